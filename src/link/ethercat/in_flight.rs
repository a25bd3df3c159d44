//! The frames under way, and whether what came back is one of them.
//!
//! `ethercrab` takes a frame for the answer when the index of its first datagram fits. A late frame,
//! a duplicate, another main device's frame or a mangled one may fit as well; so every frame is
//! compared with what was sent before it is handed on: the same datagrams, each with the same
//! command, index, address and length. Only data and working counters may differ.
//!
//! Invariants: a frame that was sent is answered at most once; nothing here allocates after
//! [`InFlight::new`].

use std::boxed::Box;
use std::vec;

use super::pdu_core::FRAMES;
use super::wire::MAX_FRAME;
use crate::time::Instant;

/// Ethernet header: destination, source, EtherType.
const ETHERNET_HEADER: usize = 14;
/// EtherCAT's EtherType, as it stands in a frame.
const ETHERTYPE: [u8; 2] = [0x88, 0xA4];
/// The 2 bytes of length and type behind the Ethernet header.
const ETHERCAT_HEADER: usize = 2;
/// Command, index, address, length and flags, event.
const DATAGRAM_HEADER: usize = 10;
/// Working counter.
const WORKING_COUNTER: usize = 2;
/// Where the source address stands in a frame.
const SOURCE: core::ops::Range<usize> = 6..12;

/// Configured address read.
const FPRD: u8 = 4;
/// Logical read and write, which begins a frame of process data, and the read of the reference clock,
/// which comes before it with distributed clocks.
const LRW: u8 = 12;
const FRMW: u8 = 14;
/// Where the process memory of an ESC begins; registers are below.
const PROCESS_MEMORY: u16 = 0x1000;
/// Mailbox type CoE, low four bits of byte 5 of a mailbox datagram.
const COE: u8 = 3;
/// CoE services, high four bits of byte 7.
const EMERGENCY: u8 = 1;
const SDO_REQUEST: u8 = 2;
/// Command byte of an SDO abort.
const ABORT: u8 = 0x80;

/// What a subdevice said in its mailbox beyond answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MailboxNotice {
    /// Station address of the subdevice.
    pub(super) station: u16,
    pub(super) kind: NoticeKind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NoticeKind {
    /// An emergency: its error code and the error register (1001h).
    Emergency { code: u16, register: u8 },
    /// The abort of an SDO transfer.
    Abort { index: u16, sub_index: u8, code: u32 },
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

/// One datagram of a frame, by its place.
struct Datagram<'a> {
    header: &'a [u8],
    body: &'a [u8],
    rest: &'a [u8],
}

fn first_datagram(frame: &[u8]) -> Option<Datagram<'_>> {
    let header = frame.get(ETHERNET_HEADER..ETHERNET_HEADER + ETHERCAT_HEADER)?;
    let len = usize::from(u16::from_le_bytes([*header.first()?, *header.get(1)?]) & 0x07FF);
    let start = ETHERNET_HEADER + ETHERCAT_HEADER;
    datagram(frame.get(start..start + len)?)
}

fn datagram(bytes: &[u8]) -> Option<Datagram<'_>> {
    let header = bytes.get(..DATAGRAM_HEADER)?;
    let len = usize::from(u16::from_le_bytes([*header.get(6)?, *header.get(7)?]) & 0x07FF);
    let end = DATAGRAM_HEADER + len + WORKING_COUNTER;
    Some(Datagram { header, body: bytes.get(DATAGRAM_HEADER..end)?, rest: bytes.get(end..)? })
}

