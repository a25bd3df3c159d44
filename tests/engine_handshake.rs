//! The MoveID handshake: order, freezing, pace, wrap, the readings of the trigger, refusals.

#[path = "support/scripted_robot.rs"]
mod scripted_robot;

use fieldarm::engine::meca500::{
    AbortReason, Config, Event, Fault, SubmitError, UnknownCause, WaitReason,
};
use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::command::{MotionCommand, MotionCommandId};
use scripted_robot::{Bench, Robot, TRIGGERS, move_number};

#[test]
fn nothing_but_zeros_until_inputs_are_fresh_and_settled() {
    let mut bench = Bench::new(Config { settle_cycles: 5, ..Config::default() }, Robot::ready());
    bench.submit_move(1);
    bench.quality = fieldarm::cycle::InputQuality::Stale { age_cycles: 1 };
    for _ in 0..30 {
        bench.step();
        assert!(bench.is_silent());
    }
    bench.quality = fieldarm::cycle::InputQuality::Fresh;
    for _ in 0..4 {
        bench.step();
        assert!(bench.is_silent());
    }
    bench.step();
    assert!(bench.saw_event(Event::Connected { again: false }));
    assert!(bench.set_point());
}

#[test]
fn first_move_id_differs_from_zero_and_from_the_echo() {
    for (first, echo) in
        [(Some(0), 0), (Some(7), 7), (Some(1), 0), (None, 4711), (Some(0xFFFF), 0xFFFF)]
    {
        let mut robot = Robot::ready();
        robot.echo = echo;
        robot.last_accepted = echo;
        let mut bench =
            Bench::connected_to(Config { first_move_id: first, ..Config::default() }, robot);
        bench.submit_move(1);
        bench.until(5, Bench::set_point);
        let move_id = bench.outputs.motion_control.move_id.get();
        assert_ne!(move_id, 0);
        assert_ne!(move_id, echo);
        assert_eq!(bench.outputs.motion_command.motion_command_id.get(), 0, "armed first");
        bench.until(50, |bench| bench.moves_taken() == [1]);
    }
}

#[test]
fn every_reading_of_the_trigger_takes_each_command_once() {
    for trigger in TRIGGERS {
        for acknowledges_no_movement in [true, false] {
            for (out_delay, in_delay) in [(0, 0), (1, 0), (0, 1), (2, 3), (5, 5)] {
                let mut robot = Robot::ready();
                robot.trigger = trigger;
                robot.acknowledges_no_movement = acknowledges_no_movement;
                robot.echo = 99;
                robot.last_accepted = 99;
                let mut bench = Bench::new(Config::default(), robot);
                (bench.out_delay, bench.in_delay) = (out_delay, in_delay);
                let tickets: Vec<_> = (1..=40).map(|number| bench.submit_move(number)).collect();
                bench.until(2000, |bench| bench.engine.pending() == 0);
                assert_eq!(
                    bench.moves_executed(),
                    (1..=40).collect::<Vec<_>>(),
                    "{trigger:?} {acknowledges_no_movement} {out_delay} {in_delay}"
                );
                for ticket in tickets {
                    assert_eq!(bench.final_event(ticket), Some(Event::Done { ticket }));
                }
            }
        }
    }
}

#[test]
fn a_stream_is_accepted_at_one_command_per_cycle() {
    let mut bench = Bench::connected(Config::default());
    for number in 1..=60 {
        bench.submit_move(number);
    }
    let before = bench.robot.taken.len();
    // One cycle to arm, one for its echo, then one command in each.
    bench.steps(2);
    bench.steps(30);
    assert_eq!(bench.robot.taken.len() - before, 30);
    let statistics = bench.engine.statistics();
    assert_eq!((statistics.ack_latency_min_cycles, statistics.ack_latency_max_cycles), (1, 1));
}

