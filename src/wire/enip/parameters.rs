//! Network connection parameters of a Forward Open: type, priority, size of one direction.
//!
//! Source: CIP volume 1, chapter 3.

/// Bytes of the sequence count in front of class 1 data.
pub const SEQUENCE_LEN: u16 = 2;
/// Bytes of the run/idle header behind the sequence count, O->T.
pub const RUN_IDLE_LEN: u16 = 4;

/// How the data of a direction travel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ConnectionType {
    /// Not at all.
    #[default]
    Null,
    /// To a group.
    Multicast,
    /// To one end.
    PointToPoint,
    /// Not defined.
    Reserved,
}

impl ConnectionType {
    const fn from_bits(bits: u32) -> Self {
        match bits & 3 {
            0 => Self::Null,
            1 => Self::Multicast,
            2 => Self::PointToPoint,
            _ => Self::Reserved,
        }
    }

    const fn to_bits(self) -> u32 {
        match self {
            Self::Null => 0,
            Self::Multicast => 1,
            Self::PointToPoint => 2,
            Self::Reserved => 3,
        }
    }
}

/// How urgent the data of a direction are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Priority {
    /// Low.
    Low,
    /// High.
    High,
    /// Scheduled; usual for I/O.
    #[default]
    Scheduled,
    /// Urgent.
    Urgent,
}

impl Priority {
    const fn from_bits(bits: u32) -> Self {
        match bits & 3 {
            0 => Self::Low,
            1 => Self::High,
            2 => Self::Scheduled,
            _ => Self::Urgent,
        }
    }

    const fn to_bits(self) -> u32 {
        match self {
            Self::Low => 0,
            Self::High => 1,
            Self::Scheduled => 2,
            Self::Urgent => 3,
        }
    }
}

/// The parameters of one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct NetworkParameters {
    /// Whether several may own the connection at once.
    pub is_redundant_owner: bool,
    /// How its data travel.
    pub connection_type: ConnectionType,
    /// How urgent they are.
    pub priority: Priority,
    /// Whether frames may be shorter than `size`.
    pub is_variable: bool,
    /// Bytes of a frame's data, sequence count and header included; 9 bits in a Forward Open, 16 in a
    /// Large Forward Open.
    pub size: u16,
}

/// Where type, priority and variable stand in the upper half; a Forward Open has them in its one word.
const REDUNDANT_BIT: u32 = 15;
const TYPE_BIT: u32 = 13;
const PRIORITY_BIT: u32 = 10;
const VARIABLE_BIT: u32 = 9;
/// Largest size of a Forward Open.
pub const MAX_SMALL_SIZE: u16 = 0x01FF;

impl NetworkParameters {
    const fn from_flags(flags: u32, size: u16) -> Self {
        Self {
            is_redundant_owner: flags >> REDUNDANT_BIT & 1 == 1,
            connection_type: ConnectionType::from_bits(flags >> TYPE_BIT),
            priority: Priority::from_bits(flags >> PRIORITY_BIT),
            is_variable: flags >> VARIABLE_BIT & 1 == 1,
            size,
        }
    }

    const fn flags(self) -> u32 {
        (self.is_redundant_owner as u32) << REDUNDANT_BIT
            | self.connection_type.to_bits() << TYPE_BIT
            | self.priority.to_bits() << PRIORITY_BIT
            | (self.is_variable as u32) << VARIABLE_BIT
    }

    /// From the word of a Forward Open.
    #[must_use]
    pub const fn from_word(word: u16) -> Self {
        Self::from_flags(word as u32, word & MAX_SMALL_SIZE)
    }

    /// The word of a Forward Open; of the size only the low 9 bits.
    #[must_use]
    pub const fn to_word(self) -> u16 {
        self.flags() as u16 | self.size & MAX_SMALL_SIZE
    }

    /// From the double word of a Large Forward Open.
    #[must_use]
    pub const fn from_double_word(word: u32) -> Self {
        Self::from_flags(word >> 16, word as u16)
    }

    /// The double word of a Large Forward Open.
    #[must_use]
    pub const fn to_double_word(self) -> u32 {
        self.flags() << 16 | self.size as u32
    }
}

/// How many intervals without a frame end a connection: 4 times 2 to the power of this number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TimeoutMultiplier(u8);

impl TimeoutMultiplier {
    /// The multiplier with this number on the wire, 0 to 7.
    #[must_use]
    pub const fn from_wire(value: u8) -> Option<Self> {
        if value <= 7 { Some(Self(value)) } else { None }
    }

    /// The multiplier with this factor: 4, 8, 16, 32, 64, 128, 256 or 512.
    #[must_use]
    pub const fn from_factor(factor: u32) -> Option<Self> {
        match factor {
            4 => Some(Self(0)),
            8 => Some(Self(1)),
            16 => Some(Self(2)),
            32 => Some(Self(3)),
            64 => Some(Self(4)),
            128 => Some(Self(5)),
            256 => Some(Self(6)),
            512 => Some(Self(7)),
            _ => None,
        }
    }

    /// Its number on the wire.
    #[must_use]
    pub const fn to_wire(self) -> u8 {
        self.0
    }

    /// The factor: 4 to 512.
    #[must_use]
    pub const fn factor(self) -> u32 {
        4 << self.0
    }
}
