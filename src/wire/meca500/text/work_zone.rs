//! Work zone supervision and collision detection.

use super::spec::{
    Category, CyclicEquivalent as Equivalent, TextCommandSpec, configuration, instantaneous,
};
use crate::wire::meca500::command::MotionCommandId as Id;
use crate::wire::meca500::dynamic::DynamicType as Type;

pub(super) const COMMANDS: &[TextCommandSpec] = &[
    instantaneous(
        "GetCollisionCfg",
        Category::WorkZone,
        &[],
        Equivalent::Dynamic(&[Type::COLLISION_CFG]),
        5794,
    ),
    instantaneous(
        "GetCollisionStatus",
        Category::WorkZone,
        &[],
        Equivalent::Dynamic(&[Type::COLLISION_STATUS]),
        5815,
    ),
    instantaneous(
        "GetToolSphere",
        Category::WorkZone,
        &[],
        Equivalent::Dynamic(&[Type::TOOL_SPHERE]),
        5845,
    ),
    instantaneous(
        "GetWorkZoneCfg",
        Category::WorkZone,
        &[],
        Equivalent::Dynamic(&[Type::WORK_ZONE_CFG]),
        5867,
    ),
    instantaneous(
        "GetWorkZoneLimits",
        Category::WorkZone,
        &[],
        Equivalent::Dynamic(&[Type::WORK_ZONE_LIMITS]),
        5889,
    ),
    instantaneous(
        "GetWorkZoneStatus",
        Category::WorkZone,
        &[],
        Equivalent::Dynamic(&[Type::WORK_ZONE_STATUS]),
        5911,
    ),
    configuration("SetCollisionCfg", Category::WorkZone, Id::SET_COLLISION_CFG, 5938),
    configuration("SetToolSphere", Category::WorkZone, Id::SET_TOOL_SPHERE, 5969),
    configuration("SetWorkZoneCfg", Category::WorkZone, Id::SET_WORK_ZONE_CFG, 6002),
    configuration("SetWorkZoneLimits", Category::WorkZone, Id::SET_WORK_ZONE_LIMITS, 6037),
];
