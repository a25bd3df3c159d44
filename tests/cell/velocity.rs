//! Velocity mode against the robot: it moves while refreshed, stops when not, and leaves position
//! commands alone.

use fieldarm::engine::meca500::{Action, Event, VelocityStop};
use fieldarm::sim::fault::{Fault, FaultPlan};
use fieldarm::sim::meca500::{Readings, RobotSettings};
use fieldarm::time::Duration;
use fieldarm::wire::meca500::command::{MotionCommand, VelocityCommand};

use crate::checkers::End;
use crate::harness::{Cell, Setup};
use crate::quick_robot::quick_robot;
use crate::recovery::act;
use crate::streaming::numbered;

const TURN: VelocityCommand = VelocityCommand::MoveJointsVel([20.0, 0.0, 0.0, 0.0, 0.0, 0.0]);

fn joint_1(cell: &mut Cell) -> f64 {
    cell.robot().target_joints()[0]
}

fn drive(cell: &mut Cell, cycles: u64) {
    for _ in 0..cycles {
        cell.engine.set_velocity(TURN).unwrap();
        cell.step();
    }
}

/// Steps until joint 1 stands still; how far it went meanwhile.
fn stand_still(cell: &mut Cell) -> f64 {
    let start = joint_1(cell);
    let mut before = f64::NAN;
    cell.until("standstill", 5_000, |cell| {
        let now = joint_1(cell);
        let stands = now == before;
        before = now;
        stands
    });
    joint_1(cell) - start
}

#[test]
fn it_moves_while_refreshed_and_stops_when_asked_under_every_reading() {
    for variation in Readings::variations() {
        let robot = RobotSettings { readings: variation.readings, ..quick_robot() };
        let mut cell = Cell::running(Setup { robot, ..Setup::default() });
        drive(&mut cell, 500);
        let moved = joint_1(&mut cell);
        assert!((5.0..10.5).contains(&moved), "{moved} deg in half a second: {variation:?}");
        cell.engine.stop_velocity();
        let further = stand_still(&mut cell);
        assert!(further < 3.0, "{further} deg after the stop: {variation:?}");
        let next = cell.submit(numbered(1)).unwrap();
        cell.finish(2_000);
        assert_eq!(cell.state(next).end, Some(End::Done), "{variation:?}");
    }
}

#[test]
fn a_caller_that_falls_silent_stops_the_robot() {
    let mut cell = Cell::running(Setup::default());
    drive(&mut cell, 300);
    let dead_man = cell.setup().config.velocity_dead_man;
    let cycles = dead_man.as_millis() as u64 + 2;
    cell.steps(cycles);
    assert!(cell.saw(|event| *event == Event::VelocityStopped(VelocityStop::DeadMan)));
    stand_still(&mut cell);
}

#[test]
fn bad_inputs_stop_the_robot() {
    let mut cell = Cell::running(Setup::default());
    drive(&mut cell, 300);
    cell.link.inject(Fault::Stale, 200);
    for _ in 0..60 {
        let _ = cell.engine.set_velocity(TURN);
        cell.step();
    }
    stand_still(&mut cell);
}

#[test]
fn a_position_command_waits_until_velocity_mode_is_left() {
    let mut cell = Cell::running(Setup::default());
    drive(&mut cell, 200);
    let back = cell.submit(MotionCommand::MoveJoints([0.0; 6])).unwrap();
    drive(&mut cell, 200);
    assert!(!cell.state(back).accepted, "not while the velocity is refreshed");
    cell.engine.stop_velocity();
    cell.finish(5_000);
    assert_eq!(cell.state(back).end, Some(End::Done));
    assert!(joint_1(&mut cell).abs() < 1e-4);
}

#[test]
fn pausing_ends_velocity_mode() {
    let mut cell = Cell::running(Setup::default());
    drive(&mut cell, 200);
    act(&mut cell, Action::Pause);
    stand_still(&mut cell);
    act(&mut cell, Action::Resume);
    assert!(stand_still(&mut cell).abs() < 1e-9, "resuming does not take the velocity up again");
}

#[test]
fn modes_alternate_on_a_bad_bus() {
    for seed in 0..10 {
        let plan = FaultPlan { faults: Fault::SURVIVABLE, per_mille: 20, longest_cycles: 4 };
        let mut cell = Cell::running(Setup { seed, ..Setup::default() });
        cell.link.set_plan(plan);
        for round in 0..8 {
            for number in 0..5 {
                let _ = cell.submit(numbered(round * 5 + number));
            }
            for _ in 0..60 {
                let _ = cell.engine.set_velocity(TURN);
                cell.step();
            }
            cell.engine.stop_velocity();
            cell.steps(60);
        }
        crate::faults::heal(&mut cell);
        cell.judge_acceptance();
    }
}

#[test]
fn the_dead_man_time_is_the_callers() {
    let mut setup = Setup::default();
    setup.config.velocity_dead_man = Duration::from_millis(500);
    let mut cell = Cell::running(setup);
    drive(&mut cell, 10);
    cell.steps(400);
    assert!(!cell.saw(|event| matches!(event, Event::VelocityStopped(_))));
    cell.steps(200);
    assert!(cell.saw(|event| matches!(event, Event::VelocityStopped(VelocityStop::DeadMan))));
}
