//! The application layer's states, and the codes that say why one was refused.

/// A state of the EtherCAT state machine, as the low four bits of AL control and AL status.
///
/// Source: ETG.1000 part 6.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum AlState {
    /// No mailbox, no process data.
    #[default]
    Init,
    /// Mailbox, no process data.
    PreOp,
    /// Firmware download; a robot does not offer it.
    Bootstrap,
    /// Mailbox and inputs; outputs are ignored.
    SafeOp,
    /// Mailbox, inputs and outputs.
    Op,
}

impl AlState {
    /// The state with this number on the wire; bits above the low four are ignored.
    #[must_use]
    pub const fn from_wire(value: u8) -> Option<Self> {
        Some(match value & 0x0F {
            1 => Self::Init,
            2 => Self::PreOp,
            3 => Self::Bootstrap,
            4 => Self::SafeOp,
            8 => Self::Op,
            _ => return None,
        })
    }

    /// Its number on the wire: 1, 2, 3, 4 or 8.
    #[must_use]
    pub const fn to_wire(self) -> u8 {
        match self {
            Self::Init => 1,
            Self::PreOp => 2,
            Self::Bootstrap => 3,
            Self::SafeOp => 4,
            Self::Op => 8,
        }
    }
}

impl core::fmt::Display for AlState {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(match self {
            Self::Init => "INIT",
            Self::PreOp => "PRE-OP",
            Self::Bootstrap => "BOOT",
            Self::SafeOp => "SAFE-OP",
            Self::Op => "OP",
        })
    }
}

/// An AL status code (register 0134h): why a state was left or refused; 0 is no error.
///
/// Source: ETG.1000 part 6.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct AlStatusCode(pub u16);

impl AlStatusCode {
    /// No error.
    pub const NO_ERROR: Self = Self(0x0000);
    /// The requested change of state does not exist.
    pub const INVALID_STATE_CHANGE: Self = Self(0x0011);
    /// The requested state does not exist.
    pub const UNKNOWN_STATE: Self = Self(0x0012);
    /// BOOT is not offered.
    pub const BOOTSTRAP_NOT_SUPPORTED: Self = Self(0x0013);
    /// The mailbox sync managers are not as PRE-OP needs them.
    pub const INVALID_MAILBOX_CONFIGURATION: Self = Self(0x0016);
    /// A sync manager is not as the state needs it.
    pub const INVALID_SYNC_MANAGER_CONFIGURATION: Self = Self(0x0017);
    /// No process data watchdog was fed in time.
    pub const SYNC_MANAGER_WATCHDOG: Self = Self(0x001B);
    /// The length of the output sync manager is not that of the assigned outputs.
    pub const INVALID_OUTPUT_CONFIGURATION: Self = Self(0x001D);
    /// The length of the input sync manager is not that of the assigned inputs.
    pub const INVALID_INPUT_CONFIGURATION: Self = Self(0x001E);
    /// The PDO assignment or mapping does not fit.
    pub const INVALID_PROCESS_DATA_MAPPING: Self = Self(0x0025);
}

impl core::fmt::Display for AlStatusCode {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{:#06x}", self.0)
    }
}
