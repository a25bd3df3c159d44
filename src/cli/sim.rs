//! `fieldarm sim`: virtual robots on a real bus; those on EtherNet/IP are in `enip/serve.rs`, the one at
//! its TCP ports is in `text/serve.rs`.

use core::net::Ipv4Addr;
use std::io::Write;
use std::prelude::v1::*;
use std::sync::atomic::Ordering;

use clap::{ArgGroup, Args, ValueEnum};

use super::emulated_robot::{EmulatedRobot, Presentation, emulated, refuse_unknown_pdos};
use super::enip::serve::Served;
use super::exit::{Exit, Failure};
use super::order::OrderName;
use super::run_program::{RevisionName, catch_interrupts};
use super::text::place::Place;
use super::text::serve::{self, TextFace};
use super::virtual_robot::ToolName;
use super::wording::counted;
use crate::bus::ethercat::meca500::Meca500Settings;
use crate::cycle::CyclicDevice;
use crate::link::ethercat::faulty_wire::{FaultPlan, FaultyWire, WireEnd, WireFault};
use crate::link::ethercat::raw_socket::{self, OpenError, RawSocket};
use crate::link::ethercat::serve::{Change, Server, Standing};
use crate::link::ethercat::wire::Wire;
use crate::sim::meca500::{CyclicBus, FieldbusMode, NetworkSettings, RobotSettings, VirtualRobot};
use crate::time::{Duration, Instant};
use crate::wire::meca500::adapter::MIN_RPI_US;
use crate::wire::meca500::image::FirmwareLayout;
use crate::wire::meca500::image::pdo::PdoLayout;
use crate::wire::order::ByteOrder;

/// How long robots stay without power before they boot.
const POWER_OFF: Duration = Duration::from_millis(500);
/// Chance of a fault when none is given, in 1/1000.
const PER_MILLE: u16 = 5;
/// Serial number of the first robot; those behind it count up.
const FIRST_SERIAL: u32 = 87_654_321;

/// Exit codes of this command, where they mean something of their own.
const EXIT_CODES: &str = "\
Exit codes:
    0  ended with Ctrl-C, or by the signal TERM or HUP: the way it is meant to end
    1  an internal error
    2  bad usage, no such network interface, or no such address of this machine
    4  the interface cannot be opened, or was removed; a port is in use by somebody else
  130  ended by a second signal, without the figures";

