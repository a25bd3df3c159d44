//! The segment that a run drives, behind whichever link was chosen.

use core::convert::Infallible;
use core::net::SocketAddrV4;
use std::io::Write;
use std::prelude::v1::*;

use super::emulated_robot::{Presentation, emulated};
use super::enip::connect::{self, Opened, START_LIMIT};
use super::enip::link_name::{EnipName, EnipOptions};
use super::enip::{robots, words};
use super::ethercat_options::{EthercatOptions, explained};
use super::exit::Failure;
use super::link_choice::LinkChoice;
use super::report::ReportedEnip;
#[cfg(target_os = "linux")]
use super::sim::refused;
use super::virtual_robot::{self, SimArgs};
use super::watch::LinkWatcher;
use super::wording::counted;
use crate::bus::ethercat::meca500::{Meca500Application, Meca500Settings};
use crate::cycle::{CyclicSegment, InputQuality};
use crate::link::direct::DirectSegment;
use crate::link::enip::memory::MemoryNetwork;
use crate::link::enip::network::Network;
use crate::link::enip::sockets::SocketNetwork;
use crate::link::enip::{EnipError, EnipSegment};
use crate::link::ethercat::memory::MemoryWire;
#[cfg(target_os = "linux")]
use crate::link::ethercat::raw_socket::RawSocket;
use crate::link::ethercat::wire::Wire;
use crate::link::ethercat::{
    EthercatError, EthercatSegment, FrameCounters, RobotChoice, SegmentStatistics,
};
use crate::run::outcome::LinkMessage;
use crate::sim::meca500::{CyclicBus, VirtualRobot};
use crate::time::{Duration, Instant};
use crate::wire::meca500::image::FirmwareLayout;
use crate::wire::meca500::revision::Revision;

/// A line of emulated robots in this process.
type Emulation = MemoryWire<Meca500Application<VirtualRobot>>;

/// Any of the segments a run can drive. A cycle costs one `match`, and no memory.
enum Bus {
    /// Left.
    Closed,
    /// Virtual robots without a bus.
    Direct(DirectSegment<VirtualRobot>),
    /// Virtual robots behind the whole EtherCAT stack, joined in memory.
    EthercatSim(Box<EthercatSegment<Emulation>>),
    /// The robots on the network interface of this name.
    #[cfg(target_os = "linux")]
    Ethercat(Box<EthercatSegment<RawSocket>>, String),
    /// Virtual robots behind the whole EtherNet/IP stack, joined in memory.
    EnipSim(Enip<MemoryNetwork<VirtualRobot>>),
    /// The robots at some addresses.
    Enip(Enip<SocketNetwork>),
}

/// Robots on EtherNet/IP, and how their connections were opened.
struct Enip<N> {
    segment: Box<EnipSegment<N>>,
    opened: Vec<Opened>,
    asked: Duration,
}

/// A segment, and who hears what happens on it.
pub(super) struct Segment {
    bus: Bus,
    watcher: Option<LinkWatcher>,
}

/// How a segment is opened.
#[derive(Clone, Copy)]
pub(super) struct Opening<'a> {
    pub(super) link: &'a LinkChoice,
    pub(super) robots: usize,
    /// Period to ask for; where the robots decide it, [`Segment::period`] tells what became of it.
    pub(super) cycle: Duration,
    pub(super) ethercat: &'a EthercatOptions,
    pub(super) sim: &'a SimArgs,
    pub(super) revision: Revision,
    pub(super) is_quiet: bool,
}

