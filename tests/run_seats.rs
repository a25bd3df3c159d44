//! Several robots in one run, on one segment: each seat ends by itself.
#![cfg(feature = "cli")]

use fieldarm::cycle::{CyclicSegment, InputQuality};
use fieldarm::engine::meca500::{CheckpointPolicy, Config, Engine, Event};
use fieldarm::link::direct::DirectSegment;
use fieldarm::run::drive::{Observer, Progress, drive_all};
use fieldarm::run::outcome::{End, Outcome, Stop};
use fieldarm::run::pace::SimulatedTime;
use fieldarm::run::periodic::Periodic;
use fieldarm::run::program::Program;
use fieldarm::run::recording::Recording;
use fieldarm::run::runner::Runner;
use fieldarm::run::seat::Seat;
use fieldarm::sim::meca500::{RobotSettings, VirtualRobot};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::image::{OUTPUT_LEN, SafetySignals};
use fieldarm::wire::meca500::revision::Revision;
use fieldarm::wire::order::ByteOrder;

const PERIOD: Duration = Duration::from_millis(1);
/// No run here lasts longer, in cycles.
const LONGEST: u64 = 60_000;

/// Robots in memory, on whose segment accidents happen.
struct Cell {
    segment: DirectSegment<VirtualRobot>,
    cycles: u64,
    /// Outputs of the coming exchange.
    outputs: Vec<[u8; OUTPUT_LEN]>,
    /// Last exchange in which a robot got anything but zeros.
    last_unsafe: Vec<u64>,
    /// From this exchange on all of them fail.
    fails_from: Option<u64>,
    /// From this exchange on nothing comes from robot 0.
    robot_lost_from: Option<u64>,
    /// In this exchange somebody presses the emergency stop beside robot 1.
    e_stop_at: Option<u64>,
}

#[derive(Debug, thiserror::Error)]
#[error("the plug was pulled")]
struct Unplugged;

impl CyclicSegment for Cell {
    type Error = Unplugged;

    fn robot_count(&self) -> usize {
        self.segment.robot_count()
    }

    fn write_outputs(&mut self, robot: usize, outputs: &[u8]) {
        self.outputs[robot].copy_from_slice(outputs);
        self.segment.write_outputs(robot, outputs);
    }

    fn exchange(&mut self, now: Instant) -> Result<(), Unplugged> {
        self.cycles += 1;
        assert!(self.cycles < LONGEST, "the run does not end");
        if self.fails_from.is_some_and(|from| self.cycles >= from) {
            return Err(Unplugged);
        }
        if self.e_stop_at == Some(self.cycles)
            && let Some(robot) = self.segment.device_mut(1)
        {
            robot.panel().press_e_stop();
        }
        for (outputs, last_unsafe) in self.outputs.iter().zip(&mut self.last_unsafe) {
            if *outputs != [0; OUTPUT_LEN] {
                *last_unsafe = self.cycles;
            }
        }
        let Ok(()) = self.segment.exchange(now);
        Ok(())
    }

    fn read_inputs(&self, robot: usize, inputs: &mut [u8]) -> InputQuality {
        if robot == 0 && self.robot_lost_from.is_some_and(|from| self.cycles >= from) {
            return InputQuality::Lost;
        }
        self.segment.read_inputs(robot, inputs)
    }
}

/// Interrupts in its cycle number so and so.
#[derive(Default)]
struct Watch {
    interrupt_at: Option<u64>,
    cycles: u64,
}

impl Observer for Watch {
    fn is_interrupted(&mut self) -> bool {
        self.cycles += 1;
        self.interrupt_at.is_some_and(|at| self.cycles >= at)
    }

    fn event(&mut self, _event: &Event, _step: Option<usize>) {}

    fn wants_progress(&mut self, _cycles: u64) -> bool {
        false
    }

    fn progress(&mut self, _progress: &Progress) {}
}

#[derive(Default)]
struct Setup {
    /// Robots on the segment; as many as programs where it is not said.
    robots: Option<usize>,
    /// What the robots speak, in turn.
    byte_orders: Vec<ByteOrder>,
    interrupt_at: Option<u64>,
    fails_from: Option<u64>,
    robot_lost_from: Option<u64>,
    e_stop_at: Option<u64>,
}

struct Finished {
    outcomes: Vec<Outcome>,
    /// Cycles in which each seat was driven.
    driven: Vec<u64>,
    byte_orders: Vec<Option<ByteOrder>>,
    samples: Vec<usize>,
    lost: Vec<u64>,
    /// Turns of the loop, the release at its end not counted.
    turns: u64,
    exchanges: u64,
    /// Last exchange in which each robot got anything but zeros.
    last_unsafe: Vec<u64>,
    last_outputs: Vec<[u8; OUTPUT_LEN]>,
}

