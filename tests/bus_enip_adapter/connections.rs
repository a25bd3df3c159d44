//! Ownership, watchdogs, run and idle, sequence numbers, endings, restart.

use fieldarm::bus::enip::ConnectionKind;
use fieldarm::bus::enip::adapter::{Access, AdapterEvent, AdapterSettings};
use fieldarm::time::Instant;

use crate::support::Field::*;
use crate::support::{
    Robot, Session, close_request, hex, input_only, ms, open_request, owner, peer,
};

fn listen_only(serial: &str) -> Vec<u8> {
    open_request(&[(Serial, serial), (O2tParameters, "02 48"), (Path, "03 | 20 04 2C ED 2C 64")])
}

fn kinds(robot: &Robot) -> Vec<ConnectionKind> {
    robot.adapter.connections().map(|connection| connection.kind).collect()
}

/// What ended, and whether by its watchdog.
fn endings(robot: &mut Robot) -> Vec<(u16, bool)> {
    let ending = |event| match event {
        AdapterEvent::Closed(status) => Some((status.triad.connection_serial, false)),
        AdapterEvent::TimedOut(status) => Some((status.triad.connection_serial, true)),
        _ => None,
    };
    robot.events().into_iter().filter_map(ending).collect()
}

fn with_session() -> (Robot, Session) {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    (robot, session)
}

#[test]
fn what_was_opened_is_told() {
    let (mut robot, session) = with_session();
    let opened =
        robot.open(session, &open_request(&[(O2tRpi, "11 27 00 00"), (T2oRpi, "A1 86 01 00")]));
    assert_eq!((opened.o2t_api_us, opened.t2o_api_us), (11_000, 101_000), "rounded up");
    let status = robot.adapter.owner().unwrap();
    assert_eq!((status.o2t_api, status.t2o_api), (ms(11), ms(101)));
    assert_eq!((status.o2t_id, status.t2o_id), (opened.o2t_id, 0x1122_3344));
    assert_eq!(status.originator, peer(1));
    assert_eq!(status.triad.connection_serial, 7);
    assert_eq!((status.triad.vendor, status.triad.originator_serial), (0x4D, 0x1234_5678));
    assert!(!status.is_multicast && !status.is_running);
    assert_eq!(robot.events(), [AdapterEvent::Opened(status)]);
    assert_eq!(robot.adapter.connections().collect::<Vec<_>>(), [status]);
}

#[test]
fn outputs_are_those_of_an_owner_that_runs() {
    let (mut robot, session) = with_session();
    let id = robot.open(session, &owner("07 00")).o2t_id;
    robot.events();
    assert_eq!(robot.adapter.outputs(), None, "nothing arrived yet");
    robot.output(peer(1), id, (500, 900), false, 1);
    assert_eq!(robot.adapter.outputs(), None, "idle");
    assert!(robot.events().is_empty());
    robot.output(peer(1), id, (501, 901), true, 2);
    assert_eq!(robot.adapter.outputs(), Some(&[2; 60][..]));
    robot.output(peer(1), id, (502, 902), true, 3);
    assert_eq!(robot.adapter.outputs(), Some(&[3; 60][..]));
    assert_eq!(robot.events(), [AdapterEvent::RunChanged { is_running: true }]);
    robot.output(peer(1), id, (503, 903), false, 4);
    assert_eq!(robot.adapter.outputs(), None);
    assert_eq!(robot.events(), [AdapterEvent::RunChanged { is_running: false }]);
    assert!(!robot.adapter.owner().unwrap().is_running);
}

#[test]
fn frames_come_from_the_originator_under_the_right_id() {
    let (mut robot, session) = with_session();
    let opened = robot.open(session, &owner("07 00"));
    robot.output(peer(2), opened.o2t_id, (1, 1), true, 1);
    robot.output(peer(1), opened.o2t_id ^ 1, (1, 1), true, 1);
    robot.output(peer(1), opened.t2o_id, (1, 1), true, 1);
    assert_eq!(robot.adapter.outputs(), None);
    robot.output(peer(1), opened.o2t_id, (1, 1), true, 1);
    assert_eq!(robot.adapter.outputs(), Some(&[1; 60][..]));
}

