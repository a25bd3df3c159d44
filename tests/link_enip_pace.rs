//! How many frames leave when the caller is late: a segment in the loop that `fieldarm run` uses, in simulated
//! time.
#![cfg(all(feature = "enip", feature = "sim"))]

#[path = "support/enip_robots.rs"]
mod enip_robots;

use core::net::{Ipv4Addr, SocketAddrV4};
use std::io;

use enip_robots::{RPI, Robots, robots, settings};
use fieldarm::bus::enip::adapter::AdapterSettings;
use fieldarm::bus::enip::scanner::{ConnectionSettings, TargetCounters};
use fieldarm::cycle::{CyclicSegment, InputQuality};
use fieldarm::link::enip::EnipSegment;
use fieldarm::link::enip::network::{Arrival, Network};
use fieldarm::run::pace::Pace;
use fieldarm::run::periodic::{Controller, Periodic};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::WireError;
use fieldarm::wire::enip::io::IoFrame;
use fieldarm::wire::enip::parameters::TimeoutMultiplier;
use fieldarm::wire::meca500::image::{INPUT_LEN, OUTPUT_LEN};

/// Periods of a run.
const PERIODS: u64 = 1_200;
/// Periods between two stalls.
const STALL_EVERY: u64 = 60;

/// A frame that left.
#[derive(Clone, Copy, Debug)]
struct Sent {
    at: Instant,
    sequence: u32,
    /// What the controller wrote into its outputs.
    mark: u16,
}

/// Robots in memory, and what was sent to them.
struct Recorder {
    network: Robots,
    sent: Vec<Sent>,
}

impl Network for Recorder {
    fn now(&self) -> Instant {
        self.network.now()
    }

    fn advance_to(&mut self, now: Instant) {
        self.network.advance_to(now);
    }

    fn receive(&mut self, room: &mut [u8], deadline: Instant) -> io::Result<Option<Arrival>> {
        self.network.receive(room, deadline)
    }

    fn connect(&mut self, target: usize, address: SocketAddrV4) -> io::Result<()> {
        self.network.connect(target, address)
    }

    fn send_stream(&mut self, target: usize, bytes: &[u8]) -> io::Result<()> {
        self.network.send_stream(target, bytes)
    }

    fn disconnect(&mut self, target: usize) {
        self.network.disconnect(target);
    }

    fn send_datagram(&mut self, to: SocketAddrV4, bytes: &[u8]) -> io::Result<()> {
        let frame = IoFrame::read(bytes).expect("a frame");
        let mark = frame.data.last_chunk().expect("an image");
        self.sent.push(Sent {
            at: self.now(),
            sequence: frame.sequence,
            mark: u16::from_le_bytes(*mark),
        });
        self.network.send_datagram(to, bytes)
    }

    fn join_group(&mut self, group: Ipv4Addr) -> io::Result<()> {
        self.network.join_group(group)
    }

    fn leave_group(&mut self, group: Ipv4Addr) {
        self.network.leave_group(group);
    }
}

/// Numbers its outputs.
struct Marker {
    mark: u16,
}

impl Controller for Marker {
    const OUTPUT_LEN: usize = OUTPUT_LEN;
    const INPUT_LEN: usize = INPUT_LEN;

    fn cycle(
        &mut self,
        _: Instant,
        _: InputQuality,
        _: &[u8],
        outputs: &mut [u8],
    ) -> Result<(), WireError> {
        self.mark += 1;
        if let Some(place) = outputs.last_chunk_mut() {
            *place = self.mark.to_le_bytes();
        }
        Ok(())
    }
}

/// A machine that stands still for `stall` every so often.
struct Stalling {
    now: Instant,
    stall: Duration,
}

impl Pace for Stalling {
    fn start(&self) -> Instant {
        Instant::ZERO
    }

    fn wait_until(&mut self, deadline: Instant) -> Instant {
        self.now = self.now.max(deadline);
        let every_ns = u64::try_from(RPI.as_nanos()).expect("10 ms") * STALL_EVERY;
        let begun = Instant::from_nanos(self.now.as_nanos() / every_ns * every_ns);
        let is_warm = begun > Instant::ZERO;
        if is_warm && self.now < begun + self.stall {
            self.now = begun + self.stall;
        }
        self.now
    }
}

/// What became of a run.
struct Run {
    /// Frames from the tenth period on.
    sent: Vec<Sent>,
    counters: TargetCounters,
    /// Deadlines that passed without a cycle.
    overruns: u64,
}

