//! `fieldarm sim --enip`: virtual robots as EtherNet/IP adapters.
//!
//! Read [`EnipFace::settle`] first: it keeps a robot's controllers apart. An owner on EtherNet/IP has the
//! control of the robot as a control connection of the text interface has it, and either is refused
//! while the other is there.

use core::net::Ipv4Addr;
use std::prelude::v1::*;

use super::robots::{Presentation, served};
use super::words;
use crate::bus::enip::adapter::Access;
use crate::cli::exit::Failure;
use crate::cli::sim::labels::Labels;
use crate::cli::sim::shared_robot::{OnEtherNetIp, SharedRobot};
use crate::cli::sim::teller::Teller;
use crate::cli::wording::counted;
use crate::link::clock::MonotonicClock;
use crate::link::enip::serve::{BindError, Ports, Server};
use crate::link::enip::served::ServedRobot;
use crate::link::watch_list::WatchList;
use crate::sim::meca500::{Controller, FieldbusMode};
use crate::time::{Duration, Instant};
use crate::wire::enip::{IO_PORT, MESSAGE_PORT};

/// How robots are served.
#[derive(Clone, Copy, Debug)]
pub(in crate::cli) struct EnipOptions {
    /// Where the first one is reached; the others at the addresses behind it.
    pub(in crate::cli) first: Ipv4Addr,
    pub(in crate::cli) min_rpi: Duration,
    pub(in crate::cli) monitoring_only: bool,
}

/// What was last seen of a robot, and told.
#[derive(Clone, Copy, Debug)]
struct Told {
    is_on_bus: bool,
    /// What its adapter was told to let in; `None` before the first time.
    access: Option<Access>,
}

/// The robots' adapters.
pub(in crate::cli) struct EnipFace {
    server: Server<OnEtherNetIp>,
    options: EnipOptions,
    told: Vec<Told>,
    announcement: String,
    labels: Labels,
    teller: Teller,
}

impl EnipFace {
    /// Opens the ports of all robots.
    pub(in crate::cli) fn open(
        options: EnipOptions,
        robots: &[SharedRobot],
        clock: MonotonicClock,
        labels: Labels,
        teller: Teller,
    ) -> Result<Self, Failure> {
        let EnipOptions { first, min_rpi, monitoring_only } = options;
        let mut places = Vec::new();
        for (number, robot) in (0_u32..).zip(robots) {
            let Some(address) = first.to_bits().checked_add(number) else {
                return Err(Failure::usage(format!(
                    "--enip {first}: behind it there are no {} addresses; begin at a lower one",
                    robots.len()
                )));
            };
            let address = Ipv4Addr::from_bits(address);
            let settings = robot.borrow().settings().clone();
            let presentation = Presentation {
                serial: settings.serial_number,
                layout: settings.layout,
                min_rpi,
                monitoring_only,
            };
            places.push((address, served(OnEtherNetIp(robot.clone()), address, presentation)));
        }
        let (at, order) = (whereabouts(&places), order_of(robots));
        let mut server = Server::bind(places, Ports::default()).map_err(refused)?;
        server.keep_time_with(clock);
        let told = |robot: &ServedRobot<_>| Told { is_on_bus: robot.is_on_bus(), access: None };
        Ok(Self {
            told: server.robots().map(told).collect(),
            server,
            options,
            announcement: format!(
                "EtherNet/IP at {at} (TCP and UDP {MESSAGE_PORT}, UDP {IO_PORT}): byte order {order}, \
                 frames every {} or less often{}",
                words::ms(min_rpi),
                if monitoring_only { ", for monitoring only" } else { "" }
            ),
            labels,
            teller,
        })
    }

    /// What is served, for a person.
    pub(in crate::cli) fn whereabouts(&self) -> &str {
        &self.announcement
    }

    /// Waits for something to do, at most for a millisecond, and does it.
    pub(in crate::cli) fn step(&mut self) -> Result<(), Failure> {
        let done = self.server.step();
        self.follow(done)
    }

    /// Does what is to be done, without waiting.
    pub(in crate::cli) fn serve(&mut self) -> Result<(), Failure> {
        let done = self.server.step_at_once();
        self.follow(done)
    }

    /// When to call [`serve`](Self::serve) at the latest.
    pub(in crate::cli) fn next_due(&self) -> Instant {
        self.server.next_due()
    }

