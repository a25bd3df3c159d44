//! The two ports of one robot on sockets.
//!
//! Read [`TextPorts::serve`] first: one pass over everything that is ready, without waiting. The robot is
//! handed in with each call, so that it may have other interfaces too.
//!
//! Connections that are sent away are kept for a moment ([`LEAVING_TIME`]) and read: a socket that is
//! closed with unread bytes resets the connection, and the peer might never see why.
//!
//! A controller that asks faster than it reads is not read any further until it has read; when its socket
//! takes nothing for [`PATIENCE`], it counts as one that does not read, and the session closes it.
//!
//! A peer that vanished without a word is found by keep-alive packets of TCP: after [`KEEP_ALIVE`] of silence
//! one is sent every [`KEEP_ALIVE`], and the connection breaks when as many are lost as the robot says
//! ([`TextDevice::keep_alive_packets`]).
//!
//! Invariants: a pass ends, whatever arrives; sockets and bytes kept are bounded.

use std::boxed::Box;
use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::vec;
use std::vec::Vec;

use rustix::fd::AsFd;
use socket2::{Domain, Protocol, SockRef, Socket, TcpKeepalive, Type};

use super::error::{BindError, Port};
use crate::bus::text::server::{
    ANOTHER_USER, CloseReason, Peer, ServerSession, SessionCounts, TOO_MANY_MONITORS,
};
use crate::bus::text::{CONTROL_PORT, MAX_COMMAND, MONITORING_PORT, OUTBOX};
#[cfg(target_os = "linux")]
use crate::link::cable;
use crate::link::watch_list::{Interest, WatchList};
use crate::text_device::TextDevice;
use crate::time::{Duration, Instant};

/// Monitoring connections at once.
///
/// Source: choice. The manual allows several and names no number.
pub const MONITORS: usize = 8;
/// How long a connection that is sent away is kept.
pub const LEAVING_TIME: Duration = Duration::from_secs(1);
/// Connections on their way out; the oldest makes place for one more.
const LEAVING: usize = 16;
/// Silence after which a keep-alive packet is sent, and time between two.
pub const KEEP_ALIVE: Duration = Duration::from_secs(1);
/// How long a controller may take to read its answers before it is taken for one that does not.
pub const PATIENCE: Duration = Duration::from_secs(1);
/// How long nothing is accepted or bound after the system refused.
const REST: Duration = Duration::from_millis(100);
/// Connections that wait to be accepted.
const WAITING: i32 = 256;
/// Connections accepted, and reads from one connection, in one pass.
const AT_ONCE: usize = 16;
/// Batches of messages in one pass; what a robot says in a pass fits in far fewer.
const BATCHES: usize = 4_096;
/// Events kept for a caller that does not ask.
const EVENTS: usize = 256;
const ROOM: usize = 16_384;

type Session = ServerSession<MONITORS, MAX_COMMAND, OUTBOX>;

/// Where the two ports are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Endpoints {
    /// The control port; 10000 of a robot.
    pub control: SocketAddr,
    /// The monitoring port; 10001 of a robot.
    pub monitoring: SocketAddr,
}

impl Endpoints {
    /// Both ports of a robot at `address`.
    #[must_use]
    pub fn at(address: core::net::IpAddr) -> Self {
        Self {
            control: SocketAddr::new(address, CONTROL_PORT),
            monitoring: SocketAddr::new(address, MONITORING_PORT),
        }
    }
}

/// What happened at the ports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ServerEvent {
    /// Somebody connected.
    Connected {
        /// As what.
        peer: Peer,
        /// From where.
        from: SocketAddr,
    },
    /// A connection was sent away: the control is taken, or there are too many monitors.
    SentAway {
        /// At which port.
        port: Port,
        /// From where.
        from: SocketAddr,
    },
    /// A connection ended.
    Disconnected {
        /// What it was.
        peer: Peer,
        /// Why, if it was this end that closed it.
        reason: Option<CloseReason>,
    },
}

