//! Loss and return of the connection, a restarted PLC, a rebooted robot, monitoring only.

#[path = "support/scripted_robot.rs"]
mod scripted_robot;

use fieldarm::cycle::InputQuality;
use fieldarm::engine::meca500::{
    AbortReason, Action, Config, ConnectionPhase, Event, Fault, RequestError, SubmitError,
    UnknownCause,
};
use fieldarm::wire::meca500::command::MotionCommand;
use scripted_robot::{Bench, Robot, TRIGGERS};

fn lost(event: &Event) -> bool {
    matches!(event, Event::ConnectionLost { .. })
}

/// A bench with one command executed and one in flight that the robot may or may not have taken.
fn in_flight(robot_takes_it: bool) -> (Bench, fieldarm::engine::meca500::Ticket) {
    let mut bench = Bench::connected(Config::default());
    bench.submit_move(1);
    bench.until(50, |bench| bench.engine.pending() == 0);
    bench.steps(5);
    let ticket = bench.submit_move(2);
    bench.step();
    if robot_takes_it {
        bench.quality = InputQuality::Stale { age_cycles: 1 };
        bench.step();
        assert_eq!(bench.moves_taken(), [1, 2]);
    }
    bench.lose_link();
    bench.steps(3);
    assert!(bench.is_silent());
    assert!(bench.saw(lost));
    assert_eq!(bench.final_event(ticket), None, "judged after the next connection");
    (bench, ticket)
}

#[test]
fn a_command_the_robot_took_is_accepted_after_reconnection() {
    let (mut bench, ticket) = in_flight(true);
    bench.restore_link();
    bench.until(100, |bench| bench.engine.pending() == 0);
    assert!(bench.saw_event(Event::Connected { again: true }));
    assert_eq!(bench.final_event(ticket), Some(Event::Done { ticket }));
    assert_eq!(bench.moves_executed(), [1, 2]);
}

#[test]
fn a_command_the_robot_never_got_is_aborted_and_not_sent_again() {
    for trigger in TRIGGERS {
        let (mut bench, ticket) = in_flight(false);
        bench.robot.trigger = trigger;
        bench.restore_link();
        bench.until(100, |bench| bench.engine.pending() == 0);
        let reason = AbortReason::LinkLost;
        assert_eq!(bench.final_event(ticket), Some(Event::Aborted { ticket, reason }));
        let next = bench.submit_move(3);
        bench.until(100, |bench| bench.final_event(next).is_some());
        assert_eq!(bench.moves_executed(), [1, 3]);
    }
}

#[test]
fn an_echo_that_proves_nothing_is_unknown() {
    for echo in [0, 12_345] {
        let (mut bench, ticket) = in_flight(false);
        bench.robot.echo = echo;
        bench.restore_link();
        bench.until(100, |bench| bench.engine.pending() == 0);
        let cause = UnknownCause::LinkLost;
        assert_eq!(bench.final_event(ticket), Some(Event::Unknown { ticket, cause }));
    }
}

#[test]
fn waiting_commands_are_aborted_and_taken_ones_kept_when_the_link_is_lost() {
    let mut bench = Bench::connected(Config::default());
    bench.robot.run_cycles = 50;
    let taken = [bench.submit_move(1), bench.submit_move(2)];
    bench.until(100, |bench| bench.engine.status().on_robot == 2 && bench.robot.queue.len() >= 2);
    bench.steps(3);
    let waiting: Vec<_> = (3..=9).map(|number| bench.submit_move(number)).collect();
    bench.lose_link();
    bench.step();
    for ticket in waiting {
        let reason = AbortReason::LinkLost;
        assert_eq!(bench.final_event(ticket), Some(Event::Aborted { ticket, reason }));
    }
    bench.steps(300);
    bench.restore_link();
    bench.until(300, |bench| bench.engine.pending() == 0);
    for ticket in taken {
        assert_eq!(bench.final_event(ticket), Some(Event::Done { ticket }));
    }
    assert_eq!(bench.moves_executed(), [1, 2]);
}

#[test]
fn a_few_bad_cycles_are_no_loss_and_too_many_make_outputs_safe() {
    let mut bench = Bench::connected(Config { bad_cycles_limit: 10, ..Config::default() });
    bench.submit_move(1);
    bench.until(50, |bench| bench.engine.pending() == 0);
    bench.quality = InputQuality::Stale { age_cycles: 1 };
    bench.steps(9);
    assert!(bench.set_point());
    bench.step();
    assert!(bench.is_silent());
    assert!(bench.saw_event(Event::ConnectionLost { bad_cycles: 10 }));
    assert_eq!(bench.engine.request(Action::Home), Err(RequestError::NotConnected));
}

#[test]
fn a_restarted_plc_meets_a_robot_with_an_old_echo() {
    for trigger in TRIGGERS {
        for echo in [1, 2, 3, 500] {
            let mut robot = Robot::ready();
            robot.trigger = trigger;
            robot.echo = echo;
            robot.last_accepted = echo;
            let config = Config { first_move_id: Some(1), ..Config::default() };
            let mut bench = Bench::new(config, robot);
            for number in 1..=5 {
                bench.submit_move(number);
            }
            bench.until(200, |bench| bench.engine.pending() == 0);
            assert_eq!(bench.moves_executed(), [1, 2, 3, 4, 5], "{trigger:?} {echo}");
        }
    }
}

