//! A [`CyclicLink`] as a segment with one robot, so that one loop serves both.

use std::prelude::v1::*;

use crate::cycle::{CyclicLink, CyclicSegment, InputQuality};
use crate::time::Instant;

/// One robot's link as a segment of one. All memory is taken when it is made.
#[derive(Clone, Debug)]
pub struct Single<L> {
    link: L,
    outputs: Vec<u8>,
    inputs: Vec<u8>,
    quality: InputQuality,
}

impl<L> Single<L> {
    /// The only robot on it.
    const ROBOT: usize = 0;

    /// A segment over `link`, with images of the given lengths in bytes. The first outputs are all
    /// zero; inputs are lost until the first exchange.
    #[must_use]
    pub fn new(link: L, output_len: usize, input_len: usize) -> Self {
        Self {
            link,
            outputs: vec![0; output_len],
            inputs: vec![0; input_len],
            quality: InputQuality::Lost,
        }
    }

    /// The link.
    #[must_use]
    pub const fn link(&self) -> &L {
        &self.link
    }

    /// The link, to be reached between two exchanges.
    pub const fn link_mut(&mut self) -> &mut L {
        &mut self.link
    }
}

impl<L: CyclicLink> CyclicSegment for Single<L> {
    type Error = L::Error;

    fn robot_count(&self) -> usize {
        1
    }

    fn write_outputs(&mut self, robot: usize, outputs: &[u8]) {
        if robot == Self::ROBOT && outputs.len() == self.outputs.len() {
            self.outputs.copy_from_slice(outputs);
        }
    }

    fn exchange(&mut self, now: Instant) -> Result<(), L::Error> {
        // Until the link says otherwise: a failure leaves nothing to be trusted.
        self.quality = InputQuality::Lost;
        self.quality = self.link.exchange(now, &self.outputs, &mut self.inputs)?;
        Ok(())
    }

    fn read_inputs(&self, robot: usize, inputs: &mut [u8]) -> InputQuality {
        if robot != Self::ROBOT || inputs.len() != self.inputs.len() {
            return InputQuality::Lost;
        }
        inputs.copy_from_slice(&self.inputs);
        self.quality
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Answers with what it was sent, and fails when it is sent a 9.
    struct Mirror;

    impl CyclicLink for Mirror {
        type Error = ();

        fn exchange(
            &mut self,
            _now: Instant,
            outputs: &[u8],
            inputs: &mut [u8],
        ) -> Result<InputQuality, ()> {
            if outputs == [9, 9] {
                return Err(());
            }
            inputs.copy_from_slice(outputs);
            Ok(InputQuality::Fresh)
        }
    }

    #[test]
    fn one_exchange_carries_what_was_written_last() {
        let mut segment = Single::new(Mirror, 2, 2);
        let mut inputs = [7; 2];
        assert_eq!(segment.read_inputs(0, &mut inputs), InputQuality::Lost);
        segment.write_outputs(0, &[1, 2]);
        segment.write_outputs(0, &[3]);
        segment.write_outputs(1, &[5, 6]);
        assert_eq!(segment.exchange(Instant::ZERO), Ok(()));
        assert_eq!(segment.read_inputs(0, &mut inputs), InputQuality::Fresh);
        assert_eq!(inputs, [1, 2]);
        for (robot, room) in [(1, 2), (0, 1), (0, 3)] {
            let mut inputs = vec![7; room];
            assert_eq!(segment.read_inputs(robot, &mut inputs), InputQuality::Lost);
            assert!(inputs.iter().all(|byte| *byte == 7), "nothing is copied");
        }
    }

    #[test]
    fn inputs_are_lost_when_the_link_has_failed() {
        let mut segment = Single::new(Mirror, 2, 2);
        assert_eq!(segment.exchange(Instant::ZERO), Ok(()));
        segment.write_outputs(0, &[9, 9]);
        assert_eq!(segment.exchange(Instant::ZERO), Err(()));
        assert_eq!(segment.read_inputs(0, &mut [0; 2]), InputQuality::Lost);
    }
}
