//! What the robot says, in words: the meaning of its code, and its values with names and units.

use std::prelude::v1::*;

use super::paint::{Paint, Tone};
use crate::link::text::OwnedMessage;
use crate::wire::meca500::code::{Code, CodeInfo, CodeKind};
use crate::wire::meca500::text::value::{RobotStatus, SafetyState};
use crate::wire::meca500::text::{Message, MessageValue, RobotNumber};

/// A message for a person, or as it is.
pub(super) fn line(message: &OwnedMessage, raw: bool, paint: Paint) -> String {
    if raw {
        return printable(&message.to_string());
    }
    let message = message.as_message();
    let tone = tone(&message);
    let words = printable(&words(&message));
    let code = format!("[{:04}]", message.code.0);
    match tone {
        Tone::Plain => format!("{} {words}", paint.text(Tone::Faint, code)),
        tone => paint.text(tone, format_args!("{code} {words}")),
    }
}

/// Without what could act on a terminal.
fn printable(text: &str) -> String {
    let seen = |letter: char| if letter.is_control() { '\u{fffd}' } else { letter };
    text.chars().map(seen).collect()
}

/// Whether the message says that something is wrong with a command, the robot or its surroundings.
pub(super) fn is_trouble(message: &Message<'_>) -> bool {
    tone(message) == Tone::Error
}

fn tone(message: &Message<'_>) -> Tone {
    match message.code.describe().map(|info| info.kind) {
        Some(CodeKind::Error) => Tone::Error,
        Some(CodeKind::Safety) => match SafetyState::read(message) {
            Ok(SafetyState::Clear) => Tone::Plain,
            Ok(SafetyState::ToBeReset) => Tone::Warning,
            Ok(SafetyState::Active) | Err(_) => Tone::Error,
        },
        _ if message.code == Code(3051) => Tone::Error,
        _ if message.code == Code::CHECKPOINT_DISCARDED => Tone::Warning,
        _ => Tone::Plain,
    }
}

fn words(message: &Message<'_>) -> String {
    let body = message.body;
    let Some(info) = message.code.describe() else {
        return format!("a code that the manual does not have: {body}");
    };
    if let Ok(status) = RobotStatus::read(message) {
        return status_words(&status);
    }
    match info.kind {
        CodeKind::Safety => {
            let state = match SafetyState::read(message) {
                Ok(SafetyState::Clear) => "clear".into(),
                Ok(SafetyState::Active) => "active".into(),
                Ok(SafetyState::ToBeReset) => "gone, to be reset".into(),
                Err(_) => body.to_string(),
            };
            let remedy = if state == "clear" { String::new() } else { remedy(info) };
            format!("{state}: {}{remedy}", info.text)
        }
        CodeKind::Error => format!("{}{}{}", info.text, own_words(message, info), remedy(info)),
        CodeKind::Response | CodeKind::Monitoring => match values(message, info) {
            Some(values) => format!("{}: {values}", info.text.trim_end_matches('.')),
            None => format!("{}{}", info.text, own_words(message, info)),
        },
    }
}

fn remedy(info: &CodeInfo) -> String {
    if info.remedy.is_empty() { String::new() } else { format!(" Remedy: {}", info.remedy) }
}

/// The robot's own words, unless they say nothing that the table does not.
fn own_words(message: &Message<'_>, info: &CodeInfo) -> String {
    let body = message.body.trim();
    let same = |other: &str| body.trim_end_matches('.') == other.trim_end_matches('.');
    if body.is_empty() || same(info.message) || same(info.text) {
        return String::new();
    }
    format!(" ({body})")
}

/// The state in words: what it is, and what it is not where that stops a robot.
pub(super) fn status_words(status: &RobotStatus) -> String {
    let mut words = Vec::new();
    words.push(if status.is_activated { "activated" } else { "not activated" });
    words.push(if status.is_homed { "homed" } else { "not homed" });
    match status.simulation {
        0 => {}
        1 => words.push("simulated"),
        _ => words.push("simulated (fast)"),
    }
    if status.is_in_error {
        words.push("in error");
    }
    if status.is_paused {
        words.push("paused");
    }
    words.push(match (status.is_end_of_motion, status.is_end_of_block) {
        (true, true) => "idle",
        (true, false) => "standing, with commands in its queue",
        (false, _) => "moving",
    });
    words.join(", ")
}

/// Names of the values of a code, as its row has them: `d_{closed}, d_{open}`.
fn names(info: &CodeInfo) -> Vec<String> {
    let parts: Vec<&str> = match info.message.contains(", ") || info.message.contains('{') {
        true => info.message.split(", ").collect(),
        false => info.message.split(',').collect(),
    };
    let plain = |part: &&str| part.replace(['{', '}'], "").replace(',', "_");
    parts.iter().map(plain).collect()
}

/// The values with their names and units; `None` where the message is a text.
fn values(message: &Message<'_>, info: &CodeInfo) -> Option<String> {
    let names = names(info);
    let values: Vec<MessageValue<'_>> = message.values().collect();
    // A sentence in the table is no list of names.
    let is_list = names.iter().all(|name| !name.is_empty() && !name.contains(' '));
    if !is_list || values.is_empty() {
        return None;
    }
    if names.len() != values.len() {
        let is_open = names.iter().any(|name| name == "...");
        return is_open.then(|| message.body.to_string());
    }
    let named = names.iter().zip(&values).map(|(name, value)| {
        let value = format!("{}{}", shown(value), unit(message.code, name));
        if names.len() == 1 { value } else { format!("{name} = {value}") }
    });
    Some(named.collect::<Vec<_>>().join(", "))
}

