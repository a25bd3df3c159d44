//! Messages that wait to be sent.

use alloc::collections::VecDeque;
use alloc::string::String;

/// Messages an outbox holds; when it is full, the oldest is dropped. A server empties it after every
/// call, so that only a caller who never asks loses something. Chosen: two seconds of everything at
/// the shortest monitoring interval.
pub(super) const MOST_MESSAGES: usize = 40_000;

/// Messages for one port, oldest first.
#[derive(Clone, Debug, Default)]
pub(super) struct Outbox {
    messages: VecDeque<String>,
}

impl Outbox {
    pub(super) fn push(&mut self, message: String) {
        if self.messages.len() >= MOST_MESSAGES {
            self.messages.pop_front();
        }
        self.messages.push_back(message);
    }

    pub(super) fn pop(&mut self) -> Option<String> {
        self.messages.pop_front()
    }

    pub(super) fn clear(&mut self) {
        self.messages.clear();
    }
}
