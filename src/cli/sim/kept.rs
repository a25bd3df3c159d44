//! What a robot keeps while its power is off, as a file holds it: JSON, with the names and numbers of
//! the commands that set it.
//!
//! What is missing in a file is as it comes from the factory; what is not understood is an error with
//! its place, so that nobody's file is overwritten by mistake. Source: PM L457, L3207.

use std::collections::BTreeMap;
use std::prelude::v1::*;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::sim::meca500::motion::JointLimits;
use crate::sim::meca500::{
    FieldbusMode, NetworkSettings, PStop2Mode, PersistentSettings, RobotSettings, SavedVariable,
    SimulationType, VirtualRobot,
};
use crate::wire::meca500::command::{Severity, WorkZoneMode};

/// The form of the file.
const FORM: u32 = 1;
/// Least range that user limits leave a joint, in degrees. Source: PM L3618.
const LEAST_RANGE_DEG: f64 = 25.0;

/// What a robot keeps.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Kept {
    /// Which form the file has; first of all, so that a foreign file is told apart.
    fieldarm_robot_state: u32,
    /// Whose it is.
    pub(super) serial_number: u32,
    /// Where the arm stands: nothing moves it while the power is off.
    #[serde(default)]
    joints_deg: [f64; 6],
    #[serde(default)]
    settings: Settings,
    #[serde(default)]
    variables: BTreeMap<String, Variable>,
    #[serde(default)]
    programs: BTreeMap<u16, Vec<String>>,
}

#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
struct Variable {
    value: Value,
    #[serde(default)]
    cyclic_id: u16,
}

/// Settings under the names of their commands, with the commands' arguments.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields, default)]
struct Settings {
    #[serde(rename = "SetRobotName")]
    robot_name: String,
    #[serde(rename = "SetNetworkOptions")]
    keep_alive_packets: u8,
    #[serde(rename = "EnableEtherNetIp")]
    ethernet_ip: u8,
    #[serde(rename = "EnableProfinet")]
    profinet: u8,
    #[serde(rename = "SwitchToEtherCAT")]
    ethercat: bool,
    /// Lowest and highest position of each joint.
    #[serde(rename = "SetJointLimits")]
    joint_limits: [[f32; 2]; 6],
    #[serde(rename = "SetJointLimitsCfg")]
    joint_limits_enabled: u8,
    #[serde(rename = "SetCalibrationCfg")]
    calibration_enabled: u8,
    #[serde(rename = "SetPStop2Cfg")]
    p_stop2: u8,
    #[serde(rename = "SetSimModeCfg")]
    simulation: u8,
    #[serde(rename = "SetCollisionCfg")]
    collision_severity: i16,
    #[serde(rename = "SetToolSphere")]
    tool_sphere: [f32; 4],
    #[serde(rename = "SetWorkZoneCfg")]
    work_zone: [i16; 2],
    #[serde(rename = "SetWorkZoneLimits")]
    work_zone_limits: [f32; 6],
    #[serde(rename = "SetOfflineProgramLoop")]
    offline_program_loop: u8,
}

impl Default for Settings {
    fn default() -> Self {
        Self::of(&PersistentSettings::default(), &NetworkSettings::default(), false)
    }
}

impl Settings {
    fn of(persistent: &PersistentSettings, network: &NetworkSettings, ethercat: bool) -> Self {
        let JointLimits { min, max } = persistent.user_joint_limits;
        let mut joint_limits = [[0.0; 2]; 6];
        for (pair, (min, max)) in joint_limits.iter_mut().zip(min.into_iter().zip(max)) {
            *pair = [min as f32, max as f32];
        }
        let ([a, b, c], [d, e, f]) = (persistent.work_zone_min, persistent.work_zone_max);
        Self {
            robot_name: network.robot_name.clone(),
            keep_alive_packets: network.keep_alive_packets,
            ethernet_ip: network.ethernet_ip.number(),
            profinet: network.profinet.number(),
            ethercat,
            joint_limits,
            joint_limits_enabled: persistent.joint_limits_enabled.into(),
            calibration_enabled: persistent.calibration_enabled.into(),
            p_stop2: match persistent.p_stop2 {
                PStop2Mode::Pause => 2,
                PStop2Mode::Clear => 3,
            },
            simulation: match persistent.simulation {
                SimulationType::Normal => 1,
                SimulationType::Fast => 2,
            },
            collision_severity: persistent.collision_severity.code(),
            tool_sphere: persistent.tool_sphere.map(|value| value as f32),
            work_zone: [persistent.work_zone_severity.code(), persistent.work_zone_mode.code()],
            work_zone_limits: [a, b, c, d, e, f].map(|value| value as f32),
            offline_program_loop: persistent.offline_program_loop.into(),
        }
    }

