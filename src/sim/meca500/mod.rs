//! The virtual Meca500.

pub mod kinematics;
pub mod motion;
pub mod pose;
