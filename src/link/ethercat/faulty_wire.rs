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
        let Faults { draws, injected, injected_received, .. } = &self.faults;
        let is_perfect = draws.plans_none() && injected.or(*injected_received).is_none();
        if is_perfect && self.is_quiet() {
            return self.wire.receive_now(buffer);
        }
        self.receive(buffer, self.wire.now())
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
mod tests {
    use std::collections::VecDeque;

    use super::*;

    /// Returns what is sent; waiting moves its clock.
    #[derive(Default)]
    struct Echo {
        now: Instant,
        frames: VecDeque<Vec<u8>>,
    }

    impl Wire for Echo {
        fn send(&mut self, frame: &[u8]) -> io::Result<()> {
            self.frames.push_back(frame.to_vec());
            Ok(())
        }

        fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> io::Result<Option<usize>> {
            let Some(frame) = self.frames.pop_front() else {
                self.now = self.now.max(deadline);
                return Ok(None);
            };
            buffer[..frame.len()].copy_from_slice(&frame);
            Ok(Some(frame.len()))
        }

        fn now(&self) -> Instant {
            self.now
        }

        fn pause_until(&mut self, deadline: Instant) {
            self.now = self.now.max(deadline);
        }
    }

    /// Two datagrams: BRD of 1 byte and LRW of 4, told apart by `index`.
    fn frame(index: u8) -> Vec<u8> {
        let mut frame = vec![0xFF; 12];
        frame.extend([0x88, 0xA4, 13 + 16, 0x10]);
        frame.extend([7, index, 0, 0, 0x30, 0x01, 1, 0x80, 0, 0, 0xAA, 1, 0]);
        frame.extend([12, index, 0, 0, 0, 0, 4, 0, 0, 0, 1, 2, 3, 4, 3, 0]);
        frame
    }

    fn wire(plan: FaultPlan) -> FaultyWire<Echo> {
        FaultyWire::new(Echo::default(), WireEnd::MainDevice, plan)
    }

    fn receive(wire: &mut FaultyWire<Echo>, wait_ms: u64) -> Option<Vec<u8>> {
        let deadline = wire.now() + Duration::from_millis(wait_ms);
        let mut buffer = [0; MAX_FRAME];
        let length = wire.receive(&mut buffer, deadline).expect("the link is up")?;
        Some(buffer[..length].to_vec())
    }

    /// What comes back of one frame sent while the first frame meets `fault`.
    fn after(fault: WireFault) -> FaultyWire<Echo> {
        let mut wire = wire(FaultPlan::NONE);
        wire.inject(fault);
        wire.send(&frame(1)).expect("sent");
        assert_eq!((wire.faults_made(), wire.last_fault()), (1, Some(fault)));
        wire
    }

    #[test]
    fn a_perfect_wire_returns_what_was_sent() {
        let mut wire = wire(FaultPlan::NONE);
        for index in 0..200 {
            wire.send(&frame(index)).expect("sent");
            assert_eq!(receive(&mut wire, 1), Some(frame(index)));
        }
        assert_eq!((wire.faults_made(), wire.is_quiet()), (0, true));
    }

    #[test]
    fn a_dropped_frame_is_gone_and_a_doubled_one_comes_twice() {
        let mut dropped = after(WireFault::Drop);
        assert_eq!(receive(&mut dropped, 1_000), None);
        let mut doubled = after(WireFault::Duplicate);
        assert_eq!(receive(&mut doubled, 0), Some(frame(1)));
        assert_eq!(receive(&mut doubled, 0), Some(frame(1)));
        assert_eq!(receive(&mut doubled, 1_000), None);
    }

    #[test]
    fn a_fault_of_what_is_received_leaves_what_is_sent_alone() {
        let mut wire = FaultyWire::new(Echo::default(), WireEnd::MainDevice, FaultPlan::NONE);
        wire.inject_received(WireFault::Drop);
        wire.send(&frame(1)).unwrap();
        assert_eq!((wire.faults_made(), wire.inner().frames.len()), (0, 1));
        assert_eq!(receive(&mut wire, 1_000), None);
        assert_eq!(wire.faults_made(), 1);
    }

    #[test]
    fn a_delayed_frame_comes_by_time_alone() {
        let mut wire = after(WireFault::Delay);
        assert_eq!(receive(&mut wire, 0), None);
        assert!(!wire.is_quiet());
        assert_eq!(receive(&mut wire, 1_000), Some(frame(1)));
        assert!(wire.now() > Instant::ZERO && wire.now() <= Instant::ZERO + LONGEST_DELAY);
        assert!(wire.is_quiet());
    }

    #[test]
    fn an_overtaken_frame_comes_behind_the_next_or_after_a_while() {
        let mut wire = after(WireFault::Reorder);
        wire.send(&frame(2)).expect("sent");
        assert_eq!(receive(&mut wire, 0), Some(frame(2)));
        assert_eq!(receive(&mut wire, 0), Some(frame(1)));
        let mut alone = after(WireFault::Reorder);
        assert_eq!(receive(&mut alone, 100), Some(frame(1)));
        assert_eq!(alone.now(), Instant::ZERO + LONGEST_REORDER);
    }

