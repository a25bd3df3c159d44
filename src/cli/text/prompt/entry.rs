//! What a line is that somebody typed: a command for the robot, one for the prompt, or a mistake.

use std::prelude::v1::*;

use super::arguments;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::revision::Revision;
use crate::wire::meca500::text::{
    SyntaxErrorReason, TextCommandSpec, error_code, parse_line, without_comment,
};

/// Begins a line that is sent as it is.
pub(super) const AS_IT_IS: char = '!';

/// A line, and what is to be done with it.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Entry<'a> {
    /// Blanks or a comment.
    Nothing,
    /// For the prompt: what stands behind the colon.
    BuiltIn(BuiltIn<'a>),
    /// For the robot, without a comment.
    Command {
        text: &'a str,
        /// `None` for what no table knows.
        spec: Option<&'static TextCommandSpec>,
    },
    /// The robot would refuse it.
    Mistake(Mistake),
}

/// A command of the prompt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BuiltIn<'a> {
    Help(Option<&'a str>),
    State,
    Quit,
    Unknown(&'a str),
}

/// Names of the prompt's own commands, with what they do.
pub(super) const BUILT_INS: [(&str, &str); 3] = [
    (":help", "what there is; with the name of a command, its arguments and answers"),
    (":state", "what the robot has told of its state"),
    (":quit", "ends; Ctrl-D does too"),
];

/// What to say of a command of the prompt that there is none of.
pub(super) fn unknown_built_in(text: &str) -> String {
    format!("there is no `:{text}`; there are {}", BUILT_INS.map(|(name, _)| name).join(", "))
}

/// Why the robot would refuse a line, and what would be right.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Mistake {
    /// What the robot would answer.
    pub(super) code: Code,
    /// Column of the offending text in characters, from 1.
    pub(super) column: usize,
    /// What is wrong there, and what it should be.
    pub(super) why: String,
    /// The command as it should look.
    pub(super) right: Option<String>,
}

impl Mistake {
    /// In words, without the line itself.
    pub(super) fn words(&self) -> String {
        let right = match &self.right {
            Some(right) => format!("\n  it is: {right}"),
            None => String::new(),
        };
        format!(
            "not sent: column {}: {}{right}\n  the robot would refuse it with [{}]; begin the line with {AS_IT_IS} \
             to send it as it is",
            self.column, self.why, self.code.0
        )
    }
}

fn built_in(text: &str) -> BuiltIn<'_> {
    let (name, argument) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    let argument = Some(argument.trim()).filter(|argument| !argument.is_empty());
    match (name, argument) {
        ("help" | "h" | "?", argument) => BuiltIn::Help(argument),
        ("state" | "s", None) => BuiltIn::State,
        ("quit" | "q" | "exit", None) => BuiltIn::Quit,
        _ => BuiltIn::Unknown(text),
    }
}

/// The command that a line names, whatever the rest of it.
fn named(text: &str) -> Option<&'static TextCommandSpec> {
    let text = text.trim_start().trim_start_matches('-').trim_start();
    let end = text.find(|letter: char| !(letter.is_ascii_alphanumeric() || letter == '_'));
    TextCommandSpec::by_name(text.split_at(end.unwrap_or(text.len())).0)
}

