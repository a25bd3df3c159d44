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

impl Exit {
    /// How a run of several robots ended: as the worst of theirs did. What the command could not do
    /// itself is worse than trouble on the link, that is worse than trouble of a robot, and an
    /// interrupt is the least of it.
    pub(super) fn worst(of: impl IntoIterator<Item = Self>) -> Self {
        const fn severity(exit: Exit) -> u8 {
            match exit {
                Exit::Done => 0,
                Exit::Interrupted => 1,
                Exit::Robot => 2,
                Exit::Link => 3,
                Exit::Usage => 4,
                Exit::Internal => 5,
            }
        }
        of.into_iter().max_by_key(|exit| severity(*exit)).unwrap_or(Self::Done)
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// Why a command ended early: what to tell the person, and how to exit.
#[derive(Clone, Debug, PartialEq, Eq)]
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

    pub(super) fn link(message: impl Into<String>) -> Self {
        Self { exit: Exit::Link, message: message.into(), is_located: false }
    }

    /// Several failures as one, each told once; `None` without any.
    pub(super) fn all(failures: Vec<Self>) -> Option<Self> {
        let mut told: Vec<Self> = Vec::new();
        for failure in failures {
            if !told.contains(&failure) {
                told.push(failure);
            }
        }
        if told.len() < 2 {
            return told.pop();
        }
        let exit = Exit::worst(told.iter().map(|failure| failure.exit));
        let texts: Vec<String> = told.iter().map(Self::text).collect();
        Some(Self { exit, message: texts.join("\n"), is_located: true })
    }

    /// The whole text for standard error, without a line end.
    pub(super) fn text(&self) -> String {
        let name = if self.is_located { "" } else { "fieldarm: " };
        format!("{name}{}", self.message)
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
  130  interrupted with Ctrl-C, or by the signal TERM or HUP; the robot was stopped
With --robots the worst of all robots counts: 1 before 4, 4 before 3, 3 before 130, 130 before 0.";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_of_all_robots_counts() {
        let order = [Exit::Done, Exit::Interrupted, Exit::Robot, Exit::Link, Exit::Internal];
        for (position, worse) in order.into_iter().enumerate() {
            for better in order.into_iter().take(position + 1) {
                assert_eq!(Exit::worst([better, worse, better]), worse);
                assert_eq!(Exit::worst([worse, better]), worse);
            }
        }
        assert_eq!(Exit::worst([]), Exit::Done);
    }
}
