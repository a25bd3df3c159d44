//! TCP connections: packets put together from segments, answers kept until they are sent.
//!
//! Invariants: a stream stays in step whatever it carries: exactly as many bytes as each header says belong
//! to its packet, also when the packet is too long to be taken.

use core::net::SocketAddrV4;

use super::MAX_DATA_LEN;
use crate::time::{Duration, Instant};
use crate::wire::enip::encapsulation::{HEADER_LEN, Header, Packet};

/// Bytes of the longest packet that is taken, and room that every answer fits into.
pub(super) const MAX_PACKET_LEN: usize = HEADER_LEN + MAX_DATA_LEN;
/// Bytes of answers that wait on one stream.
const OUTPUT_LEN: usize = 2_048;

/// One TCP connection.
#[derive(Debug)]
pub(super) struct Stream {
    /// Where it comes from.
    pub(super) peer: SocketAddrV4,
    /// Handle of its session; 0 while none is registered.
    pub(super) session: u32,
    /// When a whole packet came last, or a class 1 connection that was opened over it was last seen open.
    pub(super) heard_at: Instant,
    /// What arrived and is not a whole packet yet.
    pub(super) input: Reassembly,
    /// What is to be sent.
    pub(super) output: Output,
    /// To be closed once everything is sent; takes nothing more.
    pub(super) is_closing: bool,
}

impl Stream {
    pub(super) const fn new(peer: SocketAddrV4, now: Instant) -> Self {
        Self {
            peer,
            session: 0,
            heard_at: now,
            input: Reassembly {
                bytes: [0; MAX_PACKET_LEN],
                len: 0,
                to_skip: 0,
                is_delivered: false,
            },
            output: Output { bytes: [0; OUTPUT_LEN], start: 0, end: 0 },
            is_closing: false,
        }
    }

    /// When it has been silent for `inactivity`; `None` if that does not matter.
    pub(super) fn ends_at(&self, inactivity: Duration) -> Option<Instant> {
        (!inactivity.is_zero() && !self.is_closing).then(|| self.heard_at + inactivity)
    }
}

/// What has come together.
pub(super) enum Arrived<'a> {
    /// A packet.
    Packet(Packet<'a>),
    /// The header of one that is too long; its bytes are passed over.
    TooLong(Header),
}

/// The packet that is arriving.
#[derive(Debug)]
pub(super) struct Reassembly {
    bytes: [u8; MAX_PACKET_LEN],
    len: usize,
    /// Bytes still to come of a packet that is not taken.
    to_skip: usize,
    is_delivered: bool,
}

impl Reassembly {
    /// Takes bytes off the front of `bytes` until a packet is whole; `None` once they are used up.
    pub(super) fn push(&mut self, bytes: &mut &[u8]) -> Option<Arrived<'_>> {
        if self.is_delivered {
            self.len = 0;
            self.is_delivered = false;
        }
        let skipped = self.to_skip.min(bytes.len());
        self.to_skip -= skipped;
        *bytes = bytes.get(skipped..).unwrap_or_default();
        self.take_until(HEADER_LEN, bytes);
        let header = Header::read(self.bytes.get(..self.len)?).ok()?;
        let data_len = usize::from(header.length);
        if data_len > MAX_DATA_LEN {
            self.len = 0;
            self.to_skip = data_len;
            return Some(Arrived::TooLong(header));
        }
        self.take_until(HEADER_LEN + data_len, bytes);
        let (packet, _) = Packet::from_stream(self.bytes.get(..self.len)?)?;
        self.is_delivered = true;
        Some(Arrived::Packet(packet))
    }

    /// Takes bytes off `bytes` until there are `len`, or no more.
    fn take_until(&mut self, len: usize, bytes: &mut &[u8]) {
        let count = len.saturating_sub(self.len).min(bytes.len());
        let room = self.bytes.get_mut(self.len..self.len + count);
        if let (Some(room), Some((taken, rest))) = (room, bytes.split_at_checked(count)) {
            room.copy_from_slice(taken);
            self.len += count;
            *bytes = rest;
        }
    }
}

/// Answers that wait to be sent.
#[derive(Debug)]
pub(super) struct Output {
    bytes: [u8; OUTPUT_LEN],
    start: usize,
    end: usize,
}

impl Output {
    /// Where the next answer may be written.
    pub(super) fn room(&mut self) -> &mut [u8] {
        self.bytes.get_mut(self.end..).unwrap_or_default()
    }

    /// That an answer of `len` bytes has been written.
    pub(super) fn commit(&mut self, len: usize) {
        self.end = self.end.saturating_add(len).min(OUTPUT_LEN);
    }

    /// Moves as much as fits into `room`; how many bytes.
    pub(super) fn take(&mut self, room: &mut [u8]) -> usize {
        let waiting = self.bytes.get(self.start..self.end).unwrap_or_default();
        let len = waiting.len().min(room.len());
        for (to, from) in room.iter_mut().zip(waiting) {
            *to = *from;
        }
        self.start += len;
        if self.start >= self.end {
            (self.start, self.end) = (0, 0);
        }
        len
    }

    pub(super) const fn is_empty(&self) -> bool {
        self.start >= self.end
    }
}
