//! A hundred random faults in one life of the EtherCAT link, while an engine streams commands: back
//! in OP after each, no command lost or doubled, every verdict true. `FIELDARM_FAULT_SEED` replays
//! one run.

use fieldarm::bus::ethercat::meca500::Meca500Settings;
use fieldarm::engine::meca500::Config;
use fieldarm::link::ethercat::faulty_wire::{
    FaultPlan, FaultyWire, LONGEST_DELAY, WireEnd, WireFault,
};
use fieldarm::link::ethercat::{Clocks, EthercatLink, SegmentSettings};
use fieldarm::sim::meca500::RobotSettings;
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::order::ByteOrder;

use crate::cell::{CYCLE, Cell};
use crate::checkers::End;
use crate::contract::{Bus, Cable, PlcEnd};
use crate::ethercat::{Line, line};
use crate::lives::{self, stream};
use crate::plc::Plc;
use crate::quick_robot::quick_robot;
use crate::watched::WatchedRobot;

/// Faults in one life of a link.
const FAULTS: u32 = 100;
/// Lives, each with its own seed.
const LIVES: u64 = if cfg!(debug_assertions) { 3 } else { 25 };
/// Most cycles from the end of a fault to a robot that is up and streams.
const BACK_WITHIN: u64 = 4_000;
/// Longest time a cable stays out, in cycles.
const LONGEST_OUTAGE: u64 = 2_000;

/// A PLC that knows how long a frame may be under way here: not longer than [`LONGEST_DELAY`].
pub(crate) fn patient() -> Config {
    let cycles = LONGEST_DELAY.as_millis() / CYCLE.as_millis() + 1;
    Config { settle_cycles: u16::try_from(cycles).expect("a few"), ..Config::default() }
}

/// A robot behind a wire that misbehaves.
pub(crate) struct FaultyBus {
    link: EthercatLink<FaultyWire<Line>>,
}

impl FaultyBus {
    fn open(seed: u64, clocks: Clocks) -> Self {
        let robot = RobotSettings { byte_order: ByteOrder::LITTLE, ..quick_robot() };
        let line = line(&robot, 1, 0, Meca500Settings::default());
        let plan = FaultPlan { seed, ..FaultPlan::NONE };
        let wire = FaultyWire::new(line, WireEnd::MainDevice, plan);
        let settings = SegmentSettings { clocks, ..SegmentSettings::default() };
        match EthercatLink::start(wire, settings) {
            Ok(link) => Self { link },
            Err(failure) => panic!("{}", failure.error),
        }
    }

    fn wire(&mut self) -> &mut FaultyWire<Line> {
        self.link.segment_mut().wire_mut()
    }
}

impl Bus for FaultyBus {
    type Link = EthercatLink<FaultyWire<Line>>;

    fn link(&mut self) -> &mut Self::Link {
        &mut self.link
    }

    fn robot(&mut self) -> &mut WatchedRobot {
        self.wire().inner_mut().line_mut()[0].application_mut().device_mut()
    }

    fn set_cable(&mut self, cable: Cable) {
        match cable {
            Cable::Out => self.wire().inner_mut().unplug(),
            _ => self.wire().inner_mut().plug(),
        }
    }

    fn nudge_ns(&self) -> i64 {
        fieldarm::cycle::CyclicSegment::nudge_ns(self.link.segment())
    }

    fn restart_plc(self, _: PlcEnd, _: Instant, _: Duration) -> Result<Self, String> {
        Err("one life is all there is here".into())
    }
}

/// Streams until the robot is in OP, up, and has finished a command that was submitted since.
fn until_back(cell: &mut Cell<FaultyBus>) -> u64 {
    for cycle in 0..BACK_WITHIN {
        cell.insist();
        if cell.plc.quality.is_fresh() && cell.plc.is_up() && cell.bus().wire().is_quiet() {
            let Some(fresh) = cell.submit_next() else { panic!("no room\n{cell:#?}") };
            cell.until("a command that is done", BACK_WITHIN, |cell| {
                cell.insist();
                cell.plc.state(fresh).end.is_some()
            });
            assert_eq!(cell.plc.state(fresh).end, Some(End::Done), "{cell:#?}");
            return cycle;
        }
        stream(cell);
    }
    let events: Vec<_> =
        core::iter::from_fn(|| cell.bus().link.segment_mut().poll_event()).collect();
    panic!("not back within {BACK_WITHIN} cycles\n{events:#?}\n{cell:#?}");
}

/// One fault, to its end.
fn fault(cell: &mut Cell<FaultyBus>, random: &mut fastrand::Rng, fault: WireFault) {
    for _ in 0..random.u32(1..20) {
        stream(cell);
    }
    if fault == WireFault::LinkDown && random.bool() {
        let cycles = random.u64(1..=LONGEST_OUTAGE);
        cell.label += &format!(", cable out for {cycles}");
        cell.set_cable(Cable::Out);
        (0..cycles).for_each(|_| stream(cell));
        cell.set_cable(Cable::In);
        return;
    }
    let before = cell.bus().wire().faults_made();
    let is_received = random.bool();
    cell.label += if is_received { " of an answer" } else { " of outputs" };
    match is_received {
        true => cell.bus().wire().inject_received(fault),
        false => cell.bus().wire().inject(fault),
    }
    stream(cell);
    assert_eq!(cell.bus().wire().faults_made(), before + 1, "{cell:#?}");
    if cell.bus().wire().take_power_cycle() {
        let cycles = random.u64(0..300);
        cell.label += &format!(", off for {cycles}");
        cell.robot().robot.panel().switch_off();
        (0..cycles).for_each(|_| stream(cell));
        cell.robot().robot.panel().switch_on();
    }
    for _ in 0..2_000 {
        if cell.bus().wire().is_quiet() {
            break;
        }
        stream(cell);
    }
}

/// One life of a link; the longest way back to OP in cycles.
fn live(seed: u64) -> u64 {
    let mut random = fastrand::Rng::with_seed(seed);
    let clocks = match seed % 3 {
        0 => Clocks::Sync0 { shift: Duration::from_micros(300) },
        _ => Clocks::Off,
    };
    let bus = FaultyBus::open(seed, clocks);
    let mut cell = Cell::over(bus, ByteOrder::LITTLE, format!("seed {seed}"));
    cell.plc = Plc::new(ByteOrder::LITTLE, patient());
    cell.bring_up();
    let mut longest = 0;
    for number in 0..FAULTS {
        let drawn = WireFault::ALL[random.usize(0..WireFault::ALL.len())];
        cell.label = format!("seed {seed}, fault {number}: {drawn}");
        fault(&mut cell, &mut random, drawn);
        longest = longest.max(until_back(&mut cell));
        cell.judge();
    }
    lives::finish(&mut cell);
    longest
}

#[test]
fn a_hundred_faults_in_one_life_lose_nothing_and_double_nothing() {
    lives::lead(LIVES, live);
}
