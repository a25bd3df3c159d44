//! Work zone and collisions. Source: PM L5762-6060.

use alloc::string::String;

use super::dispatch::Refused;
use super::format;
use crate::sim::meca500::robot::VirtualRobot;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::text::ParsedCommand;

impl VirtualRobot {
    /// A command of the work zone's chapter.
    pub(super) fn work_zone(&mut self, parsed: &ParsedCommand<'_>) -> Result<(), Refused> {
        let (code, content) = match parsed.spec.name {
            "SetCollisionCfg" => (2180, "Collision configuration set successfully."),
            "SetToolSphere" => (2168, "Tool sphere set successfully."),
            "SetWorkZoneCfg" => (2164, "Work zone configuration set successfully."),
            "SetWorkZoneLimits" => (2166, "Workspace limits set successfully."),
            _ => return self.request_zone(parsed),
        };
        self.submit_parsed(parsed)?;
        self.answer(Code(code), content);
        Ok(())
    }

    fn request_zone(&mut self, parsed: &ParsedCommand<'_>) -> Result<(), Refused> {
        let persistent = &self.settings.persistent;
        let narrow = |values: &[f64]| -> String {
            format::joined(values.iter().map(|value| format::number(*value as f32)))
        };
        let (code, content) = match parsed.spec.name {
            "GetCollisionCfg" => (2181, format::number(persistent.collision_severity.to_real())),
            "GetCollisionStatus" => (2182, format::integers(self.collision_numbers())),
            "GetToolSphere" => (2167, narrow(&persistent.tool_sphere)),
            "GetWorkZoneCfg" => {
                let severity = persistent.work_zone_severity.to_real();
                (2163, format::numbers([severity, persistent.work_zone_mode.to_real()]))
            }
            "GetWorkZoneLimits" => {
                let ([a, b, c], [d, e, f]) = (persistent.work_zone_min, persistent.work_zone_max);
                (2165, narrow(&[a, b, c, d, e, f]))
            }
            "GetWorkZoneStatus" => (2183, format::integers(self.breach_numbers())),
            _ => return Err(Code::UNKNOWN_COMMAND.into()),
        };
        self.answer(Code(code), &content);
        Ok(())
    }
}
