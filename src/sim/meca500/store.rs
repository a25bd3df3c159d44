//! What the robot keeps on its drive, for the person at the cell: variables, and offline programs by
//! number.
//!
//! Both survive a reboot. What is done here is what the text port does by command; cyclic data can
//! only set and use variables (PM L6799). A program's lines are kept as they are: those with
//! variables are read anew whenever the program starts. Source: PM L3998-4080, L6733-6863.

use alloc::collections::BTreeMap;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use serde_json::Value;
use thiserror::Error;

use super::queue::CAPACITY;
use super::robot::VirtualRobot;
use super::text::command_line;
use super::variables::{CYCLIC_IDS, SavedVariable, number_of};
use crate::wire::meca500::code::Code;
use crate::wire::meca500::command::MotionCommand;

/// Highest number of an offline program. Source: PM L4054.
const MOST_PROGRAMS: u16 = 500;

/// Why something cannot be kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum StoreError {
    /// A cyclic ID outside 10000 to 19999.
    #[error("cyclic ID {0} is outside 10000 to 19999")]
    CyclicId(u16),
    /// The cyclic ID has a variable already.
    #[error("cyclic ID {0} is taken")]
    Taken(u16),
    /// No variable has this cyclic ID.
    #[error("no variable has cyclic ID {0}")]
    NoVariable(u16),
    /// A variable needs at least one number.
    #[error("a variable needs at least one number")]
    Empty,
    /// The size of an array never changes.
    #[error("the variable holds {expected} numbers, not {found}")]
    Size {
        /// Numbers it holds.
        expected: usize,
        /// Numbers given.
        found: usize,
    },
    /// A value that is infinite or no number.
    #[error("a variable holds finite numbers only")]
    NotFinite,
    /// A program number outside 1 to 500.
    #[error("program number {0} is outside 1 to 500")]
    ProgramNumber(u16),
    /// More commands than a program may hold.
    #[error("a program holds at most 13000 commands, not {0}")]
    ProgramSize(usize),
}

/// A line of an offline program.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ProgramLine {
    /// A command.
    Command(MotionCommand),
    /// A line with variables, or one that somebody wrote.
    Text(String),
}

/// Offline programs by number.
#[derive(Clone, Debug, Default)]
pub(super) struct Programs {
    by_number: BTreeMap<u16, Vec<ProgramLine>>,
    /// How often one was kept.
    revision: u64,
}

impl Programs {
    /// Keeps a program in place of the one before.
    pub(super) fn keep(&mut self, number: u16, lines: Vec<ProgramLine>) {
        self.by_number.insert(number, lines);
        self.revision = self.revision.wrapping_add(1);
    }

    /// A number that grows whenever a program is kept.
    pub(super) const fn revision(&self) -> u64 {
        self.revision
    }
}

impl VirtualRobot {
    /// Creates a variable: one number, or an array of numbers.
    ///
    /// # Errors
    ///
    /// A cyclic ID out of range or taken, no numbers, or one that is not finite.
    pub fn create_variable(&mut self, cyclic_id: u16, values: &[f32]) -> Result<(), StoreError> {
        if !CYCLIC_IDS.contains(&cyclic_id) {
            return Err(StoreError::CyclicId(cyclic_id));
        }
        if self.variables.get(cyclic_id).is_some() {
            return Err(StoreError::Taken(cyclic_id));
        }
        if values.is_empty() {
            return Err(StoreError::Empty);
        }
        if !values.iter().all(|value| value.is_finite()) {
            return Err(StoreError::NotFinite);
        }
        let value = match values {
            [single] => number_of(*single),
            _ => Value::Array(values.iter().map(|value| number_of(*value)).collect()),
        };
        let name = format!("cyclic{cyclic_id}");
        self.variables
            .create(&name, value, cyclic_id, false)
            .map_err(|_| StoreError::Taken(cyclic_id))
    }

