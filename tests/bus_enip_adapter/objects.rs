//! Explicit messages: each object, each status.

use fieldarm::bus::enip::adapter::{AdapterEvent, AdapterSettings, MAX_IMAGE_LEN};

use crate::support::{Field, Robot, hex, open_request, peer, shown};

/// Request and response, in a fresh session.
fn check(rows: &[(&str, &str)]) {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    for (request, response) in rows {
        let got = robot.cip(session, &hex(request));
        assert_eq!(shown(&got), shown(&hex(response)), "{request}");
    }
}

#[test]
fn identity() {
    check(&[
        ("0E 03 20 01 24 01 30 01", "8E 00 00 00 1D 06"),
        ("0E 03 20 01 24 01 30 02", "8E 00 00 00 2B 00"),
        ("0E 03 20 01 24 01 30 03", "8E 00 00 00 F4 01"),
        ("0E 03 20 01 24 01 30 04", "8E 00 00 00 0B 03"),
        ("0E 03 20 01 24 01 30 05", "8E 00 00 00 30 00"),
        ("0E 03 20 01 24 01 30 06", "8E 00 00 00 00 00 00 00"),
        ("0E 03 20 01 24 01 30 07", "8E 00 00 00 07 4D 65 63 61 35 30 30"),
        ("0E 03 20 01 24 01 30 08", "8E 00 00 00 03"),
        ("0E 03 20 01 24 01 30 09", "8E 00 14 00"),
        ("0E 05 21 00 01 00 24 01 31 00 01 00", "8E 00 00 00 1D 06"),
        (
            "01 02 20 01 24 01",
            "81 00 00 00 1D 06 2B 00 F4 01 0B 03 30 00 00 00 00 00 07 4D 65 63 61 35 30 30",
        ),
        ("01 02 20 01 24 01 00", "81 00 15 00"),
        (
            "03 02 20 01 24 01 02 00 01 00 04 00",
            "83 00 00 00 02 00 01 00 00 00 1D 06 04 00 00 00 0B 03",
        ),
        ("03 02 20 01 24 01 02 00 63 00 03 00", "83 00 0A 00 02 00 63 00 14 00 03 00 00 00 F4 01"),
        ("03 02 20 01 24 01 00 00", "83 00 00 00 00 00"),
        ("03 02 20 01 24 01", "83 00 13 00"),
        ("03 02 20 01 24 01 02 00 01 00", "83 00 13 00"),
        ("03 02 20 01 24 01 01 00 01 00 00", "83 00 15 00"),
        ("10 03 20 01 24 01 30 01 1D 06", "90 00 0E 00"),
        ("10 03 20 01 24 01 30 09 1D 06", "90 00 14 00"),
        ("0E 03 20 01 24 01 30 01 00", "8E 00 15 00"),
        ("0E 02 20 01 30 01", "8E 00 00 00 01 00"),
        ("0E 03 20 01 24 00 30 02", "8E 00 00 00 01 00"),
        ("0E 03 20 01 24 00 30 03", "8E 00 00 00 01 00"),
        ("0E 03 20 01 24 00 30 04", "8E 00 14 00"),
        ("01 02 20 01 24 00", "81 00 08 00"),
    ]);
}

#[test]
fn a_list_that_does_not_fit_is_refused() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    let list = |count: u16| {
        let numbers = (0..count).flat_map(|_| [7, 0]);
        let head = hex("03 02 20 01 24 01").into_iter().chain(count.to_le_bytes());
        head.chain(numbers).collect::<Vec<_>>()
    };
    // 12 bytes each in 554.
    let fits = robot.cip(session, &list(46));
    assert_eq!((&fits[..4], fits.len()), (&hex("83 00 00 00")[..], 4 + 2 + 46 * 12));
    assert_eq!(robot.cip(session, &list(47)), hex("83 00 11 00"));
}

