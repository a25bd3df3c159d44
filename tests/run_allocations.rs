//! A run takes no memory once it is under way: what it needs was taken before the first cycle.
#![cfg(feature = "std")]

use core::convert::Infallible;

use fieldarm::cycle::{CyclicLink, CyclicSegment, InputQuality};
use fieldarm::engine::meca500::{ByteOrderSetting, Config, Engine, Event};
use fieldarm::run::drive::{Observer, Progress, drive, drive_all};
use fieldarm::run::outcome::End;
use fieldarm::run::pace::SimulatedTime;
use fieldarm::run::periodic::Periodic;
use fieldarm::run::program::Program;
use fieldarm::run::recording::Recording;
use fieldarm::run::runner::Runner;
use fieldarm::run::seat::Seat;
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::command::MotionCommandId;
use fieldarm::wire::meca500::image::{
    INPUT_LEN, InputImage, MotionStatusFlags, OUTPUT_LEN, OutputImage, RobotStatusFlags,
};
use fieldarm::wire::meca500::revision::Revision;
use fieldarm::wire::order::{Big, ByteOrder};

/// A robot that is always ready, acknowledges each command, and is done with it at once.
struct Acknowledging {
    inputs: [u8; INPUT_LEN],
    cycles: u32,
}

impl Acknowledging {
    const fn new() -> Self {
        Self { inputs: [0; INPUT_LEN], cycles: 0 }
    }

    /// Takes outputs and leaves the inputs that answer them.
    fn answer(&mut self, outputs: &[u8]) {
        self.cycles += 1;
        let outputs = OutputImage::<Big>::from_bytes(outputs).expect("60 bytes");
        let image = InputImage::<Big>::from_bytes_mut(&mut self.inputs).expect("252 bytes");
        let ready = RobotStatusFlags::ACTIVATED | RobotStatusFlags::HOMED;
        image.robot_status.flags.set(ready);
        image.motion_status.fifo_space.set(13_000);
        image.motion_status.flags.set(MotionStatusFlags::EOB | MotionStatusFlags::EOM);
        image.motion_status.move_id.set(outputs.motion_control.move_id.get());
        let command = MotionCommandId(outputs.motion_command.motion_command_id.get());
        if command == MotionCommandId::SET_CHECKPOINT {
            let [number, ..] = outputs.motion_command_args.argument;
            image.motion_status.checkpoint_reached.set(number.get() as u16);
        }
        image.robot_timestamp.seconds.set(self.cycles / 1_000);
        image.robot_timestamp.microseconds.set(self.cycles % 1_000 * 1_000);
    }
}

impl CyclicLink for Acknowledging {
    type Error = Infallible;

    fn exchange(
        &mut self,
        _now: Instant,
        outputs: &[u8],
        inputs: &mut [u8],
    ) -> Result<InputQuality, Self::Error> {
        self.answer(outputs);
        inputs.copy_from_slice(&self.inputs);
        Ok(InputQuality::Fresh)
    }
}

/// Several of them on one segment.
struct Row<const ROBOTS: usize> {
    robots: [Acknowledging; ROBOTS],
    outputs: [[u8; OUTPUT_LEN]; ROBOTS],
}

impl<const ROBOTS: usize> CyclicSegment for Row<ROBOTS> {
    type Error = Infallible;

    fn robot_count(&self) -> usize {
        ROBOTS
    }

    fn write_outputs(&mut self, robot: usize, outputs: &[u8]) {
        self.outputs[robot].copy_from_slice(outputs);
    }

    fn exchange(&mut self, _now: Instant) -> Result<(), Infallible> {
        for (robot, outputs) in self.robots.iter_mut().zip(&self.outputs) {
            robot.answer(outputs);
        }
        Ok(())
    }

    fn read_inputs(&self, robot: usize, inputs: &mut [u8]) -> InputQuality {
        inputs.copy_from_slice(&self.robots[robot].inputs);
        InputQuality::Fresh
    }
}

/// An observer that looks at everything, as the one of the command does.
#[derive(Default)]
struct Attentive {
    events: u32,
    progress: Option<Progress>,
    looks: u32,
    /// Takes memory in every so many cycles, to show that it would be counted.
    wasteful_every: Option<u64>,
}

impl Observer for Attentive {
    /// A run that does not end is interrupted, so that the test fails instead of hanging.
    fn is_interrupted(&mut self) -> bool {
        self.looks > 1_000
    }

    fn event(&mut self, _event: &Event, _step: Option<usize>) {
        self.events += 1;
    }

    fn wants_progress(&mut self, cycles: u64) -> bool {
        if self.wasteful_every.is_some_and(|every| cycles.is_multiple_of(every)) {
            drop(std::hint::black_box(vec![0_u8; 16]));
        }
        cycles.is_multiple_of(256)
    }

