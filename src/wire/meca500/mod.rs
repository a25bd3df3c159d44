//! The Meca500's images, commands, codes and text.

pub mod code;
pub mod command;
pub mod dynamic;
pub mod revision;
pub mod text;
