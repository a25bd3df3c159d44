//! The program runner against the virtual robot, in simulated time.
#![cfg(feature = "cli")]

use std::fmt;

use fieldarm::cycle::{CyclicDevice, CyclicLink, InputQuality};
use fieldarm::engine::meca500::{
    AbortReason, Action, CheckpointPolicy, Config, Engine, Event, Fault, WaitReason,
};
use fieldarm::link::direct::{DirectLink, DirectLinkError};
use fieldarm::run::drive::{Observer, Progress, drive};
use fieldarm::run::outcome::{End, Outcome, Stop};
use fieldarm::run::pace::SimulatedTime;
use fieldarm::run::periodic::Periodic;
use fieldarm::run::program::Program;
use fieldarm::run::record::{Counts, StepEnd, StepRecord};
use fieldarm::run::recording::Recording;
use fieldarm::run::runner::{Runner, STOP_LIMIT};
use fieldarm::sim::meca500::readings::RefusalCode;
use fieldarm::sim::meca500::{
    FittedTool, Lifecycle, LifecycleTimes, Readings, RobotSettings, VirtualRobot,
};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::image::{INPUT_LEN, OUTPUT_LEN, SafetySignals};
use fieldarm::wire::meca500::revision::Revision;

const PERIOD: Duration = Duration::from_millis(1);
/// No program here lasts longer, in cycles.
const LONGEST: u64 = 120_000;

/// What happens to the link, beside the program.
type Accident = fn(cycle: u64, &mut VirtualRobot) -> InputQuality;

/// A direct link on which accidents happen.
struct Cell {
    link: DirectLink<VirtualRobot>,
    accident: Accident,
    cycle: u64,
    last_outputs: Vec<u8>,
    fails_at: Option<u64>,
    homing_cycles_before: u64,
    homing_cycles_after: u64,
    interrupt_at: Option<u64>,
}

/// Why an exchange failed.
#[derive(Debug)]
enum CellError {
    Direct(DirectLinkError),
    Unplugged,
}

impl fmt::Display for CellError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Direct(error) => error.fmt(f),
            Self::Unplugged => f.write_str("the plug was pulled"),
        }
    }
}

impl CyclicLink for Cell {
    type Error = CellError;

    fn exchange(
        &mut self,
        now: Instant,
        outputs: &[u8],
        inputs: &mut [u8],
    ) -> Result<InputQuality, CellError> {
        self.cycle += 1;
        assert!(self.cycle < LONGEST, "the run does not end");
        self.last_outputs = outputs.to_vec();
        if self.fails_at == Some(self.cycle) {
            return Err(CellError::Unplugged);
        }
        if self.link.device().lifecycle() == Lifecycle::Homing {
            match self.interrupt_at {
                Some(at) if self.cycle > at => self.homing_cycles_after += 1,
                _ => self.homing_cycles_before += 1,
            }
        }
        match (self.accident)(self.cycle, self.link.device_mut()) {
            InputQuality::Fresh => {
                self.link.exchange(now, outputs, inputs).map_err(CellError::Direct)
            }
            bad => Ok(bad),
        }
    }
}

struct Watch {
    interrupt_at: Option<u64>,
    cycles: u64,
    checkpoints: Vec<u16>,
}

impl Observer for Watch {
    fn is_interrupted(&mut self) -> bool {
        self.cycles += 1;
        self.interrupt_at.is_some_and(|at| self.cycles >= at)
    }

    fn event(&mut self, event: &Event, _step: Option<usize>) {
        if let Event::CheckpointReached { number } = event {
            self.checkpoints.push(*number);
        }
    }

    fn wants_progress(&mut self, _cycles: u64) -> bool {
        false
    }

    fn progress(&mut self, _progress: &Progress) {}
}

