//! One line of text to one checked command.
//!
//! The parser keeps nothing but borrowed pieces of the line, so it needs no memory of its own.

use super::error::{SyntaxError, SyntaxErrorReason as Reason};
use super::names;
use super::quotes::{Elements, Quotes, find_outside, inside_brackets, open_quote, unquoted};
use super::spec::{TextArgumentKind, TextArgumentSpec, TextCommandSpec};
use crate::wire::meca500::command::{
    Allowed, ArgumentCount, ArgumentError, MotionCommandId, ValveAction,
};
use crate::wire::meca500::revision::Revision;

/// A text command of a line, checked against the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParsedCommand<'a> {
    /// The command.
    pub spec: &'static TextCommandSpec,
    /// Whether a dash before the name asks the robot not to log it. Source: PM L439.
    pub silent: bool,
    /// Column of the name in characters, from 1.
    pub column: usize,
    line: &'a str,
    list: Piece<'a>,
    numbers: [f32; 6],
}

/// A piece of a line and where it begins, in bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Piece<'a> {
    text: &'a str,
    offset: usize,
}

/// One argument as written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Argument<'a> {
    /// Its text without surrounding blanks; quotation marks are still there.
    pub text: &'a str,
    /// Where it begins in the line, in bytes from 0.
    pub offset: usize,
    /// Where it begins in the line, in characters from 1.
    pub column: usize,
}

/// What an argument looks like, before anybody asks what it should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value<'a> {
    /// A finite number.
    Number(f32),
    /// `*`: keep what there is.
    Keep,
    /// `vars.name` or `*vars.name`: a robot variable, known over TCP only. Source: PM L6749.
    Variable {
        /// The variable's name after `vars.`.
        name: &'a str,
        /// Whether `*` spreads an array over several arguments.
        unrolled: bool,
    },
    /// An array, in brackets; its elements.
    List(Elements<'a>),
    /// Anything else, without its quotation marks.
    Text(&'a str),
}

impl<'a> Argument<'a> {
    /// What the argument looks like.
    #[must_use]
    pub fn value(&self) -> Value<'a> {
        if self.text == "*" {
            return Value::Keep;
        }
        if let Some(name) = self.text.strip_prefix("*vars.") {
            return Value::Variable { name, unrolled: true };
        }
        if let Some(name) = self.text.strip_prefix("vars.") {
            return Value::Variable { name, unrolled: false };
        }
        if let Some(list) = inside_brackets(self.text) {
            return Value::List(Elements::of(list));
        }
        match real(self.text) {
            Some(number) if number.is_finite() => Value::Number(number),
            _ => Value::Text(unquoted(self.text)),
        }
    }
}

/// A decimal number as a Real; the words that Rust reads as numbers are none here. A number too
/// large becomes infinite.
fn real(text: &str) -> Option<f32> {
    let plain =
        |byte: u8| byte.is_ascii_digit() || matches!(byte, b'+' | b'-' | b'.' | b'e' | b'E');
    if text.bytes().all(plain) { text.parse().ok() } else { None }
}

/// Whether a number other than zero became zero because a Real holds none so small.
fn is_lost_in_zero(text: &str, value: f32) -> bool {
    let digits = text.split(['e', 'E']).next().unwrap_or(text);
    value == 0.0 && digits.bytes().any(|byte| matches!(byte, b'1'..=b'9'))
}

/// The arguments of a [`ParsedCommand`] in order.
#[derive(Clone, Debug)]
pub struct Arguments<'a> {
    line: &'a str,
    rest: Option<Piece<'a>>,
    /// Where the columns are counted up to, in bytes and in characters, so that a long line is
    /// counted once and not again for every argument.
    counted: (usize, usize),
}

impl<'a> Iterator for Arguments<'a> {
    type Item = Argument<'a>;

