//! This crate, as a program uses it.

use fieldarm::wire::meca500::image::{
    FirmwareLayout, INPUT_LEN, InputImage, InputValues, MotionStatusFlags, OUTPUT_LEN, OutputImage,
    OutputValues, RobotStatusFlags, SafetyResettable, SafetySignals,
};
use fieldarm::wire::order::ImageOrder;

#[inline(never)]
pub(crate) fn measured_decode<O: ImageOrder>(bytes: &[u8; INPUT_LEN]) -> InputValues {
    InputImage::<O>::from_bytes(bytes).map(InputImage::values).unwrap_or_default()
}

#[inline(never)]
pub(crate) fn measured_encode<O: ImageOrder>(values: &OutputValues, bytes: &mut [u8; OUTPUT_LEN]) {
    if let Ok(image) = OutputImage::<O>::from_bytes_mut(bytes) {
        image.set_values(values);
    }
}

/// What an engine looks at in each bus cycle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Reads {
    pub(crate) status: RobotStatusFlags,
    pub(crate) error_code: u16,
    pub(crate) checkpoint_reached: u32,
    pub(crate) checkpoint_discarded: u32,
    pub(crate) move_id: u16,
    pub(crate) fifo_space: u16,
    pub(crate) motion: MotionStatusFlags,
    pub(crate) seconds: u32,
    pub(crate) microseconds: u32,
    pub(crate) signals: SafetySignals,
    pub(crate) resettable: SafetyResettable,
    pub(crate) dynamic_types: [u32; 4],
}

#[inline(never)]
pub(crate) fn measured_reads<O: ImageOrder>(image: &InputImage<O>, reads: &mut Reads) {
    let motion = &image.motion_status;
    let checkpoints = motion.checkpoints(FirmwareLayout::V11_3);
    reads.status = image.robot_status.flags.get();
    reads.error_code = image.robot_status.error_code.get();
    reads.checkpoint_reached = checkpoints.reached;
    reads.checkpoint_discarded = checkpoints.discarded;
    reads.move_id = motion.move_id.get();
    reads.fifo_space = motion.fifo_space.get();
    reads.motion = motion.flags.get();
    reads.seconds = image.robot_timestamp.seconds.get();
    reads.microseconds = image.robot_timestamp.microseconds.get();
    reads.signals = image.safety_status.signals.get();
    reads.resettable = image.safety_status.resettable.get();
    reads.dynamic_types = image.dynamic_data.each_ref().map(|slot| slot.dynamic_type.get());
}

#[inline(never)]
pub(crate) fn measured_copy<const N: usize>(from: &[u8; N], to: &mut [u8; N]) {
    to.copy_from_slice(from);
}
