//! `fieldarm sim`: virtual robots on any mix of EtherCAT, EtherNet/IP and the text interface.
//!
//! Read [`run`] first, then [`faces`]: one loop waits for all that robots are served on. [`stage`] is what
//! stands beside the robots between two passes, [`operator`] the person there: scenario, keys, kept state.
//!
//! ```text
//!            EtherCAT line ── OnEtherCat ──.
//! faces ──▶  adapters ─────── OnEtherNetIp ┼── SharedRobot ── VirtualRobot
//!            TCP ports ────────────────────┘        ▲
//!                              operator ──▶ stage: power, cables, buttons
//! ```
//!
//! Source: PM L1687 (EtherCAT shuts the others out), PM L1778 (one controller at a time over the others).
//! A robot that is not in EtherCAT mode ends the EtherCAT line, as one without power does. Source: choice.

mod args;
mod beside;
mod cell;
mod deed;
mod faces;
mod kept;
mod keyboard;
mod keys;
pub(super) mod labels;
mod line;
mod operator;
mod power;
mod robots;
mod scenario;
mod scenario_file;
pub(super) mod shared_robot;
mod stage;
mod state;
mod status_line;
pub(super) mod teller;

use std::prelude::v1::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

pub(super) use args::{SimArgs, parse_pdo};
use faces::{EARLY, Faces, STEP};
pub(super) use keys::give_terminal_back;
pub(super) use line::refused;
use operator::{Operator, Prepared};
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
    let prepared = Prepared::read(&args.operator, args.robots.into())?;
    let robots = robots::robots(args, &prepared, &mut |words| teller.say(words))?;
    let count = robots.len();
    let mut faces = Faces::open(args, robots, teller)?;
    let interrupted = catch_interrupts()?;
    let cut_at = args.power_cycle_after.map(|after| faces.now() + Duration::from_secs(after));
    let mut power = Power::new(count, cut_at);
    teller.say(faces.announcement(args));
    faces.warn();
    let mut operator = prepared.begin(faces.now(), Arc::clone(&interrupted), args.quiet);
    if operator.has_keys() {
        teller.say("h shows the keys");
    }
    let served = serve(&mut faces, &mut power, &mut operator, &interrupted, teller);
    // What the robots keep is written, however it ended.
    let kept = operator.end(&mut Stage::new(&mut faces, &mut power));
    if let Some(failure) =
        Failure::all([served, kept].into_iter().filter_map(Result::err).collect())
    {
        return Err(failure);
    }
    for line in faces.totals() {
        teller.say(line);
    }
    Ok(Exit::Done)
}

fn serve(
    faces: &mut Faces,
    power: &mut Power,
    operator: &mut Operator,
    interrupted: &AtomicBool,
    teller: Teller,
) -> Result<(), Failure> {
    let mut stage_due = faces.now();
    while !interrupted.load(Ordering::Relaxed) {
        faces.pass(stage_due)?;
        if faces.now() + EARLY < stage_due {
            continue;
        }
        let mut stage = Stage::new(faces, power);
        stage.supply_power(teller);
        operator.act(&mut stage, &mut |words| teller.say(words));
        stage_due = stage.now() + STEP;
    }
    Ok(())
}
