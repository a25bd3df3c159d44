//! The robot's commands as methods of [`Client`]: typed arguments in, typed answers out.
//!
//! Read `lifecycle.rs` and `waits.rs` first. Every method has the manual's name of its command, sends it at
//! once and returns an [`Answer`], which is waited for with a limit or awaited:
//!
//! ```no_run
//! # use fieldarm::link::text::{Client, ClientOptions};
//! # use std::time::Duration;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let client = Client::connect("192.168.0.100:10000".parse()?, ClientOptions::default())?;
//! let limit = Duration::from_secs(10);
//! client.activate_robot()?.wait(limit)?;
//! client.home()?.wait(limit)?;
//! client.send_all("MoveJoints(0, 10, -10, 0, 20, 0)\nMoveJoints(0, 0, 0, 0, 0, 0)")?;
//! client.until_idle()?.wait(limit)?;
//! println!("{:?}", client.get_rt_joint_pos()?.wait(limit)?.value);
//! # Ok(())
//! # }
//! ```
//!
//! Which codes answer a command is in the table of answers of
//! [`wire::meca500::text`](crate::wire::meca500::text), how their values are read in its
//! [`value`](crate::wire::meca500::text::value). Motion commands are sent with
//! [`send_motion`](Client::send_motion).
//!
//! Left out, because the robot has no text command for it: brakes (cyclic buses only), and listing, loading
//! or deleting stored programs (its web interface only).

mod identity;
mod lifecycle;
mod monitoring;
mod motion;
mod positions;
mod programs;
mod settings;
mod status;
mod variables;
mod waits;

use std::format;
use std::string::{String, ToString};

use super::answer::{Answer, ReadMessage};
use super::client::Client;
use super::error::AnswerError;
use crate::wire::meca500::text::RobotNumber;

pub use lifecycle::Simulation;
pub use variables::{NewVariable, Variable, VariableValue};
pub use waits::{Idle, StatusWait};

impl Client {
    /// Sends a command of which the answer's message is read.
    fn ask<T>(&self, line: &str, read: ReadMessage<T>) -> Result<Answer<T>, AnswerError> {
        Ok(self.send(line)?.read_by(read))
    }

    /// Sends a command of which only counts that it is answered.
    fn order(&self, line: &str) -> Result<Answer<()>, AnswerError> {
        Ok(self.send(line)?.done())
    }
}

/// Requests without arguments: method, command, value, how it is read.
macro_rules! requests {
    ($($(#[$doc:meta])* $method:ident, $command:literal, $value:ty, $read:expr;)*) => {
        impl Client {
            $(
                $(#[$doc])*
                ///
                /// # Errors
                ///
                /// As [`send`](Client::send).
                pub fn $method(&self) -> Result<Answer<$value>, AnswerError> {
                    self.ask($command, $read)
                }
            )*
        }
    };
}
use requests;

/// 1 or 0.
const fn digit(on: bool) -> u8 {
    if on { 1 } else { 0 }
}

/// A number as an argument.
fn number(argument: &'static str, number: f64) -> Result<RobotNumber, AnswerError> {
    if number.is_finite() {
        return Ok(RobotNumber(number));
    }
    let value = format!("{number}");
    Err(AnswerError::Argument { argument, value, allowed: "it must be finite" })
}

/// A name as an argument: one word that the robot reads as one.
fn name<'a>(argument: &'static str, name: &'a str) -> Result<&'a str, AnswerError> {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"._-".contains(&byte);
    if !name.is_empty() && name.bytes().all(is_plain) {
        return Ok(name);
    }
    let allowed = "it must have letters, digits, `_`, `-` and `.` only";
    Err(AnswerError::Argument { argument, value: name.to_string(), allowed })
}

/// A text as an argument, with quotation marks around it.
fn quoted(argument: &'static str, text: &str) -> Result<String, AnswerError> {
    let fits = |byte: u8| matches!(byte, b' '..=b'~') && !b"\"\\".contains(&byte);
    if text.bytes().all(fits) {
        return Ok(format!("\"{text}\""));
    }
    let allowed = "it must be printable ASCII without quotation marks and backslashes";
    Err(AnswerError::Argument { argument, value: text.to_string(), allowed })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_robot_would_read_otherwise_is_not_sent() {
        assert_eq!(name("name", "tour.home-2"), Ok("tour.home-2"));
        for bad in ["", "a,b", "a b", "a)", "\"a\"", "ä", "a\0b"] {
            assert!(name("name", bad).is_err(), "{bad:?}");
        }
        assert_eq!(quoted("s", "cell 4, left").unwrap(), "\"cell 4, left\"");
        assert!(quoted("s", "a\"b").is_err());
        assert!(number("t", f64::NAN).is_err());
        let infinite = number("t", f64::INFINITY).unwrap_err().to_string();
        assert_eq!(infinite, "not sent: t cannot be `inf`; it must be finite");
    }
}
