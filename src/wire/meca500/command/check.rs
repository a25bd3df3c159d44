//! Checked construction: argument counts, ranges, units, and what two arguments say together.

use core::fmt;

use super::id::MotionCommandId;
use super::motion::MotionCommand;
use super::spec::{ArgumentRange, ArgumentSpec, CommandSpec};
use super::table::MODEL_JOINT_LIMITS;
use super::unit::Unit;
use crate::wire::meca500::revision::Revision;

/// Range of motion that configured limits must leave to every joint, in degrees. Source: PM L3618.
const LEAST_JOINT_TRAVEL: f32 = 25.0;

/// Values that would have been accepted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Allowed {
    /// Those of the argument's range.
    Range {
        /// The range.
        range: ArgumentRange,
        /// Its unit.
        unit: Unit,
        /// The robot it was checked for.
        revision: Revision,
    },
    /// The mechanical limits of the joint named by another argument.
    JointLimits {
        /// Joint, 1 to 6.
        joint: u8,
        /// Lowest position, in degrees.
        min: f32,
        /// Highest position, in degrees.
        max: f32,
    },
    /// Less than another argument.
    Below {
        /// The other argument.
        argument: &'static str,
        /// Its value.
        value: f32,
        /// Unit of both.
        unit: Unit,
    },
    /// At least so much more than another argument.
    Above {
        /// The other argument.
        argument: &'static str,
        /// The least value.
        min: f32,
        /// Unit of both.
        unit: Unit,
    },
}

impl fmt::Display for Allowed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Range { range, unit, revision } => range.write(f, unit, revision),
            Self::JointLimits { joint, min, max } => {
                write!(f, "{min} to {max} deg for joint {joint}")
            }
            Self::Below { argument, value, unit } => {
                write!(f, "less than {argument}, which is {value}{}", unit.suffix())
            }
            Self::Above { argument, min, unit } => {
                write!(f, "{min}{} or more, to leave {argument} room", unit.suffix())
            }
        }
    }
}

/// An argument the robot would refuse.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{command}: {argument} = {value}{}, allowed: {allowed}", .unit.suffix())]
pub struct ArgumentError {
    /// The command's name.
    pub command: &'static str,
    /// The argument's name.
    pub argument: &'static str,
    /// Its position among the arguments, from 0.
    pub position: usize,
    /// Its value.
    pub value: f32,
    /// Its unit.
    pub unit: Unit,
    /// What it could have been.
    pub allowed: Allowed,
}

/// Why a command cannot be made from an ID and arguments.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CommandError {
    /// An ID of Table 8 that belongs to another robot.
    #[error("{name} (command ID {}) is not available on the Meca500", .id.0)]
    NotAvailable {
        /// The ID.
        id: MotionCommandId,
        /// The command's name.
        name: &'static str,
    },
    /// An ID without an entry in Table 8.
    #[error("command ID {} is not defined; use MotionCommand::Raw to send it all the same", .id.0)]
    Undefined {
        /// The ID.
        id: MotionCommandId,
    },
    /// Too few or too many arguments.
    #[error("{command} takes {expected}, not {given}")]
    ArgumentCount {
        /// The command's name.
        command: &'static str,
        /// How many it takes.
        expected: ArgumentCount,
        /// How many there were.
        given: usize,
    },
    /// An argument out of its range.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
}

/// How many arguments a command takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArgumentCount {
    /// Fewest.
    pub min: usize,
    /// Most.
    pub max: usize,
}

impl fmt::Display for ArgumentCount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.min, self.max) {
            (_, 0) => f.write_str("no arguments"),
            (1, 1) => f.write_str("1 argument"),
            (min, max) if min == max => write!(f, "{max} arguments"),
            (min, max) => write!(f, "{min} to {max} arguments"),
        }
    }
}

impl CommandSpec {
    /// How many arguments the command takes.
    #[must_use]
    pub const fn argument_count(&self) -> ArgumentCount {
        ArgumentCount { min: self.min_arguments, max: self.arguments.len() }
    }

    /// Checks the values of the arguments, as many as there are, for a robot of this revision.
    ///
    /// # Errors
    ///
    /// The first argument that is not a finite number, out of its range, or at odds with another.
    pub fn check_values(&self, values: &[f32], revision: Revision) -> Result<(), ArgumentError> {
        for (position, (argument, value)) in self.arguments.iter().zip(values).enumerate() {
            if !argument.range.contains(*value, revision) {
                let ArgumentSpec { range, unit, .. } = *argument;
                let allowed = Allowed::Range { range, unit, revision };
                return Err(self.error(position, *value, allowed));
            }
        }
        match (self.id, values) {
            (MotionCommandId::SET_JOINT_LIMITS, &[n, q_min, q_max]) => {
                self.check_joint_limits(n, q_min, q_max)
            }
            (MotionCommandId::SET_WORK_ZONE_LIMITS, values) => self.check_work_zone(values),
            _ => Ok(()),
        }
    }

    fn error(&self, position: usize, value: f32, allowed: Allowed) -> ArgumentError {
        let (argument, unit) = self
            .arguments
            .get(position)
            .map_or(("argument", Unit::None), |argument| (argument.name, argument.unit));
        ArgumentError { command: self.name, argument, position, value, unit, allowed }
    }

