//! What carries a scanner's messages: one UDP socket, a TCP connection per target, and a clock.

use core::net::{Ipv4Addr, SocketAddrV4};
use std::io;

use crate::time::Instant;
use crate::wire::enip::IO_PORT;

/// Room that a caller of [`Network::receive`] gives: more than any message of a scanner, in bytes.
pub const ROOM: usize = 4_096;

/// What arrived. Bytes, if any, stand in the room given to [`Network::receive`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// A TCP connection asked for with [`Network::connect`] is there.
    Connected {
        /// Number of the target.
        target: usize,
    },
    /// The first `len` bytes of the room came on a target's TCP connection, after those before.
    Stream {
        /// Number of the target.
        target: usize,
        /// Number of bytes, at least 1.
        len: usize,
    },
    /// A TCP connection could not be made, or was ended by the other side. Nothing of it follows.
    Disconnected {
        /// Number of the target.
        target: usize,
    },
    /// A datagram came to the I/O port, or to a group that was joined.
    Datagram {
        /// Who sent it.
        from: SocketAddrV4,
        /// Number of bytes; a longer datagram than the room is cut.
        len: usize,
    },
}

/// The outside world of a scanner, and the time that passes in it.
///
/// Two kinds exist: sockets, whose time is the system's monotonic clock, and robots in memory, whose time
/// is simulated: waiting costs nothing there. Targets are numbered from 0.
pub trait Network {
    /// The time on this network.
    fn now(&self) -> Instant;

    /// Tells a network with simulated time what time it is; never backwards. Others ignore it.
    fn advance_to(&mut self, now: Instant) {
        let _ = now;
    }

    /// UDP port that class 1 frames must be sent to: what a Forward Open tells the target.
    fn io_port(&self) -> u16 {
        IO_PORT
    }

    /// Waits until `deadline` for an arrival; `None` when the deadline passed without one. A deadline in
    /// the past asks without waiting.
    ///
    /// # Errors
    ///
    /// The network cannot deliver anything, which no trying mends. What concerns one target only is
    /// [`Arrival::Disconnected`] or nothing.
    fn receive(&mut self, room: &mut [u8], deadline: Instant) -> io::Result<Option<Arrival>>;

    /// Begins a TCP connection to `target` at `address`. What came of it arrives later. An earlier
    /// connection to this target is closed without a word.
    ///
    /// # Errors
    ///
    /// It cannot even begin; nothing arrives later.
    fn connect(&mut self, target: usize, address: SocketAddrV4) -> io::Result<()>;

    /// Sends all of `bytes` on the TCP connection of `target`; what the peer does not take yet is kept.
    ///
    /// # Errors
    ///
    /// There is no connection, or more is kept than is sane. The connection is closed then, and
    /// nothing of it arrives any more.
    fn send_stream(&mut self, target: usize, bytes: &[u8]) -> io::Result<()>;

    /// Closes the TCP connection of `target`. Nothing of it arrives any more.
    fn disconnect(&mut self, target: usize);

    /// Sends one datagram from the I/O port.
    ///
    /// # Errors
    ///
    /// It did not leave. The link treats it like a lost frame.
    fn send_datagram(&mut self, to: SocketAddrV4, bytes: &[u8]) -> io::Result<()>;

    /// Receives datagrams that are sent to `group` at port 2222 too. Twice is as good as once.
    ///
    /// # Errors
    ///
    /// No interface for the group, or its port is taken.
    fn join_group(&mut self, group: Ipv4Addr) -> io::Result<()>;

    /// No longer receives them.
    fn leave_group(&mut self, group: Ipv4Addr);
}
