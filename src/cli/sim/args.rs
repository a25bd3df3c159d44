//! What can be said about the robots that are served, and where.

use core::net::Ipv4Addr;
use std::prelude::v1::*;

use clap::{ArgGroup, Args, ValueEnum};

use super::operator::OperatorArgs;
use crate::cli::exit::Failure;
use crate::cli::order::OrderName;
use crate::cli::run_program::RevisionName;
use crate::cli::text::place::Place;
use crate::cli::virtual_robot::ToolName;
use crate::link::ethercat::faulty_wire::{FaultPlan, WireFault};
use crate::time::Duration;
use crate::wire::meca500::image::FirmwareLayout;

/// Chance of a fault when none is given, in 1/1000.
const PER_MILLE: u16 = 5;

/// Exit codes of this command, where they mean something of their own.
const EXIT_CODES: &str = "\
Exit codes:
    0  ended with Ctrl-C, the key q, `quit` of a scenario, or the signal TERM or HUP: the ways it is meant to end
    1  a file cannot be read or written, or an internal error
    2  bad usage, a mistake in a scenario or in kept state, no such network interface, or no such address of this machine
    4  the interface cannot be opened, or was removed; a port is in use by somebody else
  130  ended by a second signal, without the figures";

/// Serve virtual robots on a network interface and at IP addresses until Ctrl-C.
///
/// Any of --ethercat, --enip and --tcp may be given together: each robot is one robot on all of them.
///
/// With --enip, any EtherNet/IP scanner can open connections to them: each answers at an address of its
/// own, from ListIdentity to class 1 frames. Nothing but the address is needed; on Linux every address of
/// 127.0.0.0/8 is there for tests on one machine. Standard error says who connects, and how it ends.
///
/// With --tcp, they answer on their control ports 10000 and their monitoring ports 10001 to whoever speaks
/// the robot's text commands, the vendor's Python package among them. With --enip beside it, whoever controls
/// a robot over one is alone in that until the connection ends; others may watch.
///
/// With --ethercat, any EtherCAT main device can bring them to OP: they answer as robots of their own, each with its
/// ESC, mailbox and process data. The first robot is the one next to the main device. Standard error
/// says what is served and each change of a robot's state. That
/// needs the capability CAP_NET_RAW: run as root, or grant it to the executable. Without a second
/// machine, a pair of virtual interfaces (`ip link add ecat0 type veth peer name ecat1`) does.
///
/// EtherCAT is exclusive, as the manual has it: a robot in EtherCAT mode has closed its TCP and EtherNet/IP
/// ports, and one in TCP/IP mode is not in the EtherCAT line, nor are those behind it. SwitchToEtherCat over
/// TCP leads from the one to the other, the bit DisableEtherCAT over EtherCAT leads back; --mode says where
/// they begin.
///
/// In a terminal a line below shows how each robot is, and keys press its E-Stop, pull its cable and more:
/// the key h lists them. --scenario does the same at given times.
#[derive(Args, Debug)]
#[command(after_help = EXIT_CODES, after_long_help = EXIT_CODES)]
#[command(group(ArgGroup::new("bus").required(true).multiple(true).args(["ethercat", "enip", "tcp"])))]
pub(in crate::cli) struct SimArgs {
    /// Network interface to serve on; nothing else should use it.
    #[arg(long, value_name = "IFACE")]
    pub(super) ethercat: Option<String>,
    /// Address of this machine to serve EtherNet/IP at; further robots stand at the addresses behind it.
    #[arg(long, value_name = "ADDR", value_parser = parse_address)]
    pub(super) enip: Option<Ipv4Addr>,
    /// Address of this machine with the robot's control port, 10000 unless it is given as ADDR:PORT;
    /// further robots stand at the addresses behind it, with the same ports.
    #[arg(long, value_name = "ADDR")]
    pub(super) tcp: Option<Place>,
    /// Address of its monitoring port; that of --tcp and 10001 without it.
    #[arg(long, value_name = "ADDR", requires = "tcp")]
    pub(super) monitor: Option<Place>,
    /// With --ethercat: the mode in which the robots were left and boot; ethercat without it, or tcp where
    /// --tcp or --enip is given too.
    #[arg(long, value_enum, requires = "ethercat")]
    pub(super) mode: Option<ModeName>,
    /// Number of robots in a row.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64))]
    pub(super) robots: u16,
    /// Byte order of the images.
    #[arg(long, value_enum, default_value_t = OrderName::Little, value_name = "ORDER")]
    pub(super) byte_order: OrderName,
    /// Hardware revision of the robots.
    #[arg(long, value_enum, default_value_t = RevisionName::R3, ignore_case = true)]
    pub(super) revision: RevisionName,
    /// Tool on their flanges.
    #[arg(long, value_enum, default_value_t = ToolName::Megp25e, value_name = "TOOL")]
    pub(super) tool: ToolName,
    /// Firmware whose process image they have.
    #[arg(long, value_enum, default_value_t = LayoutName::V11_3, value_name = "FIRMWARE")]
    pub(super) layout: LayoutName,
    /// EtherNet/IP: shortest interval of frames that the robots accept, in ms, 0.1 to 1000; 10 without it,
    /// as a real one has it.
    #[arg(long, value_name = "MS", value_parser = parse_min_rpi, requires = "enip")]
    pub(super) min_rpi_ms: Option<Duration>,
    /// EtherNet/IP: nobody may control the robots, as after EnableEtherNetIp(2).
    #[arg(long, requires = "enip")]
    pub(super) monitoring_only: bool,
    /// EtherCAT: leave a PDO unassigned at power-up, e.g. 1A08; a real robot was seen without that one.
    #[arg(long, value_name = "PDO", value_delimiter = ',', value_parser = parse_pdo, requires = "ethercat")]
    pub(super) unassigned: Vec<u16>,
    /// EtherCAT: refuse SAFE-OP until the main device has written the PDO assignment, as users report.
    #[arg(long, requires = "ethercat")]
    pub(super) demand_assignment: bool,
    /// EtherCAT: robots without distributed clocks.
    #[arg(long, requires = "ethercat")]
    pub(super) no_dc: bool,
    /// EtherCAT: list the PDOs in the SII too, which real robots do not.
    #[arg(long, requires = "ethercat")]
    pub(super) sii_pdos: bool,
    /// EtherCAT: alias addresses, one for each robot from the first on.
    #[arg(long, value_name = "ALIAS", value_delimiter = ',', requires = "ethercat")]
    pub(super) alias: Vec<u16>,
    /// EtherCAT: a fault of the wire, its chance for each frame in 1/1000, and a seed: drop, duplicate, delay,
    /// reorder, truncate, corrupt, link-down, power-cycle, or all. May be given several times; the
    /// last seed counts.
    #[arg(long, value_name = "KIND[:PER_MILLE[:SEED]]", value_delimiter = ',', value_parser = parse_fault, requires = "ethercat")]
    pub(super) fault: Vec<FaultArg>,
    /// Cut the power of all robots once, this many seconds after the beginning.
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..))]
    pub(super) power_cycle_after: Option<u64>,
    #[command(flatten)]
    pub(super) operator: OperatorArgs,
    /// Say nothing on standard error unless something goes wrong: no status line, no keys.
    #[arg(long, short)]
    pub(super) quiet: bool,
}

