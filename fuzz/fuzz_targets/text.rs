//! Arbitrary text as lines of a robot program: nothing panics, errors point into the line, and what
//! passed makes commands the robot takes.
#![no_main]

use fieldarm::wire::meca500::command::MotionCommand;
use fieldarm::wire::meca500::revision::Revision;
use fieldarm::wire::meca500::text::{Statement, TextCommandSpec, Value, parse_line};
use libfuzzer_sys::fuzz_target;

/// A column may stand one behind the last character: something is missing there.
fn column_is_within(line: &str, column: usize) {
    assert!((1..=line.chars().count() + 1).contains(&column), "column {column} of {line:?}");
}

fn parse(line: &str, revision: Revision) {
    match parse_line(line, revision) {
        Ok(None) => assert_eq!(Statement::parse(line, revision), Ok(None)),
        Ok(Some(parsed)) => {
            column_is_within(line, parsed.column);
            for argument in parsed.arguments() {
                column_is_within(line, argument.column);
                assert!(line[argument.offset..].starts_with(argument.text));
                if let Value::Number(number) = argument.value() {
                    assert!(number.is_finite());
                }
            }
            assert!(parsed.numbers().iter().all(|number| number.is_finite()));
        }
        Err(error) => {
            column_is_within(line, error.column);
            assert!(line.is_char_boundary(error.offset), "offset {} of {line:?}", error.offset);
            assert_eq!(line[..error.offset].chars().count() + 1, error.column);
            assert!(!error.to_string().is_empty());
            assert!(Statement::parse(line, revision).is_err());
        }
    }
    match Statement::parse(line, revision) {
        Ok(Some(Statement::Motion(command))) => {
            assert_eq!(command.check(revision), Ok(()), "{line:?}");
        }
        Ok(Some(Statement::Velocity(velocity))) => {
            assert_eq!(MotionCommand::from(velocity).check(revision), Ok(()), "{line:?}");
        }
        Ok(_) => {}
        Err(error) => {
            column_is_within(line, error.column);
            assert!(!error.to_string().is_empty());
        }
    }
}

/// Bytes that are no text name a command of the table instead, with the rest behind it: random
/// letters hardly ever make a name.
fn named(data: &[u8]) -> Option<String> {
    let (&[first, second], rest) = data.split_first_chunk()?;
    let number = usize::from(first) << 8 | usize::from(second);
    let spec = TextCommandSpec::all().nth(number % TextCommandSpec::all().count())?;
    let rest = std::str::from_utf8(rest).ok()?;
    Some(format!("{}{rest}", spec.name))
}

fuzz_target!(|data: &[u8]| {
    let text = match data.first() {
        Some(first) if !first.is_ascii() => named(data),
        _ => std::str::from_utf8(data).ok().map(str::to_owned),
    };
    let Some(text) = text else { return };
    for revision in [Revision::R3, Revision::R4] {
        // As a whole, and as a person would cut it into lines.
        parse(&text, revision);
        let whole = text.len();
        text.lines().filter(|line| line.len() != whole).for_each(|line| parse(line, revision));
    }
});
