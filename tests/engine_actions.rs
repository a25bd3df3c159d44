//! Actions: trigger bits, level bits, time limits, composites, resume edges, clearing.

#[path = "support/scripted_robot.rs"]
mod scripted_robot;

use fieldarm::cycle::InputQuality;
use fieldarm::engine::meca500::{
    AbortReason, Action, Config, Event, Fault, RequestError, WaitReason,
};
use fieldarm::time::Duration;
use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::image::{
    BrakesControlFlags, MotionControlFlags, RobotControlFlags, SafetyResettable, SafetySignals,
};
use scripted_robot::{Bench, Robot};

fn robot_bits(bench: &Bench) -> RobotControlFlags {
    bench.outputs.robot_control.flags.get()
}

fn motion_bits(bench: &Bench) -> MotionControlFlags {
    bench.outputs.motion_control.flags.get()
}

fn failed(bench: &Bench, action: Action, fault: Fault) -> bool {
    bench.saw_event(Event::ActionFailed { action, fault })
}

#[test]
fn bring_up_activates_homes_and_leaves_no_bit() {
    let mut bench = Bench::connected_to(Config::default(), Robot::new());
    let mut held = RobotControlFlags::empty();
    bench.engine.bring_up().unwrap();
    assert_eq!(bench.engine.bring_up(), Err(RequestError::Pending));
    while !bench.saw_event(Event::ActionDone(Action::BringUp)) {
        bench.step();
        let bits = robot_bits(&bench);
        if held.contains(RobotControlFlags::ACTIVATE_ROBOT)
            && !bits.contains(RobotControlFlags::ACTIVATE_ROBOT)
        {
            assert!(bench.robot.activated, "released before confirmation");
        }
        if held.contains(RobotControlFlags::HOME) && !bits.contains(RobotControlFlags::HOME) {
            assert!(bench.robot.homed, "released before confirmation");
        }
        held = bits;
    }
    assert!(bench.robot.activated && bench.robot.homed);
    assert!(robot_bits(&bench).is_empty());
    assert_eq!(bench.robot.resumes, 0, "nothing was paused");
    assert!(bench.act(Action::Deactivate, 50));
    assert!(bench.act(Action::BringUp, 100));
}

#[test]
fn a_time_limit_fails_the_action_and_takes_the_bit_back() {
    for (action, robot) in [
        (Action::Activate, Robot::new()),
        (Action::Simulation(true), Robot::new()),
        (Action::RecoveryMode(true), Robot::new()),
        (Action::Deactivate, Robot::ready()),
        (Action::Pause, Robot::ready()),
        (Action::Clear, Robot::ready()),
        (Action::Home, Robot { homed: false, ..Robot::ready() }),
        (Action::ResetError, Robot { error: 3041, ..Robot::ready() }),
        (Action::Resume, Robot { paused: true, ..Robot::ready() }),
    ] {
        let mut bench = Bench::connected_to(Config::default(), robot);
        bench.robot.ignores_actions = true;
        assert!(!bench.act(action, 70_000), "{action:?}");
        assert!(failed(&bench, action, Fault::Timeout), "{action:?}: {:?}", bench.events);
        bench.step();
        assert!(robot_bits(&bench).is_empty(), "{action:?}");
        // A pause that nobody confirmed is still wanted; every other bit is taken back.
        let wanted = match action {
            Action::Pause => MotionControlFlags::PAUSE_MOTION,
            _ => MotionControlFlags::empty(),
        };
        assert_eq!(motion_bits(&bench).difference(MotionControlFlags::SET_POINT), wanted);
        bench.robot.ignores_actions = false;
        assert!(bench.act(action, 100), "{action:?} can be asked for again");
    }
}

#[test]
fn time_limits_run_without_inputs() {
    let config = Config { bad_cycles_limit: u16::MAX, ..Config::default() };
    let mut bench = Bench::connected_to(config, Robot::new());
    bench.engine.request(Action::Activate).unwrap();
    bench.steps(2);
    bench.quality = fieldarm::cycle::InputQuality::Stale { age_cycles: 1 };
    bench.until(31_000, |bench| failed(bench, Action::Activate, Fault::Timeout));
    assert!(robot_bits(&bench).is_empty());
}

#[test]
fn an_error_during_an_action_ends_it() {
    let mut bench = Bench::connected_to(Config::default(), Robot::new());
    bench.engine.bring_up().unwrap();
    bench.steps(3);
    bench.robot.busy = 0;
    bench.robot.ignores_actions = true;
    bench.robot.error = 1013;
    bench.steps(3);
    assert!(failed(&bench, Action::BringUp, Fault::RobotError(Code(1013))));
    assert!(robot_bits(&bench).is_empty());
}

