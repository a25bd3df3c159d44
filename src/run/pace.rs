//! How fast cycles follow each other: by the clock, or as quickly as they can be computed.

use crate::link::clock::{MonotonicClock, wake_exactly};
use crate::time::{Duration, Instant};

/// Decides when a cycle begins.
pub trait Pace {
    /// Time before the first cycle; called in the thread that will wait.
    fn start(&self) -> Instant;

    /// Returns when the cycle due at `deadline` begins: at the deadline, or later.
    fn wait_until(&mut self, deadline: Instant) -> Instant;
}

/// Cycles begin when the system's monotonic clock reaches their deadline.
#[derive(Clone, Copy, Debug, Default)]
pub struct RealTime {
    clock: MonotonicClock,
}

impl Pace for RealTime {
    fn start(&self) -> Instant {
        wake_exactly();
        self.clock.now()
    }

    fn wait_until(&mut self, deadline: Instant) -> Instant {
        self.clock.sleep_until(deadline)
    }
}

/// Cycles follow each other at once; each begins exactly at its deadline in simulated time.
#[derive(Clone, Copy, Debug, Default)]
pub struct SimulatedTime;

impl Pace for SimulatedTime {
    fn start(&self) -> Instant {
        Instant::ZERO
    }

    fn wait_until(&mut self, deadline: Instant) -> Instant {
        deadline
    }
}

/// Real or simulated time, chosen while running.
#[derive(Clone, Copy, Debug)]
pub enum AnyPace {
    /// By the clock.
    Real(RealTime),
    /// As quickly as possible.
    Simulated(SimulatedTime),
}

impl Pace for AnyPace {
    fn start(&self) -> Instant {
        match self {
            Self::Real(pace) => pace.start(),
            Self::Simulated(pace) => pace.start(),
        }
    }

    fn wait_until(&mut self, deadline: Instant) -> Instant {
        match self {
            Self::Real(pace) => pace.wait_until(deadline),
            Self::Simulated(pace) => pace.wait_until(deadline),
        }
    }
}

/// Deadlines on a fixed grid, and what was missed of it.
///
/// Deadlines are absolute: a late cycle does not push the following ones back. When a cycle begins
/// a whole period late or more, as many as the caller makes up for follow half a period apart; if there are
/// more, all deadlines in between are given up and counted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    deadline: Instant,
    period: Duration,
    /// Before then no cycle begins that is made up for, or that follows a late one.
    not_before: Instant,
}

/// The beginning of a cycle, seen against its deadline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Beginning {
    /// When the cycle begins.
    pub(super) at: Instant,
    /// How long after its deadline.
    pub(super) late: Duration,
    /// Deadlines that passed without a cycle.
    pub(super) missed: u64,
}

impl Grid {
    /// The first deadline is `start`; `period` is at least 1 ns.
    pub(super) fn new(start: Instant, period: Duration) -> Self {
        let period = period.max(Duration::from_nanos(1));
        Self { deadline: start, period, not_before: Instant::ZERO }
    }

    /// Moves the deadlines still to come by `ns`; negative is earlier.
    pub(super) fn nudge(&mut self, ns: i64) {
        let size = Duration::from_nanos(ns.unsigned_abs());
        self.deadline = match ns {
            0.. => self.deadline + size,
            _ => Instant::ZERO + self.deadline.saturating_duration_since(Instant::ZERO + size),
        };
    }

