//! The text interface on sockets of the loopback: both ports, and clients.

#[path = "../text_support/mod.rs"]
mod text_support;

mod client;
#[cfg(feature = "sim")]
mod commands;
mod hostile;
mod odd_answers;
mod ports;
#[cfg(feature = "sim")]
mod robot;
mod served;
