//! The frame of a cycle as our link sends it: to be sent ready-made, and to be counted.

use std::io;

use fieldarm::link::ethercat::wire::Wire;
use fieldarm::time::Instant;

/// Ethernet header and EtherCAT header.
const HEADERS: usize = 14 + 2;
/// Header of a datagram.
const DATAGRAM_HEADER: usize = 10;
const WORKING_COUNTER: usize = 2;
/// Preamble with start of frame, checksum, gap between frames.
const ON_THE_CABLE: usize = 8 + 4 + 12;
/// 100 Mbit/s.
const BITS_PER_US: usize = 100;
/// Logical read and write.
const LRW: u8 = 12;

/// An Ethernet frame without preamble and checksum.
#[derive(Clone, Debug, Default)]
pub(crate) struct Frame(Vec<u8>);

impl Frame {
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.0
    }

    /// The data bytes of each datagram.
    pub(crate) fn datagrams(&self) -> Vec<usize> {
        let mut lengths = Vec::new();
        let mut rest = self.0.get(HEADERS..).unwrap_or(&[]);
        while let Some(&[_, _, _, _, _, _, low, high]) = rest.first_chunk::<8>() {
            let length = usize::from(u16::from_le_bytes([low, high]) & 0x07FF);
            lengths.push(length);
            rest = rest.get(DATAGRAM_HEADER + length + WORKING_COUNTER..).unwrap_or(&[]);
            if high & 0x80 == 0 {
                break;
            }
        }
        lengths
    }

    /// Bytes on the cable, by the datagrams; a frame of less than 64 bytes is filled up.
    pub(crate) fn wire_bytes(&self) -> usize {
        let overhead = DATAGRAM_HEADER + WORKING_COUNTER;
        let data: usize = self.datagrams().iter().map(|length| overhead + length).sum();
        ON_THE_CABLE + (HEADERS + data).max(60)
    }

    /// Time on the cable in us.
    pub(crate) fn wire_us(&self) -> f64 {
        (8 * self.wire_bytes()) as f64 / BITS_PER_US as f64
    }

    /// The working counter of the first datagram of `frame`.
    pub(crate) fn working_counter(frame: &[u8]) -> Option<usize> {
        let datagram = frame.get(HEADERS..)?;
        let length = u16::from_le_bytes([*datagram.get(6)?, *datagram.get(7)?]) & 0x07FF;
        let counter = datagram.get(DATAGRAM_HEADER + usize::from(length)..)?.first_chunk::<2>()?;
        Some(usize::from(u16::from_le_bytes(*counter)))
    }

    /// As a word of an argument.
    pub(crate) fn to_hex(&self) -> String {
        self.0.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// What [`Self::to_hex`] made.
    pub(crate) fn from_hex(text: &str) -> Option<Self> {
        let digits = text.as_bytes().chunks_exact(2);
        let byte = |pair| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok();
        digits.map(byte).collect::<Option<_>>().map(Self)
    }
}

/// A wire that remembers the last frame of process data that was sent.
pub(crate) struct Remembering<W> {
    wire: W,
    last: Vec<u8>,
}

impl<W> Remembering<W> {
    pub(crate) fn new(wire: W) -> Self {
        Self { wire, last: Vec::new() }
    }

    pub(crate) fn into_inner(self) -> W {
        self.wire
    }

    pub(crate) fn last(&self) -> Frame {
        Frame(self.last.clone())
    }
}

impl<W: Wire> Wire for Remembering<W> {
    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        if frame.get(HEADERS) == Some(&LRW) {
            self.last.clear();
            self.last.extend_from_slice(frame);
        }
        self.wire.send(frame)
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> io::Result<Option<usize>> {
        self.wire.receive(buffer, deadline)
    }

    fn now(&self) -> Instant {
        self.wire.now()
    }

    fn pause_until(&mut self, deadline: Instant) {
        self.wire.pause_until(deadline);
    }

    fn advance_to(&mut self, now: Instant) {
        self.wire.advance_to(now);
    }
}
