//! A hundred random faults in one life of the EtherNet/IP link, while an engine streams commands: inputs
//! again after each, no command lost or doubled, every verdict true. `FIELDARM_FAULT_SEED` replays one run.

use fieldarm::bus::enip::scanner::T2oType;
use fieldarm::cycle::CyclicDevice;
use fieldarm::engine::meca500::Config;
use fieldarm::link::enip::faulty_network::{Direction, LONGEST_DELAY, NetworkFault};
use fieldarm::sim::meca500::RobotSettings;
use fieldarm::wire::order::ByteOrder;

use crate::cell::Cell;
use crate::checkers::End;
use crate::contract::Cable;
use crate::enip::{Enip, EnipBus, Net, adapter};
use crate::lives::{self, stream};
use crate::plc::Plc;
use crate::quick_robot::quick_robot;

/// Faults in one life of a link.
const FAULTS: u32 = 100;
/// Lives, each with its own seed.
const LIVES: u64 = if cfg!(debug_assertions) { 3 } else { 25 };
/// Most cycles from the end of a fault to a robot that is up and streams: the scanner may be about to
/// wait five seconds before it tries again.
const BACK_WITHIN: u64 = 12_000;
/// Longest time a cable stays out, in ms.
const LONGEST_OUTAGE_MS: u64 = 2_000;

/// A PLC that knows how long a frame may be under way here: not longer than [`LONGEST_DELAY`].
fn patient(kind: Enip) -> Config {
    let cycles = LONGEST_DELAY.as_millis() / kind.rpi().as_millis() + 1;
    Config { settle_cycles: u16::try_from(cycles).expect("a few"), ..Config::default() }
}

fn net(cell: &mut Cell<EnipBus>) -> &mut Net {
    cell.bus().link.segment.network_mut()
}

/// Streams until the robot is heard, up, and has finished a command that was submitted since.
fn until_back(cell: &mut Cell<EnipBus>) -> u64 {
    for cycle in 0..BACK_WITHIN {
        cell.insist();
        if cell.plc.quality.is_fresh() && cell.plc.is_up() && net(cell).is_quiet() {
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
    let events: Vec<_> = core::iter::from_fn(|| cell.bus().link.segment.poll_event()).collect();
    panic!("not back within {BACK_WITHIN} cycles\n{events:#?}\n{cell:#?}");
}

/// One fault, without waiting for its end.
fn fault(cell: &mut Cell<EnipBus>, random: &mut fastrand::Rng, fault: NetworkFault) {
    for _ in 0..random.u32(1..20) {
        stream(cell);
    }
    if fault == NetworkFault::Silence && random.bool() {
        let cable = [Cable::Out, Cable::AnswersLost, Cable::OutputsLost][random.usize(0..3)];
        let cycles = random.u64(1..=LONGEST_OUTAGE_MS);
        cell.label += &format!(", {cable:?} for {cycles}");
        cell.set_cable(cable);
        (0..cycles).for_each(|_| stream(cell));
        cell.set_cable(Cable::In);
        return;
    }
    let before = net(cell).faults_made();
    let direction = if random.bool() { Direction::Received } else { Direction::Sent };
    cell.label += &format!(", {fault} {direction:?}");
    net(cell).inject(direction, fault);
    for _ in 0..BACK_WITHIN {
        if net(cell).faults_made() > before {
            break;
        }
        stream(cell);
    }
    assert_eq!(net(cell).faults_made(), before + 1, "{cell:#?}");
    if net(cell).take_power_cycle() {
        let cycles = random.u64(0..300);
        cell.label += &format!(", off for {cycles}");
        cell.robot().robot.panel().switch_off();
        (0..cycles).for_each(|_| stream(cell));
        cell.robot().robot.panel().switch_on();
        // A frame or two may be under way still: wait until nobody can take them for those of a robot that is up.
        for _ in 0..BACK_WITHIN {
            if cell.robot().is_on_bus() {
                break;
            }
            stream(cell);
        }
    }
}

/// One life of a link; the longest way back in cycles.
fn live(seed: u64) -> u64 {
    let mut random = fastrand::Rng::with_seed(seed);
    let kind = Enip {
        rpi_ms: if seed.is_multiple_of(4) { 10 } else { 1 },
        t2o_type: if seed.is_multiple_of(3) { T2oType::Multicast } else { T2oType::Unicast },
        life: seed,
        ..Enip::ALONE
    };
    let robot = RobotSettings { byte_order: ByteOrder::LITTLE, ..quick_robot() };
    let bus = match kind.start(kind.network(&robot, adapter())) {
        Ok(bus) => bus,
        Err(error) => panic!("{error}"),
    };
    let mut cell = Cell::over(bus, ByteOrder::LITTLE, format!("seed {seed}"));
    cell.plc = Plc::new(ByteOrder::LITTLE, patient(kind));
    cell.bring_up();
    let mut longest = 0;
    for number in 0..FAULTS {
        cell.label = format!("seed {seed}, fault {number}: ");
        // Sometimes the next one comes before the last one is over.
        for _ in 0..random.u32(1..=2) {
            let drawn = NetworkFault::ALL[random.usize(0..NetworkFault::ALL.len())];
            fault(&mut cell, &mut random, drawn);
        }
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
