//! General and extended status of CIP responses, in words and with remedies.
//!
//! Source: CIP volume 1, appendix B and chapter 3; the remedies are ours.

/// What came of a request.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct GeneralStatus(pub u8);

impl GeneralStatus {
    /// It was done.
    pub const SUCCESS: Self = Self(0x00);
    /// A connection could not be opened or closed; the extended status says why.
    pub const CONNECTION_FAILURE: Self = Self(0x01);
    /// Something the device needs for it is used up.
    pub const RESOURCE_UNAVAILABLE: Self = Self(0x02);
    /// The path cannot be read.
    pub const PATH_SEGMENT_ERROR: Self = Self(0x04);
    /// The path names an object that does not exist.
    pub const PATH_DESTINATION_UNKNOWN: Self = Self(0x05);
    /// The object does not offer the service.
    pub const SERVICE_NOT_SUPPORTED: Self = Self(0x08);
    /// A value is out of range.
    pub const INVALID_ATTRIBUTE_VALUE: Self = Self(0x09);
    /// The attribute can only be read.
    pub const ATTRIBUTE_NOT_SETTABLE: Self = Self(0x0E);
    /// Not in this state of the device.
    pub const DEVICE_STATE_CONFLICT: Self = Self(0x10);
    /// The answer does not fit.
    pub const REPLY_TOO_LARGE: Self = Self(0x11);
    /// The request ends too early.
    pub const NOT_ENOUGH_DATA: Self = Self(0x13);
    /// The object has no such attribute.
    pub const ATTRIBUTE_NOT_SUPPORTED: Self = Self(0x14);
    /// The request has bytes too many.
    pub const TOO_MUCH_DATA: Self = Self(0x15);
    /// There is no such instance.
    pub const OBJECT_DOES_NOT_EXIST: Self = Self(0x16);
}

impl core::fmt::Display for GeneralStatus {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let text = match *self {
            Self::SUCCESS => "success",
            Self::CONNECTION_FAILURE => "connection failure",
            Self::RESOURCE_UNAVAILABLE => "resource unavailable",
            Self::PATH_SEGMENT_ERROR => "path cannot be read",
            Self::PATH_DESTINATION_UNKNOWN => "path names no object",
            Self::SERVICE_NOT_SUPPORTED => "service not supported",
            Self::INVALID_ATTRIBUTE_VALUE => "attribute value out of range",
            Self::ATTRIBUTE_NOT_SETTABLE => "attribute can only be read",
            Self::DEVICE_STATE_CONFLICT => "not in this state of the device",
            Self::REPLY_TOO_LARGE => "reply too large",
            Self::NOT_ENOUGH_DATA => "not enough data",
            Self::ATTRIBUTE_NOT_SUPPORTED => "attribute not supported",
            Self::TOO_MUCH_DATA => "too much data",
            Self::OBJECT_DOES_NOT_EXIST => "object does not exist",
            _ => "see the device's manual",
        };
        write!(f, "0x{:02X}: {text}", self.0)
    }
}

/// Why a connection could not be opened or closed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ExtendedStatus(pub u16);

impl ExtendedStatus {
    /// The connection exists already, with this very triad.
    pub const IN_USE: Self = Self(0x0100);
    /// Transport class and trigger are not supported.
    pub const TRANSPORT_NOT_SUPPORTED: Self = Self(0x0103);
    /// Somebody else owns the outputs.
    pub const OWNERSHIP_CONFLICT: Self = Self(0x0106);
    /// No such connection.
    pub const NOT_FOUND: Self = Self(0x0107);
    /// A connection type or parameter is invalid.
    pub const INVALID_PARAMETERS: Self = Self(0x0108);
    /// A size is invalid.
    pub const INVALID_SIZE: Self = Self(0x0109);
    /// An interval is not supported.
    pub const RPI_NOT_SUPPORTED: Self = Self(0x0111);
    /// No connection is left.
    pub const OUT_OF_CONNECTIONS: Self = Self(0x0113);
    /// The electronic key names another vendor or product.
    pub const VENDOR_OR_PRODUCT_MISMATCH: Self = Self(0x0114);
    /// The electronic key names another device type.
    pub const DEVICE_TYPE_MISMATCH: Self = Self(0x0115);
    /// The electronic key names another revision.
    pub const REVISION_MISMATCH: Self = Self(0x0116);
    /// The path names no assembly that fits.
    pub const INVALID_APPLICATION_PATH: Self = Self(0x0117);
    /// A listen-only connection without anything to listen to.
    pub const NO_OWNER: Self = Self(0x0119);
    /// The target is out of memory for connections.
    pub const TARGET_OUT_OF_CONNECTIONS: Self = Self(0x011A);
    /// An O->T connection type is not supported.
    pub const O2T_TYPE: Self = Self(0x0123);
    /// A T->O connection type is not supported.
    pub const T2O_TYPE: Self = Self(0x0124);
    /// The O->T size does not fit; the next word has the right one.
    pub const O2T_SIZE: Self = Self(0x0127);
    /// The T->O size does not fit; the next word has the right one.
    pub const T2O_SIZE: Self = Self(0x0128);
    /// The configuration assembly of the path is not there.
    pub const INVALID_CONFIGURATION_PATH: Self = Self(0x0129);
    /// The O->T assembly of the path is not there.
    pub const INVALID_CONSUMING_PATH: Self = Self(0x012A);
    /// The T->O assembly of the path is not there.
    pub const INVALID_PRODUCING_PATH: Self = Self(0x012B);
    /// The points of the path do not belong together.
    pub const INCONSISTENT_PATH: Self = Self(0x012F);
    /// The connection timed out.
    pub const CONNECTION_TIMED_OUT: Self = Self(0x0203);
    /// The request timed out on its way.
    pub const REQUEST_TIMED_OUT: Self = Self(0x0204);
    /// The path has a segment that is not understood.
    pub const INVALID_SEGMENT: Self = Self(0x0315);

