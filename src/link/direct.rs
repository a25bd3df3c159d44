//! The link without a bus: a device in the same process, or several as one segment.
//!
//! One exchange hands the outputs to the device, lets it live for one cycle, and brings its inputs
//! back. Nothing is ever late, so the answer is [`InputQuality::Fresh`] unless the device is off; a
//! stream of commands is accepted at one command per cycle, the limit of a handshake over a sample-and-hold
//! bus.

use core::convert::Infallible;
use std::prelude::v1::*;

use crate::cycle::{CyclicDevice, CyclicLink, CyclicSegment, InputQuality};
use crate::time::Instant;

/// A [`CyclicDevice`] as a [`CyclicLink`].
#[derive(Clone, Debug)]
pub struct DirectLink<D> {
    device: D,
}

impl<D: CyclicDevice> DirectLink<D> {
    /// A link to `device`.
    #[must_use]
    pub const fn new(device: D) -> Self {
        Self { device }
    }

    /// The device at the other end.
    #[must_use]
    pub const fn device(&self) -> &D {
        &self.device
    }

    /// The device at the other end, to be acted upon as a person beside the robot would.
    pub const fn device_mut(&mut self) -> &mut D {
        &mut self.device
    }

    /// The device, when the link is no longer needed.
    #[must_use]
    pub fn into_device(self) -> D {
        self.device
    }
}

/// Why a [`DirectLink`] cannot exchange images.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DirectLinkError {
    /// The output image has not the length the device takes.
    #[error("the device takes {expected} bytes of outputs, given {found}")]
    OutputLength {
        /// Length the device takes, in bytes.
        expected: usize,
        /// Length given, in bytes.
        found: usize,
    },
    /// The buffer for inputs has not the length the device fills.
    #[error("the device gives {expected} bytes of inputs, room for {found}")]
    InputLength {
        /// Length the device gives, in bytes.
        expected: usize,
        /// Length of the buffer, in bytes.
        found: usize,
    },
}

impl DirectLinkError {
    /// Whether trying again can help: never, since a length does not change by itself.
    #[must_use]
    pub const fn is_transient(self) -> bool {
        false
    }
}

impl<D: CyclicDevice> CyclicLink for DirectLink<D> {
    type Error = DirectLinkError;

    fn exchange(
        &mut self,
        now: Instant,
        outputs: &[u8],
        inputs: &mut [u8],
    ) -> Result<InputQuality, DirectLinkError> {
        if outputs.len() != D::OUTPUT_LEN {
            let (expected, found) = (D::OUTPUT_LEN, outputs.len());
            return Err(DirectLinkError::OutputLength { expected, found });
        }
        if inputs.len() != D::INPUT_LEN {
            let (expected, found) = (D::INPUT_LEN, inputs.len());
            return Err(DirectLinkError::InputLength { expected, found });
        }
        self.device.cycle(now, Some(outputs), inputs);
        Ok(if self.device.is_on_bus() { InputQuality::Fresh } else { InputQuality::Lost })
    }
}

/// Several [`CyclicDevice`]s as a [`CyclicSegment`]: one exchange lets each of them live for one
/// cycle, in the order of their numbers. All memory is taken when it is made.
#[derive(Clone, Debug)]
pub struct DirectSegment<D> {
    places: Vec<Place<D>>,
}

/// A device and the images that the next exchange carries, or the last one carried.
#[derive(Clone, Debug)]
struct Place<D> {
    device: D,
    outputs: Vec<u8>,
    inputs: Vec<u8>,
    quality: InputQuality,
}

impl<D: CyclicDevice> DirectSegment<D> {
    /// A segment of `devices`, numbered from 0 as they come. The first outputs are all zero; inputs
    /// are lost until the first exchange.
    #[must_use]
    pub fn new(devices: impl IntoIterator<Item = D>) -> Self {
        let place = |device| Place {
            device,
            outputs: vec![0; D::OUTPUT_LEN],
            inputs: vec![0; D::INPUT_LEN],
            quality: InputQuality::Lost,
        };
        Self { places: devices.into_iter().map(place).collect() }
    }

    /// The device of a robot; `None` if there is no such robot.
    #[must_use]
    pub fn device(&self, robot: usize) -> Option<&D> {
        self.places.get(robot).map(|place| &place.device)
    }

    /// The device of a robot, to be acted upon as a person beside the robot would.
    pub fn device_mut(&mut self, robot: usize) -> Option<&mut D> {
        self.places.get_mut(robot).map(|place| &mut place.device)
    }
}

impl<D: CyclicDevice> CyclicSegment for DirectSegment<D> {
    type Error = Infallible;

    fn robot_count(&self) -> usize {
        self.places.len()
    }

    fn write_outputs(&mut self, robot: usize, outputs: &[u8]) {
        if let Some(place) = self.places.get_mut(robot)
            && place.outputs.len() == outputs.len()
        {
            place.outputs.copy_from_slice(outputs);
        }
    }

