//! Either end starts anew: a PLC that meets a robot with an old MoveID, a robot that reboots in
//! the middle of a program.

use fieldarm::engine::meca500::{AbortReason, Action, Event};
use fieldarm::sim::fault::{Fault, FaultPlan};
use fieldarm::sim::meca500::readings::TimestampAfterBoot;
use fieldarm::sim::meca500::{Readings, RobotSettings};
use fieldarm::time::Duration;
use fieldarm::wire::meca500::command::MotionCommand;
use fieldarm::wire::meca500::image::FirmwareLayout;

use crate::checkers::End;
use crate::harness::{Cell, Setup};
use crate::quick_robot::quick_robot;
use crate::recovery::act;
use crate::streaming::numbered;

fn connect(cell: &mut Cell) {
    cell.events.clear();
    cell.until("a connection", 2_000, |cell| {
        cell.saw(|event| matches!(event, Event::Connected { .. }))
    });
}

#[test]
fn a_new_plc_meets_an_old_move_id() {
    for variation in Readings::variations() {
        let robot = RobotSettings { readings: variation.readings, ..quick_robot() };
        let mut cell = Cell::running(Setup { robot, ..Setup::default() });
        for number in 0..5 {
            cell.submit(numbered(number)).unwrap();
        }
        cell.finish(2_000);
        for life in 1..4 {
            let taken = cell.witness.accepted().len();
            cell.restart_plc();
            cell.steps(5);
            assert_eq!(
                cell.witness.accepted().len(),
                taken,
                "nothing runs by itself: {variation:?}"
            );
            connect(&mut cell);
            act(&mut cell, Action::BringUp);
            let next = cell.submit(numbered(100 + life)).unwrap();
            cell.finish(2_000);
            assert_eq!(cell.state(next).end, Some(End::Done), "{variation:?}");
            cell.judge_acceptance();
        }
    }
}

#[test]
fn a_new_plc_finds_the_queue_of_the_old_one_and_completes_its_own() {
    let mut cell = Cell::running(Setup::default());
    for angle in [40.0, 0.0, 40.0, 0.0] {
        cell.submit(MotionCommand::MoveJoints([angle, 0.0, 0.0, 0.0, 0.0, 0.0])).unwrap();
    }
    cell.steps(50);
    cell.restart_plc();
    connect(&mut cell);
    act(&mut cell, Action::BringUp);
    let own = cell.submit(MotionCommand::MoveJoints([20.0, 0.0, 0.0, 0.0, 0.0, 0.0])).unwrap();
    cell.finish(60_000);
    assert_eq!(cell.state(own).end, Some(End::Done));
    let joints = cell.robot().target_joints();
    assert!((joints[0] - 20.0).abs() < 1e-4, "done means done: {joints:?}");
}

#[test]
fn a_reboot_in_the_middle_of_a_program_aborts_it_and_nothing_runs_twice() {
    for seed in 0..20 {
        let mut cell = Cell::running(Setup { seed, ..Setup::default() });
        let mut tickets = Vec::new();
        for number in 0..30 {
            tickets.push(cell.submit(numbered(number)).unwrap());
        }
        cell.steps(3 + seed);
        cell.robot().panel().switch_off();
        cell.steps(20 * (seed % 3));
        cell.robot().panel().switch_on();
        cell.finish(20_000);
        let told = cell.saw(|event| {
            matches!(
                event,
                Event::RobotRebooted
                    | Event::Aborted {
                        reason: AbortReason::RobotRebooted | AbortReason::Deactivated,
                        ..
                    }
                    | Event::ConnectionLost { .. }
            )
        });
        assert!(told, "{cell:#?}");
        assert!(tickets.iter().any(|ticket| cell.state(*ticket).end != Some(End::Done)));
        cell.judge_acceptance();
        cell.until("the robot back", 20_000, |cell| {
            let status = cell.engine.status();
            status.phase == fieldarm::engine::meca500::ConnectionPhase::Connected
        });
        cell.steps(200);
        cell.robot().panel().press_reset();
        cell.steps(20);
        act(&mut cell, Action::BringUp);
        let next = cell.submit(numbered(1000)).unwrap();
        cell.finish(2_000);
        assert_eq!(cell.state(next).end, Some(End::Done));
    }
}

