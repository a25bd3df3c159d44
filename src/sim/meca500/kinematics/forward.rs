//! From joints to the flange and the joint centres.

use glam::{DMat3, DQuat, DVec3};

use super::{
    BASE_TO_SHOULDER_MM, ELBOW_OFFSET_MM, ELBOW_TO_WRIST_MM, Joints, SHOULDER_TO_ELBOW_MM,
    WRIST_TO_FLANGE_MM,
};
use crate::sim::meca500::pose::Pose;

/// The arm as a chain of points and axes in the base frame.
///
/// Good enough to ask whether the arm leaves a box: the bodies of the links are left out, so a
/// checker adds its own radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chain {
    /// Where the axes of joints 1 and 2 meet, in mm.
    pub shoulder: DVec3,
    /// Point of the axis of joint 3 in the plane of the arm, in mm.
    pub elbow: DVec3,
    /// Point of the axis of joint 4 next to the elbow, in mm.
    pub forearm: DVec3,
    /// Where the axes of joints 4, 5 and 6 meet, in mm.
    pub wrist: DVec3,
    /// The flange in the base frame.
    pub flange: Pose,
    /// Unit vectors of the six joint axes, positive by the right hand.
    pub axes: [DVec3; 6],
}

impl Chain {
    /// A point of the axis of each joint, in mm.
    #[must_use]
    pub const fn axis_points(&self) -> [DVec3; 6] {
        [self.shoulder, self.shoulder, self.elbow, self.wrist, self.wrist, self.wrist]
    }

    /// The points that the links join, from the bottom of the base to the flange, in mm.
    #[must_use]
    pub const fn points(&self) -> [DVec3; 6] {
        let flange = self.flange.position;
        [DVec3::ZERO, self.shoulder, self.elbow, self.forearm, self.wrist, flange]
    }
}

/// The flange in the base frame for `joints` in degrees.
#[must_use]
pub fn forward(joints: &Joints) -> Pose {
    joint_centres(joints).flange
}

/// The whole chain for `joints` in degrees.
#[must_use]
pub fn joint_centres(joints: &Joints) -> Chain {
    let [q1, q2, q3, q4, q5, q6] = joints.map(f64::to_radians);
    let shoulder = DVec3::new(0.0, 0.0, BASE_TO_SHOULDER_MM);
    let waist = DMat3::from_rotation_z(q1);
    let pitch_axis = waist.y_axis;
    let upper_arm = waist * DMat3::from_rotation_y(q2);
    let elbow = shoulder + upper_arm * DVec3::new(0.0, 0.0, SHOULDER_TO_ELBOW_MM);
    let lower_arm = waist * DMat3::from_rotation_y(q2 + q3);
    let forearm = elbow + lower_arm * DVec3::new(0.0, 0.0, ELBOW_OFFSET_MM);
    let wrist = forearm + lower_arm * DVec3::new(ELBOW_TO_WRIST_MM, 0.0, 0.0);
    let rolled = lower_arm * DMat3::from_rotation_x(q4);
    let hand = rolled * DMat3::from_rotation_y(q5);
    let rotation = hand * DMat3::from_rotation_x(q6) * flange_at_zero();
    let flange = Pose {
        position: wrist + hand * DVec3::new(WRIST_TO_FLANGE_MM, 0.0, 0.0),
        orientation: DQuat::from_mat3(&rotation).normalize(),
    };
    let axes = [DVec3::Z, pitch_axis, pitch_axis, lower_arm.x_axis, rolled.y_axis, hand.x_axis];
    Chain { shoulder, elbow, forearm, wrist, flange, axes }
}

/// Orientation of the flange at zero joints: z forward, y as that of the base, x down.
pub(super) const fn flange_at_zero() -> DMat3 {
    DMat3::from_cols(DVec3::NEG_Z, DVec3::Y, DVec3::X)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_pose(joints: Joints, expected: [f64; 6]) {
        let found = forward(&joints);
        let typed = Pose::from_xyz_euler(expected);
        assert!(found.position.distance(typed.position) < 1e-9, "{found:?} for {expected:?}");
        assert!(found.angle_to(&typed) < 1e-9, "{found:?} for {expected:?}");
    }

    #[test]
    fn zero_joints_give_the_documented_pose() {
        assert_pose([0.0; 6], [190.0, 0.0, 308.0, 0.0, 90.0, 0.0]);
    }

    #[test]
    fn each_joint_turns_the_way_its_axis_points() {
        // Typed by hand from the link lengths.
        assert_pose([90.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0, 190.0, 308.0, -90.0, 0.0, 90.0]);
        // Leaning forward by a right angle: the upper arm lies along x, the forearm points down.
        assert_pose([0.0, 90.0, 0.0, 0.0, 0.0, 0.0], [173.0, 0.0, -55.0, 180.0, 0.0, 180.0]);
        // The forearm points straight up.
        assert_pose([0.0, 0.0, -90.0, 0.0, 0.0, 0.0], [-38.0, 0.0, 460.0, 0.0, 0.0, 0.0]);
        // The hand points straight down.
        assert_pose([0.0, 0.0, 0.0, 0.0, 90.0, 0.0], [120.0, 0.0, 238.0, 180.0, 0.0, 180.0]);
    }

    #[test]
    fn links_keep_their_lengths() {
        let chain = joint_centres(&[20.0, -30.0, 40.0, 50.0, -60.0, 70.0]);
        let lengths = [135.0, 135.0, 38.0, 120.0, 70.0];
        let points = chain.points();
        for (pair, length) in points.windows(2).zip(lengths) {
            assert!((pair[0].distance(pair[1]) - length).abs() < 1e-9);
        }
        for axis in chain.axes {
            assert!((axis.length() - 1.0).abs() < 1e-12);
        }
    }
}
