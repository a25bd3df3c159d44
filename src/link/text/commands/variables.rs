//! Variables of the robot. Source: PM L6728 to L7035.

use core::fmt::{self, Write};
use std::format;
use std::string::{String, ToString};
use std::vec::Vec;

use super::{digit, name};
use crate::link::text::answer::Answer;
use crate::link::text::client::Client;
use crate::link::text::error::AnswerError;
use crate::wire::meca500::text::value::{ValueError, VariableMessage};
use crate::wire::meca500::text::{Message, MessageValue};

/// What a variable may hold. Its type, and the length of a list, stay as they were created.
#[derive(Clone, Debug, PartialEq)]
pub enum VariableValue {
    /// `true` or `false`.
    Truth(bool),
    /// A number.
    Number(f64),
    /// A text.
    Text(String),
    /// A list.
    List(Vec<Self>),
}

impl VariableValue {
    /// A list of numbers: joints, a pose, a frame.
    #[must_use]
    pub fn numbers(numbers: &[f64]) -> Self {
        Self::List(numbers.iter().copied().map(Self::Number).collect())
    }

    /// The numbers, if it is a list of nothing else.
    #[must_use]
    pub fn as_numbers(&self) -> Option<Vec<f64>> {
        let Self::List(values) = self else { return None };
        let number = |value: &Self| match value {
            Self::Number(number) => Some(*number),
            _ => None,
        };
        values.iter().map(number).collect()
    }

    fn is_finite(&self) -> bool {
        match self {
            Self::Number(number) => number.is_finite(),
            Self::List(values) => values.iter().all(Self::is_finite),
            Self::Truth(_) | Self::Text(_) => true,
        }
    }
}

/// As JSON, in ASCII.
impl fmt::Display for VariableValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Truth(truth) => write!(f, "{truth}"),
            Self::Number(number) => write!(f, "{number}"),
            Self::Text(text) => write_text(f, text),
            Self::List(values) => {
                f.write_char('[')?;
                for (position, value) in values.iter().enumerate() {
                    f.write_str(if position > 0 { "," } else { "" })?;
                    write!(f, "{value}")?;
                }
                f.write_char(']')
            }
        }
    }
}

fn write_text(f: &mut fmt::Formatter<'_>, text: &str) -> fmt::Result {
    f.write_char('"')?;
    for letter in text.chars() {
        match letter {
            '"' | '\\' => write!(f, "\\{letter}")?,
            ' '..='~' => f.write_char(letter)?,
            _ => {
                let mut units = [0; 2];
                for unit in letter.encode_utf16(&mut units) {
                    write!(f, "\\u{unit:04x}")?;
                }
            }
        }
    }
    f.write_char('"')
}

impl From<MessageValue<'_>> for VariableValue {
    fn from(value: MessageValue<'_>) -> Self {
        match value {
            MessageValue::Truth(truth) => Self::Truth(truth),
            MessageValue::Integer(integer) => Self::Number(integer as f64),
            MessageValue::Real(number) => Self::Number(number),
            MessageValue::List(values) => Self::List(values.map(Self::from).collect()),
            MessageValue::Text(text) => Self::Text(without_escapes(text)),
        }
    }
}

/// A text of JSON without its backslashes. What is no escape stays as it is.
fn without_escapes(text: &str) -> String {
    let mut units = Vec::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('\\') {
        units.extend(before.encode_utf16());
        let (unit, length) = escape(after);
        units.push(unit);
        rest = after.get(length..).unwrap_or("");
    }
    units.extend(rest.encode_utf16());
    String::from_utf16_lossy(&units)
}

/// What the escape behind a backslash stands for, and its length.
fn escape(text: &str) -> (u16, usize) {
    let unicode = || u16::from_str_radix(text.get(1..5)?, 16).ok();
    match text.bytes().next() {
        Some(b'n') => (0x0A, 1),
        Some(b'r') => (0x0D, 1),
        Some(b't') => (0x09, 1),
        Some(b'b') => (0x08, 1),
        Some(b'f') => (0x0C, 1),
        Some(b'u') => unicode().map_or((u16::from(b'\\'), 0), |unit| (unit, 5)),
        Some(byte @ (b'"' | b'\\' | b'/')) => (byte.into(), 1),
        _ => (u16::from(b'\\'), 0),
    }
}

