//! `fieldarm sim --tcp`: a virtual robot at its control port and its monitoring port.

use core::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::io;
use std::prelude::v1::*;

use super::place::Place;
use super::words::Narrator;
use crate::bus::text::server::Peer;
use crate::bus::text::{CONTROL_PORT, MONITORING_PORT};
use crate::cli::exit::Failure;
use crate::cli::sim::shared_robot::SharedRobot;
use crate::cli::sim::teller::Teller;
use crate::cli::wording::counted;
use crate::link::text::{BindError, Endpoints, PortCounts, STEP, TextPorts};
use crate::link::watch_list::WatchList;
use crate::text_device::TextDevice;
use crate::time::Instant;

/// What the ports of all robots have in common.
#[derive(Clone, Copy, Debug)]
pub(in crate::cli) struct TextOptions {
    /// The first robot's control port; the others are at the addresses behind it.
    pub(in crate::cli) control: Place,
    /// Its monitoring port, at the address of the other unless it is named.
    pub(in crate::cli) monitoring: Option<Place>,
    /// Whether a robot in EtherCAT mode is on a line.
    pub(in crate::cli) is_on_ethercat: bool,
    pub(in crate::cli) teller: Teller,
}

/// The two ports of a robot, and who tells of them.
pub(in crate::cli) struct TextFace {
    robot: SharedRobot,
    label: String,
    ports: TextPorts,
    narrator: Narrator,
    is_on_ethercat: bool,
    teller: Teller,
    was_open: bool,
    next_due: Instant,
}

impl TextFace {
    /// Opens the ports of the robot with this number.
    pub(in crate::cli) fn open(
        options: TextOptions,
        number: u16,
        robot: SharedRobot,
        label: String,
    ) -> Result<Self, Failure> {
        let TextOptions { control, monitoring, is_on_ethercat, teller } = options;
        let monitoring = monitoring.unwrap_or(Place { address: control.address, port: None });
        let control = behind("--tcp", control, number)?.with_port(CONTROL_PORT);
        let monitoring = behind("--monitor", monitoring, number)?.with_port(MONITORING_PORT);
        if control == monitoring && control.port() != 0 {
            return Err(Failure::usage(format!(
                "--tcp and --monitor: both ports at {control}; give --monitor another one"
            )));
        }
        let ports = TextPorts::bind(Endpoints { control, monitoring }).map_err(refused)?;
        let was_open = robot.borrow().is_on_text();
        Ok(Self {
            robot,
            label,
            ports,
            narrator: Narrator::default(),
            is_on_ethercat,
            teller,
            was_open,
            next_due: Instant::ZERO,
        })
    }

    /// Where the ports are.
    pub(in crate::cli) const fn endpoints(&self) -> Endpoints {
        self.ports.endpoints()
    }

    /// Puts all sockets on `list`, as those of `server`.
    pub(in crate::cli) fn watch<'a>(&'a self, list: &mut WatchList<'a>, server: usize) {
        self.ports.watch(list, server);
    }

    /// When to call [`serve`](Self::serve) at the latest.
    pub(in crate::cli) const fn next_due(&self) -> Instant {
        self.next_due
    }

    /// Pulls the cable, or plugs it in again.
    pub(in crate::cli) fn set_plugged(&mut self, plugged: bool) -> io::Result<()> {
        self.ports.set_plugged(plugged)
    }

    /// One pass over what arrived, and words about it.
    pub(in crate::cli) fn serve(&mut self, now: Instant) {
        self.next_due = now + STEP;
        self.ports.serve(now, &mut *self.robot.borrow_mut());
        while let Some(event) = self.ports.next_event() {
            let line = self.narrator.line(event);
            self.say(&line);
        }
        let (is_open, is_in_ethercat) = {
            let mut robot = self.robot.borrow_mut();
            while let Some(line) = robot.next_log_line() {
                self.say(&format!("robot log, {line}"));
            }
            (robot.is_on_text(), robot.protocol_settings().ethercat)
        };
        if core::mem::replace(&mut self.was_open, is_open) != is_open {
            self.say(match (is_open, is_in_ethercat, self.is_on_ethercat) {
                (true, _, _) => "opens its TCP ports",
                (false, false, _) => "closes its TCP ports",
                (false, true, true) => "closes its TCP ports: it is in EtherCAT mode now",
                (false, true, false) => {
                    "closes its TCP ports: it is in EtherCAT mode now, which nobody serves here; \
                     Ctrl-C ends it"
                }
            });
        }
    }

    fn say(&self, words: &str) {
        self.teller.say(format_args!("{}{words}", self.label));
    }

    /// How many have a monitoring connection.
    pub(in crate::cli) fn monitors(&self) -> usize {
        self.ports.peers().filter(|peer| *peer != Peer::Control).count()
    }

    /// What passed so far.
    pub(in crate::cli) fn counts(&self) -> PortCounts {
        self.ports.counts()
    }
}

