//! Lines that wait while the robot is being activated, homed or deactivated.
//!
//! A command that the end of what is going on may allow is not refused meanwhile: `ActivateRobot`,
//! `Home` and a move may be sent at once, as the vendor's client does. It waits with what comes after
//! it, in order; what any state allows is executed at once. Source: client

use alloc::string::String;

use crate::sim::meca500::readings::CommandsWhileBusy;
use crate::sim::meca500::robot::VirtualRobot;
use crate::wire::meca500::text::{Category, ParsedCommand, Timing, parse_line};

/// Lines that may wait; those beyond are judged at once.
const MOST_WAITING: usize = 13_000;

/// Whether the command depends on what the robot is ready for.
fn waits(parsed: &ParsedCommand<'_>) -> bool {
    let name = parsed.spec.name;
    match parsed.spec.category {
        Category::Motion => true,
        Category::Accessory => {
            parsed.spec.timing == Timing::Queued || name.starts_with("GetGripper")
        }
        Category::WorkZone => name.starts_with("Set"),
        Category::Data => super::data::needs_readiness(name),
        Category::Control => matches!(
            name,
            "ActivateRobot"
                | "ActivateSim"
                | "DeactivateSim"
                | "Home"
                | "RebootRobot"
                | "ResetError"
                | "ResumeMotion"
                | "SetCalibrationCfg"
                | "SetJointLimits"
                | "SetJointLimitsCfg"
                | "SetNetworkOptions"
                | "SetPStop2Cfg"
                | "SetRobotName"
                | "SetSimModeCfg"
                | "StartProgram"
        ),
        Category::RealTime => name == "GetCmdPendingCount",
        Category::Variable => false,
    }
}

impl VirtualRobot {
    /// Puts a line aside until the robot is no longer busy. Returns whether it was.
    pub(super) fn put_aside(&mut self, line: &str) -> bool {
        if !self.is_busy()
            || self.text.saving.is_some()
            || self.settings.readings.commands_while_busy == CommandsWhileBusy::Judged
            || self.text.waiting.len() >= MOST_WAITING
        {
            return false;
        }
        let is_waiting = match parse_line(line, self.settings.revision) {
            Ok(Some(parsed)) => waits(&parsed),
            _ => false,
        };
        if is_waiting {
            self.text.waiting.push_back(String::from(line));
        }
        is_waiting
    }

    /// Executes the lines that waited, once the robot is no longer busy.
    pub(in crate::sim::meca500) fn take_up_waiting(&mut self) {
        while !self.is_busy()
            && let Some(line) = self.text.waiting.pop_front()
        {
            self.perform(&line);
        }
    }
}
