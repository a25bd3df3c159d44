//! Holding motion back and letting it go on.

use std::format;
use std::vec::Vec;

use super::number;
use crate::link::text::answer::{Answer, Reply};
use crate::link::text::client::Client;
use crate::link::text::error::AnswerError;
use crate::wire::meca500::text::value;

impl Client {
    /// PauseMotion: the robot slows down to a stop and keeps its queue.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send); so everywhere below.
    pub fn pause_motion(&self) -> Result<Answer<()>, AnswerError> {
        self.order("PauseMotion")
    }

    /// ResumeMotion: after a pause, a clearing, an error that was reset, or a stop signal that is gone.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn resume_motion(&self) -> Result<Answer<()>, AnswerError> {
        self.order("ResumeMotion")
    }

    /// ClearMotion: as a pause, and the queue is emptied.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn clear_motion(&self) -> Result<Answer<()>, AnswerError> {
        self.order("ClearMotion")
    }

    /// SetTimeScaling, 0.001 to 100 %. Ends with what is in force.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send), and [`AnswerError::Argument`].
    pub fn set_time_scaling(&self, percent: f64) -> Result<Answer<f64>, AnswerError> {
        self.ask(&format!("SetTimeScaling({})", number("p", percent)?), value::number)
    }

    /// Sends commands that stand in lines of their own, as in a program, without comments. Their ends are
    /// in the order of the lines.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send), of the first line that was not sent; those before it are.
    pub fn send_all(&self, lines: &str) -> Result<Vec<Answer<Reply>>, AnswerError> {
        lines.lines().filter(|line| !line.trim().is_empty()).map(|line| self.send(line)).collect()
    }
}
