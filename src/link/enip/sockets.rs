//! The real network: one UDP socket for all class 1 frames, one TCP connection per target.
//!
//! Invariants: no socket blocks; waiting happens in one place; what concerns one peer (a reset, an
//! unreachable port) never stops the others.

use core::net::{Ipv4Addr, SocketAddr, SocketAddrV4};
use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpStream, UdpSocket};
use std::vec::Vec;

use rustix::fd::AsFd;
use socket2::{Domain, Protocol, SockRef, Socket, Type};

use super::network::{Arrival, Network};
use super::waiter::{Interest, Source, Waiter};
use crate::link::clock::MonotonicClock;
use crate::time::{Duration, Instant};
use crate::wire::enip::IO_PORT;

/// DSCP 47, for scheduled priority, where the byte of the IP header has it.
///
/// Source: CIP volume 2, QoS object.
const SCHEDULED_TOS: u32 = 47 << 2;
/// Receive buffer that is asked for, in bytes; the system may give less. Between two exchanges all frames
/// wait there, each with some 700 bytes of the system's own.
const RECEIVE_BUFFER: usize = 4 << 20;
/// Most bytes that wait for one TCP peer to take them.
const MOST_UNSENT: usize = 64 << 10;
/// Sockets that are ready at once without taking memory, besides those of the targets named.
const USUAL_SOURCES: usize = 64;
/// Attempts to receive while the system reports what other datagrams have met.
const RECEIVE_ATTEMPTS: u32 = 64;

/// How sockets are opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SocketSettings {
    /// Local address of all sockets, which also chooses the interface for multicast. Without one it is the
    /// address that faces the target; with targets behind several, none in particular.
    pub bind: Option<Ipv4Addr>,
    /// UDP port for class 1 frames, usually [`IO_PORT`]. If it is taken, or 0, the system chooses one;
    /// targets are told which.
    pub io_port: u16,
}

impl Default for SocketSettings {
    /// Any address, port 2222.
    fn default() -> Self {
        Self { bind: None, io_port: IO_PORT }
    }
}

/// Why sockets cannot be opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OpenError {
    /// The address is not one of this machine, or not allowed.
    #[error(
        "cannot open {} at {address} ({kind}): bind to an address that this machine has on the robots' network",
        PortName(*port)
    )]
    Bind {
        /// Local address asked for.
        address: Ipv4Addr,
        /// Port asked for.
        port: u16,
        /// Why not.
        kind: ErrorKind,
    },
    /// The system gives no more descriptors, or the like.
    #[error("the system refuses what waiting for sockets needs ({0}): close other programs")]
    System(ErrorKind),
}

/// A UDP port that was asked for, in words: 0 is none that anybody could look for.
struct PortName(u16);

impl core::fmt::Display for PortName {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.0 {
            0 => f.write_str("a UDP port"),
            port => write!(f, "UDP port {port}"),
        }
    }
}

/// A TCP connection, there or on its way.
#[derive(Debug)]
struct Stream {
    socket: TcpStream,
    is_connecting: bool,
    unsent: Vec<u8>,
}

/// A multicast group.
#[derive(Debug)]
struct Group {
    address: Ipv4Addr,
    /// Its own socket; `None` when the I/O socket receives it.
    socket: Option<UdpSocket>,
}

/// Sockets of this machine, with the system's clock.
#[derive(Debug)]
pub struct SocketNetwork {
    clock: MonotonicClock,
    waiter: Waiter,
    /// Local address of TCP connections, if one was asked for.
    bind: Option<Ipv4Addr>,
    /// Local addresses that face the targets.
    interfaces: Vec<Ipv4Addr>,
    io: UdpSocket,
    io_address: SocketAddrV4,
    is_other_port: bool,
    groups: Vec<Option<Group>>,
    streams: Vec<Option<Stream>>,
    /// Keys of sockets that had something to read when last looked at.
    ready: VecDeque<usize>,
}

/// Keys of the waiter: the I/O socket, then groups and streams in turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    Io,
    Group(usize),
    Stream(usize),
}

impl Place {
    const fn key(self) -> usize {
        match self {
            Self::Io => 0,
            Self::Group(index) => 1 + 2 * index,
            Self::Stream(target) => 2 + 2 * target,
        }
    }

