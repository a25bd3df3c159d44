//! Messages that are nothing but a header and a few fields: sessions and lists.

use std::net::{Ipv4Addr, SocketAddrV4};

use fieldarm::wire::enip::cpf::items;
use fieldarm::wire::enip::encapsulation::*;
use fieldarm::wire::enip::identity::{Identity, ListedIdentity, ProductName};
use fieldarm::wire::enip::session::{ListedService, Registration, put_list_services};
use fieldarm::wire::enip::{DecodeError, NoRoom};
use fieldarm::wire::meca500::adapter::IDENTITY;

use super::harness::{Message, check, vector};

#[derive(Clone, Copy, Debug, PartialEq)]
enum Data<'a> {
    Empty,
    Registration(Registration),
    Service(ListedService),
    Identity(ListedIdentity),
    /// Items that nothing here knows, or the data of a NOP.
    Raw(&'a [u8]),
}

struct Control;

impl Message for Control {
    type Value<'a> = (Header, Data<'a>);

    fn read(bytes: &[u8]) -> Result<Self::Value<'_>, DecodeError> {
        let Packet { header, data } = Packet::from_datagram(bytes)?;
        let data = match header.command {
            _ if data.is_empty() => Data::Empty,
            Command::REGISTER_SESSION => Data::Registration(Registration::read(data)?),
            Command::LIST_SERVICES => Data::Service(ListedService::read(data)?),
            Command::LIST_IDENTITY => Data::Identity(ListedIdentity::read(data)?),
            Command::LIST_INTERFACES => {
                let _whole = items(data)?;
                Data::Raw(data)
            }
            _ => Data::Raw(data),
        };
        Ok((header, data))
    }

    fn write((header, data): &Self::Value<'_>, room: &mut [u8]) -> Result<usize, NoRoom> {
        let mut packet = PacketWriter::new(room, *header);
        match data {
            Data::Empty => {}
            Data::Registration(registration) => packet.put(&registration.to_bytes()),
            Data::Service(service) => service.put(&mut packet),
            Data::Identity(identity) => identity.put(&mut packet),
            Data::Raw(bytes) => packet.put(bytes),
        }
        packet.finish()
    }
}

fn header(command: Command, length: u16, session: u32, context: &[u8; 8]) -> Header {
    Header { length, context: *context, ..Header::new(command, session) }
}

#[test]
fn nop() {
    let expected = header(Command::NOP, 0, 0, &[0; 8]);
    check::<Control>(
        "00 00  00 00  00 00 00 00  00 00 00 00  00 00 00 00 00 00 00 00  00 00 00 00",
        &(expected, Data::Empty),
    );
}

/// A NOP may carry data that nobody reads.
#[test]
fn nop_with_data() {
    check::<Control>(
        "00 00  03 00  00 00 00 00  00 00 00 00  00 00 00 00 00 00 00 00  00 00 00 00  AA BB CC",
        &(header(Command::NOP, 3, 0, &[0; 8]), Data::Raw(&[0xAA, 0xBB, 0xCC])),
    );
}

#[test]
fn register_session() {
    check::<Control>(
        "65 00              # RegisterSession
         04 00              # 4 bytes follow
         00 00 00 00        # no session yet
         00 00 00 00        # status
         31 32 33 34 35 36 37 38  # context
         00 00 00 00        # options
         01 00              # protocol version 1
         00 00              # options",
        &(
            header(Command::REGISTER_SESSION, 4, 0, b"12345678"),
            Data::Registration(Registration::default()),
        ),
    );
}

#[test]
fn register_session_answered() {
    check::<Control>(
        "65 00  04 00
         44 33 22 11        # the handle of the new session
         00 00 00 00
         31 32 33 34 35 36 37 38
         00 00 00 00
         01 00  00 00",
        &(
            header(Command::REGISTER_SESSION, 4, 0x1122_3344, b"12345678"),
            Data::Registration(Registration { version: 1, options: 0 }),
        ),
    );
}

/// A version that the target does not speak: status 0x69, and the version that it does.
#[test]
fn register_session_refused() {
    let status = EncapsulationStatus::UNSUPPORTED_VERSION;
    check::<Control>(
        "65 00  04 00  00 00 00 00
         69 00 00 00        # unsupported protocol revision
         00 00 00 00 00 00 00 00  00 00 00 00
         01 00  00 00",
        &(
            Header { status, ..header(Command::REGISTER_SESSION, 4, 0, &[0; 8]) },
            Data::Registration(Registration::default()),
        ),
    );
}

#[test]
fn unregister_session() {
    check::<Control>(
        "66 00  00 00  44 33 22 11  00 00 00 00  00 00 00 00 00 00 00 00  00 00 00 00",
        &(header(Command::UNREGISTER_SESSION, 0, 0x1122_3344, &[0; 8]), Data::Empty),
    );
}