/// Everything to know about a finished run.
struct Finished {
    outcome: Outcome,
    counts: Counts,
    records: Vec<StepRecord>,
    checkpoints: Vec<u16>,
    robot: VirtualRobot,
    cycles: u64,
    last_outputs: Vec<u8>,
    distance_mm: f64,
    homing_cycles_before: u64,
    homing_cycles_after: u64,
}

struct Setup {
    settings: RobotSettings,
    accident: Accident,
    interrupt_at: Option<u64>,
    fails_at: Option<u64>,
}

fn undisturbed(_cycle: u64, _robot: &mut VirtualRobot) -> InputQuality {
    InputQuality::Fresh
}

impl Default for Setup {
    fn default() -> Self {
        Self {
            settings: RobotSettings::default(),
            accident: undisturbed,
            interrupt_at: None,
            fails_at: None,
        }
    }
}

fn run_with(text: &str, setup: Setup) -> Finished {
    let program = Program::parse(text, Revision::R3).expect("a good program");
    let config = Config { checkpoints: CheckpointPolicy::EachCommand, ..Config::default() };
    let mut engine = Engine::<64>::new(config);
    let cell = Cell {
        link: DirectLink::new(VirtualRobot::new(setup.settings)),
        accident: setup.accident,
        cycle: 0,
        last_outputs: Vec::new(),
        fails_at: setup.fails_at,
        homing_cycles_before: 0,
        homing_cycles_after: 0,
        interrupt_at: setup.interrupt_at,
    };
    let mut periodic = Periodic::new::<Engine<64>>(cell, SimulatedTime, PERIOD);
    let mut runner = Runner::new(&program);
    let mut recording = Recording::new();
    let mut watch = Watch { interrupt_at: setup.interrupt_at, cycles: 0, checkpoints: Vec::new() };
    let outcome = drive(&mut periodic, &mut engine, &mut runner, &mut recording, &mut watch)
        .expect("the images have their lengths");
    Finished {
        outcome,
        counts: runner.counts(),
        records: runner.records().to_vec(),
        checkpoints: watch.checkpoints,
        cycles: periodic.statistics().cycles,
        robot: periodic.link().link.device().clone(),
        last_outputs: periodic.link().last_outputs.clone(),
        distance_mm: recording.distance_mm(),
        homing_cycles_before: periodic.link().homing_cycles_before,
        homing_cycles_after: periodic.link().homing_cycles_after,
    }
}

fn run(text: &str) -> Finished {
    run_with(text, Setup::default())
}

fn seconds(record: &StepRecord) -> f64 {
    let (began, ended) = (record.started.unwrap(), record.ended.unwrap());
    (ended - began).as_secs_f64()
}

#[test]
fn a_program_ends_with_its_last_checkpoint() {
    let finished =
        run("MoveJoints(10, 0, 0, 0, 0, 0)\nSetCheckpoint(5)\nSetCheckpoint(5)\nDelay(0.5)");
    assert_eq!(
        finished.outcome,
        Outcome { end: End::Completed, step: None, stop: Stop::NotNeeded }
    );
    assert_eq!(finished.checkpoints.first(), Some(&5));
    assert!(finished.records.iter().all(|record| record.end == StepEnd::Done));
    assert!((seconds(&finished.records[3]) - 0.5).abs() < 0.02, "the delay was waited for");
    assert!((finished.robot.target_joints()[0] - 10.0).abs() < 1e-3);
    assert_eq!(finished.last_outputs, [0; 60], "outputs are left safe");
}

#[test]
fn long_programs_stream_through_a_short_queue() {
    let text: String =
        (0..1_500).map(|n| format!("MoveJoints({}, 0, 0, 0, 0, 0)\n", n % 2)).collect();
    let finished = run(&text);
    assert_eq!(finished.outcome.end, End::Completed);
    assert_eq!(finished.counts.done, 1_500);
}