#[test]
fn an_idle_image_holds_no_movement_under_the_acknowledged_move_id() {
    let mut bench = Bench::connected(Config::default());
    bench.submit_move(1);
    bench.until(100, |bench| bench.engine.pending() == 0);
    bench.steps(3);
    let move_id = bench.outputs.motion_control.move_id.get();
    assert_eq!(move_id, bench.robot.echo);
    assert!(bench.set_point());
    assert_eq!(bench.outputs.motion_command.motion_command_id.get(), 0);
    assert_eq!(bench.outputs.motion_command_args.argument.map(|value| value.get()), [0.0; 6]);
    // A robot that forgets what it accepted takes nothing.
    let taken = bench.robot.taken.len();
    bench.robot.last_accepted = 0;
    bench.steps(10);
    assert_eq!(bench.robot.taken.len(), taken);
}

#[test]
fn move_id_wraps_past_zero() {
    let config = Config { first_move_id: Some(65_530), ..Config::default() };
    let mut bench = Bench::connected(config);
    for number in 1..=20 {
        bench.submit_move(number);
    }
    bench.until(300, |bench| bench.engine.pending() == 0);
    let ids: Vec<u16> = bench.robot.taken.iter().map(|(move_id, ..)| *move_id).collect();
    assert!(!ids.contains(&0));
    assert!(ids.contains(&65_535) && ids.contains(&1));
    assert_eq!(bench.moves_executed(), (1..=20).collect::<Vec<_>>());
}

#[test]
fn stale_inputs_never_advance_the_handshake() {
    let mut bench = Bench::connected(Config::default());
    bench.submit_move(1);
    bench.submit_move(2);
    bench.until(20, |bench| bench.moves_taken() == [1]);
    let frozen = bench.outputs;
    bench.quality = fieldarm::cycle::InputQuality::Stale { age_cycles: 1 };
    for _ in 0..15 {
        bench.step();
        assert_eq!(
            zerocopy::IntoBytes::as_bytes(&bench.outputs),
            zerocopy::IntoBytes::as_bytes(&frozen)
        );
    }
    bench.quality = fieldarm::cycle::InputQuality::Fresh;
    bench.until(100, |bench| bench.engine.pending() == 0);
    assert_eq!(bench.moves_executed(), [1, 2]);
}

#[test]
fn no_command_follows_an_arming_that_may_still_be_under_way() {
    let settle_cycles = 12;
    for trigger in TRIGGERS {
        let mut robot = Robot::ready();
        robot.trigger = trigger;
        let config = Config { settle_cycles, ..Config::default() };
        let mut bench = Bench::connected_to(config, robot);
        bench.submit_move(1);
        bench.until(5, Bench::set_point);
        bench.quality = fieldarm::cycle::InputQuality::Stale { age_cycles: 1 };
        bench.step();
        bench.quality = fieldarm::cycle::InputQuality::Fresh;
        // The arming image may have been lost in that cycle, and come late behind a command.
        for _ in 1..settle_cycles {
            bench.step();
            assert_eq!(bench.outputs.motion_command.motion_command_id.get(), 0, "{trigger:?}");
        }
        bench.until(50, |bench| bench.moves_taken() == [1]);
    }
}

#[test]
fn commands_wait_for_a_robot_that_is_ready() {
    let mut bench = Bench::connected_to(Config::default(), Robot::new());
    let ticket = bench.submit_move(1);
    bench.steps(50);
    assert!(bench.saw_event(Event::Waiting(WaitReason::NotActivated)));
    assert!(!bench.set_point());
    bench.engine.bring_up().unwrap();
    bench.until(200, |bench| bench.engine.pending() == 0);
    assert_eq!(bench.final_event(ticket), Some(Event::Done { ticket }));
    let said = bench.events.iter().filter(|event| matches!(event, Event::Waiting(_))).count();
    assert!(said <= 2, "{:?}", bench.events);
}

#[test]
fn fifo_space_zero_holds_commands_back() {
    let mut robot = Robot::ready();
    robot.fifo_size = 4;
    robot.run_cycles = 20;
    let mut bench = Bench::connected_to(Config::default(), robot);
    for number in 1..=12 {
        bench.submit_move(number);
    }
    bench.until(1000, |bench| bench.engine.pending() == 0);
    assert!(bench.saw_event(Event::Waiting(WaitReason::FifoFull)));
    assert_eq!(bench.moves_executed(), (1..=12).collect::<Vec<_>>());
    assert_eq!(bench.engine.statistics().ack_timeouts, 0);
}

