//! Questions to one device over TCP: a client that blocks, for tools that are in no hurry.
//!
//! Invariants: no call takes longer than its limit; after an error that is not the device's answer the
//! connection is of no use any more, and calls say so.

use core::net::{Ipv4Addr, SocketAddrV4};
use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::vec::Vec;

use socket2::{Domain, Protocol, Socket, Type};

use crate::link::clock::MonotonicClock;
use crate::time::{Duration, Instant};
use crate::wire::enip::cpf::Unconnected;
use crate::wire::enip::encapsulation::{
    Command, EncapsulationStatus, HEADER_LEN, Header, PROTOCOL_VERSION, Packet, PacketWriter,
};
use crate::wire::enip::identity::Identity;
use crate::wire::enip::message::{Request, Response, Service};
use crate::wire::enip::path::ObjectPath;
use crate::wire::enip::status::{ExtendedStatus, GeneralStatus};
use crate::wire::enip::{DecodeError, NoRoom};

/// Longest request, encapsulated.
const REQUEST_ROOM: usize = 2_048;
/// Longest answer: what a length of 16 bits can say.
const ANSWER_ROOM: usize = HEADER_LEN + u16::MAX as usize;
/// Longest path of a request in bytes.
const PATH_ROOM: usize = 18;

/// Why a device did not answer as asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ExplicitError {
    /// No TCP connection.
    #[error(
        "{address}: no connection ({kind}); check that the device is switched on, that EtherNet/IP is enabled \
         on it, and that this machine has an address on its network"
    )]
    Unreachable {
        /// Address of the device.
        address: SocketAddrV4,
        /// Why not.
        kind: ErrorKind,
    },
    /// The connection ended.
    #[error("{address}: the connection ended while {step} ({kind}); connect again")]
    Ended {
        /// Address of the device.
        address: SocketAddrV4,
        /// What was being done.
        step: &'static str,
        /// How it ended.
        kind: ErrorKind,
    },
    /// No answer in time.
    #[error(
        "{address}: no answer within {} ms while {step}; check that what listens there is an EtherNet/IP device, and whether it is busy",
        limit.as_millis()
    )]
    NoAnswer {
        /// Address of the device.
        address: SocketAddrV4,
        /// What was being done.
        step: &'static str,
        /// Time that was waited.
        limit: Duration,
    },
    /// The device does not understand the encapsulation.
    #[error("{address}: refused while {step}, encapsulation status {status}")]
    Encapsulation {
        /// Address of the device.
        address: SocketAddrV4,
        /// What was being done.
        step: &'static str,
        /// Its reason.
        status: EncapsulationStatus,
    },
    /// The device answered that it cannot.
    #[error("{address}: refused with general status {general}{}", Extended(*extended))]
    Refused {
        /// Address of the device.
        address: SocketAddrV4,
        /// What it says.
        general: GeneralStatus,
        /// What it says besides.
        extended: Option<ExtendedStatus>,
    },
    /// The answer cannot be read.
    #[error(
        "{address}: the answer while {step} cannot be read: {error}; the device breaks the protocol"
    )]
    Malformed {
        /// Address of the device.
        address: SocketAddrV4,
        /// What was being done.
        step: &'static str,
        /// What is wrong.
        error: DecodeError,
    },
    /// The request is too long.
    #[error("the request does not fit into {} bytes: send less data", .0.room)]
    TooLong(NoRoom),
    /// The limit is no time at all.
    #[error("the limit is 0: allow some time for an answer")]
    NoTime,
}

impl ExplicitError {
    /// Whether trying again on a new connection can help without anybody changing anything.
    #[must_use]
    pub const fn is_transient(self) -> bool {
        matches!(self, Self::Unreachable { .. } | Self::Ended { .. } | Self::NoAnswer { .. })
    }
}

/// `, extended status ...` or nothing.
struct Extended(Option<ExtendedStatus>);

impl core::fmt::Display for Extended {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.0 {
            Some(status) => write!(f, ", extended status {status}"),
            None => Ok(()),
        }
    }
}

/// A session with one device.
#[derive(Debug)]
pub struct ExplicitClient {
    socket: TcpStream,
    address: SocketAddrV4,
    clock: MonotonicClock,
    limit: Duration,
    session: u32,
    /// Tells answers apart: those to requests that were given up are passed over.
    context: u64,
    /// Set when the stream may be out of step.
    is_broken: bool,
    /// What arrived of the next answer.
    arrived: Vec<u8>,
}

