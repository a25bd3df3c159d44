//! What the exchanges of a segment were like.

use hdrhistogram::Histogram;

use crate::time::Duration;

/// Longest gap that is told apart: 10 s.
const LONGEST_NS: u64 = 10_000_000_000;

/// Figures of a running segment, over all its targets. Those of one target are in the counters of its
/// [status](super::EnipSegment::status).
#[derive(Clone, Debug)]
pub struct EnipStatistics {
    /// Exchanges since the start.
    pub exchanges: u64,
    /// Exchanges that were called for more than half a cycle late.
    pub late: u64,
    /// Exchanges that left arrivals to the next one: more came than a segment takes in at once.
    pub flooded: u64,
    /// Datagrams that the system did not send; they count as lost on the way.
    pub unsent: u64,
    /// Multicast groups that could not be joined; their targets time out.
    pub unjoined: u64,
    /// Time that an exchange took, in ns.
    pub exchange_ns: Histogram<u64>,
    /// Time between two frames to the same target, in ns, in steps of exchanges.
    pub o2t_gap_ns: Histogram<u64>,
    /// Time between two frames from the same target, in ns, in steps of exchanges: when they were taken in.
    /// Frames that were taken in together share the time since those before.
    pub t2o_gap_ns: Histogram<u64>,
}

impl EnipStatistics {
    pub(super) fn new() -> Self {
        // The bounds are constants in range; without them the histogram would grow by itself.
        let histogram = || {
            Histogram::new_with_bounds(1, LONGEST_NS, 3)
                .or_else(|_| Histogram::new(3))
                .unwrap_or_else(|_| unreachable!("three digits are in range"))
        };
        Self {
            exchanges: 0,
            late: 0,
            flooded: 0,
            unsent: 0,
            unjoined: 0,
            exchange_ns: histogram(),
            o2t_gap_ns: histogram(),
            t2o_gap_ns: histogram(),
        }
    }
}

/// `frames` frames came in `time`: as many gaps of equal length.
pub(super) fn record(histogram: &mut Histogram<u64>, time: Duration, frames: u64) {
    if frames == 0 {
        return;
    }
    let ns = u64::try_from(time.as_nanos()).unwrap_or(LONGEST_NS) / frames;
    histogram.saturating_record_n(ns.clamp(1, LONGEST_NS), frames);
}
