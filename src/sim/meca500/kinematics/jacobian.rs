//! Velocities: from joints to the tool and back.

use glam::DVec3;
use thiserror::Error;

use super::inverse::{elbow_angle, shoulder_radius};
use super::{Joints, joint_centres};

/// Sine of joint 5 or of the elbow's angle under which the arm counts as singular.
const NEAR_SIN: f64 = 1e-5;
/// Distance of the wrist centre from the axis of joint 1, in mm, under which it does.
const NEAR_RADIUS_MM: f64 = 1e-3;

/// The joints are so near a singularity that no joint velocities follow from a tool velocity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("the joints are at a singularity")]
pub struct NearSingular;

/// What each joint's motion does to a point fixed to the flange, in the base frame.
#[derive(Clone, Copy, Debug)]
pub struct Jacobian {
    /// One row a joint: mm of the point and degrees of the flange, per degree of the joint.
    per_joint: [[f64; 6]; 6],
    singular: bool,
}

impl Jacobian {
    /// The Jacobian at `joints` of `point` (in mm, base frame), moving with the flange.
    #[must_use]
    pub fn at(joints: &Joints, point: DVec3) -> Self {
        let chain = joint_centres(joints);
        let mut per_joint = [[0.0; 6]; 6];
        let joints_of_chain = chain.axes.into_iter().zip(chain.axis_points());
        for (row, (axis, origin)) in per_joint.iter_mut().zip(joints_of_chain) {
            let linear = axis.cross(point - origin) * 1f64.to_radians();
            *row = [linear.x, linear.y, linear.z, axis.x, axis.y, axis.z];
        }
        let singular = libm::sin(joints[4].to_radians()).abs() < NEAR_SIN
            || libm::sin(elbow_angle(joints)).abs() < NEAR_SIN
            || shoulder_radius(joints).abs() < NEAR_RADIUS_MM;
        Self { per_joint, singular }
    }

    /// The velocity of the point (mm/s) and of the flange (deg/s) for `joint_velocity` in deg/s.
    #[must_use]
    pub fn twist(&self, joint_velocity: &Joints) -> [f64; 6] {
        let mut twist = [0.0; 6];
        for (row, velocity) in self.per_joint.iter().zip(joint_velocity) {
            for (sum, part) in twist.iter_mut().zip(row) {
                *sum += part * velocity;
            }
        }
        twist
    }

    /// The joint velocities in deg/s that give `twist` (mm/s, deg/s, base frame).
    ///
    /// # Errors
    ///
    /// [`NearSingular`] when the joints are at a wrist, elbow or shoulder singularity.
    pub fn joint_velocity(&self, twist: &[f64; 6]) -> Result<Joints, NearSingular> {
        if self.singular {
            return Err(NearSingular);
        }
        // Equations as rows: coefficients of the six joint velocities, then the wanted component.
        let mut rows = [[0.0; 7]; 6];
        for (component, (row, wanted)) in rows.iter_mut().zip(twist).enumerate() {
            for (joint, effects) in self.per_joint.iter().enumerate() {
                row[joint] = effects[component];
            }
            row[6] = *wanted;
        }
        solve_linear(rows).ok_or(NearSingular)
    }
}

/// Gaussian elimination with partial pivoting; `None` without a unique finite solution.
fn solve_linear(mut rows: [[f64; 7]; 6]) -> Option<[f64; 6]> {
    for column in 0..6 {
        let pivot =
            (column..6).max_by(|a, b| rows[*a][column].abs().total_cmp(&rows[*b][column].abs()))?;
        rows.swap(column, pivot);
        let pivot_row = rows[column];
        if pivot_row[column].abs() < 1e-14 {
            return None;
        }
        for row in rows.iter_mut().skip(column + 1) {
            let factor = row[column] / pivot_row[column];
            for (value, above) in row.iter_mut().zip(pivot_row) {
                *value -= factor * above;
            }
        }
    }
    let mut solution = [0.0; 6];
    for (index, row) in rows.iter().enumerate().rev() {
        let known: f64 = (index + 1..6).map(|later| row[later] * solution[later]).sum();
        solution[index] = (row[6] - known) / row[index];
    }
    solution.iter().all(|value| value.is_finite()).then_some(solution)
}

#[cfg(test)]
mod tests {
    use super::super::{Configuration, forward};
    use super::*;
    use crate::sim::meca500::pose::{Pose, rotation_vector};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn agrees_with_small_motions_and_undoes_itself(
            q1 in -175.0..175.0f64, q2 in -70.0..90.0f64, q3 in -135.0..70.0f64,
            q4 in -170.0..170.0f64, q5 in -115.0..115.0f64, q6 in -180.0..180.0f64,
            velocity in prop::array::uniform6(-100.0..100.0f64),
        ) {
            let joints = [q1, q2, q3, q4, q5, q6];
            let tool = Pose::from_xyz_euler([10.0, 20.0, 30.0, 40.0, 50.0, 60.0]);
            let at = |seconds: f64| {
                let mut moved = joints;
                for (joint, velocity) in moved.iter_mut().zip(velocity) {
                    *joint += velocity * seconds;
                }
                forward(&moved) * tool
            };
            let step = 1e-5;
            let (before, after) = (at(-step), at(step));
            let linear = (after.position - before.position) / (2.0 * step);
            let angular = rotation_vector(before.orientation, after.orientation) / (2.0 * step);
            let jacobian = Jacobian::at(&joints, at(0.0).position);
            let twist = jacobian.twist(&velocity);
            let [vx, vy, vz, wx, wy, wz] = twist;
            prop_assert!((DVec3::new(vx, vy, vz) - linear).length() < 1e-3);
            prop_assert!((DVec3::new(wx, wy, wz).map(f64::to_radians) - angular).length() < 1e-3);
            let configuration = Configuration::of(&joints);
            if configuration.shoulder != 0 && configuration.elbow != 0 && configuration.wrist != 0 {
                let back = jacobian.joint_velocity(&twist);
                prop_assert!(back.is_ok());
                for (back, velocity) in back.iter().flatten().zip(velocity) {
                    prop_assert!((back - velocity).abs() < 1e-4);
                }
            }
        }
    }

    #[test]
    fn the_three_singularities_are_told() {
        let elbow = -libm::atan(60.0 / 19.0).to_degrees();
        let lean = libm::asin(38.0 / 135.0).to_degrees();
        for joints in [
            [0.0; 6],
            [0.0, 20.0, elbow, 0.0, 30.0, 0.0],
            [0.0, lean, -90.0 - lean, 0.0, 30.0, 0.0],
        ] {
            let jacobian = Jacobian::at(&joints, forward(&joints).position);
            assert_eq!(jacobian.joint_velocity(&[1.0; 6]), Err(NearSingular));
        }
    }
}
