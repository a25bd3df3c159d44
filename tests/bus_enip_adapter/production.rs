//! When T->O frames are produced, to whom, with which numbers.

use std::net::{Ipv4Addr, SocketAddrV4};

use fieldarm::time::Duration;

use crate::support::Field::*;
use crate::support::{Frame, Robot, hex, input_only, ms, open_request, owner, peer, shown};

#[test]
fn the_first_frame_follows_the_reply_and_is_right_byte_for_byte() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    robot.adapter.set_inputs(&[0xAB; 252], &[0xCD; 252]);
    robot.open(session, &owner("07 00"));
    let [frame] = &robot.frames[..] else { panic!("{} frames", robot.frames.len()) };
    assert_eq!((frame.at, frame.bytes.len()), (robot.now, 272));
    assert_eq!(frame.to, SocketAddrV4::new(*peer(1).ip(), 2_222));
    let head = hex("02 00 | 02 80 08 00 44 33 22 11 01 00 00 00 | B1 00 FE 00 01 00");
    assert_eq!(shown(&frame.bytes[..20]), shown(&head));
    assert_eq!(frame.image(), [0xAB; 252]);
}

/// Frames for two minutes of an owner at `api`, with calls that come up to 4 ms late.
fn two_minutes(rpi: &'static str) -> Vec<Frame> {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    let request = open_request(&[(T2oRpi, rpi), (Multiplier, "07 00 00 00")]);
    let id = robot.open(session, &request).o2t_id;
    let end = robot.now + ms(120_000);
    let mut random = 1_u32;
    let mut sequence = 0;
    while robot.now < end {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let late = Duration::from_micros(u64::from(random >> 16) % 4_000);
        robot.now = robot.adapter.poll_timeout().unwrap() + late;
        robot.adapter.handle_timeout(robot.now);
        robot.flush();
        robot.output(peer(1), id, (sequence, 0), true, 0);
        sequence += 1;
    }
    robot.frames
}

#[test]
fn the_mean_gap_is_the_api_however_late_single_calls_are() {
    for (rpi, api_us) in [("10 27 00 00", 10_000_u64), ("01 30 00 00", 13_000)] {
        let frames = two_minutes(rpi);
        let (first, last) = (&frames[0], &frames[frames.len() - 1]);
        let intervals = frames.len() as u64 - 1;
        let due = first.at + Duration::from_micros(api_us * intervals);
        assert!(last.at >= due && last.at - due < ms(4), "{api_us} us: {intervals} intervals");
        for (number, frame) in frames.iter().enumerate() {
            assert_eq!(frame.sequence(), number as u32 + 1);
        }
    }
}

#[test]
fn without_delays_each_gap_is_the_api() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    robot.open(session, &open_request(&[(T2oRpi, "20 4E 00 00")]));
    robot.advance(ms(5_000));
    assert_eq!(robot.frames.len(), 251);
    for pair in robot.frames.windows(2) {
        assert_eq!(pair[1].at - pair[0].at, ms(20));
    }
}

/// When frames leave, in ms behind the first, of a robot that nobody serves until `served_ms`, and then whenever it
/// wants to be. Each must carry the inputs of its moment and the next number.
fn after_a_stall(served_ms: u64, end_ms: u64) -> (Robot, Vec<u64>) {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    robot.open(session, &open_request(&[(Multiplier, "07 00 00 00")]));
    let start = robot.now;
    let end = start + ms(end_ms);
    robot.now = start + ms(served_ms);
    while robot.now <= end {
        let mark = robot.frames.len() as u8;
        robot.adapter.set_inputs(&[mark; 252], &[0xFF; 252]);
        robot.adapter.handle_timeout(robot.now);
        robot.flush();
        robot.now = robot.now.max(robot.adapter.poll_timeout().unwrap());
    }
    for (number, frame) in robot.frames.iter().enumerate() {
        assert_eq!((frame.sequence(), frame.count()), (number as u32 + 1, number as u16 + 1));
        assert_eq!(frame.image(), [number as u8; 252]);
    }
    let times = robot.frames.iter().map(|frame| ((frame.at - start).as_micros() / 1_000) as u64);
    let times = times.collect();
    (robot, times)
}

#[test]
fn what_a_stall_delayed_is_made_up_for_half_an_interval_apart() {
    let cases: [(u64, &[u64]); 5] = [
        (14, &[0, 14, 20, 30]),
        (16, &[0, 16, 21, 30]),
        (22, &[0, 22, 27, 32, 40]),
        (35, &[0, 35, 40, 45, 50, 55, 60, 70]),
        (57, &[0, 57, 62, 67, 72, 77, 82, 87, 92, 97, 102, 110]),
    ];
    for (served, expected) in cases {
        let (robot, times) = after_a_stall(served, *expected.last().unwrap());
        assert_eq!(times, expected, "served at {served} ms");
        assert_eq!(robot.adapter.frames_given_up(), 0);
    }
}

