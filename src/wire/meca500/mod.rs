//! The Meca500's process images, commands, codes and text language.
//!
//! Source: PM, the programming manual MC-PM-MECA500 for firmware 11.3.

pub mod adapter;
pub mod code;
pub mod command;
pub mod dynamic;
pub mod image;
pub mod revision;
pub mod subdevice;
pub mod text;
