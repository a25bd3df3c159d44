//! Offline programs: saving them line by line, and starting them.
//!
//! ```text
//! StartSaving(n) --> line --recorded, and executed by a robot ready for motion--> StopSaving
//!                     |------ a request: executed, not recorded
//!                     |------ no command for a program: 1023, left out
//!                     '------ a change of state: 1031, nothing is saved
//! ```
//!
//! What belongs to which kind is chosen along the manual's examples: requests are commands whose
//! name begins with Get; robot control commands change the state, but for SetTimeScaling, which is
//! recorded, and those that only concern the connection, which are executed.
//! Source: PM L3717-3735, L4032-4090.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use super::dispatch::Refused;
use super::face::Port;
use super::motion::command_of;
use crate::sim::meca500::queue::CAPACITY;
use crate::sim::meca500::robot::VirtualRobot;
use crate::sim::meca500::store::ProgramLine;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::command::MotionCommand;
use crate::wire::meca500::text::{Category, ParsedCommand, Timing, parse_line};

/// A program that is being saved.
#[derive(Clone, Debug)]
pub(super) struct Saving {
    number: u16,
    lines: Vec<ProgramLine>,
    loops: bool,
}

/// What becomes of a command while a program is saved.
enum Part {
    /// It belongs into the program.
    Recorded,
    /// It is executed and not recorded.
    Executed,
    /// It is left out.
    LeftOut,
    /// It ends the saving.
    Aborts,
}

fn part_of(parsed: &ParsedCommand<'_>) -> Part {
    let name = parsed.spec.name;
    if name.starts_with("Get") || name == "ListVariables" {
        return Part::Executed;
    }
    match parsed.spec.category {
        Category::Motion => Part::Recorded,
        Category::Accessory if parsed.spec.timing == Timing::Queued => Part::Recorded,
        Category::Control => match name {
            "SetTimeScaling" => Part::Recorded,
            "SyncCmdQueue" | "ConnectionWatchdog" | "SetCtrlPortMonitoring" | "LogTrace" => {
                Part::Executed
            }
            "StartProgram" => Part::LeftOut,
            _ => Part::Aborts,
        },
        Category::Variable if name == "SetVariable" => Part::Recorded,
        _ => Part::LeftOut,
    }
}

impl VirtualRobot {
    /// StartProgram: 2063 at once, wherever the program comes in the queue. Names other than numbers
    /// belong to programs of the MecaPortal, which this robot has none of.
    pub(super) fn start_program_by_text(&mut self, name: &str) -> Result<(), Refused> {
        let is_good = |letter: u8| letter.is_ascii_alphanumeric() || matches!(letter, b'_' | b'-');
        if name.is_empty() || !name.bytes().all(is_good) {
            return Err(Code::ARGUMENT_ERROR.into());
        }
        let number: Option<u16> = name.parse().ok().filter(|_| !name.starts_with('0'));
        self.ready_for_motion()?;
        if self.error != Code(0) {
            return Err(Code::IN_ERROR.into());
        }
        let number = number.ok_or(Code::NO_OFFLINE_PROGRAM)?;
        if let Err(code) = self.program_commands(number) {
            return Err(match code {
                Code::OFFLINE_PROGRAM_INVALID => {
                    Refused::Because(code, format!("Offline program {name} is invalid"))
                }
                _ => code.into(),
            });
        }
        self.submit(&MotionCommand::StartProgram(number))?;
        self.answer(Code(2063), &format!("Offline program {name} started."));
        Ok(())
    }

    /// StartSaving.
    pub(super) fn start_saving(&mut self, number: u16) -> Result<(), Refused> {
        self.text.saving = Some(Saving { number, lines: Vec::new(), loops: false });
        self.answer_own(Code(2060));
        Ok(())
    }

