//! An EtherCAT subdevice in software: a frame in, the same frame out, changed as an ESC changes it.
//!
//! ```text
//!  frame --> ESC: registers, FMMUs, sync managers, AL, DC --> Application: CoE, PDOs --> CyclicDevice
//! ```
//!
//! Read [`application`] first: what the two halves expect of each other.

pub mod application;
pub mod coe;
pub mod meca500;
