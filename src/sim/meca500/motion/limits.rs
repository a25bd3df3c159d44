//! Limits of joint positions and velocities.

use thiserror::Error;

use super::RATED_VELOCITY;
use crate::sim::meca500::kinematics::{Joints, MODEL_MAX, MODEL_MIN};

/// How far beyond a limit a joint still counts as inside, in degrees: rounding of the inverse
/// kinematics, far under the encoders' step.
const SLACK_DEG: f64 = 1e-6;

/// The range of each joint, in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointLimits {
    /// Lowest positions.
    pub min: Joints,
    /// Highest positions.
    pub max: Joints,
}

impl JointLimits {
    /// What the mechanics and, for joint 6, the software allow. Source: PM L170-178.
    pub const MODEL: Self = Self { min: MODEL_MIN, max: MODEL_MAX };

    /// Whether all `joints` are inside.
    ///
    /// # Errors
    ///
    /// The first joint outside, and its range.
    pub fn check(&self, joints: &Joints) -> Result<(), LimitExcess> {
        let ranges = self.min.into_iter().zip(self.max);
        for (number, (&position, (min, max))) in (1..=6).zip(joints.iter().zip(ranges)) {
            // Also refuses NaN.
            if !(position >= min - SLACK_DEG && position <= max + SLACK_DEG) {
                return Err(LimitExcess { joint: number, position, min, max });
            }
        }
        Ok(())
    }

    /// The joints inside that are nearest to `joints`.
    #[must_use]
    pub(super) fn nearest(&self, joints: &Joints) -> Joints {
        let mut nearest = *joints;
        for (joint, (min, max)) in nearest.iter_mut().zip(self.min.into_iter().zip(self.max)) {
            *joint = joint.max(min).min(max);
        }
        nearest
    }

    /// The same limits with joint 6 kept between `low` and `high` as well.
    #[must_use]
    pub(super) const fn with_joint_6(mut self, (low, high): (f64, f64)) -> Self {
        self.min[5] = self.min[5].max(low);
        self.max[5] = self.max[5].min(high);
        self
    }
}

/// A joint outside its range: what error 1007 prints.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error("{position:.3} is not in range [{min}, {max}] for joint {joint}")]
pub struct LimitExcess {
    /// 1 to 6.
    pub joint: u8,
    /// Where it is or would be, in degrees.
    pub position: f64,
    /// Lowest position, in degrees.
    pub min: f64,
    /// Highest position, in degrees.
    pub max: f64,
}

/// Joint velocities at `percent` of the rated ones, none above `top` (deg/s): what `SetJointVel` and
/// `SetJointVelLimit` stand for, with [`TOP_VELOCITY_R3`](super::TOP_VELOCITY_R3) or
/// [`TOP_VELOCITY_R4`](super::TOP_VELOCITY_R4).
///
/// Source: PM L2627-2636, L2671.
#[must_use]
pub fn velocity_limits(percent: f64, top: &Joints) -> Joints {
    let mut limits = RATED_VELOCITY;
    for (limit, top) in limits.iter_mut().zip(top) {
        *limit = (*limit * percent / 100.0).min(*top);
    }
    limits
}

#[cfg(test)]
mod tests {
    use super::super::{TOP_VELOCITY_R3, TOP_VELOCITY_R4};
    use super::*;

    #[test]
    fn velocities_of_the_manual_example() {
        let limits = velocity_limits(140.0, &TOP_VELOCITY_R4);
        let typed = [210.0, 210.0, 225.0, 350.0, 350.0, 500.0];
        assert!(limits.iter().zip(typed).all(|(limit, typed)| (limit - typed).abs() < 1e-9));
        assert_eq!(
            velocity_limits(50.0, &TOP_VELOCITY_R3),
            [75.0, 75.0, 90.0, 150.0, 150.0, 250.0]
        );
    }

    #[test]
    fn a_joint_outside_is_named() {
        let excess = JointLimits::MODEL.check(&[0.0, 0.0, 71.0, 0.0, 0.0, 0.0]);
        let expected = LimitExcess { joint: 3, position: 71.0, min: -135.0, max: 70.0 };
        assert_eq!(excess, Err(expected));
        assert!(JointLimits::MODEL.check(&[f64::NAN; 6]).is_err());
        assert!(JointLimits::MODEL.check(&MODEL_MAX).is_ok());
    }
}
