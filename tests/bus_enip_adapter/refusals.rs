//! The refusal matrix: Forward Open and Forward Close in bytes, and the bytes that come back.

use fieldarm::bus::enip::adapter::{Access, AdapterEvent};
use fieldarm::wire::enip::status::{ExtendedStatus, GeneralStatus};

use crate::support::Field::*;
use crate::support::{
    Field, Robot, close_request, hex, input_only, open_request, owner, peer, shown,
};

/// What a row begins with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Free,
    /// An owner with serial number 9, point-to-point.
    Owned,
    MonitoringOnly,
    Elsewhere,
    /// Eight connections.
    Full,
}
use State::*;

/// The triad of the request, as it stands in each refusal.
const TRIAD: &str = "07 00 4D 00 78 56 34 12";

type Row = (&'static str, State, &'static [(Field, &'static str)], &'static str);

/// Name, state, changes of a right request, general and extended status with size, words left.
const ROWS: &[Row] = &[
    ("class 3", Free, &[(Transport, "A3")], "01 01 03 01 | 00"),
    ("class 0", Free, &[(Transport, "00")], "01 01 03 01 | 00"),
    ("on change", Free, &[(Transport, "11")], "01 01 03 01 | 00"),
    ("multiplier", Free, &[(Multiplier, "08 00 00 00")], "01 01 08 01 | 00"),
    ("redundant O->T", Free, &[(O2tParameters, "42 C8")], "01 01 08 01 | 00"),
    ("redundant T->O", Free, &[(T2oParameters, "FE C8")], "01 01 08 01 | 00"),
    ("O->T null", Free, &[(O2tParameters, "42 08")], "01 01 23 01 | 00"),
    ("O->T multicast", Free, &[(O2tParameters, "42 28")], "01 01 23 01 | 00"),
    ("O->T reserved", Free, &[(O2tParameters, "42 68")], "01 01 23 01 | 00"),
    ("T->O null", Free, &[(T2oParameters, "FE 08")], "01 01 24 01 | 00"),
    ("T->O reserved", Free, &[(T2oParameters, "FE 68")], "01 01 24 01 | 00"),
    ("O->T short", Free, &[(O2tParameters, "41 48")], "01 02 27 01 42 00 | 00"),
    ("O->T long", Free, &[(O2tParameters, "43 48")], "01 02 27 01 42 00 | 00"),
    ("O->T variable", Free, &[(O2tParameters, "80 4A")], "01 02 27 01 42 00 | 00"),
    ("O->T without header", Free, &[(O2tParameters, "3E 48")], "01 02 27 01 42 00 | 00"),
    ("T->O short", Free, &[(T2oParameters, "FD 48")], "01 02 28 01 FE 00 | 00"),
    ("T->O long", Free, &[(T2oParameters, "FF 48")], "01 02 28 01 FE 00 | 00"),
    ("T->O multicast long", Free, &[(T2oParameters, "00 29")], "01 02 28 01 FE 00 | 00"),
    ("O->T fast", Free, &[(O2tRpi, "0F 27 00 00")], "01 01 11 01 | 00"),
    ("T->O fast", Free, &[(T2oRpi, "0F 27 00 00")], "01 01 11 01 | 00"),
    ("T->O zero", Free, &[(T2oRpi, "00 00 00 00")], "01 01 11 01 | 00"),
    ("O->T slow", Free, &[(O2tRpi, "01 D4 30 00")], "01 01 11 01 | 00"),
    ("T->O slow", Free, &[(T2oRpi, "FF FF FF FF")], "01 01 11 01 | 00"),
    ("no path", Free, &[(Path, "00")], "01 01 17 01 | 00"),
    ("class only", Free, &[(Path, "01 | 20 04")], "01 01 17 01 | 00"),
    ("one point", Free, &[(Path, "02 | 20 04 2C 64")], "01 01 17 01 | 00"),
    ("four points", Free, &[(Path, "05 | 20 04 24 97 2C 96 2C 64 2C 65")], "01 01 17 01 | 01"),
    ("other class", Free, &[(Path, "04 | 20 05 24 97 2C 96 2C 64")], "01 01 17 01 | 04"),
    ("class in 16 bits", Free, &[(Path, "05 | 21 00 04 01 24 97 2C 96 2C 64")], "01 01 17 01 | 05"),
    ("second class", Free, &[(Path, "04 | 20 04 20 04 2C 96 2C 64")], "01 01 15 03 | 03"),
    ("point first", Free, &[(Path, "03 | 2C 96 20 04 2C 64")], "01 01 15 03 | 03"),
    ("port segment", Free, &[(Path, "05 | 01 00 20 04 24 97 2C 96 2C 64")], "01 01 15 03 | 05"),
    ("attribute", Free, &[(Path, "04 | 20 04 2C 96 2C 64 30 03")], "01 01 15 03 | 01"),
    ("segment cut off", Free, &[(Path, "04 | 20 04 2C 96 2C 64 25 00")], "01 01 15 03 | 01"),
    ("key cut off", Free, &[(Path, "02 | 34 04 1D 06")], "01 01 15 03 | 02"),
    (
        "key of format 5",
        Free,
        &[(Path, "08 | 34 05 00 00 00 00 00 00 00 00 20 04 2C 96 2C 64")],
        "01 01 15 03 | 08",
    ),
    ("configuration", Free, &[(Path, "04 | 20 04 24 98 2C 96 2C 64")], "01 01 29 01 | 03"),
    (
        "configuration data",
        Free,
        &[(Path, "06 | 20 04 24 97 2C 96 2C 64 80 01 00 00")],
        "01 02 26 01 00 00 | 02",
    ),
    ("O->T point", Free, &[(Path, "04 | 20 04 24 97 2C 95 2C 64")], "01 01 2A 01 | 02"),
    ("T->O point", Free, &[(Path, "04 | 20 04 24 97 2C 96 2C 65")], "01 01 2B 01 | 01"),
    ("points exchanged", Free, &[(Path, "04 | 20 04 24 97 2C 64 2C 96")], "01 01 2F 01 | 02"),
    ("outputs twice", Free, &[(Path, "04 | 20 04 24 97 2C 96 2C 96")], "01 01 2F 01 | 02"),
    (
        "key: vendor",
        Free,
        &[(Path, "09 | 34 04 1C 06 2B 00 F4 01 0B 03 20 04 24 97 2C 96 2C 64")],
        "01 01 14 01 | 09",
    ),
    (
        "key: product",
        Free,
        &[(Path, "09 | 34 04 1D 06 2B 00 F5 01 0B 03 20 04 24 97 2C 96 2C 64")],
        "01 01 14 01 | 09",
    ),
    (
        "key: type",
        Free,
        &[(Path, "09 | 34 04 1D 06 2C 00 F4 01 0B 03 20 04 24 97 2C 96 2C 64")],
        "01 01 15 01 | 09",
    ),
    (
        "key: major",
        Free,
        &[(Path, "09 | 34 04 1D 06 2B 00 F4 01 0A 03 20 04 24 97 2C 96 2C 64")],
        "01 01 16 01 | 09",
    ),
    (
        "key: minor",
        Free,
        &[(Path, "09 | 34 04 1D 06 2B 00 F4 01 0B 02 20 04 24 97 2C 96 2C 64")],
        "01 01 16 01 | 09",
    ),
    (
        "key: compatible, newer",
        Free,
        &[(Path, "09 | 34 04 1D 06 2B 00 F4 01 8B 04 20 04 24 97 2C 96 2C 64")],
        "01 01 16 01 | 09",
    ),
    (
        "key: compatible, other major",
        Free,
        &[(Path, "09 | 34 04 1D 06 2B 00 F4 01 8A 03 20 04 24 97 2C 96 2C 64")],
        "01 01 16 01 | 09",
    ),
    ("second owner", Owned, &[], "01 01 06 01 | 00"),
    ("owner while monitoring", MonitoringOnly, &[], "01 01 06 01 | 00"),
    ("owner elsewhere", Elsewhere, &[], "01 01 06 01 | 00"),
    ("duplicate", Owned, &[(Serial, "09 00")], "01 01 00 01 | 00"),
    (
        "duplicate as input-only",
        Owned,
        &[(Serial, "09 00"), (O2tParameters, "02 48"), (Path, "03 | 20 04 2C EE 2C 64")],
        "01 01 00 01 | 00",
    ),
    (
        "nobody to listen to",
        Free,
        &[(O2tParameters, "02 48"), (Path, "03 | 20 04 2C ED 2C 64")],
        "01 01 19 01 | 00",
    ),
    (
        "no group to listen to",
        Owned,
        &[(O2tParameters, "02 48"), (T2oParameters, "FE 28"), (Path, "03 | 20 04 2C ED 2C 64")],
        "01 01 19 01 | 00",
    ),
    (
        "heartbeat with header",
        Owned,
        &[(O2tParameters, "06 48"), (Path, "03 | 20 04 2C EE 2C 64")],
        "01 02 27 01 02 00 | 00",
    ),
    (
        "ninth",
        Full,
        &[(O2tParameters, "02 48"), (Path, "03 | 20 04 2C EE 2C 64")],
        "01 01 13 01 | 00",
    ),
    (
        "ninth, group",
        Full,
        &[(O2tParameters, "02 48"), (T2oParameters, "FE 28"), (Path, "03 | 20 04 2C EE 2C 64")],
        "01 01 13 01 | 00",
    ),
];

fn robot_in(state: State) -> Robot {
    let mut robot = Robot::new();
    match state {
        Free => {}
        Owned => {
            let other = robot.session(peer(9));
            robot.open(other, &owner("09 00"));
        }
        MonitoringOnly => robot.adapter.set_access(robot.now, Access::MonitoringOnly),
        Elsewhere => robot.adapter.set_controlled_elsewhere(true),
        Full => {
            let other = robot.session(peer(9));
            for serial in 0x10..0x18 {
                robot.open(other, &input_only(&format!("{serial:02X} 00")));
            }
        }
    }
    robot.events();
    robot
}

#[test]
fn each_wrong_request_gets_its_refusal() {
    for (name, state, changes, expected) in ROWS {
        let mut robot = robot_in(*state);
        let before = robot.adapter.connections().count();
        let session = robot.session(peer(1));
        robot.frames.clear();
        let reply = robot.cip(session, &open_request(changes));
        let (status, left) = expected.split_once('|').unwrap();
        let triad = match changes.first() {
            Some((Serial, serial)) => format!("{serial} 4D 00 78 56 34 12"),
            _ => TRIAD.to_owned(),
        };
        let wanted = hex(&format!("D4 00 {status} {triad} {left} 00"));
        assert_eq!(shown(&reply), shown(&wanted), "{name}");
        assert_eq!(robot.adapter.connections().count(), before, "{name} opened something");
        assert_eq!(robot.frames, [], "{name}");
        let extended = ExtendedStatus(u16::from_le_bytes([wanted[4], wanted[5]]));
        let general = GeneralStatus::CONNECTION_FAILURE;
        let told = AdapterEvent::Refused { originator: peer(1), general, extended };
        assert_eq!(robot.events(), [told], "{name}");
        // Refused for what is wrong with it, not for good.
        if *state == Free {
            robot.open(session, &open_request(&[]));
        }
    }
}

#[test]
fn what_differs_from_the_usual_request_but_is_right_is_taken() {
    let key = |key: &str| format!("09 | 34 04 {key} 20 04 24 97 2C 96 2C 64");
    let rows: &[(&str, &[(Field, &str)])] = &[
        ("as usual", &[]),
        ("no configuration", &[(Path, "03 | 20 04 2C 96 2C 64")]),
        ("instances", &[(Path, "03 | 20 04 24 96 24 64")]),
        ("instances with configuration", &[(Path, "04 | 20 04 24 97 24 96 24 64")]),
        ("16 bits", &[(Path, "08 | 21 00 04 00 25 00 97 00 2D 00 96 00 2D 00 64 00")]),
        ("32 bits", &[(Path, "05 | 20 04 2E 00 96 00 00 00 2C 64")]),
        ("empty data", &[(Path, "05 | 20 04 24 97 2C 96 2C 64 80 00")]),
        ("production inhibit", &[(Path, "05 | 43 05 20 04 24 97 2C 96 2C 64")]),
        ("wildcard key", &[(Path, &key("00 00 00 00 00 00 00 00"))]),
        ("exact key", &[(Path, &key("1D 06 2B 00 F4 01 0B 03"))]),
        ("any minor", &[(Path, &key("1D 06 2B 00 F4 01 0B 00"))]),
        ("any major", &[(Path, &key("1D 06 2B 00 F4 01 00 07"))]),
        ("compatible", &[(Path, &key("1D 06 2B 00 F4 01 8B 03"))]),
        ("compatible, older", &[(Path, &key("1D 06 2B 00 F4 01 8B 02"))]),
        ("compatible, any", &[(Path, &key("00 00 00 00 00 00 80 00"))]),
        ("variable", &[(O2tParameters, "42 4A"), (T2oParameters, "FE 4A")]),
        ("low priority", &[(O2tParameters, "42 40"), (T2oParameters, "FE 40")]),
        ("direction bit", &[(Transport, "81")]),
        ("slowest", &[(O2tRpi, "00 D4 30 00"), (T2oRpi, "00 D4 30 00")]),
        ("manager in 16 bits", &[(Service, "54 04 21 00 06 00 25 00 01 00 | 0A 0E | 00 00 00 00")]),
    ];
    for (name, changes) in rows {
        let mut robot = Robot::new();
        let session = robot.session(peer(1));
        let opened = robot.open(session, &open_request(changes));
        assert_eq!(opened.t2o_id, 0x1122_3344, "{name}");
        assert_eq!(opened.group, None, "{name}");
        assert_eq!(robot.adapter.owner().map(|owner| owner.o2t_id), Some(opened.o2t_id), "{name}");
    }
}

#[test]
fn a_large_forward_open_does_the_same() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    let large = |o2t: &'static str| {
        open_request(&[
            (Service, "5B 02 20 06 24 01 | 0A 0E | 00 00 00 00"),
            (O2tParameters, o2t),
            (T2oParameters, "FE 00 00 48"),
        ])
    };
    let reply = robot.cip(session, &large("42 02 00 48"));
    let wanted = hex(&format!("DB 00 01 02 27 01 42 00 {TRIAD} 00 00"));
    assert_eq!(shown(&reply), shown(&wanted));
    let reply = robot.cip(session, &large("42 00 00 48"));
    assert_eq!(&reply[..4], hex("DB 00 00 00"), "{}", shown(&reply));
    assert!(robot.adapter.owner().is_some());
}

