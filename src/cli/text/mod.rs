//! What the commands do over the robot's text interface: addresses, served robots, words.
//!
//! Read `serve.rs` first: a virtual robot at its two ports, alone or with EtherNet/IP beside them.

pub(super) mod place;
pub(super) mod serve;
mod words;
