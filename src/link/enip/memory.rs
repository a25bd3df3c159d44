//! Served robots in the same process, and a [`Network`] to them whose time is simulated.
//!
//! Whatever is sent arrives [`LATENCY`] later, in order, and nothing is lost; waiting moves the clock and costs
//! nothing. A robot that is off its bus hears and says nothing, and its TCP connections are half open until
//! somebody sends on them, as with a device that lost its power.
//!
//! One scanner is all that most need. For several, [`MemoryNetwork::add_host`] gives each a host of its own,
//! and [`MemoryNetwork::act_as`] says for which of them the methods of [`Network`] act.
//!
//! Invariants: time never goes back; once all buffers were used, nothing is allocated while frames are
//! exchanged.

use core::net::{Ipv4Addr, SocketAddrV4};
use std::collections::VecDeque;
use std::io;
use std::vec;
use std::vec::Vec;

use super::network::{Arrival, Network, ROOM};
use super::served::ServedRobot;
use crate::bus::enip::adapter::{StreamId, Transmit};
use crate::cycle::CyclicDevice;
use crate::time::{Duration, Instant};
use crate::wire::enip::{IO_PORT, MESSAGE_PORT};

/// Time from sending to arriving.
///
/// Source: choice. About what a small frame takes through a switch at 100 Mbit/s.
pub const LATENCY: Duration = Duration::from_micros(5);
/// Address of the first host.
const FIRST_HOST: Ipv4Addr = Ipv4Addr::new(192, 168, 0, 100);
/// Datagrams that wait for a host; what comes beyond these is lost, as in a full buffer of a socket.
const WAITING: usize = 256;
/// Messages that a robot sends in one go at most.
const TRANSMITS: usize = 64;
/// Least time between two moments in which something happens, should a robot be due again at once.
const MOMENT: Duration = Duration::from_micros(1);

/// A TCP connection between a host and a robot.
struct Tcp {
    serial: u64,
    host: usize,
    target: usize,
    robot: usize,
    /// Whether the host still has it.
    is_held: bool,
    /// The robot's end, once accepted and until closed.
    stream: Option<StreamId>,
    /// Whether the robot has not been asked yet.
    is_opening: bool,
}

/// What is under way.
#[derive(Clone, Copy)]
enum Message {
    /// TCP connection of this serial number: asked for, or accepted.
    Open(u64),
    /// Bytes of one.
    Bytes(u64),
    /// One is closed.
    Close(u64),
    /// From here, to this port.
    Datagram(SocketAddrV4, u16),
}

/// A message and where it goes: a robot or a host by number.
struct Flight {
    due: Instant,
    to: usize,
    message: Message,
    bytes: Vec<u8>,
}

struct Host {
    address: Ipv4Addr,
    groups: Vec<Ipv4Addr>,
    arriving: VecDeque<Flight>,
}

impl Host {
    fn new(address: Ipv4Addr) -> Self {
        Self { address, groups: Vec::new(), arriving: VecDeque::with_capacity(2 * WAITING) }
    }
}

/// Robots and hosts on a perfect network.
pub struct MemoryNetwork<D> {
    robots: Vec<ServedRobot<D>>,
    hosts: Vec<Host>,
    active: usize,
    now: Instant,
    departing: VecDeque<Flight>,
    tcp: Vec<Tcp>,
    next_serial: u64,
    spare: Vec<Vec<u8>>,
    room: Vec<u8>,
}

impl<D: CyclicDevice> MemoryNetwork<D> {
    /// A network with `robots` at their addresses, and one host.
    #[must_use]
    pub fn new(robots: Vec<ServedRobot<D>>) -> Self {
        Self {
            robots,
            hosts: vec![Host::new(FIRST_HOST)],
            active: 0,
            now: Instant::ZERO,
            departing: VecDeque::with_capacity(2 * WAITING),
            tcp: Vec::new(),
            next_serial: 0,
            spare: Vec::new(),
            room: vec![0; ROOM],
        }
    }

    /// The robots.
    #[must_use]
    pub fn robots(&self) -> &[ServedRobot<D>] {
        &self.robots
    }

    /// The robots, to be acted upon as a person beside them would.
    pub fn robots_mut(&mut self) -> &mut [ServedRobot<D>] {
        &mut self.robots
    }