#[test]
fn a_reset_is_told_and_not_done() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    robot.open(session, &open_request(&[]));
    let rows = [
        ("05 02 20 01 24 01", "85 00 00 00", 1),
        ("05 02 20 01 24 01 00", "85 00 00 00", 1),
        ("05 02 20 01 24 01 01", "85 00 00 00", 1),
        ("05 02 20 01 24 01 02", "85 00 20 00", 0),
        ("05 02 20 01 24 01 00 00", "85 00 15 00", 0),
        ("05 02 20 01 24 00", "85 00 08 00", 0),
        ("05 02 20 06 24 01", "85 00 08 00", 0),
        ("05 03 20 01 24 01 30 01", "85 00 04 00", 0),
    ];
    robot.events();
    for (request, response, resets) in rows {
        assert_eq!(robot.cip(session, &hex(request)), hex(response), "{request}");
        let events = robot.events();
        assert_eq!(events, vec![AdapterEvent::ResetRequested; resets], "{request}");
    }
    assert!(robot.adapter.owner().is_some());
}

#[test]
fn message_router() {
    check(&[
        ("0E 03 20 02 24 01 30 01", "8E 00 00 00 07 00 01 00 02 00 04 00 06 00 48 00 F5 00 F6 00"),
        ("0E 03 20 02 24 01 30 02", "8E 00 00 00 08 00"),
        ("0E 03 20 02 24 01 30 03", "8E 00 00 00 00 00"),
        ("0E 03 20 02 24 01 30 04", "8E 00 14 00"),
        ("01 02 20 02 24 01", "81 00 08 00"),
    ]);
}

#[test]
fn assembly() {
    check(&[
        ("0E 03 20 04 24 64 30 04", "8E 00 00 00 FC 00"),
        ("0E 03 20 04 24 96 30 04", "8E 00 00 00 3C 00"),
        ("0E 03 20 04 24 97 30 04", "8E 00 00 00 00 00"),
        ("0E 03 20 04 24 97 30 03", "8E 00 00 00"),
        ("0E 03 20 04 24 ED 30 03", "8E 00 00 00"),
        ("0E 03 20 04 24 EE 30 03", "8E 00 00 00"),
        ("0E 03 20 04 24 65 30 03", "8E 00 16 00"),
        ("0E 03 20 04 24 64 30 01", "8E 00 14 00"),
        ("0E 03 20 04 2C 96 30 04", "8E 00 00 00 3C 00"),
        ("0E 03 20 04 24 00 30 01", "8E 00 00 00 02 00"),
        ("0E 03 20 04 24 00 30 02", "8E 00 00 00 EE 00"),
        ("0E 03 20 04 24 00 30 03", "8E 00 00 00 05 00"),
        ("10 03 20 04 24 64 30 03 00", "90 00 0E 00"),
        ("10 03 20 04 24 96 30 03 00", "90 00 0E 00"),
    ]);
}

#[test]
fn images_are_read_but_never_written() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    let (inputs, outputs) = (hex("0E 03 20 04 24 64 30 03"), hex("0E 03 20 04 24 96 30 03"));
    let set: Vec<u8> = [hex("10 03 20 04 24 96 30 03"), vec![0xFF; 60]].concat();
    robot.adapter.set_inputs(&[1; 252], &[2; 252]);
    assert_eq!(robot.cip(session, &inputs), [hex("8E 00 00 00"), vec![2; 252]].concat());
    assert_eq!(robot.cip(session, &set), hex("90 00 0E 00"));
    assert_eq!(robot.cip(session, &outputs), [hex("8E 00 00 00"), vec![0; 60]].concat());
    let opened = robot.open(session, &open_request(&[]));
    robot.output(peer(1), opened.o2t_id, (1, 1), true, 9);
    assert_eq!(robot.cip(session, &set), hex("90 00 0E 00"));
    assert_eq!(robot.cip(session, &outputs), [hex("8E 00 00 00"), vec![9; 60]].concat());
    robot.output(peer(1), opened.o2t_id, (2, 2), false, 9);
    assert_eq!(robot.cip(session, &outputs), [hex("8E 00 00 00"), vec![0; 60]].concat());
}

