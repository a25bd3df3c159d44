//! The robot's end of both ports, for one robot.
//!
//! Read [`ServerSession`] first. A link accepts connections and moves bytes; the session decides who
//! controls, cuts lines, gives them to the [`TextDevice`] and keeps what it says for those who are
//! connected.
//!
//! A peer that does not read: messages are kept up to the size of the outbox, then its connection ends
//! ([`CloseReason::Overfull`]). A message is never torn nor left out silently, and nobody else waits.
//! Source: choice; the manual says that connections may be dropped under load (PM L465).
//!
//! A peer that reads must not be taken for one: whenever an outbox has become half full, the session
//! stops taking messages from the robot and says so, so that the link sends first. Whose outbox is
//! still half full when it is called again holds nobody up.

use core::fmt;

use super::lines::{Line, LineSplitter};
use super::outbox::Outbox;
use crate::text_device::{LineProblem, TextDevice};
use crate::time::Instant;

/// What the second control connection is told before it is closed. Source: PM Table 1.
pub const ANOTHER_USER: &[u8] =
    concat!("[3001]", "[Another user is already connected, closing connection.]\0").as_bytes();

/// What a monitoring connection is told for which there is no place, before it is closed: the code of a
/// refused connection with words of its own.
///
/// Source: choice. The manual has no limit and no message.
pub const TOO_MANY_MONITORS: &[u8] =
    concat!("[3001]", "[Too many monitoring connections, closing connection.]\0").as_bytes();

/// Messages that are taken from the robot at once; any more wait for the next call.
const AT_ONCE: usize = 4096;
/// Calls in which a robot that stops talking has been heard out.
const CALLS: usize = 64;

/// One connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Peer {
    /// The one that controls.
    Control,
    /// One that listens, with its place.
    Monitor(usize),
}

/// Why the session ends a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CloseReason {
    /// It did not read what the robot said.
    Overfull,
    /// The robot closed its ports: power off, or EtherCAT mode.
    PortsClosed,
    /// The robot's connection watchdog ran out.
    Dropped,
}

/// What passed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SessionCounts {
    /// Lines given to the robot.
    pub commands: u64,
    /// Lines that could be none: too long, foreign bytes, blanks only.
    pub rejected: u64,
    /// Control connections refused because somebody else controls the robot.
    pub refused: u64,
    /// Connections ended because the peer did not read.
    pub overfull: u64,
}

#[derive(Debug)]
struct Seat<const OUT: usize> {
    outbox: Outbox<OUT>,
    /// What its connection is; `None` while nobody sits here.
    state: Option<SeatState>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SeatState {
    Open,
    Ended(CloseReason),
}

impl<const OUT: usize> Seat<OUT> {
    const EMPTY: Self = Self { outbox: Outbox::new(), state: None };

    fn is_open(&self) -> bool {
        self.state == Some(SeatState::Open)
    }

    /// Whether somebody sits here for whom another batch of messages has room.
    fn has_room(&self) -> bool {
        self.is_open() && self.outbox.waiting().len() < OUT / 2
    }

    fn open(&mut self) {
        self.outbox.clear();
        self.state = Some(SeatState::Open);
    }

