//! Connecting, and a stream of commands.

use fieldarm::engine::meca500::Event;
use fieldarm::wire::meca500::command::MotionCommand;
use fieldarm::wire::meca500::image::RobotStatusFlags;

use crate::cell::Cell;
use crate::checkers::End;
use crate::contract::BusKind;

/// Commands of a stream.
const COMMANDS: usize = 1_000;
/// Commands after which the engine places a checkpoint of its own.
const CHECKPOINT_EVERY: u64 = 16;

pub(crate) fn the_engine_comes_up_and_brings_the_robot_up(kind: impl BusKind) {
    let mut cell = Cell::running(kind);
    assert!(cell.plc.saw(|event| matches!(event, Event::Connected { again: false })));
    assert!(cell.plc.saw(|event| matches!(event, Event::ByteOrderSettled(_))));
    assert!(cell.plc.quality.is_fresh());
    let status = cell.plc.engine.status();
    assert!(status.ready && status.robot.contains(RobotStatusFlags::HOMED), "{cell:#?}");
    let joints = [10.0; 6];
    let ticket = cell.plc.submit(MotionCommand::MoveJoints(joints)).unwrap();
    cell.finish(10_000);
    assert_eq!(cell.plc.state(ticket).end, Some(End::Done));
    let reached = cell.robot().robot.target_joints();
    assert!(reached.iter().all(|joint| (joint - 10.0).abs() < 1e-4), "{reached:?}");
}

pub(crate) fn every_command_is_accepted_once_in_order_and_done(kind: impl BusKind) {
    let mut cell = Cell::running(kind);
    let began = cell.cycles;
    let limit = (COMMANDS as u64) * kind.cycles_per_command();
    let limit = limit + limit / CHECKPOINT_EVERY + 100;
    let mut tickets = Vec::new();
    cell.until("a stream at the pace of this bus", limit, |cell| {
        while tickets.len() < COMMANDS {
            let Some(ticket) = cell.submit_next() else { break };
            tickets.push(ticket);
        }
        tickets.len() == COMMANDS && cell.plc.tickets.unfinished() == 0
    });
    cell.judge();
    assert!(tickets.iter().all(|ticket| cell.plc.state(*ticket).end == Some(End::Done)));
    assert_eq!(cell.taken(), COMMANDS);
    assert!(cell.cycles - began >= COMMANDS as u64, "a handshake takes a cycle at least");
    assert!(!cell.plc.saw(|event| matches!(event, Event::ConnectionLost { .. })));
}
