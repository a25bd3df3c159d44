//! A bus that does everything a correct bus may do: nothing is lost, doubled or out of order, and
//! once it stops, everything ends.

use fieldarm::engine::meca500::{Action, ConnectionPhase};
use fieldarm::sim::fault::{Fault, FaultPlan};
use fieldarm::wire::order::ByteOrder;

use crate::checkers::End;
use crate::harness::{Cell, Setup};
use crate::quick_robot::quick_robot;
use crate::streaming::numbered;

/// Submits up to `count` distinguishable commands over `cycles` cycles of a faulty bus, then heals
/// the bus, recovers the robot and waits for the end of every ticket.
pub(crate) fn run_through(setup: Setup, count: u32, cycles: u64) -> Cell {
    let plan = setup.plan;
    let mut cell = Cell::running(Setup { plan: FaultPlan::NONE, ..setup });
    cell.link.set_plan(plan);
    let mut number = 0;
    for _ in 0..cycles {
        if number < count && cell.submit(numbered(number)).is_ok() {
            number += 1;
        }
        decide(&mut cell);
        cell.step();
    }
    heal(&mut cell);
    cell.judge_acceptance();
    cell
}

/// What a caller does when the fate of a command is unknown: it goes on.
fn decide(cell: &mut Cell) {
    if cell.engine.undecided() {
        cell.engine.proceed();
    }
}

/// A bus without faults from here on: every ticket must end.
pub(crate) fn heal(cell: &mut Cell) {
    cell.link.set_plan(FaultPlan::NONE);
    cell.until("end of all tickets", 60_000, |cell| {
        decide(cell);
        let status = cell.engine.status();
        let connected = status.phase == ConnectionPhase::Connected;
        if connected && !status.ready && !status.acting && cell.tickets.unfinished() > 0 {
            // Whatever holds the robot: the caller brings it back.
            let action = if status.error.is_set() { Action::Recover } else { Action::BringUp };
            cell.engine.request(action).unwrap();
        }
        cell.tickets.unfinished() == 0
    });
}

fn plan(faults: &'static [Fault]) -> FaultPlan {
    FaultPlan { faults, per_mille: 50, longest_cycles: 6 }
}

#[test]
fn every_single_fault_is_survived() {
    for (index, fault) in Fault::SURVIVABLE.iter().enumerate() {
        let faults = &Fault::SURVIVABLE[index..=index];
        for seed in 0..8 {
            let setup = Setup { plan: plan(faults), seed, ..Setup::default() };
            let cell = run_through(setup, 300, 1500);
            let done = cell
                .submitted
                .iter()
                .filter(|s| cell.state(s.ticket).end == Some(End::Done))
                .count();
            assert!(done > 20, "{fault:?}, seed {seed}: only {done} done\n{cell:#?}");
        }
    }
}

#[test]
fn all_faults_together_are_survived_in_every_byte_order() {
    for byte_order in ByteOrder::ALL {
        for seed in 0..10 {
            let mut robot = quick_robot();
            robot.byte_order = byte_order;
            let setup = Setup { plan: plan(Fault::SURVIVABLE), seed, robot, ..Setup::default() };
            run_through(setup, 300, 2000);
        }
    }
}

#[test]
fn long_outages_are_survived() {
    const OUTAGES: &[Fault] = &[Fault::LinkLoss, Fault::Stale, Fault::Zeroed, Fault::Frozen];
    for seed in 0..20 {
        let plan = FaultPlan { faults: OUTAGES, per_mille: 5, longest_cycles: 300 };
        let setup = Setup { plan, seed, ..Setup::default() };
        run_through(setup, 300, 4000);
    }
}

/// Wrong bytes cannot be told from right ones: here only the PLC's own rules are judged, and that
/// everything ends.
#[test]
fn corrupted_bytes_do_not_break_the_rules() {
    const ALL: &[Fault] = &[Fault::BitFlip, Fault::TornOutputs, Fault::LinkLoss];
    for seed in 0..20 {
        let plan = FaultPlan { faults: ALL, per_mille: 20, longest_cycles: 2 };
        let mut cell = Cell::running(Setup { seed, ..Setup::default() });
        cell.strict = false;
        cell.link.set_plan(plan);
        for number in 0..2000 {
            let _ = cell.submit(numbered(number));
            decide(&mut cell);
            cell.step();
        }
        heal(&mut cell);
    }
}
