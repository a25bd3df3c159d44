//! What is wrong with a line, and where.

use core::fmt::{self, Write};

use super::spec::TextCommandSpec;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::command::{ArgumentCount, ArgumentError};

/// A line that is not a command of the robot.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{reason}")]
pub struct SyntaxError<'a> {
    /// Column of the offending text in characters, from 1.
    pub column: usize,
    /// The same place in bytes, from 0.
    pub offset: usize,
    /// What is wrong there.
    pub reason: SyntaxErrorReason<'a>,
}

/// What is wrong with a line; [`error_code`] tells how the robot answers it.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SyntaxErrorReason<'a> {
    /// The line does not begin with a name.
    #[error("a command's name is expected here, not `{}`", Shown(.found))]
    NoName {
        /// What is there.
        found: &'a str,
    },
    /// No command has this name.
    #[error("there is no command `{}`{}{}{}", Shown(.name),
        if .suggestion.is_some() { "; did you mean `" } else { "" },
        .suggestion.unwrap_or(""),
        if .suggestion.is_some() { "`?" } else { "" })]
    UnknownCommand {
        /// The name.
        name: &'a str,
        /// The closest known one.
        suggestion: Option<&'static str>,
    },
    /// Something follows the name that is not a parenthesis.
    #[error("`(` is missing after {command}")]
    MissingOpeningParenthesis {
        /// The command.
        command: &'static str,
    },
    /// The line ends within the parentheses.
    #[error("`)` is missing at the end of {command}")]
    MissingClosingParenthesis {
        /// The command.
        command: &'static str,
    },
    /// Two arguments without a comma between them.
    #[error("a comma is missing before `{}`", Shown(.found))]
    MissingComma {
        /// The second of them.
        found: &'a str,
    },
    /// Nothing between two commas.
    #[error("an argument is missing here")]
    EmptyArgument,
    /// A quotation mark without its counterpart.
    #[error("the closing quotation mark is missing")]
    UnterminatedText,
    /// Text after the closing parenthesis.
    #[error("nothing may follow the command, but `{}` does", Shown(.found))]
    TrailingText {
        /// The text.
        found: &'a str,
    },
    /// Too few or too many arguments.
    #[error("{command} takes {expected}, not {given}")]
    ArgumentCount {
        /// The command.
        command: &'static str,
        /// How many it takes.
        expected: ArgumentCount,
        /// How many there are.
        given: usize,
    },
    /// An argument that must be a number and is not.
    #[error("{command}: {argument} must be a number, not `{}`", Shown(.found))]
    NotANumber {
        /// The command.
        command: &'static str,
        /// The argument.
        argument: &'static str,
        /// What is there.
        found: &'a str,
    },
    /// A number beyond what a Real can hold. Its value as a Real, infinite or zero, is nothing that
    /// anybody wrote.
    #[error("{command}: {argument}: {} is too {} for a 32-bit Real", Shown(.found),
        if *.is_large { "large" } else { "small" })]
    NotAReal {
        /// The command.
        command: &'static str,
        /// The argument.
        argument: &'static str,
        /// What is there.
        found: &'a str,
        /// Whether it is too large; too close to zero otherwise.
        is_large: bool,
    },
    /// A number out of its range.
    #[error(transparent)]
    OutOfRange(#[from] ArgumentError),
    /// A large integer out of its range, or not an integer.
    #[error("{command}: {argument} = {}, allowed: an integer from {min} to {max}", Shown(.found))]
    WholeOutOfRange {
        /// The command.
        command: &'static str,
        /// The argument.
        argument: &'static str,
        /// What is there.
        found: &'a str,
        /// Lowest value.
        min: u32,
        /// Highest value.
        max: u32,
    },
    /// A text that is too long.
    #[error("{command}: {argument} may have {max_chars} characters at most")]
    TextTooLong {
        /// The command.
        command: &'static str,
        /// The argument.
        argument: &'static str,
        /// Most characters.
        max_chars: u16,
    },
}

/// The error that the robot reports for a line: 1001 for a name that is no command's, 1002 for a
/// symbol that is missing or too much, 1003 for the number of arguments and for what is wrong with
/// one. An argument that is missing between two commas counts as an argument, not as a symbol.
/// Source: PM Table 1; the last sentence: choice.
#[must_use]
pub const fn error_code(error: &SyntaxError<'_>) -> Code {
    use SyntaxErrorReason as Reason;
    match error.reason {
        Reason::NoName { .. } | Reason::UnknownCommand { .. } => Code::UNKNOWN_COMMAND,
        Reason::MissingOpeningParenthesis { .. }
        | Reason::MissingClosingParenthesis { .. }
        | Reason::MissingComma { .. }
        | Reason::UnterminatedText
        | Reason::TrailingText { .. } => Code::SYNTAX_ERROR,
        Reason::EmptyArgument
        | Reason::ArgumentCount { .. }
        | Reason::NotANumber { .. }
        | Reason::NotAReal { .. }
        | Reason::OutOfRange(_)
        | Reason::WholeOutOfRange { .. }
        | Reason::TextTooLong { .. } => Code::ARGUMENT_ERROR,
    }
}

impl<'a> SyntaxErrorReason<'a> {
    /// The error at a byte offset of a line.
    pub(super) fn at(self, line: &str, offset: usize) -> SyntaxError<'a> {
        SyntaxError { column: column_of(line, offset), offset, reason: self }
    }

    /// A wrong number of arguments.
    pub(super) fn count(spec: &TextCommandSpec, expected: ArgumentCount, given: usize) -> Self {
        Self::ArgumentCount { command: spec.name, expected, given }
    }
}

/// A piece of a line in a message: what cannot be seen is escaped, and what is long is cut.
pub(super) struct Shown<'a>(pub(super) &'a str);

/// Characters of a line that a message shows at most.
const SHOWN_CHARS: usize = 40;

impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut letters = self.0.chars();
        for letter in letters.by_ref().take(SHOWN_CHARS) {
            match letter {
                // These are seen as they are, and a backslash before them would be misread.
                '"' | '\'' | '\\' => f.write_char(letter)?,
                _ => letter.escape_debug().try_for_each(|shown| f.write_char(shown))?,
            }
        }
        if letters.next().is_some() { f.write_str("...") } else { Ok(()) }
    }
}

/// Column of a byte offset in characters, from 1.
pub(super) fn column_of(line: &str, offset: usize) -> usize {
    line.char_indices().take_while(|(start, _)| *start < offset).count() + 1
}
