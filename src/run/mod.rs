//! The fixed-period loop that joins one controller to one link.

pub mod decimate;
pub mod pace;
pub mod periodic;
pub mod statistics;
