//! Motion commands, written as the robot reads them.

use core::fmt;

use super::spec::{CyclicEquivalent, TextCommandSpec};
use crate::wire::meca500::command::{MotionCommand, MotionCommandId};

/// A motion command as text: `MoveJoints(0,10,-10,0,20,0)`. Numbers are as short as they can be and read as
/// the same Real again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommandText {
    name: &'static str,
    arguments: [f32; 6],
    count: usize,
}

impl CommandText {
    /// The text of a command; `None` for what only a cyclic bus has: no movement, clearing the homing,
    /// variables by number, and IDs of no entry.
    #[must_use]
    pub fn of(command: &MotionCommand) -> Option<Self> {
        let (id, arguments) = command.encode();
        if id == MotionCommandId::GRIPPER {
            let [opens, ..] = arguments;
            let name = if opens == 0.0 { "GripperClose" } else { "GripperOpen" };
            return Some(Self { name, arguments, count: 0 });
        }
        let is_it = |spec: &&TextCommandSpec| {
            // By its name, a variable is something else than by its number.
            spec.equivalent == CyclicEquivalent::Motion(id) && spec.name != "SetVariable"
        };
        let spec = TextCommandSpec::all().find(is_it)?;
        Some(Self { name: spec.name, arguments, count: spec.arguments().count() })
    }
}

impl fmt::Display for CommandText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)?;
        f.write_str("(")?;
        for (position, argument) in self.arguments.iter().take(self.count).enumerate() {
            if position > 0 {
                f.write_str(",")?;
            }
            write!(f, "{argument}")?;
        }
        f.write_str(")")
    }
}
