//! `:help`: the prompt's own commands, and what is known of each of the robot's.

use std::prelude::v1::*;

use super::arguments;
use super::entry::{AS_IT_IS, BUILT_INS};
use crate::wire::meca500::code::Code;
use crate::wire::meca500::revision::Revision;
use crate::wire::meca500::text::{
    AllowedState, Category, CyclicEquivalent, TextCommandSpec, Timing,
};

/// What there is.
pub(super) fn overview() -> String {
    let mut lines = vec![
        "Type a command of the robot, as MoveJoints(0,10,-10,0,20,0); Tab completes names.".into(),
    ];
    lines.push(format!("  {AS_IT_IS}LINE      sends a line as it is, without a look at it"));
    for (name, what) in BUILT_INS {
        lines.push(format!("  {name:<9}  {what}"));
    }
    for (category, title) in [
        (Category::Control, "Control"),
        (Category::Motion, "Motion"),
        (Category::RealTime, "Real-time data"),
        (Category::Data, "Settings"),
        (Category::WorkZone, "Work zone and collisions"),
        (Category::Accessory, "Tools"),
        (Category::Variable, "Variables"),
    ] {
        let names: Vec<_> = TextCommandSpec::all()
            .filter(|spec| spec.category == category && spec.available != Some(false))
            .map(|spec| spec.name)
            .collect();
        lines.push(format!("{title}: {}", names.join(" ")));
    }
    lines.join("\n")
}

/// What is known of one command, by its name in any case; an error in words otherwise.
pub(super) fn of(name: &str, revision: Revision) -> Result<String, String> {
    let name = name.split('(').next().unwrap_or(name).trim();
    let mut all = TextCommandSpec::all();
    let Some(spec) = all.find(|spec| spec.name.eq_ignore_ascii_case(name)) else {
        let near: Vec<_> = super::assist::matching(name).map(|spec| spec.name).collect();
        let near = if near.is_empty() { String::new() } else { format!(": {}", near.join(" ")) };
        return Err(format!("there is no command `{name}`{near}"));
    };
    let mut lines = vec![arguments::signature(spec)];
    for argument in spec.arguments() {
        lines.push(format!("  {}", arguments::described(&argument, revision)));
    }
    lines.push(format!("  {}", when(spec)));
    if spec.available == Some(false) {
        lines.push("  No Meca500 has it.".into());
    }
    tell_codes(&mut lines, "answers", spec.answers().iter().copied());
    tell_codes(&mut lines, "later", spec.later_messages().iter().copied());
    tell_codes(&mut lines, "errors", spec.errors());
    if spec.is_persistent() {
        lines.push("  What it sets survives a restart.".into());
    }
    if !matches!(spec.equivalent, CyclicEquivalent::None | CyclicEquivalent::Unavailable) {
        lines.push(format!("  On cyclic buses: {}.", spec.equivalent));
    }
    lines.push(format!(
        "  Source: PM L{}, a line of the text of the programming manual 11.3.84.",
        spec.manual_line
    ));
    Ok(lines.join("\n"))
}

fn tell_codes(lines: &mut Vec<String>, what: &str, codes: impl Iterator<Item = Code>) {
    for code in codes {
        let text = code.describe().map_or("", |info| info.text);
        lines.push(format!("  {what}: [{}] {text}", code.0));
    }
}

fn when(spec: &TextCommandSpec) -> String {
    let timing = match spec.timing {
        Timing::Queued => "Waits in the queue",
        Timing::Instantaneous => "Executed at once",
        Timing::NotStated => "Queued or at once: the manual does not tell",
    };
    let state = match spec.allowed_state() {
        AllowedState::Any => "in any state",
        AllowedState::Deactivated => "while the robot is deactivated",
        AllowedState::Activated => "while it is activated",
        AllowedState::Ready => "while it is activated, and homed or in recovery mode",
        AllowedState::ReadyAndFree => {
            "while it is activated, homed or in recovery mode, without error and stop signal"
        }
        AllowedState::HomedAndFree => "while it is activated, homed, without error and stop signal",
        AllowedState::Saving => "while a program is being saved",
        AllowedState::NotStated => "in a state that the manual does not tell",
    };
    format!("{timing}, {state}.")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_has_its_help_with_the_source() {
        let overview = overview();
        for spec in TextCommandSpec::all() {
            let help = of(&spec.name.to_lowercase(), Revision::R3).unwrap();
            assert!(help.starts_with(spec.name), "{help}");
            assert!(help.contains(&format!("PM L{},", spec.manual_line)), "{help}");
            let words = overview.split_whitespace().any(|word| word == spec.name);
            assert_eq!(words, spec.available != Some(false), "{}", spec.name);
        }
    }

    #[test]
    fn a_command_is_told_with_arguments_and_answers() {
        let help = of("SetTorqueLimitsCfg", Revision::R3).unwrap();
        assert!(
            help.contains("SetTorqueLimitsCfg(") && help.contains("Waits in the queue"),
            "{help}"
        );
        let help = of("home()", Revision::R3).unwrap();
        assert!(help.contains("answers: [2002] The robot is homed."), "{help}");
        assert!(help.contains("RobotControl.Home"), "{help}");
    }

    #[test]
    fn an_unknown_name_brings_those_that_begin_so() {
        let error = of("movel", Revision::R3).unwrap_err();
        assert!(error.contains("MoveLin MoveLinRelTrf"), "{error}");
        assert_eq!(of("xyz", Revision::R3).unwrap_err(), "there is no command `xyz`");
    }
}
