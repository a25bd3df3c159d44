//! A prompt that is ended from outside: the terminal is as it was found, and the exit code tells it.

use std::prelude::v1::*;
use std::process;

use crate::cli::exit::{Exit, Failure};

/// From here on the signals that ask a process to end do so with the terminal given back. A robot that moves
/// stops, because the connection ends.
pub(super) fn end_in_good_order() -> Result<(), Failure> {
    let terminal = Terminal::look();
    ctrlc::set_handler(move || {
        terminal.give_back();
        process::exit(Exit::Interrupted as i32);
    })
    .map_err(|error| Failure::internal(format!("cannot catch signals: {error}")))
}

#[cfg(target_os = "linux")]
use on_linux::Terminal;

#[cfg(target_os = "linux")]
mod on_linux {
    use std::io::stdin;

    use rustix::process::getpgrp;
    use rustix::termios::{OptionalActions, Termios, tcgetattr, tcgetpgrp, tcsetattr};

    /// How the terminal was found.
    pub(super) struct Terminal(Option<Termios>);

    impl Terminal {
        pub(super) fn look() -> Self {
            Self(tcgetattr(stdin()).ok())
        }

        /// Puts it back, unless somebody else has it now: that would stop a process in the background.
        pub(super) fn give_back(&self) {
            let is_of_others = tcgetpgrp(stdin()).is_ok_and(|group| group != getpgrp());
            if let (Some(found), false) = (&self.0, is_of_others) {
                // A terminal that is gone needs nothing back.
                let _ = tcsetattr(stdin(), OptionalActions::Now, found);
            }
        }
    }
}

/// Other systems have no hand in it here.
#[cfg(not(target_os = "linux"))]
struct Terminal;

#[cfg(not(target_os = "linux"))]
impl Terminal {
    const fn look() -> Self {
        Self
    }

    const fn give_back(&self) {}
}
