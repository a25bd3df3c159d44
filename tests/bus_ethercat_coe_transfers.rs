//! Transfers of every length and split, and the refusals that the robot's own dictionary has no
//! object for, on a dictionary made for it.

mod coe_support;

use coe_support::{bytes, coe, hex, service_data};
use fieldarm::bus::ethercat::coe::{CoeServer, Dictionary, Entry, MAX_TRANSFER, Object};
use fieldarm::wire::ethercat::al::AlState;
use fieldarm::wire::ethercat::coe::AbortCode;
use fieldarm::wire::ethercat::coe::info::{DataType, ObjectAccess, ObjectCode};

/// 2000h: a text of a length set by the test. 2001h: write only. 2002h: readable in PRE-OP only.
/// 2003h: fails inside.
struct Store {
    text: Vec<u8>,
    secret: u8,
}

impl Dictionary for Store {
    fn next_index(&self, after: Option<u16>) -> Option<u16> {
        (0x2000..=0x2003).find(|index| after.is_none_or(|after| *index > after))
    }

    fn object(&self, index: u16) -> Option<Object> {
        (0x2000..=0x2003).contains(&index).then_some(Object {
            code: ObjectCode::Variable,
            data_type: DataType::VISIBLE_STRING,
            max_sub_index: 0,
            name: "test",
        })
    }

    fn entry(&self, index: u16, sub_index: u8) -> Option<Entry> {
        let (bits, access) = match index {
            0x2000 => (self.text.len() * 8, ObjectAccess::READ | ObjectAccess::WRITE),
            0x2001 => (8, ObjectAccess::WRITE),
            0x2002 => (8, ObjectAccess::READ_PRE_OP),
            _ => (8, ObjectAccess::READ | ObjectAccess::WRITE),
        };
        let bits = u16::try_from(bits).unwrap();
        let data_type = DataType::VISIBLE_STRING;
        (sub_index == 0).then_some(Entry { data_type, bits, access, name: "test" })
    }

    fn read(&self, index: u16, _: u8, value: &mut [u8]) -> Result<usize, AbortCode> {
        let bytes = match index {
            0x2000 => self.text.as_slice(),
            0x2003 => return Err(AbortCode::HARDWARE),
            _ => &[self.secret],
        };
        value.get_mut(..bytes.len()).ok_or(AbortCode::OUT_OF_MEMORY)?.copy_from_slice(bytes);
        Ok(bytes.len())
    }

    fn write(&mut self, index: u16, _: u8, value: &[u8]) -> Result<(), AbortCode> {
        match index {
            0x2000 => self.text.copy_from_slice(value),
            0x2003 => return Err(AbortCode::NOT_STORED_LOCALLY),
            _ => self.secret = value[0],
        }
        Ok(())
    }
}

/// Sends service data; returns the service data of the answer in a mailbox of `room` bytes.
fn ask(server: &mut CoeServer, store: &mut Store, room: usize, data: &[u8]) -> Vec<u8> {
    ask_in(server, store, room, AlState::PreOp, data)
}

fn ask_in(
    server: &mut CoeServer,
    store: &mut Store,
    room: usize,
    state: AlState,
    data: &[u8],
) -> Vec<u8> {
    server.receive(store, state, &coe(data));
    let mut answer = vec![0xAA; room];
    let len = server.next(store, &mut answer).expect("an answer");
    assert!(len <= room, "{len} bytes in a mailbox of {room}");
    service_data(&answer[..len]).to_vec()
}

/// Bytes that tell their place.
fn pattern(len: usize) -> Vec<u8> {
    (0..len).map(|n| u8::try_from(n % 251).unwrap() + 1).collect()
}

/// Reads 2000h as a main device would; returns the value and the lengths of the segments.
fn read_all(server: &mut CoeServer, store: &mut Store, room: usize) -> (Vec<u8>, Vec<usize>) {
    let first = ask(server, store, room, &bytes("00 20 40 00 20 00 00 00 00 00"));
    let mut segments = Vec::new();
    if first[2] & 2 != 0 {
        let len = 4 - usize::from(first[2] >> 2 & 3);
        return (first[6..6 + len].to_vec(), segments);
    }
    assert_eq!(hex(&first[..6]), "00 30 41 00 20 00");
    let size = u32::from_le_bytes(first[6..10].try_into().unwrap()) as usize;
    let mut value = first[10..].to_vec();
    let mut toggle = 0;
    while value.len() < size {
        assert!(segments.len() < 200, "endless");
        let request = [0, 0x20, 0x60 | toggle, 0, 0, 0, 0, 0, 0, 0];
        let segment = ask(server, store, room, &request);
        assert_eq!(hex(&segment[..2]), "00 30");
        assert_eq!(segment[2] & 0xF0, toggle, "an upload segment with our toggle bit");
        let unused = if segment.len() == 10 { usize::from(segment[2] >> 1 & 7) } else { 0 };
        assert!(segment.len() >= 10);
        value.extend(&segment[3..segment.len() - unused]);
        segments.push(segment.len() - 3 - unused);
        assert_eq!(segment[2] & 1 == 1, value.len() >= size, "the last segment says so");
        toggle ^= 0x10;
    }
    assert_eq!(value.len(), size);
    (value, segments)
}

