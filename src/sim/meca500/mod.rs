//! The virtual Meca500.
