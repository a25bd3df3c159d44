//! The mailbox header, and the reply that says a datagram could not be used.
//!
//! ```text
//!  0        2         4                5                6
//!  | length | address | channel:6 prio:2 | type:4 counter:3 0 | service data, `length` bytes
//! ```
//!
//! Source: ETG.1000 part 4.

/// Length of the header in bytes.
pub const MAILBOX_HEADER_LEN: usize = 6;

/// The protocol a datagram carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MailboxProtocol(pub u8);

impl MailboxProtocol {
    /// A mailbox error reply.
    pub const ERROR: Self = Self(0);
    /// CANopen over EtherCAT: dictionary access.
    pub const COE: Self = Self(3);
}

/// The header of a mailbox datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MailboxHeader {
    /// Length of the service data behind the header, in bytes.
    pub length: u16,
    /// Station address of the sender; 0 between a main device and its subdevice.
    pub address: u16,
    /// Reserved, 6 bits.
    pub channel: u8,
    /// 0 lowest to 3 highest.
    pub priority: u8,
    /// The protocol, 4 bits.
    pub protocol: MailboxProtocol,
    /// Number of the service, 1 to 7; 0 when the sender does not count.
    pub counter: u8,
}

impl MailboxHeader {
    /// Takes the header off the front of `datagram`; `None` if that is too short.
    #[must_use]
    pub fn split(datagram: &[u8]) -> Option<(Self, &[u8])> {
        let (&[length_low, length_high, address_low, address_high, channel, kind], rest) =
            datagram.split_first_chunk()?;
        let header = Self {
            length: u16::from_le_bytes([length_low, length_high]),
            address: u16::from_le_bytes([address_low, address_high]),
            channel: channel & 0x3F,
            priority: channel >> 6,
            protocol: MailboxProtocol(kind & 0x0F),
            counter: kind >> 4 & 7,
        };
        Some((header, rest))
    }

    /// The header as it goes over the wire; bits that do not fit are cut off.
    #[must_use]
    pub const fn to_bytes(&self) -> [u8; MAILBOX_HEADER_LEN] {
        let [length_low, length_high] = self.length.to_le_bytes();
        let [address_low, address_high] = self.address.to_le_bytes();
        let channel = self.channel & 0x3F | self.priority << 6;
        let kind = self.protocol.0 & 0x0F | (self.counter & 7) << 4;
        [length_low, length_high, address_low, address_high, channel, kind]
    }
}

/// The counter that follows `counter`: 1 to 7, never 0.
#[must_use]
pub const fn next_counter(counter: u8) -> u8 {
    counter % 7 + 1
}

/// What was wrong with a datagram, as the reply of type [`MailboxProtocol::ERROR`] says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MailboxError(pub u16);

impl MailboxError {
    /// The 6 bytes of the header cannot be read.
    pub const SYNTAX: Self = Self(0x0001);
    /// Another protocol than the device offers.
    pub const UNSUPPORTED_PROTOCOL: Self = Self(0x0002);
    /// A channel the device does not have.
    pub const INVALID_CHANNEL: Self = Self(0x0003);
    /// A service of the protocol that the device does not offer.
    pub const SERVICE_NOT_SUPPORTED: Self = Self(0x0004);
    /// The protocol's own header is wrong.
    pub const INVALID_HEADER: Self = Self(0x0005);
    /// Fewer bytes than the service needs.
    pub const SIZE_TOO_SHORT: Self = Self(0x0006);
    /// No room for the datagram.
    pub const NO_MORE_MEMORY: Self = Self(0x0007);
    /// The length does not fit the mailbox.
    pub const INVALID_SIZE: Self = Self(0x0008);

    /// The service data of the reply: command 1, then the code.
    #[must_use]
    pub const fn to_bytes(self) -> [u8; 4] {
        let [low, high] = self.0.to_le_bytes();
        [1, 0, low, high]
    }

    /// The code in the service data of a reply; `None` if it is none.
    #[must_use]
    pub const fn from_bytes(data: &[u8]) -> Option<Self> {
        match data {
            [1, 0, low, high, ..] => Some(Self(u16::from_le_bytes([*low, *high]))),
            _ => None,
        }
    }
}

impl core::fmt::Display for MailboxError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let text = match *self {
            Self::SYNTAX => "the mailbox header cannot be read",
            Self::UNSUPPORTED_PROTOCOL => "the device does not speak this mailbox protocol",
            Self::INVALID_CHANNEL => "the device has no such mailbox channel",
            Self::SERVICE_NOT_SUPPORTED => "the device does not offer this service",
            Self::INVALID_HEADER => "the header of the mailbox protocol is wrong",
            Self::SIZE_TOO_SHORT => "the mailbox datagram is too short for its service",
            Self::NO_MORE_MEMORY => "the device has no room for the mailbox datagram",
            Self::INVALID_SIZE => "the length of the mailbox datagram is wrong",
            _ => "unknown mailbox error",
        };
        write!(f, "{text} ({:#06x})", self.0)
    }
}
