//! SDO information byte by byte, and in fragments.

mod coe_support;

use coe_support::*;
use fieldarm::bus::ethercat::application::Application;
use fieldarm::bus::ethercat::meca500::Meca500Settings;
use fieldarm::wire::ethercat::al::AlState;

/// Every object of the robot, from the manual's Tables 4 to 28 and the communication area.
const OBJECTS: &[u16] = &[
    0x1000, 0x1001, 0x1008, 0x1009, 0x100A, 0x1018, 0x1600, 0x1601, 0x1602, 0x1610, 0x1611, 0x1620,
    0x1621, 0x1622, 0x1623, 0x1A00, 0x1A01, 0x1A02, 0x1A03, 0x1A08, 0x1A09, 0x1A0A, 0x1A10, 0x1A11,
    0x1A20, 0x1A21, 0x1A22, 0x1A23, 0x1C00, 0x1C12, 0x1C13, 0x1C32, 0x1C33, 0x6010, 0x6015, 0x6030,
    0x6031, 0x6046, 0x6050, 0x6051, 0x6060, 0x6065, 0x6070, 0x6071, 0x6072, 0x6073, 0x7200, 0x7305,
    0x7306, 0x7310, 0x7400, 0x7410, 0x7420, 0x7421, 0x7422, 0x7423,
];

fn robot() -> Firmware {
    firmware(Meca500Settings::default())
}

