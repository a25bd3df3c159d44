//! PLC-side state machines, one folder a robot: they own the handshake of the cyclic image.
//!
//! Read [`meca500`] first. An engine sees a robot only through its process image, once per bus
//! cycle, and never asks what time it is.

pub mod meca500;
