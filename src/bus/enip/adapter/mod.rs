//! The robot's side: one adapter with its sessions and connections.
//!
//! Read [`Adapter`] first. Inside, in the order of what arrives: `stream` puts packets together,
//! `encapsulation` answers commands, `explicit` routes messages to `objects`, `connection_manager` opens
//! and closes connections after `open` has checked them, `connection` takes their frames and `produce`
//! makes those of the other direction; `target` holds what they act on.
//!
//! What is decided here, where the standard leaves a choice:
//!
//! * There is one owner. Input-only and listen-only connections send heartbeats (2 bytes, the sequence
//!   count) or, with O->T type null, nothing at all; the latter end with their TCP connection, since
//!   nothing else tells that the originator is gone. All others outlive theirs.
//! * Point-to-point T->O frames go to the TCP peer, at the port of the request's socket address item
//!   (2222 without one); an address in that item is not heeded, lest frames be sent to third parties.
//! * Multicast T->O is shared: a request joins the slowest group that is as fast as it asks, or gets a group
//!   of its own; listen-only requests join the fastest if all are too slow for them. The group is one of the
//!   32 of the adapter's host number. A group carries the owner's view of the inputs while it serves the owner.
//! * Who listens to a group ends with the last owner or input-only connection of this group; who listens
//!   point-to-point, with the last of all.
//! * A TCP connection that is silent for as long as [`AdapterSettings::inactivity`] says is closed, unless a
//!   class 1 connection that was opened over it is open.
//! * Deadlines are checked by whatever is called next: a connection whose watchdog has expired takes no frame
//!   any more, also if `handle_timeout` comes late.
//!
//! Invariants: at most one owner; connection ids differ from each other and from those before a restart;
//! no allocation, no panic, whatever arrives.
//!
//! Leaves out: connected explicit messages (class 3), routes through ports.
//!
//! Source: CIP volumes 1 and 2; PM L1780 for ownership; what is listed above is a choice.

mod connection;
mod connection_manager;
mod encapsulation;
mod events;
mod explicit;
mod ids;
mod multicast;
mod objects;
mod open;
mod produce;
mod settings;
mod stream;
mod target;

use core::net::{Ipv4Addr, SocketAddrV4};

use encapsulation::Datagrams;
pub use settings::{Access, AdapterSettings};
use stream::Stream;
use target::Target;

use super::{ConnectionKind, INPUT_ONLY_POINT, LISTEN_ONLY_POINT};
use crate::time::{Duration, Instant};
use crate::wire::enip::connection::Triad;
use crate::wire::enip::status::{ExtendedStatus, GeneralStatus};

/// TCP connections at once; another one is turned away (closed at once).
///
/// Source: choice.
pub const STREAMS: usize = 8;
/// Class 1 connections at once; another one is refused with 01/0113.
///
/// Source: choice.
pub const CONNECTIONS: usize = 8;
/// Bytes of the longest image, either way: what a Forward Open's 9 bits of size allow, rounded down.
///
/// Source: choice.
pub const MAX_IMAGE_LEN: usize = 500;
/// Most bytes behind an encapsulation header; a packet with more is refused with status 65h and its bytes
/// are passed over.
///
/// Source: choice; the longest request that makes sense here is a Large Forward Open.
pub const MAX_DATA_LEN: usize = 600;
/// Room that suffices for whatever [`Adapter::poll_transmit`] writes.
pub const MAX_TRANSMIT_LEN: usize = stream::MAX_PACKET_LEN;

/// One TCP connection, numbered by the adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StreamId(u8);

impl StreamId {
    /// 0 to `STREAMS - 1`; used again after the stream is closed.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// What the I/O is to do. Bytes stand in the room given to [`Adapter::poll_transmit`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transmit {
    /// Send on a TCP connection, all of it.
    Stream {
        /// On which.
        stream: StreamId,
        /// Bytes.
        len: usize,
    },
    /// Close a TCP connection; not told back.
    CloseStream {
        /// Which.
        stream: StreamId,
    },
    /// Send from the UDP socket of port 44818.
    MessageDatagram {
        /// To whom.
        to: SocketAddrV4,
        /// Bytes.
        len: usize,
    },
    /// Send from the UDP socket of port 2222; to a group with time to live 1.
    IoDatagram {
        /// To whom.
        to: SocketAddrV4,
        /// Bytes.
        len: usize,
    },
}

