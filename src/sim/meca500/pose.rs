//! Poses: a position in millimetres and an orientation, read and written as mobile XYZ Euler angles.
//!
//! Read first: [`Pose`]. A pose says where one frame is in another; `a * b` is frame `b`, given in
//! frame `a`, seen from the frame in which `a` is given.
//!
//! Invariant: the orientation is a unit quaternion. Leaves out: which frames there are; see
//! [`Frames`](super::kinematics::Frames).

use core::ops::Mul;

use glam::{DMat3, DQuat, DVec3};

/// Cosine of beta under which alpha and gamma turn about one axis and alpha is given as 0.
const VERTICAL_BETA_COS: f64 = 1e-8;

/// Where one frame is in another.
///
/// Source: PM L149-162.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Origin of the frame, in mm.
    pub position: DVec3,
    /// Orientation of the frame, a unit quaternion.
    pub orientation: DQuat,
}

impl Pose {
    /// The frame itself.
    pub const IDENTITY: Self = Self { position: DVec3::ZERO, orientation: DQuat::IDENTITY };

    /// The pose with `x, y, z` in mm and `alpha, beta, gamma` in degrees.
    ///
    /// The angles are mobile XYZ: about x, then about the new y, then about the new z. Any value is
    /// accepted. Source: PM L153, L162.
    #[must_use]
    pub fn from_xyz_euler([x, y, z, alpha, beta, gamma]: [f64; 6]) -> Self {
        let turn = |degrees: f64| libm::fmod(degrees, 360.0).to_radians();
        let orientation = DQuat::from_rotation_x(turn(alpha))
            * DQuat::from_rotation_y(turn(beta))
            * DQuat::from_rotation_z(turn(gamma));
        Self { position: DVec3::new(x, y, z), orientation: orientation.normalize() }
    }

    /// `x, y, z` in mm and `alpha, beta, gamma` in degrees.
    ///
    /// Alpha and gamma lie within ±180, beta within ±90; alpha is 0 where beta is ±90.
    /// Source: PM L162.
    #[must_use]
    pub fn to_xyz_euler(&self) -> [f64; 6] {
        let m = DMat3::from_quat(self.orientation);
        let beta_cos = libm::hypot(m.x_axis.x, m.y_axis.x);
        let beta = libm::atan2(m.z_axis.x, beta_cos);
        let (alpha, gamma) = if beta_cos < VERTICAL_BETA_COS {
            (0.0, libm::atan2(m.x_axis.y, m.y_axis.y))
        } else {
            (libm::atan2(-m.z_axis.y, m.z_axis.z), libm::atan2(-m.y_axis.x, m.x_axis.x))
        };
        let DVec3 { x, y, z } = self.position;
        [x, y, z, alpha.to_degrees(), beta.to_degrees(), gamma.to_degrees()]
    }

    /// Where the outer frame is in this one.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let orientation = self.orientation.inverse();
        Self { position: -(orientation * self.position), orientation }
    }

    /// Whether every number of the pose is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.position.is_finite() && self.orientation.is_finite()
    }

    /// Angle of the smallest rotation from this orientation to `other`, in degrees, 0 to 180.
    #[must_use]
    pub fn angle_to(&self, other: &Self) -> f64 {
        rotation_vector(self.orientation, other.orientation).length().to_degrees()
    }
}

impl Mul for Pose {
    type Output = Self;

    fn mul(self, inner: Self) -> Self {
        Self {
            position: self.position + self.orientation * inner.position,
            orientation: (self.orientation * inner.orientation).normalize(),
        }
    }
}

/// The smallest rotation that takes `from` to `to`, as axis times angle in radians, in the frame in
/// which both are given.
pub(super) fn rotation_vector(from: DQuat, to: DQuat) -> DVec3 {
    let turn = to * from.inverse();
    let turn = if turn.w < 0.0 { -turn } else { turn };
    let half_sin = DVec3::new(turn.x, turn.y, turn.z);
    let length = half_sin.length();
    if length < 1e-15 {
        return half_sin * 2.0;
    }
    half_sin * (2.0 * libm::atan2(length, turn.w) / length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn close(a: [f64; 6], b: [f64; 6]) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9)
    }

    #[test]
    fn manual_example_turns_each_axis_about_the_moved_frame() {
        let pose = Pose::from_xyz_euler([0.0, 0.0, 0.0, 45.0, -60.0, 90.0]);
        let x = pose.orientation * DVec3::X;
        // Rz(90) takes x to y; Ry(-60) leaves y; Rx(45) lifts it between y and z.
        let half = libm::sqrt(0.5);
        assert!((x - DVec3::new(0.0, half, half)).length() < 1e-12);
        let z = pose.orientation * DVec3::Z;
        // Ry(-60) takes z to (-sin 60, 0, cos 60); Rx(45) then turns (0, cos 60) in the yz plane.
        assert!((z - DVec3::new(-libm::sqrt(0.75), -0.5 * half, 0.5 * half)).length() < 1e-12);
    }

    #[test]
    fn many_turns_are_the_same_orientation() {
        let given = Pose::from_xyz_euler([0.0, 0.0, 0.0, 378.34, -567.32, 745.03]);
        let reduced = Pose::from_xyz_euler([0.0, 0.0, 0.0, 18.34, 152.68, 25.03]);
        assert!(given.angle_to(&reduced) < 1e-9);
        let [.., alpha, beta, gamma] = given.to_xyz_euler();
        assert!(alpha.abs() <= 180.0 && beta.abs() <= 90.0 && gamma.abs() <= 180.0);
    }

    #[test]
    fn alpha_is_zero_where_beta_is_a_right_angle() {
        for beta in [90.0, -90.0] {
            let pose = Pose::from_xyz_euler([1.0, 2.0, 3.0, 30.0, beta, 50.0]);
            let gamma = if beta > 0.0 { 80.0 } else { 20.0 };
            assert!(close(pose.to_xyz_euler(), [1.0, 2.0, 3.0, 0.0, beta, gamma]));
        }
    }

    proptest! {
        #[test]
        fn euler_angles_round_trip(
            x in -300.0..300.0f64, y in -300.0..300.0f64, z in -300.0..300.0f64,
            alpha in -179.9..179.9f64, beta in -89.9..89.9f64, gamma in -179.9..179.9f64,
        ) {
            let given = [x, y, z, alpha, beta, gamma];
            prop_assert!(close(Pose::from_xyz_euler(given).to_xyz_euler(), given));
        }

        #[test]
        fn inverse_undoes(
            xyz in prop::array::uniform3(-300.0..300.0f64),
            angles in prop::array::uniform3(-400.0..400.0f64),
        ) {
            let [x, y, z] = xyz;
            let [a, b, c] = angles;
            let pose = Pose::from_xyz_euler([x, y, z, a, b, c]);
            let same = pose * pose.inverse();
            prop_assert!(same.position.length() < 1e-9);
            prop_assert!(same.angle_to(&Pose::IDENTITY) < 1e-9);
        }
    }
}
