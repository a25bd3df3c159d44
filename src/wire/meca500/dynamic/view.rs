//! The six values of a slot with their meaning, and back.

use super::id::DynamicType as Type;
use super::tool::{CollisionObject, Eoat, EoatStatus, ExternalTool, ObjectGroup};
use super::value::DynamicValue;
use crate::wire::meca500::command::{
    ConfSign, MoveMode, Payload, Pose, Severity, ToolSphere, TorqueDetection, TorqueSeverity,
    WorkZoneLimits, WorkZoneMode, coded, exact_integer,
};

coded! {
    /// Product type numbers. Source: PM Table 12, ID 2.
    ProductType {
        /// Meca500, revision 3.
        Meca500R3 = 3,
        /// Meca500, revision 4.
        Meca500R4 = 4,
        /// MCS500, revision 1: another robot.
        Mcs500R1 = 20,
    }
}

coded! {
    /// Actual posture parameter. Source: PM Table 12, ID 45.
    ActualConfSign {
        /// -1: shoulder back, elbow down, wrist flipped.
        Minus = -1,
        /// At or near the singularity between the two.
        Singular = 0,
        /// 1: shoulder front, elbow up, wrist not flipped.
        Plus = 1,
    }
}

/// Which joint limits are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum JointLimitsSource {
    /// Of the model: what the mechanics allow.
    Model,
    /// In force now.
    Effective,
    /// Configured with SetJointLimits, in force or not.
    Configured,
}

/// Which three of the six joints are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum JointTriple {
    /// Joints 1 to 3.
    First,
    /// Joints 4 to 6.
    Last,
}

