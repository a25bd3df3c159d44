//! The robots' side: served robots on real sockets, each at an IPv4 address of its own.
//!
//! Read [`Server::step`] first. One thread waits for all sockets at once, hands what arrived to the robots,
//! lets every robot live whose time has come, and sends what they have to send. A robot has three sockets
//! at its address: TCP and UDP 44818 for messages, UDP 2222 for class 1 frames; and a socket for each TCP
//! connection. A ListIdentity that is broadcast comes to sockets that are bound to the broadcast
//! addresses, where the system has such sockets (Linux); elsewhere, and when another process keeps them, a
//! robot bound to 0.0.0.0 hears broadcasts, others do not.
//!
//! Invariants: a step ends within about [`STEP`]; no memory is taken per frame; what a peer does
//! not read is kept up to [`BACKLOG`] bytes, then its connection is closed.

use core::net::{Ipv4Addr, SocketAddr, SocketAddrV4};
use std::boxed::Box;
use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::vec;
use std::vec::Vec;

use rustix::fd::AsFd;
use socket2::{Domain, Protocol, SockRef, Socket, TcpKeepalive, Type};

pub use super::bind_error::{BindError, Purpose};
use super::network::ROOM;
use super::served::{STEP, ServedRobot};
use super::waiter::{Interest, Source, Waiter};
use crate::bus::enip::adapter::{Adapter, AdapterEvent, STREAMS, StreamId, Transmit};
use crate::cycle::CyclicDevice;
#[cfg(target_os = "linux")]
use crate::link::cable;
use crate::link::clock::{MonotonicClock, wake_exactly};
#[cfg(target_os = "linux")]
use crate::link::watch_list::WatchList;
use crate::time::{Duration, Instant};
use crate::wire::enip::{IO_PORT, MESSAGE_PORT};

/// Bytes that are kept for a peer that does not read.
///
/// Source: choice. Hundreds of answers.
pub const BACKLOG: usize = 65_536;
/// Messages that one socket hands over in a step, and that a robot sends in a step.
const AT_ONCE: usize = 64;
/// Bytes that are read off a TCP connection in a step: an adapter keeps the answers to so many, however small the
/// requests are.
const PIECE: usize = 256;
/// Connections that may wait to be accepted.
const WAITING: i32 = 16;
/// How long no connections are accepted after the system could not give one.
const REST: Duration = Duration::from_millis(100);
/// Silence on a TCP connection after which the system asks whether the peer is still there, and how often.
///
/// Source: choice; a peer that is gone is noticed within two minutes or so.
const KEEP_ALIVE: TcpKeepalive =
    TcpKeepalive::new().with_time(Duration::from_secs(30)).with_interval(Duration::from_secs(10));
/// Class of service of class 1 frames: DSCP 47, scheduled.
///
/// Source: CIP volume 2.
const TOS: u32 = 47 << 2;

/// Keys of a robot's sockets: this many for each robot, TCP connections behind the first three.
const KEYS: usize = 16;
const LISTENER: usize = 0;
const MESSAGES: usize = 1;
const FRAMES: usize = 2;
const FIRST_STREAM: usize = 3;
/// Keys from here on are those of broadcast sockets.
const BROADCASTS: usize = usize::MAX / 2;
const _: () = assert!(STREAMS + FIRST_STREAM <= KEYS);

/// Ports of all robots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ports {
    /// TCP and UDP port of messages; 44818.
    pub message: u16,
    /// UDP port of class 1 frames; 2222.
    pub io: u16,
}

impl Default for Ports {
    fn default() -> Self {
        Self { message: MESSAGE_PORT, io: IO_PORT }
    }
}

/// What passed, in datagrams.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ServerCounts {
    /// Class 1 frames and messages received.
    pub received: u64,
    /// Class 1 frames and messages sent.
    pub sent: u64,
    /// Those that the system did not take: full buffers, no way to the address.
    pub unsent: u64,
    /// TCP connections closed because the peer did not read.
    pub overfull: u64,
    /// Class 1 frames given up because this process was stopped for too long to make up for them.
    pub given_up: u64,
}

