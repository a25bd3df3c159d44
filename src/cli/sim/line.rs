//! The robots as subdevices of an EtherCAT line, on a network interface.

use std::io;
use std::prelude::v1::*;

use rustix::fd::AsFd;

use super::args::{LayoutName, SimArgs};
use super::shared_robot::{OnEtherCat, SharedRobot};
use super::teller::Teller;
use crate::bus::ethercat::SubDevice;
use crate::bus::ethercat::meca500::{Meca500Application, Meca500Settings};
use crate::cli::emulated_robot::{Presentation, emulated, refuse_unknown_pdos};
use crate::cli::exit::Failure;
use crate::cli::run_program::RevisionName;
use crate::cli::wording::counted;
use crate::link::clock::MonotonicClock;
use crate::link::ethercat::faulty_wire::{FaultyWire, WireEnd};
use crate::link::ethercat::raw_socket::{self, OpenError, RawSocket};
use crate::link::ethercat::serve::{Change, FrameCounts, Server, Standing, TICK};
use crate::link::ethercat::wire::Wire;
use crate::link::watch_list::{Interest, WatchList};
use crate::time::Instant;
use crate::wire::meca500::image::FirmwareLayout;
use crate::wire::meca500::image::pdo::PdoLayout;
use crate::wire::order::ByteOrder;

/// Frames that are served before the other faces have their turn.
const AT_ONCE: usize = 64;

type Device = SubDevice<Meca500Application<OnEtherCat>>;

/// The robots' EtherCAT ports.
pub(super) struct EtherCatFace {
    server: Server<FaultyWire<RawSocket>, Meca500Application<OnEtherCat>>,
    interface: String,
    announcement: String,
    teller: Teller,
    /// Whether the interface was down, or failed, at the last look.
    is_dead: bool,
    /// Which robots have been on the bus before.
    have_been_on_bus: Vec<bool>,
    next_due: Instant,
}

impl EtherCatFace {
    /// Puts the robots in a row on `interface`.
    pub(super) fn open(
        args: &SimArgs,
        interface: &str,
        robots: &[SharedRobot],
        teller: Teller,
    ) -> Result<Self, Failure> {
        let line = line(args, robots)?;
        let socket = RawSocket::open(interface).map_err(refused)?;
        let is_dead = socket.is_down();
        let wire = FaultyWire::new(socket, WireEnd::Subdevices, args.fault_plan());
        let server = Server::new(wire, line);
        let is_on_bus = |device: &Device| Standing::of(device).is_on_bus;
        Ok(Self {
            have_been_on_bus: server.line().iter().map(is_on_bus).collect(),
            server,
            interface: interface.into(),
            announcement: format!(
                "{interface}: byte order {}, {} distributed clocks",
                ByteOrder::from(args.byte_order),
                if args.no_dc { "without" } else { "with" }
            ),
            teller,
            is_dead,
            next_due: Instant::ZERO,
        })
    }

    /// What is served, for a person.
    pub(super) fn whereabouts(&self) -> &str {
        &self.announcement
    }

    /// Says that nothing will come, if it will not.
    pub(super) fn warn(&self) {
        let interface = &self.interface;
        if self.is_dead {
            self.teller.say(format_args!("{interface} is down; ip link set {interface} up"));
        }
    }

    /// The clock by which the line lives.
    pub(super) const fn clock(&self) -> MonotonicClock {
        self.server.wire().inner().clock()
    }

    /// Waits for a frame and serves it, or lets the robots live for [`TICK`].
    pub(super) fn step(&mut self) -> Result<(), Failure> {
        let before = self.server.counts();
        let done = self.server.step();
        self.tell(before, done)
    }

    /// Serves the frames that are there, without waiting.
    pub(super) fn serve(&mut self) -> Result<(), Failure> {
        for _ in 0..AT_ONCE {
            let before = self.server.counts();
            let done = self.server.step_at_once();
            let is_last = !matches!(done, Ok(true));
            self.tell(before, done.map(drop))?;
            if is_last {
                break;
            }
        }
        self.next_due = self.server.wire().now() + TICK;
        Ok(())
    }

    /// When to call [`serve`](Self::serve) at the latest.
    pub(super) const fn next_due(&self) -> Instant {
        self.next_due
    }

