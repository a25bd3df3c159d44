//! CANopen over EtherCAT, the subdevice's end: a mailbox in front of an object dictionary.
//!
//! ```text
//!  datagram --> CoeServer --+--> SDO transfers -----+--> Dictionary (a trait: the device's objects)
//!  datagram <--             +--> SDO information ---+
//!                           +--- emergencies
//! ```
//!
//! Read [`CoeServer`] first, then [`Dictionary`]: what a device has to tell.
//!
//! Invariants: every request but an abort has exactly one answer (SDO information may take several
//! datagrams); an answer is written when there is room for it, so nothing depends on the length of
//! the mailbox; buffers are fixed, and what does not fit is refused with a code.
//!
//! Left out: block transfers, PDOs through the mailbox, and every protocol but CoE.
//!
//! Source: ETG.1000 part 6.

mod bits;
mod dictionary;
mod info_server;
mod sdo_server;
mod server;

pub(crate) use bits::copy_bits;
pub use dictionary::{Dictionary, Entry, Object};
pub use sdo_server::MAX_TRANSFER;
pub use server::{CoeServer, EmergencyQueueFull, MAX_EMERGENCIES};
