//! Codes the robot reports: errors, answers, monitoring messages, safety signals.
//!
//! Read [`Code::describe`] first. Over cyclic protocols codes appear in ErrorCode of the input image
//! (0 for none); over TCP each message begins with one.
//!
//! Invariants: an open set. A code without an entry keeps its number and prints as that number;
//! the robot's own message text may change with its firmware, the code may not (PM L477).
//!
//! Left out: which errors start error mode, which the manual does not tell.

mod errors;
mod realtime;
mod responses;
mod safety;

use core::fmt;

/// A four-digit code of the robot; 0 in ErrorCode means that there is no error.
///
/// 16-bit unsigned on the wire, input bytes 2 and 3. Source: PM Tables 1, 2, 3 and 13.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Code(pub u16);

/// What a code tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CodeKind {
    /// A refusal or a failure.
    Error,
    /// An answer to a command, or a message about one.
    Response,
    /// Sent on the monitoring port only.
    Monitoring,
    /// State of a safety signal.
    Safety,
}

/// Whether an error or a safety signal can be reset without a restart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Resettable {
    /// It can, after its cause is gone.
    Yes,
    /// It cannot.
    No,
    /// The manual does not tell.
    NotStated,
}

/// One code with what is known of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CodeInfo {
    /// The code.
    pub code: Code,
    /// What it tells.
    pub kind: CodeKind,
    /// Whether a [`CodeKind::Response`] is also sent on the monitoring port.
    pub monitored: bool,
    /// What it means, in one sentence.
    pub text: &'static str,
    /// What the robot writes after the code: its message, or the names of its values.
    pub message: &'static str,
    /// What to do about it; empty where there is nothing to do.
    pub remedy: &'static str,
    /// Whether it can be reset.
    pub resettable: Resettable,
}