impl ExplicitClient {
    /// Connects to `address` from the local address `bind`, and registers a session. `limit` holds for each
    /// call: this one and every request.
    ///
    /// # Errors
    ///
    /// [`ExplicitError`]; the encapsulation is refused by devices of another version only.
    pub fn connect(
        bind: Option<Ipv4Addr>,
        address: SocketAddrV4,
        limit: Duration,
    ) -> Result<Self, ExplicitError> {
        const STEP: &str = "registering a session";
        if limit.is_zero() {
            return Err(ExplicitError::NoTime);
        }
        let clock = MonotonicClock::new();
        let deadline = clock.now() + limit;
        let socket = open(bind, address, limit)
            .map_err(|error| ExplicitError::Unreachable { address, kind: error.kind() })?;
        let mut client = Self {
            socket,
            address,
            clock,
            limit,
            session: 0,
            context: 0,
            is_broken: false,
            arrived: Vec::new(),
        };
        let [low, high] = PROTOCOL_VERSION.to_le_bytes();
        let header = Header::new(Command::REGISTER_SESSION, 0);
        let answer =
            client.exchange(header, STEP, deadline, |packet| packet.put(&[low, high, 0, 0]))?;
        client.session = Header::read(&answer).map_or(0, |header| header.session);
        Ok(client)
    }

    /// The device's address.
    #[must_use]
    pub const fn address(&self) -> SocketAddrV4 {
        self.address
    }

    /// Attributes 1 to 7 of the identity object.
    ///
    /// # Errors
    ///
    /// [`ExplicitError`].
    pub fn identity(&mut self) -> Result<Identity, ExplicitError> {
        let path = ObjectPath { class: 1, instance: 1, attribute: None };
        let data = self.request(Service::GET_ATTRIBUTES_ALL, path, &[])?;
        let malformed = |error| ExplicitError::Malformed {
            address: self.address,
            step: "reading the identity",
            error,
        };
        Identity::read(&data).map_err(malformed)
    }

    /// Value of the attribute that `path` names.
    ///
    /// # Errors
    ///
    /// [`ExplicitError`]; [`Refused`](ExplicitError::Refused) if there is no such attribute.
    pub fn get_attribute(&mut self, path: ObjectPath) -> Result<Vec<u8>, ExplicitError> {
        self.request(Service::GET_ATTRIBUTE_SINGLE, path, &[])
    }

    /// Changes the attribute that `path` names.
    ///
    /// # Errors
    ///
    /// [`ExplicitError`]; [`Refused`](ExplicitError::Refused) if it can only be read.
    pub fn set_attribute(&mut self, path: ObjectPath, data: &[u8]) -> Result<(), ExplicitError> {
        self.request(Service::SET_ATTRIBUTE_SINGLE, path, data).map(drop)
    }

    /// Any unconnected request; returns the data of the answer.
    ///
    /// # Errors
    ///
    /// [`ExplicitError`].
    pub fn request(
        &mut self,
        service: Service,
        path: ObjectPath,
        data: &[u8],
    ) -> Result<Vec<u8>, ExplicitError> {
        const STEP: &str = "asking for an object";
        let address = self.address;
        let deadline = self.clock.now() + self.limit;
        let mut path_room = [0; PATH_ROOM];
        let path_len = path.write(&mut path_room).map_err(ExplicitError::TooLong)?;
        let path = path_room.get(..path_len).unwrap_or(&path_room);
        let mut room = [0; REQUEST_ROOM];
        let request = Request { service, path, data };
        let len = request.write(&mut room).map_err(ExplicitError::TooLong)?;
        let message = room.get(..len).unwrap_or(&room);
        let header = Header::new(Command::SEND_RR_DATA, self.session);
        let answer =
            self.exchange(header, STEP, deadline, |packet| Unconnected::new(message).put(packet))?;
        let malformed = |error| ExplicitError::Malformed { address, step: STEP, error };
        let data = answer.get(HEADER_LEN..).unwrap_or(&[]);
        let unconnected = Unconnected::read(data).map_err(malformed)?;
        let response = Response::read(unconnected.message).map_err(malformed)?;
        if response.service != service {
            self.is_broken = true;
            return Err(malformed(DecodeError::Value {
                message: "CIP response",
                field: "service",
                found: u32::from(response.service.0),
                allowed: "that of the request",
            }));
        }
        if response.status != GeneralStatus::SUCCESS {
            let (general, extended) = (response.status, response.extended());
            return Err(ExplicitError::Refused { address, general, extended });
        }
        Ok(response.data.to_vec())
    }

