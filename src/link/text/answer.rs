//! Answers to come: to be waited for with a limit, or awaited in async code of any runtime.

use core::future::Future;
use core::pin::Pin;
use core::task::{Context, Poll};
use std::string::{String, ToString};
use std::sync::Arc;

use super::connection::Shared;
use super::error::AnswerError;
use super::message::OwnedMessage;
use crate::bus::text::client::RequestId;
use crate::time::Duration;
use crate::wire::meca500::text::Message;
use crate::wire::meca500::text::value::ValueError;

/// How a command ended well.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reply {
    /// The robot answered with this.
    Message(OwnedMessage),
    /// The robot took the command, which has no answer, and found no fault with it.
    Accepted,
}

impl Reply {
    /// The only value of the answer as a number: of most settings.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        self.numbers().map(|[number]| number)
    }

    /// All values of the answer as numbers; `None` when there are more or fewer, or one is none.
    #[must_use]
    pub fn numbers<const N: usize>(&self) -> Option<[f64; N]> {
        match self {
            Self::Message(message) => message.as_message().numbers(),
            Self::Accepted => None,
        }
    }
}

/// How a value is read from the message that answers a command.
pub(super) type ReadMessage<T> = for<'a> fn(&Message<'a>) -> Result<T, ValueError>;

/// What becomes of a good end of a command.
#[derive(Clone, Copy, Debug)]
enum Reading<T> {
    /// Whatever it is.
    Whole(fn(Reply) -> T),
    /// What its message says.
    Message(ReadMessage<T>),
}

impl<T> Reading<T> {
    fn read(&self, reply: Reply) -> Result<T, AnswerError> {
        let read = match self {
            Self::Whole(take) => return Ok(take(reply)),
            Self::Message(read) => read,
        };
        let Reply::Message(message) = reply else {
            return Err(AnswerError::Unreadable {
                text: String::new(),
                error: ValueError::Nothing,
            });
        };
        let unreadable = |error| AnswerError::Unreadable { text: message.to_string(), error };
        read(&message.as_message()).map_err(unreadable)
    }
}

/// A request that somebody waits for.
#[derive(Debug)]
struct Ticket {
    shared: Arc<Shared>,
    id: RequestId,
}

impl Drop for Ticket {
    fn drop(&mut self) {
        self.shared.forget(self.id);
    }
}

/// The end of a command: a [`Reply`], or what the robot's answer says. Dropping it does not take the
/// command back.
#[must_use = "the command is sent; wait for its answer, or drop it on purpose"]
#[derive(Debug)]
pub struct Answer<T = Reply> {
    ticket: Ticket,
    reading: Reading<T>,
}

impl Answer {
    pub(super) const fn new(shared: Arc<Shared>, id: RequestId) -> Self {
        Self { ticket: Ticket { shared, id }, reading: Reading::Whole(|reply| reply) }
    }

    /// The same answer, of which only what its message says is of interest.
    pub(super) fn read_by<T>(self, read: ReadMessage<T>) -> Answer<T> {
        Answer { ticket: self.ticket, reading: Reading::Message(read) }
    }

    /// The same answer, of which nothing is of interest but that it is there.
    pub(super) fn done(self) -> Answer<()> {
        Answer { ticket: self.ticket, reading: Reading::Whole(drop) }
    }
}

impl<T> Answer<T> {
    /// Waits for it, at most for `limit`; may be called again when that is over.
    ///
    /// # Errors
    ///
    /// [`AnswerError`].
    pub fn wait(&mut self, limit: Duration) -> Result<T, AnswerError> {
        let id = self.ticket.id;
        let result = self.ticket.shared.wait_for(limit, |inner| Shared::take_result(inner, id));
        self.reading.read(result.unwrap_or(Err(AnswerError::TimedOut))?)
    }
}

impl<T> Future for Answer<T> {
    type Output = Result<T, AnswerError>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        let mut inner = self.ticket.shared.lock();
        match Shared::take_result(&mut inner, self.ticket.id) {
            Some(result) => {
                drop(inner);
                Poll::Ready(result.and_then(|reply| self.reading.read(reply)))
            }
            None => {
                inner.set_waker(self.ticket.id, context.waker());
                Poll::Pending
            }
        }
    }
}

/// A checkpoint that the robot has not reached yet.
#[must_use = "the checkpoint is sent; wait for it, or drop it on purpose"]
#[derive(Debug)]
pub struct Checkpoint {
    pub(super) answer: Answer,
    pub(super) number: u16,
}

impl Checkpoint {
    /// Its number.
    #[must_use]
    pub const fn number(&self) -> u16 {
        self.number
    }

    /// Waits until it is reached, at most for `limit`; may be called again when that is over.
    ///
    /// # Errors
    ///
    /// [`AnswerError::Discarded`] when it will never be reached; the others as for any command.
    pub fn wait(&mut self, limit: Duration) -> Result<(), AnswerError> {
        self.answer.wait(limit).map(drop)
    }
}

impl Future for Checkpoint {
    type Output = Result<(), AnswerError>;

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        Pin::new(&mut self.answer).poll(context).map(|result| result.map(drop))
    }
}