    /// One more host, for another scanner; returns its number. The first has number 0.
    pub fn add_host(&mut self, address: Ipv4Addr) -> usize {
        self.hosts.push(Host::new(address));
        self.hosts.len() - 1
    }

    /// From now on the methods of [`Network`] act for `host`; without such a host nothing changes.
    pub fn act_as(&mut self, host: usize) {
        if host < self.hosts.len() {
            self.active = host;
        }
    }

    fn buffer(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut buffer = self.spare.pop().unwrap_or_default();
        buffer.clear();
        buffer.extend_from_slice(bytes);
        buffer
    }

    fn recycle(&mut self, buffer: Vec<u8>) {
        if buffer.capacity() > 0 {
            self.spare.push(buffer);
        }
    }

    fn tcp(&mut self, serial: u64) -> Option<&mut Tcp> {
        self.tcp.iter_mut().find(|tcp| tcp.serial == serial)
    }

    fn forget_closed(&mut self) {
        self.tcp.retain(|tcp| tcp.is_held || tcp.stream.is_some() || tcp.is_opening);
    }

    fn send_to_robot(&mut self, robot: usize, message: Message, bytes: &[u8]) {
        let bytes = self.buffer(bytes);
        let due = self.now + LATENCY;
        self.departing.push_back(Flight { due, to: robot, message, bytes });
    }

    fn send_to_host(&mut self, host: usize, message: Message, bytes: &[u8]) {
        let bytes = self.buffer(bytes);
        let due = self.now + LATENCY;
        let arriving = self.hosts.get_mut(host).map(|host| &mut host.arriving);
        let is_datagram = matches!(message, Message::Datagram(..));
        match arriving.filter(|arriving| !is_datagram || arriving.len() < WAITING) {
            Some(arriving) => arriving.push_back(Flight { due, to: host, message, bytes }),
            None => self.recycle(bytes),
        }
    }

    /// The next moment in which something happens.
    fn next_moment(&self) -> Option<Instant> {
        let robots = self.robots.iter().map(ServedRobot::next_due);
        let departing = self.departing.front().map(|flight| flight.due);
        let arriving = self.hosts.get(self.active).and_then(|host| host.arriving.front());
        // What has arrived already waits until somebody asks for it.
        let arriving = arriving.map(|flight| flight.due).filter(|due| *due > self.now);
        robots.chain(departing).chain(arriving).min()
    }

    /// Lets everything happen that is due now.
    fn happen(&mut self) {
        while self.departing.front().is_some_and(|flight| flight.due <= self.now) {
            if let Some(flight) = self.departing.pop_front() {
                self.reach_robot(flight.to, flight.message, &flight.bytes);
                self.recycle(flight.bytes);
            }
        }
        for index in 0..self.robots.len() {
            let now = self.now;
            let Some(robot) = self.robots.get_mut(index) else { continue };
            if robot.next_due() <= now {
                robot.live(now);
            }
            self.transmit(index);
        }
    }

    fn reach_robot(&mut self, index: usize, message: Message, bytes: &[u8]) {
        let now = self.now;
        let Some(robot) = self.robots.get_mut(index) else { return };
        let (Message::Open(serial) | Message::Bytes(serial) | Message::Close(serial)) = message
        else {
            if let Message::Datagram(from, port) = message {
                match port {
                    IO_PORT => robot.handle_io_datagram(now, from, bytes),
                    MESSAGE_PORT => robot.handle_message_datagram(now, from, bytes),
                    _ => {}
                }
            }
            return;
        };
        let Some(tcp) = self.tcp.iter_mut().find(|tcp| tcp.serial == serial) else { return };
        let host = tcp.host;
        match message {
            Message::Open(_) if robot.is_on_bus() => {
                let address = self.hosts.get(host).map_or(FIRST_HOST, |host| host.address);
                // Ports as a system gives them out, one after the other.
                let port = 49_152 + (serial % 16_384) as u16;
                tcp.is_opening = false;
                tcp.stream = robot.handle_accepted(now, SocketAddrV4::new(address, port));
                let is_accepted = tcp.stream.is_some();
                self.send_to_host(host, Message::Open(serial), &[]);
                if !is_accepted {
                    self.send_to_host(host, Message::Close(serial), &[]);
                }
            }
            // Nobody is there to answer.
            Message::Open(_) => tcp.is_opening = false,
            Message::Bytes(_) => match tcp.stream {
                Some(stream) => robot.handle_stream(now, stream, bytes),
                None if robot.is_on_bus() => self.send_to_host(host, Message::Close(serial), &[]),
                None => {}
            },
            Message::Close(_) => {
                if let Some(stream) = tcp.stream.take() {
                    robot.handle_stream_closed(now, stream);
                }
                self.forget_closed();
            }
            Message::Datagram(..) => {}
        }
    }

