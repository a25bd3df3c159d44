//! What the cycles of a run were like, in memory that does not grow.

use hdrhistogram::Histogram;

use super::pace::Beginning;
use crate::cycle::InputQuality;
use crate::time::{Duration, Instant};

/// Longest duration told apart, in nanoseconds; quantiles count longer ones as this long.
const LONGEST_NS: u64 = 10_000_000_000;
/// Longest acknowledgement told apart, in cycles.
const LONGEST_ACKNOWLEDGEMENT_CYCLES: u64 = 1_000_000;
/// Durations are exact to so many decimal digits.
const DIGITS: u8 = 3;

/// Counts of a quantity, with its quantiles.
#[derive(Clone, Debug)]
pub struct Distribution {
    /// `None` only if the bounds were refused, which the constants above rule out.
    histogram: Option<Histogram<u64>>,
    /// The histogram rounds; the extremes are kept as they were.
    min: u64,
    max: u64,
}

/// The summary of a [`Distribution`]. The unit is that of what was counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Quantiles {
    /// How many values were counted.
    pub count: u64,
    /// Smallest.
    pub min: u64,
    /// Median.
    pub p50: u64,
    /// 99 of 100 are not above it.
    pub p99: u64,
    /// Largest.
    pub max: u64,
}

impl Distribution {
    fn up_to(longest: u64) -> Self {
        Self {
            histogram: Histogram::new_with_bounds(1, longest, DIGITS).ok(),
            min: u64::MAX,
            max: 0,
        }
    }

    /// Of durations, in nanoseconds.
    #[must_use]
    pub fn of_durations() -> Self {
        Self::up_to(LONGEST_NS)
    }

    /// Of acknowledgement latencies, in cycles.
    #[must_use]
    pub fn of_acknowledgements() -> Self {
        Self::up_to(LONGEST_ACKNOWLEDGEMENT_CYCLES)
    }

    /// Counts a value. Does not allocate.
    pub fn record(&mut self, value: u64) {
        if let Some(histogram) = &mut self.histogram {
            histogram.saturating_record(value);
            self.min = self.min.min(value);
            self.max = self.max.max(value);
        }
    }

    /// Counts a duration in nanoseconds. Does not allocate.
    pub fn record_duration(&mut self, duration: Duration) {
        self.record(u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX));
    }

    /// The summary; all zero while nothing was counted.
    #[must_use]
    pub fn quantiles(&self) -> Quantiles {
        match &self.histogram {
            Some(histogram) if !histogram.is_empty() => Quantiles {
                count: histogram.len(),
                min: self.min,
                p50: histogram.value_at_quantile(0.5).clamp(self.min, self.max),
                p99: histogram.value_at_quantile(0.99).clamp(self.min, self.max),
                max: self.max,
            },
            _ => Quantiles::default(),
        }
    }
}

/// What the bus cycles of a run were like, for all robots at once.
#[derive(Clone, Debug)]
pub struct CycleStatistics {
    /// Cycles that took place.
    pub cycles: u64,
    /// Deadlines that passed without a cycle, because the one before was still busy or the
    /// operating system woke the program too late.
    pub overruns: u64,
    /// From the beginning of a cycle to the beginning of the next, in nanoseconds.
    pub cycle_time_ns: Distribution,
    /// From a cycle's deadline to its beginning (jitter), in nanoseconds.
    pub lateness_ns: Distribution,
    /// What the exchange and all controllers took within a cycle, by the wall clock, in nanoseconds.
    pub work_ns: Distribution,
    previous_beginning: Option<Instant>,
}

impl CycleStatistics {
    /// Nothing counted yet. Takes all memory it will ever need.
    #[must_use]
    pub fn new() -> Self {
        Self {
            cycles: 0,
            overruns: 0,
            cycle_time_ns: Distribution::of_durations(),
            lateness_ns: Distribution::of_durations(),
            work_ns: Distribution::of_durations(),
            previous_beginning: None,
        }
    }

    pub(super) fn record_beginning(&mut self, beginning: Beginning) {
        self.cycles += 1;
        self.overruns += beginning.missed;
        self.lateness_ns.record_duration(beginning.late);
        if let Some(previous) = self.previous_beginning.replace(beginning.at) {
            self.cycle_time_ns.record_duration(beginning.at - previous);
        }
    }
}

impl Default for CycleStatistics {
    fn default() -> Self {
        Self::new()
    }
}

/// What the cycles of one robot were like, as long as it had a controller.
#[derive(Clone, Debug)]
pub struct RobotStatistics {
    /// Cycles whose inputs were stale.
    pub stale: u64,
    /// Cycles without inputs to be trusted.
    pub lost: u64,
    /// What the controller took within a cycle, by the wall clock, in nanoseconds.
    pub controller_ns: Distribution,
}

impl RobotStatistics {
    /// Nothing counted yet. Takes all memory it will ever need.
    #[must_use]
    pub fn new() -> Self {
        Self { stale: 0, lost: 0, controller_ns: Distribution::of_durations() }
    }

    pub(super) fn record(&mut self, quality: InputQuality, controller_took: Duration) {
        match quality {
            InputQuality::Fresh => {}
            InputQuality::Stale { .. } => self.stale += 1,
            InputQuality::Lost => self.lost += 1,
        }
        self.controller_ns.record_duration(controller_took);
    }
}

impl Default for RobotStatistics {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_known_values() {
        let mut distribution = Distribution::of_acknowledgements();
        assert_eq!(distribution.quantiles(), Quantiles::default());
        (1..=100).for_each(|value| distribution.record(value));
        let expected = Quantiles { count: 100, min: 1, p50: 50, p99: 99, max: 100 };
        assert_eq!(distribution.quantiles(), expected);
    }

    #[test]
    fn extremes_are_exact_even_beyond_the_bounds() {
        let mut distribution = Distribution::of_durations();
        distribution.record_duration(Duration::from_secs(1_000));
        let quantiles = distribution.quantiles();
        let exact = 1_000_000_000_000;
        assert_eq!(
            quantiles,
            Quantiles { count: 1, min: exact, p50: exact, p99: exact, max: exact }
        );
        distribution.record(1_000_447);
        assert_eq!(distribution.quantiles().min, 1_000_447);
    }
}
