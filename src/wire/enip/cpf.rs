//! The common packet format: typed items behind SendRRData, in lists, and in class 1 frames.
//!
//! Source: CIP volume 2, chapter 2.

use core::net::{Ipv4Addr, SocketAddrV4};

use super::bytes::{Reader, Writer};
use super::error::DecodeError;

/// The message that items stand in here, as errors name it.
const MESSAGE: &str = "SendRRData";

/// What an item holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ItemType(pub u16);

impl ItemType {
    /// No address: the message is unconnected.
    pub const NULL_ADDRESS: Self = Self(0x0000);
    /// An identity, in the answer to ListIdentity.
    pub const LIST_IDENTITY: Self = Self(0x000C);
    /// Id of a connection.
    pub const CONNECTED_ADDRESS: Self = Self(0x00A1);
    /// Data of a connection.
    pub const CONNECTED_DATA: Self = Self(0x00B1);
    /// An unconnected message.
    pub const UNCONNECTED_DATA: Self = Self(0x00B2);
    /// A service, in the answer to ListServices.
    pub const LIST_SERVICES: Self = Self(0x0100);
    /// Socket address for O->T.
    pub const SOCKET_O2T: Self = Self(0x8000);
    /// Socket address for T->O.
    pub const SOCKET_T2O: Self = Self(0x8001);
    /// Id of a connection and sequence number.
    pub const SEQUENCED_ADDRESS: Self = Self(0x8002);
}

/// One item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Item<'a> {
    /// What it holds.
    pub kind: ItemType,
    /// Its bytes.
    pub data: &'a [u8],
}

/// The items of a packet, in order. All are known to be whole.
#[derive(Clone, Copy, Debug)]
pub struct Items<'a> {
    left: u16,
    reader: Reader<'a>,
}

/// Reads items: their number, then type, length and data of each, and nothing behind the last.
///
/// # Errors
///
/// An item is cut off, or bytes follow the last one.
pub fn items(bytes: &[u8]) -> Result<Items<'_>, DecodeError> {
    let mut reader = Reader::new("common packet format", bytes);
    let count = reader.u16("item count")?;
    let items = Items { left: count, reader };
    for _ in 0..count {
        next_item(&mut reader)?;
    }
    reader.end()?;
    Ok(items)
}

fn next_item<'a>(reader: &mut Reader<'a>) -> Result<Item<'a>, DecodeError> {
    let kind = ItemType(reader.u16("item type")?);
    let len = reader.u16("item length")?;
    Ok(Item { kind, data: reader.take("item data", usize::from(len))? })
}

impl<'a> Iterator for Items<'a> {
    type Item = Item<'a>;

    fn next(&mut self) -> Option<Item<'a>> {
        self.left = self.left.checked_sub(1)?;
        next_item(&mut self.reader).ok()
    }
}

/// Reads the socket address of a careless device: the family in either byte order, whatever stands behind.
fn read_careless_address(data: &[u8]) -> Result<SocketAddrV4, DecodeError> {
    let mut reader = Reader::new("socket address item", data);
    let family = u16::from_be_bytes(reader.array("family")?);
    if ![family, family.swap_bytes()].contains(&2) {
        return Err(reader.wrong("family", family, "2"));
    }
    let port = u16::from_be_bytes(reader.array("port")?);
    let [a, b, c, d] = reader.array("address")?;
    Ok(SocketAddrV4::new(Ipv4Addr::new(a, b, c, d), port))
}

/// Reads a socket address item: big-endian family 2, port, address, eight bytes that mean nothing.
///
/// # Errors
///
/// It is not 16 bytes long or of another family.
pub fn read_socket_address(data: &[u8]) -> Result<SocketAddrV4, DecodeError> {
    let mut reader = Reader::new("socket address item", data);
    let family = u16::from_be_bytes(reader.array("family")?);
    if family != 2 {
        return Err(reader.wrong("family", family, "2"));
    }
    let port = u16::from_be_bytes(reader.array("port")?);
    let [a, b, c, d] = reader.array("address")?;
    reader.take("padding", 8)?;
    reader.end()?;
    Ok(SocketAddrV4::new(Ipv4Addr::new(a, b, c, d), port))
}

pub(crate) fn put_socket_address(writer: &mut Writer<'_>, address: SocketAddrV4) {
    writer.put(&2_u16.to_be_bytes());
    writer.put(&address.port().to_be_bytes());
    writer.put(&address.ip().octets());
    writer.put(&[0; 8]);
}

/// Puts a whole item.
pub(crate) fn put_item(writer: &mut Writer<'_>, kind: ItemType, data: &[u8]) {
    let item = begin_item(writer, kind);
    writer.put(data);
    end_item(writer, item);
}

/// Where an item's data begin.
pub(crate) struct ItemStart(usize);

/// Puts an item's type and leaves its length to [`end_item`].
pub(crate) fn begin_item(writer: &mut Writer<'_>, kind: ItemType) -> ItemStart {
    writer.u16(kind.0);
    writer.u16(0);
    ItemStart(writer.len())
}

/// Fills in the length of the item begun at `start`.
pub(crate) fn end_item(writer: &mut Writer<'_>, start: ItemStart) {
    let ItemStart(start) = start;
    writer.replace_len(start.saturating_sub(2), start);
}

/// An unconnected message as SendRRData carries it, either way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unconnected<'a> {
    /// Seconds that the requester waits; 0 leaves it to the message.
    pub timeout_s: u16,
    /// The CIP request or response.
    pub message: &'a [u8],
    /// Where O->T frames are to go, if it says.
    pub o2t_address: Option<SocketAddrV4>,
    /// Where T->O frames are to go, or come from, if it says.
    pub t2o_address: Option<SocketAddrV4>,
}

