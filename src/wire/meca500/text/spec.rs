//! What is known of each text command.

use core::fmt;

use super::{accessory, control, data, motion, real_time, variable, work_zone};
use crate::wire::meca500::command::{
    ArgumentRange, ArgumentSpec, Choice, CommandSpec, MotionCommandId, Unit,
};
use crate::wire::meca500::dynamic::DynamicType;

/// Group of text commands, as the manual's chapters have them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Category {
    /// Motion commands.
    Motion,
    /// Robot control commands.
    Control,
    /// Requests for settings.
    Data,
    /// Requests for real-time data.
    RealTime,
    /// Work zone and collisions.
    WorkZone,
    /// Grippers, valves, inputs and outputs.
    Accessory,
    /// Variables.
    Variable,
}

/// Whether a text command waits in the motion queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Timing {
    /// It does.
    Queued,
    /// It is executed as soon as it is received.
    Instantaneous,
    /// The manual does not tell.
    NotStated,
}

/// A bit of RobotControl. Source: PM Table 4.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RobotControlBit {
    /// DeactivateRobot, output bit 0:0.
    DeactivateRobot,
    /// ActivateRobot, output bit 0:1.
    ActivateRobot,
    /// Home, output bit 0:2.
    Home,
    /// ResetError, output bit 0:3.
    ResetError,
    /// ActivateSim, output bit 0:4; 1 switches simulation on, 0 off.
    ActivateSim,
    /// EnableRecoveryMode, output bit 0:5.
    EnableRecoveryMode,
}

/// A bit of MotionControl. Source: PM Table 5.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MotionControlBit {
    /// PauseMotion, output bit 6:1.
    PauseMotion,
    /// ClearMotion, output bit 6:2.
    ClearMotion,
    /// ResumeMotion, output bit 6:3.
    ResumeMotion,
}

/// A part of the input image that holds what a request asks for. Source: PM Tables 13 to 21.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum InputSection {
    /// RobotStatus, with Paused, EOB and EOM in MotionStatus.
    RobotStatus,
    /// CheckpointReached of MotionStatus.
    CheckpointReached,
    /// CheckpointDiscarded of MotionStatus.
    CheckpointDiscarded,
    /// ExcessiveTorque of MotionStatus.
    ExcessiveTorque,
    /// TargetJointSet.
    TargetJointSet,
    /// TargetEndEffectorPose.
    TargetEndEffectorPose,
    /// TargetConfiguration.
    TargetConfiguration,
    /// TargetWrf.
    TargetWrf,
    /// TargetTrf.
    TargetTrf,
    /// RobotTimestamp. It is monotonic, whereas the request answers the time of day (PM L1532).
    RobotTimestamp,
    /// SafetyStatus.
    SafetyStatus,
}

impl InputSection {
    /// The manual's name of it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::RobotStatus => "RobotStatus",
            Self::CheckpointReached => "MotionStatus.CheckpointReached",
            Self::CheckpointDiscarded => "MotionStatus.CheckpointDiscarded",
            Self::ExcessiveTorque => "MotionStatus.ExcessiveTorque",
            Self::TargetJointSet => "TargetJointSet",
            Self::TargetEndEffectorPose => "TargetEndEffectorPose",
            Self::TargetConfiguration => "TargetConfiguration",
            Self::TargetWrf => "TargetWrf",
            Self::TargetTrf => "TargetTrf",
            Self::RobotTimestamp => "RobotTimestamp",
            Self::SafetyStatus => "SafetyStatus",
        }
    }
}

/// What stands for a text command in the cyclic images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CyclicEquivalent {
    /// A motion command.
    Motion(MotionCommandId),
    /// A bit of RobotControl.
    RobotControl(RobotControlBit),
    /// A bit of MotionControl.
    MotionControl(MotionControlBit),
    /// The field HostTime.
    HostTime,
    /// Dynamic data of these types.
    Dynamic(&'static [DynamicType]),
    /// A part of the input image.
    Input(InputSection),
    /// Nothing: the command exists over TCP only.
    None,
    /// Nothing: the Meca500 lacks the command.
    Unavailable,
}