impl Code {
    /// No error, in ErrorCode.
    pub const NONE: Self = Self(0);
    /// The motion queue holds as many commands as it can.
    pub const COMMAND_BUFFER_FULL: Self = Self(1000);
    /// The robot does not know the command, or the line was empty.
    pub const UNKNOWN_COMMAND: Self = Self(1001);
    /// A parenthesis or a comma is missing.
    pub const SYNTAX_ERROR: Self = Self(1002);
    /// Wrong number of arguments, or one that cannot be used.
    pub const ARGUMENT_ERROR: Self = Self(1003);
    /// The command needs an activated robot.
    pub const NOT_ACTIVATED: Self = Self(1005);
    /// The command needs a homed robot.
    pub const NOT_HOMED: Self = Self(1006);
    /// A joint is outside its limits now, or would be at the target.
    pub const JOINT_OVER_LIMIT: Self = Self(1007);
    /// Somewhere on the line a joint would have to turn by more than 180 degrees.
    pub const LINEAR_MOVE_JOINT_ROTATION: Self = Self(1010);
    /// The robot is in error mode and ignores commands.
    pub const IN_ERROR: Self = Self(1011);
    /// The line asks for a turn of 180 degrees, or leads too close to a singularity.
    pub const LINEAR_MOVE_REORIENTATION: Self = Self(1012);
    /// The motors could not be powered.
    pub const ACTIVATION_FAILED: Self = Self(1013);
    /// Homing did not succeed.
    pub const HOMING_FAILED: Self = Self(1014);
    /// The pose, or one on the way to it, cannot be reached in the allowed postures.
    pub const OUT_OF_REACH: Self = Self(1016);
    /// No program was being saved.
    pub const NOT_SAVING: Self = Self(1022);
    /// The command cannot be part of a stored program; it was left out.
    pub const NOT_IN_OFFLINE_PROGRAM: Self = Self(1023);
    /// The robot no longer knows where its joints are.
    pub const MASTERING_NEEDED: Self = Self(1024);
    /// The error cannot be reset.
    pub const RESET_IMPOSSIBLE: Self = Self(1025);
    /// The command needs a deactivated robot.
    pub const DEACTIVATION_NEEDED: Self = Self(1026);
    /// Simulation can only be switched while the robot is deactivated.
    pub const SIM_NEEDS_DEACTIVATION: Self = Self(1027);
    /// The program reached 13,000 commands; saving stopped.
    pub const OFFLINE_PROGRAM_FULL: Self = Self(1029);
    /// A program is already being saved.
    pub const ALREADY_SAVING: Self = Self(1030);
    /// A command that cannot be saved ended the saving.
    pub const SAVING_ABORTED: Self = Self(1031);
    /// Homing was refused because a joint is outside its configured limits.
    pub const HOMING_OUTSIDE_LIMITS: Self = Self(1032);
    /// The robot does not stand in the posture that the move asks for.
    pub const START_CONF_MISMATCH: Self = Self(1033);
    /// No gripper of the family MEGP 25 is connected.
    pub const NO_GRIPPER: Self = Self(1038);
    /// The command failed for a reason that the robot does not name.
    pub const COMMAND_FAILED: Self = Self(1040);
    /// No pneumatic module is connected.
    pub const NO_PNEUMATIC_MODULE: Self = Self(1041);
    /// The simulated tool can only be changed while the robot is deactivated.
    pub const TOOL_SIM_NEEDS_DEACTIVATION: Self = Self(1042);
    /// The robot has no such bank of inputs and outputs; no Meca500 has.
    pub const NO_IO_BANK: Self = Self(1043);
    /// The robot has no vacuum module; no Meca500 has.
    pub const NO_VACUUM_MODULE: Self = Self(1044);
    /// The variables could not be listed.
    pub const LIST_VARIABLES_FAILED: Self = Self(1550);
    /// The variable could not be read.
    pub const GET_VARIABLE_FAILED: Self = Self(1551);
    /// The variable could not be created.
    pub const CREATE_VARIABLE_FAILED: Self = Self(1552);
    /// The variable could not be deleted.
    pub const DELETE_VARIABLE_FAILED: Self = Self(1553);
    /// The variable could not be set.
    pub const SET_VARIABLE_FAILED: Self = Self(1554);
    /// The robot is activated.
    pub const MOTORS_ACTIVATED: Self = Self(2000);
    /// The robot is homed.
    pub const HOMING_DONE: Self = Self(2002);
    /// The robot is deactivated.
    pub const MOTORS_DEACTIVATED: Self = Self(2004);
    /// The error was reset.
    pub const ERROR_RESET: Self = Self(2005);
    /// There was nothing to reset.
    pub const NO_ERROR_TO_RESET: Self = Self(2006);
    /// State of the robot: activated, homed, simulated, in error, paused, end of block, end of motion.
    pub const STATUS_ROBOT: Self = Self(2007);
    /// Motion is paused.
    pub const MOTION_PAUSED: Self = Self(2042);
    /// Motion is resumed.
    pub const MOTION_RESUMED: Self = Self(2043);
    /// The motion queue was cleared.
    pub const MOTION_CLEARED: Self = Self(2044);
    /// An instantaneous command succeeded.
    pub const COMMAND_SUCCESSFUL: Self = Self(2085);
    /// Connected.
    pub const CONNECTED: Self = Self(3000);
    /// Somebody else controls the robot; the connection closes.
    pub const ANOTHER_USER: Self = Self(3001);
    /// The firmware is being upgraded; the connection is refused.
    pub const FIRMWARE_UPGRADE: Self = Self(3002);
    /// Too many characters came before the end of the command.
    pub const COMMAND_TOO_LONG: Self = Self(3003);
    /// The robot stopped moving.
    pub const END_OF_MOVEMENT: Self = Self(3004);
    /// Motion went wrong, perhaps by a collision or an overload.
    pub const MOTION_ERROR: Self = Self(3005);
    /// The controller lost its drives.
    pub const DRIVE_COMMUNICATION: Self = Self(3006);
    /// The robot could not start.
    pub const INITIALIZATION_FAILED: Self = Self(3009);
    /// The robot stopped moving and its queue is empty.
    pub const END_OF_BLOCK: Self = Self(3012);
    /// The stored program ended.
    pub const END_OF_OFFLINE_PROGRAM: Self = Self(3013);
    /// The program could not be saved properly.
    pub const SAVED_PROGRAM_PROBLEM: Self = Self(3014);
    /// There is no such program in the robot.
    pub const NO_OFFLINE_PROGRAM: Self = Self(3017);
    /// The stored program cannot be run.
    pub const OFFLINE_PROGRAM_INVALID: Self = Self(3020);
    /// The gripper failed, most likely because it grew too hot while pressing.
    pub const GRIPPER_ERROR: Self = Self(3025);
    /// The robot found fault with its own hardware.
    pub const MAINTENANCE_CHECK: Self = Self(3026);
    /// The robot's software failed.
    pub const INTERNAL_ERROR: Self = Self(3027);
    /// Whether a torque limit is exceeded.
    pub const TORQUE_LIMIT_STATUS: Self = Self(3028);
    /// A motor torque went over its limit.
    pub const EXCESSIVE_TORQUE: Self = Self(3029);
    /// A checkpoint was reached.
    pub const CHECKPOINT_REACHED: Self = Self(3030);
    /// A text command sent earlier over TCP was wrong; told to an EtherNet/IP controller only.
    pub const PREVIOUS_TEXT_COMMAND_WRONG: Self = Self(3031);
    /// Protective stop 2 (SWStop): motion is stopped, the motors stay on.
    pub const P_STOP_2: Self = Self(3032);
    /// The robot cannot talk to its pneumatic module.
    pub const PNEUMATIC_MODULE_ERROR: Self = Self(3037);
    /// The tool's firmware is older than the robot's, so activation failed.
    pub const TOOL_FIRMWARE_OUTDATED: Self = Self(3039);
    /// A checkpoint was discarded.
    pub const CHECKPOINT_DISCARDED: Self = Self(3040);
    /// A collision was about to happen, and collisions are set to be errors.
    pub const COLLISION_ERROR: Self = Self(3041);
    /// An earlier firmware update did not succeed.
    pub const FIRMWARE_UPDATE_FAILED: Self = Self(3042);
    /// Too many transmissions between the tool port and the tool failed.
    pub const TOOL_COMMUNICATION_ERRORS: Self = Self(3043);
    /// The robot cannot talk to its own tool port.
    pub const TOOL_PORT_ERROR: Self = Self(3044);
    /// A collision was about to happen; the robot slows down.
    pub const COLLISION_IMMINENT: Self = Self(3045);
    /// The power supply has an error that cannot be reset; not on a Meca500.
    pub const POWER_ERROR: Self = Self(3046);
    /// The robot started in safe mode because it could not read its storage.
    pub const DRIVE_MOUNT_FAILED: Self = Self(3047);
    /// The robot was about to leave its work zone, and that is set to be an error.
    pub const WORK_ZONE_ERROR: Self = Self(3049);
    /// Power was lost and the robot shuts down; not on a Meca500.
    pub const POWER_LOST: Self = Self(3050);
    /// A time-based move cannot keep its duration.
    pub const MOVE_DURATION_TOO_SHORT: Self = Self(3051);
    /// Voltage fluctuation; not on a Meca500.
    pub const VOLTAGE_FLUCTUATION: Self = Self(3069);
    /// Emergency stop: the robot is deactivated and the motors have no power.
    pub const E_STOP: Self = Self(3070);
    /// Operation mode changed; not on a Meca500.
    pub const OPERATION_MODE_CHANGED: Self = Self(3080);
    /// The TCP connection broke, as one chapter numbers it; the tables say 3086.
    pub const CONNECTION_DROPPED_TEXT: Self = Self(3081);
    /// Safety stop 3082; the manual does not name it.
    pub const STOP_3082: Self = Self(3082);
    /// The robot was rebooted and its motors have no power.
    pub const REBOOTED: Self = Self(3083);
    /// The two channels of a stop signal disagreed for over a second.
    pub const REDUNDANCY_FAULT: Self = Self(3084);
    /// Safety stop 3085; the manual does not name it.
    pub const STOP_3085: Self = Self(3085);
    /// The TCP connection broke, or its watchdog ran out.
    pub const CONNECTION_DROPPED: Self = Self(3086);
    /// Safety stop 3087; the manual does not name it.
    pub const STOP_3087: Self = Self(3087);

