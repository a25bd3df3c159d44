//! The robots' side: emulated subdevices in a row, served on any [`Wire`].
//!
//! Read [`Server::step`] first. One thread receives a frame, passes it through the line and sends it
//! back; while no frames come it lets the devices live about once a millisecond, so that watchdogs
//! expire and robots move. Who runs it decides between two steps whether to go on, and asks
//! [`Server::next_change`] what has happened.
//!
//! Invariants: a step ends within [`TICK`] and a frame, the first one after a cycle of at most
//! [`TICK`] stops within some milliseconds; no allocation per frame; a frame that does
//! not find back, or cannot be sent, is lost as on a cable.

use std::io;
use std::prelude::v1::*;
use std::thread;

use super::wire::{MAX_FRAME, Wire};
use crate::bus::ethercat::application::Application;
use crate::bus::ethercat::{Passage, SubDevice, act, carry, tick};
use crate::time::{Duration, Instant};
use crate::wire::ethercat::al::{AlState, AlStatusCode};

/// How often the devices live while no frames come, and the longest wait of a step.
pub const TICK: Duration = Duration::from_millis(1);

/// Cycles that follow each other within this time are as good as the devices' own lives between frames: a
/// tick and how late it may be.
const CLOSE_CYCLE: Duration = Duration::from_micros(1_250);

/// What a main device sees of one device of the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Standing {
    /// Whether it answers at all; a device that does not also hides those behind it.
    pub is_on_bus: bool,
    /// Its AL state.
    pub state: AlState,
    /// Why AL status shows an error, if it does.
    pub error: Option<AlStatusCode>,
}

impl Standing {
    /// The standing of `device` now.
    #[must_use]
    pub fn of<A: Application>(device: &SubDevice<A>) -> Self {
        Self {
            is_on_bus: device.application().is_on_bus(),
            state: device.state(),
            error: device.error(),
        }
    }
}

/// That the standing of a device is another than at the last look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// Which device, counted from 0 at the main device.
    pub device: usize,
    /// What it was.
    pub before: Standing,
    /// What it is.
    pub after: Standing,
}

/// What passed a [`Server`], in frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameCounts {
    /// Received from the wire.
    pub received: u64,
    /// Sent back.
    pub returned: u64,
    /// Lost in the line: damaged, or no device was on the bus.
    pub lost: u64,
    /// Could not be sent back.
    pub unsent: u64,
}

/// A line of subdevices on a wire.
#[derive(Debug)]
pub struct Server<W, A> {
    wire: W,
    line: Vec<SubDevice<A>>,
    standings: Vec<Standing>,
    /// How many devices the cables reach.
    reach: usize,
    counts: FrameCounts,
    /// When the last frame came, and whether another had come just before it ([`CLOSE_CYCLE`]).
    last_frame: (Instant, bool),
    buffer: Box<[u8; MAX_FRAME]>,
}

impl<W: Wire, A: Application> Server<W, A> {
    /// Puts `line` on `wire`; its first device is the one next to the main device.
    #[must_use]
    pub fn new(wire: W, line: Vec<SubDevice<A>>) -> Self {
        let standings = line.iter().map(Standing::of).collect();
        let buffer = Box::new([0; MAX_FRAME]);
        let counts = FrameCounts::default();
        let last_frame = (Instant::ZERO, false);
        Self { wire, line, standings, reach: usize::MAX, counts, last_frame, buffer }
    }

    /// The wire.
    pub const fn wire(&self) -> &W {
        &self.wire
    }

    /// The wire, to be acted upon between two steps.
    pub const fn wire_mut(&mut self) -> &mut W {
        &mut self.wire
    }

    /// The devices.
    #[must_use]
    pub fn line(&self) -> &[SubDevice<A>] {
        &self.line
    }

    /// The devices, to be acted upon between two steps as their surroundings do.
    pub fn line_mut(&mut self) -> &mut [SubDevice<A>] {
        &mut self.line
    }

    /// Pulls the cable behind so many devices, counted from the main device, or plugs all in again
    /// (`usize::MAX`). Those beyond live on and are out of reach of frames.
    pub const fn set_reach(&mut self, devices: usize) {
        self.reach = devices;
    }

    /// What passed so far.
    #[must_use]
    pub const fn counts(&self) -> FrameCounts {
        self.counts
    }

    /// Serves the next frame, or lets the devices live when none comes within [`TICK`].
    ///
    /// # Errors
    ///
    /// The wire cannot deliver. The devices live on and the next step may be made: whether that can
    /// help says the wire's own error.
    pub fn step(&mut self) -> io::Result<()> {
        let deadline = self.wire.now() + TICK;
        // Where cycles follow each other so closely the next one is waited for in the cheapest way.
        let received = match core::mem::take(&mut self.last_frame.1) {
            true => self.wire.receive_next(&mut self.buffer[..], deadline),
            false => self.wire.receive(&mut self.buffer[..], deadline),
        };
        self.attend(received, deadline).map(drop)
    }

