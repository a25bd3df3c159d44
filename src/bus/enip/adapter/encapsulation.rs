//! Encapsulated commands, over TCP and UDP.
//!
//! Source: CIP volume 2, chapter 2. Choices where it leaves any: a second RegisterSession on a stream is
//! refused with status 1; SendUnitData too, since nobody can open a connection for explicit messages here;
//! ListIdentity over UDP is answered at once, however long the requester would wait; other commands than
//! lists are refused over UDP with status 1.

use core::net::SocketAddrV4;

use super::StreamId;
use super::explicit::{MAX_MESSAGE_LEN, Origin};
use super::stream::{Arrived, MAX_PACKET_LEN, Stream};
use super::target::Target;
use crate::time::Instant;
use crate::wire::enip::cpf::Unconnected;
use crate::wire::enip::encapsulation::{
    Command, EncapsulationStatus, Header, PROTOCOL_VERSION, Packet, PacketWriter,
};
use crate::wire::enip::identity::ListedIdentity;
use crate::wire::enip::{MESSAGE_PORT, NoRoom};

/// The one service that there is: type, length, version, what it can do, name.
///
/// It can do CIP over TCP (bit 5) and class 1 over UDP (bit 8). Source: CIP volume 2, chapter 2.
const SERVICES: &[u8] = b"\x01\x00\x00\x01\x14\x00\x01\x00\x20\x01Communications\0\0";
/// No interface but CIP.
const INTERFACES: &[u8] = &[0, 0];
/// State of the identity object: operational.
const OPERATIONAL: u8 = 3;

/// What comes of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reaction {
    Silence,
    /// An answer of so many bytes.
    Answer(usize),
    /// The stream is to be closed.
    Close,
}

impl Reaction {
    /// An answer that has been written. Without room for it, the requester does not read its answers.
    const fn written(written: Result<usize, NoRoom>) -> Self {
        match written {
            Ok(len) => Self::Answer(len),
            Err(NoRoom { .. }) => Self::Close,
        }
    }
}

/// Takes what arrived on a stream; answers wait in its output.
///
/// Who sends requests and does not read the answers gets status 2 in the end, and is then cut off.
pub(super) fn receive(
    target: &mut Target,
    now: Instant,
    id: StreamId,
    stream: &mut Stream,
    bytes: &[u8],
) {
    let mut bytes = bytes;
    while !stream.is_closing {
        let Some(arrived) = stream.input.push(&mut bytes) else { return };
        stream.heard_at = now;
        let room = stream.output.room();
        let origin = Origin { peer: stream.peer, stream: id, t2o_address: None };
        let reaction = match arrived {
            Arrived::TooLong(header) => refuse(header, EncapsulationStatus::INVALID_LENGTH, room),
            Arrived::Packet(packet)
                if room.len() < MAX_PACKET_LEN && is_answered(packet.header) =>
            {
                refuse(packet.header, EncapsulationStatus::NO_MEMORY, room)
            }
            Arrived::Packet(packet) => {
                react(target, now, origin, &mut stream.session, packet, room)
            }
        };
        match reaction {
            Reaction::Silence => {}
            Reaction::Answer(len) => stream.output.commit(len),
            Reaction::Close => stream.is_closing = true,
        }
    }
}

/// Whether a message is one that is answered at all.
fn is_answered(header: Header) -> bool {
    header.options == 0 && !matches!(header.command, Command::NOP | Command::UNREGISTER_SESSION)
}

/// An answer without data, if the message is one that is answered.
fn refuse(header: Header, status: EncapsulationStatus, room: &mut [u8]) -> Reaction {
    if !is_answered(header) {
        return Reaction::Silence;
    }
    Reaction::written(PacketWriter::new(room, header.answer(status)).finish())
}

fn react(
    target: &mut Target,
    now: Instant,
    origin: Origin,
    session: &mut u32,
    packet: Packet<'_>,
    room: &mut [u8],
) -> Reaction {
    let Packet { header, data } = packet;
    if header.options != 0 {
        return Reaction::Silence;
    }
    match header.command {
        Command::REGISTER_SESSION => register(target, session, packet, room),
        Command::UNREGISTER_SESSION if header.session == *session && *session != 0 => {
            *session = 0;
            Reaction::Close
        }
        Command::UNREGISTER_SESSION => Reaction::Silence,
        Command::SEND_RR_DATA if header.session != *session || *session == 0 => {
            refuse(header, EncapsulationStatus::INVALID_SESSION, room)
        }
        Command::SEND_RR_DATA => send_rr_data(target, now, origin, header, data, room),
        _ => list(target, packet, room),
    }
}

