//! `fieldarm probe`: what is on an EtherCAT segment, without acting on a robot.
//!
//! Read `observe.rs` first: what is done on the wire. `report.rs` says what it means, `text.rs`
//! writes it for people.

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
use line::LineArgs;
use observe::{Plan, observe};
use report::report;

/// Exit codes of this command, where they mean something of their own.
const EXIT_CODES: &str = "\
Exit codes:
    0  every Meca500 that was looked at can be driven
    1  an internal error
    2  bad usage, or no such network interface
    3  all can be reached, but a robot has an error, a safety signal, or lets this connection only watch
    4  nothing answers, there is no Meca500, another main device drives the segment, or a robot cannot be
       driven: its layout or OP is refused, or its byte order cannot be decided
  130  interrupted; the robots were left in INIT";

/// Look at an EtherCAT segment: who is on it, and whether its robots can be driven.
///
/// Shows each subdevice with its identity and the state it was found in. Of each Meca500: the layout of
/// its process data against our table, the byte order with the evidence for it, firmware version and
/// serial number, its state, and what the exchanges with it are like.
///
/// It changes nothing on a robot: outputs are zero but for the choice of dynamic data, there is no
/// SetPoint and no trigger, and the PDO assignment stays as it is unless --write-assignment is given.
/// The subdevices are reset to INIT at the beginning and left there. A segment that another main device
/// drives is left alone unless --take-over is given.
#[derive(Args, Debug)]
#[command(after_help = EXIT_CODES, after_long_help = EXIT_CODES)]
pub(super) struct ProbeArgs {
    /// What to look at: ethercat:IFACE, the segment on a network interface; ethercat:IFACE:POSITION, of
    /// its robots only the one at that position, from 0; ethercat-sim, virtual robots in this process.
    #[arg(value_name = "LINK", value_parser = LinkChoice::parse)]
    link: LinkChoice,
    /// Time between two exchanges, in microseconds: 100 to 100000.
    #[arg(long, default_value_t = 1_000, value_parser = clap::value_parser!(u64).range(100..=100_000))]
    cycle_us: u64,
    /// Exchanges to make: 100 to 1000000.
    #[arg(long, default_value_t = 2_000, value_parser = clap::value_parser!(u32).range(100..=1_000_000))]
    cycles: u32,
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

/// Looks and tells.
pub(super) fn run(args: &ProbeArgs) -> Result<Exit, Failure> {
    let robots = match &args.link {
        LinkChoice::EnipSim { .. } | LinkChoice::Enip(_) | LinkChoice::Sim => {
            return Err(Failure::usage(
                "sim has no bus to look at; there are ethercat-sim and ethercat:IFACE[:POSITION]",
            ));
        }
        LinkChoice::Ethercat { position: Some(position), .. } => {
            RobotChoice::These(vec![*position])
        }
        LinkChoice::EthercatSim | LinkChoice::Ethercat { .. } => RobotChoice::All,
    };
    if args.clocks && args.cycle_us < SHORTEST_SYNC0_US {
        return Err(Failure::usage(format!(
            "--clocks: a robot takes SYNC0 every {SHORTEST_SYNC0_US} us or less often, the cycle is {} us \
             (--cycle-us)",
            args.cycle_us
        )));
    }
    let cycle = Duration::from_micros(args.cycle_us);
    let plan = Plan {
        robots,
        assignment: if args.write_assignment { Assignment::Write } else { Assignment::Keep },
        clocks: args.clocks,
        take_over: args.take_over,
        cycle,
        reply_limit: args.reply_limit.of(cycle),
        cycles: args.cycles,
    };
    match &args.link {
        LinkChoice::Ethercat { interface, .. } => {
            if args.line.is_given() {
                return Err(Failure::usage(
                    "--robots and --sim-... say which virtual robots ethercat-sim has; what stands on \
                     an interface is found out",
                ));
            }
            let socket = RawSocket::open(interface).map_err(refused)?;
            look(args, &plan, socket)
        }
        _ => look(args, &plan, args.line.wire()?),
    }
}

fn look<W: Wire>(args: &ProbeArgs, plan: &Plan, wire: W) -> Result<Exit, Failure> {
    let interrupted = catch_interrupts()?;
    let flag: &AtomicBool = &interrupted;
    // Nothing can be said about the segment.
    let unseen = |error| Failure::link(format!("{}: {}", args.link, explained(error)));
    let (seen, _) = observe(wire, plan, flag).map_err(unseen)?;
    let (report, exit) = report(args.link.to_string(), &seen, args.write_assignment);
    if args.json {
        let value = serde_json::to_value(&report);
        print(&pretty(&value.map_err(|error| Failure::internal(error.to_string()))?)?)?;
    } else {
        print(&text::text(&report))?;
    }
    Ok(exit)
}
