//! A robot program as a whole: every line read and checked before anything moves.
//!
//! Read [`Program::parse`] first. Invariant: a [`Program`] that exists has no line that the parser of
//! [`Statement`] refuses, and no pause that nothing ends.
//!
//! The robot is brought up (activated, homed, resumed) just before the first line that needs it so,
//! unless `ActivateRobot` stands before that line: then the program means to do it itself.

use std::prelude::v1::*;

use crate::wire::meca500::command::{MotionCommand, Requirement};
use crate::wire::meca500::revision::Revision;
use crate::wire::meca500::text::Statement;

/// One command of a program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Line in the file, from 1.
    pub line: u32,
    /// Column where the command begins, in characters from 1.
    pub column: usize,
    /// What to do.
    pub statement: Statement,
}

/// Whether a robot without the right tool refuses the command and takes the next one all the same.
#[must_use]
pub const fn needs_a_tool(command: &MotionCommand) -> bool {
    matches!(
        command,
        MotionCommand::Gripper(_)
            | MotionCommand::MoveGripper(_)
            | MotionCommand::SetGripperForce(_)
            | MotionCommand::SetGripperVel(_)
            | MotionCommand::SetGripperRange { .. }
            | MotionCommand::SetValveState(_)
    )
}

/// Something wrong with a program.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{line}:{column}: {message}")]
pub struct ProgramFault {
    /// Line in the file, from 1.
    pub line: u32,
    /// Column in characters, from 1.
    pub column: usize,
    /// What is wrong and what would be right.
    pub message: String,
}

/// A checked program.
#[derive(Clone, Debug)]
pub struct Program {
    steps: Vec<Step>,
    lines: Vec<String>,
    bring_up_before: Option<usize>,
}

impl Program {
    /// Reads a whole program for a robot of this revision.
    ///
    /// # Errors
    ///
    /// Everything that is wrong with it, in the order of lines; one fault a line.
    pub fn parse(text: &str, revision: Revision) -> Result<Self, Vec<ProgramFault>> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut steps = Vec::new();
        let mut lines = Vec::new();
        let mut faults = Vec::new();
        for (line, content) in (1..).zip(text.lines()) {
            lines.push(content.to_string());
            match Statement::parse(content, revision) {
                Ok(Some(statement)) => {
                    let column = 1 + content.chars().take_while(|c| c.is_whitespace()).count();
                    steps.push(Step { line, column, statement });
                }
                Ok(None) => {}
                Err(error) => {
                    let (column, message) = (error.column, error.reason.to_string());
                    faults.push(ProgramFault { line, column, message });
                }
            }
        }
        faults.extend(endless_pauses(&steps));
        faults.sort_by_key(|fault| fault.line);
        if faults.is_empty() && steps.is_empty() {
            let message = "the program has no commands".into();
            faults.push(ProgramFault { line: 1, column: 1, message });
        }
        if !faults.is_empty() {
            return Err(faults);
        }
        let bring_up_before = bring_up_before(&steps);
        Ok(Self { steps, lines, bring_up_before })
    }

    /// The commands in order.
    #[must_use]
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The command of a line, from 1, without its comment; empty beyond the last.
    #[must_use]
    pub fn line_text(&self, line: u32) -> &str {
        let position = usize::try_from(line).unwrap_or(0).wrapping_sub(1);
        let text = self.lines.get(position).map_or("", String::as_str);
        // A checked line has no quotation marks that could hold a comment's beginning.
        let end = text.find("//").into_iter().chain(text.find('#')).min();
        text.get(..end.unwrap_or(text.len())).unwrap_or(text).trim()
    }

    /// Position of the step before which the robot is brought up; `None` if the program does that
    /// itself or never needs it.
    #[must_use]
    pub const fn bring_up_before(&self) -> Option<usize> {
        self.bring_up_before
    }

    /// A range of `count` checkpoint numbers from 1 to 8000 that the program does not use, the
    /// highest there is.
    #[must_use]
    pub fn free_checkpoints(&self, count: u16) -> Option<(u16, u16)> {
        let mut used: Vec<u16> = self
            .steps
            .iter()
            .filter_map(|step| match step.statement {
                Statement::Motion(MotionCommand::SetCheckpoint(number)) => Some(number),
                _ => None,
            })
            .collect();
        used.sort_unstable();
        let mut above = 8_001;
        for number in used.into_iter().rev().chain([0]) {
            if above > number && above - number > count {
                return Some((above - count, above - 1));
            }
            above = number;
        }
        None
    }
}

