//! Frames to the target: when, and numbered how.

use fieldarm::bus::enip::scanner::ConnectionSettings;
use fieldarm::time::{Duration, Instant};

use crate::bench::{Bench, Deed, frame, ms};

fn sequence(frame: &[u8]) -> (u32, u16) {
    (
        u32::from_le_bytes(frame[10..14].try_into().expect("four")),
        u16::from_le_bytes(frame[18..20].try_into().expect("two")),
    )
}

/// Lets time pass with frames from the target, so that nothing times out.
fn fed(bench: &mut Bench, id: [u8; 4], from: u32, steps: u32) -> Vec<(Instant, Vec<u8>)> {
    let mut sent = Vec::new();
    for step in 0..steps {
        for (at, deed) in bench.pass(ms(10)) {
            if let Deed::Datagram(_, bytes) = deed {
                sent.push((at, bytes));
            }
        }
        bench.receive(&frame(id, from + step, (from + step) as u16, &[0; 252]));
    }
    sent
}

#[test]
fn frames_leave_at_the_interval_that_was_granted_not_at_the_one_requested() {
    let mut bench = Bench::meca500();
    let start = bench.now;
    let id = bench.open_with(0, 12_345, 10_000);
    let sent = fed(&mut bench, id, 1, 1000);
    assert_eq!(sent.len(), 811, "10 s and the frame at 0");
    for (index, (at, frame)) in sent.iter().enumerate() {
        assert_eq!(*at - start, Duration::from_micros(12_345) * index as u32);
        assert_eq!(sequence(frame), (1 + index as u32, 1 + index as u16));
    }
    assert_eq!(bench.status().counters.overruns, 0);
    assert_eq!(bench.status().counters.produced, 811);
}

#[test]
fn the_count_of_new_data_wraps() {
    let mut bench = Bench::meca500();
    let id = bench.open_with(0, 1_000, 10_000);
    let sent = fed(&mut bench, id, 1, 6_600);
    assert_eq!(sequence(&sent[65_534].1), (65_535, 0xFFFF));
    assert_eq!(sequence(&sent[65_535].1), (65_536, 0));
    assert_eq!(sequence(&sent[65_536].1), (65_537, 1));
}

#[test]
fn a_late_frame_does_not_move_the_next_one() {
    let mut bench = Bench::meca500();
    bench.open(0);
    assert_eq!(bench.frames().len(), 1);
    bench.now += ms(13);
    assert_eq!(bench.frames().len(), 1);
    bench.now += ms(6);
    assert_eq!(bench.frames().len(), 0);
    bench.now += ms(1);
    assert_eq!(bench.frames().len(), 1);
    assert_eq!(bench.status().counters.overruns, 0);
}

/// When frames leave, in ms behind the first, of a target that nobody serves from 10 ms on until `served_ms`, and
/// then whenever it wants to be served, until `end_ms`. Each must carry the outputs of its moment and the next
/// numbers.
fn after_a_stall(served_ms: u64, end_ms: u64) -> (Bench, Vec<u64>) {
    let mut bench = Bench::meca500();
    let start = bench.now;
    let id = bench.open(0);
    let mut times = Vec::new();
    for _ in 0..10_000 {
        let mark = times.len() as u8 + 1;
        bench.scanner.write_outputs(0, &[mark; 60]);
        bench.receive(&frame(id, u32::from(mark), mark.into(), &[0; 252]));
        for sent in bench.frames() {
            assert_eq!(sequence(&sent), (times.len() as u32 + 1, times.len() as u16 + 1));
            assert_eq!(sent[24..], [mark; 60]);
            times.push(((bench.now - start).as_micros() / 1_000) as u64);
        }
        let due = bench.scanner.poll_timeout().expect("frames are due");
        bench.now = due.max(if times.len() == 1 { start + ms(served_ms) } else { start });
        if bench.now > start + ms(end_ms) {
            return (bench, times);
        }
        bench.scanner.handle_timeout(bench.now);
    }
    panic!("time does not pass");
}

#[test]
fn what_a_stall_delayed_is_made_up_for_half_an_interval_apart() {
    let cases: [(u64, &[u64]); 5] = [
        (14, &[0, 14, 20, 30]),
        (16, &[0, 16, 21, 30]),
        (22, &[0, 22, 27, 32, 40]),
        (35, &[0, 35, 40, 45, 50, 55, 60, 70]),
        (60, &[0, 60, 65, 70, 75, 80, 85, 90, 95, 100, 105, 110, 120]),
    ];
    for (served, expected) in cases {
        let (bench, times) = after_a_stall(served, *expected.last().expect("some"));
        assert_eq!(times, expected, "served at {served} ms");
        assert_eq!(bench.status().counters.overruns, 0);
    }
}

#[test]
fn what_a_longer_stall_delayed_is_given_up_and_counted() {
    // Of a whole second, less what passed without a frame.
    let (bench, times) = after_a_stall(153, 1_000);
    assert_eq!((times.len(), bench.status().counters.overruns), (101, 0));
    let mut bench = Bench::new(&[ConnectionSettings {
        multiplier: fieldarm::wire::enip::parameters::TimeoutMultiplier::from_factor(64).unwrap(),
        ..ConnectionSettings::meca500()
    }]);
    let start = bench.now;
    bench.open(0);
    assert_eq!(bench.frames().len(), 1);
    bench.now = start + ms(187);
    assert_eq!(bench.frames().len(), 1);
    assert_eq!(bench.status().counters.overruns, 17);
    let times: Vec<_> = bench.pass(ms(30)).into_iter().map(|(at, _)| at - start).collect();
    assert_eq!(times, [ms(192), ms(200), ms(210)], "the grid is kept");
}

