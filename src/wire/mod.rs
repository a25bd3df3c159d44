//! Bytes to values and back, with no state: the lowest floor.
//!
//! Read [`order`] first (byte order is a type parameter of an image), then
//! [`meca500::image`].

pub mod enip;
mod error;
pub mod ethercat;
pub mod meca500;
pub mod order;

pub use error::WireError;