/// Opens the segment with so many robots on it, ready for its first exchange.
pub(super) fn open_segment(opening: Opening<'_>) -> Result<Segment, Failure> {
    let Opening { link, robots, sim, revision, .. } = opening;
    let order = link.sim_byte_order();
    let bus = match link {
        LinkChoice::Sim => {
            let device = |_| virtual_robot::new(sim, order, revision, CyclicBus::Direct);
            Bus::Direct(DirectSegment::new((0..robots).map(device)))
        }
        LinkChoice::EthercatSim => {
            let presentation =
                Presentation { alias: 0, distributed_clock: true, pdos_in_sii: false };
            let device = |_| {
                let robot = virtual_robot::new(sim, order, revision, CyclicBus::EtherCat);
                emulated(robot, Meca500Settings::default(), presentation)
            };
            let line = (0..robots).map(device).collect::<Result<Vec<_>, _>>()?;
            Bus::EthercatSim(start(MemoryWire::new(line), opening, RobotChoice::All)?)
        }
        #[cfg(target_os = "linux")]
        LinkChoice::Ethercat { interface, position } => {
            let socket = RawSocket::open(interface).map_err(refused)?;
            if socket.is_down() {
                return Err(Failure::link(format!(
                    "--link {link}: the interface is down: ip link set {interface} up"
                )));
            }
            let choice = match position {
                Some(position) => RobotChoice::These(vec![*position]),
                None => RobotChoice::First(robots),
            };
            Bus::Ethercat(start(socket, opening, choice)?, interface.clone())
        }
        LinkChoice::EnipSim { options, .. } => {
            let device = |_| virtual_robot::new(sim, order, revision, CyclicBus::EtherNetIp);
            let (network, targets) = robots::in_memory((0..robots).map(device), options.rpi);
            Bus::EnipSim(start_enip(network, &targets, options, opening)?)
        }
        LinkChoice::Enip(EnipName { hosts, options, .. }) => {
            let targets = connect::look_up(hosts)?;
            let network = connect::open_sockets(options, &targets).map_err(|failure| Failure {
                message: format!("--link {link}: {}", failure.message),
                ..failure
            })?;
            Bus::Enip(start_enip(network, &targets, options, opening)?)
        }
        #[cfg(not(target_os = "linux"))]
        LinkChoice::Ethercat { .. } => {
            return Err(Failure::link(format!(
                "--link {link}: raw Ethernet is built for Linux only; --link ethercat-sim works here"
            )));
        }
    };
    Ok(Segment { bus, watcher: None })
}

impl Opening<'_> {
    fn say(&self, text: &str) {
        if !self.is_quiet {
            // Nobody reads standard error any more: the run goes on.
            let _ = writeln!(std::io::stderr(), "{text}");
        }
    }
}

fn start_enip<N: Network>(
    network: N,
    targets: &[SocketAddrV4],
    options: &EnipOptions,
    opening: Opening<'_>,
) -> Result<Enip<N>, Failure> {
    let link = opening.link;
    if !link.is_in_process() {
        opening.say(&format!("{link}: opening {}", counted(targets.len(), "connection")));
    }
    let connection = connect::connection(options);
    let (segment, opened) = connect::start(network, targets, connection, options.rpi, START_LIMIT)
        .map_err(|(error, _)| {
            Failure::link(format!("--link {link}: {}", words::refusal(error, targets.len())))
        })?;
    for (number, opened) in (1..).zip(&opened) {
        if let Some(text) = words::other_interval(opened, options.rpi) {
            let robot =
                if targets.len() == 1 { String::new() } else { format!("robot {number}: ") };
            opening.say(&format!("{robot}{text}"));
        }
    }
    Ok(Enip { segment: Box::new(segment), opened, asked: options.rpi })
}

impl<N: Network> Enip<N> {
    fn exchange(&mut self, watcher: Option<&LinkWatcher>, now: Instant) -> Result<(), EnipError> {
        let exchanged = self.segment.exchange(now);
        while let Some(event) = self.segment.poll_event() {
            if let Some(watcher) = watcher {
                watcher.tell_enip(event);
            }
        }
        exchanged
    }

    fn report(&self, robot: usize) -> Option<ReportedEnip> {
        let (opened, status) = (self.opened.get(robot)?, self.segment.status(robot)?);
        Some(ReportedEnip::new(self.asked, opened, &status, self.segment.statistics()))
    }
}

