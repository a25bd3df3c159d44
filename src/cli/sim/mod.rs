//! `fieldarm sim`: virtual robots on any mix of EtherCAT, EtherNet/IP and the text interface.
//!
//! Read [`run`] first, then [`faces`]: one loop waits for all that robots are served on. [`stage`] is what
//! stands beside the robots between two passes.
//!
//! ```text
//!            EtherCAT line ── OnEtherCat ──.
//! faces ──▶  adapters ─────── OnEtherNetIp ┼── SharedRobot ── VirtualRobot
//!            TCP ports ────────────────────┘        ▲
//!                                                 stage: power, cables, buttons
//! ```
//!
//! Source: PM L1687 (EtherCAT shuts the others out), PM L1778 (one controller at a time over the others).
//! A robot that is not in EtherCAT mode ends the EtherCAT line, as one without power does. Source: choice.

mod args;
mod faces;
pub(super) mod labels;
mod line;
mod power;
mod robots;
pub(super) mod shared_robot;
mod stage;
pub(super) mod teller;

use std::prelude::v1::*;
use std::sync::atomic::Ordering;

pub(super) use args::{SimArgs, parse_pdo};
use faces::{Faces, STEP};
pub(super) use line::refused;
use power::Power;
use stage::Stage;
use teller::Teller;

use super::exit::{Exit, Failure};
use super::run_program::catch_interrupts;
use crate::time::Duration;

/// Serves until interrupted.
pub(super) fn run(args: &SimArgs) -> Result<Exit, Failure> {
    args.check()?;
    let teller = Teller { quiet: args.quiet };
    let robots = robots::robots(args);
    let count = robots.len();
    let mut faces = Faces::open(args, robots, teller)?;
    let interrupted = catch_interrupts()?;
    let cut_at = args.power_cycle_after.map(|after| faces.now() + Duration::from_secs(after));
    let mut power = Power::new(count, cut_at);
    teller.say(faces.announcement(args));
    faces.warn();
    let mut stage_due = faces.now();
    while !interrupted.load(Ordering::Relaxed) {
        faces.pass(stage_due)?;
        if faces.now() < stage_due {
            continue;
        }
        let mut stage = Stage::new(&mut faces, &mut power);
        stage.supply_power(teller);
        stage_due = stage.now() + STEP;
    }
    for line in faces.totals() {
        teller.say(line);
    }
    Ok(Exit::Done)
}
