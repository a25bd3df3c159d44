//! A [`Network`] that misbehaves on purpose: seeded, replayable faults between a scanner and its targets.
//!
//! Read [`NetworkFault`] first, then [`FaultPlan`]. Each class 1 frame that passes, in either direction, may
//! meet one fault. What is held back is released by the network's own time, so a run in simulated time waits
//! for nothing.
//!
//! TCP is what it is on a bad network: its bytes are never lost or doubled, but they wait while nothing
//! passes, and a connection may be cut or refused. Corruption is left out: the checksums of Ethernet and UDP
//! make a loss of it.
//!
//! Invariants: the same plan and the same messages give the same faults; a frame is never held longer than
//! [`LONGEST_DELAY`]; once its buffers were used, nothing is allocated while frames are exchanged.

use core::net::{Ipv4Addr, SocketAddrV4};
use core::ops::RangeInclusive;
use std::collections::VecDeque;
use std::io;
use std::vec::Vec;

use super::network::{Arrival, Network};
use crate::link::fault_plan::Draws;
use crate::time::{Duration, Instant};

/// Longest time that a frame is held back.
pub const LONGEST_DELAY: Duration = Duration::from_millis(20);
/// Longest time that a frame waits to be overtaken.
const LONGEST_REORDER: Duration = Duration::from_millis(15);
/// How long a direction is silent, in ms: between these.
const SILENCE_MS: RangeInclusive<u64> = 20..=2_000;
/// How long TCP connections are refused, in ms: between these.
const REFUSAL_MS: RangeInclusive<u64> = 20..=2_000;
/// Frames held back at the same time; what should be held beyond these passes unharmed.
const HELD_FRAMES: usize = 32;
/// TCP messages held back at the same time; beyond these the connection breaks.
const HELD_STREAMS: usize = 256;

/// Which way a message goes, as the scanner sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Direction {
    /// To the targets.
    Sent,
    /// To the scanner.
    Received,
}

/// One way a network misbehaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NetworkFault {
    /// The frame is lost.
    Drop,
    /// The frame arrives twice.
    Duplicate,
    /// The frame arrives up to [`LONGEST_DELAY`] late.
    Delay,
    /// The frame is overtaken by the next one in its direction, or late when none comes.
    Reorder,
    /// Nothing passes in the direction of the frame for 20 ms to 2 s.
    Silence,
    /// Every TCP connection is cut, while frames go on.
    StreamDrop,
    /// Every TCP connection is cut, and none can be made for 20 ms to 2 s.
    StreamRefuse,
    /// The robots lose their power: the network only says so, see [`FaultyNetwork::take_power_cycle`].
    PowerCycle,
}

impl NetworkFault {
    /// Every fault there is.
    pub const ALL: &[Self] = &[
        Self::Drop,
        Self::Duplicate,
        Self::Delay,
        Self::Reorder,
        Self::Silence,
        Self::StreamDrop,
        Self::StreamRefuse,
        Self::PowerCycle,
    ];

    /// Its name, as on a command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Drop => "drop",
            Self::Duplicate => "duplicate",
            Self::Delay => "delay",
            Self::Reorder => "reorder",
            Self::Silence => "silence",
            Self::StreamDrop => "stream-drop",
            Self::StreamRefuse => "stream-refuse",
            Self::PowerCycle => "power-cycle",
        }
    }

    /// The fault of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|fault| fault.name() == name)
    }
}

impl core::fmt::Display for NetworkFault {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(self.name())
    }
}

/// Which faults of a network come, and how often.
pub type FaultPlan = crate::link::fault_plan::FaultPlan<NetworkFault>;

/// What a direction does besides single faults.
#[derive(Clone, Copy, Debug, Default)]
struct Way {
    /// Nothing passes until somebody says so.
    is_cut: bool,
    /// Nothing passes until then.
    silent_until: Option<Instant>,
    /// The next frame meets this.
    injected: Option<NetworkFault>,
}

impl Way {
    fn is_silent(&self, now: Instant) -> bool {
        self.is_cut || self.silent_until.is_some_and(|until| now < until)
    }
}

/// A frame that is held back: where it goes or whence it comes.
struct HeldFrame {
    direction: Direction,
    release_at: Instant,
    /// Whether the next frame in its direction releases it.
    waits_for_next: bool,
    peer: SocketAddrV4,
    bytes: Vec<u8>,
}