/// One TCP connection.
struct Peer {
    socket: TcpStream,
    stream: StreamId,
    /// What the system has not taken yet.
    backlog: Vec<u8>,
    /// Whether the system is to tell when it takes more.
    waits_to_write: bool,
}

/// A robot and its sockets.
struct Seat<D> {
    robot: ServedRobot<D>,
    /// Where connections are accepted.
    at: SocketAddrV4,
    /// `None` while the robot is not on its bus.
    listener: Option<TcpListener>,
    messages: UdpSocket,
    frames: UdpSocket,
    peers: [Option<Peer>; STREAMS],
    is_plugged: bool,
    /// Connections that this end closed while the cable was out: the peer cannot know yet.
    unheard: Vec<Peer>,
    /// While the system has no connections or no port to give.
    rests_until: Option<Instant>,
    /// Whether something arrived for it in this step.
    is_touched: bool,
}

/// Robots at their addresses.
pub struct Server<D> {
    seats: Vec<Seat<D>>,
    broadcasts: Vec<UdpSocket>,
    waiter: Waiter,
    clock: MonotonicClock,
    ready: Vec<usize>,
    room: Box<[u8]>,
    counts: ServerCounts,
    /// Whose events are told next.
    teller: usize,
    /// Whether the thread that steps has been told how exactly it is to be woken.
    is_exact: bool,
}

fn udp(address: SocketAddrV4, shared: bool) -> io::Result<UdpSocket> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_nonblocking(true)?;
    if shared {
        socket.set_reuse_address(true)?;
    }
    socket.bind(&SocketAddr::V4(address).into())?;
    Ok(socket.into())
}

fn frames(address: SocketAddrV4) -> io::Result<UdpSocket> {
    let socket = Socket::from(udp(address, false)?);
    // Some systems keep these to themselves; frames travel without them too.
    let _ = socket.set_tos_v4(TOS);
    let _ = socket.set_multicast_ttl_v4(1);
    if !address.ip().is_unspecified() {
        let _ = socket.set_multicast_if_v4(address.ip());
    }
    Ok(socket.into())
}

fn listener(address: SocketAddrV4) -> io::Result<TcpListener> {
    let socket = Socket::new(Domain::IPV4, Type::STREAM, Some(Protocol::TCP))?;
    socket.set_nonblocking(true)?;
    // Connections of an earlier process that linger do not hold the port on Unix; on Windows this would let two
    // processes share it.
    #[cfg(unix)]
    socket.set_reuse_address(true)?;
    socket.bind(&SocketAddr::V4(address).into())?;
    socket.listen(WAITING)?;
    Ok(socket.into())
}

impl<D: CyclicDevice> Seat<D> {
    fn bind(address: Ipv4Addr, robot: ServedRobot<D>, ports: Ports) -> Result<Self, BindError> {
        let message = SocketAddrV4::new(address, ports.message);
        let io = SocketAddrV4::new(address, ports.io);
        let failed = |address, purpose| move |cause| BindError::Socket { address, purpose, cause };
        Ok(Self {
            robot,
            at: message,
            listener: Some(listener(message).map_err(failed(message, Purpose::Sessions))?),
            messages: udp(message, false).map_err(failed(message, Purpose::Messages))?,
            frames: frames(io).map_err(failed(io, Purpose::Frames))?,
            peers: [const { None }; STREAMS],
            is_plugged: true,
            unheard: Vec::new(),
            rests_until: None,
            is_touched: false,
        })
    }

    fn watch(&self, index: usize, waiter: &mut Waiter) -> io::Result<()> {
        self.sources(index).try_for_each(|source| waiter.add(source))
    }