#[test]
fn duplicates_and_older_frames_are_dropped_across_the_wrap() {
    let (mut robot, session) = with_session();
    let id = robot.open(session, &owner("07 00")).o2t_id;
    // Encapsulation sequence, sequence count, the byte sent, the byte that stands then.
    let rows = [
        (0xFFFF_FFFE_u32, 0xFFFE_u16, 1_u8, 1_u8),
        (0xFFFF_FFFE, 0xFFFF, 2, 1),
        (0xFFFF_FFFD, 0xFFFF, 3, 1),
        (0x7FFF_FFFE, 0xFFFF, 4, 1),
        (0xFFFF_FFFF, 0xFFFF, 5, 5),
        (0x0000_0000, 0x0000, 6, 6),
        (0xFFFF_FFFF, 0x0001, 7, 6),
        (0x0000_0001, 0x0000, 8, 6),
        (0x0000_0005, 0x0003, 9, 9),
        (0x0000_0004, 0x0002, 10, 9),
        (0x8000_0004, 0x0004, 11, 11),
    ];
    for (sequence, count, sent, stands) in rows {
        robot.output(peer(1), id, (sequence, count), true, sent);
        assert_eq!(robot.adapter.outputs(), Some(&[stands; 60][..]), "{sequence:X} {count:X}");
    }
}

#[test]
fn a_repeated_sequence_count_feeds_the_watchdog_and_says_run_or_idle() {
    let (mut robot, session) = with_session();
    let id = robot.open(session, &owner("07 00")).o2t_id;
    robot.output(peer(1), id, (1, 1), true, 1);
    for sequence in 2..40 {
        robot.advance(ms(150));
        robot.output(peer(1), id, (sequence, 1), true, 2);
        assert_eq!(robot.adapter.outputs(), Some(&[1; 60][..]));
    }
    robot.output(peer(1), id, (40, 1), false, 2);
    assert_eq!(robot.adapter.outputs(), None);
}

#[test]
fn a_frame_that_is_dropped_does_not_feed_the_watchdog() {
    let (mut robot, session) = with_session();
    let id = robot.open(session, &owner("07 00")).o2t_id;
    robot.output(peer(1), id, (5, 5), true, 1);
    for count in 0..20 {
        robot.output(peer(1), id, (5, 6 + count), true, 1);
        robot.output(peer(1), id, (4, 6 + count), true, 1);
        robot.frame(peer(1), id, (6, 6 + count), &[1; 63]);
        robot.frame(peer(1), id, (6, 6 + count), &[1; 65]);
        robot.frame(peer(1), id, (6, 6 + count), &[]);
        robot.advance(ms(10));
    }
    assert_eq!(robot.adapter.outputs(), None);
    assert!(kinds(&robot).is_empty());
}

#[test]
fn the_first_frame_may_take_ten_seconds() {
    let (mut robot, session) = with_session();
    robot.open(session, &owner("07 00"));
    robot.advance(ms(9_999));
    assert!(robot.adapter.owner().is_some());
    robot.advance(ms(1));
    assert_eq!(robot.adapter.owner(), None);
    assert_eq!(endings(&mut robot), [(7, true)]);
    // Nothing is left but the TCP connection, which may be silent from now on for as long as any.
    assert_eq!(robot.adapter.poll_timeout(), Some(robot.now + ms(120_000)));
    // The same triad is free again.
    robot.open(session, &owner("07 00"));
}

#[test]
fn the_watchdog_is_the_api_times_the_multiplier() {
    for (wire, factor) in [4, 8, 16, 32, 64, 128, 256, 512_u64].into_iter().enumerate() {
        let (mut robot, session) = with_session();
        let multiplier: &'static str = format!("{wire:02X} 00 00 00").leak();
        let id = robot.open(session, &open_request(&[(Multiplier, multiplier)])).o2t_id;
        robot.output(peer(1), id, (1, 1), true, 1);
        robot.advance(ms(10 * factor - 1));
        assert!(robot.adapter.outputs().is_some(), "x{factor}");
        robot.advance(ms(1));
        assert_eq!(robot.adapter.outputs(), None, "x{factor}");
        assert_eq!(endings(&mut robot), [(7, true)]);
    }
}

#[test]
fn the_longest_watchdog_does_not_overflow() {
    let (mut robot, session) = with_session();
    let slow = "00 D4 30 00";
    let request = open_request(&[(Multiplier, "07 00 00 00"), (O2tRpi, slow), (T2oRpi, slow)]);
    let id = robot.open(session, &request).o2t_id;
    // Longer than the initial watchdog: 3.2 s x 512.
    robot.advance(ms(3_200 * 512 - 1));
    robot.output(peer(1), id, (1, 1), true, 1);
    robot.advance(ms(3_200 * 512 - 1));
    assert!(robot.adapter.outputs().is_some());
    robot.advance(ms(1));
    assert_eq!(robot.adapter.outputs(), None);
}

