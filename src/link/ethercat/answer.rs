//! Whether a frame is the answer to one that was sent.
//!
//! `ethercrab` takes a frame for the answer when the index of its first datagram fits. A late frame,
//! a duplicate, another main device's frame or a mangled one may fit as well; so every frame is
//! compared with what was sent before it is handed on: behind the same EtherCAT header the same
//! datagrams, each with the same command, index, address and length. Only data and working counters
//! may differ, and what subdevices count or set in a header.
//!
//! Source: ETG.1000 part 4.

use crate::wire::ethercat::command::Command;
use crate::wire::ethercat::frame::{
    DATAGRAM_HEADER, ETHERCAT_HEADER, ETHERNET_HEADER, WORKING_COUNTER,
};

/// Length of everything before the first datagram.
const HEAD: usize = ETHERNET_HEADER + ETHERCAT_HEADER;

/// What stands before the datagrams, except for the destination.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Head {
    source: [u8; 6],
    /// The Ethernet type; length and type of the EtherCAT header.
    kind: [u8; 4],
}

/// What a datagram's header says about whose it is: command, index, address, length and whether
/// another follows, as they stand.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Mark(u64);

/// The marks of a frame, one by one, as far as the datagrams are whole.
struct Marks<'a> {
    rest: &'a [u8],
    ended: bool,
}

/// Takes a frame apart. `None` if it is too short for one.
fn split(frame: &[u8]) -> Option<(Head, Marks<'_>)> {
    let (&[_, _, _, _, _, _, a, b, c, d, e, f, kind @ ..], rest) =
        frame.split_first_chunk::<HEAD>()?;
    Some((Head { source: [a, b, c, d, e, f], kind }, Marks { rest, ended: false }))
}

impl Mark {
    /// The two bytes of the address in which each subdevice may count itself.
    const COUNTER: u64 = 0xFFFF_0000;
    /// The free bits beside the length: reserved ones, and that the frame circulated.
    const FREE: u64 = 0x7800 << 48;
    /// The length, in the last two bytes.
    const LENGTH: u64 = 0x07FF;
    const MORE: u64 = 0x8000 << 48;

    const fn data_len(self) -> usize {
        // Eleven bits fit.
        (self.0 >> 48 & Self::LENGTH) as usize
    }

    const fn has_more(self) -> bool {
        self.0 & Self::MORE != 0
    }

    /// Whether subdevices count themselves in the address.
    const fn is_counted(self) -> bool {
        let [code, _, a, b, c, d, _, _] = self.0.to_le_bytes();
        matches!(
            Command::from_wire(code, [a, b, c, d]),
            Some(
                Command::Aprd { .. }
                    | Command::Apwr { .. }
                    | Command::Aprw { .. }
                    | Command::Armw { .. }
                    | Command::Brd { .. }
                    | Command::Bwr { .. }
                    | Command::Brw { .. }
            )
        )
    }

    /// Whether `back` is this datagram on its way back.
    const fn is_answered_by(self, back: Self) -> bool {
        let changed = (self.0 ^ back.0) & !Self::FREE;
        changed == 0 || (changed & !Self::COUNTER == 0 && self.is_counted())
    }
}

impl Iterator for Marks<'_> {
    type Item = Mark;

    fn next(&mut self) -> Option<Mark> {
        if self.ended {
            return None;
        }
        let mark = Mark(u64::from_le_bytes(*self.rest.first_chunk()?));
        self.rest = self.rest.get(DATAGRAM_HEADER + mark.data_len() + WORKING_COUNTER..)?;
        self.ended = !mark.has_more();
        Some(mark)
    }
}

/// Whether `back` carries the datagrams with these marks, one by one, and no others. No datagrams are
/// answered by nothing.
fn are_answered_by(asked: impl Iterator<Item = Mark>, mut back: Marks<'_>) -> bool {
    let mut has_more = true;
    for asked in asked {
        if !back.next().is_some_and(|back| asked.is_answered_by(back)) {
            return false;
        }
        has_more = asked.has_more();
    }
    !has_more
}

/// Whether `answer` carries the datagrams of `sent`, one by one, behind the same EtherCAT header.
pub(super) fn is_answer(sent: &[u8], answer: &[u8]) -> bool {
    let (Some((sent, asked)), Some((head, back))) = (split(sent), split(answer)) else {
        return false;
    };
    sent.kind == head.kind && are_answered_by(asked, back)
}

/// All that tells the answer to a frame of up to `N` datagrams, without its data.
#[derive(Clone, Copy, Debug)]
pub(super) struct Question<const N: usize> {
    head: Head,
    marks: [Mark; N],
    datagrams: usize,
}