    /// What is known of the code; `None` for a code without an entry.
    #[must_use]
    pub fn describe(self) -> Option<&'static CodeInfo> {
        TABLES.iter().find_map(|table| {
            let position = table.partition_point(|info| info.code < self);
            table.get(position).filter(|info| info.code == self)
        })
    }

    /// Whether ErrorCode with this value says that something is wrong.
    #[must_use]
    pub const fn is_set(self) -> bool {
        self.0 != Self::NONE.0
    }

    /// Every code with an entry: errors, safety signals, answers, real-time values and messages.
    pub fn all() -> impl Iterator<Item = &'static CodeInfo> {
        TABLES.iter().flat_map(|table| table.iter())
    }
}

impl fmt::Display for Code {
    /// The number, with its meaning where it has one: `1006: The command needs a homed robot.`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.describe() {
            Some(info) => write!(f, "{}: {}", self.0, info.text),
            None => write!(f, "{}", self.0),
        }
    }
}

const TABLES: [&[CodeInfo]; 4] =
    [errors::ERRORS, safety::SAFETY, responses::RESPONSES, realtime::REALTIME];

const fn response(code: u16, text: &'static str, message: &'static str) -> CodeInfo {
    CodeInfo {
        code: Code(code),
        kind: CodeKind::Response,
        monitored: false,
        text,
        message,
        remedy: "",
        resettable: Resettable::NotStated,
    }
}

const fn monitored(code: u16, text: &'static str, message: &'static str) -> CodeInfo {
    CodeInfo { monitored: true, ..response(code, text, message) }
}

const fn monitoring(code: u16, text: &'static str, message: &'static str) -> CodeInfo {
    CodeInfo { kind: CodeKind::Monitoring, ..response(code, text, message) }
}

const fn error(
    code: u16,
    text: &'static str,
    message: &'static str,
    remedy: &'static str,
    resettable: Resettable,
) -> CodeInfo {
    CodeInfo { kind: CodeKind::Error, remedy, resettable, ..response(code, text, message) }
}

const fn safety(
    code: u16,
    text: &'static str,
    message: &'static str,
    remedy: &'static str,
    resettable: Resettable,
) -> CodeInfo {
    CodeInfo { kind: CodeKind::Safety, remedy, resettable, ..response(code, text, message) }
}
