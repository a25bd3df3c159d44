//! A segment in operation: one exchange for all robots, and whoever falls silent brought back.
//!
//! One exchange takes in what has arrived, does what is due and sends; nothing else happens between two
//! exchanges. So the cycle of the caller is the beat of the connections: see [`EnipSegment::cycle`].
//!
//! Invariants: an exchange does not wait and does not allocate; the time of the sessions is that of the
//! network, never that of the caller; a robot's connection is opened with outputs of zero, and opened again
//! with those that the caller has set then, which an engine that has seen
//! [`InputQuality::Lost`] keeps at zero.

use core::net::{Ipv4Addr, SocketAddrV4};
use std::boxed::Box;
use std::collections::VecDeque;
use std::io;
use std::vec::Vec;

use super::error::EnipError;
use super::network::{Arrival, Network, ROOM};
use super::settings::EnipSettings;
use super::statistics::{EnipStatistics, record};
use crate::bus::enip::MOST_OWED;
use crate::bus::enip::scanner::{Scanner, ScannerEvent, Target, TargetStatus, Transmit, Trouble};
use crate::cycle::{CyclicSegment, InputQuality};
use crate::time::{Duration, Instant};

/// How long the end of a segment may take: the answers to its Forward Closes.
const CLOSE_LIMIT: Duration = Duration::from_millis(500);
/// Longest time in which a robot is shown zeros before its connection is closed.
const FAREWELL: Duration = Duration::from_millis(100);
/// Arrivals that one exchange takes in at most: some, and some for each target.
const MOST_ARRIVALS: usize = 256;
const MOST_ARRIVALS_PER_TARGET: usize = 64;
/// Things that one exchange sends at most.
const MOST_SENT: usize = 64;
const MOST_SENT_PER_TARGET: usize = 16;

/// What the segment remembers about a target besides what the scanner does.
#[derive(Debug)]
struct Seat {
    address: SocketAddrV4,
    o2t_len: usize,
    t2o_len: usize,
    /// Group that its frames came to when its connection was opened first.
    group: Option<Ipv4Addr>,
    is_open: bool,
    is_running: bool,
    is_closed: bool,
    trouble: Option<Trouble>,
    /// Counters of the exchange before.
    opened: u64,
    sent: Passed,
    received: Passed,
}

/// Frames of one direction so far, and when the last one passed.
#[derive(Clone, Copy, Debug, Default)]
struct Passed {
    frames: u64,
    at: Option<Instant>,
}

/// Robots on EtherNet/IP whose inputs arrive.
#[derive(Debug)]
pub struct EnipSegment<N> {
    network: N,
    scanner: Scanner<Vec<Target>>,
    seats: Vec<Seat>,
    /// Bytes on their way in or out.
    room: Box<[u8; ROOM]>,
    /// What happened during the start.
    events: VecDeque<ScannerEvent>,
    statistics: EnipStatistics,
    /// Asked for.
    asked_cycle: Duration,
    /// Shortest interval of an open connection.
    cycle: Duration,
    /// The same moment by the clock of the caller and by that of the network.
    meeting: Option<(Instant, Instant)>,
    last_began: Option<Instant>,
    /// Groups that are joined.
    groups: Vec<Ipv4Addr>,
    /// The last group that could not be joined.
    refused_group: Option<(Ipv4Addr, io::ErrorKind)>,
}

/// A segment that could not be started, and its network.
#[derive(Debug)]
pub struct StartFailure<N> {
    /// Why.
    pub error: EnipError,
    /// The network, to try again on.
    pub network: N,
}

