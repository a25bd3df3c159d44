//! The text interface on sockets of the loopback: both ports, and clients.

#[path = "../text_support/mod.rs"]
mod text_support;

mod client;
mod hostile;
mod ports;
mod served;