/// A TCP message that waits until its direction is heard again.
enum HeldStream {
    Connect { target: usize, address: SocketAddrV4 },
    Sent { target: usize, bytes: Vec<u8> },
    Connected { target: usize },
    Received { target: usize, bytes: Vec<u8> },
    Disconnected { target: usize },
}

impl HeldStream {
    const fn target(&self) -> usize {
        match self {
            Self::Connect { target, .. }
            | Self::Sent { target, .. }
            | Self::Connected { target }
            | Self::Received { target, .. }
            | Self::Disconnected { target } => *target,
        }
    }
}

/// A [`Network`] that misbehaves by a [`FaultPlan`].
pub struct FaultyNetwork<N> {
    network: N,
    faults: Faults,
}

/// All of a [`FaultyNetwork`] but the network.
struct Faults {
    draws: Draws<NetworkFault>,
    sent: Way,
    received: Way,
    /// Whether sending fails: the scanner's own cable is out, and it is told.
    is_unplugged: bool,
    refuses_until: Option<Instant>,
    power_cycle: bool,
    /// In the order in which the frames came.
    frames: Vec<HeldFrame>,
    /// In the order in which the messages came.
    sent_streams: VecDeque<HeldStream>,
    received_streams: VecDeque<HeldStream>,
    /// TCP connections that the scanner has or waits for.
    open: Vec<usize>,
    spare: Vec<Vec<u8>>,
}

impl<N: Network> FaultyNetwork<N> {
    /// `network` as it misbehaves by `plan`.
    #[must_use]
    pub fn new(network: N, plan: FaultPlan) -> Self {
        let faults = Faults {
            draws: Draws::new(plan),
            sent: Way::default(),
            received: Way::default(),
            is_unplugged: false,
            refuses_until: None,
            power_cycle: false,
            frames: Vec::with_capacity(HELD_FRAMES),
            sent_streams: VecDeque::new(),
            received_streams: VecDeque::new(),
            open: Vec::new(),
            spare: Vec::with_capacity(HELD_FRAMES + 1),
        };
        Self { network, faults }
    }

    /// The network behind the faults.
    pub const fn inner(&self) -> &N {
        &self.network
    }

    /// The network behind the faults.
    pub const fn inner_mut(&mut self) -> &mut N {
        &mut self.network
    }

    /// Number of faults made so far.
    #[must_use]
    pub const fn faults_made(&self) -> u32 {
        self.faults.draws.made()
    }

    /// The newest fault.
    #[must_use]
    pub const fn last_fault(&self) -> Option<NetworkFault> {
        self.faults.draws.last()
    }

    /// Whether nothing is held back, nothing is silent and nothing is refused.
    #[must_use]
    pub fn is_quiet(&self) -> bool {
        let now = self.network.now();
        let faults = &self.faults;
        faults.frames.is_empty()
            && faults.sent_streams.is_empty()
            && faults.received_streams.is_empty()
            && !faults.sent.is_silent(now)
            && !faults.received.is_silent(now)
            && !faults.is_refusing(now)
    }

    /// The next frame in `direction` meets `fault`; the plan waits for it.
    pub const fn inject(&mut self, direction: Direction, fault: NetworkFault) {
        match direction {
            Direction::Sent => self.faults.sent.injected = Some(fault),
            Direction::Received => self.faults.received.injected = Some(fault),
        }
    }

    /// Lets nothing pass in `direction` until this is taken back.
    pub fn cut(&mut self, direction: Direction, is_cut: bool) {
        self.faults.way(direction).is_cut = is_cut;
    }

    /// Pulls the cable out of the scanner's machine: nothing passes, and sending says so.
    pub const fn unplug(&mut self) {
        self.set_plugged(false);
    }

    /// Puts the cable back.
    pub const fn plug(&mut self) {
        self.set_plugged(true);
    }

    const fn set_plugged(&mut self, is_plugged: bool) {
        self.faults.is_unplugged = !is_plugged;
        self.faults.sent.is_cut = !is_plugged;
        self.faults.received.is_cut = !is_plugged;
    }

    /// Whether the robots lost their power since this was asked last. Who holds the robots switches them off
    /// and on again.
    pub const fn take_power_cycle(&mut self) -> bool {
        core::mem::replace(&mut self.faults.power_cycle, false)
    }

