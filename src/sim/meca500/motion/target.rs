//! Which joint set a `MovePose` goes to.
//!
//! The desired posture and turn decide when they are set; among what they leave, the joint set that
//! is reached first. Source: PM L265, L2252, L2313.
//!
//! Where the target is a wrist singularity, joint 4 stays where it is and joint 6 turns alone,
//! though sharing the turn could be faster.

use super::{JointLimits, JointPlan, JointSettings, PlanError, plan_joint_move};
use crate::sim::meca500::kinematics::{Joints, Posture, inverse, turn_range, wrap_degrees};
use crate::sim::meca500::pose::Pose;

/// What the choice obeys.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TargetSettings {
    /// Range of each joint.
    pub limits: JointLimits,
    /// Joint velocities by which "fastest" is measured, in deg/s.
    pub velocity: Joints,
    /// `SetConf`; `None` while the automatic selection is on.
    pub posture: Option<Posture>,
    /// `SetConfTurn`; `None` while the automatic selection is on.
    pub turn: Option<i32>,
}

/// The joint set that brings the flange to `flange` (base frame), starting from `start`.
///
/// # Errors
///
/// [`PlanError::OutOfReach`] when no allowed joint set does.
pub fn choose_target(
    start: &Joints,
    flange: &Pose,
    settings: &TargetSettings,
) -> Result<Joints, PlanError> {
    if !flange.is_finite() {
        return Err(PlanError::BadNumber);
    }
    inverse(flange, start)
        .iter()
        .filter(|solution| settings.posture.is_none_or(|posture| posture == solution.posture))
        .filter_map(|solution| turn_joint_6(start, solution.joints, settings))
        .map(|joints| (time_to(start, &joints, &settings.velocity), joints))
        .min_by(|(a, _), (b, _)| a.total_cmp(b))
        .map(|(_, joints)| joints)
        .ok_or(PlanError::OutOfReach)
}

/// Plans a `MovePose`: [`choose_target`], then [`plan_joint_move`].
///
/// # Errors
///
/// Those of the two.
pub fn plan_pose_move(
    start: &Joints,
    flange: &Pose,
    posture: Option<Posture>,
    turn: Option<i32>,
    settings: &JointSettings,
) -> Result<JointPlan, PlanError> {
    let target =
        TargetSettings { limits: settings.limits, velocity: settings.velocity, posture, turn };
    plan_joint_move(start, &choose_target(start, flange, &target)?, settings)
}

/// `joints` with joint 6 in the desired turn, or nearest to `start`, or the next best within its
/// limits; `None` when some joint is outside its limits.
fn turn_joint_6(start: &Joints, joints: Joints, settings: &TargetSettings) -> Option<Joints> {
    let with_joint_6 = |position: f64| {
        let mut turned = joints;
        turned[5] = position;
        settings.limits.check(&turned).ok().map(|()| turned)
    };
    if let Some(turn) = settings.turn {
        let (low, _) = turn_range(turn);
        return with_joint_6(joints[5] + low + 180.0);
    }
    let shortest = wrap_degrees(joints[5] - start[5]);
    let other_way = if shortest > 0.0 { shortest - 360.0 } else { shortest + 360.0 };
    with_joint_6(start[5] + shortest).or_else(|| with_joint_6(start[5] + other_way))
}

/// Time to reach `joints` at full velocity, in s, without acceleration.
fn time_to(start: &Joints, joints: &Joints, velocity: &Joints) -> f64 {
    start
        .iter()
        .zip(joints)
        .zip(velocity)
        .map(|((start, end), velocity)| (end - start).abs() / velocity)
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::super::RATED_VELOCITY;
    use super::*;
    use crate::sim::meca500::kinematics::{forward, turn_of};

    const AUTOMATIC: TargetSettings = TargetSettings {
        limits: JointLimits::MODEL,
        velocity: RATED_VELOCITY,
        posture: None,
        turn: None,
    };

    fn manual_pose() -> Pose {
        Pose::from_xyz_euler([77.0, 210.0, 300.0, -103.0, 36.0, 175.0])
    }

    #[test]
    fn a_desired_posture_is_taken_and_none_other() {
        for posture in Posture::all() {
            let settings = TargetSettings { posture: Some(posture), ..AUTOMATIC };
            let chosen = choose_target(&[0.0; 6], &manual_pose(), &settings);
            assert_eq!(chosen.map(|joints| Posture::of(&joints)), Ok(posture));
        }
    }

    #[test]
    fn a_desired_turn_is_taken() {
        for turn in [-3, 0, 2] {
            let settings = TargetSettings { turn: Some(turn), ..AUTOMATIC };
            let chosen = choose_target(&[0.0; 6], &manual_pose(), &settings);
            assert_eq!(chosen.map(|joints| turn_of(joints[5])), Ok(turn));
        }
        let settings = TargetSettings { turn: Some(101), ..AUTOMATIC };
        let chosen = choose_target(&[0.0; 6], &manual_pose(), &settings);
        assert_eq!(chosen, Err(PlanError::OutOfReach));
    }

    #[test]
    fn the_fastest_of_all_is_chosen_and_joint_6_takes_the_short_way() {
        for posture in Posture::all() {
            let settings = TargetSettings { posture: Some(posture), ..AUTOMATIC };
            let there = choose_target(&[0.0; 6], &manual_pose(), &settings);
            for mut there in there.into_iter() {
                // One and a bit turns away and a little off: the way back is unique.
                there[5] += 720.0;
                let mut start = there;
                start[0] += 1.0;
                start[5] += 100.0;
                let start_is_inside = JointLimits::MODEL.check(&start).is_ok();
                let chosen = choose_target(&start, &manual_pose(), &AUTOMATIC);
                assert!(start_is_inside && chosen.is_ok());
                for (chosen, there) in chosen.iter().flatten().zip(there) {
                    assert!((chosen - there).abs() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn joint_6_goes_the_long_way_only_when_its_limits_demand_it() {
        let start = [0.0, 0.0, 0.0, 0.0, 30.0, 170.0];
        let pose = forward(&[0.0, 0.0, 0.0, 0.0, 30.0, -170.0]);
        let posture = Some(Posture::of(&start));
        let settings = TargetSettings { posture, ..AUTOMATIC };
        let short = choose_target(&start, &pose, &settings);
        assert!(short.is_ok_and(|joints| (joints[5] - 190.0).abs() < 1e-6));
        let limits = JointLimits::MODEL.with_joint_6((-180.0, 180.0));
        let long = choose_target(&start, &pose, &TargetSettings { limits, ..settings });
        assert!(long.is_ok_and(|joints| (joints[5] + 170.0).abs() < 1e-6));
    }

    #[test]
    fn limits_leave_out_postures() {
        let mut limits = JointLimits::MODEL;
        limits.max[4] = 0.0;
        let chosen =
            choose_target(&[0.0; 6], &manual_pose(), &TargetSettings { limits, ..AUTOMATIC });
        assert!(chosen.is_ok_and(|joints| joints[4] < 0.0));
        limits.min[4] = -1.0;
        let chosen =
            choose_target(&[0.0; 6], &manual_pose(), &TargetSettings { limits, ..AUTOMATIC });
        assert_eq!(chosen, Err(PlanError::OutOfReach));
    }
}
