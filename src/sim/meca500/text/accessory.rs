//! Grippers and the pneumatic module. Source: PM L6060-6710.

use alloc::format;
use alloc::string::String;

use super::dispatch::Refused;
use super::format as text_format;
use crate::sim::meca500::readings::{ToolSimulationValue, ToolVersionCode};
use crate::sim::meca500::robot::VirtualRobot;
use crate::sim::meca500::settings::FittedTool;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::text::{ParsedCommand, Timing};

impl VirtualRobot {
    /// A command of the accessories' chapter.
    pub(super) fn accessory(&mut self, parsed: &ParsedCommand<'_>) -> Result<(), Refused> {
        if parsed.spec.timing == Timing::Queued {
            return self.submit_parsed(parsed);
        }
        let settings = &self.motion_settings;
        let [number, ..] = parsed.numbers();
        match parsed.spec.name {
            "GetExtToolFwVersion" => {
                if self.tool.old_firmware {
                    return Err(Code::TOOL_FIRMWARE_OUTDATED.into());
                }
                let code = match self.settings.readings.tool_version_code {
                    ToolVersionCode::Chapter => 2086,
                    ToolVersionCode::Table => 2088,
                };
                let version = self.tool_version();
                self.answer(Code(code), &version);
            }
            "GetExtToolSim" => self.answer_tool_simulation(),
            "SetExtToolSim" => self.emulate_tool(number)?,
            "GetGripperForce" => {
                self.ready_for_motion()?;
                let force = text_format::number(settings.gripper_force);
                self.answer(Code(2158), &force);
            }
            "GetGripperVel" => {
                self.ready_for_motion()?;
                let velocity = text_format::number(settings.gripper_vel);
                self.answer(Code(2159), &velocity);
            }
            "GetGripperRange" => {
                self.ready_for_motion()?;
                let whole = [0.0, self.tool.range_mm() as f32];
                let range = text_format::numbers(settings.gripper_range.unwrap_or(whole));
                self.answer(Code(2162), &range);
            }
            "GetRtExtToolStatus" => self.answer_real_time(2300)?,
            "GetRtGripperForce" => self.answer_real_time(2321)?,
            "GetRtGripperPos" => self.answer_real_time(2322)?,
            "GetRtGripperState" if !self.tool.is_gripper() => return Err(Code::NO_GRIPPER.into()),
            "GetRtGripperState" => self.answer_real_time(2320)?,
            "GetRtValveState" if self.tool.kind() != FittedTool::Mpm500 => {
                return Err(Code::NO_PNEUMATIC_MODULE.into());
            }
            "GetRtValveState" => self.answer_real_time(2310)?,
            "GetStatusGripper" => {
                let state = text_format::integers(self.legacy_gripper());
                self.answer(Code(2079), &state);
            }
            _ => return Err(Code::UNKNOWN_COMMAND.into()),
        }
        Ok(())
    }

    /// Firmware of the fitted tool, which is the robot's; zeros where there is none.
    /// Source: PM L6089, L6097.
    pub(super) fn tool_version(&self) -> String {
        match self.tool.fitted() {
            FittedTool::None => "v0.0.0".into(),
            _ => format!("v{}", self.short_firmware_version()),
        }
    }

    fn answer_tool_simulation(&mut self) {
        let number = self.tool.emulated().map_or(0, FittedTool::number);
        match self.settings.readings.tool_simulation_value {
            ToolSimulationValue::Number => self.answer(Code(2047), &format!("{number}")),
            ToolSimulationValue::Text => self.answer_own(Code(2047)),
        }
    }

    /// SetExtToolSim. Another kind of tool needs a deactivated robot. Source: PM L530, L6518-6536.
    fn emulate_tool(&mut self, number: f32) -> Result<(), Code> {
        let wanted = match number as u32 {
            0 => None,
            10 => Some(FittedTool::Megp25E),
            11 => Some(FittedTool::Megp25Ls),
            20 => Some(FittedTool::Mpm500),
            _ => Some(match self.tool.fitted() {
                FittedTool::None => FittedTool::Megp25E,
                fitted => fitted,
            }),
        };
        let changes = wanted.unwrap_or(self.tool.fitted()) != self.tool.kind();
        if changes && (self.has_motors_on() || self.is_busy()) {
            return Err(Code::TOOL_SIM_NEEDS_DEACTIVATION);
        }
        self.tool.emulate_as(wanted);
        self.answer_tool_simulation();
        Ok(())
    }
}