    const fn of(key: usize) -> Self {
        match key {
            0 => Self::Io,
            key if key % 2 == 1 => Self::Group(key / 2),
            key => Self::Stream(key / 2 - 1),
        }
    }
}

impl SocketNetwork {
    /// Opens the UDP socket. `targets` only say which local address is wanted if the settings do not.
    ///
    /// # Errors
    ///
    /// [`OpenError`]; a port that is taken is none: see [`io_address`](Self::io_address).
    pub fn open(settings: SocketSettings, targets: &[SocketAddrV4]) -> Result<Self, OpenError> {
        let mut interfaces: Vec<Ipv4Addr> = match settings.bind {
            Some(address) => std::vec![address],
            None => targets.iter().filter_map(|target| facing(*target).ok()).collect(),
        };
        interfaces.sort_unstable();
        interfaces.dedup();
        let address = match interfaces.as_slice() {
            [address] => *address,
            _ => Ipv4Addr::UNSPECIFIED,
        };
        let (io, is_other_port) = match io_socket(address, settings.io_port) {
            Err(error) if is_taken(&error) && settings.io_port != 0 => {
                (io_socket(address, 0), true)
            }
            socket => (socket, false),
        };
        let refused = |error: io::Error| OpenError::Bind {
            address,
            port: settings.io_port,
            kind: error.kind(),
        };
        let io = io.map_err(refused)?;
        let io_address = v4(io.local_addr()).map_err(refused)?;
        let mut waiter = Waiter::new().map_err(|error| OpenError::System(error.kind()))?;
        let source = Source { key: Place::Io.key(), socket: io.as_fd(), interest: Interest::Read };
        waiter.add(source).map_err(|error| OpenError::System(error.kind()))?;
        let mut streams = Vec::new();
        streams.resize_with(targets.len(), || None);
        Ok(Self {
            clock: MonotonicClock::new(),
            waiter,
            bind: settings.bind,
            interfaces,
            io,
            io_address,
            is_other_port,
            groups: Vec::with_capacity(targets.len()),
            ready: VecDeque::with_capacity(USUAL_SOURCES + 2 * targets.len()),
            streams,
        })
    }

    /// Address and port of the I/O socket; the address is unspecified when targets are behind several.
    #[must_use]
    pub const fn io_address(&self) -> SocketAddrV4 {
        self.io_address
    }

    /// Whether the port asked for was taken and another one is used. Targets that ignore the port they are
    /// told do not reach it then.
    #[must_use]
    pub const fn is_other_port(&self) -> bool {
        self.is_other_port
    }

    /// Reads what a socket has, if it has something.
    fn read(&mut self, place: Place, room: &mut [u8]) -> io::Result<Option<Arrival>> {
        match place {
            Place::Io => read_datagram(&self.io, room),
            Place::Group(index) => match self.groups.get(index) {
                Some(Some(Group { socket: Some(socket), .. })) => read_datagram(socket, room),
                _ => Ok(None),
            },
            Place::Stream(target) => Ok(self.read_stream(target, room)),
        }
    }

    fn read_stream(&mut self, target: usize, room: &mut [u8]) -> Option<Arrival> {
        let slot = self.streams.get_mut(target)?;
        let stream = slot.as_mut()?;
        let outcome = if stream.is_connecting {
            stream
                .finish_connecting()
                .map(|is_there| is_there.then_some(Arrival::Connected { target }))
        } else {
            stream.flush().and_then(|()| stream.read(room)).map(|read| match read {
                Some(0) => Some(Arrival::Disconnected { target }),
                Some(len) => Some(Arrival::Stream { target, len }),
                None => None,
            })
        };
        let arrival = outcome.unwrap_or(Some(Arrival::Disconnected { target }));
        match arrival {
            Some(Arrival::Disconnected { .. }) => *slot = None,
            _ => self.watch(target),
        }
        arrival
    }

    /// Waits for the right thing at a stream.
    fn watch(&mut self, target: usize) {
        let Some(Some(stream)) = self.streams.get(target) else { return };
        // Whoever is not on the list is not heard of: its session runs into its own limit.
        let _ = self.waiter.change(stream.source(target));
    }

