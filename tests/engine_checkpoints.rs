//! Completion by checkpoints: automatic numbers, user numbers, several at once, repeated, discarded.

#[path = "support/scripted_robot.rs"]
mod scripted_robot;

use fieldarm::engine::meca500::{
    AbortReason, Action, CheckpointPolicy, CheckpointRange, Config, Event, UnknownCause,
};
use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::command::MotionCommand;
use fieldarm::wire::meca500::image::{FirmwareLayout, SafetyResettable};
use scripted_robot::{Bench, Robot};

fn with_policy(checkpoints: CheckpointPolicy) -> Config {
    Config { checkpoints, ..Config::default() }
}

fn checkpoints_sent(bench: &Bench) -> Vec<u16> {
    bench.robot.taken.iter().filter(|(_, id, _)| *id == 17).map(|(_, _, a)| a[0] as u16).collect()
}

#[test]
fn each_policy_finishes_everything_in_order() {
    for policy in [
        CheckpointPolicy::EachCommand,
        CheckpointPolicy::Every(1),
        CheckpointPolicy::Every(7),
        CheckpointPolicy::WhenEmpty,
    ] {
        for run_cycles in [0, 1, 4] {
            let mut bench = Bench::connected(with_policy(policy));
            bench.robot.run_cycles = run_cycles;
            let tickets: Vec<_> = (1..=50).map(|number| bench.submit_move(number)).collect();
            bench.until(2000, |bench| bench.engine.pending() == 0);
            let done: Vec<_> = bench
                .events
                .iter()
                .filter_map(|event| match event {
                    Event::Done { ticket } => Some(*ticket),
                    _ => None,
                })
                .collect();
            assert_eq!(done, tickets, "{policy:?} {run_cycles}");
            let expected = match policy {
                CheckpointPolicy::EachCommand | CheckpointPolicy::Every(1) => 50,
                CheckpointPolicy::Every(count) => 50 / usize::from(count) + 1,
                CheckpointPolicy::WhenEmpty => 1,
            };
            assert_eq!(checkpoints_sent(&bench).len(), expected, "{policy:?}");
        }
    }
}

#[test]
fn a_command_is_not_done_before_it_ran() {
    let mut bench = Bench::connected(with_policy(CheckpointPolicy::EachCommand));
    bench.robot.run_cycles = 30;
    let ticket = bench.submit_move(1);
    bench.until(40, |bench| bench.moves_executed() == [1]);
    assert_eq!(bench.final_event(ticket), None);
    bench.until(100, |bench| bench.final_event(ticket).is_some());
}

#[test]
fn user_checkpoints_pass_through_and_are_reported_once() {
    let mut bench = Bench::connected(Config::default());
    let numbers = [5, 5, 5, 9, 9, 5, 1];
    for (number, position) in numbers.into_iter().zip(1..) {
        bench.submit_move(position);
        bench.submit(MotionCommand::SetCheckpoint(number));
    }
    bench.until(500, |bench| bench.engine.pending() == 0);
    let reached: Vec<u16> = bench
        .events
        .iter()
        .filter_map(|event| match event {
            Event::CheckpointReached { number } => Some(*number),
            _ => None,
        })
        .collect();
    assert_eq!(reached, numbers);
    let sent = checkpoints_sent(&bench);
    assert!(sent.windows(2).all(|pair| pair[0] != pair[1]), "{sent:?}");
}

#[test]
fn several_checkpoints_between_two_cycles_are_all_reached() {
    let mut bench = Bench::connected(with_policy(CheckpointPolicy::Every(2)));
    bench.robot.run_cycles = 1000;
    for number in 1..=10 {
        bench.submit_move(number);
        bench.submit(MotionCommand::SetCheckpoint(number % 3 + 1));
    }
    bench.until(200, |bench| bench.engine.status().waiting == 0);
    bench.steps(5);
    bench.robot.run_cycles = 0;
    bench.until(10, |bench| bench.engine.pending() == 0);
    let reached =
        bench.events.iter().filter(|event| matches!(event, Event::CheckpointReached { .. }));
    assert_eq!(reached.count(), 10);
}

#[test]
fn a_checkpoint_reached_before_a_clear_in_the_same_cycle_counts() {
    let mut bench = Bench::connected(with_policy(CheckpointPolicy::EachCommand));
    bench.robot.run_cycles = 1000;
    let tickets = [1, 2, 3].map(|number| bench.submit_move(number));
    bench.until(50, |bench| bench.robot.queue.len() == 6);
    bench.steps(2);
    // The robot finishes the first command and fails the second between two images.
    bench.robot.queue.drain(..2);
    bench.robot.reached = 7000;
    bench.robot.fail(1007);
    bench.step();
    let reason = AbortReason::Error(Code(1007));
    assert_eq!(bench.final_event(tickets[0]), Some(Event::Done { ticket: tickets[0] }));
    for ticket in &tickets[1..] {
        assert_eq!(bench.final_event(*ticket), Some(Event::Aborted { ticket: *ticket, reason }));
    }
}

