//! EtherCAT on the wire: frames and datagrams, registers, the mailbox, CoE, the SII.
//!
//! Everything here is little-endian, whatever the byte order of the robot's images. Read [`al`]
//! first: the states every subdevice goes through.

pub mod al;
pub mod coe;
pub mod command;
pub mod frame;
pub mod identity;
pub mod mailbox;
pub mod register;
pub mod sii;
