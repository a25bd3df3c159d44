//! What the vendor's client sends and reads beyond the manual: commands with one JSON object as their
//! argument, and messages about variables that are JSON themselves.
//!
//! ```text
//! CreateVariable({"data": {"name": "a", "val": 1, "cyclicId": null, ...}, "metaData": null})
//! {"code":3310,"data":{"vars":{"a":{"val":1,"type":0,"volatile":false,"cyclicId":null}}},"metaData":null}
//! ```
//!
//! Left out: its other commands (EnableJsonMode and what it brings), which are answered with 1001 and
//! which it does without; "volatile", so that every variable survives a boot. Source: client

use alloc::string::{String, ToString};

use serde_json::{Map, Value, json};

use super::dispatch::Refused;
use super::format as text_format;
use super::log::LogKind;
use crate::sim::meca500::robot::VirtualRobot;
use crate::sim::meca500::variables::check_value;
use crate::wire::meca500::code::Code;

/// Variables were created or set.
const VARIABLES_ADDED: u16 = 3310;
/// Variables were deleted.
const VARIABLES_REMOVED: u16 = 3311;
/// Answer to SetVariablesMonitoring.
const VARIABLES_MONITORED: Code = Code(2555);

/// Name and data of a command whose only argument is a JSON object.
fn json_command(line: &str) -> Option<(&str, Value)> {
    let (name, rest) = line.split_once('(')?;
    let body = rest.trim_end().strip_suffix(')')?;
    if !body.trim_start().starts_with('{') {
        return None;
    }
    let Value::Object(mut object) = serde_json::from_str(body).ok()? else { return None };
    Some((name.trim_start_matches('-').trim(), object.remove("data")?))
}

impl VirtualRobot {
    /// Acts on a line that only the vendor's client sends; `None` for any other line.
    pub(super) fn client_command(&mut self, line: &str) -> Option<Result<(), Refused>> {
        if let Some(rest) = line.trim_start_matches('-').strip_prefix("SetVariablesMonitoring(") {
            return match rest.trim_end_matches(')').trim() {
                "0" => Some(self.monitor_variables(false)),
                "1" => Some(self.monitor_variables(true)),
                _ => Some(Err(Code::ARGUMENT_ERROR.into())),
            };
        }
        let (name, data) = json_command(line)?;
        let text = |key: &str| data.get(key).and_then(Value::as_str).unwrap_or("");
        let value = data.get("val").cloned().unwrap_or(Value::Null);
        Some(match name {
            "CreateVariable" => {
                let overrides =
                    data.get("override").is_some_and(|value| value == true || *value == 1);
                let cyclic_id = data.get("cyclicId").and_then(Value::as_u64).unwrap_or(0);
                match u16::try_from(cyclic_id) {
                    Ok(cyclic_id) => check_value(value)
                        .map_err(|why| Refused::Because(Code::CREATE_VARIABLE_FAILED, why))
                        .and_then(|value| {
                            self.create_variable_now(text("name"), value, cyclic_id, overrides)
                        }),
                    Err(_) => Err(Code::ARGUMENT_ERROR.into()),
                }
            }
            "SetVariable" => check_value(value)
                .map_err(|why| Refused::Because(Code::SET_VARIABLE_FAILED, why))
                .and_then(|value| self.set_variable_now(text("name"), value)),
            "DeleteVariable" => self.delete_variable_now(text("name")),
            "ConnectionWatchdog" => match data.get("timeout").and_then(Value::as_f64) {
                Some(seconds) if seconds == 0.0 || (0.001..=4_294_967.5).contains(&seconds) => {
                    self.set_watchdog(seconds as f32);
                    Ok(())
                }
                _ => Err(Code::ARGUMENT_ERROR.into()),
            },
            "LogTrace" => {
                self.write_log(LogKind::Trace, text("trace"));
                self.answer(Code::COMMAND_SUCCESSFUL, &text_format::success("LogTrace"));
                Ok(())
            }
            _ => return None,
        })
    }

    /// SetVariablesMonitoring: from now on the control port is told of variables, of all there are
    /// first.
    fn monitor_variables(&mut self, is_on: bool) -> Result<(), Refused> {
        self.text.tells_variables = is_on;
        self.answer(VARIABLES_MONITORED, if is_on { "1" } else { "0" });
        let _ = self.variables.take_changed();
        if is_on {
            let names: alloc::vec::Vec<String> = self.variables.names().map(String::from).collect();
            self.tell_variables_of(names);
        }
        Ok(())
    }

    /// Tells the control port which variables have changed since the last time.
    pub(super) fn tell_variables(&mut self) {
        let changed = self.variables.take_changed();
        if self.text.tells_variables && !changed.is_empty() {
            self.tell_variables_of(changed);
        }
    }

    fn tell_variables_of(&mut self, names: impl IntoIterator<Item = String>) {
        let (mut added, mut removed) = (Map::new(), Map::new());
        for name in names {
            match self.variables.by_name(&name) {
                Some((value, cyclic_id)) => {
                    let cyclic_id = (cyclic_id != 0).then_some(cyclic_id);
                    let entry = json!({
                        "val": value, "type": 0, "volatile": false, "cyclicId": cyclic_id,
                    });
                    added.insert(name, entry);
                }
                None => drop(removed.insert(name, Value::Null)),
            }
        }
        for (code, vars) in [(VARIABLES_ADDED, added), (VARIABLES_REMOVED, removed)] {
            if !vars.is_empty() && self.text.has_control() {
                let message = json!({ "code": code, "data": { "vars": vars }, "metaData": null });
                self.text.control.push(message.to_string());
            }
        }
    }
}