/// A class 1 connection as others see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConnectionStatus {
    /// What it may do.
    pub kind: ConnectionKind,
    /// What tells it from all others.
    pub triad: Triad,
    /// The TCP peer that opened it; its O->T frames come from this address, from any port.
    pub originator: SocketAddrV4,
    /// Id of O->T frames, chosen by the adapter.
    pub o2t_id: u32,
    /// Id of T->O frames: the originator's choice, of a group the adapter's.
    pub t2o_id: u32,
    /// Interval of O->T frames; without any, what was requested.
    pub o2t_api: Duration,
    /// Interval of T->O frames.
    pub t2o_api: Duration,
    /// Whether T->O frames go to a group.
    pub is_multicast: bool,
    /// Whether its last O->T frame said run.
    pub is_running: bool,
}

/// What happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AdapterEvent {
    /// A connection was opened.
    Opened(ConnectionStatus),
    /// A connection ended: by a Forward Close, because nobody is left to listen to, or by [`Access`].
    Closed(ConnectionStatus),
    /// A connection's watchdog expired.
    TimedOut(ConnectionStatus),
    /// Refused a Forward Open.
    Refused {
        /// The TCP peer that asked.
        originator: SocketAddrV4,
        /// What it was answered.
        general: GeneralStatus,
        /// Which reason it was given; 0 if the request was cut off or too long.
        extended: ExtendedStatus,
    },
    /// The owner went from idle to run or back. It begins idle; its end is told by the other events alone.
    RunChanged {
        /// Whether it runs now.
        is_running: bool,
    },
    /// Somebody asked for a reset of the device (Identity, service 5). Nothing is reset by itself; see
    /// [`Adapter::restart`].
    ResetRequested,
}

/// The robot's side of EtherNet/IP: told what arrived and what time it is, asked what to send.
///
/// Call a `handle_*` function when something arrived or when [`Adapter::poll_timeout`] says so, then
/// [`Adapter::poll_transmit`] until it returns `None`, then [`Adapter::poll_event`] likewise. Outputs and
/// inputs may be read and set at any time between.
///
/// It is some 30 kB large and takes no other memory.
#[derive(Debug)]
pub struct Adapter {
    streams: [Option<Stream>; STREAMS],
    datagrams: Datagrams,
    target: Target,
}

impl Adapter {
    /// `address` is where the adapter is reached: the address in ListIdentity, and base of its multicast groups.
    /// `seed` makes connection ids differ from those before a restart.
    #[must_use]
    pub fn new(settings: AdapterSettings, address: Ipv4Addr, seed: u64) -> Self {
        Self {
            streams: [const { None }; STREAMS],
            datagrams: Datagrams::new(),
            target: Target::new(settings, address, seed),
        }
    }

    /// Whether anybody is answered.
    fn is_enabled(&self) -> bool {
        self.target.access != Access::Disabled
    }

    /// Ends connections whose watchdog has expired, and TCP connections that have been silent for too long.
    ///
    /// A peer that is switched off says no farewell; without this, eight of them would lock everybody out.
    fn expire(&mut self, now: Instant) {
        let Self { streams, target, .. } = self;
        for stream in streams.iter_mut().flatten().filter(|one| target.has_opened(one.peer)) {
            stream.heard_at = stream.heard_at.max(now);
        }
        target.expire(now);
        let inactivity = target.settings.inactivity;
        for stream in streams.iter_mut().flatten() {
            stream.is_closing |= stream.ends_at(inactivity).is_some_and(|end| end <= now);
        }
    }

    /// A TCP connection was accepted; `None` if there are too many, or while access is disabled: close it.
    pub fn handle_accepted(&mut self, now: Instant, peer: SocketAddrV4) -> Option<StreamId> {
        self.expire(now);
        if !self.is_enabled() {
            return None;
        }
        let mut slots = (0_u8..).zip(&mut self.streams);
        let (index, slot) = slots.find(|(_, slot)| slot.is_none())?;
        *slot = Some(Stream::new(peer, now));
        Some(StreamId(index))
    }

    /// Bytes arrived on a TCP connection: any number of packets, whole or not.
    pub fn handle_stream(&mut self, now: Instant, stream: StreamId, bytes: &[u8]) {
        self.expire(now);
        if let Some(Some(slot)) = self.streams.get_mut(stream.index()) {
            encapsulation::receive(&mut self.target, now, stream, slot, bytes);
        }
    }

    /// A TCP connection was closed by the peer, or lost. Class 1 connections opened over it live on, unless
    /// they have no O->T frames.
    pub fn handle_stream_closed(&mut self, now: Instant, stream: StreamId) {
        self.expire(now);
        self.forget_stream(stream);
    }

    fn forget_stream(&mut self, stream: StreamId) {
        if let Some(slot) = self.streams.get_mut(stream.index())
            && slot.take().is_some()
        {
            self.target.close_bound_to(stream);
        }
    }

    /// A datagram on UDP 44818.
    pub fn handle_message_datagram(&mut self, now: Instant, from: SocketAddrV4, datagram: &[u8]) {
        self.expire(now);
        if self.is_enabled() {
            self.datagrams.receive(&self.target, from, datagram);
        }
    }

