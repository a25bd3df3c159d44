//! The [`Stage`] as a [`Cell`]: what a person reaches who stands beside robots that are really served.

use core::cell::RefMut;
use std::prelude::v1::*;

use super::cell::{Cell, Mains};
use super::stage::{Cable, Cables, Facts, Stage};
use crate::sim::meca500::{Controller, VirtualRobot};
use crate::time::{Duration, Instant};
use crate::wire::ethercat::al::AlState;

/// How long [`Mains::Cycle`] leaves a robot without power.
const POWER_OFF: Duration = Duration::from_millis(500);

/// Robots whose power was cut for a moment, and when it comes back.
#[derive(Debug, Default)]
pub(super) struct Cut {
    back_at: Vec<(usize, Instant)>,
}

impl Cut {
    /// Gives power back where it is time to.
    pub(super) fn give_back(&mut self, stage: &mut Stage<'_>) {
        let now = stage.now();
        self.back_at.retain(|(number, at)| {
            let waits = *at > now;
            if !waits {
                stage.set_power(*number, true);
            }
            waits
        });
    }
}

/// The stage, with what was begun there.
pub(super) struct Beside<'b, 's> {
    pub(super) stage: &'b mut Stage<'s>,
    pub(super) cut: &'b mut Cut,
}

impl Beside<'_, '_> {
    fn facts(&self, number: usize) -> Option<Facts> {
        self.stage.facts(number)
    }
}

impl Cell for Beside<'_, '_> {
    fn now(&self) -> Instant {
        self.stage.now()
    }

    fn count(&self) -> usize {
        self.stage.robot_count()
    }

    fn robot(&mut self, number: usize) -> RefMut<'_, VirtualRobot> {
        self.stage.robot(number).expect("scenario and keys were checked: it is there")
    }

    fn set_plugged(&mut self, number: usize, cable: Cable, plugged: bool) -> Result<(), String> {
        self.stage.set_plugged(number, cable, plugged)
    }

    fn is_plugged(&self, number: usize) -> bool {
        self.facts(number).is_none_or(|facts| facts.cables == Cables::default())
    }

    fn switch(&mut self, number: usize, mains: Mains) {
        self.cut.back_at.retain(|(other, _)| *other != number);
        match mains {
            Mains::Off => self.stage.set_power(number, false),
            // Who switches it on presses Reset himself.
            Mains::On => self.robot(number).panel().switch_on(),
            Mains::Cycle => {
                self.stage.set_power(number, false);
                self.cut.back_at.push((number, self.stage.now() + POWER_OFF));
            }
        }
    }

    fn controller(&self, number: usize) -> Option<&'static str> {
        let facts = self.facts(number)?;
        if facts.is_in_ethercat_mode {
            let is_up = facts.ethercat.is_some_and(|standing| standing.state == AlState::Op);
            return is_up.then_some("EtherCAT");
        }
        facts.controller.map(|controller| match controller {
            Controller::Text => "TCP",
            Controller::EtherNetIp => "EtherNet/IP",
            Controller::Profinet => "PROFINET",
        })
    }

    fn monitors(&self, number: usize) -> usize {
        self.facts(number).map_or(0, |facts| facts.monitors)
    }
}