    /// All its sockets and what is waited for at them.
    fn sources(&self, index: usize) -> impl Iterator<Item = Source<'_>> {
        let listens = if self.rests_until.is_none() { Interest::Read } else { Interest::Nothing };
        let listener = self.listener.iter();
        let listener = listener.map(move |socket| source(key(index, LISTENER), socket, listens));
        let peers = self.peers.iter().flatten().map(move |peer| peer.source(index));
        [
            source(key(index, MESSAGES), &self.messages, Interest::Read),
            source(key(index, FRAMES), &self.frames, Interest::Read),
        ]
        .into_iter()
        .chain(listener)
        .chain(peers)
    }

    fn next_due(&self) -> Instant {
        let due = self.robot.next_due();
        self.rests_until.map_or(due, |until| until.min(due))
    }
}

const fn key(index: usize, socket: usize) -> usize {
    index * KEYS + socket
}

fn source(key: usize, socket: &impl AsFd, interest: Interest) -> Source<'_> {
    Source { key, socket: socket.as_fd(), interest }
}

/// The next datagram of `socket`.
fn datagram(socket: &UdpSocket, room: &mut [u8]) -> Option<(SocketAddrV4, usize)> {
    // An error that belongs to an earlier datagram that we sent (nobody listens there) hides at most one that
    // arrived until the next step.
    match socket.recv_from(room).ok()? {
        (len, SocketAddr::V4(from)) => Some((from, len)),
        (_, SocketAddr::V6(_)) => None,
    }
}

impl<D: CyclicDevice> Server<D> {
    /// Serves each robot at the address beside it, which must be of this machine. Several robots need several
    /// addresses; a single one may be at 0.0.0.0.
    ///
    /// # Errors
    ///
    /// [`BindError`]: two robots at one address, or a socket that cannot be had.
    pub fn bind(robots: Vec<(Ipv4Addr, ServedRobot<D>)>, ports: Ports) -> Result<Self, BindError> {
        let mut waiter = Waiter::new().map_err(|cause| BindError::Wait { cause })?;
        let mut seats: Vec<Seat<D>> = Vec::with_capacity(robots.len());
        let mut addresses = Vec::with_capacity(robots.len());
        for (index, (address, robot)) in robots.into_iter().enumerate() {
            if addresses.contains(&address) {
                return Err(BindError::Twice { address });
            }
            addresses.push(address);
            let seat = Seat::bind(address, robot, ports)?;
            seat.watch(index, &mut waiter).map_err(|cause| BindError::Wait { cause })?;
            seats.push(seat);
        }
        let broadcasts = Self::hear_broadcasts(&seats, &addresses, ports, &mut waiter);
        Ok(Self {
            seats,
            broadcasts,
            waiter,
            clock: MonotonicClock::new(),
            ready: Vec::new(),
            room: vec![0; ROOM].into_boxed_slice(),
            counts: ServerCounts::default(),
            teller: 0,
            is_exact: false,
        })
    }

    /// Sockets at the broadcast addresses of the robots; those that cannot be had are left out.
    fn hear_broadcasts(
        seats: &[Seat<D>],
        addresses: &[Ipv4Addr],
        ports: Ports,
        waiter: &mut Waiter,
    ) -> Vec<UdpSocket> {
        // A socket at 0.0.0.0 hears broadcasts by itself.
        if !cfg!(target_os = "linux") || addresses.iter().any(|a| a.is_unspecified()) {
            return Vec::new();
        }
        let mut heard = vec![Ipv4Addr::BROADCAST];
        heard.extend(seats.iter().map(|seat| seat.robot.broadcast_address()));
        heard.retain(|address| !addresses.contains(address));
        heard.sort_unstable();
        heard.dedup();
        let mut sockets: Vec<UdpSocket> = Vec::new();
        for address in heard {
            let Ok(socket) = udp(SocketAddrV4::new(address, ports.message), true) else { continue };
            let key = BROADCASTS + sockets.len();
            if waiter.add(source(key, &socket, Interest::Read)).is_ok() {
                sockets.push(socket);
            }
        }
        sockets
    }

    /// The robots, in the order in which they were given.
    pub fn robots(&self) -> impl ExactSizeIterator<Item = &ServedRobot<D>> {
        self.seats.iter().map(|seat| &seat.robot)
    }

