//! How fast cycles follow each other: by the clock, or as quickly as they can be computed.

use crate::link::clock::MonotonicClock;
use crate::time::{Duration, Instant};

/// Decides when a cycle begins.
pub trait Pace {
    /// Time before the first cycle.
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
/// a whole period late or more, the deadlines in between are given up and counted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    deadline: Instant,
    period: Duration,
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
        Self { deadline: start, period: period.max(Duration::from_nanos(1)) }
    }

    /// Moves the deadlines still to come by `ns`; negative is earlier.
    pub(super) fn nudge(&mut self, ns: i64) {
        let size = Duration::from_nanos(ns.unsigned_abs());
        self.deadline = match ns {
            0.. => self.deadline + size,
            _ => Instant::ZERO + self.deadline.saturating_duration_since(Instant::ZERO + size),
        };
    }

    /// Waits for the next deadline that can still be met.
    pub(super) fn next(&mut self, pace: &mut impl Pace) -> Beginning {
        let at = pace.wait_until(self.deadline);
        let late = at.saturating_duration_since(self.deadline);
        let missed = late.as_nanos() / self.period.as_nanos();
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
                let at = grid.next(&mut pace).at.as_nanos();
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
            .map(|_| grid.next(&mut pace))
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
}