    fn network(&self) -> Result<NetworkSettings, String> {
        let bus = |name: &str, number: u8| {
            FieldbusMode::from_number(number)
                .ok_or_else(|| format!("settings.{name} is 0, 1 or 2, not {number}"))
        };
        Ok(NetworkSettings {
            robot_name: self.robot_name.clone(),
            keep_alive_packets: self.keep_alive_packets,
            ethernet_ip: bus("EnableEtherNetIp", self.ethernet_ip)?,
            profinet: bus("EnableProfinet", self.profinet)?,
        })
    }

    fn persistent(&self) -> Result<PersistentSettings, String> {
        let switch = |name: &str, number: u8| match number {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(format!("settings.{name} is 0 or 1, not {number}")),
        };
        let severity = |name: &str, number: i16| {
            Severity::from_code(number)
                .ok_or_else(|| format!("settings.{name}: no severity has the number {number}"))
        };
        let [zone_severity, zone_mode] = self.work_zone;
        let [a, b, c, d, e, f] = self.work_zone_limits.map(f64::from);
        if !(a < d && b < e && c < f) {
            return Err("settings.SetWorkZoneLimits: each minimum is below its maximum".into());
        }
        Ok(PersistentSettings {
            user_joint_limits: self.user_joint_limits()?,
            joint_limits_enabled: switch("SetJointLimitsCfg", self.joint_limits_enabled)?,
            calibration_enabled: switch("SetCalibrationCfg", self.calibration_enabled)?,
            p_stop2: match self.p_stop2 {
                2 => PStop2Mode::Pause,
                3 => PStop2Mode::Clear,
                other => return Err(format!("settings.SetPStop2Cfg is 2 or 3, not {other}")),
            },
            simulation: match self.simulation {
                1 => SimulationType::Normal,
                2 => SimulationType::Fast,
                other => return Err(format!("settings.SetSimModeCfg is 1 or 2, not {other}")),
            },
            collision_severity: severity("SetCollisionCfg", self.collision_severity)?,
            tool_sphere: self.tool_sphere.map(f64::from),
            work_zone_severity: severity("SetWorkZoneCfg", zone_severity)?,
            work_zone_mode: WorkZoneMode::from_code(zone_mode).ok_or_else(|| {
                format!("settings.SetWorkZoneCfg: no mode has the number {zone_mode}")
            })?,
            work_zone_min: [a, b, c],
            work_zone_max: [d, e, f],
            offline_program_loop: switch("SetOfflineProgramLoop", self.offline_program_loop)?,
            ..PersistentSettings::default()
        })
    }

    fn user_joint_limits(&self) -> Result<JointLimits, String> {
        let mut limits = JointLimits::MODEL;
        for (index, [min, max]) in self.joint_limits.into_iter().enumerate() {
            let (min, max) = (f64::from(min), f64::from(max));
            let (lowest, highest) = (limits.min[index], limits.max[index]);
            if !(min >= lowest && max <= highest && max - min >= LEAST_RANGE_DEG) {
                return Err(format!(
                    "settings.SetJointLimits, joint {}: {min} to {max} deg; they lie within {lowest} to \
                     {highest} deg, at least {LEAST_RANGE_DEG} deg apart",
                    index + 1
                ));
            }
            (limits.min[index], limits.max[index]) = (min, max);
        }
        Ok(limits)
    }
}

impl Kept {
    /// What the robot would keep if its power went now.
    pub(super) fn of(robot: &VirtualRobot) -> Self {
        let RobotSettings { serial_number, persistent, network, .. } = robot.settings();
        let ethercat = robot.protocol_settings().ethercat;
        let variable = |saved: SavedVariable| {
            // It is what a JSON value wrote.
            let value = serde_json::from_str(&saved.value).unwrap_or(Value::Null);
            (saved.name, Variable { value, cyclic_id: saved.cyclic_id })
        };
        Self {
            fieldarm_robot_state: FORM,
            serial_number: *serial_number,
            joints_deg: robot.target_joints(),
            settings: Settings::of(persistent, network, ethercat),
            variables: robot.variables().into_iter().map(variable).collect(),
            programs: robot.programs().into_iter().collect(),
        }
    }

