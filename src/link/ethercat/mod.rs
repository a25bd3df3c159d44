//! EtherCAT: the main device's end on the crate `ethercrab`, and the wires it can run on.
//!
//! Read [`wire`] first: all that the link knows of the outside world.

pub mod faulty_wire;
#[cfg(target_os = "linux")]
pub mod raw_socket;
pub mod serve;
pub mod wire;
