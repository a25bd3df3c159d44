//! The frames under way outside the cycle, and whether what came back is one of them.
//!
//! Frames of the cycle have lanes of their own (`lane.rs`).
//!
//! Invariants: a frame that was sent is answered at most once; nothing here allocates after
//! [`InFlight::new`].

use std::boxed::Box;
use std::vec;

use super::answer::is_answer;
use super::pdu_core::FRAMES;
use super::wire::MAX_FRAME;
use crate::time::{Duration, Instant};

/// How often a frame is sent again: for 25 s, longer than anybody waits for one.
const MOST_RESENDS: u32 = 1_000;
/// Where the source address stands in a frame.
const SOURCE: core::ops::Range<usize> = 6..12;

/// A frame whose answer has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Settled {
    index: usize,
    /// Whether it was sent more than once: then the first may have been answered too, and that answer
    /// was lost.
    pub(super) was_resent: bool,
}

struct Slot {
    bytes: Box<[u8]>,
    len: usize,
    sent_at: Instant,
    resends: u32,
    is_open: bool,
}

/// What was sent and is not answered yet.
pub(super) struct InFlight {
    slots: Box<[Slot]>,
    next: usize,
}

impl InFlight {
    pub(super) fn new() -> Self {
        let slot = || Slot {
            bytes: vec![0; MAX_FRAME].into(),
            len: 0,
            sent_at: Instant::ZERO,
            resends: 0,
            is_open: false,
        };
        Self { slots: core::iter::repeat_with(slot).take(FRAMES).collect(), next: 0 }
    }

    /// Remembers a frame that was just sent. With all places taken, one of the others is forgotten.
    pub(super) fn sent(&mut self, frame: &[u8], now: Instant) {
        let free = self.slots.iter().position(|slot| !slot.is_open);
        let index = free.unwrap_or(self.next);
        self.next = (index + 1) % FRAMES;
        if let Some(slot) = self.slots.get_mut(index)
            && let Some(bytes) = slot.bytes.get_mut(..frame.len())
        {
            bytes.copy_from_slice(frame);
            (slot.len, slot.sent_at, slot.resends, slot.is_open) = (frame.len(), now, 0, true);
        }
    }

    /// The frame under way that `frame` answers, which is then settled.
    pub(super) fn settle(&mut self, frame: &[u8]) -> Option<Settled> {
        let is_answered = |slot: &Slot| {
            let Some(sent) = slot.bytes.get(..slot.len) else { return false };
            // The first subdevice marks the source address; what comes back unmarked never passed one.
            slot.is_open && sent.get(SOURCE) != frame.get(SOURCE) && is_answer(sent, frame)
        };
        let index = self.slots.iter().position(is_answered)?;
        let slot = self.slots.get_mut(index)?;
        slot.is_open = false;
        Some(Settled { index, was_resent: slot.resends > 0 })
    }

    /// Takes back that a frame was settled, as it is sent once more at `now`; its bytes.
    pub(super) fn reopen(&mut self, settled: Settled, now: Instant) -> Option<&[u8]> {
        let slot = self.slots.get_mut(settled.index)?;
        (slot.is_open, slot.sent_at, slot.resends) = (true, now, 0);
        slot.bytes.get(..slot.len)
    }

    /// The bytes of a settled frame as they were sent.
    pub(super) fn sent_bytes(&self, settled: Settled) -> Option<&[u8]> {
        let slot = self.slots.get(settled.index)?;
        slot.bytes.get(..slot.len)
    }

    /// Forgets everything under way: whoever waited has given up.
    pub(super) fn forget_all(&mut self) {
        self.slots.iter_mut().for_each(|slot| slot.is_open = false);
    }

    /// When the first frame under way should be sent again if it goes unanswered for `patience`.
    pub(super) fn next_resend(&self, patience: Duration) -> Option<Instant> {
        self.slots.iter().filter(|slot| slot.is_open).map(|slot| slot.sent_at + patience).min()
    }

    /// Hands every frame that is due at `now` to `send`, as it was sent the first time.
    pub(super) fn resend(&mut self, now: Instant, patience: Duration, mut send: impl FnMut(&[u8])) {
        let due = self.slots.iter_mut().filter(|slot| slot.is_open);
        for slot in due.filter(|slot| slot.sent_at + patience <= now) {
            slot.sent_at = now;
            slot.resends = slot.resends.saturating_add(1);
            // Whoever waited for it has long given up.
            slot.is_open = slot.resends < MOST_RESENDS;
            if let Some(bytes) = slot.bytes.get(..slot.len) {
                send(bytes);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// A frame with an FPRD of 2 bytes and a BRD of 2 bytes.
    fn two_datagrams(source: u8) -> Vec<u8> {
        let mut frame = vec![0xFF; 6];
        frame.extend([source; 6]);
        frame.extend([0x88, 0xA4, 0x1C, 0x10]);
        frame.extend([4, 7, 0x00, 0x10, 0x30, 0x01, 0x02, 0x80, 0, 0, 0, 0, 0, 0]);
        frame.extend([7, 8, 0x00, 0x00, 0x30, 0x01, 0x02, 0x00, 0, 0, 0, 0, 0, 0]);
        frame
    }

    fn answer() -> Vec<u8> {
        let mut frame = two_datagrams(0x12);
        frame[26..30].copy_from_slice(&[8, 0, 1, 0]);
        frame[32] = 3; // three subdevices counted the broadcast
        frame[40..44].copy_from_slice(&[8, 0, 3, 0]);
        frame
    }

    #[test]
    fn a_frame_is_answered_once() {
        let mut frames = InFlight::new();
        frames.sent(&two_datagrams(0x10), Instant::ZERO);
        assert!(frames.settle(&answer()).is_some());
        assert_eq!(frames.settle(&answer()), None, "a duplicate answers nothing");
    }

    #[test]
    fn only_data_and_counters_may_differ() {
        let good = answer();
        let header_bytes = (12..26).chain(30..32).chain(34..40);
        for position in header_bytes {
            for bit in 0..8 {
                let mut frames = InFlight::new();
                frames.sent(&two_datagrams(0x10), Instant::ZERO);
                let mut bad = good.clone();
                bad[position] ^= 1 << bit;
                // Free bits: reserved and circulating bits, event words.
                let free = matches!((position, bit), (23 | 37, 3..=6))
                    || matches!(position, 24 | 25 | 38 | 39);
                assert_eq!(frames.settle(&bad).is_some(), free, "byte {position} bit {bit}");
            }
        }
    }

    #[test]
    fn truncated_and_own_frames_answer_nothing() {
        let mut frames = InFlight::new();
        frames.sent(&two_datagrams(0x10), Instant::ZERO);
        let good = answer();
        for len in 0..good.len() {
            assert_eq!(frames.settle(&good[..len]), None, "{len} bytes");
        }
        assert_eq!(frames.settle(&two_datagrams(0x10)), None);
        assert!(frames.settle(&good).is_some());
    }
}
