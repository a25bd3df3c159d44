//! What helps while a line is typed: names with Tab, and the argument that comes next.

use std::borrow::Cow;
use std::prelude::v1::*;

use rustyline::completion::{Completer, Pair};
use rustyline::highlight::Highlighter;
use rustyline::hint::{Hint, Hinter};
use rustyline::validate::Validator;
use rustyline::{Context, Helper};

use super::arguments;
use super::entry::{AS_IT_IS, BUILT_INS};
use super::paint::{Paint, Tone};
use crate::wire::meca500::revision::Revision;
use crate::wire::meca500::text::TextCommandSpec;

/// The commands of a Meca500 whose names begin so, in any case.
pub(super) fn matching(beginning: &str) -> impl Iterator<Item = &'static TextCommandSpec> {
    let begins = move |name: &str| {
        name.get(..beginning.len()).is_some_and(|front| front.eq_ignore_ascii_case(beginning))
    };
    TextCommandSpec::all().filter(move |spec| spec.available != Some(false) && begins(spec.name))
}

/// Where the name of a command begins in a line: behind blanks, a dash and the mark for lines as they
/// are.
fn start_of_name(line: &str) -> usize {
    let skipped = |letter: char| letter.is_whitespace() || letter == '-' || letter == AS_IT_IS;
    line.find(|letter| !skipped(letter)).unwrap_or(line.len())
}

/// A name as it is typed in front of its arguments.
fn typed(spec: &TextCommandSpec) -> String {
    let parenthesis = if spec.arguments().next().is_some() { "(" } else { "" };
    format!("{}{parenthesis}", spec.name)
}

/// What Tab may put in place of the line from a byte on.
fn candidates(line: &str) -> (usize, Vec<String>) {
    if let Some(rest) = line.strip_prefix(":help ") {
        let start = line.len() - rest.trim_start().len();
        let names = matching(rest.trim_start()).map(|spec| spec.name.to_string());
        return (start, names.collect());
    }
    if line.starts_with(':') {
        let names = BUILT_INS.iter().filter(|(name, _)| name.starts_with(line));
        return (0, names.map(|(name, _)| name.to_string()).collect());
    }
    let start = start_of_name(line);
    let beginning = line.get(start..).unwrap_or("");
    if beginning.contains(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_') {
        return (line.len(), Vec::new());
    }
    (start, matching(beginning).map(typed).collect())
}

/// Which argument the end of a list of arguments is in, from 0; `None` behind the list.
fn current_argument(list: &str) -> Option<usize> {
    let (mut commas, mut depth, mut is_quoted) = (0, 0_usize, false);
    for byte in list.bytes() {
        match byte {
            b'"' => is_quoted = !is_quoted,
            _ if is_quoted => {}
            b'[' | b'{' => depth += 1,
            b']' | b'}' => depth = depth.saturating_sub(1),
            b',' if depth == 0 => commas += 1,
            b')' if depth == 0 => return None,
            _ => {}
        }
    }
    Some(commas)
}

/// What is shown behind the cursor, and what the right arrow takes of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Suggestion {
    shown: String,
    taken: Option<String>,
}

impl Hint for Suggestion {
    fn display(&self) -> &str {
        &self.shown
    }

    fn completion(&self) -> Option<&str> {
        self.taken.as_deref()
    }
}

/// What to show behind a line.
fn suggestion(line: &str, revision: Revision) -> Option<Suggestion> {
    let text = line.get(start_of_name(line)..)?;
    if text.is_empty() || text.starts_with(':') {
        return None;
    }
    let Some((name, list)) = text.split_once('(') else { return suggested_name(text) };
    let spec = TextCommandSpec::by_name(name.trim_end())?;
    let number = current_argument(list)?;
    let count = spec.arguments().count();
    let shown = match spec.arguments().nth(number) {
        Some(argument) => {
            let place =
                if count > 1 { format!(" ({} of {count})", number + 1) } else { String::new() };
            format!("   {}{place}", arguments::described(&argument, revision))
        }
        None if count == 0 => "   no arguments".into(),
        None => format!("   only {count}: {}", arguments::signature(spec)),
    };
    Some(Suggestion { shown, taken: None })
}