impl<N: Network> EnipSegment<N> {
    /// Opens the connection to every target, with outputs of zero, and returns when the inputs of all
    /// arrive.
    ///
    /// # Errors
    ///
    /// Why it cannot be done, with the network; connections that were opened are closed again. Targets that
    /// are not there yet are tried until the limit for the start; a refusal that time does not mend ends
    /// the start at once.
    pub fn start(network: N, settings: EnipSettings) -> Result<Self, StartFailure<N>> {
        let mut segment = Self::assemble(network, &settings)?;
        match segment.bring_up(settings.start_limit) {
            Ok(()) => Ok(segment),
            Err(error) => Err(StartFailure { error, network: segment.close() }),
        }
    }

    fn assemble(network: N, settings: &EnipSettings) -> Result<Self, StartFailure<N>> {
        if let Some(error) = settings.mistake() {
            return Err(StartFailure { error, network });
        }
        let mut targets = Vec::with_capacity(settings.targets.len());
        let mut seats = Vec::with_capacity(settings.targets.len());
        for (number, wanted) in settings.targets.iter().enumerate() {
            let mut connection = wanted.connection;
            connection.io_port = network.io_port();
            match Target::new(wanted.address, connection) {
                Ok(target) => targets.push(target),
                Err(mistake) => {
                    let address = wanted.address;
                    let error = EnipError::Connection { target: number, address, mistake };
                    return Err(StartFailure { error, network });
                }
            }
            seats.push(Seat {
                address: wanted.address,
                o2t_len: usize::from(connection.o2t_len),
                t2o_len: usize::from(connection.t2o_len),
                group: None,
                is_open: false,
                is_running: false,
                is_closed: false,
                trouble: None,
                opened: 0,
                sent: Passed::default(),
                received: Passed::default(),
            });
        }
        Ok(Self {
            network,
            scanner: Scanner::new(targets, settings.originator, settings.seed),
            events: VecDeque::new(),
            groups: Vec::with_capacity(seats.len()),
            seats,
            room: Box::new([0; ROOM]),
            statistics: EnipStatistics::new(),
            asked_cycle: settings.cycle,
            cycle: settings.cycle,
            meeting: None,
            last_began: None,
            refused_group: None,
        })
    }

    /// Lets the connections come up until every target's inputs arrive.
    fn bring_up(&mut self, limit: Duration) -> Result<(), EnipError> {
        let deadline = self.network.now() + limit;
        loop {
            self.step(deadline).map_err(|error| EnipError::Network(error.kind()))?;
            while let Some(event) = self.scanner.poll_event() {
                self.take_event(event)?;
                if self.events.len() == MOST_ARRIVALS {
                    self.events.pop_front();
                }
                self.events.push_back(event);
            }
            if self.seats.iter().all(|seat| seat.is_running) {
                self.follow(self.network.now());
                self.statistics = EnipStatistics::new();
                return Ok(());
            }
            if self.network.now() >= deadline {
                return Err(self.most_telling());
            }
        }
    }

    /// Remembers what an event during the start says; an end of all hope is an error.
    fn take_event(&mut self, event: ScannerEvent) -> Result<(), EnipError> {
        match event {
            ScannerEvent::Opened { target, multicast, .. } => {
                if let Some(seat) = self.seats.get_mut(target) {
                    (seat.is_open, seat.group) = (true, multicast);
                }
            }
            ScannerEvent::Running { target } => {
                if let Some(seat) = self.seats.get_mut(target) {
                    seat.is_running = true;
                }
            }
            ScannerEvent::Failed { target, trouble, retry_in } => {
                if let Some(seat) = self.seats.get_mut(target) {
                    seat.trouble = Some(trouble);
                    seat.is_running = false;
                    if retry_in.is_none() {
                        let port = self.network.io_port();
                        return Err(seat.complaint(target, port, self.refused_group));
                    }
                }
            }
            ScannerEvent::Closed { .. }
            | ScannerEvent::StreamLost { .. }
            | ScannerEvent::Answered { .. } => {}
        }
        Ok(())
    }