#[test]
fn deactivation_goes_before_an_activation_under_way() {
    let mut bench = Bench::connected_to(Config::default(), Robot::new());
    bench.robot.action_cycles = 20;
    bench.engine.bring_up().unwrap();
    bench.steps(4);
    assert!(bench.act(Action::Deactivate, 100));
    assert!(failed(&bench, Action::BringUp, Fault::Superseded));
    assert!(!bench.robot.activated);
}

#[test]
fn recover_resets_resumes_and_clears_what_an_error_may_have_left() {
    for (clears, shows) in [(true, true), (true, false), (false, false)] {
        let mut bench = Bench::connected(Config::default());
        bench.robot.clears_on_error = clears;
        bench.robot.shows_cleared_on_error = shows;
        bench.robot.run_cycles = 20;
        let tickets = [1, 2, 3, 4].map(|number| bench.submit_move(number));
        bench.steps(12);
        bench.robot.fail(1012);
        bench.steps(2);
        for ticket in tickets {
            let reason = AbortReason::Error(Code(1012));
            assert_eq!(bench.final_event(ticket), Some(Event::Aborted { ticket, reason }));
        }
        assert!(bench.saw_event(Event::RobotError { code: Code(1012) }));
        let executed = bench.moves_executed();
        let next = bench.submit_move(9);
        assert!(bench.act(Action::Recover, 200));
        bench.until(300, |bench| bench.final_event(next).is_some());
        let expected: Vec<u16> = executed.into_iter().chain([9]).collect();
        assert_eq!(bench.moves_executed(), expected, "{clears} {shows}");
    }
}

#[test]
fn resume_is_an_edge_the_robot_has_seen_even_when_nothing_is_paused() {
    let mut bench = Bench::connected(Config { edge_hold_cycles: 4, ..Config::default() });
    bench.engine.request(Action::Resume).unwrap();
    let mut high = 0;
    for _ in 0..30 {
        bench.step();
        high += u32::from(motion_bits(&bench).contains(MotionControlFlags::RESUME_MOTION));
    }
    assert!(bench.saw_event(Event::ActionDone(Action::Resume)));
    assert!(high >= 4, "{high}");
    assert_eq!(bench.robot.resumes, 1);
    assert!(bench.act(Action::Resume, 50));
    assert_eq!(bench.robot.resumes, 2, "a second request is a second edge");
}

#[test]
fn pause_holds_its_bit_until_the_resume() {
    let mut bench = Bench::connected(Config::default());
    bench.robot.run_cycles = 30;
    let tickets = [1, 2].map(|number| bench.submit_move(number));
    bench.steps(10);
    assert!(bench.act(Action::Pause, 20));
    bench.steps(100);
    assert!(motion_bits(&bench).contains(MotionControlFlags::PAUSE_MOTION));
    assert!(bench.moves_executed().is_empty());
    assert!(bench.act(Action::Resume, 100));
    bench.until(300, |bench| bench.engine.pending() == 0);
    for ticket in tickets {
        assert_eq!(bench.final_event(ticket), Some(Event::Done { ticket }));
    }
    assert!(bench.saw_event(Event::Paused) && bench.saw_event(Event::Resumed));
}

#[test]
fn clear_drops_what_came_before_and_keeps_what_came_after() {
    let mut bench = Bench::connected(Config::default());
    bench.robot.run_cycles = 30;
    let before: Vec<_> = (1..=20).map(|number| bench.submit_move(number)).collect();
    bench.steps(10);
    bench.engine.request(Action::Clear).unwrap();
    let after = bench.submit_move(21);
    bench.until(60, |bench| bench.saw_event(Event::ActionDone(Action::Clear)));
    bench.steps(40);
    assert!(!motion_bits(&bench).contains(MotionControlFlags::CLEAR_MOTION));
    for ticket in before {
        let reason = AbortReason::Cleared;
        assert_eq!(bench.final_event(ticket), Some(Event::Aborted { ticket, reason }));
    }
    assert!(bench.saw_event(Event::Waiting(WaitReason::Cleared)));
    assert!(bench.act(Action::Resume, 100));
    bench.until(200, |bench| bench.engine.pending() == 0);
    assert_eq!(bench.final_event(after), Some(Event::Done { ticket: after }));
    assert_eq!(bench.moves_executed(), [21]);
}

#[test]
fn a_command_under_way_when_the_queue_is_cleared_never_runs() {
    for delays in [(0, 0), (2, 2), (4, 1), (1, 4)] {
        let mut bench = Bench::connected(Config::default());
        (bench.out_delay, bench.in_delay) = delays;
        bench.steps(20);
        bench.robot.run_cycles = 30;
        for number in 1..=20 {
            bench.submit_move(number);
        }
        bench.steps(25);
        bench.engine.request(Action::Clear).unwrap();
        bench.until(200, |bench| bench.saw_event(Event::ActionDone(Action::Clear)));
        assert_eq!(bench.engine.pending(), 0);
        assert!(bench.act(Action::Resume, 100));
        let executed = bench.moves_executed();
        bench.steps(200);
        assert_eq!(bench.moves_executed(), executed, "{delays:?}");
    }
}

