//! Frames from the target: which are taken, and when they are missed.

use fieldarm::bus::enip::scanner::{ConnectionSettings, ScannerEvent, Trouble};
use fieldarm::cycle::InputQuality;
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::enip::parameters::TimeoutMultiplier;

use crate::bench::{Bench, Deed, address, frame, io_address, ms};

/// A cycle of the caller: the first input byte and the quality.
fn cycle(bench: &mut Bench) -> (u8, InputQuality) {
    bench.scanner.begin_cycle();
    let mut inputs = [0xEE; 252];
    let quality = bench.scanner.read_inputs(0, &mut inputs);
    (inputs[0], quality)
}

const FRESH: InputQuality = InputQuality::Fresh;
const fn stale(age_cycles: u32) -> InputQuality {
    InputQuality::Stale { age_cycles }
}

/// An open connection that is fed frames by hand.
struct Feed {
    bench: Bench,
    id: [u8; 4],
}

impl Feed {
    fn new() -> Self {
        let mut bench = Bench::meca500();
        let id = bench.open(0);
        bench.events();
        Self { bench, id }
    }

    fn frame(&mut self, sequence: u32, count: u16, byte: u8) {
        self.bench.receive(&frame(self.id, sequence, count, &[byte; 252]));
    }

    fn seen(&mut self) -> (u8, InputQuality) {
        cycle(&mut self.bench)
    }
}

#[test]
fn inputs_are_lost_fresh_stale_and_lost_again() {
    let mut feed = Feed::new();
    assert_eq!(feed.seen(), (0xEE, InputQuality::Lost));
    feed.frame(1, 1, 10);
    assert_eq!(feed.bench.events(), [ScannerEvent::Running { target: 0 }]);
    assert_eq!(feed.seen(), (10, FRESH));
    feed.frame(2, 2, 20);
    // What comes behind the beginning of a cycle is of the next one.
    let mut inputs = [0; 252];
    assert_eq!(feed.bench.scanner.read_inputs(0, &mut inputs), FRESH);
    assert_eq!(inputs, [10; 252]);
    assert_eq!(feed.seen(), (20, FRESH));
    assert_eq!(feed.seen(), (20, stale(1)));
    assert_eq!(feed.seen(), (20, stale(2)));
    // An unchanged count carries nothing new.
    feed.frame(3, 2, 30);
    assert_eq!(feed.seen(), (20, stale(3)));
    assert_eq!(feed.bench.status().counters.repeated, 1);
    feed.frame(4, 3, 40);
    feed.frame(5, 4, 50);
    assert_eq!(feed.seen(), (50, FRESH));
    let mut short = [0; 251];
    assert_eq!(feed.bench.scanner.read_inputs(0, &mut short), InputQuality::Lost);
    assert_eq!(feed.bench.scanner.read_inputs(1, &mut inputs), InputQuality::Lost);
    feed.bench.pass(ms(160));
    assert_eq!(feed.bench.scanner.read_inputs(0, &mut inputs), InputQuality::Lost);
    assert_eq!(feed.seen(), (0xEE, InputQuality::Lost));
}

#[test]
fn duplicates_and_late_frames_are_dropped_and_counted() {
    let mut feed = Feed::new();
    feed.frame(100, 100, 1);
    feed.frame(101, 101, 2);
    feed.frame(101, 101, 3);
    feed.frame(100, 100, 4);
    feed.frame(99, 99, 5);
    feed.frame(104, 104, 6);
    feed.frame(103, 103, 7);
    assert_eq!(feed.seen(), (6, FRESH));
    let counters = feed.bench.status().counters;
    assert_eq!((counters.consumed, counters.out_of_order, counters.missed), (3, 4, 2));
}

#[test]
fn any_first_number_and_every_wrap() {
    for first in [0, 1, 0x7FFF_FFFE, 0x7FFF_FFFF, 0x8000_0000, u32::MAX - 1, u32::MAX] {
        for count in [0_u16, 0x7FFF, 0xFFFE, 0xFFFF] {
            let mut feed = Feed::new();
            for step in 0..5_u8 {
                let sequence = first.wrapping_add(u32::from(step));
                feed.frame(sequence, count.wrapping_add(u16::from(step)), step);
                assert_eq!(feed.seen(), (step, FRESH), "{first:#X} {count:#X}");
                feed.frame(sequence.wrapping_sub(1), 9, 99);
                feed.frame(sequence, 9, 99);
            }
            let counters = feed.bench.status().counters;
            assert_eq!((counters.consumed, counters.missed), (5, 0));
        }
    }
}

