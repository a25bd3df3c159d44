//! The cycle of a run takes no memory: what it needs was taken before the first one.
#![cfg(feature = "std")]

use fieldarm::cycle::{CyclicLink, InputQuality};
use fieldarm::engine::meca500::{ByteOrderSetting, Config, Engine};
use fieldarm::run::observation::Observation;
use fieldarm::run::pace::SimulatedTime;
use fieldarm::run::periodic::Periodic;
use fieldarm::run::program::Program;
use fieldarm::run::recording::{Recording, Sample};
use fieldarm::run::runner::Runner;
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::command::MotionCommandId;
use fieldarm::wire::meca500::image::{INPUT_LEN, InputImage, OutputImage, RobotStatusFlags};
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

#[test]
fn cycles_take_no_memory() {
    let counted = allocation_counter::measure(|| drop(std::hint::black_box(vec![0_u8; 16])));
    assert!(counted.count_total > 0, "the counter counts");

    let text = "Delay(1)\n".repeat(30_000);
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
    let counted = allocation_counter::measure(|| {
        for _ in 0..20_000 {
            let turn = periodic.turn(&mut engine).expect("the link does not fail");
            let outcome = runner.after_turn(&mut engine, turn.now, false, |_| {});
            assert_eq!(outcome, None);
            let since_begin = recording.cycle(turn.now);
            let order = engine.byte_order();
            let seen = order
                .and_then(|order| Observation::read(periodic.inputs(), periodic.outputs(), order));
            if let Some(seen) = seen {
                let counts = runner.counts();
                recording.record(Sample {
                    at: since_begin,
                    seen,
                    submitted: counts.submitted,
                    accepted: counts.accepted,
                    done: counts.done,
                });
            }
        }
    });
    assert!(runner.counts().done > 2_000, "{:?}", runner.counts());
    assert!(!recording.samples().is_empty());
    assert_eq!(counted.count_total, 0, "{counted:?}");
}