#[test]
fn an_echo_that_never_comes_ends_as_unknown_and_the_caller_decides() {
    let config = Config { withdraw_cycles: 4, ..Config::default() };
    let mut bench = Bench::connected(config);
    bench.submit_move(1);
    bench.until(50, |bench| bench.engine.pending() == 0);
    bench.robot.acknowledges = false;
    let lost = bench.submit_move(2);
    let next = bench.submit_move(3);
    bench.until(1100, |bench| bench.final_event(lost).is_some());
    assert!(bench.saw_event(Event::Fault(Fault::AckTimeout)));
    assert_eq!(
        bench.final_event(lost),
        Some(Event::Unknown { ticket: lost, cause: UnknownCause::AckTimeout })
    );
    bench.robot.acknowledges = true;
    bench.steps(100);
    assert!(bench.engine.undecided());
    assert!(bench.saw_event(Event::Waiting(WaitReason::Undecided)));
    assert_eq!(bench.final_event(next), None);
    bench.engine.proceed();
    bench.until(100, |bench| bench.final_event(next).is_some());
    assert_eq!(bench.moves_executed(), [1, 3]);

    bench.robot.acknowledges = false;
    let lost = bench.submit_move(4);
    let next = bench.submit_move(5);
    bench.until(1100, |bench| bench.final_event(lost).is_some());
    bench.engine.discard_waiting();
    bench.robot.acknowledges = true;
    bench.until(20, |bench| bench.engine.pending() == 0);
    assert_eq!(
        bench.final_event(next),
        Some(Event::Aborted { ticket: next, reason: AbortReason::Discarded })
    );
    let again = bench.submit_move(6);
    bench.until(100, |bench| bench.final_event(again).is_some());
    assert_eq!(bench.moves_executed(), [1, 3, 6]);
}

#[test]
fn a_late_echo_of_a_withdrawn_command_counts() {
    let config = Config { withdraw_cycles: 30, ..Config::default() };
    let mut bench = Bench::connected(config);
    bench.submit_move(1);
    bench.until(50, |bench| bench.engine.pending() == 0);
    bench.in_delay = 1010;
    let ticket = bench.submit_move(2);
    bench.until(1100, |bench| bench.saw_event(Event::Fault(Fault::AckTimeout)));
    assert!(!bench.set_point());
    bench.in_delay = 0;
    let late = bench.events.len();
    bench.until(3000, |bench| bench.engine.pending() == 0);
    assert!(bench.events[late..].contains(&Event::Done { ticket }));
}

#[test]
fn an_error_that_comes_with_the_echo_aborts_with_its_code() {
    let mut bench = Bench::connected(Config::default());
    bench.submit_move(1);
    bench.until(50, |bench| bench.engine.pending() == 0);
    let ticket = bench.submit(MotionCommand::SetTimeScaling(50.0));
    bench.robot.fifo_size = 13_000;
    bench.step();
    bench.robot.error = 1003;
    bench.until(10, |bench| bench.engine.pending() == 0);
    assert_eq!(
        bench.final_event(ticket),
        Some(Event::Aborted { ticket, reason: AbortReason::Error(Code(1003)) })
    );
}

#[test]
fn refused_commands_end_under_each_reading_of_their_echo() {
    for acknowledges_refused in [false, true] {
        for trigger in TRIGGERS {
            let mut robot = Robot::ready();
            robot.trigger = trigger;
            robot.acknowledges_refused = acknowledges_refused;
            let mut bench = Bench::connected_to(Config::default(), robot);
            bench.submit_move(1);
            bench.until(50, |bench| bench.engine.pending() == 0);
            // The robot falls into error in the cycle it should take the command in.
            let tickets = [bench.submit_move(2), bench.submit_move(3)];
            bench.step();
            bench.robot.fail(1007);
            bench.until(100, |bench| bench.engine.pending() == 0);
            for ticket in tickets {
                assert_eq!(
                    bench.final_event(ticket),
                    Some(Event::Aborted { ticket, reason: AbortReason::Error(Code(1007)) })
                );
            }
            bench.engine.recover().unwrap();
            bench.steps(100);
            assert_eq!(bench.moves_executed(), [1], "nothing may be taken late");
            let ticket = bench.submit_move(4);
            bench.until(100, |bench| bench.engine.pending() == 0);
            assert_eq!(bench.final_event(ticket), Some(Event::Done { ticket }));
            assert_eq!(bench.moves_executed(), [1, 4]);
        }
    }
}

