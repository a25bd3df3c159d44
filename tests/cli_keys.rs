//! The keys and the status line of `fieldarm sim` on a terminal, which is a pseudo-terminal here.
//!
//! The command `setsid` (util-linux) makes it the controlling terminal; without it the tests say so and
//! pass, but never in CI.
#![cfg(all(target_os = "linux", feature = "cli"))]

#[path = "support/loopback.rs"]
mod loopback;
#[path = "support/namespaces.rs"]
mod namespaces;

use std::fs::File;
use std::io::{Read, Write};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use loopback::address;
use namespaces::skip;
use rustix::process::{Pid, Signal, kill_process};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{LocalModes, Winsize, tcgetattr, tcsetwinsize};

/// Far longer than anything here takes.
const LONG: Duration = Duration::from_secs(60);

/// A terminal, and a process that believes a person to sit there.
struct Terminal {
    /// The person's side.
    master: File,
    /// The process's side, kept open so that the terminal outlives the process.
    slave: File,
    child: Child,
    shown: Arc<Mutex<Vec<u8>>>,
    searched: usize,
}

impl Terminal {
    /// `fieldarm sim` at an address of its own; `None` where it cannot be had.
    fn start(arguments: &[&str]) -> Option<Self> {
        let address = address().to_string();
        let command = [env!("CARGO_BIN_EXE_fieldarm"), "sim", "--tcp", &address];
        Self::run(&[&command[..], arguments].concat())
    }

    /// A command, as a person at the terminal runs it.
    fn run(command: &[&str]) -> Option<Self> {
        if Command::new("setsid").arg("--version").output().is_err() {
            return skip("needs the command `setsid` (package util-linux)");
        }
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("there are terminals");
        grantpt(&master).and_then(|()| unlockpt(&master)).expect("it is ours");
        let name = ptsname(&master, Vec::new()).expect("it has a name");
        let slave = rustix::fs::open(
            &name,
            rustix::fs::OFlags::RDWR | rustix::fs::OFlags::NOCTTY,
            rustix::fs::Mode::empty(),
        );
        let slave = slave.expect("it can be opened");
        let size = Winsize { ws_row: 30, ws_col: 200, ws_xpixel: 0, ws_ypixel: 0 };
        tcsetwinsize(&slave, size).expect("it is a terminal");
        let end = || Stdio::from(slave.try_clone().expect("there are descriptors"));
        let child = Command::new("setsid")
            .arg("--ctty")
            .args(command)
            .env("TERM", "xterm")
            .stdin(end())
            .stdout(end())
            .stderr(end())
            .spawn()
            .expect("it starts");
        let shown = Arc::new(Mutex::new(Vec::new()));
        let master = File::from(master);
        let (mut reader, log) =
            (master.try_clone().expect("there are descriptors"), Arc::clone(&shown));
        thread::spawn(move || {
            let mut room = [0; 4096];
            while let Ok(count @ 1..) = reader.read(&mut room) {
                log.lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .extend_from_slice(&room[..count]);
            }
        });
        Some(Self { master, slave: File::from(slave), child, shown, searched: 0 })
    }

    fn shown(&self) -> String {
        let shown = self.shown.lock().unwrap_or_else(PoisonError::into_inner);
        String::from_utf8_lossy(&shown).into_owned()
    }

    /// Waits until the screen has shown `words` after what was waited for before.
    fn expect(&mut self, words: &str) {
        let deadline = Instant::now() + LONG;
        loop {
            let shown = self.shown();
            let new = shown.get(self.searched..).unwrap_or_default();
            if let Some(place) = new.find(words) {
                self.searched += place + words.len();
                return;
            }
            let last = new.char_indices().rev().nth(2_000).map_or(0, |(at, _)| at);
            assert!(Instant::now() < deadline, "no `{words}`:\n{}", &new[last..]);
            thread::sleep(Duration::from_millis(5));
        }
    }

    fn press(&mut self, keys: &str) {
        self.master.write_all(keys.as_bytes()).expect("somebody reads");
    }

    fn pid(&self) -> Pid {
        Pid::from_raw(i32::try_from(self.child.id()).expect("small")).expect("not zero")
    }

    /// Whether a line is waited for and typed keys are shown: how a shell leaves a terminal.
    fn is_plain(&self) -> bool {
        let modes = tcgetattr(&self.slave).expect("it is there").local_modes;
        modes.contains(LocalModes::ICANON | LocalModes::ECHO)
    }

