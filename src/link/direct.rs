//! The link without a bus: a device in the same process.
//!
//! One exchange hands the outputs to the device, lets it live for one cycle, and brings its inputs
//! back. Nothing is ever late, so the answer is [`InputQuality::Fresh`] unless the device is off; a
//! stream of commands is accepted at one command per cycle, the limit of a handshake over a sample-and-hold
//! bus.

use crate::cycle::{CyclicDevice, CyclicLink, InputQuality};
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
}
