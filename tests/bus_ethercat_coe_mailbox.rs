//! Mailbox headers, counters, errors and emergencies, and datagrams that nobody should send.

mod coe_support;

use coe_support::*;
use fieldarm::bus::ethercat::application::Application;
use fieldarm::bus::ethercat::coe::MAX_EMERGENCIES;
use fieldarm::bus::ethercat::meca500::Meca500Settings;
use fieldarm::wire::ethercat::al::AlState;
use fieldarm::wire::ethercat::coe::{AbortCode, CoeHeader, CoeService, Emergency};
use fieldarm::wire::ethercat::mailbox::{
    MailboxError, MailboxHeader, MailboxProtocol, next_counter,
};
use proptest::prelude::*;

fn robot() -> Firmware {
    firmware(Meca500Settings::default())
}

/// Sends a datagram as it is; returns the whole answer.
fn send(robot: &mut Firmware, datagram: &str) -> Option<String> {
    robot.receive_mailbox(AlState::PreOp, &bytes(datagram));
    fetch(robot, MAILBOX).map(|answer| hex(&answer))
}

#[test]
fn a_request_and_its_answer_with_headers() {
    let mut robot = robot();
    let answer = send(&mut robot, "0A 00 00 00 00 13 00 20 40 00 1C 00 00 00 00 00");
    assert_eq!(answer.as_deref(), Some("0A 00 00 00 00 13 00 30 4F 00 1C 00 04 00 00 00"));
    assert_eq!(fetch(&mut robot, MAILBOX), None, "one answer");
}

#[test]
fn the_subdevice_counts_its_own_datagrams_from_1_to_7() {
    let mut robot = robot();
    for (request, answer) in
        [1, 2, 3, 4, 5, 6, 7, 1, 2].into_iter().zip([1, 2, 3, 4, 5, 6, 7, 1, 2])
    {
        let request = format!("0A 00 00 00 00 {request}3 00 20 40 00 1C 00 00 00 00 00");
        let found = send(&mut robot, &request).expect("an answer");
        assert_eq!(&found[15..17], format!("{answer}3"));
    }
}

#[test]
fn a_repeated_counter_is_the_same_datagram_again() {
    let mut robot = robot();
    // Reading the next segment twice would lose one.
    send(&mut robot, "0A 00 00 00 00 13 00 20 50 11 1A 00 00 00 00 00").expect("the first part");
    let segment = "0A 00 00 00 00 23 00 20 60 00 00 00 00 00 00 00";
    send(&mut robot, segment).expect("the segment");
    assert_eq!(send(&mut robot, segment), None);
    // Another counter, or none, is a new datagram.
    let ended = "00 20 80 00 00 00 01 00 04 05";
    for counter in ["33", "03", "03"] {
        let request = format!("0A 00 00 00 00 {counter} 00 20 60 00 00 00 00 00 00 00");
        assert!(send(&mut robot, &request).expect("an answer").ends_with(ended));
    }
    // After INIT the main device begins anew.
    send(&mut robot, "0A 00 00 00 00 53 00 20 40 00 1C 00 00 00 00 00").expect("an answer");
    robot.reset_mailbox();
    send(&mut robot, "0A 00 00 00 00 53 00 20 40 00 1C 00 00 00 00 00").expect("an answer");
}