    /// Serves a frame that is already there, or lets the devices live; never waits. Whether there was
    /// a frame. For a caller who waits for other things too, and calls it at least every [`TICK`].
    ///
    /// # Errors
    ///
    /// As of [`step`](Self::step).
    pub fn step_at_once(&mut self) -> io::Result<bool> {
        let received = self.wire.receive_now(&mut self.buffer[..]);
        let now = self.wire.now();
        self.attend(received, now)
    }

    /// Does what is to be done about what was received; an error is paused over until `deadline`.
    fn attend(
        &mut self,
        received: io::Result<Option<usize>>,
        deadline: Instant,
    ) -> io::Result<bool> {
        let now = self.wire.now();
        let reach = self.reach.min(self.line.len());
        let (reached, beyond) = self.line.split_at_mut(reach);
        tick(now, beyond);
        let length = match received {
            Ok(Some(length)) => length,
            Ok(None) => {
                tick(now, reached);
                return Ok(false);
            }
            Err(error) => {
                tick(now, reached);
                // An error may come at once, and again.
                self.wire.pause_until(deadline);
                return Err(error);
            }
        };
        self.counts.received += 1;
        let since_last = now.saturating_duration_since(self.last_frame.0);
        self.last_frame = (now, since_last <= CLOSE_CYCLE);
        let Some(frame) = self.buffer.get_mut(..length) else { return Ok(true) };
        // As an ESC does: the frame goes back before the firmware has seen it.
        match carry(now, frame, reached) {
            Passage::Returned if self.wire.send(frame).is_ok() => self.counts.returned += 1,
            Passage::Returned => self.counts.unsent += 1,
            Passage::Lost => self.counts.lost += 1,
        }
        // Whoever waits for the frame on this very core goes first.
        thread::yield_now();
        act(now, reached);
        Ok(true)
    }

