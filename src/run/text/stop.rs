//! The end of a run that was not foreseen: stopping what the robot does or may be about to do.
//!
//! ```text
//! PauseMotion --2042--> ClearMotion --2044--> confirmed
//! DeactivateRobot --2004--> deactivated          while being activated or homed: a pause ends neither
//! ```

use super::robot::Robot;
use crate::run::outcome::{End, Stop};
use crate::wire::meca500::code::Code;

/// A part of stopping.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Halt {
    Pause,
    Clear,
    Deactivate,
}

/// What a message means to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Progress {
    /// Nothing.
    None,
    /// The next part is due.
    Next(Halt),
    /// It is over.
    Over(Stop),
    /// The same again a little later: the robot was busy.
    Again,
}

impl Halt {
    /// The first part, or why there is nothing to stop. `is_readying`: the line of an activation, a homing
    /// or a deactivation is on its way.
    pub(super) fn first(robot: &Robot, end: End, is_readying: bool) -> Result<Self, Stop> {
        let Some(status) = robot.status else { return Err(Stop::NotNeeded) };
        if is_readying {
            return Ok(Self::Deactivate);
        }
        if !status.is_activated {
            return Err(Stop::NotActivated);
        }
        // Error mode has stopped the robot and emptied its queue. Source: PM L872.
        if status.is_in_error && status.is_paused {
            return Err(Stop::NotNeeded);
        }
        match end {
            // It stands already, but a P-Stop 2 may leave its queue as it is.
            End::SafetyStop(_) => Ok(Self::Clear),
            _ => Ok(Self::Pause),
        }
    }

    pub(super) const fn line(self) -> &'static str {
        match self {
            Self::Pause => "PauseMotion",
            Self::Clear => "ClearMotion",
            Self::Deactivate => "DeactivateRobot",
        }
    }

    /// What a message of the control port means.
    pub(super) const fn heard(self, code: Code, is_error: bool) -> Progress {
        match (self, code) {
            (Self::Pause, Code::MOTION_PAUSED) => Progress::Next(Self::Clear),
            (Self::Clear, Code::MOTION_CLEARED) => Progress::Over(Stop::Confirmed),
            (Self::Deactivate, Code::MOTORS_DEACTIVATED) => Progress::Over(Stop::Deactivated),
            // A robot that is being activated cannot be deactivated yet.
            (Self::Deactivate, Code::NOT_ACTIVATED) => Progress::Again,
            (Self::Deactivate, Code::ACTIVATION_FAILED) => Progress::Over(Stop::NotActivated),
            (_, Code::NOT_ACTIVATED) => Progress::Over(Stop::NotActivated),
            // Not homed, it cannot move; in error, it has stopped.
            (_, Code::NOT_HOMED) | (Self::Clear, Code::IN_ERROR) => Progress::Over(Stop::NotNeeded),
            // Not paused is one more reason to clear.
            (Self::Pause, _) if is_error => Progress::Next(Self::Clear),
            _ => Progress::None,
        }
    }
}