    fn progress(&mut self, progress: &Progress) {
        self.looks += 1;
        self.progress = Some(*progress);
    }
}

fn program(commands: usize) -> Program {
    let text = "Delay(1)\n".repeat(commands);
    Program::parse(&text, Revision::R3).expect("a good program")
}

fn engine() -> Engine<64> {
    Engine::new(Config { byte_order: ByteOrderSetting::Fixed(ByteOrder::BIG), ..Config::default() })
}

/// Drives a program of so many commands to its end: memory taken meanwhile, and cycles.
fn driven(commands: usize, observer: &mut Attentive) -> (u64, u64) {
    let program = program(commands);
    let mut engine = engine();
    let link = Acknowledging::new();
    let period = Duration::from_millis(1);
    let mut periodic = Periodic::new::<Engine<64>>(link, SimulatedTime, period);
    let mut runner = Runner::new(&program);
    let mut recording = Recording::new();
    let mut outcome = None;
    let counted = allocation_counter::measure(|| {
        let ended = drive(&mut periodic, &mut engine, &mut runner, &mut recording, observer);
        outcome = Some(ended);
    });
    let outcome = outcome.expect("measured").expect("the link does not fail");
    assert_eq!(outcome.end, End::Completed);
    assert_eq!(usize::try_from(runner.counts().done), Ok(commands));
    assert!(!recording.samples().is_empty());
    (counted.count_total, periodic.statistics().cycles)
}

#[test]
fn a_driven_run_takes_no_memory() {
    let mut observer = Attentive::default();
    let (taken, cycles) = driven(5_000, &mut observer);
    assert!(cycles > 5_000, "{cycles}");
    assert!(observer.events > 5_000 && observer.looks > 10, "the observer took part");
    assert!(observer.progress.is_some_and(|progress| progress.seen.is_some()));
    assert_eq!(taken, 0, "in {cycles} cycles");
}

/// Drives programs of so many commands, one a robot, to their ends: memory taken meanwhile, and
/// cycles.
fn driven_together<const ROBOTS: usize>(
    commands: [usize; ROBOTS],
    observers: &mut [Attentive; ROBOTS],
) -> (u64, u64) {
    let programs = commands.map(program);
    let mut engines = [(); ROBOTS].map(|()| engine());
    let mut runners: Vec<Runner<'_>> = programs.iter().map(Runner::new).collect();
    let mut recordings = [(); ROBOTS].map(|()| Recording::new());
    let mut seats: Vec<_> = engines
        .iter_mut()
        .zip(&mut runners)
        .zip(recordings.iter_mut().zip(observers))
        .map(|((engine, runner), (recording, observer))| {
            Seat::new(engine, runner, recording, observer)
        })
        .collect();
    let robots = [(); ROBOTS].map(|()| Acknowledging::new());
    let row = Row { robots, outputs: [[0; OUTPUT_LEN]; ROBOTS] };
    let period = Duration::from_millis(1);
    let mut periodic = Periodic::over_segment::<Engine<64>>(row, SimulatedTime, period);
    let mut ended = None;
    let counted = allocation_counter::measure(|| {
        ended = Some(drive_all(&mut periodic, &mut seats));
    });
    assert!(matches!(ended, Some(Ok(()))), "{ended:?}");
    for seat in seats {
        assert_eq!(seat.into_outcome().end, End::Completed);
    }
    for (runner, commands) in runners.iter().zip(commands) {
        assert_eq!(usize::try_from(runner.counts().done), Ok(commands));
    }
    (counted.count_total, periodic.statistics().cycles)
}

#[test]
fn four_robots_on_one_segment_take_no_memory_either() {
    let mut observers = [(); 4].map(|()| Attentive::default());
    let (taken, cycles) = driven_together([2_000, 300, 1_000, 3_000], &mut observers);
    // Every other command is a checkpoint of the engine, and all robots share the cycles.
    assert!((3_000..2 * 3_000 + 1_000).contains(&cycles), "{cycles}");
    assert!(observers.iter().all(|observer| observer.events > 300 && observer.looks > 1));
    assert_eq!(taken, 0, "in {cycles} cycles");
}

#[test]
fn memory_that_one_of_four_takes_is_counted() {
    let mut observers = [(); 4].map(|()| Attentive::default());
    observers[3].wasteful_every = Some(100);
    let (taken, cycles) = driven_together([100, 100, 100, 500], &mut observers);
    assert_eq!(taken, cycles / 100);
}

#[test]
fn memory_that_is_taken_is_counted() {
    let mut observer = Attentive { wasteful_every: Some(100), ..Attentive::default() };
    let (taken, cycles) = driven(500, &mut observer);
    assert_eq!(taken, cycles / 100);
}
