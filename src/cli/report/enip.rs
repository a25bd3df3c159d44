//! The EtherNet/IP connection of a robot, for the report.

use std::prelude::v1::*;

use hdrhistogram::Histogram;
use serde::Serialize;

use super::ReportedQuantiles;
use crate::bus::enip::scanner::{ConfigPath, TargetCounters, TargetStatus};
use crate::cli::enip::connect::Opened;
use crate::link::enip::EnipStatistics;
use crate::time::Duration;

/// The connection of one robot. Intervals are in microseconds.
#[derive(Clone, Debug, Serialize)]
pub struct ReportedEnip {
    /// Where the robot is reached, with the TCP port.
    pub address: String,
    /// Name of the product, as the robot's identity object has it; `null` when it did not tell.
    pub product: Option<String>,
    /// Revision in the identity object, as `11.3`: that of the firmware.
    pub revision: Option<String>,
    /// Serial number in the identity object.
    pub serial: Option<u32>,
    /// Interval that was asked for, both ways.
    pub rpi_us: f64,
    /// Interval that the robot granted for frames to it.
    pub o2t_api_us: f64,
    /// Interval that the robot granted for frames from it.
    pub t2o_api_us: f64,
    /// Configuration assembly in the path that was accepted; `null` without one.
    pub config_assembly: Option<u32>,
    /// Group that the inputs came to; `null` when they came to us alone.
    pub multicast: Option<String>,
    /// What was counted on this connection.
    pub counters: ReportedCounters,
    /// Between two frames to the same robot, of all robots of the run.
    pub o2t_gap_us: ReportedQuantiles,
    /// Between two frames from the same robot when they were taken in, of all robots of the run.
    pub t2o_gap_us: ReportedQuantiles,
    /// What an exchange with all robots of the run took.
    pub exchange_us: ReportedQuantiles,
    /// Exchanges that began more than half a cycle late.
    pub late: u64,
    /// Frames that the system did not send.
    pub unsent: u64,
}

/// Counted since the start on one connection, over all times it was opened.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ReportedCounters {
    /// Frames sent.
    pub produced: u64,
    /// Frames received that were in order.
    pub consumed: u64,
    /// Frames that came twice or behind a later one.
    pub out_of_order: u64,
    /// Sequence numbers that never came.
    pub missed: u64,
    /// Frames without new data.
    pub repeated: u64,
    /// Times that a frame was due and did not leave.
    pub overruns: u64,
    /// Times that the connection was opened.
    pub opened: u64,
    /// Times that no frame came for too long.
    pub timed_out: u64,
}

impl From<TargetCounters> for ReportedCounters {
    fn from(counters: TargetCounters) -> Self {
        let TargetCounters {
            produced,
            consumed,
            out_of_order,
            missed,
            repeated,
            overruns,
            opened,
            timed_out,
        } = counters;
        Self { produced, consumed, out_of_order, missed, repeated, overruns, opened, timed_out }
    }
}

impl ReportedEnip {
    pub(in crate::cli) fn new(
        asked: Duration,
        opened: &Opened,
        status: &TargetStatus,
        statistics: &EnipStatistics,
    ) -> Self {
        let us = |duration: Duration| duration.as_nanos() as f64 * 1e-3;
        let identity = status.identity.as_ref();
        Self {
            address: status.address.to_string(),
            product: identity.map(|identity| identity.name.to_string()),
            revision: identity.map(|identity| format!("{}.{}", identity.major, identity.minor)),
            serial: identity.map(|identity| identity.serial),
            rpi_us: us(asked),
            o2t_api_us: us(opened.o2t_api),
            t2o_api_us: us(opened.t2o_api),
            config_assembly: match opened.config {
                ConfigPath::Named(number) => Some(number),
                ConfigPath::None => None,
            },
            multicast: opened.multicast.map(|group| group.to_string()),
            counters: status.counters.into(),
            o2t_gap_us: ReportedQuantiles::of_ns(&statistics.o2t_gap_ns),
            t2o_gap_us: ReportedQuantiles::of_ns(&statistics.t2o_gap_ns),
            exchange_us: ReportedQuantiles::of_ns(&statistics.exchange_ns),
            late: statistics.late,
            unsent: statistics.unsent,
        }
    }
}

impl ReportedQuantiles {
    /// Of a histogram of nanoseconds, in microseconds; zeros of an empty one.
    pub(in crate::cli) fn of_ns(histogram: &Histogram<u64>) -> Self {
        let us = |ns: u64| if histogram.is_empty() { 0.0 } else { ns as f64 * 1e-3 };
        Self {
            count: histogram.len(),
            min: us(histogram.min()),
            p50: us(histogram.value_at_quantile(0.5)),
            p99: us(histogram.value_at_quantile(0.99)),
            max: us(histogram.max()),
        }
    }
}
