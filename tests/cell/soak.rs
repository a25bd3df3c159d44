//! The long run: one cell after another, each on a bad bus with its own seed, with programs,
//! velocity moves, safety stops, reboots and PLC restarts, for ten million cycles in an optimised
//! build. A failure prints the seed; `FIELDARM_SOAK_SEED` replays one cell.

use std::env;

use fieldarm::engine::meca500::{Action, ConnectionPhase};
use fieldarm::sim::fault::{Fault, FaultPlan};
use fieldarm::sim::meca500::{Readings, RobotSettings};
use fieldarm::wire::meca500::command::{MotionCommand, VelocityCommand};
use fieldarm::wire::order::ByteOrder;

use crate::checkers::End;
use crate::harness::{Cell, Setup};
use crate::quick_robot::quick_robot;

/// Cycles of all cells together.
const TOTAL_CYCLES: u64 = if cfg!(debug_assertions) { 200_000 } else { 10_000_000 };
/// Cycles of one cell before it is healed and judged.
const CELL_CYCLES: u64 = 20_000;

/// What a caller and the people around the robot may do.
fn act(cell: &mut Cell, random: &mut fastrand::Rng, number: &mut u32) {
    match random.u32(0..2000) {
        0..400 => {
            *number += 1;
            let _ = cell.submit(MotionCommand::SetCartLinVel(100.0 + *number as f32 * 0.0625));
        }
        400..410 => {
            *number += 1;
            let mut joints = [0.0; 6];
            joints.fill_with(|| random.f32() * 20.0 - 10.0);
            let _ = cell.submit(MotionCommand::MoveJoints(joints));
        }
        410..414 => {
            let checkpoint = MotionCommand::SetCheckpoint(random.u16(1..=6000));
            let _ = cell.engine.submit(checkpoint).map(|ticket| cell.tickets.submitted(ticket));
        }
        414..430 => {
            let mut speeds = [0.0; 6];
            speeds.fill_with(|| random.f32() * 4.0 - 2.0);
            let _ = cell.engine.set_velocity(VelocityCommand::MoveJointsVel(speeds));
        }
        430 => cell.engine.stop_velocity(),
        431 => drop(cell.engine.request(Action::Pause)),
        432 => drop(cell.engine.request(Action::Clear)),
        433..436 => drop(cell.engine.request(Action::Resume)),
        436 => cell.robot().panel().press_p_stop2(),
        437..441 => cell.robot().panel().release_p_stop2(),
        441 if random.u8(0..4) == 0 => cell.robot().panel().press_e_stop(),
        442..446 => cell.robot().panel().release_e_stop(),
        446..450 => cell.robot().panel().press_reset(),
        450 if random.u8(0..8) == 0 => {
            cell.robot().panel().switch_off();
            cell.robot().panel().switch_on();
        }
        451 if random.u8(0..4) == 0 => drop(cell.engine.request(Action::Deactivate)),
        452..456 => drop(cell.engine.bring_up()),
        456..460 => drop(cell.engine.recover()),
        460..465 if cell.engine.undecided() => cell.engine.proceed(),
        465 if cell.engine.undecided() => cell.engine.discard_waiting(),
        _ => {}
    }
}

/// A good bus, nobody presses anything, and a caller that brings the robot back: all must end.
fn heal(cell: &mut Cell) {
    cell.link.set_plan(FaultPlan::NONE);
    cell.robot().panel().release_e_stop();
    cell.robot().panel().release_p_stop2();
    cell.robot().panel().switch_on();
    cell.until("end of all tickets and actions", 200_000, |cell| {
        if cell.engine.undecided() {
            cell.engine.proceed();
        }
        let status = cell.engine.status();
        let connected = status.phase == ConnectionPhase::Connected;
        if connected && !status.ready && !status.acting && !status.velocity_mode {
            cell.robot().panel().press_reset();
            let action = if status.error.is_set() { Action::Recover } else { Action::BringUp };
            let _ = cell.engine.request(action);
        }
        cell.tickets.unfinished() == 0 && !status.acting
    });
}

fn run_cell(seed: u64) -> (u64, usize) {
    let mut random = fastrand::Rng::with_seed(seed);
    let variations = Readings::variations().len();
    let readings = Readings::variations()
        .nth(random.usize(0..variations * 2))
        .map_or_else(Readings::default, |variation| variation.readings);
    let byte_order = ByteOrder::ALL[random.usize(0..4)];
    let robot = RobotSettings { readings, byte_order, ..quick_robot() };
    let plan = FaultPlan {
        faults: Fault::SURVIVABLE,
        per_mille: random.u16(0..60),
        longest_cycles: random.u32(1..40),
    };
    let mut cell = Cell::new(Setup { robot, plan, seed, ..Setup::default() }).forgetting();
    let mut number = 0;
    let mut done = 0;
    while cell.cycles < CELL_CYCLES {
        act(&mut cell, &mut random, &mut number);
        cell.step();
        if random.u32(0..15_000) == 0 {
            done += count_done(&cell);
            cell.restart_plc();
        }
    }
    heal(&mut cell);
    cell.judge_acceptance();
    done += count_done(&cell);
    (cell.cycles, done)
}

fn count_done(cell: &Cell) -> usize {
    cell.submitted.iter().filter(|s| cell.state(s.ticket).end == Some(End::Done)).count()
}

#[test]
fn ten_million_cycles_lose_nothing_and_double_nothing() {
    if let Some(seed) = env::var("FIELDARM_SOAK_SEED").ok().and_then(|seed| seed.parse().ok()) {
        println!("seed {seed}: {:?}", run_cell(seed));
        return;
    }
    let (mut cycles, mut done, mut seed) = (0, 0, 0);
    while cycles < TOTAL_CYCLES {
        seed += 1;
        let run = std::panic::catch_unwind(|| run_cell(seed));
        let Ok((cell_cycles, cell_done)) = run else {
            panic!("replay with FIELDARM_SOAK_SEED={seed}");
        };
        cycles += cell_cycles;
        done += cell_done;
    }
    println!("{seed} cells, {cycles} cycles, {done} commands done");
    assert!(done as u64 > cycles / 100, "the cells hardly work: {done} done in {cycles} cycles");
}
