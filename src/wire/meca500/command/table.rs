//! The table of motion commands: the single source of IDs, names, units and ranges.
//!
//! Where the manual leaves a range open the row is decided here, once:
//!
//! * `Delay`: no range is stated; a negative time is refused.
//! * `StartProgram`: 1 to 500. The upper bound is that of StartSaving (PM L4054); 0 is refused
//!   because OfflineProgram 0 means that none runs (PM L1449).
//! * `SetGripperVel`: up to 200. Above 100 the robot takes it only while the gripper force is set to
//!   100 % (PM L6616), which is robot state that nobody sees here.
//! * `MoveGripper`: up to 48 mm, the widest opening of the MEGP 25LS; the robot at hand may be
//!   narrower (6 mm with the MEGP 25E).
//! * `SetCheckpoint`: 1 to 8000 as stated, although the vendor's own TCP client uses numbers up to
//!   8191.
//! * `MoveJoints`: the mechanical limits (PM L174); SetJointLimits can only narrow them.

use super::id::MotionCommandId as Id;
use super::spec::{
    ArgumentRange, ArgumentSpec, Choice, CommandKind as Kind, CommandSpec, Requirement as Needs,
};
use super::unit::Unit;

const fn argument(name: &'static str, unit: Unit, range: ArgumentRange) -> ArgumentSpec {
    ArgumentSpec { name, unit, range, default: None }
}

impl ArgumentSpec {
    const fn or(mut self, default: f32) -> Self {
        self.default = Some(default);
        self
    }
}

const fn any(name: &'static str, unit: Unit) -> ArgumentSpec {
    argument(name, unit, ArgumentRange::Any)
}

const fn within(name: &'static str, unit: Unit, min: f32, max: f32) -> ArgumentSpec {
    argument(name, unit, ArgumentRange::Within { min, max })
}

const fn percent(name: &'static str, min: f32, max: f32) -> ArgumentSpec {
    within(name, Unit::Percent, min, max)
}

const fn one_of(name: &'static str, choices: &'static [Choice]) -> ArgumentSpec {
    argument(name, Unit::None, ArgumentRange::OneOf(choices))
}

const fn joint_velocity_percent(name: &'static str) -> ArgumentSpec {
    let range = ArgumentRange::WithinByRevision { min: 0.001, max_r3: 100.0, max_r4: 150.0 };
    argument(name, Unit::Percent, range)
}

const fn choice(value: i16, meaning: &'static str) -> Choice {
    Choice { value, meaning }
}

const DISABLE_ENABLE: &[Choice] = &[choice(0, "disable"), choice(1, "enable")];
const SIGN: &[Choice] = &[choice(-1, ""), choice(1, "")];
const VALVE: &[Choice] = &[choice(-1, "keep"), choice(0, "close"), choice(1, "open")];
const SEVERITY: &[Choice] = &[choice(0, "silent"), choice(1, "warning"), choice(4, "error")];
const TORQUE_SEVERITY: &[Choice] =
    &[choice(0, "none"), choice(1, "warning"), choice(2, "pause"), choice(4, "error")];
const TORQUE_DETECTION: &[Choice] = &[
    choice(0, "always"),
    choice(1, "except while accelerating"),
    choice(2, "against the expected torque"),
];
const WORK_ZONE_MODE: &[Choice] =
    &[choice(1, "flange center point"), choice(2, "tool"), choice(3, "tool and links")];
const GRIPPER: &[Choice] = &[choice(0, "GripperClose"), choice(1, "GripperOpen")];
const MOVE_MODE: &[Choice] = &[choice(0, "velocity-based"), choice(1, "time-based")];

/// Mechanical limits of joints 1 to 5 and software limit of joint 6, each (lowest, highest), in
/// degrees. Source: PM L174, L179.
pub const MODEL_JOINT_LIMITS: [(f32, f32); 6] = [
    (-175.0, 175.0),
    (-70.0, 90.0),
    (-135.0, 70.0),
    (-170.0, 170.0),
    (-115.0, 115.0),
    (-36_000.0, 36_000.0),
];

