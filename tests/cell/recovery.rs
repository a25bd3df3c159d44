//! From every stop back to motion: errors, safety signals, deactivation, with the robot's panel.

use fieldarm::engine::meca500::{AbortReason, Action, ConnectionPhase, Event};
use fieldarm::sim::meca500::RobotSettings;
use fieldarm::wire::meca500::command::MotionCommand;
use fieldarm::wire::meca500::image::{RobotStatusFlags, SafetySignals};
use fieldarm::wire::meca500::revision::Revision;

use crate::checkers::End;
use crate::harness::{Cell, Setup};
use crate::quick_robot::quick_robot;
use crate::streaming::numbered;

/// Requests `action` and waits until it is done; a failure fails the test.
pub(crate) fn act(cell: &mut Cell, action: Action) {
    let before = cell.events.len();
    cell.engine.request(action).unwrap();
    cell.until("end of the action", 40_000, |cell| {
        cell.events.iter().skip(before).any(|event| match *event {
            Event::ActionDone(done) => done == action,
            Event::ActionFailed { action: failed, fault } => {
                panic!("{failed:?} failed: {fault:?}\n{cell:#?}")
            }
            _ => false,
        })
    });
}

fn robot_of(revision: Revision) -> Setup {
    Setup { robot: RobotSettings { revision, ..quick_robot() }, ..Setup::default() }
}

#[test]
fn bring_up_activates_homes_and_leaves_a_robot_that_moves() {
    let mut cell = Cell::running(Setup::default());
    let status = cell.engine.status();
    assert!(status.ready && status.robot.contains(RobotStatusFlags::HOMED));
    cell.submit(MotionCommand::MoveJoints([10.0; 6])).unwrap();
    cell.finish(10_000);
    let joints = cell.robot().target_joints();
    assert!(joints.iter().all(|joint| (joint - 10.0).abs() < 1e-4), "{joints:?}");
}

#[test]
fn bring_up_of_a_robot_that_is_up_does_nothing() {
    let mut cell = Cell::running(Setup::default());
    let before = cell.cycles;
    act(&mut cell, Action::BringUp);
    assert!(cell.cycles - before < 10, "took {} cycles", cell.cycles - before);
}

#[test]
fn a_p_stop_2_aborts_what_it_clears_and_resume_resets_it() {
    let mut cell = Cell::running(Setup::default());
    let far = cell.submit(MotionCommand::MoveJoints([90.0, 0.0, 0.0, 0.0, 0.0, 0.0])).unwrap();
    cell.steps(200);
    cell.robot().panel().press_p_stop2();
    cell.finish(2_000);
    assert_eq!(cell.state(far).end, Some(End::Aborted));
    assert!(
        cell.saw(|event| matches!(event, Event::Aborted { reason: AbortReason::SafetyStop, .. }))
    );
    assert!(cell.engine.status().stops.contains(SafetySignals::P_STOP2));
    cell.robot().panel().release_p_stop2();
    cell.steps(10);
    act(&mut cell, Action::Resume);
    assert!(cell.engine.status().stops.is_empty());
    let next = cell.submit(numbered(1)).unwrap();
    cell.finish(2_000);
    assert_eq!(cell.state(next).end, Some(End::Done));
}

#[test]
fn resume_fails_with_a_fault_while_a_p_stop_2_is_pressed() {
    let mut cell = Cell::running(Setup::default());
    cell.robot().panel().press_p_stop2();
    cell.steps(50);
    cell.engine.request(Action::Resume).unwrap();
    cell.until("a failed action", 20_000, |cell| {
        cell.saw(|event| matches!(event, Event::ActionFailed { action: Action::Resume, .. }))
    });
    assert!(!cell.saw(|event| matches!(event, Event::ActionDone(Action::Resume))));
}

#[test]
fn an_e_stop_of_revision_4_needs_release_reset_and_activation_but_no_homing() {
    let mut cell = Cell::running(robot_of(Revision::R4));
    let far = cell.submit(MotionCommand::MoveJoints([90.0, 0.0, 0.0, 0.0, 0.0, 0.0])).unwrap();
    cell.steps(200);
    cell.robot().panel().press_e_stop();
    cell.finish(3_000);
    assert_eq!(cell.state(far).end, Some(End::Aborted));
    cell.steps(500);
    assert!(!cell.engine.status().robot.contains(RobotStatusFlags::ACTIVATED));
    cell.robot().panel().release_e_stop();
    cell.steps(20);
    cell.robot().panel().press_reset();
    cell.steps(20);
    act(&mut cell, Action::BringUp);
    let next = cell.submit(numbered(1)).unwrap();
    cell.finish(2_000);
    assert_eq!(cell.state(next).end, Some(End::Done));
}

#[test]
fn an_e_stop_of_revision_3_switches_the_robot_off() {
    let mut cell = Cell::running(robot_of(Revision::R3));
    let far = cell.submit(MotionCommand::MoveJoints([90.0, 0.0, 0.0, 0.0, 0.0, 0.0])).unwrap();
    cell.steps(200);
    cell.robot().panel().press_e_stop();
    cell.steps(3_000);
    cell.robot().panel().release_e_stop();
    cell.robot().panel().switch_on();
    cell.finish(5_000);
    assert_ne!(cell.state(far).end, Some(End::Done));
    cell.until("a connection", 5_000, |cell| {
        cell.engine.status().phase == ConnectionPhase::Connected
    });
    cell.robot().panel().press_reset();
    cell.steps(20);
    act(&mut cell, Action::BringUp);
    let next = cell.submit(numbered(1)).unwrap();
    cell.finish(2_000);
    assert_eq!(cell.state(next).end, Some(End::Done));
}

#[test]
fn a_deactivated_robot_aborts_and_comes_back() {
    let mut cell = Cell::running(Setup::default());
    let far = cell.submit(MotionCommand::MoveJoints([90.0, 0.0, 0.0, 0.0, 0.0, 0.0])).unwrap();
    cell.steps(100);
    act(&mut cell, Action::Deactivate);
    cell.finish(1_000);
    assert_eq!(cell.state(far).end, Some(End::Aborted));
    act(&mut cell, Action::BringUp);
    let next = cell.submit(numbered(1)).unwrap();
    cell.finish(2_000);
    assert_eq!(cell.state(next).end, Some(End::Done));
}

#[test]
fn simulation_and_recovery_mode_are_levels_with_a_confirmation() {
    let mut cell = Cell::running(Setup::default());
    act(&mut cell, Action::RecoveryMode(true));
    assert!(cell.engine.status().robot.contains(RobotStatusFlags::RECOVERY_MODE));
    act(&mut cell, Action::RecoveryMode(false));
    assert!(!cell.engine.status().robot.contains(RobotStatusFlags::RECOVERY_MODE));
    act(&mut cell, Action::Deactivate);
    act(&mut cell, Action::Simulation(true));
    assert!(cell.engine.status().robot.contains(RobotStatusFlags::SIM_ACTIVATED));
    act(&mut cell, Action::BringUp);
    assert!(cell.engine.status().robot.contains(RobotStatusFlags::SIM_ACTIVATED));
}
