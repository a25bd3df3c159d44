//! Samples of a run of unknown length in bounded memory.

use std::prelude::v1::*;

/// Keeps evenly spaced samples, never more than its capacity.
///
/// Every sample is kept until the room is full; then every second one is dropped and from there on
/// only every second one is taken, and so on. Memory is taken once, when it is made.
#[derive(Clone, Debug)]
pub struct Decimated<T> {
    kept: Vec<T>,
    capacity: usize,
    stride: u64,
    offered: u64,
}

impl<T: Copy> Decimated<T> {
    /// Room for `capacity` samples, at least 2.
    #[must_use]
    pub fn with_capacity(capacity: usize) -> Self {
        let capacity = capacity.max(2);
        // One more for the sample that closes a run.
        Self { kept: Vec::with_capacity(capacity + 1), capacity, stride: 1, offered: 0 }
    }

    /// Whether the next sample will be kept; asking saves making one that will not.
    #[must_use]
    pub const fn wants_next(&self) -> bool {
        self.offered.is_multiple_of(self.stride)
    }

    /// Offers the next sample.
    pub fn offer(&mut self, sample: T) {
        if self.wants_next() {
            if self.kept.len() == self.capacity {
                self.halve();
            }
            if self.wants_next() {
                self.kept.push(sample);
            }
        }
        self.skip();
    }

    /// Counts a sample that [`wants_next`](Self::wants_next) did not ask for.
    pub const fn skip(&mut self) {
        self.offered += 1;
    }

    /// Makes `last` the last sample kept, if the spacing left it out.
    pub fn close(&mut self, last: T) {
        let is_kept = self.offered == 0 || (self.offered - 1).is_multiple_of(self.stride);
        if !is_kept && self.kept.len() < self.kept.capacity() {
            self.kept.push(last);
        }
    }

    /// The samples kept, oldest first.
    #[must_use]
    pub fn samples(&self) -> &[T] {
        &self.kept
    }

    /// One of so many samples is kept.
    #[must_use]
    pub const fn stride(&self) -> u64 {
        self.stride
    }

    fn halve(&mut self) {
        let mut position = 0;
        self.kept.retain(|_| {
            position += 1;
            position % 2 == 1
        });
        self.stride *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_stay_evenly_spaced_and_bounded() {
        for offered in [0_u64, 1, 7, 8, 9, 63, 64, 65, 1_000] {
            let mut samples = Decimated::with_capacity(8);
            let memory = samples.kept.capacity();
            (0..offered).for_each(|n| samples.offer(n));
            let kept = samples.samples();
            let expected: Vec<u64> = (0..offered).step_by(samples.stride() as usize).collect();
            assert_eq!(kept, expected, "{offered} offered");
            assert!(kept.len() <= 8);
            assert!(offered < 8 || kept.len() >= 4, "{offered} offered, {} kept", kept.len());
            assert_eq!(samples.kept.capacity(), memory, "grew after it was made");
        }
    }
}