/// A run on a machine that stalls.
fn run(stall: Duration) -> Run {
    let network = Recorder { network: robots(1, AdapterSettings::meca500()), sent: Vec::new() };
    let connection = ConnectionSettings {
        multiplier: TimeoutMultiplier::from_factor(64).expect("a power of two"),
        ..ConnectionSettings::meca500()
    };
    let segment = match EnipSegment::start(network, settings(1, &[(0, connection)])) {
        Ok(segment) => segment,
        Err(failure) => panic!("{}", failure.error),
    };
    let pace = Stalling { now: Instant::ZERO, stall };
    let mut cycles = Periodic::over_segment::<Marker>(segment, pace, RPI);
    let mut plc = Marker { mark: 0 };
    let mut from = 0;
    for cycle in 0..2 * PERIODS {
        let at = cycles.turn([Some(&mut plc)]).expect("memory never fails");
        if cycle == 10 {
            from = cycles.segment().network().sent.len();
        }
        if at >= Instant::ZERO + RPI * u32::try_from(PERIODS).expect("few") {
            let counters = cycles.segment().status(0).expect("there is a target").counters;
            let sent = cycles.segment().network().sent.split_at(from).1.to_vec();
            return Run { sent, counters, overruns: cycles.statistics().overruns };
        }
    }
    panic!("time does not pass");
}

/// Gaps between frames, in us.
fn gaps(sent: &[Sent]) -> Vec<u128> {
    sent.windows(2).map(|pair| (pair[1].at - pair[0].at).as_micros()).collect()
}

#[test]
fn the_mean_gap_is_the_interval_although_the_machine_stalls() {
    for tenths in [0, 4, 6, 9, 12, 25, 160] {
        let Run { sent, counters, overruns } = run(RPI * tenths / 10);
        assert_eq!((counters.overruns, overruns, counters.opened), (0, 0, 1), "{tenths}");
        let time = sent[sent.len() - 1].at - sent[0].at;
        // The run ends on the stall of its last period, if there is one.
        let late = RPI * tenths / 10;
        let intervals = u32::try_from(sent.len() - 1).expect("few");
        assert_eq!(time, RPI * intervals + late, "stalls of {tenths} tenths");
        let shortest = gaps(&sent).into_iter().min().expect("some");
        assert!(shortest >= 5_000, "{tenths}: {shortest} us");
        for pair in sent.windows(2) {
            assert_eq!(pair[1].sequence, pair[0].sequence + 1);
            // One frame a cycle, with what the cycle before computed.
            assert_eq!(pair[1].mark, pair[0].mark + 1);
        }
    }
}

#[test]
fn what_is_late_follows_half_an_interval_apart() {
    let stall = |tenths: u32| {
        let sent = run(RPI * tenths / 10).sent;
        let gaps = gaps(&sent);
        let first = gaps.iter().position(|gap| *gap != 10_000).expect("it stalled");
        gaps[first..first + 6].iter().map(|us| us / 1_000).collect::<Vec<_>>()
    };
    assert_eq!(stall(4), [14, 6, 10, 10, 10, 10]);
    assert_eq!(stall(6), [16, 5, 9, 10, 10, 10]);
    assert_eq!(stall(12), [22, 5, 5, 8, 10, 10]);
    assert_eq!(stall(25), [35, 5, 5, 5, 5, 5]);
}

#[test]
fn what_a_longer_stall_delayed_is_given_up_and_counted_by_both() {
    let Run { sent, counters, overruns } = run(RPI * 173 / 10);
    let stalls = PERIODS / STALL_EVERY;
    assert_eq!((counters.overruns, overruns, counters.opened), (stalls * 17, stalls * 17, 1));
    let time = sent[sent.len() - 1].at - sent[0].at;
    let intervals = u32::try_from(sent.len() as u64 - 1 + stalls * 17).expect("few");
    assert_eq!(time, RPI * intervals + RPI * 3 / 10, "the grid is kept");
}

#[test]
fn a_loop_of_the_callers_own_sends_one_frame_in_each_cycle_however_late_it_is() {
    let network = Recorder { network: robots(1, AdapterSettings::meca500()), sent: Vec::new() };
    let owner = [(0, ConnectionSettings::meca500())];
    let mut plc = enip_robots::Plc::start(network, 1, &owner);
    plc.cycles(10);
    let begun = plc.now;
    let before = plc.segment.network().sent.len();
    for cycle in 1..=1_000_u32 {
        let late = Duration::from_millis([0, 4, 6, 7][cycle as usize % 4]);
        plc.segment.exchange(begun + RPI * cycle + late).expect("memory never fails");
    }
    assert_eq!(plc.segment.network().sent.len() - before, 1_000);
    assert_eq!(plc.segment.status(0).expect("there is a target").counters.overruns, 0);
}
