//! Robot variables: named values on the robot's drive, some with a cyclic ID.
//!
//! The text port creates, sets, lists and deletes them by name; cyclic data sets and reads those with
//! a cyclic ID, which are numbers and arrays of numbers. They survive a reboot.
//!
//! Invariants: a cyclic ID belongs to one variable at most, and that one is a number or an array of
//! numbers; all numbers are finite. Limits, chosen: [`MOST_VARIABLES`], [`MOST_NAME_BYTES`],
//! [`MOST_VALUE_BYTES`]. Source: PM L6711-7035.

use alloc::collections::{BTreeMap, BTreeSet};
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

use serde_json::{Number, Value};

use crate::wire::meca500::code::Code;

/// Lowest and highest cyclic ID of a variable. Source: PM L6793.
pub(super) const CYCLIC_IDS: core::ops::RangeInclusive<u16> = 10_000..=19_999;
/// Variables the drive holds.
const MOST_VARIABLES: usize = 10_000;
/// Length of a name.
const MOST_NAME_BYTES: usize = 128;
/// Length of a value as JSON.
const MOST_VALUE_BYTES: usize = 16_384;

/// A variable as a caller stores it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SavedVariable {
    /// Its name.
    pub name: String,
    /// Its value as JSON.
    pub value: String,
    /// Its cyclic ID, 10000 to 19999; 0 for none.
    pub cyclic_id: u16,
}

#[derive(Clone, Debug)]
struct Variable {
    value: Value,
    cyclic_id: u16,
    /// The value as cyclic data see it; empty without a cyclic ID.
    numbers: Vec<f32>,
}

/// All variables.
#[derive(Clone, Debug, Default)]
pub(super) struct Variables {
    by_name: BTreeMap<String, Variable>,
    names: BTreeMap<u16, String>,
    /// Names of what was created, set or deleted since somebody asked.
    changed: BTreeSet<String>,
    /// How often one was created, set or deleted.
    revision: u64,
}

/// Reads a value: a boolean, a number, a text or an array of such; no object, no null.
pub(super) fn read_value(json: &str) -> Result<Value, String> {
    if json.len() > MOST_VALUE_BYTES {
        return Err(format!("the value is longer than {MOST_VALUE_BYTES} characters"));
    }
    let value: Value =
        serde_json::from_str(json).map_err(|error| format!("the value is not JSON: {error}"))?;
    check_value(value)
}

/// The value, if a variable can hold it.
pub(super) fn check_value(value: Value) -> Result<Value, String> {
    if is_basic(&value) { Ok(value) } else { Err("objects and null are no values".into()) }
}

fn is_basic(value: &Value) -> bool {
    match value {
        Value::Null | Value::Object(_) => false,
        Value::Bool(_) | Value::Number(_) | Value::String(_) => true,
        Value::Array(elements) => elements.iter().all(is_basic),
    }
}

/// Whether two values are of the same type; of arrays only with `deeply` the elements count too.
fn same_type(one: &Value, other: &Value, deeply: bool) -> bool {
    match (one, other) {
        (Value::Array(one), Value::Array(other)) => {
            !deeply
                || (one.len() == other.len()
                    && one.iter().zip(other).all(|(one, other)| same_type(one, other, true)))
        }
        _ => core::mem::discriminant(one) == core::mem::discriminant(other),
    }
}

/// A number, or an array of numbers that is not empty, as Reals.
pub(super) fn numbers_of(value: &Value) -> Option<Vec<f32>> {
    let real = |value: &Value| {
        let real = value.as_f64()? as f32;
        real.is_finite().then_some(real)
    };
    match value {
        Value::Array(elements) if !elements.is_empty() => elements.iter().map(real).collect(),
        Value::Number(_) => real(value).map(|real| [real].to_vec()),
        _ => None,
    }
}

/// A Real as the number that its shortest decimals say: 0.1 stays 0.1.
pub(super) fn number_of(real: f32) -> Value {
    let shortest: f64 = real.to_string().parse().unwrap_or(0.0);
    Number::from_f64(shortest).map_or(Value::from(0), Value::Number)
}

fn is_name(name: &str) -> bool {
    let is_part = |part: &str| {
        let is_letter = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
        part.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
            && part.chars().all(is_letter)
    };
    name.len() <= MOST_NAME_BYTES && name.split('.').all(is_part)
}

impl Variables {
    /// The numbers of the variable with a cyclic ID.
    pub(super) fn get(&self, cyclic_id: u16) -> Option<&[f32]> {
        let name = self.names.get(&cyclic_id)?;
        self.by_name.get(name).map(|variable| variable.numbers.as_slice())
    }

    /// The cyclic IDs in use, ascending.
    pub(super) fn ids(&self) -> impl Iterator<Item = u16> {
        self.names.keys().copied()
    }

