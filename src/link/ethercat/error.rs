//! Why a segment cannot be driven, with what to do about it.

use super::layout::LayoutMismatch;
use crate::wire::ethercat::al::{AlState, AlStatusCode};

/// What the start was doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Step {
    /// Looking for subdevices.
    Search,
    /// Addresses, SII, mailboxes: to PRE-OP.
    PreOp,
    /// Reading and writing the PDO assignment and mapping.
    Layout,
    /// Sync managers, FMMUs, watchdog, clocks.
    Configuration,
    /// To SAFE-OP.
    SafeOp,
    /// To OP, with outputs of zero on the wire.
    Op,
}

impl core::fmt::Display for Step {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Search => "looking for subdevices",
            Self::PreOp => "bringing the subdevices to PRE-OP",
            Self::Layout => "reading the PDO layout over CoE",
            Self::Configuration => "configuring sync managers and clocks",
            Self::SafeOp => "bringing the robots to SAFE-OP",
            Self::Op => "bringing the robots to OP",
        })
    }
}

/// Why an EtherCAT segment cannot be driven. Lost frames and robots that fall are not errors: they
/// show in [`InputQuality`](crate::cycle::InputQuality) and as events.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EthercatError {
    /// The settings contradict themselves.
    #[error("settings of the segment: {0}")]
    Settings(&'static str),
    /// No frame came back.
    #[error(
        "no EtherCAT subdevice answers: check the cable (port IN of the first robot), the interface, the \
         power, and that the robot is in EtherCAT mode (SwitchToEtherCAT)"
    )]
    Silent,
    /// There are subdevices, but no robot among them.
    #[error("no Meca500 on the segment; subdevices that answer: {subdevices}")]
    NoRobot {
        /// Subdevices on the segment.
        subdevices: u16,
    },
    /// Fewer robots than were asked for.
    #[error("robots asked for: {wanted}, on the segment: {found}")]
    TooFewRobots {
        /// Robots asked for.
        wanted: usize,
        /// Robots there are.
        found: usize,
    },
    /// More robots than a segment drives.
    #[error("{wanted} robots are more than the {} of one segment", super::settings::MAX_ROBOTS)]
    TooManyRobots {
        /// Robots asked for.
        wanted: usize,
    },
    /// More subdevices than can be looked after.
    #[error("{found} subdevices are more than the {limit} that fit: split the segment")]
    TooManySubdevices {
        /// Subdevices on the segment.
        found: u16,
        /// Subdevices that fit.
        limit: usize,
    },
    /// Nothing at this position.
    #[error("no subdevice at position {position}: there are {found}, counted from 0")]
    NoSuchPosition {
        /// Position asked for.
        position: u16,
        /// Subdevices on the segment.
        found: u16,
    },
    /// Nothing with this alias.
    #[error("no subdevice has the alias {alias}: `fieldarm probe` shows those there are")]
    NoSuchAlias {
        /// Alias asked for.
        alias: u16,
    },
    /// The same robot twice.
    #[error("the subdevice at position {position} was asked for twice")]
    Twice {
        /// Its position.
        position: u16,
    },
    /// Another device than a Meca500.
    #[error(
        "the subdevice at position {position} is no Meca500: vendor {vendor:#010x}, product {product:#010x}"
    )]
    NotMeca500 {
        /// Its position.
        position: u16,
        /// Vendor ID found.
        vendor: u32,
        /// Product code found.
        product: u32,
    },
    /// Somebody drives this segment.
    #[error(
        "the subdevice at position {position} is in OP: another main device drives this segment; stop it \
         first (or take over, which stops its robots)"
    )]
    Driven {
        /// Its position.
        position: u16,
    },
    /// The robot's images are laid out in a way that cannot be used.
    #[error("robot at position {position}: {mismatch}")]
    Layout {
        /// Its position.
        position: u16,
        /// What differs.
        mismatch: LayoutMismatch,
    },
    /// A subdevice refused a state.
    #[error("the subdevice at position {position} refused {wanted} and is in {state}: {code}")]
    Refused {
        /// Its position.
        position: u16,
        /// State asked for.
        wanted: AlState,
        /// State it is in.
        state: AlState,
        /// Its reason.
        code: AlStatusCode,
    },
    /// An SDO transfer was aborted.
    #[error(
        "the subdevice at position {position} aborted the transfer of object {index:04X}h:{sub_index:02X}: \
         code {code:#010x}"
    )]
    Aborted {
        /// Its position.
        position: u16,
        /// Object index.
        index: u16,
        /// Sub-index.
        sub_index: u8,
        /// CoE abort code.
        code: u32,
    },
    /// An emergency message came instead of an answer.
    #[error("the subdevice at position {position} sent the emergency {code:#06x} while {step}")]
    Emergency {
        /// Its position.
        position: u16,
        /// Emergency error code.
        code: u16,
        /// What was being done.
        step: Step,
    },
    /// An image has not the length of a Meca500's.
    #[error("an image is {expected} bytes long, given {found}")]
    ImageLength {
        /// Length of the image in bytes.
        expected: usize,
        /// Length given in bytes.
        found: usize,
    },
    /// The robot came back as something else.
    #[error(
        "what stands at position {position} now is another device or has another image; start the link again"
    )]
    Replaced {
        /// Its position.
        position: u16,
    },
    /// Distributed clocks were asked for and the robot has none.
    #[error("the robot at position {position} offers no distributed clocks: run without them")]
    NoClocks {
        /// Its position.
        position: u16,
    },
    /// The time for the start was over.
    #[error(
        "{step} took too long: frames get lost or the machine is too busy; {received} of {sent} frames came back"
    )]
    TimedOut {
        /// What was being done.
        step: Step,
        /// Frames sent so far.
        sent: u64,
        /// Frames that came back.
        received: u64,
    },
    /// A subdevice did not behave as EtherCAT asks.
    #[error("{step} failed: {what}")]
    Protocol {
        /// What was being done.
        step: Step,
        /// What was wrong, in a few words.
        what: &'static str,
    },
}

impl EthercatError {
    /// Whether trying again can help without anybody changing anything: frames that got lost, a robot
    /// that is not there yet.
    #[must_use]
    pub const fn is_transient(self) -> bool {
        matches!(
            self,
            Self::Silent
                | Self::NoRobot { .. }
                | Self::TooFewRobots { .. }
                | Self::NoSuchPosition { .. }
                | Self::Emergency { .. }
                | Self::TimedOut { .. }
                | Self::Protocol { .. }
        )
    }
    /// The subdevice that it is about, if it is about one.
    #[must_use]
    pub const fn position(self) -> Option<u16> {
        match self {
            Self::NoSuchPosition { position, .. }
            | Self::Twice { position }
            | Self::NotMeca500 { position, .. }
            | Self::Driven { position }
            | Self::Layout { position, .. }
            | Self::Refused { position, .. }
            | Self::Aborted { position, .. }
            | Self::Emergency { position, .. }
            | Self::Replaced { position }
            | Self::NoClocks { position } => Some(position),
            _ => None,
        }
    }
}
