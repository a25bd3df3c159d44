//! Who is there: ListIdentity to one device, or to all that a broadcast reaches.

use core::net::{Ipv4Addr, SocketAddr, SocketAddrV4};
use std::io::{self, ErrorKind};
use std::net::UdpSocket;
use std::vec::Vec;

use crate::link::clock::MonotonicClock;
use crate::time::Duration;
use crate::wire::enip::encapsulation::{
    Command, EncapsulationStatus, Header, Packet, PacketWriter,
};
use crate::wire::enip::identity::ListedIdentity;

/// Room for an answer: an identity takes 122 bytes at most, and other items may stand beside it.
const ROOM: usize = 2_048;
/// Most devices that are listed, and most datagrams that are looked at.
const MOST_FOUND: usize = 4_096;
const MOST_DATAGRAMS: usize = 65_536;

/// A device that answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Found {
    /// Who sent the answer: where it is reached from here.
    pub from: SocketAddrV4,
    /// What it said.
    pub listed: ListedIdentity,
}

/// Who answered in the time there was.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Listing {
    /// Each device once, by address.
    pub found: Vec<Found>,
    /// Datagrams that were no answer that can be read.
    pub malformed: u32,
}

/// Asks who is at `to` and collects answers for `wait`. `to` is one device or a broadcast address, such as
/// 255.255.255.255:44818; `bind` is the local address to ask from, which chooses the interface. One device
/// is waited for only until it answers.
///
/// # Errors
///
/// The socket cannot be opened at `bind`, or there is no way to `to`. That nobody answers is none.
pub fn list_identity(
    bind: Option<Ipv4Addr>,
    to: SocketAddrV4,
    wait: Duration,
) -> io::Result<Listing> {
    let socket = UdpSocket::bind((bind.unwrap_or(Ipv4Addr::UNSPECIFIED), 0))?;
    socket.set_broadcast(true)?;
    let mut room = [0; ROOM];
    // Answers to a broadcast may take their time up to the one named here, in ms.
    let longest = u16::try_from(wait.as_millis() / 2).unwrap_or(u16::MAX);
    let [low, high] = longest.to_le_bytes();
    let mut header = Header::new(Command::LIST_IDENTITY, 0);
    header.context = [low, high, 0, 0, 0, 0, 0, 0];
    let len = PacketWriter::new(&mut room, header).finish().map_err(io::Error::other)?;
    socket.send_to(room.get(..len).unwrap_or(&room), to)?;
    collect(&socket, to, wait, &mut room)
}

/// Takes in answers until `wait` is over, or until `to` itself has answered.
fn collect(
    socket: &UdpSocket,
    to: SocketAddrV4,
    wait: Duration,
    room: &mut [u8],
) -> io::Result<Listing> {
    let clock = MonotonicClock::new();
    let deadline = clock.now() + wait;
    let mut listing = Listing::default();
    for _ in 0..MOST_DATAGRAMS {
        let left = deadline.saturating_duration_since(clock.now());
        if left.is_zero() || listing.found.len() == MOST_FOUND {
            break;
        }
        socket.set_read_timeout(Some(left))?;
        let (len, from) = match socket.recv_from(room) {
            Ok((len, SocketAddr::V4(from))) => (len, from),
            Ok((_, SocketAddr::V6(_))) => continue,
            Err(error) => match error.kind() {
                // The time is over; or nobody listens there, which a later answer may disprove.
                ErrorKind::WouldBlock
                | ErrorKind::TimedOut
                | ErrorKind::Interrupted
                | ErrorKind::ConnectionRefused
                | ErrorKind::ConnectionReset => continue,
                _ => return Err(error),
            },
        };
        let Some(listed) = room.get(..len).and_then(read_answer) else {
            listing.malformed += 1;
            continue;
        };
        let found = Found { from, listed };
        if !listing.found.iter().any(|known| is_same(known, &found)) {
            listing.found.push(found);
        }
        if from == to {
            break;
        }
    }
    listing.found.sort_by_key(|found| found.from);
    Ok(listing)
}

fn read_answer(datagram: &[u8]) -> Option<ListedIdentity> {
    let packet = Packet::from_datagram(datagram).ok()?;
    let is_answer = packet.header.command == Command::LIST_IDENTITY
        && packet.header.status == EncapsulationStatus::SUCCESS;
    if !is_answer {
        return None;
    }
    ListedIdentity::read(packet.data).ok()
}

/// Whether two answers come from one device: it may answer once per interface it was asked on.
fn is_same(known: &Found, found: &Found) -> bool {
    known.from == found.from && known.listed.identity.serial == found.listed.identity.serial
}