fn start<W: Wire>(
    wire: W,
    opening: Opening<'_>,
    robots: RobotChoice,
) -> Result<Box<EthercatSegment<W>>, Failure> {
    let cycle_us = u64::try_from(opening.cycle.as_micros()).unwrap_or(u64::MAX);
    let settings = opening.ethercat.settings(robots, cycle_us);
    let say = |text: String| opening.say(&text);
    if !opening.link.is_in_process() {
        say(format!("{}: bringing the robots to OP", opening.link));
    }
    let segment = EthercatSegment::start(wire, settings).map(Box::new).map_err(|failure| {
        Failure::link(format!("--link {}: {}", opening.link, explained(failure.error)))
    })?;
    for (number, robot) in (1..).zip(segment.robots()) {
        for layout in [&robot.outputs, &robot.inputs] {
            let missing: Vec<String> =
                layout.missing().iter().map(|object| format!("{object:04X}h")).collect();
            if !missing.is_empty() {
                say(format!(
                    "robot {number}: its {} are laid out by name; not mapped, so read as 0: {}",
                    layout.direction(),
                    missing.join(", ")
                ));
            }
        }
    }
    Ok(segment)
}

impl Segment {
    /// Who hears what happens on the bus from now on; nobody with `None`.
    pub(super) fn watch(&mut self, watcher: Option<LinkWatcher>) {
        self.watcher = watcher;
    }

    /// Which firmware's image a robot has, as far as the bus tells.
    pub(super) fn firmware(&self, robot: usize) -> FirmwareLayout {
        let robots = match &self.bus {
            Bus::Closed | Bus::Direct(_) | Bus::EnipSim(_) | Bus::Enip(_) => {
                return FirmwareLayout::default();
            }
            Bus::EthercatSim(segment) => segment.robots(),
            #[cfg(target_os = "linux")]
            Bus::Ethercat(segment, _) => segment.robots(),
        };
        robots.get(robot).map_or(FirmwareLayout::default(), |robot| robot.inputs.firmware())
    }

    /// What the frames were like, and how long a cycle waits for them; `None` but on EtherCAT.
    pub(super) fn figures(&self) -> Option<(&SegmentStatistics, FrameCounters, Duration)> {
        match &self.bus {
            Bus::Closed | Bus::Direct(_) | Bus::EnipSim(_) | Bus::Enip(_) => None,
            Bus::EthercatSim(segment) => Some(figures_of(segment)),
            #[cfg(target_os = "linux")]
            Bus::Ethercat(segment, _) => Some(figures_of(segment)),
        }
    }

    /// The period of the cycles, where the robots decide it.
    pub(super) fn period(&self) -> Option<Duration> {
        match &self.bus {
            Bus::EnipSim(enip) => Some(enip.segment.cycle()),
            Bus::Enip(enip) => Some(enip.segment.cycle()),
            _ => None,
        }
    }

    /// What the connection of a robot was like; `None` but on EtherNet/IP.
    pub(super) fn enip_report(&self, robot: usize) -> Option<ReportedEnip> {
        match &self.bus {
            Bus::EnipSim(enip) => enip.report(robot),
            Bus::Enip(enip) => enip.report(robot),
            _ => None,
        }
    }

    /// Leaves the bus: the robots are asked for INIT, or their connections are closed.
    pub(super) fn close(&mut self) {
        match core::mem::replace(&mut self.bus, Bus::Closed) {
            Bus::Closed | Bus::Direct(_) => {}
            Bus::EthercatSim(segment) => drop(segment.close()),
            #[cfg(target_os = "linux")]
            Bus::Ethercat(segment, _) => drop(segment.close()),
            Bus::EnipSim(enip) => drop(enip.segment.close()),
            Bus::Enip(enip) => drop(enip.segment.close()),
        }
    }
}

fn figures_of<W: Wire>(
    segment: &EthercatSegment<W>,
) -> (&SegmentStatistics, FrameCounters, Duration) {
    (segment.statistics(), segment.frames(), segment.settings().reply_limit)
}

/// One exchange, and its events told.
fn exchange<W: Wire>(
    segment: &mut EthercatSegment<W>,
    watcher: Option<&LinkWatcher>,
    now: Instant,
) -> Result<(), EthercatError> {
    let exchanged = segment.exchange(now);
    while let Some(event) = segment.poll_event() {
        if let Some(watcher) = watcher {
            watcher.tell(event);
        }
    }
    exchanged
}

