//! Why a connection is not there, in words with a remedy.

use crate::time::Duration;
use crate::wire::enip::DecodeError;
use crate::wire::enip::encapsulation::EncapsulationStatus;
use crate::wire::enip::message::Response;
use crate::wire::enip::status::{ExtendedStatus, GeneralStatus, Refusal};

/// Why a connection ended or could not be opened. Every variant has words with a remedy in `Display`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Trouble {
    /// No TCP connection to the target's address.
    #[error(
        "no TCP connection to the target: check its address, that it is switched on, that EtherNet/IP is enabled on it, and that no firewall stands before port 44818"
    )]
    Unreachable,
    /// The target does not answer an encapsulated request in time, or closes the TCP connection instead.
    #[error(
        "the target does not answer {step}, or closes the TCP connection instead: check that what listens there is an EtherNet/IP device and that it has connections left; start it again if this stays"
    )]
    NoAnswer {
        /// Which request.
        step: Step,
    },
    /// It refuses the encapsulated request.
    #[error(
        "the target refuses {step} with encapsulation status {status}: start it again if this stays"
    )]
    Encapsulation {
        /// Which request.
        step: Step,
        /// With which status.
        status: EncapsulationStatus,
    },
    /// It refuses the Forward Open.
    #[error("the target refuses the connection: {}", RefusalText(*general, *extended, *detail))]
    Refused {
        /// General status.
        general: GeneralStatus,
        /// Why, if it says.
        extended: Option<ExtendedStatus>,
        /// The word behind the extended status, if there is one.
        detail: Option<u16>,
    },
    /// It refuses the sizes of the Forward Open. All sizes as they go on the wire: with 2 bytes of sequence
    /// count, O->T of an owner with 4 bytes of run/idle header.
    #[error(
        "the target refuses the sizes ({extended}); asked for were {o2t} bytes O->T and {t2o} bytes T->O, sequence count and header included{}",
        Offered(*offered)
    )]
    WrongSize {
        /// The status that says so.
        extended: ExtendedStatus,
        /// O->T size that was asked for.
        o2t: u16,
        /// T->O size that was asked for.
        t2o: u16,
        /// The size that the target has in the direction of the status, if it says.
        offered: Option<u16>,
    },
    /// What it answered cannot be read.
    #[error(
        "the target's answer to {step} cannot be read ({error}): check that what listens there is an EtherNet/IP device; if it is, record the traffic of port 44818 and compare firmware versions"
    )]
    Malformed {
        /// What was asked.
        step: Step,
        /// What is wrong with the answer.
        error: DecodeError,
    },
    /// No T->O frame came for so long.
    #[error(
        "no frame from the target for {} ms: check cable and target, that a firewall lets UDP 2222 pass, or ask for a larger timeout multiplier",
        after.as_millis()
    )]
    TimedOut {
        /// How long was waited.
        after: Duration,
    },
    /// The frames have another size than was agreed.
    #[error(
        "frames from the target carry {found} bytes of inputs, and {expected} were agreed on: check which device and which firmware is at this address"
    )]
    FrameSize {
        /// Bytes of the input image that was agreed on.
        expected: u16,
        /// Bytes that came.
        found: u16,
    },
    /// Frames of its group come, but have said for so long that the connection does not control the target any
    /// more.
    #[error(
        "the target has said for {} ms that this connection only watches: its outputs do not arrive any more, so check cable and target, and that a firewall lets UDP 2222 pass to the target",
        after.as_millis()
    )]
    ControlLost {
        /// How long.
        after: Duration,
    },
}

