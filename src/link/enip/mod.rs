//! EtherNet/IP.
mod bind_error;
pub mod faulty_network;
pub mod memory;
pub mod network;
mod readiness;
pub mod serve;
pub mod served;
