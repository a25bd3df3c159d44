//! What the exchanges of a segment were like.

use hdrhistogram::Histogram;

use super::group::ClockReading;
use crate::time::{Duration, Instant};

/// Longest latency that is told apart: 1 s.
const LONGEST_NS: u64 = 1_000_000_000;

/// Figures of a running segment.
#[derive(Clone, Debug)]
pub struct SegmentStatistics {
    /// Exchanges since all robots were in OP.
    pub exchanges: u64,
    /// Exchanges in which at least one frame did not come back in time.
    pub lost: u64,
    /// Robots and exchanges in which the working counter did not add up.
    pub wrong_counter: u64,
    /// Working counter of the last exchange whose frames all came back.
    pub working_counter: Option<WorkingCounter>,
    /// Exchanges that were called for more than half a cycle late.
    pub late: u64,
    /// Time from sending the first frame to having all answers, in ns; lost ones are not in it.
    pub exchange_ns: Histogram<u64>,
    /// The distributed clock against ours; `None` without one.
    pub clock: Option<ClockFigures>,
}

/// How many read and write accesses the robots took part in, over all frames of an exchange.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WorkingCounter {
    /// 3 for each robot.
    pub expected: u16,
    /// What came back.
    pub found: u16,
}

/// The distributed clock of a segment against the clock that paces the exchanges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockFigures {
    /// How much faster the segment's clock runs, in parts per billion.
    pub drift_ppb: f64,
    /// Where the last frame met the reference, against where it should: positive is late, in ns.
    pub phase_error_ns: i64,
    /// Largest distance of a frame from where it should be since the phase was first met, in ns.
    pub worst_phase_error_ns: i64,
}

impl SegmentStatistics {
    pub(super) fn new() -> Self {
        // The bounds are constants in range; without them the histogram would grow by itself.
        let exchange_ns = Histogram::new_with_bounds(1, LONGEST_NS, 3)
            .or_else(|_| Histogram::new(3))
            .unwrap_or_else(|_| unreachable!("three digits are in range"));
        Self {
            exchanges: 0,
            lost: 0,
            wrong_counter: 0,
            working_counter: None,
            late: 0,
            exchange_ns,
            clock: None,
        }
    }

    pub(super) fn record_exchange(&mut self, took_ns: u64) {
        self.exchange_ns.saturating_record(took_ns.clamp(1, LONGEST_NS));
    }
}

/// Follows the reference clock from exchange to exchange.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClockTrack {
    cycle_ns: i64,
    /// Where in the SYNC0 cycle a frame should meet the reference.
    wanted_ns: i64,
    first: Option<(Instant, u64)>,
    /// Whether the phase was met once.
    is_settled: bool,
}

/// More than this is no drift of a quartz, as a share of the time.
const LARGEST_DRIFT: f64 = 0.01;
/// What readings may differ by besides, in ns.
const JUMP_NS: f64 = 5e6;
/// A phase within this share of a cycle counts as met.
const SETTLED_SHARE: i64 = 200;
/// How much of a phase error one cycle takes back.
const PULL_SHARE: i64 = 8;
/// Most that a cycle is moved, as a share of it.
const MOST_SHARE: i64 = 50;

impl ClockTrack {
    /// Frames are to leave `shift` before SYNC0.
    pub(super) fn new(cycle: Duration, shift: Duration) -> Self {
        let ns = |duration: Duration| i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX);
        let cycle_ns = ns(cycle).max(1);
        let wanted_ns = (cycle_ns - ns(shift)).rem_euclid(cycle_ns);
        Self { cycle_ns, wanted_ns, first: None, is_settled: false }
    }

    /// Takes a reading of the reference at our time `now`; returns by how much the next cycle should
    /// begin later, in ns.
    pub(super) fn take(
        &mut self,
        now: Instant,
        reading: ClockReading,
        figures: &mut Option<ClockFigures>,
    ) -> i64 {
        // A reference that does not answer leaves the zero that was sent.
        if reading.system_time_ns == 0 {
            return 0;
        }
        let (began, began_ns) = *self.first.get_or_insert((now, reading.system_time_ns));
        let ours = now.saturating_duration_since(began).as_nanos() as f64;
        let theirs = reading.system_time_ns.wrapping_sub(began_ns) as f64;
        if (theirs - ours).abs() > LARGEST_DRIFT * ours + JUMP_NS {
            // The reference restarted, or another one took its place.
            self.first = None;
            return 0;
        }
        let drift_ppb = if ours > 0.0 { (theirs - ours) / ours * 1e9 } else { 0.0 };
        let phase = i64::try_from(reading.since_sync0.as_nanos()).unwrap_or(0);
        let half = self.cycle_ns / 2;
        let error = (phase - self.wanted_ns + half).rem_euclid(self.cycle_ns) - half;
        self.is_settled |= error.abs() < self.cycle_ns / SETTLED_SHARE;
        let worst = figures.map_or(0, |figures| figures.worst_phase_error_ns);
        *figures = Some(ClockFigures {
            drift_ppb,
            phase_error_ns: error,
            worst_phase_error_ns: if self.is_settled { worst.max(error.abs()) } else { 0 },
        });
        let most = (self.cycle_ns / MOST_SHARE).max(1);
        (-error / PULL_SHARE).clamp(-most, most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reference_that_is_gone_or_restarted_does_not_pull() {
        let mut track = ClockTrack::new(Duration::from_millis(1), Duration::ZERO);
        let mut figures = None;
        let mut take = |now_ms: u64, system_time_ns: u64| {
            let since_sync0 = Duration::from_nanos(system_time_ns % 1_000_000);
            let reading = ClockReading { system_time_ns, since_sync0 };
            track.take(Instant::from_millis(now_ms), reading, &mut figures)
        };
        assert!(take(1, 500_400_000) != 0);
        assert_eq!(take(2, 0), 0, "no answer");
        assert!(take(3, 502_400_000) != 0);
        assert_eq!(take(4, 400_000), 0, "it began anew");
        assert!(take(5, 1_400_000) != 0);
        let drift = figures.unwrap().drift_ppb;
        assert!(drift.abs() < 1.0, "{drift}");
    }

    #[test]
    fn cycles_are_drawn_to_the_phase_of_a_clock_that_drifts() {
        // The segment's clock runs 100 ppm fast and begins anywhere in the cycle.
        for start_ns in [0_u64, 250_000, 500_000, 750_000, 999_000] {
            let cycle = Duration::from_millis(1);
            let mut track = ClockTrack::new(cycle, Duration::from_micros(300));
            let mut figures = None;
            let mut now_ns = 0_i64;
            for _ in 0..2_000 {
                let system_time_ns = start_ns + now_ns as u64 + now_ns as u64 / 10_000;
                let reading = ClockReading {
                    system_time_ns,
                    since_sync0: Duration::from_nanos(system_time_ns % 1_000_000),
                };
                let now = Instant::from_nanos(now_ns as u64);
                now_ns += 1_000_000 + track.take(now, reading, &mut figures);
            }
            let figures = figures.unwrap();
            assert!(figures.phase_error_ns.abs() < 2_000, "from {start_ns}: {figures:?}");
            assert!((figures.drift_ppb - 100_000.0).abs() < 10.0, "from {start_ns}: {figures:?}");
        }
    }
}
