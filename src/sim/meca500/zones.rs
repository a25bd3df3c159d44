//! Work zone and collisions: a box, a sphere, and a few capsules for the arm.
//!
//! The bodies of the real links are not public. Here the arm is a chain of thin capsules around the
//! joint centres; the tool is the tool sphere and, where an MPM500 is fitted, a sphere in its place.
//! Thin, because a false collision would stop a program that the real robot runs: only the
//! interferences of a hand reaching into the base or the upper arm are found.
//!
//! Source: PM L5782-6052. The robot looks a little ahead, so that it stops before the breach; the
//! manual calls that imminent.

use glam::DVec3;

use super::kinematics::{Chain, Joints, joint_centres};
use super::settings::{FittedTool, PersistentSettings};
use crate::wire::meca500::command::{Severity, WorkZoneMode};

/// Group of an object: links, flange, tool. Source: PM L5828.
const LINKS: u32 = 0;
const FLANGE: u32 = 1;
const TOOL: u32 = 2;
/// Number of the MPM500 in the tool's group.
const MPM500: u32 = 10_000;
/// Radius of the sphere that stands for the MPM500, and distance of its centre from the flange.
const MPM500_RADIUS_MM: f64 = 20.0;
const MPM500_CENTRE_MM: f64 = 15.0;
/// Radii of base, upper arm, forearm and hand, in mm. Chosen thin.
const BASE_RADIUS_MM: f64 = 40.0;
const UPPER_ARM_RADIUS_MM: f64 = 25.0;
const FOREARM_RADIUS_MM: f64 = 25.0;
const HAND_RADIUS_MM: f64 = 15.0;

/// An object: its group and its number in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Object {
    pub(super) group: u32,
    pub(super) id: u32,
}

/// What is wrong at a place of the arm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Findings {
    /// The object outside the work zone.
    pub(super) breach: Option<Object>,
    /// The two objects that collide.
    pub(super) collision: Option<[Object; 2]>,
}

impl Findings {
    pub(super) const fn is_none(&self) -> bool {
        self.breach.is_none() && self.collision.is_none()
    }
}

struct Sphere {
    centre: DVec3,
    radius: f64,
    id: u32,
}

fn tool_spheres(
    chain: &Chain,
    settings: &PersistentSettings,
    tool: FittedTool,
) -> [Option<Sphere>; 2] {
    let at = |offset: DVec3| chain.flange.position + chain.flange.orientation * offset;
    let [x, y, z, radius] = settings.tool_sphere;
    let sphere = (settings.tool_sphere != [0.0; 4]).then(|| Sphere {
        centre: at(DVec3::new(x, y, z)),
        radius,
        id: 0,
    });
    let module = (tool == FittedTool::Mpm500).then(|| Sphere {
        centre: at(DVec3::new(0.0, 0.0, MPM500_CENTRE_MM)),
        radius: MPM500_RADIUS_MM,
        id: MPM500,
    });
    [sphere, module]
}

/// Looks at the arm at `joints`.
pub(super) fn inspect(
    joints: &Joints,
    settings: &PersistentSettings,
    tool: FittedTool,
) -> Findings {
    let chain = joint_centres(joints);
    let spheres = tool_spheres(&chain, settings, tool);
    Findings { breach: breach(&chain, settings, &spheres), collision: collision(&chain, &spheres) }
}

/// Whether looking is worth it: a robot with the factory's zone and severity 0 has nothing to find.
pub(super) fn is_watching(settings: &PersistentSettings) -> bool {
    settings.work_zone_severity != Severity::Silent
        || settings.collision_severity != Severity::Silent
}