    /// Sends what was held back and may go. What cannot be sent is lost.
    fn send_held(&mut self) {
        let now = self.network.now();
        if self.faults.sent.is_silent(now) {
            return;
        }
        while let Some(held) = self.faults.sent_streams.pop_front() {
            let (target, sent) = match held {
                HeldStream::Connect { target, address } => {
                    (target, self.network.connect(target, address))
                }
                HeldStream::Sent { target, bytes } => {
                    let sent = self.network.send_stream(target, &bytes);
                    self.faults.recycle(bytes);
                    (target, sent)
                }
                _ => continue,
            };
            if sent.is_err() {
                self.faults.break_stream(target);
            }
        }
        while let Some(held) = self.faults.take_due(Direction::Sent, now) {
            let _ = self.network.send_datagram(held.peer, &held.bytes);
            self.faults.recycle(held.bytes);
        }
    }

    /// Cuts every TCP connection.
    fn drop_streams(&mut self) {
        while let Some(target) = self.faults.open.pop() {
            self.network.disconnect(target);
            self.faults.forget_streams(target);
            self.faults.received_streams.push_back(HeldStream::Disconnected { target });
        }
    }

    /// What a fault does that concerns more than its frame.
    fn begin(&mut self, fault: NetworkFault, direction: Direction) {
        let now = self.network.now();
        match fault {
            NetworkFault::Silence => {
                let until = now + Duration::from_millis(self.faults.draws.random.u64(SILENCE_MS));
                self.faults.way(direction).silent_until = Some(until);
            }
            NetworkFault::StreamDrop => self.drop_streams(),
            NetworkFault::StreamRefuse => {
                self.drop_streams();
                let until = now + Duration::from_millis(self.faults.draws.random.u64(REFUSAL_MS));
                self.faults.refuses_until = Some(until);
            }
            NetworkFault::PowerCycle => self.faults.power_cycle = true,
            _ => {}
        }
    }

    /// A frame was received: how many of its bytes are in `room` after its fault, if any.
    fn pass_received(
        &mut self,
        from: SocketAddrV4,
        len: usize,
        room: &mut [u8],
    ) -> Option<Arrival> {
        let now = self.network.now();
        let bytes = room.get(..len).unwrap_or(&[]);
        if self.faults.received.is_silent(now) {
            return None;
        }
        let passes = Some(Arrival::Datagram { from, len });
        let Some(fault) = self.faults.draw(Direction::Received) else {
            self.faults.release_overtaken(Direction::Received, now);
            return passes;
        };
        self.begin(fault, Direction::Received);
        let is_held = match fault {
            NetworkFault::Drop | NetworkFault::Silence => return None,
            NetworkFault::Duplicate => {
                self.faults.hold(Direction::Received, from, bytes, now, false);
                false
            }
            NetworkFault::Delay => {
                let release_at = now + self.faults.delay();
                self.faults.hold(Direction::Received, from, bytes, release_at, false)
            }
            NetworkFault::Reorder => {
                let release_at = now + LONGEST_REORDER;
                self.faults.hold(Direction::Received, from, bytes, release_at, true)
            }
            _ => false,
        };
        if is_held { None } else { passes }
    }

    /// A TCP message that waited and may be told now.
    fn receive_held_stream(&mut self, now: Instant, room: &mut [u8]) -> Option<Arrival> {
        // That a connection was cut is known at this end, whatever the network does.
        let is_silent = self.faults.received.is_silent(now);
        let is_known = |held: &HeldStream| matches!(held, HeldStream::Disconnected { .. });
        let front = self.faults.received_streams.front()?;
        if is_silent && !is_known(front) {
            return None;
        }
        match self.faults.received_streams.pop_front()? {
            HeldStream::Connected { target } => Some(Arrival::Connected { target }),
            HeldStream::Disconnected { target } => Some(Arrival::Disconnected { target }),
            HeldStream::Received { target, bytes } => {
                let len = bytes.len().min(room.len());
                room.iter_mut().zip(&bytes).for_each(|(room, byte)| *room = *byte);
                self.faults.recycle(bytes);
                Some(Arrival::Stream { target, len })
            }
            HeldStream::Connect { .. } | HeldStream::Sent { .. } => None,
        }
    }