/// Values of a dynamic-data slot by type. Source: PM Table 12.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DynamicView {
    /// Type 1.
    FirmwareVersion {
        /// Major version.
        major: u32,
        /// Minor version.
        minor: u32,
        /// Patch version.
        patch: u32,
        /// Build number.
        build: u32,
    },
    /// Type 2.
    ProductType(ProductType),
    /// Type 3: the exact number, from the second value; the first is the same as an inexact Real.
    SerialNumber(u32),
    /// Type 11: whether configured joint limits are in force.
    JointLimitsCfg(bool),
    /// Types 12 to 15, 61 and 62: limits of three joints, in degrees.
    JointLimits {
        /// Which limits.
        source: JointLimitsSource,
        /// Which joints.
        joints: JointTriple,
        /// Lowest positions.
        min: [f32; 3],
        /// Highest positions.
        max: [f32; 3],
    },
    /// Type 17.
    WorkZoneCfg {
        /// What a breach leads to.
        severity: Severity,
        /// What must stay inside.
        mode: WorkZoneMode,
    },
    /// Type 18, in mm.
    WorkZoneLimits(WorkZoneLimits),
    /// Type 19, in mm.
    ToolSphere(ToolSphere),
    /// Type 20: desired posture and turn. `None` is NaN on the wire: the robot chooses.
    DesiredConf {
        /// Shoulder.
        c_s: Option<ConfSign>,
        /// Elbow.
        c_e: Option<ConfSign>,
        /// Wrist.
        c_w: Option<ConfSign>,
        /// Turn of joint 6.
        c_t: Option<i16>,
    },
    /// Type 21.
    MotionQueueParameters {
        /// Blending.
        blending_percent: f32,
        /// Velocity timeout.
        velocity_timeout_s: f32,
    },
    /// Type 22. Table 12 calls all six percentages; the units of the third and fourth are those of
    /// the commands that set them. `Unverified:`
    MotionQueueVelocities {
        /// Joint velocity.
        joint_vel_percent: f32,
        /// Joint acceleration.
        joint_acc_percent: f32,
        /// Linear velocity of the tool.
        cart_lin_vel_mm_per_s: f32,
        /// Angular velocity of the tool.
        cart_ang_vel_deg_per_s: f32,
        /// Acceleration of the tool.
        cart_acc_percent: f32,
        /// Limit of the joint velocities.
        joint_vel_limit_percent: f32,
    },
    /// Type 23.
    GripperParameters {
        /// Grip force.
        force_percent: f32,
        /// Finger velocity.
        vel_percent: f32,
        /// Opening that counts as closed.
        d_closed_mm: f32,
        /// Opening that counts as open.
        d_open_mm: f32,
    },
    /// Type 24.
    TorqueLimitsCfg {
        /// What an exceeded limit leads to.
        severity: TorqueSeverity,
        /// What the limit is compared with.
        detection: TorqueDetection,
    },
    /// Type 25: limits of the six motors, in percent.
    TorqueLimits([f32; 6]),
    /// Type 29.
    MoveModeCfg {
        /// How moves are timed.
        mode: MoveMode,
        /// What a move that cannot keep its duration does.
        severity: Severity,
        /// Duration of time-based moves.
        duration_s: f32,
    },
    /// Type 30.
    Calibration {
        /// The calibration is used.
        enabled: bool,
        /// The robot was calibrated.
        calibrated: bool,
    },
    /// Type 31.
    Payload(Payload),
    /// Type 32: calculated joint velocities, in degrees per second.
    TargetJointVelocity([f32; 6]),
    /// Type 33: calculated motor torques, signed, in percent.
    TargetJointTorque([f32; 6]),
    /// Type 34: calculated tool velocity, three in mm/s and three in degrees per second.
    TargetCartesianVelocity([f32; 6]),
    /// Type 36: what an imminent collision leads to.
    CollisionCfg(Severity),
    /// Type 37; both objects are all zero while there is no collision.
    CollisionStatus {
        /// A collision is imminent.
        collision: bool,
        /// One object.
        first: CollisionObject,
        /// The other.
        second: CollisionObject,
    },
    /// Type 38; the object is all zero while there is no breach.
    WorkZoneStatus {
        /// Something leaves the work zone.
        breach: bool,
        /// What.
        object: CollisionObject,
    },
    /// Type 40: measured joint positions, in degrees.
    ActualJointPosition([f32; 6]),
    /// Type 41: measured pose of the tool frame.
    ActualPose(Pose),
    /// Type 42: measured joint velocities, in degrees per second.
    ActualJointVelocity([f32; 6]),
    /// Type 43: measured torques, signed, in percent.
    ActualJointTorque([f32; 6]),
    /// Type 44: measured tool velocity, three in mm/s and three in degrees per second.
    ActualCartesianVelocity([f32; 6]),
    /// Type 45: posture and turn as measured.
    ActualConf {
        /// Shoulder.
        c_s: ActualConfSign,
        /// Elbow.
        c_e: ActualConfSign,
        /// Wrist.
        c_w: ActualConfSign,
        /// Turn of joint 6.
        c_t: i16,
    },
    /// Type 46: acceleration of link 5 along the world frame; 16000 is 1 g.
    Accelerometer([f32; 3]),
    /// Type 52. Whether the simulated or the mounted tool is meant is not stated.
    ExternalToolStatus {
        /// The tool.
        tool: ExternalTool,
        /// It is homed.
        homed: bool,
        /// It is in error.
        error: bool,
        /// It is too hot.
        overheated: bool,
    },
    /// Type 53.
    EoatStatus(EoatStatus),
    /// Type 54: speed of the robot's time, in percent.
    TimeScaling(f32),
    /// Types 10000 to 19999: a robot variable.
    Variable {
        /// Its cyclic ID.
        cyclic_id: u16,
        /// Its values; those it does not have are 0.
        values: [f32; 6],
    },
    /// Any other type, or a value without a meaning in a known one.
    Unknown {
        /// The type.
        ty: Type,
        /// The six values.
        values: [f32; 6],
    },
}

fn flag(value: f32) -> Option<bool> {
    match exact_integer(value)? {
        0 => Some(false),
        1 => Some(true),
        _ => None,
    }
}

fn integer<T: TryFrom<i32>>(value: f32) -> Option<T> {
    exact_integer(value).and_then(|integer| T::try_from(integer).ok())
}

/// `Some(None)` for NaN; `None` for a number without a meaning.
fn automatic_or<T>(value: f32, read: impl Fn(f32) -> Option<T>) -> Option<Option<T>> {
    if value.is_nan() { Some(None) } else { read(value).map(Some) }
}

fn object(group: f32, id: f32) -> Option<CollisionObject> {
    Some(CollisionObject { group: ObjectGroup::from_real(group)?, id: integer(id)? })
}

fn real(on: bool) -> f32 {
    f32::from(u8::from(on))
}

fn sign(choice: Option<ConfSign>) -> f32 {
    choice.map_or(f32::NAN, ConfSign::to_real)
}

impl DynamicView {
    /// Reads the values of a slot. Never refuses; see [`DynamicView::Unknown`].
    #[must_use]
    pub fn decode(slot: &DynamicValue, eoat: Eoat) -> Self {
        let (ty, values) = (slot.dynamic_type(), slot.values());
        Self::decode_typed(slot, eoat).unwrap_or(Self::Unknown { ty, values })
    }

