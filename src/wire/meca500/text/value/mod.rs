//! What the robot's messages say, as values with names.
//!
//! Read [`ValueError`] first: it is what becomes of a message that does not say what its code promises.
//! Each type reads the messages of one subject; the functions here read those that say a single thing.
//! How many values a message has and what they mean: PM Tables 2 and 3, and the chapters.
//!
//! Invariants: a message is read whole or not at all, and a value too many is an error as one too few
//! is, because a robot with another firmware may have moved them; nothing panics, whatever the message.

mod conf;
mod identity;
mod limits;
mod place;
mod reader;
mod status;
mod variable;

use super::message::Message;
use crate::wire::meca500::code::Code;

pub use conf::{ConfTurn, Posture};
pub use identity::{FirmwareVersion, Greeting};
pub use limits::{JointLimits, SavedProgram, TorqueLimitsCfg};
pub use place::Stamped;
pub use status::{GripperState, RobotStatus, SafetySignal, SafetyState};
pub use variable::VariableMessage;

use reader::Reader;

/// A message that does not say what was expected of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ValueError {
    /// It has a code that is no answer to what was asked.
    #[error("code {} is no answer to it", .code.0)]
    OtherCode {
        /// The code.
        code: Code,
    },
    /// It ends too early.
    #[error("value {position} is missing in message {}", .code.0)]
    Missing {
        /// The message's code.
        code: Code,
        /// Which value, from 1.
        position: usize,
    },
    /// It goes on behind the last value.
    #[error("message {} has more than {count} value{}", .code.0, if *.count == 1 { "" } else { "s" })]
    Excess {
        /// The message's code.
        code: Code,
        /// How many values it may have.
        count: usize,
    },
    /// One of its values is of another kind, or beyond its range.
    #[error("value {position} of message {} must be {expected}", .code.0)]
    Unfit {
        /// The message's code.
        code: Code,
        /// Which value, from 1.
        position: usize,
        /// What it must be.
        expected: &'static str,
    },
    /// The command was taken, but the robot said nothing that could be read.
    #[error("there is no message to read")]
    Nothing,
}

/// The only value as a number: of most settings.
///
/// # Errors
///
/// [`ValueError`]; so everywhere below.
pub fn number(message: &Message<'_>) -> Result<f64, ValueError> {
    numbers::<1>(message).map(|[number]| number)
}

/// `N` numbers and no more: frames, payloads.
///
/// # Errors
///
/// [`ValueError`].
pub fn numbers<const N: usize>(message: &Message<'_>) -> Result<[f64; N], ValueError> {
    let mut reader = Reader::any(message);
    let numbers = reader.numbers()?;
    reader.end()?;
    Ok(numbers)
}

/// The only value as an integer: a checkpoint, a count, a time.
///
/// # Errors
///
/// [`ValueError`]; also for one beyond the range of `T`.
pub fn integer<T: TryFrom<i64>>(message: &Message<'_>) -> Result<T, ValueError> {
    let mut reader = Reader::any(message);
    let integer = reader.integer()?;
    reader.end()?;
    Ok(integer)
}

/// The only value as on (1) or off (0).
///
/// # Errors
///
/// [`ValueError`]; also for another number.
pub fn flag(message: &Message<'_>) -> Result<bool, ValueError> {
    let mut reader = Reader::any(message);
    let flag = reader.flag()?;
    reader.end()?;
    Ok(flag)
}

/// The body as one text, which may hold commas: a name, a serial number.
///
/// # Errors
///
/// [`ValueError::Missing`] for an empty one.
pub fn text<'a>(message: &Message<'a>) -> Result<&'a str, ValueError> {
    let text = super::quotes::unquoted(message.body.trim());
    if text.is_empty() {
        return Err(ValueError::Missing { code: message.code, position: 1 });
    }
    Ok(text)
}

/// Whether the message has the first of two codes, as the answers have that say only by their code
/// whether something is on.
///
/// # Errors
///
/// [`ValueError::OtherCode`] for a third code.
pub fn is_first_of(message: &Message<'_>, codes: [Code; 2]) -> Result<bool, ValueError> {
    let [first, second] = codes;
    match message.code {
        code if code == first => Ok(true),
        code if code == second => Ok(false),
        code => Err(ValueError::OtherCode { code }),
    }
}

/// The codes of a list of codes (2117), as far as they fit into `codes`; how many there are in all.
///
/// # Errors
///
/// [`ValueError::Unfit`] for what is no code.
pub fn codes(message: &Message<'_>, codes: &mut [Code]) -> Result<usize, ValueError> {
    let mut reader = Reader::any(message);
    let mut slots = codes.iter_mut();
    let mut count = 0;
    while !reader.is_at_end() {
        let code: u16 = reader.integer()?;
        if let Some(slot) = slots.next() {
            *slot = Code(code);
        }
        count += 1;
    }
    Ok(count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString as _;

    fn message(line: &str) -> Message<'_> {
        Message::parse(line).unwrap()
    }

    #[test]
    fn single_values() {
        assert_eq!(number(&message("[2152][25.5]")), Ok(25.5));
        assert_eq!(integer::<u16>(&message("[2157][8000]")), Ok(8000));
        assert_eq!(integer::<u16>(&message("[2157][8000.0]")), Ok(8000));
        assert_eq!(flag(&message("[3028][1]")), Ok(true));
        assert_eq!(text(&message("[2095][a, b]")), Ok("a, b"));
        assert_eq!(text(&message("[2095][\"cell 4\"]")), Ok("cell 4"));
        let on_or_off = [Code(2054), Code(2055)];
        assert_eq!(is_first_of(&message("[2055][off]"), on_or_off), Ok(false));
        let other = ValueError::OtherCode { code: Code(2056) };
        assert_eq!(is_first_of(&message("[2056][]"), on_or_off), Err(other));
    }

    #[test]
    fn what_is_not_as_promised_is_named_by_its_place() {
        for (line, words) in [
            ("[2152][]", "value 1 is missing in message 2152"),
            ("[2152][1,2]", "message 2152 has more than 1 value"),
            ("[2152][fast]", "value 1 of message 2152 must be a number"),
        ] {
            assert_eq!(number(&message(line)).unwrap_err().to_string(), words);
        }
        let small = integer::<u8>(&message("[2157][256]")).unwrap_err();
        assert_eq!(small.to_string(), "value 1 of message 2157 must be an integer in its range");
        assert!(integer::<i64>(&message("[2157][1.5]")).is_err());
        assert!(flag(&message("[3028][2]")).is_err());
        assert!(text(&message("[2083][ ]")).is_err());
        assert_eq!(
            numbers::<6>(&message("[2013][1,2,3,4,5]")).unwrap_err(),
            ValueError::Missing { code: Code(2013), position: 6 }
        );
    }

    #[test]
    fn a_list_of_codes_is_counted_beyond_its_room() {
        let mut room = [Code(0); 2];
        assert_eq!(codes(&message("[2117][2200,2210,2220]"), &mut room), Ok(3));
        assert_eq!(room, [Code(2200), Code(2210)]);
        assert_eq!(codes(&message("[2117][]"), &mut room), Ok(0));
        assert!(codes(&message("[2117][2200,All]"), &mut room).is_err());
        assert!(codes(&message("[2117][70000]"), &mut room).is_err());
    }
}