/// What passed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PortCounts {
    /// What the session counts.
    pub session: SessionCounts,
    /// Connections that were accepted, those sent away too.
    pub accepted: u64,
    /// Bytes received from controlling connections.
    pub received: u64,
    /// Bytes sent.
    pub sent: u64,
    /// Times that the system gave no connection or no port.
    pub refused_by_system: u64,
}

/// A connection on its way out.
#[derive(Debug)]
struct Leaving {
    stream: TcpStream,
    until: Instant,
}

/// The two ports of a robot.
pub struct TextPorts {
    session: Box<Session>,
    endpoints: Endpoints,
    /// `None` while the robot's ports are closed.
    listeners: Option<(TcpListener, TcpListener)>,
    control: Option<TcpStream>,
    monitors: [Option<TcpStream>; MONITORS],
    leaving: VecDeque<Leaving>,
    is_plugged: bool,
    /// Connections that this end closed while the cable was out: the peer cannot know yet.
    unheard: Vec<TcpStream>,
    /// What came from the controller and waits until it has read.
    held: Vec<u8>,
    /// When its socket last took something.
    taken_at: Instant,
    rests_until: Option<Instant>,
    events: VecDeque<ServerEvent>,
    counts: PortCounts,
    room: Box<[u8]>,
}

impl core::fmt::Debug for TextPorts {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("TextPorts")
            .field("endpoints", &self.endpoints)
            .field("counts", &self.counts)
            .finish_non_exhaustive()
    }
}

fn listen(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = Socket::new(Domain::for_address(address), Type::STREAM, Some(Protocol::TCP))?;
    socket.set_nonblocking(true)?;
    // Connections of an earlier process that linger do not hold the port on Unix; on Windows this would
    // let two processes share it.
    #[cfg(unix)]
    socket.set_reuse_address(true)?;
    socket.bind(&address.into())?;
    socket.listen(WAITING)?;
    Ok(socket.into())
}

fn open(endpoints: Endpoints) -> Result<(TcpListener, TcpListener), BindError> {
    let failed = |port, address| move |cause| BindError { port, address, cause };
    let Endpoints { control, monitoring } = endpoints;
    Ok((
        listen(control).map_err(failed(Port::Control, control))?,
        listen(monitoring).map_err(failed(Port::Monitoring, monitoring))?,
    ))
}

/// Makes a fresh connection ready for passes; it breaks when `keep_alives` packets in a row are lost. None
/// at all cannot be told from a connection without silence, and counts as one.
fn prepare(stream: &TcpStream, keep_alives: u8) -> io::Result<()> {
    stream.set_nonblocking(true)?;
    stream.set_nodelay(true)?;
    let lost = u32::from(keep_alives.max(1));
    let socket = SockRef::from(stream);
    let keep_alive = TcpKeepalive::new().with_time(KEEP_ALIVE).with_interval(KEEP_ALIVE);
    #[cfg(not(windows))]
    let keep_alive = keep_alive.with_retries(lost);
    // Some systems keep these to themselves; a peer that vanished is then found later.
    let _ = socket.set_tcp_keepalive(&keep_alive);
    // The same for bytes that are under way and not acknowledged.
    #[cfg(target_os = "linux")]
    let _ = socket.set_tcp_user_timeout(Some(KEEP_ALIVE * (lost + 1)));
    Ok(())
}

/// What a read or a write came to.
enum Moved {
    Bytes(usize),
    NotNow,
    Gone,
}

fn moved(result: io::Result<usize>) -> Moved {
    match result {
        Ok(0) => Moved::Gone,
        Ok(count) => Moved::Bytes(count),
        Err(error) if error.kind() == ErrorKind::WouldBlock => Moved::NotNow,
        Err(error) if error.kind() == ErrorKind::Interrupted => Moved::NotNow,
        Err(_) => Moved::Gone,
    }
}

