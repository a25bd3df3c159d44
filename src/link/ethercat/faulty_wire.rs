//! A [`Wire`] that misbehaves on purpose: seeded, replayable faults between a main device and its
//! segment, at either end, on a real interface as well as in memory.
//!
//! Read [`WireFault`] first, then [`FaultPlan`]. Each frame that passes, in either direction, may
//! meet one fault. Frames that are held back are released by the wire's own time, so a run in
//! simulated time waits for nothing.
//!
//! Corruption is of what a receiver can notice: EtherType, lengths, and on the way back to the main
//! device also commands, indices, addresses and working counters. Everything else (payload, and
//! addresses on the way out, which a subdevice would obey) is what the checksum of each Ethernet
//! frame catches: a frame damaged there is dropped by the first receiver, and [`WireFault::Drop`]
//! is that.
//!
//! Invariants: the same plan and the same frames give the same faults; no allocation once made; a
//! frame is never held longer than [`LONGEST_DELAY`].

use std::io;
use std::prelude::v1::*;

use super::wire::{MAX_FRAME, Wire};
use crate::link::fault_plan::Draws;
use crate::time::{Duration, Instant};

/// Longest time that a frame is held back.
pub const LONGEST_DELAY: Duration = Duration::from_millis(20);
/// Longest time that a frame waits to be overtaken.
const LONGEST_REORDER: Duration = Duration::from_millis(5);
/// How long a link stays down, in ms: between these.
const LINK_DOWN_MS: core::ops::RangeInclusive<u64> = 20..=300;
/// Frames held back at the same time; what should be held beyond these passes unharmed.
const HELD_FRAMES: usize = 32;
/// Length of an Ethernet header, in bytes.
const ETHERNET_HEADER: usize = 14;

type Buffer = Box<[u8; MAX_FRAME]>;

/// One way a wire misbehaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum WireFault {
    /// The frame is lost.
    Drop,
    /// The frame arrives twice.
    Duplicate,
    /// The frame arrives up to [`LONGEST_DELAY`] late.
    Delay,
    /// The frame is overtaken by the next one in its direction, or late when none comes.
    Reorder,
    /// The frame loses its end; at least its Ethernet header remains.
    Truncate,
    /// A header field of the frame is wrong.
    Corrupt,
    /// Nothing passes for 20 to 300 ms, in both directions.
    LinkDown,
    /// The robots lose their power: the wire only says so, see [`FaultyWire::take_power_cycle`].
    PowerCycle,
}

impl WireFault {
    /// Every fault there is.
    pub const ALL: &[Self] = &[
        Self::Drop,
        Self::Duplicate,
        Self::Delay,
        Self::Reorder,
        Self::Truncate,
        Self::Corrupt,
        Self::LinkDown,
        Self::PowerCycle,
    ];

    /// Its name, as on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Drop => "drop",
            Self::Duplicate => "duplicate",
            Self::Delay => "delay",
            Self::Reorder => "reorder",
            Self::Truncate => "truncate",
            Self::Corrupt => "corrupt",
            Self::LinkDown => "link-down",
            Self::PowerCycle => "power-cycle",
        }
    }

    /// The fault of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|fault| fault.name() == name)
    }
}

impl core::fmt::Display for WireFault {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(self.name())
    }
}

/// Which faults of a wire come, and how often.
pub type FaultPlan = crate::link::fault_plan::FaultPlan<WireFault>;

/// The end of the wire at which the faults are made: it says which way a frame goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WireEnd {
    /// What is sent goes out to the subdevices, what is received comes back.
    MainDevice,
    /// What is received comes from the main device, what is sent goes back.
    Subdevices,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Direction {
    Sent,
    Received,
}

/// A frame that is held back.
struct Held {
    direction: Direction,
    release_at: Instant,
    /// Whether the next frame in its direction releases it.
    waits_for_next: bool,
    length: usize,
    buffer: Buffer,
}

/// A [`Wire`] that misbehaves by a [`FaultPlan`].
pub struct FaultyWire<W> {
    wire: W,
    faults: Faults,
}

/// All of a [`FaultyWire`] but the wire.
struct Faults {
    end: WireEnd,
    draws: Draws<WireFault>,
    injected: Option<WireFault>,
    injected_received: Option<WireFault>,
    down_until: Option<Instant>,
    /// Whether the reader was told of the link that is down.
    is_told: bool,
    power_cycle: bool,
    /// In the order in which the frames came.
    held: Vec<Held>,
    /// Buffers without a frame: as many as there are frames to hold, and one for the frame in hand.
    spare: Vec<Buffer>,
}

