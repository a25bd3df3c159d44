//! Sixty-four virtual robots and one scanner on loopback at 10 ms, every robot fed as fast as it
//! takes commands.
//!
//! In release for a minute, as CI runs it; in debug with fewer robots and for a few seconds. Nothing is
//! lost or done twice, no watchdog expires, memory does not grow. What the processor time was is printed.
#![cfg(all(feature = "cli", target_os = "linux"))]

#[path = "cell/checkers.rs"]
mod checkers;
#[path = "support/loopback.rs"]
mod loopback;
#[allow(dead_code, reason = "another suite uses the rest of it")]
#[path = "link_contract/plc.rs"]
mod plc;
#[path = "support/quick_robot.rs"]
mod quick_robot;
#[path = "link_contract/watched.rs"]
mod watched;

use std::net::{Ipv4Addr, SocketAddrV4};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use fieldarm::bus::enip::adapter::{AdapterEvent, AdapterSettings};
use fieldarm::bus::enip::scanner::{ConnectionSettings, Originator, ScannerEvent};
use fieldarm::cycle::CyclicSegment;
use fieldarm::engine::meca500::Config;
use fieldarm::link::clock::MonotonicClock;
use fieldarm::link::enip::serve::{Ports, Server};
use fieldarm::link::enip::served::ServedRobot;
use fieldarm::link::enip::sockets::{SocketNetwork, SocketSettings};
use fieldarm::link::enip::{EnipSegment, EnipSettings, TargetSettings};
use fieldarm::sim::meca500::RobotSettings;
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::enip::MESSAGE_PORT;
use fieldarm::wire::enip::parameters::TimeoutMultiplier;
use fieldarm::wire::meca500::command::MotionCommand;
use fieldarm::wire::order::ByteOrder;

use checkers::End;
use plc::Plc;
use watched::WatchedRobot;

const ROBOTS: usize = if cfg!(debug_assertions) { 8 } else { 64 };
const SECONDS: u64 = if cfg!(debug_assertions) { 5 } else { 60 };
const CYCLE: Duration = Duration::from_millis(10);
/// Commands that wait in each engine.
const WAITING: u32 = 4;
/// Cycles in which every robot must be up, and in which the last commands must end.
const PATIENCE: u64 = 6_000;
/// What the process may grow by while it runs, in pages of 4 kB; its buffers are all there at the start.
const MOST_PAGES: u64 = 2_048;

/// Settings commands that differ from each other, so that none can be taken for another.
fn command(number: u32) -> MotionCommand {
    MotionCommand::SetCartLinVel(1.0 + number as f32 * 0.0625)
}

/// Addresses that follow each other.
fn addresses() -> Vec<Ipv4Addr> {
    let first = loopback::address();
    let [a, b, ..] = first.octets();
    (1..=ROBOTS).map(|number| Ipv4Addr::new(a, b, 251, u8::try_from(number).unwrap())).collect()
}

/// A number of this process's line in a file of /proc.
fn proc_number(file: &str, field: usize) -> u64 {
    let text = std::fs::read_to_string(format!("/proc/self/{file}")).unwrap();
    // Behind the name, which is in parentheses and may hold blanks.
    let text = text.rsplit(')').next().unwrap();
    text.split_whitespace().nth(field).unwrap().parse().unwrap()
}

fn resident_pages() -> u64 {
    proc_number("statm", 1)
}

/// Processor time of all threads, in ticks of 10 ms.
fn ticks() -> u64 {
    proc_number("stat", 11) + proc_number("stat", 12)
}

struct Cell {
    segment: EnipSegment<SocketNetwork>,
    plcs: Vec<Plc>,
    clock: MonotonicClock,
    due: Instant,
    late: u64,
}

impl Cell {
    fn cycle(&mut self) {
        let now = self.clock.now();
        for (robot, plc) in self.plcs.iter().enumerate() {
            self.segment.write_outputs(robot, &plc.outputs);
        }
        self.segment.exchange(now).unwrap();
        for (robot, plc) in self.plcs.iter_mut().enumerate() {
            plc.quality = self.segment.read_inputs(robot, &mut plc.inputs);
            plc.think(now).unwrap_or_else(|problem| panic!("robot {robot}: {problem}\n{plc:#?}"));
        }
        while let Some(event) = self.segment.poll_event() {
            assert!(
                !matches!(event, ScannerEvent::Failed { .. } | ScannerEvent::StreamLost { .. }),
                "{event:?}"
            );
        }
        self.due += CYCLE;
        if self.clock.now() > self.due {
            self.late += 1;
            self.due = self.clock.now();
        }
        self.clock.sleep_until(self.due);
    }

    fn until(&mut self, what: &str, is_there: impl Fn(&Plc) -> bool) {
        for _ in 0..PATIENCE {
            if self.plcs.iter().all(&is_there) {
                return;
            }
            self.plcs.iter_mut().for_each(Plc::insist);
            self.cycle();
        }
        let missing = self.plcs.iter().find(|plc| !is_there(plc));
        panic!("{what}: not within {PATIENCE} cycles\n{missing:#?}");
    }
}

