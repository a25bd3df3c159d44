//! Finding the byte order from what arrives while nothing but zeros is sent.
//!
//! Integers: read in the wrong order, FifoSpace exceeds 13,000, the microseconds of the timestamp a
//! million, a dynamic type 19,999, or the clock jumps. Reals: of the joints and the pose, those that
//! are finite, of a sensible size and not absurdly small count for an order. Each rule for one image
//! is in `order_evidence.rs`.
//!
//! An order is settled when it fits three fresh images in a row and the other one does not fit any of
//! them (integers), or is ahead by two values or more in each of them (Reals). Both must settle:
//! zeros and palindromes settle nothing.
//!
//! Left out: the integer inside dynamic type 3, which is read in the order of Reals. `Unverified:`.

use super::Engine;
use super::config::ByteOrderSetting;
use super::event::{Event, Fault};
use super::order_evidence::OrderReading;
use crate::cycle::InputQuality;
use crate::time::Instant;
use crate::wire::WireError;
use crate::wire::meca500::image::{INPUT_LEN, InputImage, OUTPUT_LEN, OutputImage};
use crate::wire::order::{
    Big, BigIntLittleReal, ByteOrder, Endian, ImageOrder, Little, LittleIntBigReal,
};

/// Images in a row that settle an order.
pub(super) const IN_A_ROW: u8 = 3;

/// How one order has fared over the images so far.
#[derive(Clone, Copy, Debug, Default)]
struct Witness {
    fits: u8,
    misfits: u8,
    clock_us: Option<u64>,
}

impl Witness {
    fn see(&mut self, reading: &OrderReading) {
        let steady = reading.clock_follows(self.clock_us);
        self.clock_us = reading.microseconds_fit().then_some(reading.clock_us());
        (self.fits, self.misfits) = if reading.integers_fit() && steady {
            (self.fits.saturating_add(1), 0)
        } else {
            (0, self.misfits.saturating_add(1))
        };
    }
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Detector {
    big: Witness,
    little: Witness,
    reals_big: u8,
    reals_little: u8,
    since: Option<Instant>,
    gave_up: bool,
}

impl Detector {
    /// Takes one fresh image; the order once it is settled.
    pub(super) fn see(
        &mut self,
        big: &InputImage<Big>,
        little: &InputImage<Little>,
    ) -> Option<ByteOrder> {
        let (big, little) = (OrderReading::of(big), OrderReading::of(little));
        self.big.see(&big);
        self.little.see(&little);
        let count = |is_ahead, before: u8| if is_ahead { before.saturating_add(1) } else { 0 };
        self.reals_big = count(big.has_better_reals_than(&little), self.reals_big);
        self.reals_little = count(little.has_better_reals_than(&big), self.reals_little);
        Some(ByteOrder { integers: self.integers()?, reals: self.reals()? })
    }

    /// The order of integers, once it is settled.
    pub(super) fn integers(&self) -> Option<Endian> {
        if self.big.fits >= IN_A_ROW && self.little.misfits >= IN_A_ROW {
            Some(Endian::BigEndian)
        } else if self.little.fits >= IN_A_ROW && self.big.misfits >= IN_A_ROW {
            Some(Endian::LittleEndian)
        } else {
            None
        }
    }

    /// The order of Reals, once it is settled.
    pub(super) fn reals(&self) -> Option<Endian> {
        if self.reals_big >= IN_A_ROW {
            Some(Endian::BigEndian)
        } else if self.reals_little >= IN_A_ROW {
            Some(Endian::LittleEndian)
        } else {
            None
        }
    }
}

impl<const QUEUE: usize> Engine<QUEUE> {
    /// The byte order: fixed by the configuration, or found; `None` while it is not settled.
    #[must_use]
    pub fn byte_order(&self) -> Option<ByteOrder> {
        self.order
    }

    /// [`cycle`](Self::cycle) over raw bytes, in the byte order of the configuration. With `auto`
    /// nothing but zeros is sent until the order is settled.
    ///
    /// # Errors
    ///
    /// A slice that has not the length of its image; nothing happened then.
    pub fn cycle_bytes(
        &mut self,
        now: Instant,
        quality: InputQuality,
        inputs: &[u8],
        outputs: &mut [u8],
    ) -> Result<(), WireError> {
        let big = InputImage::<Big>::from_bytes(inputs)?;
        let little = InputImage::<Little>::from_bytes(inputs)?;
        OutputImage::<Big>::from_bytes(outputs)?;
        if self.order.is_none() {
            self.detect(now, quality, big, little);
        }
        match self.order {
            None => {
                outputs.fill(0);
                self.now = now;
                self.cycles = self.cycles.wrapping_add(1);
                Ok(())
            }
            Some(order) => match (order.integers, order.reals) {
                (Endian::BigEndian, Endian::BigEndian) => {
                    self.cycle_slices::<Big>(now, quality, inputs, outputs)
                }
                (Endian::LittleEndian, Endian::LittleEndian) => {
                    self.cycle_slices::<Little>(now, quality, inputs, outputs)
                }
                (Endian::BigEndian, Endian::LittleEndian) => {
                    self.cycle_slices::<BigIntLittleReal>(now, quality, inputs, outputs)
                }
                (Endian::LittleEndian, Endian::BigEndian) => {
                    self.cycle_slices::<LittleIntBigReal>(now, quality, inputs, outputs)
                }
            },
        }
    }

    fn cycle_slices<O: ImageOrder>(
        &mut self,
        now: Instant,
        quality: InputQuality,
        inputs: &[u8],
        outputs: &mut [u8],
    ) -> Result<(), WireError> {
        let inputs = InputImage::<O>::from_bytes(inputs)?;
        let outputs = OutputImage::<O>::from_bytes_mut(outputs)?;
        self.cycle(now, quality, inputs, outputs);
        Ok(())
    }

    fn detect(
        &mut self,
        now: Instant,
        quality: InputQuality,
        big: &InputImage<Big>,
        little: &InputImage<Little>,
    ) {
        if !quality.is_fresh() {
            return;
        }
        let since = *self.detector.since.get_or_insert(now);
        if let Some(order) = self.detector.see(big, little) {
            self.order = Some(order);
            self.events.state_or_merge(Event::ByteOrderSettled(order));
        } else if !self.detector.gave_up
            && now.saturating_duration_since(since) >= self.config.byte_order_timeout
        {
            self.detector.gave_up = true;
            self.events.state_or_merge(Event::Fault(Fault::ByteOrderUndecidable));
        }
    }

    pub(super) fn order_of(setting: ByteOrderSetting) -> Option<ByteOrder> {
        match setting {
            ByteOrderSetting::Auto => None,
            ByteOrderSetting::Fixed(order) => Some(order),
        }
    }
}

const _: () = assert!(INPUT_LEN == 252 && OUTPUT_LEN == 60);
