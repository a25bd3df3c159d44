//! A working counter that stays wrong: told once a spell, with both numbers.
#![cfg(feature = "ethercat")]

#[path = "support/ethercat_line.rs"]
mod ethercat_line;

use std::io;

use ethercat_line::{Line, line};
use fieldarm::cycle::{CyclicSegment, InputQuality};
use fieldarm::link::ethercat::wire::Wire;
use fieldarm::link::ethercat::{EthercatSegment, EventKind, SegmentEvent, SegmentSettings};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::image::INPUT_LEN;

/// Exchanges with a wrong counter until it is told.
const TOLD_AFTER: u32 = 20;
/// Ethernet header and EtherCAT header.
const FIRST_DATAGRAM: usize = 16;
const LRW: u8 = 12;

/// A wire on which some access to the process data is missing.
struct Miscounting {
    line: Line,
    missing: u16,
}

impl Miscounting {
    /// Takes the missing ones from the counter of every LRW in `frame`.
    fn miscount(&self, frame: &mut [u8]) {
        let mut start = FIRST_DATAGRAM;
        loop {
            let length = u16::from_le_bytes([frame[start + 6], frame[start + 7]]);
            let counter = start + 10 + usize::from(length & 0x07FF);
            if frame[start] == LRW {
                let counted = u16::from_le_bytes([frame[counter], frame[counter + 1]]);
                let counted = counted.saturating_sub(self.missing);
                frame[counter..counter + 2].copy_from_slice(&counted.to_le_bytes());
            }
            if length & 0x8000 == 0 {
                return;
            }
            start = counter + 2;
        }
    }
}

impl Wire for Miscounting {
    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        self.line.send(frame)
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> io::Result<Option<usize>> {
        let received = self.line.receive(buffer, deadline)?;
        if let Some(length) = received {
            self.miscount(&mut buffer[..length]);
        }
        Ok(received)
    }

    fn now(&self) -> Instant {
        self.line.now()
    }

    fn pause_until(&mut self, deadline: Instant) {
        self.line.pause_until(deadline);
    }

    fn advance_to(&mut self, now: Instant) {
        self.line.advance_to(now);
    }
}

struct Bus {
    segment: EthercatSegment<Miscounting>,
    now: Instant,
}

impl Bus {
    fn start(robots: u16) -> Self {
        let wire = Miscounting { line: line(robots), missing: 0 };
        match EthercatSegment::start(wire, SegmentSettings::default()) {
            Ok(segment) => Self { segment, now: Instant::ZERO },
            Err(failure) => panic!("{}", failure.error),
        }
    }

    /// So many exchanges with so many accesses missing; what was told meanwhile.
    fn exchange(&mut self, times: u32, missing: u16) -> Vec<SegmentEvent> {
        self.segment.wire_mut().missing = missing;
        for _ in 0..times {
            self.now += Duration::from_millis(1);
            self.segment.exchange(self.now).unwrap();
        }
        std::iter::from_fn(|| self.segment.poll_event()).collect()
    }

    fn quality(&self, robot: usize) -> InputQuality {
        self.segment.read_inputs(robot, &mut [0; INPUT_LEN])
    }
}

#[test]
fn it_is_told_once_a_spell_for_each_robot_of_the_frame() {
    let mut bus = Bus::start(2);
    let kind = EventKind::WrongCounter { expected: 6, found: 5 };
    let both = [0, 1].map(|robot| SegmentEvent { robot, kind });
    for spell in 0..3 {
        assert_eq!(bus.exchange(10, 0), [], "spell {spell}");
        assert_eq!(bus.exchange(TOLD_AFTER - 1, 1), [], "spell {spell}");
        assert_eq!(bus.exchange(1, 1), both, "spell {spell}");
        assert_eq!(bus.exchange(500, 1), [], "spell {spell}");
        assert_eq!(bus.quality(0), InputQuality::Stale { age_cycles: 500 + TOLD_AFTER });
    }
    assert_eq!(
        both[1].to_string(),
        "robot 2: the working counter of its frame stays wrong, 5 instead of 6: inputs are not used"
    );
}

#[test]
fn a_counter_that_is_right_now_and_then_is_not_worth_a_word() {
    let mut bus = Bus::start(1);
    for _ in 0..20 {
        assert_eq!(bus.exchange(TOLD_AFTER - 1, 2), []);
        assert_eq!(bus.exchange(1, 0), []);
        assert_eq!(bus.quality(0), InputQuality::Fresh);
    }
    assert_eq!(bus.segment.statistics().wrong_counter, u64::from(20 * (TOLD_AFTER - 1)));
}