    fn decode_typed(slot: &DynamicValue, eoat: Eoat) -> Option<Self> {
        let values = slot.values();
        let [v1, v2, v3, v4, v5, v6] = values;
        let joint_limits = |source, joints| Self::JointLimits {
            source,
            joints,
            min: [v1, v2, v3],
            max: [v4, v5, v6],
        };
        Some(match slot.dynamic_type() {
            Type::FIRMWARE_VERSION => Self::FirmwareVersion {
                major: integer(v1)?,
                minor: integer(v2)?,
                patch: integer(v3)?,
                build: integer(v4)?,
            },
            Type::PRODUCT_TYPE => Self::ProductType(ProductType::from_real(v1)?),
            Type::SERIAL_NUMBER => {
                let [_, serial, ..] = slot.raw_bits();
                Self::SerialNumber(serial)
            }
            Type::JOINT_LIMITS_CFG => Self::JointLimitsCfg(flag(v1)?),
            Type::MODEL_JOINT_LIMITS_1_3 => {
                joint_limits(JointLimitsSource::Model, JointTriple::First)
            }
            Type::MODEL_JOINT_LIMITS_4_6 => {
                joint_limits(JointLimitsSource::Model, JointTriple::Last)
            }
            Type::EFFECTIVE_JOINT_LIMITS_1_3 => {
                joint_limits(JointLimitsSource::Effective, JointTriple::First)
            }
            Type::EFFECTIVE_JOINT_LIMITS_4_6 => {
                joint_limits(JointLimitsSource::Effective, JointTriple::Last)
            }
            Type::CONFIGURED_JOINT_LIMITS_1_3 => {
                joint_limits(JointLimitsSource::Configured, JointTriple::First)
            }
            Type::CONFIGURED_JOINT_LIMITS_4_6 => {
                joint_limits(JointLimitsSource::Configured, JointTriple::Last)
            }
            Type::WORK_ZONE_CFG => Self::WorkZoneCfg {
                severity: Severity::from_real(v1)?,
                mode: WorkZoneMode::from_real(v2)?,
            },
            Type::WORK_ZONE_LIMITS => Self::WorkZoneLimits(WorkZoneLimits {
                x_min: v1,
                y_min: v2,
                z_min: v3,
                x_max: v4,
                y_max: v5,
                z_max: v6,
            }),
            Type::TOOL_SPHERE => Self::ToolSphere(ToolSphere { x: v1, y: v2, z: v3, r: v4 }),
            Type::DESIRED_CONF => Self::DesiredConf {
                c_s: automatic_or(v1, ConfSign::from_real)?,
                c_e: automatic_or(v2, ConfSign::from_real)?,
                c_w: automatic_or(v3, ConfSign::from_real)?,
                c_t: automatic_or(v4, integer)?,
            },
            Type::MOTION_QUEUE_PARAMETERS => {
                Self::MotionQueueParameters { blending_percent: v1, velocity_timeout_s: v2 }
            }
            Type::MOTION_QUEUE_VELOCITIES => Self::MotionQueueVelocities {
                joint_vel_percent: v1,
                joint_acc_percent: v2,
                cart_lin_vel_mm_per_s: v3,
                cart_ang_vel_deg_per_s: v4,
                cart_acc_percent: v5,
                joint_vel_limit_percent: v6,
            },
            Type::GRIPPER_PARAMETERS => Self::GripperParameters {
                force_percent: v1,
                vel_percent: v2,
                d_closed_mm: v3,
                d_open_mm: v4,
            },
            Type::TORQUE_LIMITS_CFG => Self::TorqueLimitsCfg {
                severity: TorqueSeverity::from_real(v1)?,
                detection: TorqueDetection::from_real(v2)?,
            },
            Type::TORQUE_LIMITS => Self::TorqueLimits(values),
            Type::MOVE_MODE_CFG => Self::MoveModeCfg {
                mode: MoveMode::from_real(v1)?,
                severity: Severity::from_real(v2)?,
                duration_s: v3,
            },
            Type::CALIBRATION => Self::Calibration { enabled: flag(v1)?, calibrated: flag(v2)? },
            Type::PAYLOAD => Self::Payload(Payload { m: v1, c_x: v2, c_y: v3, c_z: v4 }),
            Type::TARGET_JOINT_VELOCITY => Self::TargetJointVelocity(values),
            Type::TARGET_JOINT_TORQUE => Self::TargetJointTorque(values),
            Type::TARGET_CARTESIAN_VELOCITY => Self::TargetCartesianVelocity(values),
            Type::COLLISION_CFG => Self::CollisionCfg(Severity::from_real(v1)?),
            Type::COLLISION_STATUS => Self::CollisionStatus {
                collision: flag(v1)?,
                first: object(v2, v3)?,
                second: object(v4, v5)?,
            },
            Type::WORK_ZONE_STATUS => {
                Self::WorkZoneStatus { breach: flag(v1)?, object: object(v2, v3)? }
            }
            Type::ACTUAL_JOINT_POSITION => Self::ActualJointPosition(values),
            Type::ACTUAL_POSE => Self::ActualPose(values.into()),
            Type::ACTUAL_JOINT_VELOCITY => Self::ActualJointVelocity(values),
            Type::ACTUAL_JOINT_TORQUE => Self::ActualJointTorque(values),
            Type::ACTUAL_CARTESIAN_VELOCITY => Self::ActualCartesianVelocity(values),
            Type::ACTUAL_CONF => Self::ActualConf {
                c_s: ActualConfSign::from_real(v1)?,
                c_e: ActualConfSign::from_real(v2)?,
                c_w: ActualConfSign::from_real(v3)?,
                c_t: integer(v4)?,
            },
            Type::ACCELEROMETER => Self::Accelerometer([v1, v2, v3]),
            Type::EXTERNAL_TOOL_STATUS => Self::ExternalToolStatus {
                tool: ExternalTool::from_real(v1)?,
                homed: flag(v2)?,
                error: flag(v3)?,
                overheated: flag(v4)?,
            },
            Type::EOAT_STATUS => Self::EoatStatus(match eoat {
                Eoat::None => return None,
                Eoat::Gripper => EoatStatus::Gripper {
                    holding_part: flag(v1)?,
                    desired_opening_reached: flag(v2)?,
                    closed: flag(v3)?,
                    open: flag(v4)?,
                    force_percent: v5,
                    opening_mm: v6,
                },
                Eoat::Valves => EoatStatus::Valves([flag(v1)?, flag(v2)?]),
            }),
            Type::TIME_SCALING => Self::TimeScaling(v1),
            ty if ty.is_variable() => {
                Self::Variable { cyclic_id: u16::try_from(ty.0).ok()?, values }
            }
            _ => return None,
        })
    }

