//! RegisterSession and ListServices: what their data hold, either way.
//!
//! Source: CIP volume 2, chapter 2.

use super::bytes::{Reader, Writer};
use super::cpf::{self, ItemType};
use super::encapsulation::{PROTOCOL_VERSION, PacketWriter};
use super::error::DecodeError;

/// Data of RegisterSession; the answer repeats them, with the version that the target speaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Registration {
    /// Protocol version asked for: 1. Another one is answered with
    /// [`EncapsulationStatus::UNSUPPORTED_VERSION`](super::encapsulation::EncapsulationStatus).
    pub version: u16,
    /// 0; nothing else is defined.
    pub options: u16,
}

impl Default for Registration {
    fn default() -> Self {
        Self { version: PROTOCOL_VERSION, options: 0 }
    }
}

impl Registration {
    /// Length in bytes.
    pub const LEN: usize = 4;

    /// Reads the data of RegisterSession. Whether version and options are acceptable is for the caller to
    /// say: a wrong version is answered otherwise than malformed data.
    ///
    /// # Errors
    ///
    /// They are not four bytes long.
    pub fn read(data: &[u8]) -> Result<Self, DecodeError> {
        let mut reader = Reader::new("RegisterSession", data);
        let version = reader.u16("protocol version")?;
        let options = reader.u16("options")?;
        reader.end()?;
        Ok(Self { version, options })
    }

    /// The data of RegisterSession.
    #[must_use]
    pub fn to_bytes(self) -> [u8; Self::LEN] {
        let ([a, b], [c, d]) = (self.version.to_le_bytes(), self.options.to_le_bytes());
        [a, b, c, d]
    }
}

/// Bytes of a service's name, filled up with zeros.
pub const SERVICE_NAME_LEN: usize = 16;

/// What a device answers to ListServices: the one service that is defined, and what it can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ListedService {
    /// Protocol version: 1.
    pub version: u16,
    /// What the service can do: bit 5 CIP over TCP, bit 8 class 0 and 1 over UDP; the others are reserved.
    pub capabilities: u16,
    /// `Communications`, filled up with zeros.
    pub name: [u8; SERVICE_NAME_LEN],
}

impl ListedService {
    /// Encapsulated CIP over TCP.
    pub const TCP: u16 = 1 << 5;
    /// Class 0 and class 1 frames over UDP.
    pub const UDP_IO: u16 = 1 << 8;
    /// The service of a device that takes explicit messages over TCP and I/O over UDP.
    pub const COMMUNICATIONS: Self = Self {
        version: PROTOCOL_VERSION,
        capabilities: Self::TCP | Self::UDP_IO,
        name: *b"Communications\0\0",
    };

    /// Reads the data of a ListServices answer: its first service item.
    ///
    /// # Errors
    ///
    /// There is no service item, or it is not 20 bytes long.
    pub fn read(data: &[u8]) -> Result<Self, DecodeError> {
        const MESSAGE: &str = "ListServices answer";
        let item = cpf::items(data)?.find(|item| item.kind == ItemType::LIST_SERVICES);
        let missing = DecodeError::Truncated { message: MESSAGE, field: "service item" };
        let mut reader = Reader::new(MESSAGE, item.ok_or(missing)?.data);
        let version = reader.u16("protocol version")?;
        let capabilities = reader.u16("capability flags")?;
        let name = reader.array("name of service")?;
        reader.end()?;
        Ok(Self { version, capabilities, name })
    }

    /// Puts the data of a ListServices answer behind a header.
    pub fn put(&self, packet: &mut PacketWriter<'_>) {
        let writer: &mut Writer<'_> = &mut packet.body;
        writer.u16(1);
        let item = cpf::begin_item(writer, ItemType::LIST_SERVICES);
        writer.u16(self.version);
        writer.u16(self.capabilities);
        writer.put(&self.name);
        cpf::end_item(writer, item);
    }
}

/// Puts the answer of a device that takes explicit messages over TCP and I/O over UDP:
/// [`ListedService::COMMUNICATIONS`].
pub fn put_list_services(packet: &mut PacketWriter<'_>) {
    ListedService::COMMUNICATIONS.put(packet);
}