/// Serve virtual robots on a network interface or at IP addresses until Ctrl-C.
///
/// With --enip, any EtherNet/IP scanner can open connections to them: each answers at an address of its
/// own, from ListIdentity to class 1 frames. Nothing but the address is needed; on Linux every address of
/// 127.0.0.0/8 is there for tests on one machine. Standard error says who connects, and how it ends.
///
/// With --tcp, one robot answers on its control port 10000 and its monitoring port 10001 to whoever speaks
/// its text commands, the vendor's Python package among them. With --enip beside it, the same robot is on
/// both: whoever controls it over one is alone in that until the connection ends, others may watch.
///
/// With --ethercat, any EtherCAT main device can bring them to OP: they answer as robots of their own, each with its
/// ESC, mailbox and process data. The first robot is the one next to the main device. Standard error
/// says what is served and each change of a robot's state. That
/// needs the capability CAP_NET_RAW: run as root, or grant it to the executable. Without a second
/// machine, a pair of virtual interfaces (`ip link add ecat0 type veth peer name ecat1`) does.
#[derive(Args, Debug)]
#[command(after_help = EXIT_CODES, after_long_help = EXIT_CODES)]
#[command(group(ArgGroup::new("bus").required(true).multiple(true).args(["ethercat", "enip", "tcp"])))]
pub(super) struct SimArgs {
    /// Network interface to serve on; nothing else should use it.
    #[arg(long, value_name = "IFACE", conflicts_with_all = ["enip", "tcp"])]
    ethercat: Option<String>,
    /// Address of this machine to serve at; further robots stand at the addresses behind it.
    #[arg(long, value_name = "ADDR", value_parser = parse_address)]
    enip: Option<Ipv4Addr>,
    /// Address of this machine with the robot's control port, 10000 unless it is given as ADDR:PORT.
    #[arg(long, value_name = "ADDR")]
    tcp: Option<Place>,
    /// Address of its monitoring port; that of --tcp and 10001 without it.
    #[arg(long, value_name = "ADDR", requires = "tcp")]
    monitor: Option<Place>,
    /// Number of robots in a row.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64))]
    robots: u16,
    /// Byte order of the images.
    #[arg(long, value_enum, default_value_t = OrderName::Little, value_name = "ORDER")]
    byte_order: OrderName,
    /// Hardware revision of the robots.
    #[arg(long, value_enum, default_value_t = RevisionName::R3, ignore_case = true)]
    revision: RevisionName,
    /// Tool on their flanges.
    #[arg(long, value_enum, default_value_t = ToolName::Megp25e, value_name = "TOOL")]
    tool: ToolName,
    /// Firmware whose process image they have.
    #[arg(long, value_enum, default_value_t = LayoutName::V11_3, value_name = "FIRMWARE")]
    layout: LayoutName,
    /// EtherNet/IP: shortest interval of frames that the robots accept, in ms, 0.1 to 1000; 10 without it,
    /// as a real one has it.
    #[arg(long, value_name = "MS", value_parser = parse_min_rpi, conflicts_with = "ethercat", requires = "enip")]
    min_rpi_ms: Option<Duration>,
    /// EtherNet/IP: nobody may control the robots, as after EnableEtherNetIp(2).
    #[arg(long, conflicts_with = "ethercat", requires = "enip")]
    monitoring_only: bool,
    /// EtherCAT: leave a PDO unassigned at power-up, e.g. 1A08; a real robot was seen without that one.
    #[arg(long, value_name = "PDO", value_delimiter = ',', value_parser = parse_pdo, conflicts_with_all = ["enip", "tcp"])]
    unassigned: Vec<u16>,
    /// EtherCAT: refuse SAFE-OP until the main device has written the PDO assignment, as users report.
    #[arg(long, conflicts_with_all = ["enip", "tcp"])]
    demand_assignment: bool,
    /// EtherCAT: robots without distributed clocks.
    #[arg(long, conflicts_with_all = ["enip", "tcp"])]
    no_dc: bool,
    /// EtherCAT: list the PDOs in the SII too, which real robots do not.
    #[arg(long, conflicts_with_all = ["enip", "tcp"])]
    sii_pdos: bool,
    /// EtherCAT: alias addresses, one for each robot from the first on.
    #[arg(long, value_name = "ALIAS", value_delimiter = ',', conflicts_with_all = ["enip", "tcp"])]
    alias: Vec<u16>,
    /// EtherCAT: a fault of the wire, its chance for each frame in 1/1000, and a seed: drop, duplicate, delay,
    /// reorder, truncate, corrupt, link-down, power-cycle, or all. May be given several times; the
    /// last seed counts.
    #[arg(long, value_name = "KIND[:PER_MILLE[:SEED]]", value_delimiter = ',', value_parser = parse_fault, conflicts_with_all = ["enip", "tcp"])]
    fault: Vec<FaultArg>,
    /// Cut the power of all robots once, this many seconds after the beginning.
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..))]
    power_cycle_after: Option<u64>,
    /// Say nothing on standard error unless something goes wrong.
    #[arg(long, short)]
    quiet: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum LayoutName {
    /// Firmware 11.3, the programming manual.
    #[value(name = "11.3")]
    V11_3,
    /// Firmware 10.2.
    #[value(name = "10.2")]
    V10_2,
}

impl From<LayoutName> for FirmwareLayout {
    fn from(name: LayoutName) -> Self {
        match name {
            LayoutName::V11_3 => Self::V11_3,
            LayoutName::V10_2 => Self::V10_2,
        }
    }
}