impl Datagram<'_> {
    fn has_next(&self) -> bool {
        self.header.get(7).is_some_and(|flags| flags & 0x80 != 0)
    }

    /// Whether `answer` is this datagram on its way back.
    fn is_answered_by(&self, answer: &Self) -> bool {
        let (Some(&[command, index, ..]), Some(asked), Some(back)) =
            (self.header.first_chunk::<2>(), self.header.get(..8), answer.header.get(..8))
        else {
            return false;
        };
        // Each subdevice counts the position up in APRD, APWR, APRW, BRD, BWR, BRW and ARMW.
        let counts_up = matches!(command, 1..=3 | 7..=9 | 13);
        let address = if counts_up { 4..6 } else { 2..6 };
        // Bit 14 of the length word marks a frame that went round twice; the others must stay.
        let same_length = asked.get(6) == back.get(6)
            && asked.get(7).map(|b| b & 0xBF) == back.get(7).map(|b| b & 0xBF);
        back.starts_with(&[command, index])
            && asked.get(address.clone()) == back.get(address)
            && same_length
    }
}

/// Whether `answer` carries the datagrams of `sent`, one by one.
fn is_answer(sent: &[u8], answer: &[u8]) -> bool {
    let (mut asked, mut back) = (first_datagram(sent), first_datagram(answer));
    loop {
        let (Some(one), Some(other)) = (asked, back) else { return false };
        if !one.is_answered_by(&other) {
            return false;
        }
        if !one.has_next() {
            return true;
        }
        (asked, back) = (datagram(one.rest), datagram(other.rest));
    }
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

    /// Remembers a frame that was just sent. With all places taken, the oldest is forgotten.
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

    /// Whether `frame` answers one of the frames under way; that one is then settled.
    pub(super) fn settle(&mut self, frame: &[u8]) -> bool {
        if frame.get(ETHERNET_HEADER - 2..ETHERNET_HEADER) != Some(&ETHERTYPE) {
            return false;
        }
        let found = self.slots.iter_mut().filter(|slot| slot.is_open).find(|slot| {
            let Some(sent) = slot.bytes.get(..slot.len) else { return false };
            // The first subdevice marks the source address; what comes back unmarked never passed one.
            sent.get(SOURCE) != frame.get(SOURCE) && is_answer(sent, frame)
        });
        found.map(|slot| slot.is_open = false).is_some()
    }

    /// Forgets everything under way: whoever waited has given up.
    pub(super) fn forget_all(&mut self) {
        self.slots.iter_mut().for_each(|slot| slot.is_open = false);
    }

    /// Forgets the process data frames under way: whoever waited for them has given up.
    pub(super) fn forget_cycle(&mut self) {
        let is_cycle = |slot: &Slot| {
            matches!(slot.bytes.get(ETHERNET_HEADER + ETHERCAT_HEADER), Some(&(LRW | FRMW)))
        };
        let cycle = self.slots.iter_mut().filter(|slot| is_cycle(slot));
        cycle.for_each(|slot| slot.is_open = false);
    }

    /// When the first frame under way should be sent again if it goes unanswered for `patience`.
    pub(super) fn next_resend(&self, patience: crate::time::Duration) -> Option<Instant> {
        self.slots.iter().filter(|slot| slot.is_open).map(|slot| slot.sent_at + patience).min()
    }

    /// Hands every frame that is due at `now` to `send`, as it was sent the first time.
    pub(super) fn resend(
        &mut self,
        now: Instant,
        patience: crate::time::Duration,
        mut send: impl FnMut(&[u8]),
    ) {
        let due = self.slots.iter_mut().filter(|slot| slot.is_open);
        for slot in due.filter(|slot| slot.sent_at + patience <= now) {
            slot.sent_at = now;
            slot.resends = slot.resends.saturating_add(1);
            if let Some(bytes) = slot.bytes.get(..slot.len) {
                send(bytes);
            }
        }
    }
}

/// Looks for a message in a mailbox that `ethercrab` cannot tell us about. An emergency is taken out:
/// the read then looks unanswered, because `ethercrab` asserts that none comes in place of an answer.
pub(super) fn take_notice(frame: &mut [u8]) -> Option<MailboxNotice> {
    let mut start = ETHERNET_HEADER + ETHERCAT_HEADER;
    loop {
        let this = datagram(frame.get(start..)?)?;
        let end = start + DATAGRAM_HEADER + this.body.len();
        let has_next = this.has_next();
        if let Some(notice) = notice_of(&this) {
            if matches!(notice.kind, NoticeKind::Emergency { .. }) {
                frame.get_mut(end - WORKING_COUNTER..end)?.fill(0);
            }
            return Some(notice);
        }
        if !has_next {
            return None;
        }
        start = end;
    }
}

