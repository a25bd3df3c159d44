//! Programs stored in the robot. Its web interface alone can list, load or delete them.

use std::format;

use super::{digit, name};
use crate::link::text::answer::Answer;
use crate::link::text::client::Client;
use crate::link::text::error::AnswerError;
use crate::wire::meca500::text::value::SavedProgram;

impl Client {
    /// StartProgram: runs a stored program once. Ends when it is queued, not when it ends, which the
    /// robot tells with \[3013\]. Source: PM L3998.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send), and [`AnswerError::Argument`]; [3017] when there is no such program.
    ///
    /// [3017]: crate::wire::meca500::code::Code::NO_OFFLINE_PROGRAM
    pub fn start_program(&self, program: &str) -> Result<Answer<()>, AnswerError> {
        self.order(&format!("StartProgram({})", name("s", program)?))
    }

    /// StartSaving: commands are recorded from now on as program `number`, 1 to 500, instead of the one
    /// before; a robot that is ready executes them too.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn start_saving(&self, number: u16) -> Result<Answer<()>, AnswerError> {
        self.order(&format!("StartSaving({number})"))
    }

    /// SetOfflineProgramLoop, while saving: whether Start/Pause on the robot's base runs the program again
    /// and again. It has no answer: this ends with an error, or with a later
    /// [`sync`](Self::sync).
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn set_offline_program_loop(&self, on: bool) -> Result<Answer<()>, AnswerError> {
        self.order(&format!("SetOfflineProgramLoop({})", digit(on)))
    }

    /// StopSaving: the program is kept, without what the robot could not record. Ends with how many
    /// commands it has.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn stop_saving(&self) -> Result<Answer<SavedProgram>, AnswerError> {
        self.ask("StopSaving", SavedProgram::read)
    }
}
