//! Multicast T->O: shared productions, their groups, and who keeps them alive.

use std::net::{Ipv4Addr, SocketAddrV4};

use fieldarm::bus::enip::adapter::ConnectionStatus;

use crate::support::Field::*;
use crate::support::{GROUP, Robot, close_request, hex, ms, open_request, peer};

fn group(number: u8) -> Option<SocketAddrV4> {
    let [a, b, c, d] = GROUP.octets();
    Some(SocketAddrV4::new(Ipv4Addr::new(a, b, c, d + number), 2_222))
}

fn multicast(serial: &str, rpi: &str, path: &str) -> Vec<u8> {
    let o2t = if path.contains("96") { "42 48" } else { "02 48" };
    let changes = [
        (Serial, serial),
        (O2tParameters, o2t),
        (T2oRpi, rpi),
        (T2oParameters, "FE 28"),
        (Multiplier, "07 00 00 00"),
        (Path, path),
    ];
    open_request(&changes)
}

const OWNER: &str = "04 | 20 04 24 97 2C 96 2C 64";
const INPUT_ONLY: &str = "03 | 20 04 2C EE 2C 64";
const LISTEN_ONLY: &str = "03 | 20 04 2C ED 2C 64";
const MS_10: &str = "10 27 00 00";
const MS_20: &str = "20 4E 00 00";
const MS_50: &str = "50 C3 00 00";

#[test]
fn slower_requests_share_what_the_first_one_gets() {
    let mut robot = Robot::new();
    let (one, two) = (robot.session(peer(1)), robot.session(peer(2)));
    robot.adapter.set_inputs(&[1; 252], &[2; 252]);
    let first = robot.open(one, &multicast("07 00", MS_20, OWNER));
    assert_eq!((first.group, first.t2o_api_us), (group(0), 20_000));
    assert_ne!(first.t2o_id, 0x1122_3344, "the id of a group is the robot's choice");
    let second = robot.open(two, &multicast("08 00", MS_50, INPUT_ONLY));
    let third = robot.open(two, &multicast("09 00", MS_20, LISTEN_ONLY));
    for other in [second, third] {
        assert_eq!((other.group, other.t2o_api_us), (group(0), 20_000));
        assert_eq!(other.t2o_id, first.t2o_id);
        assert_ne!(other.o2t_id, first.o2t_id);
    }
    robot.frames.clear();
    robot.advance(ms(200));
    assert_eq!(robot.frames.len(), 10, "one frame for all");
    assert!(robot.frames.iter().all(|frame| Some(frame.to) == group(0)));
    assert!(robot.frames.iter().all(|frame| frame.image() == [1; 252]));
    assert!(robot.adapter.connections().all(|connection| connection.is_multicast));
}

#[test]
fn a_faster_request_gets_a_group_of_its_own() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    let slow = robot.open(session, &multicast("07 00", MS_50, INPUT_ONLY));
    let fast = robot.open(session, &multicast("08 00", MS_10, OWNER));
    assert_eq!((slow.group, slow.t2o_api_us), (group(0), 50_000));
    assert_eq!((fast.group, fast.t2o_api_us), (group(1), 10_000));
    assert_ne!(slow.t2o_id, fast.t2o_id);
    // The slowest that is fast enough; who only listens takes the fastest there is.
    let middle = robot.open(session, &multicast("09 00", MS_20, INPUT_ONLY));
    assert_eq!((middle.group, middle.t2o_api_us), (group(1), 10_000));
    let listener = robot.open(session, &multicast("0A 00", MS_50, LISTEN_ONLY));
    assert_eq!(listener.group, group(0));
    robot.cip(session, &close_request("08 00"));
    robot.cip(session, &close_request("09 00"));
    let listener = robot.open(session, &multicast("0B 00", MS_10, LISTEN_ONLY));
    assert_eq!((listener.group, listener.t2o_api_us), (group(0), 50_000));
    // The group that was left is free again.
    let again = robot.open(session, &multicast("0C 00", MS_10, OWNER));
    assert_eq!(again.group, group(1));
    assert_ne!(again.t2o_id, fast.t2o_id);
}

