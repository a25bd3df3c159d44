//! The number that names a motion command on the wire.

use core::fmt;

use super::spec::CommandSpec;

/// MotionCommandID: which command the six arguments belong to. 32-bit unsigned, output bytes 8 to 11.
///
/// An open set: a number without an entry in Table 8 is kept as it is. Source: PM Table 6, Table 8.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MotionCommandId(pub u32);

impl MotionCommandId {
    /// Nothing to execute; the arguments are ignored.
    pub const NO_MOVEMENT: Self = Self(0);
    /// `MoveJoints`.
    pub const MOVE_JOINTS: Self = Self(1);
    /// `MovePose`.
    pub const MOVE_POSE: Self = Self(2);
    /// `MoveLin`.
    pub const MOVE_LIN: Self = Self(3);
    /// `MoveLinRelTrf`.
    pub const MOVE_LIN_REL_TRF: Self = Self(4);
    /// `MoveLinRelWrf`.
    pub const MOVE_LIN_REL_WRF: Self = Self(5);
    /// `Delay`.
    pub const DELAY: Self = Self(6);
    /// `SetBlending`.
    pub const SET_BLENDING: Self = Self(7);
    /// `SetJointVel`.
    pub const SET_JOINT_VEL: Self = Self(8);
    /// `SetJointAcc`.
    pub const SET_JOINT_ACC: Self = Self(9);
    /// `SetCartAngVel`.
    pub const SET_CART_ANG_VEL: Self = Self(10);
    /// `SetCartLinVel`.
    pub const SET_CART_LIN_VEL: Self = Self(11);
    /// `SetCartAcc`.
    pub const SET_CART_ACC: Self = Self(12);
    /// `SetTrf`.
    pub const SET_TRF: Self = Self(13);
    /// `SetWrf`.
    pub const SET_WRF: Self = Self(14);
    /// `SetConf`.
    pub const SET_CONF: Self = Self(15);
    /// `SetAutoConf`.
    pub const SET_AUTO_CONF: Self = Self(16);
    /// `SetCheckpoint`.
    pub const SET_CHECKPOINT: Self = Self(17);
    /// Close or open the gripper.
    pub const GRIPPER: Self = Self(18);
    /// `SetGripperVel`.
    pub const SET_GRIPPER_VEL: Self = Self(19);
    /// `SetGripperForce`.
    pub const SET_GRIPPER_FORCE: Self = Self(20);
    /// `MoveJointsVel`.
    pub const MOVE_JOINTS_VEL: Self = Self(21);
    /// `MoveLinVelWrf`.
    pub const MOVE_LIN_VEL_WRF: Self = Self(22);
    /// `MoveLinVelTrf`.
    pub const MOVE_LIN_VEL_TRF: Self = Self(23);
    /// `SetVelTimeout`.
    pub const SET_VEL_TIMEOUT: Self = Self(24);
    /// `SetConfTurn`.
    pub const SET_CONF_TURN: Self = Self(25);
    /// `SetAutoConfTurn`.
    pub const SET_AUTO_CONF_TURN: Self = Self(26);
    /// `SetTorqueLimits`.
    pub const SET_TORQUE_LIMITS: Self = Self(27);
    /// `SetTorqueLimitsCfg`.
    pub const SET_TORQUE_LIMITS_CFG: Self = Self(28);
    /// `MoveJointsRel`.
    pub const MOVE_JOINTS_REL: Self = Self(29);
    /// `SetValveState`.
    pub const SET_VALVE_STATE: Self = Self(30);
    /// `SetGripperRange`.
    pub const SET_GRIPPER_RANGE: Self = Self(31);
    /// `MoveGripper`.
    pub const MOVE_GRIPPER: Self = Self(32);
    /// `SetJointVelLimit`.
    pub const SET_JOINT_VEL_LIMIT: Self = Self(33);
    /// `SetOutputState`, not available on the Meca500.
    pub const SET_OUTPUT_STATE: Self = Self(34);
    /// `SetOutputState_Immediate`, not available on the Meca500.
    pub const SET_OUTPUT_STATE_IMMEDIATE: Self = Self(35);
    /// `SetIoSim`, not available on the Meca500.
    pub const SET_IO_SIM: Self = Self(36);
    /// `VacuumGrip`, not available on the Meca500.
    pub const VACUUM_GRIP: Self = Self(37);
    /// `VacuumGrip_Immediate`, not available on the Meca500.
    pub const VACUUM_GRIP_IMMEDIATE: Self = Self(38);
    /// `VacuumRelease`, not available on the Meca500.
    pub const VACUUM_RELEASE: Self = Self(39);
    /// `VacuumRelease_Immediate`, not available on the Meca500.
    pub const VACUUM_RELEASE_IMMEDIATE: Self = Self(40);
    /// `SetVacuumThreshold`, not available on the Meca500.
    pub const SET_VACUUM_THRESHOLD: Self = Self(41);
    /// `SetVacuumThreshold_Immediate`, not available on the Meca500.
    pub const SET_VACUUM_THRESHOLD_IMMEDIATE: Self = Self(42);
    /// `SetVacuumPurgeDuration`, not available on the Meca500.
    pub const SET_VACUUM_PURGE_DURATION: Self = Self(43);
    /// `SetVacuumPurgeDuration_Immediate`, not available on the Meca500.
    pub const SET_VACUUM_PURGE_DURATION_IMMEDIATE: Self = Self(44);
    /// `MoveJump`, not available on the Meca500.
    pub const MOVE_JUMP: Self = Self(45);
    /// `SetMoveJumpHeight`, not available on the Meca500.
    pub const SET_MOVE_JUMP_HEIGHT: Self = Self(46);
    /// `SetMoveJumpApproachVel`, not available on the Meca500.
    pub const SET_MOVE_JUMP_APPROACH_VEL: Self = Self(47);
    /// `SetTimeScaling`.
    pub const SET_TIME_SCALING: Self = Self(48);
    /// `SetMoveMode`.
    pub const SET_MOVE_MODE: Self = Self(49);
    /// `SetMoveDurationCfg`.
    pub const SET_MOVE_DURATION_CFG: Self = Self(50);
    /// `SetMoveDuration`.
    pub const SET_MOVE_DURATION: Self = Self(51);
    /// `SetPayload`.
    pub const SET_PAYLOAD: Self = Self(60);
    /// `StartProgram`.
    pub const START_PROGRAM: Self = Self(100);
    /// `SetJointLimits`.
    pub const SET_JOINT_LIMITS: Self = Self(150);
    /// `SetJointLimitsCfg`.
    pub const SET_JOINT_LIMITS_CFG: Self = Self(151);
    /// `SetWorkZoneCfg`.
    pub const SET_WORK_ZONE_CFG: Self = Self(152);
    /// `SetWorkZoneLimits`.
    pub const SET_WORK_ZONE_LIMITS: Self = Self(153);
    /// `SetCollisionCfg`.
    pub const SET_COLLISION_CFG: Self = Self(154);
    /// `SetToolSphere`.
    pub const SET_TOOL_SPHERE: Self = Self(155);
    /// `SetCalibrationCfg`.
    pub const SET_CALIBRATION_CFG: Self = Self(156);
    /// `RebootRobot`.
    pub const REBOOT_ROBOT: Self = Self(200);
    /// Forget the homing, so that the next activation initialises the drives again.
    pub const CLEAR_HOMING: Self = Self(1002);
    /// Lowest ID that sets a robot variable; the ID is the variable's cyclic ID.
    pub const VARIABLE_FIRST: Self = Self(10_000);
    /// Highest ID that sets a robot variable.
    pub const VARIABLE_LAST: Self = Self(19_999);

    /// Whether this ID sets the robot variable with the same cyclic ID.
    #[must_use]
    pub const fn is_variable(self) -> bool {
        self.0 >= Self::VARIABLE_FIRST.0 && self.0 <= Self::VARIABLE_LAST.0
    }

    /// The command's row of [`COMMANDS`](super::COMMANDS); `None` for an ID without an entry.
    #[must_use]
    pub fn spec(self) -> Option<&'static CommandSpec> {
        CommandSpec::of(self)
    }
}

impl fmt::Display for MotionCommandId {
    /// The number, with the command's name where it has one: `1 (MoveJoints)`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.spec() {
            Some(spec) => write!(f, "{} ({})", self.0, spec.name),
            None => write!(f, "{}", self.0),
        }
    }
}