    /// Of the targets that are not up, what is wrong with the one that says most about it.
    fn most_telling(&self) -> EnipError {
        let port = self.network.io_port();
        let missing = self.seats.iter().enumerate().filter(|(_, seat)| !seat.is_running);
        let complaints =
            missing.map(|(target, seat)| seat.complaint(target, port, self.refused_group));
        // Of equal ones the first.
        complaints.rev().max_by_key(|error| telling(*error)).unwrap_or(EnipError::NoTarget)
    }

    /// Does what is due, then waits for one arrival until `until` or until something else is due.
    fn step(&mut self, until: Instant) -> io::Result<()> {
        let now = self.network.now();
        self.scanner.handle_timeout(now);
        self.transmit(now);
        let deadline = self.scanner.poll_timeout().map_or(until, |due| due.min(until));
        if let Some(arrival) = self.network.receive(&mut self.room[..], deadline)? {
            let now = self.network.now();
            self.take_in(now, arrival);
        }
        Ok(())
    }

    /// Hands an arrival to the scanner.
    fn take_in(&mut self, now: Instant, arrival: Arrival) {
        let bytes = |len: usize| self.room.get(..len).unwrap_or(&self.room[..]);
        match arrival {
            Arrival::Connected { target } => self.scanner.handle_connected(now, target),
            Arrival::Stream { target, len } => self.scanner.handle_stream(now, target, bytes(len)),
            Arrival::Disconnected { target } => self.scanner.handle_disconnected(now, target),
            Arrival::Datagram { from, len } => self.scanner.handle_datagram(now, from, bytes(len)),
        }
    }

    /// Sends what the scanner has to send.
    fn transmit(&mut self, now: Instant) {
        for _ in 0..MOST_SENT + MOST_SENT_PER_TARGET * self.seats.len() {
            let Some(transmit) = self.scanner.poll_transmit(now, &mut self.room[..]) else {
                return;
            };
            let bytes = |len: usize| self.room.get(..len).unwrap_or(&self.room[..]);
            match transmit {
                Transmit::Connect { target } => {
                    let Some(seat) = self.seats.get(target) else { continue };
                    if self.network.connect(target, seat.address).is_err() {
                        self.scanner.handle_disconnected(now, target);
                    }
                }
                Transmit::Stream { target, len } => {
                    if self.network.send_stream(target, bytes(len)).is_err() {
                        self.scanner.handle_disconnected(now, target);
                    }
                }
                Transmit::Disconnect { target } => self.network.disconnect(target),
                Transmit::Datagram { to, len } => {
                    let is_sent = self.network.send_datagram(to, bytes(len)).is_ok();
                    self.statistics.unsent += u64::from(!is_sent);
                }
                Transmit::JoinGroup { group } => match self.network.join_group(group) {
                    Ok(()) => self.groups.push(group),
                    Err(error) => {
                        self.refused_group = Some((group, error.kind()));
                        self.statistics.unjoined += 1;
                    }
                },
                Transmit::LeaveGroup { group } => {
                    self.groups.retain(|joined| *joined != group);
                    self.network.leave_group(group);
                }
            }
        }
    }

    /// One exchange, in the time of the network.
    fn cycle_once(&mut self) -> io::Result<()> {
        let began = self.network.now();
        if let Some(last) = self.last_began.replace(began) {
            let limit = self.asked_cycle.max(self.cycle) * 3 / 2;
            self.statistics.late += u64::from(began.saturating_duration_since(last) > limit);
        }
        let most = MOST_ARRIVALS + MOST_ARRIVALS_PER_TARGET * self.seats.len();
        let mut taken = 0;
        while let Some(arrival) = self.network.receive(&mut self.room[..], Instant::ZERO)? {
            self.take_in(began, arrival);
            taken += 1;
            if taken == most {
                self.statistics.flooded += 1;
                break;
            }
        }
        self.scanner.begin_cycle();
        self.scanner.handle_timeout(began);
        self.transmit(began);
        self.follow(began);
        let ended = self.network.now();
        self.statistics.exchanges += 1;
        record(&mut self.statistics.exchange_ns, ended.saturating_duration_since(began), 1);
        Ok(())
    }