#[test]
fn the_connection_manager_counts() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    let all = hex("01 02 20 06 24 01");
    assert_eq!(robot.cip(session, &all), [hex("81 00 00 00"), vec![0; 16]].concat());
    robot.open(session, &open_request(&[]));
    robot.cip(session, &open_request(&[]));
    robot.cip(session, &hex("54 02 20 06 24 01 00"));
    robot.cip(session, &hex("4E 02 20 06 24 01 00"));
    robot.cip(session, &hex("4E 02 20 06 24 01 0A 0E 01 00 01 00 01 00 00 00 00 00"));
    robot.advance(crate::support::ms(10_000));
    let wanted = "81 00 00 00 | 03 00 01 00 00 00 01 00 | 02 00 01 00 01 00 | 01 00";
    assert_eq!(shown(&robot.cip(session, &all)), shown(&hex(wanted)));
    assert_eq!(robot.cip(session, &hex("0E 03 20 06 24 01 30 08")), hex("8E 00 00 00 01 00"));
    assert_eq!(robot.cip(session, &hex("0E 03 20 06 24 01 30 09")), hex("8E 00 14 00"));
}

#[test]
fn tcp_ip_interface() {
    let interface = "64 00 A8 C0 00 FF FF FF 00 00 00 00 00 00 00 00 00 00 00 00 00 00";
    let name = "07 00 6D 65 63 61 35 30 30 00";
    let all = format!(
        "81 00 00 00 01 00 00 00 00 00 00 00 00 00 00 00 02 00 20 F6 24 01 {interface} {name}"
    );
    check(&[
        ("0E 03 20 F5 24 01 30 01", "8E 00 00 00 01 00 00 00"),
        ("0E 03 20 F5 24 01 30 02", "8E 00 00 00 00 00 00 00"),
        ("0E 03 20 F5 24 01 30 03", "8E 00 00 00 00 00 00 00"),
        ("0E 03 20 F5 24 01 30 04", "8E 00 00 00 02 00 20 F6 24 01"),
        ("0E 03 20 F5 24 01 30 05", &format!("8E 00 00 00 {interface}")),
        ("0E 03 20 F5 24 01 30 06", &format!("8E 00 00 00 {name}")),
        ("0E 03 20 F5 24 01 30 08", "8E 00 00 00 01"),
        ("0E 03 20 F5 24 01 30 09", "8E 00 00 00 00 00 20 00 60 0D C0 EF"),
        ("0E 03 20 F5 24 01 30 0D", "8E 00 00 00 78 00"),
        ("0E 03 20 F5 24 01 30 07", "8E 00 14 00"),
        ("10 03 20 F5 24 01 30 0D 78 00", "90 00 0E 00"),
        ("0E 03 20 F5 24 00 30 01", "8E 00 00 00 04 00"),
        ("01 02 20 F5 24 01", &all),
    ]);
}

#[test]
fn ethernet_link_and_quality_of_service() {
    check(&[
        ("0E 03 20 F6 24 01 30 01", "8E 00 00 00 64 00 00 00"),
        ("0E 03 20 F6 24 01 30 02", "8E 00 00 00 0F 00 00 00"),
        ("0E 03 20 F6 24 01 30 03", "8E 00 00 00 02 00 00 00 00 01"),
        ("0E 03 20 F6 24 01 30 07", "8E 00 00 00 02"),
        ("0E 03 20 F6 24 01 30 04", "8E 00 14 00"),
        ("0E 03 20 F6 24 02 30 01", "8E 00 16 00"),
        ("01 02 20 F6 24 01", "81 00 00 00 64 00 00 00 0F 00 00 00 02 00 00 00 00 01"),
        ("0E 03 20 48 24 01 30 04", "8E 00 00 00 37"),
        ("0E 03 20 48 24 01 30 05", "8E 00 00 00 2F"),
        ("0E 03 20 48 24 01 30 06", "8E 00 00 00 2B"),
        ("0E 03 20 48 24 01 30 07", "8E 00 00 00 1F"),
        ("0E 03 20 48 24 01 30 08", "8E 00 00 00 1B"),
        ("0E 03 20 48 24 01 30 01", "8E 00 14 00"),
        ("10 03 20 48 24 01 30 05 00", "90 00 0E 00"),
        ("01 02 20 48 24 01", "81 00 08 00"),
    ]);
}

