//! Four robots on one segment: what happens to one leaves those before it alone, and everybody's
//! commands are accepted once and in order.
//!
//! A robot without power ends the line where it stands, so those behind it are gone with it.

use fieldarm::bus::ethercat::meca500::Meca500Settings;
use fieldarm::cycle::{CyclicSegment, InputQuality};
use fieldarm::engine::meca500::Event;
use fieldarm::link::ethercat::faulty_wire::{FaultPlan, FaultyWire, WireEnd, WireFault};
use fieldarm::link::ethercat::{EthercatSegment, SegmentSettings};
use fieldarm::sim::meca500::RobotSettings;
use fieldarm::time::Instant;
use fieldarm::wire::order::ByteOrder;

use crate::cell::{next_cycle, numbered};
use crate::checkers::End;
use crate::ethercat::{Line, line};
use crate::faults::patient;
use crate::plc::Plc;
use crate::quick_robot::quick_robot;
use crate::watched::WatchedRobot;

const ROBOTS: usize = 4;
/// Faults of the wire in one life.
const FAULTS: u32 = if cfg!(debug_assertions) { 20 } else { 100 };
/// Lives, each with its own seed.
const LIVES: u64 = if cfg!(debug_assertions) { 1 } else { 5 };
/// Most cycles until all four are up again: a robot may have to be started four times in a row.
const BACK_WITHIN: u64 = 20_000;
/// Commands that wait in each engine while it streams.
const WAITING: u32 = 6;

/// Four PLCs, one segment, four robots.
struct Four {
    segment: EthercatSegment<FaultyWire<Line>>,
    plcs: [Plc; ROBOTS],
    now: Instant,
    next_number: u32,
    label: String,
}

impl Four {
    fn start(seed: u64) -> Self {
        let robot = RobotSettings { byte_order: ByteOrder::LITTLE, ..quick_robot() };
        let line = line(&robot, 4, 0, Meca500Settings::default());
        let plan = FaultPlan { seed, ..FaultPlan::NONE };
        let wire = FaultyWire::new(line, WireEnd::MainDevice, plan);
        let segment = match EthercatSegment::start(wire, SegmentSettings::default()) {
            Ok(segment) => segment,
            Err(failure) => panic!("{}", failure.error),
        };
        let plcs = [(); ROBOTS].map(|()| Plc::new(ByteOrder::LITTLE, patient()));
        let label = format!("seed {seed}");
        let mut four = Self { segment, plcs, now: Instant::ZERO, next_number: 0, label };
        four.until_all_stream();
        four
    }

    fn robot(&mut self, robot: usize) -> &mut WatchedRobot {
        let line = self.segment.wire_mut().inner_mut().line_mut();
        line[robot].application_mut().device_mut()
    }

    /// One cycle in which every engine streams that can.
    fn step(&mut self) {
        self.now = next_cycle(self.now, self.segment.nudge_ns());
        for (robot, plc) in self.plcs.iter_mut().enumerate() {
            while plc.is_up() && plc.engine.status().waiting < WAITING {
                if plc.submit(numbered(self.next_number)).is_err() {
                    break;
                }
                self.next_number += 1;
            }
            if let Err(problem) = plc.think(self.now) {
                panic!("{}: robot {robot}: {problem}\n{plc:#?}", self.label);
            }
            self.segment.write_outputs(robot, &plc.outputs);
        }
        self.segment.exchange(self.now).expect("it never fails");
        for (robot, plc) in self.plcs.iter_mut().enumerate() {
            plc.quality = self.segment.read_inputs(robot, &mut plc.inputs);
        }
    }

    /// Steps until every robot is up and has a command done that was submitted since.
    fn until_all_stream(&mut self) {
        self.plcs.iter_mut().for_each(|plc| plc.events.clear());
        for _ in 0..BACK_WITHIN {
            let done = |event: &Event| matches!(event, Event::Done { .. });
            if self.plcs.iter().all(|plc| plc.is_up() && plc.quality.is_fresh() && plc.saw(done)) {
                return;
            }
            for robot in 0..ROBOTS {
                if self.plcs[robot].is_connected() && !self.plcs[robot].is_up() {
                    self.robot(robot).robot.panel().press_reset();
                    self.plcs[robot].events.clear();
                }
                self.plcs[robot].insist();
            }
            self.step();
        }
        let events: Vec<_> = core::iter::from_fn(|| self.segment.poll_event()).collect();
        panic!("{}: not all stream\n{events:#?}\n{:#?}", self.label, self.plcs);
    }

