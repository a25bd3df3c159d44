//! The error codes that the virtual robot gives, by name. Source: PM Table 1.

/// A code of Table 1, as ErrorCode carries it.
pub type Code = u16;

/// Command buffer is full.
pub const BUFFER_FULL: Code = 1000;
/// Unknown command.
pub const UNKNOWN_COMMAND: Code = 1001;
/// An argument is out of its range, or not a number.
pub const ARGUMENT: Code = 1003;
/// The robot is not activated.
pub const NOT_ACTIVATED: Code = 1005;
/// The robot is not homed.
pub const NOT_HOMED: Code = 1006;
/// A joint is or would be over its limit.
pub const JOINT_OVER_LIMIT: Code = 1007;
/// A linear move needs half a turn.
pub const HALF_TURN: Code = 1010;
/// The robot is in error.
pub const IN_ERROR: Code = 1011;
/// A linear move meets a singularity.
pub const SINGULARITY: Code = 1012;
/// Activation failed.
pub const ACTIVATION_FAILED: Code = 1013;
/// Homing failed.
pub const HOMING_FAILED: Code = 1014;
/// A pose is out of reach.
pub const OUT_OF_REACH: Code = 1016;
/// The robot must be deactivated for this command.
pub const DEACTIVATION_NEEDED: Code = 1026;
/// The error cannot be reset.
pub const CANNOT_RESET: Code = 1025;
/// Simulation can be switched only while deactivated.
pub const SIMULATION_NEEDS_DEACTIVATION: Code = 1027;
/// Homing failed because a joint is outside its user limits.
pub const HOMING_OUTSIDE_LIMITS: Code = 1032;
/// A linear move does not start in the desired configuration.
pub const START_CONFIGURATION: Code = 1033;
/// No gripper is connected.
pub const NO_GRIPPER: Code = 1038;
/// General failure.
pub const FAILED: Code = 1040;
/// No pneumatic module is connected.
pub const NO_PNEUMATIC_MODULE: Code = 1041;
/// A variable could not be set.
pub const VARIABLE: Code = 1554;
/// Error of motion: collision or overload.
pub const MOTION: Code = 3005;
/// Error of communication with the drives; needs a reboot.
pub const DRIVES: Code = 3006;
/// No such offline program.
pub const NO_PROGRAM: Code = 3017;
/// The offline program is invalid.
pub const INVALID_PROGRAM: Code = 3020;
/// Gripper error.
pub const GRIPPER: Code = 3025;
/// A torque limit of severity 4 was exceeded.
pub const EXCESSIVE_TORQUE: Code = 3029;
/// The tool's firmware is older than the robot's.
pub const TOOL_FIRMWARE: Code = 3039;
/// Imminent collision.
pub const COLLISION: Code = 3041;
/// Imminent breach of the work zone.
pub const WORK_ZONE: Code = 3049;
/// A move cannot keep its duration.
pub const DURATION: Code = 3051;