    /// Sends one packet and returns the one that answers it, header included.
    fn exchange(
        &mut self,
        header: Header,
        step: &'static str,
        deadline: Instant,
        put: impl FnOnce(&mut PacketWriter<'_>),
    ) -> Result<Vec<u8>, ExplicitError> {
        let address = self.address;
        if self.is_broken {
            let kind = ErrorKind::NotConnected;
            return Err(ExplicitError::Ended { address, step, kind });
        }
        self.context += 1;
        let context = self.context.to_le_bytes();
        let mut room = [0; REQUEST_ROOM + 64];
        let mut packet = PacketWriter::new(&mut room, Header { context, ..header });
        put(&mut packet);
        let len = packet.finish().map_err(ExplicitError::TooLong)?;
        let outcome = self
            .send(room.get(..len).unwrap_or(&room), deadline)
            .and_then(|()| self.receive(header.command, context, deadline));
        let answer = outcome.map_err(|error| {
            self.is_broken = true;
            match error.kind() {
                ErrorKind::TimedOut | ErrorKind::WouldBlock => {
                    ExplicitError::NoAnswer { address, step, limit: self.limit }
                }
                kind => ExplicitError::Ended { address, step, kind },
            }
        })?;
        let status = Header::read(&answer).map(|header| header.status).unwrap_or_default();
        if status != EncapsulationStatus::SUCCESS {
            return Err(ExplicitError::Encapsulation { address, step, status });
        }
        Ok(answer)
    }

    fn send(&mut self, bytes: &[u8], deadline: Instant) -> io::Result<()> {
        self.socket.set_write_timeout(Some(self.left(deadline)?))?;
        self.socket.write_all(bytes)
    }

    /// The answer to `command` with `context`; others are passed over.
    fn receive(
        &mut self,
        command: Command,
        context: [u8; 8],
        deadline: Instant,
    ) -> io::Result<Vec<u8>> {
        let mut room = [0; 2_048];
        loop {
            while let Some((packet, len)) = Packet::from_stream(&self.arrived) {
                let is_it = packet.header.command == command && packet.header.context == context;
                let rest = self.arrived.split_off(len);
                let whole = core::mem::replace(&mut self.arrived, rest);
                if is_it {
                    return Ok(whole);
                }
            }
            if self.arrived.len() > ANSWER_ROOM {
                return Err(ErrorKind::InvalidData.into());
            }
            self.socket.set_read_timeout(Some(self.left(deadline)?))?;
            match self.socket.read(&mut room) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(len) => self.arrived.extend_from_slice(room.get(..len).unwrap_or(&[])),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
    }

    /// Time until `deadline`, more than none.
    fn left(&self, deadline: Instant) -> io::Result<Duration> {
        match deadline.saturating_duration_since(self.clock.now()) {
            Duration::ZERO => Err(ErrorKind::TimedOut.into()),
            left => Ok(left),
        }
    }
}

impl Drop for ExplicitClient {
    /// Unregisters the session, as far as the device listens.
    fn drop(&mut self) {
        let mut room = [0; HEADER_LEN];
        let header = Header::new(Command::UNREGISTER_SESSION, self.session);
        if !self.is_broken && PacketWriter::new(&mut room, header).finish().is_ok() {
            let _ = self.socket.set_write_timeout(Some(Duration::from_millis(100)));
            let _ = self.socket.write_all(&room);
        }
    }
}

fn open(bind: Option<Ipv4Addr>, address: SocketAddrV4, limit: Duration) -> io::Result<TcpStream> {
    let socket = Socket::new(Domain::IPV4, Type::STREAM, Some(Protocol::TCP))?;
    if let Some(bind) = bind {
        socket.bind(&SocketAddrV4::new(bind, 0).into())?;
    }
    socket.connect_timeout(&address.into(), limit)?;
    let _ = socket.set_tcp_nodelay(true);
    Ok(socket.into())
}
