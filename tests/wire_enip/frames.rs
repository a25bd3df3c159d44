//! Class 1 frames, both directions, and their sequence numbers.

use fieldarm::wire::enip::io::{IoFrame, OVERHEAD, is_later, is_newer};
use fieldarm::wire::enip::parameters::{RUN_IDLE_LEN, SEQUENCE_LEN};
use fieldarm::wire::enip::{DecodeError, NoRoom};

use super::harness::{Message, check, repeated, vector};

/// T->O: the image stands right behind the sequence count.
struct Bare;

impl Message for Bare {
    type Value<'a> = IoFrame<'a>;

    fn read(bytes: &[u8]) -> Result<IoFrame<'_>, DecodeError> {
        IoFrame::read(bytes)
    }

    fn write(value: &IoFrame<'_>, room: &mut [u8]) -> Result<usize, NoRoom> {
        value.write(None, room)
    }
}

/// O->T: the run/idle header comes first.
struct WithHeader;

impl Message for WithHeader {
    type Value<'a> = (bool, IoFrame<'a>);

    fn read(bytes: &[u8]) -> Result<(bool, IoFrame<'_>), DecodeError> {
        let frame = IoFrame::read(bytes)?;
        let (run, data) = frame.split_run_idle()?;
        Ok((run, IoFrame { data, ..frame }))
    }

    fn write((run, frame): &(bool, IoFrame<'_>), room: &mut [u8]) -> Result<usize, NoRoom> {
        frame.write(Some(*run), room)
    }
}

/// The robot's 60 bytes of outputs: 84 bytes of UDP payload.
#[test]
fn outputs() {
    let text = format!(
        "02 00              # two items
         02 80  08 00       # sequenced address
         01 00 22 11        # the id that the target chose
         FF 00 00 00        # 255th frame
         B1 00  42 00       # connected data, 66 bytes
         07 00              # 7th data
         01~FE 00~ 00~ 00~  # run
         {} 5A",
        repeated("A5", 59)
    );
    assert_eq!(vector(&text).bytes.len(), 84);
    assert_eq!(OVERHEAD + usize::from(RUN_IDLE_LEN) + 60, 84);
    let data = [[0xA5; 59].as_slice(), &[0x5A]].concat();
    let (connection_id, sequence, data_sequence) = (0x1122_0001, 255, 7);
    let frame = IoFrame { connection_id, sequence, data_sequence, data: &data };
    check::<WithHeader>(&text, &(true, frame));
    let idle = text.replace("01~FE", "00~FE");
    check::<WithHeader>(&idle, &(false, frame));
}

/// The robot's 252 bytes of inputs: 272 bytes of UDP payload.
#[test]
fn inputs() {
    let text = format!(
        "02 00
         02 80  08 00
         88 77 66 55        # the id that the originator chose
         FF FF FF FF        # the last frame before the count wraps
         B1 00  FE 00       # connected data, 254 bytes
         FF FF
         01 {}",
        repeated("C3", 251)
    );
    assert_eq!(vector(&text).bytes.len(), 272);
    assert_eq!(OVERHEAD + 252, 272);
    assert_eq!(SEQUENCE_LEN + 252, 254);
    let data = [[0x01].as_slice(), &[0xC3; 251]].concat();
    let (connection_id, sequence, data_sequence) = (0x5566_7788, u32::MAX, u16::MAX);
    let frame = IoFrame { connection_id, sequence, data_sequence, data: &data };
    check::<Bare>(&text, &frame);
}

/// A heartbeat has a sequence count and nothing else.
#[test]
fn heartbeat() {
    let frame = IoFrame { connection_id: 0x0A0B_0C0D, sequence: 1, data_sequence: 1, data: &[] };
    check::<Bare>("02 00  02 80  08 00  0D 0C 0B 0A  01 00 00 00  B1 00  02 00  01 00", &frame);
    assert_eq!(
        frame.split_run_idle(),
        Err(DecodeError::Truncated { message: "class 1 frame", field: "run/idle header" })
    );
}

/// Items behind the two are of no concern; other items in their place are.
#[test]
fn items_in_another_order() {
    let swapped = vector("02 00  B1 00  02 00  01 00  02 80  08 00  0D 0C 0B 0A  01 00 00 00");
    let error = IoFrame::read(&swapped.bytes).unwrap_err();
    assert_eq!(
        error.to_string(),
        "class 1 frame: address item type is 177, but must be 32770 (sequenced address)"
    );
    let plain = vector("02 00  A1 00  04 00  0D 0C 0B 0A  B1 00  02 00  01 00");
    assert!(IoFrame::read(&plain.bytes).is_err());
    let more = vector(
        "03 00  02 80  08 00  0D 0C 0B 0A  01 00 00 00  B1 00  02 00  01 00  34 12  01 00  FF",
    );
    let frame = IoFrame { connection_id: 0x0A0B_0C0D, sequence: 1, data_sequence: 1, data: &[] };
    assert_eq!(IoFrame::read(&more.bytes), Ok(frame));
}

#[test]
fn order_across_the_wrap() {
    assert!(is_later(1, 0) && is_later(0, u32::MAX) && is_later(5, u32::MAX - 5));
    assert!(!is_later(0, 0) && !is_later(0, 1) && !is_later(u32::MAX, 0));
    assert!(is_later(0x7FFF_FFFF, 0) && !is_later(0x8000_0000, 0));
    assert!(is_newer(1, 0) && is_newer(0, u16::MAX) && is_newer(5, u16::MAX - 5));
    assert!(!is_newer(0, 0) && !is_newer(0, 1) && !is_newer(u16::MAX, 0));
    assert!(is_newer(0x7FFF, 0) && !is_newer(0x8000, 0));
}
