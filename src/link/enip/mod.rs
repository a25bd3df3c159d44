//! EtherNet/IP: the scanner's end on sockets, and what it can run on besides.
//!
//! Read [`network`] first: all that the link knows of the outside world. [`EnipSegment`] drives robots over
//! it.
//!
//! Invariants: one thread, no hand-off: what arrives between two exchanges waits in the system's buffers.
//! An exchange does not allocate and does not wait.

mod error;
pub mod network;
mod segment;
mod settings;
mod statistics;

pub use error::EnipError;
pub use segment::{EnipSegment, StartFailure};
pub use settings::{EnipSettings, MAX_TARGETS, TargetSettings};
pub use statistics::EnipStatistics;
