//! What a virtual robot is and remembers: its identity, its habits, its persistent settings.
//!
//! Three lifetimes (PM L457, L3207):
//!
//! | kind | where | set back by |
//! |---|---|---|
//! | persistent | [`PersistentSettings`] | nobody; survives power-off |
//! | of a boot | [`BootSettings`] | every boot |
//! | of motion | [`MotionSettings`](super::motion_settings::MotionSettings) | every boot and every deactivation |

use alloc::string::String;

use super::kinematics::Joints;
use super::motion::JointLimits;
use super::readings::Readings;
use crate::time::Duration;
use crate::wire::meca500::command::{Severity, WorkZoneMode};
use crate::wire::meca500::image::FirmwareLayout;
use crate::wire::meca500::revision::Revision;
use crate::wire::order::ByteOrder;

/// How a virtual robot is built.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotSettings {
    /// Hardware revision.
    pub revision: Revision,
    /// Firmware version: major, minor, patch, build.
    pub firmware: [u16; 4],
    /// Serial number.
    pub serial_number: u32,
    /// Byte order of the images.
    pub byte_order: ByteOrder,
    /// Layout of the images.
    pub layout: FirmwareLayout,
    /// The bus that carries the images.
    pub bus: CyclicBus,
    /// Whether this cyclic connection may only watch.
    pub monitoring_only: bool,
    /// Tool on the flange.
    pub tool: FittedTool,
    /// Joints at power-up, in degrees; kept inside the model's limits.
    pub joints: Joints,
    /// Whether the robot was homed before (its encoders remember).
    pub homed: bool,
    /// How the open questions of the manual are answered.
    pub readings: Readings,
    /// Durations the manual does not give.
    pub times: LifecycleTimes,
    /// What recovery mode leaves of velocities and accelerations; a cap that is not a positive number
    /// becomes the default.
    pub recovery_caps: RecoveryCaps,
    /// Error of the reported actual joints before homing, in degrees; kept within 180,
    /// and 0 for what is not finite. Source: PM L346.
    pub position_error_before_homing_deg: f64,
    /// The settings that survive power-off.
    pub persistent: PersistentSettings,
    /// The settings of name and network, which survive power-off too.
    pub network: NetworkSettings,
}

impl Default for RobotSettings {
    /// An R4 that was never homed, on no bus in particular, without a tool, at zero joints, big-endian.
    fn default() -> Self {
        Self {
            revision: Revision::R4,
            firmware: [11, 3, 84, 0],
            serial_number: 87_654_321,
            byte_order: ByteOrder::BIG,
            layout: FirmwareLayout::V11_3,
            bus: CyclicBus::Direct,
            monitoring_only: false,
            tool: FittedTool::None,
            joints: [0.0; 6],
            homed: false,
            readings: Readings::default(),
            times: LifecycleTimes::default(),
            recovery_caps: RecoveryCaps::default(),
            position_error_before_homing_deg: 0.5,
            persistent: PersistentSettings::default(),
            network: NetworkSettings::default(),
        }
    }
}

impl RobotSettings {
    /// The settings a robot can live with, whatever was asked for.
    pub(super) fn made_livable(mut self) -> Self {
        let JointLimits { min, max } = JointLimits::MODEL;
        for (joint, (min, max)) in self.joints.iter_mut().zip(min.into_iter().zip(max)) {
            *joint = if joint.is_finite() { joint.clamp(min, max) } else { 0.0 };
        }
        let error = self.position_error_before_homing_deg;
        self.position_error_before_homing_deg =
            if error.is_finite() { error.clamp(-180.0, 180.0) } else { 0.0 };
        self.recovery_caps = self.recovery_caps.made_livable();
        self
    }
}

/// The bus that carries the cyclic images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum CyclicBus {
    /// None: the images are handed over in memory, everything they hold means something.
    #[default]
    Direct,
    /// EtherCAT: DisableEtherCAT acts, UseVariables does not (PM L1113, L6834).
    EtherCat,
    /// EtherNet/IP.
    EtherNetIp,
    /// PROFINET.
    Profinet,
}

/// Tool on the flange.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum FittedTool {
    /// None.
    #[default]
    None,
    /// MEGP 25E electric gripper: opens 6 mm.
    Megp25E,
    /// MEGP 25LS electric gripper: opens 48 mm.
    Megp25Ls,
    /// MPM500 pneumatic module: two valves.
    Mpm500,
}

