//! Value after value of one message, each with its place for who has to complain.

use super::ValueError;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::text::message::{Message, MessageValue};
use crate::wire::meca500::text::quotes::Elements;

/// The values of a message that are still to be read.
pub(super) struct Reader<'a> {
    code: Code,
    rest: Elements<'a>,
    /// Values that were read.
    count: usize,
}

impl<'a> Reader<'a> {
    /// Of a message whose code somebody else has looked at.
    pub(super) fn any(message: &Message<'a>) -> Self {
        Self { code: message.code, rest: Elements::of(message.body), count: 0 }
    }

    /// Of a message with one of these codes.
    pub(super) fn of(message: &Message<'a>, codes: &[Code]) -> Result<Self, ValueError> {
        if !codes.contains(&message.code) {
            return Err(ValueError::OtherCode { code: message.code });
        }
        Ok(Self::any(message))
    }

    fn unfit(&self, expected: &'static str) -> ValueError {
        ValueError::Unfit { code: self.code, position: self.count, expected }
    }

    /// The next value as it is written.
    pub(super) fn text(&mut self) -> Result<&'a str, ValueError> {
        self.count += 1;
        let missing = ValueError::Missing { code: self.code, position: self.count };
        self.rest.next().filter(|text| !text.is_empty()).ok_or(missing)
    }

    pub(super) fn value(&mut self) -> Result<MessageValue<'a>, ValueError> {
        self.text().map(MessageValue::read)
    }

    pub(super) fn number(&mut self) -> Result<f64, ValueError> {
        self.value()?.number().ok_or_else(|| self.unfit("a number"))
    }

    pub(super) fn numbers<const N: usize>(&mut self) -> Result<[f64; N], ValueError> {
        let mut numbers = [0.0; N];
        for slot in &mut numbers {
            *slot = self.number()?;
        }
        Ok(numbers)
    }

    /// An integer, with or without a decimal point.
    pub(super) fn integer<T: TryFrom<i64>>(&mut self) -> Result<T, ValueError> {
        let integer = match self.value()? {
            MessageValue::Integer(integer) => Some(integer),
            // Saturates, and is another number then.
            MessageValue::Real(number) if (number as i64) as f64 == number => Some(number as i64),
            _ => None,
        };
        let integer = integer.ok_or_else(|| self.unfit("an integer"))?;
        T::try_from(integer).map_err(|_| self.unfit("an integer in its range"))
    }

    pub(super) fn flag(&mut self) -> Result<bool, ValueError> {
        match self.integer::<i64>() {
            Ok(0) => Ok(false),
            Ok(1) => Ok(true),
            Ok(_) => Err(self.unfit("0 or 1")),
            Err(missing @ ValueError::Missing { .. }) => Err(missing),
            Err(_) => Err(self.unfit("0 or 1")),
        }
    }

    pub(super) fn is_at_end(&self) -> bool {
        self.rest.clone().next().is_none()
    }

    /// Nothing may follow.
    pub(super) fn end(self) -> Result<(), ValueError> {
        if self.is_at_end() {
            return Ok(());
        }
        Err(ValueError::Excess { code: self.code, count: self.count })
    }
}
