//! The program runner over the text interface against the virtual robot, in simulated time.
#![cfg(feature = "cli")]

#[path = "run_text/deaf.rs"]
mod deaf;
#[path = "support/quick_robot.rs"]
mod quick_robot;

use fieldarm::engine::meca500::{AbortReason, Action, Event, Fault, WaitReason};
use fieldarm::link::text::Port;
use fieldarm::link::text::memory::MemoryConnection;
use fieldarm::run::drive::{Observer, Progress};
use fieldarm::run::outcome::{End, LinkMessage, Outcome, Stop};
use fieldarm::run::program::Program;
use fieldarm::run::record::{Counts, StepEnd, StepRecord};
use fieldarm::run::recording::Recording;
use fieldarm::run::runner::STOP_LIMIT;
use fieldarm::run::text::{Heard, TextLink, TextRunner, TextSettings, drive_text};
use fieldarm::sim::meca500::{FittedTool, Lifecycle, Readings, RobotSettings, VirtualRobot};
use fieldarm::text_device::TextDevice;
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::image::SafetySignals;
use fieldarm::wire::meca500::revision::Revision;
use fieldarm::wire::meca500::text::Message;

use quick_robot::quick_robot;

/// A quick robot with a gripper.
fn armed() -> RobotSettings {
    RobotSettings { tool: FittedTool::Megp25E, ..quick_robot() }
}

type Cell = MemoryConnection<VirtualRobot>;

/// No run here lasts longer.
const LONGEST: Duration = Duration::from_secs(600);
/// More messages than any run here hears.
const MOST_MESSAGES: u64 = 2_000_000;

/// What happens in the cell, beside the program: called before every wait.
type Accident = Box<dyn FnMut(&mut Cell)>;

/// A robot on which accidents happen.
struct Accidents {
    cell: Cell,
    accident: Accident,
    /// The connection breaks when so many messages have been handed over.
    cut_after: Option<u64>,
    /// The robot falls silent when so many messages have been handed over.
    mute_after: Option<u64>,
    heard: u64,
    said: Vec<String>,
}

impl TextLink for Accidents {
    type Error = String;

    fn now(&self) -> Instant {
        self.cell.now()
    }

    fn send(&mut self, command: &str) -> Result<bool, String> {
        self.said.push(command.into());
        self.cell.send(command).map(|()| true).map_err(|reason| reason.to_string())
    }

    fn receive(
        &mut self,
        until: Instant,
        take: &mut dyn FnMut(Instant, Heard<'_>),
    ) -> Result<(), String> {
        let last = self.said.get(self.said.len().saturating_sub(8)..).unwrap_or_default();
        assert!(self.now() - Instant::ZERO < LONGEST, "the run does not end: {last:?}");
        assert!(self.heard < MOST_MESSAGES, "the run does not end");
        (self.accident)(&mut self.cell);
        let Self { cell, heard, cut_after, mute_after, .. } = self;
        let mut cuts = false;
        let received = cell.receive(until, &mut |at, port, message| {
            if port == Port::Monitoring {
                return take(at, Heard::Monitoring(message));
            }
            cuts |= *cut_after == Some(*heard);
            if !cuts && mute_after.is_none_or(|limit| *heard < limit) {
                take(at, Heard::Control(message));
            }
            *heard += 1;
        });
        if cuts {
            cell.cut();
            return Err("cut".into());
        }
        received.map_err(|reason| reason.to_string())
    }

    fn reconnect(&mut self) -> bool {
        self.cell.pass(Duration::from_millis(50));
        self.cell.connect().is_ok()
    }
}

#[derive(Default)]
struct Watch {
    interrupt_at: Option<u64>,
    passes: u64,
    checkpoints: Vec<u16>,
    actions: Vec<Action>,
    events: Vec<Event>,
}

impl Observer for Watch {
    fn is_interrupted(&mut self) -> bool {
        self.passes += 1;
        self.interrupt_at.is_some_and(|at| self.passes >= at)
    }

    fn event(&mut self, event: &Event, _step: Option<usize>) {
        match event {
            Event::CheckpointReached { number } => self.checkpoints.push(*number),
            Event::ActionDone(action) => self.actions.push(*action),
            _ => {}
        }
        self.events.push(*event);
    }

    fn wants_progress(&mut self, _passes: u64) -> bool {
        false
    }