impl Trouble {
    /// Whether time alone may mend it: somebody else lets go, a watchdog expires, a cable is plugged in.
    #[must_use]
    pub const fn is_transient(&self) -> bool {
        match self {
            Self::Unreachable
            | Self::NoAnswer { .. }
            | Self::TimedOut { .. }
            | Self::ControlLost { .. } => true,
            // TCP damages nothing: the next answer will be the same.
            Self::Malformed { step, .. } => !matches!(*step, Step::ForwardOpen),
            Self::Encapsulation { status, .. } => !matches!(
                *status,
                EncapsulationStatus::UNSUPPORTED_VERSION | EncapsulationStatus::INVALID_COMMAND
            ),
            Self::WrongSize { .. } | Self::FrameSize { .. } => false,
            Self::Refused { extended: Some(extended), .. } => !matches!(
                extended.category(),
                Refusal::Key
                    | Refusal::Path
                    | Refusal::Size
                    | Refusal::Interval
                    | Refusal::Parameters
            ),
            Self::Refused { general, .. } => !matches!(
                *general,
                GeneralStatus::PATH_SEGMENT_ERROR
                    | GeneralStatus::PATH_DESTINATION_UNKNOWN
                    | GeneralStatus::SERVICE_NOT_SUPPORTED
                    | GeneralStatus::INVALID_ATTRIBUTE_VALUE
                    | GeneralStatus::NOT_ENOUGH_DATA
                    | GeneralStatus::TOO_MUCH_DATA
                    | GeneralStatus::OBJECT_DOES_NOT_EXIST
                    | GeneralStatus::KEY_FAILURE_IN_PATH
                    | GeneralStatus::PATH_SIZE_INVALID
            ),
        }
    }

    /// Whether the path was refused, so that another one may do.
    pub(super) fn is_about_the_path(&self) -> bool {
        match self {
            Self::Refused { extended: Some(extended), .. } => extended.category() == Refusal::Path,
            Self::Refused { general, .. } => matches!(
                *general,
                GeneralStatus::PATH_SEGMENT_ERROR | GeneralStatus::PATH_DESTINATION_UNKNOWN
            ),
            _ => false,
        }
    }

    /// What a refusal of sizes `o2t` and `t2o` means. Words of additional status belong to connections only
    /// where the general status is a connection failure; elsewhere they are the device's own.
    pub(super) fn refusal(response: &Response<'_>, o2t: u16, t2o: u16) -> Self {
        let general = response.status;
        let is_connection = general == GeneralStatus::CONNECTION_FAILURE;
        let extended = response.extended().filter(|_| is_connection);
        let detail = response.additional_word(1);
        match extended {
            Some(extended) if extended.category() == Refusal::Size => {
                Self::WrongSize { extended, o2t, t2o, offered: detail }
            }
            _ => Self::Refused { general, extended, detail },
        }
    }
}

/// A refusal in words.
struct RefusalText(GeneralStatus, Option<ExtendedStatus>, Option<u16>);

impl core::fmt::Display for RefusalText {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.1 {
            Some(extended) => write!(f, "{extended}")?,
            None => write!(f, "general status {}; see the device's manual", self.0)?,
        }
        self.2.map_or(Ok(()), |detail| write!(f, " (it adds 0x{detail:04X})"))
    }
}

/// The size that the target has.
struct Offered(Option<u16>);

impl core::fmt::Display for Offered {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.0.map_or(Ok(()), |offered| write!(f, "; the target has {offered} bytes"))
    }
}

/// Steps of opening a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// TCP.
    Connect,
    /// The session on it.
    RegisterSession,
    /// Who the target is.
    Identity,
    /// The connection.
    ForwardOpen,
    /// Its end.
    ForwardClose,
    /// An explicit request of the caller.
    Request,
}

impl core::fmt::Display for Step {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Connect => "the TCP connection",
            Self::RegisterSession => "RegisterSession",
            Self::Identity => "the request for its identity",
            Self::ForwardOpen => "Forward Open",
            Self::ForwardClose => "Forward Close",
            Self::Request => "the explicit request",
        })
    }
}

/// Why an explicit request was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RequestError {
    /// Another one is under way.
    #[error("an explicit request to this target is under way: wait for its answer")]
    Busy,
    /// There is no session yet, or none any more.
    #[error("there is no session with this target: wait until its connection is open")]
    NoSession,
    /// The data are too long.
    #[error("data of an explicit request are at most {room} bytes")]
    TooLong {
        /// Bytes that fit.
        room: usize,
    },
    /// The scanner has no target with this number.
    #[error("the scanner has no target with this number: they count from 0")]
    NoSuchTarget,
}
