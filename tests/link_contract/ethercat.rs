//! The contract of [`EthercatLink`], on a line of emulated robots in memory.

use fieldarm::bus::ethercat::meca500::{Meca500Application, Meca500Settings};
use fieldarm::bus::ethercat::{Settings, SubDevice};
use fieldarm::cycle::CyclicSegment;
use fieldarm::link::ethercat::memory::MemoryWire;
use fieldarm::link::ethercat::wire::Wire;
use fieldarm::link::ethercat::{Clocks, EthercatLink, RobotAddress, RobotChoice, SegmentSettings};
use fieldarm::sim::meca500::{CyclicBus, RobotSettings};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::ethercat::sii::SiiImage;
use fieldarm::wire::meca500::image::pdo::PdoLayout;
use fieldarm::wire::meca500::subdevice::DESCRIPTION;

use crate::contract::{Ability, Bus, BusKind, Cable, PlcEnd};
use crate::link_contract;
use crate::one_way::OneWay;
use crate::quick_robot::quick_robot;
use crate::watched::WatchedRobot;

/// A line of emulated robots and the wire to it.
pub(crate) type Line = MemoryWire<Meca500Application<WatchedRobot>>;

/// A robot in its place of a line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ethercat {
    /// Robots on the line.
    pub(crate) robots: u16,
    /// Which of them is driven, counted from 0.
    pub(crate) position: u16,
    /// Whether cycles are taken from SYNC0.
    pub(crate) clocks: bool,
}

/// A line with a link to one of its robots.
pub(crate) struct EthercatBus {
    link: EthercatLink<OneWay<Line>>,
    kind: Ethercat,
}

/// So many robots in a line, the one at `position` with its own settings on the bus.
pub(crate) fn line(
    robot: &RobotSettings,
    robots: u16,
    position: u16,
    bus: Meca500Settings,
) -> Line {
    let device = |n: u16| {
        let settings = RobotSettings { bus: CyclicBus::EtherCat, ..robot.clone() };
        let bus = if n == position { bus } else { Meca500Settings::default() };
        let sii = SiiImage::new(&DESCRIPTION).expect("our own description fits");
        let clock = Settings {
            clock_start_ns: u64::from(n) * 77_777_777,
            clock_drift_ppb: 15_000 - i32::from(n) * 9_000,
            ..Settings::default()
        };
        let application = Meca500Application::new(WatchedRobot::new(settings), bus);
        SubDevice::new(application, &DESCRIPTION, sii, clock)
    };
    MemoryWire::new((0..robots).map(device).collect())
}

impl Ethercat {
    fn settings(self) -> SegmentSettings {
        let clocks = match self.clocks {
            true => Clocks::Sync0 { shift: Duration::from_micros(300) },
            false => Clocks::Off,
        };
        let robots = RobotChoice::These(vec![RobotAddress::Position(self.position)]);
        SegmentSettings { robots, clocks, ..SegmentSettings::default() }
    }

    fn start(self, wire: OneWay<Line>) -> Result<EthercatBus, String> {
        match EthercatLink::start(wire, self.settings()) {
            Ok(link) => Ok(EthercatBus { link, kind: self }),
            Err(failure) => Err(failure.error.to_string()),
        }
    }
}

impl BusKind for Ethercat {
    type Bus = EthercatBus;

    fn inability(self, _: Ability) -> Option<&'static str> {
        None
    }

    fn cycles_per_command(self) -> u64 {
        2
    }

    fn open(self, robot: RobotSettings) -> Result<EthercatBus, String> {
        let line = line(&robot, self.robots, self.position, Meca500Settings::default());
        self.start(OneWay::new(line))
    }

    fn refusal(self) -> (Result<(), String>, &'static [&'static str]) {
        let old = Meca500Settings { layout: PdoLayout::V9_3, ..Meca500Settings::default() };
        let line = line(&quick_robot(), self.robots, self.position, old);
        let named: &[&str] = match self.position {
            0 => &["position 0", "outputs", "7200h:07", "DisableEtherCAT", "1600h", "1C12h"],
            _ => &["position 1", "outputs", "7200h:07", "DisableEtherCAT", "1600h", "1C12h"],
        };
        (self.start(OneWay::new(line)).map(drop), named)
    }
}

impl Bus for EthercatBus {
    type Link = EthercatLink<OneWay<Line>>;

    fn link(&mut self) -> &mut Self::Link {
        &mut self.link
    }

    fn robot(&mut self) -> &mut WatchedRobot {
        let line = self.link.segment_mut().wire_mut().wire.line_mut();
        line[usize::from(self.kind.position)].application_mut().device_mut()
    }

    fn set_cable(&mut self, cable: Cable) {
        let wire = self.link.segment_mut().wire_mut();
        wire.loses_sent = cable == Cable::OutputsLost;
        wire.loses_received = cable == Cable::AnswersLost;
        match cable {
            Cable::Out => wire.wire.unplug(),
            _ => wire.wire.plug(),
        }
    }

    fn nudge_ns(&self) -> i64 {
        self.link.segment().nudge_ns()
    }

    fn restart_plc(self, end: PlcEnd, _: Instant, away: Duration) -> Result<Self, String> {
        let segment = self.link.into_segment();
        let mut wire = match end {
            PlcEnd::Closed => segment.close(),
            PlcEnd::Died => segment.abandon(),
        };
        let until = wire.now() + away;
        wire.pause_until(until);
        self.kind.start(wire)
    }
}

link_contract!(alone, crate::ethercat::Ethercat { robots: 1, position: 0, clocks: false });
link_contract!(
    alone_with_clocks,
    crate::ethercat::Ethercat { robots: 1, position: 0, clocks: true }
);
link_contract!(
    second_of_three,
    crate::ethercat::Ethercat { robots: 3, position: 1, clocks: false }
);
link_contract!(
    second_of_three_with_clocks,
    crate::ethercat::Ethercat { robots: 3, position: 1, clocks: true }
);

#[test]
fn it_can_do_everything() {
    let kind = Ethercat { robots: 1, position: 0, clocks: false };
    assert_eq!(Ability::ALL.map(|ability| kind.inability(ability)), [None; 4]);
}
