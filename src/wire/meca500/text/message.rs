//! What the robot says over TCP: `[code][text]` or `[code][value,value,...]`.
//!
//! Read [`Message::parse`] and [`MessageWriter`] first; they are each other's inverse. Messages stand
//! here without their terminator, a NUL or an end of line. Source: PM L406, L478.
//!
//! Invariants: a code has four digits; no message makes the parser panic; what is written holds
//! neither a terminator nor a blank beside a comma (PM L858).

use core::fmt::{self, Write};

use super::quotes::{Elements, inside_brackets, unquoted};
use crate::wire::meca500::code::Code;

/// One message of the robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Message<'a> {
    /// What it tells; the only part to rely on where a text follows. Source: PM L480.
    pub code: Code,
    /// What stands in the second pair of brackets: a text, or values with commas between them.
    pub body: &'a str,
}

/// A line that is no message of the robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MessageError {
    /// It does not begin with a code.
    #[error("a message begins with a code of four digits in brackets, as in `[2007]`")]
    NoCode,
    /// Nothing in brackets follows the code.
    #[error("code {0} is not followed by a text or values in brackets", .code.0)]
    NoBody {
        /// The code.
        code: Code,
    },
    /// The second bracket is not closed, or something follows it.
    #[error("the message of code {0} does not end with `]`", .code.0)]
    NoEnd {
        /// The code.
        code: Code,
    },
}

impl<'a> Message<'a> {
    /// Reads one message, without its terminator. Blanks around it and between its two parts do not
    /// matter: the manual prints some.
    ///
    /// # Errors
    ///
    /// The line is not of the form `[4 digits][...]`.
    pub fn parse(line: &'a str) -> Result<Self, MessageError> {
        let (code, rest) = code_of(line.trim()).ok_or(MessageError::NoCode)?;
        let body = rest.trim_start().strip_prefix('[').ok_or(MessageError::NoBody { code })?;
        let body = body.strip_suffix(']').ok_or(MessageError::NoEnd { code })?;
        Ok(Self { code, body })
    }

    /// Its values, in order. A text is a message of values too, of little use to anybody.
    #[must_use]
    pub fn values(&self) -> MessageValues<'a> {
        MessageValues { elements: Elements::of(self.body) }
    }

    /// All its values as numbers; `None` when there are more or fewer than `N`, or one is none.
    #[must_use]
    pub fn numbers<const N: usize>(&self) -> Option<[f64; N]> {
        let mut numbers = [0.0; N];
        let mut values = self.values();
        for slot in &mut numbers {
            *slot = values.next()?.number()?;
        }
        values.next().is_none().then_some(numbers)
    }

    /// The only value as a number, as most settings are answered.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        self.numbers::<1>().map(|[number]| number)
    }

    /// The command that an error quotes: `... - Command: 'MoveJoints(0)'`. Source: PM Table 1.
    #[must_use]
    pub fn quoted_command(&self) -> Option<&'a str> {
        let (_, command) = self.body.split_once("Command: '")?;
        command.trim_end().strip_suffix('\'')
    }
}

impl fmt::Display for Message<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_code(f, self.code)?;
        f.write_str(self.body)?;
        f.write_char(']')
    }
}

/// Up to the bracket that opens the body.
fn write_code<W: Write + ?Sized>(into: &mut W, code: Code) -> fmt::Result {
    write!(into, "[{:04}]", code.0)?;
    into.write_char('[')
}

fn code_of(text: &str) -> Option<(Code, &str)> {
    let (digits, rest) = text.strip_prefix('[')?.split_once(']')?;
    let is_code = digits.len() == 4 && digits.bytes().all(|byte| byte.is_ascii_digit());
    is_code.then(|| digits.parse().ok()).flatten().map(|code| (Code(code), rest))
}

