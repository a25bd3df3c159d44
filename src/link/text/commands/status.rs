//! What state the robot is in.

use std::format;

use super::requests;
use crate::link::text::answer::Answer;
use crate::link::text::client::Client;
use crate::link::text::error::AnswerError;
use crate::wire::meca500::text::value::{
    self, GripperState, RobotStatus, SafetySignal, SafetyState,
};

requests! {
    /// GetStatusRobot: activated, homed, paused and so on.
    get_status_robot, "GetStatusRobot", RobotStatus, RobotStatus::read;
    /// GetStatusGripper.
    get_status_gripper, "GetStatusGripper", GripperState, GripperState::read;
    /// GetCheckpoint: the last checkpoint that was reached, 0 for none.
    get_checkpoint, "GetCheckpoint", u16, value::integer;
    /// GetCheckpointDiscarded: the last checkpoint that was discarded, 0 for none.
    get_checkpoint_discarded, "GetCheckpointDiscarded", u16, value::integer;
    /// GetCmdPendingCount: commands in the queue, without those that are compiled already (about 25). Source: PM
    /// L5229.
    get_cmd_pending_count, "GetCmdPendingCount", u32, value::integer;
    /// GetTorqueLimitsStatus: whether a torque limit is exceeded.
    get_torque_limits_status, "GetTorqueLimitsStatus", bool, value::flag;
}

impl Client {
    /// GetSafetyStopStatus: whether a stop signal is active, or gone and to be reset.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn get_safety_stop_status(
        &self,
        signal: SafetySignal,
    ) -> Result<Answer<SafetyState>, AnswerError> {
        // Any of four codes may answer, and the robot may tell of another signal meanwhile.
        let line = format!("GetSafetyStopStatus({})", signal.code().0);
        let answer = match signal {
            SafetySignal::PStop2 => const { &[SafetySignal::PStop2.code()] },
            SafetySignal::EStop => const { &[SafetySignal::EStop.code()] },
            SafetySignal::Reboot => const { &[SafetySignal::Reboot.code()] },
            SafetySignal::ConnectionDrop => const { &[SafetySignal::ConnectionDrop.code()] },
        };
        Ok(self.send_expecting(&line, answer)?.read_by(SafetyState::read))
    }
}