/// Where the ports of all robots are, for a person.
pub(in crate::cli) fn whereabouts(faces: &[TextFace]) -> String {
    let all = |port: fn(Endpoints) -> SocketAddr| match faces {
        [] => String::new(),
        [only] => port(only.endpoints()).to_string(),
        [first, .., last] => format!("{} to {}", port(first.endpoints()), port(last.endpoints())),
    };
    format!(
        "TCP at {} for control and {} for monitoring",
        all(|endpoints| endpoints.control),
        all(|endpoints| endpoints.monitoring)
    )
}

/// What passed at the ports of all robots, for a person.
pub(in crate::cli) fn totals(faces: &[TextFace]) -> String {
    let total =
        |figure: fn(PortCounts) -> u64| faces.iter().map(|face| figure(face.counts())).sum();
    let [connections, commands, received, sent]: [u64; 4] = [
        total(|counts| counts.accepted),
        total(|counts| counts.session.commands),
        total(|counts| counts.received),
        total(|counts| counts.sent),
    ];
    format!(
        "TCP: {}, {}, {} received, {sent} sent",
        counted(connections, "connection"),
        counted(commands, "command"),
        counted(received, "byte"),
    )
}

/// The place of the robot with this number, at an address behind that of the first.
fn behind(option: &str, first: Place, number: u16) -> Result<Place, Failure> {
    let address = match first.address {
        IpAddr::V4(address) => {
            let behind = address.to_bits().checked_add(number.into());
            behind.map(|bits| IpAddr::V4(Ipv4Addr::from_bits(bits)))
        }
        IpAddr::V6(address) => {
            let behind = address.to_bits().checked_add(number.into());
            behind.map(|bits| IpAddr::V6(Ipv6Addr::from_bits(bits)))
        }
    };
    let Some(address) = address else {
        return Err(Failure::usage(format!(
            "{option} {}: behind it there is no address for robot {}; begin at a lower one",
            first.address,
            number + 1
        )));
    };
    Ok(Place { address, ..first })
}

/// An address that this machine does not have is a mistake of the command line, the rest is the
/// link's.
fn refused(error: BindError) -> Failure {
    let message = format!("--tcp: {error}");
    match error.cause.kind() {
        io::ErrorKind::AddrNotAvailable => Failure::usage(message),
        _ => Failure::link(message),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn robots_stand_at_the_addresses_behind_the_first_with_the_same_port() {
        let place = |text: &str, number| {
            let place = behind("--tcp", text.parse().unwrap(), number);
            place.map(|place| place.with_port(10_000).to_string()).map_err(|why| why.message)
        };
        for (first, number, expected) in [
            ("127.0.0.1", 0, "127.0.0.1:10000"),
            ("127.0.0.255:7", 2, "127.0.1.1:7"),
            ("[::1]:7", 3, "[::4]:7"),
        ] {
            assert_eq!(place(first, number).unwrap(), expected);
        }
        let why = place("255.255.255.254", 2).unwrap_err();
        assert!(why.contains("--tcp 255.255.255.254") && why.contains("robot 3"), "{why}");
    }
}
