//! The TCP connection to a target and the session on it: one request at a time, answers put together from
//! whatever segments arrive.

use super::Step;
use crate::time::Instant;
use crate::wire::enip::DecodeError;
use crate::wire::enip::connection::Triad;
use crate::wire::enip::encapsulation::{HEADER_LEN, Header, Packet};
use crate::wire::enip::message::Service;

/// Longest packet that is taken from the stream, with header.
pub(super) const PACKET_LEN: usize = 640;

/// Bytes of the stream that do not form a whole packet yet.
#[derive(Debug)]
pub(super) struct Inbox {
    bytes: [u8; PACKET_LEN],
    len: usize,
}

impl Inbox {
    pub(super) const fn new() -> Self {
        Self { bytes: [0; PACKET_LEN], len: 0 }
    }

    pub(super) const fn clear(&mut self) {
        self.len = 0;
    }

    /// Takes as many of `bytes` as there is room for and returns the others.
    pub(super) fn fill<'a>(&mut self, bytes: &'a [u8]) -> &'a [u8] {
        let room = self.bytes.get_mut(self.len..).unwrap_or(&mut []);
        let count = room.len().min(bytes.len());
        let (taken, rest) = bytes.split_at_checked(count).unwrap_or((bytes, &[]));
        for (place, byte) in room.iter_mut().zip(taken) {
            *place = *byte;
        }
        self.len = self.len.saturating_add(count).min(PACKET_LEN);
        rest
    }

    /// Moves the first packet to `out`, once it is whole.
    ///
    /// # Errors
    ///
    /// It will never be: its header announces more than there is room for.
    pub(super) fn pop(&mut self, out: &mut [u8; PACKET_LEN]) -> Result<Option<usize>, DecodeError> {
        let held = self.bytes.get(..self.len).unwrap_or(&[]);
        let Ok(header) = Header::read(held) else { return Ok(None) };
        if usize::from(header.length) > PACKET_LEN - HEADER_LEN {
            return Err(DecodeError::Value {
                message: "encapsulation header",
                field: "length",
                found: u32::from(header.length),
                allowed: "616 at most",
            });
        }
        let Some((_, len)) = Packet::from_stream(held) else { return Ok(None) };
        *out = self.bytes;
        self.bytes.rotate_left(len.min(PACKET_LEN));
        self.len = self.len.saturating_sub(len);
        Ok(Some(len))
    }
}

/// How far the TCP connection is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stream {
    /// There is none; not to be tried again before `retry_at`.
    Down { retry_at: Instant },
    /// Asked for.
    Connecting { deadline: Instant },
    /// There.
    Up,
}

/// A request that has not been answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pending {
    pub(super) step: Step,
    pub(super) service: Service,
    /// Comes back with the answer.
    pub(super) context: [u8; 8],
    pub(super) deadline: Instant,
    /// Of Forward Open and Forward Close: which connection.
    pub(super) triad: Triad,
}

/// The session's state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Session {
    pub(super) stream: Stream,
    /// The I/O still has to be told to close the stream.
    pub(super) must_disconnect: bool,
    /// The session ends with an UnRegisterSession, then the stream.
    pub(super) must_unregister: bool,
    /// Handle of the session, once the target has given one.
    pub(super) handle: Option<u32>,
    pub(super) pending: Option<Pending>,
    pub(super) has_asked_identity: bool,
}

impl Session {
    pub(super) const fn new() -> Self {
        Self {
            stream: Stream::Down { retry_at: Instant::ZERO },
            must_disconnect: false,
            must_unregister: false,
            handle: None,
            pending: None,
            has_asked_identity: false,
        }
    }

    pub(super) const fn is_up(&self) -> bool {
        matches!(self.stream, Stream::Up)
    }

    /// The stream is gone, or is to be closed if `hang_up`.
    pub(super) const fn drop_stream(&mut self, retry_at: Instant, hang_up: bool) {
        *self = Self::new();
        self.stream = Stream::Down { retry_at };
        self.must_disconnect = hang_up;
    }

    /// Lets the stream be tried again without waiting.
    pub(super) const fn hurry(&mut self, now: Instant) {
        if let Stream::Down { retry_at } = &mut self.stream
            && retry_at.as_nanos() > now.as_nanos()
        {
            *retry_at = now;
        }
    }
}
