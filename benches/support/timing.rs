//! Times on a machine that wobbles: many short batches in turns, and of these the median and the
//! least.

use std::time::{Duration, Instant};

use super::Subject;

/// How long to measure.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Batches of each subject.
    pub(crate) batches: usize,
    /// Least length of a batch.
    pub(crate) batch: Duration,
}

impl Effort {
    /// What a figure for the record needs.
    pub(crate) const FULL: Self = Self { batches: 501, batch: Duration::from_micros(200) };
    /// A first look.
    pub(crate) const QUICK: Self = Self { batches: 51, batch: Duration::from_micros(100) };

    /// [`Self::QUICK`] if the command line has `--quick`, else [`Self::FULL`].
    pub(crate) fn from_args() -> Self {
        if std::env::args().any(|arg| arg == "--quick") { Self::QUICK } else { Self::FULL }
    }
}

/// Time of one operation, in nanoseconds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nanoseconds {
    /// Median of the batches.
    pub(crate) median: f64,
    /// Least of the batches.
    pub(crate) min: f64,
}

/// Times all subjects, one batch of each in turn.
pub(crate) fn time(subjects: &mut [&mut Subject], effort: Effort) -> Vec<Nanoseconds> {
    let sizes: Vec<u64> =
        subjects.iter_mut().map(|subject| batch_size(subject, effort.batch)).collect();
    let mut batches = vec![Vec::with_capacity(effort.batches); subjects.len()];
    for _ in 0..effort.batches {
        for ((subject, &size), batches) in subjects.iter_mut().zip(&sizes).zip(&mut batches) {
            batches.push(elapsed(subject, size).as_nanos() as f64 / size as f64);
        }
    }
    batches
        .into_iter()
        .map(|mut batches: Vec<f64>| {
            batches.sort_by(f64::total_cmp);
            Nanoseconds { median: batches[batches.len() / 2], min: batches[0] }
        })
        .collect()
}

/// Operations that take at least `batch`; doubling also warms the caches.
fn batch_size(subject: &mut Subject, batch: Duration) -> u64 {
    let mut size = 16;
    while elapsed(subject, size) < batch {
        size *= 2;
    }
    size
}

fn elapsed(subject: &mut Subject, times: u64) -> Duration {
    let start = Instant::now();
    subject.run(times);
    start.elapsed()
}
