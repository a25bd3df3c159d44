//! The encapsulation header in front of every message on port 44818.
//!
//! Source: CIP volume 2, chapter 2.

use super::bytes::{Reader, Writer};
use super::error::{DecodeError, NoRoom};

/// Bytes of the header.
pub const HEADER_LEN: usize = 24;
/// Encapsulation protocol version that RegisterSession names.
pub const PROTOCOL_VERSION: u16 = 1;

/// What an encapsulated message asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Command(pub u16);

impl Command {
    /// Nothing; never answered.
    pub const NOP: Self = Self(0x0000);
    /// Which services the device offers.
    pub const LIST_SERVICES: Self = Self(0x0004);
    /// Who is there; the only one that is broadcast.
    pub const LIST_IDENTITY: Self = Self(0x0063);
    /// Interfaces other than CIP; none exist.
    pub const LIST_INTERFACES: Self = Self(0x0064);
    /// Opens a session on this TCP connection.
    pub const REGISTER_SESSION: Self = Self(0x0065);
    /// Closes it; never answered.
    pub const UNREGISTER_SESSION: Self = Self(0x0066);
    /// An unconnected message, and its answer.
    pub const SEND_RR_DATA: Self = Self(0x006F);
    /// A connected message.
    pub const SEND_UNIT_DATA: Self = Self(0x0070);
}

/// Whether an encapsulated message was understood.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct EncapsulationStatus(pub u32);

impl EncapsulationStatus {
    /// It was.
    pub const SUCCESS: Self = Self(0x0000);
    /// The command is unknown or not supported.
    pub const INVALID_COMMAND: Self = Self(0x0001);
    /// No memory.
    pub const NO_MEMORY: Self = Self(0x0002);
    /// The data behind the header are malformed.
    pub const INCORRECT_DATA: Self = Self(0x0003);
    /// The session handle is not one of this connection.
    pub const INVALID_SESSION: Self = Self(0x0064);
    /// The length does not fit the command.
    pub const INVALID_LENGTH: Self = Self(0x0065);
    /// The protocol version is not supported.
    pub const UNSUPPORTED_VERSION: Self = Self(0x0069);
    /// The service is not allowed on this port: the device wants CIP Security.
    pub const NOT_ON_THIS_PORT: Self = Self(0x006A);
}

impl core::fmt::Display for EncapsulationStatus {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let text = match *self {
            Self::SUCCESS => "success",
            Self::INVALID_COMMAND => "command unknown or not supported",
            Self::NO_MEMORY => "no memory left in the device",
            Self::INCORRECT_DATA => "data behind the header malformed",
            Self::INVALID_SESSION => "session handle unknown",
            Self::INVALID_LENGTH => "length does not fit the command",
            Self::UNSUPPORTED_VERSION => "protocol version not supported",
            Self::NOT_ON_THIS_PORT => "service not allowed on this port",
            _ => "not a status of the standard",
        };
        write!(f, "0x{:04X}: {text}", self.0)
    }
}

/// The header: 24 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// What is asked for.
    pub command: Command,
    /// Bytes that follow the header. [`PacketWriter`] fills it in.
    pub length: u16,
    /// Handle of the session; 0 where none is needed.
    pub session: u32,
    /// 0 in requests.
    pub status: EncapsulationStatus,
    /// Chosen by the requester, returned unchanged.
    pub context: [u8; 8],
    /// 0; a message with anything else is to be dropped.
    pub options: u32,
}

impl Header {
    /// A header with nothing but a command and a session.
    #[must_use]
    pub const fn new(command: Command, session: u32) -> Self {
        Self {
            command,
            length: 0,
            session,
            status: EncapsulationStatus::SUCCESS,
            context: [0; 8],
            options: 0,
        }
    }

    /// This header as that of the answer.
    #[must_use]
    pub const fn answer(self, status: EncapsulationStatus) -> Self {
        Self { status, length: 0, options: 0, ..self }
    }

    /// Reads the header in front of `bytes`.
    ///
    /// # Errors
    ///
    /// [`DecodeError::Truncated`] below 24 bytes.
    pub fn read(bytes: &[u8]) -> Result<Self, DecodeError> {
        let mut reader = Reader::new("encapsulation header", bytes);
        Ok(Self {
            command: Command(reader.u16("command")?),
            length: reader.u16("length")?,
            session: reader.u32("session handle")?,
            status: EncapsulationStatus(reader.u32("status")?),
            context: reader.array("sender context")?,
            options: reader.u32("options")?,
        })
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.u16(self.command.0);
        writer.u16(self.length);
        writer.u32(self.session);
        writer.u32(self.status.0);
        writer.put(&self.context);
        writer.u32(self.options);
    }
}

/// A header and the data behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packet<'a> {
    /// The header.
    pub header: Header,
    /// As many bytes as its length says.
    pub data: &'a [u8],
}

impl<'a> Packet<'a> {
    /// Reads a UDP datagram: one packet, nothing behind it.
    ///
    /// # Errors
    ///
    /// The datagram is shorter or longer than its header says.
    pub fn from_datagram(datagram: &'a [u8]) -> Result<Self, DecodeError> {
        const MESSAGE: &str = "encapsulated datagram";
        let header = Header::read(datagram)?;
        let mut reader = Reader::new(MESSAGE, datagram);
        reader.take("header", HEADER_LEN)?;
        let data = reader.take("data", usize::from(header.length))?;
        reader.end()?;
        Ok(Self { header, data })
    }

    /// The packet at the front of a TCP stream and its length with header; `None` while it is not
    /// whole.
    #[must_use]
    pub fn from_stream(stream: &'a [u8]) -> Option<(Self, usize)> {
        let header = Header::read(stream).ok()?;
        let end = HEADER_LEN + usize::from(header.length);
        let data = stream.get(HEADER_LEN..end)?;
        Some((Self { header, data }, end))
    }
}

/// Writes a packet: the header, then whatever is put behind it.
#[derive(Debug)]
pub struct PacketWriter<'a> {
    pub(crate) body: Writer<'a>,
}

impl<'a> PacketWriter<'a> {
    /// Begins a packet in `room`.
    #[must_use]
    pub fn new(room: &'a mut [u8], header: Header) -> Self {
        let mut body = Writer::new(room);
        header.write(&mut body);
        Self { body }
    }

    /// Puts `data` behind what is there.
    pub fn put(&mut self, data: &[u8]) {
        self.body.put(data);
    }

    /// Fills in the length; returns the number of bytes of the whole packet.
    ///
    /// # Errors
    ///
    /// [`NoRoom`] if the packet did not fit.
    pub fn finish(mut self) -> Result<usize, NoRoom> {
        self.body.replace_len(2, HEADER_LEN);
        self.body.finish()
    }
}