#[test]
fn checkpoints_of_an_earlier_plc_run_do_not_count() {
    let mut robot = Robot::ready();
    robot.reached = 7003;
    robot.run_cycles = 40;
    for number in 7004..7010 {
        robot.queue.push_back((17, [f32::from(number as u16), 0.0, 0.0, 0.0, 0.0, 0.0]));
    }
    let mut bench = Bench::new(Config::default(), robot);
    let ticket = bench.submit_move(1);
    bench.until(1000, |bench| bench.final_event(ticket).is_some());
    assert_eq!(bench.moves_executed(), [1]);
}

#[test]
fn a_rebooted_robot_ends_everything() {
    let mut bench = Bench::connected(Config::default());
    bench.robot.run_cycles = 100;
    let tickets: Vec<_> = (1..=20).map(|number| bench.submit_move(number)).collect();
    bench.steps(10);
    bench.robot.reboot();
    bench.steps(2);
    assert!(bench.is_silent());
    assert!(bench.saw_event(Event::RobotRebooted));
    let reason = AbortReason::RobotRebooted;
    for ticket in tickets {
        assert_eq!(bench.final_event(ticket), Some(Event::Aborted { ticket, reason }));
    }
    assert_eq!(bench.engine.pending(), 0);
    bench.steps(30);
    bench.engine.bring_up().unwrap();
    let ticket = bench.submit_move(42);
    bench.until(200, |bench| bench.engine.pending() == 0);
    assert_eq!(bench.final_event(ticket), Some(Event::Done { ticket }));
    assert_eq!(bench.moves_executed(), [42]);
}

#[test]
fn a_reboot_while_the_link_is_down_is_seen_on_return() {
    let (mut bench, ticket) = in_flight(true);
    bench.robot.reboot();
    bench.restore_link();
    bench.until(100, |bench| bench.engine.pending() == 0);
    assert!(bench.saw_event(Event::RobotRebooted));
    let reason = AbortReason::RobotRebooted;
    assert_eq!(bench.final_event(ticket), Some(Event::Aborted { ticket, reason }));
}

#[test]
fn one_late_or_damaged_image_is_no_reboot() {
    let mut bench = Bench::connected(Config::default());
    bench.robot.run_cycles = 5;
    for number in 1..=30 {
        bench.submit_move(number);
    }
    for odd in [-3_i64, -4_000_000, 3_600_000_000] {
        bench.steps(10);
        let clock = bench.robot.clock_us;
        bench.robot.clock_us = clock.saturating_add_signed(odd);
        bench.step();
        bench.robot.clock_us = clock + 1000;
    }
    bench.steps(5);
    bench.robot.fifo_size = 0;
    let (clock, echo) = (bench.robot.clock_us, bench.robot.echo);
    bench.robot.clock_us = 0;
    bench.robot.cycle_us = 0;
    (bench.robot.activated, bench.robot.homed, bench.robot.echo) = (false, false, 0);
    bench.step();
    (bench.robot.activated, bench.robot.homed, bench.robot.echo) = (true, true, echo);
    (bench.robot.clock_us, bench.robot.cycle_us, bench.robot.fifo_size) = (clock, 1000, 13_000);
    bench.until(500, |bench| bench.engine.pending() == 0);
    assert!(!bench.saw_event(Event::RobotRebooted), "{:?}", bench.events);
    assert_eq!(bench.moves_executed(), (1..=30).collect::<Vec<_>>());
}

#[test]
fn a_monitoring_connection_is_never_written_to() {
    let mut robot = Robot::ready();
    robot.monitoring = true;
    let mut bench = Bench::new(Config::default(), robot);
    bench.until(20, |bench| bench.saw_event(Event::MonitoringOnly));
    assert_eq!(bench.engine.status().phase, ConnectionPhase::Monitoring);
    assert_eq!(bench.engine.bring_up(), Err(RequestError::MonitoringOnly));
    let refused = bench.engine.submit(MotionCommand::Delay(1.0));
    assert_eq!(refused, Err(SubmitError::MonitoringOnly));
    for _ in 0..50 {
        bench.step();
        assert!(bench.is_silent());
    }
    bench.robot.monitoring = false;
    bench.until(20, |bench| bench.saw_event(Event::Connected { again: false }));
    let ticket = bench.submit_move(1);
    bench.robot.monitoring = true;
    bench.steps(3);
    assert!(bench.is_silent());
    let reason = AbortReason::LinkLost;
    assert_eq!(bench.final_event(ticket), Some(Event::Aborted { ticket, reason }));
}

#[test]
fn rebooting_is_confirmed_by_the_clock() {
    let mut bench = Bench::connected_to(Config::default(), Robot::new());
    assert!(bench.act(Action::Reboot, 100));
    assert!(bench.saw_event(Event::RobotRebooted));
    assert_eq!(bench.robot.taken.len(), 1);
    let mut bench = Bench::connected(Config::default());
    assert!(!bench.act(Action::Reboot, 10));
    let action = Action::Reboot;
    assert!(bench.saw_event(Event::ActionFailed { action, fault: Fault::WrongState }));
}