#[test]
fn p_stop_2_keeps_or_clears_the_queue_and_resume_waits_for_it() {
    for clears in [false, true] {
        let mut bench = Bench::connected(Config::default());
        bench.robot.run_cycles = 30;
        bench.robot.resume_needs_second_edge = true;
        let tickets = [1, 2].map(|number| bench.submit_move(number));
        bench.steps(20);
        bench.robot.p_stop2(clears);
        bench.steps(5);
        assert!(bench.saw_event(Event::SafetyStop { signals: SafetySignals::P_STOP2 }));
        bench.engine.request(Action::Resume).unwrap();
        bench.steps(300);
        assert_eq!(bench.robot.resumes, 0, "the signal is still present");
        bench.robot.resettable = SafetyResettable::P_STOP2;
        bench.until(200, |bench| bench.saw_event(Event::ActionDone(Action::Resume)));
        assert!(bench.saw_event(Event::SafetyCleared));
        bench.until(300, |bench| bench.engine.pending() == 0);
        for ticket in tickets {
            let aborted = Event::Aborted { ticket, reason: AbortReason::SafetyStop };
            let expected = if clears { aborted } else { Event::Done { ticket } };
            assert_eq!(bench.final_event(ticket), Some(expected));
        }
    }
}

#[test]
fn resume_fails_when_a_safety_signal_stays() {
    let mut robot = Robot::ready();
    robot.p_stop2(true);
    let mut bench = Bench::connected_to(Config::default(), robot);
    assert!(!bench.act(Action::Resume, 6000));
    assert!(failed(&bench, Action::Resume, Fault::SafetyStopPresent));
    assert_eq!(bench.robot.resumes, 0);
}

#[test]
fn levels_stay_commanded() {
    let mut bench = Bench::connected_to(Config::default(), Robot::new());
    assert!(bench.act(Action::Simulation(true), 20));
    assert!(bench.act(Action::BringUp, 100));
    bench.steps(20);
    assert!(bench.robot.sim);
    assert!(!bench.act(Action::Simulation(false), 20));
    assert!(failed(&bench, Action::Simulation(false), Fault::WrongState));
    assert!(bench.act(Action::RecoveryMode(true), 20));
    assert!(bench.act(Action::Deactivate, 50));
    bench.steps(20);
    assert!(bench.robot.sim && bench.robot.recovery);
    assert!(bench.act(Action::Simulation(false), 20));
    assert!(!bench.robot.sim);
}

#[test]
fn a_simulation_found_on_connection_is_kept() {
    let robot = Robot { sim: true, ..Robot::ready() };
    let mut bench = Bench::connected_to(Config::default(), robot);
    assert!(bench.act(Action::Deactivate, 50));
    bench.steps(20);
    assert!(bench.robot.sim);
}

#[test]
fn brakes_stay_out_of_reach_until_allowed() {
    let mut bench = Bench::connected_to(Config::default(), Robot::new());
    let release = Action::Brakes { engaged: false };
    assert_eq!(bench.engine.request(release), Err(RequestError::BrakesNotAllowed));

    let config = Config { allow_brakes: true, ..Config::default() };
    let mut bench = Bench::connected_to(config, Robot::new());
    bench.steps(20);
    assert_eq!(bench.outputs.brakes_control.flags.get(), BrakesControlFlags::empty());
    assert!(bench.act(release, 20));
    assert!(!bench.robot.brakes);
    bench.engine.bring_up().unwrap();
    bench.steps(3);
    assert_eq!(bench.outputs.brakes_control.flags.get(), BrakesControlFlags::empty());
    bench.until(100, |bench| bench.saw_event(Event::ActionDone(Action::BringUp)));
    assert!(!bench.act(release, 20));
    assert!(failed(&bench, release, Fault::WrongState));
}

#[test]
fn host_time_is_shown_for_a_while_and_taken_back() {
    let mut bench = Bench::connected(Config { host_time_cycles: 6, ..Config::default() });
    assert_eq!(bench.engine.request(Action::HostTime(0)), Err(RequestError::HostTimeZero));
    bench.engine.request(Action::HostTime(1_800_000_000)).unwrap();
    let mut shown = 0;
    for _ in 0..20 {
        bench.step();
        shown += u32::from(bench.outputs.host_time.host_time.get() == 1_800_000_000);
    }
    assert_eq!(shown, 6);
    assert_eq!(bench.outputs.host_time.host_time.get(), 0);
}