/// The rest of the only name that begins so, with its arguments.
fn suggested_name(beginning: &str) -> Option<Suggestion> {
    let exact = TextCommandSpec::by_name(beginning).filter(|spec| spec.available != Some(false));
    let mut names = matching(beginning);
    let only = names.next().filter(|_| names.next().is_none());
    let spec = exact.or(only)?;
    let signature = arguments::signature(spec);
    match signature.strip_prefix(beginning) {
        Some("") => None,
        Some(rest) => {
            let taken = typed(spec).strip_prefix(beginning).map(String::from);
            Some(Suggestion { shown: rest.into(), taken: taken.filter(|rest| !rest.is_empty()) })
        }
        // In another case, which the robot may mind.
        None => Some(Suggestion { shown: format!("   {signature}"), taken: None }),
    }
}

/// The helper of the line editor.
#[derive(Debug)]
pub(super) struct Assist {
    pub(super) revision: Revision,
    pub(super) paint: Paint,
}

impl Completer for Assist {
    type Candidate = Pair;

    fn complete(
        &self,
        line: &str,
        position: usize,
        _context: &Context<'_>,
    ) -> rustyline::Result<(usize, Vec<Pair>)> {
        let (start, names) = candidates(line.get(..position).unwrap_or(line));
        let pair = |name: String| Pair { display: name.clone(), replacement: name };
        Ok((start, names.into_iter().map(pair).collect()))
    }
}

impl Hinter for Assist {
    type Hint = Suggestion;

    fn hint(&self, line: &str, position: usize, _context: &Context<'_>) -> Option<Suggestion> {
        if position < line.len() { None } else { suggestion(line, self.revision) }
    }
}

impl Highlighter for Assist {
    fn highlight_hint<'h>(&self, hint: &'h str) -> Cow<'h, str> {
        Cow::Owned(self.paint.text(Tone::Faint, hint))
    }
}

impl Validator for Assist {}

impl Helper for Assist {}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(line: &str) -> Option<String> {
        suggestion(line, Revision::R3).map(|suggestion| suggestion.shown)
    }

    #[test]
    fn names_are_completed_in_any_case() {
        let (start, names) = candidates("movejoints");
        assert_eq!(start, 0);
        assert_eq!(names, ["MoveJoints(", "MoveJointsRel(", "MoveJointsVel("]);
        assert_eq!(candidates("getstatusr"), (0, vec!["GetStatusRobot".into()]));
        assert_eq!(candidates(" !-HOM"), (3, vec!["Home".into()]));
        assert_eq!(candidates("MoveJoints(1, set").1, Vec::<String>::new());
        assert!(candidates("").1.len() > 150);
        assert!(candidates("é").1.is_empty());
        // What other robots have is not offered.
        assert!(candidates("MoveJ").1.iter().all(|name| !name.starts_with("MoveJump")));
    }

    #[test]
    fn the_prompts_own_commands_are_completed_too() {
        assert_eq!(candidates(":h"), (0, vec![":help".into()]));
        assert_eq!(candidates(":help movep"), (6, vec!["MovePose".into()]));
        assert_eq!(candidates(":").1.len(), BUILT_INS.len());
    }

    #[test]
    fn the_rest_of_an_unambiguous_name_is_shown_and_can_be_taken() {
        let rest = suggestion("MovePo", Revision::R3).unwrap();
        assert_eq!(rest.display(), "se(x, y, z, alpha, beta, gamma)");
        assert_eq!(rest.completion(), Some("se("));
        assert_eq!(shown("MoveL"), None);
        assert_eq!(shown("MoveLin"), Some("(x, y, z, alpha, beta, gamma)".into()));
        let other_case = suggestion("movepo", Revision::R3).unwrap();
        assert!(other_case.display().contains("MovePose(x"));
        assert_eq!(other_case.completion(), None);
        assert_eq!(shown("Home"), None);
        assert_eq!(shown(""), None);
    }

    #[test]
    fn the_argument_that_comes_next_is_described() {
        assert_eq!(shown("MoveJoints("), Some("   theta1: -175 to 175 deg (1 of 6)".into()));
        assert_eq!(shown("!-MoveJoints(1, 2"), Some("   theta2: -70 to 90 deg (2 of 6)".into()));
        assert_eq!(shown("MoveJoints(1,2,3,4,5,6)"), None);
        assert!(
            shown("MoveJoints(1,2,3,4,5,6,").unwrap().starts_with("   only 6: MoveJoints(theta1")
        );
        assert_eq!(shown("Home("), Some("   no arguments".into()));
        assert_eq!(shown("Nonsense("), None);
        let value = shown("CreateVariable(a, [1, 2], ").unwrap();
        assert!(value.starts_with("   cyclicId: an integer from 0 to 19999"), "{value}");
        let text = shown("CreateVariable(a, \"b, ").unwrap();
        assert!(text.starts_with("   value: "), "{text}");
    }
}
