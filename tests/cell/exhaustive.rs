//! Small handshakes, enumerated instead of sampled: every sequence of faults over the cycles in
//! which two commands go out, under each reading of the trigger.

use fieldarm::sim::fault::Fault;
use fieldarm::sim::meca500::readings::{MoveIdTrigger, NoMovementCommand};
use fieldarm::sim::meca500::{Readings, RobotSettings};

use crate::faults::heal;
use crate::harness::{Cell, Setup};
use crate::quick_robot::quick_robot;
use crate::streaming::numbered;

const CHOICES: [Option<Fault>; 6] = [
    None,
    Some(Fault::Stale),
    Some(Fault::Frozen),
    Some(Fault::Skipped),
    Some(Fault::Late),
    Some(Fault::LinkLoss),
];

/// Cycles in which each choice is tried: more in an optimised build.
const CYCLES: u32 = if cfg!(debug_assertions) { 4 } else { 6 };

fn every_sequence(readings: Readings, idle_cycles: u64) {
    let robot = RobotSettings { readings, ..quick_robot() };
    let mut start = Cell::running(Setup { robot, ..Setup::default() });
    start.steps(idle_cycles);
    for sequence in 0..CHOICES.len().pow(CYCLES) {
        let mut cell = start.clone();
        cell.submit(numbered(1)).unwrap();
        cell.submit(numbered(2)).unwrap();
        let mut rest = sequence;
        for _ in 0..CYCLES {
            if let Some(fault) = CHOICES[rest % CHOICES.len()] {
                cell.link.inject(fault, 1);
            }
            rest /= CHOICES.len();
            cell.step();
        }
        heal(&mut cell);
        cell.judge_acceptance();
    }
}

#[test]
fn every_sequence_of_faults_over_two_commands_compared_with_the_last_accepted() {
    every_sequence(Readings::default(), 10);
}

#[test]
fn every_sequence_of_faults_over_two_commands_compared_with_the_previous_cycle() {
    every_sequence(
        Readings { move_id_trigger: MoveIdTrigger::PreviousCycle, ..Readings::default() },
        10,
    );
}

#[test]
fn every_sequence_of_faults_over_two_commands_compared_while_set_point_was_1() {
    every_sequence(
        Readings {
            move_id_trigger: MoveIdTrigger::PreviousCycleWithSetPoint,
            ..Readings::default()
        },
        10,
    );
}

/// Right after the connection the handshake is still to be armed.
#[test]
fn every_sequence_of_faults_over_the_first_commands_without_an_echo_of_no_movement() {
    every_sequence(
        Readings { no_movement: NoMovementCommand::NotAcknowledged, ..Readings::default() },
        0,
    );
}
