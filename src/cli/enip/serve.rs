//! `fieldarm sim --enip`: virtual robots as EtherNet/IP adapters, a single one with its TCP ports beside.

use core::net::Ipv4Addr;
use std::prelude::v1::*;
use std::sync::atomic::Ordering;

use super::robots::{FIRST_SERIAL, Presentation, served};
use super::words;
use crate::cli::exit::{Exit, Failure};
use crate::cli::run_program::catch_interrupts;
use crate::cli::sim::{Power, Teller};
use crate::cli::text::serve::TextFace;
use crate::cli::wording::counted;
use crate::link::enip::serve::{BindError, Ports, Server};
use crate::link::enip::served::ServedRobot;
use crate::sim::meca500::{CyclicBus, RobotSettings, VirtualRobot};
use crate::time::Duration;
use crate::wire::enip::{IO_PORT, MESSAGE_PORT};

/// Which robots to serve, and how.
pub(in crate::cli) struct Served {
    /// Where the first one is reached; the others at the addresses behind it.
    pub(in crate::cli) first: Ipv4Addr,
    pub(in crate::cli) count: u16,
    /// What all of them are like; the bus and the serial number are filled in.
    pub(in crate::cli) robot: RobotSettings,
    pub(in crate::cli) min_rpi: Duration,
    pub(in crate::cli) monitoring_only: bool,
    pub(in crate::cli) power_cycle_after: Option<Duration>,
    /// The TCP ports of the first robot.
    pub(in crate::cli) text: Option<TextFace>,
    pub(in crate::cli) teller: Teller,
}

impl Served {
    /// The robots and their addresses.
    fn server(&self) -> Result<Server<VirtualRobot>, Failure> {
        let mut robots = Vec::new();
        for number in 0..u32::from(self.count) {
            let Some(address) = self.first.to_bits().checked_add(number) else {
                return Err(Failure::usage(format!(
                    "--enip {}: behind it there are no {} addresses; begin at a lower one",
                    self.first, self.count
                )));
            };
            let (address, serial) = (Ipv4Addr::from_bits(address), FIRST_SERIAL + number);
            let robot = VirtualRobot::new(RobotSettings {
                serial_number: serial,
                bus: CyclicBus::EtherNetIp,
                ..self.robot.clone()
            });
            let presentation = Presentation {
                serial,
                layout: self.robot.layout,
                min_rpi: self.min_rpi,
                monitoring_only: self.monitoring_only,
            };
            robots.push((address, served(robot, address, presentation)));
        }
        Server::bind(robots, Ports::default()).map_err(refused)
    }

    /// What is served, for a person.
    fn announcement(&self) -> String {
        let Self { first, count, robot, min_rpi, monitoring_only, .. } = self;
        let at = match count {
            1 => first.to_string(),
            _ => format!(
                "{first} to {}",
                Ipv4Addr::from_bits(first.to_bits().saturating_add(u32::from(count - 1)))
            ),
        };
        let access = if *monitoring_only { ", for monitoring only" } else { "" };
        let text = match &self.text {
            Some(text) => format!("; and on {}", text.whereabouts()),
            None => String::new(),
        };
        format!(
            "serving {count} virtual Meca500 on EtherNet/IP at {at} (TCP and UDP {MESSAGE_PORT}, UDP \
             {IO_PORT}): byte order {}, frames every {} or less often{access}{text}; Ctrl-C ends it",
            robot.byte_order,
            words::ms(*min_rpi)
        )
    }

    /// Serves until interrupted.
    pub(in crate::cli) fn run(mut self) -> Result<Exit, Failure> {
        let mut server = self.server()?;
        let interrupted = catch_interrupts()?;
        let teller = self.teller;
        let mut power = Power::cut_at(self.power_cycle_after.map(|after| server.now() + after));
        let count = self.count;
        let label = |robot: usize| match count {
            1 => String::new(),
            _ => format!("robot {}: ", robot + 1),
        };
        let mut are_on_bus: Vec<bool> = server.robots().map(ServedRobot::is_on_bus).collect();
        teller.say(self.announcement());
        while !interrupted.load(Ordering::Relaxed) {
            server.step().map_err(|error| {
                Failure::link(format!("--enip {}: the sockets fail: {error}", self.first))
            })?;
            while let Some((robot, event)) = server.next_event() {
                teller.say(format_args!("{}{}", label(robot), words::adapter_event(&event)));
            }
            for (robot, (served, was_on_bus)) in server.robots().zip(&mut are_on_bus).enumerate() {
                if served.is_on_bus() != *was_on_bus {
                    *was_on_bus = served.is_on_bus();
                    teller.say(format_args!(
                        "{}{}",
                        label(robot),
                        match served.is_on_bus() {
                            true => "is back on the bus",
                            false => "has left the bus; its connections are gone",
                        }
                    ));
                }
            }
            let now = server.now();
            if let (Some(text), Some(served)) = (&mut self.text, server.robots_mut().next()) {
                text.serve_beside(now, served);
            }
            let devices = server.robots_mut().map(|robot| robot.device_mut());
            power.supply(now, false, devices, teller);
        }
        let counts = server.counts();
        teller.say(format_args!(
            "{} received, {} sent, {} not sent",
            counted(counts.received, "datagram"),
            counts.sent,
            counts.unsent
        ));
        if let Some(text) = &self.text {
            teller.say(text.totals());
        }
        Ok(Exit::Done)
    }
}

/// An address that this machine does not have is a mistake of the command line, the rest is the
/// link's.
fn refused(error: BindError) -> Failure {
    let message = format!("--enip: {error}");
    match error {
        BindError::Twice { .. } => Failure::usage(message),
        BindError::Socket { cause, .. } if cause.kind() == std::io::ErrorKind::AddrNotAvailable => {
            Failure::usage(message)
        }
        BindError::Socket { .. } | BindError::Wait { .. } => Failure::link(message),
    }
}
