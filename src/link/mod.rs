//! Real I/O: both ends of the buses and of the text interface, and the system clock.
//!
//! Read [`direct`] first: the smallest link there is. Every link implements
//! [`CyclicLink`](crate::cycle::CyclicLink) and has an error of its own: small, `Copy`, with the
//! numbers inside and an `is_transient` that says whether trying again can help.
//!
//! Invariant: [`clock`] is the only file that names a system clock.

#[cfg(all(target_os = "linux", any(feature = "enip", feature = "text")))]
mod cable;
pub mod clock;
pub mod direct;
#[cfg(feature = "enip")]
pub mod enip;
#[cfg(feature = "ethercat")]
pub mod ethercat;
#[cfg(any(feature = "enip", feature = "ethercat"))]
pub mod fault_plan;
#[cfg(feature = "text")]
pub mod text;
#[cfg(any(feature = "enip", feature = "ethercat", feature = "text"))]
pub mod watch_list;
