//! A program from its file: read, and checked for what this program cannot run.
//!
//! [`Program::parse`] knows the robot's language; here stand the checks that are this command's own.
//! Every one of them ends in a place in the file, so that nothing is refused once the robot moves.

use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::prelude::v1::*;

use super::exit::{Exit, Failure};
use crate::run::program::{Program, ProgramFault};
use crate::wire::meca500::command::MotionCommand;
use crate::wire::meca500::revision::Revision;
use crate::wire::meca500::text::{Statement, parse_line};

/// The longest Delay and the longest duration of a move, in seconds: a day. The robot's manual has
/// no such limit, but a program that waits longer was mistyped.
const LONGEST_S: u32 = 86_400;
/// Last checkpoint number.
const LAST_CHECKPOINT: u16 = 8_000;

/// The path that means standard input.
const STDIN: &str = "-";

/// A program and what it is called in messages.
pub(super) struct Source {
    pub(super) name: String,
    pub(super) program: Program,
}

/// The programs of all files, or everything that is wrong with any of them, as [`read`].
pub(super) fn read_all(
    paths: &[PathBuf],
    revision: Revision,
    checkpoints: u16,
) -> Result<Vec<Source>, Failure> {
    if paths.iter().filter(|path| path.as_path() == Path::new(STDIN)).count() > 1 {
        return Err(Failure::usage(
            "standard input (-) can be read only once; give one program for all robots, or files",
        ));
    }
    let (mut sources, mut failures) = (Vec::new(), Vec::new());
    for path in paths {
        match read(path, revision, checkpoints) {
            Ok(source) => sources.push(source),
            Err(failure) => failures.push(failure),
        }
    }
    Failure::all(failures).map_or(Ok(sources), Err)
}

/// The whole program, or everything that is wrong with it. At least `checkpoints` numbers in a row
/// stay free.
fn read(path: &Path, revision: Revision, checkpoints: u16) -> Result<Source, Failure> {
    let (name, text) = text(path)?;
    match check(&text, revision, checkpoints) {
        Ok(program) => Ok(Source { name, program }),
        Err(faults) => Err(failure(&name, &faults)),
    }
}

/// Name and text of the file; of standard input when it is `-`.
fn text(path: &Path) -> Result<(String, String), Failure> {
    let (name, text) = if path == Path::new(STDIN) {
        let mut text = String::new();
        ("<stdin>".to_string(), io::stdin().lock().read_to_string(&mut text).map(|_| text))
    } else {
        (path.display().to_string(), fs::read_to_string(path))
    };
    match text {
        Ok(text) => Ok((name, text)),
        Err(error) if error.kind() == io::ErrorKind::InvalidData => {
            Err(Failure::usage(format!("{name} is not a text; a program is plain text (UTF-8)")))
        }
        Err(error) => Err(Failure::internal(format!("cannot read {name}: {error}"))),
    }
}

fn failure(name: &str, faults: &[ProgramFault]) -> Failure {
    let mut message: String = faults.iter().map(|fault| format!("{name}:{fault}\n")).collect();
    let errors =
        if faults.len() == 1 { "1 error".into() } else { format!("{} errors", faults.len()) };
    message += &format!("{errors} in {name}; nothing was sent to the robot");
    Failure { exit: Exit::Usage, message, is_located: true }
}

fn check(text: &str, revision: Revision, checkpoints: u16) -> Result<Program, Vec<ProgramFault>> {
    if let Some(fault) = bare_carriage_return(text) {
        return Err(vec![fault]);
    }
    let too_long = endless_waits(text, revision);
    let parsed = Program::parse(text, revision);
    if too_long.is_empty() {
        let program = parsed?;
        return match no_room(&program, checkpoints) {
            Some(fault) => Err(vec![fault]),
            None => Ok(program),
        };
    }
    let mut faults = parsed.err().unwrap_or_default();
    faults.extend(too_long);
    faults.sort_by_key(|fault| fault.line);
    Err(faults)
}