/// Which protocols a robot begins with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum ModeName {
    /// EtherCAT and nothing else.
    Ethercat,
    /// TCP/IP: the text interface and EtherNet/IP.
    Tcp,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum LayoutName {
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
pub(super) struct FaultArg {
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

pub(in crate::cli) fn parse_pdo(text: &str) -> Result<u16, String> {
    let digits = text.trim_start_matches("0x").trim_end_matches(['h', 'H']);
    u16::from_str_radix(digits, 16)
        .map_err(|_| format!("a PDO is a hexadecimal number as 1A08, given `{text}`"))
}

impl SimArgs {
    /// The faults of the wire.
    pub(super) fn fault_plan(&self) -> FaultPlan {
        let chances = self
            .fault
            .iter()
            .flat_map(|argument| argument.faults.iter().map(|fault| (*fault, argument.per_mille)))
            .collect();
        let seed = self.fault.iter().rev().find_map(|argument| argument.seed).unwrap_or(0);
        FaultPlan { chances, seed, limit: None }
    }

    /// The mode in which the robots boot.
    ///
    /// Source: PM L1689: a robot boots in the mode it was left in. Which that is, is a choice.
    pub(super) fn mode(&self) -> ModeName {
        let has_ip = self.tcp.is_some() || self.enip.is_some();
        let usual = match self.ethercat {
            Some(_) if !has_ip => ModeName::Ethercat,
            _ => ModeName::Tcp,
        };
        self.mode.unwrap_or(usual)
    }

    /// The mode in which a robot boots that was left in `left`: that one, if it is served and the
    /// command line asks for no other.
    pub(super) fn mode_when_left_in(&self, left: ModeName) -> ModeName {
        let is_served = match left {
            ModeName::Ethercat => self.ethercat.is_some(),
            ModeName::Tcp => self.tcp.is_some() || self.enip.is_some(),
        };
        if self.mode.is_none() && is_served { left } else { self.mode() }
    }

    /// Refuses what the options of each other rule out.
    pub(super) fn check(&self) -> Result<(), Failure> {
        if self.mode() == ModeName::Tcp && self.tcp.is_none() && self.enip.is_none() {
            return Err(Failure::usage(
                "--mode tcp: nothing is served in this mode; give --tcp ADDR or --enip ADDR too",
            ));
        }
        Ok(())
    }
}

fn parse_address(text: &str) -> Result<Ipv4Addr, String> {
    text.parse().map_err(|_| {
        "an IPv4 address of this machine, as `ip addr` lists them, or one of 127.0.0.0/8".into()
    })
}

/// As `10` or `0.5`.
fn parse_min_rpi(text: &str) -> Result<Duration, String> {
    match text.parse::<f64>() {
        Ok(ms) if (0.1..=1_000.0).contains(&ms) => {
            Ok(Duration::from_micros((ms * 1e3).round() as u64))
        }
        _ => Err("an interval in ms, 0.1 to 1000".into()),
    }
}
