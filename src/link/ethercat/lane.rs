//! The way of one group's cycle frames: a place of `ethercrab` for one frame, and what was asked.
//!
//! A cycle comes once a millisecond and finds little of the last one in the caches. So the frames of
//! the cycle do not share the storage of all others, whose places are used in turns: each group has
//! one place, no longer than its frame, and of a frame that was sent only the headers are kept. It is
//! never sent twice.
//!
//! Invariants: a frame that was sent is answered at most once, by nothing that differs from it in more
//! than data and working counters; nothing here allocates after [`Lane::take`].

use ethercrab::MainDevice;

use super::answer::Question;
use super::driver::FrameCounters;
use super::group::GROUP_ROBOTS;
use super::pdu_core::CycleCore;
use super::wire::Wire;

/// Datagrams of a cycle: the time of the reference, process data, the state of each robot.
const MOST_DATAGRAMS: usize = 2 + GROUP_ROBOTS;

/// The way of one group's cycle frames.
pub(super) struct Lane {
    core: CycleCore,
    /// What is under way.
    question: Question<MOST_DATAGRAMS>,
}

impl Lane {
    /// A lane for frames of up to `frame_len` bytes.
    pub(super) fn take(frame_len: usize) -> Self {
        Self { core: CycleCore::take(frame_len), question: Question::none() }
    }

    /// The main device whose frames go this way: for the group's cycle alone, since there is one place.
    pub(super) const fn main_device(&self) -> &'static MainDevice<'static> {
        self.core.main_device()
    }

    /// Sends the frame that waits, if one does.
    pub(super) fn send_pending(&mut self, wire: &mut impl Wire, counters: &mut FrameCounters) {
        let Some(frame) = self.core.next_sendable_frame() else { return };
        let question = &mut self.question;
        let _ = frame.send_blocking(|bytes| {
            match wire.send(bytes) {
                Ok(()) => counters.sent += 1,
                Err(_) => counters.unsent += 1,
            }
            question.set(bytes);
            // Said to be sent in either case: a frame that did not leave is a lost frame.
            Ok(bytes.len())
        });
    }

    /// Hands `frame` on if it is the answer to what is under way; whether it was.
    pub(super) fn receive(&mut self, frame: &[u8]) -> bool {
        let is_answer = self.question.is_answered_by(frame);
        if is_answer {
            self.question.forget();
            self.core.receive_frame(frame);
        }
        is_answer
    }

    /// Forgets what is under way: whoever waited for it has given up.
    pub(super) const fn give_up(&mut self) {
        self.question.forget();
    }
}