    fn next(&mut self) -> Option<Self::Item> {
        let piece = self.rest?;
        let end = find_outside(piece.text, |byte| byte == b',').unwrap_or(piece.text.len());
        let (text, after) = piece.text.split_at_checked(end)?;
        self.rest =
            after.strip_prefix(',').map(|text| Piece { text, offset: piece.offset + end + 1 });
        let trimmed = trim(Piece { text, offset: piece.offset });
        let (offset, characters) = self.counted;
        let passed = self.line.get(offset..trimmed.offset).unwrap_or("").chars().count();
        self.counted = (trimmed.offset, characters + passed);
        let column = characters + passed + 1;
        Some(Argument { text: trimmed.text, offset: trimmed.offset, column })
    }
}

impl<'a> ParsedCommand<'a> {
    /// The arguments as written, in order.
    #[must_use]
    pub fn arguments(&self) -> Arguments<'a> {
        let is_empty = self.list.text.trim().is_empty();
        Arguments { line: self.line, rest: (!is_empty).then_some(self.list), counted: (0, 0) }
    }

    /// The first six arguments as numbers, 0 where an argument is none or is left out. `*` in
    /// SetValveState is -1.
    #[must_use]
    pub const fn numbers(&self) -> [f32; 6] {
        self.numbers
    }

    /// The first argument that names a robot variable, if any does. Counts and ranges of such a
    /// command are unknown and were not checked.
    #[must_use]
    pub fn variable(&self) -> Option<Argument<'a>> {
        self.variables().next()
    }

    /// The arguments that name robot variables, in order. A robot puts their values where the names
    /// stand, at [`Argument::offset`], and reads the line again.
    pub fn variables(&self) -> impl Iterator<Item = Argument<'a>> + use<'a> {
        let is_variable =
            |argument: &Argument<'a>| matches!(argument.value(), Value::Variable { .. });
        self.arguments().filter(is_variable)
    }
}

fn trim(piece: Piece<'_>) -> Piece<'_> {
    let without_front = piece.text.trim_start();
    let offset = piece.offset + (piece.text.len() - without_front.len());
    Piece { text: without_front.trim_end(), offset }
}

/// The line up to its comment: `//` or `#` outside quotation marks. A robot knows no comments.
#[must_use]
pub fn without_comment(line: &str) -> &str {
    let mut quotes = Quotes::of_line();
    let mut previous = 0;
    for (position, byte) in line.bytes().enumerate() {
        let is_quoted = quotes.hold(position, byte);
        if !is_quoted && byte == b'#' {
            return line.get(..position).unwrap_or(line);
        }
        if !is_quoted && byte == b'/' && previous == b'/' {
            return line.get(..position.saturating_sub(1)).unwrap_or(line);
        }
        previous = if is_quoted { 0 } else { byte };
    }
    line
}

/// The first word, for a message.
fn first_word(text: &str) -> &str {
    text.split_whitespace().next().unwrap_or(text)
}

/// Reads one line for a robot of this revision: `None` for a blank line or a mere comment.
///
/// A number of a motion command must be in the range of
/// [`COMMANDS`](crate::wire::meca500::command::COMMANDS), so that a line that passes makes a
/// [`MotionCommand`](crate::wire::meca500::command::MotionCommand). Commands the Meca500 lacks are
/// read without a look at their arguments, which this crate does not know. Source: PM L406, L1931.
///
/// # Errors
///
/// The first thing that is wrong with the line, with its column.
pub fn parse_line(
    line: &str,
    revision: Revision,
) -> Result<Option<ParsedCommand<'_>>, SyntaxError<'_>> {
    parse(line, without_comment(line), revision)
}

/// Reads one command as it comes over TCP: as [`parse_line`], but without comments, which the robot
/// does not know. `None` for nothing but blanks. Source: PM L406.
///
/// # Errors
///
/// The first thing that is wrong with it; [`error_code`](super::error_code) has the robot's answer.
pub fn parse_command(
    line: &str,
    revision: Revision,
) -> Result<Option<ParsedCommand<'_>>, SyntaxError<'_>> {
    parse(line, line, revision)
}

fn parse<'a>(
    line: &'a str,
    without_comment: &'a str,
    revision: Revision,
) -> Result<Option<ParsedCommand<'a>>, SyntaxError<'a>> {
    let whole = trim(Piece { text: without_comment, offset: 0 });
    if whole.text.is_empty() {
        return Ok(None);
    }
    let (silent, body) = match whole.text.strip_prefix('-') {
        Some(text) => (true, trim(Piece { text, offset: whole.offset + 1 })),
        None => (false, whole),
    };
    if !body.text.starts_with(char::is_alphabetic) {
        return Err(Reason::NoName { found: first_word(body.text) }.at(line, body.offset));
    }
    let is_name = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
    let name = body.text.split(|letter| !is_name(letter)).next().unwrap_or("");
    let Some(spec) = TextCommandSpec::by_name(name) else {
        // The whole word, with what no name may have: that may be the mistake.
        let name = first_word(body.text).split(['(', ')', ',']).next().unwrap_or(name);
        let suggestion = names::closest(name);
        return Err(Reason::UnknownCommand { name, suggestion }.at(line, body.offset));
    };
    let after_name = body.text.strip_prefix(name).unwrap_or("");
    let tail = trim(Piece { text: after_name, offset: body.offset + name.len() });
    let list = argument_list(line, spec, tail)?;
    let column = super::error::column_of(line, body.offset);
    let mut parsed = ParsedCommand { spec, silent, column, line, list, numbers: [0.0; 6] };
    if spec.available != Some(false) {
        parsed.check(line, tail, revision)?;
    }
    Ok(Some(parsed))
}

