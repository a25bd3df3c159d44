//! From queued commands to planned moves: what the robot does about 25 commands ahead.
//!
//! A move is planned from where the one before it ends, with the settings at its place in the queue.
//! What is wrong with it comes to light here and is raised when its turn comes.
//! Source: PM L5231, L371-381.

use super::kinematics::Joints;
use super::motion::{
    FULL_ANGULAR_ACCELERATION, FULL_JOINT_ACCELERATION, FULL_LINEAR_ACCELERATION, JointLimits,
    JointSettings, LinearSettings, Pace, Plan, PlanError, TOP_VELOCITY_R3, TOP_VELOCITY_R4,
    VelocitySettings, plan_joint_move, plan_linear_move, plan_pose_move, velocity_limits,
};
use super::motion_settings::{MotionSettings, frame};
use super::queue::{Item, Step};
use super::robot::VirtualRobot;
use crate::sim::meca500::event::RobotEvent;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::command::{
    CommandKind, MotionCommand, MoveMode, Severity, VelocityCommand,
};
use crate::wire::meca500::revision::Revision;

/// Moves planned in one step of time, so that a full queue does not make one cycle long.
const PLANS_PER_STEP: usize = 2;

/// Velocities, accelerations and limits in force, recovery mode considered.
#[derive(Clone, Copy, Debug)]
struct Pacing {
    limits: JointLimits,
    joint_velocity: Joints,
    joint_velocity_limit: Joints,
    joint_acceleration: Joints,
    linear_velocity: f64,
    angular_velocity: f64,
    cart_acceleration: f64,
    pace: Pace,
    capped: bool,
}

/// The code of a move that cannot be planned. Source: PM Table 1, and `PlanError`'s documentation.
const fn code_of(error: &PlanError) -> Code {
    match error {
        PlanError::JointOverLimit(_) => Code::JOINT_OVER_LIMIT,
        PlanError::OutOfReach
        | PlanError::OutOfReachOnPath { .. }
        | PlanError::LimitOnPath { .. } => Code::OUT_OF_REACH,
        PlanError::Singularity { .. } => Code(1012),
        PlanError::HalfTurn => Code(1010),
        PlanError::StartMismatch => Code::START_CONF_MISMATCH,
        PlanError::BadNumber => Code::ARGUMENT_ERROR,
    }
}

impl VirtualRobot {
    /// Compiles what has room, a few moves at a time.
    pub(super) fn compile_ahead(&mut self) {
        let mut plans = 0;
        while plans < PLANS_PER_STEP
            && let Some(item) = self.queue.next_to_compile()
        {
            let command = match item {
                Item::ProgramBegin(number) => {
                    self.queue.compile_next(Step::ProgramBegin(number));
                    continue;
                }
                Item::ProgramEnd(number) => {
                    self.queue.compile_next(Step::ProgramEnd(number));
                    continue;
                }
                Item::ProgramAgain => {
                    self.queue.compile_next(Step::ProgramAgain);
                    continue;
                }
                Item::Command(command) => command,
            };
            if let MotionCommand::StartProgram(number) = command {
                self.queue.take_next();
                self.expand_program(number);
                continue;
            }
            let needs_joints = is_move(&command)
                || matches!(
                    command,
                    MotionCommand::SetAutoConf(_) | MotionCommand::SetAutoConfTurn(_)
                );
            if needs_joints && (self.velocity.is_some() || self.queue.end_is_unknown()) {
                return;
            }
            plans += usize::from(is_move(&command));
            let step = self.compile(&command);
            self.queue.compile_next(step);
        }
    }

    fn compile(&mut self, command: &MotionCommand) -> Step {
        if self.ahead.settings.apply(command, &self.ahead.joints) {
            return Step::Setting(*command, self.ahead.joints);
        }
        match *command {
            MotionCommand::SetCheckpoint(n) => Step::Checkpoint(n),
            MotionCommand::Delay(seconds) => Step::Delay(seconds.into()),
            MotionCommand::Gripper(_)
            | MotionCommand::MoveGripper(_)
            | MotionCommand::SetValveState(_) => Step::Tool(*command),
            _ if is_move(command) => self.compile_move(command),
            _ => match VelocityCommand::try_from(*command) {
                Ok(velocity) => Step::Velocity(velocity),
                Err(_) => Step::Immediate(*command),
            },
        }
    }

    fn compile_move(&mut self, command: &MotionCommand) -> Step {
        let settings = self.ahead.settings;
        let pacing = self.pacing(&settings);
        if pacing.capped {
            self.events.push(RobotEvent::RecoveryCap);
        }
        let plan = match plan(command, &self.ahead.joints, &settings, &pacing) {
            Ok(plan) => plan,
            Err(error) => return Step::Fail(code_of(&error)),
        };
        if plan.shortest_duration_s().is_some() {
            match settings.move_duration_severity {
                Severity::Silent => {}
                Severity::Warning => {
                    self.events.push(RobotEvent::Warning(Code::MOVE_DURATION_TOO_SHORT));
                }
                Severity::Error => return Step::Fail(Code::MOVE_DURATION_TOO_SHORT),
            }
        }
        self.ahead.joints = plan.end();
        Step::Move {
            space: plan.space(),
            blending: f64::from(settings.blending) / 100.0,
            plan: Some(plan.into()),
        }
    }