impl<'a> Unconnected<'a> {
    /// A message without socket addresses.
    #[must_use]
    pub const fn new(message: &'a [u8]) -> Self {
        Self { timeout_s: 0, message, o2t_address: None, t2o_address: None }
    }

    /// Reads the data of SendRRData.
    ///
    /// # Errors
    ///
    /// The interface is not CIP, the items are malformed, the first two are not a null address and an
    /// unconnected message, or a direction has two socket addresses. Items of unknown types are passed over.
    pub fn read(data: &'a [u8]) -> Result<Self, DecodeError> {
        let (timeout_s, mut reader, count) = Self::begin(data)?;
        // All items are whole, and nothing follows the last one.
        let mut rest = reader;
        for _ in 0..count {
            next_item(&mut rest)?;
        }
        rest.end()?;
        let mut unconnected = Self { timeout_s, ..Self::new(Self::message(&mut reader, count)?) };
        for _ in 2..count {
            let item = next_item(&mut reader)?;
            let slot = match item.kind {
                ItemType::SOCKET_O2T => &mut unconnected.o2t_address,
                ItemType::SOCKET_T2O => &mut unconnected.t2o_address,
                _ => continue,
            };
            if slot.replace(read_socket_address(item.data)?).is_some() {
                let (found, allowed) = (u32::from(item.kind.0), "there once");
                let field = "socket address item type";
                return Err(DecodeError::Value { message: MESSAGE, field, found, allowed });
            }
        }
        Ok(unconnected)
    }

    /// Reads the data of SendRRData as an answer, whose device may be careless about what stands behind its
    /// message: an item there that cannot be read, or is cut off, and bytes behind the last item are passed over,
    /// and the family of a socket address may stand in either byte order. Second comes what was wrong with a socket
    /// address that was passed over.
    ///
    /// # Errors
    ///
    /// As [`read`](Self::read) for the first two items.
    pub fn read_answer(data: &'a [u8]) -> Result<(Self, Option<DecodeError>), DecodeError> {
        let (timeout_s, mut reader, count) = Self::begin(data)?;
        let mut unconnected = Self { timeout_s, ..Self::new(Self::message(&mut reader, count)?) };
        let mut flaw = None;
        for _ in 2..count {
            let Ok(item) = next_item(&mut reader) else {
                let (message, field) = (MESSAGE, "items behind the message");
                flaw = flaw.or(Some(DecodeError::Truncated { message, field }));
                break;
            };
            let slot = match item.kind {
                ItemType::SOCKET_O2T => &mut unconnected.o2t_address,
                ItemType::SOCKET_T2O => &mut unconnected.t2o_address,
                _ => continue,
            };
            match read_careless_address(item.data) {
                Ok(address) => *slot = slot.or(Some(address)),
                Err(error) => flaw = flaw.or(Some(error)),
            }
        }
        Ok((unconnected, flaw))
    }

    /// What stands in front of the items: timeout, then the items and their number.
    fn begin(data: &'a [u8]) -> Result<(u16, Reader<'a>, u16), DecodeError> {
        let mut reader = Reader::new(MESSAGE, data);
        let interface = reader.u32("interface handle")?;
        if interface != 0 {
            return Err(reader.wrong("interface handle", interface, "0 (CIP)"));
        }
        let timeout_s = reader.u16("timeout")?;
        let mut items = Reader::new("common packet format", reader.rest());
        let count = items.u16("item count")?;
        Ok((timeout_s, items, count))
    }

    /// The message, from the first two of `count` items.
    fn message(reader: &mut Reader<'a>, count: u16) -> Result<&'a [u8], DecodeError> {
        let wrong =
            |field, found, allowed| DecodeError::Value { message: MESSAGE, field, found, allowed };
        let mut items = (0..count).map(|_| next_item(reader));
        let missing = |field| DecodeError::Truncated { message: MESSAGE, field };
        let address = items.next().ok_or(missing("address item"))??;
        if address.kind != ItemType::NULL_ADDRESS {
            let found = u32::from(address.kind.0);
            return Err(wrong("address item type", found, "0 (unconnected)"));
        }
        if !address.data.is_empty() {
            let len = u32::try_from(address.data.len()).unwrap_or(u32::MAX);
            return Err(wrong("address item length", len, "0"));
        }
        let data = items.next().ok_or(missing("data item"))??;
        if data.kind != ItemType::UNCONNECTED_DATA {
            let found = u32::from(data.kind.0);
            return Err(wrong("data item type", found, "178 (unconnected data)"));
        }
        Ok(data.data)
    }

    /// Puts the data of SendRRData behind a header.
    pub fn put(&self, packet: &mut super::encapsulation::PacketWriter<'_>) {
        let writer = &mut packet.body;
        let addresses =
            [(ItemType::SOCKET_O2T, self.o2t_address), (ItemType::SOCKET_T2O, self.t2o_address)];
        let count = addresses.iter().filter(|(_, address)| address.is_some()).count();
        writer.u32(0);
        writer.u16(self.timeout_s);
        writer.u16(2 + u16::try_from(count).unwrap_or(0));
        put_item(writer, ItemType::NULL_ADDRESS, &[]);
        put_item(writer, ItemType::UNCONNECTED_DATA, self.message);
        for (kind, address) in addresses {
            if let Some(address) = address {
                let item = begin_item(writer, kind);
                put_socket_address(writer, address);
                end_item(writer, item);
            }
        }
    }
}
