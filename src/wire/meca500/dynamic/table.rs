//! The table of dynamic data types: the single source of their names, values and units.

use super::id::DynamicType as Type;
use crate::wire::meca500::command::Unit;

/// One of the six values of a dynamic data type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DynamicValueSpec {
    /// What it is.
    pub name: &'static str,
    /// Its unit.
    pub unit: Unit,
}

/// One dynamic data type of Table 12.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DynamicTypeSpec {
    /// Its ID; the lowest one of a range.
    pub id: Type,
    /// The highest of its IDs; equal to `id` except for reserved IDs and variables.
    pub last_id: Type,
    /// Its name.
    pub name: &'static str,
    /// The values it uses, at most six. Those it does not use are 0 on the wire (PM L1370).
    pub values: &'static [DynamicValueSpec],
    /// Whether a Meca500 reports it; `None` for reserved IDs.
    pub available: Option<bool>,
    /// Whether it takes part in the automatic rotation; `None` where the manual does not tell.
    pub in_rotation: Option<bool>,
    /// Line of the manual. Source: PM Table 12.
    pub manual_line: u16,
}

const fn value(name: &'static str, unit: Unit) -> DynamicValueSpec {
    DynamicValueSpec { name, unit }
}

const fn reported(
    id: Type,
    name: &'static str,
    values: &'static [DynamicValueSpec],
    manual_line: u16,
) -> DynamicTypeSpec {
    DynamicTypeSpec {
        id,
        last_id: id,
        name,
        values,
        available: Some(true),
        in_rotation: Some(true),
        manual_line,
    }
}

const LIMITS_1_3: &[DynamicValueSpec] = &[
    value("q1_min", Unit::Degree),
    value("q2_min", Unit::Degree),
    value("q3_min", Unit::Degree),
    value("q1_max", Unit::Degree),
    value("q2_max", Unit::Degree),
    value("q3_max", Unit::Degree),
];

const LIMITS_4_6: &[DynamicValueSpec] = &[
    value("q4_min", Unit::Degree),
    value("q5_min", Unit::Degree),
    value("q6_min", Unit::Degree),
    value("q4_max", Unit::Degree),
    value("q5_max", Unit::Degree),
    value("q6_max", Unit::Degree),
];

const WORK_ZONE: &[DynamicValueSpec] = &[
    value("x_min", Unit::Millimetre),
    value("y_min", Unit::Millimetre),
    value("z_min", Unit::Millimetre),
    value("x_max", Unit::Millimetre),
    value("y_max", Unit::Millimetre),
    value("z_max", Unit::Millimetre),
];

const MOTOR_LIMITS: &[DynamicValueSpec] = &[
    value("motor_1_limit", Unit::Percent),
    value("motor_2_limit", Unit::Percent),
    value("motor_3_limit", Unit::Percent),
    value("motor_4_limit", Unit::Percent),
    value("motor_5_limit", Unit::Percent),
    value("motor_6_limit", Unit::Percent),
];

const JOINT_VELOCITIES: &[DynamicValueSpec] = &[
    value("omega1", Unit::DegreePerSecond),
    value("omega2", Unit::DegreePerSecond),
    value("omega3", Unit::DegreePerSecond),
    value("omega4", Unit::DegreePerSecond),
    value("omega5", Unit::DegreePerSecond),
    value("omega6", Unit::DegreePerSecond),
];

const MOTOR_TORQUES: &[DynamicValueSpec] = &[
    value("motor_1_torque", Unit::Percent),
    value("motor_2_torque", Unit::Percent),
    value("motor_3_torque", Unit::Percent),
    value("motor_4_torque", Unit::Percent),
    value("motor_5_torque", Unit::Percent),
    value("motor_6_torque", Unit::Percent),
];

