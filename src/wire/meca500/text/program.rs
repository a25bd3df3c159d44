//! One line of a program to what a cyclic controller does for it.

use core::fmt;

use super::error::{Shown, SyntaxError, SyntaxErrorReason};
use super::parse::{Argument, ParsedCommand, Value, parse_line};
use super::spec::{Category, CyclicEquivalent, MotionControlBit, RobotControlBit};
use crate::wire::meca500::command::{
    CommandError, MotionCommand, MotionCommandId, VelocityCommand,
};
use crate::wire::meca500::revision::Revision;

/// A checked statement of a robot program, for a controller on a cyclic bus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Statement {
    /// A motion command, sent through the MoveID handshake.
    Motion(MotionCommand),
    /// A velocity command.
    Velocity(VelocityCommand),
    /// Activate the robot.
    Activate {
        /// Forget the homing first (`ActivateRobot(1)`, motion command 1002), so that the drives are
        /// initialised again.
        reinitialize: bool,
    },
    /// Deactivate the robot.
    Deactivate,
    /// Home the robot.
    Home,
    /// Reset the error.
    ResetError,
    /// Pause motion.
    PauseMotion,
    /// Resume motion.
    ResumeMotion,
    /// Stop and clear the motion queue.
    ClearMotion,
    /// Switch simulation on, in the kind that SetSimModeCfg chose.
    ActivateSim,
    /// Switch simulation off.
    DeactivateSim,
    /// Switch recovery mode on or off.
    SetRecoveryMode(bool),
    /// Set the robot's clock: seconds since 1970-01-01, never 0.
    SetRtc(u32),
}

/// A line that a cyclic controller cannot execute.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{reason}")]
pub struct ProgramError<'a> {
    /// Column of the offending text in characters, from 1.
    pub column: usize,
    /// Why.
    pub reason: ProgramErrorReason<'a>,
}

/// Why a line cannot be executed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ProgramErrorReason<'a> {
    /// The line is not a command.
    Syntax(SyntaxErrorReason<'a>),
    /// A command of another robot.
    NotAvailable {
        /// The command.
        command: &'static str,
    },
    /// A command without an equivalent in the cyclic images.
    TcpOnly {
        /// The command.
        command: &'static str,
    },
    /// A request for data that the images hold anyway.
    Request {
        /// The command.
        command: &'static str,
        /// Where the data is.
        held_by: CyclicEquivalent,
    },
    /// A robot variable as an argument.
    Variable {
        /// The argument.
        argument: &'a str,
    },
    /// A variable set by its name.
    VariableByName,
    /// A kind of simulation that the cyclic bit cannot choose.
    SimulationKind,
    /// A program whose name is not a number from 1 to 500.
    ProgramName {
        /// The name.
        name: &'a str,
    },
    /// A motion command that cannot be made; lines that pass the syntax do not lead here.
    Command(CommandError),
}

impl fmt::Display for ProgramErrorReason<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Syntax(reason) => reason.fmt(f),
            Self::NotAvailable { command } => {
                write!(f, "{command} is not available on the Meca500")
            }
            Self::TcpOnly { command } => write!(
                f,
                "{command} exists only on the robot's TCP interface; nothing in the cyclic image \
                 stands for it"
            ),
            Self::Request { command, held_by } => write!(
                f,
                "{command} is a request for data; read it from the cyclic image: {held_by}"
            ),
            Self::Variable { argument } => write!(
                f,
                "`{}` is a robot variable, which only the robot's TCP interface looks up by name; \
                 write a number",
                Shown(argument)
            ),
            Self::VariableByName => f.write_str(
                "SetVariable names its variable, and names exist only on the robot's TCP \
                 interface; the cyclic image sets a variable by its cyclic ID",
            ),
            Self::SimulationKind => f.write_str(
                "ActivateSim with a kind exists only on the robot's TCP interface; the cyclic bit \
                 starts the kind that SetSimModeCfg chose: write ActivateSim()",
            ),
            Self::ProgramName { name } => write!(
                f,
                "StartProgram over the cyclic image takes programs named by a number from 1 to \
                 500, not `{}`",
                Shown(name)
            ),
            Self::Command(error) => error.fmt(f),
        }
    }
}

impl<'a> From<SyntaxError<'a>> for ProgramError<'a> {
    fn from(error: SyntaxError<'a>) -> Self {
        Self { column: error.column, reason: ProgramErrorReason::Syntax(error.reason) }
    }
}

