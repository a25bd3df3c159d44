//! The Meca500's firmware as EtherCAT sees it: its dictionary, its PDOs, and the robot behind them.
//!
//! [`Meca500Application`] is what an emulated ESC talks to. It keeps the images as the robot has
//! them (60 bytes out, 252 in) and moves the assigned PDOs between them and the sync managers'
//! bytes; SDOs read the same images.
//!
//! Choices, where nothing public says it: outputs (7200h..) can be read by SDO and are never
//! written by it (abort 06010006h), because the next cycle would overwrite them and a command must
//! come through the handshake; while no outputs are received they read as 0. Mappings are fixed,
//! the assignment takes every existing PDO at most once, in any order. Power-up (the robot comes
//! back to the bus) restores the assignment of the settings.

mod assignment;
mod objects;
mod settings;
mod sync;

use crate::bus::ethercat::application::Application;
use crate::bus::ethercat::coe::{CoeServer, EmergencyQueueFull};
use crate::cycle::CyclicDevice;
use crate::time::Instant;
use crate::wire::ethercat::al::{AlState, AlStatusCode};
use crate::wire::ethercat::coe::Emergency;
use crate::wire::ethercat::identity::Identity;
use objects::Objects;
pub use settings::Meca500Settings;

/// A Meca500 behind an ESC; `D` is the robot itself, with images of 60 and 252 bytes.
#[derive(Debug)]
pub struct Meca500Application<D> {
    device: D,
    mailbox: CoeServer,
    objects: Objects,
    was_on_bus: bool,
}

impl<D: CyclicDevice> Meca500Application<D> {
    /// `device` on the bus, as it is after power-up.
    #[must_use]
    pub fn new(device: D, settings: Meca500Settings) -> Self {
        let was_on_bus = device.is_on_bus();
        Self { device, mailbox: CoeServer::new(), objects: Objects::new(settings), was_on_bus }
    }

    /// The robot.
    #[must_use]
    pub const fn device(&self) -> &D {
        &self.device
    }

    /// The robot, to act on it as its surroundings do.
    pub const fn device_mut(&mut self) -> &mut D {
        &mut self.device
    }

    /// The settings it was made with.
    #[must_use]
    pub const fn settings(&self) -> &Meca500Settings {
        self.objects.settings()
    }

    /// Its identity, as object 1018h and the SII tell it.
    #[must_use]
    pub const fn identity(&self) -> Identity {
        Identity::meca500(self.settings().serial)
    }

    /// Reports a fault through the mailbox when that is next free, e.g. that the watchdog expired.
    ///
    /// # Errors
    ///
    /// [`EmergencyQueueFull`]: the main device does not fetch them.
    pub fn queue_emergency(&mut self, emergency: Emergency) -> Result<(), EmergencyQueueFull> {
        self.mailbox.queue_emergency(emergency)
    }
}

impl<D: CyclicDevice> Application for Meca500Application<D> {
    fn receive_mailbox(&mut self, state: AlState, datagram: &[u8]) {
        self.mailbox.receive(&mut self.objects, state, datagram);
    }

    fn next_mailbox(&mut self, room: &mut [u8]) -> Option<usize> {
        self.mailbox.next(&mut self.objects, room)
    }

    fn reset_mailbox(&mut self) {
        self.mailbox.reset();
    }

    fn output_len(&self) -> usize {
        self.objects.output_assignment.byte_len()
    }

    fn input_len(&self) -> usize {
        self.objects.input_assignment.byte_len()
    }

    fn check_transition(&mut self, from: AlState, to: AlState) -> Result<(), AlStatusCode> {
        match (from, to) {
            (AlState::PreOp, AlState::SafeOp) if !self.objects.mapping_is_settled() => {
                Err(AlStatusCode::INVALID_PROCESS_DATA_MAPPING)
            }
            _ => Ok(()),
        }
    }

    fn cycle(&mut self, now: Instant, outputs: Option<&[u8]>, inputs: &mut [u8]) {
        let objects = &mut self.objects;
        let assigned = outputs.filter(|bytes| bytes.len() == objects.output_assignment.byte_len());
        match assigned {
            Some(bytes) => objects.output_assignment.scatter(bytes, &mut objects.outputs),
            None => objects.outputs.fill(0),
        }
        let image = assigned.map(|_| objects.outputs.as_slice());
        self.device.cycle(now, image, &mut objects.inputs);

        let is_on_bus = self.device.is_on_bus();
        if is_on_bus && !self.was_on_bus {
            let first_inputs = self.objects.inputs;
            self.objects = Objects::new(*self.objects.settings());
            self.objects.inputs = first_inputs;
            self.mailbox.reset();
        }
        self.was_on_bus = is_on_bus;
        if is_on_bus && inputs.len() == self.objects.input_assignment.byte_len() {
            self.objects.input_assignment.gather(&self.objects.inputs, inputs);
        }
    }

    fn is_on_bus(&self) -> bool {
        self.device.is_on_bus()
    }
}
