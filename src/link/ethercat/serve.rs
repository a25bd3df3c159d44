//! The robots' side: emulated subdevices in a row, served on any [`Wire`].
//!
//! Read [`Server::step`] first. One thread receives a frame, passes it through the line and sends it
//! back; while no frames come it lets the devices live about once a millisecond, so that watchdogs
//! expire and robots move. Who runs it decides between two steps whether to go on, and asks
//! [`Server::next_change`] what has happened.
//!
//! Invariants: a step ends within [`TICK`] and a frame; no allocation per frame; a frame that does
//! not find back, or cannot be sent, is lost as on a cable.

use std::io;
use std::prelude::v1::*;

use super::wire::{MAX_FRAME, Wire};
use crate::bus::ethercat::application::Application;
use crate::bus::ethercat::{Passage, SubDevice, pass, tick};
use crate::time::Duration;
use crate::wire::ethercat::al::{AlState, AlStatusCode};

/// How often the devices live while no frames come, and the longest wait of a step.
pub const TICK: Duration = Duration::from_millis(1);

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
    fn of<A: Application>(device: &SubDevice<A>) -> Self {
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
    counts: FrameCounts,
    buffer: Box<[u8; MAX_FRAME]>,
}

impl<W: Wire, A: Application> Server<W, A> {
    /// Puts `line` on `wire`; its first device is the one next to the main device.
    #[must_use]
    pub fn new(wire: W, line: Vec<SubDevice<A>>) -> Self {
        let standings = line.iter().map(Standing::of).collect();
        let buffer = Box::new([0; MAX_FRAME]);
        Self { wire, line, standings, counts: FrameCounts::default(), buffer }
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
        let received = self.wire.receive(&mut self.buffer[..], deadline);
        let now = self.wire.now();
        let length = match received {
            Ok(Some(length)) => length,
            Ok(None) => {
                tick(now, &mut self.line);
                return Ok(());
            }
            Err(error) => {
                tick(now, &mut self.line);
                // An error may come at once, and again.
                self.wire.pause_until(deadline);
                return Err(error);
            }
        };
        self.counts.received += 1;
        let Some(frame) = self.buffer.get_mut(..length) else { return Ok(()) };
        match pass(now, frame, &mut self.line) {
            Passage::Returned if self.wire.send(frame).is_ok() => self.counts.returned += 1,
            Passage::Returned => self.counts.unsent += 1,
            Passage::Lost => self.counts.lost += 1,
        }
        Ok(())
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
