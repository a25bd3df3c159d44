//! Virtual robots: they answer on every bus as the real ones do.

pub mod meca500;