#[test]
fn what_does_not_exist_is_told_by_its_status() {
    check(&[
        ("0E 03 20 03 24 01 30 01", "8E 00 05 00"),
        ("0E 04 21 00 01 01 24 01 30 01", "8E 00 05 00"),
        ("0E 03 20 01 24 02 30 01", "8E 00 16 00"),
        ("0E 02 20 01 24 01", "8E 00 04 00"),
        ("0E 00", "8E 00 04 00"),
        ("0E", "8E 00 04 00"),
        ("0E 03 20 01 24 01", "8E 00 04 00"),
        ("0E 03 24 01 20 01 30 01", "8E 00 04 00"),
        ("0E 03 20 01 30 01 24 01", "8E 00 04 00"),
        ("0E 04 20 01 24 01 30 01 28 01", "8E 00 04 00"),
        ("0E 01 25 00", "8E 00 04 00"),
        ("4B 02 20 01 24 01", "CB 00 08 00"),
        ("54 02 20 01 24 01", "D4 00 08 00"),
        ("54 02 20 06 24 02", "D4 00 16 00"),
        ("54 02 20 06 24 00", "D4 00 08 00"),
        ("0A 02 20 02 24 01 00 00", "8A 00 08 00"),
    ]);
}

#[test]
fn an_unconnected_send_goes_to_ourselves_or_nowhere() {
    let to_us = "52 02 20 06 24 01 0A 0E 08 00 0E 03 20 01 24 01 30 01";
    check(&[
        (&format!("{to_us} 00 00"), "8E 00 00 00 1D 06"),
        // Padded after an odd number of bytes.
        ("52 02 20 06 24 01 0A 0E 07 00 05 02 20 01 24 01 00 00 00 00", "85 00 00 00"),
        (&format!("{to_us} 01 00 01 00"), "D2 00 01 01 11 03 01"),
        (&format!("{to_us} 02 00 01 00 01 02"), "D2 00 01 01 11 03 02"),
        (&format!("{to_us} 00 00 00"), "D2 00 15 00"),
        (to_us, "D2 00 13 00"),
        ("52 02 20 06 24 01 0A 0E 00 00 00 00", "D2 00 13 00"),
        ("52 02 20 06 24 01 0A 0E 02 00 8E 00 00 00", "D2 00 13 00"),
        ("52 02 20 06 24 01 0A 0E 0C 00 52 02 20 06 24 01 00 00 00 00 00 00 00 00", "D2 00 08 00"),
    ]);
}

#[test]
fn images_have_other_lengths_up_to_the_longest() {
    let settings =
        AdapterSettings { output_len: 7, input_len: u16::MAX, ..AdapterSettings::meca500() };
    let mut robot = Robot::with(settings);
    let session = robot.session(peer(1));
    robot.adapter.set_inputs(&[3; MAX_IMAGE_LEN], &[4; MAX_IMAGE_LEN]);
    let image = robot.cip(session, &hex("0E 03 20 04 24 64 30 03"));
    assert_eq!(image, [hex("8E 00 00 00"), vec![4; MAX_IMAGE_LEN]].concat());
    // 2 + 4 + 7 and 2 + 500 bytes.
    let sizes = [(Field::O2tParameters, "0D 48"), (Field::T2oParameters, "F6 49")];
    let opened = robot.open(session, &open_request(&sizes));
    assert_eq!(robot.frames[0].image(), [3; MAX_IMAGE_LEN]);
    robot.frame(peer(1), opened.o2t_id, (1, 1), &hex("01 00 00 00 01 02 03 04 05 06 07"));
    assert_eq!(robot.adapter.outputs(), Some(&[1, 2, 3, 4, 5, 6, 7][..]));
}