    fn exchange(&mut self, now: Instant) -> Result<(), Infallible> {
        for Place { device, outputs, inputs, quality } in &mut self.places {
            device.cycle(now, Some(outputs), inputs);
            *quality = if device.is_on_bus() { InputQuality::Fresh } else { InputQuality::Lost };
        }
        Ok(())
    }

    fn read_inputs(&self, robot: usize, inputs: &mut [u8]) -> InputQuality {
        match self.places.get(robot) {
            Some(place) if place.inputs.len() == inputs.len() => {
                inputs.copy_from_slice(&place.inputs);
                place.quality
            }
            _ => InputQuality::Lost,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Echoes its two bytes of outputs plus one, and remembers when it was called.
    #[derive(Default)]
    struct Echo {
        cycled_at: Option<Instant>,
    }

    impl CyclicDevice for Echo {
        fn is_on_bus(&self) -> bool {
            true
        }

        const OUTPUT_LEN: usize = 2;
        const INPUT_LEN: usize = 2;

        fn cycle(&mut self, now: Instant, outputs: Option<&[u8]>, inputs: &mut [u8]) {
            self.cycled_at = Some(now);
            for (input, output) in inputs.iter_mut().zip(outputs.unwrap_or_default()) {
                *input = output + 1;
            }
        }
    }

    #[test]
    fn outputs_arrive_and_inputs_return_in_the_same_exchange() {
        let mut link = DirectLink::new(Echo::default());
        let mut inputs = [0; 2];
        let quality = link.exchange(Instant::from_millis(7), &[1, 2], &mut inputs);
        assert_eq!(quality, Ok(InputQuality::Fresh));
        assert_eq!(inputs, [2, 3]);
        assert_eq!(link.device().cycled_at, Some(Instant::from_millis(7)));
    }

    #[test]
    fn a_wrong_length_is_refused_before_the_device_sees_it() {
        let mut link = DirectLink::new(Echo::default());
        let error = link.exchange(Instant::ZERO, &[1], &mut [0; 2]);
        assert_eq!(error, Err(DirectLinkError::OutputLength { expected: 2, found: 1 }));
        let error = link.exchange(Instant::ZERO, &[1, 2], &mut [0; 3]);
        assert_eq!(error, Err(DirectLinkError::InputLength { expected: 2, found: 3 }));
        assert!(!DirectLinkError::InputLength { expected: 2, found: 3 }.is_transient());
        assert_eq!(link.into_device().cycled_at, None);
    }

    #[test]
    fn a_segment_keeps_its_robots_apart() {
        let mut segment = DirectSegment::new([Echo::default(), Echo::default()]);
        assert_eq!(segment.robot_count(), 2);
        let mut inputs = [7; 2];
        assert_eq!(segment.read_inputs(1, &mut inputs), InputQuality::Lost, "nothing came yet");
        segment.write_outputs(1, &[1, 2]);
        assert_eq!(segment.exchange(Instant::from_millis(7)), Ok(()));
        for (robot, expected) in [(0, [1, 1]), (1, [2, 3])] {
            assert_eq!(segment.read_inputs(robot, &mut inputs), InputQuality::Fresh);
            assert_eq!(inputs, expected, "robot {robot}");
            let device = segment.device(robot).expect("one of two");
            assert_eq!(device.cycled_at, Some(Instant::from_millis(7)), "robot {robot}");
        }
    }

    #[test]
    fn outputs_stay_until_set_again() {
        let mut segment = DirectSegment::new([Echo::default()]);
        let mut inputs = [0; 2];
        segment.write_outputs(0, &[4, 5]);
        for now in 0..2 {
            assert_eq!(segment.exchange(Instant::from_millis(now)), Ok(()));
            assert_eq!(segment.read_inputs(0, &mut inputs), InputQuality::Fresh);
            assert_eq!(inputs, [5, 6]);
        }
    }

    #[test]
    fn strangers_and_wrong_lengths_change_nothing_on_a_segment() {
        let mut segment = DirectSegment::new([Echo::default()]);
        segment.write_outputs(0, &[9]);
        segment.write_outputs(1, &[9, 9]);
        assert_eq!(segment.exchange(Instant::ZERO), Ok(()));
        let mut inputs = [7; 3];
        for (robot, room) in [(0, 1), (0, 3), (1, 2)] {
            let inputs = inputs.get_mut(..room).expect("at most 3");
            assert_eq!(segment.read_inputs(robot, inputs), InputQuality::Lost);
        }
        assert_eq!(inputs, [7; 3]);
        let mut inputs = [7; 2];
        assert_eq!(segment.read_inputs(0, &mut inputs), InputQuality::Fresh);
        assert_eq!(inputs, [1, 1], "the outputs were still zero");
        assert!(segment.device_mut(1).is_none());
    }
}