    /// Top velocities of the revision, in deg/s.
    fn top_velocity(&self) -> &'static Joints {
        match self.settings.revision {
            Revision::R3 => &TOP_VELOCITY_R3,
            Revision::R4 => &TOP_VELOCITY_R4,
        }
    }

    fn pacing(&self, settings: &MotionSettings) -> Pacing {
        let mut joint_percent = f64::from(settings.joint_vel);
        let mut limit_percent = f64::from(settings.joint_vel_limit);
        let mut acceleration = f64::from(settings.joint_acc);
        let mut linear_velocity = f64::from(settings.cart_lin_vel);
        let mut angular_velocity = f64::from(settings.cart_ang_vel);
        let mut cart_acceleration = f64::from(settings.cart_acc) / 100.0;
        let mut capped = false;
        if self.boot.recovery_mode {
            let caps = &self.settings.recovery_caps;
            let mut cap = |value: &mut f64, most: f64| {
                capped |= *value > most;
                *value = value.min(most);
            };
            cap(&mut joint_percent, caps.joint_velocity_percent);
            cap(&mut acceleration, caps.joint_acceleration_percent);
            cap(&mut linear_velocity, caps.linear_velocity_mm_per_s);
            cap(&mut angular_velocity, caps.angular_velocity_deg_per_s);
            cap(&mut cart_acceleration, caps.cart_acceleration_percent / 100.0);
            limit_percent = limit_percent.min(caps.joint_velocity_percent);
        }
        let top = self.top_velocity();
        let joint_velocity_limit = velocity_limits(limit_percent, top);
        let pace = match settings.move_mode {
            MoveMode::VelocityBased => Pace::Velocity,
            MoveMode::TimeBased => Pace::Duration(settings.move_duration.into()),
        };
        let joint_velocity = match pace {
            Pace::Velocity => velocity_limits(joint_percent.min(limit_percent), top),
            Pace::Duration(_) => joint_velocity_limit,
        };
        Pacing {
            limits: self.joint_limits(),
            joint_velocity,
            joint_velocity_limit,
            joint_acceleration: FULL_JOINT_ACCELERATION.map(|full| full * acceleration / 100.0),
            linear_velocity,
            angular_velocity,
            cart_acceleration,
            pace,
            capped,
        }
    }

    /// The joint limits in force: recovery mode leaves only the model's. Source: PM L3838.
    pub(super) fn joint_limits(&self) -> JointLimits {
        if self.boot.recovery_mode {
            JointLimits::MODEL
        } else {
            self.settings.persistent.effective_joint_limits()
        }
    }

    /// What velocity mode obeys now.
    pub(super) fn velocity_settings(&self) -> VelocitySettings {
        let settings = &self.motion_settings;
        let pacing = self.pacing(settings);
        VelocitySettings {
            limits: pacing.limits,
            joint_velocity: pacing.joint_velocity_limit,
            joint_acceleration: pacing.joint_acceleration,
            linear_acceleration: FULL_LINEAR_ACCELERATION * pacing.cart_acceleration,
            angular_acceleration: FULL_ANGULAR_ACCELERATION * pacing.cart_acceleration,
            frames: settings.frames,
            posture: settings.conf,
            turn: settings.conf_turn,
        }
    }
}

/// Whether the command is a position-mode move.
pub(super) const fn is_move(command: &MotionCommand) -> bool {
    matches!(
        command,
        MotionCommand::MoveJoints(_)
            | MotionCommand::MoveJointsRel(_)
            | MotionCommand::MovePose(_)
            | MotionCommand::MoveLin(_)
            | MotionCommand::MoveLinRelTrf(_)
            | MotionCommand::MoveLinRelWrf(_)
    )
}

/// Whether a command waits in the queue.
pub(super) fn is_queued(command: &MotionCommand) -> bool {
    command.spec().is_some_and(|spec| spec.kind == CommandKind::Queued)
}

fn plan(
    command: &MotionCommand,
    start: &Joints,
    settings: &MotionSettings,
    pacing: &Pacing,
) -> Result<Plan, PlanError> {
    let joint = JointSettings {
        limits: pacing.limits,
        velocity: pacing.joint_velocity,
        acceleration: pacing.joint_acceleration,
        pace: pacing.pace,
    };
    let frames = &settings.frames;
    let target = match *command {
        MotionCommand::MoveJoints(joints) => {
            return plan_joint_move(start, &joints.map(f64::from), &joint).map(Plan::from);
        }
        MotionCommand::MoveJointsRel(steps) => {
            let mut end = *start;
            for (end, step) in end.iter_mut().zip(steps) {
                *end += f64::from(step);
            }
            return plan_joint_move(start, &end, &joint).map(Plan::from);
        }
        MotionCommand::MovePose(pose) => {
            let flange = frames.flange_of_tool(&frame(pose));
            let (posture, turn) = (settings.conf, settings.conf_turn);
            return plan_pose_move(start, &flange, posture, turn, &joint).map(Plan::from);
        }
        MotionCommand::MoveLin(pose) => frame(pose),
        MotionCommand::MoveLinRelTrf(offset) => {
            frames.target_relative_to_tool(start, &frame(offset))
        }
        MotionCommand::MoveLinRelWrf(offset) => {
            frames.target_relative_to_world(start, &frame(offset))
        }
        _ => return Err(PlanError::BadNumber),
    };
    let linear = LinearSettings {
        frames: *frames,
        limits: pacing.limits,
        joint_velocity: pacing.joint_velocity_limit,
        joint_acceleration: pacing.joint_acceleration,
        linear_velocity: pacing.linear_velocity,
        angular_velocity: pacing.angular_velocity,
        linear_acceleration: FULL_LINEAR_ACCELERATION * pacing.cart_acceleration,
        angular_acceleration: FULL_ANGULAR_ACCELERATION * pacing.cart_acceleration,
        pace: pacing.pace,
        posture: settings.conf,
        turn: settings.conf_turn,
    };
    plan_linear_move(start, &target, &linear).map(Plan::from)
}