#[test]
fn datagrams_that_cannot_be_used_are_answered_with_the_reason() {
    for (datagram, code) in [
        ("", "01"),
        ("0A 00 00 00 00", "01"),
        // EoE, FoE, and a protocol without a name.
        ("0A 00 00 00 00 02 00 00 00 00 00 00 00 00 00 00", "02"),
        ("0A 00 00 00 00 04 00 00 00 00 00 00 00 00 00 00", "02"),
        ("0A 00 00 00 00 0E 00 00 00 00 00 00 00 00 00 00", "02"),
        // CoE: emergency, SDO response, PDOs are not for us.
        ("0A 00 00 00 00 03 00 10 00 00 00 00 00 00 00 00", "04"),
        ("0A 00 00 00 00 03 00 30 40 00 1C 00 00 00 00 00", "04"),
        ("0A 00 00 00 00 03 00 70 40 00 1C 00 00 00 00 00", "04"),
        // CoE services that do not exist.
        ("0A 00 00 00 00 03 00 00 40 00 1C 00 00 00 00 00", "05"),
        ("0A 00 00 00 00 03 00 90 40 00 1C 00 00 00 00 00", "05"),
        // Too short for CoE, for an SDO, for SDO information and its request.
        ("00 00 00 00 00 03", "06"),
        ("01 00 00 00 00 03 00", "06"),
        ("09 00 00 00 00 03 00 20 40 00 1C 00 00 00 00", "06"),
        ("05 00 00 00 00 03 00 80 01 00 00", "06"),
        ("07 00 00 00 00 03 00 80 01 00 00 00 01", "06"),
        ("09 00 00 00 00 03 00 80 05 00 00 00 10 60 02", "06"),
        // Longer than what came.
        ("0B 00 00 00 00 03 00 20 40 00 1C 00 00 00 00 00", "08"),
        ("FF FF 00 00 00 03 00 20 40 00 1C 00 00 00 00 00", "08"),
    ] {
        let answer = send(&mut robot(), datagram);
        let expected = format!("04 00 00 00 00 10 01 00 {code} 00");
        assert_eq!(answer, Some(expected), "{datagram}");
    }
    assert_eq!(
        send(&mut robot(), "04 00 00 00 00 00 01 00 02 00"),
        None,
        "errors are not answered"
    );
}

#[test]
fn a_request_that_comes_too_early_waits_and_a_third_is_refused() {
    let mut robot = robot();
    let request = |sub_index: u8| coe(&[0, 0x20, 0x40, 0, 0x1C, sub_index, 0, 0, 0, 0]);
    for sub_index in 1..=4 {
        let mut full = request(sub_index);
        full.resize(MAILBOX, 0);
        robot.receive_mailbox(AlState::PreOp, &full);
    }
    let next = |robot: &mut Firmware| fetch(robot, MAILBOX).map(|answer| hex(&answer));
    let answer = |count, value| {
        Some(format!("0A 00 00 00 00 {count}3 00 30 4F 00 1C {value:02X} {value:02X} 00 00 00"))
    };
    assert_eq!(next(&mut robot), answer(1, 1));
    assert_eq!(next(&mut robot), answer(2, 2));
    assert_eq!(next(&mut robot).as_deref(), Some("04 00 00 00 00 30 01 00 07 00"));
    assert_eq!(next(&mut robot), None);
    // All of it works again.
    robot.receive_mailbox(AlState::PreOp, &request(3));
    assert_eq!(next(&mut robot), answer(4, 3));
}

#[test]
fn emergencies_go_out_in_order_when_no_answer_waits() {
    let mut robot = robot();
    let emergency = |n| Emergency { code: 0x8100, register: 0x11, data: [n, 2, 3, 4, 5] };
    robot.queue_emergency(emergency(1)).unwrap();
    robot.queue_emergency(emergency(2)).unwrap();
    let answer = send(&mut robot, "0A 00 00 00 00 13 00 20 40 00 1C 00 00 00 00 00");
    assert_eq!(answer.as_deref(), Some("0A 00 00 00 00 13 00 30 4F 00 1C 00 04 00 00 00"));
    let mut next = || fetch(&mut robot, MAILBOX).map(|answer| hex(&answer));
    assert_eq!(next().as_deref(), Some("0A 00 00 00 00 23 00 10 00 81 11 01 02 03 04 05"));
    assert_eq!(next().as_deref(), Some("0A 00 00 00 00 33 00 10 00 81 11 02 02 03 04 05"));
    assert_eq!(next(), None);
}