    /// Puts all sockets on `list`, as those of `server`.
    pub(in crate::cli) fn watch<'a>(&'a self, list: &mut WatchList<'a>, server: usize) {
        self.server.watch(list, server);
    }

    /// Pulls the cable of a robot, or plugs it in again.
    pub(in crate::cli) fn set_plugged(
        &mut self,
        robot: usize,
        plugged: bool,
    ) -> std::io::Result<()> {
        self.server.set_plugged(robot, plugged)
    }

    /// How many connections to a robot are not its owner's.
    pub(in crate::cli) fn monitors(&self, robot: usize) -> usize {
        let Some(served) = self.server.robots().nth(robot) else { return 0 };
        let adapter = served.adapter();
        adapter.connections().count().saturating_sub(usize::from(adapter.owner().is_some()))
    }

    /// What passed, for a person.
    pub(in crate::cli) fn totals(&self) -> String {
        let counts = self.server.counts();
        format!(
            "{} received, {} sent, {} not sent",
            counted(counts.received, "datagram"),
            counts.sent,
            counts.unsent
        )
    }

    /// What comes after every step.
    fn follow(&mut self, done: std::io::Result<()>) -> Result<(), Failure> {
        done.map_err(|error| {
            Failure::link(format!("--enip {}: the sockets fail: {error}", self.options.first))
        })?;
        let Self { server, told, labels, teller, .. } = self;
        while let Some((robot, event)) = server.next_event() {
            teller.say(format_args!("{}{}", labels.of(robot), words::adapter_event(&event)));
        }
        for (robot, (served, told)) in server.robots().zip(told).enumerate() {
            if served.is_on_bus() != told.is_on_bus {
                told.is_on_bus = served.is_on_bus();
                let place = match told.is_on_bus {
                    true => "is back on the bus",
                    false => "has left the bus; its connections are gone",
                };
                teller.say(format_args!("{}{}{place}", labels.of(robot), labels.bus()));
            }
        }
        (0..self.told.len()).for_each(|robot| self.settle(robot));
        Ok(())
    }

    /// Tells a robot of its owner on EtherNet/IP, and its adapter of everybody else. After every step, and
    /// whenever another face of the robot was served: who has come to own it over EtherNet/IP counts
    /// before anybody else is let in, and who came in elsewhere before the next one can own it.
    pub(in crate::cli) fn settle(&mut self, robot: usize) {
        let now = self.server.now();
        let Some(served) = self.server.robots_mut().nth(robot) else { return };
        let Some(told) = self.told.get_mut(robot) else { return };
        let has_owner = served.adapter().owner().is_some();
        let shared = served.device().0.clone();
        let (is_elsewhere, mode) = {
            let mut robot = shared.borrow_mut();
            if has_owner {
                robot.claim_control(Controller::EtherNetIp);
            } else {
                robot.release_control(Controller::EtherNetIp);
            }
            let controller = robot.controller();
            let is_elsewhere = controller.is_some_and(|other| other != Controller::EtherNetIp);
            (is_elsewhere, robot.protocol_settings().ethernet_ip)
        };
        let access = match mode {
            FieldbusMode::Disabled => Access::Disabled,
            FieldbusMode::Enabled => Access::Full,
            FieldbusMode::MonitoringOnly => Access::MonitoringOnly,
        };
        served.adapter_mut().set_controlled_elsewhere(is_elsewhere);
        if told.access == Some(access) {
            return;
        }
        served.adapter_mut().set_access(now, access);
        if told.access.replace(access).is_some() {
            let label = self.labels.of(robot);
            self.teller.say(match access {
                Access::Full => {
                    format!("{label}EtherNet/IP: owners and monitors are let in from now on")
                }
                Access::MonitoringOnly => {
                    format!("{label}EtherNet/IP: for monitoring only from now on")
                }
                Access::Disabled => format!("{label}EtherNet/IP: nobody is answered from now on"),
            });
        }
    }
}

/// `127.0.0.1`, `127.0.0.1 to 127.0.0.4`.
fn whereabouts<D>(places: &[(Ipv4Addr, D)]) -> String {
    match places {
        [] => String::new(),
        [(only, _)] => only.to_string(),
        [(first, _), .., (last, _)] => format!("{first} to {last}"),
    }
}

/// All robots have the same.
fn order_of(robots: &[SharedRobot]) -> String {
    robots.first().map(|robot| robot.borrow().settings().byte_order.to_string()).unwrap_or_default()
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