#[test]
fn clearing_the_homing_is_confirmed_by_its_echo() {
    let robot = Robot { homed: true, ..Robot::new() };
    let mut bench = Bench::connected_to(Config::default(), robot);
    assert!(bench.act(Action::ClearHoming, 50));
    assert!(!bench.robot.homed);
}

#[test]
fn leaving_ethercat_is_confirmed_by_the_loss_of_the_link() {
    let mut bench = Bench::connected(Config::default());
    bench.engine.request(Action::DisableEtherCat).unwrap();
    bench.steps(5);
    assert!(robot_bits(&bench).contains(RobotControlFlags::DISABLE_ETHERCAT));
    bench.lose_link();
    bench.steps(2);
    assert!(bench.saw_event(Event::ActionDone(Action::DisableEtherCat)));
}

#[test]
fn actions_end_when_the_link_does() {
    let mut bench = Bench::connected_to(Config::default(), Robot::new());
    bench.engine.bring_up().unwrap();
    bench.engine.request(Action::Resume).unwrap();
    bench.steps(3);
    bench.lose_link();
    bench.steps(2);
    assert!(failed(&bench, Action::BringUp, Fault::LinkLost));
    assert!(failed(&bench, Action::Resume, Fault::LinkLost));
    assert!(bench.is_silent());
}

#[test]
fn deactivation_aborts_what_the_robot_held() {
    let mut bench = Bench::connected(Config::default());
    bench.robot.run_cycles = 100;
    let tickets: Vec<_> = (1..=20).map(|number| bench.submit_move(number)).collect();
    bench.steps(10);
    assert!(bench.act(Action::Deactivate, 50));
    bench.steps(30);
    for ticket in tickets {
        let reason = AbortReason::Deactivated;
        assert_eq!(bench.final_event(ticket), Some(Event::Aborted { ticket, reason }));
    }
}

#[test]
fn a_stop_goes_before_everything_that_could_power_or_move_the_robot() {
    for stop in [Action::Pause, Action::Clear] {
        for cycles in 0..40 {
            let mut bench = Bench::connected_to(Config::default(), Robot::new());
            for action in [Action::BringUp, Action::Activate, Action::Home, Action::Recover] {
                bench.engine.request(action).unwrap();
            }
            bench.engine.request(Action::RecoveryMode(true)).unwrap();
            bench.steps(cycles);
            let is_up = bench.saw_event(Event::ActionDone(Action::BringUp));
            bench.engine.request(stop).unwrap();
            bench.steps(1);
            let powering = RobotControlFlags::ACTIVATE_ROBOT | RobotControlFlags::HOME;
            for _ in 0..100 {
                assert!(!robot_bits(&bench).intersects(powering), "{stop:?} after {cycles}");
                assert!(!motion_bits(&bench).contains(MotionControlFlags::RESUME_MOTION));
                bench.step();
            }
            assert!(bench.saw_event(Event::ActionDone(stop)), "{stop:?} after {cycles}");
            assert!(is_up || failed(&bench, Action::BringUp, Fault::Superseded));
            assert!(bench.robot.recovery, "what moves nothing is still done");
        }
    }
}

#[test]
fn a_bring_up_fails_at_once_over_a_signal_it_cannot_reset() {
    for cycles in [0, 6, 14] {
        let mut bench = Bench::connected_to(Config::default(), Robot::new());
        bench.robot.action_cycles = 50;
        bench.engine.bring_up().unwrap();
        bench.steps(cycles);
        bench.robot.signals = SafetySignals::E_STOP;
        bench.robot.ignores_actions = true;
        bench.steps(10);
        assert!(failed(&bench, Action::BringUp, Fault::SafetyStopPresent), "after {cycles}");
        assert!(robot_bits(&bench).is_empty());
    }
}

#[test]
fn a_time_limit_counts_from_the_cycle_that_shows_the_bit() {
    for (action, bit) in [
        (Action::Pause, MotionControlFlags::PAUSE_MOTION),
        (Action::Clear, MotionControlFlags::CLEAR_MOTION),
    ] {
        let mut bench = Bench::connected_to(Config::default(), Robot::ready());
        bench.engine.request(action).unwrap();
        bench.now += Duration::from_secs(10);
        bench.step();
        assert!(motion_bits(&bench).contains(bit), "{action:?} is shown however late the cycle");
        assert!(!failed(&bench, action, Fault::Timeout));
    }
}

#[test]
fn levels_of_before_a_lost_link_do_not_come_back_by_themselves() {
    let mut bench = Bench::connected_to(Config::default(), Robot::ready());
    assert!(bench.act(Action::RecoveryMode(true), 100));
    bench.quality = InputQuality::Lost;
    bench.steps(50);
    bench.robot.recovery = false;
    bench.quality = InputQuality::Fresh;
    bench.steps(100);
    assert!(!robot_bits(&bench).contains(RobotControlFlags::ENABLE_RECOVERY_MODE));
}
