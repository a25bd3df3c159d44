//! Settings of motion that are in force. The commands that change them are motion commands, which wait in
//! the queue: what these requests tell is what the robot has come to.

use std::format;

use super::requests;
use crate::link::text::answer::Answer;
use crate::link::text::client::Client;
use crate::link::text::error::AnswerError;
use crate::wire::meca500::text::value::{self, ConfTurn, JointLimits, Posture, TorqueLimitsCfg};

requests! {
    /// GetBlending, in percent.
    get_blending, "GetBlending", f64, value::number;
    /// GetJointVel, in percent of the rated velocities.
    get_joint_vel, "GetJointVel", f64, value::number;
    /// GetJointVelLimit, in percent of the rated velocities.
    get_joint_vel_limit, "GetJointVelLimit", f64, value::number;
    /// GetJointAcc, in percent.
    get_joint_acc, "GetJointAcc", f64, value::number;
    /// GetCartLinVel, in mm/s.
    get_cart_lin_vel, "GetCartLinVel", f64, value::number;
    /// GetCartAngVel, in degrees a second.
    get_cart_ang_vel, "GetCartAngVel", f64, value::number;
    /// GetCartAcc, in percent.
    get_cart_acc, "GetCartAcc", f64, value::number;
    /// GetVelTimeout, in seconds.
    get_vel_timeout, "GetVelTimeout", f64, value::number;
    /// GetTimeScaling, in percent.
    get_time_scaling, "GetTimeScaling", f64, value::number;
    /// GetAutoConf: whether the robot chooses its posture.
    get_auto_conf, "GetAutoConf", bool, value::flag;
    /// GetAutoConfTurn: whether the robot chooses the turn of joint 6.
    get_auto_conf_turn, "GetAutoConfTurn", bool, value::flag;
    /// GetConf: the posture that was asked for, `None` while the robot chooses it.
    get_conf, "GetConf", Option<Posture>, Posture::read;
    /// GetConfTurn: the turn that was asked for, `None` while the robot chooses it.
    get_conf_turn, "GetConfTurn", Option<ConfTurn>, ConfTurn::read;
    /// GetTrf: the tool frame, in mm and degrees.
    get_trf, "GetTrf", [f64; 6], value::numbers;
    /// GetWrf: the world frame, in mm and degrees.
    get_wrf, "GetWrf", [f64; 6], value::numbers;
    /// GetPayload: mass in kg, centre of mass in mm.
    get_payload, "GetPayload", [f64; 4], value::numbers;
    /// GetMoveMode: 0 by velocity, 1 by duration.
    get_move_mode, "GetMoveMode", u8, value::integer;
    /// GetMoveDuration, in seconds.
    get_move_duration, "GetMoveDuration", f64, value::number;
    /// GetTorqueLimits, in percent of the largest.
    get_torque_limits, "GetTorqueLimits", [f64; 6], value::numbers;
    /// GetTorqueLimitsCfg.
    get_torque_limits_cfg, "GetTorqueLimitsCfg", TorqueLimitsCfg, TorqueLimitsCfg::read;
    /// GetJointLimitsCfg: whether limits that a user has set are in force.
    get_joint_limits_cfg, "GetJointLimitsCfg", bool, value::flag;
}

impl Client {
    /// GetJointLimits: limits of a joint, 1 to 6, that are in force.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn get_joint_limits(&self, joint: u8) -> Result<Answer<JointLimits>, AnswerError> {
        self.ask(&format!("GetJointLimits({joint})"), JointLimits::read)
    }

    /// GetModelJointLimits: limits that a joint, 1 to 6, is built with.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn get_model_joint_limits(&self, joint: u8) -> Result<Answer<JointLimits>, AnswerError> {
        self.ask(&format!("GetModelJointLimits({joint})"), JointLimits::read)
    }
}
