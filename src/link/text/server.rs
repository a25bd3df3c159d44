//! A robot that has the text interface alone: its ports, itself and a clock.

use std::io;

use super::error::BindError;
use super::ports::{Endpoints, PortCounts, ServerEvent, TextPorts};
use crate::link::clock::MonotonicClock;
use crate::text_device::TextDevice;
use crate::time::{Duration, Instant};

/// How long a step waits at most, so that the robot lives in steps of a millisecond.
pub const STEP: Duration = Duration::from_millis(1);

/// A robot at its two ports, in real time.
#[derive(Debug)]
pub struct TextServer<D> {
    ports: TextPorts,
    device: D,
    clock: MonotonicClock,
}

impl<D: TextDevice> TextServer<D> {
    /// Opens the ports for `device`.
    ///
    /// # Errors
    ///
    /// [`BindError`].
    pub fn bind(device: D, endpoints: Endpoints) -> Result<Self, BindError> {
        Ok(Self { ports: TextPorts::bind(endpoints)?, device, clock: MonotonicClock::new() })
    }

    /// Waits until something arrives, at most for [`STEP`], and does what is to be done.
    ///
    /// # Errors
    ///
    /// The system refuses to wait for the sockets. The robot has lived nevertheless.
    pub fn step(&mut self) -> io::Result<()> {
        let waited = self.ports.wait(STEP);
        self.ports.serve(self.clock.now(), &mut self.device);
        waited
    }

    /// The time that the robot lives in.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.clock.now()
    }

    /// The robot.
    pub const fn device(&self) -> &D {
        &self.device
    }

    /// The robot, to be acted upon between two steps as a person beside it would.
    pub const fn device_mut(&mut self) -> &mut D {
        &mut self.device
    }

    /// Where the ports are.
    #[must_use]
    pub const fn endpoints(&self) -> Endpoints {
        self.ports.endpoints()
    }

    /// The next thing that happened at the ports.
    pub fn next_event(&mut self) -> Option<ServerEvent> {
        self.ports.next_event()
    }

    /// What passed so far.
    #[must_use]
    pub fn counts(&self) -> PortCounts {
        self.ports.counts()
    }
}