    /// Sends what a robot has to send.
    fn transmit(&mut self, index: usize) {
        let now = self.now;
        let mut room = core::mem::take(&mut self.room);
        let Some(robot) = self.robots.get_mut(index) else { return };
        if robot.take_departure() {
            self.tcp.iter_mut().filter(|tcp| tcp.robot == index).for_each(|tcp| tcp.stream = None);
            self.forget_closed();
        }
        for _ in 0..TRANSMITS {
            let Some(robot) = self.robots.get_mut(index) else { break };
            let address = robot.address();
            let Some(transmit) = robot.poll_transmit(now, &mut room) else { break };
            match transmit {
                Transmit::Stream { stream, len } => {
                    let bytes = room.get(..len).unwrap_or(&[]);
                    let tcp = self.tcp.iter().find(|tcp| tcp.is(index, stream));
                    if let Some((host, serial)) = tcp.map(|tcp| (tcp.host, tcp.serial)) {
                        self.send_to_host(host, Message::Bytes(serial), bytes);
                    }
                }
                Transmit::CloseStream { stream } => {
                    let tcp = self.tcp.iter_mut().find(|tcp| tcp.is(index, stream));
                    if let Some(tcp) = tcp {
                        tcp.stream = None;
                        let (host, serial) = (tcp.host, tcp.serial);
                        self.send_to_host(host, Message::Close(serial), &[]);
                    }
                }
                Transmit::MessageDatagram { to, len } => {
                    let bytes = room.get(..len).unwrap_or(&[]);
                    self.datagram_to_hosts(SocketAddrV4::new(address, MESSAGE_PORT), to, bytes);
                }
                Transmit::IoDatagram { to, len } => {
                    let bytes = room.get(..len).unwrap_or(&[]);
                    self.datagram_to_hosts(SocketAddrV4::new(address, IO_PORT), to, bytes);
                }
            }
        }
        self.room = room;
    }

    /// Every host has one socket, at port 2222.
    fn datagram_to_hosts(&mut self, from: SocketAddrV4, to: SocketAddrV4, bytes: &[u8]) {
        if to.port() != IO_PORT {
            return;
        }
        for index in 0..self.hosts.len() {
            let is_meant = self
                .hosts
                .get(index)
                .is_some_and(|host| host.address == *to.ip() || host.groups.contains(to.ip()));
            if is_meant {
                self.send_to_host(index, Message::Datagram(from, to.port()), bytes);
            }
        }
    }

    /// The next message that has arrived at the acting host, in `room`.
    fn arrived(&mut self, room: &mut [u8]) -> Option<Arrival> {
        loop {
            let now = self.now;
            let arriving = &mut self.hosts.get_mut(self.active)?.arriving;
            if arriving.front()?.due > now {
                return None;
            }
            let flight = arriving.pop_front()?;
            let arrival = self.arrival(&flight, room);
            self.recycle(flight.bytes);
            if arrival.is_some() {
                return arrival;
            }
        }
    }

    fn arrival(&mut self, flight: &Flight, room: &mut [u8]) -> Option<Arrival> {
        let len = flight.bytes.len().min(room.len());
        room.iter_mut().zip(&flight.bytes).for_each(|(room, byte)| *room = *byte);
        let (Message::Open(serial) | Message::Bytes(serial) | Message::Close(serial)) =
            flight.message
        else {
            let Message::Datagram(from, _) = flight.message else { return None };
            return Some(Arrival::Datagram { from, len });
        };
        // Of a connection that the host has closed nothing arrives any more.
        let tcp = self.tcp(serial).filter(|tcp| tcp.is_held)?;
        let target = tcp.target;
        match flight.message {
            Message::Open(_) => Some(Arrival::Connected { target }),
            Message::Bytes(_) => Some(Arrival::Stream { target, len }),
            _ => {
                tcp.is_held = false;
                self.forget_closed();
                Some(Arrival::Disconnected { target })
            }
        }
    }

