//! Robot control commands: executed at once, each answered with a response of its own or with 2085.
//! Source: PM L3009-4190.

use alloc::format;
use alloc::string::String;

use super::dispatch::Refused;
use super::face::Port;
use super::format as text_format;
use super::log::LogKind;
use crate::sim::meca500::lifecycle::Lifecycle;
use crate::sim::meca500::readings::EndOfMovementAfterPause;
use crate::sim::meca500::robot::VirtualRobot;
use crate::sim::meca500::settings::{FieldbusMode, NetworkSettings, PStop2Mode, SimulationType};
use crate::time::Duration;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::text::{Argument, ParsedCommand, Value};

/// Shortest time of a connection watchdog. Source: PM L3158.
const SHORTEST_WATCHDOG_S: f32 = 0.001;

/// The first argument as it was written, without quotation marks.
pub(super) fn first_text<'a>(parsed: &ParsedCommand<'a>) -> &'a str {
    parsed.arguments().next().map_or("", |argument| plain(&argument))
}

/// An argument without quotation marks.
pub(super) fn plain<'a>(argument: &Argument<'a>) -> &'a str {
    match argument.value() {
        Value::Text(text) => text,
        _ => argument.text,
    }
}

impl VirtualRobot {
    /// Executes a robot control command.
    pub(super) fn control(
        &mut self,
        parsed: &ParsedCommand<'_>,
        line: &str,
    ) -> Result<(), Refused> {
        let [number, ..] = parsed.numbers();
        let is_on = number == 1.0;
        match parsed.spec.name {
            "ActivateRobot" => self.activate_by_text(parsed.arguments().next().is_some()),
            "DeactivateRobot" => self.deactivate_by_text(),
            "Home" => self.home_by_text(),
            "PauseMotion" => self.pause_by_text(),
            "ClearMotion" => Ok(self.clear_motion()?),
            "ResumeMotion" => Ok(self.resume_motion()?),
            "ResetError" => self.reset_by_text(),
            "ActivateSim" => {
                let kind = parsed.arguments().next().map(|_| number);
                self.simulate_by_text(kind)
            }
            "DeactivateSim" => self.simulate_by_text(Some(0.0)),
            "SetRecoveryMode" => {
                self.set_recovery_mode(is_on);
                let text = if is_on { "enabled" } else { "disabled" };
                let code = if is_on { Code(2049) } else { Code(2050) };
                self.answer(code, &format!("Recovery mode {text}"));
                Ok(())
            }
            "SetTimeScaling" => {
                self.submit_parsed(parsed)?;
                self.answer(Code(2015), &text_format::number(number));
                Ok(())
            }
            "SetCalibrationCfg" => {
                self.submit_parsed(parsed)?;
                self.answer(Code(2170), &text_format::number(number));
                Ok(())
            }
            "SetJointLimits" => {
                self.submit_parsed(parsed)?;
                self.answer(Code(2092), &text_format::number(number));
                Ok(())
            }
            "SetJointLimitsCfg" => {
                self.submit_parsed(parsed)?;
                let text = if is_on { "enabled" } else { "disabled" };
                self.answer(Code(2093), &format!("User-defined joint limits {text}."));
                Ok(())
            }
            "StartProgram" => self.start_program_by_text(first_text(parsed)),
            "StartSaving" => self.start_saving(number as u16),
            "StopSaving" | "SetOfflineProgramLoop" => Err(Code::NOT_SAVING.into()),
            "SetRealTimeMonitoring" => self.set_real_time_monitoring(parsed),
            "SetCtrlPortMonitoring" => {
                self.copy_monitoring(is_on);
                Ok(())
            }
            "ConnectionWatchdog" => {
                if number > 0.0 && number < SHORTEST_WATCHDOG_S {
                    return Err(Code::ARGUMENT_ERROR.into());
                }
                self.set_watchdog(number);
                Ok(())
            }
            "RebootRobot" => self.submit_parsed(parsed),
            _ => self.configure(parsed, line),
        }
    }

