//! An emulated segment in the same process, and a wire to it whose time is simulated.
//!
//! Frames pass the subdevices when they are sent and come back one latency later; waiting moves the
//! clock and costs nothing, so a start with all its limits takes milliseconds.
//!
//! Invariant: after [`MemoryWire::new`] nothing is allocated.

use std::collections::VecDeque;
use std::io;
use std::vec::Vec;

use super::wire::{MAX_FRAME, Wire};
use crate::bus::ethercat::application::Application;
use crate::bus::ethercat::{Passage, SubDevice, pass, tick};
use crate::time::{Duration, Instant};

/// Time from sending a frame to having it back.
///
/// Source: choice. About what a frame of one robot takes at 100 Mbit/s.
const LATENCY: Duration = Duration::from_micros(30);
/// Frames that can be on their way back.
const FRAMES: usize = 32;
/// Longest time that passes at once: the robots live in steps no longer than this.
const STEP: Duration = Duration::from_millis(1);

/// A frame on its way back.
struct Returning {
    due: Instant,
    bytes: Vec<u8>,
}

/// A line of emulated subdevices and the wire to them.
pub struct MemoryWire<A> {
    line: Vec<SubDevice<A>>,
    returning: VecDeque<Returning>,
    spare: Vec<Vec<u8>>,
    now: Instant,
    is_plugged: bool,
}

impl<A: Application> MemoryWire<A> {
    /// A wire to `line`, the first of which is next to the main device.
    #[must_use]
    pub fn new(line: Vec<SubDevice<A>>) -> Self {
        Self {
            line,
            returning: VecDeque::with_capacity(FRAMES),
            spare: (0..FRAMES).map(|_| Vec::with_capacity(MAX_FRAME)).collect(),
            now: Instant::ZERO,
            is_plugged: true,
        }
    }

    /// The subdevices, in the order of the line.
    #[must_use]
    pub fn line(&self) -> &[SubDevice<A>] {
        &self.line
    }

    /// The subdevices, to be acted upon as a person beside them would.
    pub fn line_mut(&mut self) -> &mut [SubDevice<A>] {
        &mut self.line
    }

    /// Pulls the cable out of the main device: it can neither send nor receive.
    pub fn unplug(&mut self) {
        self.is_plugged = false;
        while let Some(frame) = self.returning.pop_front() {
            self.spare.push(frame.bytes);
        }
    }

    /// Puts the cable back.
    pub fn plug(&mut self) {
        self.is_plugged = true;
    }

    fn live_until(&mut self, until: Instant) {
        while self.now < until {
            self.now = until.min(self.now + STEP);
            tick(self.now, &mut self.line);
        }
    }

    fn down() -> io::Error {
        io::Error::from(io::ErrorKind::NetworkDown)
    }
}

impl<A: Application> Wire for MemoryWire<A> {
    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        if !self.is_plugged {
            return Err(Self::down());
        }
        // With nobody taking what comes back, the newest frame is lost, as in a full queue of a card.
        let Some(mut bytes) = self.spare.pop() else { return Ok(()) };
        bytes.clear();
        bytes.extend_from_slice(frame.get(..MAX_FRAME).unwrap_or(frame));
        match pass(self.now, &mut bytes, &mut self.line) {
            Passage::Returned => {
                self.returning.push_back(Returning { due: self.now + LATENCY, bytes });
            }
            Passage::Lost => self.spare.push(bytes),
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> io::Result<Option<usize>> {
        if !self.is_plugged {
            return Err(Self::down());
        }
        let in_time = |frame: &Returning| frame.due <= deadline || frame.due <= self.now;
        if !self.returning.front().is_some_and(in_time) {
            self.live_until(deadline);
            return Ok(None);
        }
        let Some(Returning { due, bytes }) = self.returning.pop_front() else { return Ok(None) };
        self.live_until(due);
        let room = buffer.get_mut(..bytes.len());
        let len = room.map(|room| room.copy_from_slice(&bytes)).map(|()| bytes.len());
        self.spare.push(bytes);
        Ok(len)
    }

    fn now(&self) -> Instant {
        self.now
    }

    fn pause_until(&mut self, deadline: Instant) {
        self.live_until(deadline);
    }

    fn advance_to(&mut self, now: Instant) {
        self.live_until(now);
    }
}
