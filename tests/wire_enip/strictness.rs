//! What is refused although it could be guessed, and what is taken although it differs from the usual.

use fieldarm::wire::enip::connection::{ConnectionRefusal, Triad};
use fieldarm::wire::enip::cpf::{Unconnected, items, read_socket_address};
use fieldarm::wire::enip::encapsulation::{Command, Header, Packet, PacketWriter};
use fieldarm::wire::enip::identity::{Identity, ProductName};
use fieldarm::wire::enip::message::{Request, Response, Service};
use fieldarm::wire::enip::path::ElectronicKey;
use fieldarm::wire::enip::status::GeneralStatus;
use fieldarm::wire::meca500::adapter::IDENTITY;

use super::harness::vector;

/// Targets that know nothing of routing end a refusal behind the triad.
#[test]
fn a_refusal_may_end_behind_the_triad() {
    let bytes = vector("34 12  39 05  0D F0 FE CA  03  00").bytes;
    let triad = Triad { connection_serial: 0x1234, vendor: 0x0539, originator_serial: 0xCAFE_F00D };
    for len in 0..bytes.len() {
        let expected = (len == 8).then_some(ConnectionRefusal { triad, remaining_path_words: 0 });
        assert_eq!(ConnectionRefusal::read(&bytes[..len]).ok(), expected, "{len} bytes");
    }
    let whole = ConnectionRefusal { triad, remaining_path_words: 3 };
    assert_eq!(ConnectionRefusal::read(&bytes), Ok(whole));
    assert!(ConnectionRefusal::read(&[bytes.as_slice(), &[0]].concat()).is_err());
}

fn unconnected_error(text: &str) -> String {
    Unconnected::read(&vector(text).bytes).unwrap_err().to_string()
}

#[test]
fn items_of_an_unconnected_message() {
    let good = "00 00 00 00  00 00  02 00  00 00 00 00  B2 00 01 00 AA";
    assert_eq!(Unconnected::read(&vector(good).bytes), Ok(Unconnected::new(&[0xAA])));
    let unknown = "00 00 00 00  00 00  03 00  00 00 00 00  B2 00 01 00 AA  77 00 02 00 01 02";
    assert_eq!(Unconnected::read(&vector(unknown).bytes), Ok(Unconnected::new(&[0xAA])));
    for (text, expected) in [
        ("01 00 00 00  00 00  00 00", "SendRRData: interface handle is 1, but must be 0 (CIP)"),
        ("00 00 00 00  00 00  00 00", "SendRRData is cut off in its address item"),
        ("00 00 00 00  00 00  01 00  00 00 00 00", "SendRRData is cut off in its data item"),
        (
            "00 00 00 00  00 00  02 00  A1 00 00 00  B2 00 00 00",
            "SendRRData: address item type is 161, but must be 0 (unconnected)",
        ),
        (
            "00 00 00 00  00 00  02 00  00 00 01 00 FF  B2 00 00 00",
            "SendRRData: address item length is 1, but must be 0",
        ),
        (
            "00 00 00 00  00 00  02 00  00 00 00 00  B1 00 00 00",
            "SendRRData: data item type is 177, but must be 178 (unconnected data)",
        ),
        (
            "00 00 00 00  00 00  01 00  00 00 00 00  B2 00 00 00",
            "common packet format is followed by 4 bytes that do not belong to it",
        ),
        (
            "00 00 00 00  00 00  03 00  00 00 00 00  B2 00 00 00  00 80 02 00 00 02",
            "socket address item is cut off in its port",
        ),
        (
            "00 00 00 00  00 00  04 00  00 00 00 00  B2 00 00 00
             00 80 10 00 00 02 08 AE 00 00 00 00 00 00 00 00 00 00 00 00
             00 80 10 00 00 02 08 AE 00 00 00 00 00 00 00 00 00 00 00 00",
            "SendRRData: socket address item type is 32768, but must be there once",
        ),
    ] {
        assert_eq!(unconnected_error(text), expected, "{text}");
    }
}