/// What stands between the parentheses; nothing where there are none.
fn argument_list<'a>(
    line: &'a str,
    spec: &TextCommandSpec,
    tail: Piece<'a>,
) -> Result<Piece<'a>, SyntaxError<'a>> {
    let command = spec.name;
    if tail.text.is_empty() {
        return Ok(tail);
    }
    let Some(inner) = tail.text.strip_prefix('(') else {
        return Err(Reason::MissingOpeningParenthesis { command }.at(line, tail.offset));
    };
    let offset = tail.offset + 1;
    let Some(end) = find_outside(inner, |byte| byte == b')') else {
        return Err(match open_quote(inner) {
            Some(position) => Reason::UnterminatedText.at(line, offset + position),
            None => Reason::MissingClosingParenthesis { command }.at(line, offset + inner.len()),
        });
    };
    let (list, after) = inner.split_at_checked(end).unwrap_or((inner, ""));
    let after = after.strip_prefix(')').unwrap_or("");
    let rest = trim(Piece { text: after, offset: offset + end + 1 });
    if !rest.text.is_empty() {
        return Err(Reason::TrailingText { found: rest.text }.at(line, rest.offset));
    }
    Ok(Piece { text: list, offset })
}

impl<'a> ParsedCommand<'a> {
    fn check(
        &mut self,
        line: &'a str,
        tail: Piece<'a>,
        revision: Revision,
    ) -> Result<(), SyntaxError<'a>> {
        let takes_numbers = self.spec.arguments().all(|argument| argument.kind.is_number());
        for argument in self.arguments() {
            if argument.text.is_empty() {
                return Err(Reason::EmptyArgument.at(line, argument.offset));
            }
            if let (true, Some(found)) = (takes_numbers, second_word(argument)) {
                return Err(Reason::MissingComma { found: found.text }.at(line, found.offset));
            }
        }
        if takes_numbers && self.variable().is_some() {
            return Ok(());
        }
        self.check_count(line, tail)?;
        let mut numbers = [0.0; 6];
        let mut slots = numbers.iter_mut();
        for (position, (declared, argument)) in
            self.spec.arguments().zip(self.arguments()).enumerate()
        {
            let number = check_argument(self.spec, declared, position, argument, revision)
                .map_err(|reason| reason.at(line, argument.offset))?;
            if let (Some(slot), Some(number)) = (slots.next(), number) {
                *slot = number;
            }
        }
        self.numbers = numbers;
        self.check_together(line, revision)
    }

    fn check_count(&self, line: &'a str, tail: Piece<'a>) -> Result<(), SyntaxError<'a>> {
        let given = self.arguments().count();
        let min = self.spec.arguments().filter(|argument| !argument.optional).count();
        let max = self.spec.arguments().count();
        let is_list = self.spec.arguments().any(|argument| argument.kind == TextArgumentKind::List);
        let expected = ArgumentCount { min, max };
        if given < min {
            let closing = tail.offset + tail.text.len().saturating_sub(1);
            return Err(Reason::count(self.spec, expected, given).at(line, closing));
        }
        if given > max && !is_list {
            let extra = self.arguments().nth(max).map_or(tail.offset, |argument| argument.offset);
            return Err(Reason::count(self.spec, expected, given).at(line, extra));
        }
        Ok(())
    }

    /// What the motion command says of its arguments together.
    fn check_together(&self, line: &'a str, revision: Revision) -> Result<(), SyntaxError<'a>> {
        let Some(motion) = self.spec.motion_command() else { return Ok(()) };
        let used = self.numbers.get(..motion.arguments.len()).unwrap_or(&self.numbers);
        motion.check_values(used, revision).map_err(|error| {
            let argument = self.arguments().nth(error.position);
            Reason::OutOfRange(error).at(line, argument.map_or(0, |argument| argument.offset))
        })
    }
}