impl fmt::Display for CyclicEquivalent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Motion(id) => write!(f, "motion command {id}"),
            Self::RobotControl(bit) => write!(f, "RobotControl.{bit:?}"),
            Self::MotionControl(bit) => write!(f, "MotionControl.{bit:?}"),
            Self::HostTime => f.write_str("HostTime"),
            Self::Dynamic(types) => {
                f.write_str("dynamic data type ")?;
                for (position, ty) in types.iter().enumerate() {
                    if position > 0 {
                        f.write_str(", ")?;
                    }
                    write!(f, "{ty}")?;
                }
                Ok(())
            }
            Self::Input(section) => f.write_str(section.name()),
            Self::None => f.write_str("none"),
            Self::Unavailable => f.write_str("not available on the Meca500"),
        }
    }
}

/// What may stand for an argument in text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TextArgumentKind {
    /// A number.
    Number(ArgumentRange),
    /// An integer too large for a Real to hold.
    Whole {
        /// Lowest value.
        min: u32,
        /// Highest value.
        max: u32,
    },
    /// A text, with or without quotes.
    Text {
        /// Most characters; `None` where the manual states no limit.
        max_chars: Option<u16>,
    },
    /// A JSON value.
    Json,
    /// This and any further arguments: codes or names.
    List,
}

impl TextArgumentKind {
    /// Whether only a number may stand there.
    #[must_use]
    pub const fn is_number(&self) -> bool {
        matches!(self, Self::Number(_) | Self::Whole { .. })
    }
}

/// One argument of a text command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextArgumentSpec {
    /// The manual's name, in plain letters.
    pub name: &'static str,
    /// Its unit.
    pub unit: Unit,
    /// What may stand there.
    pub kind: TextArgumentKind,
    /// Value in force before anybody sends the command.
    pub default: Option<f32>,
    /// Whether it may be left out.
    pub optional: bool,
}

impl From<&ArgumentSpec> for TextArgumentSpec {
    fn from(argument: &ArgumentSpec) -> Self {
        Self {
            name: argument.name,
            unit: argument.unit,
            kind: TextArgumentKind::Number(argument.range),
            default: argument.default,
            optional: false,
        }
    }
}

/// Where the arguments of a text command are declared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Declared {
    /// In the row of its motion command, since they are the same.
    WithMotionCommand,
    /// Here.
    Here(&'static [TextArgumentSpec]),
}

/// One text command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextCommandSpec {
    /// The manual's spelling of its name.
    pub name: &'static str,
    /// Its group.
    pub category: Category,
    /// Whether it waits in the motion queue.
    pub timing: Timing,
    /// Whether a Meca500 has it; `None` where the manual does not tell.
    pub available: Option<bool>,
    /// What stands for it in the cyclic images.
    pub equivalent: CyclicEquivalent,
    /// Line of the manual where its chapter begins. Source: PM.
    pub manual_line: u16,
    pub(super) declared: Declared,
}

impl TextCommandSpec {
    /// Every text command, in the order of [`TEXT_COMMANDS`].
    pub fn all() -> impl Iterator<Item = &'static Self> {
        TEXT_COMMANDS.iter().flat_map(|group| group.iter())
    }

    /// The command with this name, spelled exactly so.
    #[must_use]
    pub fn by_name(name: &str) -> Option<&'static Self> {
        Self::all().find(|spec| spec.name == name)
    }

    /// Its arguments in order.
    pub fn arguments(&self) -> impl Iterator<Item = TextArgumentSpec> + use<> {
        let (own, shared) = match self.declared {
            Declared::Here(own) => (own, None),
            Declared::WithMotionCommand => (&[] as &[TextArgumentSpec], self.motion_command()),
        };
        let shared = shared.map_or(&[] as &[ArgumentSpec], |spec| spec.arguments);
        own.iter().copied().chain(shared.iter().map(TextArgumentSpec::from))
    }

    /// The motion command with the same name and the same arguments, if there is one.
    #[must_use]
    pub fn motion_command(&self) -> Option<&'static CommandSpec> {
        match (self.declared, self.equivalent) {
            (Declared::WithMotionCommand, CyclicEquivalent::Motion(id)) => CommandSpec::of(id),
            _ => None,
        }
    }
}