    /// The slot that carries these values: what a robot puts on the wire. Values a type does not
    /// use are 0.
    #[must_use]
    pub fn encode(&self) -> DynamicValue {
        if let Self::SerialNumber(serial) = *self {
            let values = [serial as f32, f32::from_bits(serial), 0.0, 0.0, 0.0, 0.0];
            let raw_bits = [(serial as f32).to_bits(), serial, 0, 0, 0, 0];
            return DynamicValue::new(Type::SERIAL_NUMBER, values, raw_bits);
        }
        let (ty, values) = self.encode_reals();
        DynamicValue::from_values(ty, values)
    }

    fn encode_reals(&self) -> (Type, [f32; 6]) {
        let one = |v1| [v1, 0.0, 0.0, 0.0, 0.0, 0.0];
        let two = |v1, v2| [v1, v2, 0.0, 0.0, 0.0, 0.0];
        let three = |v1, v2, v3| [v1, v2, v3, 0.0, 0.0, 0.0];
        let four = |v1, v2, v3, v4| [v1, v2, v3, v4, 0.0, 0.0];
        match *self {
            Self::FirmwareVersion { major, minor, patch, build } => (
                Type::FIRMWARE_VERSION,
                four(major as f32, minor as f32, patch as f32, build as f32),
            ),
            Self::ProductType(product) => (Type::PRODUCT_TYPE, one(product.to_real())),
            Self::SerialNumber(serial) => {
                (Type::SERIAL_NUMBER, two(serial as f32, f32::from_bits(serial)))
            }
            Self::JointLimitsCfg(enabled) => (Type::JOINT_LIMITS_CFG, one(real(enabled))),
            Self::JointLimits { source, joints, min: [a, b, c], max: [d, e, f] } => {
                (Type::joint_limits(source, joints), [a, b, c, d, e, f])
            }
            Self::WorkZoneCfg { severity, mode } => {
                (Type::WORK_ZONE_CFG, two(severity.to_real(), mode.to_real()))
            }
            Self::WorkZoneLimits(WorkZoneLimits { x_min, y_min, z_min, x_max, y_max, z_max }) => {
                (Type::WORK_ZONE_LIMITS, [x_min, y_min, z_min, x_max, y_max, z_max])
            }
            Self::ToolSphere(ToolSphere { x, y, z, r }) => (Type::TOOL_SPHERE, four(x, y, z, r)),
            Self::DesiredConf { c_s, c_e, c_w, c_t } => (
                Type::DESIRED_CONF,
                four(sign(c_s), sign(c_e), sign(c_w), c_t.map_or(f32::NAN, f32::from)),
            ),
            Self::MotionQueueParameters { blending_percent, velocity_timeout_s } => {
                (Type::MOTION_QUEUE_PARAMETERS, two(blending_percent, velocity_timeout_s))
            }
            Self::MotionQueueVelocities {
                joint_vel_percent,
                joint_acc_percent,
                cart_lin_vel_mm_per_s,
                cart_ang_vel_deg_per_s,
                cart_acc_percent,
                joint_vel_limit_percent,
            } => (
                Type::MOTION_QUEUE_VELOCITIES,
                [
                    joint_vel_percent,
                    joint_acc_percent,
                    cart_lin_vel_mm_per_s,
                    cart_ang_vel_deg_per_s,
                    cart_acc_percent,
                    joint_vel_limit_percent,
                ],
            ),
            Self::GripperParameters { force_percent, vel_percent, d_closed_mm, d_open_mm } => {
                (Type::GRIPPER_PARAMETERS, four(force_percent, vel_percent, d_closed_mm, d_open_mm))
            }
            Self::TorqueLimitsCfg { severity, detection } => {
                (Type::TORQUE_LIMITS_CFG, two(severity.to_real(), detection.to_real()))
            }
            Self::TorqueLimits(values) => (Type::TORQUE_LIMITS, values),
            Self::MoveModeCfg { mode, severity, duration_s } => {
                (Type::MOVE_MODE_CFG, three(mode.to_real(), severity.to_real(), duration_s))
            }
            Self::Calibration { enabled, calibrated } => {
                (Type::CALIBRATION, two(real(enabled), real(calibrated)))
            }
            Self::Payload(Payload { m, c_x, c_y, c_z }) => (Type::PAYLOAD, four(m, c_x, c_y, c_z)),
            Self::TargetJointVelocity(values) => (Type::TARGET_JOINT_VELOCITY, values),
            Self::TargetJointTorque(values) => (Type::TARGET_JOINT_TORQUE, values),
            Self::TargetCartesianVelocity(values) => (Type::TARGET_CARTESIAN_VELOCITY, values),
            Self::CollisionCfg(severity) => (Type::COLLISION_CFG, one(severity.to_real())),
            Self::CollisionStatus { collision, first, second } => (
                Type::COLLISION_STATUS,
                [
                    real(collision),
                    first.group.to_real(),
                    f32::from(first.id),
                    second.group.to_real(),
                    f32::from(second.id),
                    0.0,
                ],
            ),
            Self::WorkZoneStatus { breach, object } => (
                Type::WORK_ZONE_STATUS,
                three(real(breach), object.group.to_real(), f32::from(object.id)),
            ),
            Self::ActualJointPosition(values) => (Type::ACTUAL_JOINT_POSITION, values),
            Self::ActualPose(pose) => (Type::ACTUAL_POSE, pose.into()),
            Self::ActualJointVelocity(values) => (Type::ACTUAL_JOINT_VELOCITY, values),
            Self::ActualJointTorque(values) => (Type::ACTUAL_JOINT_TORQUE, values),
            Self::ActualCartesianVelocity(values) => (Type::ACTUAL_CARTESIAN_VELOCITY, values),
            Self::ActualConf { c_s, c_e, c_w, c_t } => (
                Type::ACTUAL_CONF,
                four(c_s.to_real(), c_e.to_real(), c_w.to_real(), f32::from(c_t)),
            ),
            Self::Accelerometer([x, y, z]) => (Type::ACCELEROMETER, three(x, y, z)),
            Self::ExternalToolStatus { tool, homed, error, overheated } => (
                Type::EXTERNAL_TOOL_STATUS,
                four(tool.to_real(), real(homed), real(error), real(overheated)),
            ),
            Self::EoatStatus(EoatStatus::Gripper {
                holding_part,
                desired_opening_reached,
                closed,
                open,
                force_percent,
                opening_mm,
            }) => (
                Type::EOAT_STATUS,
                [
                    real(holding_part),
                    real(desired_opening_reached),
                    real(closed),
                    real(open),
                    force_percent,
                    opening_mm,
                ],
            ),
            Self::EoatStatus(EoatStatus::Valves([v1, v2])) => {
                (Type::EOAT_STATUS, two(real(v1), real(v2)))
            }
            Self::TimeScaling(p) => (Type::TIME_SCALING, one(p)),
            Self::Variable { cyclic_id, values } => (Type(u32::from(cyclic_id)), values),
            Self::Unknown { ty, values } => (ty, values),
        }
    }
}
