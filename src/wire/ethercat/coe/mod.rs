//! CANopen over EtherCAT: how a main device reads and writes a subdevice's object dictionary.
//!
//! Read [`CoeHeader`] first, then [`sdo`]: the transfers. [`info`] describes the dictionary itself.
//! All of it travels as service data of a [mailbox](super::mailbox) datagram.
//!
//! Source: ETG.1000 part 6.

mod abort;
pub mod info;
pub mod sdo;

pub use abort::AbortCode;

/// Length of the CoE header in bytes.
pub const COE_HEADER_LEN: usize = 2;

/// What a CoE datagram is, the upper four bits of its header.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CoeService(pub u8);

impl CoeService {
    /// The subdevice reports a fault by itself.
    pub const EMERGENCY: Self = Self(1);
    /// An SDO request; also every abort, whoever sends it.
    pub const SDO_REQUEST: Self = Self(2);
    /// An SDO response.
    pub const SDO_RESPONSE: Self = Self(3);
    /// A PDO sent through the mailbox, inputs; nobody uses it.
    pub const TX_PDO: Self = Self(4);
    /// A remote request for outputs, the highest of the four PDO services.
    pub const RX_PDO_REMOTE_REQUEST: Self = Self(7);
    /// SDO information, requests and responses alike.
    pub const SDO_INFORMATION: Self = Self(8);
}

/// The header of a CoE datagram: two bytes, little-endian, service in the upper four bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CoeHeader {
    /// PDO number, 9 bits; 0 for SDOs.
    pub number: u16,
    /// The service, 4 bits.
    pub service: CoeService,
}

impl CoeHeader {
    /// A header without PDO number.
    #[must_use]
    pub const fn new(service: CoeService) -> Self {
        Self { number: 0, service }
    }

    /// Takes the header off the front of `data`; `None` if that is too short.
    #[must_use]
    pub fn split(data: &[u8]) -> Option<(Self, &[u8])> {
        let (bytes, rest) = data.split_first_chunk()?;
        let word = u16::from_le_bytes(*bytes);
        let service = CoeService((word >> 12) as u8);
        Some((Self { number: word & 0x01FF, service }, rest))
    }

    /// The header as it goes over the wire.
    #[must_use]
    pub const fn to_bytes(&self) -> [u8; COE_HEADER_LEN] {
        (self.number & 0x01FF | (self.service.0 as u16) << 12).to_le_bytes()
    }
}

/// What a subdevice reports by itself: 8 bytes behind the CoE header.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Emergency {
    /// Error code; `0xA000` and above are the state machine's.
    pub code: u16,
    /// The error register, object 1001h.
    pub register: u8,
    /// Five bytes of the maker's own.
    pub data: [u8; 5],
}

impl Emergency {
    /// Communication failed, e.g. the process data watchdog expired. Source: ETG.1000 part 6.
    pub const COMMUNICATION: u16 = 0x8100;

    /// The bytes behind the CoE header.
    #[must_use]
    pub const fn to_bytes(&self) -> [u8; 8] {
        let [low, high] = self.code.to_le_bytes();
        let [a, b, c, d, e] = self.data;
        [low, high, self.register, a, b, c, d, e]
    }

    /// Reads the bytes behind the CoE header; `None` if they are too few.
    #[must_use]
    pub const fn from_bytes(data: &[u8]) -> Option<Self> {
        match data {
            [low, high, register, a, b, c, d, e, ..] => Some(Self {
                code: u16::from_le_bytes([*low, *high]),
                register: *register,
                data: [*a, *b, *c, *d, *e],
            }),
            _ => None,
        }
    }
}