    /// The robots, to be acted upon between two steps as a person beside them would.
    pub fn robots_mut(&mut self) -> impl ExactSizeIterator<Item = &mut ServedRobot<D>> {
        self.seats.iter_mut().map(|seat| &mut seat.robot)
    }

    /// Lets the robots live by `clock`, for a caller who has other things that live by it; before the
    /// first step.
    pub const fn keep_time_with(&mut self, clock: MonotonicClock) {
        self.clock = clock;
    }

    /// What passed so far.
    #[must_use]
    pub fn counts(&self) -> ServerCounts {
        let adapters = self.seats.iter().map(|seat| seat.robot.adapter());
        let given_up = adapters.map(Adapter::frames_given_up).sum();
        ServerCounts { given_up, ..self.counts }
    }

    /// The time that the robots live in.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.clock.now()
    }

    /// The next thing that happened to a robot, and the robot's number. To be asked after every step.
    pub fn next_event(&mut self) -> Option<(usize, AdapterEvent)> {
        for _ in 0..self.seats.len() {
            let index = self.teller;
            if let Some(event) = self.seats.get_mut(index)?.robot.poll_event() {
                return Some((index, event));
            }
            self.teller = (self.teller + 1) % self.seats.len();
        }
        None
    }

    /// Waits until something arrives or a robot's time has come, at most for [`STEP`], and does what is to be
    /// done. From the first step on, its thread is woken [as exactly as the system can](wake_exactly).
    ///
    /// # Errors
    ///
    /// The system refuses to wait for the sockets. The robots have lived nevertheless.
    pub fn step(&mut self) -> io::Result<()> {
        if !core::mem::replace(&mut self.is_exact, true) {
            wake_exactly();
        }
        let now = self.clock.now();
        let until = self.next_due().min(now + STEP);
        self.step_within(until.saturating_duration_since(now))
    }

    /// Does what is to be done now, without waiting: for a caller who waits for other things too.
    ///
    /// # Errors
    ///
    /// As of [`step`](Self::step).
    #[cfg(target_os = "linux")]
    pub fn step_at_once(&mut self) -> io::Result<()> {
        if !core::mem::replace(&mut self.is_exact, true) {
            wake_exactly();
        }
        self.step_within(Duration::ZERO)
    }

    /// When a robot's time has come; without robots [`STEP`] from now.
    #[must_use]
    pub fn next_due(&self) -> Instant {
        let due = self.seats.iter().map(Seat::next_due).min();
        due.unwrap_or_else(|| self.clock.now() + STEP)
    }

    /// Puts all sockets on `list`, as those of `server`: [`step_at_once`](Self::step_at_once) is to be
    /// called when one of them is ready, and at [`next_due`](Self::next_due).
    #[cfg(target_os = "linux")]
    pub fn watch<'a>(&'a self, list: &mut WatchList<'a>, server: usize) {
        list.add(server, self.waiter.as_fd(), Interest::Read);
    }

    /// Pulls the network cable of a robot, or plugs it in again. While it is out nothing arrives and
    /// nothing is sent; TCP connections stay, and what this end closes the peer learns when the cable
    /// is in again.
    ///
    /// # Errors
    ///
    /// The system cannot hold up what arrives.
    #[cfg(target_os = "linux")]
    pub fn set_plugged(&mut self, robot: usize, plugged: bool) -> io::Result<()> {
        let Some(seat) = self.seats.get_mut(robot) else { return Ok(()) };
        seat.set_plugged(plugged, self.clock.now(), robot, &mut self.waiter)
    }

    fn step_within(&mut self, limit: Duration) -> io::Result<()> {
        let mut ready = core::mem::take(&mut self.ready);
        ready.clear();
        let seats = self.seats.iter().enumerate();
        let broadcasts = self.broadcasts.iter().enumerate();
        let sources = seats.flat_map(|(index, seat)| seat.sources(index)).chain(
            broadcasts.map(|(index, socket)| source(BROADCASTS + index, socket, Interest::Read)),
        );
        let waited = self.waiter.wait(sources, limit, |key| ready.push(key));
        for key in &ready {
            self.attend(*key);
        }
        self.ready = ready;
        let now = self.clock.now();
        for index in 0..self.seats.len() {
            let Some(seat) = self.seats.get_mut(index) else { continue };
            let is_due = seat.next_due() <= now;
            if is_due {
                seat.robot.live(now);
            }
            if core::mem::take(&mut seat.is_touched) || is_due {
                self.send(index);
            }
        }
        waited
    }

    /// Reads what arrived at the socket of this key.
    fn attend(&mut self, key: usize) {
        if key >= BROADCASTS {
            self.attend_broadcast(key - BROADCASTS);
            return;
        }
        let now = self.clock.now();
        let (index, socket) = (key / KEYS, key % KEYS);
        let Some(seat) = self.seats.get_mut(index) else { return };
        seat.is_touched = true;
        match socket {
            LISTENER => seat.accept(now, index, &mut self.waiter),
            MESSAGES => {
                for _ in 0..AT_ONCE {
                    let Some((from, len)) = datagram(&seat.messages, &mut self.room) else { break };
                    self.counts.received += 1;
                    let bytes = self.room.get(..len).unwrap_or(&[]);
                    seat.robot.handle_message_datagram(now, from, bytes);
                }
            }
            FRAMES => {
                for _ in 0..AT_ONCE {
                    let Some((from, len)) = datagram(&seat.frames, &mut self.room) else { break };
                    self.counts.received += 1;
                    let bytes = self.room.get(..len).unwrap_or(&[]);
                    seat.robot.handle_io_datagram(now, from, bytes);
                }
            }
            stream => {
                let stream = stream - FIRST_STREAM;
                seat.attend_stream(now, index, stream, &mut self.room, &mut self.waiter);
            }
        }
    }

    /// Every robot answers a broadcast, from its own address.
    fn attend_broadcast(&mut self, socket: usize) {
        let now = self.clock.now();
        let Some(socket) = self.broadcasts.get(socket) else { return };
        for _ in 0..AT_ONCE {
            let Some((from, len)) = datagram(socket, &mut self.room) else { break };
            self.counts.received += 1;
            let bytes = self.room.get(..len).unwrap_or(&[]);
            for seat in self.seats.iter_mut().filter(|seat| seat.is_plugged) {
                seat.is_touched = true;
                seat.robot.handle_message_datagram(now, from, bytes);
            }
        }
    }

    /// Sends what a robot has to send.
    fn send(&mut self, index: usize) {
        let now = self.clock.now();
        let Some(seat) = self.seats.get_mut(index) else { return };
        // First, so that nobody who sees its connection end finds the port open.
        seat.open_or_close(now, index, &mut self.waiter);
        if seat.robot.take_departure() {
            for stream in 0..STREAMS {
                seat.drop_peer(stream, &mut self.waiter);
            }
        }
        for _ in 0..AT_ONCE {
            let Some(transmit) = seat.robot.poll_transmit(now, &mut self.room) else { return };
            match transmit {
                Transmit::Stream { stream, len } => {
                    let bytes = self.room.get(..len).unwrap_or(&[]);
                    if seat.write(now, index, stream, bytes, &mut self.waiter).is_err() {
                        self.counts.overfull += 1;
                    }
                }
                Transmit::CloseStream { stream } => seat.close(stream, &mut self.waiter),
                // Without a cable they are lost, as they must be.
                Transmit::MessageDatagram { .. } | Transmit::IoDatagram { .. }
                    if !seat.is_plugged =>
                {
                    self.counts.unsent += 1;
                }
                Transmit::MessageDatagram { to, len } => {
                    let bytes = self.room.get(..len).unwrap_or(&[]);
                    self.counts.count(seat.messages.send_to(bytes, to));
                }
                Transmit::IoDatagram { to, len } => {
                    let bytes = self.room.get(..len).unwrap_or(&[]);
                    self.counts.count(seat.frames.send_to(bytes, to));
                }
            }
        }
        // The rest goes in the next step.
        seat.is_touched = true;
    }
}