const fn joint(name: &'static str, limits: (f32, f32)) -> ArgumentSpec {
    within(name, Unit::Degree, limits.0, limits.1)
}

const JOINTS: &[ArgumentSpec] = {
    let [j1, j2, j3, j4, j5, j6] = MODEL_JOINT_LIMITS;
    &[
        joint("theta1", j1),
        joint("theta2", j2),
        joint("theta3", j3),
        joint("theta4", j4),
        joint("theta5", j5),
        joint("theta6", j6),
    ]
};

const JOINT_STEPS: &[ArgumentSpec] = &[
    any("dtheta1", Unit::Degree),
    any("dtheta2", Unit::Degree),
    any("dtheta3", Unit::Degree),
    any("dtheta4", Unit::Degree),
    any("dtheta5", Unit::Degree),
    any("dtheta6", Unit::Degree),
];

const JOINT_VELOCITIES: &[ArgumentSpec] = &[
    any("omega1", Unit::DegreePerSecond),
    any("omega2", Unit::DegreePerSecond),
    any("omega3", Unit::DegreePerSecond),
    any("omega4", Unit::DegreePerSecond),
    any("omega5", Unit::DegreePerSecond),
    any("omega6", Unit::DegreePerSecond),
];

const CARTESIAN_VELOCITIES: &[ArgumentSpec] = &[
    any("x_dot", Unit::MillimetrePerSecond),
    any("y_dot", Unit::MillimetrePerSecond),
    any("z_dot", Unit::MillimetrePerSecond),
    any("omega_x", Unit::DegreePerSecond),
    any("omega_y", Unit::DegreePerSecond),
    any("omega_z", Unit::DegreePerSecond),
];

const POSE: &[ArgumentSpec] = &[
    any("x", Unit::Millimetre),
    any("y", Unit::Millimetre),
    any("z", Unit::Millimetre),
    any("alpha", Unit::Degree),
    any("beta", Unit::Degree),
    any("gamma", Unit::Degree),
];

const FRAME: &[ArgumentSpec] = &[
    any("x", Unit::Millimetre).or(0.0),
    any("y", Unit::Millimetre).or(0.0),
    any("z", Unit::Millimetre).or(0.0),
    any("alpha", Unit::Degree).or(0.0),
    any("beta", Unit::Degree).or(0.0),
    any("gamma", Unit::Degree).or(0.0),
];

const TORQUES: &[ArgumentSpec] = &[
    percent("tau1", 0.001, 100.0).or(100.0),
    percent("tau2", 0.001, 100.0).or(100.0),
    percent("tau3", 0.001, 100.0).or(100.0),
    percent("tau4", 0.001, 100.0).or(100.0),
    percent("tau5", 0.001, 100.0).or(100.0),
    percent("tau6", 0.001, 100.0).or(100.0),
];

const VARIABLE_VALUES: &[ArgumentSpec] = &[
    any("value1", Unit::None),
    any("value2", Unit::None),
    any("value3", Unit::None),
    any("value4", Unit::None),
    any("value5", Unit::None),
    any("value6", Unit::None),
];

const fn row(
    id: Id,
    name: &'static str,
    kind: Kind,
    arguments: &'static [ArgumentSpec],
    requires: Needs,
    manual_line: u16,
) -> CommandSpec {
    CommandSpec {
        id,
        last_id: id,
        name,
        kind,
        arguments,
        min_arguments: arguments.len(),
        available: true,
        requires,
        persistent: false,
        manual_line,
    }
}

const fn queued(
    id: Id,
    name: &'static str,
    arguments: &'static [ArgumentSpec],
    manual_line: u16,
) -> CommandSpec {
    row(id, name, Kind::Queued, arguments, Needs::ReadyForMotion, manual_line)
}

const fn velocity(
    id: Id,
    name: &'static str,
    arguments: &'static [ArgumentSpec],
    manual_line: u16,
) -> CommandSpec {
    row(id, name, Kind::Velocity, arguments, Needs::ReadyForMotion, manual_line)
}

