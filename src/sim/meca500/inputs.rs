//! Writing the 252 bytes. Source: PM Tables 13 to 25.

use super::kinematics::{Configuration, Frames, Joints, turn_of};
use super::lifecycle::Lifecycle;
use super::readings::HomedInRecovery;
use super::robot::VirtualRobot;
use super::safety::Safety;
use crate::wire::meca500::command::Pose;
use crate::wire::meca500::dynamic::DynamicType;
use crate::wire::meca500::image::{
    FirmwareLayout, InputImage, MotionStatusFlags, PoseBlock, PoseBlockValues, RobotStatusFlags,
};
use crate::wire::order::ImageOrder;

/// Where the arm is, in joints and as a pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    joints: Joints,
    frames: Frames,
    pose: [f32; 6],
    configuration: Configuration,
}

impl VirtualRobot {
    /// Writes the inputs of this cycle; a slice of another length is left as it is.
    pub(super) fn write_inputs<O: ImageOrder>(
        &mut self,
        shown: &[DynamicType; 4],
        bytes: &mut [u8],
    ) {
        let Ok(image) = InputImage::<O>::from_bytes_mut(bytes) else { return };
        image.robot_status.flags.set_raw(self.robot_status_flags());
        image.robot_status.error_code.set(self.error_code().0);

        let readings = self.settings.readings;
        let status = &mut image.motion_status;
        status.checkpoint_reached.set(self.checkpoint_reached);
        status.checkpoint_discarded.set(self.checkpoint_discarded);
        status.move_id.set(self.face.handshake.echo());
        let space = self.queue.space(readings.compiled_commands);
        status.fifo_space.set(u16::try_from(space).unwrap_or(u16::MAX));
        status.flags.set_raw(self.motion_status_flags());
        status.offline_program_id.set(self.program);

        let place = self.place();
        let joints = place.joints;
        for (slot, joint) in image.target_joint_set.joint.iter_mut().zip(joints) {
            slot.set(joint as f32);
        }
        let [x, y, z, alpha, beta, gamma] = place.pose;
        image.target_end_effector_pose.set_values(&PoseBlockValues { x, y, z, alpha, beta, gamma });
        let configuration = place.configuration;
        image.target_configuration.shoulder = configuration.shoulder;
        image.target_configuration.elbow = configuration.elbow;
        image.target_configuration.wrist = configuration.wrist;
        image.target_configuration.turn = i8::try_from(turn_of(joints[5])).unwrap_or(0);
        write_frame(&mut image.target_wrf, &self.motion_settings.wrf);
        write_frame(&mut image.target_trf, &self.motion_settings.trf);

        let micros = self.now.as_nanos() / 1_000;
        let timestamp = &mut image.robot_timestamp;
        timestamp.seconds.set(u32::try_from(micros / 1_000_000).unwrap_or(u32::MAX));
        timestamp.microseconds.set((micros % 1_000_000) as u32);
        timestamp.dynamic_data_cycles.set(self.face.slots.cycles());

        let revision = self.settings.revision;
        let safety = &mut image.safety_status;
        safety.signals.set_raw(self.safety.signals(&readings));
        safety.resettable.set_raw(self.safety.resettable(revision));
        safety.operation_mode = 0;
        safety.power.set_raw(self.safety.power(revision));
        safety.psu_inputs.set_raw(Default::default());

        for (slot, ty) in image.dynamic_data.iter_mut().zip(shown) {
            slot.dynamic_type.set(ty.0);
            for (place, value) in slot.value_idx.iter_mut().zip(self.dynamic_values(*ty)) {
                place.set(value);
            }
        }
        if self.settings.layout == FirmwareLayout::V10_2 {
            self.adapt_to_10_2(image);
        }
    }

    /// Where the arm is; worked out anew only when it moved or a frame changed.
    fn place(&mut self) -> Place {
        let joints = self.target_joints();
        let frames = self.motion_settings.frames;
        if let Some(place) = self.face.place
            && place.joints == joints
            && place.frames == frames
        {
            return place;
        }
        let pose = frames.tool_of_joints(&joints).to_xyz_euler().map(|value| value as f32);
        let place = Place { joints, frames, pose, configuration: Configuration::of(&joints) };
        self.face.place = Some(place);
        place
    }

    /// One 32-bit checkpoint, no MonitoringMode.
    fn adapt_to_10_2<O: ImageOrder>(&self, image: &mut InputImage<O>) {
        let checkpoint = zerocopy::byteorder::U32::<O::Int>::new(self.checkpoint_reached.into());
        let bytes = checkpoint.to_bytes();
        let [a, b, c, d] = bytes;
        image.motion_status.checkpoint_reached = zerocopy::byteorder::U16::from_bytes([a, b]);
        image.motion_status.checkpoint_discarded = zerocopy::byteorder::U16::from_bytes([c, d]);
        image.robot_status.flags.assign(RobotStatusFlags::MONITORING_MODE, false);
    }

    fn robot_status_flags(&self) -> RobotStatusFlags {
        let readings = &self.settings.readings;
        let ready_in_recovery = readings.homed_in_recovery == HomedInRecovery::Set
            && self.boot.recovery_mode
            && self.lifecycle == Lifecycle::Activated;
        let mut flags = RobotStatusFlags::empty();
        flags.set(RobotStatusFlags::BUSY, self.is_busy());
        flags.set(RobotStatusFlags::ACTIVATED, self.has_motors_on());
        flags.set(RobotStatusFlags::HOMED, self.is_homed() || ready_in_recovery);
        flags.set(RobotStatusFlags::SIM_ACTIVATED, self.simulating);
        flags.set(RobotStatusFlags::BRAKES_ENGAGED, self.has_brakes_engaged());
        flags.set(RobotStatusFlags::RECOVERY_MODE, self.boot.recovery_mode);
        let e_stop = Safety::deprecated(self.safety.e_stop, readings);
        flags.set(RobotStatusFlags::E_STOP, e_stop);
        flags.set(RobotStatusFlags::COLLISION_STATUS, self.collision_event.is_some());
        flags.set(RobotStatusFlags::WORK_ZONE_STATUS, self.zone_event.is_some());
        flags.set(RobotStatusFlags::MONITORING_MODE, self.settings.monitoring_only);
        flags
    }

    fn motion_status_flags(&self) -> MotionStatusFlags {
        let readings = &self.settings.readings;
        let mut flags = MotionStatusFlags::empty();
        flags.set(MotionStatusFlags::PAUSED, self.is_paused());
        flags.set(MotionStatusFlags::EOB, self.is_block_ended());
        flags.set(MotionStatusFlags::EOM, !self.is_moving());
        flags.set(MotionStatusFlags::CLEARED, self.cleared);
        let p_stop2 = Safety::deprecated(self.safety.p_stop2, readings);
        flags.set(MotionStatusFlags::P_STOP2, p_stop2);
        flags.set(MotionStatusFlags::EXCESSIVE_TORQUE, self.torque_exceeded);
        flags
    }
}

fn write_frame<O: ImageOrder>(block: &mut PoseBlock<O>, pose: &Pose) {
    let Pose { x, y, z, alpha, beta, gamma } = *pose;
    block.set_values(&PoseBlockValues { x, y, z, alpha, beta, gamma });
}
