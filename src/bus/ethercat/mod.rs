//! An EtherCAT subdevice in software: a frame in, the same frame out, changed as an ESC changes it.
//!
//! ```text
//!  frame --> ESC: registers, FMMUs, sync managers, AL, DC --> Application: CoE, PDOs --> CyclicDevice
//! ```
//!
//! Read [`application`] first: what the two halves expect of each other; then [`pass`] and
//! [`tick`], the two ways in which time reaches [`SubDevice`]s in a row. The ESC itself is in
//! `controller`.
//!
//! Invariants: no frame, however broken, makes anything panic; all memory is inside the struct; a
//! frame that is not whole changes nothing but error counters.

pub mod application;
mod clock;
pub mod coe;
mod controller;
mod eeprom;
mod fmmu;
mod mailbox;
pub mod meca500;
mod memory;
mod registers;
mod segment;
mod settings;
mod state_machine;
mod sub_device;
mod sync_manager;
mod watchdog;

pub use segment::{Passage, act, carry, pass, tick};
pub use settings::Settings;
pub use sub_device::SubDevice;