#[test]
fn a_target_that_counts_anew_far_away_is_followed_at_once() {
    for (last, next) in [(5_000_000, 0), (10, 3_000_000_000), (100, 2_000_000_000), (70_000, 1)] {
        let mut feed = Feed::new();
        feed.frame(last, 1, 1);
        feed.seen();
        feed.frame(next, 1, 2);
        assert_eq!(feed.seen(), (2, FRESH), "{last} {next}");
        feed.frame(next + 1, 2, 3);
        assert_eq!(feed.seen(), (3, FRESH));
        assert_eq!(feed.bench.status().counters.missed, 0);
    }
}

#[test]
fn a_target_that_counts_anew_nearby_is_followed_before_the_watchdog() {
    let mut feed = Feed::new();
    feed.frame(500, 500, 1);
    feed.seen();
    feed.bench.events();
    let mut taken = None;
    for step in 0..40_u32 {
        feed.bench.pass(ms(10));
        feed.frame(step, step as u16, 2);
        if feed.seen().1 == FRESH && taken.is_none() {
            taken = Some(step);
        }
    }
    // Half of the timeout of 160 ms: the eighth frame.
    assert_eq!(taken, Some(7));
    assert_eq!(feed.bench.events(), []);
    assert_eq!(feed.bench.status().counters.consumed, 1 + 33);
}

#[test]
fn one_straggler_is_not_a_target_that_counts_anew() {
    let mut feed = Feed::new();
    feed.frame(500, 500, 1);
    feed.bench.pass(ms(120));
    feed.frame(499, 499, 2);
    feed.frame(499, 499, 2);
    feed.frame(498, 498, 3);
    feed.seen();
    assert_eq!(feed.seen(), (1, stale(1)));
    assert_eq!(feed.bench.status().counters.out_of_order, 3);
}

#[test]
fn frames_of_others_are_passed_over() {
    let mut feed = Feed::new();
    let good = frame(feed.id, 1, 1, &[1; 252]);
    let mut other_id = good.clone();
    other_id[6] ^= 1;
    feed.bench.receive(&other_id);
    feed.bench.scanner.handle_datagram(feed.bench.now, io_address(1), &good);
    for end in 0..good.len() {
        feed.bench.receive(&good[..end]);
    }
    let mut longer = good.clone();
    longer.push(0);
    feed.bench.receive(&longer);
    assert_eq!(feed.bench.events(), []);
    assert_eq!(feed.bench.status().counters.consumed, 0);
    // The port it sends from does not matter.
    feed.bench.scanner.handle_datagram(feed.bench.now, address(0), &good);
    assert_eq!(feed.bench.status().counters.consumed, 1);
}

#[test]
fn frames_of_another_size_are_named_when_the_watchdog_expires() {
    let mut feed = Feed::new();
    feed.frame(1, 1, 1);
    feed.bench.events();
    for step in 0..16 {
        feed.bench.receive(&frame(feed.id, 2 + step, 2, &[0; 250]));
        feed.bench.pass(ms(10));
    }
    let events = feed.bench.events();
    let [ScannerEvent::Failed { trouble, retry_in: None, .. }] = events.as_slice() else {
        panic!("{events:?}")
    };
    assert_eq!(*trouble, Trouble::FrameSize { expected: 252, found: 250 });
    let text = trouble.to_string();
    assert!(text.contains("250 bytes of inputs, and 252 were agreed on"), "{text}");
    // What a user cannot set is no remedy.
    assert!(!text.contains("t2o_len"), "{text}");
}

#[test]
fn one_frame_of_another_size_ends_nothing() {
    let mut feed = Feed::new();
    feed.frame(1, 1, 1);
    let id = feed.id;
    feed.bench.receive(&frame(id, 2, 2, &[0; 253]));
    feed.frame(3, 3, 3);
    feed.seen();
    feed.bench.events();
    feed.bench.pass(ms(160));
    assert!(matches!(
        feed.bench.events()[..],
        [ScannerEvent::Failed { trouble: Trouble::TimedOut { .. }, retry_in: Some(_), .. }]
    ));
}

