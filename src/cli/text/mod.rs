//! What the commands do over the robot's text interface: addresses, runs, served robots, words.
//!
//! Read `run.rs` first: robot programs over TCP; then `serve.rs`, a virtual robot at its two ports, and
//! `prompt/`, which talks to a robot.

pub(super) mod link_name;
pub(super) mod place;
pub(super) mod prompt;
pub(super) mod run;
mod run_link;
mod run_words;
#[cfg(target_os = "linux")]
pub(super) mod serve;
#[cfg(target_os = "linux")]
mod words;
