//! Lines of emulated robots for tests.

#![allow(dead_code, reason = "each test binary uses a part of it")]

use fieldarm::bus::ethercat::meca500::{Meca500Application, Meca500Settings};
use fieldarm::bus::ethercat::{Settings, SubDevice};
use fieldarm::cycle::CyclicDevice;
use fieldarm::link::ethercat::memory::MemoryWire;
use fieldarm::sim::meca500::{CyclicBus, RobotSettings, VirtualRobot};
use fieldarm::wire::ethercat::sii::SiiImage;
use fieldarm::wire::meca500::subdevice::DESCRIPTION;
use fieldarm::wire::order::ByteOrder;

/// A robot as EtherCAT sees it.
pub(crate) type EmulatedRobot = SubDevice<Meca500Application<VirtualRobot>>;
/// A wire to a line of them.
pub(crate) type Line = MemoryWire<Meca500Application<VirtualRobot>>;

/// A robot that has booted, little-endian, with this alias.
pub(crate) fn robot(alias: u16, bus: Meca500Settings, esc: Settings) -> EmulatedRobot {
    robot_in(ByteOrder::LITTLE, alias, bus, esc)
}

/// A robot that has booted, in the given byte order.
pub(crate) fn robot_in(
    byte_order: ByteOrder,
    alias: u16,
    bus: Meca500Settings,
    esc: Settings,
) -> EmulatedRobot {
    let device = VirtualRobot::new(RobotSettings {
        byte_order,
        bus: CyclicBus::EtherCat,
        ..RobotSettings::default()
    });
    on_bus(device, alias, bus, esc)
}

/// A robot's inside behind an EtherCAT interface.
pub(crate) fn on_bus<D: CyclicDevice>(
    device: D,
    alias: u16,
    bus: Meca500Settings,
    esc: Settings,
) -> SubDevice<Meca500Application<D>> {
    let mut sii = SiiImage::new(&DESCRIPTION).unwrap();
    sii.set_alias(alias);
    SubDevice::new(Meca500Application::new(device, bus), &DESCRIPTION, sii, esc)
}

/// A line of so many robots, all alike.
pub(crate) fn line(robots: u16) -> Line {
    let robot = |n| robot(n + 1, Meca500Settings::default(), Settings::default());
    MemoryWire::new((0..robots).map(robot).collect())
}
