//! What the robot keeps on its drive: variables with a cyclic ID, and offline programs by number.
//!
//! Both survive a reboot. Variables are created here by the person at the cell, as through the text
//! port; cyclic data can only set and use them (PM L6799). Source: PM L3998-4080, L6733-6863.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use thiserror::Error;

use super::queue::CAPACITY;
use super::robot::VirtualRobot;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::command::MotionCommand;

/// Lowest and highest cyclic ID of a variable. Source: PM L6793.
const CYCLIC_IDS: core::ops::RangeInclusive<u16> = 10_000..=19_999;
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
    /// A program number outside 1 to 500.
    #[error("program number {0} is outside 1 to 500")]
    ProgramNumber(u16),
    /// More commands than a program may hold.
    #[error("a program holds at most 13000 commands, not {0}")]
    ProgramSize(usize),
}

/// Variables with a cyclic ID: numbers and arrays of numbers.
#[derive(Clone, Debug, Default)]
pub(super) struct Variables {
    by_id: BTreeMap<u16, Vec<f32>>,
}

impl Variables {
    pub(super) fn get(&self, cyclic_id: u16) -> Option<&[f32]> {
        self.by_id.get(&cyclic_id).map(Vec::as_slice)
    }

    /// The cyclic IDs in use, ascending.
    pub(super) fn ids(&self) -> impl Iterator<Item = u16> {
        self.by_id.keys().copied()
    }

    /// Sets a variable from the arguments of a cyclic command: as many as it has elements. An array
    /// of more than six cannot be set so.
    pub(super) fn set_from_arguments(
        &mut self,
        cyclic_id: u16,
        arguments: &[f32; 6],
    ) -> Result<(), Code> {
        let failed = Code::SET_VARIABLE_FAILED;
        let values = self.by_id.get_mut(&cyclic_id).ok_or(failed)?;
        let used = arguments.get(..values.len()).ok_or(failed)?;
        if !used.iter().all(|value| value.is_finite()) {
            return Err(failed);
        }
        values.copy_from_slice(used);
        Ok(())
    }
}

/// Offline programs by number.
#[derive(Clone, Debug, Default)]
pub(super) struct Programs {
    by_number: BTreeMap<u16, Vec<MotionCommand>>,
}

impl Programs {
    /// The program's commands.
    ///
    /// # Errors
    ///
    /// 3017 where there is none, 3020 for one with a command that a program cannot hold.
    pub(super) fn get(&self, number: u16) -> Result<&[MotionCommand], Code> {
        let commands = self.by_number.get(&number).ok_or(Code::NO_OFFLINE_PROGRAM)?;
        if commands.iter().all(VirtualRobot::may_be_in_program) {
            Ok(commands)
        } else {
            Err(Code::OFFLINE_PROGRAM_INVALID)
        }
    }
}

impl VirtualRobot {
    /// Creates a variable: one number, or an array of numbers.
    ///
    /// # Errors
    ///
    /// A cyclic ID out of range or taken, or no numbers.
    pub fn create_variable(&mut self, cyclic_id: u16, values: &[f32]) -> Result<(), StoreError> {
        if !CYCLIC_IDS.contains(&cyclic_id) {
            return Err(StoreError::CyclicId(cyclic_id));
        }
        if self.variables.by_id.contains_key(&cyclic_id) {
            return Err(StoreError::Taken(cyclic_id));
        }
        if values.is_empty() {
            return Err(StoreError::Empty);
        }
        self.variables.by_id.insert(cyclic_id, values.to_vec());
        Ok(())
    }

    /// Sets a variable to as many numbers as it holds.
    ///
    /// # Errors
    ///
    /// No such variable, or another number of values.
    pub fn set_variable(&mut self, cyclic_id: u16, values: &[f32]) -> Result<(), StoreError> {
        let Some(variable) = self.variables.by_id.get_mut(&cyclic_id) else {
            return Err(StoreError::NoVariable(cyclic_id));
        };
        if variable.len() != values.len() {
            let (expected, found) = (variable.len(), values.len());
            return Err(StoreError::Size { expected, found });
        }
        variable.copy_from_slice(values);
        Ok(())
    }

    /// The variable's numbers.
    #[must_use]
    pub fn variable(&self, cyclic_id: u16) -> Option<&[f32]> {
        self.variables.get(cyclic_id)
    }

    /// Deletes a variable. Returns whether it was there.
    pub fn delete_variable(&mut self, cyclic_id: u16) -> bool {
        self.variables.by_id.remove(&cyclic_id).is_some()
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
        self.programs.by_number.insert(number, commands);
        Ok(())
    }
}
