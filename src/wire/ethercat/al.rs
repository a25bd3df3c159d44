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
    /// The SYNC cycle is not one that the device supports.
    pub const INVALID_SYNC_CYCLE: Self = Self(0x0035);
}

impl AlStatusCode {
    /// What the code means and what to do about it; `None` for a code that is not in the table,
    /// as a vendor's own (8000h and above).
    #[must_use]
    pub fn text(self) -> Option<(&'static str, &'static str)> {
        TEXTS
            .iter()
            .find(|(code, ..)| *code == self.0)
            .map(|&(_, meaning, remedy)| (meaning, remedy))
    }
}

impl core::fmt::Display for AlStatusCode {
    /// `0x001B: no process data came in time; ...`, or the number alone when it is not known.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.text() {
            Some((meaning, "")) => write!(f, "0x{:04X}: {meaning}", self.0),
            Some((meaning, remedy)) => write!(f, "0x{:04X}: {meaning}; {remedy}", self.0),
            None => {
                write!(f, "0x{:04X}: not a code of the standard; see the device's manual", self.0)
            }
        }
    }
}

/// Code, meaning, remedy; sorted by code.
///
/// Source: ETG.1000 part 6 for codes and meanings; the remedies are ours.
const TEXTS: &[(u16, &str, &str)] = &[
    (0x0000, "no error", ""),
    (0x0001, "error without a code of its own", "see the device's log"),
    (0x0002, "no memory left in the device", "power-cycle it"),
    (0x0003, "device set up invalidly", "check its own configuration"),
    (0x0006, "SII and firmware do not fit each other", "update the device's SII or firmware"),
    (0x0007, "firmware update failed", "repeat it"),
    (0x000E, "licence missing or expired", "ask the vendor"),
    (0x0011, "no such change of state", "go through PRE-OP and SAFE-OP in order"),
    (0x0012, "no such state", "request INIT, PRE-OP, SAFE-OP or OP"),
    (0x0013, "BOOT is not supported", "request INIT, PRE-OP, SAFE-OP or OP"),
    (0x0014, "no valid firmware", "load the firmware again"),
    (0x0015, "mailbox for BOOT set up wrongly", "take its sync managers from the SII"),
    (0x0016, "mailbox for PRE-OP set up wrongly", "take sync managers 0 and 1 from the SII"),
    (0x0017, "sync manager set up wrongly", "check address, length and control byte"),
    (0x0018, "no valid inputs", "look for a fault of the device itself"),
    (0x0019, "no valid outputs", "send outputs before requesting OP"),
    (0x001A, "synchronisation lost", "check cycle time and jitter, or switch off SYNC0"),
    (
        0x001B,
        "no outputs came before the watchdog expired",
        "send process data steadily, then acknowledge",
    ),
    (0x001C, "sync managers of the wrong kind", "take their order from the SII"),
    (
        0x001D,
        "output sync manager set up wrongly",
        "set its length to the sum of the assigned outputs",
    ),
    (
        0x001E,
        "input sync manager set up wrongly",
        "set its length to the sum of the assigned inputs",
    ),
    (0x001F, "watchdog set up wrongly", "check registers 0400h and 0420h"),
    (0x0020, "device needs a power cycle", "switch it off and on"),
    (0x0021, "device needs INIT", "request INIT"),
    (0x0022, "device needs PRE-OP", "request PRE-OP"),
    (0x0023, "device needs SAFE-OP", "request SAFE-OP"),
    (0x0024, "input mapping does not fit", "write 1C13h again, with objects the device knows"),
    (0x0025, "output mapping does not fit", "write 1C12h and 1C13h again, even if unchanged"),
    (0x0026, "settings contradict each other", "restore the device's defaults"),
    (0x0027, "free run is not supported", "choose another synchronisation"),
    (0x0028, "this synchronisation is not supported", "choose another one in 1C32h and 1C33h"),
    (0x0029, "free run needs three buffers", "set the sync managers to buffered"),
    (0x002A, "background watchdog expired", "power-cycle the device"),
    (0x002B, "neither inputs nor outputs are valid", "look for a fault of the device itself"),
    (0x002C, "synchronisation lost for good", "set up distributed clocks again"),
    (0x002D, "no SYNC signal arrived", "check activation and start time of SYNC0"),
    (0x002E, "cycle too short for the device", "lengthen the cycle"),
    (0x0030, "distributed clocks set up wrongly", "check the activation byte 0981h"),
    (0x0031, "latch inputs set up wrongly", "check register 09A8h"),
    (0x0032, "device cannot follow the clock", "reduce the jitter of the reference clock"),
    (0x0033, "synchronised inputs or outputs failed", "check the timing of frames against SYNC0"),
    (0x0034, "too many frames missed their SYNC0", "check the main device's cycle and shift time"),
    (0x0035, "SYNC cycle invalid", "set 09A0h to a cycle that the device supports"),
    (0x0036, "SYNC0 cycle does not fit", "set 09A0h to a cycle that the device supports"),
    (0x0037, "SYNC1 cycle does not fit", "set 09A4h to a cycle that the device supports"),
    (0x0041, "error in the AoE mailbox", "see the device's manual"),
    (0x0042, "error in the EoE mailbox", "see the device's manual"),
    (0x0043, "error in the CoE mailbox", "check the start-up SDOs"),
    (0x0044, "error in the FoE mailbox", "see the device's manual"),
    (0x0045, "error in the SoE mailbox", "see the device's manual"),
    (0x004F, "error in the VoE mailbox", "see the device's manual"),
    (0x0050, "SII not accessible for the firmware", "hand it over: write 1 to 0500h"),
    (0x0051, "SII access failed", "power-cycle the device"),
    (0x0052, "other hardware of the device is not ready", "wait and try again"),
    (0x0060, "device restarted by itself", "start it up again from INIT"),
    (0x0061, "identification value changed", "read it again"),
    (0x0070, "modules do not match the expected ones", "compare F030h with F050h"),
    (0x00F0, "application processor not there", "wait, or power-cycle the device"),
];

#[cfg(test)]
mod tests {
    extern crate std;

    use std::string::ToString as _;

    use super::*;

    #[test]
    fn codes_ascend_and_say_something() {
        assert!(TEXTS.windows(2).all(|pair| pair[0].0 < pair[1].0));
        assert!(TEXTS.iter().all(|(_, meaning, _)| !meaning.is_empty()));
        assert!(TEXTS.iter().skip(1).all(|(.., remedy)| !remedy.is_empty()));
    }

    #[test]
    fn a_code_is_shown_with_number_meaning_and_remedy() {
        assert_eq!(
            AlStatusCode::SYNC_MANAGER_WATCHDOG.to_string(),
            "0x001B: no outputs came before the watchdog expired; send process data steadily, then acknowledge"
        );
        assert_eq!(AlStatusCode::NO_ERROR.to_string(), "0x0000: no error");
        assert!(AlStatusCode(0x8123).to_string().starts_with("0x8123: not a code"));
    }

    #[test]
    fn states_come_back() {
        for value in 0..=u8::MAX {
            match AlState::from_wire(value) {
                Some(state) => assert_eq!(state.to_wire(), value & 0x0F),
                None => assert!(![1, 2, 3, 4, 8].contains(&(value & 0x0F))),
            }
        }
    }
}
