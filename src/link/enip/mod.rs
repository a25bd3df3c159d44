//! EtherNet/IP, both ends: a scanner on sockets and what it can run on besides, and robots served on sockets.
//!
//! Read [`network`] first: all that the scanner's end knows of the outside world. [`EnipSegment`] drives
//! robots over it; [`sockets`] is the real one. [`explicit`] and [`list_identity`] ask devices a question and
//! are done. The robots' end is [`served`], a device and its adapter; [`serve`] puts them on sockets,
//! [`memory`] into the same process, where [`faulty_network`] makes the network misbehave.
//!
//! Invariants: one thread, no hand-off: what arrives between two exchanges waits in the system's buffers.
//! An exchange does not allocate and does not wait.

mod bind_error;
mod error;
pub mod explicit;
pub mod faulty_network;
pub mod list_identity;
pub mod memory;
pub mod network;
mod segment;
pub mod serve;
pub mod served;
mod settings;
pub mod sockets;
mod statistics;
mod waiter;

pub use error::EnipError;
pub use segment::{EnipSegment, StartFailure};
pub use settings::{EnipSettings, MAX_TARGETS, TargetSettings};
pub use statistics::EnipStatistics;
