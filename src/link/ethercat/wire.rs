//! What carries frames between a main device and its segment, and the clock that goes with it.

use std::io;

use crate::time::Instant;

/// Longest Ethernet frame without its checksum, in bytes.
pub const MAX_FRAME: usize = 1_514;

/// A wire with one end in this process, and the time that passes on it.
///
/// Two kinds exist: a raw socket, whose time is the system's monotonic clock, and an emulated
/// segment in memory, whose time is simulated: waiting costs nothing there.
pub trait Wire {
    /// Sends one Ethernet frame, without preamble and checksum.
    ///
    /// # Errors
    ///
    /// The frame did not leave. The link treats it like a lost frame.
    fn send(&mut self, frame: &[u8]) -> io::Result<()>;

    /// Waits until `deadline` for a frame, and returns its length in `buffer`; `None` when the
    /// deadline passed without one. A deadline in the past asks without waiting. Frames longer than
    /// `buffer` are dropped. Frames that this end sent do not come back.
    ///
    /// # Errors
    ///
    /// The wire cannot deliver (interface down or gone). The link treats it like a lost frame.
    fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> io::Result<Option<usize>>;

    /// A frame that is already there, without waiting and without giving way to others.
    ///
    /// # Errors
    ///
    /// As of [`receive`](Self::receive).
    fn receive_now(&mut self, buffer: &mut [u8]) -> io::Result<Option<usize>> {
        let now = self.now();
        self.receive(buffer, now)
    }

    /// As [`receive`](Self::receive), for a frame that is all but certain to come before `deadline`: where
    /// none comes, the wait may last some milliseconds longer. That is cheaper on some wires.
    ///
    /// # Errors
    ///
    /// As of [`receive`](Self::receive).
    fn receive_next(&mut self, buffer: &mut [u8], deadline: Instant) -> io::Result<Option<usize>> {
        self.receive(buffer, deadline)
    }

    /// The time on this wire.
    fn now(&self) -> Instant;

    /// Lets time pass until `deadline` while the wire cannot deliver.
    fn pause_until(&mut self, deadline: Instant);

    /// Tells a wire with simulated time what time it is; never backwards. Others ignore it.
    fn advance_to(&mut self, now: Instant) {
        let _ = now;
    }
}
