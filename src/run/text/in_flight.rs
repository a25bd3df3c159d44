//! Lines that the robot has not finished, each with a checkpoint of ours behind it.

use std::collections::VecDeque;

/// One line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Line {
    pub(super) step: usize,
    checkpoint: u16,
}

/// The lines in the order in which they were sent; as many as there are numbers at most, so that none is
/// under way twice.
#[derive(Clone, Debug)]
pub(super) struct InFlight {
    lines: VecDeque<Line>,
    first: u16,
    last: u16,
    next: u16,
    window: usize,
}

impl InFlight {
    /// With the checkpoint numbers from `first` to `last`.
    pub(super) fn new((first, last): (u16, u16), window: usize) -> Self {
        let numbers = usize::from(last.saturating_sub(first)) + 1;
        let window = window.clamp(1, numbers);
        Self { lines: VecDeque::with_capacity(window), first, last, next: first, window }
    }

    pub(super) fn is_full(&self) -> bool {
        self.lines.len() >= self.window
    }

    /// A line of `step` is sent; the number of the checkpoint to be sent behind it.
    pub(super) fn push(&mut self, step: usize) -> u16 {
        let checkpoint = self.next;
        self.next = if checkpoint >= self.last { self.first } else { checkpoint + 1 };
        self.lines.push_back(Line { step, checkpoint });
        checkpoint
    }

    /// Whether a checkpoint is one of ours.
    pub(super) fn owns(&self, checkpoint: u16) -> bool {
        (self.first..=self.last).contains(&checkpoint)
    }

    /// A checkpoint was reached: all lines up to it are done, since the queue keeps its order.
    pub(super) fn reached(&mut self, checkpoint: u16) -> impl Iterator<Item = usize> {
        let place = self.lines.iter().position(|line| line.checkpoint == checkpoint);
        let count = place.map_or(0, |place| place + 1);
        self.lines.drain(..count).map(|line| line.step)
    }

    /// A checkpoint was discarded: its line, which may have been done for a part.
    pub(super) fn discarded(&mut self, checkpoint: u16) -> Option<usize> {
        let place = self.lines.iter().position(|line| line.checkpoint == checkpoint)?;
        self.lines.remove(place).map(|line| line.step)
    }

    /// Nothing is under way any more; what was.
    pub(super) fn clear(&mut self) -> impl Iterator<Item = usize> {
        self.lines.drain(..).map(|line| line.step)
    }

    /// The steps under way, oldest first.
    pub(super) fn steps(&self) -> impl DoubleEndedIterator<Item = usize> {
        self.lines.iter().map(|line| line.step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn numbers_go_round_and_none_is_under_way_twice() {
        let mut in_flight = InFlight::new((7, 9), 200);
        let numbers: Vec<u16> = (0..3).map(|step| in_flight.push(step)).collect();
        assert_eq!(numbers, [7, 8, 9]);
        assert!(in_flight.is_full());
        assert_eq!(in_flight.reached(8).collect::<Vec<_>>(), [0, 1]);
        assert_eq!((in_flight.push(3), in_flight.push(4)), (7, 8));
        assert_eq!(in_flight.discarded(7), Some(3));
        assert_eq!(in_flight.reached(7).count(), 0, "it is known no more");
        assert_eq!(in_flight.clear().collect::<Vec<_>>(), [2, 4]);
        assert!(in_flight.owns(9) && !in_flight.owns(10) && !in_flight.is_full());
    }
}
