//! Answers to come: to be waited for with a limit, or awaited in async code of any runtime.

use core::future::Future;
use core::pin::Pin;
use core::task::{Context, Poll};
use std::sync::Arc;

use super::connection::Shared;
use super::error::AnswerError;
use super::message::OwnedMessage;
use crate::bus::text::client::RequestId;
use crate::time::Duration;

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

/// The end of a command. Dropping it does not take the command back.
#[must_use = "the command is sent; wait for its answer, or drop it on purpose"]
#[derive(Debug)]
pub struct Answer {
    shared: Arc<Shared>,
    id: RequestId,
}

impl Answer {
    pub(super) const fn new(shared: Arc<Shared>, id: RequestId) -> Self {
        Self { shared, id }
    }

    /// Waits for it, at most for `limit`; may be called again when that is over.
    ///
    /// # Errors
    ///
    /// [`AnswerError`].
    pub fn wait(&mut self, limit: Duration) -> Result<Reply, AnswerError> {
        let result = self.shared.wait_for(limit, |inner| Shared::take_result(inner, self.id));
        result.unwrap_or(Err(AnswerError::TimedOut))
    }
}

impl Future for Answer {
    type Output = Result<Reply, AnswerError>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        let mut inner = self.shared.lock();
        match Shared::take_result(&mut inner, self.id) {
            Some(result) => Poll::Ready(result),
            None => {
                inner.set_waker(self.id, context.waker());
                Poll::Pending
            }
        }
    }
}

impl Drop for Answer {
    fn drop(&mut self) {
        self.shared.forget(self.id);
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
