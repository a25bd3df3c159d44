//! The process images of the Meca500: 60 bytes out, 252 bytes in, on every bus alike.
//!
//! [`OutputImage`] is what the PLC sends, [`InputImage`] what it receives; directions are always
//! the PLC's. Both are views of borrowed bytes: nothing is copied, nothing is decoded until a
//! field is read. The byte order is a type parameter, see [`crate::wire::order`].
//!
//! ```
//! use fieldarm::wire::meca500::image::{INPUT_LEN, InputImage, RobotStatusFlags};
//! use fieldarm::wire::order::Big;
//!
//! let mut bytes = [0; INPUT_LEN];
//! bytes[0] = 0b110; // Activated, Homed
//! bytes[10..12].copy_from_slice(&13_000_u16.to_be_bytes());
//! let inputs = InputImage::<Big>::from_bytes(&bytes)?;
//! assert!(inputs.robot_status.flags.contains(RobotStatusFlags::HOMED));
//! assert_eq!(inputs.motion_status.fifo_space.get(), 13_000);
//! # Ok::<(), fieldarm::wire::WireError>(())
//! ```
//!
//! Invariants: one declarative table per PDO block ([`output`](OutputImage) and
//! [`input`](InputImage)) is the only place that spells an offset; [`OUTPUT_FIELDS`] and
//! [`INPUT_FIELDS`] come from it. Reserved bits are read as they are and never written by setters.
//! Nothing here panics or allocates.
//!
//! Left out: what the values mean together (engine), and the typed views of commands and dynamic
//! slots.

mod block;
mod field;
mod input;
mod layout;
mod output;
pub mod pdo;

use zerocopy::byteorder::{F32, U16, U32};

use crate::wire::order::ImageOrder;

pub use block::{BitField, FlagSet, StoredBits};
pub use field::{Field, FieldType, FieldValue, Support};
pub use input::*;
pub use layout::{Checkpoints, FirmwareLayout};
pub use output::*;

/// A 16-bit integer in the image's order of integers.
pub type Int16<O> = U16<<O as ImageOrder>::Int>;
/// A 32-bit integer in the image's order of integers.
pub type Int32<O> = U32<<O as ImageOrder>::Int>;
/// A 32-bit Real in the image's order of Reals.
pub type Real<O> = F32<<O as ImageOrder>::Real>;