/// Pauses after which the program could never end, since nothing resumes motion.
fn endless_pauses(steps: &[Step]) -> Vec<ProgramFault> {
    let mut faults = Vec::new();
    for (position, step) in steps.iter().enumerate() {
        let name = match step.statement {
            Statement::PauseMotion => "PauseMotion",
            Statement::ClearMotion => "ClearMotion",
            _ => continue,
        };
        let later = steps.get(position + 1..).unwrap_or_default();
        let is_ended = later.iter().any(|step| {
            matches!(
                step.statement,
                Statement::ResumeMotion | Statement::ClearMotion | Statement::Deactivate
            )
        });
        let moves_later = later.iter().any(|step| needs_ready(&step.statement));
        // A queue that was cleared may stay so at the end of a program; a paused one never empties.
        if !is_ended && (moves_later || matches!(step.statement, Statement::PauseMotion)) {
            faults.push(ProgramFault {
                line: step.line,
                column: step.column,
                message: format!(
                    "{name} is never followed by ResumeMotion, so the program could not end"
                ),
            });
        }
    }
    faults
}

fn bring_up_before(steps: &[Step]) -> Option<usize> {
    let needs = steps.iter().position(|step| needs_ready(&step.statement))?;
    let activates = steps
        .iter()
        .position(|step| matches!(step.statement, Statement::Activate { .. }))
        .is_some_and(|activates| activates < needs);
    (!activates).then_some(needs)
}

/// Whether a statement has no place on a robot that is not activated and homed.
fn needs_ready(statement: &Statement) -> bool {
    match statement {
        Statement::Velocity(_)
        | Statement::Home
        | Statement::PauseMotion
        | Statement::ResumeMotion
        | Statement::ClearMotion => true,
        Statement::Motion(command) => matches!(
            command.spec().map(|spec| spec.requires),
            Some(
                Requirement::ReadyForMotion
                    | Requirement::ReadyAndHomed
                    | Requirement::ActivatedAndHomed
            )
        ),
        Statement::Activate { .. }
        | Statement::Deactivate
        | Statement::ResetError
        | Statement::ActivateSim
        | Statement::DeactivateSim
        | Statement::SetRecoveryMode(_)
        | Statement::SetRtc(_) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Program, Vec<String>> {
        Program::parse(text, Revision::R3)
            .map_err(|faults| faults.iter().map(ToString::to_string).collect())
    }

    #[test]
    fn every_line_with_a_fault_is_told_at_once() {
        let faults = parse("MoveJoint(0,0,0,0,0,0)\n\nDelay(1)\n  Delay(-1)\n").unwrap_err();
        assert_eq!(faults.len(), 2, "{faults:?}");
        assert!(faults[0].starts_with("1:1: "), "{faults:?}");
        assert!(faults[1].starts_with("4:9: "), "{faults:?}");
    }

    #[test]
    fn a_program_without_commands_is_a_fault() {
        assert_eq!(parse("// nothing\n").unwrap_err(), ["1:1: the program has no commands"]);
    }

    #[test]
    fn comments_blanks_and_a_byte_order_mark_keep_line_numbers() {
        let program = parse("\u{feff}# one\r\n\r\nDelay(1) // two\r\n").unwrap();
        assert_eq!(program.steps().len(), 1);
        assert_eq!(program.steps()[0].line, 3);
        assert_eq!(program.line_text(3), "Delay(1)");
        assert_eq!(program.line_text(4), "");
    }

    #[test]
    fn a_pause_needs_an_end() {
        let faults = parse("Delay(1)\nPauseMotion()\nDelay(1)").unwrap_err();
        assert!(faults[0].starts_with("2:1: PauseMotion is never followed"), "{faults:?}");
        assert!(parse("Delay(1)\nPauseMotion()\nResumeMotion()").is_ok());
        assert!(parse("Delay(1)\nClearMotion()").is_ok());
        assert!(parse("Delay(1)\nClearMotion()\nDelay(1)").is_err());
    }

    #[test]
    fn the_robot_is_brought_up_where_it_is_first_needed() {
        let before = |text| parse(text).unwrap().bring_up_before();
        assert_eq!(before("Delay(1)"), Some(0));
        assert_eq!(before("ActivateSim()\nDelay(1)"), Some(1));
        assert_eq!(before("ResetError()\nHome()"), Some(1));
        assert_eq!(before("ActivateRobot()\nHome()\nDelay(1)"), None);
        assert_eq!(before("DeactivateRobot()\nSetJointLimitsCfg(1)\nDelay(1)"), Some(2));
        assert_eq!(before("DeactivateRobot()"), None);
    }

    #[test]
    fn free_checkpoints_avoid_those_of_the_program() {
        let free = |text, count| parse(text).unwrap().free_checkpoints(count);
        assert_eq!(free("Delay(1)", 1_000), Some((7_001, 8_000)));
        assert_eq!(free("SetCheckpoint(7500)", 1_000), Some((6_500, 7_499)));
        assert_eq!(free("SetCheckpoint(7500)\nSetCheckpoint(7500)", 500), Some((7_501, 8_000)));
        assert_eq!(free("SetCheckpoint(4000)", 8_000), None);
    }
}
