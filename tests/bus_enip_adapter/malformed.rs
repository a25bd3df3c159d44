//! Every cut, every excess and every flipped bit of every request.

use crate::support::Field;
use crate::support::{
    Robot, close_request, hex, input_only, open_request, owner, packet, peer, rr_data, shown,
    unwrapped,
};

/// Each kind of request, right as it is.
fn requests() -> Vec<Vec<u8>> {
    let large = open_request(&[
        (Field::Service, "5B 02 20 06 24 01 | 0A 0E | 00 00 00 00"),
        (Field::O2tParameters, "42 00 00 48"),
        (Field::T2oParameters, "FE 00 00 48"),
        (Field::Path, "09 | 34 04 1D 06 2B 00 F4 01 0B 03 20 04 24 97 2C 96 2C 64"),
    ]);
    vec![
        owner("01 00"),
        large,
        input_only("03 00"),
        close_request("07 00"),
        hex("0E 03 20 01 24 01 30 01"),
        hex("01 02 20 01 24 01"),
        hex("03 02 20 01 24 01 02 00 01 00 04 00"),
        hex("05 02 20 01 24 01"),
        hex("52 02 20 06 24 01 0A 0E 08 00 0E 03 20 01 24 01 30 01 00 00"),
    ]
}

#[test]
fn they_are_right_as_they_are() {
    for request in requests() {
        let mut robot = Robot::new();
        let session = robot.session(peer(1));
        if request[0] == 0x4E {
            robot.open(session, &owner("07 00"));
        }
        let reply = robot.cip(session, &request);
        assert_eq!(reply[2], 0, "{}", shown(&request));
    }
}

#[test]
fn no_cut_request_does_anything() {
    for request in requests() {
        for len in 1..request.len() {
            let mut robot = Robot::new();
            let session = robot.session(peer(1));
            let reply = robot.cip(session, &request[..len]);
            assert_eq!(reply[0], request[0] | 0x80);
            // Either the path of the request or its data end too early.
            assert!(
                [0x04, 0x13].contains(&reply[2]),
                "{} cut to {len}: {}",
                shown(&request),
                shown(&reply)
            );
            assert_eq!(reply.len(), 4);
            assert_eq!(robot.adapter.connections().count(), 0);
            assert_eq!(robot.frames, []);
        }
    }
}

#[test]
fn no_request_with_bytes_too_many_does_anything() {
    for request in requests() {
        for excess in 1..20 {
            let mut robot = Robot::new();
            let session = robot.session(peer(1));
            let long = [&request[..], &vec![0xFF; excess]].concat();
            let reply = robot.cip(session, &long);
            let wrong = if (request[0], excess) == (0x05, 1) { 0x20 } else { 0x15 };
            assert_eq!(reply[2], wrong, "{}", shown(&long));
            assert_eq!(robot.adapter.connections().count(), 0);
        }
    }
}

#[test]
fn a_path_longer_than_its_request_is_not_read_beyond_it() {
    for words in 5..=255_u8 {
        let mut robot = Robot::new();
        let session = robot.session(peer(1));
        let path = format!("{words:02X} | 20 04 24 97 2C 96 2C 64");
        let path: &'static str = path.leak();
        let reply = robot.cip(session, &open_request(&[(Field::Path, path)]));
        assert_eq!(reply, hex("D4 00 13 00"));
    }
}

#[test]
fn no_flipped_bit_does_harm() {
    for request in requests() {
        for bit in 0..8 * (40 + request.len()) {
            let mut robot = Robot::new();
            let session = robot.session(peer(1));
            let mut bytes = packet(0x6F, session.handle, &rr_data(&request, &[]));
            bytes[bit / 8] ^= 1 << (bit % 8);
            robot.feed(session.stream, &bytes);
            assert!(robot.adapter.connections().count() <= 1);
            robot.advance(crate::support::ms(30));
            // Whoever comes next is served.
            let next = robot.session(peer(2));
            let answer = robot.rr(next, &hex("0E 03 20 01 24 01 30 01"), &[]);
            assert_eq!(unwrapped(&answer).0, hex("8E 00 00 00 1D 06"), "bit {bit}");
        }
    }
}

#[test]
fn no_wrong_class_1_frame_is_taken() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    let opened = robot.open(session, &owner("07 00"));
    let mut data = vec![1, 0, 0, 0];
    data.extend([5; 60]);
    let whole = crate::support::io_frame(opened.o2t_id, (1, 1), &data);
    assert_eq!(whole.len(), 84);
    let mut wrong: Vec<Vec<u8>> = (0..whole.len()).map(|len| whole[..len].to_vec()).collect();
    wrong.push([&whole[..], &[0]].concat());
    // All bits in front of the data but those of both sequence numbers, the id included.
    for bit in (0..8 * 10).chain(8 * 14..8 * 18) {
        let mut flipped = whole.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        wrong.push(flipped);
    }
    let deadline = robot.adapter.poll_timeout();
    for datagram in wrong {
        robot.adapter.handle_io_datagram(robot.now, peer(1), &datagram);
        assert_eq!(robot.adapter.outputs(), None, "{}", shown(&datagram));
    }
    assert_eq!(robot.adapter.poll_timeout(), deadline);
    robot.adapter.handle_io_datagram(robot.now, peer(1), &whole);
    assert_eq!(robot.adapter.outputs(), Some(&[5; 60][..]));
}
