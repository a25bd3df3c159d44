//! Motion commands: what the PLC may ask of the robot through MotionCommandID and six arguments.
//!
//! Read [`COMMANDS`] first: one row for each ID of Table 8, with its arguments and their ranges. It
//! is the only place where a range stands; [`MotionCommand::check`],
//! [`MotionCommand::from_arguments`] and the text commands all read it.
//!
//! A [`MotionCommand`] is plain data and may hold any value; it becomes trustworthy by
//! [`MotionCommand::check`]. On the wire it is a [`MotionCommandId`] and six Reals:
//!
//! ```text
//! arguments --from_arguments--> MotionCommand --encode--> (MotionCommandId, [f32; 6])
//!  (counts and ranges)             ^                             |
//!                                  +-----------decode------------+   (total; never refuses)
//! ```
//!
//! Invariants: every ID survives `decode` and `encode`; a checked command has finite arguments; a
//! [`VelocityCommand`] is one of the three IDs that may be sent with MoveID 0.
//!
//! Left out: the MoveID handshake, which belongs to the engine, and whether the robot's state
//! permits the command now ([`Requirement`] names the state, nothing here checks it).

mod arguments;
mod check;
mod codec;
mod id;
mod motion;
mod spec;
mod table;
mod unit;
mod velocity;

pub use arguments::{
    Conf, ConfSign, GripperAction, MoveMode, Payload, Pose, Severity, ToolSphere, TorqueDetection,
    TorqueSeverity, ValveAction, WorkZoneLimits, WorkZoneMode,
};
pub use check::{Allowed, ArgumentCount, ArgumentError, CommandError};
pub use id::MotionCommandId;
pub use motion::MotionCommand;
pub use spec::{ArgumentRange, ArgumentSpec, Choice, CommandKind, CommandSpec, Requirement};
pub use table::{COMMANDS, MODEL_JOINT_LIMITS};
pub use unit::Unit;
pub use velocity::{NotAVelocityCommand, VelocityCommand};

pub(in crate::wire::meca500) use arguments::{coded, exact_integer};