impl<W: Wire> FaultyWire<W> {
    /// `wire` as it misbehaves by `plan`, at the given end of it.
    #[must_use]
    pub fn new(wire: W, end: WireEnd, plan: FaultPlan) -> Self {
        let faults = Faults {
            end,
            draws: Draws::new(plan),
            injected: None,
            injected_received: None,
            down_until: None,
            is_told: false,
            power_cycle: false,
            held: Vec::with_capacity(HELD_FRAMES),
            spare: (0..=HELD_FRAMES).map(|_| Box::new([0; MAX_FRAME])).collect(),
        };
        Self { wire, faults }
    }

    /// The wire behind the faults.
    pub const fn inner(&self) -> &W {
        &self.wire
    }

    /// The wire behind the faults.
    pub const fn inner_mut(&mut self) -> &mut W {
        &mut self.wire
    }

    /// Number of faults made so far.
    #[must_use]
    pub const fn faults_made(&self) -> u32 {
        self.faults.draws.made()
    }

    /// The newest fault.
    #[must_use]
    pub const fn last_fault(&self) -> Option<WireFault> {
        self.faults.draws.last()
    }

    /// Whether no frame is held back and the link is up.
    #[must_use]
    pub fn is_quiet(&self) -> bool {
        self.faults.held.is_empty() && !self.faults.is_down(self.wire.now())
    }

    /// The next frame, in whichever direction, meets `fault`; the plan waits for it.
    pub const fn inject(&mut self, fault: WireFault) {
        self.faults.injected = Some(fault);
    }

    /// The next frame that is received meets `fault`; what is sent before it goes by the plan.
    pub const fn inject_received(&mut self, fault: WireFault) {
        self.faults.injected_received = Some(fault);
    }

    /// Whether the robots lost their power since this was asked last. Who holds the robots switches
    /// them off and on again.
    pub const fn take_power_cycle(&mut self) -> bool {
        core::mem::replace(&mut self.faults.power_cycle, false)
    }

    /// Sends what was held back and is due. What cannot be sent is lost.
    fn send_due(&mut self, now: Instant) {
        while let Some(held) = self.faults.take_due(Direction::Sent, now) {
            if let Some(frame) = held.buffer.get(..held.length) {
                let _ = self.wire.send(frame);
            }
            self.faults.spare.push(held.buffer);
        }
    }

    /// Receives and throws away until the link is up or `deadline` has passed.
    fn wait_for_link(&mut self, buffer: &mut [u8], deadline: Instant) -> io::Result<()> {
        if !core::mem::replace(&mut self.faults.is_told, true) {
            return Err(link_down());
        }
        let until = self.faults.down_until.map_or(deadline, |up| up.min(deadline));
        while self.wire.receive(buffer, until)?.is_some() {}
        Ok(())
    }
}

impl Faults {
    /// The fault that the frame in hand meets.
    fn draw(&mut self, direction: Direction) -> Option<WireFault> {
        let received = match direction {
            Direction::Received => self.injected_received.take(),
            Direction::Sent => None,
        };
        let injected = received.or_else(|| self.injected.take());
        self.draws.draw(injected)
    }

    /// Whether frames pass as if nothing stood in their way: none meets a fault, none is held back.
    fn are_none(&self) -> bool {
        self.draws.plans_none()
            && self.injected.or(self.injected_received).is_none()
            && self.held.is_empty()
            && self.down_until.is_none()
    }

    fn is_down(&self, now: Instant) -> bool {
        self.down_until.is_some_and(|until| now < until)
    }

    fn begin_link_down(&mut self, now: Instant) {
        self.down_until = Some(now + Duration::from_millis(self.draws.random.u64(LINK_DOWN_MS)));
        self.is_told = false;
        // What is on its way is lost too.
        self.spare.extend(self.held.drain(..).map(|held| held.buffer));
    }

    /// Keeps a frame until `release_at`, or until the next one passes; `false` without room for it.
    fn hold(
        &mut self,
        direction: Direction,
        frame: &[u8],
        release_at: Instant,
        waits_for_next: bool,
    ) -> bool {
        if self.held.len() >= HELD_FRAMES {
            return false;
        }
        let Some(mut buffer) = self.spare.pop() else { return false };
        let length = frame.len();
        if let Some(room) = buffer.get_mut(..length) {
            room.copy_from_slice(frame);
            self.held.push(Held { direction, release_at, waits_for_next, length, buffer });
            return true;
        }
        self.spare.push(buffer);
        false
    }

