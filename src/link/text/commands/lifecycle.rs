//! Bringing the robot up and down.

use std::format;

use super::digit;
use crate::link::text::answer::Answer;
use crate::link::text::client::Client;
use crate::link::text::error::AnswerError;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::text::value;

/// A kind of simulation. Source: PM L3115.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Simulation {
    /// As SetSimModeCfg has it.
    AsConfigured,
    /// In real time.
    RealTime,
    /// As fast as the robot computes.
    Fast,
}

impl Client {
    /// ActivateRobot: powers the motors. Ends when they are on.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send); so everywhere below.
    pub fn activate_robot(&self) -> Result<Answer<()>, AnswerError> {
        self.order("ActivateRobot")
    }

    /// ActivateRobot(1): initialises the drives again; the robot must be homed after that. Source: PM
    /// L3087.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn activate_robot_afresh(&self) -> Result<Answer<()>, AnswerError> {
        self.order("ActivateRobot(1)")
    }

    /// DeactivateRobot: takes the power from the motors. Ends when they are off.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn deactivate_robot(&self) -> Result<Answer<()>, AnswerError> {
        self.order("DeactivateRobot")
    }

    /// Home. Ends when the robot is homed, at once where it was before; takes some seconds.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn home(&self) -> Result<Answer<()>, AnswerError> {
        self.order("Home")
    }

    /// ResetError. Ends when the error is reset, with whether there was one; motion goes on after
    /// ResumeMotion only (PM L880).
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn reset_error(&self) -> Result<Answer<bool>, AnswerError> {
        self.ask("ResetError", |message| {
            value::is_first_of(message, [Code::ERROR_RESET, Code::NO_ERROR_TO_RESET])
        })
    }

    /// ActivateSim, of a deactivated robot. Ends with whether simulation is on.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn activate_sim(&self, kind: Simulation) -> Result<Answer<bool>, AnswerError> {
        let line = match kind {
            Simulation::AsConfigured => "ActivateSim",
            Simulation::RealTime => "ActivateSim(1)",
            Simulation::Fast => "ActivateSim(2)",
        };
        self.ask(line, |message| value::is_first_of(message, [Code(2045), Code(2046)]))
    }

    /// DeactivateSim, of a deactivated robot.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn deactivate_sim(&self) -> Result<Answer<()>, AnswerError> {
        self.order("DeactivateSim")
    }

    /// SetRecoveryMode: motion without homing, beyond limits, slowly. Ends with whether it is on. Source: PM
    /// L3832.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn set_recovery_mode(&self, on: bool) -> Result<Answer<bool>, AnswerError> {
        let line = format!("SetRecoveryMode({})", digit(on));
        self.ask(&line, |message| value::is_first_of(message, [Code(2049), Code(2050)]))
    }

    /// RebootRobot, of a deactivated robot. It has no answer: the connection ends.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn reboot_robot(&self) -> Result<(), AnswerError> {
        self.send("RebootRobot").map(drop)
    }
}
