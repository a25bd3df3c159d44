//! Times at which frames of one direction arrived, and the gaps between them.

use std::time::{Duration, Instant};

/// Arrivals of one direction, in order.
#[derive(Debug, Default)]
pub(crate) struct Arrivals {
    stamps: Vec<Instant>,
}

/// What the gaps of one direction are like.
#[derive(Clone, Debug, Default)]
pub(crate) struct Gaps {
    /// Each gap in us, sorted once [`Gaps::sort`] was called.
    pub(crate) us: Vec<f64>,
    /// Time from first to last frame and number of gaps, of each round.
    rounds: Vec<(f64, usize)>,
}

impl Arrivals {
    pub(crate) fn with_capacity(frames: usize) -> Self {
        Self { stamps: Vec::with_capacity(frames) }
    }

    pub(crate) fn stamp(&mut self) {
        self.stamps.push(Instant::now());
    }

    pub(crate) fn len(&self) -> usize {
        self.stamps.len()
    }

    pub(crate) fn clear(&mut self) {
        self.stamps.clear();
    }
}

impl Gaps {
    /// Adds the arrivals of a round.
    pub(crate) fn add(&mut self, arrivals: &Arrivals) {
        let gap = |pair: &[Instant]| (pair[1] - pair[0]).as_secs_f64() * 1e6;
        self.us.extend(arrivals.stamps.windows(2).map(gap));
        if let (Some(first), Some(last)) = (arrivals.stamps.first(), arrivals.stamps.last()) {
            let us = (*last - *first).as_secs_f64() * 1e6;
            self.rounds.push((us, arrivals.stamps.len() - 1));
        }
    }

    pub(crate) fn sort(&mut self) {
        self.us.sort_unstable_by(f64::total_cmp);
    }

    /// Mean gap in us over all rounds.
    pub(crate) fn mean_us(&self) -> Option<f64> {
        let count: usize = self.rounds.iter().map(|(_, count)| count).sum();
        let us: f64 = self.rounds.iter().map(|(us, _)| us).sum();
        (count > 0).then(|| us / count as f64)
    }

    /// By how much the mean gap is off from `interval`, in percent of it.
    pub(crate) fn off_percent(&self, interval: Duration) -> Option<f64> {
        self.mean_us().map(|mean| (mean / (interval.as_secs_f64() * 1e6) - 1.0) * 100.0)
    }

    /// The gap in us below which so many of 1000 lie; of 1000, the longest.
    pub(crate) fn quantile_us(&self, per_mille: usize) -> Option<f64> {
        let at = (self.us.len() * per_mille / 1000).min(self.us.len().checked_sub(1)?);
        self.us.get(at).copied()
    }
}
