//! EtherNet/IP: the scanner's end on sockets, and what it can run on besides.
//!
//! Read [`network`] first: all that the link knows of the outside world. [`EnipSegment`] drives robots over
//! it; [`sockets`] is the real one. [`explicit`] and [`list_identity`] ask devices a question and are done.
//!
//! Invariants: one thread, no hand-off: what arrives between two exchanges waits in the system's buffers.
//! An exchange does not allocate and does not wait.

mod error;
pub mod explicit;
pub mod list_identity;
pub mod network;
mod segment;
mod settings;
pub mod sockets;
mod statistics;
mod waiter;

pub use error::EnipError;
pub use segment::{EnipSegment, StartFailure};
pub use settings::{EnipSettings, MAX_TARGETS, TargetSettings};
pub use statistics::EnipStatistics;