    /// Settings of the robot, the network and the ports.
    fn configure(&mut self, parsed: &ParsedCommand<'_>, line: &str) -> Result<(), Refused> {
        let [number, ..] = parsed.numbers();
        let is_on = number == 1.0;
        let done =
            |robot: &mut Self| robot.answer(Code::COMMAND_SUCCESSFUL, &text_format::success(line));
        match parsed.spec.name {
            "SetEob" => {
                self.text.tells_end_of_block = is_on;
                self.answer_own(if is_on { Code(2054) } else { Code(2055) });
            }
            "SetEom" => {
                self.text.tells_end_of_movement = is_on;
                self.answer_own(if is_on { Code(2052) } else { Code(2053) });
            }
            "SetMonitoringInterval" => {
                self.text.interval = duration(number);
                self.text.next_cycle = self.now + self.text.interval;
                done(self);
            }
            "SetPStop2Cfg" => {
                self.deactivated()?;
                let clears = number == 3.0;
                self.settings.persistent.p_stop2 =
                    if clears { PStop2Mode::Clear } else { PStop2Mode::Pause };
                self.answer(Code(2178), "PStop2 configuration set successfully");
            }
            "SetSimModeCfg" => {
                self.deactivated()?;
                let fast = number == 2.0;
                self.settings.persistent.simulation =
                    if fast { SimulationType::Fast } else { SimulationType::Normal };
                self.answer(Code(2188), "Simulation mode configuration set successfully.");
            }
            "SetRobotName" => {
                self.set_robot_name(first_text(parsed))?;
                done(self);
            }
            "SetNetworkOptions" => {
                self.deactivated()?;
                self.settings.network.keep_alive_packets = number as u8;
                done(self);
            }
            "EnableEtherNetIp" => {
                self.settings.network.ethernet_ip = fieldbus_mode(number);
                done(self);
            }
            "EnableProfinet" => {
                self.settings.network.profinet = fieldbus_mode(number);
                done(self);
            }
            "SwitchToEtherCat" => {
                done(self);
                self.switch_to_ethercat();
            }
            "SetRtc" => {
                let seconds: u32 = first_text(parsed).parse().map_err(|_| Code::ARGUMENT_ERROR)?;
                self.set_rtc(seconds.into());
                done(self);
            }
            "SyncCmdQueue" => {
                let id: u32 = first_text(parsed).parse().map_err(|_| Code::ARGUMENT_ERROR)?;
                self.answer(Code(2097), &format!("{id}"));
            }
            "LogTrace" => {
                self.write_log(LogKind::Trace, first_text(parsed));
                done(self);
            }
            "LogUserCommands" => {
                let [_, beginnings, ..] = parsed.numbers();
                self.log_user_commands(is_on, beginnings == 1.0);
                done(self);
            }
            // Nothing is captured: there is no MecaPortal to fetch a capture with.
            "TcpDump" => {
                let seconds: u32 = first_text(parsed).parse().map_err(|_| Code::ARGUMENT_ERROR)?;
                self.text.dump_ends = Some(self.now + Duration::from_secs(seconds.into()));
                self.answer(
                    Code(3035),
                    &format!("TCP dump capture started for {seconds} seconds."),
                );
            }
            "TcpDumpStop" => {
                self.text.dump_ends = None;
                self.answer(Code(3036), "TCP dump capture stopped.");
            }
            _ => return Err(Code::UNKNOWN_COMMAND.into()),
        }
        Ok(())
    }

    /// Answers with a code's own message.
    pub(super) fn answer_own(&mut self, code: Code) {
        let message = text_format::message(code, None);
        self.answer(code, &message);
    }

    /// For commands that need a deactivated robot.
    pub(super) fn deactivated(&self) -> Result<(), Code> {
        if self.has_motors_on() || self.is_busy() { Err(Code::DEACTIVATION_NEEDED) } else { Ok(()) }
    }

    /// ActivateRobot: 2000 comes when the motors are on. Source: PM L3075-3100.
    fn activate_by_text(&mut self, initialises: bool) -> Result<(), Refused> {
        if self.is_activated() {
            self.answer_own(Code::MOTORS_ACTIVATED);
            return Ok(());
        }
        let was_homed = self.arm_homed;
        self.arm_homed &= !initialises;
        if let Err(code) = self.activate() {
            self.arm_homed = was_homed;
            return Err(code.into());
        }
        self.text.awaits_activation = true;
        Ok(())
    }

