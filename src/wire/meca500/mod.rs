//! The Meca500's images, commands, codes and text.

pub mod command;
pub mod revision;
