//! Motor torques: a documented approximation.
//!
//! The robot's dynamic model is not public. Here a motor's calculated torque is that of gravity on
//! four point masses and the payload, plus an inertia times the joint's acceleration, as a
//! percentage of a chosen largest torque. The actual torque adds what pushes on a joint, and a
//! spring for a joint that is blocked while its target moves on.
//!
//! Good enough for limits and their severities to act where they should; not for figures.

use glam::DVec3;

use super::kinematics::{Joints, joint_centres};
use super::motion::JointState;
use crate::wire::meca500::command::{Payload, TorqueDetection};

/// Standard gravity, in m/s².
const GRAVITY: f64 = 9.806_65;
/// Point masses, in kg: upper arm, elbow, forearm, wrist. Chosen.
const MASSES_KG: [f64; 4] = [0.9, 0.5, 0.5, 0.3];
/// Largest torques, in N m. Chosen.
const LARGEST_TORQUE: [f64; 6] = [12.0, 12.0, 8.0, 2.0, 2.0, 1.5];
/// Inertias, in kg m². Chosen.
const INERTIA: [f64; 6] = [0.08, 0.08, 0.03, 0.003, 0.003, 0.001];
/// Torque of a blocked joint for each degree its target is ahead, in percent.
const SPRING_PERCENT_PER_DEG: f64 = 25.0;
/// Acceleration below which a joint counts as moving steadily, in deg/s².
const STEADY_DEG_PER_S2: f64 = 1e-3;

/// What pushes on the arm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Disturbance {
    /// Torque from outside, in percent of the largest.
    pub(super) push_percent: [f64; 6],
    /// Joints that cannot move, and where they stand, in degrees.
    pub(super) blocked_at: [Option<f64>; 6],
}

impl Disturbance {
    pub(super) fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// The joints as they are when the robot wants them at `target`.
    pub(super) fn actual(&self, target: &Joints) -> Joints {
        let mut joints = *target;
        for (joint, blocked) in joints.iter_mut().zip(self.blocked_at) {
            *joint = blocked.unwrap_or(*joint);
        }
        joints
    }
}

/// Calculated torques, in percent.
pub(super) fn calculated(state: &JointState, payload: &Payload) -> [f64; 6] {
    let chain = joint_centres(&state.position);
    let centre = DVec3::new(payload.c_x.into(), payload.c_y.into(), payload.c_z.into());
    let bodies = [
        ((chain.shoulder + chain.elbow) / 2.0, MASSES_KG[0], 1),
        (chain.elbow, MASSES_KG[1], 2),
        ((chain.forearm + chain.wrist) / 2.0, MASSES_KG[2], 3),
        ((chain.wrist + chain.flange.position) / 2.0, MASSES_KG[3], 5),
        (chain.flange.position + chain.flange.orientation * centre, f64::from(payload.m), 6),
    ];
    let mut torques = [0.0; 6];
    let joints = chain.axes.into_iter().zip(chain.axis_points()).enumerate();
    for (index, (axis, point)) in joints {
        let mut torque = INERTIA[index] * state.acceleration[index].to_radians();
        for (position, mass, last_joint) in bodies {
            if index <= last_joint {
                let lever_m = (position - point) / 1000.0;
                // The motor holds against gravity.
                torque += axis.dot(lever_m.cross(DVec3::Z)) * mass * GRAVITY;
            }
        }
        let percent = torque / LARGEST_TORQUE[index] * 100.0;
        torques[index] = if percent.is_finite() { percent.clamp(-100.0, 100.0) } else { 0.0 };
    }
    torques
}

/// Actual torques, in percent.
pub(super) fn actual(state: &JointState, payload: &Payload, disturbance: &Disturbance) -> [f64; 6] {
    let mut torques = calculated(state, payload);
    for (index, torque) in torques.iter_mut().enumerate() {
        let spring = disturbance.blocked_at[index]
            .map_or(0.0, |at| (state.position[index] - at) * SPRING_PERCENT_PER_DEG);
        let sum = *torque + disturbance.push_percent[index] + spring;
        *torque = sum.clamp(-100.0, 100.0);
    }
    torques
}

/// Whether a joint is at the end of its strength: what error 3005 stands for here.
pub(super) fn is_overloaded(state: &JointState, disturbance: &Disturbance) -> bool {
    let springs = state.position.iter().zip(disturbance.blocked_at);
    springs
        .filter_map(|(position, blocked)| blocked.map(|at| (position - at).abs()))
        .any(|deviation| deviation * SPRING_PERCENT_PER_DEG >= 100.0)
}

/// Whether a torque exceeds its limit. Source: PM L2844, L2895-2897.
pub(super) fn exceeds(
    limits: &[f32; 6],
    detection: TorqueDetection,
    state: &JointState,
    payload: &Payload,
    disturbance: &Disturbance,
) -> bool {
    let actual = actual(state, payload, disturbance);
    let compared = match detection {
        TorqueDetection::Always => actual,
        TorqueDetection::ExceptAcceleration => {
            if state.acceleration.iter().any(|value| value.abs() > STEADY_DEG_PER_S2) {
                return false;
            }
            actual
        }
        TorqueDetection::Deviation => {
            let mut deviation = actual;
            for (value, calculated) in deviation.iter_mut().zip(calculated(state, payload)) {
                *value -= calculated;
            }
            deviation
        }
    };
    compared.iter().zip(limits).any(|(torque, limit)| torque.abs() > f64::from(*limit))
}
