//! What is known of each motion command before anybody sends one.

use core::fmt;

use super::id::MotionCommandId;
use super::table::COMMANDS;
use super::unit::Unit;
use crate::wire::meca500::revision::Revision;

/// When and how the robot executes a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CommandKind {
    /// ID 0: nothing to execute.
    NoMovement,
    /// Enters the motion queue and is executed in its turn.
    Queued,
    /// Executed as soon as it is received.
    Instantaneous,
    /// One of the three velocity commands, executed continuously while MoveID is 0 and SetPoint 1.
    Velocity,
    /// Sets a robot variable. Whether it waits in the queue is not stated in the manual.
    Variable,
    /// Nothing is known: an ID outside Table 8, or one whose kind the manual does not tell.
    Unknown,
}

/// Robot state that a command needs. Named, not checked, by this floor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Requirement {
    /// Accepted in every state.
    AnyState,
    /// Activated, homed (or in recovery mode), no error, no safety stop.
    ReadyForMotion,
    /// As [`Self::ReadyForMotion`], but recovery mode does not replace homing.
    ReadyAndHomed,
    /// Activated and homed (or in recovery mode).
    ActivatedAndHomed,
    /// Deactivated.
    Deactivated,
    /// Sent before activation; what it does later is not stated.
    BeforeActivation,
    /// The manual does not tell.
    NotStated,
}

impl Requirement {
    /// The state in a few words.
    #[must_use]
    pub const fn text(self) -> &'static str {
        match self {
            Self::AnyState => "any state",
            Self::ReadyForMotion => {
                "activated, homed or in recovery mode, no error, no safety stop"
            }
            Self::ReadyAndHomed => "activated, homed, no error, no safety stop",
            Self::ActivatedAndHomed => "activated, homed or in recovery mode",
            Self::Deactivated => "deactivated",
            Self::BeforeActivation => "before activation",
            Self::NotStated => "not stated",
        }
    }
}

/// One value of an argument that is a choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// The number on the wire.
    pub value: i16,
    /// What it means; empty where the number says it all.
    pub meaning: &'static str,
}

/// Values an argument may have. NaN and the infinities are never among them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ArgumentRange {
    /// Every finite number: the manual states no range.
    Any,
    /// A number not below the given one.
    AtLeast(f32),
    /// A number between two bounds, both included.
    Within {
        /// Lowest value.
        min: f32,
        /// Highest value.
        max: f32,
    },
    /// A number between two bounds, both included, of which the higher depends on the revision.
    WithinByRevision {
        /// Lowest value.
        min: f32,
        /// Highest value on a Meca500 R3.
        max_r3: f32,
        /// Highest value on a Meca500 R4.
        max_r4: f32,
    },
    /// An integer between two bounds, both included.
    Integer {
        /// Lowest value.
        min: i32,
        /// Highest value.
        max: i32,
    },
    /// One of a few integers.
    OneOf(&'static [Choice]),
}

impl ArgumentRange {
    /// Whether the robot of this revision takes `value`.
    #[must_use]
    pub fn contains(&self, value: f32, revision: Revision) -> bool {
        if !value.is_finite() {
            return false;
        }
        match *self {
            Self::Any => true,
            Self::AtLeast(min) => value >= min,
            Self::Within { .. } | Self::WithinByRevision { .. } => {
                self.min().is_none_or(|min| value >= min)
                    && self.max(revision).is_none_or(|max| value <= max)
            }
            Self::Integer { min, max } => super::arguments::exact_integer(value)
                .is_some_and(|integer| integer >= min && integer <= max),
            Self::OneOf(choices) => choices.iter().any(|choice| f32::from(choice.value) == value),
        }
    }

    /// Lowest value, if there is one.
    #[must_use]
    pub fn min(&self) -> Option<f32> {
        match *self {
            Self::Any => None,
            Self::AtLeast(min) | Self::Within { min, .. } | Self::WithinByRevision { min, .. } => {
                Some(min)
            }
            Self::Integer { min, .. } => Some(min as f32),
            Self::OneOf(choices) => choices.iter().map(|choice| choice.value).min().map(f32::from),
        }
    }

