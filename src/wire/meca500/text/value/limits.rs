//! Limits that the robot tells, and what came of saving a program.

use super::{Reader, ValueError};
use crate::wire::meca500::code::Code;
use crate::wire::meca500::text::message::Message;

/// Limits of one joint: answers 2090 and 2113. Source: PM L4581, L4677.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointLimits {
    /// The joint, 1 to 6.
    pub joint: u8,
    /// Lowest angle in degrees.
    pub min_deg: f64,
    /// Highest angle in degrees.
    pub max_deg: f64,
}

impl JointLimits {
    /// Reads answers 2090 (in force) and 2113 (of the model).
    ///
    /// # Errors
    ///
    /// [`ValueError`].
    pub fn read(message: &Message<'_>) -> Result<Self, ValueError> {
        let mut reader = Reader::any(message);
        let joint = reader.integer()?;
        let [min_deg, max_deg] = reader.numbers()?;
        reader.end()?;
        Ok(Self { joint, min_deg, max_deg })
    }
}

/// What happens at a torque limit: answer 2160. Source: PM L2879.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TorqueLimitsCfg {
    /// 0 nothing, 1 a message, 2 a pause too, 4 an error.
    pub severity: u8,
    /// Which torque is compared: 0 always, 1 not while accelerating, 2 its deviation from the model.
    pub mode: u8,
}

impl TorqueLimitsCfg {
    /// Reads answer 2160.
    ///
    /// # Errors
    ///
    /// [`ValueError`].
    pub fn read(message: &Message<'_>) -> Result<Self, ValueError> {
        let mut reader = Reader::any(message);
        let (severity, mode) = (reader.integer()?, reader.integer()?);
        reader.end()?;
        Ok(Self { severity, mode })
    }
}

/// The answer to StopSaving: `3 commands saved.` Source: PM L4070.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SavedProgram {
    /// How many commands were saved; `None` where the text does not begin with a number, because
    /// texts may change with the firmware (PM L480).
    pub commands: Option<u32>,
}

impl SavedProgram {
    /// Reads answer 2061.
    ///
    /// # Errors
    ///
    /// [`ValueError::OtherCode`].
    pub fn read(message: &Message<'_>) -> Result<Self, ValueError> {
        if message.code != Code(2061) {
            return Err(ValueError::OtherCode { code: message.code });
        }
        let word = message.body.split_whitespace().next();
        Ok(Self { commands: word.and_then(|word| word.parse().ok()) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(line: &str) -> Message<'_> {
        Message::parse(line).unwrap()
    }

    #[test]
    fn limits_and_severities() {
        let limits = JointLimits::read(&message("[2090][2,-70,90.5]")).unwrap();
        assert_eq!(limits, JointLimits { joint: 2, min_deg: -70.0, max_deg: 90.5 });
        let cfg = TorqueLimitsCfg::read(&message("[2160][4,2]")).unwrap();
        assert_eq!(cfg, TorqueLimitsCfg { severity: 4, mode: 2 });
        assert!(TorqueLimitsCfg::read(&message("[2160][4]")).is_err());
        assert!(JointLimits::read(&message("[2090][-2,-70,90]")).is_err());
    }

    #[test]
    fn saved_commands_are_counted_where_the_text_tells() {
        let read = |line: &str| SavedProgram::read(&message(line)).map(|saved| saved.commands);
        assert_eq!(read("[2061][3 commands saved.]"), Ok(Some(3)));
        assert_eq!(read("[2061][Saved.]"), Ok(None));
        assert!(read("[2064][looping]").is_err());
    }
}