impl<const N: usize> Question<N> {
    /// What nothing answers.
    pub(super) fn none() -> Self {
        Self { head: Head::default(), marks: [Mark::default(); N], datagrams: 0 }
    }

    /// What a frame asks that is being sent. Nothing answers one of more than `N` datagrams.
    pub(super) fn set(&mut self, sent: &[u8]) {
        self.datagrams = 0;
        let Some((head, marks)) = split(sent) else { return };
        self.head = head;
        for (place, mark) in self.marks.iter_mut().zip(marks) {
            *place = mark;
            self.datagrams += 1;
        }
    }

    /// Lets nothing answer it any more.
    pub(super) const fn forget(&mut self) {
        self.datagrams = 0;
    }

    /// Whether `frame` is the answer, and has passed a subdevice.
    pub(super) fn is_answered_by(&self, frame: &[u8]) -> bool {
        let Some((head, back)) = split(frame) else { return false };
        head.kind == self.head.kind
            && head.source != self.head.source
            && are_answered_by(self.marks.iter().take(self.datagrams).copied(), back)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;
    use std::vec::Vec;

    /// A cycle of one robot: an LRW of 4 bytes and the read of an AL status.
    fn cycle(source: u8) -> Vec<u8> {
        let mut frame = vec![0xFF; 6];
        frame.extend([source; 6]);
        frame.extend([0x88, 0xA4, 0x1E, 0x10]);
        frame.extend([12, 7, 0x00, 0x00, 0x01, 0x00, 0x04, 0x80, 0, 0, 1, 2, 3, 4, 0, 0]);
        frame.extend([4, 8, 0x00, 0x10, 0x30, 0x01, 0x02, 0x00, 0, 0, 0, 0, 0, 0]);
        frame
    }

    fn answer() -> Vec<u8> {
        let mut frame = cycle(0x12);
        frame[26..32].copy_from_slice(&[9, 9, 9, 9, 3, 0]);
        frame[42..46].copy_from_slice(&[8, 0, 1, 0]);
        frame
    }

    fn asked<const N: usize>(sent: &[u8]) -> Question<N> {
        let mut question = Question::none();
        question.set(sent);
        question
    }

    #[test]
    fn of_a_cycle_only_data_and_counters_may_differ() {
        let (question, good) = (asked::<6>(&cycle(0x10)), answer());
        assert!(question.is_answered_by(&good));
        for position in 12..good.len() {
            for bit in 0..8 {
                let mut bad = good.clone();
                bad[position] ^= 1 << bit;
                // Data and counters; the free bits of a length; what robots report in the event word.
                let free = matches!(position, 24..=31 | 40..=45)
                    || matches!((position, bit), (23 | 39, 3..=6));
                assert_eq!(question.is_answered_by(&bad), free, "byte {position} bit {bit}");
                assert_eq!(is_answer(&cycle(0x10), &bad), free, "byte {position} bit {bit}");
            }
        }
    }

    #[test]
    fn truncated_frames_and_those_that_passed_nobody_answer_nothing() {
        let (question, good) = (asked::<6>(&cycle(0x10)), answer());
        for len in 0..good.len() {
            assert!(!question.is_answered_by(&good[..len]), "{len} bytes");
            assert!(!is_answer(&cycle(0x10), &good[..len]), "{len} bytes");
        }
        assert!(!question.is_answered_by(&cycle(0x10)));
        let mut padded = good;
        padded.resize(60, 0xAA);
        assert!(question.is_answered_by(&padded));
    }

    #[test]
    fn nothing_answers_what_was_not_asked_or_is_forgotten() {
        let mut question = asked::<6>(&cycle(0x10));
        question.forget();
        assert!(!question.is_answered_by(&answer()));
        assert!(!Question::<6>::none().is_answered_by(&answer()));
        assert!(!Question::<6>::none().is_answered_by(&[0; 60]));
        // Of two datagrams only one was remembered.
        assert!(!asked::<1>(&cycle(0x10)).is_answered_by(&answer()));
        // What was sent before does not count any more.
        let mut question = asked::<6>(&cycle(0x10));
        let mut next = cycle(0x10);
        (next[17], next[33]) = (9, 10);
        question.set(&next);
        assert!(!question.is_answered_by(&answer()));
    }

    #[test]
    fn one_datagram_more_or_less_is_another_frame() {
        let question = asked::<6>(&cycle(0x10));
        let mut longer = answer();
        longer[39] |= 0x80;
        longer.extend([4, 9, 0x01, 0x10, 0x30, 0x01, 0x02, 0x00, 0, 0, 8, 0, 1, 0]);
        assert!(!question.is_answered_by(&longer));
        let mut shorter = answer();
        shorter[23] &= 0x7F;
        assert!(!question.is_answered_by(&shorter));
    }
}