impl FittedTool {
    /// The number the robot reports. Source: PM L6219.
    #[must_use]
    pub const fn number(self) -> u32 {
        match self {
            Self::None => 0,
            Self::Megp25E => 10,
            Self::Megp25Ls => 11,
            Self::Mpm500 => 20,
        }
    }

    /// Widest opening of the fingers, in mm; `None` unless it is a gripper. Source: PM L6455.
    #[must_use]
    pub const fn opening_mm(self) -> Option<f64> {
        match self {
            Self::Megp25E => Some(6.0),
            Self::Megp25Ls => Some(48.0),
            Self::None | Self::Mpm500 => None,
        }
    }
}

/// Whether the robot answers on EtherNet/IP or PROFINET. Source: PM L3246, L3273.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum FieldbusMode {
    /// 0: it does not.
    #[default]
    Disabled,
    /// 1: it does.
    Enabled,
    /// 2: it does, for connections that only watch.
    MonitoringOnly,
}

impl FieldbusMode {
    /// The number in EnableEtherNetIp and EnableProfinet.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The mode with this number; `None` above 2.
    #[must_use]
    pub const fn from_number(number: u8) -> Option<Self> {
        match number {
            0 => Some(Self::Disabled),
            1 => Some(Self::Enabled),
            2 => Some(Self::MonitoringOnly),
            _ => None,
        }
    }
}

/// Name and network: settings that survive power-off, set over TCP only.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NetworkSettings {
    /// SetRobotName: at most 63 letters, digits and hyphens, no hyphen first.
    pub robot_name: String,
    /// SetNetworkOptions: keep-alive packets that may be lost before a connection counts as
    /// dropped, 0 to 60. In force from the next boot on.
    pub keep_alive_packets: u8,
    /// EnableEtherNetIp.
    pub ethernet_ip: FieldbusMode,
    /// EnableProfinet.
    pub profinet: FieldbusMode,
}

impl Default for NetworkSettings {
    fn default() -> Self {
        Self {
            robot_name: String::from("m500"),
            keep_alive_packets: 3,
            ethernet_ip: FieldbusMode::Disabled,
            profinet: FieldbusMode::Disabled,
        }
    }
}

/// How long the robot takes for what the manual gives no time for. Chosen, except for homing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LifecycleTimes {
    /// Activation.
    pub activation: Duration,
    /// Deactivation.
    pub deactivation: Duration,
    /// Homing: three seconds (PM L334).
    pub homing: Duration,
    /// Boot.
    pub boot: Duration,
}

impl Default for LifecycleTimes {
    fn default() -> Self {
        Self {
            activation: Duration::from_millis(200),
            deactivation: Duration::from_millis(100),
            homing: Duration::from_secs(3),
            boot: Duration::from_secs(5),
        }
    }
}

/// What recovery mode leaves: "significantly reduced" (PM L3856). Chosen: the manual gives none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecoveryCaps {
    /// Highest joint velocity, in percent of the rated ones.
    pub joint_velocity_percent: f64,
    /// Highest joint acceleration, in percent.
    pub joint_acceleration_percent: f64,
    /// Highest linear velocity of the tool, in mm/s.
    pub linear_velocity_mm_per_s: f64,
    /// Highest angular velocity of the tool, in deg/s.
    pub angular_velocity_deg_per_s: f64,
    /// Highest acceleration of the tool, in percent.
    pub cart_acceleration_percent: f64,
    /// Highest grip force and finger velocity before homing, in percent.
    pub gripper_percent: f64,
}

impl RecoveryCaps {
    /// A cap of zero or below would keep the arm from every move; one that is no number says nothing.
    fn made_livable(self) -> Self {
        let default = Self::default();
        let positive = |cap: f64, default: f64| {
            if cap > 0.0 && cap.is_finite() { cap } else { default }
        };
        Self {
            joint_velocity_percent: positive(
                self.joint_velocity_percent,
                default.joint_velocity_percent,
            ),
            joint_acceleration_percent: positive(
                self.joint_acceleration_percent,
                default.joint_acceleration_percent,
            ),
            linear_velocity_mm_per_s: positive(
                self.linear_velocity_mm_per_s,
                default.linear_velocity_mm_per_s,
            ),
            angular_velocity_deg_per_s: positive(
                self.angular_velocity_deg_per_s,
                default.angular_velocity_deg_per_s,
            ),
            cart_acceleration_percent: positive(
                self.cart_acceleration_percent,
                default.cart_acceleration_percent,
            ),
            gripper_percent: positive(self.gripper_percent, default.gripper_percent),
        }
    }
}

