//! The robot's user log: what LogTrace writes into it, and with LogUserCommands what passes on the
//! control port and which motion commands begin. Source: PM L1907-1917, L3322-3365.
//!
//! A real robot gives its log to the MecaPortal; this one to whoever asks for
//! [`VirtualRobot::next_log_line`]. A command with a dash is not logged, and neither are its answers
//! (PM L439). Copies of the monitoring port on the control port are no responses, and left out.
//!
//! Chosen: the log survives a boot and LogUserCommands does not; while nobody asks for its lines, the
//! oldest are dropped; long ones are cut.

use alloc::collections::VecDeque;
use alloc::string::String;
use core::fmt;

use super::format::command_line;
use crate::sim::meca500::robot::VirtualRobot;
use crate::wire::meca500::command::MotionCommand;

/// Lines kept for somebody who does not ask.
const MOST_LINES: usize = 4_096;
/// Characters of a line.
const MOST_CHARACTERS: usize = 256;

/// What a line of the log is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LogKind {
    /// Somebody's own words: LogTrace.
    Trace,
    /// A command was received.
    Received,
    /// A response was sent.
    Sent,
    /// A command of the motion queue begins.
    Begins,
}

/// A line of the robot's user log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogLine {
    /// Date and time by the robot's clock (SetRtc), in seconds since 1970. Source: PM L3909.
    pub unix_s: u64,
    /// What it is about.
    pub kind: LogKind,
    /// The words, the command or the message, cut after 256 characters.
    pub text: String,
}

impl fmt::Display for LogLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.kind {
            LogKind::Trace => "trace",
            LogKind::Received => "received",
            LogKind::Sent => "sent",
            LogKind::Begins => "begins",
        };
        write!(f, "{what}: {}", self.text)
    }
}

/// The log and what goes into it.
#[derive(Clone, Debug, Default)]
pub(super) struct Log {
    lines: VecDeque<LogLine>,
    /// LogUserCommands: commands and responses.
    logs_commands: bool,
    /// LogUserCommands: the beginning of queued commands.
    logs_beginnings: bool,
    /// Whether the command in progress has a dash.
    is_silent: bool,
}

impl Log {
    /// The log after a boot.
    pub(super) fn after_boot(self) -> Self {
        Self { lines: self.lines, ..Self::default() }
    }

    /// Whether the command in progress, and what it is answered with, is logged.
    pub(super) const fn logs_commands(&self) -> bool {
        self.logs_commands && !self.is_silent
    }
}

/// Whether a line has the dash of a command that is not to be logged.
fn is_silent(line: &str) -> bool {
    line.trim_start().starts_with('-')
}

impl VirtualRobot {
    /// The next line of the robot's log, oldest first; it is forgotten afterwards.
    pub fn next_log_line(&mut self) -> Option<LogLine> {
        self.text.log.lines.pop_front()
    }

    /// Adds a line to the log.
    pub(super) fn write_log(&mut self, kind: LogKind, text: &str) {
        let unix_s = self.rtc_s();
        let lines = &mut self.text.log.lines;
        if lines.len() >= MOST_LINES {
            lines.pop_front();
        }
        let text = text.chars().take(MOST_CHARACTERS).collect();
        lines.push_back(LogLine { unix_s, kind, text });
    }

    /// LogUserCommands.
    pub(super) fn log_user_commands(&mut self, commands: bool, beginnings: bool) {
        self.text.log.logs_commands = commands;
        self.text.log.logs_beginnings = beginnings;
        self.queue.record_begun(beginnings);
    }

    /// A command has come.
    pub(super) fn log_received(&mut self, line: &str) {
        if self.text.log.logs_commands && !is_silent(line) {
            self.write_log(LogKind::Received, line.trim());
        }
    }

    /// A command is about to be executed: its answers are logged or not.
    pub(super) fn log_answers_of(&mut self, line: &str) {
        self.text.log.is_silent = is_silent(line);
    }

    /// The command in progress has been executed.
    pub(super) const fn log_answers_again(&mut self) {
        self.text.log.is_silent = false;
    }

    /// Commands of the queue whose turn has come since the last call.
    pub(super) fn log_beginnings(&mut self) {
        while let Some(command) = self.queue.next_begun() {
            if self.text.log.logs_beginnings {
                self.log_beginning(&command);
            }
        }
    }

    fn log_beginning(&mut self, command: &MotionCommand) {
        let line = command_line(command);
        self.write_log(LogKind::Begins, &line);
    }
}
