//! The six values of each dynamic type. Source: PM Table 12.
//!
//! Choices where the table is open: type 22 gives mm/s and deg/s for values 3 and 4, as the
//! commands do; type 52's tool follows a reading; types of other robots give zeros.

use glam::DVec3;

use super::dynamic::variable_id;
use super::kinematics::{Configuration, Jacobian, Joints, Posture, joint_centres, turn_of};
use super::motion::{JointLimits, JointState};
use super::readings::{DynamicBeforeHoming, ExternalToolType};
use super::robot::VirtualRobot;
use super::settings::FittedTool;
use super::torque;
use super::zones::Object;
use crate::wire::meca500::dynamic::{DynamicType as Type, DynamicTypeSpec};

/// Accelerometer steps for each standard gravity. Source: PM L1352.
const STEPS_PER_GRAVITY: f64 = 16_000.0;

/// Whether this robot reports the type in its rotation.
pub(super) fn is_reported(spec: &DynamicTypeSpec) -> bool {
    spec.available == Some(true) && spec.in_rotation == Some(true) && spec.id != Type::AUTOMATIC
}

fn narrow(values: Joints) -> [f32; 6] {
    values.map(|value| value as f32)
}

fn few<const N: usize>(values: [f32; N]) -> [f32; 6] {
    let mut six = [0.0; 6];
    for (slot, value) in six.iter_mut().zip(values) {
        *slot = value;
    }
    six
}

const fn flag(on: bool) -> f32 {
    if on { 1.0 } else { 0.0 }
}

/// Lowest then highest positions of three joints, the first of which is `first` (from 0).
fn three(limits: &JointLimits, first: usize) -> [f32; 6] {
    let mut values = [0.0; 6];
    for (index, (min, max)) in limits.min.iter().zip(limits.max).skip(first).take(3).enumerate() {
        values[index] = *min as f32;
        values[index + 3] = max as f32;
    }
    values
}

impl VirtualRobot {
    /// The six values that a slot with this type carries now.
    pub(super) fn dynamic_values(&self, ty: Type) -> [f32; 6] {
        if is_real_time(ty)
            && !self.is_homed()
            && self.settings.readings.dynamic_before_homing == DynamicBeforeHoming::Zero
        {
            return [0.0; 6];
        }
        let settings = &self.motion_settings;
        let persistent = &self.settings.persistent;
        match ty {
            Type::FIRMWARE_VERSION => few(self.settings.firmware.map(f32::from)),
            Type::PRODUCT_TYPE => few([self.settings.revision.product_type() as f32]),
            Type::SERIAL_NUMBER => {
                // The second value is the integer itself, laid over the Real.
                let serial = self.settings.serial_number;
                few([serial as f32, f32::from_bits(serial)])
            }
            Type::JOINT_LIMITS_CFG => few([flag(persistent.joint_limits_enabled)]),
            Type::MODEL_JOINT_LIMITS_1_3 => three(&JointLimits::MODEL, 0),
            Type::MODEL_JOINT_LIMITS_4_6 => three(&JointLimits::MODEL, 3),
            Type::EFFECTIVE_JOINT_LIMITS_1_3 => three(&persistent.effective_joint_limits(), 0),
            Type::EFFECTIVE_JOINT_LIMITS_4_6 => three(&persistent.effective_joint_limits(), 3),
            Type::CONFIGURED_JOINT_LIMITS_1_3 => three(&persistent.user_joint_limits, 0),
            Type::CONFIGURED_JOINT_LIMITS_4_6 => three(&persistent.user_joint_limits, 3),
            Type::WORK_ZONE_CFG => {
                few([persistent.work_zone_severity.to_real(), persistent.work_zone_mode.to_real()])
            }
            Type::WORK_ZONE_LIMITS => {
                let ([a, b, c], [d, e, f]) = (persistent.work_zone_min, persistent.work_zone_max);
                narrow([a, b, c, d, e, f])
            }
            Type::TOOL_SPHERE => few(persistent.tool_sphere.map(|value| value as f32)),
            Type::DESIRED_CONF => self.desired_conf(),
            Type::MOTION_QUEUE_PARAMETERS => few([settings.blending, settings.vel_timeout]),
            Type::MOTION_QUEUE_VELOCITIES => [
                settings.joint_vel,
                settings.joint_acc,
                settings.cart_lin_vel,
                settings.cart_ang_vel,
                settings.cart_acc,
                settings.joint_vel_limit,
            ],
            Type::GRIPPER_PARAMETERS => {
                let range = settings.gripper_range.unwrap_or([0.0, self.tool.range_mm() as f32]);
                few([settings.gripper_force, settings.gripper_vel, range[0], range[1]])
            }
            Type::TORQUE_LIMITS_CFG => {
                few([settings.torque_severity.to_real(), settings.torque_detection.to_real()])
            }
            Type::TORQUE_LIMITS => settings.torque_limits,
            Type::MOVE_MODE_CFG => few([
                settings.move_mode.to_real(),
                settings.move_duration_severity.to_real(),
                settings.move_duration,
            ]),
            Type::CALIBRATION => few([flag(persistent.calibration_enabled), 0.0]),
            Type::PAYLOAD => {
                let payload = settings.payload;
                few([payload.m, payload.c_x, payload.c_y, payload.c_z])
            }
            Type::TARGET_JOINT_VELOCITY => narrow(self.target_state().velocity),
            Type::TARGET_JOINT_TORQUE => {
                narrow(torque::calculated(&self.target_state(), &settings.payload))
            }
            Type::TARGET_CARTESIAN_VELOCITY => self.cartesian_velocity(&self.target_state()),
            Type::COLLISION_CFG => few([persistent.collision_severity.to_real()]),
            Type::COLLISION_STATUS => self.collision_event.map_or([0.0; 6], |[one, other]| {
                let number = |object: Object| [object.group as f32, object.id as f32];
                let ([a, b], [c, d]) = (number(one), number(other));
                few([1.0, a, b, c, d])
            }),
            Type::WORK_ZONE_STATUS => self
                .zone_event
                .map_or([0.0; 6], |object| few([1.0, object.group as f32, object.id as f32])),
            Type::ACTUAL_JOINT_POSITION => narrow(self.actual_state().position),
            Type::ACTUAL_POSE => {
                let frames = &settings.frames;
                narrow(frames.tool_of_joints(&self.actual_state().position).to_xyz_euler())
            }
            Type::ACTUAL_JOINT_VELOCITY => narrow(self.actual_state().velocity),
            Type::ACTUAL_JOINT_TORQUE => {
                let state = self.target_state();
                narrow(torque::actual(&state, &settings.payload, &self.disturbance))
            }
            Type::ACTUAL_CARTESIAN_VELOCITY => self.cartesian_velocity(&self.actual_state()),
            Type::ACTUAL_CONF => {
                let joints = self.actual_state().position;
                let Configuration { shoulder, elbow, wrist } = Configuration::of(&joints);
                let [s, e, w] = [shoulder, elbow, wrist].map(f32::from);
                few([s, e, w, turn_of(joints[5]) as f32])
            }
            Type::ACCELEROMETER => self.accelerometer(),
            Type::EXTERNAL_TOOL_STATUS => {
                let tool = match self.settings.readings.external_tool_type {
                    ExternalToolType::Emulated => self.tool.kind(),
                    ExternalToolType::Fitted => self.tool.fitted(),
                };
                let failed = self.tool.overheated;
                few([
                    tool.number() as f32,
                    flag(self.tool.is_homed()),
                    flag(failed),
                    flag(self.tool.overheated),
                ])
            }
            Type::EOAT_STATUS => self.eoat_status(),
            Type::TIME_SCALING => few([self.boot.time_scaling_percent]),
            _ => {
                let mut values = [0.0; 6];
                let variable = self.variables.get(variable_id(ty)).unwrap_or_default();
                for (slot, value) in values.iter_mut().zip(variable) {
                    *slot = *value;
                }
                values
            }
        }
    }

