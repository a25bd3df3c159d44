//! The engine's cycle: idle, streaming, velocity, beside what it cannot do without, in one run.
//!
//! `cargo bench --bench cycle`, with `-- --quick` for a first look. The robot of these figures is
//! three stores in the input image (the echo, the clock, the queue space); its cost is included.

mod support;

use std::hint::black_box;

use fieldarm::cycle::InputQuality;
use fieldarm::engine::meca500::{ByteOrderSetting, Config, Engine, Event};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::command::{MotionCommand, MotionCommandId, VelocityCommand};
use fieldarm::wire::meca500::image::{
    INPUT_LEN, InputImage, MotionControlFlags, MotionStatusFlags, OUTPUT_LEN, OutputImage,
    RobotStatusFlags,
};
use fieldarm::wire::order::{Big, ImageOrder, Little};
use support::timing::Effort;
use support::{Group, Subject};

#[global_allocator]
static ALLOCATOR: support::alloc::CountingAllocator = support::alloc::CountingAllocator;

const PERIOD: Duration = Duration::from_millis(1);

/// An engine and the least that answers it like a robot.
struct Station<O: ImageOrder> {
    engine: Engine<64>,
    inputs: InputImage<O>,
    outputs: OutputImage<O>,
    now: Instant,
    number: u32,
}

impl<O: ImageOrder> Station<O> {
    /// Connected to a robot that is ready for motion.
    fn new() -> Self {
        let config = Config {
            byte_order: ByteOrderSetting::Fixed(O::VALUE),
            // However many cycles a bench makes of its simulated time, nothing is ever late.
            ack_timeout: Duration::MAX,
            velocity_dead_man: Duration::MAX,
            velocity_dead_man_cycles: u16::MAX,
            ..Config::default()
        };
        let mut inputs = InputImage::zeroed();
        inputs.robot_status.flags.set(RobotStatusFlags::ACTIVATED | RobotStatusFlags::HOMED);
        inputs.motion_status.fifo_space.set(13_000);
        inputs.motion_status.flags.set(MotionStatusFlags::EOB | MotionStatusFlags::EOM);
        let mut station = Self {
            engine: Engine::new(config),
            inputs,
            outputs: OutputImage::zeroed(),
            now: Instant::from_millis(1),
            number: 0,
        };
        let connected = (0..1000).any(|_| {
            station.cycle();
            station.poll() & 1 == 1
        });
        assert!(connected, "the engine does not connect");
        station
    }

    /// What a robot does to the inputs, and the engine's cycle.
    #[inline(always)]
    fn cycle(&mut self) {
        self.now += PERIOD;
        let micros = self.now.as_nanos() / 1000;
        self.inputs.robot_timestamp.seconds.set((micros / 1_000_000) as u32);
        self.inputs.robot_timestamp.microseconds.set((micros % 1_000_000) as u32);
        if self.outputs.motion_control.flags.contains(MotionControlFlags::SET_POINT) {
            self.inputs.motion_status.move_id.set(self.outputs.motion_control.move_id.get());
        }
        if self.outputs.motion_command.motion_command_id.get() == MotionCommandId::SET_CHECKPOINT.0
        {
            let [number, ..] = self.outputs.motion_command_args.argument;
            self.inputs.motion_status.checkpoint_reached.set(number.get() as u16);
        }
        self.engine.cycle(self.now, InputQuality::Fresh, &self.inputs, &mut self.outputs);
    }

    /// Reads all events: bit 0 of the result for a connection, the rest counts accepted commands.
    #[inline(always)]
    fn poll(&mut self) -> u32 {
        let mut seen = 0;
        while let Some(event) = self.engine.poll_event() {
            match event {
                Event::Connected { .. } => seen |= 1,
                Event::Accepted { .. } => seen += 2,
                _ => {}
            }
        }
        seen
    }

    /// Keeps commands waiting, so that one goes out each cycle.
    #[inline(always)]
    fn feed(&mut self) {
        while self.engine.queue_space() > 32 {
            self.number = (self.number + 1) % 1000;
            let velocity = 100.0 + self.number as f32;
            if self.engine.submit(MotionCommand::SetCartLinVel(velocity)).is_err() {
                break;
            }
        }
    }

    fn drive(&mut self) {
        self.engine
            .set_velocity(VelocityCommand::MoveJointsVel([1.0; 6]))
            .expect("a velocity within its range");
    }
}

/// Defines the counted operations for one byte order.
macro_rules! operations {
    ($($name:ident($station:ident: $order:ty) $body:block)*) => {$(
        #[inline(never)]
        fn $name($station: &mut Station<$order>) $body
    )*};
}

operations! {
    measured_idle_big(station: Big) { station.cycle(); }
    measured_idle_little(station: Little) { station.cycle(); }
    measured_velocity_big(station: Big) { station.cycle(); }
    measured_velocity_little(station: Little) { station.cycle(); }
    measured_streaming_big(station: Big) { station.cycle(); black_box(station.poll()); }
    measured_streaming_little(station: Little) { station.cycle(); black_box(station.poll()); }
}

/// Both images as bytes. Aligned, because a copy across cache lines takes up to four times as long.
#[repr(align(64))]
struct Images([u8; INPUT_LEN], [u8; OUTPUT_LEN]);

#[inline(never)]
fn measured_copy(from: &Images, to: &mut Images) {
    to.0 = from.0;
    to.1 = from.1;
}