fn breach(
    chain: &Chain,
    settings: &PersistentSettings,
    spheres: &[Option<Sphere>; 2],
) -> Option<Object> {
    if settings.work_zone_min == PersistentSettings::FACTORY_WORK_ZONE_MIN
        && settings.work_zone_max == PersistentSettings::FACTORY_WORK_ZONE_MAX
    {
        return None;
    }
    let min = DVec3::from_array(settings.work_zone_min);
    let max = DVec3::from_array(settings.work_zone_max);
    let leaves = |centre: DVec3, radius: f64| {
        (centre - DVec3::splat(radius)).cmplt(min).any()
            || (centre + DVec3::splat(radius)).cmpgt(max).any()
    };
    let flange = Object { group: FLANGE, id: 0 };
    let tool = || {
        let mut outside = spheres.iter().flatten().filter(|s| leaves(s.centre, s.radius));
        outside.next().map(|sphere| Object { group: TOOL, id: sphere.id })
    };
    match settings.work_zone_mode {
        WorkZoneMode::FlangeCenterPoint => leaves(chain.flange.position, 0.0).then_some(flange),
        WorkZoneMode::Tool => tool(),
        WorkZoneMode::ToolAndLinks => tool().or_else(|| {
            let links = [
                (chain.elbow, UPPER_ARM_RADIUS_MM, 2),
                (chain.forearm, FOREARM_RADIUS_MM, 3),
                (chain.wrist, FOREARM_RADIUS_MM, 4),
                (chain.flange.position, HAND_RADIUS_MM, 6),
            ];
            let mut outside = links.into_iter().filter(|(at, radius, _)| leaves(*at, *radius));
            outside.next().map(|(_, _, id)| Object { group: LINKS, id })
        }),
    }
}

fn collision(chain: &Chain, spheres: &[Option<Sphere>; 2]) -> Option<[Object; 2]> {
    let link = |id| Object { group: LINKS, id };
    let base = (DVec3::ZERO, chain.shoulder, BASE_RADIUS_MM);
    let upper_arm = (chain.shoulder, chain.elbow, UPPER_ARM_RADIUS_MM);
    let forearm = (chain.forearm, chain.wrist, FOREARM_RADIUS_MM);
    let hand = (chain.wrist, chain.flange.position, HAND_RADIUS_MM);
    for sphere in spheres.iter().flatten() {
        for (capsule, id) in [(base, 0), (upper_arm, 2), (forearm, 4)] {
            let (from, to, radius) = capsule;
            if point_to_segment(sphere.centre, from, to) < radius + sphere.radius {
                return Some([link(id), Object { group: TOOL, id: sphere.id }]);
            }
        }
    }
    for (capsule, id) in [(base, 0), (upper_arm, 2)] {
        let (from, to, radius) = capsule;
        // The hand's middle is near before the hand is: most arms are done here.
        let reach = (hand.1 - hand.0).length() / 2.0 + radius + hand.2;
        let is_near = point_to_segment((hand.0 + hand.1) / 2.0, from, to) < reach;
        if is_near && segments(from, to, hand.0, hand.1) < radius + hand.2 {
            return Some([link(id), link(6)]);
        }
    }
    None
}

fn point_to_segment(point: DVec3, from: DVec3, to: DVec3) -> f64 {
    let along = to - from;
    let length = along.length_squared();
    let t = if length > 0.0 { ((point - from).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
    point.distance(from + along * t)
}

/// Distance of two segments, by halving: a few millimetres do not matter here.
fn segments(from: DVec3, to: DVec3, other_from: DVec3, other_to: DVec3) -> f64 {
    let distance = |t: f64| point_to_segment(from + (to - from) * t, other_from, other_to);
    // The distance to a convex set along a line is convex, so a ternary search finds its least.
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..16 {
        let third = (high - low) / 3.0;
        if distance(low + third) < distance(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    distance((low + high) / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::meca500::kinematics::inverse;
    use crate::sim::meca500::pose::Pose;

    #[test]
    fn no_posture_of_the_manuals_pose_collides() {
        let pose = Pose::from_xyz_euler([77.0, 210.0, 300.0, -103.0, 36.0, 175.0]);
        let settings = PersistentSettings::default();
        for solution in inverse(&pose, &[0.0; 6]).iter() {
            assert!(inspect(&solution.joints, &settings, FittedTool::None).is_none());
        }
    }

    #[test]
    fn a_hand_in_the_base_collides() {
        // The wrist bent back over a lowered forearm.
        let joints = [0.0, -20.0, 70.0, 0.0, 100.0, 0.0];
        let findings = inspect(&joints, &PersistentSettings::default(), FittedTool::None);
        assert!(findings.collision.is_some());
    }

    #[test]
    fn a_large_tool_sphere_always_meets_the_yoke() {
        let settings = PersistentSettings {
            tool_sphere: [0.0, 0.0, 0.0, 60.0],
            ..PersistentSettings::default()
        };
        let findings = inspect(&[0.0; 6], &settings, FittedTool::None);
        assert_eq!(findings.collision.map(|objects| objects[0].id), Some(4));
    }
}
