//! A run takes no memory once it is under way: what it needs was taken before the first cycle.
#![cfg(feature = "std")]

use fieldarm::cycle::{CyclicLink, InputQuality};
use fieldarm::engine::meca500::{ByteOrderSetting, Config, Engine, Event};
use fieldarm::run::drive::{Observer, Progress, drive};
use fieldarm::run::outcome::End;
use fieldarm::run::pace::SimulatedTime;
use fieldarm::run::periodic::Periodic;
use fieldarm::run::program::Program;
use fieldarm::run::recording::Recording;
use fieldarm::run::runner::Runner;
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::command::MotionCommandId;
use fieldarm::wire::meca500::image::{
    INPUT_LEN, InputImage, MotionStatusFlags, OutputImage, RobotStatusFlags,
};
use fieldarm::wire::meca500::revision::Revision;
use fieldarm::wire::order::{Big, ByteOrder};

/// A robot that is always ready, acknowledges each command, and is done with it at once.
struct Acknowledging {
    inputs: [u8; INPUT_LEN],
    cycles: u32,
}

impl CyclicLink for Acknowledging {
    type Error = core::convert::Infallible;

    fn exchange(
        &mut self,
        _now: Instant,
        outputs: &[u8],
        inputs: &mut [u8],
    ) -> Result<InputQuality, Self::Error> {
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
        inputs.copy_from_slice(&self.inputs);
        Ok(InputQuality::Fresh)
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

/// Drives a program of so many commands to its end: memory taken meanwhile, and cycles.
fn driven(commands: usize, observer: &mut Attentive) -> (u64, u64) {
    let text = "Delay(1)\n".repeat(commands);
    let program = Program::parse(&text, Revision::R3).expect("a good program");
    let mut engine = Engine::<64>::new(Config {
        byte_order: ByteOrderSetting::Fixed(ByteOrder::BIG),
        ..Config::default()
    });
    let link = Acknowledging { inputs: [0; INPUT_LEN], cycles: 0 };
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

#[test]
fn memory_that_is_taken_is_counted() {
    let mut observer = Attentive { wasteful_every: Some(100), ..Attentive::default() };
    let (taken, cycles) = driven(500, &mut observer);
    assert_eq!(taken, cycles / 100);
}
