//! World and tool frames: from the tool in the world to the flange in the base, and back.

use super::{Joints, forward};
use crate::sim::meca500::pose::Pose;

/// The two frames a program may set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frames {
    /// The world frame in the base frame (`SetWrf`).
    pub wrf: Pose,
    /// The tool frame in the flange frame (`SetTrf`).
    pub trf: Pose,
}

impl Default for Frames {
    fn default() -> Self {
        Self { wrf: Pose::IDENTITY, trf: Pose::IDENTITY }
    }
}

impl Frames {
    /// The tool in the world for a `flange` in the base.
    #[must_use]
    pub fn tool_of_flange(&self, flange: &Pose) -> Pose {
        self.wrf.inverse() * *flange * self.trf
    }

    /// The flange in the base for a `tool` in the world.
    #[must_use]
    pub fn flange_of_tool(&self, tool: &Pose) -> Pose {
        self.wrf * *tool * self.trf.inverse()
    }

    /// The tool in the world for `joints`.
    #[must_use]
    pub fn tool_of_joints(&self, joints: &Joints) -> Pose {
        self.tool_of_flange(&forward(joints))
    }

    /// The target of `MoveLinRelTrf`: `offset` is given in the tool frame as it is at `joints`.
    ///
    /// Source: PM L2139.
    #[must_use]
    pub fn target_relative_to_tool(&self, joints: &Joints, offset: &Pose) -> Pose {
        self.tool_of_joints(joints) * *offset
    }

    /// The target of `MoveLinRelWrf`: `offset` is given in a frame at the tool's origin that is
    /// parallel to the world.
    ///
    /// The chapter calls the arguments the desired pose in that frame, which would make the target's
    /// orientation independent of the present one; it is read here as a displacement, so that zero
    /// angles keep the orientation, as for the tool frame. Source: PM L2163. Unverified: the
    /// orientation.
    #[must_use]
    pub fn target_relative_to_world(&self, joints: &Joints, offset: &Pose) -> Pose {
        let tool = self.tool_of_joints(joints);
        Pose {
            position: tool.position + offset.position,
            orientation: (offset.orientation * tool.orientation).normalize(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_two_directions_undo_each_other() {
        let frames = Frames {
            wrf: Pose::from_xyz_euler([10.0, 20.0, 30.0, 40.0, 50.0, 60.0]),
            trf: Pose::from_xyz_euler([-5.0, 3.0, 80.0, 10.0, -20.0, 30.0]),
        };
        let flange = forward(&[10.0, 20.0, -30.0, 40.0, 50.0, 60.0]);
        let back = frames.flange_of_tool(&frames.tool_of_flange(&flange));
        assert!(back.position.distance(flange.position) < 1e-9);
        assert!(back.angle_to(&flange) < 1e-9);
    }

    #[test]
    fn relative_targets_differ_by_the_frame_the_offset_is_in() {
        let frames = Frames::default();
        let joints = [0.0; 6];
        let offset = Pose::from_xyz_euler([0.0, 0.0, 10.0, 0.0, 0.0, 30.0]);
        // The flange's z points along the base's x.
        let in_tool = frames.target_relative_to_tool(&joints, &offset);
        assert!((in_tool.position.x - 200.0).abs() < 1e-9);
        assert!((in_tool.orientation * glam::DVec3::Z - glam::DVec3::X).length() < 1e-9);
        let in_world = frames.target_relative_to_world(&joints, &offset);
        assert!((in_world.position.z - 318.0).abs() < 1e-9);
        let z = in_world.orientation * glam::DVec3::Z;
        assert!((z.y - 0.5).abs() < 1e-9 && z.z.abs() < 1e-9);
    }
}