#[test]
fn a_late_caller_does_not_revive_an_expired_connection() {
    let (mut robot, session) = with_session();
    let id = robot.open(session, &owner("07 00")).o2t_id;
    robot.output(peer(1), id, (1, 1), true, 1);
    robot.now += ms(160);
    robot.output(peer(1), id, (2, 2), true, 2);
    assert_eq!(robot.adapter.outputs(), None);
    assert!(kinds(&robot).is_empty());
}

#[test]
fn the_initial_watchdog_is_a_setting() {
    let settings = AdapterSettings { initial_watchdog: ms(300), ..AdapterSettings::meca500() };
    let mut robot = Robot::with(settings);
    let session = robot.session(peer(1));
    robot.open(session, &owner("07 00"));
    robot.advance(ms(299));
    assert!(robot.adapter.owner().is_some());
    robot.advance(ms(1));
    assert_eq!(robot.adapter.owner(), None);
}

#[test]
fn a_connection_outlives_its_stream() {
    let (mut robot, session) = with_session();
    let id = robot.open(session, &owner("07 00")).o2t_id;
    robot.adapter.handle_stream_closed(robot.now, session.stream);
    robot.frames.clear();
    for sequence in 0..100 {
        robot.output(peer(1), id, (sequence, sequence as u16), true, sequence as u8);
        robot.advance(ms(10));
        assert_eq!(robot.adapter.outputs(), Some(&[sequence as u8; 60][..]));
    }
    assert_eq!(robot.frames.len(), 100);
    // It can be closed from another one.
    let session = robot.session(peer(1));
    assert_eq!(robot.cip(session, &close_request("07 00"))[2], 0);
}

#[test]
fn without_heartbeats_a_connection_ends_with_its_stream() {
    let (mut robot, session) = with_session();
    let other = robot.session(peer(2));
    let silent = open_request(&[
        (Serial, "08 00"),
        (O2tRpi, "00 00 00 00"),
        (O2tParameters, "00 00"),
        (Path, "03 | 20 04 2C EE 2C 64"),
    ]);
    robot.open(session, &silent);
    robot.open(other, &input_only("09 00"));
    robot.frames.clear();
    robot.advance(ms(60_000));
    assert_eq!(endings(&mut robot), [(9, true)], "only who promised heartbeats is missed");
    robot.adapter.handle_stream_closed(robot.now, other.stream);
    assert_eq!(kinds(&robot), [ConnectionKind::InputOnly]);
    robot.adapter.handle_stream_closed(robot.now, session.stream);
    assert_eq!(endings(&mut robot), [(8, false)]);
    assert_eq!(robot.adapter.poll_timeout(), None);
}

#[test]
fn heartbeats_keep_an_input_only_connection() {
    let (mut robot, session) = with_session();
    let opened = robot.open(session, &input_only("07 00"));
    for sequence in 0..100 {
        robot.frame(peer(1), opened.o2t_id, (sequence, 0), &[]);
        robot.advance(ms(159));
    }
    assert_eq!(kinds(&robot), [ConnectionKind::InputOnly]);
    assert_eq!(robot.adapter.outputs(), None);
    // With data it is no heartbeat.
    robot.frame(peer(1), opened.o2t_id, (200, 0), &[1, 0, 0, 0]);
    robot.advance(ms(1));
    assert_eq!(endings(&mut robot), [(7, true)]);
}

#[test]
fn ownership_is_handed_over_when_it_is_given_up_or_lost() {
    let (mut robot, first) = with_session();
    let second = robot.session(peer(2));
    let one = robot.open(first, &owner("07 00")).o2t_id;
    robot.output(peer(1), one, (1, 1), true, 1);
    assert_eq!(&robot.cip(second, &owner("08 00"))[2..6], hex("01 01 06 01"));
    assert_eq!(robot.adapter.outputs(), Some(&[1; 60][..]), "the refused one changes nothing");

    robot.cip(first, &close_request("07 00"));
    assert_eq!(robot.adapter.outputs(), None);
    let two = robot.open(second, &owner("08 00")).o2t_id;
    assert_ne!(one, two);
    assert_eq!(robot.adapter.outputs(), None, "nothing of the first owner is left");
    robot.output(peer(1), one, (2, 2), true, 1);
    assert_eq!(robot.adapter.outputs(), None);
    robot.output(peer(2), two, (1, 1), true, 2);
    assert_eq!(robot.adapter.outputs(), Some(&[2; 60][..]));

    robot.advance(ms(159));
    assert_eq!(&robot.cip(first, &owner("09 00"))[2..6], hex("01 01 06 01"));
    robot.advance(ms(1));
    robot.open(first, &owner("09 00"));
}