/// One value of a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MessageValue<'a> {
    /// A number without a decimal point: a state, a count, a time stamp in us.
    Integer(i64),
    /// A number with one, or one too large for an integer.
    Real(f64),
    /// `true` or `false`, in the value of a variable.
    Truth(bool),
    /// Values in brackets of their own, in the value of a variable.
    List(MessageValues<'a>),
    /// Anything else, without its quotation marks; backslashes inside are still there.
    Text(&'a str),
}

impl<'a> MessageValue<'a> {
    pub(super) fn read(text: &'a str) -> Self {
        if let Some(list) = inside_brackets(text) {
            return Self::List(MessageValues { elements: Elements::of(list) });
        }
        let is_number = |byte: u8| byte.is_ascii_digit() || b"+-.eE".contains(&byte);
        if !text.is_empty() && text.bytes().all(is_number) {
            if let Ok(integer) = text.parse() {
                return Self::Integer(integer);
            }
            if let Ok(number) = text.parse::<f64>()
                && number.is_finite()
            {
                return Self::Real(number);
            }
        }
        match text {
            "true" => Self::Truth(true),
            "false" => Self::Truth(false),
            _ => Self::Text(unquoted(text)),
        }
    }

    /// The number, if it is one. Integers beyond 2^53 are rounded.
    #[must_use]
    pub const fn number(&self) -> Option<f64> {
        match *self {
            Self::Integer(integer) => Some(integer as f64),
            Self::Real(number) => Some(number),
            Self::Truth(_) | Self::List(_) | Self::Text(_) => None,
        }
    }

    /// The integer, if it is one.
    #[must_use]
    pub const fn integer(&self) -> Option<i64> {
        match *self {
            Self::Integer(integer) => Some(integer),
            _ => None,
        }
    }
}

/// The values of a [`Message`] or of a list in one, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MessageValues<'a> {
    elements: Elements<'a>,
}

impl<'a> Iterator for MessageValues<'a> {
    type Item = MessageValue<'a>;

    fn next(&mut self) -> Option<MessageValue<'a>> {
        self.elements.next().map(MessageValue::read)
    }
}

/// A number as the robot writes it: at most nine decimal places, none that are zero at the end, no
/// exponent, and no minus before a zero.
///
/// Source: PM L482 for the nine places; choice for the rest. The two older messages 2026 and 2027 have
/// four places always (PM L860): [`MessageWriter::four_places`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotNumber(pub f64);

impl fmt::Display for RobotNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // What would round to a zero with a sign.
        if self.0 > -0.5e-9 && self.0 < 0.5e-9 {
            return f.write_str("0");
        }
        let mut shortened =
            WithoutLastZeros { into: f, zeros: 0, is_fraction: false, holds_point: false };
        write!(shortened, "{:.9}", self.0)
    }
}

/// Holds back the point and the zeros behind it until another digit follows.
struct WithoutLastZeros<'a, 'f> {
    into: &'a mut fmt::Formatter<'f>,
    /// Zeros that are held back.
    zeros: usize,
    /// Whether the point has come.
    is_fraction: bool,
    /// Whether the point is held back too.
    holds_point: bool,
}

impl Write for WithoutLastZeros<'_, '_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let fraction = if self.is_fraction {
            text
        } else {
            let Some((whole, fraction)) = text.split_once('.') else {
                return self.into.write_str(text);
            };
            self.into.write_str(whole)?;
            (self.is_fraction, self.holds_point) = (true, true);
            fraction
        };
        let kept = fraction.trim_end_matches('0');
        if !kept.is_empty() {
            if self.holds_point {
                self.into.write_char('.')?;
                self.holds_point = false;
            }
            for _ in 0..self.zeros {
                self.into.write_char('0')?;
            }
            self.zeros = 0;
            self.into.write_str(kept)?;
        }
        self.zeros += fraction.len() - kept.len();
        Ok(())
    }
}

/// Writes a message of values, one after the other.
///
/// ```
/// use fieldarm::wire::meca500::{code::Code, text::MessageWriter};
///
/// let mut line = String::new();
/// MessageWriter::begin(&mut line, Code(2211))?.integer(1500)?.number(190.0)?.number(-0.25)?.end()?;
/// assert_eq!(line, "[2211][1500,190,-0.25]");
/// # Ok::<(), core::fmt::Error>(())
/// ```
#[must_use = "without `end` the last bracket is missing"]
pub struct MessageWriter<'a, W: Write + ?Sized> {
    into: &'a mut W,
    needs_comma: bool,
}