impl Finished {
    fn ends(&self) -> Vec<End> {
        self.outcomes.iter().map(|outcome| outcome.end).collect()
    }
}

fn run(texts: &[&str], setup: Setup) -> Finished {
    let programs: Vec<Program> = texts
        .iter()
        .map(|text| Program::parse(text, Revision::R3).expect("a good program"))
        .collect();
    let config = || Config { checkpoints: CheckpointPolicy::EachCommand, ..Config::default() };
    let mut engines: Vec<Engine<64>> = texts.iter().map(|_| Engine::new(config())).collect();
    let mut runners: Vec<Runner<'_>> = programs.iter().map(Runner::new).collect();
    let mut recordings: Vec<Recording> = texts.iter().map(|_| Recording::new()).collect();
    let watch = |_| Watch { interrupt_at: setup.interrupt_at, cycles: 0 };
    let mut watches: Vec<Watch> = texts.iter().map(watch).collect();
    let count = setup.robots.unwrap_or(texts.len());
    let robot = |number: usize| {
        let order = setup.byte_orders.get(number).copied();
        let byte_order = order.unwrap_or(ByteOrder::BIG);
        // Homed before, so that a run is short.
        VirtualRobot::new(RobotSettings { byte_order, homed: true, ..RobotSettings::default() })
    };
    let cell = Cell {
        segment: DirectSegment::new((0..count).map(robot)),
        cycles: 0,
        outputs: vec![[0; OUTPUT_LEN]; count],
        last_unsafe: vec![0; count],
        fails_from: setup.fails_from,
        robot_lost_from: setup.robot_lost_from,
        e_stop_at: setup.e_stop_at,
    };
    let mut periodic = Periodic::over_segment::<Engine<64>>(cell, SimulatedTime, PERIOD);
    let mut seats: Vec<_> = engines
        .iter_mut()
        .zip(&mut runners)
        .zip(recordings.iter_mut().zip(&mut watches))
        .map(|((engine, runner), (recording, watch))| Seat::new(engine, runner, recording, watch))
        .collect();
    drive_all(&mut periodic, &mut seats).expect("the images have their lengths");
    assert!(seats.iter().all(|seat| seat.outcome().is_some()), "all have ended");
    let outcomes = seats.into_iter().map(Seat::into_outcome).collect();
    let turns = periodic.statistics().cycles;
    let lost = periodic.ports().iter().map(|port| port.statistics().lost).collect();
    let cell = periodic.segment();
    Finished {
        outcomes,
        driven: watches.iter().map(|watch| watch.cycles).collect(),
        byte_orders: engines.iter().map(Engine::byte_order).collect(),
        samples: recordings.iter().map(|recording| recording.samples().len()).collect(),
        lost,
        turns,
        exchanges: cell.cycles,
        last_unsafe: cell.last_unsafe.clone(),
        last_outputs: cell.outputs.clone(),
    }
}

/// Programs that are done after about so many seconds.
const SECONDS: [&str; 4] = ["Delay(1)", "Delay(0.2)", "Delay(2)", "MoveJoints(5, 0, 0, 0, 0, 0)"];
/// Cycles with outputs of zero at the end of a run.
const RELEASE_CYCLES: u64 = 10;

#[test]
fn each_robot_gets_zeros_from_its_own_end_on() {
    let finished = run(&SECONDS, Setup::default());
    assert_eq!(finished.ends(), [End::Completed; 4]);
    let longest = finished.driven.iter().max().copied();
    assert_eq!(longest, Some(finished.turns), "the run ends with its last robot");
    assert_eq!(finished.exchanges, finished.turns + RELEASE_CYCLES, "one exchange for all");
    for (robot, (driven, last)) in finished.driven.iter().zip(&finished.last_unsafe).enumerate() {
        assert!(last <= driven && last + 20 > *driven, "robot {robot}: {last} of {driven}");
        let samples = usize::try_from(*driven).expect("a few thousand");
        assert!(finished.samples[robot] <= samples, "robot {robot}");
    }
    assert!(finished.driven[1] + 500 < finished.driven[0], "{:?}", finished.driven);
    assert!(finished.driven[0] + 500 < finished.driven[2], "{:?}", finished.driven);
}

