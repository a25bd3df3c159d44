//! Values and texts as the robot writes them.
//!
//! Settings are written as short as their value allows, real-time values with a fixed number of
//! decimals: four in the older messages, as the manual's example has it, six in the others. No
//! blanks between values. Source: PM L482, L858-864; the six decimals are chosen.

use alloc::format;
use alloc::string::String;
use core::fmt::Write;

use crate::wire::meca500::code::Code;
use crate::wire::meca500::command::{GripperAction, MotionCommand};

/// Most decimals of a value. Source: PM L482.
const MOST_DECIMALS: usize = 9;
/// Characters of a command that an error message repeats.
const MOST_REPEATED: usize = 256;
/// Where a message's template holds the command.
const COMMAND: &str = "'...'";

/// A setting: the shortest text that reads as the same value, nine decimals at most.
pub(super) fn number(value: f32) -> String {
    let shortest = format!("{value}");
    match shortest.split_once('.') {
        Some((_, decimals)) if decimals.len() > MOST_DECIMALS => {
            let cut = format!("{value:.MOST_DECIMALS$}");
            String::from(cut.trim_end_matches('0').trim_end_matches('.'))
        }
        _ => shortest,
    }
}

/// Settings with commas between them.
pub(super) fn numbers<const N: usize>(values: [f32; N]) -> String {
    joined(values.iter().map(|value| number(*value)))
}

/// Integers with commas between them.
pub(super) fn integers<T: core::fmt::Display>(values: impl IntoIterator<Item = T>) -> String {
    joined(values)
}

/// Real-time values of the older messages.
pub(super) fn legacy(values: &[f64]) -> String {
    joined(values.iter().map(|value| format!("{value:.4}")))
}

/// Real-time values.
pub(super) fn real_time(values: &[f64]) -> String {
    joined(values.iter().map(|value| format!("{value:.6}")))
}

/// Anything with commas between.
pub(super) fn joined<T: core::fmt::Display>(values: impl IntoIterator<Item = T>) -> String {
    let mut text = String::new();
    for (index, value) in values.into_iter().enumerate() {
        let comma = if index > 0 { "," } else { "" };
        // Writing into a text cannot fail.
        let _ = write!(text, "{comma}{value}");
    }
    text
}

/// The robot's message of a code, with the command that caused it where the message has a place for
/// it and the command is known.
pub(super) fn message(code: Code, command: Option<&str>) -> String {
    let template = code.describe().map_or("", |info| info.message);
    match (template.split_once(COMMAND), command) {
        (Some((before, after)), Some(command)) => {
            let repeated: String = command.chars().take(MOST_REPEATED).collect();
            format!("{before}'{repeated}'{after}")
        }
        (Some((before, _)), None) => {
            // Neither is there anything to put into a parenthesis of values.
            let ends = [before.find(" (..."), before.rfind(" - Command")];
            let end = ends.into_iter().flatten().min().unwrap_or(before.len());
            String::from(before.get(..end).unwrap_or(before))
        }
        (None, _) => String::from(template),
    }
}

/// The answer to a command that has none of its own. Source: PM L3013.
pub(super) fn success(command: &str) -> String {
    let repeated: String = command.chars().take(MOST_REPEATED).collect();
    format!("Command successful: '{repeated}'.")
}

/// A command as a line of text.
pub(in crate::sim::meca500) fn command_line(command: &MotionCommand) -> String {
    match command {
        MotionCommand::Gripper(GripperAction::Open) => return String::from("GripperOpen()"),
        MotionCommand::Gripper(GripperAction::Close) => return String::from("GripperClose()"),
        _ => {}
    }
    let (_, arguments) = command.encode();
    let count = command.spec().map_or(0, |spec| spec.arguments.len());
    let used = arguments.get(..count).unwrap_or(&arguments);
    format!("{}({})", command.name(), joined(used.iter().map(|value| number(*value))))
}
