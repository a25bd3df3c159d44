//! The geometry of a straight line of the tool: position along a segment, orientation by the
//! smallest rotation. Source: PM L2106.

use glam::{DQuat, DVec3};

use super::PlanError;
use crate::sim::meca500::kinematics::{Frames, Joints, forward};
use crate::sim::meca500::pose::{Pose, rotation_vector};

/// How near to half a turn counts as exactly half a turn, in degrees: what is left of 180 degrees
/// after single-precision arguments.
const HALF_TURN_SLACK_DEG: f64 = 1e-4;

/// A line of the tool in the base frame, over a fraction of the way from 0 to 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct LinearPath {
    start: Pose,
    travel: DVec3,
    /// Axis times angle in radians, base frame.
    turn: DVec3,
    /// The flange in the tool frame.
    tool_to_flange: Pose,
}

impl LinearPath {
    /// The line from where the tool is at `start` to `target` (tool in the world).
    pub(super) fn new(start: &Joints, target: &Pose, frames: &Frames) -> Result<Self, PlanError> {
        let from = forward(start) * frames.trf;
        let to = frames.wrf * *target;
        if !(from.is_finite() && to.is_finite()) {
            return Err(PlanError::BadNumber);
        }
        let path = Self {
            start: from,
            travel: to.position - from.position,
            turn: rotation_vector(from.orientation, to.orientation),
            tool_to_flange: frames.trf.inverse(),
        };
        if 180.0 - path.angle_deg() < HALF_TURN_SLACK_DEG {
            return Err(PlanError::HalfTurn);
        }
        Ok(path)
    }

    pub(super) fn length_mm(&self) -> f64 {
        self.travel.length()
    }

    pub(super) fn angle_deg(&self) -> f64 {
        self.turn.length().to_degrees()
    }

    /// The tool in the base frame at the fraction `at` of the way.
    pub(super) fn tool_at(&self, at: f64) -> Pose {
        Pose {
            position: self.start.position + self.travel * at,
            orientation: (DQuat::from_scaled_axis(self.turn * at) * self.start.orientation)
                .normalize(),
        }
    }

    /// The flange in the base frame at the fraction `at` of the way.
    pub(super) fn flange_at(&self, at: f64) -> Pose {
        self.tool_at(at) * self.tool_to_flange
    }

    /// The flange when this line's tool is displaced by what `next` has covered at `next_at`.
    pub(super) fn flange_blended(&self, at: f64, next: &Self, next_at: f64) -> Pose {
        let tool = self.tool_at(at);
        let blended = Pose {
            position: tool.position + next.travel * next_at,
            orientation: DQuat::from_scaled_axis(next.turn * next_at) * tool.orientation,
        };
        blended * next.tool_to_flange
    }
}