    /// DeactivateRobot: 2004 comes when the motors are off. That the queue was emptied goes without
    /// saying here, but not on the monitoring port. Source: PM L3189, L890.
    fn deactivate_by_text(&mut self) -> Result<(), Refused> {
        self.deactivate()?;
        self.text.answered.push(Code::MOTION_CLEARED);
        Ok(())
    }

    /// Home: 2002 comes when it is done, at once where it was done before. Source: PM L3309.
    fn home_by_text(&mut self) -> Result<(), Refused> {
        if self.is_homed() {
            self.answer_own(Code::HOMING_DONE);
            return Ok(());
        }
        Ok(self.home()?)
    }

    fn pause_by_text(&mut self) -> Result<(), Refused> {
        let moves = self.is_moving();
        self.pause_motion()?;
        let always =
            self.settings.readings.end_of_movement_after_pause == EndOfMovementAfterPause::Always;
        self.text.tells_next_stop |= moves && always;
        Ok(())
    }

    fn reset_by_text(&mut self) -> Result<(), Refused> {
        let was_in_error = self.error != Code(0);
        self.reset_error()?;
        self.answer_own(if was_in_error { Code::ERROR_RESET } else { Code::NO_ERROR_TO_RESET });
        Ok(())
    }

    /// ActivateSim and DeactivateSim: 0 off, 1 in real time, 2 fast, `None` as configured.
    fn simulate_by_text(&mut self, kind: Option<f32>) -> Result<(), Refused> {
        if self.lifecycle != Lifecycle::Deactivated {
            return Err(Code::SIM_NEEDS_DEACTIVATION.into());
        }
        let is_on = kind != Some(0.0);
        self.set_simulation(is_on)?;
        self.asked_simulation = match kind {
            Some(1.0) => Some(SimulationType::Normal),
            Some(2.0) => Some(SimulationType::Fast),
            _ => None,
        };
        self.answer_own(if is_on { Code(2045) } else { Code(2046) });
        Ok(())
    }

    /// SetCtrlPortMonitoring. Whoever switches it on is told all of the state, as a new monitoring
    /// connection is, but for the greeting. Source: client
    fn copy_monitoring(&mut self, is_on: bool) {
        let text = if is_on { "enabled" } else { "disabled" };
        self.answer(Code(2096), &format!("Monitoring on control port {text}"));
        let was_on = core::mem::replace(&mut self.text.copies_monitoring, is_on);
        if !is_on || was_on {
            return;
        }
        let mut messages = alloc::vec::Vec::new();
        self.tell_everything(&mut |code, content| {
            messages.push((code, String::from(content)));
        });
        for (code, content) in messages.into_iter().filter(|(code, _)| *code != Code::CONNECTED) {
            self.say(Port::Control, code, &content);
        }
    }

    /// ConnectionWatchdog: each one starts the time anew; 0 cancels. Only the first one and the
    /// cancelling one are answered. Source: PM L3178.
    pub(super) fn set_watchdog(&mut self, seconds: f32) {
        let was_on = self.text.watchdog.is_some();
        if seconds > 0.0 {
            self.text.watchdog = Some(self.now + duration(seconds));
            if !was_on {
                self.answer(Code(2177), "1");
            }
        } else {
            self.text.watchdog = None;
            self.answer(Code(2177), "0");
        }
    }

    fn set_robot_name(&mut self, name: &str) -> Result<(), Code> {
        if !NetworkSettings::is_robot_name(name) {
            return Err(Code::ARGUMENT_ERROR);
        }
        self.deactivated()?;
        self.settings.network.robot_name = String::from(name);
        self.say(Port::Monitoring, Code(2095), name);
        Ok(())
    }

    /// The end of a capture that TcpDump began.
    pub(super) fn end_dump(&mut self) {
        if self.text.dump_ends.is_some_and(|end| self.now >= end) {
            self.text.dump_ends = None;
            self.say(Port::Control, Code(3036), "TCP dump capture stopped.");
        }
    }
}

/// Whole microseconds, so that 0.1 s is 100 ms and not the nearest Real.
fn duration(seconds: f32) -> Duration {
    Duration::from_micros((f64::from(seconds) * 1e6 + 0.5) as u64)
}

fn fieldbus_mode(number: f32) -> FieldbusMode {
    FieldbusMode::from_number(number as u8).unwrap_or_default()
}