const fn configuration(
    id: Id,
    name: &'static str,
    arguments: &'static [ArgumentSpec],
    manual_line: u16,
) -> CommandSpec {
    let spec = row(id, name, Kind::Instantaneous, arguments, Needs::Deactivated, manual_line);
    CommandSpec { persistent: true, ..spec }
}

const fn lacking(id: Id, name: &'static str, kind: Kind, manual_line: u16) -> CommandSpec {
    let spec = row(id, name, kind, &[], Needs::NotStated, manual_line);
    CommandSpec { available: false, ..spec }
}

/// Every command of Table 8 in ascending order of ID, those of other robots included.
///
/// Source: PM Table 8, ranges and defaults from the commands' own chapters.
pub const COMMANDS: &[CommandSpec] = &[
    row(Id::NO_MOVEMENT, "NoMovement", Kind::NoMovement, &[], Needs::NotStated, 1161),
    queued(Id::MOVE_JOINTS, "MoveJoints", JOINTS, 2013),
    queued(Id::MOVE_POSE, "MovePose", POSE, 2250),
    queued(Id::MOVE_LIN, "MoveLin", POSE, 2104),
    queued(Id::MOVE_LIN_REL_TRF, "MoveLinRelTrf", POSE, 2140),
    queued(Id::MOVE_LIN_REL_WRF, "MoveLinRelWrf", POSE, 2167),
    queued(Id::DELAY, "Delay", &[argument("t", Unit::Second, ArgumentRange::AtLeast(0.0))], 1989),
    queued(Id::SET_BLENDING, "SetBlending", &[percent("p", 0.0, 100.0).or(100.0)], 2339),
    queued(Id::SET_JOINT_VEL, "SetJointVel", &[joint_velocity_percent("p").or(25.0)], 2609),
    queued(Id::SET_JOINT_ACC, "SetJointAcc", &[percent("p", 0.001, 150.0).or(100.0)], 2575),
    queued(
        Id::SET_CART_ANG_VEL,
        "SetCartAngVel",
        &[within("omega", Unit::DegreePerSecond, 0.001, 1000.0).or(45.0)],
        2405,
    ),
    queued(
        Id::SET_CART_LIN_VEL,
        "SetCartLinVel",
        &[within("v", Unit::MillimetrePerSecond, 0.001, 5000.0).or(150.0)],
        2437,
    ),
    queued(Id::SET_CART_ACC, "SetCartAcc", &[percent("p", 0.001, 600.0).or(50.0)], 2371),
    queued(Id::SET_TRF, "SetTrf", FRAME, 2921),
    queued(Id::SET_WRF, "SetWrf", FRAME, 2982),
    queued(
        Id::SET_CONF,
        "SetConf",
        &[one_of("c_s", SIGN), one_of("c_e", SIGN), one_of("c_w", SIGN)],
        2505,
    ),
    queued(Id::SET_AUTO_CONF, "SetAutoConf", &[one_of("e", DISABLE_ENABLE).or(1.0)], 2281),
    queued(
        Id::SET_CHECKPOINT,
        "SetCheckpoint",
        &[argument("n", Unit::None, ArgumentRange::Integer { min: 1, max: 8000 })],
        2469,
    ),
    queued(Id::GRIPPER, "Gripper", &[one_of("action", GRIPPER)], 6371),
    queued(Id::SET_GRIPPER_VEL, "SetGripperVel", &[percent("p", 5.0, 200.0).or(40.0)], 6604),
    queued(Id::SET_GRIPPER_FORCE, "SetGripperForce", &[percent("p", 5.0, 100.0).or(50.0)], 6542),
    velocity(Id::MOVE_JOINTS_VEL, "MoveJointsVel", JOINT_VELOCITIES, 2068),
    velocity(Id::MOVE_LIN_VEL_WRF, "MoveLinVelWrf", CARTESIAN_VELOCITIES, 2221),
    velocity(Id::MOVE_LIN_VEL_TRF, "MoveLinVelTrf", CARTESIAN_VELOCITIES, 2192),
    queued(
        Id::SET_VEL_TIMEOUT,
        "SetVelTimeout",
        &[within("t", Unit::Second, 0.001, 1.0).or(0.05)],
        2950,
    ),
    queued(
        Id::SET_CONF_TURN,
        "SetConfTurn",
        &[argument("c_t", Unit::None, ArgumentRange::Integer { min: -100, max: 100 })],
        2537,
    ),
    queued(Id::SET_AUTO_CONF_TURN, "SetAutoConfTurn", &[one_of("e", DISABLE_ENABLE).or(1.0)], 2311),
    queued(Id::SET_TORQUE_LIMITS, "SetTorqueLimits", TORQUES, 2840),
    queued(
        Id::SET_TORQUE_LIMITS_CFG,
        "SetTorqueLimitsCfg",
        &[one_of("l", TORQUE_SEVERITY).or(0.0), one_of("m", TORQUE_DETECTION).or(2.0)],
        2879,
    ),
    queued(Id::MOVE_JOINTS_REL, "MoveJointsRel", JOINT_STEPS, 2042),
    queued(
        Id::SET_VALVE_STATE,
        "SetValveState",
        &[one_of("v1", VALVE).or(0.0), one_of("v2", VALVE).or(0.0)],
        6662,
    ),
    queued(
        Id::SET_GRIPPER_RANGE,
        "SetGripperRange",
        &[any("d_closed", Unit::Millimetre).or(0.0), any("d_open", Unit::Millimetre)],
        6570,
    ),
    row(
        Id::MOVE_GRIPPER,
        "MoveGripper",
        Kind::Queued,
        &[within("d", Unit::Millimetre, 0.0, 48.0)],
        Needs::ReadyAndHomed,
        6453,
    ),
    queued(
        Id::SET_JOINT_VEL_LIMIT,
        "SetJointVelLimit",
        &[joint_velocity_percent("p_o").or(100.0)],
        2651,
    ),
    lacking(Id::SET_OUTPUT_STATE, "SetOutputState", Kind::Queued, 6638),
    lacking(Id::SET_OUTPUT_STATE_IMMEDIATE, "SetOutputState_Immediate", Kind::Instantaneous, 6642),
    lacking(Id::SET_IO_SIM, "SetIoSim", Kind::Unknown, 6634),
    lacking(Id::VACUUM_GRIP, "VacuumGrip", Kind::Queued, 6695),
    lacking(Id::VACUUM_GRIP_IMMEDIATE, "VacuumGrip_Immediate", Kind::Instantaneous, 6699),
    lacking(Id::VACUUM_RELEASE, "VacuumRelease", Kind::Queued, 6703),
    lacking(Id::VACUUM_RELEASE_IMMEDIATE, "VacuumRelease_Immediate", Kind::Instantaneous, 6707),
    lacking(Id::SET_VACUUM_THRESHOLD, "SetVacuumThreshold", Kind::Queued, 6654),
    lacking(
        Id::SET_VACUUM_THRESHOLD_IMMEDIATE,
        "SetVacuumThreshold_Immediate",
        Kind::Instantaneous,
        6658,
    ),
    lacking(Id::SET_VACUUM_PURGE_DURATION, "SetVacuumPurgeDuration", Kind::Queued, 6646),
    lacking(
        Id::SET_VACUUM_PURGE_DURATION_IMMEDIATE,
        "SetVacuumPurgeDuration_Immediate",
        Kind::Instantaneous,
        6650,
    ),
    lacking(Id::MOVE_JUMP, "MoveJump", Kind::Queued, 2100),
    lacking(Id::SET_MOVE_JUMP_HEIGHT, "SetMoveJumpHeight", Kind::Queued, 2760),
    lacking(Id::SET_MOVE_JUMP_APPROACH_VEL, "SetMoveJumpApproachVel", Kind::Queued, 2752),
    row(
        Id::SET_TIME_SCALING,
        "SetTimeScaling",
        Kind::Instantaneous,
        &[percent("p", 0.001, 100.0).or(100.0)],
        Needs::AnyState,
        3968,
    ),
    queued(Id::SET_MOVE_MODE, "SetMoveMode", &[one_of("m", MOVE_MODE).or(0.0)], 2768),
    queued(Id::SET_MOVE_DURATION_CFG, "SetMoveDurationCfg", &[one_of("s", SEVERITY).or(4.0)], 2715),
    queued(
        Id::SET_MOVE_DURATION,
        "SetMoveDuration",
        &[argument("t", Unit::Second, ArgumentRange::AtLeast(0.0)).or(3.0)],
        2685,
    ),
    queued(
        Id::SET_PAYLOAD,
        "SetPayload",
        &[
            any("m", Unit::Kilogram).or(0.0),
            any("c_x", Unit::Millimetre),
            any("c_y", Unit::Millimetre),
            any("c_z", Unit::Millimetre),
        ],
        2800,
    ),
    row(
        Id::START_PROGRAM,
        "StartProgram",
        Kind::Instantaneous,
        &[argument("program", Unit::None, ArgumentRange::Integer { min: 1, max: 500 })],
        Needs::ActivatedAndHomed,
        3998,
    ),
    configuration(
        Id::SET_JOINT_LIMITS,
        "SetJointLimits",
        &[
            argument("n", Unit::None, ArgumentRange::Integer { min: 1, max: 6 }),
            any("q_min", Unit::Degree),
            any("q_max", Unit::Degree),
        ],
        3602,
    ),
    configuration(
        Id::SET_JOINT_LIMITS_CFG,
        "SetJointLimitsCfg",
        &[one_of("e", DISABLE_ENABLE).or(0.0)],
        3636,
    ),
    configuration(
        Id::SET_WORK_ZONE_CFG,
        "SetWorkZoneCfg",
        &[one_of("l", SEVERITY).or(4.0), one_of("m", WORK_ZONE_MODE).or(1.0)],
        6002,
    ),
    configuration(
        Id::SET_WORK_ZONE_LIMITS,
        "SetWorkZoneLimits",
        &[
            any("x_min", Unit::Millimetre).or(-10_000.0),
            any("y_min", Unit::Millimetre).or(-10_000.0),
            any("z_min", Unit::Millimetre).or(-10_000.0),
            any("x_max", Unit::Millimetre).or(10_000.0),
            any("y_max", Unit::Millimetre).or(10_000.0),
            any("z_max", Unit::Millimetre).or(10_000.0),
        ],
        6037,
    ),
    configuration(Id::SET_COLLISION_CFG, "SetCollisionCfg", &[one_of("l", SEVERITY).or(4.0)], 5938),
    configuration(
        Id::SET_TOOL_SPHERE,
        "SetToolSphere",
        &[
            any("x", Unit::Millimetre).or(0.0),
            any("y", Unit::Millimetre).or(0.0),
            any("z", Unit::Millimetre).or(0.0),
            any("r", Unit::Millimetre).or(0.0),
        ],
        5969,
    ),
    configuration(
        Id::SET_CALIBRATION_CFG,
        "SetCalibrationCfg",
        &[one_of("e", DISABLE_ENABLE).or(1.0)],
        3475,
    ),
    row(Id::REBOOT_ROBOT, "RebootRobot", Kind::Instantaneous, &[], Needs::Deactivated, 3399),
    row(Id::CLEAR_HOMING, "ClearHoming", Kind::Instantaneous, &[], Needs::BeforeActivation, 3075),
    CommandSpec {
        id: Id::VARIABLE_FIRST,
        last_id: Id::VARIABLE_LAST,
        name: "SetVariable",
        kind: Kind::Variable,
        arguments: VARIABLE_VALUES,
        min_arguments: 1,
        available: true,
        requires: Needs::AnyState,
        persistent: true,
        manual_line: 6801,
    },
];
