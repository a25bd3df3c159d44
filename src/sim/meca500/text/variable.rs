//! Commands for variables, and variables as arguments. Source: PM L6711-7035.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use serde_json::Value as Json;

use super::control::{first_text, plain};
use super::dispatch::Refused;
use super::format::joined;
use crate::sim::meca500::robot::VirtualRobot;
use crate::sim::meca500::variables::{numbers_of, read_value};
use crate::wire::meca500::code::Code;
use crate::wire::meca500::text::{ParsedCommand, Value};

/// Length of a line with the values of its variables, which no server has looked at.
const MOST_LINE_BYTES: usize = 65_536;

impl VirtualRobot {
    /// A command of the variables' chapter.
    pub(super) fn variable_command(&mut self, parsed: &ParsedCommand<'_>) -> Result<(), Refused> {
        let name = first_text(parsed);
        match parsed.spec.name {
            "ListVariables" => {
                let names = joined(self.variables.names());
                self.answer(Code(2550), &names);
            }
            "GetVariable" => {
                let Some((value, cyclic_id)) = self.variables.by_name(name) else {
                    let why = format!("Variable '{name}' does not exist");
                    return Err(Refused::Because(Code::GET_VARIABLE_FAILED, why));
                };
                let content = format!("{name},{value},{cyclic_id}");
                self.answer(Code(2551), &content);
            }
            "CreateVariable" => self.create_by_text(parsed, name)?,
            "DeleteVariable" => self.delete_variable_now(name)?,
            "SetVariable" => {
                let failed = |why| Refused::Because(Code::SET_VARIABLE_FAILED, why);
                let value = self.value_argument(parsed).map_err(failed)?;
                self.set_variable_now(name, value)?;
            }
            _ => return Err(Code::UNKNOWN_COMMAND.into()),
        }
        Ok(())
    }

    fn create_by_text(&mut self, parsed: &ParsedCommand<'_>, name: &str) -> Result<(), Refused> {
        let failed = |why| Refused::Because(Code::CREATE_VARIABLE_FAILED, why);
        let value = self.value_argument(parsed).map_err(failed)?;
        let [_, _, cyclic_id, overrides, ..] = parsed.numbers();
        self.create_variable_now(name, value, cyclic_id as u16, overrides == 1.0)
    }

    /// CreateVariable.
    pub(super) fn create_variable_now(
        &mut self,
        name: &str,
        value: Json,
        cyclic_id: u16,
        overrides: bool,
    ) -> Result<(), Refused> {
        let failed = |why| Refused::Because(Code::CREATE_VARIABLE_FAILED, why);
        self.variables.create(name, value, cyclic_id, overrides).map_err(failed)?;
        self.tell_variables();
        // What is there now: without override an existing variable is left as it was.
        let kept = self.variables.by_name(name).map_or(Json::Null, |(value, _)| value.clone());
        let content = format!("{name},{kept},{cyclic_id},{}", u8::from(overrides));
        self.answer(Code(2552), &content);
        Ok(())
    }

    /// SetVariable.
    pub(super) fn set_variable_now(&mut self, name: &str, value: Json) -> Result<(), Refused> {
        let content = format!("{name},{value}");
        let failed = |why| Refused::Because(Code::SET_VARIABLE_FAILED, why);
        self.variables.set(name, value).map_err(failed)?;
        self.tell_variables();
        self.answer(Code(2554), &content);
        Ok(())
    }

    /// DeleteVariable.
    pub(super) fn delete_variable_now(&mut self, name: &str) -> Result<(), Refused> {
        if !self.variables.delete(name) {
            let why = format!("Cannot delete variable {name} (not found)");
            return Err(Refused::Because(Code::DELETE_VARIABLE_FAILED, why));
        }
        self.tell_variables();
        self.answer(Code(2553), name);
        Ok(())
    }

    /// The second argument: JSON, or another variable's value.
    fn value_argument(&self, parsed: &ParsedCommand<'_>) -> Result<Json, String> {
        let argument = parsed.arguments().nth(1);
        let argument = argument.ok_or_else(|| String::from("the value is missing"))?;
        match argument.value() {
            Value::Variable { name, unrolled: false } => match self.variables.by_name(name) {
                Some((value, _)) => Ok(value.clone()),
                None => Err(format!("variable '{name}' does not exist")),
            },
            _ => read_value(argument.text),
        }
    }

    /// The second argument as Reals, if it is a number or an array of numbers.
    pub(super) fn numbers_argument(&self, parsed: &ParsedCommand<'_>) -> Option<Vec<f32>> {
        self.value_argument(parsed).ok().and_then(|value| numbers_of(&value))
    }

    /// A command's line with the values of the variables among its arguments.
    ///
    /// # Errors
    ///
    /// 1003 for a variable that is not there, an array that is not unrolled, an unrolled one that is
    /// no array.
    pub(super) fn with_values(
        &self,
        line: &str,
        parsed: &ParsedCommand<'_>,
    ) -> Result<String, Refused> {
        let unusable = Refused::Code(Code::ARGUMENT_ERROR);
        let mut resolved = String::new();
        let mut copied = 0;
        for argument in parsed.arguments() {
            let Value::Variable { name, unrolled } = argument.value() else { continue };
            let (value, _) = self.variables.by_name(name).ok_or(unusable.clone())?;
            let text = match (value, unrolled) {
                (Json::Array(elements), true) => joined(elements),
                (Json::Array(_), false) | (_, true) => return Err(unusable),
                (single, false) => format!("{single}"),
            };
            resolved.push_str(line.get(copied..argument.offset).unwrap_or(""));
            resolved.push_str(&text);
            copied = argument.offset + argument.text.len();
            if resolved.len() > MOST_LINE_BYTES {
                return Err(unusable);
            }
        }
        resolved.push_str(line.get(copied..).unwrap_or(""));
        Ok(resolved)
    }

    /// The cyclic ID of the variable that the first argument names; only such a variable can be set
    /// by a program.
    pub(super) fn cyclic_id_of(&self, parsed: &ParsedCommand<'_>) -> Option<u16> {
        let (_, cyclic_id) = self.variables.by_name(plain(&parsed.arguments().next()?))?;
        (cyclic_id != 0).then_some(cyclic_id)
    }
}
