//! Motion commands to the ID and six Reals of the wire, and back.

use super::arguments::{
    Conf, ConfSign, GripperAction, MoveMode, Payload, Severity, ToolSphere, TorqueDetection,
    TorqueSeverity, ValveAction, WorkZoneLimits, WorkZoneMode, exact_integer,
};
use super::id::MotionCommandId as Id;
use super::motion::MotionCommand;

const NONE: [f32; 6] = [0.0; 6];

const fn one(value: f32) -> [f32; 6] {
    [value, 0.0, 0.0, 0.0, 0.0, 0.0]
}

const fn two(first: f32, second: f32) -> [f32; 6] {
    [first, second, 0.0, 0.0, 0.0, 0.0]
}

fn flag(on: bool) -> [f32; 6] {
    one(f32::from(u8::from(on)))
}

fn is_set(value: f32) -> Option<bool> {
    match exact_integer(value)? {
        0 => Some(false),
        1 => Some(true),
        _ => None,
    }
}

fn integer<T: TryFrom<i32>>(value: f32) -> Option<T> {
    exact_integer(value).and_then(|integer| T::try_from(integer).ok())
}

impl MotionCommand {
    /// The ID and the six arguments of the wire. Arguments a command does not have are 0.
    #[must_use]
    pub fn encode(&self) -> (Id, [f32; 6]) {
        match *self {
            Self::NoMovement => (Id::NO_MOVEMENT, NONE),
            Self::MoveJoints(joints) => (Id::MOVE_JOINTS, joints),
            Self::MovePose(pose) => (Id::MOVE_POSE, pose.into()),
            Self::MoveLin(pose) => (Id::MOVE_LIN, pose.into()),
            Self::MoveLinRelTrf(pose) => (Id::MOVE_LIN_REL_TRF, pose.into()),
            Self::MoveLinRelWrf(pose) => (Id::MOVE_LIN_REL_WRF, pose.into()),
            Self::Delay(t) => (Id::DELAY, one(t)),
            Self::SetBlending(p) => (Id::SET_BLENDING, one(p)),
            Self::SetJointVel(p) => (Id::SET_JOINT_VEL, one(p)),
            Self::SetJointAcc(p) => (Id::SET_JOINT_ACC, one(p)),
            Self::SetCartAngVel(omega) => (Id::SET_CART_ANG_VEL, one(omega)),
            Self::SetCartLinVel(v) => (Id::SET_CART_LIN_VEL, one(v)),
            Self::SetCartAcc(p) => (Id::SET_CART_ACC, one(p)),
            Self::SetTrf(pose) => (Id::SET_TRF, pose.into()),
            Self::SetWrf(pose) => (Id::SET_WRF, pose.into()),
            Self::SetConf(Conf { c_s, c_e, c_w }) => {
                (Id::SET_CONF, [c_s.to_real(), c_e.to_real(), c_w.to_real(), 0.0, 0.0, 0.0])
            }
            Self::SetAutoConf(e) => (Id::SET_AUTO_CONF, flag(e)),
            Self::SetCheckpoint(n) => (Id::SET_CHECKPOINT, one(f32::from(n))),
            Self::Gripper(action) => (Id::GRIPPER, one(action.to_real())),
            Self::SetGripperVel(p) => (Id::SET_GRIPPER_VEL, one(p)),
            Self::SetGripperForce(p) => (Id::SET_GRIPPER_FORCE, one(p)),
            Self::MoveJointsVel(omega) => (Id::MOVE_JOINTS_VEL, omega),
            Self::MoveLinVelWrf(velocity) => (Id::MOVE_LIN_VEL_WRF, velocity),
            Self::MoveLinVelTrf(velocity) => (Id::MOVE_LIN_VEL_TRF, velocity),
            Self::SetVelTimeout(t) => (Id::SET_VEL_TIMEOUT, one(t)),
            Self::SetConfTurn(c_t) => (Id::SET_CONF_TURN, one(f32::from(c_t))),
            Self::SetAutoConfTurn(e) => (Id::SET_AUTO_CONF_TURN, flag(e)),
            Self::SetTorqueLimits(tau) => (Id::SET_TORQUE_LIMITS, tau),
            Self::SetTorqueLimitsCfg { severity, detection } => {
                (Id::SET_TORQUE_LIMITS_CFG, two(severity.to_real(), detection.to_real()))
            }
            Self::MoveJointsRel(steps) => (Id::MOVE_JOINTS_REL, steps),
            Self::SetValveState([v1, v2]) => (Id::SET_VALVE_STATE, two(v1.to_real(), v2.to_real())),
            Self::SetGripperRange { d_closed, d_open } => {
                (Id::SET_GRIPPER_RANGE, two(d_closed, d_open))
            }
            Self::MoveGripper(d) => (Id::MOVE_GRIPPER, one(d)),
            Self::SetJointVelLimit(p) => (Id::SET_JOINT_VEL_LIMIT, one(p)),
            Self::SetTimeScaling(p) => (Id::SET_TIME_SCALING, one(p)),
            Self::SetMoveMode(mode) => (Id::SET_MOVE_MODE, one(mode.to_real())),
            Self::SetMoveDurationCfg(severity) => {
                (Id::SET_MOVE_DURATION_CFG, one(severity.to_real()))
            }
            Self::SetMoveDuration(t) => (Id::SET_MOVE_DURATION, one(t)),
            Self::SetPayload(Payload { m, c_x, c_y, c_z }) => {
                (Id::SET_PAYLOAD, [m, c_x, c_y, c_z, 0.0, 0.0])
            }
            Self::StartProgram(number) => (Id::START_PROGRAM, one(f32::from(number))),
            Self::SetJointLimits { n, q_min, q_max } => {
                (Id::SET_JOINT_LIMITS, [f32::from(n), q_min, q_max, 0.0, 0.0, 0.0])
            }
            Self::SetJointLimitsCfg(e) => (Id::SET_JOINT_LIMITS_CFG, flag(e)),
            Self::SetWorkZoneCfg { severity, mode } => {
                (Id::SET_WORK_ZONE_CFG, two(severity.to_real(), mode.to_real()))
            }
            Self::SetWorkZoneLimits(WorkZoneLimits {
                x_min,
                y_min,
                z_min,
                x_max,
                y_max,
                z_max,
            }) => (Id::SET_WORK_ZONE_LIMITS, [x_min, y_min, z_min, x_max, y_max, z_max]),
            Self::SetCollisionCfg(severity) => (Id::SET_COLLISION_CFG, one(severity.to_real())),
            Self::SetToolSphere(ToolSphere { x, y, z, r }) => {
                (Id::SET_TOOL_SPHERE, [x, y, z, r, 0.0, 0.0])
            }
            Self::SetCalibrationCfg(e) => (Id::SET_CALIBRATION_CFG, flag(e)),
            Self::RebootRobot => (Id::REBOOT_ROBOT, NONE),
            Self::ClearHoming => (Id::CLEAR_HOMING, NONE),
            Self::SetVariable { cyclic_id, values, count } => {
                let mut arguments = NONE;
                for (argument, value) in arguments.iter_mut().zip(values).take(count.into()) {
                    *argument = value;
                }
                (Id(u32::from(cyclic_id)), arguments)
            }
            Self::Raw { id, arguments } => (id, arguments),
        }
    }