#[test]
fn a_close_needs_the_right_triad_and_nothing_else() {
    let mut robot = Robot::new();
    let (mine, other) = (robot.session(peer(1)), robot.session(peer(2)));
    robot.open(mine, &owner("07 00"));
    let reply = robot.cip(mine, &close_request("08 00"));
    assert_eq!(shown(&reply), shown(&hex("CE 00 01 01 07 01 08 00 4D 00 78 56 34 12 00 00")));
    // From another session, with a path that never was.
    let message = hex("4E 02 20 06 24 01 0A 0E 07 00 4D 00 78 56 34 12 01 00 20 77");
    let reply = robot.cip(other, &message);
    assert_eq!(shown(&reply), shown(&hex("CE 00 00 00 07 00 4D 00 78 56 34 12 00 00")));
    assert_eq!(robot.adapter.connections().count(), 0);
    let reply = robot.cip(other, &message);
    assert_eq!(shown(&reply), shown(&hex("CE 00 01 01 07 01 07 00 4D 00 78 56 34 12 00 00")));
}

#[test]
fn a_close_in_16_bit_segments_is_understood() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    robot.open(session, &owner("07 00"));
    let message = hex("4E 04 21 00 06 00 25 00 01 00 0A 0E 07 00 4D 00 78 56 34 12 00 00");
    let reply = robot.cip(session, &message);
    assert_eq!(shown(&reply), shown(&hex("CE 00 00 00 07 00 4D 00 78 56 34 12 00 00")));
}