    /// Sets a variable to as many numbers as it holds.
    ///
    /// # Errors
    ///
    /// No such variable, another number of values, or a value that is not finite.
    pub fn set_variable(&mut self, cyclic_id: u16, values: &[f32]) -> Result<(), StoreError> {
        let Some(variable) = self.variables.get(cyclic_id) else {
            return Err(StoreError::NoVariable(cyclic_id));
        };
        let (expected, found) = (variable.len(), values.len());
        if expected != found {
            return Err(StoreError::Size { expected, found });
        }
        if self.variables.set_numbers(cyclic_id, values) {
            Ok(())
        } else {
            Err(StoreError::NotFinite)
        }
    }

    /// The variable's numbers.
    #[must_use]
    pub fn variable(&self, cyclic_id: u16) -> Option<&[f32]> {
        self.variables.get(cyclic_id)
    }

    /// Deletes a variable. Returns whether it was there.
    pub fn delete_variable(&mut self, cyclic_id: u16) -> bool {
        self.variables.delete_by_id(cyclic_id)
    }

    /// Every variable, for a caller who stores them.
    #[must_use]
    pub fn variables(&self) -> Vec<SavedVariable> {
        self.variables.saved()
    }

    /// Creates a variable, or replaces it, as it was saved.
    ///
    /// # Errors
    ///
    /// Why the robot does not take it.
    pub fn restore_variable(&mut self, saved: &SavedVariable) -> Result<(), String> {
        let value = super::variables::read_value(&saved.value)?;
        self.variables.create(&saved.name, value, saved.cyclic_id, true)
    }

    /// Saves an offline program under a number, in place of the one before. Whether its commands
    /// make sense shows when it is started.
    ///
    /// # Errors
    ///
    /// A number outside 1 to 500, or more than 13,000 commands.
    pub fn save_program(
        &mut self,
        number: u16,
        commands: Vec<MotionCommand>,
    ) -> Result<(), StoreError> {
        if number == 0 || number > MOST_PROGRAMS {
            return Err(StoreError::ProgramNumber(number));
        }
        if commands.len() > CAPACITY {
            return Err(StoreError::ProgramSize(commands.len()));
        }
        self.programs.keep(number, commands.into_iter().map(ProgramLine::Command).collect());
        Ok(())
    }

    /// The programs' numbers and their lines of text, for a caller who stores them.
    #[must_use]
    pub fn programs(&self) -> Vec<(u16, Vec<String>)> {
        let text = |line: &ProgramLine| match line {
            ProgramLine::Command(command) => command_line(command),
            ProgramLine::Text(text) => text.clone(),
        };
        let all = self.programs.by_number.iter();
        all.map(|(number, lines)| (*number, lines.iter().map(text).collect())).collect()
    }

    /// Saves lines of text as an offline program, in place of the one before. Whether they make
    /// sense shows when it is started.
    ///
    /// # Errors
    ///
    /// As for [`save_program`](Self::save_program).
    pub fn restore_program(&mut self, number: u16, lines: Vec<String>) -> Result<(), StoreError> {
        self.save_program(number, Vec::new())?;
        if lines.len() > CAPACITY {
            return Err(StoreError::ProgramSize(lines.len()));
        }
        self.programs.keep(number, lines.into_iter().map(ProgramLine::Text).collect());
        Ok(())
    }

    /// A program's commands, with the values that variables have now.
    ///
    /// # Errors
    ///
    /// 3017 where there is none, 3020 for one with a line that a program cannot hold.
    pub(super) fn program_commands(&self, number: u16) -> Result<Vec<MotionCommand>, Code> {
        let lines = self.programs.by_number.get(&number).ok_or(Code::NO_OFFLINE_PROGRAM)?;
        let command = |line: &ProgramLine| match line {
            ProgramLine::Command(command) => Some(*command),
            ProgramLine::Text(text) => self.command_of_line(text),
        };
        lines
            .iter()
            .map(command)
            .map(|found| found.filter(Self::may_be_in_program))
            .collect::<Option<Vec<_>>>()
            .ok_or(Code::OFFLINE_PROGRAM_INVALID)
    }
}
