//! From the flange to the joints, in closed form, one solution per posture.
//!
//! The wrist centre gives joint 1 (front or back), then a triangle gives joints 2 and 3 (elbow up
//! or down), then the remaining rotation gives joints 4 to 6 (no flip or flip). Where a singularity
//! leaves joint 1 or joint 4 open, the value of a reference joint set is kept.

use glam::{DMat3, DVec3};

use super::forward::flange_at_zero;
use super::{
    BASE_TO_SHOULDER_MM, ELBOW_OFFSET_MM, ELBOW_TO_WRIST_MM, Joints, Posture, SHOULDER_TO_ELBOW_MM,
    Side, WRIST_TO_FLANGE_MM, wrap_degrees,
};
use crate::sim::meca500::pose::Pose;

/// Distance of the wrist centre from the axis of joint 1, in mm, under which joint 1 is open.
const OPEN_WAIST_MM: f64 = 1e-9;
/// Sine of joint 5 under which joint 4 is open.
const OPEN_FOREARM_SIN: f64 = 1e-9;
/// How far the cosine of the elbow may exceed 1 before a pose counts as out of reach; about
/// 0.1 nm of reach, the rounding of the computation.
const REACH_SLACK: f64 = 1e-12;

/// A posture and the joints that take it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution {
    /// The label.
    pub posture: Posture,
    /// Joints 1 to 6 in degrees, each within -180 (excluded) to 180. Not checked against limits.
    pub joints: Joints,
}

/// Up to eight solutions.
#[derive(Clone, Copy, Debug)]
pub struct Solutions {
    items: [Option<Solution>; 8],
}

impl Solutions {
    /// The solutions, (1,1,1) first.
    pub fn iter(&self) -> impl Iterator<Item = Solution> + '_ {
        self.items.iter().flatten().copied()
    }

    /// The number of solutions.
    #[must_use]
    pub fn count(&self) -> usize {
        self.iter().count()
    }
}

/// Every posture that brings the flange to `flange` (in the base frame).
///
/// At a singularity the two postures it parts coincide; what it leaves open is taken from
/// `reference`. Empty when the pose is out of reach.
#[must_use]
pub fn inverse(flange: &Pose, reference: &Joints) -> Solutions {
    let target = Target::of(flange);
    let mut items = [None; 8];
    for (item, posture) in items.iter_mut().zip(Posture::all()) {
        *item = target
            .solve(
                Waist::Side(posture.shoulder),
                posture.elbow,
                Forearm::Side(posture.wrist),
                reference,
            )
            .map(|joints| Solution { posture, joints });
    }
    Solutions { items }
}

/// The joints that bring the flange to `flange` in `posture`, or `None` when it is out of reach.
#[must_use]
pub fn solve(flange: &Pose, posture: Posture, reference: &Joints) -> Option<Joints> {
    let waist = Waist::Side(posture.shoulder);
    Target::of(flange).solve(waist, posture.elbow, Forearm::Side(posture.wrist), reference)
}

/// Which joints are held while a singularity is crossed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::sim::meca500) struct Bridge {
    /// Hold joint 1: the wrist centre passes through its axis.
    pub(in crate::sim::meca500) waist: bool,
    /// Hold joint 4: joint 5 passes through zero.
    pub(in crate::sim::meca500) forearm: bool,
}

/// The joints that come nearest to `flange` with joint 1 or joint 4 taken from `held`.
///
/// The error is what the path misses the singularity by; zero when it meets it exactly.
pub(in crate::sim::meca500) fn solve_across(
    flange: &Pose,
    posture: Posture,
    bridge: Bridge,
    held: &Joints,
) -> Option<Joints> {
    let waist = if bridge.waist { Waist::Held } else { Waist::Side(posture.shoulder) };
    let forearm = if bridge.forearm { Forearm::Held } else { Forearm::Side(posture.wrist) };
    Target::of(flange).solve(waist, posture.elbow, forearm, held)
}

/// Signed distance of the wrist centre from the axis of joint 1, in mm; positive in front.
pub(super) fn shoulder_radius(joints: &Joints) -> f64 {
    let lean = joints[1].to_radians();
    let (sin, cos) = libm::sincos(lean + joints[2].to_radians());
    SHOULDER_TO_ELBOW_MM * libm::sin(lean) + ELBOW_TO_WRIST_MM * cos + ELBOW_OFFSET_MM * sin
}

/// Angle between the upper arm and the line from elbow to wrist centre, in radians; zero when the
/// arm is stretched, positive for elbow up, within ±pi.
pub(super) fn elbow_angle(joints: &Joints) -> f64 {
    wrap_degrees(joints[2] + stretched_offset().to_degrees()).to_radians()
}

/// Joint 3 is at minus this angle, in radians, when the arm is stretched: atan(60/19).
fn stretched_offset() -> f64 {
    libm::atan2(ELBOW_TO_WRIST_MM, ELBOW_OFFSET_MM)
}

