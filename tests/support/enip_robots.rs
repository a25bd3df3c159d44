//! Robots on EtherNet/IP in memory for tests, and segments to them.

#![allow(dead_code, reason = "each test binary uses a part of it")]

use core::net::{Ipv4Addr, SocketAddrV4};

use fieldarm::bus::enip::adapter::AdapterSettings;
use fieldarm::bus::enip::scanner::{ConnectionSettings, Originator};
use fieldarm::cycle::{CyclicSegment, InputQuality};
use fieldarm::link::enip::memory::MemoryNetwork;
use fieldarm::link::enip::network::Network;
use fieldarm::link::enip::served::ServedRobot;
use fieldarm::link::enip::{EnipSegment, EnipSettings, TargetSettings};
use fieldarm::sim::meca500::{LifecycleTimes, RobotSettings, VirtualRobot};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::enip::MESSAGE_PORT;
use fieldarm::wire::meca500::image::INPUT_LEN;
use fieldarm::wire::order::ByteOrder;

/// Interval of the connections, and cycle of the segments.
pub(crate) const RPI: Duration = Duration::from_millis(10);
/// Intervals after which a connection is given up, by the settings of a Meca500.
pub(crate) const WATCHDOG_CYCLES: u64 = 16;

/// Robots at addresses of their own.
pub(crate) type Robots = MemoryNetwork<VirtualRobot>;

/// Where a robot of this number is reached.
pub(crate) fn robot_address(robot: u8) -> SocketAddrV4 {
    SocketAddrV4::new(Ipv4Addr::new(192, 168, 0, 10 + robot), MESSAGE_PORT)
}

/// A little-endian robot that has booted, and boots quickly.
pub(crate) fn device() -> VirtualRobot {
    let times = LifecycleTimes { boot: Duration::from_millis(100), ..LifecycleTimes::default() };
    VirtualRobot::new(RobotSettings {
        byte_order: ByteOrder::LITTLE,
        times,
        ..RobotSettings::default()
    })
}

/// So many robots on a perfect network.
pub(crate) fn robots(count: u8, adapter: AdapterSettings) -> Robots {
    let served = |robot| {
        ServedRobot::new(device(), adapter, *robot_address(robot).ip(), 1 + u64::from(robot))
    };
    MemoryNetwork::new((0..count).map(served).collect())
}

/// Settings of a segment with these connections, each to a robot by its number.
pub(crate) fn settings(seed: u64, connections: &[(u8, ConnectionSettings)]) -> EnipSettings {
    let target = |(robot, connection): &(u8, ConnectionSettings)| TargetSettings {
        address: robot_address(*robot),
        connection: *connection,
    };
    EnipSettings {
        targets: connections.iter().map(target).collect(),
        originator: Originator { vendor: 0xFFFF, serial: 7 },
        seed,
        cycle: RPI,
        start_limit: Duration::from_secs(10),
    }
}

/// A segment and the PLC's clock.
pub(crate) struct Plc<N> {
    pub(crate) segment: EnipSegment<N>,
    pub(crate) now: Instant,
}

impl<N: Network> Plc<N> {
    /// Starts a segment with these connections.
    pub(crate) fn start(network: N, seed: u64, connections: &[(u8, ConnectionSettings)]) -> Self {
        match EnipSegment::start(network, settings(seed, connections)) {
            Ok(segment) => Self { segment, now: Instant::ZERO },
            Err(failure) => panic!("{}", failure.error),
        }
    }

    /// An owner of robot 0.
    pub(crate) fn owner(network: N) -> Self {
        Self::start(network, 1, &[(0, ConnectionSettings::meca500())])
    }

    /// One cycle; the quality of the inputs of target 0.
    pub(crate) fn cycle(&mut self) -> InputQuality {
        self.now += RPI;
        self.segment.exchange(self.now).expect("memory never fails");
        self.quality(0)
    }

    pub(crate) fn cycles(&mut self, cycles: u64) -> Vec<InputQuality> {
        (0..cycles).map(|_| self.cycle()).collect()
    }

    pub(crate) fn quality(&self, target: usize) -> InputQuality {
        self.segment.read_inputs(target, &mut [0; INPUT_LEN])
    }

    /// Cycles until the inputs of target 0 are fresh; how many, at most `limit`.
    pub(crate) fn until_fresh(&mut self, limit: u64) -> u64 {
        let cycles = (1..=limit).find(|_| self.cycle().is_fresh());
        cycles.unwrap_or_else(|| {
            let events: Vec<_> = core::iter::from_fn(|| self.segment.poll_event()).collect();
            panic!("no fresh inputs within {limit} cycles: {events:?}")
        })
    }
}