#[test]
fn a_velocity_line_lasts_as_long_as_the_timeout_in_force() {
    let finished = run(
        "MoveJointsVel(10, 0, 0, 0, 0, 0)\nSetVelTimeout(0.4)\nMoveJointsVel(10, 0, 0, 0, 0, 0)\n\
         MoveJointsVel(-10, 0, 0, 0, 0, 0)\nDelay(0)",
    );
    assert_eq!(finished.outcome.end, End::Completed);
    let [first, _, second, third, _] = finished.records[..] else { panic!("five steps") };
    // The last of a row ends when the robot stands still, which takes its own timeout and braking.
    assert!(seconds(&first) >= 0.05 && seconds(&first) < 0.4, "{}", seconds(&first));
    assert!((seconds(&second) - 0.4).abs() < 0.003, "{}", seconds(&second));
    assert!(seconds(&third) >= 0.4 && seconds(&third) < 1.2, "{}", seconds(&third));
    assert_eq!(third.started, second.ended, "no stop between velocity lines");
    let joint = finished.robot.target_joints()[0];
    assert!(joint.abs() < 5.0, "there and back: {joint}");
}

#[test]
fn clear_motion_drops_what_is_queued_and_that_is_no_error() {
    let finished = run("Delay(50)\nDelay(50)\nClearMotion()\nResumeMotion()\nDelay(0.1)");
    assert_eq!(finished.outcome.end, End::Completed);
    let ends: Vec<StepEnd> = finished.records.iter().map(|record| record.end).collect();
    let cleared = StepEnd::Aborted(AbortReason::Cleared);
    assert_eq!(ends, [cleared, cleared, StepEnd::Done, StepEnd::Done, StepEnd::Done]);
    assert!(finished.cycles < 10_000, "{} cycles", finished.cycles);
}

#[test]
fn pause_motion_acts_on_what_is_under_way() {
    let finished = run("MoveJoints(60, 0, 0, 0, 0, 0)\nPauseMotion()\nResumeMotion()");
    assert_eq!(finished.outcome.end, End::Completed);
    let [moved, paused, resumed] = finished.records[..] else { panic!("three steps") };
    assert!(paused.ended < moved.ended && resumed.ended < moved.ended, "not after the move");
}

#[test]
fn deactivation_waits_for_the_lines_before_it() {
    let finished = run("MoveJoints(30, 0, 0, 0, 0, 0)\nDeactivateRobot()");
    assert_eq!(finished.outcome.end, End::Completed);
    assert!((finished.robot.target_joints()[0] - 30.0).abs() < 1e-3, "the move was not cut short");
}

#[test]
fn a_robot_error_blames_the_first_command_it_dropped() {
    let finished = run(
        "MoveJoints(0, -20, 20, 0, 60, 0)\nSetCheckpoint(1)\nMoveLin(480, 0, 180, 180, 0, 180)\n\
         SetCheckpoint(2)",
    );
    assert_eq!(finished.outcome.end, End::RobotError(Code::OUT_OF_REACH));
    assert_eq!(finished.outcome.step, Some(2));
    assert_eq!(finished.checkpoints, [1]);
    assert_eq!((finished.counts.done, finished.counts.aborted), (2, 2));
    assert_eq!(finished.last_outputs, [0; 60]);
}

#[test]
fn a_refusal_that_shows_for_a_cycle_stops_the_run() {
    let readings = Readings { refusal_code: RefusalCode::ShownForOneCycle, ..Readings::default() };
    let settings = RobotSettings { readings, tool: FittedTool::None, ..RobotSettings::default() };
    let finished =
        run_with("Delay(0.1)\nGripperClose()\nDelay(3)", Setup { settings, ..Setup::default() });
    assert_eq!(finished.outcome.end, End::RobotError(Code::NO_GRIPPER));
}

#[test]
fn commands_that_nothing_makes_possible_end_the_run() {
    let finished = run("ActivateRobot()\nDelay(1)");
    assert_eq!(finished.outcome.end, End::HeldBack(WaitReason::NotHomed));
    assert_eq!(finished.outcome.step, Some(1));
    let finished = run("ActivateRobot()\nHome()\nDeactivateRobot()\nDelay(1)");
    assert_eq!(finished.outcome.end, End::HeldBack(WaitReason::NotActivated));
    assert_eq!(finished.outcome.step, Some(3));
}