    fn check_joint_limits(&self, n: f32, q_min: f32, q_max: f32) -> Result<(), ArgumentError> {
        let restores_factory_limits = q_min == 0.0 && q_max == 0.0;
        if restores_factory_limits {
            return Ok(());
        }
        let limits = (1_u8..).zip(MODEL_JOINT_LIMITS).find(|(joint, _)| f32::from(*joint) == n);
        if let Some((joint, (min, max))) = limits {
            for (position, value) in [(1, q_min), (2, q_max)] {
                if !(min..=max).contains(&value) {
                    let allowed = Allowed::JointLimits { joint, min, max };
                    return Err(self.error(position, value, allowed));
                }
            }
        }
        let least = q_min + LEAST_JOINT_TRAVEL;
        if q_max < least {
            let allowed = Allowed::Above { argument: "q_min", min: least, unit: Unit::Degree };
            return Err(self.error(2, q_max, allowed));
        }
        Ok(())
    }

    fn check_work_zone(&self, values: &[f32]) -> Result<(), ArgumentError> {
        let restores_factory_zone = values.iter().all(|value| *value == 0.0);
        if restores_factory_zone {
            return Ok(());
        }
        let corners = values.iter().zip(values.iter().skip(3));
        let names = self.arguments.iter().skip(3).map(|argument| argument.name);
        for (position, ((min, max), argument)) in corners.zip(names).enumerate() {
            if min >= max {
                let allowed = Allowed::Below { argument, value: *max, unit: Unit::Millimetre };
                return Err(self.error(position, *min, allowed));
            }
        }
        Ok(())
    }
}

impl MotionCommand {
    /// Whether a robot of this revision takes the command's values, as far as they alone decide.
    ///
    /// [`MotionCommand::Raw`] is only asked for finite arguments.
    ///
    /// # Errors
    ///
    /// The first argument the robot would refuse, with the values it takes.
    pub fn check(&self, revision: Revision) -> Result<(), ArgumentError> {
        let (_, arguments) = self.encode();
        match *self {
            Self::Raw { arguments, .. } => check_finite("Raw", &arguments, revision),
            Self::SetVariable { cyclic_id, values, count } => {
                check_variable(cyclic_id, &values, count, revision)
            }
            _ => match self.spec() {
                Some(spec) => {
                    let used = arguments.get(..spec.arguments.len()).unwrap_or(&arguments);
                    spec.check_values(used, revision)
                }
                None => check_finite(self.name(), &arguments, revision),
            },
        }
    }

    /// Makes a command from its ID and exactly as many arguments as it takes, checked.
    ///
    /// # Errors
    ///
    /// An ID the Meca500 lacks or nobody defined, a wrong number of arguments, or the first argument
    /// the robot would refuse.
    pub fn from_arguments(
        id: MotionCommandId,
        arguments: &[f32],
        revision: Revision,
    ) -> Result<Self, CommandError> {
        let spec = CommandSpec::of(id).ok_or(CommandError::Undefined { id })?;
        if !spec.available {
            return Err(CommandError::NotAvailable { id, name: spec.name });
        }
        let expected = spec.argument_count();
        let given = arguments.len();
        if given < expected.min || given > expected.max {
            return Err(CommandError::ArgumentCount { command: spec.name, expected, given });
        }
        spec.check_values(arguments, revision)?;
        let mut padded = [0.0; 6];
        for (slot, argument) in padded.iter_mut().zip(arguments) {
            *slot = *argument;
        }
        Ok(match Self::decode(id, padded) {
            Self::SetVariable { cyclic_id, values, .. } => {
                Self::SetVariable { cyclic_id, values, count: u8::try_from(given).unwrap_or(6) }
            }
            command => command,
        })
    }
}

const ARGUMENT_NAMES: [&str; 6] =
    ["argument 1", "argument 2", "argument 3", "argument 4", "argument 5", "argument 6"];

fn check_finite(
    command: &'static str,
    values: &[f32],
    revision: Revision,
) -> Result<(), ArgumentError> {
    let range = ArgumentRange::Any;
    for (position, (argument, value)) in ARGUMENT_NAMES.iter().zip(values).enumerate() {
        if !value.is_finite() {
            let allowed = Allowed::Range { range, unit: Unit::None, revision };
            let (value, unit) = (*value, Unit::None);
            return Err(ArgumentError { command, argument, position, value, unit, allowed });
        }
    }
    Ok(())
}

fn check_variable(
    cyclic_id: u16,
    values: &[f32; 6],
    count: u8,
    revision: Revision,
) -> Result<(), ArgumentError> {
    let integers =
        [("cyclic_id", f32::from(cyclic_id), 10_000, 19_999), ("count", f32::from(count), 1, 6)];
    for (argument, value, min, max) in integers {
        let range = ArgumentRange::Integer { min, max };
        if !range.contains(value, revision) {
            let (command, unit, position) = ("SetVariable", Unit::None, 0);
            let allowed = Allowed::Range { range, unit, revision };
            return Err(ArgumentError { command, argument, position, value, unit, allowed });
        }
    }
    let used = values.get(..usize::from(count)).unwrap_or(values);
    check_finite("SetVariable", used, revision)
}
