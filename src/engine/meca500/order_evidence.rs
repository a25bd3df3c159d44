//! What one input image says in one byte order, and the evidence that settles the order.
//!
//! [`OrderReading`] holds the rules for a single image. The engine's detector applies them; so does
//! [`OrderProbe`], which drives nothing: it watches, and shows what a verdict rests on. Both end in
//! the same verdict because both are the same detector.
//!
//! Beyond what the engine does, a probe can ask for a dynamic type and watch for its echo. That
//! supports a verdict or hints at one; it never makes one.

use super::order::{Detector, IN_A_ROW};
use crate::wire::WireError;
use crate::wire::meca500::dynamic::DynamicType;
use crate::wire::meca500::image::{InputImage, OUTPUT_LEN, OutputImage};
use crate::wire::order::{Big, ByteOrder, Endian, ImageOrder, Little};

/// Longest step of the robot's clock between two images, in microseconds.
const CLOCK_STEP_US: u64 = 60_000_000;
const FIRST_UNUSED_TYPE: u32 = 20_000;
const MICROSECONDS: u32 = 1_000_000;
/// Sizes a coordinate or a joint angle may have; zero says nothing.
const SENSIBLE: core::ops::RangeInclusive<f32> = 1e-6..=40_000.0;
/// Reals of an image that are looked at: six target joints, then the target pose.
pub const REALS_READ: usize = 12;

/// What an input image says when it is read in one byte order.
///
/// Source: PM Tables 14 to 16, 20, 22 to 25.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrderReading {
    /// FifoSpace, input bytes 10 and 11.
    pub fifo_space: u16,
    /// Seconds of the robot's clock, input bytes 116 to 119.
    pub seconds: u32,
    /// Microseconds of the robot's clock, input bytes 120 to 123.
    pub microseconds: u32,
    /// DynamicType of the four slots, input bytes 140, 168, 196 and 224.
    pub dynamic_types: [DynamicType; 4],
    /// Target joints in degrees, then the target pose in mm and degrees: input bytes 16 to 63.
    pub reals: [f32; REALS_READ],
}

impl OrderReading {
    /// Reads `image`.
    #[must_use]
    pub fn of<O: ImageOrder>(image: &InputImage<O>) -> Self {
        let time = &image.robot_timestamp;
        let pose = &image.target_end_effector_pose;
        let pose = [&pose.x, &pose.y, &pose.z, &pose.alpha, &pose.beta, &pose.gamma];
        let mut reals = [0.0; REALS_READ];
        for (to, from) in reals.iter_mut().zip(image.target_joint_set.joint.iter().chain(pose)) {
            *to = from.get();
        }
        Self {
            fifo_space: image.motion_status.fifo_space.get(),
            seconds: time.seconds.get(),
            microseconds: time.microseconds.get(),
            dynamic_types: image
                .dynamic_data
                .each_ref()
                .map(|slot| DynamicType(slot.dynamic_type.get())),
            reals,
        }
    }

    /// Whether FifoSpace is one that a robot can have: 0 to 13,000.
    #[must_use]
    pub const fn fifo_space_fits(&self) -> bool {
        self.fifo_space <= super::FIFO_SPACE_MAX
    }

    /// Whether the microseconds are less than a second.
    #[must_use]
    pub const fn microseconds_fit(&self) -> bool {
        self.microseconds < MICROSECONDS
    }

    /// Whether all dynamic types have numbers that are used.
    #[must_use]
    pub fn dynamic_types_fit(&self) -> bool {
        self.dynamic_types.iter().all(|ty| ty.0 < FIRST_UNUSED_TYPE)
    }

    /// Whether all integers are ones that a robot can send; the step of its clock is left out.
    #[must_use]
    pub fn integers_fit(&self) -> bool {
        self.fifo_space_fits() && self.microseconds_fit() && self.dynamic_types_fit()
    }

    /// The robot's clock in microseconds.
    #[must_use]
    pub const fn clock_us(&self) -> u64 {
        self.seconds as u64 * MICROSECONDS as u64 + self.microseconds as u64
    }

    /// Whether the clock can read so after it read `last_us`: not back, and no jump.
    pub(super) fn clock_follows(&self, last_us: Option<u64>) -> bool {
        let clock_us = self.clock_us();
        last_us
            .is_none_or(|last| clock_us >= last && clock_us.saturating_sub(last) <= CLOCK_STEP_US)
    }

    /// Whether a joint angle or a coordinate may be so: 0.000001 to 40,000, with any sign. Zero says
    /// nothing and does not count.
    #[must_use]
    pub fn is_sensible(real: f32) -> bool {
        SENSIBLE.contains(&real.abs())
    }

    /// How many of the Reals are sensible.
    #[must_use]
    pub fn sensible_reals(&self) -> u8 {
        self.reals.iter().fold(0, |count, real| count + u8::from(Self::is_sensible(*real)))
    }