    /// Streams, and fails if a robot of `robots` has a cycle without fresh inputs.
    fn steps_without_a_stale_one(&mut self, cycles: u64, robots: &[usize]) {
        for cycle in 0..cycles {
            self.step();
            for robot in robots {
                let quality = self.plcs[*robot].quality;
                assert_eq!(
                    quality,
                    InputQuality::Fresh,
                    "{}: robot {robot} after {cycle} cycles",
                    self.label
                );
            }
        }
    }

    fn done(&self, robot: usize) -> usize {
        let plc = &self.plcs[robot];
        plc.submitted.iter().filter(|s| plc.state(s.ticket).end == Some(End::Done)).count()
    }

    fn judge(&mut self) {
        for robot in 0..ROBOTS {
            let witness = self.robot(robot).witness.clone();
            if let Err(problem) = self.plcs[robot].judge(&witness) {
                panic!("{}: robot {robot}: {problem}\n{:#?}", self.label, self.plcs[robot]);
            }
        }
    }
}

#[test]
fn the_power_of_one_costs_those_before_it_no_cycle() {
    let mut four = Four::start(0);
    for robot in (0..ROBOTS).rev() {
        for off_cycles in [1, 30, 400] {
            four.label = format!("robot {robot} off for {off_cycles}");
            let before: Vec<usize> = (0..robot).collect();
            let done_before: Vec<usize> = before.iter().map(|robot| four.done(*robot)).collect();
            four.steps_without_a_stale_one(10, &[0, 1, 2, 3]);
            four.robot(robot).robot.panel().switch_off();
            four.steps_without_a_stale_one(off_cycles, &before);
            four.robot(robot).robot.panel().switch_on();
            four.steps_without_a_stale_one(2_000, &before);
            for (robot, done) in before.iter().zip(done_before) {
                assert!(four.done(*robot) > done + 500, "{}: robot {robot} halts", four.label);
            }
            four.until_all_stream();
            four.judge();
        }
    }
}

/// Its ESC still passes frames, so that even those behind it go on.
#[test]
fn firmware_that_hangs_in_one_costs_the_others_no_cycle() {
    for robot in 0..ROBOTS {
        let mut four = Four::start(0);
        four.label = format!("robot {robot} hangs");
        let others: Vec<usize> = (0..ROBOTS).filter(|other| *other != robot).collect();
        let device = |four: &mut Four, hangs| {
            let line = four.segment.wire_mut().inner_mut().line_mut();
            line[robot].set_firmware_hangs(hangs);
        };
        device(&mut four, true);
        four.steps_without_a_stale_one(1_000, &others);
        device(&mut four, false);
        four.steps_without_a_stale_one(1_000, &others);
        four.until_all_stream();
        four.judge();
    }
}

#[test]
fn faults_of_the_wire_lose_nothing_and_double_nothing_of_any_robot() {
    for seed in 1..=LIVES {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut four = Four::start(seed);
        for number in 0..FAULTS {
            let drawn = WireFault::ALL[random.usize(0..WireFault::ALL.len())];
            four.label = format!("seed {seed}, fault {number}: {drawn}");
            for _ in 0..random.u32(1..20) {
                four.step();
            }
            match random.bool() {
                true => four.segment.wire_mut().inject_received(drawn),
                false => four.segment.wire_mut().inject(drawn),
            }
            four.step();
            if four.segment.wire_mut().take_power_cycle() {
                let robot = random.usize(0..ROBOTS);
                four.robot(robot).robot.panel().switch_off();
                (0..random.u64(0..100)).for_each(|_| four.step());
                four.robot(robot).robot.panel().switch_on();
            }
            for _ in 0..2_000 {
                if four.segment.wire().is_quiet() {
                    break;
                }
                four.step();
            }
            four.until_all_stream();
            four.judge();
        }
        println!("seed {seed}: {:?} commands done", [0, 1, 2, 3].map(|robot| four.done(robot)));
    }
}
