//! What a person beside the robots can see and do, between two passes over their faces.
//!
//! Read [`Stage`] first. A scenario, keys or a status line need nothing else.

use core::cell::RefMut;
use std::prelude::v1::*;

use super::faces::Faces;
use super::power::Power;
use super::teller::Teller;
use crate::cli::text::serve::TextFace;
use crate::link::ethercat::serve::Standing;
use crate::sim::meca500::{Controller, VirtualRobot};
use crate::time::Instant;

/// One of a robot's cables, as far as its protocols see it. A real robot has one for all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Cable {
    /// Frames of EtherCAT; the robots behind this one are out of reach too.
    EtherCat,
    /// Messages and class 1 frames of EtherNet/IP.
    EtherNetIp,
    /// Both ports of the text interface.
    Tcp,
    /// All of them.
    All,
}

/// Which cables of a robot are plugged in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cables {
    pub(super) ethercat: bool,
    pub(super) ethernet_ip: bool,
    pub(super) tcp: bool,
}

impl Default for Cables {
    fn default() -> Self {
        Self { ethercat: true, ethernet_ip: true, tcp: true }
    }
}

impl Cables {
    pub(super) const fn set(&mut self, cable: Cable, plugged: bool) {
        match cable {
            Cable::EtherCat => self.ethercat = plugged,
            Cable::EtherNetIp => self.ethernet_ip = plugged,
            Cable::Tcp => self.tcp = plugged,
            Cable::All => {
                *self = Self { ethercat: plugged, ethernet_ip: plugged, tcp: plugged };
            }
        }
    }
}

/// What can be seen of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Facts {
    /// EtherCAT mode: it has no other face.
    pub(super) is_in_ethercat_mode: bool,
    /// Who controls it in TCP/IP mode.
    pub(super) controller: Option<Controller>,
    /// Its place in the EtherCAT line, if there is one.
    pub(super) ethercat: Option<Standing>,
    /// How many connections only watch, on EtherNet/IP and at the monitoring port.
    pub(super) monitors: usize,
    pub(super) cables: Cables,
}

/// The robots and all that is around them, between two passes. Robots count from 0; one that does not
/// exist is no error: nothing happens to it.
pub(super) struct Stage<'a> {
    now: Instant,
    faces: &'a mut Faces,
    power: &'a mut Power,
}

impl<'a> Stage<'a> {
    /// What there is now.
    pub(super) fn new(faces: &'a mut Faces, power: &'a mut Power) -> Self {
        Self { now: faces.now(), faces, power }
    }

    /// The time that the robots live by; it begins shortly before they are served.
    pub(super) const fn now(&self) -> Instant {
        self.now
    }

    /// Number of robots.
    pub(super) fn robot_count(&self) -> usize {
        self.faces.robots.len()
    }

    /// A robot, to be acted upon; its buttons are at [`VirtualRobot::panel`]. It has lived until about
    /// [`now`](Self::now).
    pub(super) fn robot(&mut self, robot: usize) -> Option<RefMut<'_, VirtualRobot>> {
        Some(self.faces.robots.get(robot)?.borrow_mut())
    }

    /// Pulls the power plug of a robot, or puts it in: the robot boots, and somebody presses Reset as
    /// soon as it has.
    pub(super) fn set_power(&mut self, robot: usize, on: bool) {
        if let Some(shared) = self.faces.robots.get(robot) {
            self.power.switch(robot, shared, on);
        }
    }

    /// Pulls a network cable of a robot, or plugs it in again. While it is out, frames, datagrams and
    /// bytes are neither received nor sent there; connections break when either end misses the other.
    ///
    /// # Errors
    ///
    /// Why not, for a person: nothing is served there, or the system cannot do it.
    pub(super) fn set_plugged(
        &mut self,
        robot: usize,
        cable: Cable,
        plugged: bool,
    ) -> Result<(), String> {
        self.faces.set_plugged(robot, cable, plugged)
    }

    /// What can be seen of a robot.
    pub(super) fn facts(&self, robot: usize) -> Option<Facts> {
        let Faces { robots, ethercat, enip, text, cables, .. } = &*self.faces;
        // The standing in the line asks the robot itself.
        let ethercat = ethercat.as_ref().and_then(|face| face.standing(robot));
        let state = robots.get(robot)?.borrow();
        Some(Facts {
            is_in_ethercat_mode: state.protocol_settings().ethercat,
            controller: state.controller(),
            ethercat,
            monitors: text.get(robot).map_or(0, TextFace::monitors)
                + enip.as_ref().map_or(0, |face| face.monitors(robot)),
            cables: *cables.get(robot)?,
        })
    }

    /// The power supply does its part.
    pub(super) fn supply_power(&mut self, teller: Teller) {
        let is_cut = self.faces.take_power_cycle();
        self.power.supply(self.now, is_cut, &self.faces.robots, teller);
    }
}
