//! A caller that polls late loses no final event, and nothing is sent that could not be reported.

#[path = "support/scripted_robot.rs"]
mod scripted_robot;

use fieldarm::engine::meca500::{CheckpointPolicy, Config, Event, SubmitError, WaitReason};
use scripted_robot::{Bench, final_ticket};

#[test]
fn nobody_polls_and_still_every_ticket_ends_once() {
    let config = Config { checkpoints: CheckpointPolicy::EachCommand, ..Config::default() };
    let mut bench = Bench::connected(config);
    bench.polls = false;
    let mut tickets = Vec::new();
    for round in 0..400 {
        while let Ok(ticket) = bench.engine.submit(scripted_robot::move_number(round % 170)) {
            tickets.push(ticket);
        }
        bench.steps(5);
        // The robot misbehaves all along.
        match round % 40 {
            7 => bench.robot.fail(1007),
            9 => {
                let _ = bench.engine.recover();
            }
            20 => bench.robot.p_stop2(true),
            22 => {
                bench.robot.resettable = fieldarm::wire::meca500::image::SafetyResettable::P_STOP2;
                let _ = bench.engine.request(fieldarm::engine::meca500::Action::Resume);
            }
            _ => {}
        }
        if round % 50 == 49 {
            bench.poll();
        }
    }
    bench.polls = true;
    bench.robot.error = 0;
    bench.until(3000, |bench| !bench.engine.status().acting);
    bench.engine.recover().unwrap();
    bench.until(5000, |bench| bench.engine.pending() == 0);
    assert!(tickets.len() > 200);
    for ticket in tickets {
        let ends = bench.events.iter().filter(|event| final_ticket(event) == Some(ticket)).count();
        assert_eq!(ends, 1, "{ticket:?}");
    }
    assert!(bench.saw(|event| matches!(event, Event::Merged { .. })));
}

#[test]
fn sending_stops_while_events_wait_and_goes_on_when_polled() {
    let config = Config { checkpoints: CheckpointPolicy::EachCommand, ..Config::default() };
    let mut bench = Bench::connected(config);
    bench.polls = false;
    let mut tickets = Vec::new();
    while let Ok(ticket) = bench.engine.submit(scripted_robot::move_number(1)) {
        tickets.push(ticket);
    }
    bench.steps(1000);
    let taken = bench.robot.taken.len();
    assert!(taken < 100, "{taken} of 128");
    bench.steps(1000);
    assert_eq!(bench.robot.taken.len(), taken);
    let refused = bench.engine.submit(scripted_robot::move_number(2));
    assert_eq!(refused, Err(SubmitError::EventsUnread));
    bench.polls = true;
    bench.until(1000, |bench| bench.engine.pending() == 0);
    for ticket in tickets {
        assert_eq!(bench.final_event(ticket), Some(Event::Done { ticket }));
    }
    assert!(!bench.saw_event(Event::Waiting(WaitReason::LedgerFull)));
}

#[test]
fn a_long_stream_flows_through_the_ledger() {
    let config = Config { checkpoints: CheckpointPolicy::WhenEmpty, ..Config::default() };
    let mut bench = Bench::connected(config);
    bench.robot.run_cycles = 2;
    let mut submitted = 0;
    for _ in 0..5000 {
        while submitted < 1000 && bench.engine.submit(scripted_robot::move_number(1)).is_ok() {
            submitted += 1;
        }
        bench.step();
    }
    assert_eq!(submitted, 1000);
    assert_eq!(bench.engine.pending(), 0);
    assert_eq!(bench.moves_executed().len(), 1000);
    let done = bench.events.iter().filter(|event| matches!(event, Event::Done { .. })).count();
    assert_eq!(done, 1000);
}