#[test]
fn many_robots_are_fed_by_one_scanner() {
    let addresses = addresses();
    let adapter = AdapterSettings::meca500();
    let robot = |address: &Ipv4Addr| {
        let settings =
            RobotSettings { byte_order: ByteOrder::LITTLE, ..quick_robot::quick_robot() };
        let device = WatchedRobot::new(settings);
        (*address, ServedRobot::new(device, adapter, *address, u64::from(address.to_bits())))
    };
    let mut server = Server::bind(addresses.iter().map(robot).collect(), Ports::default())
        .unwrap_or_else(|error| panic!("{error}"));
    let is_over = AtomicBool::new(false);
    let (plcs, timed_out) = thread::scope(|scope| {
        let serving = scope.spawn(|| {
            let mut timed_out = 0;
            while !is_over.load(Ordering::Relaxed) {
                server.step().unwrap();
                while let Some((_, event)) = server.next_event() {
                    timed_out += u32::from(matches!(event, AdapterEvent::TimedOut(_)));
                }
            }
            timed_out
        });
        let plcs = feed(&addresses);
        is_over.store(true, Ordering::Relaxed);
        (plcs, serving.join().expect("it serves to the end"))
    });
    assert_eq!(timed_out, 0, "watchdogs that expired");
    for (number, (plc, served)) in plcs.iter().zip(server.robots()).enumerate() {
        plc.judge(&served.device().witness)
            .unwrap_or_else(|problem| panic!("robot {number}: {problem}\n{plc:#?}"));
    }
}

/// Brings all robots up, feeds them, and waits for the last command.
fn feed(addresses: &[Ipv4Addr]) -> Vec<Plc> {
    let targets: Vec<SocketAddrV4> =
        addresses.iter().map(|address| SocketAddrV4::new(*address, MESSAGE_PORT)).collect();
    let bind = Some(loopback::address());
    let network =
        SocketNetwork::open(SocketSettings { bind, ..SocketSettings::default() }, &targets)
            .unwrap_or_else(|error| panic!("{error}"));
    // Machines stall; what is looked for here is what stays.
    let multiplier = TimeoutMultiplier::from_factor(128).unwrap();
    let connection = ConnectionSettings { multiplier, ..ConnectionSettings::meca500() };
    let settings = EnipSettings {
        targets: targets
            .iter()
            .map(|address| TargetSettings { address: *address, connection })
            .collect(),
        originator: Originator { vendor: 0xFFFF, serial: std::process::id() },
        seed: u64::from(std::process::id()),
        cycle: CYCLE,
        start_limit: Duration::from_secs(30),
    };
    let segment = EnipSegment::start(network, settings)
        .map_err(|failure| failure.error)
        .unwrap_or_else(|error| panic!("{error}"));
    let clock = MonotonicClock::new();
    let plc = |_: &Ipv4Addr| Plc::new(ByteOrder::LITTLE, Config::default());
    let plcs = addresses.iter().map(plc).collect();
    let mut cell = Cell { segment, plcs, due: clock.now(), clock, late: 0 };
    cell.until("every robot is up", Plc::is_up);

    let cycles = SECONDS * 1_000 / 10;
    let (mut number, mut pages) = (0, 0);
    let before = ticks();
    for cycle in 0..cycles {
        for plc in &mut cell.plcs {
            while plc.engine.status().waiting < WAITING {
                number += 1;
                if plc.submit(command(number)).is_err() {
                    break;
                }
            }
        }
        cell.cycle();
        // The records of the checkers grow; only what is left beside them is judged.
        if cycle == cycles / 2 {
            pages = resident_pages();
        }
    }
    let spent = ticks() - before;
    let grown = resident_pages().saturating_sub(pages);
    let statistics = cell.segment.statistics();
    println!(
        "{ROBOTS} robots for {SECONDS} s: {number} commands, {} % of one core for both ends, \
         {grown} pages more in the second half, {} cycles late, {} exchanges",
        spent / SECONDS,
        cell.late,
        statistics.exchanges
    );
    cell.until("every command has ended", |plc| {
        plc.submitted
            .iter()
            .rev()
            .take(8)
            .all(|submitted| plc.state(submitted.ticket).end.is_some())
    });
    for plc in &cell.plcs {
        let done = |ticket| plc.state(ticket).end == Some(End::Done);
        let lost = plc.submitted.iter().filter(|submitted| !done(submitted.ticket)).count();
        assert_eq!((lost, plc.tickets.unfinished()), (0, 0), "not done\n{plc:#?}");
    }
    let records = plc_records(&cell.plcs);
    assert!(
        grown < MOST_PAGES + records,
        "{grown} pages more in the second half, {records} of records"
    );
    drop(cell.segment.close());
    cell.plcs
}

/// Pages that the records of events and commands may take: a generous guess by their number.
fn plc_records(plcs: &[Plc]) -> u64 {
    let bytes: usize =
        plcs.iter().map(|plc| 256 * plc.events.len() + 512 * plc.submitted.len()).sum();
    u64::try_from(bytes / 4_096).unwrap_or(u64::MAX)
}