    /// What kind of refusal it is: different devices send different numbers for the same reason.
    #[must_use]
    pub const fn category(self) -> Refusal {
        match self.0 {
            0x0100 => Refusal::InUse,
            0x0106 => Refusal::Ownership,
            0x0107 => Refusal::NotFound,
            0x0109 | 0x0127 | 0x0128 | 0x0126 => Refusal::Size,
            0x0110 => Refusal::NotConfigured,
            0x0111 | 0x0112 => Refusal::Interval,
            0x0113 | 0x011A | 0x011B | 0x0302 => Refusal::OutOfConnections,
            0x0114..=0x0116 | 0x013D => Refusal::Key,
            0x0117 | 0x0129..=0x012F | 0x0315 | 0x0311 | 0x0312 | 0x0316 => Refusal::Path,
            0x0119 | 0x0120 => Refusal::NoOwner,
            0x0103 | 0x0108 | 0x0123..=0x0125 | 0x010C | 0x0132 => Refusal::Parameters,
            0x0203..=0x0205 => Refusal::TimedOut,
            _ => Refusal::Other,
        }
    }
}

/// Kinds of refusals of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Refusal {
    /// The same connection is open already.
    InUse,
    /// Somebody else owns the outputs.
    Ownership,
    /// No such connection.
    NotFound,
    /// A size does not fit.
    Size,
    /// The target is not configured.
    NotConfigured,
    /// An interval is not supported.
    Interval,
    /// No connection is left.
    OutOfConnections,
    /// The electronic key names another device.
    Key,
    /// The path names something that is not there.
    Path,
    /// Nobody is there to listen to.
    NoOwner,
    /// A type, transport or parameter is not supported.
    Parameters,
    /// Somebody on the way waited too long.
    TimedOut,
    /// Anything else.
    Other,
}

impl Refusal {
    /// What it means and what to do about it.
    #[must_use]
    pub const fn text(self) -> (&'static str, &'static str) {
        match self {
            Self::InUse => (
                "this very connection is open already",
                "wait until the target's watchdog has ended it, or open one with another serial number",
            ),
            Self::Ownership => (
                "somebody else controls the robot",
                "close the connection of the other scanner, or the controlling connection of another \
                 protocol (TCP, PROFINET, the web interface), or listen only",
            ),
            Self::NotFound => ("the target has no such connection", "open it anew"),
            Self::Size => (
                "the target's assemblies have other sizes",
                "compare with 60 bytes O->T and 252 bytes T->O; another firmware may differ",
            ),
            Self::NotConfigured => ("the target is not configured", "configure it first"),
            Self::Interval => (
                "the target does not support this interval",
                "ask for a longer one (the robot takes 10 ms and more)",
            ),
            Self::OutOfConnections => (
                "the target has no connection left",
                "close one, or wait until a dead one has timed out",
            ),
            Self::Key => (
                "the target is not the device that the electronic key names",
                "use no key or a wildcard key: the revision differs with the firmware",
            ),
            Self::Path => (
                "the target does not know the assemblies of the path",
                "try it with or without a configuration assembly",
            ),
            Self::NoOwner => (
                "there is no owner to listen to",
                "let an owner connect first, or ask for an input-only connection",
            ),
            Self::Parameters => (
                "the target does not support this kind of connection",
                "try T->O unicast instead of multicast, or the other way round",
            ),
            Self::TimedOut => {
                ("a request or a connection timed out", "check the network and try again")
            }
            Self::Other => ("the target refuses", "see the device's manual"),
        }
    }
}

impl core::fmt::Display for ExtendedStatus {
    /// `0x0106: somebody else controls the robot; close ...`
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let (meaning, remedy) = self.category().text();
        write!(f, "0x{:04X}: {meaning}; {remedy}", self.0)
    }
}