    /// Makes a message of the draft. Whether the seat just ended because there is no room for it.
    fn finish(&mut self) -> bool {
        let is_overfull = self.outbox.finish().is_err() && self.is_open();
        if is_overfull {
            self.state = Some(SeatState::Ended(CloseReason::Overfull));
        }
        is_overfull
    }
}

/// Both ports of one robot: one control connection and up to `MONITORS` others, commands of up to
/// `LINE` characters, `OUT` bytes kept for each connection.
#[derive(Debug)]
pub struct ServerSession<const MONITORS: usize, const LINE: usize, const OUT: usize> {
    splitter: LineSplitter<LINE>,
    control: Seat<OUT>,
    monitors: [Seat<OUT>; MONITORS],
    counts: SessionCounts,
}

impl<const MONITORS: usize, const LINE: usize, const OUT: usize> Default
    for ServerSession<MONITORS, LINE, OUT>
{
    fn default() -> Self {
        Self::new()
    }
}

impl<const MONITORS: usize, const LINE: usize, const OUT: usize>
    ServerSession<MONITORS, LINE, OUT>
{
    /// A session with nobody connected.
    #[must_use]
    pub const fn new() -> Self {
        let counts = SessionCounts { commands: 0, rejected: 0, refused: 0, overfull: 0 };
        Self {
            splitter: LineSplitter::new(),
            control: Seat::EMPTY,
            monitors: [const { Seat::EMPTY }; MONITORS],
            counts,
        }
    }

    /// A connection came to the control port. `false`: somebody else has the control, or the ports are
    /// closed; the link sends [`ANOTHER_USER`] and closes.
    pub fn accept_control(&mut self, now: Instant, device: &mut dyn TextDevice) -> bool {
        let is_free = self.control.state.is_none() && device.is_on_text();
        if !is_free || !device.open_control(now) {
            self.counts.refused += 1;
            return false;
        }
        self.splitter.restart();
        self.control.open();
        self.take_messages(now, device);
        true
    }

    /// A connection came to the monitoring port. `None`: there are as many as there may be, or the ports
    /// are closed; the link closes.
    pub fn accept_monitor(&mut self, now: Instant, device: &mut dyn TextDevice) -> Option<Peer> {
        if !device.is_on_text() {
            return None;
        }
        // What was said before belongs to those who were here.
        for _ in 0..CALLS {
            if !self.take_messages(now, device) {
                break;
            }
        }
        let mut places = self.monitors.iter_mut().enumerate();
        let (place, seat) = places.find(|(_, seat)| seat.state.is_none())?;
        seat.open();
        let mut overfull = 0;
        device.monitoring_snapshot(now, &mut |message| {
            let _ = fmt::Write::write_str(&mut seat.outbox, message);
            overfull += u64::from(seat.finish());
        });
        self.counts.overfull += overfull;
        self.take_messages(now, device);
        Some(Peer::Monitor(place))
    }

    /// Bytes came from `peer`, all of which are taken. What a monitoring connection says is not listened
    /// to.
    pub fn receive(
        &mut self,
        now: Instant,
        device: &mut dyn TextDevice,
        peer: Peer,
        mut bytes: &[u8],
    ) {
        while self.receive_some(now, device, peer, &mut bytes) {}
    }

    /// As [`receive`](Self::receive), but stops as soon as somebody's outbox has become half full: takes
    /// bytes from the front of `bytes` and returns whether there is more to do. To be called until there is
    /// not, with an attempt to send what waits in between.
    pub fn receive_some(
        &mut self,
        now: Instant,
        device: &mut dyn TextDevice,
        peer: Peer,
        bytes: &mut &[u8],
    ) -> bool {
        if peer != Peer::Control {
            return false;
        }
        loop {
            if self.take_messages(now, device) {
                return true;
            }
            if !self.control.is_open() {
                return false;
            }
            let Some(line) = self.splitter.next_line(bytes) else { return false };
            let problem = match line {
                Line::Text(text) if text.trim().is_empty() => Some(LineProblem::Empty),
                Line::Text(text) => {
                    self.counts.commands += 1;
                    device.command(now, text);
                    None
                }
                Line::NotAscii => Some(LineProblem::NotAscii),
                Line::TooLong => Some(LineProblem::TooLong),
            };
            if let Some(problem) = problem {
                self.counts.rejected += 1;
                device.reject(now, problem);
            }
        }
    }

    /// The connection of `peer` is gone: the peer closed it, the network broke it, or the link closed it
    /// because it was [`next_to_close`](Self::next_to_close).
    pub fn closed(&mut self, now: Instant, device: &mut dyn TextDevice, peer: Peer) {
        let Some(seat) = self.seat_mut(peer) else { return };
        let was_open = seat.is_open();
        seat.state = None;
        seat.outbox.clear();
        if was_open && peer == Peer::Control {
            device.close_control(now);
        }
        self.take_messages(now, device);
    }

    /// Lets the robot live until `now` and takes what it says, as [`take_messages`](Self::take_messages)
    /// does. To be called once a millisecond at least.
    pub fn advance(&mut self, now: Instant, device: &mut dyn TextDevice) {
        device.advance(now);
        self.take_messages(now, device);
        if !device.is_on_text() {
            for seat in &mut self.monitors {
                if seat.is_open() {
                    seat.state = Some(SeatState::Ended(CloseReason::PortsClosed));
                }
            }
            self.end_control(now, device, CloseReason::PortsClosed);
        }
    }

    /// The next connection that the link shall close, after an attempt to send what still waits for it.
    /// It is told until [`closed`](Self::closed) is called for it.
    #[must_use]
    pub fn next_to_close(&self) -> Option<(Peer, CloseReason)> {
        self.seats().find_map(|(peer, seat)| match seat.state {
            Some(SeatState::Ended(reason)) => Some((peer, reason)),
            _ => None,
        })
    }

    /// What waits to be sent to `peer`.
    #[must_use]
    pub fn waiting(&self, peer: Peer) -> &[u8] {
        let seat = match peer {
            Peer::Control => Some(&self.control),
            Peer::Monitor(place) => self.monitors.get(place),
        };
        seat.map_or(&[], |seat| seat.outbox.waiting())
    }

    /// The first `count` bytes of [`waiting`](Self::waiting) are sent.
    pub fn sent(&mut self, peer: Peer, count: usize) {
        if let Some(seat) = self.seat_mut(peer) {
            seat.outbox.sent(count);
        }
    }

    /// Whether `peer` is connected and another batch of messages has room for it.
    #[must_use]
    pub fn has_room(&self, peer: Peer) -> bool {
        match peer {
            Peer::Control => self.control.has_room(),
            Peer::Monitor(place) => self.monitors.get(place).is_some_and(Seat::has_room),
        }
    }

    /// Everybody who is connected.
    pub fn peers(&self) -> impl Iterator<Item = Peer> {
        self.seats().filter(|(_, seat)| seat.state.is_some()).map(|(peer, _)| peer)
    }

    /// What passed so far.
    #[must_use]
    pub const fn counts(&self) -> SessionCounts {
        self.counts
    }

    fn seats(&self) -> impl Iterator<Item = (Peer, &Seat<OUT>)> {
        let monitors = self.monitors.iter().enumerate();
        let monitors = monitors.map(|(place, seat)| (Peer::Monitor(place), seat));
        core::iter::once((Peer::Control, &self.control)).chain(monitors)
    }

    fn seat_mut(&mut self, peer: Peer) -> Option<&mut Seat<OUT>> {
        match peer {
            Peer::Control => Some(&mut self.control),
            Peer::Monitor(place) => self.monitors.get_mut(place),
        }
    }

    fn end_control(&mut self, now: Instant, device: &mut dyn TextDevice, reason: CloseReason) {
        if self.control.is_open() {
            self.control.state = Some(SeatState::Ended(reason));
            device.close_control(now);
        }
    }

    /// Takes what the robot has to say, for whoever is connected, until somebody's outbox becomes half
    /// full. Returns whether there may be more; then what waits is to be sent before the next call. Who
    /// had no room to begin with is not waited for.
    pub fn take_messages(&mut self, now: Instant, device: &mut dyn TextDevice) -> bool {
        let waits_for_control = self.control.has_room();
        let mut is_full = false;
        let mut has_more = false;
        for _ in 0..AT_ONCE {
            has_more = self.take_control_message(now, device);
            is_full = waits_for_control && self.control.is_open() && !self.control.has_room();
            if !has_more || is_full {
                break;
            }
        }
        // The robot ends a connection behind its last words.
        if !has_more && device.drops_control() {
            self.end_control(now, device, CloseReason::Dropped);
        }
        let mut waits_for = [false; MONITORS];
        for (waits, seat) in waits_for.iter_mut().zip(&self.monitors) {
            *waits = seat.has_room();
        }
        for _ in 0..AT_ONCE {
            let has_more_news = self.take_monitoring_message(device);
            let mut seats = waits_for.iter().zip(&self.monitors);
            is_full |= seats.any(|(waits, seat)| *waits && seat.is_open() && !seat.has_room());
            if !has_more_news {
                return has_more;
            }
            if is_full {
                break;
            }
        }
        true
    }

    fn take_control_message(&mut self, now: Instant, device: &mut dyn TextDevice) -> bool {
        if !self.control.is_open() {
            return device.next_control_message(&mut Nobody);
        }
        let is_any = device.next_control_message(&mut self.control.outbox);
        if self.control.finish() {
            self.counts.overfull += 1;
            device.close_control(now);
        }
        is_any
    }

    fn take_monitoring_message(&mut self, device: &mut dyn TextDevice) -> bool {
        let is_any = device.next_monitoring_message(&mut Everybody(&mut self.monitors));
        for seat in &mut self.monitors {
            self.counts.overfull += u64::from(seat.finish());
        }
        is_any
    }
}

/// Where messages go while nobody is connected.
struct Nobody;

impl fmt::Write for Nobody {
    fn write_str(&mut self, _: &str) -> fmt::Result {
        Ok(())
    }
}

/// Writes to every monitoring connection; who has no room does not keep the others from getting it.
struct Everybody<'a, const OUT: usize>(&'a mut [Seat<OUT>]);

impl<const OUT: usize> fmt::Write for Everybody<'_, OUT> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for seat in self.0.iter_mut().filter(|seat| seat.is_open()) {
            let _ = seat.outbox.write_str(text);
        }
        Ok(())
    }
}
