//! Requests for settings. Source: PM L4192-5170.

use alloc::format;
use alloc::string::String;

use super::dispatch::Refused;
use super::format as text_format;
use crate::sim::meca500::kinematics::{MODEL_MAX, MODEL_MIN};
use crate::sim::meca500::readings::{PStop2CfgCode, WrfCode};
use crate::sim::meca500::robot::VirtualRobot;
use crate::sim::meca500::settings::{PStop2Mode, SimulationType};
use crate::wire::meca500::code::Code;
use crate::wire::meca500::text::ParsedCommand;

const fn flag(on: bool) -> &'static str {
    if on { "1" } else { "0" }
}

/// Whether the request is for what the robot only tells when it is ready for motion.
pub(super) fn needs_readiness(name: &str) -> bool {
    matches!(
        name,
        "GetAutoConf"
            | "GetAutoConfTurn"
            | "GetBlending"
            | "GetCartAcc"
            | "GetCartAngVel"
            | "GetCartLinVel"
            | "GetConf"
            | "GetConfTurn"
            | "GetJointAcc"
            | "GetJointVel"
            | "GetJointVelLimit"
            | "GetModelJointLimits"
            | "GetMoveDuration"
            | "GetMoveDurationCfg"
            | "GetMoveMode"
            | "GetPayload"
            | "GetTorqueLimits"
            | "GetTorqueLimitsCfg"
            | "GetTrf"
            | "GetVelTimeout"
            | "GetWrf"
    )
}

impl VirtualRobot {
    /// Answers a request for a setting.
    pub(super) fn request_data(&mut self, parsed: &ParsedCommand<'_>) -> Result<(), Refused> {
        let answer = if needs_readiness(parsed.spec.name) {
            self.ready_for_motion()?;
            self.motion_data(parsed)
        } else {
            self.identity_data(parsed)
        };
        let (code, content) = answer.ok_or(Code::UNKNOWN_COMMAND)?;
        self.answer(Code(code), &content);
        Ok(())
    }

    /// What may be asked for in any state.
    fn identity_data(&mut self, parsed: &ParsedCommand<'_>) -> Option<(u16, String)> {
        let persistent = &self.settings.persistent;
        let network = &self.settings.network;
        let [number, ..] = parsed.numbers();
        Some(match parsed.spec.name {
            "GetCalibrationCfg" => (2171, flag(persistent.calibration_enabled).into()),
            "GetCheckpoint" => (2157, format!("{}", self.checkpoint_reached)),
            "GetCheckpointDiscarded" => (2149, format!("{}", self.checkpoint_discarded)),
            "GetEthernetIpEnabled" => (2073, format!("{}", network.ethernet_ip.number())),
            "GetProfinetEnabled" => (2077, format!("{}", network.profinet.number())),
            "GetFwVersion" => (2081, format!("v{}", self.short_firmware_version())),
            "GetJointLimits" => {
                let limits = persistent.effective_joint_limits();
                (2090, limits_of(number, &limits.min, &limits.max))
            }
            "GetJointLimitsCfg" => (2094, flag(persistent.joint_limits_enabled).into()),
            "GetMonitoringInterval" => {
                (2116, text_format::number(self.text.interval.as_secs_f32()))
            }
            "GetNetworkOptions" => (2119, format!("{},0,0,0,0,0", network.keep_alive_packets)),
            "GetPStop2Cfg" => {
                let code = match self.settings.readings.p_stop2_cfg_code {
                    PStop2CfgCode::Table => 2179,
                    PStop2CfgCode::Chapter => 2178,
                };
                let mode = match persistent.p_stop2 {
                    PStop2Mode::Pause => "2",
                    PStop2Mode::Clear => "3",
                };
                (code, mode.into())
            }
            "GetProductType" => (2084, "Meca500".into()),
            "GetRealTimeMonitoring" => {
                let codes = self.text.optional.codes().map(|code| code.0);
                (2117, text_format::integers(codes))
            }
            // Nobody ever did, so that SetCalibrationCfg has nothing to switch. Source: PM L3491.
            "GetRobotCalibrated" => (2122, "0".into()),
            "GetRobotName" => (2095, network.robot_name.clone()),
            "GetRobotSerial" => (2083, format!("{}", self.settings.serial_number)),
            "GetSimModeCfg" => {
                let kind = match persistent.simulation {
                    SimulationType::Normal => "1",
                    SimulationType::Fast => "2",
                };
                (2187, kind.into())
            }
            "GetTimeScaling" => (2015, text_format::number(self.boot.time_scaling_percent)),
            _ => return None,
        })
    }

