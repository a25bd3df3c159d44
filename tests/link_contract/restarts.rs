//! Either end starts anew.

use fieldarm::cycle::{CyclicDevice, InputQuality};
use fieldarm::engine::meca500::{Action, Event};
use fieldarm::time::Duration;
use fieldarm::wire::meca500::command::MotionCommand;

use crate::cell::Cell;
use crate::checkers::End;
use crate::contract::{Ability, BusKind, PlcEnd, cannot};

pub(crate) fn a_robot_that_loses_its_power_comes_back(kind: impl BusKind) {
    let mut cell = Cell::running(kind);
    for off_cycles in [0, 5, 150] {
        for at in [0, 1, 2, 5] {
            cell.label = format!("{kind:?}: off after {at} cycles, for {off_cycles}");
            for _ in 0..30 {
                cell.submit_next().unwrap();
            }
            cell.plc.events.clear();
            cell.steps(at);
            cell.robot().robot.panel().switch_off();
            cell.steps(off_cycles);
            cell.robot().robot.panel().switch_on();
            cell.until("told", 2_000, |cell| {
                cell.plc.saw(|event| {
                    matches!(event, Event::RobotRebooted | Event::ConnectionLost { .. })
                })
            });
            cell.finish(20_000);
            cell.bring_up();
            let next = cell.submit_next().unwrap();
            cell.finish(2_000);
            assert_eq!(cell.plc.state(next).end, Some(End::Done), "{cell:#?}");
        }
    }
}

pub(crate) fn a_robot_that_leaves_by_command_is_lost_until_it_is_switched_back(kind: impl BusKind) {
    if cannot(kind, Ability::LeaveByCommand) {
        return;
    }
    let mut cell = Cell::running(kind);
    cell.submit_next().unwrap();
    cell.finish(100);
    cell.plc.engine.request(Action::DisableEtherCat).unwrap();
    cell.until("told that it left", 2_000, |cell| {
        cell.plc.saw(|event| *event == Event::ActionDone(Action::DisableEtherCat))
    });
    assert!(!cell.robot().is_on_bus());
    for _ in 0..1_000 {
        cell.step();
        assert_eq!(cell.plc.quality, InputQuality::Lost, "{cell:#?}");
    }
    // Somebody sends SwitchToEtherCAT on the text port and restarts the robot.
    let robot = &mut cell.robot().robot;
    robot.persistent_mut().ethercat_enabled = true;
    robot.panel().switch_off();
    cell.steps(10);
    cell.robot().robot.panel().switch_on();
    cell.bring_up();
    let next = cell.submit_next().unwrap();
    cell.finish(2_000);
    assert_eq!(cell.plc.state(next).end, Some(End::Done), "{cell:#?}");
}

const ENDS: [PlcEnd; 2] = [PlcEnd::Closed, PlcEnd::Died];
const AWAY: [Duration; 3] =
    [Duration::ZERO, Duration::from_millis(60), Duration::from_millis(3_000)];

pub(crate) fn a_new_plc_finds_a_robot_without_a_queue(kind: impl BusKind) {
    let mut cell = Cell::running(kind);
    for end in ENDS {
        for away in AWAY {
            cell.label = format!("{kind:?}: {end:?}, away for {away:?}");
            for _ in 0..5 {
                cell.submit_next().unwrap();
            }
            cell.finish(1_000);
            let taken = cell.taken();
            cell.restart_plc(end, away);
            cell.steps(20);
            assert_eq!(cell.taken(), taken, "something ran by itself\n{cell:#?}");
            cell.bring_up();
            let own = cell.submit_next().unwrap();
            cell.finish(2_000);
            assert_eq!(cell.plc.state(own).end, Some(End::Done), "{cell:#?}");
            assert_eq!(cell.taken(), taken + 1);
        }
    }
}

pub(crate) fn a_new_plc_finds_the_queue_of_the_old_one(kind: impl BusKind) {
    let mut cell = Cell::running(kind);
    // Every angle once, so that no life's commands look like another's.
    let mut life = 0.0;
    for end in ENDS {
        for away in AWAY {
            cell.label = format!("{kind:?}: {end:?}, away for {away:?}, with a queue");
            life += 1.0;
            for angle in [40.0 + life, life, 50.0 + life, 10.0 + life] {
                let joints = [angle, 0.0, 0.0, 0.0, 0.0, 0.0];
                cell.plc.submit(MotionCommand::MoveJoints(joints)).unwrap();
            }
            cell.steps(50);
            assert!(cell.plc.engine.status().on_robot >= 4, "no queue is left\n{cell:#?}");
            cell.restart_plc(end, away);
            cell.bring_up();
            let goal = 20.0 + life;
            let joints = [goal, 0.0, 0.0, 0.0, 0.0, 0.0];
            let own = cell.plc.submit(MotionCommand::MoveJoints(joints)).unwrap();
            cell.finish(60_000);
            assert_eq!(cell.plc.state(own).end, Some(End::Done), "{cell:#?}");
            let joint = cell.robot().robot.target_joints()[0];
            assert!((joint - f64::from(goal)).abs() < 1e-4, "done at {joint} degrees\n{cell:#?}");
        }
    }
}
