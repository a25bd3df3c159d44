//! Variables as the robot tells them.

use super::{Reader, ValueError};
use crate::wire::meca500::code::Code;
use crate::wire::meca500::text::message::{Message, MessageValue};

/// One variable: answers 2551 (asked for), 2552 (created) and 2554 (set). Source: PM L6866, L6948, L7003.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VariableMessage<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its value.
    pub value: MessageValue<'a>,
    /// Its number on cyclic buses, 10000 to 19999; `None` where it has none, or where the message does
    /// not tell.
    pub cyclic_id: Option<u16>,
}

impl<'a> VariableMessage<'a> {
    /// Reads answers 2551, 2552 and 2554.
    ///
    /// # Errors
    ///
    /// [`ValueError`].
    pub fn read(message: &Message<'a>) -> Result<Self, ValueError> {
        let [told, created, set] = [Code(2551), Code(2552), Code(2554)];
        let mut reader = Reader::of(message, &[told, created, set])?;
        let (name, value) = (reader.text()?, reader.value()?);
        let mut cyclic_id = None;
        if message.code != set {
            cyclic_id = Some(reader.integer()?).filter(|id| *id != 0);
        }
        if message.code == created {
            let _overrides = reader.flag()?;
        }
        reader.end()?;
        Ok(Self { name, value, cyclic_id })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(line: &str) -> Result<VariableMessage<'_>, ValueError> {
        VariableMessage::read(&Message::parse(line).unwrap())
    }

    #[test]
    fn the_three_answers_have_the_same_beginning() {
        let told = read("[2551][tour.home,[10,0,-5.5],10001]").unwrap();
        assert_eq!((told.name, told.cyclic_id), ("tour.home", Some(10_001)));
        let MessageValue::List(values) = told.value else { panic!("{:?}", told.value) };
        assert!(values.map(|value| value.number().unwrap()).eq([10.0, 0.0, -5.5]));
        let created = read("[2552][7,\"a, b\",0,1]").unwrap();
        assert_eq!((created.name, created.cyclic_id), ("7", None));
        assert_eq!(created.value, MessageValue::Text("a, b"));
        assert_eq!(read("[2554][on,true]").unwrap().value, MessageValue::Truth(true));
    }

    #[test]
    fn what_is_missing_or_too_much_is_an_error() {
        for line in
            ["[2551][x,1]", "[2551][x]", "[2551][]", "[2554][x,1,0]", "[2552][x,1,0]", "[2553][x]"]
        {
            assert!(read(line).is_err(), "{line}");
        }
    }
}