/// The second of two words that a comma should part. Texts, lists and objects may hold blanks.
fn second_word(argument: Argument<'_>) -> Option<Piece<'_>> {
    if argument.text.starts_with(['"', '\'', '[', '{']) {
        return None;
    }
    let (first, rest) = argument.text.split_once(char::is_whitespace)?;
    real(first)?;
    let start = argument.offset + first.len() + (argument.text.len() - first.len() - rest.len());
    let second = trim(Piece { text: rest, offset: start });
    Some(Piece { text: first_word(second.text), offset: second.offset })
}

/// Checks one argument; its number if it is one.
fn check_argument<'a>(
    spec: &TextCommandSpec,
    declared: TextArgumentSpec,
    position: usize,
    argument: Argument<'a>,
    revision: Revision,
) -> Result<Option<f32>, Reason<'a>> {
    let (command, name, found) = (spec.name, declared.name, argument.text);
    match declared.kind {
        TextArgumentKind::Number(range) => {
            let keeps_a_valve = found == "*"
                && spec.motion_command().is_some_and(|m| m.id == MotionCommandId::SET_VALVE_STATE);
            let value = if keeps_a_valve { Some(ValveAction::Keep.to_real()) } else { real(found) };
            let not_a_number = Reason::NotANumber { command, argument: name, found };
            let value = value.ok_or(not_a_number)?;
            if range.contains(value, revision) {
                return Ok(Some(value));
            }
            if value.is_infinite() || is_lost_in_zero(found, value) {
                let is_large = value.is_infinite();
                return Err(Reason::NotAReal { command, argument: name, found, is_large });
            }
            let unit = declared.unit;
            let allowed = Allowed::Range { range, unit, revision };
            let argument = name;
            Err(ArgumentError { command, argument, position, value, unit, allowed }.into())
        }
        TextArgumentKind::Whole { min, max } => {
            let is_number = real(found).is_some();
            match found.parse::<u32>() {
                Ok(value) if (min..=max).contains(&value) => Ok(Some(value as f32)),
                _ if is_number => {
                    Err(Reason::WholeOutOfRange { command, argument: name, found, min, max })
                }
                _ => Err(Reason::NotANumber { command, argument: name, found }),
            }
        }
        TextArgumentKind::Text { max_chars } => match max_chars {
            Some(max) if unquoted(found).chars().count() > usize::from(max) => {
                Err(Reason::TextTooLong { command, argument: name, max_chars: max })
            }
            _ => Ok(None),
        },
        TextArgumentKind::Json | TextArgumentKind::List => Ok(None),
    }
}