    /// Lets time pass until `until` or until something has arrived at the acting host.
    fn wait_until(&mut self, until: Instant, room: &mut [u8]) -> Option<Arrival> {
        loop {
            if let Some(arrival) = self.arrived(room) {
                return Some(arrival);
            }
            if !self.pass_moment(until) {
                return None;
            }
        }
    }

    /// Lets time pass until the next thing has happened; `false` when nothing does until `until`.
    fn pass_moment(&mut self, until: Instant) -> bool {
        match self.next_moment().filter(|moment| *moment <= until) {
            Some(moment) => {
                let earliest = if moment <= self.now { self.now + MOMENT } else { moment };
                if earliest > until {
                    self.now = self.now.max(until);
                    return false;
                }
                self.now = earliest;
                self.happen();
                true
            }
            None => {
                self.now = self.now.max(until);
                false
            }
        }
    }
}

impl Tcp {
    fn is(&self, robot: usize, stream: StreamId) -> bool {
        self.robot == robot && self.stream == Some(stream)
    }
}

impl<D: CyclicDevice> Network for MemoryNetwork<D> {
    fn now(&self) -> Instant {
        self.now
    }

    fn advance_to(&mut self, now: Instant) {
        while self.pass_moment(now) {}
    }

    fn receive(&mut self, room: &mut [u8], deadline: Instant) -> io::Result<Option<Arrival>> {
        Ok(self.wait_until(deadline, room))
    }

    fn connect(&mut self, target: usize, address: SocketAddrV4) -> io::Result<()> {
        self.disconnect(target);
        let reached = |robot: &ServedRobot<D>| {
            robot.address() == *address.ip() && address.port() == MESSAGE_PORT
        };
        let serial = self.next_serial;
        self.next_serial += 1;
        let host = self.active;
        let robot = self.robots.iter().position(reached);
        self.tcp.push(Tcp {
            serial,
            host,
            target,
            robot: robot.unwrap_or(usize::MAX),
            is_held: true,
            stream: None,
            is_opening: robot.is_some(),
        });
        match robot {
            Some(robot) => self.send_to_robot(robot, Message::Open(serial), &[]),
            None => self.send_to_host(host, Message::Close(serial), &[]),
        }
        Ok(())
    }

    fn send_stream(&mut self, target: usize, bytes: &[u8]) -> io::Result<()> {
        let host = self.active;
        let is_meant = |tcp: &&Tcp| tcp.host == host && tcp.target == target && tcp.is_held;
        let Some(tcp) = self.tcp.iter().find(is_meant) else {
            return Err(io::ErrorKind::NotConnected.into());
        };
        let (robot, serial) = (tcp.robot, tcp.serial);
        self.send_to_robot(robot, Message::Bytes(serial), bytes);
        Ok(())
    }

    fn disconnect(&mut self, target: usize) {
        let host = self.active;
        let is_meant = |tcp: &&mut Tcp| tcp.host == host && tcp.target == target && tcp.is_held;
        if let Some(tcp) = self.tcp.iter_mut().find(is_meant) {
            tcp.is_held = false;
            let (robot, serial) = (tcp.robot, tcp.serial);
            self.send_to_robot(robot, Message::Close(serial), &[]);
            self.forget_closed();
        }
    }

    fn send_datagram(&mut self, to: SocketAddrV4, bytes: &[u8]) -> io::Result<()> {
        let Some(from) = self.hosts.get(self.active).map(|host| host.address) else {
            return Ok(());
        };
        if let Some(robot) = self.robots.iter().position(|robot| robot.address() == *to.ip()) {
            let from = SocketAddrV4::new(from, IO_PORT);
            self.send_to_robot(robot, Message::Datagram(from, to.port()), bytes);
        }
        Ok(())
    }

    fn join_group(&mut self, group: Ipv4Addr) -> io::Result<()> {
        if let Some(host) = self.hosts.get_mut(self.active)
            && !host.groups.contains(&group)
        {
            host.groups.push(group);
        }
        Ok(())
    }

    fn leave_group(&mut self, group: Ipv4Addr) {
        if let Some(host) = self.hosts.get_mut(self.active) {
            host.groups.retain(|joined| *joined != group);
        }
    }
}
