//! Messages that are kept, and the queue of those who want to see all of them.

use core::future::Future;
use core::pin::Pin;
use core::task::{Context, Poll, Waker};
use std::collections::VecDeque;
use std::string::{String, ToString};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::vec::Vec;

use super::error::EndReason;
use crate::link::clock::MonotonicClock;
use crate::time::Duration;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::text::Message;

/// Messages that a queue holds; the oldest makes place for one more.
///
/// Source: choice. A minute of monitoring at the default interval.
const QUEUE: usize = 16_384;

/// A message of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OwnedMessage {
    /// What it tells.
    pub code: Code,
    /// Its text or its values.
    pub body: String,
}

impl OwnedMessage {
    /// The same message, to be read.
    #[must_use]
    pub fn as_message(&self) -> Message<'_> {
        Message { code: self.code, body: &self.body }
    }
}

impl From<Message<'_>> for OwnedMessage {
    fn from(message: Message<'_>) -> Self {
        Self { code: message.code, body: message.body.to_string() }
    }
}

impl core::fmt::Display for OwnedMessage {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.as_message().fmt(f)
    }
}

#[derive(Debug, Default)]
struct Kept {
    messages: VecDeque<OwnedMessage>,
    missed: u64,
    ended: Option<EndReason>,
    wakers: Vec<Waker>,
}

/// What the reading thread and the reader share.
#[derive(Debug, Default)]
pub(super) struct Queue {
    kept: Mutex<Kept>,
    changed: Condvar,
}

impl Queue {
    fn lock(&self) -> MutexGuard<'_, Kept> {
        // Nobody can leave the queue half changed.
        self.kept.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    fn change(&self, change: impl FnOnce(&mut Kept)) {
        let mut kept = self.lock();
        change(&mut kept);
        let wakers = core::mem::take(&mut kept.wakers);
        drop(kept);
        self.changed.notify_all();
        wakers.into_iter().for_each(Waker::wake);
    }

    pub(super) fn push(&self, message: OwnedMessage) {
        self.change(|kept| {
            if kept.messages.len() >= QUEUE {
                kept.messages.pop_front();
                kept.missed += 1;
            }
            kept.messages.push_back(message);
        });
    }

    pub(super) fn end(&self, reason: EndReason) {
        self.change(|kept| kept.ended = Some(reason));
    }
}

/// All messages of a connection from the moment it was asked for, in order. It ends with the
/// connection.
#[derive(Debug)]
pub struct Messages {
    pub(super) queue: Arc<Queue>,
}

impl Messages {
    /// The next message; waits for it, at most for `limit`.
    ///
    /// # Errors
    ///
    /// The connection ended, and every message before that was told. `Ok(None)`: none came in time.
    pub fn wait_next(&self, limit: Duration) -> Result<Option<OwnedMessage>, EndReason> {
        let clock = MonotonicClock::new();
        let mut kept = self.queue.lock();
        loop {
            if let Some(message) = kept.messages.pop_front() {
                return Ok(Some(message));
            }
            if let Some(reason) = kept.ended {
                return Err(reason);
            }
            let left = limit.saturating_sub(clock.now() - crate::time::Instant::ZERO);
            if left.is_zero() {
                return Ok(None);
            }
            let waited = self.queue.changed.wait_timeout(kept, left);
            kept = waited.unwrap_or_else(std::sync::PoisonError::into_inner).0;
        }
    }

    /// The next message, for async code of any runtime. Of several who wait at once, one gets it.
    pub const fn next(&self) -> NextMessage<'_> {
        NextMessage { messages: self }
    }

    /// Messages that were forgotten because nobody read them.
    #[must_use]
    pub fn missed(&self) -> u64 {
        self.queue.lock().missed
    }
}

/// Waits for the next message of [`Messages`].
#[must_use = "a future does nothing until it is awaited"]
#[derive(Debug)]
pub struct NextMessage<'a> {
    messages: &'a Messages,
}

impl Future for NextMessage<'_> {
    type Output = Result<OwnedMessage, EndReason>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        let mut kept = self.messages.queue.lock();
        if let Some(message) = kept.messages.pop_front() {
            return Poll::Ready(Ok(message));
        }
        if let Some(reason) = kept.ended {
            return Poll::Ready(Err(reason));
        }
        if !kept.wakers.iter().any(|waker| waker.will_wake(context.waker())) {
            kept.wakers.push(context.waker().clone());
        }
        Poll::Pending
    }
}
