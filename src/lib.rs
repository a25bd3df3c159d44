//! Drive industrial robot arms from a soft PLC.
//!
//! Three things, in this order of weight: a zero-copy **codec** for the robots' process images
//! ([`wire`]), a PLC-side **engine** that owns each robot's handshake, and **virtual robots** and
//! links so that a cell can be built and tested without hardware.
//!
//! Each floor uses only the floors below it; `ARCHITECTURE.md` has the table, `tests/tidy.rs`
//! enforces it.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(feature = "sim")]
extern crate alloc;
#[cfg(feature = "std")]
#[macro_use]
extern crate std;

pub mod bus;
#[cfg(feature = "cli")]
pub mod cli;
pub mod cycle;
pub mod engine;
#[cfg(feature = "std")]
pub mod link;
#[cfg(feature = "std")]
pub mod run;
#[cfg(feature = "sim")]
pub mod sim;
pub mod text_device;
pub mod time;
pub mod wire;

/// Keeps the example of the README compiling and true.
#[cfg(all(doctest, feature = "cli"))]
#[doc = include_str!("../README.md")]
pub struct Readme;
