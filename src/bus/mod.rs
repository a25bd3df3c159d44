//! Protocol sessions without I/O: frames in, frames out, `now` as an argument.
//!
//! Nothing here opens a socket or reads a clock; `link` does that on top.

pub mod enip;
pub mod ethercat;
pub mod text;