    /// A TCP message that arrived: told now, or kept while its direction is silent.
    fn pass_stream(&mut self, arrival: Arrival, room: &[u8]) -> Option<Arrival> {
        let now = self.network.now();
        if let Arrival::Disconnected { target } = arrival {
            self.faults.open.retain(|open| *open != target);
        }
        // Behind what waits already, so that the order stays.
        if !self.faults.received.is_silent(now) && self.faults.received_streams.is_empty() {
            return Some(arrival);
        }
        let held = match arrival {
            Arrival::Connected { target } => HeldStream::Connected { target },
            Arrival::Disconnected { target } => HeldStream::Disconnected { target },
            Arrival::Stream { target, len } => {
                let bytes = self.faults.buffer(room.get(..len).unwrap_or(&[]));
                HeldStream::Received { target, bytes }
            }
            Arrival::Datagram { .. } => return Some(arrival),
        };
        let target = held.target();
        if self.faults.received_streams.len() < HELD_STREAMS {
            self.faults.received_streams.push_back(held);
        } else {
            self.network.disconnect(target);
            self.faults.break_stream(target);
        }
        None
    }
}

impl Faults {
    const fn way(&mut self, direction: Direction) -> &mut Way {
        match direction {
            Direction::Sent => &mut self.sent,
            Direction::Received => &mut self.received,
        }
    }

    /// The fault that the frame in hand meets.
    fn draw(&mut self, direction: Direction) -> Option<NetworkFault> {
        let injected = self.way(direction).injected.take();
        self.draws.draw(injected)
    }

    fn delay(&mut self) -> Duration {
        let longest = LONGEST_DELAY.as_micros() as u64;
        Duration::from_micros(self.draws.random.u64(1..=longest))
    }

    fn is_refusing(&self, now: Instant) -> bool {
        self.refuses_until.is_some_and(|until| now < until)
    }

    fn buffer(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut buffer = self.spare.pop().unwrap_or_default();
        buffer.clear();
        buffer.extend_from_slice(bytes);
        buffer
    }

    fn recycle(&mut self, buffer: Vec<u8>) {
        if self.spare.len() < self.spare.capacity() {
            self.spare.push(buffer);
        }
    }

    /// Keeps a frame until `release_at`, or until the next one passes; `false` without room for it.
    fn hold(
        &mut self,
        direction: Direction,
        peer: SocketAddrV4,
        bytes: &[u8],
        release_at: Instant,
        waits_for_next: bool,
    ) -> bool {
        if self.frames.len() >= HELD_FRAMES {
            return false;
        }
        let bytes = self.buffer(bytes);
        self.frames.push(HeldFrame { direction, release_at, waits_for_next, peer, bytes });
        true
    }

    /// A frame passed: what waited to be overtaken goes now.
    fn release_overtaken(&mut self, direction: Direction, now: Instant) {
        let waiting = self.frames.iter_mut().filter(|held| held.direction == direction);
        for held in waiting.filter(|held| held.waits_for_next) {
            held.release_at = now;
        }
    }

    fn take_due(&mut self, direction: Direction, now: Instant) -> Option<HeldFrame> {
        let is_due = |held: &HeldFrame| held.direction == direction && held.release_at <= now;
        self.frames.iter().position(is_due).map(|index| self.frames.remove(index))
    }

    /// A received frame that was held back and is due, in `room`. One that does not fit is cut.
    fn receive_due(&mut self, now: Instant, room: &mut [u8]) -> Option<Arrival> {
        while let Some(held) = self.take_due(Direction::Received, now) {
            let len = held.bytes.len().min(room.len());
            room.iter_mut().zip(&held.bytes).for_each(|(room, byte)| *room = *byte);
            let from = held.peer;
            self.recycle(held.bytes);
            if !self.received.is_silent(now) {
                return Some(Arrival::Datagram { from, len });
            }
        }
        None
    }

    /// When the next thing is released that waits here, after `now`.
    fn next_release(&self, now: Instant) -> Option<Instant> {
        let frames = self.frames.iter().map(|held| held.release_at);
        let ways = [self.sent, self.received].into_iter().filter_map(|way| way.silent_until);
        frames.chain(ways.filter(|until| *until > now)).min()
    }

    /// Drops what waits of a TCP connection.
    fn forget_streams(&mut self, target: usize) {
        self.sent_streams.retain(|held| held.target() != target);
        self.received_streams.retain(|held| held.target() != target);
    }

    /// A TCP connection is no more, and the scanner will be told.
    fn break_stream(&mut self, target: usize) {
        self.open.retain(|open| *open != target);
        self.forget_streams(target);
        self.received_streams.push_back(HeldStream::Disconnected { target });
    }
}

