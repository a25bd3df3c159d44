//! Postures and turns of the last joint.

use super::{Reader, Stamped, ValueError};
use crate::wire::meca500::text::message::Message;

/// A posture: shoulder, elbow and wrist. Source: PM L178.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Posture {
    /// Shoulder: -1 or 1; 0 at a singularity.
    pub c_s: i8,
    /// Elbow, as above.
    pub c_e: i8,
    /// Wrist, as above.
    pub c_w: i8,
}

impl Posture {
    fn next(reader: &mut Reader<'_>) -> Result<Self, ValueError> {
        Ok(Self { c_s: reader.integer()?, c_e: reader.integer()?, c_w: reader.integer()? })
    }

    /// Answer to GetConf (2029): the posture that was asked for, `None` while the robot chooses it,
    /// which it writes as stars.
    ///
    /// Source: PM L4475.
    ///
    /// # Errors
    ///
    /// [`ValueError`].
    pub fn read(message: &Message<'_>) -> Result<Option<Self>, ValueError> {
        let mut reader = Reader::any(message);
        if is_unset(message) {
            return Ok(None);
        }
        let posture = Self::next(&mut reader)?;
        reader.end()?;
        Ok(Some(posture))
    }
}

/// Stars, or nothing at all.
fn is_unset(message: &Message<'_>) -> bool {
    message.body.split(',').all(|value| matches!(value.trim(), "*" | ""))
}

impl Stamped<Posture> {
    /// A time and a posture (2208, 2218).
    ///
    /// # Errors
    ///
    /// [`ValueError`].
    pub fn posture(message: &Message<'_>) -> Result<Self, ValueError> {
        let mut reader = Reader::any(message);
        let timestamp_us = reader.integer()?;
        let value = Posture::next(&mut reader)?;
        reader.end()?;
        Ok(Self { timestamp_us, value })
    }
}

/// The turn of joint 6, from -100 to 100: its angle lies between -180 and 180 degrees around as many
/// whole turns. Source: PM L178.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ConfTurn(pub i16);

impl ConfTurn {
    /// Answer to GetConfTurn (2036): `None` while the robot chooses it, which it writes as a star.
    ///
    /// # Errors
    ///
    /// [`ValueError`].
    pub fn read(message: &Message<'_>) -> Result<Option<Self>, ValueError> {
        if is_unset(message) {
            return Ok(None);
        }
        super::integer(message).map(Self).map(Some)
    }
}

impl Stamped<ConfTurn> {
    /// A time and a turn (2209, 2219).
    ///
    /// # Errors
    ///
    /// [`ValueError`].
    pub fn turn(message: &Message<'_>) -> Result<Self, ValueError> {
        let mut reader = Reader::any(message);
        let (timestamp_us, turn) = (reader.integer()?, reader.integer()?);
        reader.end()?;
        Ok(Self { timestamp_us, value: ConfTurn(turn) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(line: &str) -> Message<'_> {
        Message::parse(line).unwrap()
    }

    #[test]
    fn postures_and_turns_may_be_left_to_the_robot() {
        let posture = Posture { c_s: 1, c_e: -1, c_w: 1 };
        assert_eq!(Posture::read(&message("[2029][1,-1,1]")), Ok(Some(posture)));
        assert_eq!(Posture::read(&message("[2029][*,*,*]")), Ok(None));
        assert_eq!(ConfTurn::read(&message("[2036][*]")), Ok(None));
        assert_eq!(ConfTurn::read(&message("[2036][-3]")), Ok(Some(ConfTurn(-3))));
        let stamped = Stamped::posture(&message("[2218][7,1,-1,1]")).unwrap();
        assert_eq!((stamped.timestamp_us, stamped.value), (7, posture));
        assert_eq!(Stamped::turn(&message("[2219][7,2]")).unwrap().value, ConfTurn(2));
        assert!(Posture::read(&message("[2029][1,-1]")).is_err());
        assert!(Posture::read(&message("[2029][1,*,1]")).is_err());
    }
}