impl ServerCounts {
    fn count(&mut self, sent: io::Result<usize>) {
        match sent {
            Ok(_) => self.sent += 1,
            Err(_) => self.unsent += 1,
        }
    }
}

/// A connection was closed because its peer does not read.
struct Overfull;

impl<D: CyclicDevice> Seat<D> {
    fn accept(&mut self, now: Instant, index: usize, waiter: &mut Waiter) {
        for _ in 0..AT_ONCE {
            let Some(listener) = &self.listener else { return };
            let (socket, peer) = match listener.accept() {
                Ok((socket, SocketAddr::V4(peer))) => (socket, peer),
                Ok(_) => continue,
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) if error.kind() == io::ErrorKind::ConnectionAborted => continue,
                Err(_) => {
                    // No files left, or no memory: it would be told again at once.
                    self.rests_until = Some(now + REST);
                    let key = key(index, LISTENER);
                    let _ = waiter.change(source(key, listener, Interest::Nothing));
                    return;
                }
            };
            let Some(stream) = self.robot.handle_accepted(now, peer) else { continue };
            let key = key(index, FIRST_STREAM + stream.index());
            let is_set_up = socket.set_nonblocking(true).is_ok()
                && waiter.add(source(key, &socket, Interest::Read)).is_ok();
            let _ = socket.set_nodelay(true);
            // A connection without O->T frames lives as long as its stream, and a peer without power ends none.
            let _ = SockRef::from(&socket).set_tcp_keepalive(&KEEP_ALIVE);
            match self.peers.get_mut(stream.index()) {
                Some(place) if is_set_up => {
                    *place = Some(Peer::new(socket, stream));
                }
                _ => self.robot.handle_stream_closed(now, stream),
            }
        }
    }

    /// Follows the robot to another protocol or through a boot, where its port is closed, and back.
    fn open_or_close(&mut self, now: Instant, index: usize, waiter: &mut Waiter) {
        if self.rests_until.is_some_and(|until| until <= now) {
            self.rests_until = None;
            if let Some(listener) = &self.listener {
                let _ = waiter.change(source(key(index, LISTENER), listener, Interest::Read));
            }
        }
        match (self.robot.is_on_bus(), &self.listener) {
            (false, Some(_)) => self.listener = None,
            (true, None) if self.rests_until.is_none() => {
                let is_back = listener(self.at).and_then(|listener| {
                    waiter.add(source(key(index, LISTENER), &listener, Interest::Read))?;
                    self.listener = Some(listener);
                    Ok(())
                });
                if is_back.is_err() {
                    self.rests_until = Some(now + REST);
                }
                self.join_cable();
            }
            _ => {}
        }
    }

    /// A socket that was made while the cable is out hears nothing either.
    fn join_cable(&self) {
        #[cfg(target_os = "linux")]
        if let (false, Some(listener)) = (self.is_plugged, &self.listener) {
            // It went for the others, so it goes for this one.
            let _ = cable::set_plugged(listener.as_fd(), false);
        }
    }

    #[cfg(target_os = "linux")]
    fn set_plugged(
        &mut self,
        plugged: bool,
        now: Instant,
        index: usize,
        waiter: &mut Waiter,
    ) -> io::Result<()> {
        self.is_plugged = plugged;
        for stream in 0..STREAMS {
            let Some(Some(peer)) = self.peers.get_mut(stream) else { continue };
            // What waits to be sent waits for the cable now, or leaves again.
            let done = match plugged {
                true => peer.write_backlog(index, waiter),
                false => peer.set_waits_to_write(false, index, waiter),
            };
            if done.is_err() {
                self.end(now, stream, waiter);
            }
        }
        if plugged {
            self.unheard.clear();
        }
        let listener = self.listener.iter().map(AsFd::as_fd);
        let datagrams = [self.messages.as_fd(), self.frames.as_fd()];
        let peers = self.peers.iter().flatten().map(|peer| peer.socket.as_fd());
        let mut sockets = listener.chain(datagrams).chain(peers);
        sockets.try_for_each(|socket| cable::set_plugged(socket, plugged))
    }

    /// Closes a TCP connection, or keeps it from its peer until the cable is in again.
    fn drop_peer(&mut self, stream: usize, waiter: &mut Waiter) -> Option<StreamId> {
        let peer = self.peers.get_mut(stream).and_then(Option::take)?;
        let id = peer.stream;
        #[cfg(target_os = "linux")]
        if !self.is_plugged && waiter.remove(peer.socket.as_fd()).is_ok() {
            self.unheard.push(peer);
        }
        #[cfg(not(target_os = "linux"))]
        let _ = waiter;
        Some(id)
    }

    fn attend_stream(
        &mut self,
        now: Instant,
        index: usize,
        stream: usize,
        room: &mut [u8],
        waiter: &mut Waiter,
    ) {
        let Some(place) = self.peers.get_mut(stream) else { return };
        let Some(peer) = place else { return };
        // The system may take more now.
        let may_write = self.is_plugged && !peer.backlog.is_empty();
        if may_write && peer.write_backlog(index, waiter).is_err() {
            self.end(now, stream, waiter);
            return;
        }
        let room = room.get_mut(..PIECE).unwrap_or_default();
        let read = peer.socket.read(room);
        let id = peer.stream;
        match read {
            Ok(len) if len > 0 => {
                self.robot.handle_stream(now, id, room.get(..len).unwrap_or(&[]));
            }
            Err(error)
                if matches!(
                    error.kind(),
                    io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
                ) => {}
            _ => self.end(now, stream, waiter),
        }
    }

    /// A connection ended at the peer's side, or shall end because of the peer.
    fn end(&mut self, now: Instant, stream: usize, waiter: &mut Waiter) {
        if let Some(stream) = self.drop_peer(stream, waiter) {
            self.robot.handle_stream_closed(now, stream);
        }
    }

    /// The robot closes a connection. What it sent before leaves first if the system takes it.
    fn close(&mut self, stream: StreamId, waiter: &mut Waiter) {
        self.drop_peer(stream.index(), waiter);
    }

    fn write(
        &mut self,
        now: Instant,
        index: usize,
        stream: StreamId,
        bytes: &[u8],
        waiter: &mut Waiter,
    ) -> Result<(), Overfull> {
        let Some(Some(peer)) = self.peers.get_mut(stream.index()) else { return Ok(()) };
        if peer.backlog.len() + bytes.len() > BACKLOG {
            self.end(now, stream.index(), waiter);
            return Err(Overfull);
        }
        let was_empty = peer.backlog.is_empty();
        peer.backlog.extend_from_slice(bytes);
        let may_write = self.is_plugged && was_empty;
        if may_write && peer.write_backlog(index, waiter).is_err() {
            self.end(now, stream.index(), waiter);
        }
        Ok(())
    }
}

impl Peer {
    const fn new(socket: TcpStream, stream: StreamId) -> Self {
        Self { socket, stream, backlog: Vec::new(), waits_to_write: false }
    }

    fn source(&self, index: usize) -> Source<'_> {
        let interest = if self.waits_to_write { Interest::ReadAndWrite } else { Interest::Read };
        source(key(index, FIRST_STREAM + self.stream.index()), &self.socket, interest)
    }

    fn set_waits_to_write(
        &mut self,
        waits: bool,
        index: usize,
        waiter: &mut Waiter,
    ) -> io::Result<()> {
        if waits == core::mem::replace(&mut self.waits_to_write, waits) {
            return Ok(());
        }
        waiter.change(self.source(index))
    }

    /// Writes what the system takes; what is left waits until it takes more.
    fn write_backlog(&mut self, index: usize, waiter: &mut Waiter) -> io::Result<()> {
        while !self.backlog.is_empty() {
            match self.socket.write(&self.backlog) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(len) => {
                    self.backlog.drain(..len);
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    return self.set_waits_to_write(true, index, waiter);
                }
                Err(error) => return Err(error),
            }
        }
        self.set_waits_to_write(false, index, waiter)
    }
}