    /// The names, in their order.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.by_name.keys().map(String::as_str)
    }

    /// Value and cyclic ID by name.
    pub(super) fn by_name(&self, name: &str) -> Option<(&Value, u16)> {
        self.by_name.get(name).map(|variable| (&variable.value, variable.cyclic_id))
    }

    /// Every variable.
    pub(super) fn saved(&self) -> Vec<SavedVariable> {
        let save = |(name, variable): (&String, &Variable)| SavedVariable {
            name: name.clone(),
            value: variable.value.to_string(),
            cyclic_id: variable.cyclic_id,
        };
        self.by_name.iter().map(save).collect()
    }

    /// CreateVariable; `Err` tells why not.
    pub(super) fn create(
        &mut self,
        name: &str,
        value: Value,
        cyclic_id: u16,
        overrides: bool,
    ) -> Result<(), String> {
        if !is_name(name) {
            return Err(format!("'{name}' cannot be the name of a variable"));
        }
        if cyclic_id != 0 && !CYCLIC_IDS.contains(&cyclic_id) {
            return Err(format!("cyclic ID {cyclic_id} is neither 0 nor from 10000 to 19999"));
        }
        let numbers = numbers_of(&value);
        if cyclic_id != 0 && numbers.is_none() {
            return Err("a cyclic ID needs a number or an array of numbers".into());
        }
        if let Some(other) = self.names.get(&cyclic_id)
            && other != name
        {
            return Err(format!("cyclic ID {cyclic_id} is already used by variable {other}"));
        }
        match self.by_name.get(name) {
            Some(old) if !overrides => {
                return if same_type(&old.value, &value, false) && old.cyclic_id == cyclic_id {
                    Ok(())
                } else {
                    Err(format!("variable {name} exists with another type or cyclic ID"))
                };
            }
            Some(old) => {
                self.names.remove(&old.cyclic_id);
            }
            None if self.by_name.len() >= MOST_VARIABLES => {
                return Err(format!("the robot holds {MOST_VARIABLES} variables at most"));
            }
            None => {}
        }
        if cyclic_id != 0 {
            self.names.insert(cyclic_id, name.into());
        }
        self.note_change(name);
        let numbers = numbers.filter(|_| cyclic_id != 0).unwrap_or_default();
        self.by_name.insert(name.into(), Variable { value, cyclic_id, numbers });
        Ok(())
    }

    /// SetVariable by name; `Err` tells why not.
    pub(super) fn set(&mut self, name: &str, value: Value) -> Result<(), String> {
        let Some(variable) = self.by_name.get_mut(name) else {
            return Err(format!("variable {name} does not exist"));
        };
        if !same_type(&variable.value, &value, true) {
            return Err(format!("variable {name} is of another type or array length"));
        }
        if variable.cyclic_id != 0 {
            variable.numbers =
                numbers_of(&value).ok_or_else(|| String::from("a number is too large"))?;
        }
        variable.value = value;
        self.note_change(name);
        Ok(())
    }

    /// Sets the variable with a cyclic ID to as many numbers as it holds. Returns whether it could be.
    pub(super) fn set_numbers(&mut self, cyclic_id: u16, values: &[f32]) -> bool {
        let Some(variable) = self.names.get(&cyclic_id).and_then(|name| self.by_name.get_mut(name))
        else {
            return false;
        };
        if variable.numbers.len() != values.len() || !values.iter().all(|value| value.is_finite()) {
            return false;
        }
        variable.numbers.copy_from_slice(values);
        match &mut variable.value {
            Value::Array(elements) => {
                for (element, value) in elements.iter_mut().zip(values) {
                    *element = number_of(*value);
                }
            }
            single => *single = values.first().map_or(Value::from(0), |value| number_of(*value)),
        }
        if let Some(name) = self.names.get(&cyclic_id).cloned() {
            self.note_change(&name);
        }
        true
    }

    /// DeleteVariable. Returns whether it was there.
    pub(super) fn delete(&mut self, name: &str) -> bool {
        let removed = self.by_name.remove(name);
        if let Some(variable) = &removed {
            self.names.remove(&variable.cyclic_id);
            self.note_change(name);
        }
        removed.is_some()
    }

    /// Names beyond as many as there may be variables are not kept: nobody asks.
    fn note_change(&mut self, name: &str) {
        self.revision = self.revision.wrapping_add(1);
        if self.changed.len() < MOST_VARIABLES {
            self.changed.insert(name.into());
        }
    }

    /// A number that grows with every change.
    pub(super) const fn revision(&self) -> u64 {
        self.revision
    }

    /// The names of what has changed since the last call.
    pub(super) fn take_changed(&mut self) -> BTreeSet<String> {
        core::mem::take(&mut self.changed)
    }

    /// Deletes the variable with a cyclic ID. Returns whether it was there.
    pub(super) fn delete_by_id(&mut self, cyclic_id: u16) -> bool {
        match self.names.get(&cyclic_id).cloned() {
            Some(name) => self.delete(&name),
            None => false,
        }
    }

    /// Sets a variable from the arguments of a cyclic command: as many as it has elements. An array
    /// of more than six cannot be set so.
    pub(super) fn set_from_arguments(
        &mut self,
        cyclic_id: u16,
        arguments: &[f32; 6],
    ) -> Result<(), Code> {
        let failed = Code::SET_VARIABLE_FAILED;
        let count = self.get(cyclic_id).ok_or(failed)?.len();
        let used = arguments.get(..count).ok_or(failed)?;
        if self.set_numbers(cyclic_id, used) { Ok(()) } else { Err(failed) }
    }
}