fn copy() -> Subject {
    let from = Images([1; INPUT_LEN], [2; OUTPUT_LEN]);
    let mut to = Images([0; INPUT_LEN], [0; OUTPUT_LEN]);
    Subject::new("memcpy 252 + 60", move || {
        measured_copy(black_box(&from), black_box(&mut to));
    })
}

macro_rules! subject {
    ($name:literal, $order:ty, $operation:path, $before:expr, $each:expr) => {{
        let mut station = Station::<$order>::new();
        let before: fn(&mut Station<$order>) = $before;
        let each: fn(&mut Station<$order>) = $each;
        before(&mut station);
        Subject::new($name, move || {
            each(&mut station);
            $operation(black_box(&mut station));
        })
    }};
}

fn groups() -> Vec<Group> {
    let references: &[&str] = &["memcpy 252 + 60"];
    vec![
        Group {
            title: "engine cycle, idle",
            subjects: vec![
                copy(),
                subject!("big", Big, measured_idle_big, |_| {}, |_| {}),
                subject!("little", Little, measured_idle_little, |_| {}, |_| {}),
            ],
            references,
        },
        Group {
            title: "engine cycle, streaming",
            subjects: vec![
                copy(),
                subject!("big", Big, measured_streaming_big, |_| {}, Station::feed),
                subject!("little", Little, measured_streaming_little, |_| {}, Station::feed),
            ],
            references,
        },
        Group {
            title: "engine cycle, velocity mode",
            subjects: vec![
                copy(),
                subject!("big", Big, measured_velocity_big, Station::drive, |_| {}),
                subject!("little", Little, measured_velocity_little, Station::drive, |_| {}),
            ],
            references,
        },
    ]
}

fn main() {
    let mut groups = groups();
    let figures = support::measure(&mut groups, Effort::from_args());
    println!(
        "One cycle of one engine, with a robot of a few stores around it. Streaming: one command is accepted,"
    );
    println!(
        "its events are read, the next one goes out; the time includes submitting it, the instructions do not."
    );
    support::table::print(&groups, &figures);
    print_pace();
    print_allocations();
    print_many(Effort::from_args());
}

/// A stream is accepted at one command per cycle, but for the engine's own checkpoints.
fn print_pace() {
    const CYCLES: u32 = 10_000;
    let mut station = Station::<Big>::new();
    let mut accepted = 0;
    for _ in 0..CYCLES {
        station.feed();
        station.cycle();
        accepted += station.poll() / 2;
    }
    let own = station.engine.statistics().automatic_checkpoints;
    println!(
        "\nStream: {accepted} commands and {own} checkpoints of the engine accepted in {CYCLES} cycles."
    );
}

fn print_allocations() {
    assert!(support::alloc::counts_at_all(), "the counting allocator is not installed");
    let mut station = Station::<Big>::new();
    let streaming = support::alloc::allocations_during(|| {
        for _ in 0..10_000 {
            station.feed();
            station.cycle();
            black_box(station.poll());
        }
    });
    println!("Allocations in 10,000 streaming cycles: {streaming} (positive control passed).");
}

/// What one core needs for very many engines, one after the other.
fn print_many(effort: Effort) {
    const ENGINES: usize = 5_000;
    // Twice around the longest ring of an engine, so that all memory has been touched before.
    const WARM_UP: usize = 512;
    let mut stations: Vec<_> = (0..ENGINES).map(|_| Station::<Big>::new()).collect();
    println!(
        "\n{:<34}{:>9}{:>9}{:>16}",
        format!("{ENGINES} engines on one core"),
        "ms",
        "min ms",
        "ns an engine"
    );
    print_rounds("idle", &mut stations, WARM_UP, effort, |_| {}, work);
    print_rounds("streaming", &mut stations, WARM_UP, effort, Station::feed, work);
    let submit_too = |station: &mut Station<Big>| {
        station.feed();
        work(station);
    };
    print_rounds("streaming, submitting too", &mut stations, WARM_UP, effort, |_| {}, submit_too);
    println!(
        "Each with its images and its robot of a few stores: {} bytes, {} of them the engine.",
        size_of::<Station<Big>>(),
        size_of::<Engine<64>>()
    );
    let accepted = stations.iter().map(|station| station.engine.statistics().accepted);
    assert!(accepted.min() > Some(WARM_UP as u64), "an engine does not stream");
}

/// A cycle and the reading of its events.
fn work(station: &mut Station<Big>) {
    station.cycle();
    black_box(station.poll());
}

/// Times rounds of `work` over all stations; `before` is not timed.
fn print_rounds(
    name: &str,
    stations: &mut [Station<Big>],
    warm_up: usize,
    effort: Effort,
    before: fn(&mut Station<Big>),
    work: fn(&mut Station<Big>),
) {
    let mut rounds: Vec<_> = (0..warm_up + effort.batches)
        .map(|_| {
            stations.iter_mut().for_each(before);
            let start = std::time::Instant::now();
            black_box(&mut *stations).iter_mut().for_each(work);
            start.elapsed().as_secs_f64() * 1e3
        })
        .skip(warm_up)
        .collect();
    rounds.sort_by(f64::total_cmp);
    let (median, least) = (rounds[rounds.len() / 2], rounds[0]);
    let each = median * 1e6 / stations.len() as f64;
    println!("  {name:<32}{median:>9.3}{least:>9.3}{each:>16.1}");
}
