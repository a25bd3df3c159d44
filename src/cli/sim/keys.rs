//! Keys of a terminal, one by one, without holding up who serves.
//!
//! Read [`Keys::open`] first. A thread of its own reads; what keys mean is said in
//! [`keyboard`](super::keyboard). Meanwhile the terminal neither waits for the end of a line nor repeats
//! what is typed; Ctrl-C stays the signal it is.
//!
//! Invariants: a process in the background neither reads nor changes the terminal, for that would stop it;
//! the terminal is as it was found whenever the process ends or is suspended, unless it is killed.

use std::io::{IsTerminal, stderr, stdin};
use std::prelude::v1::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::{Errno, read};
use rustix::process::{Signal, getpgrp, kill_current_process_group};
use rustix::termios::{
    LocalModes, OptionalActions, SpecialCodeIndex, Termios, tcgetattr, tcgetpgrp, tcsetattr,
};

use crate::time::Duration;

/// How long the thread waits for a key before it looks whether it is still wanted.
const WAIT: Duration = Duration::from_millis(50);
/// Switches a special character of the terminal off (`_POSIX_VDISABLE` of Linux).
const NONE: u8 = 0;
/// What the terminal would make signals of; they arrive as keys, so that it is given back before.
const CTRL_Z: u8 = 0x1A;
const CTRL_BACKSLASH: u8 = 0x1C;
/// Begins what arrow keys and the like send.
const ESCAPE: u8 = 0x1B;

/// Whose settings the terminal has.
enum Modes {
    /// Those it was found with.
    Found,
    /// Ours; those it was found with are kept.
    Ours(Termios),
    /// Those it was found with, to the end of the process.
    GivenBack,
}

/// A process has one controlling terminal.
static MODES: Mutex<Modes> = Mutex::new(Modes::Found);

fn modes() -> MutexGuard<'static, Modes> {
    MODES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes the terminal hand over each key. It is looked at anew each time, for a shell that brings the
/// process to the foreground again may have changed it.
fn take_over() -> Result<(), Errno> {
    let found = tcgetattr(stdin())?;
    let mut modes = modes();
    let by_line = LocalModes::ICANON | LocalModes::ECHO;
    if matches!(*modes, Modes::GivenBack) || !found.local_modes.intersects(by_line) {
        return Ok(());
    }
    let mut ours = found.clone();
    ours.local_modes.remove(by_line);
    ours.special_codes[SpecialCodeIndex::VMIN] = 1;
    ours.special_codes[SpecialCodeIndex::VTIME] = 0;
    ours.special_codes[SpecialCodeIndex::VSUSP] = NONE;
    ours.special_codes[SpecialCodeIndex::VQUIT] = NONE;
    tcsetattr(stdin(), OptionalActions::Now, &ours)?;
    if matches!(*modes, Modes::Found) {
        *modes = Modes::Ours(found);
    }
    Ok(())
}

/// Gives the terminal back as it was found; `afterwards` is what holds from then on.
fn give_back(afterwards: Modes) {
    let mut modes = modes();
    if let Modes::Ours(found) = core::mem::replace(&mut *modes, afterwards)
        && is_in_foreground() == Ok(true)
    {
        // A terminal that is gone needs nothing back.
        let _ = tcsetattr(stdin(), OptionalActions::Now, &found);
    }
}

/// Gives the terminal back for good: for who ends the process without more ado.
pub(in crate::cli) fn give_terminal_back() {
    give_back(Modes::GivenBack);
}

fn is_in_foreground() -> Result<bool, Errno> {
    tcgetpgrp(stdin()).map(|group| group == getpgrp())
}

/// Keys that were pressed. The terminal is given back when it is dropped.
pub(super) struct Keys {
    pressed: Receiver<u8>,
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Keys {
    /// Begins to read; `None` unless a person sits there: standard input and standard error are
    /// terminals.
    pub(super) fn open() -> Option<Self> {
        if !stdin().is_terminal() || !stderr().is_terminal() {
            return None;
        }
        let (sender, pressed) = channel();
        let is_over = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&is_over);
        let thread = thread::spawn(move || {
            // A terminal that is gone has no more keys.
            let _ = listen(&sender, &flag);
        });
        Some(Self { pressed, is_over, thread: Some(thread) })
    }

    /// The next key, if one was pressed.
    pub(super) fn next(&self) -> Option<u8> {
        self.pressed.try_recv().ok()
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        give_terminal_back();
    }
}

/// What was typed without what arrow keys and the like send, which is full of letters nobody typed: ESC,
/// `[` and all up to a final byte, ESC `O` and a byte, or ESC and a key that was pressed with Alt.
fn single_keys(typed: &[u8]) -> Vec<u8> {
    let (mut keys, mut rest) = (Vec::new(), typed.iter().copied());
    while let Some(key) = rest.next() {
        if key != ESCAPE {
            keys.push(key);
            continue;
        }
        match rest.next() {
            Some(b'[') => drop(rest.find(|byte| (0x40..=0x7E).contains(byte))),
            Some(b'O') => drop(rest.next()),
            Some(_) | None => {}
        }
    }
    keys
}

/// Hands over keys until it is over or the terminal is gone.
fn listen(sender: &Sender<u8>, is_over: &AtomicBool) -> Result<(), Errno> {
    let limit = Timespec::try_from(WAIT).map_err(|_| Errno::INVAL)?;
    while !is_over.load(Ordering::Relaxed) {
        if !is_in_foreground()? {
            thread::sleep(WAIT);
            continue;
        }
        take_over()?;
        let terminal = stdin();
        let mut watched = [PollFd::new(&terminal, PollFlags::IN)];
        match poll(&mut watched, Some(&limit)) {
            Ok(0) | Err(Errno::INTR) => continue,
            Ok(_) => {}
            Err(error) => return Err(error),
        }
        // Reading in the background would stop the process.
        if !is_in_foreground()? {
            continue;
        }
        let mut room = [0; 64];
        let count = match read(&terminal, &mut room) {
            Ok(0) => return Ok(()),
            Ok(count) => count,
            Err(Errno::INTR | Errno::AGAIN) => continue,
            Err(error) => return Err(error),
        };
        for key in single_keys(room.get(..count).unwrap_or_default()) {
            match key {
                CTRL_Z => {
                    give_back(Modes::Found);
                    kill_current_process_group(Signal::TSTP)?;
                }
                CTRL_BACKSLASH => {
                    give_terminal_back();
                    kill_current_process_group(Signal::QUIT)?;
                }
                // Nobody listens any more: it is over.
                key => drop(sender.send(key)),
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrow_keys_are_no_letters() {
        for (typed, keys) in [
            (&b"e\x1b[Aq"[..], &b"eq"[..]),
            (b"\x1b[1;5Cp\x1bOPr\x1bec", b"prc"),
            (b"\x1b", b""),
            (b"\x1b[", b""),
            (b"\x1b[12", b""),
            (b"bq", b"bq"),
        ] {
            assert_eq!(single_keys(typed), keys, "{typed:?}");
        }
    }
}