    #[test]
    fn received_frames_meet_faults_too() {
        let mut wire = wire(FaultPlan::NONE);
        wire.send(&frame(1)).expect("sent");
        wire.send(&frame(2)).expect("sent");
        wire.inject(WireFault::Reorder);
        assert_eq!(receive(&mut wire, 0), Some(frame(2)));
        assert_eq!(receive(&mut wire, 0), Some(frame(1)));
    }

    #[test]
    fn a_truncated_frame_keeps_its_ethernet_header() {
        for _ in 0..50 {
            let mut wire = after(WireFault::Truncate);
            let short = receive(&mut wire, 0).expect("it comes");
            assert!((ETHERNET_HEADER..frame(1).len()).contains(&short.len()));
            assert_eq!(short, frame(1)[..short.len()]);
        }
    }

    #[test]
    fn a_link_down_is_told_once_and_ends_by_itself() {
        let mut wire = after(WireFault::LinkDown);
        let mut buffer = [0; MAX_FRAME];
        let error = wire.receive(&mut buffer, Instant::from_millis(1)).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::NetworkDown);
        assert_eq!(wire.send(&frame(2)).unwrap_err().kind(), io::ErrorKind::NetworkDown);
        assert_eq!(receive(&mut wire, 10), None);
        assert_eq!(receive(&mut wire, 1_000), None);
        wire.send(&frame(3)).expect("the link is up");
        assert_eq!(receive(&mut wire, 0), Some(frame(3)));
    }

    #[test]
    fn a_power_cycle_is_said_once() {
        let mut wire = after(WireFault::PowerCycle);
        assert!(wire.take_power_cycle());
        assert!(!wire.take_power_cycle());
        assert_eq!(receive(&mut wire, 10), None);
    }

    /// Which bytes differ between `frame(1)` and what 2,000 corruptions made of it.
    fn corrupted_places(goes_back: bool) -> Vec<usize> {
        let mut random = fastrand::Rng::with_seed(7);
        let mut places = Vec::new();
        for _ in 0..2_000 {
            let mut bytes = frame(1);
            corrupt(&mut random, &mut bytes, goes_back);
            assert_ne!(bytes, frame(1), "a corruption changes something");
            places.extend((0..bytes.len()).filter(|at| bytes[*at] != frame(1)[*at]));
        }
        places.sort_unstable();
        places.dedup();
        places
    }

    #[test]
    fn corruption_hits_what_the_receiver_can_notice() {
        // EtherType, length and protocol type, and the length of either datagram.
        assert_eq!(corrupted_places(false), [12, 13, 14, 15, 22, 23, 35, 36]);
        // Beside them command, index, 16 bits of address and the working counter of both.
        assert_eq!(
            corrupted_places(true),
            [12, 13, 14, 15, 16, 17, 18, 19, 22, 23, 27, 28, 29, 30, 31, 32, 35, 36, 43, 44]
        );
    }

    #[test]
    fn a_frame_without_datagrams_is_corrupted_in_its_header() {
        let mut random = fastrand::Rng::with_seed(7);
        for length in 0..frame(1).len() {
            let mut bytes = frame(1)[..length].to_vec();
            corrupt(&mut random, &mut bytes, true);
            assert_eq!(bytes.len(), length);
        }
    }

    fn run(seed: u64, limit: Option<u32>) -> (Vec<Option<Vec<u8>>>, Vec<WireFault>) {
        let chances = WireFault::ALL.iter().map(|fault| (*fault, 20)).collect();
        let mut wire = wire(FaultPlan { chances, seed, limit });
        let mut faults = Vec::new();
        let came = (0..2_000u32)
            .map(|index| {
                let made = wire.faults_made();
                let _ = wire.send(&frame(index as u8));
                let deadline = wire.now() + Duration::from_millis(1);
                let mut buffer = [0; MAX_FRAME];
                let received = wire.receive(&mut buffer, deadline).ok().flatten();
                if wire.faults_made() > made {
                    faults.extend(wire.last_fault());
                }
                received.map(|length| buffer[..length].to_vec())
            })
            .collect();
        (came, faults)
    }

    #[test]
    fn the_same_seed_gives_the_same_faults() {
        assert_eq!(run(3, None), run(3, None));
        assert_ne!(run(3, None).1, run(4, None).1);
        for fault in WireFault::ALL {
            assert!(run(3, None).1.contains(fault), "{fault}");
        }
    }

    #[test]
    fn after_the_last_fault_of_a_plan_the_wire_is_perfect() {
        let (came, faults) = run(3, Some(10));
        assert!((5..=10).contains(&faults.len()), "{faults:?}");
        assert!(came.iter().rev().take(500).all(Option::is_some));
    }

    #[test]
    fn more_frames_than_can_be_held_pass() {
        let plan = FaultPlan { chances: vec![(WireFault::Delay, 1000)], seed: 1, limit: None };
        let mut wire = wire(plan);
        for index in 0..100 {
            wire.send(&frame(index)).expect("sent");
        }
        assert_eq!(wire.inner().frames.len(), 100 - HELD_FRAMES);
    }

    #[test]
    fn every_fault_has_a_name_of_its_own() {
        for fault in WireFault::ALL {
            assert_eq!(WireFault::from_name(fault.name()), Some(*fault));
        }
        assert_eq!(WireFault::from_name("melt"), None);
    }
}
