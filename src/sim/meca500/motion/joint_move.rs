//! Straight lines in joint space: `MoveJoints`, `MoveJointsRel` and, through
//! [`plan_pose_move`](super::plan_pose_move), `MovePose`.
//!
//! All joints share one profile, so they start and stop together, and the one that needs longest
//! sets the pace. Source: PM L2015.

use super::{JointLimits, Pace, PlanError, Trapezoid, all_positive};
use crate::sim::meca500::kinematics::Joints;

/// What a joint-space move obeys.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointSettings {
    /// Range of each joint.
    pub limits: JointLimits,
    /// Velocities that are never exceeded, in deg/s: the lower of `SetJointVel` and
    /// `SetJointVelLimit`, or the latter alone when the pace is a duration.
    pub velocity: Joints,
    /// Accelerations that are never exceeded, in deg/s².
    pub acceleration: Joints,
    /// `SetMoveMode`.
    pub pace: Pace,
}

/// A checked move along a straight line in joint space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointPlan {
    start: Joints,
    end: Joints,
    /// Over the fraction of the way, 0 to 1.
    profile: Trapezoid,
    shortest_duration_s: Option<f64>,
}

impl JointPlan {
    /// The joints at the start, in degrees.
    #[must_use]
    pub const fn start(&self) -> Joints {
        self.start
    }

    /// The joints at the end, in degrees.
    #[must_use]
    pub const fn end(&self) -> Joints {
        self.end
    }

    /// The profile of the fraction of the way.
    #[must_use]
    pub const fn profile(&self) -> Trapezoid {
        self.profile
    }

    /// See [`Plan::shortest_duration_s`](super::Plan::shortest_duration_s).
    #[must_use]
    pub const fn shortest_duration_s(&self) -> Option<f64> {
        self.shortest_duration_s
    }

    /// The joints `seconds` after the start, in degrees.
    #[must_use]
    pub fn sample(&self, seconds: f64) -> Joints {
        if seconds >= self.profile.duration_s() {
            return self.end;
        }
        let fraction = self.profile.at(seconds).position;
        let mut joints = self.start;
        for (joint, end) in joints.iter_mut().zip(self.end) {
            *joint += fraction * (end - *joint);
        }
        joints
    }
}

/// Plans the move from `start` to `end`, both in degrees.
///
/// # Errors
///
/// [`PlanError::JointOverLimit`] when a joint is outside its limits at either end;
/// [`PlanError::BadNumber`] for velocities or accelerations that are not positive.
pub fn plan_joint_move(
    start: &Joints,
    end: &Joints,
    settings: &JointSettings,
) -> Result<JointPlan, PlanError> {
    if !(all_positive(&settings.velocity) && all_positive(&settings.acceleration)) {
        return Err(PlanError::BadNumber);
    }
    for joints in [start, end] {
        settings.limits.check(joints).map_err(PlanError::JointOverLimit)?;
    }
    let velocity = slowest(start, end, &settings.velocity);
    let acceleration = slowest(start, end, &settings.acceleration);
    let (velocity, shortest_duration_s) = match settings.pace {
        Pace::Velocity => (velocity, None),
        Pace::Duration(_) if start == end => (velocity, None),
        Pace::Duration(wanted_s) => pace_for(1.0, wanted_s, velocity, acceleration)?,
    };
    let distance = if start == end { 0.0 } else { 1.0 };
    let profile = Trapezoid::new(distance, velocity, acceleration);
    Ok(JointPlan { start: *start, end: *end, profile, shortest_duration_s })
}

/// The velocity for a wanted duration within `velocity`, and the shortest duration when the wanted
/// one cannot be met.
pub(super) fn pace_for(
    distance: f64,
    wanted_s: f64,
    velocity: f64,
    acceleration: f64,
) -> Result<(f64, Option<f64>), PlanError> {
    if !(wanted_s >= 0.0 && wanted_s.is_finite()) {
        return Err(PlanError::BadNumber);
    }
    let needed = Trapezoid::velocity_for(distance, wanted_s, acceleration);
    let fastest = Trapezoid::new(distance, velocity, acceleration);
    if wanted_s > 0.0 && needed <= velocity * (1.0 + 1e-9) {
        Ok((needed.min(velocity), None))
    } else {
        Ok((velocity, Some(fastest.hold_s())))
    }
}

/// Fraction of the way per second (or per s²) at which the first joint meets its limit.
fn slowest(start: &Joints, end: &Joints, limits: &Joints) -> f64 {
    start
        .iter()
        .zip(end)
        .zip(limits)
        .map(|((start, end), limit)| limit / (end - start).abs())
        .fold(f64::MAX, f64::min)
}