#[test]
fn an_interrupt_pauses_clears_and_ends_in_bounded_time() {
    // Connecting, bringing up, moving, velocity: whatever the run is at.
    for interrupt_at in [1, 20, 150, 2_000, 4_000, 5_000] {
        let text = "MoveJoints(90, 0, 0, 0, 0, 0)\nMoveJointsVel(1, 0, 0, 0, 0, 0)\nDelay(3600)";
        let setup = Setup { interrupt_at: Some(interrupt_at), ..Setup::default() };
        let finished = run_with(text, setup);
        assert_eq!(finished.outcome.end, End::Interrupted, "at {interrupt_at}");
        let bound = u64::try_from(STOP_LIMIT.as_millis()).unwrap() + 5;
        assert!(finished.cycles <= interrupt_at + bound, "at {interrupt_at}: {}", finished.cycles);
        assert_eq!(finished.last_outputs, [0; 60], "at {interrupt_at}");
        if interrupt_at >= 4_000 {
            assert_eq!(finished.outcome.stop, Stop::Confirmed, "at {interrupt_at}");
            assert_eq!(finished.robot.pending_commands(), 0, "at {interrupt_at}");
        }
    }
}

/// A robot that is up quickly, so that every cycle of it can be tried.
fn quick() -> RobotSettings {
    let times = LifecycleTimes {
        activation: Duration::from_millis(20),
        deactivation: Duration::from_millis(10),
        homing: Duration::from_millis(60),
        boot: Duration::from_millis(100),
    };
    RobotSettings { times, ..RobotSettings::default() }
}

#[test]
fn after_an_interrupt_nothing_begins_to_move() {
    let text = "MoveJoints(90, 0, 0, 0, 0, 0)\nDelay(3600)";
    let (mut deactivated, mut while_homing) = (0, 0);
    for homed in [false, true] {
        for interrupt_at in 1..160 {
            let settings = RobotSettings { homed, ..quick() };
            let setup = Setup { settings, interrupt_at: Some(interrupt_at), ..Setup::default() };
            let mut finished = run_with(text, setup);
            let at = format!("at {interrupt_at}, homed before: {homed}");
            assert_eq!(finished.outcome.end, End::Interrupted, "{at}");
            let stop = finished.outcome.stop;
            let is_stopped = matches!(
                stop,
                Stop::NotNeeded | Stop::NotActivated | Stop::Deactivated | Stop::Confirmed
            );
            assert!(is_stopped, "{at}: {stop:?}");
            assert!(finished.cycles < interrupt_at + 500, "{at}: {}", finished.cycles);
            assert!(finished.homing_cycles_after <= 8, "{at}: {}", finished.homing_cycles_after);
            let lifecycle = finished.robot.lifecycle();
            if stop == Stop::Confirmed {
                assert_eq!(lifecycle, Lifecycle::Activated, "{at}");
            } else {
                assert_eq!(lifecycle, Lifecycle::Deactivated, "{at}: {stop:?}");
            }
            deactivated += u32::from(stop == Stop::Deactivated);
            while_homing +=
                u32::from(finished.homing_cycles_before > 0 && lifecycle == Lifecycle::Deactivated);
            let before = finished.robot.target_joints();
            let end = Instant::from_millis(finished.cycles + 1);
            for cycle in 0..800 {
                let now = end + Duration::from_millis(cycle);
                let mut inputs = [0; INPUT_LEN];
                finished.robot.cycle(now, Some(&[0; OUTPUT_LEN]), &mut inputs);
            }
            // Paused is told while the arm still brakes.
            let braking_deg = if stop == Stop::Confirmed { 2.0 } else { 0.0 };
            for (joint, before) in finished.robot.target_joints().into_iter().zip(before) {
                assert!((joint - before).abs() <= braking_deg, "{at}: {before} to {joint}");
            }
        }
    }
    assert!(deactivated > 50 && while_homing > 20, "{deactivated} {while_homing}");
}

