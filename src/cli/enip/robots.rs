//! Virtual robots behind EtherNet/IP adapters.

use core::net::{Ipv4Addr, SocketAddrV4};
use std::prelude::v1::*;

use super::connect;
use crate::bus::enip::adapter::{Access, AdapterSettings};
use crate::cycle::CyclicDevice;
use crate::link::enip::memory::MemoryNetwork;
use crate::link::enip::served::ServedRobot;
use crate::sim::meca500::VirtualRobot;
use crate::time::Duration;
use crate::wire::enip::MESSAGE_PORT;
use crate::wire::enip::identity::Identity;
use crate::wire::meca500::adapter::IDENTITY;
use crate::wire::meca500::image::FirmwareLayout;

/// Serial number of the first robot; those behind it count up.
pub(in crate::cli) const FIRST_SERIAL: u32 = 87_654_321;
/// Where the first robot in memory stands; the others stand at the addresses behind it.
const FIRST_IN_MEMORY: Ipv4Addr = Ipv4Addr::new(192, 168, 0, 101);
/// Shortest interval that robots in this process accept, in us.
const SHORTEST_RPI: Duration = Duration::from_micros(100);

const LOOPBACK_NETMASK: Ipv4Addr = Ipv4Addr::new(255, 0, 0, 0);

/// How a robot presents itself on EtherNet/IP.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::cli) struct Presentation {
    pub(in crate::cli) serial: u32,
    pub(in crate::cli) layout: FirmwareLayout,
    /// Shortest interval that is accepted.
    pub(in crate::cli) min_rpi: Duration,
    pub(in crate::cli) monitoring_only: bool,
}

/// `robot` behind an adapter at `address`.
pub(in crate::cli) fn served<D: CyclicDevice>(
    robot: D,
    address: Ipv4Addr,
    presentation: Presentation,
) -> ServedRobot<D> {
    let Presentation { serial, layout, min_rpi, monitoring_only } = presentation;
    let defaults = AdapterSettings::meca500();
    let (major, minor) = match layout {
        FirmwareLayout::V11_3 => (11, 3),
        FirmwareLayout::V10_2 => (10, 2),
    };
    let settings = AdapterSettings {
        identity: Identity { serial, major, minor, ..IDENTITY },
        min_rpi,
        // What is shorter than the usual step is granted as it was asked for.
        rpi_step: if min_rpi < defaults.min_rpi { Duration::ZERO } else { defaults.rpi_step },
        // As the loopback interface has it: broadcasts to it reach the robots.
        netmask: if address.is_loopback() { LOOPBACK_NETMASK } else { defaults.netmask },
        access: if monitoring_only { Access::MonitoringOnly } else { Access::Full },
        ..defaults
    };
    ServedRobot::new(robot, settings, address, connect::seed())
}

/// `robots` on a network in memory that accept intervals of `rpi`, and where they are reached.
pub(in crate::cli) fn in_memory(
    robots: impl Iterator<Item = VirtualRobot>,
    rpi: Duration,
) -> (MemoryNetwork<VirtualRobot>, Vec<SocketAddrV4>) {
    let served: Vec<_> = (0..)
        .zip(robots)
        .map(|(number, robot)| {
            let address = Ipv4Addr::from_bits(FIRST_IN_MEMORY.to_bits() + number);
            let presentation = Presentation {
                serial: FIRST_SERIAL + number,
                layout: FirmwareLayout::V11_3,
                min_rpi: rpi.clamp(SHORTEST_RPI, AdapterSettings::meca500().min_rpi),
                monitoring_only: false,
            };
            served(robot, address, presentation)
        })
        .collect();
    let addresses =
        served.iter().map(|robot| SocketAddrV4::new(robot.address(), MESSAGE_PORT)).collect();
    (MemoryNetwork::new(served), addresses)
}
