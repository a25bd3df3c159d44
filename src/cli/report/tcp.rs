//! What a report tells of the robot's text interface.

use std::prelude::v1::*;

use serde::Serialize;

use super::{ReportedQuantiles, quantiles};
use crate::run::text::TalkStatistics;

/// The text interface of one robot.
#[derive(Clone, Debug, Serialize)]
pub struct ReportedTcp {
    /// Address and port of the control connection; `null` for a robot in this process.
    pub control: Option<String>,
    /// Address and port of the monitoring connection; `null` when positions came over the control port.
    pub monitor: Option<String>,
    /// Interval of the positions that was set for the run, in ms; `null` when it was left as it was.
    pub interval_ms: Option<f64>,
    /// Connection watchdog that was set for the run, in ms; `null` without one.
    pub watchdog_ms: Option<f64>,
    /// Lines sent: commands, checkpoints, questions.
    pub lines_sent: u64,
    /// Messages heard on the control port.
    pub messages_heard: u64,
    /// From a SyncCmdQueue to its answer, in microseconds: how soon the robot has read what was sent.
    pub answer_us: ReportedQuantiles,
}

impl ReportedTcp {
    pub(in crate::cli) fn new(statistics: TalkStatistics) -> Self {
        Self {
            control: None,
            monitor: None,
            interval_ms: None,
            watchdog_ms: None,
            lines_sent: statistics.sent,
            messages_heard: statistics.heard,
            answer_us: quantiles(statistics.answer_ns, 1e-3),
        }
    }
}