#[test]
fn too_many_emergencies_are_refused_and_init_drops_them() {
    let mut robot = robot();
    for _ in 0..MAX_EMERGENCIES {
        robot.queue_emergency(Emergency::default()).unwrap();
    }
    let refused = robot.queue_emergency(Emergency::default()).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "8 emergencies wait already; the main device does not fetch them"
    );
    fetch(&mut robot, MAILBOX).expect("an emergency");
    robot.queue_emergency(Emergency::default()).unwrap();
    robot.reset_mailbox();
    assert_eq!(fetch(&mut robot, MAILBOX), None);
}

#[test]
fn init_forgets_an_answer_a_waiting_request_and_a_transfer() {
    let mut robot = robot();
    let read = coe(&bytes("00 20 50 11 1A 00 00 00 00 00"));
    ask_bytes(&mut robot, AlState::PreOp, &read).expect("the first part");
    robot.receive_mailbox(AlState::PreOp, &coe(&bytes("00 20 60 00 00 00 00 00 00 00")));
    robot.receive_mailbox(AlState::PreOp, &read);
    robot.reset_mailbox();
    assert_eq!(fetch(&mut robot, MAILBOX), None);
    assert_eq!(ask(&mut robot, "00 20 60 00 00 00 00 00 00 00"), "00 20 80 00 00 00 01 00 04 05");
}

#[test]
fn a_mailbox_too_short_for_any_answer_gets_none_and_loses_none() {
    let mut robot = robot();
    robot.receive_mailbox(AlState::PreOp, &coe(&bytes("00 20 40 00 1C 00 00 00 00 00")));
    for room in 0..16 {
        assert_eq!(fetch(&mut robot, room), None);
    }
    assert!(fetch(&mut robot, 16).is_some());
}

/// Asserts that `answer` is a datagram a main device can read.
fn check_form(answer: &[u8], room: usize) {
    assert!(answer.len() <= room, "{} bytes for {room}", answer.len());
    let (header, data) = MailboxHeader::split(answer).expect("a header");
    assert_eq!(usize::from(header.length), data.len());
    assert_eq!((header.address, header.channel, header.priority), (0, 0, 0));
    assert!((1..=7).contains(&header.counter));
    if header.protocol == MailboxProtocol::ERROR {
        let error = MailboxError::from_bytes(data).expect("an error code");
        assert!((1..=8).contains(&error.0), "{error}");
        return;
    }
    assert_eq!(header.protocol, MailboxProtocol::COE);
    let (coe, data) = CoeHeader::split(data).expect("a CoE header");
    match coe.service {
        CoeService::SDO_REQUEST => {
            assert_eq!((data.len(), data[0]), (8, 0x80), "only an abort is a request");
            let code = AbortCode(u32::from_le_bytes(data[4..8].try_into().unwrap()));
            assert_ne!(code.text(), "unknown abort code");
        }
        CoeService::SDO_RESPONSE => {
            assert!(data.len() >= 8);
            assert!(data[0] >> 5 <= 3, "a response");
        }
        CoeService::SDO_INFORMATION => {
            // The last fragment of a name may be a single letter.
            assert!(data.len() > 4);
            assert!([2, 4, 6, 7].contains(&(data[0] & 0x7F)), "a response");
        }
        other => panic!("{other:?}"),
    }
}

/// Requests of every kind, to be cut and bent.
const GOOD: &[&str] = &[
    "0A 00 00 00 00 03 00 20 40 18 10 01 00 00 00 00",
    "0A 00 00 00 00 03 00 20 2F 13 1C 00 00 00 00 00",
    "0C 00 00 00 00 03 00 20 21 13 1C 01 02 00 00 00 08 1A",
    "12 00 00 00 00 03 00 20 31 12 1C 00 08 00 00 00 03 00 02 16 00 16 01 16",
    "0B 00 00 00 00 03 00 20 31 12 1C 00 08 00 00 00 03",
    "0A 00 00 00 00 03 00 20 01 00 02 16 00 16 01 16",
    "0A 00 00 00 00 03 00 20 50 11 1A 00 00 00 00 00",
    "0A 00 00 00 00 03 00 20 60 00 00 00 00 00 00 00",
    "0A 00 00 00 00 03 00 20 80 12 1C 00 00 00 00 08",
    "08 00 00 00 00 03 00 80 01 00 00 00 01 00",
    "08 00 00 00 00 03 00 80 03 00 00 00 00 10",
    "0A 00 00 00 00 03 00 80 05 00 00 00 10 60 02 07",
];

