//! Sessions of the text interface, without sockets.

#[path = "../text_support/mod.rs"]
mod text_support;

mod client;
mod lines;
mod server;