/// Every text command in groups: motion, control, data requests, real-time requests, work zone,
/// accessories, variables. Source: PM, chapters from L1927 on.
pub const TEXT_COMMANDS: [&[TextCommandSpec]; 7] = [
    motion::COMMANDS,
    control::COMMANDS,
    data::COMMANDS,
    real_time::COMMANDS,
    work_zone::COMMANDS,
    accessory::COMMANDS,
    variable::COMMANDS,
];

pub(super) const fn command(
    name: &'static str,
    category: Category,
    timing: Timing,
    declared: Declared,
    equivalent: CyclicEquivalent,
    manual_line: u16,
) -> TextCommandSpec {
    let available = Some(!matches!(equivalent, CyclicEquivalent::Unavailable));
    TextCommandSpec { name, category, timing, available, equivalent, manual_line, declared }
}

/// A queued command with the arguments of its motion command.
pub(super) const fn queued(
    name: &'static str,
    category: Category,
    id: MotionCommandId,
    manual_line: u16,
) -> TextCommandSpec {
    let declared = Declared::WithMotionCommand;
    command(name, category, Timing::Queued, declared, CyclicEquivalent::Motion(id), manual_line)
}

/// An instantaneous command with the arguments of its motion command.
pub(super) const fn configuration(
    name: &'static str,
    category: Category,
    id: MotionCommandId,
    manual_line: u16,
) -> TextCommandSpec {
    TextCommandSpec { timing: Timing::Instantaneous, ..queued(name, category, id, manual_line) }
}

/// An instantaneous command with arguments of its own.
pub(super) const fn instantaneous(
    name: &'static str,
    category: Category,
    arguments: &'static [TextArgumentSpec],
    equivalent: CyclicEquivalent,
    manual_line: u16,
) -> TextCommandSpec {
    let declared = Declared::Here(arguments);
    command(name, category, Timing::Instantaneous, declared, equivalent, manual_line)
}

/// A command of another robot.
pub(super) const fn unavailable(
    name: &'static str,
    category: Category,
    timing: Timing,
    manual_line: u16,
) -> TextCommandSpec {
    let declared = Declared::Here(&[]);
    command(name, category, timing, declared, CyclicEquivalent::Unavailable, manual_line)
}

/// An argument that is a number.
pub(super) const fn number(
    name: &'static str,
    unit: Unit,
    range: ArgumentRange,
    default: Option<f32>,
) -> TextArgumentSpec {
    let kind = TextArgumentKind::Number(range);
    TextArgumentSpec { name, unit, kind, default, optional: false }
}

/// An argument that is one of a few integers.
pub(super) const fn one_of(
    name: &'static str,
    choices: &'static [Choice],
    default: Option<f32>,
) -> TextArgumentSpec {
    number(name, Unit::None, ArgumentRange::OneOf(choices), default)
}

/// An argument that is an integer.
pub(super) const fn integer(
    name: &'static str,
    min: i32,
    max: i32,
    default: Option<f32>,
) -> TextArgumentSpec {
    number(name, Unit::None, ArgumentRange::Integer { min, max }, default)
}

/// An argument that is a large integer.
pub(super) const fn whole(name: &'static str, unit: Unit, min: u32) -> TextArgumentSpec {
    let kind = TextArgumentKind::Whole { min, max: u32::MAX };
    TextArgumentSpec { name, unit, kind, default: None, optional: false }
}

/// An argument that is a text.
pub(super) const fn text(name: &'static str, max_chars: Option<u16>) -> TextArgumentSpec {
    let kind = TextArgumentKind::Text { max_chars };
    TextArgumentSpec { name, unit: Unit::None, kind, default: None, optional: false }
}

/// An argument of another kind.
pub(super) const fn other(name: &'static str, kind: TextArgumentKind) -> TextArgumentSpec {
    TextArgumentSpec { name, unit: Unit::None, kind, default: None, optional: false }
}

/// The same argument, which may be left out.
pub(super) const fn optional(argument: TextArgumentSpec) -> TextArgumentSpec {
    TextArgumentSpec { optional: true, ..argument }
}

pub(super) const fn choice(value: i16, meaning: &'static str) -> Choice {
    Choice { value, meaning }
}

pub(super) const OFF_ON: &[Choice] = &[choice(0, "off"), choice(1, "on")];
