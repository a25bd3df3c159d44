//! The robot's text face: the control port and the monitoring port, as messages without a stream.
//!
//! Read [`face`] first, then [`dispatch`]. The face acts on the same robot as the cyclic images: the
//! same queue, settings and lifecycle.
//!
//! ```text
//! line --dispatch--> motion, control, program, data, ... --> VirtualRobot --events--> observe
//!           |                                                     |                     |
//!           '---- answers, refusals ----> control outbox <--------'---------------------+
//!                                              ^ copies, if asked for                   v
//!                                              '------------------------- monitoring outbox
//! ```
//!
//! Invariants: no line makes it panic; each outbox holds a bounded number of messages
//! ([`outbox`]); while nobody ever used the face, it costs the robot nothing.
//!
//! Leaves out: the streams, their terminators and the limit of a line, which belong to the server;
//! captures of the robot's network; messages 2226 and 3048, which the manual does not explain well
//! enough.

mod accessory;
mod client;
mod control;
mod data;
mod device;
mod dispatch;
mod face;
mod format;
mod line;
mod log;
mod monitoring;
mod motion;
mod observe;
mod outbox;
mod program;
mod protocol;
mod real_time;
mod status;
mod variable;
mod waiting;
mod work_zone;

pub(super) use face::TextFace;
pub(super) use format::command_line;
pub use log::{LogKind, LogLine};
pub use protocol::{Controller, ProtocolSettings};