    /// Puts the socket on `list`, as that of `server`.
    pub(super) fn watch<'a>(&'a self, list: &mut WatchList<'a>, server: usize) {
        list.add(server, self.server.wire().inner().as_fd(), Interest::Read);
    }

    /// Pulls the cable behind so many robots.
    pub(super) const fn set_reach(&mut self, robots: usize) {
        self.server.set_reach(robots);
    }

    /// What a main device sees of a robot.
    pub(super) fn standing(&self, robot: usize) -> Option<Standing> {
        self.server.line().get(robot).map(Standing::of)
    }

    /// Whether a fault of the wire cut the power since this was asked last.
    pub(super) const fn take_power_cycle(&mut self) -> bool {
        self.server.wire_mut().take_power_cycle()
    }

    /// What passed, for a person.
    pub(super) fn totals(&self) -> String {
        let counts = self.server.counts();
        format!(
            "{} received, {} returned, {} lost in the line, {} not sent; {} made",
            counted(counts.received, "frame"),
            counts.returned,
            counts.lost,
            counts.unsent,
            counted(self.server.wire().faults_made(), "fault")
        )
    }

    /// Says what a step has changed, and fails if the interface is gone for good.
    fn tell(&mut self, before: FrameCounts, done: io::Result<()>) -> Result<(), Failure> {
        let interface = &self.interface;
        if let Err(error) = done {
            self.is_dead = true;
            let message = format!("{interface}: {error}");
            if !raw_socket::is_transient(&error) {
                return Err(Failure::link(message));
            }
            self.teller.say(message);
        } else if self.is_dead && self.server.counts() != before {
            self.is_dead = false;
            self.teller.say(format_args!("{interface} carries frames again"));
        }
        while let Some(change) = self.server.next_change() {
            self.tell_change(change);
        }
        Ok(())
    }

    fn tell_change(&mut self, change: Change) {
        let Change { device, before, after } = change;
        let teller = self.teller;
        if before.is_on_bus != after.is_on_bus {
            let place = match self.have_been_on_bus.get_mut(device) {
                _ if !after.is_on_bus => "has left the bus",
                Some(has_been @ false) => {
                    *has_been = true;
                    "is on the bus"
                }
                _ => "is back on the bus",
            };
            teller.say(format_args!("position {device}: {place}"));
        }
        let shown = |standing: Standing| (standing.state, standing.error);
        if shown(before) != shown(after) {
            let (from, to) = (before.state, after.state);
            match after.error {
                Some(error) => {
                    teller.say(format_args!("position {device}: {from} -> {to}, {error}"));
                }
                None if from == to => {
                    teller.say(format_args!("position {device}: {to}, error acknowledged"));
                }
                None => teller.say(format_args!("position {device}: {from} -> {to}")),
            }
        }
    }
}

/// The robots in a row, as the command line wants them.
fn line(args: &SimArgs, robots: &[SharedRobot]) -> Result<Vec<Device>, Failure> {
    check_aliases(args)?;
    let layout = FirmwareLayout::from(args.layout);
    refuse_unknown_pdos("--unassigned", &args.unassigned, &[PdoLayout::from(layout)])?;
    // The process lives as long as its robots.
    let unassigned: &'static [u16] = args.unassigned.clone().leak();
    let aliases = args.alias.iter().copied().chain(core::iter::repeat(0));
    robots
        .iter()
        .zip(aliases)
        .map(|(robot, alias)| {
            let settings = Meca500Settings {
                serial: robot.borrow().settings().serial_number,
                layout: PdoLayout::from(layout),
                hardware_version: match args.revision {
                    RevisionName::R3 => "R3",
                    RevisionName::R4 => "R4",
                },
                software_version: match args.layout {
                    LayoutName::V11_3 => "11.3.84",
                    LayoutName::V10_2 => "10.2",
                },
                unassigned_at_power_up: unassigned,
                assignment_must_be_written: args.demand_assignment,
            };
            let presentation =
                Presentation { alias, distributed_clock: !args.no_dc, pdos_in_sii: args.sii_pdos };
            emulated(OnEtherCat(robot.clone()), settings, presentation)
        })
        .collect()
}

fn check_aliases(args: &SimArgs) -> Result<(), Failure> {
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
    Ok(())
}

/// An interface that does not exist is a mistake of the command line, the rest is the link's.
pub(in crate::cli) fn refused(error: OpenError) -> Failure {
    let message = error.to_string();
    match error {
        OpenError::NoSuchInterface { .. } | OpenError::NotEthernet { .. } => {
            Failure::usage(message)
        }
        OpenError::NotPermitted { .. } | OpenError::System { .. } => Failure::link(message),
    }
}