    fn take_due(&mut self, direction: Direction, now: Instant) -> Option<Held> {
        let is_due = |held: &Held| held.direction == direction && held.release_at <= now;
        self.held.iter().position(is_due).map(|index| self.held.remove(index))
    }

    /// A received frame that was held back and is due, in `buffer`. One that does not fit is lost.
    fn receive_due(&mut self, now: Instant, buffer: &mut [u8]) -> Option<usize> {
        while let Some(held) = self.take_due(Direction::Received, now) {
            let fits = match (buffer.get_mut(..held.length), held.buffer.get(..held.length)) {
                (Some(room), Some(frame)) => {
                    room.copy_from_slice(frame);
                    true
                }
                _ => false,
            };
            self.spare.push(held.buffer);
            if fits {
                return Some(held.length);
            }
        }
        None
    }

    /// When the next frame held back is due.
    fn next_due(&self) -> Option<Instant> {
        self.held.iter().map(|held| held.release_at).min()
    }

    /// What becomes of `frame` at `now`: its length if it passes, maybe changed.
    fn pass(&mut self, direction: Direction, frame: &mut [u8], now: Instant) -> Option<usize> {
        let length = frame.len();
        match self.draw(direction) {
            None => {}
            Some(WireFault::Drop) => return None,
            Some(WireFault::Duplicate) => {
                self.hold(direction, frame, now, false);
            }
            Some(WireFault::Delay) => {
                let delay_us = self.draws.random.u64(100..=LONGEST_DELAY.as_micros() as u64);
                if self.hold(direction, frame, now + Duration::from_micros(delay_us), false) {
                    return None;
                }
            }
            Some(WireFault::Reorder)
                if self.hold(direction, frame, now + LONGEST_REORDER, true) =>
            {
                return None;
            }
            Some(WireFault::Reorder) => {}
            Some(WireFault::Truncate) if length > ETHERNET_HEADER => {
                return Some(self.draws.random.usize(ETHERNET_HEADER..length));
            }
            Some(WireFault::Truncate) => {}
            Some(WireFault::Corrupt) => {
                let goes_back = match self.end {
                    WireEnd::MainDevice => direction == Direction::Received,
                    WireEnd::Subdevices => direction == Direction::Sent,
                };
                corrupt(&mut self.draws.random, frame, goes_back);
            }
            Some(WireFault::LinkDown) => {
                self.begin_link_down(now);
                return None;
            }
            Some(WireFault::PowerCycle) => {
                self.power_cycle = true;
                return None;
            }
        }
        // This frame has overtaken those that waited for it.
        for held in self.held.iter_mut().filter(|held| held.direction == direction) {
            if held.waits_for_next {
                held.waits_for_next = false;
                held.release_at = now;
            }
        }
        Some(length)
    }
}

/// What a sender or reader is told when the link is down.
fn link_down() -> io::Error {
    io::ErrorKind::NetworkDown.into()
}

/// A header field that can be made wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Field {
    EtherType,
    ProtocolType,
    TotalLength,
    DatagramLength,
    Command,
    Index,
    Address,
    WorkingCounter,
}

impl Field {
    /// What a subdevice notices.
    const OUTBOUND: [Self; 4] =
        [Self::EtherType, Self::ProtocolType, Self::TotalLength, Self::DatagramLength];
    /// What a main device notices, which knows what it sent.
    const INBOUND: [Self; 8] = [
        Self::EtherType,
        Self::ProtocolType,
        Self::TotalLength,
        Self::DatagramLength,
        Self::Command,
        Self::Index,
        Self::Address,
        Self::WorkingCounter,
    ];
}

/// Length of EtherCAT's own header, in bytes: 11 bits of length, 4 bits of protocol type.
const ETHERCAT_HEADER: usize = 2;
/// Length of a datagram's header: command, index, address (4), length and flags (2), event (2).
const DATAGRAM_HEADER: usize = 10;
/// Length of a working counter.
const WORKING_COUNTER: usize = 2;
/// The bits of a length, in its 16-bit field.
const LENGTH_BITS: u16 = 0x07FF;

