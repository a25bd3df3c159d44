//! The robot's text commands: one a line, as programs and TCP clients write them.
//!
//! Read [`TEXT_COMMANDS`] first: one row for each command, with its arguments and with what stands
//! for it in the cyclic image ([`CyclicEquivalent`]). [`parse_line`] reads a line against that table;
//! [`Statement::parse`] goes on to what a program may do over a cyclic bus.
//!
//! ```text
//! line --parse_line--> ParsedCommand --Statement::parse--> Statement --> MotionCommand, actions
//!         |                                  |
//!    SyntaxError                        ProgramError      (both with a column)
//! ```
//!
//! The language, as far as the manual tells: `Name(argument, argument)`; parentheses may be left out
//! where there are no arguments; a dash before the name keeps the command out of the robot's log.
//! `//` and `#` begin a comment, which is a habit of program files and nothing the robot reads.
//! Names are compared exactly; whether the robot minds their case is not stated.
//!
//! Invariants: no line makes the parser panic; a number that passed is finite and in the range of
//! [`COMMANDS`](super::command::COMMANDS); an error's column is that of the offending text.
//!
//! The other direction is a [`Message`], `[code][values]`: an answer, or news that nobody asked for; [`value`]
//! reads what it says.
//! What the codes mean is in [`code`](super::code).

mod accessory;
mod answers;
mod control;
mod data;
mod error;
mod format;
mod message;
mod motion;
mod names;
mod parse;
mod program;
mod quotes;
mod real_time;
mod spec;
pub mod value;
mod variable;
mod work_zone;

pub use answers::AllowedState;
pub use error::{SyntaxError, SyntaxErrorReason, error_code};
pub use format::CommandText;
pub use message::{
    Message, MessageError, MessageValue, MessageValues, MessageWriter, RobotNumber, write_message,
};
pub use parse::{
    Argument, Arguments, ParsedCommand, Value, parse_command, parse_line, without_comment,
};
pub use program::{ProgramError, ProgramErrorReason, Statement};
pub use quotes::Elements;
pub use spec::{
    Category, CyclicEquivalent, InputSection, MotionControlBit, RobotControlBit, TEXT_COMMANDS,
    TextArgumentKind, TextArgumentSpec, TextCommandSpec, Timing,
};