enum Waist {
    Side(Side),
    Held,
}

enum Forearm {
    Side(Side),
    Held,
}

/// A flange pose taken apart at the wrist centre.
struct Target {
    wrist: DVec3,
    rotation: DMat3,
}

impl Target {
    fn of(flange: &Pose) -> Self {
        let rotation = DMat3::from_quat(flange.orientation);
        Self {
            wrist: flange.position - rotation.z_axis * WRIST_TO_FLANGE_MM,
            rotation: rotation * flange_at_zero().transpose(),
        }
    }

    fn solve(&self, waist: Waist, elbow: Side, forearm: Forearm, held: &Joints) -> Option<Joints> {
        let (q1, radius) = self.waist(&waist, held[0].to_radians());
        let (q2, q3) = self.arm(radius, elbow)?;
        let lower_arm = DMat3::from_rotation_z(q1) * DMat3::from_rotation_y(q2 + q3);
        let hand = lower_arm.transpose() * self.rotation;
        let [q4, q5, q6] = wrist_angles(&hand, &forearm, held[3].to_radians());
        Some([q1, q2, q3, q4, q5, q6].map(|angle| wrap_degrees(angle.to_degrees())))
    }

    /// Joint 1 and the signed distance of the wrist centre from its axis.
    fn waist(&self, waist: &Waist, held: f64) -> (f64, f64) {
        let radius = libm::hypot(self.wrist.x, self.wrist.y);
        match waist {
            Waist::Side(side) if radius >= OPEN_WAIST_MM => {
                let sign = side.sign();
                (libm::atan2(sign * self.wrist.y, sign * self.wrist.x), sign * radius)
            }
            Waist::Side(_) | Waist::Held => {
                let (sin, cos) = libm::sincos(held);
                (held, self.wrist.x * cos + self.wrist.y * sin)
            }
        }
    }

    fn arm(&self, radius: f64, elbow: Side) -> Option<(f64, f64)> {
        let height = self.wrist.z - BASE_TO_SHOULDER_MM;
        let upper = SHOULDER_TO_ELBOW_MM;
        let lower_squared =
            ELBOW_TO_WRIST_MM * ELBOW_TO_WRIST_MM + ELBOW_OFFSET_MM * ELBOW_OFFSET_MM;
        let lower = libm::sqrt(lower_squared);
        let distance_squared = radius * radius + height * height;
        let cos = (distance_squared - upper * upper - lower_squared) / (2.0 * upper * lower);
        if cos.is_nan() || cos.abs() > 1.0 + REACH_SLACK {
            return None;
        }
        let cos = cos.clamp(-1.0, 1.0);
        let sin = elbow.sign() * libm::sqrt((1.0 - cos) * (1.0 + cos));
        let q2 = libm::atan2(radius, height) - libm::atan2(lower * sin, upper + lower * cos);
        Some((q2, libm::atan2(sin, cos) - stretched_offset()))
    }
}

