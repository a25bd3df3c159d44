//! Bytes to values and back, with no state: the lowest floor.

pub mod meca500;