impl TextPorts {
    /// Opens both ports. Port 0 takes a free one; [`endpoints`](Self::endpoints) tells which.
    ///
    /// # Errors
    ///
    /// [`BindError`].
    pub fn bind(endpoints: Endpoints) -> Result<Self, BindError> {
        let listeners = open(endpoints)?;
        let real = |listener: &TcpListener, asked| listener.local_addr().unwrap_or(asked);
        let endpoints = Endpoints {
            control: real(&listeners.0, endpoints.control),
            monitoring: real(&listeners.1, endpoints.monitoring),
        };
        Ok(Self {
            session: Box::new(Session::new()),
            endpoints,
            listeners: Some(listeners),
            control: None,
            monitors: [const { None }; MONITORS],
            leaving: VecDeque::with_capacity(LEAVING),
            is_plugged: true,
            unheard: Vec::new(),
            held: Vec::new(),
            taken_at: Instant::ZERO,
            rests_until: None,
            events: VecDeque::new(),
            counts: PortCounts::default(),
            room: vec![0; ROOM].into_boxed_slice(),
        })
    }

    /// Where the ports are.
    #[must_use]
    pub const fn endpoints(&self) -> Endpoints {
        self.endpoints
    }

    /// What passed so far.
    #[must_use]
    pub fn counts(&self) -> PortCounts {
        PortCounts { session: self.session.counts(), ..self.counts }
    }

    /// Who is connected.
    pub fn peers(&self) -> impl Iterator<Item = Peer> {
        self.session.peers()
    }

    /// The next thing that happened. Those that nobody asks for are forgotten, the oldest first.
    pub fn next_event(&mut self) -> Option<ServerEvent> {
        self.events.pop_front()
    }

    fn tell(&mut self, event: ServerEvent) {
        if self.events.len() >= EVENTS {
            self.events.pop_front();
        }
        self.events.push_back(event);
    }

    /// One pass, without waiting: the robot lives until `now`, who knocks is let in or sent away, what arrived
    /// goes to the robot and what it says is sent. To be called once a millisecond at least.
    pub fn serve(&mut self, now: Instant, device: &mut dyn TextDevice) {
        self.session.advance(now, device);
        self.send_all(now, device);
        self.open_or_close(now, device);
        self.accept(now, device);
        self.read_all(now, device);
        self.send_all(now, device);
        self.close_ended(now, device);
        self.see_off(now);
    }

    /// Waits until something is to be done for [`serve`](Self::serve), at most for `limit`. It may return early.
    ///
    /// # Errors
    ///
    /// The system refuses to wait.
    pub fn wait(&self, limit: Duration) -> io::Result<()> {
        let mut list = WatchList::new();
        self.watch(&mut list, 0);
        list.wait(limit).map(drop)
    }