fn little_endian(words: &[u16]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

#[test]
fn the_lists_and_their_lengths() {
    let mut robot = robot();
    // 56 objects, 10 outputs, 13 inputs, none to back up, 4 to write at start-up.
    assert_eq!(
        ask(&mut robot, "00 80 01 00 00 00 00 00"),
        "00 80 02 00 00 00 00 00 38 00 0A 00 0D 00 00 00 04 00"
    );
    assert_eq!(OBJECTS.len(), 0x38);
    let all = ask(&mut robot, "00 80 01 00 00 00 01 00");
    assert_eq!(all, format!("00 80 02 00 00 00 01 00 {}", hex(&little_endian(OBJECTS))));
    let inputs = ask(&mut robot, "00 80 01 00 00 00 03 00");
    assert_eq!(
        inputs,
        format!("00 80 02 00 00 00 03 00 {}", hex(&little_endian(&OBJECTS[33..46])))
    );
    dialogue(
        &mut robot,
        &[
            (
                "00 80 01 00 00 00 02 00",
                "00 80 02 00 00 00 02 00 00 72 05 73 06 73 10 73 00 74 10 74 20 74 21 74 22 74 23 74",
            ),
            ("00 80 01 00 00 00 04 00", "00 80 02 00 00 00 04 00"),
            ("00 80 01 00 00 00 05 00", "00 80 02 00 00 00 05 00 12 1C 13 1C 32 1C 33 1C"),
            ("00 80 01 00 00 00 06 00", "00 80 07 00 00 00 00 00 01 06"),
        ],
    );
}

#[test]
fn objects_describe_themselves() {
    dialogue(
        &mut robot(),
        &[
            // A variable of 32 bits: type 7, highest sub-index 0, code 7, "Device type".
            (
                "00 80 03 00 00 00 00 10",
                "00 80 04 00 00 00 00 10 07 00 00 07 44 65 76 69 63 65 20 74 79 70 65",
            ),
            // 1C00h: an array of bytes.
            (
                "00 80 03 00 00 00 00 1C",
                "00 80 04 00 00 00 00 1C 05 00 04 08 53 79 6E 63 20 6D 61 6E 61 67 65 72 20 74 79 70 65 73",
            ),
            // 1A08h: a mapping of four entries, "TargetConfiguration".
            (
                "00 80 03 00 00 00 08 1A",
                "00 80 04 00 00 00 08 1A 21 00 04 09 54 61 72 67 65 74 43 6F 6E 66 69 67 75 72 61 74 69 6F 6E",
            ),
            // 6065h: its numbers go up to 79, "SafetyStatus".
            (
                "00 80 03 00 00 00 65 60",
                "00 80 04 00 00 00 65 60 2A 00 4F 09 53 61 66 65 74 79 53 74 61 74 75 73",
            ),
            // 7305h: a variable, "MotionCommandID".
            (
                "00 80 03 00 00 00 05 73",
                "00 80 04 00 00 00 05 73 07 00 00 07 4D 6F 74 69 6F 6E 43 6F 6D 6D 61 6E 64 49 44",
            ),
            ("00 80 03 00 00 00 34 12", "00 80 07 00 00 00 00 00 02 06"),
        ],
    );
}

#[test]
fn entries_describe_themselves() {
    dialogue(
        &mut robot(),
        &[
            // 6010h:02 Busy: BOOLEAN, 1 bit, readable and TxPDO-mappable.
            (
                "00 80 05 00 00 00 10 60 02 07",
                "00 80 06 00 00 00 10 60 02 07 01 00 01 00 87 00 42 75 73 79",
            ),
            // 7306h:01 Argument 1: REAL32, 32 bits, readable and RxPDO-mappable. Units and limits,
            // asked for too, are not told.
            (
                "00 80 05 00 00 00 06 73 01 7F",
                "00 80 06 00 00 00 06 73 01 07 08 00 20 00 47 00 41 72 67 75 6D 65 6E 74 20 31",
            ),
            // 6046h:04 Turn: INTEGER8.
            (
                "00 80 05 00 00 00 46 60 04 00",
                "00 80 06 00 00 00 46 60 04 00 02 00 08 00 87 00 54 75 72 6E",
            ),
            // 1C12h:01: UNSIGNED16, read always, written in PRE-OP, at start-up.
            (
                "00 80 05 00 00 00 12 1C 01 01",
                "00 80 06 00 00 00 12 1C 01 01 06 00 10 00 0F 02 50 44 4F",
            ),
            ("00 80 05 00 00 00 34 12 00 07", "00 80 07 00 00 00 00 00 02 06"),
            ("00 80 05 00 00 00 18 10 05 07", "00 80 07 00 00 00 11 00 09 06"),
            // The reserved bit 128:3 of 6065h is no entry.
            ("00 80 05 00 00 00 65 60 04 07", "00 80 07 00 00 00 11 00 09 06"),
            // Responses and unknown operations are no requests.
            ("00 80 02 00 00 00 01 00", "00 80 07 00 00 00 01 00 04 05"),
            ("00 80 55 00 00 00 01 00", "00 80 07 00 00 00 01 00 04 05"),
        ],
    );
}

#[test]
fn a_list_comes_in_as_many_fragments_as_the_mailbox_needs() {
    let whole = [&[1, 0], little_endian(OBJECTS).as_slice()].concat();
    for room in 16..=140 {
        let mut robot = robot();
        robot.receive_mailbox(AlState::PreOp, &coe(&bytes("00 80 01 00 00 00 01 00")));
        let mut list: Vec<u8> = Vec::new();
        let mut left = None;
        while let Some(datagram) = fetch(&mut robot, room) {
            assert!(datagram.len() <= room);
            let data = service_data(&datagram);
            assert_eq!(hex(&data[..2]), "00 80");
            let now = u16::from_le_bytes([data[4], data[5]]);
            assert!(left.is_none_or(|left| left == now + 1), "fragments count down to 0");
            assert_eq!(data[2], if now > 0 { 0x82 } else { 0x02 });
            assert_eq!(data.len() % 2, 0, "no index is cut");
            list.extend(&data[6..]);
            left = Some(now);
        }
        assert_eq!(left, Some(0));
        assert_eq!(list, whole, "through {room}");
    }
}

#[test]
fn a_request_during_the_fragments_waits_for_the_last_one() {
    let mut robot = robot();
    robot.receive_mailbox(AlState::PreOp, &coe(&bytes("00 80 01 00 00 00 01 00")));
    let first = fetch(&mut robot, 80).expect("a fragment");
    assert_eq!(first[8], 0x82);
    robot.receive_mailbox(AlState::PreOp, &coe(&bytes("00 20 40 00 1C 00 00 00 00 00")));
    let second = fetch(&mut robot, 80).expect("a fragment");
    assert_eq!(second[8], 0x02);
    let answer = fetch(&mut robot, 80).expect("the answer");
    assert_eq!(hex(service_data(&answer)), "00 30 4F 00 1C 00 04 00 00 00");
}