fn shown(value: &MessageValue<'_>) -> String {
    match *value {
        MessageValue::Integer(integer) => integer.to_string(),
        MessageValue::Real(number) => RobotNumber(number).to_string(),
        MessageValue::Truth(truth) => truth.to_string(),
        MessageValue::Text(text) => text.to_string(),
        MessageValue::List(values) => {
            let values: Vec<String> = values.map(|value| shown(&value)).collect();
            format!("[{}]", values.join(", "))
        }
    }
}

/// The unit of a value by its name in the table, with a blank before it. Source: PM Tables 2 and 3, the
/// chapters of the commands.
fn unit(code: Code, name: &str) -> &'static str {
    match (code.0, name) {
        (2200..=2399, "t") => " us",
        (2116 | 2140 | 2151 | 2191, "t") => " s",
        (2192, "m") => " kg",
        (2220, "a_x" | "a_y" | "a_z") => "/16000 g",
        (2342 | 2343, _) => " kPa",
        (2154, "v") => " mm/s",
        (_, "p") => " %",
        (_, "x" | "y" | "z" | "c_x" | "c_y" | "c_z" | "r" | "d" | "d_closed" | "d_open") => " mm",
        (_, "x_dot" | "y_dot" | "z_dot") => " mm/s",
        (_, "alpha" | "beta" | "gamma") => " deg",
        _ if name.starts_with("theta") || name.starts_with("q_") => " deg",
        _ if name.starts_with("omega") => " deg/s",
        _ if name.starts_with("tau") => " %",
        _ if name.starts_with("x_") || name.starts_with("y_") || name.starts_with("z_") => " mm",
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(text: &str) -> String {
        let message = OwnedMessage::from(Message::parse(text).unwrap());
        line(&message, false, Paint { is_on: false })
    }

    #[test]
    fn values_have_names_and_units() {
        for (message, words) in [
            (
                "[2007][1,1,2,0,1,0,1]",
                "[2007] activated, homed, simulated (fast), paused, standing, with commands in its queue",
            ),
            ("[2007][0,0,0,0,0,1,1]", "[2007] not activated, not homed, idle"),
            ("[2026][1.0000,2,3,4,5,6]", "theta1 = 1 deg, theta2 = 2 deg"),
            ("[2210][1500,1,2,3,4,5,-6.5]", "t = 1500 us, theta1 = 1 deg"),
            (
                "[2204][7,1,2,3,4,5,6]",
                "x_dot = 1 mm/s, y_dot = 2 mm/s, z_dot = 3 mm/s, omega_x = 4 deg/s",
            ),
            ("[2090][2,-70,90]", "n = 2, theta_n_min = -70 deg, theta_n_max = 90 deg"),
            ("[2227][5,12]", "t = 5 us, n = 12"),
            ("[2152][25]", "[2152] Answer to GetJointVel: 25 %"),
            ("[2551][home,[1,2],10001]", "name = home, value = [1, 2], cyclicId = 10001"),
            ("[2117][2200,2210]", "2200,2210"),
            ("[2083][m500-1234]", "(m500-1234)"),
            ("[2000][Motors activated.]", "[2000] The robot is activated."),
            (
                "[3000][Connected to Meca500 R3 v11.3.84]",
                "Connected. (Connected to Meca500 R3 v11.3.84)",
            ),
            ("[4711][1,2]", "does not have: 1,2"),
        ] {
            let line = shown(message);
            assert!(line.contains(words), "{message}: {line}");
        }
    }

    #[test]
    fn errors_bring_the_robots_words_and_a_remedy() {
        let error = shown(
            "[1007][Joint over limit (200 is not in range [-70,90] for joint 2). - Command: 'MoveJoints(0,200,0,0,0,0)']",
        );
        assert!(error.contains("outside its limits") && error.contains("joint 2"), "{error}");
        assert!(error.contains("Remedy: "), "{error}");
        let stop = shown("[3032][1]");
        assert!(stop.starts_with("[3032] active: ") && stop.contains("Remedy"), "{stop}");
        assert!(!shown("[3032][0]").contains("Remedy"));
    }

    #[test]
    fn trouble_is_told_from_news() {
        let is_trouble = |text: &str| is_trouble(&Message::parse(text).unwrap());
        for text in ["[1001][x]", "[3005][x]", "[3070][1]", "[3051][x]"] {
            assert!(is_trouble(text), "{text}");
        }
        for text in ["[2000][x]", "[3070][2]", "[3086][0]", "[3040][1]", "[9999][x]"] {
            assert!(!is_trouble(text), "{text}");
        }
    }

    #[test]
    fn nothing_acts_on_the_terminal() {
        let message = OwnedMessage { code: Code(2095), body: "a\u{1b}[2Jb".into() };
        for raw in [false, true] {
            assert!(!line(&message, raw, Paint { is_on: false }).contains('\u{1b}'));
        }
    }

    #[test]
    fn colour_is_for_what_matters() {
        let paint = Paint { is_on: true };
        let line = |text: &str| line(&Message::parse(text).unwrap().into(), false, paint);
        assert!(
            line("[1005][x]").contains("\u{1b}[31m") || line("[1005][x]").contains("\u{1b}[1m")
        );
        assert!(!line("[2000][x]").contains("\u{1b}[31m"));
    }

    #[test]
    fn every_code_can_be_told() {
        for info in Code::all() {
            let message = Message { code: info.code, body: "1" };
            assert!(!words(&message).is_empty());
        }
    }
}
