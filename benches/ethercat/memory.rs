//! One exchange without sockets: the emulated segment in the same process, its time simulated.

use std::hint::black_box;

use fieldarm::cycle::CyclicSegment;
use fieldarm::link::ethercat::EthercatSegment;
use fieldarm::link::ethercat::wire::Wire;
use fieldarm::time::{Duration, Instant};

use crate::ethercat_line::{Line, line};
use crate::frame::{Frame, Remembering};
use crate::ours::settings;
use crate::support::{Group, Subject, alloc};

const PERIOD: Duration = Duration::from_millis(1);
const BUFFER: usize = 1514;

/// The emulated robots alone, passed by the frame of a cycle.
struct Emulated {
    wire: Line,
    frame: Frame,
    buffer: [u8; BUFFER],
    now: Instant,
}

/// The link and the same robots.
struct Linked {
    segment: EthercatSegment<Line>,
    now: Instant,
}

#[inline(never)]
fn measured_emulator(emulated: &mut Emulated) {
    emulated.now += PERIOD;
    emulated.wire.advance_to(emulated.now);
    let _ = black_box(emulated.wire.send(emulated.frame.bytes()));
    let deadline = emulated.now + PERIOD / 2;
    let _ = black_box(emulated.wire.receive(&mut emulated.buffer, deadline));
}

#[inline(never)]
fn measured_exchange(linked: &mut Linked) {
    linked.now += PERIOD;
    let _ = black_box(linked.segment.exchange(linked.now));
}

impl Linked {
    fn new(robots: u16) -> Self {
        match EthercatSegment::start(line(robots), settings(PERIOD)) {
            Ok(segment) => Self { segment, now: Instant::ZERO },
            Err(failure) => panic!("no start in memory: {}", failure.error),
        }
    }
}

impl Emulated {
    /// Robots that a link has brought to OP and left there.
    fn new(robots: u16) -> Self {
        let segment = EthercatSegment::start(Remembering::new(line(robots)), settings(PERIOD));
        let Ok(segment) = segment else { panic!("no start in memory") };
        let remembering = segment.abandon();
        let frame = remembering.last();
        let wire = remembering.into_inner();
        let now = wire.now();
        Self { wire, frame, buffer: [0; BUFFER], now }
    }
}

fn emulated(robots: u16) -> Subject {
    let mut emulated = Emulated::new(robots);
    Subject::new("emulator alone", move || measured_emulator(black_box(&mut emulated)))
}

fn linked(robots: u16) -> Subject {
    let mut linked = Linked::new(robots);
    Subject::new("link and emulator", move || measured_exchange(black_box(&mut linked)))
}

/// What is timed and counted.
pub(crate) fn groups() -> Vec<Group> {
    let references: &[&str] = &["emulator alone"];
    [("exchange in memory, 1 robot", 1), ("exchange in memory, 4 robots", 4)]
        .into_iter()
        .map(|(title, robots)| Group {
            title,
            subjects: vec![emulated(robots), linked(robots)],
            references,
        })
        .collect()
}

/// Shows that the exchange does not allocate, in many cycles.
pub(crate) fn print_allocations() {
    const CYCLES: u32 = 10_000;
    assert!(alloc::counts_at_all(), "the counting allocator is not installed");
    for robots in [1, 4] {
        let mut linked = Linked::new(robots);
        let count = alloc::allocations_during(|| {
            (0..CYCLES).for_each(|_| measured_exchange(&mut linked));
        });
        println!(
            "Allocations in {CYCLES} exchanges in memory, {robots} robots: {count} (positive control passed)."
        );
    }
}