impl<N: Network> Network for FaultyNetwork<N> {
    fn now(&self) -> Instant {
        self.network.now()
    }

    fn io_port(&self) -> u16 {
        self.network.io_port()
    }

    fn advance_to(&mut self, now: Instant) {
        // Bounded: each turn passes the release of a held frame, or the end of a silence.
        while let Some(release) = self.faults.next_release(self.network.now()) {
            if release > now || self.network.now() >= now {
                break;
            }
            self.network.advance_to(release);
            let before = self.faults.frames.len();
            self.send_held();
            if self.faults.frames.len() == before {
                // What is left waits for somebody to receive it.
                break;
            }
        }
        self.network.advance_to(now);
        self.send_held();
    }

    fn receive(&mut self, room: &mut [u8], deadline: Instant) -> io::Result<Option<Arrival>> {
        loop {
            self.send_held();
            let now = self.network.now();
            if let Some(arrival) = self.receive_held_stream(now, room) {
                return Ok(Some(arrival));
            }
            if let Some(arrival) = self.faults.receive_due(now, room) {
                return Ok(Some(arrival));
            }
            let release = self.faults.next_release(now).filter(|release| *release > now);
            let until = release.map_or(deadline, |release| release.min(deadline));
            let passed = match self.network.receive(room, until)? {
                Some(Arrival::Datagram { from, len }) => self.pass_received(from, len, room),
                Some(arrival) => self.pass_stream(arrival, room),
                None if until >= deadline => return Ok(None),
                None => None,
            };
            if passed.is_some() {
                return Ok(passed);
            }
        }
    }

    fn connect(&mut self, target: usize, address: SocketAddrV4) -> io::Result<()> {
        self.disconnect(target);
        let now = self.network.now();
        if self.faults.is_refusing(now) {
            self.faults.received_streams.push_back(HeldStream::Disconnected { target });
            return Ok(());
        }
        self.faults.open.push(target);
        if self.faults.sent.is_silent(now) {
            self.faults.sent_streams.push_back(HeldStream::Connect { target, address });
            return Ok(());
        }
        self.network.connect(target, address)
    }

    fn send_stream(&mut self, target: usize, bytes: &[u8]) -> io::Result<()> {
        if !self.faults.open.contains(&target) {
            return Err(io::ErrorKind::NotConnected.into());
        }
        let now = self.network.now();
        if !self.faults.sent.is_silent(now) {
            return self.network.send_stream(target, bytes);
        }
        if self.faults.sent_streams.len() >= HELD_STREAMS {
            self.disconnect(target);
            return Err(io::ErrorKind::OutOfMemory.into());
        }
        let bytes = self.faults.buffer(bytes);
        self.faults.sent_streams.push_back(HeldStream::Sent { target, bytes });
        Ok(())
    }

    fn disconnect(&mut self, target: usize) {
        self.faults.open.retain(|open| *open != target);
        self.faults.forget_streams(target);
        self.network.disconnect(target);
    }

    fn send_datagram(&mut self, to: SocketAddrV4, bytes: &[u8]) -> io::Result<()> {
        let now = self.network.now();
        if self.faults.is_unplugged {
            return Err(io::ErrorKind::NetworkDown.into());
        }
        if self.faults.sent.is_silent(now) {
            return Ok(());
        }
        let Some(fault) = self.faults.draw(Direction::Sent) else {
            let sent = self.network.send_datagram(to, bytes);
            self.faults.release_overtaken(Direction::Sent, now);
            self.send_held();
            return sent;
        };
        self.begin(fault, Direction::Sent);
        match fault {
            NetworkFault::Drop | NetworkFault::Silence => return Ok(()),
            NetworkFault::Duplicate => self.network.send_datagram(to, bytes)?,
            NetworkFault::Delay => {
                let release_at = now + self.faults.delay();
                if self.faults.hold(Direction::Sent, to, bytes, release_at, false) {
                    return Ok(());
                }
            }
            NetworkFault::Reorder => {
                let release_at = now + LONGEST_REORDER;
                if self.faults.hold(Direction::Sent, to, bytes, release_at, true) {
                    return Ok(());
                }
            }
            _ => {}
        }
        self.network.send_datagram(to, bytes)
    }

    fn join_group(&mut self, group: Ipv4Addr) -> io::Result<()> {
        self.network.join_group(group)
    }

    fn leave_group(&mut self, group: Ipv4Addr) {
        self.network.leave_group(group);
    }
}
