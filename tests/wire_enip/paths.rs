//! Encoded paths on their own: several bytes may say the same.

use fieldarm::wire::enip::path::*;
use fieldarm::wire::enip::{DecodeError, NoRoom};

use super::harness::{Message, check, vector};

struct Connection;

impl Message for Connection {
    type Value<'a> = ConnectionPath<'a>;

    fn read(bytes: &[u8]) -> Result<ConnectionPath<'_>, DecodeError> {
        // A path may end behind any segment; what follows on the wire is what its size says.
        let path = ConnectionPath::read(bytes)?;
        let complete = path.t2o.ok_or(DecodeError::Truncated { message: "path", field: "point" });
        complete.map(|_| path)
    }

    fn write(value: &ConnectionPath<'_>, room: &mut [u8]) -> Result<usize, NoRoom> {
        value.write(room)
    }
}

fn robot(config: Option<u32>) -> ConnectionPath<'static> {
    ConnectionPath { config, o2t: Some(150), t2o: Some(100), ..ConnectionPath::default() }
}

#[test]
fn points_with_and_without_configuration() {
    check::<Connection>("20! 04 24! 97 2C! 96 2C! 64", &robot(Some(151)));
    check::<Connection>("20! 04 2C! 96 2C! 64", &robot(None));
}

#[test]
fn wide_numbers() {
    let path = ConnectionPath {
        config: Some(0x0001_0000),
        o2t: Some(0x0100),
        t2o: Some(0xFFFF_FFFF),
        ..ConnectionPath::default()
    };
    check::<Connection>(
        "20! 04
         26! 00~ 00! 00! 01! 00!  # instance of 32 bits
         2D! 00~ 00! 01!     # point of 16 bits
         2E! 00~ FF FF! FF! FF!  # point of 32 bits",
        &path,
    );
}

fn read(text: &str) -> Result<ConnectionPath<'static>, String> {
    let bytes = vector(text).bytes;
    match ConnectionPath::read(&bytes) {
        Ok(path) => Ok(ConnectionPath { data: &[], ..path }),
        Err(error) => Err(error.to_string()),
    }
}

/// Scanners write the same points in several ways.
#[test]
fn the_same_points_otherwise() {
    for text in [
        "20 04 24 97 2C 96 2C 64",
        "21 00 04 00 25 00 97 00 2D 00 96 00 2D 00 64 00",
        "20 04 24 97 24 96 24 64",
        "20 04 24 97 24 96 2C 64",
        "20 04 24 97 2C 96 2C 64 43 05", // production inhibit time of 5 ms
    ] {
        assert_eq!(read(text), Ok(robot(Some(151))), "{text}");
    }
    assert_eq!(read("20 04 24 96 24 64"), Ok(robot(None)));
}

#[test]
fn what_is_wrong_is_named() {
    let order = "but must be key, class, instance, points, data, each once";
    for (text, expected) in [
        ("", "connection path is cut off in its class".to_owned()),
        ("24 97", "connection path is cut off in its class".to_owned()),
        ("20 06 24 01", "connection path: class is 6, but must be 4 (assembly)".to_owned()),
        ("20 04 20 04", format!("connection path: order of segments is 32, {order}")),
        ("20 04 30 03", format!("connection path: order of segments is 48, {order}")),
        ("01 00 20 04", "path: segment type is 1, but must be".to_owned()),
        ("20 04 2F 96", "path: segment type is 47, but must be".to_owned()),
        ("34 05 00 00", "path: key format is 5, but must be 4".to_owned()),
        ("20 04 80 02 00 00", "path is cut off in its data segment".to_owned()),
        (
            "20 04 80 01 00 00 80 01 00 00",
            format!("connection path: order of segments is 128, {order}"),
        ),
    ] {
        let error = read(text).unwrap_err();
        assert!(error.starts_with(&expected), "{text}: {error}");
    }
    assert!(read("20 04 2C 01 2C 02 2C 03").is_err());
    assert!(read("20 04 24 01 24 02 24 03 24 04").is_err());
    assert!(read("20 04 24 01 24 02 24 03 2C 04").is_err());
}

#[test]
fn objects() {
    for (text, class, instance, attribute) in [
        ("20 01 24 01 30 07", 1, 1, Some(7)),
        ("20 F5 24 01", 0xF5, 1, None),
        ("20 02", 2, 0, None),
        ("20 04 2C 64 30 03", 4, 100, Some(3)),
        ("21 00 00 03 25 00 00 02 31 00 00 01", 0x300, 0x200, Some(0x100)),
    ] {
        let expected = ObjectPath { class, instance, attribute };
        assert_eq!(ObjectPath::read(&vector(text).bytes), Ok(expected), "{text}");
    }
    for (text, expected) in [
        ("", "path is cut off in its class"),
        ("24 01 20 01", "path: order of segments is 36, but must be class, instance"),
        ("20 01 30 01 24 01", "path: order of segments is 36"),
        ("20 01 24 01 24 01", "path: order of segments is 36"),
        ("20 01 24 01 30 01 30 01", "path: order of segments is 48"),
        ("20 01 24", "path is cut off in its 8-bit segment value"),
        ("21 00 01", "path is cut off in its 16-bit segment value"),
    ] {
        let error = ObjectPath::read(&vector(text).bytes).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{text}: {error}");
    }
}

/// Behind a segment that cannot be read nothing follows, so that a loop over segments ends.
#[test]
fn segments_end_at_the_first_error() {
    let bytes = vector("20 04 28 05 30 06 43 07 80 01 AA BB FF 20 04").bytes;
    let found: Vec<_> = segments(&bytes).collect();
    assert_eq!(
        found[..5],
        [
            Ok(Segment::Class(4)),
            Ok(Segment::Member(5)),
            Ok(Segment::Attribute(6)),
            Ok(Segment::ProductionInhibit(7)),
            Ok(Segment::Data(&[0xAA, 0xBB])),
        ]
    );
    assert_eq!(found.len(), 6);
    assert!(found[5].is_err());
}

/// Data of an odd length are filled up; more than 255 words cannot be said.
#[test]
fn data_segments() {
    let path = ConnectionPath { data: &[1, 2, 3], ..robot(None) };
    let mut room = [0xEE; 600];
    let len = path.write(&mut room).unwrap();
    assert_eq!(room[..len], [0x20, 4, 0x2C, 150, 0x2C, 100, 0x80, 2, 1, 2, 3, 0]);
    let long = [0; 512];
    assert_eq!(ConnectionPath { data: &long[..510], ..path }.write(&mut room), Ok(518));
    assert_eq!(
        ConnectionPath { data: &long[..511], ..path }.write(&mut room),
        Err(NoRoom { room: 600 })
    );
}