    /// Waits for the next deadline that can still be met, or that belongs to one of `makes_up` cycles that are
    /// made up for.
    pub(super) fn next(&mut self, pace: &mut impl Pace, makes_up: u32) -> Beginning {
        let begins = if makes_up > 0 { self.deadline.max(self.not_before) } else { self.deadline };
        let at = pace.wait_until(begins);
        self.not_before = at + self.period / 2;
        let late = at.saturating_duration_since(self.deadline);
        let passed = late.as_nanos() / self.period.as_nanos();
        let missed = if passed <= u128::from(makes_up) { 0 } else { passed };
        let missed = u64::try_from(missed).unwrap_or(u64::MAX);
        let grid_steps = u32::try_from(missed.saturating_add(1)).unwrap_or(u32::MAX);
        self.deadline += self.period.saturating_mul(grid_steps);
        Beginning { at, late, missed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Wakes up at the given times, or at the deadline if that is later.
    struct Woken(std::vec::IntoIter<u64>);

    impl Pace for Woken {
        fn start(&self) -> Instant {
            Instant::ZERO
        }

        fn wait_until(&mut self, deadline: Instant) -> Instant {
            Instant::from_micros(self.0.next().unwrap_or(0)).max(deadline)
        }
    }

    #[test]
    fn a_nudge_moves_what_is_to_come() {
        let mut grid = Grid::new(Instant::ZERO, Duration::from_millis(1));
        let mut pace = super::SimulatedTime;
        let begins: std::vec::Vec<u64> = [0, 5_000, -20_000, 0]
            .into_iter()
            .map(|nudge| {
                let at = grid.next(&mut pace, 0).at.as_nanos();
                grid.nudge(nudge);
                at
            })
            .collect();
        assert_eq!(begins, [0, 1_000_000, 2_005_000, 2_985_000]);
    }

    #[test]
    fn a_late_cycle_does_not_push_the_grid() {
        let mut pace = Woken(vec![0, 1_400, 0, 5_100, 0].into_iter());
        let mut grid = Grid::new(Instant::ZERO, Duration::from_millis(1));
        let beginnings: std::vec::Vec<_> = (0..5)
            .map(|_| grid.next(&mut pace, 0))
            .map(|b| (b.at.as_nanos() / 1_000, b.late.as_micros(), b.missed))
            .collect();
        let expected = [
            (0, 0, 0),
            (1_400, 400, 0),
            (2_000, 0, 0),
            // Due at 3 ms, woken at 5.1 ms: the deadlines at 4 and 5 ms passed without a cycle.
            (5_100, 2_100, 2),
            (6_000, 0, 0),
        ];
        assert_eq!(beginnings, expected);
    }

    /// When cycles of 10 ms begin, in ms, of a caller that is woken at `woken_ms` or when it wants to, until
    /// `end_ms`; and how many deadlines were given up.
    fn begun(woken_ms: &[u64], end_ms: u64) -> (std::vec::Vec<u64>, u64) {
        let woken: std::vec::Vec<_> = woken_ms.iter().map(|ms| ms * 1_000).collect();
        let mut pace = Woken(woken.into_iter());
        let mut grid = Grid::new(Instant::ZERO, Duration::from_millis(10));
        let (mut begun, mut missed) = (std::vec::Vec::new(), 0);
        for _ in 0..1_000 {
            let beginning = grid.next(&mut pace, 16);
            if beginning.at > Instant::from_millis(end_ms) {
                break;
            }
            begun.push(beginning.at.as_nanos() / 1_000_000);
            missed += beginning.missed;
        }
        (begun, missed)
    }

    #[test]
    fn cycles_are_made_up_for_half_a_period_apart() {
        let cases: [(&[u64], &[u64]); 5] = [
            (&[0, 14], &[0, 14, 20, 30, 40]),
            (&[0, 16], &[0, 16, 21, 30, 40]),
            (&[0, 22], &[0, 22, 27, 32, 40]),
            (&[0, 35], &[0, 35, 40, 45, 50, 55, 60, 70]),
            (&[0, 35, 52], &[0, 35, 52, 57, 62, 67, 72, 77, 82, 90, 100]),
        ];
        for (woken, expected) in cases {
            let end = *expected.last().expect("some");
            assert_eq!(begun(woken, end), (expected.to_vec(), 0), "{woken:?}");
        }
    }

    #[test]
    fn more_cycles_than_are_made_up_for_are_given_up_together() {
        let (times, missed) = begun(&[0, 10 + 169], 1_000);
        assert_eq!((times.len(), missed), (101, 0));
        let (times, missed) = begun(&[0, 10 + 173], 1_000);
        assert_eq!((times.len(), missed), (101 - 17, 17));
        assert_eq!(times[1..4], [183, 190, 200]);
    }
}