#[cfg(test)]
mod tests {
    use super::super::{FULL_JOINT_ACCELERATION, RATED_VELOCITY};
    use super::*;
    use crate::sim::meca500::kinematics::{MODEL_MAX, MODEL_MIN};
    use proptest::prelude::*;

    fn settings(pace: Pace) -> JointSettings {
        JointSettings {
            limits: JointLimits::MODEL,
            velocity: RATED_VELOCITY,
            acceleration: FULL_JOINT_ACCELERATION,
            pace,
        }
    }

    fn within(fractions: [f64; 6]) -> Joints {
        let mut joints = [0.0; 6];
        for (index, fraction) in fractions.into_iter().enumerate() {
            let (min, max) =
                if index == 5 { (-400.0, 400.0) } else { (MODEL_MIN[index], MODEL_MAX[index]) };
            joints[index] = min + fraction * (max - min);
        }
        joints
    }

    #[test]
    fn a_target_or_start_outside_is_refused() {
        let outside = [176.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        for (start, end) in [([0.0; 6], outside), (outside, [0.0; 6])] {
            let refused = plan_joint_move(&start, &end, &settings(Pace::Velocity));
            assert!(matches!(refused, Err(PlanError::JointOverLimit(excess)) if excess.joint == 1));
        }
    }

    #[test]
    fn a_duration_counts_only_the_constant_part() {
        let end = [30.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let plan = plan_joint_move(&[0.0; 6], &end, &settings(Pace::Duration(2.0)));
        let plan = plan.ok().filter(|plan| plan.shortest_duration_s().is_none());
        assert!(plan.is_some_and(|plan| (plan.profile().hold_s() - 2.0).abs() < 1e-9));
        // 150 deg at 150 deg/s with 0.1 s ramps: 15 deg on the ramps, 135 in the middle.
        let end = [150.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        for wanted in [0.0, 0.5] {
            let plan = plan_joint_move(&[0.0; 6], &end, &settings(Pace::Duration(wanted)));
            let shortest = plan.ok().and_then(|plan| plan.shortest_duration_s());
            assert!(shortest.is_some_and(|shortest| (shortest - 0.9).abs() < 1e-9));
        }
        let bad = plan_joint_move(&[0.0; 6], &end, &settings(Pace::Duration(-1.0)));
        assert_eq!(bad, Err(PlanError::BadNumber));
    }

    #[test]
    fn nowhere_to_go_takes_no_time() {
        let plan = plan_joint_move(&[1.0; 6], &[1.0; 6], &settings(Pace::Velocity));
        assert!(
            plan.is_ok_and(
                |plan| plan.profile().duration_s() == 0.0 && plan.sample(0.0) == [1.0; 6]
            )
        );
    }

    proptest! {
        #[test]
        fn joints_start_and_stop_together_within_their_limits(
            from in prop::array::uniform6(0.0..1.0f64), to in prop::array::uniform6(0.0..1.0f64),
            wanted in prop::option::of(0.01..5.0f64),
        ) {
            let pace = wanted.map_or(Pace::Velocity, Pace::Duration);
            let (start, end) = (within(from), within(to));
            let plan = plan_joint_move(&start, &end, &settings(pace));
            prop_assert!(plan.is_ok());
            for plan in plan.iter() {
                let step = 0.001;
                let steps = libm::ceil(plan.profile().duration_s() / step) as u32;
                let mut before = plan.sample(0.0);
                let mut velocity_before = [0.0; 6];
                prop_assert_eq!(before, start);
                let mut fastest: f64 = 0.0;
                for index in 1..=steps {
                    let seconds = step * f64::from(index);
                    let now = plan.sample(seconds);
                    let fraction = plan.profile().at(seconds).position;
                    for joint in 0..6 {
                        // One fraction for all: they start and stop together.
                        let expected = start[joint] + fraction * (end[joint] - start[joint]);
                        prop_assert!((now[joint] - expected).abs() < 1e-9);
                        let velocity = (now[joint] - before[joint]) / step;
                        prop_assert!(velocity.abs() <= RATED_VELOCITY[joint] * (1.0 + 1e-9));
                        let acceleration = (velocity - velocity_before[joint]) / step;
                        prop_assert!(acceleration.abs() <= FULL_JOINT_ACCELERATION[joint] * 1.000_001);
                        velocity_before[joint] = velocity;
                        fastest = fastest.max(velocity.abs() / RATED_VELOCITY[joint]);
                    }
                    before = now;
                }
                prop_assert_eq!(before, end);
                if plan.profile().hold_s() > 0.01 && (wanted.is_none() || plan.shortest_duration_s().is_some()) {
                    prop_assert!(fastest > 1.0 - 1e-6, "someone goes as fast as allowed");
                }
            }
        }
    }
}