#[test]
fn every_truncation_is_answered_in_form_or_not_at_all() {
    for request in GOOD {
        let whole = bytes(request);
        for len in 0..whole.len() {
            let mut robot = robot();
            robot.receive_mailbox(AlState::PreOp, &whole[..len]);
            let answer = fetch(&mut robot, MAILBOX).expect("a truncated datagram is refused");
            check_form(&answer, MAILBOX);
            assert_eq!(answer[5] & 0x0F, 0, "{request} cut to {len}");
            // The same with a header that agrees to the cut.
            if let Some(data) = whole.get(6..len) {
                let mut robot = robot_asked(data);
                while let Some(answer) = fetch(&mut robot, MAILBOX) {
                    check_form(&answer, MAILBOX);
                }
            }
        }
    }
}

/// A robot that was sent `data` as CoE.
fn robot_asked(data: &[u8]) -> Firmware {
    let mut robot = robot();
    robot.receive_mailbox(AlState::PreOp, &coe(data));
    robot
}

#[test]
fn every_flipped_bit_is_answered_in_form() {
    for request in GOOD {
        let whole = bytes(request);
        for bit in 0..whole.len() * 8 {
            let mut bent = whole.clone();
            bent[bit / 8] ^= 1 << (bit % 8);
            let mut robot = robot();
            robot.receive_mailbox(AlState::PreOp, &bent);
            while let Some(answer) = fetch(&mut robot, MAILBOX) {
                check_form(&answer, MAILBOX);
            }
        }
    }
}

#[test]
fn counters_follow_each_other() {
    let counters: Vec<u8> =
        std::iter::successors(Some(1), |counter| Some(next_counter(*counter))).take(9).collect();
    assert_eq!(counters, [1, 2, 3, 4, 5, 6, 7, 1, 2]);
    assert_eq!(next_counter(0), 1);
}

/// A datagram: noise, or a good one with a few bytes changed.
fn datagram() -> impl Strategy<Value = Vec<u8>> {
    let noise = prop::collection::vec(any::<u8>(), 0..160);
    let framed = prop::collection::vec(any::<u8>(), 0..122).prop_map(|mut data| {
        if let Some(service) = data.get_mut(1) {
            *service = if *service & 1 == 0 { 0x20 } else { 0x80 };
        }
        coe(&data)
    });
    let bent = (0..GOOD.len(), prop::collection::vec((6_usize..24, any::<u8>()), 0..4)).prop_map(
        |(which, changes)| {
            let mut datagram = bytes(GOOD[which]);
            for (at, value) in changes {
                if let Some(byte) = datagram.get_mut(at) {
                    *byte = value;
                }
            }
            datagram
        },
    );
    prop_oneof![1 => noise, 3 => framed, 6 => bent]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn any_conversation_stays_in_form(
        steps in prop::collection::vec((datagram(), 0_usize..3, 16_usize..300, 0_usize..4), 1..40),
    ) {
        let states = [AlState::Init, AlState::PreOp, AlState::SafeOp, AlState::Op];
        let mut robot = robot();
        for (datagram, fetches, room, state) in steps {
            robot.receive_mailbox(states[state], &datagram);
            for _ in 0..fetches {
                if let Some(answer) = fetch(&mut robot, room) {
                    check_form(&answer, room);
                }
            }
            prop_assert!(robot.output_len() <= 60);
            prop_assert!(robot.input_len() <= 252);
        }
        // What is left comes to an end, and the robot still answers.
        for _ in 0..100 {
            let Some(answer) = fetch(&mut robot, 128) else { break };
            check_form(&answer, 128);
        }
        robot.reset_mailbox();
        let answer = ask(&mut robot, "00 20 40 00 1C 00 00 00 00 00");
        prop_assert_eq!(answer, "00 30 4F 00 1C 00 04 00 00 00");
    }
}
