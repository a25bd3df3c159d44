//! `fieldarm sim --tcp`: a virtual robot at its control port and its monitoring port.
//!
//! Read [`TextFace::serve`] first. Beside EtherNet/IP the same robot has both faces:
//! [`TextFace::serve_beside`] keeps its controllers apart. An owner on EtherNet/IP has the control of the
//! robot as a control connection has it, and either is refused while the other is there.

use std::prelude::v1::*;
use std::sync::atomic::Ordering;

use super::place::Place;
use super::words::Narrator;
use crate::bus::enip::adapter::Access;
use crate::bus::text::{CONTROL_PORT, MONITORING_PORT};
use crate::cli::exit::{Exit, Failure};
use crate::cli::run_program::catch_interrupts;
use crate::cli::sim::{Power, Teller};
use crate::cli::wording::counted;
use crate::link::clock::MonotonicClock;
use crate::link::enip::served::ServedRobot;
use crate::link::text::{BindError, Endpoints, STEP, TextPorts};
use crate::sim::meca500::{Controller, FieldbusMode, RobotSettings, VirtualRobot};
use crate::text_device::TextDevice;
use crate::time::{Duration, Instant};

/// The two ports of a robot, and who tells of them.
pub(in crate::cli) struct TextFace {
    ports: TextPorts,
    narrator: Narrator,
    teller: Teller,
    was_open: bool,
    /// What the adapter beside was told last.
    access: Option<Access>,
}

impl TextFace {
    /// Opens the ports; the monitoring port is at the address of the other unless it is named.
    pub(in crate::cli) fn open(
        control: Place,
        monitoring: Option<Place>,
        teller: Teller,
    ) -> Result<Self, Failure> {
        let control_at = control.with_port(CONTROL_PORT);
        let monitoring = monitoring.unwrap_or(Place { address: control.address, port: None });
        let monitoring_at = monitoring.with_port(MONITORING_PORT);
        if control_at == monitoring_at && control_at.port() != 0 {
            return Err(Failure::usage(format!(
                "--tcp and --monitor: both ports at {control_at}; give --monitor another one"
            )));
        }
        let endpoints = Endpoints { control: control_at, monitoring: monitoring_at };
        let ports = TextPorts::bind(endpoints).map_err(refused)?;
        let narrator = Narrator::default();
        Ok(Self { ports, narrator, teller, was_open: true, access: None })
    }

    /// Where the ports are, for a person.
    pub(in crate::cli) fn whereabouts(&self) -> String {
        let Endpoints { control, monitoring } = self.ports.endpoints();
        format!("TCP at {control} for control and {monitoring} for monitoring")
    }

    /// One pass over what arrived, and words about it.
    pub(in crate::cli) fn serve(&mut self, now: Instant, robot: &mut VirtualRobot) {
        self.ports.serve(now, robot);
        while let Some(event) = self.ports.next_event() {
            self.teller.say(self.narrator.line(event));
        }
        while let Some(line) = robot.next_log_line() {
            self.teller.say(format_args!("robot log, {line}"));
        }
        let is_open = robot.is_on_text();
        if core::mem::replace(&mut self.was_open, is_open) != is_open {
            self.teller.say(match (is_open, robot.protocol_settings().ethercat) {
                (true, _) => "opens its TCP ports",
                (false, false) => "closes its TCP ports",
                (false, true) => {
                    "closes its TCP ports: it is in EtherCAT mode now, which nobody serves here; \
                     Ctrl-C ends it"
                }
            });
        }
    }

    /// The same for a robot that is on EtherNet/IP too. Between two steps of its server.
    pub(in crate::cli) fn serve_beside(
        &mut self,
        now: Instant,
        served: &mut ServedRobot<VirtualRobot>,
    ) {
        // Twice: who has come to own it over EtherNet/IP counts before anybody else is let in, and
        // who came in here before the next one can own it.
        self.settle(now, served);
        self.serve(now, served.device_mut());
        self.settle(now, served);
    }

    /// Tells the robot of its owner on EtherNet/IP, and the adapter of everybody else.
    fn settle(&mut self, now: Instant, served: &mut ServedRobot<VirtualRobot>) {
        let has_owner = served.adapter().owner().is_some();
        let robot = served.device_mut();
        if has_owner {
            robot.claim_control(Controller::EtherNetIp);
        } else {
            robot.release_control(Controller::EtherNetIp);
        }
        let is_elsewhere =
            robot.controller().is_some_and(|controller| controller != Controller::EtherNetIp);
        let protocols = robot.protocol_settings();
        let access = match protocols.ethernet_ip {
            _ if protocols.ethercat => Access::Disabled,
            FieldbusMode::Disabled => Access::Disabled,
            FieldbusMode::Enabled => Access::Full,
            FieldbusMode::MonitoringOnly => Access::MonitoringOnly,
        };
        served.adapter_mut().set_controlled_elsewhere(is_elsewhere);
        if self.access != Some(access) {
            served.adapter_mut().set_access(now, access);
            if self.access.replace(access).is_some() {
                self.teller.say(match access {
                    Access::Full => "EtherNet/IP: owners and monitors are let in from now on",
                    Access::MonitoringOnly => "EtherNet/IP: for monitoring only from now on",
                    Access::Disabled => "EtherNet/IP: nobody is answered from now on",
                });
            }
        }
    }

    /// What passed, for a person.
    pub(in crate::cli) fn totals(&self) -> String {
        let counts = self.ports.counts();
        format!(
            "TCP: {}, {}, {} received, {} sent",
            counted(counts.accepted, "connection"),
            counted(counts.session.commands, "command"),
            counted(counts.received, "byte"),
            counts.sent
        )
    }
}

/// Serves one robot at its two ports alone until interrupted.
pub(in crate::cli) fn run(
    mut face: TextFace,
    settings: RobotSettings,
    power_cycle_after: Option<Duration>,
    teller: Teller,
) -> Result<Exit, Failure> {
    let clock = MonotonicClock::new();
    let mut robot = VirtualRobot::new(settings);
    let interrupted = catch_interrupts()?;
    let mut power = Power::cut_at(power_cycle_after.map(|after| clock.now() + after));
    teller.say(format_args!("serving a virtual Meca500 on {}; Ctrl-C ends it", face.whereabouts()));
    while !interrupted.load(Ordering::Relaxed) {
        face.ports.wait(STEP).map_err(|error| {
            Failure::link(format!("--tcp: the sockets of {} fail: {error}", face.whereabouts()))
        })?;
        let now = clock.now();
        face.serve(now, &mut robot);
        power.supply(now, false, core::iter::once(&mut robot), teller);
    }
    teller.say(face.totals());
    Ok(Exit::Done)
}

/// An address that this machine does not have is a mistake of the command line, the rest is the
/// link's.
fn refused(error: BindError) -> Failure {
    let message = format!("--tcp: {error}");
    match error.cause.kind() {
        std::io::ErrorKind::AddrNotAvailable => Failure::usage(message),
        _ => Failure::link(message),
    }
}