impl<W: Write + ?Sized> fmt::Debug for MessageWriter<'_, W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MessageWriter").field("needs_comma", &self.needs_comma).finish()
    }
}

impl<'a, W: Write + ?Sized> MessageWriter<'a, W> {
    /// Writes the code and opens the values.
    ///
    /// # Errors
    ///
    /// `into` has no room; so everywhere below.
    pub fn begin(into: &'a mut W, code: Code) -> Result<Self, fmt::Error> {
        write_code(into, code)?;
        Ok(Self { into, needs_comma: false })
    }

    fn value(self, value: fmt::Arguments<'_>) -> Result<Self, fmt::Error> {
        if self.needs_comma {
            self.into.write_char(',')?;
        }
        self.into.write_fmt(value)?;
        Ok(Self { needs_comma: true, ..self })
    }

    /// An integer.
    ///
    /// # Errors
    ///
    /// No room.
    pub fn integer(self, integer: impl Into<i64>) -> Result<Self, fmt::Error> {
        let integer: i64 = integer.into();
        self.value(format_args!("{integer}"))
    }

    /// A number, as [`RobotNumber`] writes it.
    ///
    /// # Errors
    ///
    /// No room.
    pub fn number(self, number: impl Into<f64>) -> Result<Self, fmt::Error> {
        self.value(format_args!("{}", RobotNumber(number.into())))
    }

    /// Several numbers.
    ///
    /// # Errors
    ///
    /// No room.
    pub fn numbers<N: Into<f64>>(
        self,
        numbers: impl IntoIterator<Item = N>,
    ) -> Result<Self, fmt::Error> {
        numbers.into_iter().try_fold(self, Self::number)
    }

    /// A number of the messages 2026 and 2027, with four places always. Source: PM L860.
    ///
    /// # Errors
    ///
    /// No room.
    pub fn four_places(self, number: impl Into<f64>) -> Result<Self, fmt::Error> {
        let number: f64 = number.into();
        self.value(format_args!("{number:.4}"))
    }

    /// 1 or 0.
    ///
    /// # Errors
    ///
    /// No room.
    pub fn flag(self, flag: bool) -> Result<Self, fmt::Error> {
        self.integer(flag)
    }

    /// A text as it is: a name, a version, a value that already is written. Control characters, which
    /// would end the message, become blanks.
    ///
    /// # Errors
    ///
    /// No room.
    pub fn text(self, text: &str) -> Result<Self, fmt::Error> {
        self.value(format_args!("{}", Printable(text)))
    }

    /// Closes the message.
    ///
    /// # Errors
    ///
    /// No room.
    pub fn end(self) -> fmt::Result {
        self.into.write_char(']')
    }
}

/// Writes a message whose body is a text. Control characters, which would end it, become blanks.
///
/// # Errors
///
/// `into` has no room.
pub fn write_message<W: Write + ?Sized>(
    into: &mut W,
    code: Code,
    body: fmt::Arguments<'_>,
) -> fmt::Result {
    write_code(into, code)?;
    OneLine(into).write_fmt(body)?;
    into.write_char(']')
}

struct Printable<'a>(&'a str);

impl fmt::Display for Printable<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        OneLine(f).write_str(self.0)
    }
}

/// Hands on what is written, with blanks for control characters.
struct OneLine<'a, W: Write + ?Sized>(&'a mut W);

impl<W: Write + ?Sized> Write for OneLine<'_, W> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let mut pieces = text.split(|letter: char| letter.is_ascii_control());
        self.0.write_str(pieces.next().unwrap_or(""))?;
        for piece in pieces {
            self.0.write_char(' ')?;
            self.0.write_str(piece)?;
        }
        Ok(())
    }
}
