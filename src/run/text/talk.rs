//! Lines that wait to be sent, and the marks by which their arrival is known.
//!
//! A mark is a SyncCmdQueue with a number: its answer says that the robot has read every line before it.
//! Source: PM L4126.

use std::collections::VecDeque;
use std::format;
use std::string::String;

use super::allowance::Allowance;
use crate::run::statistics::{Distribution, Quantiles};
use crate::time::{Duration, Instant};
use crate::wire::meca500::text::RobotNumber;

/// A mark without its answer.
#[derive(Clone, Copy, Debug)]
struct Mark {
    number: u32,
    /// Steps before this one are accepted when it is answered, as far as they were not refused.
    upto: usize,
    at: Instant,
}

/// What passed between both ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TalkStatistics {
    /// Lines sent.
    pub sent: u64,
    /// Messages heard on the control port.
    pub heard: u64,
    /// From a mark to its answer, in nanoseconds: how long the robot takes to read and to answer.
    pub answer_ns: Quantiles,
}

/// Both directions of the control connection.
#[derive(Clone, Debug)]
pub(super) struct Talk {
    lines: VecDeque<String>,
    marks: VecDeque<Mark>,
    last_mark: u32,
    pub(super) allowance: Allowance,
    answer_ns: Distribution,
    sent: u64,
    heard: u64,
    pub(super) heard_at: Instant,
    watchdog: Option<Duration>,
    fed_at: Option<Instant>,
}

impl Talk {
    pub(super) fn new(watchdog: Option<Duration>) -> Self {
        Self {
            lines: VecDeque::new(),
            marks: VecDeque::new(),
            last_mark: 0,
            allowance: Allowance::new(),
            answer_ns: Distribution::of_durations(),
            sent: 0,
            heard: 0,
            heard_at: Instant::ZERO,
            watchdog,
            fed_at: None,
        }
    }

    /// A new connection: what waited was for the old one.
    pub(super) fn restart(&mut self, now: Instant) {
        self.lines.clear();
        self.marks.clear();
        self.heard_at = now;
        self.fed_at = None;
    }

    pub(super) fn statistics(&self) -> TalkStatistics {
        let answer_ns = self.answer_ns.quantiles();
        TalkStatistics { sent: self.sent, heard: self.heard, answer_ns }
    }

    pub(super) fn say(&mut self, line: impl Into<String>) {
        self.lines.push_back(line.into());
        self.allowance.spend();
    }

    /// Forgets what has not been sent.
    pub(super) fn hush(&mut self) {
        self.lines.clear();
        // Marks that never leave would never be answered.
        self.marks.clear();
    }

    /// Sends a mark behind everything so far.
    pub(super) fn mark(&mut self, upto: usize, now: Instant) -> u32 {
        self.last_mark = self.last_mark.wrapping_add(1);
        let number = self.last_mark;
        self.say(format!("SyncCmdQueue({number})"));
        self.marks.push_back(Mark { number, upto, at: now });
        number
    }

    /// The robot's state, and a mark behind it.
    pub(super) fn ask_for_status(&mut self, upto: usize, now: Instant) -> u32 {
        self.say("GetStatusRobot");
        self.mark(upto, now)
    }

    /// A mark was answered; how many steps are accepted with it.
    pub(super) fn answered(&mut self, number: i64, now: Instant) -> Option<usize> {
        let place = self.marks.iter().position(|mark| i64::from(mark.number) == number)?;
        let mark = self.marks.drain(..=place).next_back()?;
        self.answer_ns.record_duration(now - mark.at);
        Some(mark.upto)
    }

    /// Whether this mark is without its answer.
    pub(super) fn awaits(&self, number: u32) -> bool {
        self.marks.iter().any(|mark| mark.number == number)
    }

    /// Whether any mark is without its answer.
    pub(super) fn is_awaiting(&self) -> bool {
        !self.marks.is_empty()
    }

    /// Whether the oldest mark waits for longer than `limit`.
    pub(super) fn is_overdue(&self, now: Instant, limit: Duration) -> bool {
        self.marks.front().is_some_and(|mark| now - mark.at > limit)
    }

    pub(super) fn has_heard(&mut self, now: Instant) {
        self.heard += 1;
        self.heard_at = now;
    }

    /// The next line to be sent.
    pub(super) fn next_line(&self) -> Option<&str> {
        self.lines.front().map(String::as_str)
    }

    /// It is sent.
    pub(super) fn sent_line(&mut self) {
        if self.lines.pop_front().is_some() {
            self.sent += 1;
        }
    }

    pub(super) fn has_lines(&self) -> bool {
        !self.lines.is_empty()
    }

    /// Feeds the watchdog when it is time to; before everything else that waits.
    pub(super) fn feed(&mut self, now: Instant) {
        let Some(period) = self.watchdog else { return };
        if self.fed_at.is_none_or(|at| now - at >= period / 3) {
            let seconds = RobotNumber(period.as_secs_f64());
            self.lines.push_front(format!("-ConnectionWatchdog({seconds})"));
            self.fed_at = Some(now);
        }
    }

    /// When the watchdog wants to be fed next.
    pub(super) fn feed_due(&self) -> Option<Instant> {
        Some(self.fed_at? + self.watchdog? / 3)
    }

    /// Cancels the watchdog, if it was fed.
    pub(super) fn stop_feeding(&mut self) {
        if self.watchdog.take().is_some() && self.fed_at.is_some() {
            self.say("ConnectionWatchdog(0)");
        }
    }
}