#[test]
fn socket_addresses() {
    // Little-endian by mistake: family 2 reads as 512.
    let swapped = vector("02 00 AE 08 01 02 A8 C0 00 00 00 00 00 00 00 00").bytes;
    assert_eq!(
        read_socket_address(&swapped).unwrap_err().to_string(),
        "socket address item: family is 512, but must be 2"
    );
    let padded = vector("00 02 08 AE C0 A8 02 01 01 02 03 04 05 06 07 08").bytes;
    assert_eq!(read_socket_address(&padded), Ok("192.168.2.1:2222".parse().unwrap()));
}

/// The count alone may say 65535 items; as many as there are bytes for are looked at.
#[test]
fn a_count_without_items() {
    assert_eq!(
        items(&[0xFF, 0xFF]).unwrap_err().to_string(),
        "common packet format is cut off in its item type"
    );
    let many = [vec![0xFF, 0xFF], vec![0; 4 * 65_535]].concat();
    assert_eq!(items(&many).unwrap().count(), 65_535);
    assert!(items(&many[..many.len() - 1]).is_err());
}

#[test]
fn requests_are_no_responses() {
    assert!(Request::read(&[0x8E, 0]).is_err());
    assert!(Response::read(&[0x0E, 0, 0, 0]).is_err());
    // A service never carries the bit of a response, whatever a caller puts into it.
    let mut room = [0; 8];
    let service = Service(0x8E);
    let len = Request { service, path: &[], data: &[] }.write(&mut room).unwrap();
    assert_eq!(Request::read(&room[..len]).unwrap().service, Service::GET_ATTRIBUTE_SINGLE);
}

#[test]
fn odd_and_overlong_parts() {
    let mut room = [0xEE; 700];
    let long = [0; 600];
    let service = Service::GET_ATTRIBUTE_SINGLE;
    let odd = Request { service, path: &[0x20, 0x01, 0x24], data: &[9] };
    assert_eq!(odd.write(&mut room), Ok(7));
    assert_eq!(room[..7], [0x0E, 2, 0x20, 0x01, 0x24, 0, 9]);
    assert!(Request { service, path: &long, data: &[] }.write(&mut room).is_err());
    let status = GeneralStatus::CONNECTION_FAILURE;
    let response = Response { service, status, additional: &[1, 2, 3], data: &[9] };
    assert_eq!(response.write(&mut room), Ok(7));
    assert_eq!(room[..7], [0x8E, 0, 1, 1, 1, 2, 9]);
    assert!(Response { additional: &long, ..response }.write(&mut room).is_err());
}

#[test]
fn product_names() {
    let long = [b'x'; 40];
    assert_eq!(ProductName::new(&long).as_bytes(), &long[..32]);
    assert_eq!(ProductName::new(b"a\xFFb").to_string(), "a\\xffb");
    let mut bytes = [0; 64];
    let len = Identity { name: ProductName::new(&long), ..IDENTITY }.write(&mut bytes).unwrap();
    assert_eq!(len, 47);
    assert!(Identity::read(&bytes[..len]).is_ok());
    // GetAttributesAll may go on behind the seventh attribute.
    assert!(Identity::read(&bytes).is_ok());
    bytes[14] = 33;
    assert_eq!(
        Identity::read(&bytes).unwrap_err().to_string(),
        "identity: length of product name is 33, but must be 0 to 32"
    );
}

#[test]
fn packets_have_a_largest_size() {
    let mut room = vec![0; 70_000];
    let data = vec![7; 65_536];
    for (len, expected) in [(65_535, Some(65_559)), (65_536, None)] {
        let mut packet = PacketWriter::new(&mut room, Header::new(Command::NOP, 0));
        packet.put(&data[..len]);
        assert_eq!(packet.finish().ok(), expected);
        if expected.is_some() {
            let (packet, len) = Packet::from_stream(&room).unwrap();
            assert_eq!((packet.data.len(), len), (65_535, 65_559));
        }
    }
}

#[test]
fn keys_default_to_any_device() {
    let key = ElectronicKey::default();
    assert_eq!(
        (key.vendor, key.device_type, key.product_code, key.major, key.minor, key.is_compatible),
        (0, 0, 0, 0, 0, false)
    );
}