    /// Puts all sockets on `list`, as those of `server`: [`serve`](Self::serve) is to be called when one
    /// of them is ready.
    pub fn watch<'a>(&'a self, list: &mut WatchList<'a>, server: usize) {
        if let (Some((control, monitoring)), None) = (&self.listeners, self.rests_until) {
            list.add(server, control.as_fd(), Interest::Read);
            list.add(server, monitoring.as_fd(), Interest::Read);
        }
        for (peer, stream) in self.streams() {
            let has_more = self.is_plugged && !self.session.waiting(peer).is_empty();
            let is_held = peer == Peer::Control && !self.held.is_empty();
            list.add(
                server,
                stream.as_fd(),
                match (has_more, is_held) {
                    (true, false) => Interest::ReadAndWrite,
                    (true, true) => Interest::Write,
                    // Nothing is read before something was written, which waits for the cable.
                    (false, true) if !self.is_plugged => Interest::Nothing,
                    (false, _) => Interest::Read,
                },
            );
        }
        for one in &self.leaving {
            list.add(server, one.stream.as_fd(), Interest::Read);
        }
    }

    /// Pulls the network cable, or plugs it in again. While it is out nothing arrives and nothing is
    /// sent: who is connected stays so until keep-alive packets are missed, at either end; who knocks
    /// is not heard; and what this end closes the peer learns when the cable is in again.
    ///
    /// # Errors
    ///
    /// The system cannot hold up what arrives.
    #[cfg(target_os = "linux")]
    pub fn set_plugged(&mut self, plugged: bool) -> io::Result<()> {
        self.is_plugged = plugged;
        if plugged {
            self.unheard.clear();
        }
        let listeners = self.listeners.iter();
        let listeners = listeners.flat_map(|(one, other)| [one.as_fd(), other.as_fd()]);
        let streams = self.streams().map(|(_, stream)| stream.as_fd());
        let leaving = self.leaving.iter().map(|one| one.stream.as_fd());
        let mut sockets = listeners.chain(streams).chain(leaving);
        sockets.try_for_each(|socket| cable::set_plugged(socket, plugged))
    }

    /// A socket that was made while the cable is out hears nothing either.
    #[cfg(target_os = "linux")]
    fn join_cable(&self, socket: impl AsFd) {
        if !self.is_plugged {
            // It went for the others, so it goes for this one.
            let _ = cable::set_plugged(socket.as_fd(), false);
        }
    }

    #[cfg(not(target_os = "linux"))]
    fn join_cable(&self, _: impl AsFd) {}

    fn streams(&self) -> impl Iterator<Item = (Peer, &TcpStream)> {
        let monitors = self.monitors.iter().enumerate();
        let monitors =
            monitors.filter_map(|(place, stream)| Some((Peer::Monitor(place), stream.as_ref()?)));
        self.control.iter().map(|stream| (Peer::Control, stream)).chain(monitors)
    }

    fn stream_mut(&mut self, peer: Peer) -> Option<&mut TcpStream> {
        match peer {
            Peer::Control => self.control.as_mut(),
            Peer::Monitor(place) => self.monitors.get_mut(place)?.as_mut(),
        }
    }

    fn take_stream(&mut self, peer: Peer) -> Option<TcpStream> {
        match peer {
            Peer::Control => self.control.take(),
            Peer::Monitor(place) => self.monitors.get_mut(place)?.take(),
        }
    }

    /// Follows the robot into EtherCAT mode, where its ports are closed, and back.
    fn open_or_close(&mut self, now: Instant, device: &mut dyn TextDevice) {
        if self.rests_until.is_some_and(|until| now >= until) {
            self.rests_until = None;
        }
        match (device.is_on_text(), &self.listeners) {
            (false, Some(_)) => self.listeners = None,
            (true, None) if self.rests_until.is_none() => match open(self.endpoints) {
                Ok(listeners) => {
                    self.join_cable(&listeners.0);
                    self.join_cable(&listeners.1);
                    self.listeners = Some(listeners);
                }
                Err(_) => self.rest(now),
            },
            _ => {}
        }
    }

    fn rest(&mut self, now: Instant) {
        self.counts.refused_by_system += 1;
        self.rests_until = Some(now + REST);
    }

    fn accept(&mut self, now: Instant, device: &mut dyn TextDevice) {
        for port in [Port::Control, Port::Monitoring] {
            for _ in 0..AT_ONCE {
                if self.rests_until.is_some() {
                    return;
                }
                let Some((control, monitoring)) = &self.listeners else { return };
                let listener = if port == Port::Control { control } else { monitoring };
                match listener.accept() {
                    Ok((stream, from)) => self.let_in(now, device, port, stream, from),
                    Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                    // Gone before it was accepted.
                    Err(error) if error.kind() == ErrorKind::ConnectionAborted => {}
                    Err(error) if error.kind() == ErrorKind::Interrupted => {}
                    Err(_) => self.rest(now),
                }
            }
        }
    }

    fn let_in(
        &mut self,
        now: Instant,
        device: &mut dyn TextDevice,
        port: Port,
        stream: TcpStream,
        from: SocketAddr,
    ) {
        self.counts.accepted += 1;
        if prepare(&stream, device.keep_alive_packets()).is_err() {
            return;
        }
        self.join_cable(&stream);
        if port == Port::Control {
            // Whoever has control may have left before this one knocked, and be found gone only by reading.
            self.read(now, device, Peer::Control);
        }
        let peer = match port {
            Port::Control => self.session.accept_control(now, device).then_some(Peer::Control),
            Port::Monitoring => self.session.accept_monitor(now, device),
        };
        match peer {
            Some(Peer::Control) => self.control = Some(stream),
            Some(Peer::Monitor(place)) => {
                if let Some(slot) = self.monitors.get_mut(place) {
                    *slot = Some(stream);
                }
            }
            None => {
                let farewell = match port {
                    Port::Control => ANOTHER_USER,
                    Port::Monitoring => TOO_MANY_MONITORS,
                };
                self.dismiss(now, stream, farewell);
                return self.tell(ServerEvent::SentAway { port, from });
            }
        }
        if let Some(peer) = peer {
            self.tell(ServerEvent::Connected { peer, from });
        }
    }

    /// Says the last words and keeps the socket until the peer has closed too, or for a moment.
    fn dismiss(&mut self, now: Instant, mut stream: TcpStream, farewell: &[u8]) {
        if !self.is_plugged {
            return self.unheard.push(stream);
        }
        // What does not fit into the system's buffers now is lost, as it must be.
        let _ = stream.write(farewell);
        let _ = stream.shutdown(Shutdown::Write);
        if self.leaving.len() >= LEAVING {
            self.leaving.pop_front();
        }
        self.leaving.push_back(Leaving { stream, until: now + LEAVING_TIME });
    }

    fn read_all(&mut self, now: Instant, device: &mut dyn TextDevice) {
        let places = (0..MONITORS).map(Peer::Monitor);
        for peer in core::iter::once(Peer::Control).chain(places) {
            self.read(now, device, peer);
        }
    }

    fn read(&mut self, now: Instant, device: &mut dyn TextDevice, peer: Peer) {
        if peer == Peer::Control && !self.held.is_empty() {
            let held = core::mem::take(&mut self.held);
            self.give(now, device, &held);
        }
        let mut room = core::mem::take(&mut self.room);
        for _ in 0..AT_ONCE {
            if peer == Peer::Control && !self.held.is_empty() {
                break;
            }
            let Some(stream) = self.stream_mut(peer) else { break };
            match moved(stream.read(&mut room)) {
                Moved::Bytes(count) => {
                    if peer == Peer::Control {
                        self.counts.received += count as u64;
                        self.give(now, device, &room[..count]);
                    }
                }
                Moved::NotNow => break,
                Moved::Gone => {
                    self.gone(now, device, peer);
                    break;
                }
            }
            self.write(now, device, peer);
        }
        self.room = room;
    }

    /// Gives the session what came from the controller. The answers leave before more commands are looked
    /// at; what its socket leaves no room for is held.
    fn give(&mut self, now: Instant, device: &mut dyn TextDevice, mut bytes: &[u8]) {
        loop {
            let waits = self.control.is_some() && !self.session.has_room(Peer::Control);
            if waits && now.saturating_duration_since(self.taken_at) < PATIENCE {
                self.held.extend_from_slice(bytes);
                return;
            }
            if !self.session.receive_some(now, device, Peer::Control, &mut bytes) {
                return;
            }
            self.write_all(now, device);
        }
    }

    /// Sends all that the robot has to say, batch by batch: after a while in which nobody served, it is
    /// more than an outbox holds.
    fn send_all(&mut self, now: Instant, device: &mut dyn TextDevice) {
        for _ in 0..BATCHES {
            self.write_all(now, device);
            if !self.session.take_messages(now, device) {
                break;
            }
        }
        self.write_all(now, device);
    }

    fn write_all(&mut self, now: Instant, device: &mut dyn TextDevice) {
        let places = (0..MONITORS).map(Peer::Monitor);
        for peer in core::iter::once(Peer::Control).chain(places) {
            self.write(now, device, peer);
        }
    }

    fn write(&mut self, now: Instant, device: &mut dyn TextDevice, peer: Peer) {
        if !self.is_plugged {
            return;
        }
        let Self { session, control, monitors, counts, taken_at, .. } = self;
        let stream = match peer {
            Peer::Control => control.as_mut(),
            Peer::Monitor(place) => monitors.get_mut(place).and_then(Option::as_mut),
        };
        let Some(stream) = stream else { return };
        let waiting = session.waiting(peer);
        if waiting.is_empty() {
            return;
        }
        match moved(stream.write(waiting)) {
            Moved::Bytes(count) => {
                counts.sent += count as u64;
                session.sent(peer, count);
                if peer == Peer::Control {
                    *taken_at = now;
                }
            }
            Moved::NotNow => {}
            Moved::Gone => self.gone(now, device, peer),
        }
    }

    /// The peer is gone.
    fn gone(&mut self, now: Instant, device: &mut dyn TextDevice, peer: Peer) {
        self.take_stream(peer);
        self.session.closed(now, device, peer);
        if peer == Peer::Control {
            self.held.clear();
        }
        self.tell(ServerEvent::Disconnected { peer, reason: None });
    }

    /// Closes what the session wants closed.
    fn close_ended(&mut self, now: Instant, device: &mut dyn TextDevice) {
        // Each turn frees a seat, so there are no more turns than seats.
        for _ in 0..=MONITORS {
            let Some((peer, reason)) = self.session.next_to_close() else { break };
            self.write(now, device, peer);
            if let Some(stream) = self.take_stream(peer) {
                self.dismiss(now, stream, b"");
            }
            self.session.closed(now, device, peer);
            if peer == Peer::Control {
                self.held.clear();
            }
            self.tell(ServerEvent::Disconnected { peer, reason: Some(reason) });
        }
    }

    /// Reads what those on their way out still say, until they are gone or their time is over.
    fn see_off(&mut self, now: Instant) {
        let room = &mut self.room;
        self.leaving.retain_mut(|one| {
            let is_gone = matches!(moved(one.stream.read(room)), Moved::Gone);
            !is_gone && now < one.until
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A robot that says nothing and lets so many packets be lost.
    struct Patient(u8);

    impl TextDevice for Patient {
        fn open_control(&mut self, _: Instant) -> bool {
            true
        }

        fn close_control(&mut self, _: Instant) {}

        fn command(&mut self, _: Instant, _: &str) {}

        fn reject(&mut self, _: Instant, _: crate::text_device::LineProblem) {}

        fn next_control_message(&mut self, _: &mut dyn core::fmt::Write) -> bool {
            false
        }

        fn monitoring_snapshot(&mut self, _: Instant, _: &mut dyn FnMut(&str)) {}

        fn next_monitoring_message(&mut self, _: &mut dyn core::fmt::Write) -> bool {
            false
        }

        fn advance(&mut self, _: Instant) {}

        fn is_on_text(&self) -> bool {
            true
        }

        fn keep_alive_packets(&self) -> u8 {
            self.0
        }
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn the_robot_says_how_many_packets_may_be_lost() {
        let any = "127.0.0.1:0".parse().unwrap();
        let mut ports = TextPorts::bind(Endpoints { control: any, monitoring: any }).unwrap();
        let _control = TcpStream::connect(ports.endpoints().control).unwrap();
        let _monitor = TcpStream::connect(ports.endpoints().monitoring).unwrap();
        for _ in 0..100 {
            ports.wait(Duration::from_millis(10)).unwrap();
            ports.serve(Instant::ZERO, &mut Patient(7));
        }
        assert_eq!(ports.streams().count(), 2);
        for (_, stream) in ports.streams() {
            assert_eq!(SockRef::from(stream).tcp_keepalive_retries().unwrap(), 7);
        }
    }

    #[test]
    fn a_peer_that_vanished_is_looked_for() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        for (keep_alives, lost) in [(3, 3), (60, 60), (1, 1), (0, 1)] {
            let _peer = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
            let (stream, _) = listener.accept().unwrap();
            prepare(&stream, keep_alives).unwrap();
            let socket = SockRef::from(&stream);
            assert!(socket.keepalive().unwrap() && socket.tcp_nodelay().unwrap());
            #[cfg(target_os = "linux")]
            {
                let limit = Duration::from_secs(u64::from(lost) + 1);
                assert_eq!(socket.tcp_keepalive_time().unwrap(), KEEP_ALIVE);
                assert_eq!(socket.tcp_keepalive_interval().unwrap(), KEEP_ALIVE);
                assert_eq!(socket.tcp_keepalive_retries().unwrap(), lost);
                assert_eq!(socket.tcp_user_timeout().unwrap(), Some(limit));
            }
        }
    }
}
