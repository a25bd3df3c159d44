//! State of the robot, of its gripper and of its stop signals.

use super::{Reader, ValueError};
use crate::wire::meca500::code::Code;
use crate::wire::meca500::text::message::Message;

/// The robot's state: message 2007. Source: PM L5722.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct RobotStatus {
    /// The motors are on.
    pub is_activated: bool,
    /// The robot is homed.
    pub is_homed: bool,
    /// 0: no simulation; 1: in real time; 2: fast.
    pub simulation: u8,
    /// The robot is in error mode.
    pub is_in_error: bool,
    /// Motion is paused, was cleared, or the robot is in error mode.
    pub is_paused: bool,
    /// The robot does not move and its queue is empty.
    pub is_end_of_block: bool,
    /// The robot does not move.
    pub is_end_of_motion: bool,
}

/// The gripper's state: message 2079. Source: PM Table 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct GripperState {
    /// A gripper is there and enabled.
    pub is_enabled: bool,
    /// It is homed.
    pub is_homed: bool,
    /// It holds a part.
    pub is_holding: bool,
    /// It is at a limit.
    pub is_at_limit: bool,
    /// It is in error.
    pub is_in_error: bool,
    /// It is too hot.
    pub is_overheated: bool,
}

impl RobotStatus {
    /// Reads message 2007.
    ///
    /// # Errors
    ///
    /// [`ValueError`].
    pub fn read(message: &Message<'_>) -> Result<Self, ValueError> {
        let mut reader = Reader::of(message, &[Code::STATUS_ROBOT])?;
        let status = Self {
            is_activated: reader.flag()?,
            is_homed: reader.flag()?,
            simulation: reader.integer()?,
            is_in_error: reader.flag()?,
            is_paused: reader.flag()?,
            is_end_of_block: reader.flag()?,
            is_end_of_motion: reader.flag()?,
        };
        reader.end()?;
        Ok(status)
    }
}

impl GripperState {
    /// Reads message 2079.
    ///
    /// # Errors
    ///
    /// [`ValueError`].
    pub fn read(message: &Message<'_>) -> Result<Self, ValueError> {
        let mut reader = Reader::of(message, &[Code(2079)])?;
        let state = Self {
            is_enabled: reader.flag()?,
            is_homed: reader.flag()?,
            is_holding: reader.flag()?,
            is_at_limit: reader.flag()?,
            is_in_error: reader.flag()?,
            is_overheated: reader.flag()?,
        };
        reader.end()?;
        Ok(state)
    }
}

/// A stop signal that GetSafetyStopStatus tells of. Source: PM L5697.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SafetySignal {
    /// Protective stop 2 (SWStop).
    PStop2,
    /// Emergency stop.
    EStop,
    /// The robot was rebooted and waits for Reset.
    Reboot,
    /// A connection broke, or its watchdog ran out.
    ConnectionDrop,
}

impl SafetySignal {
    /// Its code, which is both the argument and the code of the answer.
    #[must_use]
    pub const fn code(self) -> Code {
        match self {
            Self::PStop2 => Code::P_STOP_2,
            Self::EStop => Code::E_STOP,
            Self::Reboot => Code::REBOOTED,
            Self::ConnectionDrop => Code::CONNECTION_DROPPED,
        }
    }
}

/// State of a stop signal. Source: PM L739.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SafetyState {
    /// 0: there is no stop.
    Clear,
    /// 1: the robot is stopped by it.
    Active,
    /// 2: it is gone and must be reset.
    ToBeReset,
}

impl SafetyState {
    /// Reads the state of any stop signal.
    ///
    /// # Errors
    ///
    /// [`ValueError`].
    pub fn read(message: &Message<'_>) -> Result<Self, ValueError> {
        let mut reader = Reader::any(message);
        let state = match reader.integer::<i64>()? {
            0 => Self::Clear,
            1 => Self::Active,
            2 => Self::ToBeReset,
            _ => {
                let (code, position) = (message.code, 1);
                return Err(ValueError::Unfit { code, position, expected: "0, 1 or 2" });
            }
        };
        reader.end()?;
        Ok(state)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(line: &str) -> Result<RobotStatus, ValueError> {
        RobotStatus::read(&Message::parse(line).unwrap())
    }

    #[test]
    fn each_value_of_the_status_has_its_place() {
        let read = status("[2007][1,0,2,0,1,0,1]").unwrap();
        assert_eq!(
            read,
            RobotStatus {
                is_activated: true,
                is_homed: false,
                simulation: 2,
                is_in_error: false,
                is_paused: true,
                is_end_of_block: false,
                is_end_of_motion: true,
            }
        );
        assert!(status("[2007][1,0,2,0,1,0]").is_err());
        assert!(status("[2007][1,0,2,0,1,0,1,0]").is_err());
        assert!(status("[2007][1,0,2,0,1,0,7]").is_err());
        assert!(status("[2008][1,0,2,0,1,0,1]").is_err());
    }

    #[test]
    fn stop_signals_have_three_states() {
        let read = |line: &str| SafetyState::read(&Message::parse(line).unwrap());
        assert_eq!(read("[3070][0]"), Ok(SafetyState::Clear));
        assert_eq!(read("[3070][1]"), Ok(SafetyState::Active));
        assert_eq!(read("[3070][2]"), Ok(SafetyState::ToBeReset));
        assert!(read("[3070][3]").is_err());
        assert!(read("[3070][1,1]").is_err());
    }
}
