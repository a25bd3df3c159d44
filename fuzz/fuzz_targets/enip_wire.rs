//! Arbitrary bytes as every message of EtherNet/IP: nothing panics, errors have words, and what was read is
//! written so that it reads the same.
#![no_main]

use fieldarm::wire::enip::connection::*;
use fieldarm::wire::enip::cpf::{Unconnected, items, read_socket_address};
use fieldarm::wire::enip::encapsulation::{Packet, PacketWriter};
use fieldarm::wire::enip::identity::{Identity, ListedIdentity};
use fieldarm::wire::enip::io::IoFrame;
use fieldarm::wire::enip::message::{Request, Response};
use fieldarm::wire::enip::path::{ConnectionPath, ObjectPath, segments};
use fieldarm::wire::enip::session::{ListedService, Registration};
use fieldarm::wire::enip::{DecodeError, NoRoom};
use libfuzzer_sys::fuzz_target;

/// More than the longest input and what is put around it.
const ROOM: usize = 8_192;

/// Reads; if that succeeds, writes and reads again.
fn again<T: PartialEq + std::fmt::Debug>(
    read: Result<T, DecodeError>,
    write: impl Fn(&T, &mut [u8]) -> Result<usize, NoRoom>,
    check: impl Fn(&[u8], &T) -> bool,
) {
    match read {
        Ok(value) => {
            let mut room = vec![0; ROOM];
            let len = write(&value, &mut room).unwrap_or_else(|error| panic!("{error}: {value:?}"));
            assert!(check(&room[..len], &value), "{value:?} was written as {:?}", &room[..len]);
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// [`again`] for a reader and a writer of the same bytes.
macro_rules! again {
    ($data:expr, $read:expr, $write:expr) => {
        again($read($data), $write, |bytes, value| $read(bytes).as_ref() == Ok(value))
    };
}

/// Reads what stands behind a header in the same way as `read`, from the data of a packet.
fn data(bytes: &[u8]) -> &[u8] {
    Packet::from_datagram(bytes).map_or(&[], |packet| packet.data)
}

fuzz_target!(|bytes: &[u8]| {
    if bytes.len() > ROOM / 2 {
        return;
    }
    if let (Some((packet, len)), Ok(header)) =
        (Packet::from_stream(bytes), Packet::from_datagram(bytes).map(|packet| packet.header))
    {
        assert_eq!((packet.header, len), (header, bytes.len()));
    }
    again!(bytes, Packet::from_datagram, |packet: &Packet<'_>, room: &mut [u8]| {
        let mut writer = PacketWriter::new(room, packet.header);
        writer.put(packet.data);
        writer.finish()
    });
    // As a whole, and as what is in a packet: the header is hard to hit by chance.
    for bytes in [bytes, data(bytes)] {
        let header = fieldarm::wire::enip::encapsulation::Header::new;
        let header = header(fieldarm::wire::enip::encapsulation::Command::NOP, 0);
        again(
            Unconnected::read(bytes),
            |value, room| {
                let mut writer = PacketWriter::new(room, header);
                value.put(&mut writer);
                writer.finish()
            },
            |bytes, value| Unconnected::read(data(bytes)).as_ref() == Ok(value),
        );
        again(
            ListedIdentity::read(bytes),
            |value, room| {
                let mut writer = PacketWriter::new(room, header);
                value.put(&mut writer);
                writer.finish()
            },
            |bytes, value| ListedIdentity::read(data(bytes)).as_ref() == Ok(value),
        );
        again(
            ListedService::read(bytes),
            |value, room| {
                let mut writer = PacketWriter::new(room, header);
                value.put(&mut writer);
                writer.finish()
            },
            |bytes, value| ListedService::read(data(bytes)).as_ref() == Ok(value),
        );
        if let Ok(registration) = Registration::read(bytes) {
            assert_eq!(registration.to_bytes(), bytes);
        }
        if let Ok(items) = items(bytes) {
            assert!(items.count() <= bytes.len());
        }
        let _ = read_socket_address(bytes);
        if let Ok(refusal) = ConnectionRefusal::read(bytes) {
            assert_eq!(ConnectionRefusal::read(&refusal.to_bytes()), Ok(refusal));
        }
        assert!(segments(bytes).count() <= bytes.len());
        again!(bytes, Identity::read, |value: &Identity, room: &mut [u8]| value.write(room));
        again!(bytes, ObjectPath::read, |value: &ObjectPath, room: &mut [u8]| value.write(room));
        again!(bytes, IoFrame::read, |value: &IoFrame<'_>, room: &mut [u8]| value
            .write(None, room));
        again!(bytes, Request::read, |value: &Request<'_>, room: &mut [u8]| value.write(room));
        again!(bytes, Response::read, |value: &Response<'_>, room: &mut [u8]| value.write(room));
        for is_large in [false, true] {
            again!(
                bytes,
                |bytes| ForwardOpen::read(bytes, is_large),
                |value: &ForwardOpen<'_>, room: &mut [u8]| value.write(room, is_large)
            );
        }
        again!(bytes, ForwardOpenReply::read, |value: &ForwardOpenReply<'_>, room: &mut [u8]| {
            value.write(room)
        });
        again!(bytes, ForwardClose::read, |value: &ForwardClose<'_>, room: &mut [u8]| {
            value.write(room)
        });
        again!(bytes, ForwardCloseReply::read, |value: &ForwardCloseReply<'_>, room: &mut [u8]| {
            value.write(room)
        });
        again!(bytes, ConnectionPath::read, |value: &ConnectionPath<'_>, room: &mut [u8]| {
            value.write(room)
        });
    }
});