    /// Whether so many more Reals are sensible than in `other`, the same image read in the other order,
    /// that it counts: two.
    #[must_use]
    pub fn has_better_reals_than(&self, other: &Self) -> bool {
        self.sensible_reals() >= other.sensible_reals() + 2
    }
}

/// What became of asking for a dynamic type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Echo {
    /// The type asked for in the first slot.
    pub asked: DynamicType,
    /// The order in which the question was written.
    pub integers: Endian,
    /// Whether the first slot reported that type, read in the same order, in three images in a row,
    /// and a value with it.
    pub answered: bool,
}

/// What a verdict about the byte order rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrderEvidence {
    /// Images seen.
    pub images: u32,
    /// Order of integers; `None` while nothing settles it.
    pub integers: Option<Endian>,
    /// Order of Reals; `None` while nothing settles it.
    pub reals: Option<Endian>,
    /// The image that settled the order, or the newest while it is open, read big-endian.
    pub big: OrderReading,
    /// The same image read little-endian.
    pub little: OrderReading,
    /// The last question asked.
    pub echo: Option<Echo>,
}

impl OrderEvidence {
    /// The byte order, if both parts are settled.
    #[must_use]
    pub fn verdict(&self) -> Option<ByteOrder> {
        Some(ByteOrder { integers: self.integers?, reals: self.reals? })
    }
}

/// Finds the byte order of a robot as the engine does, and keeps the evidence.
#[derive(Clone, Debug, Default)]
pub struct OrderProbe {
    detector: Detector,
    evidence: Option<OrderEvidence>,
    echo: Option<Echo>,
    echoes_in_a_row: u8,
    images: u32,
}

impl OrderProbe {
    /// A probe that has seen nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes one fresh input image of 252 bytes. What follows the verdict does not change it.
    ///
    /// # Errors
    ///
    /// `inputs` has another length; nothing happened then.
    pub fn see(&mut self, inputs: &[u8]) -> Result<(), WireError> {
        let big = InputImage::<Big>::from_bytes(inputs)?;
        let little = InputImage::<Little>::from_bytes(inputs)?;
        self.images = self.images.saturating_add(1);
        self.watch_for_echo(big, little);
        if self.verdict().is_some() {
            return Ok(());
        }
        self.detector.see(big, little);
        self.evidence = Some(OrderEvidence {
            images: self.images,
            integers: self.detector.integers(),
            reals: self.detector.reals(),
            big: OrderReading::of(big),
            little: OrderReading::of(little),
            echo: None,
        });
        Ok(())
    }

    /// The byte order, once it is settled.
    #[must_use]
    pub fn verdict(&self) -> Option<ByteOrder> {
        self.evidence.as_ref()?.verdict()
    }

    /// What is known; `None` before the first image.
    #[must_use]
    pub fn evidence(&self) -> Option<OrderEvidence> {
        self.evidence.map(|evidence| OrderEvidence { echo: self.echo, ..evidence })
    }

    /// Outputs that ask for `types` in the four slots, integers written in this order, and for nothing
    /// else; from now on the echo of the first is watched for.
    pub fn ask(&mut self, types: [DynamicType; 4], integers: Endian) -> [u8; OUTPUT_LEN] {
        let [asked, ..] = types;
        self.echo = Some(Echo { asked, integers, answered: false });
        self.echoes_in_a_row = 0;
        match integers {
            Endian::BigEndian => question::<Big>(types),
            Endian::LittleEndian => question::<Little>(types),
        }
    }

    fn watch_for_echo(&mut self, big: &InputImage<Big>, little: &InputImage<Little>) {
        let Some(echo) = &mut self.echo else { return };
        let ([in_big, ..], [in_little, ..]) = (&big.dynamic_data, &little.dynamic_data);
        let reported = match echo.integers {
            Endian::BigEndian => in_big.dynamic_type.get(),
            Endian::LittleEndian => in_little.dynamic_type.get(),
        };
        // A Real that is not zero is not zero in either order.
        let has_value = in_big.value_idx.iter().any(|value| value.get().to_bits() != 0);
        self.echoes_in_a_row = if reported == echo.asked.0 && has_value {
            self.echoes_in_a_row.saturating_add(1)
        } else {
            0
        };
        echo.answered |= self.echoes_in_a_row >= IN_A_ROW;
    }
}

fn question<O: ImageOrder>(types: [DynamicType; 4]) -> [u8; OUTPUT_LEN] {
    let mut image = OutputImage::<O>::zeroed();
    let slots = &mut image.dynamic_data_configuration.dynamic_data_type_id;
    for (slot, ty) in slots.iter_mut().zip(types) {
        slot.set(ty.0);
    }
    let mut bytes = [0; OUTPUT_LEN];
    for (to, from) in bytes.iter_mut().zip(image.as_bytes()) {
        *to = *from;
    }
    bytes
}
