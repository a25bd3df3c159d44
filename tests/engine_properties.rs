//! Random robots, buses and callers: whatever happens, no MoveID carries two commands, arguments are
//! frozen while unacknowledged (the bench looks at every image), no command is taken twice, order is
//! kept, and every ticket ends exactly once.

#[path = "support/scripted_robot.rs"]
mod scripted_robot;

use fieldarm::cycle::InputQuality;
use fieldarm::engine::meca500::{Action, CheckpointPolicy, Config, Event};
use fieldarm::wire::meca500::command::{MotionCommand, VelocityCommand};
use fieldarm::wire::meca500::image::{SafetyResettable, SafetySignals};
use proptest::prelude::*;
use scripted_robot::{Bench, Robot, TRIGGERS, final_ticket, move_number};

#[derive(Clone, Debug)]
enum Op {
    Steps(usize),
    Submit,
    Checkpoint(u16),
    Scaling,
    Act(Action),
    Velocity,
    StopVelocity,
    Stale(usize),
    Lose(usize),
    Fail(u16),
    PStop2(bool),
    Cleared,
    Deaf(usize),
    Proceed,
    Discard,
    Reboot,
    Delay(usize, usize),
}

fn op() -> impl Strategy<Value = Op> {
    prop_oneof![
        6 => (1..20_usize).prop_map(Op::Steps),
        12 => Just(Op::Submit),
        3 => (1..9_u16).prop_map(Op::Checkpoint),
        1 => Just(Op::Scaling),
        4 => prop::sample::select(vec![
            Action::Recover, Action::BringUp, Action::Pause, Action::Clear, Action::Resume,
            Action::Deactivate, Action::ResetError, Action::HostTime(5), Action::ClearHoming,
        ]).prop_map(Op::Act),
        2 => Just(Op::Velocity),
        1 => Just(Op::StopVelocity),
        1 => (1..30_usize).prop_map(Op::Stale),
        1 => (1..30_usize).prop_map(Op::Lose),
        1 => prop::sample::select(vec![1007_u16, 1012, 3005]).prop_map(Op::Fail),
        1 => any::<bool>().prop_map(Op::PStop2),
        1 => Just(Op::Cleared),
        1 => (1..60_usize).prop_map(Op::Deaf),
        1 => Just(Op::Proceed),
        1 => Just(Op::Discard),
        1 => Just(Op::Reboot),
        1 => (0..4_usize, 0..4_usize).prop_map(|(out, back)| Op::Delay(out, back)),
    ]
}

fn apply(bench: &mut Bench, op: Op, tickets: &mut Vec<(fieldarm::engine::meca500::Ticket, u16)>) {
    match op {
        Op::Steps(count) => bench.steps(count),
        Op::Submit => {
            // The place in the list tells one command from another.
            let number = (tickets.len() % 170) as u16;
            if let Ok(ticket) = bench.engine.submit(move_number(number)) {
                tickets.push((ticket, number));
            }
        }
        Op::Checkpoint(number) => {
            if let Ok(ticket) = bench.engine.submit(MotionCommand::SetCheckpoint(number)) {
                tickets.push((ticket, 1000));
            }
        }
        Op::Scaling => {
            if let Ok(ticket) = bench.engine.submit(MotionCommand::SetTimeScaling(50.0)) {
                tickets.push((ticket, 1000));
            }
        }
        Op::Act(action) => {
            let _ = bench.engine.request(action);
        }
        Op::Velocity => {
            let _ = bench.engine.set_velocity(VelocityCommand::MoveJointsVel([1.0; 6]));
        }
        Op::StopVelocity => bench.engine.stop_velocity(),
        Op::Stale(count) => {
            bench.quality = InputQuality::Stale { age_cycles: 1 };
            bench.steps(count);
            bench.quality = InputQuality::Fresh;
        }
        Op::Lose(count) => {
            bench.lose_link();
            bench.steps(count);
            bench.restore_link();
        }
        Op::Fail(code) => bench.robot.fail(code),
        Op::PStop2(clears) => bench.robot.p_stop2(clears),
        Op::Cleared => {
            bench.robot.lose_queue();
            bench.robot.paused = true;
            bench.robot.cleared = true;
        }
        Op::Deaf(count) => {
            bench.robot.acknowledges = false;
            bench.steps(count);
            bench.robot.acknowledges = true;
        }
        Op::Proceed => bench.engine.proceed(),
        Op::Discard => bench.engine.discard_waiting(),
        Op::Reboot => bench.robot.reboot(),
        Op::Delay(out, back) => (bench.out_delay, bench.in_delay) = (out, back),
    }
}

/// The faults stop, and the caller does what a caller does.
fn settle(bench: &mut Bench) {
    bench.restore_link();
    bench.robot.acknowledges = true;
    for _ in 0..120 {
        bench.steps(100);
        if bench.robot.signals.contains(SafetySignals::P_STOP2) {
            bench.robot.resettable = SafetyResettable::P_STOP2;
        }
        if bench.engine.pending() == 0 {
            return;
        }
        bench.engine.proceed();
        let _ = bench.engine.request(Action::ResetError);
        let _ = bench.engine.bring_up();
        let _ = bench.engine.request(Action::Resume);
    }
    panic!("tickets left: {:?}\n{:#?}", bench.engine.status(), bench.events);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_ticket_ends_once_and_nothing_is_taken_twice(
        trigger in prop::sample::select(TRIGGERS.to_vec()),
        acknowledges_no_movement: bool,
        acknowledges_refused: bool,
        clears_on_error: bool,
        shows_cleared_on_error: bool,
        refusal_code in prop::sample::select(vec![0_u16, 1005]),
        run_cycles in 0..6_u32,
        fifo_size in prop::sample::select(vec![2_usize, 5, 13_000]),
        policy in prop::sample::select(vec![
            CheckpointPolicy::EachCommand, CheckpointPolicy::Every(3), CheckpointPolicy::WhenEmpty,
        ]),
        echo: u16,
        ops in prop::collection::vec(op(), 1..60),
    ) {
        let robot = Robot {
            trigger, acknowledges_no_movement, acknowledges_refused, clears_on_error,
            shows_cleared_on_error, refusal_code, run_cycles, fifo_size, echo,
            last_accepted: echo,
            ..Robot::ready()
        };
        let config = Config {
            checkpoints: policy,
            ack_timeout: fieldarm::time::Duration::from_millis(40),
            ..Config::default()
        };
        let mut bench = Bench::new(config, robot);
        let mut tickets = Vec::new();
        for op in ops {
            apply(&mut bench, op, &mut tickets);
        }
        settle(&mut bench);

        let taken = bench.moves_taken();
        let mut increasing = taken.clone();
        increasing.dedup();
        prop_assert_eq!(&increasing, &taken, "a command was taken twice");
        prop_assert!(taken.is_sorted(), "order: {:?}", taken);
        let executed = bench.moves_executed();
        for (ticket, number) in &tickets {
            let ends: Vec<_> =
                bench.events.iter().filter(|event| final_ticket(event) == Some(*ticket)).collect();
            prop_assert_eq!(ends.len(), 1, "{:?}: {:?}", ticket, ends);
            if *number < 1000 && matches!(ends[0], Event::Done { .. }) {
                prop_assert!(executed.contains(number), "{} done, not executed", number);
            }
        }
    }
}