fn register(
    target: &mut Target,
    session: &mut u32,
    packet: Packet<'_>,
    room: &mut [u8],
) -> Reaction {
    let header = packet.header;
    let Some((&[low, high, options @ ..], [])) = packet.data.split_first_chunk::<4>() else {
        return refuse(header, EncapsulationStatus::INVALID_LENGTH, room);
    };
    if *session != 0 {
        return refuse(header, EncapsulationStatus::INVALID_COMMAND, room);
    }
    let is_supported = u16::from_le_bytes([low, high]) == PROTOCOL_VERSION && options == [0, 0];
    let status = match is_supported {
        true => EncapsulationStatus::SUCCESS,
        false => EncapsulationStatus::UNSUPPORTED_VERSION,
    };
    if is_supported {
        *session = target.ids.next();
    }
    let answer = Header { session: *session, ..header.answer(status) };
    let mut writer = PacketWriter::new(room, answer);
    writer.put(&PROTOCOL_VERSION.to_le_bytes());
    writer.put(&[0, 0]);
    Reaction::written(writer.finish())
}

fn send_rr_data(
    target: &mut Target,
    now: Instant,
    origin: Origin,
    header: Header,
    data: &[u8],
    room: &mut [u8],
) -> Reaction {
    let mut response = [0; MAX_MESSAGE_LEN];
    let answered = Unconnected::read(data).ok().and_then(|request| {
        let origin = Origin { t2o_address: request.t2o_address, ..origin };
        target.answer(now, origin, request.message, &mut response)
    });
    let Some(answer) = answered else {
        return refuse(header, EncapsulationStatus::INCORRECT_DATA, room);
    };
    let message = response.get(..answer.len).unwrap_or_default();
    let mut writer = PacketWriter::new(room, header.answer(EncapsulationStatus::SUCCESS));
    Unconnected { t2o_address: answer.t2o_address, ..Unconnected::new(message) }.put(&mut writer);
    Reaction::written(writer.finish())
}

/// Answers what needs no session, over TCP or UDP.
fn list(target: &Target, packet: Packet<'_>, room: &mut [u8]) -> Reaction {
    let Packet { header, data } = packet;
    let is_list = matches!(
        header.command,
        Command::LIST_IDENTITY | Command::LIST_SERVICES | Command::LIST_INTERFACES
    );
    if !is_list {
        return refuse(header, EncapsulationStatus::INVALID_COMMAND, room);
    }
    if !data.is_empty() {
        return refuse(header, EncapsulationStatus::INVALID_LENGTH, room);
    }
    let mut writer = PacketWriter::new(room, header.answer(EncapsulationStatus::SUCCESS));
    match header.command {
        Command::LIST_IDENTITY => {
            let address = SocketAddrV4::new(target.address, MESSAGE_PORT);
            let identity = target.identity();
            ListedIdentity { address, identity, state: OPERATIONAL }.put(&mut writer);
        }
        Command::LIST_SERVICES => writer.put(SERVICES),
        _ => writer.put(INTERFACES),
    }
    Reaction::written(writer.finish())
}

/// Bytes of the longest answer over UDP: ListIdentity with a name of 32 bytes.
const DATAGRAM_LEN: usize = 96;
/// Answers over UDP that wait; more are lost, as datagrams may be.
const DATAGRAMS: usize = 8;

/// Answers over UDP.
#[derive(Debug)]
pub(super) struct Datagrams {
    waiting: [Option<Datagram>; DATAGRAMS],
}

#[derive(Clone, Copy, Debug)]
struct Datagram {
    to: SocketAddrV4,
    bytes: [u8; DATAGRAM_LEN],
    len: usize,
}

impl Datagrams {
    pub(super) const fn new() -> Self {
        Self { waiting: [None; DATAGRAMS] }
    }

    /// Takes a datagram that arrived.
    pub(super) fn receive(&mut self, target: &Target, from: SocketAddrV4, datagram: &[u8]) {
        let Ok(packet) = Packet::from_datagram(datagram) else { return };
        let Some(place) = self.waiting.iter_mut().find(|place| place.is_none()) else { return };
        if packet.header.options != 0 {
            return;
        }
        let mut bytes = [0; DATAGRAM_LEN];
        if let Reaction::Answer(len) = list(target, packet, &mut bytes) {
            *place = Some(Datagram { to: from, bytes, len });
        }
    }

    /// Moves the next answer into `room`: where it goes and its length. One that does not fit is lost.
    pub(super) fn take(&mut self, room: &mut [u8]) -> Option<(SocketAddrV4, usize)> {
        self.waiting.iter_mut().find_map(|place| {
            let datagram = place.take()?;
            let room = room.get_mut(..datagram.len)?;
            room.copy_from_slice(datagram.bytes.get(..datagram.len)?);
            Some((datagram.to, datagram.len))
        })
    }
}
