//! The number that names the contents of a dynamic-data slot.

use core::fmt;

use super::table::{DYNAMIC_TYPES, DynamicTypeSpec};
use super::view::{JointLimitsSource, JointTriple};

/// DynamicTypeID. 32-bit unsigned; output bytes 44 to 59 ask for four, input bytes 140, 168, 196 and
/// 224 tell which four are reported.
///
/// An open set: a number without an entry in Table 12 is kept as it is. Source: PM Table 11, Table 12.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DynamicType(pub u32);

impl DynamicType {
    /// The robot chooses, another type each cycle. Asked for, never reported.
    pub const AUTOMATIC: Self = Self(0);
    /// Firmware version.
    pub const FIRMWARE_VERSION: Self = Self(1);
    /// Product type.
    pub const PRODUCT_TYPE: Self = Self(2);
    /// Serial number.
    pub const SERIAL_NUMBER: Self = Self(3);
    /// Joint limits configuration.
    pub const JOINT_LIMITS_CFG: Self = Self(11);
    /// Model joint limits, joints 1 to 3.
    pub const MODEL_JOINT_LIMITS_1_3: Self = Self(12);
    /// Model joint limits, joints 4 to 6.
    pub const MODEL_JOINT_LIMITS_4_6: Self = Self(13);
    /// Effective joint limits, joints 1 to 3.
    pub const EFFECTIVE_JOINT_LIMITS_1_3: Self = Self(14);
    /// Effective joint limits, joints 4 to 6.
    pub const EFFECTIVE_JOINT_LIMITS_4_6: Self = Self(15);
    /// Work zone configuration.
    pub const WORK_ZONE_CFG: Self = Self(17);
    /// Work zone limits.
    pub const WORK_ZONE_LIMITS: Self = Self(18);
    /// Tool sphere.
    pub const TOOL_SPHERE: Self = Self(19);
    /// Desired conf.
    pub const DESIRED_CONF: Self = Self(20);
    /// Motion queue parameters.
    pub const MOTION_QUEUE_PARAMETERS: Self = Self(21);
    /// Motion queue velocities.
    pub const MOTION_QUEUE_VELOCITIES: Self = Self(22);
    /// Gripper parameters.
    pub const GRIPPER_PARAMETERS: Self = Self(23);
    /// Torque limits configuration.
    pub const TORQUE_LIMITS_CFG: Self = Self(24);
    /// Torque limits.
    pub const TORQUE_LIMITS: Self = Self(25);
    /// Of another robot: vacuum configuration.
    pub const VACUUM_CFG: Self = Self(26);
    /// Of another robot: jump height.
    pub const MOVE_JUMP_HEIGHT: Self = Self(27);
    /// Of another robot: jump approach velocity.
    pub const MOVE_JUMP_APPROACH_VEL: Self = Self(28);
    /// Move mode configuration.
    pub const MOVE_MODE_CFG: Self = Self(29);
    /// Calibration.
    pub const CALIBRATION: Self = Self(30);
    /// Payload.
    pub const PAYLOAD: Self = Self(31);
    /// Target joint velocity.
    pub const TARGET_JOINT_VELOCITY: Self = Self(32);
    /// Target joint torque.
    pub const TARGET_JOINT_TORQUE: Self = Self(33);
    /// Target cartesian velocity.
    pub const TARGET_CARTESIAN_VELOCITY: Self = Self(34);
    /// Collision configuration.
    pub const COLLISION_CFG: Self = Self(36);
    /// Collision status.
    pub const COLLISION_STATUS: Self = Self(37);
    /// Work zone status.
    pub const WORK_ZONE_STATUS: Self = Self(38);
    /// Actual joint position.
    pub const ACTUAL_JOINT_POSITION: Self = Self(40);
    /// Actual pose.
    pub const ACTUAL_POSE: Self = Self(41);
    /// Actual joint velocity.
    pub const ACTUAL_JOINT_VELOCITY: Self = Self(42);
    /// Actual joint torque.
    pub const ACTUAL_JOINT_TORQUE: Self = Self(43);
    /// Actual cartesian velocity.
    pub const ACTUAL_CARTESIAN_VELOCITY: Self = Self(44);
    /// Actual conf.
    pub const ACTUAL_CONF: Self = Self(45);
    /// Accelerometer.
    pub const ACCELEROMETER: Self = Self(46);
    /// External tool status.
    pub const EXTERNAL_TOOL_STATUS: Self = Self(52);
    /// Eoat status.
    pub const EOAT_STATUS: Self = Self(53);
    /// Time scaling.
    pub const TIME_SCALING: Self = Self(54);
    /// Configured joint limits, joints 1 to 3.
    pub const CONFIGURED_JOINT_LIMITS_1_3: Self = Self(61);
    /// Configured joint limits, joints 4 to 6.
    pub const CONFIGURED_JOINT_LIMITS_4_6: Self = Self(62);
    /// Lowest ID that reports a robot variable; the ID is the variable's cyclic ID.
    pub const VARIABLE_FIRST: Self = Self(10_000);
    /// Highest ID that reports a robot variable.
    pub const VARIABLE_LAST: Self = Self(19_999);

    /// Whether this ID reports the robot variable with the same cyclic ID.
    #[must_use]
    pub const fn is_variable(self) -> bool {
        self.0 >= Self::VARIABLE_FIRST.0 && self.0 <= Self::VARIABLE_LAST.0
    }

    /// The ID that reports these limits of these joints.
    #[must_use]
    pub const fn joint_limits(source: JointLimitsSource, joints: JointTriple) -> Self {
        match (source, joints) {
            (JointLimitsSource::Model, JointTriple::First) => Self::MODEL_JOINT_LIMITS_1_3,
            (JointLimitsSource::Model, JointTriple::Last) => Self::MODEL_JOINT_LIMITS_4_6,
            (JointLimitsSource::Effective, JointTriple::First) => Self::EFFECTIVE_JOINT_LIMITS_1_3,
            (JointLimitsSource::Effective, JointTriple::Last) => Self::EFFECTIVE_JOINT_LIMITS_4_6,
            (JointLimitsSource::Configured, JointTriple::First) => {
                Self::CONFIGURED_JOINT_LIMITS_1_3
            }
            (JointLimitsSource::Configured, JointTriple::Last) => Self::CONFIGURED_JOINT_LIMITS_4_6,
        }
    }

    /// The row of [`DYNAMIC_TYPES`] the ID belongs to; `None` for an ID without an entry.
    #[must_use]
    pub fn spec(self) -> Option<&'static DynamicTypeSpec> {
        let position = DYNAMIC_TYPES.partition_point(|spec| spec.last_id < self);
        DYNAMIC_TYPES.get(position).filter(|spec| spec.id <= self)
    }
}

impl fmt::Display for DynamicType {
    /// The number, with its name where it has one: `40 (Actual joint position)`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.spec() {
            Some(spec) => write!(f, "{} ({})", self.0, spec.name),
            None => write!(f, "{}", self.0),
        }
    }
}