/// Tells what a line is, for a robot of this revision.
pub(super) fn read(line: &str, revision: Revision) -> Entry<'_> {
    let trimmed = line.trim();
    if let Some(text) = trimmed.strip_prefix(AS_IT_IS) {
        let text = text.trim();
        return if text.is_empty() {
            Entry::Nothing
        } else {
            Entry::Command { text, spec: named(text) }
        };
    }
    if let Some(text) = trimmed.strip_prefix(':') {
        return Entry::BuiltIn(built_in(text.trim()));
    }
    let parsed = match parse_line(line, revision) {
        Ok(None) => return Entry::Nothing,
        Ok(Some(parsed)) => parsed,
        Err(error) => {
            let right = match error.reason {
                SyntaxErrorReason::UnknownCommand { suggestion, .. } => suggestion,
                _ => named(line).map(|spec| spec.name),
            };
            let right = right.and_then(TextCommandSpec::by_name).map(arguments::signature);
            let (code, column) = (error_code(&error), error.column);
            return Entry::Mistake(Mistake { code, column, why: format!("{error}"), right });
        }
    };
    if parsed.spec.available == Some(false) {
        let why = format!("{} is for other robots, no Meca500 has it", parsed.spec.name);
        let (code, column) = (Code::UNKNOWN_COMMAND, parsed.column);
        return Entry::Mistake(Mistake { code, column, why, right: None });
    }
    Entry::Command { text: without_comment(line).trim(), spec: Some(parsed.spec) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mistake(line: &str) -> Mistake {
        match read(line, Revision::R3) {
            Entry::Mistake(mistake) => mistake,
            other => unreachable!("{line}: {other:?}"),
        }
    }

    fn sent(line: &str) -> &str {
        match read(line, Revision::R3) {
            Entry::Command { text, .. } => text,
            other => unreachable!("{line}: {other:?}"),
        }
    }

    #[test]
    fn good_lines_go_as_they_are_without_comments() {
        assert_eq!(sent("Home"), "Home");
        assert_eq!(sent("  -GetStatusRobot() // how is it"), "-GetStatusRobot()");
        assert_eq!(sent("MoveJoints(0,10,-10,0,20,0) # there"), "MoveJoints(0,10,-10,0,20,0)");
        assert_eq!(read("  # nothing", Revision::R3), Entry::Nothing);
        assert_eq!(read("!", Revision::R3), Entry::Nothing);
    }

    #[test]
    fn the_exclamation_mark_sends_anything() {
        assert_eq!(sent("!Jump(1) # and this"), "Jump(1) # and this");
        let Entry::Command { spec, .. } = read("! -SetBlending(900)", Revision::R3) else {
            unreachable!()
        };
        assert_eq!(spec.map(|spec| spec.name), Some("SetBlending"));
    }

    #[test]
    fn mistakes_say_what_would_be_right() {
        let name = mistake("movejoints(0,0,0,0,0,0)");
        assert_eq!((name.code, name.column), (Code::UNKNOWN_COMMAND, 1));
        assert!(name.why.contains("did you mean `MoveJoints`?"), "{}", name.why);
        assert!(name.right.unwrap().starts_with("MoveJoints(theta1, "));
        let range = mistake("MoveJoints(0, 200, 0, 0, 0, 0)");
        assert_eq!((range.code, range.column), (Code::ARGUMENT_ERROR, 15));
        assert!(range.why.contains("-70 to 90 deg"), "{}", range.why);
        assert_eq!(mistake("Delay(1").code, Code::SYNTAX_ERROR);
        let other = mistake("MoveJump(1,2,3,4,5,6)");
        assert!(other.why.contains("other robots"), "{}", other.why);
        let words = mistake("Delay()").words();
        assert!(words.contains("1003") && words.contains("Delay(t)"), "{words}");
    }

    #[test]
    fn a_revision_has_its_ranges() {
        let faster = "SetJointVel(150)";
        assert!(matches!(read(faster, Revision::R3), Entry::Mistake(_)));
        assert!(matches!(read(faster, Revision::R4), Entry::Command { .. }));
    }

    #[test]
    fn the_prompt_has_its_own_commands() {
        let read = |line| match read(line, Revision::R3) {
            Entry::BuiltIn(built_in) => built_in,
            other => unreachable!("{other:?}"),
        };
        assert_eq!(read(":help MoveLin"), BuiltIn::Help(Some("MoveLin")));
        assert_eq!(read(" : help"), BuiltIn::Help(None));
        assert_eq!(read(":state"), BuiltIn::State);
        assert_eq!(read(":quit"), BuiltIn::Quit);
        assert_eq!(read(":quit now"), BuiltIn::Unknown("quit now"));
        for (name, _) in BUILT_INS {
            assert!(!matches!(read(name), BuiltIn::Unknown(_)), "{name}");
        }
    }
}
