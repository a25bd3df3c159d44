//! A line that the codec refuses, as the robot sees it: some it takes all the same, the others are
//! refused with a code.

use crate::sim::meca500::robot::VirtualRobot;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::command::MotionCommand;
use crate::wire::meca500::text::{SyntaxError, SyntaxErrorReason as Reason};

/// What a line means that is no command of the table.
pub(super) enum Odd {
    /// A motion command with an argument beyond the codec's range, for the robot to judge.
    Motion(MotionCommand),
    /// GetFwVersionFull, which the manual lacks and the vendor's client sends. Source: client
    FullFirmwareVersion,
    /// SetRealTimeMonitoring without arguments.
    NoRealTime,
    /// Nothing the robot takes.
    Refused(Code),
}

/// What becomes of a line that the codec refused.
pub(super) fn judge(line: &str, error: &SyntaxError<'_>) -> Odd {
    match error.reason {
        Reason::UnknownCommand { name: "GetFwVersionFull", .. } => Odd::FullFirmwareVersion,
        Reason::ArgumentCount { command: "SetRealTimeMonitoring", given: 0, .. } => Odd::NoRealTime,
        Reason::OutOfRange(error) => match error.command {
            "MoveJoints" => listed(line).map_or(Odd::Refused(Code::ARGUMENT_ERROR), |joints| {
                Odd::Motion(MotionCommand::MoveJoints(joints))
            }),
            "SetCheckpoint"
                if error.value.fract() == 0.0 && (1.0..=8191.0).contains(&error.value) =>
            {
                Odd::Motion(MotionCommand::SetCheckpoint(error.value as u16))
            }
            _ => Odd::Refused(Code::ARGUMENT_ERROR),
        },
        Reason::NoName { .. } | Reason::UnknownCommand { .. } => {
            Odd::Refused(Code::UNKNOWN_COMMAND)
        }
        Reason::MissingOpeningParenthesis { .. }
        | Reason::MissingClosingParenthesis { .. }
        | Reason::MissingComma { .. }
        | Reason::UnterminatedText
        | Reason::TrailingText { .. } => Odd::Refused(Code::SYNTAX_ERROR),
        _ => Odd::Refused(Code::ARGUMENT_ERROR),
    }
}

/// Six finite numbers between the parentheses of a line.
fn listed(line: &str) -> Option<[f32; 6]> {
    let (_, rest) = line.split_once('(')?;
    let (list, _) = rest.split_once(')')?;
    let mut numbers = [0.0; 6];
    let mut slots = numbers.iter_mut();
    for argument in list.split(',') {
        let number: f32 = argument.trim().parse().ok()?;
        *slots.next()? = if number.is_finite() { number } else { return None };
    }
    slots.next().is_none().then_some(numbers)
}

impl VirtualRobot {
    /// The robot's name for itself at the beginning of a connection. Source: client
    pub(super) fn greeting(&self) -> alloc::string::String {
        let revision = self.settings.revision;
        alloc::format!("Connected to Meca500 {revision:?} v{}", self.short_firmware_version())
    }
}