const CARTESIAN_VELOCITY: &[DynamicValueSpec] = &[
    value("x_dot", Unit::MillimetrePerSecond),
    value("y_dot", Unit::MillimetrePerSecond),
    value("z_dot", Unit::MillimetrePerSecond),
    value("omega_x", Unit::DegreePerSecond),
    value("omega_y", Unit::DegreePerSecond),
    value("omega_z", Unit::DegreePerSecond),
];

const JOINT_POSITIONS: &[DynamicValueSpec] = &[
    value("q1", Unit::Degree),
    value("q2", Unit::Degree),
    value("q3", Unit::Degree),
    value("q4", Unit::Degree),
    value("q5", Unit::Degree),
    value("q6", Unit::Degree),
];

const POSE: &[DynamicValueSpec] = &[
    value("x", Unit::Millimetre),
    value("y", Unit::Millimetre),
    value("z", Unit::Millimetre),
    value("alpha", Unit::Degree),
    value("beta", Unit::Degree),
    value("gamma", Unit::Degree),
];

const JOINT_TORQUES: &[DynamicValueSpec] = &[
    value("joint_1_torque", Unit::Percent),
    value("joint_2_torque", Unit::Percent),
    value("joint_3_torque", Unit::Percent),
    value("joint_4_torque", Unit::Percent),
    value("joint_5_torque", Unit::Percent),
    value("joint_6_torque", Unit::Percent),
];

const VARIABLE: &[DynamicValueSpec] = &[
    value("value1", Unit::None),
    value("value2", Unit::None),
    value("value3", Unit::None),
    value("value4", Unit::None),
    value("value5", Unit::None),
    value("value6", Unit::None),
];

