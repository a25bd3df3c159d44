//! Exit codes: the only place where the kinds of trouble are folded into numbers.

use std::prelude::v1::*;
use std::process::ExitCode;

/// How the command ended. The numbers are part of the command's interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Exit {
    /// Everything asked for was done.
    Done = 0,
    /// A file cannot be read or written, or the command itself is at fault.
    Internal = 1,
    /// Bad usage, a bad program, or bytes that are no image. Nothing has moved.
    Usage = 2,
    /// The robot reported an error, stopped for safety, or refused an action.
    Robot = 3,
    /// The link failed, the inputs were lost, or the byte order could not be settled.
    Link = 4,
    /// Ended by Ctrl-C or a signal to end, after the robot was paused and cleared, or deactivated.
    Interrupted = 130,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// Why a command ended early: what to tell the person, and how to exit.
#[derive(Clone, Debug)]
pub(super) struct Failure {
    pub(super) exit: Exit,
    /// What to say on standard error; may have several lines.
    pub(super) message: String,
    /// Whether the message begins with a place in a file, which editors find only at the beginning
    /// of a line.
    pub(super) is_located: bool,
}

impl Failure {
    pub(super) fn usage(message: impl Into<String>) -> Self {
        Self { exit: Exit::Usage, message: message.into(), is_located: false }
    }

    pub(super) fn internal(message: impl Into<String>) -> Self {
        Self { exit: Exit::Internal, message: message.into(), is_located: false }
    }
}

/// Exit codes as `--help` shows them.
pub(super) const EXIT_CODES: &str = "\
Exit codes:
    0  done
    1  a file cannot be read or written, or an internal error
    2  bad usage, a bad program, or bytes that are no image; nothing has moved
    3  the robot reported an error, stopped for safety, or refused an action
    4  link trouble: the link failed, inputs were lost, or the byte order is undecidable
  130  interrupted with Ctrl-C, or by the signal TERM or HUP; the robot was stopped";