    fn wait(&mut self, timeout: Duration) -> io::Result<()> {
        let Self { waiter, io, groups, streams, ready, .. } = self;
        let io = Source { key: Place::Io.key(), socket: io.as_fd(), interest: Interest::Read };
        let groups = groups.iter().enumerate().filter_map(|(index, group)| {
            let socket = group.as_ref()?.socket.as_ref()?.as_fd();
            Some(Source { key: Place::Group(index).key(), socket, interest: Interest::Read })
        });
        let streams = streams
            .iter()
            .enumerate()
            .filter_map(|(target, stream)| Some(stream.as_ref()?.source(target)));
        let sources = core::iter::once(io).chain(groups).chain(streams);
        waiter.wait(sources, timeout, |key| ready.push_back(key))
    }
}

impl Stream {
    const fn interest(&self) -> Interest {
        if self.is_connecting || !self.unsent.is_empty() {
            Interest::ReadAndWrite
        } else {
            Interest::Read
        }
    }

    fn source(&self, target: usize) -> Source<'_> {
        let key = Place::Stream(target).key();
        Source { key, socket: self.socket.as_fd(), interest: self.interest() }
    }

    /// Whether the connection is there now.
    fn finish_connecting(&mut self) -> io::Result<bool> {
        if let Some(error) = self.socket.take_error()? {
            return Err(error);
        }
        match self.socket.peer_addr() {
            Ok(_) => self.is_connecting = false,
            Err(error) if error.kind() == ErrorKind::NotConnected => {}
            Err(error) => return Err(error),
        }
        Ok(!self.is_connecting)
    }

    /// Sends what waits, as far as the peer takes it.
    fn flush(&mut self) -> io::Result<()> {
        while !self.unsent.is_empty() {
            match self.socket.write(&self.unsent) {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(sent) => drop(self.unsent.drain(..sent)),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        if self.is_connecting {
            return Err(ErrorKind::NotConnected.into());
        }
        if self.unsent.len() + bytes.len() > MOST_UNSENT {
            return Err(ErrorKind::TimedOut.into());
        }
        self.unsent.extend_from_slice(bytes);
        self.flush()
    }

    /// Bytes that were read; 0 is the end, `None` that there are none yet.
    fn read(&mut self, room: &mut [u8]) -> io::Result<Option<usize>> {
        loop {
            match self.socket.read(room) {
                Ok(len) => return Ok(Some(len)),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(None),
                Err(error) => return Err(error),
            }
        }
    }
}

impl Network for SocketNetwork {
    fn now(&self) -> Instant {
        self.clock.now()
    }

    fn io_port(&self) -> u16 {
        self.io_address.port()
    }

    fn receive(&mut self, room: &mut [u8], deadline: Instant) -> io::Result<Option<Arrival>> {
        let mut is_last = false;
        loop {
            while let Some(key) = self.ready.pop_front() {
                if let Some(arrival) = self.read(Place::of(key), room)? {
                    // It may have more; the others come first.
                    self.ready.push_back(key);
                    return Ok(Some(arrival));
                }
            }
            if is_last {
                return Ok(None);
            }
            // No clock is read for a deadline that cannot be ahead.
            let left = match deadline {
                Instant::ZERO => Duration::ZERO,
                _ => deadline.saturating_duration_since(self.clock.now()),
            };
            is_last = left.is_zero();
            self.wait(left)?;
        }
    }

    fn connect(&mut self, target: usize, address: SocketAddrV4) -> io::Result<()> {
        self.disconnect(target);
        let socket = Socket::new(Domain::IPV4, Type::STREAM, Some(Protocol::TCP))?;
        socket.set_nonblocking(true)?;
        // Requests are small and wait for answers.
        let _ = socket.set_tcp_nodelay(true);
        if let Some(bind) = self.bind {
            socket.bind(&SocketAddrV4::new(bind, 0).into())?;
        }
        match socket.connect(&address.into()) {
            Err(error) if !is_under_way(&error) => return Err(error),
            _ => {}
        }
        let stream = Stream { socket: socket.into(), is_connecting: true, unsent: Vec::new() };
        self.waiter.add(stream.source(target))?;
        if self.streams.len() <= target {
            self.streams.resize_with(target + 1, || None);
        }
        if let Some(slot) = self.streams.get_mut(target) {
            *slot = Some(stream);
        }
        Ok(())
    }

    fn send_stream(&mut self, target: usize, bytes: &[u8]) -> io::Result<()> {
        let slot = self.streams.get_mut(target);
        let Some(slot @ Some(_)) = slot else { return Err(ErrorKind::NotConnected.into()) };
        let sent = slot.as_mut().map_or(Ok(()), |stream| stream.send(bytes));
        match sent {
            Ok(()) => self.watch(target),
            Err(_) => *slot = None,
        }
        sent
    }

    fn disconnect(&mut self, target: usize) {
        if let Some(slot) = self.streams.get_mut(target) {
            *slot = None;
        }
    }

    fn send_datagram(&mut self, to: SocketAddrV4, bytes: &[u8]) -> io::Result<()> {
        match self.io.send_to(bytes, to) {
            Ok(_) => Ok(()),
            // What an earlier datagram has met: this one was not sent yet.
            Err(error) if is_of_another(&error) => self.io.send_to(bytes, to).map(drop),
            Err(error) => Err(error),
        }
    }

    fn join_group(&mut self, group: Ipv4Addr) -> io::Result<()> {
        if !group.is_multicast() {
            return Err(ErrorKind::InvalidInput.into());
        }
        if self.groups.iter().flatten().any(|joined| joined.address == group) {
            return Ok(());
        }
        let is_shared = self.io_address.ip().is_unspecified() && self.io_address.port() == IO_PORT;
        let index = self.groups.iter().position(Option::is_none).unwrap_or(self.groups.len());
        let socket = if is_shared {
            join(&self.io, group, &self.interfaces)?;
            None
        } else {
            // A socket with an address of its own gets no multicast; and frames to a group come to the
            // usual port, whatever ours is.
            let socket = group_socket(group)?;
            join(&socket, group, &self.interfaces)?;
            let key = Place::Group(index).key();
            self.waiter.add(Source { key, socket: socket.as_fd(), interest: Interest::Read })?;
            Some(socket)
        };
        let joined = Some(Group { address: group, socket });
        match self.groups.get_mut(index) {
            Some(slot) => *slot = joined,
            None => self.groups.push(joined),
        }
        Ok(())
    }

    fn leave_group(&mut self, group: Ipv4Addr) {
        for slot in &mut self.groups {
            if slot.as_ref().is_none_or(|joined| joined.address != group) {
                continue;
            }
            if let Some(Group { socket: None, .. }) = slot.take() {
                for interface in &self.interfaces {
                    let _ = self.io.leave_multicast_v4(&group, interface);
                }
            }
        }
    }
}

/// The local address from which the system would reach `target`.
fn facing(target: SocketAddrV4) -> io::Result<Ipv4Addr> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    socket.connect(target)?;
    Ok(*v4(socket.local_addr())?.ip())
}