/// A SendRRData on a session that the target does not know comes back without data.
#[test]
fn unknown_session() {
    let asked = header(Command::SEND_RR_DATA, 0, 0xDEAD_BEEF, b"whoareyu");
    check::<Control>(
        "6F 00  00 00  EF BE AD DE
         64 00 00 00        # invalid session handle
         77 68 6F 61 72 65 79 75  00 00 00 00",
        &(asked.answer(EncapsulationStatus::INVALID_SESSION), Data::Empty),
    );
}

#[test]
fn list_services() {
    check::<Control>(
        "04 00  00 00  00 00 00 00  00 00 00 00  00 00 00 00 00 00 00 00  00 00 00 00",
        &(header(Command::LIST_SERVICES, 0, 0, &[0; 8]), Data::Empty),
    );
}

const LIST_SERVICES_ANSWER: &str = "04 00  1A 00  00 00 00 00  00 00 00 00
     00 00 00 00 00 00 00 00  00 00 00 00
     01 00              # one item
     00 01              # list services
     14 00              # 20 bytes
     01 00              # protocol version
     20 01              # CIP over TCP (bit 5), class 0 and 1 over UDP (bit 8)
     43 6F 6D 6D 75 6E 69 63 61 74 69 6F 6E 73 00 00  # Communications";

#[test]
fn list_services_answered() {
    let expected = header(Command::LIST_SERVICES, 26, 0, &[0; 8]);
    let data = Data::Service(ListedService::COMMUNICATIONS);
    check::<Control>(LIST_SERVICES_ANSWER, &(expected, data));
    let mut room = [0; 64];
    let mut packet = PacketWriter::new(&mut room, Header::new(Command::LIST_SERVICES, 0));
    put_list_services(&mut packet);
    let len = packet.finish().unwrap();
    assert_eq!(room[..len], vector(LIST_SERVICES_ANSWER).bytes);
}

#[test]
fn list_interfaces_answered() {
    check::<Control>(
        "64 00  02 00  00 00 00 00  00 00 00 00  00 00 00 00 00 00 00 00  00 00 00 00
         00 00              # no item",
        &(header(Command::LIST_INTERFACES, 2, 0, &[0; 8]), Data::Raw(&[0, 0])),
    );
}

#[test]
fn list_identity() {
    check::<Control>(
        "63 00  00 00  00 00 00 00  00 00 00 00
         0A 00 00 00 00 00 00 00  # context: who asks may number the questions
         00 00 00 00",
        &(header(Command::LIST_IDENTITY, 0, 0, &[10, 0, 0, 0, 0, 0, 0, 0]), Data::Empty),
    );
}

#[test]
fn list_identity_answered() {
    let listed = ListedIdentity {
        address: SocketAddrV4::new(Ipv4Addr::new(192, 168, 0, 100), 44_818),
        identity: Identity { status: 0x0030, serial: 0x0102_0304, ..IDENTITY },
        state: 3,
    };
    check::<Control>(
        "63 00  2F 00  00 00 00 00  00 00 00 00  0A 00 00 00 00 00 00 00  00 00 00 00
         01 00              # one item
         0C 00              # identity
         29 00              # 41 bytes
         01~ 00~            # protocol version
         00 02              # from here big-endian: family
         AF 12              # port 44818
         C0 A8 00 64        # 192.168.0.100
         00~ 00~ 00~ 00~ 00~ 00~ 00~ 00~
         1D 06              # little-endian again: vendor 1565
         2B 00              # device type 43
         F4 01              # product 500
         0B 03              # revision 11.3
         30 00              # status
         04 03 02 01        # serial number
         07 4D 65 63 61 35 30 30  # Meca500
         03                 # state: operational",
        &(
            header(Command::LIST_IDENTITY, 47, 0, &[10, 0, 0, 0, 0, 0, 0, 0]),
            Data::Identity(listed),
        ),
    );
}

struct Attributes;

impl Message for Attributes {
    type Value<'a> = Identity;

    fn read(bytes: &[u8]) -> Result<Identity, DecodeError> {
        // Attributes behind the seventh are allowed; here none are.
        let identity = Identity::read(bytes)?;
        match bytes.len() - 15 - identity.name.as_bytes().len() {
            0 => Ok(identity),
            count => Err(DecodeError::Trailing { message: "identity", count }),
        }
    }

    fn write(value: &Identity, room: &mut [u8]) -> Result<usize, NoRoom> {
        value.write(room)
    }
}

/// What GetAttributesAll of the identity object returns; a name of 11 bytes, filled up with nothing.
#[test]
fn identity_attributes() {
    let expected = Identity {
        vendor: 1,
        device_type: 12,
        product_code: 58,
        major: 4,
        minor: 1,
        status: 0x0030,
        serial: 0x00AB_CDEF,
        name: ProductName::new(b"1756-ENBT/A"),
    };
    check::<Attributes>(
        "01 00  0C 00  3A 00  04 01  30 00  EF CD AB 00
         0B 31 37 35 36 2D 45 4E 42 54 2F 41",
        &expected,
    );
}