/// Every type of Table 12 in ascending order of ID. Source: PM Table 12.
///
/// Type 26 is called unavailable although Table 12 does not say so: the commands that set it are of
/// another robot (PM L6365).
pub const DYNAMIC_TYPES: &[DynamicTypeSpec] = &[
    DynamicTypeSpec {
        available: Some(true),
        in_rotation: Some(false),
        ..reported(Type::AUTOMATIC, "Automatic", &[], 1291)
    },
    reported(
        Type::FIRMWARE_VERSION,
        "Firmware version",
        &[
            value("major_version", Unit::None),
            value("minor_version", Unit::None),
            value("patch_version", Unit::None),
            value("build_number", Unit::None),
        ],
        1292,
    ),
    reported(Type::PRODUCT_TYPE, "Product type", &[value("product_type", Unit::None)], 1293),
    reported(
        Type::SERIAL_NUMBER,
        "Serial number",
        &[value("serial_number_inexact", Unit::None), value("serial_number", Unit::None)],
        1294,
    ),
    DynamicTypeSpec {
        id: Type(4),
        last_id: Type(10),
        name: "Reserved",
        values: &[],
        available: None,
        in_rotation: None,
        manual_line: 1295,
    },
    reported(
        Type::JOINT_LIMITS_CFG,
        "Joint limits configuration",
        &[value("enabled", Unit::None)],
        1296,
    ),
    reported(Type::MODEL_JOINT_LIMITS_1_3, "Model joint limits, joints 1-3", LIMITS_1_3, 1297),
    reported(Type::MODEL_JOINT_LIMITS_4_6, "Model joint limits, joints 4-6", LIMITS_4_6, 1304),
    reported(
        Type::EFFECTIVE_JOINT_LIMITS_1_3,
        "Effective joint limits, joints 1-3",
        LIMITS_1_3,
        1305,
    ),
    reported(
        Type::EFFECTIVE_JOINT_LIMITS_4_6,
        "Effective joint limits, joints 4-6",
        LIMITS_4_6,
        1306,
    ),
    reported(
        Type::WORK_ZONE_CFG,
        "Work zone configuration",
        &[
            value("work_zone_limits_severity", Unit::None),
            value("work_zone_limits_detection_mode", Unit::None),
        ],
        1307,
    ),
    reported(Type::WORK_ZONE_LIMITS, "Work zone limits", WORK_ZONE, 1308),
    reported(
        Type::TOOL_SPHERE,
        "Tool sphere",
        &[
            value("x", Unit::Millimetre),
            value("y", Unit::Millimetre),
            value("z", Unit::Millimetre),
            value("r", Unit::Millimetre),
        ],
        1309,
    ),
    reported(
        Type::DESIRED_CONF,
        "Conf and conf turn (desired)",
        &[
            value("shoulder", Unit::None),
            value("elbow", Unit::None),
            value("wrist", Unit::None),
            value("last_joint_turn", Unit::None),
        ],
        1310,
    ),
    reported(
        Type::MOTION_QUEUE_PARAMETERS,
        "Motion queue parameters",
        &[value("blending_ratio", Unit::Percent), value("velocity_timeout", Unit::Second)],
        1311,
    ),
    reported(
        Type::MOTION_QUEUE_VELOCITIES,
        "Motion queue velocities and accelerations",
        &[
            value("joint_velocity", Unit::Percent),
            value("joint_acceleration", Unit::Percent),
            value("Cartesian_linear_velocity", Unit::MillimetrePerSecond),
            value("Cartesian_angular_velocity", Unit::DegreePerSecond),
            value("Cartesian_acceleration", Unit::Percent),
            value("joint_velocity_limit", Unit::Percent),
        ],
        1318,
    ),
    reported(
        Type::GRIPPER_PARAMETERS,
        "Gripper parameters",
        &[
            value("gripper_force", Unit::Percent),
            value("gripper_velocity", Unit::Percent),
            value("fingers_opening_closed_state", Unit::Millimetre),
            value("fingers_opening_open_state", Unit::Millimetre),
        ],
        1319,
    ),
    reported(
        Type::TORQUE_LIMITS_CFG,
        "Torque limits configuration",
        &[value("severity", Unit::None), value("detection_mode", Unit::None)],
        1320,
    ),
    reported(Type::TORQUE_LIMITS, "Torque limits", MOTOR_LIMITS, 1321),
    DynamicTypeSpec {
        available: Some(false),
        in_rotation: None,
        ..reported(
            Type::VACUUM_CFG,
            "Vacuum configuration",
            &[
                value("holdThreshold", Unit::Kilopascal),
                value("releaseThreshold", Unit::Kilopascal),
                value("purgeDuration", Unit::Second),
            ],
            1322,
        )
    },
    DynamicTypeSpec {
        available: Some(false),
        in_rotation: None,
        ..reported(Type::MOVE_JUMP_HEIGHT, "Move jump height", &[], 1323)
    },
    DynamicTypeSpec {
        available: Some(false),
        in_rotation: None,
        ..reported(Type::MOVE_JUMP_APPROACH_VEL, "Move jump approach velocity", &[], 1324)
    },
    reported(
        Type::MOVE_MODE_CFG,
        "Move mode configuration",
        &[
            value("move_mode", Unit::None),
            value("severity", Unit::None),
            value("duration", Unit::Second),
        ],
        1325,
    ),
    reported(
        Type::CALIBRATION,
        "Robot calibration status",
        &[value("calibrationEnabled", Unit::None), value("calibrated", Unit::None)],
        1332,
    ),
    reported(
        Type::PAYLOAD,
        "Robot payload",
        &[
            value("m", Unit::Kilogram),
            value("c_x", Unit::Millimetre),
            value("c_y", Unit::Millimetre),
            value("c_z", Unit::Millimetre),
        ],
        1333,
    ),
    reported(
        Type::TARGET_JOINT_VELOCITY,
        "Target real-time joint velocity",
        JOINT_VELOCITIES,
        1334,
    ),
    reported(Type::TARGET_JOINT_TORQUE, "Target real-time joint torque", MOTOR_TORQUES, 1335),
    reported(
        Type::TARGET_CARTESIAN_VELOCITY,
        "Target real-time Cartesian velocity",
        CARTESIAN_VELOCITY,
        1336,
    ),
    reported(
        Type::COLLISION_CFG,
        "Collision configuration",
        &[value("collision_severity_level", Unit::None)],
        1337,
    ),
    reported(
        Type::COLLISION_STATUS,
        "Collision status",
        &[
            value("collision_state", Unit::None),
            value("group_of_colliding_object_1", Unit::None),
            value("ID_of_colliding_object_1", Unit::None),
            value("group_of_colliding_object_2", Unit::None),
            value("ID_of_colliding_object_2", Unit::None),
        ],
        1338,
    ),
    reported(
        Type::WORK_ZONE_STATUS,
        "Work zone status",
        &[
            value("work_zone_breach_state", Unit::None),
            value("group_of_object_in_breach", Unit::None),
            value("ID_of_object_in_breach", Unit::None),
        ],
        1339,
    ),
    reported(Type::ACTUAL_JOINT_POSITION, "Actual joint position", JOINT_POSITIONS, 1346),
    reported(Type::ACTUAL_POSE, "Actual end-effector pose", POSE, 1347),
    reported(Type::ACTUAL_JOINT_VELOCITY, "Actual joint velocity", JOINT_VELOCITIES, 1348),
    reported(Type::ACTUAL_JOINT_TORQUE, "Actual joint torque", JOINT_TORQUES, 1349),
    reported(
        Type::ACTUAL_CARTESIAN_VELOCITY,
        "Actual Cartesian velocity",
        CARTESIAN_VELOCITY,
        1350,
    ),
    reported(
        Type::ACTUAL_CONF,
        "Actual conf and conf turn",
        &[
            value("shoulder", Unit::None),
            value("elbow", Unit::None),
            value("wrist", Unit::None),
            value("last_joint_turn", Unit::None),
        ],
        1351,
    ),
    reported(
        Type::ACCELEROMETER,
        "Accelerometer",
        &[
            value("a_x", Unit::GravityPer16000),
            value("a_y", Unit::GravityPer16000),
            value("a_z", Unit::GravityPer16000),
        ],
        1352,
    ),
    reported(
        Type::EXTERNAL_TOOL_STATUS,
        "External tool status",
        &[
            value("type", Unit::None),
            value("homing_done", Unit::None),
            value("error_state", Unit::None),
            value("overheated", Unit::None),
        ],
        1353,
    ),
    reported(
        Type::EOAT_STATUS,
        "EOAT status",
        &[
            value("holding_part_or_valve_1", Unit::None),
            value("desired_fingers_opening_reached_or_valve_2", Unit::None),
            value("gripper_closed", Unit::None),
            value("gripper_open", Unit::None),
            value("gripper_force", Unit::Percent),
            value("fingers_opening", Unit::Millimetre),
        ],
        1360,
    ),
    reported(Type::TIME_SCALING, "Time scaling", &[value("p", Unit::Percent)], 1361),
    reported(
        Type::CONFIGURED_JOINT_LIMITS_1_3,
        "Configured joint limits, joints 1-3",
        LIMITS_1_3,
        1362,
    ),
    reported(
        Type::CONFIGURED_JOINT_LIMITS_4_6,
        "Configured joint limits, joints 4-6",
        LIMITS_4_6,
        1363,
    ),
    DynamicTypeSpec {
        available: Some(false),
        in_rotation: None,
        ..reported(Type(72), "Not named", &[], 1364)
    },
    DynamicTypeSpec {
        available: Some(false),
        in_rotation: None,
        ..reported(Type(73), "Not named", &[], 1365)
    },
    DynamicTypeSpec {
        id: Type::VARIABLE_FIRST,
        last_id: Type::VARIABLE_LAST,
        name: "Robot variable",
        values: VARIABLE,
        available: Some(true),
        in_rotation: None,
        manual_line: 1366,
    },
];