/// A line that ends with CR only, as on very old computers. What follows would be taken for the same
/// line, or be lost in its comment.
fn bare_carriage_return(text: &str) -> Option<ProgramFault> {
    (1..).zip(text.lines()).find_map(|(line, content)| {
        let (before, _) = content.trim_end_matches('\r').split_once('\r')?;
        Some(ProgramFault {
            line,
            column: before.chars().count() + 1,
            message: "the line ends here with CR only; save the program with LF or CR LF at the \
                      end of its lines"
                .into(),
        })
    })
}

/// Waits that nobody would live to see the end of.
fn endless_waits(text: &str, revision: Revision) -> Vec<ProgramFault> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let fault = |(line, content)| {
        let parsed = parse_line(content, revision).ok()??;
        let [seconds, ..] = parsed.numbers();
        let is_wait = matches!(parsed.spec.name, "Delay" | "SetMoveDuration");
        if !is_wait || seconds <= LONGEST_S as f32 {
            return None;
        }
        let argument = parsed.arguments().next()?;
        let (name, column) = (parsed.spec.name, argument.column);
        let message = format!(
            "{name}: {} s is more than a day; {LONGEST_S} s is the limit of this program, \
             not of the robot",
            argument.text
        );
        Some(ProgramFault { line, column, message })
    };
    (1..).zip(text.lines()).filter_map(fault).collect()
}

/// The line that takes the last room for the checkpoints by which commands are followed.
fn no_room(program: &Program, checkpoints: u16) -> Option<ProgramFault> {
    if program.free_checkpoints(checkpoints).is_some() {
        return None;
    }
    let mut is_used = vec![false; usize::from(LAST_CHECKPOINT) + 1];
    program.steps().iter().find_map(|step| {
        let Statement::Motion(MotionCommand::SetCheckpoint(number)) = step.statement else {
            return None;
        };
        let is_used_before = core::mem::replace(is_used.get_mut(usize::from(number))?, true);
        let free = is_used.get(1..)?.split(|is_used| *is_used).map(<[bool]>::len).max()?;
        (!is_used_before && free < usize::from(checkpoints)).then(|| ProgramFault {
            line: step.line,
            column: step.column,
            message: format!(
                "no {checkpoints} checkpoint numbers in a row are left free; they are needed for \
                 following the commands, so use fewer of 1 to {LAST_CHECKPOINT}"
            ),
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faults(text: &str) -> Vec<String> {
        let faults = check(text, Revision::R3, 20).unwrap_err();
        faults.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn the_line_that_takes_the_last_free_checkpoints_is_named() {
        let lines: Vec<String> = (1..=8_000).map(|n| format!("SetCheckpoint({n})")).collect();
        let text = lines.join("\n");
        let faults = faults(&text);
        assert_eq!(faults.len(), 1);
        assert!(faults[0].starts_with("7981:1: no 20 checkpoint numbers in a row"), "{faults:?}");
        assert!(check(&lines[..7_980].join("\n"), Revision::R3, 20).is_ok());
    }

    #[test]
    fn old_line_ends_are_told_and_new_ones_taken() {
        let faults = faults("# one\rDelay(1)\r");
        assert_eq!(faults.len(), 1);
        assert!(faults[0].starts_with("1:6: the line ends here with CR only"), "{faults:?}");
        for text in ["Delay(1)\r\nDelay(1)\r\n", "Delay(1)\r", "Delay(1)\r\r\nDelay(1)"] {
            assert!(check(text, Revision::R3, 20).is_ok(), "{text:?}");
        }
    }

    #[test]
    fn waits_of_more_than_a_day_are_told_among_the_other_faults() {
        let text = "\u{feff}Delay(86400)\nDelay( 1e30)\nMoveJoint()\nSetMoveDuration(86401)\n";
        let faults = faults(text);
        assert_eq!(faults.len(), 3, "{faults:?}");
        assert_eq!(
            faults[0],
            "2:8: Delay: 1e30 s is more than a day; 86400 s is the limit of this program, not of \
             the robot"
        );
        assert!(faults[1].starts_with("3:1: there is no command"), "{faults:?}");
        assert!(faults[2].starts_with("4:17: SetMoveDuration: "), "{faults:?}");
        assert!(check("Delay(86400)", Revision::R3, 20).is_ok());
    }
}
