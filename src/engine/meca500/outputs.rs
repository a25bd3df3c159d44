//! What the engine commands, as plain values, and how they become the output image.

use crate::wire::meca500::image::{
    BrakesControlFlags, MotionControlFlags, OutputImage, RobotControlFlags,
};
use crate::wire::order::ImageOrder;

/// All of the output image. `Default` is the safe image: every byte zero, in every order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Outputs {
    pub(super) robot: RobotControlFlags,
    pub(super) motion: MotionControlFlags,
    pub(super) move_id: u16,
    pub(super) command: u32,
    pub(super) arguments: [f32; 6],
    pub(super) host_time: u32,
    pub(super) brakes: BrakesControlFlags,
    pub(super) dynamic: [u32; 4],
}

impl Outputs {
    #[inline]
    pub(super) fn write<O: ImageOrder>(&self, image: &mut OutputImage<O>) {
        image.robot_control.flags.set_raw(self.robot);
        image.motion_control.move_id.set(self.move_id);
        image.motion_control.flags.set_raw(self.motion);
        image.motion_command.motion_command_id.set(self.command);
        for (field, value) in image.motion_command_args.argument.iter_mut().zip(self.arguments) {
            field.set(value);
        }
        image.host_time.host_time.set(self.host_time);
        image.brakes_control.flags.set_raw(self.brakes);
        let types = &mut image.dynamic_data_configuration.dynamic_data_type_id;
        for (field, value) in types.iter_mut().zip(self.dynamic) {
            field.set(value);
        }
    }

    /// Nothing to execute: ID 0 without arguments.
    pub(super) fn idle_command(&mut self) {
        self.command = 0;
        self.arguments = [0.0; 6];
    }

    pub(super) fn set_point(&mut self, on: bool) {
        self.motion.set(MotionControlFlags::SET_POINT, on);
    }
}
