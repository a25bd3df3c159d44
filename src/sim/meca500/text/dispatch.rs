//! From a line to what the robot does about it.
//!
//! ```text
//! line --variables--> line --parse--> command --saving?--> error mode? --> its category's file
//!                               |
//!                               '--> 1001, 1002, 1003, or taken all the same (`line`)
//! ```
//!
//! A command is looked at in the order of the robot's `receive`: does it exist, are its arguments
//! good, may it run in this state. Names of other robots' commands are answered as unknown ones.

use alloc::borrow::Cow;
use alloc::string::String;

use super::face::Port;
use super::format;
use super::line::{Odd, judge};
use super::status::signal_number;
use crate::sim::meca500::readings::TextInErrorMode;
use crate::sim::meca500::robot::VirtualRobot;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::text::{Category, ParsedCommand, parse_line};

/// Why a command was not executed.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Refused {
    /// A code with the robot's own message.
    Code(Code),
    /// A code with a message that names the reason.
    Because(Code, String),
    /// P-Stop 2 ignores it, which is told by the state of the signal. Source: PM L882.
    PStop2,
}

impl From<Code> for Refused {
    fn from(code: Code) -> Self {
        Self::Code(code)
    }
}

impl VirtualRobot {
    /// Acts on a line of the control port.
    pub(super) fn text_command(&mut self, line: &str) {
        self.listen_to_text();
        // What happened before belongs in front of the answer.
        self.observe_text();
        self.log_received(line);
        if !self.put_aside(line) {
            self.perform(line);
            self.take_up_waiting();
        }
    }

    /// Acts on a line that does not have to wait.
    pub(super) fn perform(&mut self, line: &str) {
        self.text.in_command = true;
        self.log_answers_of(line);
        if let Err(refused) = self.dispatch(line) {
            self.tell_refusal(line, refused);
        }
        self.observe_text();
        self.text.in_command = false;
        self.log_answers_again();
        self.text.answered.clear();
    }

    fn tell_refusal(&mut self, line: &str, refused: Refused) {
        match refused {
            Refused::Code(code) => {
                let message = format::message(code, Some(line));
                self.answer(code, &message);
            }
            Refused::Because(code, message) => self.answer(code, &message),
            Refused::PStop2 => {
                let number = signal_number(self.safety.p_stop2);
                self.say(Port::Control, Code::P_STOP_2, &format::integers([number]));
            }
        }
    }

    fn dispatch(&mut self, line: &str) -> Result<(), Refused> {
        let line = line.trim();
        if self.text.saving.is_some() {
            return self.dispatch_while_saving(line);
        }
        if let Some(done) = self.client_command(line) {
            return done;
        }
        let resolved = self.resolve_variables(line)?;
        self.dispatch_resolved(&resolved)
    }

    /// Acts on a line without variables.
    pub(super) fn dispatch_resolved(&mut self, line: &str) -> Result<(), Refused> {
        let parsed = match parse_line(line, self.settings.revision) {
            Ok(Some(parsed)) => parsed,
            Ok(None) => return Err(Code::UNKNOWN_COMMAND.into()),
            Err(error) => {
                return match judge(line, &error) {
                    Odd::Motion(command) => self.submit(&command),
                    Odd::FullFirmwareVersion => {
                        let version = self.full_firmware_version();
                        self.answer(Code(2082), &version);
                        Ok(())
                    }
                    Odd::NoRealTime => {
                        self.clear_real_time_monitoring();
                        Ok(())
                    }
                    Odd::Refused(code) => Err(code.into()),
                };
            }
        };
        self.execute_text(&parsed, line)
    }

    /// Acts on a parsed command; `line` is what an answer repeats.
    pub(super) fn execute_text(
        &mut self,
        parsed: &ParsedCommand<'_>,
        line: &str,
    ) -> Result<(), Refused> {
        if parsed.spec.available == Some(false) {
            return Err(Code::UNKNOWN_COMMAND.into());
        }
        self.check_error_mode(parsed)?;
        match parsed.spec.category {
            Category::Motion => self.submit_parsed(parsed),
            Category::Control => self.control(parsed, line),
            Category::Data => self.request_data(parsed),
            Category::RealTime => self.request_real_time(parsed),
            Category::WorkZone => self.work_zone(parsed),
            Category::Accessory => self.accessory(parsed),
            Category::Variable => self.variable_command(parsed),
        }
    }

    /// Error mode and commands for any state. What needs a robot ready for motion is looked at where
    /// it is executed. Source: PM L872.
    fn check_error_mode(&self, parsed: &ParsedCommand<'_>) -> Result<(), Code> {
        let refuses = self.settings.readings.text_in_error_mode == TextInErrorMode::Refused;
        let leads_on = matches!(
            parsed.spec.name,
            "GetStatusRobot"
                | "GetSafetyStopStatus"
                | "ResetError"
                | "ActivateRobot"
                | "DeactivateRobot"
                | "ClearMotion"
                | "PauseMotion"
                | "ConnectionWatchdog"
                | "SyncCmdQueue"
        );
        let is_queued_elsewhere = parsed.spec.category == Category::Motion;
        if refuses && self.error != Code(0) && !leads_on && !is_queued_elsewhere {
            return Err(Code::IN_ERROR);
        }
        Ok(())
    }

    /// The line with the values of the variables that it refers to.
    pub(super) fn resolve_variables<'a>(&self, line: &'a str) -> Result<Cow<'a, str>, Refused> {
        if !line.contains("vars.") {
            return Ok(Cow::Borrowed(line));
        }
        match parse_line(line, self.settings.revision) {
            Ok(Some(parsed)) if parsed.spec.category != Category::Variable => {
                self.with_values(line, &parsed).map(Cow::Owned)
            }
            _ => Ok(Cow::Borrowed(line)),
        }
    }
}
