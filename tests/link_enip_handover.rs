//! Two scanners and one robot: who owns it, and how it changes hands.
#![cfg(all(feature = "enip", feature = "sim"))]

#[path = "support/enip_robots.rs"]
mod enip_robots;

use core::net::Ipv4Addr;

use enip_robots::{RPI, Robots, robot_address, robots};
use fieldarm::bus::enip::adapter::AdapterSettings;
use fieldarm::bus::enip::scanner::{
    ConnectionSettings, Originator, Scanner, ScannerEvent, Target, Transmit, Trouble,
};
use fieldarm::link::enip::network::{Arrival, Network, ROOM};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::enip::status::ExtendedStatus;
use fieldarm::wire::meca500::image::OUTPUT_LEN;

/// A scanner on a host of its own.
struct Host {
    number: usize,
    scanner: Scanner<Vec<Target>>,
    events: Vec<ScannerEvent>,
}

/// Two hosts and a robot.
struct Cell {
    network: Robots,
    hosts: [Host; 2],
}

impl Cell {
    /// Scanners of the same vendor that differ in their serial number, which is all that tells them apart.
    fn new() -> Self {
        let mut network = robots(1, AdapterSettings::meca500());
        let second = network.add_host(Ipv4Addr::new(192, 168, 0, 101));
        let host = |number| {
            let settings = ConnectionSettings {
                longest_retry: Duration::from_millis(400),
                ..ConnectionSettings::meca500()
            };
            let target = Target::new(robot_address(0), settings).expect("sane settings");
            let originator = Originator { vendor: 0xFFFF, serial: 1 + number as u32 };
            let mut scanner = Scanner::new(vec![target], originator, 9);
            scanner.write_outputs(0, &[1 + number as u8; OUTPUT_LEN]);
            Host { number, scanner, events: Vec::new() }
        };
        Self { network, hosts: [host(0), host(second)] }
    }

    /// Lets those of `who` run for `time`, in steps of a millisecond; the others' processes stand still.
    fn run(&mut self, who: &[usize], time: Duration) {
        let end = self.network.now() + time;
        while self.network.now() < end {
            let next = self.network.now() + Duration::from_millis(1);
            self.network.advance_to(next);
            for host in who {
                self.network.act_as(*host);
                self.hosts[*host].step(&mut self.network);
            }
        }
    }

    fn owner(&self) -> Option<u32> {
        let owner = self.network.robots()[0].adapter().owner();
        owner.map(|owner| owner.triad.originator_serial - 1)
    }

    fn outputs(&self) -> Option<u8> {
        let outputs = self.network.robots()[0].adapter().outputs();
        outputs.and_then(|outputs| outputs.first().copied())
    }
}

impl Host {
    fn step(&mut self, network: &mut Robots) {
        let mut room = [0; ROOM];
        let now = network.now();
        while let Some(arrival) = network.receive(&mut room, Instant::ZERO).expect("memory") {
            match arrival {
                Arrival::Connected { target } => self.scanner.handle_connected(now, target),
                Arrival::Stream { target, len } => {
                    self.scanner.handle_stream(now, target, &room[..len]);
                }
                Arrival::Disconnected { target } => self.scanner.handle_disconnected(now, target),
                Arrival::Datagram { from, len } => {
                    self.scanner.handle_datagram(now, from, &room[..len]);
                }
            }
        }
        self.scanner.handle_timeout(now);
        while let Some(transmit) = self.scanner.poll_transmit(now, &mut room) {
            match transmit {
                Transmit::Connect { target } => {
                    network.connect(target, robot_address(0)).expect("memory");
                }
                Transmit::Stream { target, len } => {
                    network.send_stream(target, &room[..len]).expect("it is connected");
                }
                Transmit::Disconnect { target } => network.disconnect(target),
                Transmit::Datagram { to, len } => {
                    network.send_datagram(to, &room[..len]).expect("memory");
                }
                Transmit::JoinGroup { group } => network.join_group(group).expect("memory"),
                Transmit::LeaveGroup { group } => network.leave_group(group),
            }
        }
        self.events.extend(core::iter::from_fn(|| self.scanner.poll_event()));
        assert!(self.events.len() < 1_000, "host {}: {:?}", self.number, self.events);
    }

    /// How often it was told that somebody else owns the robot.
    fn refused(&self) -> usize {
        let is_refusal = |event: &&ScannerEvent| {
            let ScannerEvent::Failed { trouble, retry_in, .. } = event else { return false };
            let Trouble::Refused { extended, .. } = trouble else { return false };
            *extended == Some(ExtendedStatus::OWNERSHIP_CONFLICT) && retry_in.is_some()
        };
        self.events.iter().filter(is_refusal).count()
    }
}

const SECOND: Duration = Duration::from_secs(1);

#[test]
fn a_second_owner_waits_until_the_first_has_closed() {
    let mut cell = Cell::new();
    cell.run(&[0], SECOND);
    assert_eq!((cell.owner(), cell.outputs()), (Some(0), Some(1)));
    cell.run(&[0, 1], 2 * SECOND);
    assert_eq!((cell.owner(), cell.outputs()), (Some(0), Some(1)), "the first still owns it");
    assert!(cell.hosts[1].refused() >= 2, "{:?}", cell.hosts[1].events);
    let now = cell.network.now();
    cell.hosts[0].scanner.close(now, 0);
    cell.run(&[0, 1], 2 * SECOND);
    assert_eq!((cell.owner(), cell.outputs()), (Some(1), Some(2)));
    assert!(cell.hosts[0].events.contains(&ScannerEvent::Closed { target: 0 }));
    // And back.
    let now = cell.network.now();
    cell.hosts[0].scanner.open(now, 0);
    cell.run(&[0, 1], 2 * SECOND);
    assert_eq!(cell.owner(), Some(1));
    assert!(cell.hosts[0].refused() >= 2, "{:?}", cell.hosts[0].events);
    let now = cell.network.now();
    cell.hosts[1].scanner.close(now, 0);
    cell.run(&[0, 1], 2 * SECOND);
    assert_eq!((cell.owner(), cell.outputs()), (Some(0), Some(1)));
}

#[test]
fn a_second_owner_takes_over_once_the_watchdog_of_the_first_has_expired() {
    let mut cell = Cell::new();
    cell.run(&[0], SECOND);
    // The first one's process stands still, and says nothing.
    cell.run(&[1], 10 * RPI);
    assert_eq!((cell.owner(), cell.outputs()), (Some(0), Some(1)), "too early");
    cell.run(&[1], 2 * SECOND);
    assert_eq!((cell.owner(), cell.outputs()), (Some(1), Some(2)));
    // When it goes on, what it sends belongs to no connection any more, and it has to wait.
    cell.run(&[0, 1], 2 * SECOND);
    assert_eq!((cell.owner(), cell.outputs()), (Some(1), Some(2)));
    assert!(cell.hosts[0].refused() >= 1, "{:?}", cell.hosts[0].events);
    assert_eq!(cell.network.robots()[0].adapter().connections().count(), 1);
}
