//! The text interface on sockets of the loopback: both ports, and clients.

#[cfg(feature = "sim")]
#[path = "../support/quick_robot.rs"]
mod quick_robot;
#[cfg(feature = "sim")]
#[path = "../support/text_robot.rs"]
mod robot;
#[path = "../text_support/mod.rs"]
mod text_support;

mod client;
#[cfg(feature = "sim")]
mod commands;
mod hostile;
mod odd_answers;
mod ports;
mod served;