    /// Reads a file's text; `Err` says what is wrong, behind the place of it: `line:column: message` or
    /// ` message`.
    pub(super) fn read(text: &str) -> Result<Self, String> {
        let kept: Self = serde_json::from_str(text).map_err(|error| {
            let (line, column) = (error.line(), error.column());
            let said = error.to_string();
            let place = format!(" at line {line} column {column}");
            format!("{line}:{column}: {}", said.strip_suffix(&place).unwrap_or(&said))
        })?;
        if kept.fieldarm_robot_state != FORM {
            return Err(format!(
                " fieldarm_robot_state is {}, and this version knows {FORM} only",
                kept.fieldarm_robot_state
            ));
        }
        Ok(kept)
    }

    /// The file's text.
    pub(super) fn written(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self).map(|text| text + "\n")
    }

    /// Whether the robot was switched to EtherCAT.
    pub(super) const fn is_in_ethercat_mode(&self) -> bool {
        self.settings.ethercat
    }

    /// Puts the settings into those of a robot that is about to be made. EtherCAT mode is left as it
    /// is there.
    pub(super) fn furnish(&self, settings: &mut RobotSettings) -> Result<(), String> {
        let ethercat_enabled = settings.persistent.ethercat_enabled;
        settings.network = self.settings.network()?;
        settings.persistent =
            PersistentSettings { ethercat_enabled, ..self.settings.persistent()? };
        if let Err(excess) = JointLimits::MODEL.check(&self.joints_deg) {
            return Err(format!("joints_deg: {excess}"));
        }
        settings.joints = self.joints_deg;
        Ok(())
    }

    /// Puts variables and programs into a robot made of these settings.
    pub(super) fn fill(&self, robot: &mut VirtualRobot) -> Result<(), String> {
        let NetworkSettings { robot_name, keep_alive_packets, .. } = &robot.settings().network;
        if *robot_name != self.settings.robot_name {
            return Err(format!(
                "settings.SetRobotName: a robot cannot be called `{}`",
                self.settings.robot_name
            ));
        }
        if *keep_alive_packets != self.settings.keep_alive_packets {
            return Err(format!(
                "settings.SetNetworkOptions: {} is too much",
                self.settings.keep_alive_packets
            ));
        }
        for (name, variable) in &self.variables {
            let saved = SavedVariable {
                name: name.clone(),
                value: variable.value.to_string(),
                cyclic_id: variable.cyclic_id,
            };
            robot.restore_variable(&saved).map_err(|why| format!("variables.{name}: {why}"))?;
        }
        for (number, lines) in &self.programs {
            robot
                .restore_program(*number, lines.clone())
                .map_err(|why| format!("programs.{number}: {why}"))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::meca500::command::MotionCommand;

    /// A robot on which everything is otherwise than from the factory.
    fn used() -> VirtualRobot {
        let mut user_joint_limits = JointLimits::MODEL;
        user_joint_limits.min[2] = f64::from(-12.3_f32);
        user_joint_limits.max[5] = 360.0;
        let mut robot = VirtualRobot::new(RobotSettings {
            serial_number: 77,
            joints: [10.0, -20.25, 30.0, -40.0, 50.0, 360.5],
            persistent: PersistentSettings {
                user_joint_limits,
                joint_limits_enabled: true,
                calibration_enabled: false,
                p_stop2: PStop2Mode::Pause,
                simulation: SimulationType::Fast,
                collision_severity: Severity::Silent,
                tool_sphere: [1.5, -2.0, 0.1_f32.into(), 40.0],
                work_zone_severity: Severity::Warning,
                work_zone_mode: WorkZoneMode::from_code(2).expect("there are two at least"),
                work_zone_min: [-300.0, -301.0, 0.0],
                work_zone_max: [300.0, 301.0, 500.0],
                offline_program_loop: true,
                ethercat_enabled: true,
            },
            network: NetworkSettings {
                robot_name: "left-arm".into(),
                keep_alive_packets: 9,
                ethernet_ip: FieldbusMode::MonitoringOnly,
                profinet: FieldbusMode::Enabled,
            },
            ..RobotSettings::default()
        });
        robot.create_variable(10_001, &[0.1]).expect("it is free");
        robot.create_variable(19_999, &[1.0, -2.5, 3e20]).expect("it is free");
        for (name, value) in [("a.text", r#""with \"quotes\" and ünicode""#), ("yes", "[true,[1]]")]
        {
            let saved = SavedVariable { name: name.into(), value: value.into(), cyclic_id: 0 };
            robot.restore_variable(&saved).expect("such a value is one");
        }
        let commands = vec![MotionCommand::Delay(0.25), MotionCommand::SetJointVel(33.3)];
        robot.save_program(3, commands).expect("there is room");
        robot
    }

    #[test]
    fn nothing_is_lost_on_the_way_through_a_file() {
        let robot = used();
        let kept = Kept::of(&robot);
        let read = Kept::read(&kept.written().expect("it can be written")).expect("it can be read");
        assert_eq!(read, kept);
        let mut settings = RobotSettings { serial_number: 77, ..RobotSettings::default() };
        read.furnish(&mut settings).expect("it was a robot's");
        let mut again = VirtualRobot::new(settings);
        read.fill(&mut again).expect("it was a robot's");
        assert_eq!(again.settings(), robot.settings());
        assert_eq!(again.variables(), robot.variables());
        assert_eq!(again.programs(), robot.programs());
        assert_eq!(Kept::of(&again), kept);
    }

    #[test]
    fn what_a_file_does_not_say_is_as_from_the_factory() {
        let kept =
            Kept::read(r#"{"fieldarm_robot_state": 1, "serial_number": 5}"#).expect("enough");
        let mut settings = RobotSettings::default();
        kept.furnish(&mut settings).expect("nothing is said");
        assert_eq!(settings, RobotSettings::default());
    }

    fn complaint(text: &str) -> String {
        let filled = |kept: Kept| {
            let mut settings = RobotSettings::default();
            kept.furnish(&mut settings)?;
            kept.fill(&mut VirtualRobot::new(settings))
        };
        Kept::read(text).and_then(filled).expect_err(text)
    }

    #[test]
    fn mistakes_name_their_place() {
        for (text, said) in [
            ("", "1:0: EOF while parsing a value"),
            ("{\"fieldarm_robot_state\": 1,\n \"serial_number\": x}", "2:19: expected value"),
            ("{\"serial_number\": 1}", "1:20: missing field `fieldarm_robot_state`"),
            ("{\"name\": \"mine\"}", "1:7: unknown field `name`"),
        ] {
            assert!(complaint(text).starts_with(said), "{text}: {}", complaint(text));
        }
        for (content, said) in [
            (r#""settings": {"SetPStop2Cfg": 4}"#, "settings.SetPStop2Cfg is 2 or 3, not 4"),
            (r#""settings": {"SetSimModeCfg": 0}"#, "settings.SetSimModeCfg is 1 or 2, not 0"),
            (
                r#""settings": {"SetJointLimitsCfg": 2}"#,
                "settings.SetJointLimitsCfg is 0 or 1, not 2",
            ),
            (r#""settings": {"SetCollisionCfg": 7}"#, "settings.SetCollisionCfg: no severity"),
            (r#""settings": {"SetWorkZoneCfg": [4, 9]}"#, "settings.SetWorkZoneCfg: no mode"),
            (
                r#""settings": {"SetWorkZoneLimits": [0,0,0,0,0,0]}"#,
                "settings.SetWorkZoneLimits: each",
            ),
            (r#""settings": {"EnableProfinet": 3}"#, "settings.EnableProfinet is 0, 1 or 2, not 3"),
            (r#""settings": {"SetRobotName": "-"}"#, "settings.SetRobotName: a robot cannot be"),
            (r#""settings": {"SetNetworkOptions": 61}"#, "settings.SetNetworkOptions: 61 is too"),
            (
                r#""settings": {"SetJointLimits": [[-175,175],[-70,90],[-135,70],[-170,170],[0,20],[0,90]]}"#,
                "settings.SetJointLimits, joint 5: 0 to 20 deg;",
            ),
            (r#""joints_deg": [0, 0, 0, 0, 120, 0]"#, "joints_deg: "),
            (r#""variables": {"9x": {"value": 1}}"#, "variables.9x: '9x' cannot be"),
            (r#""variables": {"x": {"value": null}}"#, "variables.x: objects and null"),
            (r#""programs": {"501": []}"#, "programs.501: program number 501 is outside"),
        ] {
            let text = format!("{{\"fieldarm_robot_state\": 1, \"serial_number\": 1, {content}}}");
            assert!(complaint(&text).starts_with(said), "{text}: {}", complaint(&text));
        }
        let other = r#"{"fieldarm_robot_state": 2, "serial_number": 1}"#;
        assert!(complaint(other).contains("this version knows 1 only"));
    }
}
