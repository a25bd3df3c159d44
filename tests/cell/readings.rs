//! Where the manual leaves a behaviour open, the engine must be right under every reading: each
//! switch of the robot in turn, on a good bus and on a bad one.

use fieldarm::engine::meca500::{Event, WaitReason};
use fieldarm::sim::fault::{Fault, FaultPlan};
use fieldarm::sim::meca500::Readings;
use fieldarm::sim::meca500::RobotSettings;
use fieldarm::sim::meca500::readings::Variation;
use fieldarm::wire::meca500::command::MotionCommand;

use crate::checkers::End;
use crate::faults::run_through;
use crate::harness::{Cell, Setup};
use crate::quick_robot::quick_robot;
use crate::streaming::numbered;

/// Runs `test` under each reading, and fails with the list of those it failed under.
fn each(mut test: impl FnMut(RobotSettings)) {
    assert!(Readings::variations().len() > 40, "the robot has its switches");
    let mut failed = Vec::new();
    for Variation { contradiction, switch, value, readings } in Readings::variations() {
        let robot = RobotSettings { readings, ..quick_robot() };
        let run = std::panic::AssertUnwindSafe(|| test(robot));
        if std::panic::catch_unwind(run).is_err() {
            failed.push(format!("#{contradiction} {switch} = {value}"));
        }
    }
    assert!(failed.is_empty(), "failed under:\n{}", failed.join("\n"));
}

#[test]
fn a_program_runs_to_its_end_under_every_reading() {
    each(|robot| {
        let mut cell = Cell::running(Setup { robot, ..Setup::default() });
        let mut tickets = Vec::new();
        for number in 0..40 {
            tickets.push(cell.submit(numbered(number)).unwrap());
        }
        tickets
            .push(cell.submit(MotionCommand::MoveJoints([5.0, 4.0, 3.0, 2.0, 1.0, 0.0])).unwrap());
        tickets.push(cell.submit(MotionCommand::SetCheckpoint(7)).unwrap());
        tickets.push(cell.submit(MotionCommand::SetCheckpoint(7)).unwrap());
        tickets.push(cell.submit(MotionCommand::MoveJoints([0.0; 6])).unwrap());
        cell.finish(20_000);
        for ticket in tickets {
            assert_eq!(cell.state(ticket).end, Some(End::Done), "{ticket:?}\n{cell:#?}");
        }
        let sevens = cell
            .events
            .iter()
            .filter(|event| **event == Event::CheckpointReached { number: 7 })
            .count();
        assert_eq!(sevens, 2, "{cell:#?}");
        cell.judge_acceptance();
    });
}

#[test]
fn faults_are_survived_under_every_reading() {
    each(|robot| {
        for seed in 0..3 {
            let plan = FaultPlan { faults: Fault::SURVIVABLE, per_mille: 30, longest_cycles: 20 };
            run_through(Setup { plan, seed, robot: robot.clone(), ..Setup::default() }, 150, 1200);
        }
    });
}

#[test]
fn pause_clear_and_resume_work_under_every_reading() {
    each(|robot| {
        let mut cell = Cell::running(Setup { robot, ..Setup::default() });
        let far = cell.submit(MotionCommand::MoveJoints([60.0, 0.0, 0.0, 0.0, 0.0, 0.0])).unwrap();
        cell.steps(150);
        crate::recovery::act(&mut cell, fieldarm::engine::meca500::Action::Pause);
        cell.steps(300);
        assert_eq!(cell.state(far).end, None, "a paused move goes on later");
        crate::recovery::act(&mut cell, fieldarm::engine::meca500::Action::Resume);
        cell.finish(20_000);
        assert_eq!(cell.state(far).end, Some(End::Done));

        let back = cell.submit(MotionCommand::MoveJoints([0.0; 6])).unwrap();
        cell.steps(150);
        crate::recovery::act(&mut cell, fieldarm::engine::meca500::Action::Clear);
        cell.finish(5_000);
        assert_eq!(cell.state(back).end, Some(End::Aborted));
        crate::recovery::act(&mut cell, fieldarm::engine::meca500::Action::Resume);
        let again = cell.submit(numbered(1)).unwrap();
        cell.finish(5_000);
        assert_eq!(cell.state(again).end, Some(End::Done));
        assert!(!cell.saw(|event| matches!(event, Event::Waiting(WaitReason::Undecided))));
    });
}

#[test]
fn an_error_of_the_robot_ends_what_is_lost_and_recovers_under_every_reading() {
    each(|robot| {
        let mut cell = Cell::running(Setup { robot, ..Setup::default() });
        let unreachable =
            fieldarm::wire::meca500::command::Pose::from([900.0, 0.0, 900.0, 0.0, 90.0, 0.0]);
        let good = cell.submit(MotionCommand::MoveJoints([3.0, 0.0, 0.0, 0.0, 0.0, 0.0])).unwrap();
        let bad = cell.submit(MotionCommand::MovePose(unreachable)).unwrap();
        let after = cell.submit(MotionCommand::MoveJoints([9.0; 6])).unwrap();
        cell.finish(20_000);
        assert_eq!(cell.state(bad).end, Some(End::Aborted), "{cell:#?}");
        assert_ne!(cell.state(after).end, Some(End::Done), "{cell:#?}");
        assert_ne!(cell.state(good).end, None);
        assert!(cell.saw(|event| matches!(event, Event::RobotError { .. })));
        crate::recovery::act(&mut cell, fieldarm::engine::meca500::Action::Recover);
        let again = cell.submit(numbered(1)).unwrap();
        cell.finish(5_000);
        assert_eq!(cell.state(again).end, Some(End::Done), "{cell:#?}");
    });
}