#[test]
fn a_robot_that_fails_does_not_disturb_the_others() {
    let texts = ["Delay(1)", "MoveLin(480, 0, 180, 180, 0, 180)", "Delay(2)", "Delay(0.1)"];
    let finished = run(&texts, Setup::default());
    let failed = End::RobotError(Code::OUT_OF_REACH);
    assert_eq!(finished.ends(), [End::Completed, failed, End::Completed, End::Completed]);
    assert_eq!(finished.outcomes[1].step, Some(0));
    assert!(finished.last_unsafe[1] + 500 < finished.last_unsafe[0]);
}

#[test]
fn a_safety_stop_at_one_robot_ends_only_its_program() {
    let texts = ["Delay(2)"; 3];
    let finished = run(&texts, Setup { e_stop_at: Some(1_000), ..Setup::default() });
    let stopped = End::SafetyStop(SafetySignals::E_STOP);
    assert_eq!(finished.ends(), [End::Completed, stopped, End::Completed]);
    assert!(finished.driven[1] < 1_100 && finished.driven[0] > 2_000, "{:?}", finished.driven);
}

#[test]
fn a_robot_that_is_lost_ends_only_its_program() {
    let texts = ["Delay(2)"; 3];
    let finished = run(&texts, Setup { robot_lost_from: Some(1_000), ..Setup::default() });
    assert_eq!(finished.ends(), [End::ConnectionLost, End::Completed, End::Completed]);
    assert!(finished.lost[0] > 0, "{:?}", finished.lost);
    assert_eq!(finished.lost[1..], [0, 0]);
}

#[test]
fn an_interrupt_stops_all_robots_that_still_run() {
    let texts = ["Delay(3600)", "Delay(0.1)", "MoveJoints(90, 0, 0, 0, 0, 0)\nDelay(3600)"];
    let finished = run(&texts, Setup { interrupt_at: Some(1_500), ..Setup::default() });
    assert_eq!(finished.ends(), [End::Interrupted, End::Completed, End::Interrupted]);
    let stops: Vec<Stop> = finished.outcomes.iter().map(|outcome| outcome.stop).collect();
    assert_eq!(stops, [Stop::Confirmed, Stop::NotNeeded, Stop::Confirmed]);
    assert!(finished.turns < 1_700, "{}", finished.turns);
    assert!(finished.last_outputs.iter().all(|outputs| *outputs == [0; OUTPUT_LEN]));
}

#[test]
fn a_segment_that_fails_ends_all_that_still_run() {
    let setup = Setup { fails_from: Some(1_500), ..Setup::default() };
    let finished = run(&["Delay(2)", "Delay(0.1)", "Delay(3)"], setup);
    let [End::LinkFailed(first), End::Completed, End::LinkFailed(_)] = finished.ends()[..] else {
        panic!("{:?}", finished.outcomes)
    };
    assert_eq!(first.as_str(), "the plug was pulled");
}

#[test]
fn an_end_without_safe_outputs_behind_it_is_no_good_end() {
    let good = run(&["Delay(0.1)", "Delay(2)"], Setup::default());
    let end_of_first = good.driven[0];
    // The segment fails when so many safe images have left behind the end of the first program.
    for (safe_images, is_good) in [(0, false), (9, false), (10, true), (11, true)] {
        let fails_from = Some(end_of_first + 1 + safe_images);
        let setup = Setup { fails_from, ..Setup::default() };
        let finished = run(&["Delay(0.1)", "Delay(2)"], setup);
        assert_eq!(finished.driven[0], end_of_first, "the same run up to there");
        assert_eq!(finished.ends()[0] == End::Completed, is_good, "{safe_images} safe images");
        assert!(matches!(finished.ends()[1], End::LinkFailed(_)), "{:?}", finished.ends());
    }
}

#[test]
fn each_robot_is_understood_in_its_own_byte_order() {
    let setup = Setup { byte_orders: ByteOrder::ALL.to_vec(), ..Setup::default() };
    let finished = run(&SECONDS, setup);
    assert_eq!(finished.ends(), [End::Completed; 4]);
    assert_eq!(finished.byte_orders, ByteOrder::ALL.map(Some));
}

#[test]
fn a_seat_without_a_robot_is_not_connected() {
    let finished =
        run(&["Delay(0.1)", "Delay(0.1)"], Setup { robots: Some(1), ..Setup::default() });
    assert_eq!(finished.ends(), [End::Completed, End::NotConnected]);
}

#[test]
fn a_robot_without_a_seat_gets_zeros() {
    let finished = run(&["Delay(0.1)"], Setup { robots: Some(3), ..Setup::default() });
    assert_eq!(finished.ends(), [End::Completed]);
    assert!(finished.last_unsafe[0] > 0);
    assert_eq!(finished.last_unsafe[1..], [0, 0]);
}
