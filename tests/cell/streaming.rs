//! A stream of commands through the handshake: order, pace, completion.

use fieldarm::engine::meca500::Event;
use fieldarm::wire::meca500::command::MotionCommand;

use crate::checkers::End;
use crate::harness::{Cell, Setup};

/// A settings command unlike any other of the run.
pub(crate) fn numbered(number: u32) -> MotionCommand {
    MotionCommand::SetCartLinVel(100.0 + number as f32 * 0.25)
}

#[test]
fn one_command_is_accepted_each_cycle() {
    let mut cell = Cell::running(Setup::default());
    cell.submit(numbered(0)).unwrap();
    cell.finish(100);
    cell.events.clear();
    for number in 1..=15 {
        cell.submit(numbered(number)).unwrap();
    }
    let mut accepted_each_cycle = Vec::new();
    for _ in 0..18 {
        cell.events.clear();
        cell.step();
        accepted_each_cycle
            .push(cell.events.iter().filter(|e| matches!(e, Event::Accepted { .. })).count());
    }
    assert_eq!(accepted_each_cycle[1..16], [1; 15], "{accepted_each_cycle:?}");
    assert!(cell.events.iter().all(|e| !matches!(e, Event::Accepted { latency_cycles: 2.., .. })));
}

#[test]
fn everything_submitted_is_taken_once_in_order_and_done() {
    let mut cell = Cell::running(Setup::default());
    let mut number = 0;
    cell.until("room for 2000 commands", 20_000, |cell| {
        while number < 2000 && cell.submit(numbered(number)).is_ok() {
            number += 1;
        }
        number == 2000
    });
    cell.finish(10_000);
    for submitted in cell.submitted.clone() {
        assert_eq!(cell.state(submitted.ticket).end, Some(End::Done));
    }
    cell.judge_acceptance();
    let taken = cell.witness.accepted().iter().filter(|(id, _)| *id == 11).count();
    assert_eq!(taken, 2000);
}
