//! What every vector goes through: read, written, written into too little room, cut off, bit by bit flipped.

use std::fmt::Debug;

use fieldarm::wire::enip::{DecodeError, NoRoom};

/// A kind of message, read and written as a whole.
pub(crate) trait Message {
    /// What its bytes mean.
    type Value<'a>: Debug + PartialEq;
    fn read(bytes: &[u8]) -> Result<Self::Value<'_>, DecodeError>;
    fn write(value: &Self::Value<'_>, room: &mut [u8]) -> Result<usize, NoRoom>;
    /// What must stay when a value is written in another way than it was read.
    fn meaning(value: &Self::Value<'_>) -> String {
        format!("{value:?}")
    }
}

/// Bytes typed by hand, with what is to be expected of their bits.
pub(crate) struct Vector {
    pub(crate) bytes: Vec<u8>,
    /// Bits that mean nothing, by byte: flipped, the message reads the same.
    ignored: Vec<u8>,
    /// Bytes whose flips may read to a value that is written otherwise.
    loose: Vec<bool>,
}

/// Reads hexadecimal bytes. `#` begins a comment; `xx~` is a byte that means nothing, `xx~mm` one whose
/// bits `mm` mean nothing, `xx!` one with which the same can be said in several ways.
pub(crate) fn vector(text: &str) -> Vector {
    let mut vector = Vector { bytes: Vec::new(), ignored: Vec::new(), loose: Vec::new() };
    let hex =
        |text: &str| u8::from_str_radix(text, 16).unwrap_or_else(|_| panic!("not hex: {text}"));
    for line in text.lines() {
        for word in line.split('#').next().unwrap().split_whitespace() {
            let (byte, mark) = word.split_at(2);
            vector.bytes.push(hex(byte));
            vector.ignored.push(match mark.strip_prefix('~') {
                Some("") => 0xFF,
                Some(mask) => hex(mask),
                None => 0,
            });
            vector.loose.push(mark == "!");
            assert!(
                mark.is_empty() || mark.starts_with('~') || mark == "!",
                "unknown mark: {word}"
            );
        }
    }
    vector
}

/// `byte` `count` times, as text for [`vector`].
pub(crate) fn repeated(byte: &str, count: usize) -> String {
    vec![byte; count].join(" ")
}

fn written<M: Message>(value: &M::Value<'_>) -> Vec<u8> {
    let mut room = [0xAA; 1024];
    let len = M::write(value, &mut room).unwrap_or_else(|error| panic!("{error}: {value:?}"));
    room[..len].to_vec()
}

/// An error names the message and the field, or how many bytes are too many.
fn assert_names_place(error: DecodeError, what: &str) {
    let text = error.to_string();
    let (message, field) = match error {
        DecodeError::Truncated { message, field } | DecodeError::Value { message, field, .. } => {
            (message, field.to_owned())
        }
        DecodeError::Trailing { message, count } => {
            assert!(count > 0, "{what}: {text}");
            (message, count.to_string())
        }
    };
    assert!(!message.is_empty() && !field.is_empty(), "{what}: {text}");
    assert!(text.contains(message) && text.contains(&field), "{what}: {text}");
}

/// Puts a vector through everything. `expected` is what it must read to.
pub(crate) fn check<M: Message>(text: &str, expected: &M::Value<'_>) {
    let vector = vector(text);
    let bytes = &vector.bytes;
    let shown = format!("{expected:?}");
    match M::read(bytes) {
        Ok(value) => assert_eq!(format!("{value:?}"), shown),
        Err(error) => panic!("{error}; expected {shown}"),
    }
    assert_eq!(&written::<M>(expected), bytes, "{shown}");
    for room in 0..bytes.len() {
        assert_eq!(M::write(expected, &mut vec![0; room]), Err(NoRoom { room }), "{shown}");
    }
    for len in 0..bytes.len() {
        match M::read(&bytes[..len]) {
            Ok(value) => panic!("cut off at {len} it reads: {value:?}"),
            Err(error) => assert_names_place(error, &format!("cut off at {len}")),
        }
    }
    let mut longer = bytes.clone();
    longer.push(0);
    match M::read(&longer) {
        Ok(value) => panic!("with a byte too many it reads: {value:?}"),
        Err(error) => assert_names_place(error, "with a byte too many"),
    }
    for bit in 0..8 * bytes.len() {
        flip::<M>(&vector, bit / 8, 1 << (bit % 8));
    }
}

fn flip<M: Message>(vector: &Vector, at: usize, mask: u8) {
    let what = format!("bits {mask:#04X} of byte {at} flipped");
    let mut flipped = vector.bytes.clone();
    flipped[at] ^= mask;
    let original = M::read(&vector.bytes).unwrap();
    let value = match M::read(&flipped) {
        Ok(value) => value,
        Err(error) => {
            assert_eq!(vector.ignored[at] & mask, 0, "{what}: {error}");
            return assert_names_place(error, &what);
        }
    };
    if vector.ignored[at] & mask != 0 {
        assert_eq!(value, original, "{what}");
        assert_eq!(written::<M>(&value), vector.bytes, "{what}");
    } else if vector.loose[at] {
        let again = written::<M>(&value);
        let read = M::read(&again).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert_eq!(M::meaning(&read), M::meaning(&value), "{what}");
    } else {
        assert_ne!(format!("{value:?}"), format!("{original:?}"), "{what}");
        assert_eq!(written::<M>(&value), flipped, "{what}: {value:?}");
    }
}

#[test]
fn marks_are_read() {
    let read = vector("01 02~ 03~10 # 04\n 05!");
    assert_eq!(read.bytes, [1, 2, 3, 5]);
    assert_eq!(read.ignored, [0, 0xFF, 0x10, 0]);
    assert_eq!(read.loose, [false, false, false, true]);
    assert_eq!(vector(&repeated("07", 3)).bytes, [7, 7, 7]);
}