    /// The next device whose standing is another than at the last look; `None` when all were told.
    /// To be asked after every step, or changes that take each other back are not seen.
    pub fn next_change(&mut self) -> Option<Change> {
        let pairs = self.line.iter().zip(&mut self.standings);
        for (device, (subdevice, before)) in pairs.enumerate() {
            let after = Standing::of(subdevice);
            if after != *before {
                return Some(Change { device, before: core::mem::replace(before, after), after });
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use super::*;
    use crate::bus::ethercat::Settings;
    use crate::wire::ethercat::sii::SiiImage;
    use crate::wire::meca500::subdevice::DESCRIPTION;

    /// Firmware without a mailbox's worth of anything; counts its cycles.
    struct Firmware {
        is_on_bus: bool,
        cycles: u32,
    }

    impl Application for Firmware {
        fn receive_mailbox(&mut self, _: AlState, _: &[u8]) {}

        fn next_mailbox(&mut self, _: &mut [u8]) -> Option<usize> {
            None
        }

        fn reset_mailbox(&mut self) {}

        fn output_len(&self) -> usize {
            60
        }

        fn input_len(&self) -> usize {
            252
        }

        fn check_transition(&mut self, _: AlState, _: AlState) -> Result<(), AlStatusCode> {
            Ok(())
        }

        fn cycle(&mut self, _: Instant, _: Option<&[u8]>, _: &mut [u8]) {
            self.cycles += 1;
        }

        fn is_on_bus(&self) -> bool {
            self.is_on_bus
        }
    }

    /// What will arrive, in order; `None` is an error. Without anything time passes.
    #[derive(Default)]
    struct Script {
        now: Instant,
        arriving: VecDeque<Option<Vec<u8>>>,
        sent: Vec<Vec<u8>>,
        careless_waits: usize,
    }

    impl Wire for Script {
        fn send(&mut self, frame: &[u8]) -> io::Result<()> {
            self.sent.push(frame.to_vec());
            Ok(())
        }

        fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> io::Result<Option<usize>> {
            match self.arriving.pop_front() {
                Some(Some(frame)) => {
                    buffer[..frame.len()].copy_from_slice(&frame);
                    Ok(Some(frame.len()))
                }
                Some(None) => Err(io::ErrorKind::NetworkDown.into()),
                None => {
                    self.now = deadline;
                    Ok(None)
                }
            }
        }

        fn receive_next(
            &mut self,
            buffer: &mut [u8],
            deadline: Instant,
        ) -> io::Result<Option<usize>> {
            self.careless_waits += 1;
            self.receive(buffer, deadline)
        }

        fn now(&self) -> Instant {
            self.now
        }

        fn pause_until(&mut self, deadline: Instant) {
            self.now = deadline;
        }
    }

    fn server(devices: usize) -> Server<Script, Firmware> {
        let sii = SiiImage::new(&DESCRIPTION).expect("it fits");
        let device = || {
            let firmware = Firmware { is_on_bus: true, cycles: 0 };
            SubDevice::new(firmware, &DESCRIPTION, sii.clone(), Settings::default())
        };
        Server::new(Script::default(), (0..devices).map(|_| device()).collect())
    }

    /// One datagram of two data bytes.
    fn frame(command: u8, address: [u8; 4], data: [u8; 2]) -> Vec<u8> {
        let mut frame = vec![0x10; 12];
        frame.extend([0x88, 0xA4, 14, 0x10, command, 0x55]);
        frame.extend(address);
        frame.extend([2, 0, 0, 0]);
        frame.extend(data);
        frame.extend([0, 0]);
        frame
    }

    #[test]
    fn a_frame_comes_back_from_all_devices() {
        let mut server = server(3);
        server.wire_mut().arriving.push_back(Some(frame(7, [0; 4], [0; 2])));
        server.step().expect("a frame");
        let sent = &server.wire().sent[0];
        assert_eq!(sent[28..], [3, 0], "the working counter");
        assert_eq!(sent[6] & 2, 2, "marked as passed");
        let counts = FrameCounts { received: 1, returned: 1, ..FrameCounts::default() };
        assert_eq!(server.counts(), counts);
    }

    #[test]
    fn only_between_close_cycles_may_a_wait_last_longer() {
        let mut server = server(1);
        let mut frame_after = |ms: u64| {
            server.wire_mut().now += Duration::from_millis(ms);
            server.wire_mut().arriving.push_back(Some(frame(7, [0; 4], [0; 2])));
            let before = server.wire().careless_waits;
            server.step().expect("a frame");
            server.wire().careless_waits - before
        };
        // Of each frame: how long after the one before it came, and how it was waited for.
        let waits = [(5, 0), (1, 0), (1, 1), (1, 1), (2, 1), (2, 0), (1, 0), (1, 1)];
        for (number, (after_ms, careless)) in waits.into_iter().enumerate() {
            assert_eq!(frame_after(after_ms), careless, "frame {number}");
        }
        // One longer wait at most when cycles stop.
        let before = server.wire().careless_waits;
        for _ in 0..5 {
            server.step().expect("nothing comes");
        }
        assert_eq!(server.wire().careless_waits - before, 1);
    }

    #[test]
    fn devices_live_while_no_frames_come_and_while_the_link_is_down() {
        let mut server = server(1);
        for _ in 0..10 {
            server.step().expect("nothing comes");
        }
        assert_eq!(server.wire().now(), Instant::ZERO + 10 * TICK);
        let cycles = server.line()[0].application().cycles;
        assert!(cycles >= 9, "{cycles}");
        for _ in 0..10 {
            server.wire_mut().arriving.push_back(None);
            let error = server.step().expect_err("the link is down");
            assert_eq!(error.kind(), io::ErrorKind::NetworkDown);
        }
        assert!(server.line()[0].application().cycles >= cycles + 9);
        assert_eq!(server.counts(), FrameCounts::default());
    }

    #[test]
    fn a_damaged_frame_is_lost_and_so_is_one_that_reaches_nobody() {
        let mut server = server(1);
        let mut damaged = frame(7, [0; 4], [0; 2]);
        damaged.truncate(25);
        server.wire_mut().arriving.push_back(Some(damaged));
        server.step().expect("a frame");
        server.line_mut()[0].application_mut().is_on_bus = false;
        server.wire_mut().arriving.push_back(Some(frame(7, [0; 4], [0; 2])));
        server.step().expect("a frame");
        assert_eq!(server.counts(), FrameCounts { received: 2, lost: 2, ..FrameCounts::default() });
        assert!(server.wire().sent.is_empty());
    }

    #[test]
    fn a_pulled_cable_hides_those_behind_it_and_lets_them_live() {
        let mut server = server(3);
        for (reach, answered) in [(usize::MAX, 3), (1, 1), (2, 2), (3, 3)] {
            server.set_reach(reach);
            server.wire_mut().arriving.push_back(Some(frame(7, [0; 4], [0; 2])));
            assert!(server.step_at_once().expect("a frame"));
            let sent = server.wire_mut().sent.pop().expect("it comes back");
            assert_eq!(sent[28], answered, "reach {reach}");
        }
        server.set_reach(0);
        server.wire_mut().arriving.push_back(Some(frame(7, [0; 4], [0; 2])));
        server.step().expect("a frame");
        assert!(server.wire().sent.is_empty(), "nobody has seen it");
        assert_eq!(server.counts().lost, 1);
        let cycles = server.line()[2].application().cycles;
        for _ in 0..10 {
            server.step().expect("nothing comes");
        }
        assert!(server.line()[2].application().cycles >= cycles + 9);
        assert!(!server.step_at_once().expect("nothing comes"));
    }

    #[test]
    fn each_change_is_told_once() {
        let mut server = server(2);
        assert_eq!(server.next_change(), None);
        // APWR to AL control of the second device: OP, which INIT does not lead to.
        let address = [0xFF, 0xFF, 0x20, 0x01];
        server.wire_mut().arriving.push_back(Some(frame(2, address, [8, 0])));
        server.step().expect("a frame");
        let change = server.next_change().expect("it refuses");
        assert_eq!((change.device, change.before.error), (1, None));
        assert_eq!(change.after.error, Some(AlStatusCode::INVALID_STATE_CHANGE));
        assert_eq!(server.next_change(), None);
        server.line_mut()[0].application_mut().is_on_bus = false;
        server.step().expect("nothing comes");
        let change = server.next_change().expect("it left");
        assert_eq!((change.device, change.after.is_on_bus), (0, false));
        assert_eq!(server.next_change(), None);
    }
}
