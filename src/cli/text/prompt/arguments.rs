//! Arguments of commands for people: how a command looks, and what an argument may be.

use std::prelude::v1::*;

use crate::wire::meca500::command::Allowed;
use crate::wire::meca500::revision::Revision;
use crate::wire::meca500::text::{TextArgumentKind, TextArgumentSpec, TextCommandSpec};

/// `SetTorqueLimitsCfg(l, m)`; what may be left out stands in brackets.
pub(super) fn signature(spec: &TextCommandSpec) -> String {
    let names: Vec<String> = spec
        .arguments()
        .map(|argument| match argument.optional {
            true => format!("[{}]", argument.name),
            false => argument.name.to_string(),
        })
        .collect();
    if names.is_empty() {
        spec.name.to_string()
    } else {
        format!("{}({})", spec.name, names.join(", "))
    }
}

/// What an argument may be, with its unit.
pub(super) fn allowed(argument: &TextArgumentSpec, revision: Revision) -> String {
    match argument.kind {
        TextArgumentKind::Number(range) => {
            format!("{}", Allowed::Range { range, unit: argument.unit, revision })
        }
        TextArgumentKind::Whole { min, max } => {
            format!("an integer from {min} to {max}{}", argument.unit.suffix())
        }
        TextArgumentKind::Text { max_chars: Some(most) } => {
            format!("a text of {most} characters at most")
        }
        TextArgumentKind::Text { max_chars: None } => "a text".into(),
        TextArgumentKind::Json => "true, false, a number, \"a text\" or [a list]".into(),
        TextArgumentKind::List => "codes or names, as many as wanted".into(),
    }
}

/// `theta2: -70 to 90 deg`, with the value in force without the command.
pub(super) fn described(argument: &TextArgumentSpec, revision: Revision) -> String {
    let optional = if argument.optional { " (may be left out)" } else { "" };
    let default = match argument.default {
        Some(value) => format!(", {value}{} at first", argument.unit.suffix()),
        None => String::new(),
    };
    format!("{}: {}{default}{optional}", argument.name, allowed(argument, revision))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(name: &str) -> &'static TextCommandSpec {
        TextCommandSpec::by_name(name).unwrap()
    }

    #[test]
    fn commands_are_shown_as_they_are_typed() {
        assert_eq!(signature(spec("Home")), "Home");
        assert_eq!(signature(spec("ActivateSim")), "ActivateSim([m])");
        assert_eq!(
            signature(spec("CreateVariable")),
            "CreateVariable(name, value, [cyclicId], [override])"
        );
    }

    #[test]
    fn every_argument_can_be_described() {
        for argument in TextCommandSpec::all().flat_map(TextCommandSpec::arguments) {
            let text = described(&argument, Revision::R4);
            assert!(text.len() > argument.name.len() + 4, "{text}");
        }
        let blending = spec("SetBlending").arguments().next().unwrap();
        assert_eq!(described(&blending, Revision::R3), "p: 0 to 100 %, 100 % at first");
    }
}
