//! Sessions of the robot's text interface: lines in, messages out, over two TCP ports.
//!
//! Read [`server::ServerSession`] for the robot's end and [`client::ClientSession`] for the PC's.
//! Neither knows a socket: bytes that arrived go in, bytes to send are asked for, `now` is an argument.
//!
//! ```text
//!  bytes ─▶ LineSplitter ─▶ lines ─▶ TextDevice ─▶ messages ─▶ Outbox ─▶ bytes      (server)
//!  bytes ─▶ LineSplitter ─▶ messages ─▶ who waits for it, what it tells of the robot (client)
//! ```
//!
//! Terminators: the robot ends what it says with a NUL; a command may end with NUL, LF or CR LF. An
//! empty line is no line. Source: PM L406, L858; client.
//!
//! Invariants: all memory is in the session and has a bound; no input makes it panic, grow or stall; a
//! peer that does not read loses its connection, never a part of a message.

pub mod client;
mod lines;
mod outbox;
pub mod server;
mod state;

pub use crate::wire::meca500::text::value::{GripperState, RobotStatus};
pub use lines::{Line, LineSplitter};
pub use outbox::Outbox;
pub use state::RobotState;

/// TCP port of the control connection. Source: PM L414.
pub const CONTROL_PORT: u16 = 10_000;
/// TCP port of monitoring connections. Source: PM L418.
pub const MONITORING_PORT: u16 = 10_001;
/// Most characters of a command, without its terminator; a longer one gives 3003.
///
/// Source: choice. The manual names the error and not the number. No command of the manual comes near,
/// but for the value of a variable.
pub const MAX_COMMAND: usize = 4096;
/// Room for one message of the robot in a client, in bytes without its terminator.
///
/// Source: choice. The longest message is the list of all variables.
pub const MAX_MESSAGE: usize = 65_536;
/// Bytes that a server keeps for a peer that does not read.
///
/// Source: choice. About a second of monitoring messages at the default interval.
pub const OUTBOX: usize = 65_536;