#[test]
fn idle_and_run_and_outputs_are_those_of_the_moment() {
    let mut bench = Bench::meca500();
    bench.open(0);
    assert_eq!(bench.frames()[0][20..24], [1, 0, 0, 0]);
    bench.scanner.set_run(0, false);
    bench.scanner.write_outputs(0, &[7; 60]);
    bench.scanner.write_outputs(0, &[9; 59]);
    bench.now += ms(10);
    let frame = bench.frames().remove(0);
    assert_eq!(frame[20..24], [0, 0, 0, 0]);
    assert_eq!(frame[24..], [7; 60]);
    bench.scanner.set_run(0, true);
    bench.now += ms(10);
    assert_eq!(bench.frames()[0][20..24], [1, 0, 0, 0]);
}

/// Cycles of 10 ms that jitter by up to `jitter_us`, each of which asks for frames once; how many each sent.
fn beat(opened_us: u64, jitter_us: u64) -> Vec<usize> {
    let mut bench = Bench::meca500();
    bench.scanner.set_early(ms(5));
    let start = bench.now;
    bench.now = start + Duration::from_micros(opened_us);
    let id = bench.open(0);
    assert_eq!(bench.frames().len(), 1);
    let mut random = fastrand::Rng::with_seed(opened_us + jitter_us);
    let mut sent = Vec::new();
    for cycle in 1..1000_u64 {
        let late = random.u64(0..=jitter_us);
        bench.now = start + Duration::from_micros(10_000 * cycle + late);
        bench.scanner.handle_timeout(bench.now);
        bench.receive(&frame(id, cycle as u32, cycle as u16, &[0; 252]));
        bench.scanner.begin_cycle();
        sent.push(bench.frames().len());
    }
    assert_eq!(bench.status().counters.overruns, 0, "opened at {opened_us} us");
    sent
}

#[test]
fn a_caller_with_a_beat_sends_one_frame_in_each_cycle() {
    for opened_us in (0..10_000).step_by(500) {
        for jitter_us in [0, 100, 4_000] {
            let sent = beat(opened_us, jitter_us);
            // The first cycle comes shortly behind the frame that opening sends.
            assert!(sent[1..].iter().all(|count| *count == 1), "{opened_us} {jitter_us}: {sent:?}");
            assert!(sent[0] <= 1);
        }
    }
}

#[test]
fn early_is_no_more_than_half_an_interval() {
    let mut bench = Bench::meca500();
    bench.scanner.set_early(Duration::from_secs(1));
    bench.open(0);
    assert_eq!(bench.frames().len(), 1);
    bench.now += ms(4);
    assert_eq!(bench.frames().len(), 0);
    bench.now += ms(1);
    assert_eq!(bench.frames().len(), 1);
    bench.now += ms(4);
    assert_eq!(bench.frames().len(), 0);
}

#[test]
fn each_target_has_its_own_pace_and_its_own_outputs() {
    let settings = ConnectionSettings::meca500();
    let mut bench = Bench::new(&[settings, settings]);
    let open = crate::opening::open_both(&mut bench, [10_000, 20_000]);
    bench.scanner.write_outputs(0, &[1; 60]);
    bench.scanner.write_outputs(1, &[2; 60]);
    assert_ne!(open[0], open[1]);
    let deeds = bench.pass(ms(40));
    for (target, count) in [(0_usize, 5), (1, 3)] {
        let to = crate::bench::io_address(target);
        let frames: Vec<_> = deeds
            .iter()
            .filter_map(|(_, deed)| match deed {
                Deed::Datagram(found, bytes) if *found == to => Some(bytes),
                _ => None,
            })
            .collect();
        assert_eq!(frames.len(), count);
        assert!(frames.iter().all(|frame| frame[24..] == [1 + target as u8; 60]));
    }
}

#[test]
fn a_late_frame_is_not_followed_at_once_by_an_early_one() {
    let mut bench = Bench::meca500();
    bench.scanner.set_early(ms(5));
    bench.open(0);
    assert_eq!(bench.frames().len(), 1);
    // Due at 10 ms; the next one at 20 ms, so at 15 ms at the earliest, but only 1 ms behind this one.
    bench.now += ms(14);
    assert_eq!(bench.frames().len(), 1);
    bench.now += ms(1);
    assert_eq!(bench.frames().len(), 0);
    bench.now += ms(4);
    assert_eq!(bench.frames().len(), 1);
}

#[test]
fn a_cycle_that_comes_late_and_the_next_one_in_time_send_a_frame_each() {
    let mut bench = Bench::meca500();
    bench.scanner.set_early(ms(5));
    bench.open(0);
    assert_eq!(bench.frames().len(), 1);
    let start = bench.now;
    for cycle in 1..100_u32 {
        let late = [7, 0, 4, 6][cycle as usize % 4];
        bench.now = start + ms(10) * cycle + ms(late);
        bench.scanner.begin_cycle();
        assert_eq!(bench.frames().len(), 1, "cycle {cycle}, late by {late} ms");
    }
    assert_eq!(bench.status().counters.overruns, 0);
}

#[test]
fn a_caller_that_comes_too_often_gets_no_burst() {
    let mut bench = Bench::meca500();
    bench.scanner.set_early(ms(5));
    bench.open(0);
    assert_eq!(bench.frames().len(), 1);
    bench.now += ms(10);
    bench.scanner.begin_cycle();
    assert_eq!(bench.frames().len(), 1);
    // Four frames are owed when somebody asks for some each 0.1 ms.
    bench.now += ms(40);
    let mut times = Vec::new();
    for step in 0..200 {
        bench.scanner.begin_cycle();
        times.extend(bench.frames().iter().map(|_| step));
        bench.now += Duration::from_micros(100);
    }
    assert_eq!(times, [0, 25, 50, 75, 100, 150]);
}
