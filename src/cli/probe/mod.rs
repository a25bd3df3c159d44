//! `fieldarm probe`: what is on a bus, without acting on a robot. This folder is about EtherCAT, `enip/`
//! about EtherNet/IP.
//!
//! Read `observe.rs` first: what is done on the wire. `report.rs` says what it means, `text.rs`
//! writes it for people.

mod enip;
mod evidence;
mod line;
mod observe;
mod report;
mod text;

use std::prelude::v1::*;
use std::sync::atomic::AtomicBool;

use clap::Args;

use super::ethercat_options::{ReplyLimit, SHORTEST_SYNC0_US, explained};
use super::exit::{Exit, Failure};
use super::grid::{pretty, print};
use super::link_choice::LinkChoice;
use super::run_program::catch_interrupts;
use super::sim::refused;
use crate::link::ethercat::raw_socket::RawSocket;
use crate::link::ethercat::wire::Wire;
use crate::link::ethercat::{Assignment, RobotChoice};
use crate::time::Duration;
use enip::Everybody;
use line::LineArgs;
use observe::{Plan, observe};
use report::report;

/// Time between two exchanges where nobody says another, in microseconds.
const CYCLE_US: u64 = 1_000;
/// Exchanges to make where nobody says how many.
const CYCLES: u32 = 2_000;

/// Exit codes of this command, where they mean something of their own.
const EXIT_CODES: &str = "\
Exit codes:
    0  every Meca500 that was looked at can be driven
    1  an internal error
    2  bad usage, or no such network interface
    3  all can be reached, but a robot has an error, a safety signal, or lets this connection only watch
    4  nothing answers, there is no Meca500, another main device drives the segment, or a robot cannot be
       driven: its layout or OP is refused, or its byte order cannot be decided
  130  interrupted; subdevices on EtherCAT were left in INIT, connections on EtherNet/IP were closed";

/// Look at a bus: who is on it, and whether its robots can be driven.
///
/// EtherCAT: shows each subdevice with its identity and the state it was found in. Of each Meca500: the layout of
/// its process data against our table, the byte order with the evidence for it, firmware version and
/// serial number, its state, and what the exchanges with it are like.
///
/// It changes nothing on a robot: outputs are zero but for the choice of dynamic data, there is no
/// SetPoint and no trigger, and the PDO assignment stays as it is unless --write-assignment is given.
/// The subdevices are reset to INIT at the beginning and left there. A segment that another main device
/// drives is left alone unless --take-over is given.
///
/// EtherNet/IP: enip:broadcast lists who answers ListIdentity. Of the robot at enip:ADDR it shows the
/// identity, which connections it accepts with which intervals, the byte order with the evidence for it,
/// its state and the gaps between its frames. It opens connections that only watch (input-only,
/// listen-only), so nothing moves and an owner is not disturbed; it writes nothing.
#[derive(Args, Debug)]
#[command(after_help = EXIT_CODES, after_long_help = EXIT_CODES)]
pub(super) struct ProbeArgs {
    /// What to look at: ethercat:IFACE, the segment on a network interface; ethercat:IFACE:POSITION, of
    /// its robots only the one at that position, from 0; ethercat-sim, virtual robots in this process;
    /// enip:ADDR[?rpi_ms=..&bind=..], the robot at an address, with the options that `fieldarm run` has;
    /// enip:broadcast[?bind=ADDR&to=ADDR], everybody whom a broadcast reaches.
    #[arg(value_name = "LINK", value_parser = Target::parse)]
    link: Target,
    /// Time between two exchanges, in microseconds: 100 to 100000; 1000 without it. Of EtherCAT: on
    /// EtherNet/IP ask with ?rpi_ms=.
    #[arg(long, value_parser = clap::value_parser!(u64).range(100..=100_000))]
    cycle_us: Option<u64>,
    /// Exchanges to make, or frames to look at on EtherNet/IP: 100 to 1000000; 2000 without it, 300 on
    /// EtherNet/IP.
    #[arg(long, value_parser = clap::value_parser!(u32).range(100..=1_000_000))]
    cycles: Option<u32>,
    /// Use distributed clocks, and show their drift and phase. Cycles of 1000 us and more.
    #[arg(long)]
    clocks: bool,
    #[command(flatten)]
    reply_limit: ReplyLimit,
    /// Write the PDO assignment (1C12h, 1C13h) before reading the layout, as `fieldarm run` does.
    #[arg(long)]
    write_assignment: bool,
    /// Look although another main device drives the segment. It stops its robots.
    #[arg(long)]
    take_over: bool,
    /// JSON instead of text.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    line: LineArgs,
}