#[test]
fn a_longer_stall_is_given_up_and_counted_and_the_grid_is_kept() {
    let (robot, times) = after_a_stall(173, 1_000);
    assert_eq!((times.len(), robot.adapter.frames_given_up()), (101, 0));
    let (robot, times) = after_a_stall(187, 1_000);
    assert_eq!((times.len(), robot.adapter.frames_given_up()), (101 - 17, 17));
    assert_eq!(times[..4], [0, 187, 192, 200]);
}

#[test]
fn the_sequence_count_tells_new_inputs() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    robot.open(session, &owner("07 00"));
    robot.advance(ms(20));
    robot.adapter.set_inputs(&[1; 252], &[1; 252]);
    robot.adapter.set_inputs(&[2; 252], &[2; 252]);
    robot.advance(ms(20));
    robot.adapter.set_inputs(&[2; 252], &[2; 252]);
    robot.advance(ms(10));
    // Other lengths change nothing.
    robot.adapter.set_inputs(&[3; 251], &[3; 252]);
    robot.adapter.set_inputs(&[3; 252], &[3; 253]);
    robot.advance(ms(10));
    let counts: Vec<_> = robot.frames.iter().map(Frame::count).collect();
    assert_eq!(counts, [1, 1, 1, 2, 2, 3, 3]);
    let first: Vec<_> = robot.frames.iter().map(|frame| frame.image()[0]).collect();
    assert_eq!(first, [0, 0, 0, 2, 2, 2, 2]);
}

#[test]
fn the_sequence_count_wraps() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    let id = robot.open(session, &owner("07 00")).o2t_id;
    for number in 1..=0x1_0001_u32 {
        robot.adapter.set_inputs(&[0; 252], &[0; 252]);
        robot.output(peer(1), id, (number, 0), true, 0);
        robot.frames.clear();
        robot.advance(ms(10));
        assert_eq!(robot.frames.len(), 1);
        assert_eq!(robot.frames[0].count(), (number + 1) as u16);
        assert_eq!(robot.frames[0].sequence(), number + 1);
    }
}

#[test]
fn frames_go_to_the_peer_at_the_port_it_names() {
    let item = |port: &str, address: &str| {
        hex(&format!("01 80 10 00 00 02 {port} {address} 00 00 00 00 00 00 00 00"))
    };
    let rows = [
        (item("30 39", "00 00 00 00"), 12_345),
        (item("30 39", "C0 A8 00 01"), 12_345),
        // Somebody else's address is not heeded.
        (item("30 39", "C0 A8 00 63"), 12_345),
        (item("00 00", "00 00 00 00"), 2_222),
        // O->T, which is not ours to know.
        (hex("00 80 10 00 00 02 30 39 00 00 00 00 00 00 00 00 00 00 00 00"), 2_222),
    ];
    for (item, port) in rows {
        let mut robot = Robot::new();
        let session = robot.session(peer(1));
        let opened = robot.open_with(session, &owner("07 00"), &[&item]);
        assert_eq!(opened.group, None);
        assert_eq!(robot.frames[0].to, SocketAddrV4::new(Ipv4Addr::new(192, 168, 0, 1), port));
    }
}

#[test]
fn point_to_point_connections_are_independent() {
    let mut robot = Robot::new();
    let (one, two) = (robot.session(peer(1)), robot.session(peer(2)));
    robot.adapter.set_inputs(&[1; 252], &[2; 252]);
    robot.open(one, &owner("07 00"));
    let mut slow = input_only("08 00");
    // Another id and RPI: 30 ms.
    slow[12..16].copy_from_slice(&hex("99 00 00 00"));
    let at = slow.len() - 14;
    assert_eq!(&slow[at..at + 4], hex("10 27 00 00"));
    slow[at..at + 4].copy_from_slice(&hex("30 75 00 00"));
    let opened = robot.open(two, &slow);
    assert_eq!(opened.t2o_api_us, 30_000);
    robot.frames.clear();
    robot.advance(ms(300));
    let (owners, monitors): (Vec<_>, Vec<_>) =
        robot.frames.iter().partition(|frame| frame.to.ip() == peer(1).ip());
    assert_eq!((owners.len(), monitors.len()), (30, 10));
    assert!(owners.iter().all(|frame| frame.id() == 0x1122_3344 && frame.image() == [1; 252]));
    assert!(monitors.iter().all(|frame| frame.id() == 0x99 && frame.image() == [2; 252]));
    let sequences: Vec<_> = monitors.iter().map(|frame| frame.sequence()).collect();
    assert_eq!(sequences, (2..12).collect::<Vec<_>>());
}