fn notice_of(datagram: &Datagram<'_>) -> Option<MailboxNotice> {
    let [command, _, station_low, station_high, memory_low, memory_high, ..] =
        *datagram.header.first_chunk::<8>()?;
    let is_memory = u16::from_le_bytes([memory_low, memory_high]) >= PROCESS_MEMORY;
    let (data, working_counter) = datagram.body.split_last_chunk::<WORKING_COUNTER>()?;
    let [_, _, _, _, _, kind, _, service, a, b, c, d, code @ ..] = *data.first_chunk::<16>()?;
    if command != FPRD || !is_memory || kind & 0x0F != COE || *working_counter == [0, 0] {
        return None;
    }
    let kind = match (service >> 4, a) {
        (EMERGENCY, _) => NoticeKind::Emergency { code: u16::from_le_bytes([a, b]), register: c },
        (SDO_REQUEST, ABORT) => NoticeKind::Abort {
            index: u16::from_le_bytes([b, c]),
            sub_index: d,
            code: u32::from_le_bytes(code),
        },
        _ => return None,
    };
    Some(MailboxNotice { station: u16::from_le_bytes([station_low, station_high]), kind })
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
        assert!(frames.settle(&answer()));
        assert!(!frames.settle(&answer()), "a duplicate answers nothing");
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
                // Free bits: type in the EtherCAT header, circulating bits, event words.
                let free = matches!((position, bit), (15, 3..=7) | (23 | 37, 6))
                    || matches!(position, 24 | 25 | 38 | 39);
                assert_eq!(frames.settle(&bad), free, "byte {position} bit {bit}");
            }
        }
    }

    #[test]
    fn truncated_and_own_frames_answer_nothing() {
        let mut frames = InFlight::new();
        frames.sent(&two_datagrams(0x10), Instant::ZERO);
        let good = answer();
        for len in 0..good.len() {
            assert!(!frames.settle(&good[..len]), "{len} bytes");
        }
        assert!(!frames.settle(&two_datagrams(0x10)));
        assert!(frames.settle(&good));
    }

    #[test]
    fn an_emergency_is_taken_out_and_named() {
        let mut frame = vec![0xFF; 12];
        frame.extend([0x88, 0xA4, 0x1C, 0x10]);
        frame.extend([4, 7, 0x01, 0x10, 0x80, 0x10, 0x10, 0x00, 0, 0]);
        frame.extend([10, 0, 0, 0, 0, 0x13, 0, 0x10, 0x00, 0x82, 0x21, 1, 2, 3, 4, 5]);
        frame.extend([1, 0]);
        let kind = NoticeKind::Emergency { code: 0x8200, register: 0x21 };
        assert_eq!(take_notice(&mut frame), Some(MailboxNotice { station: 0x1001, kind }));
        assert_eq!(frame[42..], [0, 0]);
        assert_eq!(take_notice(&mut frame), None, "it looks unread now");
        assert_eq!(take_notice(&mut answer()), None);
    }

    #[test]
    fn an_abort_is_named_and_left_in_place() {
        let mut frame = vec![0xFF; 12];
        frame.extend([0x88, 0xA4, 0x1C, 0x10]);
        frame.extend([4, 7, 0x02, 0x10, 0x80, 0x10, 0x10, 0x00, 0, 0]);
        frame.extend([10, 0, 0, 0, 0, 0x13, 0, 0x20, 0x80, 0x12, 0x1C, 3, 0x22, 0, 0, 8]);
        frame.extend([1, 0]);
        let before = frame.clone();
        let kind = NoticeKind::Abort { index: 0x1C12, sub_index: 3, code: 0x0800_0022 };
        assert_eq!(take_notice(&mut frame), Some(MailboxNotice { station: 0x1002, kind }));
        assert_eq!(frame, before);
    }
}
