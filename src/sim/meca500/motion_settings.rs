//! The settings that travel in the motion queue and are set back by every deactivation.
//!
//! A setting takes effect for the commands after it, in the order of the queue: what is reported is
//! the value in force, not the last one sent (PM L4203).

use super::kinematics::{Frames, Joints, Posture, turn_of};
use super::pose::Pose;
use crate::wire::meca500::command::{
    Conf, ConfSign, MotionCommand, MoveMode, Payload, Pose as WirePose, Severity, TorqueDetection,
    TorqueSeverity,
};

/// Values of the queued settings, with the defaults of rule 39.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionSettings {
    /// SetBlending, in percent.
    pub blending: f32,
    /// SetJointVel, in percent.
    pub joint_vel: f32,
    /// SetJointAcc, in percent.
    pub joint_acc: f32,
    /// SetCartLinVel, in mm/s.
    pub cart_lin_vel: f32,
    /// SetCartAngVel, in deg/s.
    pub cart_ang_vel: f32,
    /// SetCartAcc, in percent.
    pub cart_acc: f32,
    /// SetJointVelLimit, in percent.
    pub joint_vel_limit: f32,
    /// SetVelTimeout, in s.
    pub vel_timeout: f32,
    /// SetMoveMode.
    pub move_mode: MoveMode,
    /// SetMoveDuration, in s.
    pub move_duration: f32,
    /// SetMoveDurationCfg.
    pub move_duration_severity: Severity,
    /// SetTorqueLimits, in percent.
    pub torque_limits: [f32; 6],
    /// SetTorqueLimitsCfg, severity.
    pub torque_severity: TorqueSeverity,
    /// SetTorqueLimitsCfg, detection.
    pub torque_detection: TorqueDetection,
    /// SetConf; `None` while the posture is chosen automatically.
    pub conf: Option<Posture>,
    /// SetConfTurn; `None` while the turn is chosen automatically.
    pub conf_turn: Option<i32>,
    /// SetPayload.
    pub payload: Payload,
    /// SetTrf as it was given.
    pub trf: WirePose,
    /// SetWrf as it was given.
    pub wrf: WirePose,
    /// The two frames, ready for use.
    pub(super) frames: Frames,
    /// SetGripperForce, in percent.
    pub gripper_force: f32,
    /// SetGripperVel, in percent.
    pub gripper_vel: f32,
    /// SetGripperRange: closed and open, in mm; `None` for the range found by homing.
    pub gripper_range: Option<[f32; 2]>,
}

impl Default for MotionSettings {
    fn default() -> Self {
        Self {
            blending: 100.0,
            joint_vel: 25.0,
            joint_acc: 100.0,
            cart_lin_vel: 150.0,
            cart_ang_vel: 45.0,
            cart_acc: 50.0,
            joint_vel_limit: 100.0,
            vel_timeout: 0.05,
            move_mode: MoveMode::VelocityBased,
            move_duration: 3.0,
            move_duration_severity: Severity::Error,
            torque_limits: [100.0; 6],
            torque_severity: TorqueSeverity::None,
            torque_detection: TorqueDetection::Deviation,
            conf: None,
            conf_turn: None,
            payload: Payload::default(),
            trf: WirePose::default(),
            wrf: WirePose::default(),
            frames: Frames::default(),
            gripper_force: 50.0,
            gripper_vel: 40.0,
            gripper_range: None,
        }
    }
}

/// Whether a setting lets two moves blend across it. Source: PM L2373, L2577, L2923, L2984.
pub(super) const fn stops_the_robot(command: &MotionCommand) -> bool {
    matches!(
        command,
        MotionCommand::SetJointAcc(_)
            | MotionCommand::SetCartAcc(_)
            | MotionCommand::SetTrf(_)
            | MotionCommand::SetWrf(_)
    )
}

impl MotionSettings {
    /// Applies a queued setting; `joints` are those at its place in the queue. Returns whether the
    /// command was a setting.
    pub(super) fn apply(&mut self, command: &MotionCommand, joints: &Joints) -> bool {
        match *command {
            MotionCommand::SetBlending(p) => self.blending = p,
            MotionCommand::SetJointVel(p) => self.joint_vel = p,
            MotionCommand::SetJointAcc(p) => self.joint_acc = p,
            MotionCommand::SetCartAngVel(omega) => self.cart_ang_vel = omega,
            MotionCommand::SetCartLinVel(v) => self.cart_lin_vel = v,
            MotionCommand::SetCartAcc(p) => self.cart_acc = p,
            MotionCommand::SetTrf(pose) => {
                self.trf = pose;
                self.frames.trf = frame(pose);
            }
            MotionCommand::SetWrf(pose) => {
                self.wrf = pose;
                self.frames.wrf = frame(pose);
            }
            MotionCommand::SetConf(conf) => self.conf = posture(conf),
            MotionCommand::SetAutoConf(automatic) => {
                self.conf = (!automatic).then(|| Posture::of(joints));
            }
            MotionCommand::SetConfTurn(c_t) => self.conf_turn = Some(c_t.into()),
            MotionCommand::SetAutoConfTurn(automatic) => {
                self.conf_turn = (!automatic).then(|| turn_of(joints[5]));
            }
            MotionCommand::SetVelTimeout(t) => self.vel_timeout = t,
            MotionCommand::SetTorqueLimits(tau) => self.torque_limits = tau,
            MotionCommand::SetTorqueLimitsCfg { severity, detection } => {
                self.torque_severity = severity;
                self.torque_detection = detection;
            }
            MotionCommand::SetJointVelLimit(p) => self.joint_vel_limit = p,
            MotionCommand::SetMoveMode(mode) => self.move_mode = mode,
            MotionCommand::SetMoveDurationCfg(severity) => self.move_duration_severity = severity,
            MotionCommand::SetMoveDuration(t) => self.move_duration = t,
            MotionCommand::SetPayload(payload) => self.payload = payload,
            MotionCommand::SetGripperForce(p) => self.gripper_force = p,
            MotionCommand::SetGripperVel(p) => {
                // Above 100 only at full force (PM L6616).
                let most = if self.gripper_force >= 100.0 { 200.0 } else { 100.0 };
                self.gripper_vel = p.min(most);
            }
            MotionCommand::SetGripperRange { d_closed, d_open } => {
                let restores = d_closed == 0.0 && d_open == 0.0;
                self.gripper_range = (!restores).then_some([d_closed, d_open]);
            }
            _ => return false,
        }
        true
    }
}

/// The wire's pose as the geometry's.
pub(super) fn frame(pose: WirePose) -> Pose {
    Pose::from_xyz_euler(<[f32; 6]>::from(pose).map(f64::from))
}

fn posture(conf: Conf) -> Option<Posture> {
    let number = |sign: ConfSign| match sign {
        ConfSign::Minus => -1,
        ConfSign::Plus => 1,
    };
    Posture::from_numbers([number(conf.c_s), number(conf.c_e), number(conf.c_w)])
}