#[test]
fn every_length_is_read_whole_through_every_mailbox() {
    let mut server = CoeServer::new();
    for room in [16, 17, 23, 24, 64, 128, 255] {
        for len in (1..=140).chain([511, MAX_TRANSFER]) {
            let mut store = Store { text: pattern(len), secret: 0 };
            let (value, segments) = read_all(&mut server, &mut store, room);
            assert_eq!(value, store.text, "{len} bytes through {room}");
            // 6 + 2 + 8 bytes of heads in the first datagram, 6 + 2 + 1 in the others.
            let behind = if len <= 4 { 0 } else { len.saturating_sub(room - 16) };
            assert_eq!(segments.len(), behind.div_ceil(room - 9), "{len} bytes through {room}");
        }
    }
}

#[test]
fn every_length_is_written_whole_in_every_split() {
    let mut server = CoeServer::new();
    for len in [1_usize, 4, 5, 7, 8, 13, 112, 113, 119, 230, MAX_TRANSFER] {
        for (first, step) in [(0, 1), (0, 7), (1, 6), (3, 5), (112, 119), (112, 8), (usize::MAX, 1)]
        {
            let value = pattern(len);
            let mut store = Store { text: vec![0; len], secret: 0 };
            let (now, mut rest) = value.split_at(first.min(len));
            let size = u32::try_from(len).unwrap().to_le_bytes();
            let start = [&[0, 0x20, 0x21, 0, 0x20, 0], &size[..], now].concat();
            let done = ask(&mut server, &mut store, 128, &start);
            assert_eq!(hex(&done), "00 30 60 00 20 00 00 00 00 00");
            let mut toggle = 0;
            while !rest.is_empty() {
                let (now, later) = rest.split_at(step.min(rest.len()));
                let unused = 7_usize.saturating_sub(now.len());
                let command =
                    toggle | u8::try_from(unused << 1).unwrap() | u8::from(later.is_empty());
                let segment = [&[0, 0x20, command], now, &vec![0xEE; unused]].concat();
                let done = ask(&mut server, &mut store, 128, &segment);
                assert_eq!(done[2], 0x20 | toggle);
                toggle ^= 0x10;
                rest = later;
            }
            assert_eq!(store.text, value, "{len} bytes, {first} then {step}");
        }
    }
}

#[test]
fn the_refusals_a_robot_has_no_object_for() {
    let mut server = CoeServer::new();
    let mut store = Store { text: pattern(8), secret: 7 };
    let mut check = |state, request, answer| {
        let found = ask_in(&mut server, &mut store, 128, state, &bytes(request));
        assert_eq!(hex(&found), answer, "{state}: {request}");
    };
    let pre_op = AlState::PreOp;
    check(pre_op, "00 20 40 01 20 00 00 00 00 00", "00 20 80 01 20 00 01 00 01 06");
    check(pre_op, "00 20 2F 02 20 00 00 00 00 00", "00 20 80 02 20 00 02 00 01 06");
    check(pre_op, "00 20 40 03 20 00 00 00 00 00", "00 20 80 03 20 00 00 00 06 06");
    check(pre_op, "00 20 2F 03 20 00 00 00 00 00", "00 20 80 03 20 00 21 00 00 08");
    check(pre_op, "00 20 40 02 20 00 00 00 00 00", "00 30 4F 02 20 00 07 00 00 00");
    check(AlState::Op, "00 20 40 02 20 00 00 00 00 00", "00 20 80 02 20 00 22 00 00 08");
    check(AlState::Op, "00 20 2F 01 20 00 2A 00 00 00", "00 30 60 01 20 00 00 00 00 00");
    check(AlState::Init, "00 20 2F 01 20 00 2A 00 00 00", "00 20 80 01 20 00 22 00 00 08");
    check(pre_op, "00 20 40 02 20 00 00 00 00 00", "00 30 4F 02 20 00 2A 00 00 00");
}

#[test]
fn an_entry_longer_than_any_transfer_is_refused() {
    let mut server = CoeServer::new();
    let mut store = Store { text: pattern(MAX_TRANSFER + 1), secret: 0 };
    let answer = ask(&mut server, &mut store, 128, &bytes("00 20 40 00 20 00 00 00 00 00"));
    assert_eq!(hex(&answer), "00 20 80 00 20 00 05 00 04 05");
}

#[test]
fn a_new_transfer_takes_the_place_of_an_unfinished_one() {
    let mut server = CoeServer::new();
    let mut store = Store { text: pattern(200), secret: 9 };
    ask(&mut server, &mut store, 128, &bytes("00 20 40 00 20 00 00 00 00 00"));
    let other = ask(&mut server, &mut store, 128, &bytes("00 20 40 02 20 00 00 00 00 00"));
    assert_eq!(hex(&other), "00 30 4F 02 20 00 09 00 00 00");
    let late = ask(&mut server, &mut store, 128, &bytes("00 20 60 00 00 00 00 00 00 00"));
    assert_eq!(hex(&late), "00 20 80 00 00 00 01 00 04 05");
}

#[test]
fn abort_codes_have_texts_of_their_own() {
    let text = AbortCode::TOGGLE.to_string();
    assert_eq!(text, "the toggle bit of the segment did not alternate (0x05030000)");
    assert_eq!(AbortCode(0x1234_5678).to_string(), "unknown abort code (0x12345678)");
}