    fn until(&self, what: &str, is_so: impl Fn(&Self) -> bool) {
        let deadline = Instant::now() + LONG;
        while !is_so(self) {
            assert!(Instant::now() < deadline, "not {what}:\n{}", self.shown());
            thread::sleep(Duration::from_millis(5));
        }
    }

    fn expect_exit(&mut self, code: i32) {
        let deadline = Instant::now() + LONG;
        let status = loop {
            if let Some(status) = self.child.try_wait().expect("it is our child") {
                break status;
            }
            assert!(Instant::now() < deadline, "still there:\n{}", self.shown());
            thread::sleep(Duration::from_millis(5));
        };
        assert_eq!(status.code(), Some(code), "{}", self.shown());
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn keys_act_and_the_line_below_shows_it() {
    let Some(mut terminal) = Terminal::start(&["--revision", "r4"]) else { return };
    terminal.expect("Ctrl-C ends it");
    terminal.expect("deactivated   nobody controls it");
    terminal.press("h");
    terminal.expect("e E-Stop, press and release");
    terminal.press("e");
    terminal.expect("E-Stop pressed");
    terminal.expect("deactivated   E-Stop   nobody");
    terminal.press("e");
    terminal.expect("E-Stop released");
    terminal.press("r");
    terminal.expect("Reset pressed: the motors can be powered");
    terminal.press("p");
    terminal.expect("P-Stop 2 pressed");
    terminal.press("p");
    terminal.expect("P-Stop 2 released");
    terminal.press("b3");
    terminal.expect("joint 3 is blocked");
    terminal.expect("joint 3 blocked   nobody");
    terminal.press("c");
    terminal.expect("the cable pulled");
    terminal.expect("cable pulled   nobody");
    terminal.press("c");
    terminal.expect("the cable plugged");
    terminal.press("o");
    terminal.expect("power off");
    terminal.press("o");
    terminal.expect("power on");
    // An arrow key is no letter.
    terminal.press("\u{1b}[A");
    terminal.press("q");
    terminal.expect_exit(0);
    assert!(terminal.is_plain(), "{}", terminal.shown());
}

#[test]
fn ctrl_c_is_the_signal_it_is() {
    let Some(mut terminal) = Terminal::start(&[]) else { return };
    terminal.until("taken over", |terminal| !terminal.is_plain());
    terminal.expect("Ctrl-C ends it");
    terminal.press("\u{3}");
    terminal.expect_exit(0);
    assert!(terminal.is_plain());
    assert!(terminal.shown().contains("TCP: 0 connections"), "{}", terminal.shown());
}

#[test]
fn a_shell_can_stop_it_and_bring_it_back() {
    if Command::new("bash").arg("--version").output().is_err() {
        let _: Option<()> = skip("needs the command `bash`");
        return;
    }
    let Some(mut shell) = Terminal::run(&["bash", "--noprofile", "--norc", "--noediting", "-i"])
    else {
        return;
    };
    // In the background it neither reads nor stops. The words are put together so that the shell's echo of
    // what is typed is not what is waited for.
    let program = env!("CARGO_BIN_EXE_fieldarm");
    shell.press("set -b; PS1=; s=ervi\n");
    shell.press(&format!("{program} sim --tcp {} &\n", address()));
    shell.expect("Ctrl-C ends it");
    assert!(shell.is_plain(), "it is the shell's");
    shell.press("sleep 0.3; jobs; echo s${s}ng\n");
    shell.expect("Running");
    shell.expect("serving");
    assert!(shell.is_plain(), "it is the shell's");
    // In the foreground it does.
    shell.press("fg\n");
    shell.until("taken over", |shell| !shell.is_plain());
    shell.press("p");
    shell.expect("P-Stop 2 pressed");
    // Ctrl-Z gives the terminal back.
    shell.press("\u{1a}");
    shell.expect("Stopped");
    shell.until("given back", Terminal::is_plain);
    shell.press("fg\n");
    shell.until("taken over", |shell| !shell.is_plain());
    shell.press("p");
    shell.expect("P-Stop 2 released");
    shell.press("q");
    shell.until("given back", Terminal::is_plain);
    shell.press("exit 7\n");
    shell.expect_exit(7);
}

#[test]
fn who_is_quiet_has_no_keys() {
    let Some(mut terminal) = Terminal::start(&["--quiet"]) else { return };
    thread::sleep(Duration::from_millis(300));
    assert!(terminal.is_plain());
    kill_process(terminal.pid(), Signal::TERM).expect("it is there");
    terminal.expect_exit(0);
    assert!(!terminal.shown().contains("nobody controls it"), "{}", terminal.shown());
}
