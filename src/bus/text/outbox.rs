//! What waits to be sent, in whole messages.

use core::fmt;

/// A queue of bytes with room for `N`, filled message by message: one that does not fit is not there
/// at all.
///
/// What is written through [`fmt::Write`] is a draft; [`finish`](Self::finish) makes a message of it.
#[derive(Clone, Debug)]
pub struct Outbox<const N: usize> {
    bytes: [u8; N],
    /// First byte that has not been sent.
    start: usize,
    /// End of the last whole message.
    end: usize,
    /// End of the draft behind it.
    draft_end: usize,
    /// Whether a piece of the draft did not fit.
    is_torn: bool,
}

/// A message that an [`Outbox`] has no room for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the message does not fit into what waits to be sent: the peer does not read")]
pub struct DoesNotFit;

impl<const N: usize> Default for Outbox<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Outbox<N> {
    /// An empty one.
    #[must_use]
    pub const fn new() -> Self {
        Self { bytes: [0; N], start: 0, end: 0, draft_end: 0, is_torn: false }
    }

    /// Forgets everything, the draft too.
    pub const fn clear(&mut self) {
        (self.start, self.end, self.draft_end, self.is_torn) = (0, 0, 0, false);
    }

    /// What waits; no draft.
    #[must_use]
    pub fn waiting(&self) -> &[u8] {
        self.bytes.get(self.start..self.end).unwrap_or(&[])
    }

    /// Forgets the first `count` bytes: they are sent.
    pub fn sent(&mut self, count: usize) {
        self.start = self.start.saturating_add(count).min(self.end);
    }

    /// Ends the draft with a NUL and lets it be sent. A draft of nothing is no message.
    ///
    /// # Errors
    ///
    /// It did not fit; nothing of it is sent, and the next draft begins.
    pub fn finish(&mut self) -> Result<(), DoesNotFit> {
        if self.draft_end != self.end && !self.is_torn {
            self.put(&[0]);
        }
        if core::mem::take(&mut self.is_torn) {
            self.draft_end = self.end;
            return Err(DoesNotFit);
        }
        self.end = self.draft_end;
        Ok(())
    }

    fn put(&mut self, piece: &[u8]) {
        if self.draft_end.saturating_add(piece.len()) > N {
            self.move_to_front();
        }
        let end = self.draft_end.saturating_add(piece.len());
        match self.bytes.get_mut(self.draft_end..end) {
            Some(room) => {
                room.copy_from_slice(piece);
                self.draft_end = end;
            }
            None => self.is_torn = true,
        }
    }

    fn move_to_front(&mut self) {
        // Within the array: `start <= end <= draft_end <= N` always.
        self.bytes.copy_within(self.start..self.draft_end, 0);
        self.end -= self.start;
        self.draft_end -= self.start;
        self.start = 0;
    }
}

impl<const N: usize> fmt::Write for Outbox<N> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        if !self.is_torn {
            self.put(text.as_bytes());
        }
        if self.is_torn { Err(fmt::Error) } else { Ok(()) }
    }
}