#[test]
fn a_link_lost_at_any_time_of_the_bring_up_is_a_lost_link() {
    for at in [25, 30, 60, 120, 180, 230, 300, 1_000, 3_000] {
        let finished = run_with("Delay(20)", lost_at(at));
        assert_eq!(finished.outcome.end, End::ConnectionLost, "at {at}");
        assert_eq!(finished.outcome.stop, Stop::NotNeeded, "at {at}");
        assert!(finished.cycles < at + 100, "at {at}: {}", finished.cycles);
    }
}

fn lost_at(at: u64) -> Setup {
    const LOST: [(u64, Accident); 9] = [
        (25, |cycle, _| lost_from::<25>(cycle)),
        (30, |cycle, _| lost_from::<30>(cycle)),
        (60, |cycle, _| lost_from::<60>(cycle)),
        (120, |cycle, _| lost_from::<120>(cycle)),
        (180, |cycle, _| lost_from::<180>(cycle)),
        (230, |cycle, _| lost_from::<230>(cycle)),
        (300, |cycle, _| lost_from::<300>(cycle)),
        (1_000, |cycle, _| lost_from::<1_000>(cycle)),
        (3_000, |cycle, _| lost_from::<3_000>(cycle)),
    ];
    let (_, accident) = LOST.into_iter().find(|(cycle, _)| *cycle == at).expect("one of these");
    Setup { accident, ..Setup::default() }
}

fn lost_from<const AT: u64>(cycle: u64) -> InputQuality {
    if cycle < AT { InputQuality::Fresh } else { InputQuality::Lost }
}

#[test]
fn a_link_that_fails_is_an_outcome_and_says_why() {
    for fails_at in [1, 30, 300, 4_000] {
        let setup = Setup { fails_at: Some(fails_at), ..Setup::default() };
        let finished = run_with("Delay(20)", setup);
        let End::LinkFailed(message) = finished.outcome.end else {
            panic!("at {fails_at}: {:?}", finished.outcome)
        };
        assert_eq!(message.as_str(), "the plug was pulled");
        assert_eq!(finished.last_outputs, [0; 60], "safe outputs are tried all the same");
    }
}

#[test]
fn a_reboot_as_a_line_of_the_program_is_done_when_the_robot_is_back() {
    for settings in [quick(), RobotSettings::default()] {
        let finished = run_with("RebootRobot()", Setup { settings, ..Setup::default() });
        assert_eq!(finished.outcome.end, End::Completed);
        assert_eq!(finished.counts.done, 1);
    }
}

#[test]
fn a_safety_signal_while_activating_or_homing_ends_the_run_at_once() {
    let accidents: [(u64, SafetySignals, Accident); 4] = [
        (100, SafetySignals::E_STOP, |cycle, robot| {
            if cycle == 100 {
                robot.panel().press_e_stop();
            }
            InputQuality::Fresh
        }),
        (1_000, SafetySignals::E_STOP, |cycle, robot| {
            if cycle == 1_000 {
                robot.panel().press_e_stop();
            }
            InputQuality::Fresh
        }),
        (1_000, SafetySignals::P_STOP2, |cycle, robot| {
            if cycle == 1_000 {
                robot.panel().press_p_stop2();
            }
            InputQuality::Fresh
        }),
        (1, SafetySignals::P_STOP2, |cycle, robot| {
            if cycle == 1 {
                robot.panel().press_p_stop2();
            }
            InputQuality::Fresh
        }),
    ];
    for (at, signals, accident) in accidents {
        let finished = run_with("Delay(1)", Setup { accident, ..Setup::default() });
        assert_eq!(finished.outcome.end, End::SafetyStop(signals), "at {at}");
        assert!(finished.cycles < at + 400, "at {at}: {}", finished.cycles);
        assert_ne!(finished.outcome.stop, Stop::Unconfirmed, "at {at}");
    }
}