    /// Highest value, if there is one.
    #[must_use]
    pub fn max(&self, revision: Revision) -> Option<f32> {
        match *self {
            Self::Any | Self::AtLeast(_) => None,
            Self::Within { max, .. } => Some(max),
            Self::WithinByRevision { max_r3, max_r4, .. } => Some(match revision {
                Revision::R3 => max_r3,
                Revision::R4 => max_r4,
            }),
            Self::Integer { max, .. } => Some(max as f32),
            Self::OneOf(choices) => choices.iter().map(|choice| choice.value).max().map(f32::from),
        }
    }

    /// Writes the range for a person, with its unit: `-70 to 90 deg`.
    pub(super) fn write(
        &self,
        f: &mut fmt::Formatter<'_>,
        unit: Unit,
        revision: Revision,
    ) -> fmt::Result {
        let suffix = unit.suffix();
        match *self {
            Self::Any => write!(f, "any finite number"),
            Self::AtLeast(min) => write!(f, "{min}{suffix} or more"),
            Self::Within { min, max } => write!(f, "{min} to {max}{suffix}"),
            Self::WithinByRevision { min, .. } => {
                let max = self.max(revision).unwrap_or(min);
                write!(f, "{min} to {max}{suffix} on a Meca500 {revision}")
            }
            Self::Integer { min, max } => write!(f, "an integer from {min} to {max}{suffix}"),
            Self::OneOf(choices) => {
                for (position, choice) in choices.iter().enumerate() {
                    if position > 0 {
                        f.write_str(", ")?;
                    }
                    write!(f, "{}", choice.value)?;
                    if !choice.meaning.is_empty() {
                        write!(f, " ({})", choice.meaning)?;
                    }
                }
                Ok(())
            }
        }
    }
}

/// One argument of a motion command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArgumentSpec {
    /// The manual's name, in plain letters: `theta1`, `c_s`, `d_open`.
    pub name: &'static str,
    /// Its unit.
    pub unit: Unit,
    /// Its values.
    pub range: ArgumentRange,
    /// The value in force before anybody sends the command; `None` where the manual gives none, or
    /// where it depends on the robot.
    pub default: Option<f32>,
}

/// One motion command of Table 8.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommandSpec {
    /// Its ID; the lowest one for variables, which have a range of IDs.
    pub id: MotionCommandId,
    /// The highest of its IDs; equal to `id` except for variables.
    pub last_id: MotionCommandId,
    /// The manual's name of the command. IDs 0, 18, 1002 and the variables have none in Table 8 and
    /// are called `NoMovement`, `Gripper`, `ClearHoming` and `SetVariable`.
    pub name: &'static str,
    /// When the robot executes it.
    pub kind: CommandKind,
    /// Its arguments in wire order. A command uses as many of the six Reals as it has arguments.
    pub arguments: &'static [ArgumentSpec],
    /// Fewest arguments; differs from the length of `arguments` for variables only.
    pub min_arguments: usize,
    /// Whether a Meca500 has it.
    pub available: bool,
    /// Robot state it needs.
    pub requires: Requirement,
    /// Whether its effect survives a power cycle.
    pub persistent: bool,
    /// Line of the manual where the command's own chapter begins. Source: PM.
    pub manual_line: u16,
}

impl CommandSpec {
    /// The row of [`COMMANDS`] an ID belongs to.
    #[must_use]
    pub fn of(id: MotionCommandId) -> Option<&'static Self> {
        let position = COMMANDS.partition_point(|spec| spec.last_id < id);
        COMMANDS.get(position).filter(|spec| spec.id <= id)
    }

    /// The row with this name, spelled exactly so.
    #[must_use]
    pub fn by_name(name: &str) -> Option<&'static Self> {
        COMMANDS.iter().find(|spec| spec.name == name)
    }
}