/// A variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Its name, with its groups before it: `tour.home`.
    pub name: String,
    /// Its value.
    pub value: VariableValue,
    /// Its number on cyclic buses, 10000 to 19999, if it has one and the robot told it.
    pub cyclic_id: Option<u16>,
}

/// How a variable is created beside its name and its value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NewVariable {
    /// Its number on cyclic buses, 10000 to 19999, of numbers and lists of numbers.
    pub cyclic_id: Option<u16>,
    /// Whether one with the same name is replaced; otherwise it must be alike in type and number, and
    /// keeps its value. Source: PM L6899.
    pub replaces: bool,
}

fn variable(message: &Message<'_>) -> Result<Variable, ValueError> {
    let VariableMessage { name, value, cyclic_id } = VariableMessage::read(message)?;
    Ok(Variable { name: name.to_string(), value: value.into(), cyclic_id })
}

fn names(message: &Message<'_>) -> Result<Vec<String>, ValueError> {
    if message.body.trim().is_empty() {
        return Ok(Vec::new());
    }
    Ok(message.body.split(',').map(|name| name.trim().to_string()).collect())
}

fn finite(value: &VariableValue) -> Result<&VariableValue, AnswerError> {
    if value.is_finite() {
        return Ok(value);
    }
    let allowed = "its numbers must be finite";
    Err(AnswerError::Argument { argument: "value", value: value.to_string(), allowed })
}

impl Client {
    /// ListVariables: the names of all.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send); so everywhere below.
    pub fn list_variables(&self) -> Result<Answer<Vec<String>>, AnswerError> {
        self.ask("ListVariables", names)
    }

    /// GetVariable.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send), and [`AnswerError::Argument`].
    pub fn get_variable(&self, variable_name: &str) -> Result<Answer<Variable>, AnswerError> {
        self.ask(&format!("GetVariable({})", name("name", variable_name)?), variable)
    }

    /// CreateVariable. Ends with the variable as it is then.
    ///
    /// # Errors
    ///
    /// As [`get_variable`](Self::get_variable).
    pub fn create_variable(
        &self,
        variable_name: &str,
        value: &VariableValue,
        new: NewVariable,
    ) -> Result<Answer<Variable>, AnswerError> {
        let line = format!(
            "CreateVariable({},{},{},{})",
            name("name", variable_name)?,
            finite(value)?,
            new.cyclic_id.unwrap_or(0),
            digit(new.replaces)
        );
        self.ask(&line, variable)
    }

    /// SetVariable: a value of the same type, a list of the same length. Ends with what is kept.
    ///
    /// # Errors
    ///
    /// As [`get_variable`](Self::get_variable).
    pub fn set_variable(
        &self,
        variable_name: &str,
        value: &VariableValue,
    ) -> Result<Answer<Variable>, AnswerError> {
        let line = format!("SetVariable({},{})", name("name", variable_name)?, finite(value)?);
        self.ask(&line, variable)
    }

    /// DeleteVariable.
    ///
    /// # Errors
    ///
    /// As [`get_variable`](Self::get_variable).
    pub fn delete_variable(&self, variable_name: &str) -> Result<Answer<()>, AnswerError> {
        self.order(&format!("DeleteVariable({})", name("name", variable_name)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    #[test]
    fn values_are_written_as_json_and_read_back() {
        let text = VariableValue::Text("a \"b\", \\ \n ü 🤖".into());
        assert_eq!(text.to_string(), r#""a \"b\", \\ \u000a \u00fc \ud83e\udd16""#);
        let values = [
            VariableValue::Truth(true),
            VariableValue::Number(-5.5),
            VariableValue::Number(1e-12),
            VariableValue::numbers(&[1.0, 2.0]),
            VariableValue::List(vec![text.clone(), VariableValue::List(Vec::new())]),
            text,
        ];
        for value in values {
            let line = format!("[2551][x,{value},0]");
            let read = variable(&Message::parse(&line).unwrap()).unwrap();
            assert_eq!(read, Variable { name: "x".into(), value, cyclic_id: None });
        }
    }

    #[test]
    fn odd_escapes_stay() {
        assert_eq!(without_escapes(r"a\qb\u12\"), r"a\qb\u12\");
        assert_eq!(without_escapes(r"\u00e4\t"), "ä\t");
    }

    #[test]
    fn names_are_parted_by_commas() {
        let read = |line: &str| names(&Message::parse(line).unwrap()).unwrap();
        assert!(read("[2550][]").is_empty());
        assert_eq!(read("[2550][a, b.c]"), ["a", "b.c"]);
    }
}