/// One `--fault`.
#[derive(Clone, Debug, PartialEq, Eq)]
struct FaultArg {
    faults: Vec<WireFault>,
    per_mille: u16,
    seed: Option<u64>,
}

fn parse_fault(text: &str) -> Result<FaultArg, String> {
    let mut parts = text.splitn(3, ':');
    let name = parts.next().unwrap_or_default();
    let faults = match WireFault::from_name(name) {
        Some(fault) => vec![fault],
        None if name == "all" => WireFault::ALL.to_vec(),
        None => {
            let names: Vec<_> = WireFault::ALL.iter().map(|fault| fault.name()).collect();
            return Err(format!("no fault `{name}`; there are {} and all", names.join(", ")));
        }
    };
    let per_mille = match parts.next() {
        None => PER_MILLE,
        Some(text) => text
            .parse()
            .ok()
            .filter(|chance| *chance <= 1000)
            .ok_or_else(|| format!("a chance is 0 to 1000 in 1/1000, given `{text}`"))?,
    };
    let seed = parts.next().map(|text| text.parse().map_err(|_| format!("no seed: `{text}`")));
    Ok(FaultArg { faults, per_mille, seed: seed.transpose()? })
}

pub(super) fn parse_pdo(text: &str) -> Result<u16, String> {
    let digits = text.trim_start_matches("0x").trim_end_matches(['h', 'H']);
    u16::from_str_radix(digits, 16)
        .map_err(|_| format!("a PDO is a hexadecimal number as 1A08, given `{text}`"))
}

fn plan(arguments: &[FaultArg]) -> FaultPlan {
    let chances = arguments
        .iter()
        .flat_map(|argument| argument.faults.iter().map(|fault| (*fault, argument.per_mille)))
        .collect();
    let seed = arguments.iter().rev().find_map(|argument| argument.seed).unwrap_or(0);
    FaultPlan { chances, seed, limit: None }
}

/// The robots in a row, as the command line wants them.
fn line(args: &SimArgs) -> Result<Vec<EmulatedRobot>, Failure> {
    if args.alias.len() > usize::from(args.robots) {
        return Err(Failure::usage(format!(
            "--alias: {} aliases for {}: give at most one each",
            args.alias.len(),
            counted(args.robots, "robot")
        )));
    }
    for (number, alias) in args.alias.iter().enumerate() {
        // 0 is none, and any number of robots may have none.
        let mut before = args.alias.iter().take(number);
        if *alias != 0 && before.any(|other| other == alias) {
            return Err(Failure::usage(format!(
                "--alias: {alias} is given twice; an alias names one robot, only 0 (none) may come again"
            )));
        }
    }
    let layout = FirmwareLayout::from(args.layout);
    refuse_unknown_pdos("--unassigned", &args.unassigned, &[PdoLayout::from(layout)])?;
    // The process lives as long as its robots.
    let unassigned: &'static [u16] = args.unassigned.clone().leak();
    (0..args.robots)
        .map(|number| {
            let serial = FIRST_SERIAL + u32::from(number);
            let robot = VirtualRobot::new(RobotSettings {
                serial_number: serial,
                bus: CyclicBus::EtherCat,
                ..robot_settings(args)
            });
            let settings = Meca500Settings {
                serial,
                layout: PdoLayout::from(layout),
                hardware_version: match args.revision {
                    RevisionName::R3 => "R3",
                    RevisionName::R4 => "R4",
                },
                software_version: match layout {
                    FirmwareLayout::V11_3 => "11.3.84",
                    FirmwareLayout::V10_2 => "10.2",
                },
                unassigned_at_power_up: unassigned,
                assignment_must_be_written: args.demand_assignment,
            };
            let presentation = Presentation {
                alias: args.alias.get(usize::from(number)).copied().unwrap_or(0),
                distributed_clock: !args.no_dc,
                pdos_in_sii: args.sii_pdos,
            };
            emulated(robot, settings, presentation)
        })
        .collect()
}

/// As `10` or `0.5`.
fn parse_address(text: &str) -> Result<Ipv4Addr, String> {
    text.parse().map_err(|_| {
        "an IPv4 address of this machine, as `ip addr` lists them, or one of 127.0.0.0/8".into()
    })
}