    fn desired_conf(&self) -> [f32; 6] {
        let nan = f32::NAN;
        let numbers = |posture: Posture| posture.numbers().map(f32::from);
        let [s, e, w] = self.motion_settings.conf.map_or([nan; 3], numbers);
        let turn = self.motion_settings.conf_turn.map_or(nan, |turn| turn as f32);
        few([s, e, w, turn])
    }

    fn eoat_status(&self) -> [f32; 6] {
        match self.tool.kind() {
            FittedTool::None => [0.0; 6],
            FittedTool::Mpm500 => few(self.tool.valves().map(flag)),
            FittedTool::Megp25E | FittedTool::Megp25Ls => {
                let state = self.gripper_state();
                [
                    flag(state.holding_part),
                    flag(state.target_reached),
                    flag(state.closed),
                    flag(state.open),
                    state.force_percent as f32,
                    state.opening_mm as f32,
                ]
            }
        }
    }

    /// What the gripper does.
    #[must_use]
    pub fn gripper_state(&self) -> super::tool::GripperState {
        self.tool.gripper_state(self.motion_settings.gripper_range)
    }

    /// Where the joints are: not quite where the robot wants them before homing, and where they
    /// are blocked.
    pub(super) fn actual_state(&self) -> JointState {
        let mut state = self.target_state();
        state.position = self.disturbance.actual(&state.position);
        if !self.arm_homed {
            for joint in &mut state.position {
                *joint += self.settings.position_error_before_homing_deg;
            }
        }
        state
    }

    /// Velocity of the tool in the world frame.
    fn cartesian_velocity(&self, state: &JointState) -> [f32; 6] {
        if state.velocity == [0.0; 6] {
            return [0.0; 6];
        }
        let frames = &self.motion_settings.frames;
        let flange = joint_centres(&state.position).flange;
        let point = (flange * frames.trf).position;
        let [x, y, z, a, b, c] = Jacobian::at(&state.position, point).twist(&state.velocity);
        let to_world = frames.wrf.orientation.inverse();
        let linear = to_world * DVec3::new(x, y, z);
        let angular = to_world * DVec3::new(a, b, c);
        narrow([linear.x, linear.y, linear.z, angular.x, angular.y, angular.z])
    }

    /// Gravity as link 5 feels it; accelerations of the arm are left out. The axes of the sensor
    /// are not in the manual: those of the flange before joint 6 turns it.
    fn accelerometer(&self) -> [f32; 6] {
        let mut joints = self.actual_state().position;
        joints[5] = 0.0;
        let up = joint_centres(&joints).flange.orientation.inverse() * DVec3::Z;
        let steps = up * STEPS_PER_GRAVITY;
        few([steps.x as f32, steps.y as f32, steps.z as f32])
    }
}

/// Whether the type reports what the arm does rather than a setting.
fn is_real_time(ty: Type) -> bool {
    matches!(
        ty,
        Type::TARGET_JOINT_VELOCITY
            | Type::TARGET_JOINT_TORQUE
            | Type::TARGET_CARTESIAN_VELOCITY
            | Type::ACTUAL_JOINT_POSITION
            | Type::ACTUAL_POSE
            | Type::ACTUAL_JOINT_VELOCITY
            | Type::ACTUAL_JOINT_TORQUE
            | Type::ACTUAL_CARTESIAN_VELOCITY
            | Type::ACTUAL_CONF
            | Type::ACCELEROMETER
    )
}