#[test]
fn a_discarded_checkpoint_aborts_even_without_any_other_sign() {
    let mut bench = Bench::connected(Config::default());
    bench.robot.run_cycles = 1000;
    let tickets = [1, 2, 3].map(|number| bench.submit_move(number));
    let checkpoint = bench.submit(MotionCommand::SetCheckpoint(77));
    bench.until(50, |bench| bench.robot.queue.len() == 5);
    bench.steps(2);
    bench.robot.lose_queue();
    bench.step();
    let reason = AbortReason::Cleared;
    for ticket in tickets.into_iter().chain([checkpoint]) {
        assert_eq!(bench.final_event(ticket), Some(Event::Aborted { ticket, reason }));
    }
    assert!(bench.saw_event(Event::CheckpointDiscarded { number: 77 }));
}

#[test]
fn numbers_wrap_in_their_range() {
    let config = Config {
        checkpoint_range: CheckpointRange { first: 100, last: 104 },
        ..with_policy(CheckpointPolicy::EachCommand)
    };
    let mut bench = Bench::connected(config);
    for number in 1..=30 {
        bench.submit_move(number);
    }
    bench.until(500, |bench| bench.engine.pending() == 0);
    assert_eq!(bench.moves_executed(), (1..=30).collect::<Vec<_>>());
    let sent = checkpoints_sent(&bench);
    assert!(sent.iter().all(|number| (100..=104).contains(number)));
    assert_eq!(&sent[..7], &[100, 101, 102, 103, 104, 100, 101]);
}

#[test]
fn the_number_shown_at_connection_is_not_taken_for_ours() {
    let mut robot = Robot::ready();
    robot.reached = 7000;
    robot.run_cycles = 20;
    let mut bench = Bench::connected_to(Config::default(), robot);
    let ticket = bench.submit_move(1);
    bench.until(15, |bench| bench.robot.taken.len() == 2);
    bench.steps(10);
    assert_eq!(bench.final_event(ticket), None);
    bench.until(100, |bench| bench.final_event(ticket).is_some());
}

#[test]
fn a_safety_stop_with_nothing_behind_makes_commands_unknown_not_done() {
    let mut bench = Bench::connected(with_policy(CheckpointPolicy::WhenEmpty));
    bench.robot.run_cycles = 1000;
    // Enough waiting commands keep the checkpoint back.
    let tickets: Vec<_> = (1..=30).map(|number| bench.submit_move(number)).collect();
    bench.steps(10);
    // A stop that clears without showing Cleared.
    bench.robot.p_stop2(false);
    bench.robot.lose_queue();
    bench.steps(30);
    bench.robot.signals = fieldarm::wire::meca500::image::SafetySignals::P_STOP2;
    bench.robot.resettable = SafetyResettable::P_STOP2;
    bench.robot.run_cycles = 1;
    assert!(bench.act(Action::Resume, 100));
    bench.until(300, |bench| bench.engine.pending() == 0);
    let cause = UnknownCause::SafetyStop;
    let first = tickets[0];
    assert_eq!(bench.final_event(first), Some(Event::Unknown { ticket: first, cause }));
    let executed = bench.moves_executed();
    for (ticket, number) in tickets.into_iter().zip(1..) {
        let done = bench.final_event(ticket) == Some(Event::Done { ticket });
        assert!(!done || executed.contains(&number), "{number} done without being executed");
    }
}

#[test]
fn firmware_10_2_reports_one_checkpoint_field() {
    let config = Config { layout: FirmwareLayout::V10_2, ..Config::default() };
    let mut bench = Bench::connected(config);
    let ticket = bench.submit_move(1);
    bench.until(50, |bench| bench.robot.reached == 7000);
    // The robot of this bench shows 11.3; in 10.2 the number is a 32-bit field at the same place.
    for _ in 0..5 {
        bench.step();
    }
    assert_eq!(bench.final_event(ticket), None, "a number in the upper half is another number");
    bench.robot.reached = 0;
    bench.robot.discarded = 7000;
    bench.step();
    assert_eq!(bench.final_event(ticket), Some(Event::Done { ticket }));
}

#[test]
fn started_is_said_when_everything_before_is_done() {
    let mut bench = Bench::connected(with_policy(CheckpointPolicy::EachCommand));
    bench.robot.run_cycles = 10;
    let [first, second] = [1, 2].map(|number| bench.submit_move(number));
    bench.until(200, |bench| bench.engine.pending() == 0);
    let position = |wanted: Event| bench.events.iter().position(|event| *event == wanted);
    assert!(position(Event::Started { ticket: first }) < position(Event::Done { ticket: first }));
    assert!(position(Event::Done { ticket: first }) < position(Event::Started { ticket: second }));
    assert!(position(Event::Started { ticket: second }) < position(Event::Done { ticket: second }));
}