#[test]
fn a_reboot_that_was_asked_for_is_confirmed_however_long_it_takes() {
    for timestamp_after_boot in [TimestampAfterBoot::Restarts, TimestampAfterBoot::Continues] {
        for (boot_ms, cycles_before) in [(5_000, 0), (5_000, 9_000), (100, 0), (100, 3_000)] {
            let readings = Readings { timestamp_after_boot, ..Readings::default() };
            let mut robot = RobotSettings { readings, ..quick_robot() };
            robot.times.boot = Duration::from_millis(boot_ms);
            let mut cell = Cell::new(Setup { robot, ..Setup::default() });
            connect(&mut cell);
            cell.steps(cycles_before);
            let before = cell.cycles;
            act(&mut cell, Action::Reboot);
            assert!(cell.cycles - before >= boot_ms, "done before the robot was back");
            assert!(cell.saw(|event| matches!(event, Event::RobotRebooted)));
            connect(&mut cell);
            cell.robot().panel().press_reset();
            cell.steps(20);
            act(&mut cell, Action::BringUp);
            let next = cell.submit(numbered(1)).unwrap();
            cell.finish(2_000);
            assert_eq!(cell.state(next).end, Some(End::Done));
        }
    }
}

#[test]
fn a_loss_in_the_middle_of_a_handshake_has_a_verdict() {
    for variation in Readings::variations() {
        for at in 0..6 {
            let robot = RobotSettings { readings: variation.readings, ..quick_robot() };
            let mut cell = Cell::running(Setup { robot, ..Setup::default() });
            for number in 0..4 {
                cell.submit(numbered(number)).unwrap();
            }
            cell.steps(at);
            cell.link.inject(Fault::LinkLoss, 40);
            cell.steps(45);
            cell.link.set_plan(FaultPlan::NONE);
            crate::faults::heal(&mut cell);
            cell.judge_acceptance();
        }
    }
}

/// What became of the queue while the PLC was away cannot be known without a checkpoint of before.
#[test]
fn a_queue_lost_while_the_link_was_down_is_not_reported_as_done() {
    for layout in [FirmwareLayout::V11_3, FirmwareLayout::V10_2] {
        let mut setup = Setup::default();
        setup.config.layout = layout;
        setup.robot.layout = layout;
        let mut cell = Cell::running(setup);
        let far = cell.submit(MotionCommand::MoveJoints([60.0, 0.0, 0.0, 0.0, 0.0, 0.0])).unwrap();
        let farther = cell.submit(MotionCommand::MoveJoints([30.0; 6])).unwrap();
        cell.steps(1);
        cell.until("both commands at the robot", 20, |cell| cell.state(farther).accepted);
        cell.link.inject(Fault::LinkLoss, 400);
        cell.steps(200);
        cell.robot().clear_motion().unwrap();
        cell.steps(190);
        let _ = cell.robot().resume_motion();
        crate::faults::heal(&mut cell);
        for ticket in [far, farther] {
            assert_ne!(cell.state(ticket).end, Some(End::Done), "{layout:?}\n{cell:#?}");
        }
        act(&mut cell, Action::BringUp);
        let next = cell.submit(numbered(1)).unwrap();
        cell.finish(5_000);
        assert_eq!(cell.state(next).end, Some(End::Done), "{layout:?}");
    }
}

#[test]
fn a_new_plc_never_takes_an_old_checkpoint_for_its_own() {
    for user_checkpoint in [false, true] {
        for phase in 0..40 {
            let mut cell = Cell::running(Setup::default());
            if user_checkpoint {
                cell.submit(MotionCommand::SetCheckpoint(5)).unwrap();
            }
            for _ in 0..30 {
                cell.submit(MotionCommand::MoveJointsRel([0.2; 6])).unwrap();
            }
            cell.steps(40 + phase * 7);
            cell.restart_plc();
            cell.events.clear();
            cell.until("a connection", 2_000, |cell| {
                cell.saw(|event| matches!(event, Event::Connected { .. }))
            });
            act(&mut cell, Action::BringUp);
            let own =
                cell.submit(MotionCommand::MoveJoints([-40.0, 0.0, 0.0, 0.0, 0.0, 0.0])).unwrap();
            cell.finish(60_000);
            assert_eq!(cell.state(own).end, Some(End::Done));
            let joint = cell.robot().target_joints()[0];
            assert!((joint + 40.0).abs() < 1e-4, "done at {joint} deg, phase {phase}");
        }
    }
}