fn v4(address: io::Result<SocketAddr>) -> io::Result<SocketAddrV4> {
    match address? {
        SocketAddr::V4(address) => Ok(address),
        SocketAddr::V6(_) => Err(ErrorKind::Unsupported.into()),
    }
}

fn io_socket(address: Ipv4Addr, port: u16) -> io::Result<UdpSocket> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_nonblocking(true)?;
    socket.bind(&SocketAddrV4::new(address, port).into())?;
    // What the system does not grant makes nothing wrong.
    let _ = socket.set_recv_buffer_size(RECEIVE_BUFFER);
    let _ = socket.set_tos_v4(SCHEDULED_TOS);
    Ok(socket.into())
}

fn group_socket(group: Ipv4Addr) -> io::Result<UdpSocket> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_nonblocking(true)?;
    // Every listener of this machine has its own.
    socket.set_reuse_address(true)?;
    // Where a group cannot be bound to, its port is shared by all that is sent there.
    let address = if cfg!(windows) { Ipv4Addr::UNSPECIFIED } else { group };
    socket.bind(&SocketAddrV4::new(address, IO_PORT).into())?;
    let _ = socket.set_recv_buffer_size(RECEIVE_BUFFER);
    Ok(socket.into())
}

/// Joins `group` at all interfaces that face targets; one that takes part suffices.
fn join(socket: &UdpSocket, group: Ipv4Addr, interfaces: &[Ipv4Addr]) -> io::Result<()> {
    let socket = SockRef::from(socket);
    let mut outcome = None;
    for interface in interfaces {
        let joined = socket.join_multicast_v4(&group, interface);
        if !matches!(outcome, Some(Ok(()))) {
            outcome = Some(joined);
        }
    }
    outcome.unwrap_or_else(|| socket.join_multicast_v4(&group, &Ipv4Addr::UNSPECIFIED))
}

