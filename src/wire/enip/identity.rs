//! Who a device is: the identity object's attributes, and the item of ListIdentity.
//!
//! Source: CIP volume 1, chapter 5; CIP volume 2, chapter 2.

use core::net::SocketAddrV4;

use super::bytes::{Reader, Writer};
use super::cpf::{self, ItemType};
use super::encapsulation::{PROTOCOL_VERSION, PacketWriter};
use super::error::{DecodeError, NoRoom};

/// Most bytes of a product name.
pub const NAME_LEN: usize = 32;

/// A product name: at most 32 bytes, as a device sends them.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct ProductName {
    bytes: [u8; NAME_LEN],
    len: u8,
}

impl ProductName {
    /// The first 32 bytes of `name`.
    #[must_use]
    pub const fn new(name: &[u8]) -> Self {
        let mut bytes = [0; NAME_LEN];
        let mut rest = name;
        let mut room: &mut [u8] = &mut bytes;
        let mut len = 0;
        while let ([byte, after @ ..], [place, left @ ..]) = (rest, room) {
            *place = *byte;
            rest = after;
            room = left;
            len += 1;
        }
        Self { bytes, len }
    }

    /// Its bytes; usually ASCII.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.len)).unwrap_or(&self.bytes)
    }
}

impl core::fmt::Display for ProductName {
    /// Bytes that are not printable ASCII show as `\xNN`.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{}", self.as_bytes().escape_ascii())
    }
}

impl core::fmt::Debug for ProductName {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "\"{self}\"")
    }
}

/// Who a device is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Identity {
    /// Vendor number, as ODVA gave it out.
    pub vendor: u16,
    /// Device type: 43 is a generic device, keyable.
    pub device_type: u16,
    /// The vendor's number of the product.
    pub product_code: u16,
    /// Major revision.
    pub major: u8,
    /// Minor revision.
    pub minor: u8,
    /// Status word of the identity object.
    pub status: u16,
    /// Serial number of this very device.
    pub serial: u32,
    /// Name of the product.
    pub name: ProductName,
}

impl Identity {
    /// Puts attributes 1 to 7 of the identity object, as GetAttributesAll returns them.
    pub(crate) fn put_attributes(&self, writer: &mut Writer<'_>) {
        writer.u16(self.vendor);
        writer.u16(self.device_type);
        writer.u16(self.product_code);
        writer.put(&[self.major, self.minor]);
        writer.u16(self.status);
        writer.u32(self.serial);
        writer.u8(self.name.len);
        writer.put(self.name.as_bytes());
    }

    fn read_attributes(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let vendor = reader.u16("vendor")?;
        let device_type = reader.u16("device type")?;
        let product_code = reader.u16("product code")?;
        let [major, minor] = reader.array("revision")?;
        let status = reader.u16("status")?;
        let serial = reader.u32("serial number")?;
        let len = reader.u8("length of product name")?;
        if usize::from(len) > NAME_LEN {
            return Err(reader.wrong("length of product name", len, "0 to 32"));
        }
        let name = ProductName::new(reader.take("product name", usize::from(len))?);
        Ok(Self { vendor, device_type, product_code, major, minor, status, serial, name })
    }

    /// Reads what GetAttributesAll of the identity object returns; attributes behind the seventh are
    /// passed over.
    ///
    /// # Errors
    ///
    /// It is cut off, or its name is longer than 32 bytes.
    pub fn read(data: &[u8]) -> Result<Self, DecodeError> {
        Self::read_attributes(&mut Reader::new("identity", data))
    }

    /// Writes what GetAttributesAll of the identity object returns, attributes 1 to 7, and returns its
    /// length: 15 bytes and the name.
    ///
    /// # Errors
    ///
    /// [`NoRoom`] if it does not fit; 47 bytes always suffice.
    pub fn write(&self, room: &mut [u8]) -> Result<usize, NoRoom> {
        let mut writer = Writer::new(room);
        self.put_attributes(&mut writer);
        writer.finish()
    }
}

/// What a device answers to ListIdentity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ListedIdentity {
    /// Where it says it is reached.
    pub address: SocketAddrV4,
    /// Who it is.
    pub identity: Identity,
    /// State of the identity object: 3 is operational, 255 means that it does not tell.
    pub state: u8,
}

impl ListedIdentity {
    /// Reads the data of a ListIdentity answer: one identity item, others are passed over. A device that
    /// names another protocol version than 1 is listed all the same.
    ///
    /// # Errors
    ///
    /// There is no identity item, or it is malformed or longer than its fields.
    pub fn read(data: &[u8]) -> Result<Self, DecodeError> {
        const MESSAGE: &str = "ListIdentity answer";
        let item = cpf::items(data)?.find(|item| item.kind == ItemType::LIST_IDENTITY);
        let missing = DecodeError::Truncated { message: MESSAGE, field: "identity item" };
        let mut reader = Reader::new(MESSAGE, item.ok_or(missing)?.data);
        reader.u16("protocol version")?;
        let address = cpf::read_socket_address(reader.take("socket address", 16)?)?;
        let identity = Identity::read_attributes(&mut reader)?;
        let state = reader.u8("state")?;
        reader.end()?;
        Ok(Self { address, identity, state })
    }

    /// Puts the data of a ListIdentity answer behind a header.
    pub fn put(&self, packet: &mut PacketWriter<'_>) {
        let writer = &mut packet.body;
        writer.u16(1);
        let item = cpf::begin_item(writer, ItemType::LIST_IDENTITY);
        writer.u16(PROTOCOL_VERSION);
        cpf::put_socket_address(writer, self.address);
        self.identity.put_attributes(writer);
        writer.u8(self.state);
        cpf::end_item(writer, item);
    }
}
