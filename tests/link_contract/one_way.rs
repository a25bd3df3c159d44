//! A wire whose frames can get lost on one way only.

use std::io;

use fieldarm::link::ethercat::wire::Wire;
use fieldarm::time::Instant;

/// A wire and what it loses.
pub(crate) struct OneWay<W> {
    pub(crate) wire: W,
    pub(crate) loses_sent: bool,
    pub(crate) loses_received: bool,
}

impl<W> OneWay<W> {
    pub(crate) const fn new(wire: W) -> Self {
        Self { wire, loses_sent: false, loses_received: false }
    }
}

impl<W: Wire> Wire for OneWay<W> {
    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        if self.loses_sent { Ok(()) } else { self.wire.send(frame) }
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> io::Result<Option<usize>> {
        loop {
            let received = self.wire.receive(buffer, deadline)?;
            if received.is_none() || !self.loses_received {
                return Ok(received);
            }
        }
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
