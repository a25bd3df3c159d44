//! The geometry of the arm: where the flange is for given joints, and which joints bring it there.
//!
//! Read first: [`forward()`], [`inverse()`], [`Posture`]. Joint sets are plain `[f64; 6]` in degrees,
//! lengths are millimetres.
//!
//! Invariants: nothing here allocates or panics; every solution of [`inverse()`] gives back its pose
//! through [`forward()`]. Leaves out: joint limits other than their figures, calibration, the bodies
//! of the links (the joint centres of [`Chain`] stand for them).

mod configuration;
mod forward;
mod frames;
mod inverse;
mod jacobian;

pub use configuration::{
    Configuration, NEAR_SINGULAR_DEG, NEAR_SINGULAR_MM, Posture, Side, turn_of, turn_range,
};
pub use forward::{Chain, forward, joint_centres};
pub use frames::Frames;
pub(super) use inverse::{Bridge, solve_across};
pub use inverse::{Solution, Solutions, inverse, solve};
pub use jacobian::{Jacobian, NearSingular};

/// Six joint positions in degrees, six joint velocities in deg/s, or six accelerations in deg/s².
pub type Joints = [f64; 6];

/// Height of the axis of joint 2 over the bottom of the base, in mm.
pub const BASE_TO_SHOULDER_MM: f64 = 135.0;
/// Length from the axis of joint 2 to that of joint 3, in mm.
pub const SHOULDER_TO_ELBOW_MM: f64 = 135.0;
/// Offset of the axis of joint 4 from that of joint 3, in mm, upwards at zero joints.
pub const ELBOW_OFFSET_MM: f64 = 38.0;
/// Length from the axis of joint 3 to the wrist centre along the axis of joint 4, in mm.
pub const ELBOW_TO_WRIST_MM: f64 = 120.0;
/// Length from the wrist centre to the flange, in mm.
pub const WRIST_TO_FLANGE_MM: f64 = 70.0;

/// Lowest joint positions of the model, in degrees. Joint 6 is limited to 100 turns by software.
///
/// Source: PM L170-176.
pub const MODEL_MIN: Joints = [-175.0, -70.0, -135.0, -170.0, -115.0, -36_000.0];
/// Highest joint positions of the model, in degrees. Source: PM L170-176.
pub const MODEL_MAX: Joints = [175.0, 90.0, 70.0, 170.0, 115.0, 36_000.0];

/// `degrees` brought to -180 (excluded) to 180 (included).
#[must_use]
pub fn wrap_degrees(degrees: f64) -> f64 {
    let wrapped = degrees - 360.0 * libm::round(degrees / 360.0);
    if wrapped <= -180.0 { wrapped + 360.0 } else { wrapped }
}

/// The angle equal to `degrees` up to whole turns that is nearest to `reference`.
pub(super) fn nearest_turn(degrees: f64, reference: f64) -> f64 {
    reference + wrap_degrees(degrees - reference)
}