/// When the watchdog of a running connection expires, by multiplier and API.
fn watchdog(factor: u32, api_us: u32) -> Duration {
    let multiplier = TimeoutMultiplier::from_factor(factor).expect("a factor");
    let mut bench =
        Bench::new(&[ConnectionSettings { multiplier, ..ConnectionSettings::meca500() }]);
    let id = bench.open_with(0, u32::MAX, api_us);
    bench.receive(&frame(id, 1, 1, &[0; 252]));
    let fed = bench.now;
    bench.events();
    let expected = Duration::from_micros(u64::from(api_us)) * factor;
    bench.pass(expected - Duration::from_nanos(1));
    assert_eq!(bench.events(), [], "{factor} x {api_us} us");
    for _ in 0..10_000 {
        bench.pass(Duration::from_nanos(1));
        if let [ScannerEvent::Failed { trouble: Trouble::TimedOut { after }, .. }] =
            bench.events()[..]
        {
            assert_eq!(after, bench.now - fed);
            assert_eq!(bench.status().counters.timed_out, 1);
            return bench.now - fed;
        }
    }
    panic!("it never expires");
}

#[test]
fn the_watchdog_counts_granted_intervals_and_never_overflows() {
    for (factor, api_us, expected) in [
        (4, 10_000, ms(40)),
        (16, 12_345, Duration::from_micros(197_520)),
        (256, 10_000, ms(2_560)),
        (512, 10_000, ms(5_120)),
        (512, 8_388_608, Duration::from_micros(4_294_967_296)),
        (512, u32::MAX, Duration::from_micros(512 * 4_294_967_295)),
    ] {
        assert_eq!(watchdog(factor, api_us), expected);
    }
}

#[test]
fn the_first_frame_may_take_ten_seconds_or_the_timeout_if_that_is_longer() {
    for (api_us, limit) in [(10_000, ms(10_000)), (1_000_000, ms(16_000))] {
        let mut bench = Bench::meca500();
        bench.open_with(0, 1_000_000, api_us);
        bench.events();
        bench.pass(limit - ms(1));
        assert_eq!(bench.events(), []);
        bench.pass(ms(1));
        let after = limit;
        assert!(matches!(
            bench.events()[..],
            [ScannerEvent::Failed { trouble: Trouble::TimedOut { after: told }, .. }] if told == after
        ));
    }
}

#[test]
fn repeated_data_feed_the_watchdog_and_dropped_frames_do_not() {
    let mut feed = Feed::new();
    feed.frame(1, 7, 1);
    feed.bench.events();
    for step in 0..50 {
        feed.bench.pass(ms(100));
        feed.frame(2 + step, 7, 1);
    }
    assert_eq!(feed.bench.events(), []);
    for _ in 0..16 {
        feed.bench.pass(ms(10));
        feed.frame(51, 7, 1);
    }
    assert!(matches!(feed.bench.events()[..], [ScannerEvent::Failed { .. }]));
}

#[test]
fn behind_a_timeout_comes_a_close_then_a_new_triad_after_the_pause() {
    let mut feed = Feed::new();
    feed.frame(1, 1, 1);
    feed.bench.events();
    let start: Instant = feed.bench.now;
    let deeds = feed.bench.pass(ms(160));
    let Some((at, Deed::Stream(0, close))) = deeds.last() else { panic!("{deeds:?}") };
    assert_eq!((*at - start, close[40]), (ms(160), 0x4E));
    let frames = |deeds: &[(Instant, Deed)]| {
        deeds.iter().filter(|(_, deed)| matches!(deed, Deed::Datagram(..))).count()
    };
    assert_eq!(frames(&deeds), 16, "none with the close");
    // It answers that it has no such connection: that is well.
    feed.bench.refuse(0, close, &[0x0107]);
    let deeds = feed.bench.pass(ms(200));
    assert_eq!(frames(&deeds), 0);
    let opens = Bench::requests(&deeds, 0x54);
    assert_eq!(opens.len(), 1);
    assert_ne!(opens[0][56..58], close[48..50], "a new serial number");
    assert_eq!(opens[0][58..64], close[50..56], "of the same originator");
    // Frames of the connection before are not of this one.
    let message = Bench::acceptance(&opens[0], crate::bench::t2o_id(&opens[0]), 10_000, 10_000);
    feed.bench.answer(0, &opens[0], &message);
    feed.frame(2, 2, 9);
    assert_eq!(feed.seen(), (0xEE, InputQuality::Lost));
    feed.id = crate::bench::t2o_id(&opens[0]);
    feed.frame(0, 2, 11);
    assert_eq!(feed.seen(), (11, FRESH));
    assert_eq!(feed.bench.status().counters.opened, 2);
}