    /// Follows frames and intervals of all targets from exchange to exchange.
    fn follow(&mut self, now: Instant) {
        let mut beat = None;
        for (target, seat) in self.seats.iter_mut().enumerate() {
            let Some(status) = self.scanner.status(target) else { continue };
            let counters = status.counters;
            if seat.opened != counters.opened {
                // The gap before the first frame of a connection is not one of its intervals.
                seat.opened = counters.opened;
                (seat.sent.at, seat.received.at) = (None, None);
            }
            seat.sent.follow(now, counters.produced, &mut self.statistics.o2t_gap_ns);
            seat.received.follow(now, counters.consumed, &mut self.statistics.t2o_gap_ns);
            if status.is_open {
                let shortest = status.o2t_api.min(status.t2o_api);
                beat = Some(beat.map_or(shortest, |beat: Duration| beat.min(shortest)));
            }
        }
        let beat = beat.unwrap_or(self.asked_cycle);
        if beat != self.cycle || self.statistics.exchanges == 0 {
            self.cycle = beat;
            self.scanner.set_early(beat.min(self.asked_cycle) / 2);
        }
    }

    /// The shortest interval of the open connections: exchanges at this beat send and receive one frame
    /// each. A target may have set another interval than was asked for.
    #[must_use]
    pub const fn cycle(&self) -> Duration {
        self.cycle
    }

    /// The oldest event that was not asked for yet, those of the start included.
    pub fn poll_event(&mut self) -> Option<ScannerEvent> {
        self.events.pop_front().or_else(|| self.scanner.poll_event())
    }

    /// What the exchanges were like.
    #[must_use]
    pub const fn statistics(&self) -> &EnipStatistics {
        &self.statistics
    }

    /// What the connection of `target` is like now.
    #[must_use]
    pub fn status(&self, target: usize) -> Option<TargetStatus> {
        self.scanner.status(target)
    }

    /// Tells `target` whether its outputs are to be acted upon (run, as at the start) or not (idle).
    pub fn set_run(&mut self, target: usize, run: bool) {
        self.scanner.set_run(target, run);
    }

    /// The network it runs on.
    #[must_use]
    pub const fn network(&self) -> &N {
        &self.network
    }

    /// The network it runs on, to reach robots in memory. Sending or receiving on it disturbs the sessions.
    pub const fn network_mut(&mut self) -> &mut N {
        &mut self.network
    }

    /// Shows every robot two frames with zeros that say idle, closes the connections and gives the network back.
    /// Takes 600 ms at most.
    pub fn close(mut self) -> N {
        let targets = self.seats.len();
        self.scanner.set_early(Duration::ZERO);
        for (target, seat) in self.seats.iter_mut().enumerate() {
            self.scanner.write_outputs(target, &std::vec![0; seat.o2t_len]);
            self.scanner.set_run(target, false);
            let status = self.scanner.status(target);
            seat.sent.frames = status.map_or(0, |status| status.counters.produced);
        }
        self.step_until(FAREWELL, Self::has_shown_zeros);
        let now = self.network.now();
        for target in 0..targets {
            self.scanner.close(now, target);
        }
        self.step_until(CLOSE_LIMIT, |segment| segment.seats.iter().all(|seat| seat.is_closed));
        self.abandon()
    }

    /// Whether every open connection has sent two frames since the outputs became zero: one may get lost, or
    /// be overtaken by what comes over TCP.
    fn has_shown_zeros(&self) -> bool {
        self.seats.iter().enumerate().all(|(target, seat)| {
            let status = self.scanner.status(target);
            status.is_none_or(|now| !now.is_open || now.counters.produced > seat.sent.frames + 1)
        })
    }