impl Default for RecoveryCaps {
    fn default() -> Self {
        Self {
            joint_velocity_percent: 10.0,
            joint_acceleration_percent: 20.0,
            linear_velocity_mm_per_s: 25.0,
            angular_velocity_deg_per_s: 10.0,
            cart_acceleration_percent: 10.0,
            gripper_percent: 20.0,
        }
    }
}

/// Settings that survive power-off, with the factory's values as default. Source: PM L457, rule 41.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PersistentSettings {
    /// SetJointLimits: the user's limits, in degrees; in force only with `joint_limits_enabled`.
    pub user_joint_limits: JointLimits,
    /// SetJointLimitsCfg.
    pub joint_limits_enabled: bool,
    /// SetCalibrationCfg.
    pub calibration_enabled: bool,
    /// SetPStop2Cfg.
    pub p_stop2: PStop2Mode,
    /// SetSimModeCfg.
    pub simulation: SimulationType,
    /// SetCollisionCfg.
    pub collision_severity: Severity,
    /// SetToolSphere: x, y, z in the FRF and radius, in mm; all zero is none.
    pub tool_sphere: [f64; 4],
    /// SetWorkZoneCfg, severity.
    pub work_zone_severity: Severity,
    /// SetWorkZoneCfg, mode.
    pub work_zone_mode: WorkZoneMode,
    /// SetWorkZoneLimits: lowest corner, in mm.
    pub work_zone_min: [f64; 3],
    /// SetWorkZoneLimits: highest corner, in mm.
    pub work_zone_max: [f64; 3],
    /// SetOfflineProgramLoop, as saved with program 1: whether the Start/Stop button repeats it.
    pub offline_program_loop: bool,
    /// Whether EtherCAT is the robot's protocol, on a robot whose bus is EtherCAT.
    pub ethercat_enabled: bool,
}

impl PersistentSettings {
    /// Lowest corner of the factory's work zone, in mm.
    pub const FACTORY_WORK_ZONE_MIN: [f64; 3] = [-10_000.0; 3];
    /// Highest corner of the factory's work zone, in mm.
    pub const FACTORY_WORK_ZONE_MAX: [f64; 3] = [10_000.0; 3];

    /// The joint limits in force: the user's, never wider than the model's, which also stand in for
    /// a limit that is no number.
    #[must_use]
    pub const fn effective_joint_limits(&self) -> JointLimits {
        let mut limits = JointLimits::MODEL;
        if self.joint_limits_enabled {
            let mut index = 0;
            while index < limits.min.len() {
                limits.min[index] = self.user_joint_limits.min[index].max(limits.min[index]);
                limits.max[index] = self.user_joint_limits.max[index].min(limits.max[index]);
                index += 1;
            }
        }
        limits
    }
}

impl Default for PersistentSettings {
    fn default() -> Self {
        Self {
            user_joint_limits: JointLimits::MODEL,
            joint_limits_enabled: false,
            calibration_enabled: true,
            p_stop2: PStop2Mode::Clear,
            simulation: SimulationType::Normal,
            collision_severity: Severity::Error,
            tool_sphere: [0.0; 4],
            work_zone_severity: Severity::Error,
            work_zone_mode: WorkZoneMode::FlangeCenterPoint,
            work_zone_min: Self::FACTORY_WORK_ZONE_MIN,
            work_zone_max: Self::FACTORY_WORK_ZONE_MAX,
            offline_program_loop: false,
            ethercat_enabled: true,
        }
    }
}

/// What P-Stop 2 does with the queue: SetPStop2Cfg. Source: PM L3758.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum PStop2Mode {
    /// 2: keeps it, and takes more commands meanwhile.
    Pause,
    /// 3: empties it, and refuses commands until the stop is reset.
    #[default]
    Clear,
}

/// How a simulating robot passes its time: SetSimModeCfg. Source: PM L3119.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SimulationType {
    /// 1: in real time.
    #[default]
    Normal,
    /// 2: as quickly as possible.
    Fast,
}

/// Settings that every boot sets back. Source: PM L457, rule 40.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BootSettings {
    /// SetTimeScaling, in percent.
    pub(super) time_scaling_percent: f32,
    /// SetRecoveryMode.
    pub(super) recovery_mode: bool,
}

impl Default for BootSettings {
    fn default() -> Self {
        Self { time_scaling_percent: 100.0, recovery_mode: false }
    }
}
