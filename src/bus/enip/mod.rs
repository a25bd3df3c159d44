//! EtherNet/IP sessions without I/O: the scanner that drives robots, and the adapter that a robot is.
//!
//! Read [`scanner`] for the PLC's side and [`adapter`] for the robot's. Both are told what arrived and what
//! time it is, and are asked what to send: `handle_*` first, then `poll_transmit` until it has nothing more,
//! then `poll_event`; `poll_timeout` says when to come back at the latest.
//!
//! Invariants: no allocation, no panic, whatever arrives; the two roles share only the wire,
//! and how deadlines follow each other.

pub mod adapter;
mod deadlines;
pub mod scanner;

#[cfg(feature = "enip")]
pub(crate) use deadlines::MOST_OWED;

/// What a connection may do with the robot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ConnectionKind {
    /// Sends outputs and receives inputs; only one at a time.
    #[default]
    ExclusiveOwner,
    /// Receives inputs, owner or not.
    InputOnly,
    /// Receives the inputs that are produced for somebody else, as long as they are.
    ListenOnly,
}

/// O->T point of input-only connections: a heartbeat without data.
///
/// Source: choice; the number is common in device descriptions.
pub const INPUT_ONLY_POINT: u32 = 238;
/// O->T point of listen-only connections.
///
/// Source: choice; the number is common in device descriptions.
pub const LISTEN_ONLY_POINT: u32 = 237;
