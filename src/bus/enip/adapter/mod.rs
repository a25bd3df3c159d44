//! The robot's side: one adapter with its sessions and connections.

mod settings;

use core::net::SocketAddrV4;

pub use settings::{Access, AdapterSettings};

use super::ConnectionKind;
use crate::time::{Duration, Instant};
use crate::wire::enip::connection::Triad;
use crate::wire::enip::message::Service;
use crate::wire::enip::status::{ExtendedStatus, GeneralStatus};

/// TCP connections at once; another one is turned away (closed at once).
pub const STREAMS: usize = 8;
/// Class 1 connections at once.
pub const CONNECTIONS: usize = 8;

/// One TCP connection, numbered by the adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StreamId(u8);

impl StreamId {
    /// 0 to `STREAMS - 1`; used again after the stream is closed.
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// What the I/O is to do. Bytes stand in the room given to [`Adapter::poll_transmit`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transmit {
    /// Send on a TCP connection, all of it.
    Stream { stream: StreamId, len: usize },
    /// Close a TCP connection; not told back.
    CloseStream { stream: StreamId },
    /// Send from the UDP socket of port 44818.
    MessageDatagram { to: SocketAddrV4, len: usize },
    /// Send from the UDP socket of port 2222; to a group with time to live 1.
    IoDatagram { to: SocketAddrV4, len: usize },
}

/// A class 1 connection as others see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConnectionStatus {
    pub kind: ConnectionKind,
    pub triad: Triad,
    pub originator: SocketAddrV4,
    pub o2t_id: u32,
    pub t2o_id: u32,
    pub o2t_api: Duration,
    pub t2o_api: Duration,
    pub is_multicast: bool,
    /// Whether its last O->T frame said run.
    pub is_running: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AdapterEvent {
    Opened(ConnectionStatus),
    Closed(ConnectionStatus),
    TimedOut(ConnectionStatus),
    /// Refused a Forward Open.
    Refused {
        originator: SocketAddrV4,
        general: GeneralStatus,
        extended: ExtendedStatus,
    },
    /// The owner went from idle to run or back.
    RunChanged {
        is_running: bool,
    },
    /// Somebody asked for a reset of the device (Identity, service 5), or for another explicit service that acts.
    ResetRequested,
}

#[derive(Debug)]
pub struct Adapter {/* fixed arrays of sessions and connections */}

impl Adapter {
    /// `address` is where the adapter is reached: the address in ListIdentity, and base of its multicast group.
    /// `seed` makes connection ids differ from those before a restart.
    pub fn new(settings: AdapterSettings, address: core::net::Ipv4Addr, seed: u64) -> Self {
        todo!()
    }

    /// A TCP connection was accepted; `None` if there are too many: close it.
    pub fn handle_accepted(&mut self, now: Instant, peer: SocketAddrV4) -> Option<StreamId> {
        todo!()
    }
    pub fn handle_stream(&mut self, now: Instant, stream: StreamId, bytes: &[u8]) {
        todo!()
    }
    pub fn handle_stream_closed(&mut self, now: Instant, stream: StreamId) {
        todo!()
    }
    /// A datagram on UDP 44818.
    pub fn handle_message_datagram(&mut self, now: Instant, from: SocketAddrV4, datagram: &[u8]) {
        todo!()
    }
    /// A datagram on UDP 2222.
    pub fn handle_io_datagram(&mut self, now: Instant, from: SocketAddrV4, datagram: &[u8]) {
        todo!()
    }
    pub fn handle_timeout(&mut self, now: Instant) {
        todo!()
    }
    pub fn poll_timeout(&self) -> Option<Instant> {
        todo!()
    }
    pub fn poll_transmit(&mut self, now: Instant, room: &mut [u8]) -> Option<Transmit> {
        todo!()
    }
    pub fn poll_event(&mut self) -> Option<AdapterEvent> {
        todo!()
    }

    /// The newest outputs of an owner that runs; `None` without one, while it idles, after it timed out.
    pub fn outputs(&self) -> Option<&[u8]> {
        todo!()
    }
    /// What is produced from now on: to the owner and to groups `controlling`, to unicast connections that only
    /// monitor `monitoring`. Slices of another length change nothing.
    pub fn set_inputs(&mut self, controlling: &[u8], monitoring: &[u8]) {
        todo!()
    }

    /// What may be opened from now on. `Disabled` closes everything and answers nobody; `MonitoringOnly` ends an owner.
    pub fn set_access(&mut self, now: Instant, access: Access) {
        todo!()
    }
    /// While another protocol controls the robot, owners are refused with 01/0106.
    pub fn set_controlled_elsewhere(&mut self, is_controlled: bool) {
        todo!()
    }
    pub fn owner(&self) -> Option<ConnectionStatus> {
        todo!()
    }
    pub fn connections(&self) -> impl Iterator<Item = ConnectionStatus> + '_ {
        core::iter::empty()
    }
    /// Everything as after a power cycle: streams and connections are gone without a word; ids go on.
    pub fn restart(&mut self, seed: u64) {
        todo!()
    }
}
