//! The robots' power supply, and who stands beside it.

use std::prelude::v1::*;

use super::shared_robot::SharedRobot;
use super::teller::Teller;
use crate::time::{Duration, Instant};

/// How long robots stay without power before they boot.
const POWER_OFF: Duration = Duration::from_millis(500);

/// The power of all robots.
#[derive(Debug)]
pub(super) struct Power {
    cut_at: Option<Instant>,
    back_at: Option<Instant>,
    /// Which robots have not been reset since their power came back.
    waits_for_reset: Vec<bool>,
}

impl Power {
    /// Power of so many robots that is cut once at a time, or never.
    pub(super) fn new(robots: usize, cut_at: Option<Instant>) -> Self {
        Self { cut_at, back_at: None, waits_for_reset: vec![false; robots] }
    }

    /// Switches one robot.
    pub(super) fn switch(&mut self, number: usize, robot: &SharedRobot, on: bool) {
        let mut robot = robot.borrow_mut();
        if on {
            robot.panel().switch_on();
        } else {
            robot.panel().switch_off();
        }
        if let Some(waits) = self.waits_for_reset.get_mut(number) {
            *waits = on;
        }
    }

    /// Switches all robots when it is time to, or when `is_cut` says so.
    pub(super) fn supply(
        &mut self,
        now: Instant,
        is_cut: bool,
        robots: &[SharedRobot],
        teller: Teller,
    ) {
        if is_cut || self.cut_at.is_some_and(|at| at <= now) {
            self.cut_at = None;
            self.back_at = Some(now + POWER_OFF);
            teller.say("power cut");
            self.switch_all(robots, false);
        }
        if self.back_at.is_some_and(|at| at <= now) {
            self.back_at = None;
            teller.say("power back: the robots boot");
            self.switch_all(robots, true);
        }
        for (waits, robot) in self.waits_for_reset.iter_mut().zip(robots) {
            // Somebody at the cell presses Reset as soon as a robot has booted: without that its motors
            // get no power.
            if *waits && robot.borrow().is_online() {
                *waits = false;
                robot.borrow_mut().panel().press_reset();
            }
        }
    }

    fn switch_all(&mut self, robots: &[SharedRobot], on: bool) {
        for (number, robot) in robots.iter().enumerate() {
            self.switch(number, robot, on);
        }
    }
}
