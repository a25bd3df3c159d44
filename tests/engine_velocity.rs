//! Velocity mode: entering, changing, leaving, the dead-man, and what stops it.

#[path = "support/scripted_robot.rs"]
mod scripted_robot;

use fieldarm::cycle::InputQuality;
use fieldarm::engine::meca500::{Action, Config, Event, SubmitError, VelocityStop, WaitReason};
use fieldarm::time::Duration;
use fieldarm::wire::meca500::command::VelocityCommand;
use scripted_robot::{Bench, Robot, TRIGGERS};

const JOINTS: VelocityCommand = VelocityCommand::MoveJointsVel([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
const LINEAR: VelocityCommand = VelocityCommand::MoveLinVelWrf([7.0, 0.0, 0.0, 0.0, 0.0, 0.0]);

fn arguments(bench: &Bench) -> [f32; 6] {
    bench.outputs.motion_command_args.argument.map(|value| value.get())
}

fn moving() -> Bench {
    let mut bench = Bench::connected(Config::default());
    bench.engine.set_velocity(JOINTS).unwrap();
    bench.until(10, |bench| bench.robot.velocity.is_some());
    bench
}

#[test]
fn move_id_is_zero_and_arguments_follow_at_once() {
    let mut bench = moving();
    assert_eq!(bench.robot.velocity, Some((21, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0])));
    let faster = JOINTS.with_velocities([9.0; 6]);
    bench.engine.set_velocity(faster).unwrap();
    bench.step();
    assert_eq!(arguments(&bench), [9.0; 6]);
    assert!(bench.set_point());
    assert!(bench.engine.status().velocity_mode);
}

#[test]
fn another_id_passes_through_set_point_zero() {
    let mut bench = moving();
    bench.engine.set_velocity(LINEAR).unwrap();
    bench.step();
    assert!(!bench.set_point());
    assert_eq!(arguments(&bench), [0.0; 6]);
    bench.step();
    assert!(bench.set_point());
    assert_eq!(bench.outputs.motion_command.motion_command_id.get(), 22);
    assert_eq!(bench.outputs.motion_control.move_id.get(), 0);
}

#[test]
fn the_dead_man_drops_set_point_and_arguments_together() {
    let config = Config { velocity_dead_man: Duration::from_millis(20), ..Config::default() };
    let mut bench = Bench::connected(config);
    for _ in 0..50 {
        bench.engine.set_velocity(JOINTS).unwrap();
        bench.step();
    }
    assert!(bench.set_point());
    bench.steps(20);
    assert!(!bench.set_point());
    assert_eq!(arguments(&bench), [0.0; 6]);
    assert!(bench.saw_event(Event::VelocityStopped(VelocityStop::DeadMan)));
    bench.steps(50);
    assert!(!bench.set_point());
}

#[test]
fn the_dead_man_runs_without_inputs() {
    let config = Config {
        velocity_dead_man: Duration::from_millis(20),
        velocity_bad_cycles_limit: u16::MAX,
        bad_cycles_limit: u16::MAX,
        ..Config::default()
    };
    let mut bench = Bench::connected(config);
    bench.engine.set_velocity(JOINTS).unwrap();
    bench.steps(5);
    assert!(bench.set_point());
    bench.quality = InputQuality::Stale { age_cycles: 1 };
    bench.steps(20);
    assert!(!bench.set_point());
}

#[test]
fn every_reason_to_stop_stops() {
    type Cause = fn(&mut Bench);
    let causes: [(Cause, VelocityStop); 7] = [
        (|bench| bench.engine.stop_velocity(), VelocityStop::Requested),
        (|bench| bench.robot.fail(3025), VelocityStop::RobotState),
        (|bench| bench.robot.paused = true, VelocityStop::RobotState),
        (|bench| bench.robot.p_stop2(false), VelocityStop::RobotState),
        (|bench| bench.engine.request(Action::Pause).unwrap(), VelocityStop::RobotState),
        (|bench| bench.quality = InputQuality::Stale { age_cycles: 1 }, VelocityStop::InputsBad),
        (|bench| bench.lose_link(), VelocityStop::InputsBad),
    ];
    for (number, (cause, why)) in causes.into_iter().enumerate() {
        let mut bench = moving();
        cause(&mut bench);
        bench.steps(2);
        assert!(!bench.set_point(), "cause {number}");
        assert_eq!(arguments(&bench), [0.0; 6]);
        assert!(bench.saw_event(Event::VelocityStopped(why)), "{number}: {:?}", bench.events);
        bench.steps(30);
        assert!(!bench.set_point(), "cause {number} must not pass by itself");
    }
}

#[test]
fn never_while_a_command_is_unacknowledged_and_position_commands_wait() {
    for trigger in TRIGGERS {
        for (out_delay, in_delay) in [(0, 0), (3, 2)] {
            let robot = Robot { trigger, ..Robot::ready() };
            let mut bench = Bench::connected_to(Config::default(), robot);
            (bench.out_delay, bench.in_delay) = (out_delay, in_delay);
            bench.steps(20);
            bench.submit_move(1);
            bench.until(50, |bench| bench.engine.status().unacknowledged);
            let sent = bench.outputs.motion_control.move_id.get();
            bench.engine.set_velocity(JOINTS).unwrap();
            while bench.inputs.motion_status.move_id.get() != sent {
                assert_eq!(bench.outputs.motion_control.move_id.get(), sent);
                bench.step();
            }
            bench.submit_move(2);
            for _ in 0..40 {
                bench.engine.set_velocity(JOINTS).unwrap();
                bench.step();
            }
            assert!(bench.robot.velocity.is_some());
            assert_eq!(bench.moves_taken(), [1]);
            assert!(bench.saw_event(Event::Waiting(WaitReason::VelocityMode)));
            bench.engine.stop_velocity();
            bench.step();
            assert!(!bench.set_point(), "a cycle of SetPoint 0 between modes");
            bench.until(200, |bench| bench.engine.pending() == 0);
            assert_eq!(bench.moves_executed(), [1, 2], "{trigger:?}");
        }
    }
}

#[test]
fn a_robot_that_is_not_ready_is_not_moved() {
    let mut bench = Bench::connected_to(Config::default(), Robot::new());
    assert_eq!(bench.engine.set_velocity(JOINTS), Err(SubmitError::NotReady));
    let not_a_number = JOINTS.with_velocities([f32::NAN; 6]);
    assert!(matches!(bench.engine.set_velocity(not_a_number), Err(SubmitError::Argument(_))));
    bench.steps(20);
    assert!(bench.is_silent());
}
