//! The contract of [`EnipSegment`], on served robots in memory.

use core::net::{Ipv4Addr, SocketAddrV4};

use fieldarm::bus::enip::adapter::AdapterSettings;
use fieldarm::bus::enip::scanner::{ConnectionSettings, Originator, T2oType};
use fieldarm::cycle::{CyclicLink, CyclicSegment, InputQuality};
use fieldarm::link::enip::faulty_network::{Direction, FaultPlan, FaultyNetwork};
use fieldarm::link::enip::memory::MemoryNetwork;
use fieldarm::link::enip::network::Network;
use fieldarm::link::enip::served::ServedRobot;
use fieldarm::link::enip::{EnipError, EnipSegment, EnipSettings, TargetSettings};
use fieldarm::sim::meca500::RobotSettings;
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::enip::MESSAGE_PORT;

use crate::cell::CYCLE;
use crate::contract::{Ability, Bus, BusKind, Cable, PlcEnd};
use crate::link_contract;
use crate::quick_robot::quick_robot;
use crate::watched::WatchedRobot;

/// Robots in memory on a network that can misbehave.
pub(crate) type Net = FaultyNetwork<MemoryNetwork<WatchedRobot>>;

/// A robot among others.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Enip {
    /// Robots that are driven.
    pub(crate) robots: u8,
    /// Which of them is the one under test, counted from 0.
    pub(crate) robot: usize,
    /// Interval of both directions, and the PLC's cycle.
    pub(crate) rpi_ms: u64,
    pub(crate) t2o_type: T2oType,
    /// Number of PLCs before this one: no two begin with the same serial numbers.
    pub(crate) life: u64,
}

/// A segment of which one robot is the PLC's.
pub(crate) struct EnipLink {
    pub(crate) segment: EnipSegment<Net>,
    robot: usize,
}

impl CyclicLink for EnipLink {
    type Error = EnipError;

    fn exchange(
        &mut self,
        now: Instant,
        outputs: &[u8],
        inputs: &mut [u8],
    ) -> Result<InputQuality, EnipError> {
        self.segment.write_outputs(self.robot, outputs);
        self.segment.exchange(now)?;
        Ok(self.segment.read_inputs(self.robot, inputs))
    }
}

/// A network with a link to one of its robots.
pub(crate) struct EnipBus {
    pub(crate) link: EnipLink,
    kind: Enip,
}

/// Where a robot of this number is reached.
pub(crate) fn address(robot: u8) -> Ipv4Addr {
    Ipv4Addr::new(192, 168, 0, 10 + robot)
}

/// Adapter settings of a Meca500 that also takes intervals of 1 ms.
pub(crate) fn adapter() -> AdapterSettings {
    AdapterSettings { min_rpi: Duration::from_millis(1), ..AdapterSettings::meca500() }
}

/// A robot behind its adapter.
pub(crate) fn served(
    robot: u8,
    settings: RobotSettings,
    adapter: AdapterSettings,
) -> ServedRobot<WatchedRobot> {
    ServedRobot::new(WatchedRobot::new(settings), adapter, address(robot), 1 + u64::from(robot))
}

impl Enip {
    pub(crate) const ALONE: Self =
        Self { robots: 1, robot: 0, rpi_ms: 1, t2o_type: T2oType::Unicast, life: 0 };

    pub(crate) fn rpi(self) -> Duration {
        Duration::from_millis(self.rpi_ms)
    }

    pub(crate) fn connection(self) -> ConnectionSettings {
        ConnectionSettings {
            o2t_rpi: self.rpi(),
            t2o_rpi: self.rpi(),
            t2o_type: self.t2o_type,
            ..ConnectionSettings::meca500()
        }
    }

    pub(crate) fn network(self, robot: &RobotSettings, adapter: AdapterSettings) -> Net {
        let robots = (0..self.robots).map(|n| served(n, robot.clone(), adapter)).collect();
        FaultyNetwork::new(MemoryNetwork::new(robots), FaultPlan::NONE)
    }