#[test]
fn a_group_goes_on_until_the_last_who_is_more_than_a_listener() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    robot.open(session, &multicast("07 00", MS_10, OWNER));
    robot.open(session, &multicast("08 00", MS_10, INPUT_ONLY));
    robot.open(session, &multicast("09 00", MS_10, LISTEN_ONLY));
    // Not on the group: it keeps no listener of the group.
    robot.open(session, &crate::support::input_only("0A 00"));
    robot.cip(session, &close_request("07 00"));
    robot.frames.clear();
    robot.advance(ms(50));
    let to_group = |robot: &Robot| robot.frames.iter().filter(|it| Some(it.to) == group(0)).count();
    assert_eq!(to_group(&robot), 5);
    robot.cip(session, &close_request("08 00"));
    let left: Vec<_> = robot.adapter.connections().map(|it| it.triad.connection_serial).collect();
    assert_eq!(left, [0x0A]);
    robot.frames.clear();
    robot.advance(ms(50));
    assert_eq!(to_group(&robot), 0);
    let reply = robot.cip(session, &multicast("0B 00", MS_10, LISTEN_ONLY));
    assert_eq!(&reply[2..6], hex("01 01 19 01"));
}

#[test]
fn a_group_without_an_owner_says_that_it_only_monitors() {
    let mut robot = Robot::new();
    let (one, two) = (robot.session(peer(1)), robot.session(peer(2)));
    robot.adapter.set_inputs(&[1; 252], &[2; 252]);
    let images = |robot: &mut Robot| {
        robot.frames.clear();
        robot.advance(ms(20));
        robot.frames.iter().map(|frame| (frame.image()[0], frame.count())).collect::<Vec<_>>()
    };
    robot.open(two, &multicast("08 00", MS_10, INPUT_ONLY));
    robot.flush();
    assert_eq!(images(&mut robot), [(2, 1), (2, 1)]);
    robot.open(one, &multicast("07 00", MS_10, OWNER));
    assert_eq!(images(&mut robot), [(1, 2), (1, 2)]);
    // The owner's frames get lost: it still hears the group, and must learn that it controls nothing. What it
    // hears counts as new.
    let serial = |connection: &ConnectionStatus| connection.triad.connection_serial;
    let monitor = robot.adapter.connections().find(|it| serial(it) == 8).unwrap().o2t_id;
    robot.advance(ms(9_000));
    robot.frame(peer(2), monitor, (1, 1), &[]);
    robot.advance(ms(1_000));
    assert_eq!(robot.adapter.connections().map(|it| serial(&it)).collect::<Vec<_>>(), [8]);
    assert_eq!(images(&mut robot), [(2, 3), (2, 3)]);
}

#[test]
fn the_sequence_goes_on_when_the_first_of_a_group_leaves() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    robot.open(session, &multicast("07 00", MS_10, OWNER));
    robot.open(session, &multicast("08 00", MS_10, INPUT_ONLY));
    robot.advance(ms(50));
    robot.cip(session, &close_request("07 00"));
    robot.advance(ms(50));
    robot.open(session, &multicast("09 00", MS_10, OWNER));
    robot.advance(ms(50));
    let sequences: Vec<_> = robot.frames.iter().map(|frame| frame.sequence()).collect();
    assert_eq!(sequences, (1..=16).collect::<Vec<_>>());
}

#[test]
fn a_socket_address_in_the_request_does_not_move_the_group() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    let item = hex("01 80 10 00 00 02 30 39 EF 01 02 03 00 00 00 00 00 00 00 00");
    let opened = robot.open_with(session, &multicast("07 00", MS_10, OWNER), &[&item]);
    assert_eq!(opened.group, group(0));
    assert_eq!(Some(robot.frames[0].to), group(0));
}
