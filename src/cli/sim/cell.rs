//! The robots as a person sees them who stands between them: their panels, cables and power.
//!
//! Whatever acts on them ([`scenario`](super::scenario), [`keys`](super::keys)) or shows them
//! ([`status_line`](super::status_line)) does it through [`Cell`].

use core::cell::RefMut;
use std::prelude::v1::*;

use super::stage::Cable;
use crate::sim::meca500::VirtualRobot;
use crate::time::Instant;

/// What is done to a robot's power.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mains {
    Off,
    On,
    /// Off and on again; somebody presses Reset as soon as the robot has booted.
    Cycle,
}

/// Robots, with what leads to them.
pub(super) trait Cell {
    fn now(&self) -> Instant;

    /// How many robots there are; their numbers count from 0.
    fn count(&self) -> usize;

    /// One that is there, to be acted upon.
    fn robot(&mut self, number: usize) -> RefMut<'_, VirtualRobot>;

    /// Pulls or plugs a cable; says why not when there is none.
    fn set_plugged(&mut self, number: usize, cable: Cable, plugged: bool) -> Result<(), String>;

    /// Whether every cable of the robot is plugged.
    fn is_plugged(&self, number: usize) -> bool;

    fn switch(&mut self, number: usize, mains: Mains);

    /// Who controls the robot, for a person; `None` while nobody does.
    fn controller(&self, number: usize) -> Option<&'static str>;

    /// How many only watch.
    fn monitors(&self, number: usize) -> usize;
}

/// Robots without any bus, for tests.
#[cfg(test)]
pub(super) struct Bench {
    pub(super) now: Instant,
    pub(super) robots: Vec<core::cell::RefCell<VirtualRobot>>,
    pub(super) pulled: Vec<bool>,
    pub(super) controller: Option<&'static str>,
}

#[cfg(test)]
impl Bench {
    pub(super) fn of(revision: crate::wire::meca500::revision::Revision, count: usize) -> Self {
        let settings = crate::sim::meca500::RobotSettings { revision, ..Default::default() };
        Self {
            now: Instant::ZERO,
            robots: vec![core::cell::RefCell::new(VirtualRobot::new(settings)); count],
            pulled: vec![false; count],
            controller: None,
        }
    }

    /// Lets all of them live for a while.
    pub(super) fn pass(&mut self, time: crate::time::Duration) {
        self.now += time;
        for robot in &mut self.robots {
            robot.get_mut().advance(self.now);
        }
    }
}

#[cfg(test)]
impl Cell for Bench {
    fn now(&self) -> Instant {
        self.now
    }

    fn count(&self) -> usize {
        self.robots.len()
    }

    fn robot(&mut self, number: usize) -> RefMut<'_, VirtualRobot> {
        self.robots[number].borrow_mut()
    }

    fn set_plugged(&mut self, number: usize, cable: Cable, plugged: bool) -> Result<(), String> {
        match cable {
            Cable::Tcp | Cable::All => {
                self.pulled[number] = !plugged;
                Ok(())
            }
            Cable::EtherCat | Cable::EtherNetIp => Err("there is none".into()),
        }
    }

    fn is_plugged(&self, number: usize) -> bool {
        !self.pulled[number]
    }

    fn switch(&mut self, number: usize, mains: Mains) {
        let mut robot = self.robot(number);
        let mut panel = robot.panel();
        if mains != Mains::On {
            panel.switch_off();
        }
        if mains != Mains::Off {
            panel.switch_on();
        }
    }

    fn controller(&self, _number: usize) -> Option<&'static str> {
        self.controller
    }

    fn monitors(&self, _number: usize) -> usize {
        0
    }
}
