//! A terminal, which is a pseudo-terminal, and a process that believes a person to sit there.

#![allow(dead_code, reason = "each test file uses a part of it")]

use std::fs::File;
use std::io::{Read, Write};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use rustix::fs::{Mode, OFlags};
use rustix::process::Pid;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{LocalModes, Winsize, tcgetattr, tcsetwinsize};

/// Far longer than anything here takes.
const PATIENCE: Duration = Duration::from_secs(60);
/// Wide enough for every line.
const SIZE: Winsize = Winsize { ws_row: 30, ws_col: 200, ws_xpixel: 0, ws_ypixel: 0 };

pub(crate) struct Terminal {
    /// The person's side.
    master: File,
    /// The process's side, kept open so that the terminal outlives the process.
    slave: File,
    child: Child,
    shown: Arc<Mutex<Vec<u8>>>,
    searched: usize,
}

impl Terminal {
    /// Starts a command with all three of its streams here.
    pub(crate) fn start(command: &mut Command) -> Self {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("there are terminals");
        grantpt(&master).and_then(|()| unlockpt(&master)).expect("it is ours");
        let name = ptsname(&master, Vec::new()).expect("it has a name");
        let slave = rustix::fs::open(&name, OFlags::RDWR | OFlags::NOCTTY, Mode::empty());
        let slave = slave.expect("it can be opened");
        tcsetwinsize(&slave, SIZE).expect("it is a terminal");
        let end = || Stdio::from(slave.try_clone().expect("there are descriptors"));
        command.env("TERM", "xterm").stdin(end()).stdout(end()).stderr(end());
        let child = command.spawn().expect("it starts");
        let shown = Arc::new(Mutex::new(Vec::new()));
        let master = File::from(master);
        let mut reader = master.try_clone().expect("there are descriptors");
        let log = Arc::clone(&shown);
        thread::spawn(move || {
            let mut room = [0; 4096];
            // An error is the end of the other side.
            while let Ok(count @ 1..) = reader.read(&mut room) {
                let mut log = log.lock().unwrap_or_else(PoisonError::into_inner);
                log.extend_from_slice(&room[..count]);
            }
        });
        Self { master, slave: File::from(slave), child, shown, searched: 0 }
    }

    /// All that was shown so far.
    pub(crate) fn shown(&self) -> String {
        let shown = self.shown.lock().unwrap_or_else(PoisonError::into_inner);
        String::from_utf8_lossy(&shown).into_owned()
    }

    /// Waits until the screen has shown `words` after what was waited for before.
    #[track_caller]
    pub(crate) fn expect(&mut self, words: &str) {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let shown = self.shown();
            let new = shown.get(self.searched..).unwrap_or_default();
            if let Some(place) = new.find(words) {
                self.searched += place + words.len();
                return;
            }
            let last = new.char_indices().rev().nth(2_000).map_or(0, |(at, _)| at);
            assert!(Instant::now() < deadline, "no {words:?}:\n{:?}", &new[last..]);
            thread::sleep(Duration::from_millis(5));
        }
    }

    pub(crate) fn press(&mut self, keys: &str) {
        self.master.write_all(keys.as_bytes()).expect("somebody reads");
    }

    /// Types a line.
    pub(crate) fn enter(&mut self, line: &str) {
        self.press(&format!("{line}\r"));
    }

    /// The process that was started.
    pub(crate) fn pid(&self) -> Pid {
        Pid::from_raw(i32::try_from(self.child.id()).expect("small")).expect("not zero")
    }

    /// Whether a line is waited for and typed keys are shown: how a shell leaves a terminal.
    pub(crate) fn is_plain(&self) -> bool {
        let modes = tcgetattr(&self.slave).expect("it is there").local_modes;
        modes.contains(LocalModes::ICANON | LocalModes::ECHO)
    }

    /// Waits until the terminal is what `what` says.
    #[track_caller]
    pub(crate) fn until(&self, what: &str, is_so: impl Fn(&Self) -> bool) {
        let deadline = Instant::now() + PATIENCE;
        while !is_so(self) {
            assert!(Instant::now() < deadline, "not {what}:\n{}", self.shown());
            thread::sleep(Duration::from_millis(5));
        }
    }

    /// Waits for the end of the process, which must be with this exit code.
    #[track_caller]
    pub(crate) fn expect_exit(&mut self, code: i32) {
        let deadline = Instant::now() + PATIENCE;
        let status = loop {
            if let Some(status) = self.child.try_wait().expect("it is our child") {
                break status;
            }
            assert!(Instant::now() < deadline, "still there:\n{}", self.shown());
            thread::sleep(Duration::from_millis(5));
        };
        assert_eq!(status.code(), Some(code), "{:?}", self.shown());
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