#[test]
fn a_robot_that_was_never_activated_is_not_stopped() {
    let finished = run("ActivateRobot()\nDeactivateRobot()\nHome()");
    assert_eq!(finished.outcome.end, End::ActionFailed(Action::Home, Fault::WrongState));
    assert!(
        matches!(finished.outcome.stop, Stop::Deactivated | Stop::NotActivated),
        "{:?}",
        finished.outcome.stop
    );
    assert!(finished.cycles < 1_000, "{}", finished.cycles);
}

#[test]
fn a_lost_link_ends_the_run() {
    let accident: Accident = |cycle, _| match cycle {
        ..4_000 => InputQuality::Fresh,
        _ => InputQuality::Lost,
    };
    let finished = run_with("Delay(20)", Setup { accident, ..Setup::default() });
    assert_eq!(finished.outcome.end, End::ConnectionLost);
    assert!(finished.cycles < 4_100, "{}", finished.cycles);
}

#[test]
fn a_short_gap_is_survived() {
    let accident: Accident = |cycle, _| match cycle % 100 {
        0..5 => InputQuality::Stale { age_cycles: u32::try_from(cycle % 100).unwrap() + 1 },
        _ => InputQuality::Fresh,
    };
    let text = "MoveJoints(20, 0, 0, 0, 0, 0)\nDelay(0.2)\nMoveJoints(0, 0, 0, 0, 0, 0)";
    let finished = run_with(text, Setup { accident, ..Setup::default() });
    assert_eq!(finished.outcome.end, End::Completed);
}

#[test]
fn nobody_there_is_no_connection() {
    let finished =
        run_with("Delay(1)", Setup { accident: |_, _| InputQuality::Lost, ..Setup::default() });
    assert_eq!(finished.outcome.end, End::NotConnected);
}

#[test]
fn a_connection_that_only_watches_is_told() {
    let settings = RobotSettings { monitoring_only: true, ..RobotSettings::default() };
    let finished = run_with("Delay(1)", Setup { settings, ..Setup::default() });
    assert_eq!(finished.outcome.end, End::MonitoringOnly);
}

#[test]
fn a_protective_stop_ends_the_run() {
    let accident: Accident = |cycle, robot| {
        if cycle == 4_000 {
            robot.panel().press_p_stop2();
        }
        InputQuality::Fresh
    };
    let finished = run_with("Delay(1)\nDelay(20)", Setup { accident, ..Setup::default() });
    assert_eq!(finished.outcome.end, End::SafetyStop(SafetySignals::P_STOP2));
    assert!(finished.cycles < 4_100, "{}", finished.cycles);
}

#[test]
fn an_emergency_stop_before_the_bring_up_fails_it() {
    let accident: Accident = |cycle, robot| {
        if cycle == 1 {
            robot.panel().press_e_stop();
        }
        InputQuality::Fresh
    };
    let finished = run_with("Delay(1)", Setup { accident, ..Setup::default() });
    assert_eq!(finished.outcome.end, End::SafetyStop(SafetySignals::E_STOP));
    assert_eq!(finished.outcome.step, None, "no line of the program is to blame");
}

#[test]
fn distance_is_the_length_of_the_path() {
    let there = "MovePose(180, 0, 180, 180, 0, 180)\n";
    let with_line = run(&format!("{there}MoveLinRelWrf(0, 50, 0, 0, 0, 0)")).distance_mm;
    let without = run(there).distance_mm;
    assert!((with_line - without - 50.0).abs() < 0.05, "{}", with_line - without);
    let with_tool = run(&format!("{there}SetTrf(0, 0, 100, 0, 0, 0)\nDelay(0.1)")).distance_mm;
    assert!(
        (with_tool - without).abs() < 0.05,
        "a longer tool is no way travelled: {with_tool} and {without}"
    );
}
