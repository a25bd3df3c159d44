//! Virtual robots: they answer on every bus as the real ones do, and faults between them and a PLC.
//!
//! Read [`meca500`] for the robot and [`fault`] for what a bus can do to a cell.

pub mod fault;
pub mod meca500;