impl Statement {
    /// Reads one line for a robot of this revision: `None` for a blank line or a mere comment.
    ///
    /// # Errors
    ///
    /// The first thing that is wrong with the line, or the reason why a command has no place in a
    /// program that runs over a cyclic bus.
    pub fn parse(line: &str, revision: Revision) -> Result<Option<Self>, ProgramError<'_>> {
        match parse_line(line, revision)? {
            Some(parsed) => Self::from_parsed(&parsed, revision).map(Some),
            None => Ok(None),
        }
    }

    /// What a cyclic controller does for a parsed command.
    ///
    /// # Errors
    ///
    /// The reason why it can do nothing.
    pub fn from_parsed<'a>(
        parsed: &ParsedCommand<'a>,
        revision: Revision,
    ) -> Result<Self, ProgramError<'a>> {
        let error = |reason| ProgramError { column: parsed.column, reason };
        if let Some(reason) = without_a_place(parsed) {
            return Err(error(reason));
        }
        if let Some(Argument { text, column, .. }) = parsed.variable() {
            let reason = ProgramErrorReason::Variable { argument: text };
            return Err(ProgramError { column, reason });
        }
        match parsed.spec.equivalent {
            CyclicEquivalent::Motion(id) => motion(parsed, id, revision),
            CyclicEquivalent::RobotControl(bit) => robot_control(parsed, bit),
            CyclicEquivalent::MotionControl(MotionControlBit::PauseMotion) => Ok(Self::PauseMotion),
            CyclicEquivalent::MotionControl(MotionControlBit::ClearMotion) => Ok(Self::ClearMotion),
            CyclicEquivalent::MotionControl(MotionControlBit::ResumeMotion) => {
                Ok(Self::ResumeMotion)
            }
            CyclicEquivalent::HostTime
            | CyclicEquivalent::Dynamic(_)
            | CyclicEquivalent::Input(_)
            | CyclicEquivalent::None
            | CyclicEquivalent::Unavailable => {
                let seconds = parsed.arguments().next().and_then(|first| first.text.parse().ok());
                let command = parsed.spec.name;
                seconds.map(Self::SetRtc).ok_or(error(ProgramErrorReason::TcpOnly { command }))
            }
        }
    }
}

/// Why a command has no place in a cyclic program, whatever its arguments; `None` if it has one.
fn without_a_place<'a>(parsed: &ParsedCommand<'a>) -> Option<ProgramErrorReason<'a>> {
    let command = parsed.spec.name;
    match parsed.spec.equivalent {
        CyclicEquivalent::Unavailable => Some(ProgramErrorReason::NotAvailable { command }),
        CyclicEquivalent::None => Some(ProgramErrorReason::TcpOnly { command }),
        held_by @ (CyclicEquivalent::Dynamic(_) | CyclicEquivalent::Input(_)) => {
            Some(ProgramErrorReason::Request { command, held_by })
        }
        CyclicEquivalent::Motion(_) if parsed.spec.category == Category::Variable => {
            Some(ProgramErrorReason::VariableByName)
        }
        _ => None,
    }
}

fn robot_control<'a>(
    parsed: &ParsedCommand<'a>,
    bit: RobotControlBit,
) -> Result<Statement, ProgramError<'a>> {
    let first = parsed.arguments().next();
    let [number, ..] = parsed.numbers();
    Ok(match bit {
        RobotControlBit::ActivateRobot => Statement::Activate { reinitialize: first.is_some() },
        RobotControlBit::DeactivateRobot => Statement::Deactivate,
        RobotControlBit::Home => Statement::Home,
        RobotControlBit::ResetError => Statement::ResetError,
        RobotControlBit::EnableRecoveryMode => Statement::SetRecoveryMode(number == 1.0),
        RobotControlBit::ActivateSim => match first {
            _ if parsed.spec.name == "DeactivateSim" => Statement::DeactivateSim,
            None => Statement::ActivateSim,
            Some(_) if number == 0.0 => Statement::DeactivateSim,
            Some(Argument { column, .. }) => {
                return Err(ProgramError { column, reason: ProgramErrorReason::SimulationKind });
            }
        },
    })
}

fn motion<'a>(
    parsed: &ParsedCommand<'a>,
    id: MotionCommandId,
    revision: Revision,
) -> Result<Statement, ProgramError<'a>> {
    let mut numbers = parsed.numbers();
    let mut count = parsed.arguments().count();
    let mut column = parsed.column;
    if id == MotionCommandId::GRIPPER {
        let opens = parsed.spec.name == "GripperOpen";
        numbers = [f32::from(u8::from(opens)), 0.0, 0.0, 0.0, 0.0, 0.0];
        count = 1;
    }
    if let (MotionCommandId::START_PROGRAM, Some(argument)) = (id, parsed.arguments().next()) {
        column = argument.column;
        let [number, ..] = &mut numbers;
        *number = program_number(argument)
            .map_err(|reason| ProgramError { column: argument.column, reason })?;
    }
    let arguments = numbers.get(..count).unwrap_or(&numbers);
    let command = MotionCommand::from_arguments(id, arguments, revision)
        .map_err(|error| ProgramError { column, reason: ProgramErrorReason::Command(error) })?;
    Ok(match VelocityCommand::try_from(command) {
        Ok(velocity) => Statement::Velocity(velocity),
        Err(_) => Statement::Motion(command),
    })
}

/// The number of a program; a name like `01` is another program than `1` and is refused.
fn program_number(argument: Argument<'_>) -> Result<f32, ProgramErrorReason<'_>> {
    let name = match argument.value() {
        Value::Text(name) => name,
        _ => argument.text,
    };
    match name.parse::<u16>() {
        Ok(number @ 1..=500) if !name.starts_with(['0', '+']) => Ok(f32::from(number)),
        _ => Err(ProgramErrorReason::ProgramName { name }),
    }
}