#[test]
fn instantaneous_commands_are_done_when_acknowledged() {
    let mut bench = Bench::connected_to(Config::default(), Robot::new());
    let scaling = bench.submit(MotionCommand::SetTimeScaling(10.0));
    let limits = bench.submit(MotionCommand::SetJointLimitsCfg(true));
    bench.until(30, |bench| bench.engine.pending() == 0);
    for ticket in [scaling, limits] {
        assert_eq!(bench.final_event(ticket), Some(Event::Done { ticket }));
    }
    let mut bench = Bench::connected(Config::default());
    bench.submit(MotionCommand::SetJointLimitsCfg(true));
    bench.steps(50);
    assert!(bench.saw_event(Event::Waiting(WaitReason::NotDeactivated)));
    assert!(bench.robot.taken.is_empty());
}

#[test]
fn submit_refuses_what_cannot_be_sent() {
    let mut bench = Bench::connected(Config::default());
    let raw = |id, first: f32| MotionCommand::Raw {
        id: MotionCommandId(id),
        arguments: [first, 0.0, 0.0, 0.0, 0.0, 0.0],
    };
    let engine = &mut bench.engine;
    assert!(matches!(engine.submit(move_number(176)), Err(SubmitError::Argument(_))));
    let velocity = MotionCommand::MoveJointsVel([0.0; 6]);
    assert_eq!(engine.submit(velocity), Err(SubmitError::VelocityCommand));
    assert_eq!(engine.submit(raw(22, 0.0)), Err(SubmitError::VelocityCommand));
    assert_eq!(engine.submit(MotionCommand::NoMovement), Err(SubmitError::NoMovement));
    assert_eq!(engine.submit(raw(45, 0.0)), Err(SubmitError::NotAvailable { id: 45 }));
    let reserved = SubmitError::ReservedCheckpoint { number: 7000 };
    assert_eq!(engine.submit(MotionCommand::SetCheckpoint(7000)), Err(reserved));
    assert_eq!(engine.submit(raw(17, 7000.0)), Err(reserved));
    assert_eq!(engine.submit(raw(17, 1.5)), Err(SubmitError::BadCheckpoint));
    assert_eq!(engine.pending(), 0);
    for _ in 0..64 {
        engine.submit(move_number(1)).unwrap();
    }
    assert_eq!(engine.queue_space(), 0);
    assert_eq!(engine.submit(move_number(1)), Err(SubmitError::QueueFull));
}

/// Outputs that were late by a few cycles arrive behind newer ones: were there another MoveID in
/// those, the old one would be a trigger once more.
#[test]
fn after_a_bad_cycle_nothing_new_is_sent_while_old_outputs_may_be_under_way() {
    let mut bench = Bench::connected(Config { settle_cycles: 6, ..Config::default() });
    bench.submit_move(1);
    bench.steps(40);
    assert_eq!(bench.moves_taken(), [1]);
    let move_id = bench.outputs.motion_control.move_id.get();
    bench.quality = fieldarm::cycle::InputQuality::Stale { age_cycles: 1 };
    bench.step();
    bench.quality = fieldarm::cycle::InputQuality::Fresh;
    bench.submit_move(2);
    for _ in 0..6 {
        bench.step();
        assert_eq!(bench.outputs.motion_control.move_id.get(), move_id);
        assert!(bench.set_point());
    }
    bench.step();
    assert_ne!(bench.outputs.motion_control.move_id.get(), move_id);
    bench.until(20, |bench| bench.moves_taken() == [1, 2]);
}