    /// A datagram on UDP 2222.
    pub fn handle_io_datagram(&mut self, now: Instant, from: SocketAddrV4, datagram: &[u8]) {
        self.expire(now);
        self.target.consume(now, from, datagram);
    }

    /// The time of [`Adapter::poll_timeout`] has come: ends connections whose watchdog has expired and closes
    /// TCP connections that have been silent for too long.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.expire(now);
    }

    /// When the next frame is to be produced, the next watchdog expires or a TCP connection has been silent
    /// for too long; `None` without any.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let target = &self.target;
        let silent = self.streams.iter().flatten().filter(|one| !target.has_opened(one.peer));
        let silence = silent.filter_map(|one| one.ends_at(target.settings.inactivity)).min();
        let next = [target.productions.next_at(), target.connections.ends_at(), silence];
        next.into_iter().flatten().min()
    }

    /// What to send next: answers first, then frames that are due. [`MAX_TRANSMIT_LEN`] bytes of room
    /// suffice; a datagram that does not fit is lost, bytes of a stream come in pieces.
    pub fn poll_transmit(&mut self, now: Instant, room: &mut [u8]) -> Option<Transmit> {
        if let Some(transmit) = self.poll_streams(room) {
            return Some(transmit);
        }
        if let Some((to, len)) = self.datagrams.take(room) {
            return Some(Transmit::MessageDatagram { to, len });
        }
        let target = &mut self.target;
        let owners = target.connections.owner().map(|owner| owner.production);
        let (to, len) = target.productions.produce(now, &target.inputs, owners, room)?;
        Some(Transmit::IoDatagram { to, len })
    }

    fn poll_streams(&mut self, room: &mut [u8]) -> Option<Transmit> {
        let mut closing = None;
        for (index, slot) in (0_u8..).zip(&mut self.streams) {
            let Some(stream) = slot else { continue };
            if !stream.output.is_empty() && !room.is_empty() {
                let len = stream.output.take(room);
                return Some(Transmit::Stream { stream: StreamId(index), len });
            }
            if stream.is_closing {
                closing = Some(StreamId(index));
            }
        }
        let stream = closing?;
        self.forget_stream(stream);
        Some(Transmit::CloseStream { stream })
    }

    /// What happened, oldest first. 32 events are kept; of more, the oldest are forgotten.
    pub fn poll_event(&mut self) -> Option<AdapterEvent> {
        self.target.events.pop()
    }

    /// The newest outputs of an owner that runs; `None` without one, while it idles, after it timed out.
    #[must_use]
    pub fn outputs(&self) -> Option<&[u8]> {
        self.target.outputs()
    }

    /// What is produced from now on: to the owner, also by its group, `controlling`; to all others `monitoring`. Slices of another length change nothing. Counts as new data, also if equal.
    pub fn set_inputs(&mut self, controlling: &[u8], monitoring: &[u8]) {
        self.target.inputs.set(controlling, monitoring);
    }

    /// What may be opened from now on. `Disabled` closes everything and answers nobody; `MonitoringOnly` ends an
    /// owner.
    pub fn set_access(&mut self, now: Instant, access: Access) {
        self.expire(now);
        self.target.access = access;
        match access {
            Access::Full => {}
            Access::MonitoringOnly => self.target.close_owner(),
            Access::Disabled => {
                self.target.close_all();
                self.datagrams = Datagrams::new();
                for stream in self.streams.iter_mut().flatten() {
                    *stream = Stream { is_closing: true, ..Stream::new(stream.peer, now) };
                }
            }
        }
    }

    /// While another protocol controls the robot, owners are refused with 01/0106. One that is there stays.
    ///
    /// Source: PM L1780.
    pub fn set_controlled_elsewhere(&mut self, is_controlled: bool) {
        self.target.is_controlled_elsewhere = is_controlled;
    }

    /// Who controls the robot.
    #[must_use]
    pub fn owner(&self) -> Option<ConnectionStatus> {
        self.target.connections.owner().map(connection::Connection::status)
    }

    /// All class 1 connections.
    pub fn connections(&self) -> impl Iterator<Item = ConnectionStatus> + '_ {
        self.target.connections.iter().map(connection::Connection::status)
    }

    /// T->O frames that were given up since the adapter began anew: their deadlines passed in a stall too long to
    /// be made up for.
    #[must_use]
    pub const fn frames_given_up(&self) -> u64 {
        self.target.productions.given_up()
    }

    /// Everything as after a power cycle: streams and connections are gone without a word, and so are events
    /// and inputs; [`Access`] stays and ids go on.
    pub fn restart(&mut self, seed: u64) {
        self.streams = [const { None }; STREAMS];
        self.datagrams = Datagrams::new();
        self.target.restart(seed);
    }
}
