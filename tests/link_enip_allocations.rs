//! Exchanges of an EtherNet/IP segment take no memory once all connections are up, and neither do the robots
//! in memory, their adapters and the network that carries the frames.
#![cfg(all(feature = "enip", feature = "sim"))]

#[path = "support/enip_robots.rs"]
mod enip_robots;

use enip_robots::{Plc, robots};
use fieldarm::bus::enip::adapter::AdapterSettings;
use fieldarm::bus::enip::scanner::{ConnectionSettings, T2oType};
use fieldarm::cycle::CyclicSegment;
use fieldarm::link::enip::faulty_network::{FaultPlan, FaultyNetwork, NetworkFault};
use fieldarm::wire::meca500::image::OUTPUT_LEN;

/// Exchanges that are counted.
const EXCHANGES: u64 = 10_000;
/// Exchanges before.
const WARM_UP: u64 = 500;

/// Memory taken in [`EXCHANGES`] exchanges of `count` robots, with some taken on purpose every so often.
fn taken(count: u8, t2o_type: T2oType, plan: FaultPlan, wasteful_every: Option<u64>) -> u64 {
    let connection = ConnectionSettings { t2o_type, ..ConnectionSettings::meca500() };
    let connections: Vec<_> = (0..count).map(|robot| (robot, connection)).collect();
    let network = FaultyNetwork::new(robots(count, AdapterSettings::meca500()), plan);
    let mut plc = Plc::start(network, 1, &connections);
    let mut outputs = [0_u8; OUTPUT_LEN];
    let mut cycles = |plc: &mut Plc<_>, cycles: u64, every: Option<u64>| {
        let mut fresh = 0;
        for cycle in 0..cycles {
            if every.is_some_and(|every| cycle.is_multiple_of(every)) {
                drop(std::hint::black_box(vec![0_u8; 16]));
            }
            // Other outputs each time: the last slot asks for a type that does not exist, and for none again.
            outputs[OUTPUT_LEN - 1] ^= 1;
            for robot in 0..usize::from(count) {
                plc.segment.write_outputs(robot, &outputs);
            }
            plc.cycle();
            fresh += u64::from(plc.quality(usize::from(count) - 1).is_fresh());
        }
        fresh
    };
    cycles(&mut plc, WARM_UP, None);
    let mut fresh = 0;
    let counted = allocation_counter::measure(|| {
        fresh = cycles(&mut plc, EXCHANGES, wasteful_every);
    });
    assert!(fresh > EXCHANGES * 9 / 10, "only {fresh} fresh inputs");
    counted.count_total
}

#[test]
fn ten_thousand_exchanges_take_no_memory() {
    for t2o_type in [T2oType::Unicast, T2oType::Multicast] {
        assert_eq!(taken(1, t2o_type, FaultPlan::NONE, None), 0, "{t2o_type:?}");
    }
    assert_eq!(taken(3, T2oType::Unicast, FaultPlan::NONE, None), 0, "three robots");
}

#[test]
fn neither_do_lost_doubled_late_and_overtaken_frames() {
    let faults =
        [NetworkFault::Drop, NetworkFault::Duplicate, NetworkFault::Delay, NetworkFault::Reorder];
    let chances = faults.into_iter().map(|fault| (fault, 10)).collect();
    let plan = FaultPlan { chances, seed: 3, limit: None };
    assert_eq!(taken(1, T2oType::Unicast, plan, None), 0);
}

#[test]
fn memory_that_is_taken_is_counted() {
    assert_eq!(taken(1, T2oType::Unicast, FaultPlan::NONE, Some(100)), EXCHANGES / 100);
}