/// What to look at.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Target {
    /// What can be driven too.
    Link(LinkChoice),
    /// Everybody on EtherNet/IP.
    Everybody(Everybody),
}

impl Target {
    fn parse(text: &str) -> Result<Self, String> {
        match Everybody::parse(text) {
            Some(everybody) => everybody.map(Self::Everybody),
            None => LinkChoice::parse(text).map(Self::Link),
        }
    }
}

impl ProbeArgs {
    /// The first option about EtherCAT that was given, if one was.
    fn given_for_ethercat(&self) -> Option<&'static str> {
        match self {
            Self { cycle_us: Some(_), .. } => Some("--cycle-us"),
            Self { clocks: true, .. } => Some("--clocks"),
            Self { write_assignment: true, .. } => Some("--write-assignment"),
            Self { take_over: true, .. } => Some("--take-over"),
            Self { reply_limit, .. } if reply_limit.is_given() => Some("--reply-limit-us"),
            Self { line, .. } if line.is_given() => Some("--robots or --sim-..."),
            _ => None,
        }
    }
}

/// Looks and tells.
pub(super) fn run(args: &ProbeArgs) -> Result<Exit, Failure> {
    let refuse_given = || match args.given_for_ethercat() {
        Some(option) => Err(Failure::usage(format!(
            "{option} is about EtherCAT; on EtherNet/IP options stand behind the address, as in \
             enip:192.168.0.100?rpi_ms=10"
        ))),
        None => Ok(()),
    };
    match &args.link {
        Target::Everybody(everybody) => {
            refuse_given()?;
            enip::run_everybody(args, everybody)
        }
        Target::Link(LinkChoice::Enip(name)) => {
            refuse_given()?;
            enip::run_one(args, name)
        }
        Target::Link(link) => run_ethercat(args, link),
    }
}

fn run_ethercat(args: &ProbeArgs, link: &LinkChoice) -> Result<Exit, Failure> {
    let cycle_us = args.cycle_us.unwrap_or(CYCLE_US);
    let robots = match link {
        LinkChoice::Sim => {
            return Err(Failure::usage(
                "sim has no bus to look at; there are ethercat-sim, ethercat:IFACE[:POSITION], enip:ADDR \
                 and enip:broadcast",
            ));
        }
        LinkChoice::EnipSim { .. } | LinkChoice::Enip(_) => {
            return Err(Failure::usage(
                "enip-sim has no addresses to look at: start `fieldarm sim --enip 127.0.0.1`, then probe \
                 enip:127.0.0.1",
            ));
        }
        LinkChoice::Ethercat { position: Some(position), .. } => {
            RobotChoice::These(vec![*position])
        }
        LinkChoice::EthercatSim | LinkChoice::Ethercat { .. } => RobotChoice::All,
    };
    if args.clocks && cycle_us < SHORTEST_SYNC0_US {
        return Err(Failure::usage(format!(
            "--clocks: a robot takes SYNC0 every {SHORTEST_SYNC0_US} us or less often, the cycle is {} us \
             (--cycle-us)",
            cycle_us
        )));
    }
    let cycle = Duration::from_micros(cycle_us);
    let plan = Plan {
        robots,
        assignment: if args.write_assignment { Assignment::Write } else { Assignment::Keep },
        clocks: args.clocks,
        take_over: args.take_over,
        cycle,
        reply_limit: args.reply_limit.of(cycle),
        cycles: args.cycles.unwrap_or(CYCLES),
    };
    match link {
        LinkChoice::Ethercat { interface, .. } => {
            if args.line.is_given() {
                return Err(Failure::usage(
                    "--robots and --sim-... say which virtual robots ethercat-sim has; what stands on \
                     an interface is found out",
                ));
            }
            let socket = RawSocket::open(interface).map_err(refused)?;
            look(args, link, &plan, socket)
        }
        _ => look(args, link, &plan, args.line.wire()?),
    }
}

fn look<W: Wire>(
    args: &ProbeArgs,
    link: &LinkChoice,
    plan: &Plan,
    wire: W,
) -> Result<Exit, Failure> {
    let interrupted = catch_interrupts()?;
    let flag: &AtomicBool = &interrupted;
    // Nothing can be said about the segment.
    let unseen = |error| Failure::link(format!("{}: {}", link, explained(error)));
    let (seen, _) = observe(wire, plan, flag).map_err(unseen)?;
    let (report, exit) = report(link.to_string(), &seen, args.write_assignment);
    if args.json {
        let value = serde_json::to_value(&report);
        print(&pretty(&value.map_err(|error| Failure::internal(error.to_string()))?)?)?;
    } else {
        print(&text::text(&report))?;
    }
    Ok(exit)
}