fn read_datagram(socket: &UdpSocket, room: &mut [u8]) -> io::Result<Option<Arrival>> {
    for _ in 0..RECEIVE_ATTEMPTS {
        match socket.recv_from(room) {
            Ok((len, SocketAddr::V4(from))) => return Ok(Some(Arrival::Datagram { from, len })),
            Ok((_, SocketAddr::V6(_))) => {}
            Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(None),
            Err(error) if is_of_another(&error) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(None)
}

/// Whether an error of a UDP socket only tells what became of a datagram sent before, or of nothing.
fn is_of_another(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::Interrupted
            | ErrorKind::ConnectionRefused
            | ErrorKind::ConnectionReset
            | ErrorKind::HostUnreachable
            | ErrorKind::NetworkUnreachable
    )
}

/// Whether a port cannot be had because somebody else has it.
fn is_taken(error: &io::Error) -> bool {
    // Windows says that access is denied when the other one does not share.
    error.kind() == ErrorKind::AddrInUse
        || cfg!(windows) && error.kind() == ErrorKind::PermissionDenied
}

/// Whether a connection that does not wait is on its way.
fn is_under_way(error: &io::Error) -> bool {
    error.kind() == ErrorKind::WouldBlock
        || error.raw_os_error() == Some(rustix::io::Errno::INPROGRESS.raw_os_error())
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use super::*;

    fn open() -> SocketNetwork {
        let settings = SocketSettings { bind: Some(Ipv4Addr::LOCALHOST), io_port: 0 };
        SocketNetwork::open(settings, &[]).unwrap()
    }

    #[test]
    fn frames_leave_with_the_priority_of_scheduled_data() {
        assert_eq!(SockRef::from(&open().io).tos_v4().unwrap(), 0xBC);
    }

    #[test]
    fn keys_tell_sockets_apart() {
        for place in
            [Place::Io, Place::Group(0), Place::Stream(0), Place::Group(9), Place::Stream(9)]
        {
            assert_eq!(Place::of(place.key()), place);
        }
    }

    #[test]
    fn what_was_kept_is_sent_in_order_when_the_peer_takes_it() {
        let mut network = open();
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        network.connect(0, v4(listener.local_addr()).unwrap()).unwrap();
        let mut room = [0; 4_096];
        let deadline = network.now() + Duration::from_secs(20);
        let there = network.receive(&mut room, deadline).unwrap();
        assert_eq!(there, Some(Arrival::Connected { target: 0 }));
        let mut peer = listener.accept().unwrap().0;
        let kept = |network: &SocketNetwork| {
            network.streams.first().unwrap().as_ref().unwrap().unsent.len()
        };
        // Until the system takes no more, and some is kept.
        let mut sent: Vec<u8> = Vec::new();
        while kept(&network) < 10_000 {
            let piece: Vec<u8> = (0..1_000).map(|i| ((sent.len() + i) % 251) as u8).collect();
            network.send_stream(0, &piece).unwrap();
            sent.extend(piece);
        }
        peer.set_nonblocking(true).unwrap();
        let mut arrived = Vec::new();
        while arrived.len() < sent.len() && network.now() < deadline {
            match peer.read(&mut room) {
                Ok(len) => arrived.extend_from_slice(&room[..len]),
                Err(_) => {
                    let soon = network.now() + Duration::from_millis(1);
                    assert_eq!(network.receive(&mut room, soon).unwrap(), None);
                }
            }
        }
        assert!(
            arrived == sent,
            "{} of {} bytes arrived as they were sent",
            arrived.len(),
            sent.len()
        );
        assert_eq!(kept(&network), 0);
    }
}