impl CyclicSegment for Segment {
    type Error = LinkMessage;

    fn robot_count(&self) -> usize {
        match &self.bus {
            Bus::Closed => 0,
            Bus::Direct(segment) => segment.robot_count(),
            Bus::EthercatSim(segment) => segment.robot_count(),
            #[cfg(target_os = "linux")]
            Bus::Ethercat(segment, _) => segment.robot_count(),
            Bus::EnipSim(enip) => enip.segment.robot_count(),
            Bus::Enip(enip) => enip.segment.robot_count(),
        }
    }

    fn write_outputs(&mut self, robot: usize, outputs: &[u8]) {
        match &mut self.bus {
            Bus::Closed => {}
            Bus::Direct(segment) => segment.write_outputs(robot, outputs),
            Bus::EthercatSim(segment) => segment.write_outputs(robot, outputs),
            #[cfg(target_os = "linux")]
            Bus::Ethercat(segment, _) => segment.write_outputs(robot, outputs),
            Bus::EnipSim(enip) => enip.segment.write_outputs(robot, outputs),
            Bus::Enip(enip) => enip.segment.write_outputs(robot, outputs),
        }
    }

    fn exchange(&mut self, now: Instant) -> Result<(), LinkMessage> {
        let watcher = self.watcher.as_ref();
        match &mut self.bus {
            Bus::Closed => Ok(()),
            Bus::Direct(segment) => {
                segment.exchange(now).map_err(|error: Infallible| match error {})
            }
            Bus::EthercatSim(segment) => {
                exchange(segment, watcher, now).map_err(|e| LinkMessage::of(&e))
            }
            #[cfg(target_os = "linux")]
            Bus::Ethercat(segment, interface) => {
                exchange(segment, watcher, now).map_err(|e| LinkMessage::of(&e))?;
                segment.check_interface().map_err(|error| {
                    let gone = format_args!("network interface {interface} was removed: {error}");
                    LinkMessage::of(&gone)
                })
            }
            Bus::EnipSim(enip) => enip.exchange(watcher, now).map_err(|e| LinkMessage::of(&e)),
            Bus::Enip(enip) => enip.exchange(watcher, now).map_err(|e| LinkMessage::of(&e)),
        }
    }

    fn read_inputs(&self, robot: usize, inputs: &mut [u8]) -> InputQuality {
        match &self.bus {
            Bus::Closed => InputQuality::Lost,
            Bus::Direct(segment) => segment.read_inputs(robot, inputs),
            Bus::EthercatSim(segment) => segment.read_inputs(robot, inputs),
            #[cfg(target_os = "linux")]
            Bus::Ethercat(segment, _) => segment.read_inputs(robot, inputs),
            Bus::EnipSim(enip) => enip.segment.read_inputs(robot, inputs),
            Bus::Enip(enip) => enip.segment.read_inputs(robot, inputs),
        }
    }

    fn nudge_ns(&self) -> i64 {
        match &self.bus {
            Bus::Closed | Bus::Direct(_) => 0,
            Bus::EnipSim(enip) => enip.segment.nudge_ns(),
            Bus::Enip(enip) => enip.segment.nudge_ns(),
            Bus::EthercatSim(segment) => segment.nudge_ns(),
            #[cfg(target_os = "linux")]
            Bus::Ethercat(segment, _) => segment.nudge_ns(),
        }
    }

    fn makes_up(&self) -> u32 {
        match &self.bus {
            Bus::Closed => 0,
            Bus::Direct(segment) => segment.makes_up(),
            Bus::EnipSim(enip) => enip.segment.makes_up(),
            Bus::Enip(enip) => enip.segment.makes_up(),
            Bus::EthercatSim(segment) => segment.makes_up(),
            #[cfg(target_os = "linux")]
            Bus::Ethercat(segment, _) => segment.makes_up(),
        }
    }
}
