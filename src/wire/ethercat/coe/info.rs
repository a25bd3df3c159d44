//! SDO information: how a dictionary describes itself.
//!
//! A request is an [`InfoHeader`] and a few bytes; the answer may come in several fragments, each
//! with a header that counts how many are left.

/// Length of the header in bytes.
pub const INFO_HEADER_LEN: usize = 4;

/// What a datagram asks for or answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct InfoOpCode(pub u8);

impl InfoOpCode {
    /// Which objects exist; asks with the list's number, 2 bytes.
    pub const LIST_REQUEST: Self = Self(1);
    /// The list's number, then 2 bytes an object (or, for list 0, a length).
    pub const LIST_RESPONSE: Self = Self(2);
    /// What an object is; asks with the index, 2 bytes.
    pub const OBJECT_REQUEST: Self = Self(3);
    /// Index, data type, highest sub-index, object code, name.
    pub const OBJECT_RESPONSE: Self = Self(4);
    /// What an entry is; asks with index, sub-index and what is wanted, 4 bytes.
    pub const ENTRY_REQUEST: Self = Self(5);
    /// The question, data type, length in bits, access, name.
    pub const ENTRY_RESPONSE: Self = Self(6);
    /// The question has no answer: an abort code.
    pub const ERROR: Self = Self(7);
}

/// The four bytes behind the CoE header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InfoHeader {
    /// The operation, 7 bits.
    pub op_code: InfoOpCode,
    /// More fragments follow.
    pub incomplete: bool,
    /// How many follow.
    pub fragments_left: u16,
}

impl InfoHeader {
    /// Takes the header off the front of `data`; `None` if that is too short.
    #[must_use]
    pub fn split(data: &[u8]) -> Option<(Self, &[u8])> {
        let (&[op_code, _, low, high], rest) = data.split_first_chunk()?;
        let header = Self {
            op_code: InfoOpCode(op_code & 0x7F),
            incomplete: op_code & 0x80 != 0,
            fragments_left: u16::from_le_bytes([low, high]),
        };
        Some((header, rest))
    }

    /// The header as it goes over the wire.
    #[must_use]
    pub const fn to_bytes(&self) -> [u8; INFO_HEADER_LEN] {
        let [low, high] = self.fragments_left.to_le_bytes();
        let incomplete = if self.incomplete { 0x80 } else { 0 };
        [self.op_code.0 & 0x7F | incomplete, 0, low, high]
    }
}

/// A list of objects that can be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ObjectList {
    /// Not a list, but the lengths of the five.
    Lengths,
    /// Every object.
    All,
    /// Those that an RxPDO can map: outputs.
    RxPdoMappable,
    /// Those that a TxPDO can map: inputs.
    TxPdoMappable,
    /// Those to save when a device is replaced.
    Backup,
    /// Those to write at start-up.
    Settings,
}

impl ObjectList {
    /// The five lists in the order of their numbers, 1 to 5.
    pub const LISTS: [Self; 5] =
        [Self::All, Self::RxPdoMappable, Self::TxPdoMappable, Self::Backup, Self::Settings];

    /// The list with this number.
    #[must_use]
    pub const fn from_wire(number: u16) -> Option<Self> {
        Some(match number {
            0 => Self::Lengths,
            1 => Self::All,
            2 => Self::RxPdoMappable,
            3 => Self::TxPdoMappable,
            4 => Self::Backup,
            5 => Self::Settings,
            _ => return None,
        })
    }

    /// What an entry must be for its object to be listed; nothing for `Lengths` and `All`.
    #[must_use]
    pub const fn needs(self) -> ObjectAccess {
        match self {
            Self::Lengths | Self::All => ObjectAccess::empty(),
            Self::RxPdoMappable => ObjectAccess::RX_PDO,
            Self::TxPdoMappable => ObjectAccess::TX_PDO,
            Self::Backup => ObjectAccess::BACKUP,
            Self::Settings => ObjectAccess::SETTINGS,
        }
    }
}

/// The shape of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ObjectCode {
    /// One value, at sub-index 0.
    Variable,
    /// Values of one type from sub-index 1; sub-index 0 counts them.
    Array,
    /// Values of any type from sub-index 1; sub-index 0 is the highest.
    Record,
}

impl ObjectCode {
    /// Its number on the wire: 7, 8 or 9.
    #[must_use]
    pub const fn to_wire(self) -> u8 {
        match self {
            Self::Variable => 7,
            Self::Array => 8,
            Self::Record => 9,
        }
    }
}

/// The type of an entry or object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DataType(pub u16);

impl DataType {
    /// No type: bits without a meaning.
    pub const NONE: Self = Self(0x0000);
    /// A bit.
    pub const BOOLEAN: Self = Self(0x0001);
    /// Signed, 8 bits.
    pub const INTEGER8: Self = Self(0x0002);
    /// Unsigned, 8 bits.
    pub const UNSIGNED8: Self = Self(0x0005);
    /// Unsigned, 16 bits.
    pub const UNSIGNED16: Self = Self(0x0006);
    /// Unsigned, 32 bits.
    pub const UNSIGNED32: Self = Self(0x0007);
    /// Single precision.
    pub const REAL32: Self = Self(0x0008);
    /// Text without an end mark.
    pub const VISIBLE_STRING: Self = Self(0x0009);
    /// The record of a PDO's mapping.
    pub const PDO_MAPPING: Self = Self(0x0021);
    /// The record of the identity, 1018h.
    pub const IDENTITY: Self = Self(0x0023);
    /// The record of a sync manager's timing, 1C32h and 1C33h.
    pub const SYNC_PARAMETER: Self = Self(0x0029);
    /// A record without a type of its own.
    pub const RECORD: Self = Self(0x002A);
}

bitflags::bitflags! {
    /// What may be done with an entry, and when.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct ObjectAccess: u16 {
        /// Readable in PRE-OP.
        const READ_PRE_OP = 1 << 0;
        /// Readable in SAFE-OP.
        const READ_SAFE_OP = 1 << 1;
        /// Readable in OP.
        const READ_OP = 1 << 2;
        /// Writable in PRE-OP.
        const WRITE_PRE_OP = 1 << 3;
        /// Writable in SAFE-OP.
        const WRITE_SAFE_OP = 1 << 4;
        /// Writable in OP.
        const WRITE_OP = 1 << 5;
        /// Can be mapped into an RxPDO.
        const RX_PDO = 1 << 6;
        /// Can be mapped into a TxPDO.
        const TX_PDO = 1 << 7;
        /// To be saved when the device is replaced.
        const BACKUP = 1 << 8;
        /// To be written at start-up.
        const SETTINGS = 1 << 9;
        /// Readable in every state.
        const READ = Self::READ_PRE_OP.bits() | Self::READ_SAFE_OP.bits() | Self::READ_OP.bits();
        /// Writable in every state.
        const WRITE = Self::WRITE_PRE_OP.bits() | Self::WRITE_SAFE_OP.bits() | Self::WRITE_OP.bits();
    }
}