/// Joints 4 to 6 in radians of `hand` = Rx(q4) Ry(q5) Rx(q6).
fn wrist_angles(hand: &DMat3, forearm: &Forearm, held: f64) -> [f64; 3] {
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = *hand;
    let sin = libm::hypot(x.y, x.z);
    match forearm {
        Forearm::Side(side) if sin >= OPEN_FOREARM_SIN => {
            let sign = side.sign();
            [
                libm::atan2(sign * x.y, -sign * x.z),
                sign * libm::atan2(sin, x.x),
                libm::atan2(sign * y.x, sign * z.x),
            ]
        }
        Forearm::Side(_) | Forearm::Held => {
            let (sin, cos) = libm::sincos(held);
            // The second row of Rx(-q4) Rx(q4) Ry(q5) Rx(q6) holds joint 6 alone.
            let (row_y, row_z) = (cos * y.y + sin * y.z, cos * z.y + sin * z.z);
            [held, libm::atan2(sin * x.y - cos * x.z, x.x), libm::atan2(-row_z, row_y)]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Configuration, MODEL_MAX, MODEL_MIN, forward};
    use super::*;
    use proptest::prelude::*;
    use rs_opw_kinematics::kinematic_traits::Kinematics;
    use rs_opw_kinematics::kinematics_impl::OPWKinematics;
    use rs_opw_kinematics::parameters::opw_kinematics::Parameters;

    fn within_model(joints: &Joints) -> bool {
        joints.iter().zip(MODEL_MIN).all(|(q, min)| *q >= min)
            && joints.iter().zip(MODEL_MAX).all(|(q, max)| *q <= max)
    }

    /// The same arm in a library that nobody here wrote; it works in radians and labels nothing.
    fn witness() -> OPWKinematics {
        OPWKinematics::new(Parameters {
            a1: 0.0,
            a2: -38.0,
            b: 0.0,
            c1: 135.0,
            c2: 135.0,
            c3: 120.0,
            c4: 70.0,
            offsets: [0.0, 0.0, -core::f64::consts::FRAC_PI_2, 0.0, 0.0, 0.0],
            sign_corrections: [1; 6],
            dof: 6,
        })
    }

    fn distance(a: &Pose, b: &Pose) -> f64 {
        a.position.distance(b.position) + a.angle_to(b)
    }

    #[test]
    fn the_figure_of_eight_postures() {
        let pose = Pose::from_xyz_euler([77.0, 210.0, 300.0, -103.0, 36.0, 175.0]);
        let solutions = inverse(&pose, &[0.0; 6]);
        assert_eq!(solutions.count(), 8);
        for (solution, posture) in solutions.iter().zip(Posture::all()) {
            assert_eq!(solution.posture, posture);
            assert_eq!(Posture::of(&solution.joints), posture);
            assert!(within_model(&solution.joints), "{posture:?} {:?}", solution.joints);
            assert!(distance(&forward(&solution.joints), &pose) < 1e-9);
        }
        let first = solutions.iter().next().map(|solution| solution.joints);
        let typed = [76.961, 18.732, -24.511, -55.458, 28.637, 133.726];
        for (found, typed) in first.iter().flatten().zip(typed) {
            assert!((found - typed).abs() < 6e-4, "{found} for {typed}");
        }
    }

    #[test]
    fn out_of_reach_has_no_solution() {
        for xyz in [[400.0, 0.0, 308.0], [0.0, 0.0, 600.0], [f64::NAN, 0.0, 0.0]] {
            let [x, y, z] = xyz;
            let pose = Pose::from_xyz_euler([x, y, z, 0.0, 90.0, 0.0]);
            assert_eq!(inverse(&pose, &[0.0; 6]).count(), 0);
        }
    }

    #[test]
    fn a_singularity_keeps_what_the_reference_says() {
        let wrist_open = [10.0, 20.0, 30.0, 40.0, 0.0, 60.0];
        for solution in inverse(&forward(&wrist_open), &wrist_open).iter() {
            if solution.posture.shoulder == Side::Positive
                && solution.posture.elbow == Side::Positive
            {
                for (found, expected) in solution.joints.iter().zip(wrist_open) {
                    assert!((found - expected).abs() < 1e-6, "{found} for {expected}");
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]
        #[test]
        fn inverse_finds_the_joints_in_their_posture(
            q1 in -175.0..175.0f64, q2 in -70.0..90.0f64, q3 in -135.0..70.0f64,
            q4 in -170.0..170.0f64, q5 in -115.0..115.0f64, q6 in -179.9..180.0f64,
        ) {
            let joints = [q1, q2, q3, q4, q5, q6];
            let configuration = Configuration::of(&joints);
            prop_assume!(
                configuration.shoulder != 0 && configuration.elbow != 0 && configuration.wrist != 0
            );
            let pose = forward(&joints);
            let found = solve(&pose, Posture::of(&joints), &[0.0; 6]);
            prop_assert!(found.is_some());
            for (found, expected) in found.iter().flatten().zip(joints) {
                prop_assert!((found - expected).abs() < 1e-6, "{} for {}", found, expected);
            }
            for solution in inverse(&pose, &[0.0; 6]).iter() {
                prop_assert!(distance(&forward(&solution.joints), &pose) < 1e-8);
                prop_assert_eq!(Posture::of(&solution.joints), solution.posture);
            }
        }

        #[test]
        fn an_independent_library_agrees(
            q1 in -175.0..175.0f64, q2 in -70.0..90.0f64, q3 in -135.0..70.0f64,
            q4 in -170.0..170.0f64, q5 in -115.0..115.0f64, q6 in -179.9..180.0f64,
        ) {
            let joints = [q1, q2, q3, q4, q5, q6];
            let pose = forward(&joints);
            let theirs = witness().forward(&joints.map(f64::to_radians));
            let theirs = Pose {
                position: DVec3::from_array(theirs.translation.to_array()),
                orientation: glam::DQuat::from_array(theirs.rotation.to_array()),
            };
            prop_assert!(distance(&pose, &theirs) < 1e-9, "{:?} {:?}", pose, theirs);
        }
    }

    #[test]
    fn an_independent_library_finds_the_same_eight_postures() {
        let typed = [77.0, 210.0, 300.0, -103.0, 36.0, 175.0];
        let pose = Pose::from_xyz_euler(typed);
        let theirs = witness().inverse(&rs_opw_kinematics::pose::Pose::from_parts(
            rs_opw_kinematics::glam::DVec3::from_array(pose.position.to_array()),
            rs_opw_kinematics::glam::DQuat::from_array(pose.orientation.to_array()),
        ));
        for solution in inverse(&pose, &[0.0; 6]).iter() {
            assert!(
                theirs.iter().any(|their| {
                    let their = their.map(f64::to_degrees);
                    solution.joints.iter().zip(their).all(|(a, b)| wrap_degrees(a - b).abs() < 1e-6)
                }),
                "{solution:?} is not among {theirs:?}"
            );
        }
    }
}