#[test]
fn listening_point_to_point_ends_with_the_last_of_the_others() {
    let (mut robot, session) = with_session();
    robot.open(session, &owner("07 00"));
    robot.open(session, &input_only("08 00"));
    robot.open(session, &listen_only("09 00"));
    robot.open(session, &listen_only("0A 00"));
    robot.cip(session, &close_request("07 00"));
    assert_eq!(endings(&mut robot), [(7, false)]);
    robot.cip(session, &close_request("08 00"));
    let mut ended = endings(&mut robot);
    ended.sort_unstable();
    assert_eq!(ended, [(8, false), (9, false), (10, false)]);
    robot.frames.clear();
    robot.advance(ms(100));
    assert!(robot.frames.is_empty());
}

#[test]
fn listening_ends_when_the_owner_times_out() {
    let (mut robot, session) = with_session();
    let id = robot.open(session, &owner("07 00")).o2t_id;
    robot.open(session, &listen_only("09 00"));
    robot.output(peer(1), id, (1, 1), true, 1);
    robot.advance(ms(160));
    assert_eq!(endings(&mut robot), [(7, true), (9, false)]);
}

#[test]
fn monitoring_only_ends_the_owner_and_nothing_else() {
    let (mut robot, session) = with_session();
    robot.open(session, &owner("07 00"));
    robot.open(session, &input_only("08 00"));
    robot.adapter.set_access(robot.now, Access::MonitoringOnly);
    assert_eq!(endings(&mut robot), [(7, false)]);
    assert_eq!(kinds(&robot), [ConnectionKind::InputOnly]);
    robot.open(session, &listen_only("09 00"));
    robot.adapter.set_access(robot.now, Access::Full);
    robot.open(session, &owner("07 00"));
}

#[test]
fn control_elsewhere_keeps_owners_out_but_not_monitors() {
    let (mut robot, session) = with_session();
    robot.adapter.set_controlled_elsewhere(true);
    assert_eq!(&robot.cip(session, &owner("07 00"))[2..6], hex("01 01 06 01"));
    robot.open(session, &input_only("08 00"));
    robot.adapter.set_controlled_elsewhere(false);
    robot.open(session, &owner("07 00"));
    robot.adapter.set_controlled_elsewhere(true);
    assert!(robot.adapter.owner().is_some(), "who was first stays");
}

#[test]
fn a_restart_forgets_everything_but_access_and_ids() {
    let (mut robot, session) = with_session();
    robot.adapter.set_inputs(&[9; 252], &[9; 252]);
    let before = robot.open(session, &owner("07 00"));
    robot.output(peer(1), before.o2t_id, (1, 1), true, 1);
    // The same seed must not bring back the same ids.
    robot.adapter.restart(1);
    assert_eq!((robot.adapter.outputs(), robot.adapter.owner()), (None, None));
    assert_eq!((robot.adapter.poll_timeout(), robot.adapter.poll_event()), (None, None));
    robot.closed.clear();
    assert!(robot.feed(session.stream, &crate::support::packet(0x63, 0, &[])).is_empty());
    assert!(robot.closed.is_empty(), "without a word");

    let session = robot.session(peer(1));
    robot.frames.clear();
    let after = robot.open(session, &owner("07 00"));
    assert_ne!(before.o2t_id, after.o2t_id);
    assert_eq!(robot.frames[0].image(), [0; 252]);
    robot.output(peer(1), before.o2t_id, (2, 2), true, 1);
    assert_eq!(robot.adapter.outputs(), None, "frames of the old life do not count");
    robot.output(peer(1), after.o2t_id, (1, 1), true, 3);
    assert_eq!(robot.adapter.outputs(), Some(&[3; 60][..]));

    robot.adapter.set_access(Instant::ZERO, Access::MonitoringOnly);
    robot.adapter.restart(2);
    let session = robot.session(peer(1));
    assert_eq!(&robot.cip(session, &owner("07 00"))[2..6], hex("01 01 06 01"));
}
