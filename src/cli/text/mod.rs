//! What the commands do over the robot's text interface: addresses, served robots, words.
//!
//! Read `serve.rs` first: a virtual robot at its two ports, alone or with EtherNet/IP beside them; then
//! `prompt/`, which talks to a robot.

pub(super) mod place;
pub(super) mod prompt;
#[cfg(target_os = "linux")]
pub(super) mod serve;
#[cfg(target_os = "linux")]
mod words;