    /// Acts on a line while a program is being saved.
    pub(super) fn dispatch_while_saving(&mut self, line: &str) -> Result<(), Refused> {
        let parsed = match parse_line(line, self.settings.revision) {
            Ok(Some(parsed)) if parsed.spec.available != Some(false) => parsed,
            _ => return self.record_odd(line),
        };
        match parsed.spec.name {
            "StartSaving" => return Err(Code::ALREADY_SAVING.into()),
            "StopSaving" => {
                self.stop_saving();
                return Ok(());
            }
            "SetOfflineProgramLoop" => {
                let [number, ..] = parsed.numbers();
                if let Some(saving) = &mut self.text.saving {
                    saving.loops = number == 1.0;
                }
                return Ok(());
            }
            _ => {}
        }
        match part_of(&parsed) {
            Part::Executed => self.execute_text(&parsed, line),
            Part::LeftOut => Err(Code::NOT_IN_OFFLINE_PROGRAM.into()),
            Part::Aborts => {
                self.text.saving = None;
                Err(Code::SAVING_ABORTED.into())
            }
            Part::Recorded => {
                let uses_variables =
                    parsed.variable().is_some() || parsed.spec.category == Category::Variable;
                if parsed.spec.category == Category::Variable
                    && self.cyclic_id_of(&parsed).is_none()
                {
                    return Err(Code::NOT_IN_OFFLINE_PROGRAM.into());
                }
                let recorded = match command_of(&parsed, self.settings.revision) {
                    Some(command) if !uses_variables => ProgramLine::Command(command),
                    _ => ProgramLine::Text(String::from(line)),
                };
                self.record(recorded)?;
                self.execute_recorded(line)
            }
        }
    }

    /// A line that the codec refuses: some belong into a program all the same.
    fn record_odd(&mut self, line: &str) -> Result<(), Refused> {
        match self.command_of_line(line) {
            Some(command) => {
                self.record(ProgramLine::Command(command))?;
                self.execute_recorded(line)
            }
            None => self.dispatch_resolved(line),
        }
    }

    /// A deactivated robot only records. Source: PM L4066.
    fn execute_recorded(&mut self, line: &str) -> Result<(), Refused> {
        if self.ready_for_motion().is_err() {
            return Ok(());
        }
        let resolved = self.resolve_variables(line)?;
        self.dispatch_resolved(&resolved)
    }

    fn record(&mut self, line: ProgramLine) -> Result<(), Refused> {
        let Some(saving) = &mut self.text.saving else { return Ok(()) };
        if saving.lines.len() < CAPACITY {
            saving.lines.push(line);
            return Ok(());
        }
        if let Some(Saving { number, lines, .. }) = self.text.saving.take() {
            self.programs.keep(number, lines);
        }
        Err(Code::OFFLINE_PROGRAM_FULL.into())
    }

    fn stop_saving(&mut self) {
        let Some(Saving { number, lines, loops }) = self.text.saving.take() else { return };
        let count = lines.len();
        self.programs.keep(number, lines);
        if number == 1 {
            self.settings.persistent.offline_program_loop = loops;
        }
        self.answer(Code(2061), &format!("{count} commands saved."));
        let code = if number == 1 && loops { Code(2064) } else { Code(2065) };
        let message = super::format::message(code, None);
        self.say(Port::Control, code, &message);
    }

    /// The motion command of a line of a program, with the values that variables have now.
    pub(in crate::sim::meca500) fn command_of_line(&self, line: &str) -> Option<MotionCommand> {
        let resolved = self.resolve_variables(line).ok()?;
        match parse_line(&resolved, self.settings.revision) {
            Ok(Some(parsed)) if parsed.spec.name == "SetVariable" => {
                let cyclic_id = self.cyclic_id_of(&parsed)?;
                let numbers = self.numbers_argument(&parsed)?;
                let mut values = [0.0; 6];
                let used = values.get_mut(..numbers.len())?;
                used.copy_from_slice(&numbers);
                let count = u8::try_from(numbers.len()).ok()?;
                Some(MotionCommand::SetVariable { cyclic_id, values, count })
            }
            Ok(Some(parsed)) => command_of(&parsed, self.settings.revision),
            Ok(None) => None,
            Err(error) => match super::line::judge(&resolved, &error) {
                super::line::Odd::Motion(command) => Some(command),
                _ => None,
            },
        }
    }
}