    /// The command that an ID and six arguments mean. Never refuses: what no typed variant holds
    /// exactly (an ID of no entry, a checkpoint of 1.5, a choice without meaning) stays
    /// [`MotionCommand::Raw`].
    ///
    /// Arguments a command does not have are ignored, as the robot does (PM L1232; for the IDs
    /// without a dagger in Table 8 this is `Unverified:`). Values are not checked.
    #[must_use]
    pub fn decode(id: Id, arguments: [f32; 6]) -> Self {
        Self::decode_typed(id, arguments).unwrap_or(Self::Raw { id, arguments })
    }

    fn decode_typed(id: Id, arguments: [f32; 6]) -> Option<Self> {
        let [a1, a2, a3, a4, _, _] = arguments;
        Some(match id {
            Id::NO_MOVEMENT => Self::NoMovement,
            Id::MOVE_JOINTS => Self::MoveJoints(arguments),
            Id::MOVE_POSE => Self::MovePose(arguments.into()),
            Id::MOVE_LIN => Self::MoveLin(arguments.into()),
            Id::MOVE_LIN_REL_TRF => Self::MoveLinRelTrf(arguments.into()),
            Id::MOVE_LIN_REL_WRF => Self::MoveLinRelWrf(arguments.into()),
            Id::DELAY => Self::Delay(a1),
            Id::SET_BLENDING => Self::SetBlending(a1),
            Id::SET_JOINT_VEL => Self::SetJointVel(a1),
            Id::SET_JOINT_ACC => Self::SetJointAcc(a1),
            Id::SET_CART_ANG_VEL => Self::SetCartAngVel(a1),
            Id::SET_CART_LIN_VEL => Self::SetCartLinVel(a1),
            Id::SET_CART_ACC => Self::SetCartAcc(a1),
            Id::SET_TRF => Self::SetTrf(arguments.into()),
            Id::SET_WRF => Self::SetWrf(arguments.into()),
            Id::SET_CONF => Self::SetConf(Conf {
                c_s: ConfSign::from_real(a1)?,
                c_e: ConfSign::from_real(a2)?,
                c_w: ConfSign::from_real(a3)?,
            }),
            Id::SET_AUTO_CONF => Self::SetAutoConf(is_set(a1)?),
            Id::SET_CHECKPOINT => Self::SetCheckpoint(integer(a1)?),
            Id::GRIPPER => Self::Gripper(GripperAction::from_real(a1)?),
            Id::SET_GRIPPER_VEL => Self::SetGripperVel(a1),
            Id::SET_GRIPPER_FORCE => Self::SetGripperForce(a1),
            Id::MOVE_JOINTS_VEL => Self::MoveJointsVel(arguments),
            Id::MOVE_LIN_VEL_WRF => Self::MoveLinVelWrf(arguments),
            Id::MOVE_LIN_VEL_TRF => Self::MoveLinVelTrf(arguments),
            Id::SET_VEL_TIMEOUT => Self::SetVelTimeout(a1),
            Id::SET_CONF_TURN => Self::SetConfTurn(integer(a1)?),
            Id::SET_AUTO_CONF_TURN => Self::SetAutoConfTurn(is_set(a1)?),
            Id::SET_TORQUE_LIMITS => Self::SetTorqueLimits(arguments),
            Id::SET_TORQUE_LIMITS_CFG => Self::SetTorqueLimitsCfg {
                severity: TorqueSeverity::from_real(a1)?,
                detection: TorqueDetection::from_real(a2)?,
            },
            Id::MOVE_JOINTS_REL => Self::MoveJointsRel(arguments),
            Id::SET_VALVE_STATE => {
                Self::SetValveState([ValveAction::from_real(a1)?, ValveAction::from_real(a2)?])
            }
            Id::SET_GRIPPER_RANGE => Self::SetGripperRange { d_closed: a1, d_open: a2 },
            Id::MOVE_GRIPPER => Self::MoveGripper(a1),
            Id::SET_JOINT_VEL_LIMIT => Self::SetJointVelLimit(a1),
            Id::SET_TIME_SCALING => Self::SetTimeScaling(a1),
            Id::SET_MOVE_MODE => Self::SetMoveMode(MoveMode::from_real(a1)?),
            Id::SET_MOVE_DURATION_CFG => Self::SetMoveDurationCfg(Severity::from_real(a1)?),
            Id::SET_MOVE_DURATION => Self::SetMoveDuration(a1),
            Id::SET_PAYLOAD => Self::SetPayload(Payload { m: a1, c_x: a2, c_y: a3, c_z: a4 }),
            Id::START_PROGRAM => Self::StartProgram(integer(a1)?),
            Id::SET_JOINT_LIMITS => Self::SetJointLimits { n: integer(a1)?, q_min: a2, q_max: a3 },
            Id::SET_JOINT_LIMITS_CFG => Self::SetJointLimitsCfg(is_set(a1)?),
            Id::SET_WORK_ZONE_CFG => Self::SetWorkZoneCfg {
                severity: Severity::from_real(a1)?,
                mode: WorkZoneMode::from_real(a2)?,
            },
            Id::SET_WORK_ZONE_LIMITS => {
                let [x_min, y_min, z_min, x_max, y_max, z_max] = arguments;
                let limits = WorkZoneLimits { x_min, y_min, z_min, x_max, y_max, z_max };
                Self::SetWorkZoneLimits(limits)
            }
            Id::SET_COLLISION_CFG => Self::SetCollisionCfg(Severity::from_real(a1)?),
            Id::SET_TOOL_SPHERE => Self::SetToolSphere(ToolSphere { x: a1, y: a2, z: a3, r: a4 }),
            Id::SET_CALIBRATION_CFG => Self::SetCalibrationCfg(is_set(a1)?),
            Id::REBOOT_ROBOT => Self::RebootRobot,
            Id::CLEAR_HOMING => Self::ClearHoming,
            _ if id.is_variable() => Self::SetVariable {
                cyclic_id: u16::try_from(id.0).ok()?,
                values: arguments,
                count: 6,
            },
            _ => return None,
        })
    }
}
