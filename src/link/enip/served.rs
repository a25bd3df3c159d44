//! A robot behind its adapter: the device, the sessions that serve it, and what joins the two.
//!
//! Read [`ServedRobot::live`] first: there the adapter's outputs reach the device and the device's inputs go
//! back. Everything else hands to the adapter what arrived, and takes from it what is to be sent, as long as
//! the device is on its bus: a device that is switched off, boots or serves another protocol hears nothing
//! and says nothing, and when it returns its adapter begins anew.
//!
//! Invariants: the device lives in steps of [`STEP`], however seldom anybody comes by; no allocation after
//! [`ServedRobot::new`].

use core::net::{Ipv4Addr, SocketAddrV4};
use std::vec;
use std::vec::Vec;

use crate::bus::enip::adapter::{Adapter, AdapterEvent, AdapterSettings, StreamId, Transmit};
use crate::cycle::CyclicDevice;
use crate::time::{Duration, Instant};
use crate::wire::meca500::image::mark_monitoring;

/// How long the device lives with the same outputs before they are looked at again.
///
/// Source: choice. The shortest cycle of the robot on any bus.
pub const STEP: Duration = Duration::from_millis(1);
/// Most steps that are made up for at once; a process that was stopped for longer lets its devices live the
/// rest in one.
const STEPS_AT_ONCE: u32 = 100;

/// A device and the adapter it is reached through.
pub struct ServedRobot<D> {
    device: D,
    adapter: Adapter,
    address: Ipv4Addr,
    netmask: Ipv4Addr,
    seed: u64,
    /// What the device produces, and the same for connections that only monitor.
    controlling: Vec<u8>,
    monitoring: Vec<u8>,
    /// Until when the device has lived; `None` before its first step.
    lived_until: Option<Instant>,
    is_on_bus: bool,
    has_departed: bool,
}

impl<D: CyclicDevice> ServedRobot<D> {
    /// `device` behind an adapter that is reached at `address`. `seed` makes connection ids differ from those of
    /// an earlier process.
    ///
    /// The lengths in `settings` should be those of the device: outputs of another length count as none, and
    /// its inputs would never be produced.
    #[must_use]
    pub fn new(device: D, settings: AdapterSettings, address: Ipv4Addr, seed: u64) -> Self {
        Self {
            is_on_bus: device.is_on_bus(),
            device,
            adapter: Adapter::new(settings, address, seed),
            address,
            netmask: settings.netmask,
            seed,
            controlling: vec![0; D::INPUT_LEN],
            monitoring: vec![0; D::INPUT_LEN],
            lived_until: None,
            has_departed: false,
        }
    }

    /// The device.
    pub const fn device(&self) -> &D {
        &self.device
    }

    /// The device, to be acted upon as a person beside it would.
    pub const fn device_mut(&mut self) -> &mut D {
        &mut self.device
    }

    /// The adapter.
    pub const fn adapter(&self) -> &Adapter {
        &self.adapter
    }

    /// The adapter, to be set up as a person with a browser would.
    pub const fn adapter_mut(&mut self) -> &mut Adapter {
        &mut self.adapter
    }

    /// Where the robot is reached.
    #[must_use]
    pub const fn address(&self) -> Ipv4Addr {
        self.address
    }

    /// Where broadcasts to its network go.
    #[must_use]
    pub const fn broadcast_address(&self) -> Ipv4Addr {
        let host = !u32::from_be_bytes(self.netmask.octets());
        let [a, b, c, d] = (u32::from_be_bytes(self.address.octets()) | host).to_be_bytes();
        Ipv4Addr::new(a, b, c, d)
    }

    /// Whether the device answers its bus.
    #[must_use]
    pub const fn is_on_bus(&self) -> bool {
        self.is_on_bus
    }

    /// Whether the device left its bus since this was asked last: all its TCP connections are gone then, and who
    /// holds them drops them.
    pub const fn take_departure(&mut self) -> bool {
        core::mem::replace(&mut self.has_departed, false)
    }

    /// Lets the device live until `now`, in whole steps, and the adapter do what is due.
    pub fn live(&mut self, now: Instant) {
        let mut at = match self.lived_until {
            Some(until) => until,
            None => {
                self.step(now);
                now
            }
        };
        if now.saturating_duration_since(at) > STEPS_AT_ONCE * STEP {
            self.step(now);
            at = now;
        }
        while at + STEP <= now {
            at += STEP;
            self.step(at);
        }
        self.lived_until = Some(at);
        if self.is_on_bus {
            self.adapter.handle_timeout(now);
        }
    }

    /// One cycle of the device.
    fn step(&mut self, at: Instant) {
        if self.is_on_bus {
            // First, so that outputs whose owner fell silent are not taken any more.
            self.adapter.handle_timeout(at);
        }
        let outputs = self.adapter.outputs().filter(|_| self.is_on_bus);
        self.device.cycle(at, outputs, &mut self.controlling);
        let was_on_bus = core::mem::replace(&mut self.is_on_bus, self.device.is_on_bus());
        if was_on_bus && !self.is_on_bus {
            self.has_departed = true;
            self.seed = self.seed.wrapping_add(1);
            self.adapter.restart(self.seed);
        }
        if self.is_on_bus {
            self.monitoring.copy_from_slice(&self.controlling);
            mark_monitoring(&mut self.monitoring);
            self.adapter.set_inputs(&self.controlling, &self.monitoring);
        }
    }

    /// When to call [`live`](Self::live) at the latest.
    #[must_use]
    pub fn next_due(&self) -> Instant {
        let step = self.lived_until.map_or(Instant::ZERO, |until| until + STEP);
        let timeout = self.adapter.poll_timeout().filter(|_| self.is_on_bus);
        timeout.map_or(step, |timeout| timeout.min(step))
    }

    /// A TCP connection was accepted; `None` to close it at once.
    pub fn handle_accepted(&mut self, now: Instant, peer: SocketAddrV4) -> Option<StreamId> {
        if self.is_on_bus { self.adapter.handle_accepted(now, peer) } else { None }
    }

    /// Bytes came on a TCP connection.
    pub fn handle_stream(&mut self, now: Instant, stream: StreamId, bytes: &[u8]) {
        if self.is_on_bus {
            self.adapter.handle_stream(now, stream, bytes);
        }
    }

    /// A TCP connection is gone.
    pub fn handle_stream_closed(&mut self, now: Instant, stream: StreamId) {
        if self.is_on_bus {
            self.adapter.handle_stream_closed(now, stream);
        }
    }

    /// A datagram came to UDP 44818.
    pub fn handle_message_datagram(&mut self, now: Instant, from: SocketAddrV4, datagram: &[u8]) {
        if self.is_on_bus {
            self.adapter.handle_message_datagram(now, from, datagram);
        }
    }

    /// A datagram came to UDP 2222.
    pub fn handle_io_datagram(&mut self, now: Instant, from: SocketAddrV4, datagram: &[u8]) {
        if self.is_on_bus {
            self.adapter.handle_io_datagram(now, from, datagram);
        }
    }

    /// What is to be sent next; to be asked until there is nothing more.
    pub fn poll_transmit(&mut self, now: Instant, room: &mut [u8]) -> Option<Transmit> {
        if self.is_on_bus { self.adapter.poll_transmit(now, room) } else { None }
    }

    /// What happened.
    pub fn poll_event(&mut self) -> Option<AdapterEvent> {
        self.adapter.poll_event()
    }
}