/// Makes one header field of `frame` wrong; a frame too short for it gets another EtherType.
fn corrupt(random: &mut fastrand::Rng, frame: &mut [u8], goes_back: bool) {
    let fields: &[Field] = if goes_back { &Field::INBOUND } else { &Field::OUTBOUND };
    let field = random.choice(fields).copied().unwrap_or(Field::EtherType);
    let datagrams = datagrams(frame).count();
    let datagram = if datagrams == 0 { None } else { datagrams_nth(random, frame, datagrams) };
    let ethercat = ETHERNET_HEADER;
    let (at, mask) = match (field, datagram) {
        (Field::ProtocolType, _) => (ethercat, random.u16(1..=0xF) << 12),
        // More than a frame can carry, whatever it was.
        (Field::TotalLength, _) => return set_length(frame, ethercat),
        (Field::DatagramLength, Some((start, _))) => return set_length(frame, start + 6),
        (Field::Command, Some((start, _))) => (start, random.u16(1..=0xFF)),
        (Field::Index, Some((start, _))) => (start, random.u16(1..=0xFF) << 8),
        (Field::Address, Some((start, _))) => (start + 2, random.u16(1..)),
        (Field::WorkingCounter, Some((_, counter))) => (counter, random.u16(1..)),
        (_, _) => (ETHERNET_HEADER - 2, random.u16(1..)),
    };
    if let Some(bytes) = frame.get_mut(at..).and_then(|rest| rest.first_chunk_mut::<2>()) {
        *bytes = (u16::from_le_bytes(*bytes) ^ mask).to_le_bytes();
    }
}

/// Sets a length to the longest there is, longer than any frame.
fn set_length(frame: &mut [u8], at: usize) {
    if let Some(bytes) = frame.get_mut(at..).and_then(|rest| rest.first_chunk_mut::<2>()) {
        *bytes = (u16::from_le_bytes(*bytes) | LENGTH_BITS).to_le_bytes();
    }
}

fn datagrams_nth(random: &mut fastrand::Rng, frame: &[u8], count: usize) -> Option<(usize, usize)> {
    datagrams(frame).nth(random.usize(0..count))
}

/// Where each datagram of `frame` begins, and where its working counter is.
fn datagrams(frame: &[u8]) -> impl Iterator<Item = (usize, usize)> {
    let mut start = ETHERNET_HEADER + ETHERCAT_HEADER;
    core::iter::from_fn(move || {
        let length = frame.get(start + 6..)?.first_chunk::<2>()?;
        let length = usize::from(u16::from_le_bytes(*length) & LENGTH_BITS);
        let counter = start + DATAGRAM_HEADER + length;
        frame.get(counter..counter + WORKING_COUNTER)?;
        let found = (start, counter);
        start = counter + WORKING_COUNTER;
        Some(found)
    })
}

impl<W: Wire> Wire for FaultyWire<W> {
    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        if self.faults.are_none() {
            return self.wire.send(frame);
        }
        let now = self.wire.now();
        if self.faults.is_down(now) {
            return Err(link_down());
        }
        self.send_due(now);
        let Some(mut buffer) = self.faults.spare.pop() else { return self.wire.send(frame) };
        let mut sent = Ok(());
        if let Some(copy) = buffer.get_mut(..frame.len()) {
            copy.copy_from_slice(frame);
            if let Some(length) = self.faults.pass(Direction::Sent, copy, now) {
                sent = copy.get(..length).map_or(Ok(()), |copy| self.wire.send(copy));
            }
        }
        self.faults.spare.push(buffer);
        self.send_due(now);
        sent
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> io::Result<Option<usize>> {
        if self.faults.are_none() {
            return self.wire.receive(buffer, deadline);
        }
        loop {
            let now = self.wire.now();
            if self.faults.is_down(now) {
                self.wait_for_link(buffer, deadline)?;
                if self.faults.is_down(self.wire.now()) {
                    return Ok(None);
                }
                continue;
            }
            self.send_due(now);
            if let Some(length) = self.faults.receive_due(now, buffer) {
                return Ok(Some(length));
            }
            let until = self.faults.next_due().map_or(deadline, |due| due.min(deadline));
            match self.wire.receive(buffer, until)? {
                Some(length) => {
                    let now = self.wire.now();
                    let frame = buffer.get_mut(..length);
                    let passed =
                        frame.and_then(|frame| self.faults.pass(Direction::Received, frame, now));
                    if passed.is_some() {
                        return Ok(passed);
                    }
                }
                // A wire may return early; what is held back has its time in the next call then.
                None if until >= deadline || self.wire.now() < until => return Ok(None),
                None => {}
            }
        }
    }

    fn receive_now(&mut self, buffer: &mut [u8]) -> io::Result<Option<usize>> {
        if self.faults.are_none() {
            return self.wire.receive_now(buffer);
        }
        self.receive(buffer, self.wire.now())
    }

    fn receive_next(&mut self, buffer: &mut [u8], deadline: Instant) -> io::Result<Option<usize>> {
        if self.faults.are_none() {
            return self.wire.receive_next(buffer, deadline);
        }
        self.receive(buffer, deadline)
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

#[cfg(test)]
mod tests;
