//! Where the robot is and where it should be: real-time data, each with its time.

use super::requests;
use crate::link::text::answer::Answer;
use crate::link::text::client::Client;
use crate::link::text::error::AnswerError;
use crate::wire::meca500::text::value::{self, ConfTurn, Posture, Stamped};

/// Six numbers and their time.
type Six = Stamped<[f64; 6]>;

requests! {
    /// GetRtTargetJointPos: where the joints should be, in degrees.
    get_rt_target_joint_pos, "GetRtTargetJointPos", Six, Six::numbers;
    /// GetRtTargetCartPos: where the tool should be in the world frame: x, y, z in mm, then three Euler
    /// angles in degrees.
    get_rt_target_cart_pos, "GetRtTargetCartPos", Six, Six::numbers;
    /// GetRtTargetJointVel, in degrees a second.
    get_rt_target_joint_vel, "GetRtTargetJointVel", Six, Six::numbers;
    /// GetRtTargetJointTorq, in percent of the largest.
    get_rt_target_joint_torq, "GetRtTargetJointTorq", Six, Six::numbers;
    /// GetRtTargetCartVel: three velocities in mm/s, three in degrees a second.
    get_rt_target_cart_vel, "GetRtTargetCartVel", Six, Six::numbers;
    /// GetRtTargetConf: the posture that the robot should have.
    get_rt_target_conf, "GetRtTargetConf", Stamped<Posture>, Stamped::posture;
    /// GetRtTargetConfTurn: the turn that joint 6 should have.
    get_rt_target_conf_turn, "GetRtTargetConfTurn", Stamped<ConfTurn>, Stamped::turn;
    /// GetRtJointPos: where the joints are, in degrees.
    get_rt_joint_pos, "GetRtJointPos", Six, Six::numbers;
    /// GetRtCartPos: where the tool is in the world frame: x, y, z in mm, then three Euler angles in
    /// degrees.
    get_rt_cart_pos, "GetRtCartPos", Six, Six::numbers;
    /// GetRtJointVel, in degrees a second.
    get_rt_joint_vel, "GetRtJointVel", Six, Six::numbers;
    /// GetRtJointTorq, in percent of the largest.
    get_rt_joint_torq, "GetRtJointTorq", Six, Six::numbers;
    /// GetRtCartVel: three velocities in mm/s, three in degrees a second.
    get_rt_cart_vel, "GetRtCartVel", Six, Six::numbers;
    /// GetRtConf: the posture that the robot has.
    get_rt_conf, "GetRtConf", Stamped<Posture>, Stamped::posture;
    /// GetRtConfTurn: the turn that joint 6 has.
    get_rt_conf_turn, "GetRtConfTurn", Stamped<ConfTurn>, Stamped::turn;
    /// GetRtWrf: the world frame in force, in mm and degrees.
    get_rt_wrf, "GetRtWrf", Six, Six::numbers;
    /// GetRtTrf: the tool frame in force, in mm and degrees.
    get_rt_trf, "GetRtTrf", Six, Six::numbers;
    /// GetJoints: as GetRtTargetJointPos, without a time, and with four decimal places. Source: PM L5563.
    get_joints, "GetJoints", [f64; 6], value::numbers;
    /// GetPose: as GetRtTargetCartPos, without a time, and with four decimal places. Source: PM L5467.
    get_pose, "GetPose", [f64; 6], value::numbers;
}

impl Client {
    /// GetRtAccelerometer, of link 5, the only one with a sensor: its number, and the acceleration in
    /// 1/16000 of the standard gravity. Source: PM L5256.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn get_rt_accelerometer(&self) -> Result<Answer<Stamped<[f64; 4]>>, AnswerError> {
        self.ask("GetRtAccelerometer(5)", Stamped::numbers)
    }
}
