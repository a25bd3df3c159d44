//! Commands that may have vanished from the robot's queue without a trace.
//!
//! A robot that drops its queue discards the checkpoints in it, and that shows. It does not show
//! when no checkpoint was behind the commands, when the layout reports no discarded checkpoint
//! (firmware 10.2), or when another controller used the robot while this one was away. A checkpoint
//! sent afterwards proves nothing for what was sent before.
//!
//! ```text
//!   settled .. proven by a checkpoint sent before | in doubt | sent since, proven as usual
//!                                                 ^ from     ^ upto
//! ```
//!
//! Invariants: what is in doubt ends as unknown, never as done, unless a checkpoint that was sent
//! before the doubt arose is reached.

use super::event::UnknownCause;

/// The doubtful range of the ledger, by index.
#[derive(Clone, Copy, Debug)]
pub(super) struct Doubt {
    from: u32,
    upto: u32,
    /// Automatic checkpoints up to this boundary were sent before the doubt arose.
    marked: u32,
    cause: UnknownCause,
}

/// Whether `index` is above `other` on the wrapping count.
#[inline]
pub(super) fn above(index: u32, other: u32) -> bool {
    index != other && index.wrapping_sub(other) < u32::MAX / 2
}

fn earlier(index: u32, other: u32) -> u32 {
    if above(index, other) { other } else { index }
}

impl Doubt {
    pub(super) const fn none() -> Self {
        Self { from: 0, upto: 0, marked: 0, cause: UnknownCause::LinkLost }
    }

    /// Everything from `from` to `upto` is in doubt, together with what already was.
    pub(super) fn arise(
        &mut self,
        from: u32,
        upto: u32,
        marked: u32,
        settled: u32,
        cause: UnknownCause,
    ) {
        if !above(upto, from) {
            return;
        }
        let from = if self.is_open(settled) { earlier(self.from, from) } else { from };
        *self = Self { from, upto, marked, cause };
    }

    /// Whether something above `settled` is in doubt.
    #[inline]
    pub(super) fn is_open(&self, settled: u32) -> bool {
        above(self.upto, settled)
    }

    /// An automatic checkpoint was reached.
    pub(super) fn mark_reached(&mut self, boundary: u32) {
        if !above(boundary, self.marked) {
            self.prove(boundary);
        }
    }

    /// A user checkpoint, itself an entry, was reached.
    pub(super) fn entry_reached(&mut self, index: u32) {
        if above(self.upto, index) {
            self.prove(index.wrapping_add(1));
        }
    }

    fn prove(&mut self, boundary: u32) {
        if above(boundary, self.from) {
            self.from = boundary;
        }
    }

    /// Of everything below `reached`: the end of what is proven, the end of what is in doubt, and
    /// why.
    pub(super) fn split(&self, reached: u32) -> (u32, u32, UnknownCause) {
        (earlier(reached, self.from), earlier(reached, self.upto), self.cause)
    }
}
