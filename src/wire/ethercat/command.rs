//! The fifteen commands a datagram can carry, with the four address bytes that go with them.

/// What a datagram asks of the subdevices it passes, and of which.
///
/// `position` is an auto-increment address: every subdevice adds one, and the one that receives 0
/// is meant. [`position_of`] gives it for a place in the line. `counter` of a broadcast comes back
/// as the number of subdevices passed. `register` is a physical address in the subdevice.
///
/// Source: ETG.1000 part 4.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Command {
    /// Nothing; every subdevice ignores it.
    Nop,
    /// Read by position.
    Aprd {
        /// Auto-increment address.
        position: u16,
        /// Physical address.
        register: u16,
    },
    /// Write by position.
    Apwr {
        /// Auto-increment address.
        position: u16,
        /// Physical address.
        register: u16,
    },
    /// Read and write by position.
    Aprw {
        /// Auto-increment address.
        position: u16,
        /// Physical address.
        register: u16,
    },
    /// Read by station address or alias.
    Fprd {
        /// Station address.
        station: u16,
        /// Physical address.
        register: u16,
    },
    /// Write by station address or alias.
    Fpwr {
        /// Station address.
        station: u16,
        /// Physical address.
        register: u16,
    },
    /// Read and write by station address or alias.
    Fprw {
        /// Station address.
        station: u16,
        /// Physical address.
        register: u16,
    },
    /// Read of all: the data are OR-ed together.
    Brd {
        /// Subdevices passed so far; 0 when sent.
        counter: u16,
        /// Physical address.
        register: u16,
    },
    /// Write to all.
    Bwr {
        /// Subdevices passed so far; 0 when sent.
        counter: u16,
        /// Physical address.
        register: u16,
    },
    /// Read and write of all.
    Brw {
        /// Subdevices passed so far; 0 when sent.
        counter: u16,
        /// Physical address.
        register: u16,
    },
    /// Read of the logical process image.
    Lrd {
        /// Logical address.
        address: u32,
    },
    /// Write to the logical process image.
    Lwr {
        /// Logical address.
        address: u32,
    },
    /// Read and write of the logical process image.
    Lrw {
        /// Logical address.
        address: u32,
    },
    /// One subdevice by position reads, all others write what was read.
    Armw {
        /// Auto-increment address.
        position: u16,
        /// Physical address.
        register: u16,
    },
    /// One subdevice by station address reads, all others write what was read.
    Frmw {
        /// Station address.
        station: u16,
        /// Physical address.
        register: u16,
    },
}

/// The auto-increment address of the subdevice number `index` of the line, counted from 0.
#[must_use]
pub const fn position_of(index: u16) -> u16 {
    0_u16.wrapping_sub(index)
}

impl Command {
    /// The command with this number and these four address bytes; `None` for a number above 14.
    #[must_use]
    pub const fn from_wire(code: u8, address: [u8; 4]) -> Option<Self> {
        let [a, b, c, d] = address;
        let (device, register) = (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
        let logical = u32::from_le_bytes(address);
        Some(match code {
            0 => Self::Nop,
            1 => Self::Aprd { position: device, register },
            2 => Self::Apwr { position: device, register },
            3 => Self::Aprw { position: device, register },
            4 => Self::Fprd { station: device, register },
            5 => Self::Fpwr { station: device, register },
            6 => Self::Fprw { station: device, register },
            7 => Self::Brd { counter: device, register },
            8 => Self::Bwr { counter: device, register },
            9 => Self::Brw { counter: device, register },
            10 => Self::Lrd { address: logical },
            11 => Self::Lwr { address: logical },
            12 => Self::Lrw { address: logical },
            13 => Self::Armw { position: device, register },
            14 => Self::Frmw { station: device, register },
            _ => return None,
        })
    }

    /// Its number on the wire, 0 to 14.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Nop => 0,
            Self::Aprd { .. } => 1,
            Self::Apwr { .. } => 2,
            Self::Aprw { .. } => 3,
            Self::Fprd { .. } => 4,
            Self::Fpwr { .. } => 5,
            Self::Fprw { .. } => 6,
            Self::Brd { .. } => 7,
            Self::Bwr { .. } => 8,
            Self::Brw { .. } => 9,
            Self::Lrd { .. } => 10,
            Self::Lwr { .. } => 11,
            Self::Lrw { .. } => 12,
            Self::Armw { .. } => 13,
            Self::Frmw { .. } => 14,
        }
    }

    /// Its four address bytes on the wire.
    #[must_use]
    pub const fn address(self) -> [u8; 4] {
        let (device, register) = match self {
            Self::Nop => (0, 0),
            Self::Aprd { position, register }
            | Self::Apwr { position, register }
            | Self::Aprw { position, register }
            | Self::Armw { position, register } => (position, register),
            Self::Fprd { station, register }
            | Self::Fpwr { station, register }
            | Self::Fprw { station, register }
            | Self::Frmw { station, register } => (station, register),
            Self::Brd { counter, register }
            | Self::Bwr { counter, register }
            | Self::Brw { counter, register } => (counter, register),
            Self::Lrd { address } | Self::Lwr { address } | Self::Lrw { address } => {
                return address.to_le_bytes();
            }
        };
        let ([a, b], [c, d]) = (device.to_le_bytes(), register.to_le_bytes());
        [a, b, c, d]
    }

    /// Its name as the standard spells it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Nop => "NOP",
            Self::Aprd { .. } => "APRD",
            Self::Apwr { .. } => "APWR",
            Self::Aprw { .. } => "APRW",
            Self::Fprd { .. } => "FPRD",
            Self::Fpwr { .. } => "FPWR",
            Self::Fprw { .. } => "FPRW",
            Self::Brd { .. } => "BRD",
            Self::Bwr { .. } => "BWR",
            Self::Brw { .. } => "BRW",
            Self::Lrd { .. } => "LRD",
            Self::Lwr { .. } => "LWR",
            Self::Lrw { .. } => "LRW",
            Self::Armw { .. } => "ARMW",
            Self::Frmw { .. } => "FRMW",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_comes_back() {
        for code in 0..=u8::MAX {
            let address = if code == 0 { [0; 4] } else { [1, 2, 3, 4] };
            match Command::from_wire(code, address) {
                Some(command) => {
                    assert_eq!((command.code(), command.address()), (code, address));
                }
                None => assert!(code > 14),
            }
        }
    }

    #[test]
    fn positions_count_down_from_zero() {
        assert_eq!([position_of(0), position_of(1), position_of(3)], [0, 0xFFFF, 0xFFFD]);
    }
}