    /// What may be asked for when the robot is ready for motion.
    fn motion_data(&self, parsed: &ParsedCommand<'_>) -> Option<(u16, String)> {
        let settings = &self.motion_settings;
        let number = text_format::number;
        let [first, ..] = parsed.numbers();
        Some(match parsed.spec.name {
            "GetAutoConf" => (2028, flag(settings.conf.is_none()).into()),
            "GetAutoConfTurn" => (2031, flag(settings.conf_turn.is_none()).into()),
            "GetBlending" => (2150, number(settings.blending)),
            "GetCartAcc" => (2156, number(settings.cart_acc)),
            "GetCartAngVel" => (2155, number(settings.cart_ang_vel)),
            "GetCartLinVel" => (2154, number(settings.cart_lin_vel)),
            "GetConf" => (
                2029,
                settings
                    .conf
                    .map_or("*,*,*".into(), |posture| text_format::integers(posture.numbers())),
            ),
            "GetConfTurn" => {
                (2036, settings.conf_turn.map_or("*".into(), |turn| format!("{turn}")))
            }
            "GetJointAcc" => (2153, number(settings.joint_acc)),
            "GetJointVel" => (2152, number(settings.joint_vel)),
            "GetJointVelLimit" => (2169, number(settings.joint_vel_limit)),
            "GetModelJointLimits" => (2113, limits_of(first, &MODEL_MIN, &MODEL_MAX)),
            "GetMoveDuration" => (2191, number(settings.move_duration)),
            "GetMoveDurationCfg" => (2190, number(settings.move_duration_severity.to_real())),
            "GetMoveMode" => (2189, number(settings.move_mode.to_real())),
            "GetPayload" => {
                let payload = settings.payload;
                (2192, text_format::numbers([payload.m, payload.c_x, payload.c_y, payload.c_z]))
            }
            "GetTorqueLimits" => (2161, text_format::numbers(settings.torque_limits)),
            "GetTorqueLimitsCfg" => {
                let severity = settings.torque_severity.to_real();
                (2160, text_format::numbers([severity, settings.torque_detection.to_real()]))
            }
            "GetTrf" => (2014, text_format::numbers(<[f32; 6]>::from(settings.trf))),
            "GetVelTimeout" => (2151, number(settings.vel_timeout)),
            "GetWrf" => {
                let code = match self.settings.readings.wrf_code {
                    WrfCode::Table => 2013,
                    WrfCode::Chapter => 2014,
                };
                (code, text_format::numbers(<[f32; 6]>::from(settings.wrf)))
            }
            _ => return None,
        })
    }

    /// Firmware version without its build: `11.3.84`.
    pub(super) fn short_firmware_version(&self) -> String {
        let [major, minor, patch, _] = self.settings.firmware;
        format!("{major}.{minor}.{patch}")
    }

    /// 2082, as the vendor's client reads it. Source: client
    pub(super) fn full_firmware_version(&self) -> String {
        let [.., build] = self.settings.firmware;
        format!("{}.{build}-official", self.short_firmware_version())
    }
}

/// Number and limits of a joint, 1 to 6.
fn limits_of(joint: f32, min: &[f64; 6], max: &[f64; 6]) -> String {
    let index = (joint as usize).saturating_sub(1);
    let at = |limits: &[f64; 6]| limits.get(index).map_or(0.0, |limit| *limit as f32);
    text_format::numbers([joint, at(min), at(max)])
}
