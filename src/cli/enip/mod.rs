//! What the commands share about EtherNet/IP: names of links, connections, virtual robots, words.
//!
//! Read `link_name.rs` first: what a user can ask for.

pub(super) mod connect;
pub(super) mod link_name;
pub(super) mod robots;
#[cfg(target_os = "linux")]
pub(super) mod serve;
pub(super) mod words;