fn parse_min_rpi(text: &str) -> Result<Duration, String> {
    match text.parse::<f64>() {
        Ok(ms) if (0.1..=1_000.0).contains(&ms) => {
            Ok(Duration::from_micros((ms * 1e3).round() as u64))
        }
        _ => Err("an interval in ms, 0.1 to 1000".into()),
    }
}

/// Says things on standard error, if anybody wants to hear them.
#[derive(Clone, Copy)]
pub(super) struct Teller {
    quiet: bool,
}

impl Teller {
    pub(super) fn say(self, message: impl core::fmt::Display) {
        if !self.quiet {
            // Nobody reads standard error any more: the robots are served on.
            let _ = writeln!(std::io::stderr(), "{message}");
        }
    }

    fn tell(self, change: Change) {
        let Change { device, before, after } = change;
        if before.is_on_bus != after.is_on_bus {
            let place = if after.is_on_bus { "is back on the bus" } else { "has left the bus" };
            self.say(format_args!("position {device}: {place}"));
        }
        let shown = |standing: Standing| (standing.state, standing.error);
        if shown(before) != shown(after) {
            let (from, to) = (before.state, after.state);
            match after.error {
                Some(error) => self.say(format_args!("position {device}: {from} -> {to}, {error}")),
                None if from == to => {
                    self.say(format_args!("position {device}: {to}, error acknowledged"));
                }
                None => self.say(format_args!("position {device}: {from} -> {to}")),
            }
        }
    }
}

/// The robots' power supply.
pub(super) struct Power {
    cut_at: Option<Instant>,
    back_at: Option<Instant>,
    /// Which robots have not been reset since their power came back.
    waits_for_reset: Vec<bool>,
}

impl Power {
    /// Power that is cut once at a time, or never.
    pub(super) const fn cut_at(cut_at: Option<Instant>) -> Self {
        Self { cut_at, back_at: None, waits_for_reset: Vec::new() }
    }

    /// Switches the robots when it is time to, or when `is_cut` says so.
    pub(super) fn supply<'r>(
        &mut self,
        now: Instant,
        is_cut: bool,
        robots: impl ExactSizeIterator<Item = &'r mut VirtualRobot>,
        teller: Teller,
    ) {
        let is_cut = is_cut || self.cut_at.is_some_and(|at| at <= now);
        if is_cut {
            self.cut_at = None;
            self.back_at = Some(now + POWER_OFF);
            teller.say("power cut");
        }
        let is_back = self.back_at.is_some_and(|at| at <= now);
        if is_back {
            self.back_at = None;
            teller.say("power back: the robots boot");
            self.waits_for_reset = vec![true; robots.len()];
        }
        for (number, robot) in robots.enumerate() {
            if is_cut {
                robot.panel().switch_off();
            }
            if is_back {
                robot.panel().switch_on();
            }
            // Somebody at the cell presses Reset as soon as a robot has booted: without that its motors
            // get no power.
            if let Some(waits) = self.waits_for_reset.get_mut(number)
                && *waits
                && robot.is_on_bus()
            {
                *waits = false;
                robot.panel().press_reset();
            }
        }
    }
}

/// Serves until interrupted.
pub(super) fn run(args: &SimArgs) -> Result<Exit, Failure> {
    if let Some(interface) = &args.ethercat {
        return run_ethercat(args, interface);
    }
    let teller = Teller { quiet: args.quiet };
    let power_cycle_after = args.power_cycle_after.map(Duration::from_secs);
    let text = text_face(args, teller)?;
    match (args.enip, text) {
        (None, Some(text)) => serve::run(
            text,
            RobotSettings { serial_number: FIRST_SERIAL, ..robot_settings(args) },
            power_cycle_after,
            teller,
        ),
        (Some(first), text) => Served {
            first,
            count: args.robots,
            robot: robot_settings(args),
            min_rpi: args.min_rpi_ms.unwrap_or(Duration::from_micros(MIN_RPI_US.into())),
            monitoring_only: args.monitoring_only,
            power_cycle_after,
            text,
            teller,
        }
        .run(),
        (None, None) => Err(Failure::usage("give --ethercat IFACE, --enip ADDR or --tcp ADDR")),
    }
}