    pub(crate) fn start(self, network: Net) -> Result<EnipBus, String> {
        let target = |robot| TargetSettings {
            address: SocketAddrV4::new(address(robot), MESSAGE_PORT),
            connection: self.connection(),
        };
        let settings = EnipSettings {
            targets: (0..self.robots).map(target).collect(),
            originator: Originator { vendor: 0xFFFF, serial: 7 },
            seed: 100 + self.life,
            cycle: self.rpi(),
            start_limit: Duration::from_secs(10),
        };
        match EnipSegment::start(network, settings) {
            Ok(segment) => {
                Ok(EnipBus { link: EnipLink { segment, robot: self.robot }, kind: self })
            }
            Err(failure) => Err(failure.error.to_string()),
        }
    }
}

impl BusKind for Enip {
    type Bus = EnipBus;

    fn inability(self, ability: Ability) -> Option<&'static str> {
        match ability {
            Ability::LeaveByCommand => Some("the image has a command for leaving EtherCAT only"),
            Ability::NoticeLostOutputs => Some("the robot's frames come by themselves"),
            Ability::LoseImages | Ability::LoseOneWay => None,
        }
    }

    fn cycles_per_command(self) -> u64 {
        // A frame there, at most a millisecond until the robot looks, at most an interval until it speaks.
        if self.rpi_ms == 1 { 3 } else { 2 }
    }

    fn open(self, robot: RobotSettings) -> Result<EnipBus, String> {
        self.start(self.network(&robot, adapter()))
    }

    fn refusal(self) -> (Result<(), String>, &'static [&'static str]) {
        let old = AdapterSettings { input_len: 248, ..adapter() };
        let network = self.network(&quick_robot(), old);
        // Sizes on the wire count two bytes of sequence number.
        (self.start(network).map(drop), &["192.168.0.10", "254", "250", "T->O"])
    }
}

impl Bus for EnipBus {
    type Link = EnipLink;

    fn link(&mut self) -> &mut EnipLink {
        &mut self.link
    }

    fn robot(&mut self) -> &mut WatchedRobot {
        let network = self.link.segment.network_mut().inner_mut();
        network.robots_mut()[self.kind.robot].device_mut()
    }

    fn set_cable(&mut self, cable: Cable) {
        let network = self.link.segment.network_mut();
        network.plug();
        match cable {
            Cable::In => {}
            Cable::Out => network.unplug(),
            Cable::AnswersLost => network.cut(Direction::Received, true),
            Cable::OutputsLost => network.cut(Direction::Sent, true),
        }
    }

    fn nudge_ns(&self) -> i64 {
        let longer = self.kind.rpi().saturating_sub(CYCLE);
        i64::try_from(longer.as_nanos()).expect("some milliseconds")
    }

    fn restart_plc(self, end: PlcEnd, _: Instant, away: Duration) -> Result<Self, String> {
        let mut network = match end {
            PlcEnd::Closed => self.link.segment.close(),
            PlcEnd::Died => self.link.segment.abandon(),
        };
        let until = network.now() + away;
        network.advance_to(until);
        Enip { life: self.kind.life + 1, ..self.kind }.start(network)
    }
}

link_contract!(alone, crate::enip::Enip::ALONE);
link_contract!(alone_at_its_own_pace, crate::enip::Enip { rpi_ms: 10, ..crate::enip::Enip::ALONE });
link_contract!(
    alone_by_multicast,
    crate::enip::Enip {
        t2o_type: fieldarm::bus::enip::scanner::T2oType::Multicast,
        ..crate::enip::Enip::ALONE
    }
);
link_contract!(
    second_of_three,
    crate::enip::Enip { robots: 3, robot: 1, ..crate::enip::Enip::ALONE }
);

#[test]
fn it_cannot_leave_by_command_nor_notice_lost_outputs() {
    let able = Ability::ALL.map(|ability| Enip::ALONE.inability(ability).is_none());
    let names = Ability::ALL.iter().zip(able).filter(|(_, able)| !able);
    let names: Vec<_> = names.map(|(ability, _)| *ability).collect();
    assert_eq!(names, [Ability::LeaveByCommand, Ability::NoticeLostOutputs]);
}