    /// Lets the sessions go on for `time`, or until all is as wished.
    fn step_until(&mut self, time: Duration, is_done: impl Fn(&Self) -> bool) {
        let deadline = self.network.now() + time;
        while !is_done(self) && self.network.now() < deadline {
            if self.step(deadline).is_err() {
                return;
            }
            while let Some(event) = self.scanner.poll_event() {
                if let ScannerEvent::Closed { target } = event
                    && let Some(seat) = self.seats.get_mut(target)
                {
                    seat.is_closed = true;
                }
            }
        }
        // What the last event left to send.
        let now = self.network.now();
        self.transmit(now);
    }

    /// Gives the network back without a word to the robots, as if this process had died: their watchdogs
    /// will notice.
    pub fn abandon(mut self) -> N {
        for target in 0..self.seats.len() {
            self.network.disconnect(target);
        }
        for group in &self.groups {
            self.network.leave_group(*group);
        }
        self.network
    }
}

impl Passed {
    /// Takes the count of this exchange and records the gaps.
    fn follow(&mut self, now: Instant, frames: u64, gaps: &mut hdrhistogram::Histogram<u64>) {
        let new = frames.saturating_sub(self.frames);
        self.frames = frames;
        if new == 0 {
            return;
        }
        if let Some(at) = self.at {
            record(gaps, now.saturating_duration_since(at), new);
        }
        self.at = Some(now);
    }
}

impl Seat {
    /// What is wrong with a target whose inputs do not arrive.
    fn complaint(
        &self,
        target: usize,
        port: u16,
        refused: Option<(Ipv4Addr, io::ErrorKind)>,
    ) -> EnipError {
        let address = self.address;
        let is_silent = matches!(self.trouble, None | Some(Trouble::TimedOut { .. }));
        if !(self.is_open && is_silent) {
            return match self.trouble {
                Some(trouble) => EnipError::Target { target, address, trouble },
                None => EnipError::NotConnected { target, address },
            };
        }
        match (self.group, refused) {
            (Some(group), Some((refused, kind))) if group == refused => {
                EnipError::Group { target, address, group, kind }
            }
            _ => EnipError::NoFrames { target, address, port },
        }
    }
}

/// How much an error says about its cause.
fn telling(error: EnipError) -> u8 {
    match error {
        EnipError::NotConnected { .. } => 0,
        EnipError::Target { trouble: Trouble::Unreachable, .. } => 1,
        EnipError::Target { trouble: Trouble::NoAnswer { .. }, .. } => 2,
        EnipError::NoFrames { .. } => 3,
        _ => 4,
    }
}

impl<N: Network> CyclicSegment for EnipSegment<N> {
    type Error = EnipError;

    fn robot_count(&self) -> usize {
        self.seats.len()
    }

    fn write_outputs(&mut self, robot: usize, outputs: &[u8]) {
        self.scanner.write_outputs(robot, outputs);
    }

    /// Takes in what has arrived since the last exchange and sends what is due. `now` may come from another
    /// clock than the network's: only the time between two exchanges counts.
    ///
    /// # Errors
    ///
    /// [`EnipError::Network`] if the sockets do not work any more. What goes wrong with a robot shows in
    /// its quality and in the events.
    fn exchange(&mut self, now: Instant) -> Result<(), EnipError> {
        let (theirs, ours) = *self.meeting.get_or_insert_with(|| (now, self.network.now()));
        self.network.advance_to(ours + now.saturating_duration_since(theirs));
        self.cycle_once().map_err(|error| EnipError::Network(error.kind()))
    }

    fn read_inputs(&self, robot: usize, inputs: &mut [u8]) -> InputQuality {
        match self.seats.get(robot) {
            Some(seat) if seat.t2o_len == inputs.len() => self.scanner.read_inputs(robot, inputs),
            _ => InputQuality::Lost,
        }
    }

    /// As many as there are frames that the connections make up for: each cycle sends one.
    fn makes_up(&self) -> u32 {
        MOST_OWED
    }
}
