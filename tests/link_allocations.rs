//! Exchanges of an EtherCAT segment take no memory once all robots are in OP, and neither does the
//! emulated wire, with engines cycling and commands streaming.
#![cfg(all(feature = "ethercat", feature = "sim"))]

#[path = "support/ethercat_line.rs"]
mod ethercat_line;

use ethercat_line::{Line, line};
use fieldarm::cycle::{CyclicSegment, InputQuality};
use fieldarm::engine::meca500::{Config, Engine, Event};
use fieldarm::link::ethercat::{Clocks, EthercatSegment, SegmentSettings};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::command::MotionCommand;
use fieldarm::wire::meca500::image::{INPUT_LEN, OUTPUT_LEN};

/// Exchanges that are counted.
const EXCHANGES: u32 = 10_000;
/// Exchanges before: the robots are brought up in them.
const WARM_UP: u32 = 6_000;

/// A robot's place in a cell: its engine and images.
struct Seat {
    engine: Engine<64>,
    outputs: [u8; OUTPUT_LEN],
    inputs: [u8; INPUT_LEN],
    quality: InputQuality,
    accepted: u32,
    bad: u32,
}

/// A segment and the engines of its robots.
struct Cell {
    segment: EthercatSegment<Line>,
    seats: Vec<Seat>,
    now: Instant,
    number: u32,
    /// Takes memory in every so many cycles, to show that it would be counted.
    wasteful_every: Option<u32>,
}

impl Cell {
    fn start(robots: u16, clocks: Clocks) -> Self {
        let settings = SegmentSettings { clocks, ..SegmentSettings::default() };
        let segment = match EthercatSegment::start(line(robots), settings) {
            Ok(segment) => segment,
            Err(failure) => panic!("{}", failure.error),
        };
        let seat = |_| Seat {
            engine: Engine::new(Config::default()),
            outputs: [0; OUTPUT_LEN],
            inputs: [0; INPUT_LEN],
            quality: InputQuality::Lost,
            accepted: 0,
            bad: 0,
        };
        let seats = (0..robots).map(seat).collect();
        Self { segment, seats, now: Instant::ZERO, number: 0, wasteful_every: None }
    }

    /// So many cycles, in which every engine that is up streams commands.
    fn cycles(&mut self, cycles: u32) {
        for cycle in 0..cycles {
            let nudge = self.segment.nudge_ns();
            self.now += Duration::from_nanos(1_000_000_u64.saturating_add_signed(nudge));
            if self.wasteful_every.is_some_and(|every| cycle.is_multiple_of(every)) {
                drop(std::hint::black_box(vec![0_u8; 16]));
            }
            for (robot, seat) in self.seats.iter_mut().enumerate() {
                let status = seat.engine.status();
                if status.ready && status.waiting == 0 {
                    self.number += 1;
                    let speed = 100.0 + (self.number % 4_000) as f32;
                    seat.engine.submit(MotionCommand::SetCartLinVel(speed)).expect("there is room");
                } else if !status.ready && !status.acting {
                    // Refused until it is connected.
                    let _ = seat.engine.bring_up();
                }
                seat.engine
                    .cycle_bytes(self.now, seat.quality, &seat.inputs, &mut seat.outputs)
                    .expect("the images have their lengths");
                while let Some(event) = seat.engine.poll_event() {
                    seat.accepted += u32::from(matches!(event, Event::Accepted { .. }));
                }
                self.segment.write_outputs(robot, &seat.outputs);
            }
            self.segment.exchange(self.now).expect("it never fails");
            // A robot keeps what it would say on its text ports, and takes memory for it.
            for device in self.segment.wire_mut().line_mut() {
                device.application_mut().device_mut().panel().drain_events().for_each(drop);
            }
            for (robot, seat) in self.seats.iter_mut().enumerate() {
                seat.quality = self.segment.read_inputs(robot, &mut seat.inputs);
                seat.bad += u32::from(!seat.quality.is_fresh());
            }
        }
    }

    /// Memory taken in [`EXCHANGES`] exchanges of robots that are up and work.
    fn measured(&mut self) -> u64 {
        self.cycles(WARM_UP);
        let before: Vec<u32> = self.seats.iter().map(|seat| seat.accepted).collect();
        self.seats.iter_mut().for_each(|seat| seat.bad = 0);
        let counted = allocation_counter::measure(|| self.cycles(EXCHANGES));
        for (seat, before) in self.seats.iter().zip(before) {
            assert!(seat.accepted - before > EXCHANGES / 4, "{:?}", seat.engine.status());
            assert_eq!(seat.bad, 0, "cycles without fresh inputs");
        }
        counted.count_total
    }
}

const SYNC0: Clocks = Clocks::Sync0 { shift: Duration::from_micros(300) };

#[test]
fn ten_thousand_exchanges_take_no_memory() {
    for robots in [1, 4] {
        for clocks in [Clocks::Off, SYNC0] {
            let taken = Cell::start(robots, clocks).measured();
            assert_eq!(taken, 0, "{robots} robots, {clocks:?}");
        }
    }
}

#[test]
fn memory_that_is_taken_is_counted() {
    let mut cell = Cell::start(1, Clocks::Off);
    cell.wasteful_every = Some(100);
    assert_eq!(cell.measured(), u64::from(EXCHANGES / 100));
}