/// The TCP ports, if they are asked for.
fn text_face(args: &SimArgs, teller: Teller) -> Result<Option<TextFace>, Failure> {
    let Some(control) = args.tcp else { return Ok(None) };
    if args.robots > 1 {
        return Err(Failure::usage(format!(
            "--tcp serves one robot, not {}; start a process for each, at addresses of their own",
            args.robots
        )));
    }
    TextFace::open(control, args.monitor, teller).map(Some)
}

/// What all robots are like.
fn robot_settings(args: &SimArgs) -> RobotSettings {
    RobotSettings {
        revision: args.revision.into(),
        byte_order: args.byte_order.into(),
        layout: args.layout.into(),
        tool: args.tool.into(),
        network: NetworkSettings {
            // Whoever serves it has enabled it before.
            ethernet_ip: match args.enip {
                None => FieldbusMode::Disabled,
                Some(_) if args.monitoring_only => FieldbusMode::MonitoringOnly,
                Some(_) => FieldbusMode::Enabled,
            },
            ..NetworkSettings::default()
        },
        ..RobotSettings::default()
    }
}

fn run_ethercat(args: &SimArgs, interface: &str) -> Result<Exit, Failure> {
    let line = line(args)?;
    let socket = RawSocket::open(interface).map_err(refused)?;
    let interrupted = catch_interrupts()?;
    let teller = Teller { quiet: args.quiet };
    let is_down = socket.is_down();
    let cut_at = args.power_cycle_after.map(|s| socket.now() + Duration::from_secs(s));
    let mut power = Power::cut_at(cut_at);
    let wire = FaultyWire::new(socket, WireEnd::Subdevices, plan(&args.fault));
    let mut server = Server::new(wire, line);
    teller.say(format_args!(
        "serving {} virtual Meca500 on {interface}: byte order {}, {} distributed clocks; Ctrl-C ends it",
        args.robots,
        ByteOrder::from(args.byte_order),
        if args.no_dc { "without" } else { "with" },
    ));
    if is_down {
        teller.say(format_args!("{interface} is down; ip link set {interface} up"));
    }
    let mut is_dead = is_down;
    while !interrupted.load(Ordering::Relaxed) {
        let before = server.counts();
        if let Err(error) = server.step() {
            is_dead = true;
            let is_transient = raw_socket::is_transient(&error);
            let message = format!("{interface}: {error}");
            if !is_transient {
                return Err(Failure::link(message));
            }
            teller.say(message);
        } else if is_dead && server.counts() != before {
            is_dead = false;
            teller.say(format_args!("{interface} carries frames again"));
        }
        while let Some(change) = server.next_change() {
            teller.tell(change);
        }
        let now = server.wire().now();
        let is_cut = server.wire_mut().take_power_cycle();
        let robots = server.line_mut().iter_mut();
        let devices = robots.map(|robot| robot.application_mut().device_mut());
        power.supply(now, is_cut, devices, teller);
    }
    let counts = server.counts();
    teller.say(format_args!(
        "{} received, {} returned, {} lost in the line, {} not sent; {} made",
        counted(counts.received, "frame"),
        counts.returned,
        counts.lost,
        counts.unsent,
        counted(server.wire().faults_made(), "fault")
    ));
    Ok(Exit::Done)
}

/// An interface that does not exist is a mistake of the command line, the rest is the link's.
pub(super) fn refused(error: OpenError) -> Failure {
    let message = error.to_string();
    match error {
        OpenError::NoSuchInterface { .. } | OpenError::NotEthernet { .. } => {
            Failure::usage(message)
        }
        OpenError::NotPermitted { .. } | OpenError::System { .. } => Failure::link(message),
    }
}