    fn progress(&mut self, _progress: &Progress) {}
}

struct Setup {
    robot: RobotSettings,
    settings: TextSettings,
    accident: Accident,
    cut_after: Option<u64>,
    mute_after: Option<u64>,
    interrupt_at: Option<u64>,
    latency: Duration,
    with_monitor: bool,
}

impl Default for Setup {
    fn default() -> Self {
        Self {
            robot: armed(),
            settings: TextSettings::default(),
            accident: Box::new(|_| {}),
            cut_after: None,
            mute_after: None,
            interrupt_at: None,
            latency: Duration::ZERO,
            with_monitor: false,
        }
    }
}

/// Everything to know about a finished run.
struct Finished {
    outcome: Outcome,
    counts: Counts,
    records: Vec<StepRecord>,
    watch: Watch,
    cell: Cell,
    said: Vec<String>,
    heard: u64,
    recording: Recording,
    lost: Option<LinkMessage>,
    took: Duration,
}

impl Finished {
    fn robot(&self) -> &VirtualRobot {
        self.cell.device()
    }
}

fn run_on(mut cell: Cell, text: &str, setup: Setup) -> Finished {
    let program = Program::parse(text, Revision::R3).expect("a good program");
    cell.latency = setup.latency;
    cell.connect().expect("nobody else controls it");
    if setup.with_monitor {
        assert!(cell.monitor());
    }
    let began = cell.now();
    let mut link = Accidents {
        cell,
        accident: setup.accident,
        cut_after: setup.cut_after,
        mute_after: setup.mute_after,
        heard: 0,
        said: Vec::new(),
    };
    let mut runner = TextRunner::new(&program, setup.settings);
    let mut recording = Recording::new();
    let mut watch = Watch { interrupt_at: setup.interrupt_at, ..Watch::default() };
    let outcome = drive_text(&mut link, &mut runner, &mut recording, &mut watch);
    let Accidents { cell, said, heard, .. } = link;
    let counts = runner.counts();
    assert_eq!(
        counts.open(),
        0,
        "the fate of every line is told: {outcome:?} {:?}",
        runner.records()
    );
    Finished {
        outcome,
        counts,
        records: runner.records().to_vec(),
        lost: runner.lost(),
        watch,
        took: cell.now() - began,
        cell,
        said,
        heard,
        recording,
    }
}

fn run_with(text: &str, setup: Setup) -> Finished {
    let cell = MemoryConnection::new(VirtualRobot::new(setup.robot.clone()));
    run_on(cell, text, setup)
}

fn run(text: &str) -> Finished {
    run_with(text, Setup::default())
}

fn seconds(record: &StepRecord) -> f64 {
    let (began, ended) = (record.started.unwrap(), record.ended.unwrap());
    (ended - began).as_secs_f64()
}

const COMPLETED: Outcome = Outcome { end: End::Completed, step: None, stop: Stop::NotNeeded };

/// Every kind of line there is.
const EVERYTHING: &str = "SetRtc(1700000000)\nActivateSim()\nDeactivateSim()\nSetTimeScaling(100)\n\
    SetJointVel(60)\nMoveJoints(10, -10, 10, 0, 20, 0)\nSetTrf(0, 0, 50, 0, 0, 0)\nSetCheckpoint(5)\n\
    MoveLinRelWrf(0, 0, 5, 0, 0, 0)\nGripperOpen()\nSetVelTimeout(0.1)\nMoveJointsVel(5, 0, 0, 0, 0, 0)\n\
    MoveJointsVel(-5, 0, 0, 0, 0, 0)\nDelay(0.05)\nPauseMotion()\nResumeMotion()\nSetRtc(1700000001)\n\
    MoveJoints(5, 0, 0, 0, 20, 0)\nClearMotion()\nResumeMotion()\nResetError()\nMoveJoints(1, 2, 3, 4, 5, 6)\nDeactivateRobot()\n\
    SetJointLimitsCfg(0)\nActivateRobot()\nHome()\nResumeMotion()\nDelay(0.01)";

#[test]
fn a_program_ends_with_its_last_checkpoint() {
    let finished =
        run("MoveJoints(10, 0, 0, 0, 0, 0)\nSetCheckpoint(5)\nSetCheckpoint(5)\nDelay(0.5)");
    assert_eq!(finished.outcome, COMPLETED);
    assert_eq!(finished.watch.checkpoints, [5, 5]);
    assert!(finished.records.iter().all(|record| record.end == StepEnd::Done));
    assert!(finished.records.iter().all(|record| record.accepted.is_some()));
    assert!((seconds(&finished.records[3]) - 0.5).abs() < 0.02, "the delay was waited for");
    assert!((finished.robot().target_joints()[0] - 10.0).abs() < 1e-3);
    let last = finished.recording.samples().last().expect("positions were told");
    assert!((last.seen.joints_deg[0] - 10.0).abs() < 1e-3, "{last:?}");
    assert_eq!(last.done, 4);
    assert!(finished.recording.robot_time_us() > 500_000);
}

#[test]
fn every_kind_of_line_is_done_under_every_reading_of_the_manual() {
    let default = [("default", "", Readings::default())].into_iter();
    let others = Readings::variations().map(|v| (v.switch, v.value, v.readings));
    for (switch, value, readings) in default.chain(others) {
        let robot = RobotSettings { readings, ..armed() };
        let finished = run_with(EVERYTHING, Setup { robot, ..Setup::default() });
        assert_eq!(finished.outcome, COMPLETED, "{switch} {value}");
        let cleared = StepEnd::Aborted(AbortReason::Cleared);
        for (step, record) in finished.records.iter().enumerate() {
            // What ClearMotion finds under way is dropped by it.
            let expected = if step == 17 { cleared } else { StepEnd::Done };
            assert_eq!(record.end, expected, "step {step}: {switch} {value}");
        }
        let joints = finished.robot().target_joints();
        assert!((joints[2] - 3.0).abs() < 1e-3, "{joints:?} {switch} {value}");
    }
}

#[test]
fn a_slow_network_changes_times_and_nothing_else() {
    for millis in [1, 40, 700] {
        let latency = Duration::from_millis(millis);
        let finished = run_with(EVERYTHING, Setup { latency, ..Setup::default() });
        assert_eq!(finished.outcome, COMPLETED, "{millis} ms");
        // A move may be done before a slow ClearMotion finds it.
        assert!(finished.counts.done >= 27, "{millis} ms: {:?}", finished.counts);
    }
}

#[test]
fn positions_may_come_over_the_monitoring_port() {
    let settings = TextSettings { copies_monitoring: false, ..TextSettings::default() };
    let setup = Setup { settings, with_monitor: true, ..Setup::default() };
    let finished = run_with("MoveJoints(30, 0, 0, 0, 0, 0)", setup);
    assert_eq!(finished.outcome, COMPLETED);
    assert!(!finished.said.iter().any(|line| line.starts_with("SetCtrlPortMonitoring")));
    assert!(finished.recording.samples().len() > 10);
    assert!(finished.recording.distance_mm() > 50.0);
}

#[test]
fn settings_for_the_run_are_put_back() {
    let settings = TextSettings {
        interval: Some(Duration::from_millis(2)),
        watchdog: Some(Duration::from_millis(500)),
        ..TextSettings::default()
    };
    let finished = run_with("Delay(3)", Setup { settings, ..Setup::default() });
    assert_eq!(finished.outcome, COMPLETED);
    let place = |line: &str| finished.said.iter().position(|said| said == line);
    assert!(place("SetMonitoringInterval(0.002)") < place("SetMonitoringInterval(0.015)"));
    assert!(place("SetCtrlPortMonitoring(1)") < place("SetCtrlPortMonitoring(0)"));
    let fed = finished.said.iter().filter(|line| line.starts_with("-ConnectionWatchdog(0.5"));
    assert!(fed.count() > 15, "it is fed three times a period");
    assert!(place("ConnectionWatchdog(0)").is_some());
    assert!(finished.recording.samples().len() > 1_000);
}

#[test]
fn long_programs_never_overfill_the_queue_and_keep_to_the_rate() {
    let lines = 3_000;
    let text: String = (0..lines).map(|n| format!("SetJointVel({})\n", 1 + n % 100)).collect();
    let mut most = 0;
    let cell = MemoryConnection::new(VirtualRobot::new(armed()));
    let fullest = std::rc::Rc::new(std::cell::Cell::new(0));
    let seen = std::rc::Rc::clone(&fullest);
    let accident: Accident = Box::new(move |cell| {
        most = most.max(cell.device().pending_commands());
        seen.set(most);
    });
    let finished = run_on(cell, &text, Setup { accident, ..Setup::default() });
    assert_eq!(finished.outcome, COMPLETED);
    assert_eq!(finished.counts.done, lines);
    assert!(fullest.get() < 1_000, "{}", fullest.get());
    let rate = finished.said.len() as f64 / finished.took.as_secs_f64();
    assert!((100.0..250.0).contains(&rate), "{rate} lines a second");
}

#[test]
fn a_window_of_commands_waits_for_a_robot_that_is_slower() {
    let text: String =
        (0..1_500).map(|n| format!("MoveJoints({}, 0, 0, 0, 0, 0)\n", n % 2)).collect();
    let finished = run(&text);
    assert_eq!(finished.outcome, COMPLETED);
    assert_eq!(finished.counts.done, 1_500);
}

#[test]
fn a_program_with_few_free_checkpoints_is_followed_too() {
    let settings = TextSettings { checkpoints: (7_981, 8_000), ..TextSettings::default() };
    let text: String = (1..=200).map(|n| format!("SetCheckpoint({n})\n")).collect();
    let finished = run_with(&text, Setup { settings, ..Setup::default() });
    assert_eq!(finished.outcome, COMPLETED);
    assert_eq!(finished.watch.checkpoints, (1..=200).collect::<Vec<u16>>());
}

#[test]
fn a_velocity_line_lasts_as_long_as_the_timeout_in_force() {
    let finished = run(
        "MoveJointsVel(10, 0, 0, 0, 0, 0)\nSetVelTimeout(0.4)\nMoveJointsVel(10, 0, 0, 0, 0, 0)\n\
         MoveJointsVel(-10, 0, 0, 0, 0, 0)\nDelay(0)",
    );
    assert_eq!(finished.outcome.end, End::Completed);
    let [first, _, second, third, _] = finished.records[..] else { panic!("five steps") };
    assert!(seconds(&first) >= 0.05 && seconds(&first) < 0.4, "{}", seconds(&first));
    assert!((seconds(&second) - 0.4).abs() < 0.004, "{}", seconds(&second));
    assert!(seconds(&third) >= 0.4 && seconds(&third) < 1.2, "{}", seconds(&third));
    assert_eq!(third.started, second.ended, "no stop between velocity lines");
    let joint = finished.robot().target_joints()[0];
    assert!(joint.abs() < 5.0, "there and back: {joint}");
}

#[test]
fn actions_on_the_queue_do_not_wait_for_what_is_queued() {
    let finished = run("Delay(50)\nDelay(50)\nClearMotion()\nResumeMotion()\nDelay(0.1)");
    assert_eq!(finished.outcome.end, End::Completed);
    let ends: Vec<StepEnd> = finished.records.iter().map(|record| record.end).collect();
    let cleared = StepEnd::Aborted(AbortReason::Cleared);
    assert_eq!(ends, [cleared, cleared, StepEnd::Done, StepEnd::Done, StepEnd::Done]);
    assert!(finished.took < Duration::from_secs(10), "{:?}", finished.took);
    let finished = run("MoveJoints(60, 0, 0, 0, 0, 0)\nPauseMotion()\nResumeMotion()");
    assert_eq!(finished.outcome.end, End::Completed);
    let [moved, paused, resumed] = finished.records[..] else { panic!("three steps") };
    assert!(paused.ended < moved.ended && resumed.ended < moved.ended, "not after the move");
    let finished = run("MoveJoints(30, 0, 0, 0, 0, 0)\nDeactivateRobot()");
    assert_eq!(finished.outcome.end, End::Completed);
    assert!(
        (finished.robot().target_joints()[0] - 30.0).abs() < 1e-3,
        "the move was not cut short"
    );
}

#[test]
fn a_tool_frame_that_changes_is_no_distance() {
    let text = "MoveJoints(0, 0, 0, 0, 20, 0)\nDelay(0.1)\nSetTrf(0, 0, 200, 0, 0, 0)\nDelay(0.2)";
    let with = run(text).recording.distance_mm();
    let without = run("MoveJoints(0, 0, 0, 0, 20, 0)\nDelay(0.3)").recording.distance_mm();
    assert!((with - without).abs() < 1.0, "{with} {without}");
}

#[test]
fn a_robot_error_blames_the_first_command_it_dropped() {
    let text = "MoveJoints(0, -20, 20, 0, 60, 0)\nSetCheckpoint(1)\nMoveLin(480, 0, 180, 180, 0, 180)\n\
                SetCheckpoint(2)";
    let others = Readings::variations().map(|v| (v.switch, v.value, v.readings));
    for (switch, value, readings) in
        [("default", "", Readings::default())].into_iter().chain(others)
    {
        let robot = RobotSettings { readings, ..armed() };
        let finished = run_with(text, Setup { robot, ..Setup::default() });
        assert_eq!(finished.outcome.end, End::RobotError(Code::OUT_OF_REACH), "{switch} {value}");
        assert_eq!(finished.outcome.step, Some(2), "{switch} {value}");
        assert_eq!(finished.outcome.stop, Stop::NotNeeded, "{switch} {value}");
        assert_eq!(finished.watch.checkpoints, [1], "{switch} {value}");
        assert_eq!((finished.counts.done, finished.counts.aborted), (2, 2), "{switch} {value}");
    }
}

#[test]
fn what_the_robot_lacks_is_refused_and_nothing_behind_it_is_sent() {
    let robot = RobotSettings { tool: FittedTool::None, ..armed() };
    let text = "MoveJoints(2, 0, 0, 0, 0, 0)\nGripperClose()\nMoveJoints(90, 0, 0, 0, 0, 0)";
    let finished = run_with(text, Setup { robot: robot.clone(), ..Setup::default() });
    assert_eq!(finished.outcome.end, End::RobotError(Code::NO_GRIPPER));
    assert_eq!((finished.outcome.step, finished.outcome.stop), (Some(1), Stop::Confirmed));
    assert!(!finished.said.iter().any(|line| line.contains("90")), "{:?}", finished.said);
    let aborted = StepEnd::Aborted(AbortReason::Error(Code::NO_GRIPPER));
    assert_eq!(finished.records[1].end, aborted);
    let finished = run_with(
        "StartProgram(3)\nMoveJoints(90, 0, 0, 0, 0, 0)",
        Setup { robot, ..Setup::default() },
    );
    assert_eq!(finished.outcome.end, End::RobotError(Code::NO_OFFLINE_PROGRAM));
    assert_eq!(finished.outcome.step, Some(0));
    assert!(!finished.said.iter().any(|line| line.contains("90")), "{:?}", finished.said);
}

#[test]
fn a_stored_program_is_waited_for() {
    let mut robot = VirtualRobot::new(armed());
    let lines = vec!["Delay(1)".to_string(), "MoveJoints(7,0,0,0,0,0)".to_string()];
    robot.restore_program(3, lines).expect("it may be stored");
    let text = "StartProgram(3)\nMoveJointsRel(1, 0, 0, 0, 0, 0)";
    let finished = run_on(MemoryConnection::new(robot), text, Setup::default());
    assert_eq!(finished.outcome, COMPLETED);
    assert!((finished.robot().target_joints()[0] - 8.0).abs() < 1e-3);
    assert!(seconds(&finished.records[0]) > 1.0);
}

#[test]
fn commands_that_nothing_makes_possible_end_the_run() {
    for (text, reason, step) in [
        ("ActivateRobot()\nDelay(1)", WaitReason::NotHomed, 1),
        ("ActivateRobot()\nHome()\nDeactivateRobot()\nDelay(1)", WaitReason::NotActivated, 3),
        ("Delay(0)\nSetJointLimitsCfg(1)\nDelay(1)", WaitReason::NotDeactivated, 1),
    ] {
        let finished = run(text);
        assert_eq!(finished.outcome.end, End::HeldBack(reason), "{text}");
        assert_eq!(finished.outcome.step, Some(step), "{text}");
    }
    let failed = |text, action| {
        let finished = run(text);
        assert_eq!(finished.outcome.end, End::ActionFailed(action, Fault::WrongState), "{text}");
    };
    failed("Home()\nActivateRobot(1)", Action::ClearHoming);
    failed("Home()\nActivateSim()", Action::Simulation(true));
    failed("DeactivateRobot()\nActivateRobot()\nDeactivateRobot()\nHome()\nDelay(1)", Action::Home);
}

#[test]
fn an_interrupt_pauses_clears_and_ends_in_bounded_time() {
    let text = "MoveJoints(90, 0, 0, 0, 0, 0)\nSetVelTimeout(1)\nMoveJointsVel(1, 0, 0, 0, 0, 0)\nDelay(3600)";
    let mut stops = Vec::new();
    for interrupt_at in (1..40).chain((40..1_400).step_by(97)) {
        let finished =
            run_with(text, Setup { interrupt_at: Some(interrupt_at), ..Setup::default() });
        assert_eq!(finished.outcome.end, End::Interrupted, "at {interrupt_at}");
        let robot = finished.robot();
        assert_eq!(robot.pending_commands(), 0, "at {interrupt_at}");
        let late = !matches!(robot.lifecycle(), Lifecycle::Activating | Lifecycle::Homing);
        assert!(late, "at {interrupt_at}: {:?}", robot.lifecycle());
        // It stands, and goes on standing.
        let mut cell = finished.cell;
        cell.pass(Duration::from_millis(300));
        let before = cell.device().target_joints();
        cell.pass(Duration::from_millis(500));
        assert_eq!(cell.device().target_joints(), before, "at {interrupt_at}");
        stops.push(finished.outcome.stop);
    }
    for stop in [Stop::NotNeeded, Stop::NotActivated, Stop::Deactivated, Stop::Confirmed] {
        assert!(stops.contains(&stop), "{stop:?} is among {stops:?}");
    }
    assert!(!stops.contains(&Stop::Unconfirmed), "{stops:?}");
}

#[test]
fn a_robot_that_does_not_answer_any_more_ends_the_run() {
    for mute_after in [0, 30, 120, 400] {
        let setup = Setup { mute_after: Some(mute_after), ..Setup::default() };
        let finished = run_with("MoveJoints(90, 0, 0, 0, 0, 0)\nDelay(5)", setup);
        let end = if mute_after <= 30 { End::NotConnected } else { End::Fault(Fault::AckTimeout) };
        assert_eq!(finished.outcome.end, end, "after {mute_after}");
        assert!(finished.took < Duration::from_secs(25), "after {mute_after}: {:?}", finished.took);
    }
    let setup = Setup { mute_after: Some(400), interrupt_at: Some(500), ..Setup::default() };
    let finished = run_with("MoveJoints(90, 0, 0, 0, 0, 0)\nDelay(5)", setup);
    assert_eq!(finished.outcome.end, End::Interrupted);
    assert_eq!(finished.outcome.stop, Stop::Unconfirmed);
    assert!(finished.took < STOP_LIMIT + Duration::from_secs(10), "{:?}", finished.took);
}

#[test]
fn a_connection_that_breaks_at_any_message_ends_the_run_there() {
    let text = "MoveJoints(3, 0, 0, 0, 0, 0)\nSetTimeScaling(100)\nMoveJointsVel(5, 0, 0, 0, 0, 0)\nPauseMotion()\n\
                ResumeMotion()\nDeactivateRobot()";
    let whole = run(text);
    assert_eq!(whole.outcome, COMPLETED);
    let (mut lost, mut unknown) = (0, 0);
    for cut_after in 0..whole.heard {
        let setup = Setup { cut_after: Some(cut_after), ..Setup::default() };
        let finished = run_with(text, setup);
        if finished.outcome.end == End::Completed {
            // Only what puts settings back was cut off.
            assert_eq!(finished.counts.done, 6, "after {cut_after}");
            continue;
        }
        lost += 1;
        assert_eq!(finished.outcome.end, End::ConnectionLost, "after {cut_after}");
        assert_eq!(finished.lost.map(|lost| lost.as_str().to_string()), Some("cut".into()));
        unknown += finished.counts.unknown;
        for (record, first) in finished.records.iter().zip(&whole.records) {
            let is_done = record.end == StepEnd::Done;
            assert!(!is_done || record.ended == first.ended, "after {cut_after}");
        }
        // A line is sent once, and nothing after the end.
        let sent = |line: &str| finished.said.iter().filter(|said| *said == line).count();
        assert!(sent("MoveJoints(3,0,0,0,0,0)") <= 1 && sent("MoveJointsVel(5,0,0,0,0,0)") <= 1);
    }
    assert!(lost > 50 && unknown > 20, "{lost} {unknown}");
}

/// Does something once when the first joint has gone so far, and something else a second later.
fn at_joint(
    degrees: f64,
    first: impl Fn(&mut VirtualRobot) + 'static,
    then: impl Fn(&mut VirtualRobot) + 'static,
) -> Accident {
    let mut began: Option<Instant> = None;
    let mut is_over = false;
    Box::new(move |cell| match began {
        None if cell.device().target_joints()[0] > degrees => {
            began = Some(cell.now());
            first(cell.device_mut());
        }
        Some(at) if !is_over && cell.now() - at > Duration::from_secs(1) => {
            is_over = true;
            then(cell.device_mut());
        }
        _ => {}
    })
}

const LONG_MOVE: &str =
    "SetJointVel(20)\nMoveJoints(90, 0, 0, 0, 0, 0)\nMoveJoints(0, 0, 0, 0, 0, 0)";

#[test]
fn safety_signals_end_the_run_and_leave_nothing_queued() {
    let default = [("default", "", Readings::default())].into_iter();
    let others = Readings::variations().map(|v| (v.switch, v.value, v.readings));
    for (switch, value, readings) in default.chain(others) {
        let robot = RobotSettings { readings, revision: Revision::R4, ..armed() };
        let accident = at_joint(5.0, |robot| robot.panel().press_p_stop2(), |_| {});
        let finished =
            run_with(LONG_MOVE, Setup { accident, robot: robot.clone(), ..Setup::default() });
        assert_eq!(
            finished.outcome.end,
            End::SafetyStop(SafetySignals::P_STOP2),
            "{switch} {value}"
        );
        assert_eq!(finished.outcome.step, Some(1), "{switch} {value}");
        assert_eq!(finished.robot().pending_commands(), 0, "{switch} {value}");
        let accident = at_joint(5.0, |robot| robot.panel().press_e_stop(), |_| {});
        let finished = run_with(LONG_MOVE, Setup { accident, robot, ..Setup::default() });
        assert_eq!(
            finished.outcome.end,
            End::SafetyStop(SafetySignals::E_STOP),
            "{switch} {value}"
        );
        // It deactivates itself, or has cleared its queue before that.
        let is_stopped = matches!(finished.outcome.stop, Stop::NotActivated | Stop::Confirmed);
        assert!(is_stopped, "{:?} {switch} {value}", finished.outcome.stop);
        let dropped = StepEnd::Aborted(AbortReason::SafetyStop);
        assert_eq!(finished.records[1].end, dropped, "{switch} {value}");
    }
}

#[test]
fn a_signal_that_stands_at_the_beginning_is_told_before_anything_moves() {
    for readings in
        [Readings::default()].into_iter().chain(Readings::variations().map(|v| v.readings))
    {
        let mut robot = VirtualRobot::new(RobotSettings { readings, ..armed() });
        robot.panel().press_p_stop2();
        let finished = run_on(MemoryConnection::new(robot), LONG_MOVE, Setup::default());
        assert_eq!(finished.outcome.end, End::SafetyStop(SafetySignals::P_STOP2));
        assert_eq!(finished.counts.submitted, 0);
        // Released, it is reset on the way.
        let mut robot = VirtualRobot::new(RobotSettings { readings, ..armed() });
        robot.panel().press_p_stop2();
        TextDevice::advance(&mut robot, Instant::from_millis(5));
        robot.panel().release_p_stop2();
        let finished = run_on(MemoryConnection::new(robot), "Delay(0.1)", Setup::default());
        assert_eq!(finished.outcome, COMPLETED, "{readings:?}");
    }
}

#[test]
fn what_somebody_else_left_in_the_queue_is_never_executed() {
    for cuts_while_moving in [false, true] {
        let mut cell = MemoryConnection::new(VirtualRobot::new(armed()));
        cell.connect().unwrap();
        for line in ["ActivateRobot", "Home", "SetJointVel(10)", "MoveJoints(80,0,0,0,0,0)"] {
            cell.send(line).unwrap();
        }
        if !cuts_while_moving {
            cell.send("PauseMotion").unwrap();
        }
        cell.pass(Duration::from_millis(600));
        cell.cut();
        cell.pass(Duration::from_millis(600));
        let finished = run_on(cell, "Delay(0.5)", Setup::default());
        assert_eq!(finished.outcome, COMPLETED);
        assert!(finished.robot().target_joints()[0] < 20.0, "the old move did not go on");
    }
}

#[test]
fn a_queue_that_somebody_clears_ends_the_run() {
    let accident = at_joint(5.0, |robot| robot.clear_motion().unwrap(), |_| {});
    let finished = run_with(LONG_MOVE, Setup { accident, ..Setup::default() });
    assert_eq!(finished.outcome.end, End::HeldBack(WaitReason::Cleared));
    assert_eq!(finished.outcome.step, Some(1));
    assert_eq!(finished.counts.aborted, 2);
}

#[test]
fn motion_that_somebody_pauses_and_resumes_goes_on() {
    let accident = at_joint(
        5.0,
        |robot| robot.pause_motion().unwrap(),
        |robot| robot.resume_motion().unwrap(),
    );
    let finished = run_with(LONG_MOVE, Setup { accident, ..Setup::default() });
    assert_eq!(finished.outcome, COMPLETED);
}

#[test]
fn a_reboot_of_the_program_is_waited_for_and_any_other_is_a_lost_connection() {
    let text = "SetJointLimitsCfg(0)\nRebootRobot()\nActivateRobot()\nHome()\nMoveJoints(4, 0, 0, 0, 0, 0)";
    let readings = fieldarm::sim::meca500::readings::PowerAfterReboot::On;
    let readings = Readings { power_after_reboot: readings, ..Readings::default() };
    let robot = RobotSettings { readings, ..armed() };
    let finished = run_with(text, Setup { robot, ..Setup::default() });
    assert_eq!(finished.outcome, COMPLETED);
    assert!(finished.watch.actions.contains(&Action::Reboot));
    let accident = at_joint(5.0, |robot| robot.panel().switch_off(), |_| {});
    let finished = run_with(LONG_MOVE, Setup { accident, ..Setup::default() });
    assert_eq!(finished.outcome.end, End::ConnectionLost);
    let accident = at_joint(5.0, |robot| robot.panel().break_drives(), |_| {});
    let finished = run_with(LONG_MOVE, Setup { accident, ..Setup::default() });
    assert_eq!(finished.outcome.end, End::RobotError(Code::DRIVE_COMMUNICATION));
}

#[test]
fn a_blocked_joint_is_an_error_of_the_robot() {
    let accident = at_joint(5.0, |robot| robot.panel().block_joint(1, true), |_| {});
    let finished = run_with(LONG_MOVE, Setup { accident, ..Setup::default() });
    assert!(matches!(finished.outcome.end, End::RobotError(_)), "{:?}", finished.outcome);
    assert_eq!(finished.outcome.step, Some(1));
    let mut robot = VirtualRobot::new(armed());
    robot.panel().block_joint(1, true);
    let finished = run_on(MemoryConnection::new(robot), "Delay(1)", Setup::default());
    assert_eq!(finished.outcome.end, End::RobotError(Code::HOMING_FAILED));
    assert_eq!(finished.counts.submitted, 0);
}

#[test]
fn an_error_that_was_there_before_is_reset_by_the_program() {
    let others = Readings::variations().map(|v| (v.switch, v.value, v.readings));
    for (switch, value, readings) in
        [("default", "", Readings::default())].into_iter().chain(others)
    {
        let mut cell =
            MemoryConnection::new(VirtualRobot::new(RobotSettings { readings, ..armed() }));
        cell.connect().unwrap();
        for line in ["ActivateRobot", "Home"] {
            cell.send(line).unwrap();
            cell.pass(Duration::from_millis(300));
        }
        for line in ["ResumeMotion", "MovePose(5000,0,0,0,0,0)"] {
            cell.send(line).unwrap();
            cell.pass(Duration::from_millis(100));
        }
        cell.cut();
        let finished = run_on(cell, "ResetError()\nMoveJoints(9, 0, 0, 0, 0, 0)", Setup::default());
        assert_eq!(finished.outcome, COMPLETED, "{switch} {value}");
        assert!(
            finished.recording.samples().len() > 5,
            "positions were asked for again: {switch} {value}"
        );
    }
}

#[test]
fn messages_that_nobody_expects_do_no_harm() {
    // What a robot of another firmware may say, at a moment when something is waited for.
    let odd = [
        "[9999][news]",
        "[2097][4294967295]",
        "[3030][7999]",
        "[3040][x]",
        "[2007][1,1]",
        "[3070][]",
    ];
    let program = Program::parse("Delay(0.2)", Revision::R3).unwrap();
    struct Chatter {
        link: Accidents,
        odd: Vec<Message<'static>>,
    }
    impl TextLink for Chatter {
        type Error = String;

        fn now(&self) -> Instant {
            self.link.now()
        }
        fn send(&mut self, command: &str) -> Result<bool, String> {
            self.link.send(command)
        }
        fn receive(
            &mut self,
            until: Instant,
            take: &mut dyn FnMut(Instant, Heard<'_>),
        ) -> Result<(), String> {
            for message in &self.odd {
                take(self.link.now(), Heard::Control(*message));
            }
            self.link.receive(until, take)
        }
        fn reconnect(&mut self) -> bool {
            false
        }
    }
    let mut cell = MemoryConnection::new(VirtualRobot::new(armed()));
    cell.connect().unwrap();
    let link = Accidents {
        cell,
        accident: Box::new(|_| {}),
        cut_after: None,
        mute_after: None,
        heard: 0,
        said: Vec::new(),
    };
    let odd = odd.iter().map(|line| Message::parse(line).unwrap()).collect();
    let mut link = Chatter { link, odd };
    let mut runner = TextRunner::new(&program, TextSettings::default());
    let mut watch = Watch::default();
    let outcome = drive_text(&mut link, &mut runner, &mut Recording::new(), &mut watch);
    assert_eq!(outcome, COMPLETED);
}
