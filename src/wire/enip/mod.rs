//! EtherNet/IP: encapsulation, the common packet format, CIP messages and class 1 frames.
//!
//! Read [`encapsulation`] first, then [`cpf`], [`message`] and [`path`]; a connection is opened with
//! [`connection`] and its data travel in [`io`]; [`session`] and [`identity`] hold the data of the few commands
//! that are not messages of an object.
//!
//! Everything is little-endian except socket addresses. Reading borrows; writing goes into room that the
//! caller gives. Reading is strict: a field that is cut off, a count that does not fit and bytes that belong
//! to nothing are errors that name the message and the field.
//!
//! Invariants: nothing here allocates or panics, whatever the bytes.
//!
//! Leaves out: connected explicit messages (class 3), routing through bridges, CIP Safety and CIP Security.

pub(crate) mod bytes;
pub mod connection;
pub mod cpf;
pub mod encapsulation;
mod error;
pub mod identity;
pub mod io;
pub mod message;
pub mod parameters;
pub mod path;
pub mod session;
pub mod status;

pub use error::{DecodeError, NoRoom};

/// TCP and UDP port of encapsulated messages.
///
/// Source: CIP volume 2.
pub const MESSAGE_PORT: u16 = 44_818;
/// UDP port of class 1 frames.
///
/// Source: CIP volume 2.
pub const IO_PORT: u16 = 2_222;
