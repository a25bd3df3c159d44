//! General and extended status of CIP responses, in words and with remedies.
//!
//! Read [`ExtendedStatus::category`] first: stacks differ in the number they send for one reason, so that
//! code decides by category, and only people read the number.
//!
//! Source: CIP volume 1, appendix B and chapter 3; words, categories and remedies are a choice.

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
    /// The electronic key in the path names another device.
    pub const KEY_FAILURE_IN_PATH: Self = Self(0x25);
    /// The size of the path does not fit the path.
    pub const PATH_SIZE_INVALID: Self = Self(0x26);
}

impl core::fmt::Display for GeneralStatus {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let text = match self.0 {
            0x00 => "success",
            0x01 => "connection failure",
            0x02 => "resource unavailable",
            0x03 => "parameter value out of range",
            0x04 => "path cannot be read",
            0x05 => "path names no object",
            0x06 => "only a part was transferred",
            0x07 => "connection lost",
            0x08 => "service not supported",
            0x09 => "attribute value out of range",
            0x0A => "an attribute of the list failed",
            0x0B => "already in this mode or state",
            0x0C => "not in this state of the object",
            0x0D => "object exists already",
            0x0E => "attribute can only be read",
            0x0F => "not permitted",
            0x10 => "not in this state of the device",
            0x11 => "reply too large",
            0x12 => "a value was cut in two",
            0x13 => "not enough data",
            0x14 => "attribute not supported",
            0x15 => "too much data",
            0x16 => "object does not exist",
            0x17 => "no fragmented service under way",
            0x18 => "attribute data were not stored",
            0x19 => "attribute data could not be stored",
            0x1A => "request too large for a network on the way",
            0x1B => "response too large for a network on the way",
            0x1C => "data missing from a list of attributes",
            0x1D => "list of attributes with invalid values",
            0x1E => "an embedded service failed",
            0x1F => "error of the vendor's own",
            0x20 => "parameter invalid",
            0x21 => "can be written once only, and was",
            0x22 => "invalid reply received",
            0x23 => "buffer overflow",
            0x24 => "message malformed",
            0x25 => "electronic key names another device",
            0x26 => "size of the path does not fit",
            0x27 => "attribute cannot be set now",
            0x28 => "no such member",
            0x29 => "member can only be read",
            0x2A => "general failure of a group 2 server",
            0x2B => "unknown Modbus error",
            0x2C => "attribute cannot be read",
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
    /// A size is invalid; the next word of additional status, if there is one, has the largest, in bytes.
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
    /// The configuration of the path is invalid or does not fit.
    pub const INVALID_CONFIGURATION_FORMAT: Self = Self(0x0118);
    /// A listen-only connection without anything to listen to.
    pub const NO_OWNER: Self = Self(0x0119);
    /// The target is out of memory for connections.
    pub const TARGET_OUT_OF_CONNECTIONS: Self = Self(0x011A);
    /// An O->T connection type is not supported.
    pub const O2T_TYPE: Self = Self(0x0123);
    /// A T->O connection type is not supported.
    pub const T2O_TYPE: Self = Self(0x0124);
    /// The O->T size does not fit; the next word of additional status has the right one, in bytes.
    pub const O2T_SIZE: Self = Self(0x0127);
    /// The T->O size does not fit; the next word of additional status has the right one, in bytes.
    pub const T2O_SIZE: Self = Self(0x0128);
    /// The configuration assembly of the path is not there.
    pub const INVALID_CONFIGURATION_PATH: Self = Self(0x0129);
    /// The O->T assembly of the path is not there.
    pub const INVALID_CONSUMING_PATH: Self = Self(0x012A);
    /// The T->O assembly of the path is not there.
    pub const INVALID_PRODUCING_PATH: Self = Self(0x012B);
    /// The points of the path do not belong together.
    pub const INCONSISTENT_PATH: Self = Self(0x012F);
    /// The timeout multiplier is not acceptable.
    pub const MULTIPLIER_NOT_ACCEPTABLE: Self = Self(0x0133);
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
            0x0109 | 0x0127 | 0x0128 | 0x0134 => Refusal::Size,
            0x0110 => Refusal::NotConfigured,
            0x0111 | 0x0112 | 0x011B => Refusal::Interval,
            0x0113 | 0x011A | 0x0301..=0x0303 | 0x0319 | 0x031E | 0x031F => {
                Refusal::OutOfConnections
            }
            0x0114..=0x0116 => Refusal::Key,
            // A size of configuration data that is not welcome is mended like a path that is not.
            0x0117 | 0x0118 | 0x0126 | 0x0129..=0x012F => Refusal::Path,
            0x0311 | 0x0312 | 0x0315 | 0x0316 | 0x0318 => Refusal::Path,
            0x0119 => Refusal::NoOwner,
            0x0103 | 0x0108 | 0x011C..=0x0125 => Refusal::Parameters,
            0x0130..=0x0133 | 0x0135..=0x0139 | 0x0304 | 0x0317 => Refusal::Parameters,
            0x0203 | 0x0204 | 0x0207 => Refusal::TimedOut,
            _ => Refusal::Other,
        }
    }

    /// What this very number says, where it says more than its [`category`](Self::category); `None` for
    /// numbers that the standard does not define for connections of this kind.
    #[must_use]
    pub const fn meaning(self) -> Option<&'static str> {
        Some(match self.0 {
            0x0100 => "this very connection is open already",
            0x0103 => "transport class and trigger are not supported together",
            0x0106 => "somebody else controls the robot",
            0x0107 => "the target has no such connection",
            0x0108 => "a connection type or another network parameter is invalid",
            0x0109 => "the size of a direction is invalid",
            0x0110 => "the target is not configured",
            0x0111 => "the target does not support this interval",
            0x0112 => "the target does not accept this interval, but others near it",
            0x0113 => "the target has no connection left",
            0x0114 => "the electronic key names another vendor or product",
            0x0115 => "the electronic key names another device type",
            0x0116 => "the electronic key names another revision",
            0x0117 => "the path names no assembly to produce or consume",
            0x0118 => "the configuration in the path is invalid or does not fit the assemblies",
            0x0119 => "there is no connection that could be listened to",
            0x011A => "the assembly has no connection left",
            0x011B => "the interval is shorter than the production inhibit time",
            0x011C => "the transport class is not supported",
            0x011D => "the trigger is not supported",
            0x011E => "the direction is not supported",
            0x011F => "fixed or variable size is not supported O->T",
            0x0120 => "fixed or variable size is not supported T->O",
            0x0121 => "the priority is not supported O->T",
            0x0122 => "the priority is not supported T->O",
            0x0123 => "the connection type is not supported O->T",
            0x0124 => "the connection type is not supported T->O",
            0x0125 => "redundant owners are not supported",
            0x0126 => "the configuration data have another size than the target's",
            0x0127 => "the size O->T is not that of the assembly",
            0x0128 => "the size T->O is not that of the assembly",
            0x0129 => "the path names a configuration assembly that is not there",
            0x012A => "the path names a consuming assembly that is not there",
            0x012B => "the path names a producing assembly that is not there",
            0x012C => "the path names a configuration symbol that is not there",
            0x012D => "the path names a consuming symbol that is not there",
            0x012E => "the path names a producing symbol that is not there",
            0x012F => "the assemblies of the path do not belong together",
            0x0130 => "the format of consumed data does not fit the assembly",
            0x0131 => "the format of produced data does not fit the assembly",
            0x0132 => "a Forward Open without any data direction is not supported",
            0x0133 => "the timeout multiplier is not accepted",
            0x0134 => "the size T->O differs from that of the group already produced",
            0x0135 => "fixed or variable differs from that of the group already produced",
            0x0136 => "the priority differs from that of the group already produced",
            0x0137 => "the transport class differs from that of the group already produced",
            0x0138 => "the trigger differs from that of the group already produced",
            0x0139 => "the inhibit time differs from that of the group already produced",
            0x0203 => "the connection timed out",
            0x0204 => "the request timed out on its way",
            0x0205 => "a parameter of the unconnected request is wrong",
            0x0206 => "the message is too large for an unconnected request",
            0x0207 => "the request was confirmed, but not answered in time",
            0x0301 => "no buffer memory is left",
            0x0302 => "no network bandwidth is left",
            0x0303 => "no filter for another connection id is left",
            0x0304 => "scheduled data are not configured",
            0x0305 => "the signature of the schedule does not fit",
            0x0306 => "the signature of the schedule cannot be checked",
            0x0311 => "the path names a port that is not there",
            0x0312 => "the path names an invalid link address",
            0x0315 => "the path has a segment that is not understood",
            0x0316 => "the path of the Forward Close is not that of the Forward Open",
            0x0317 => "the schedule is missing",
            0x0318 => "the path leads back to the device itself",
            0x0319 => "the secondary device has no resources left",
            0x031A => "a connection to the whole rack is open already",
            0x031B => "a connection to the module is open already",
            0x031C => "the target gives no reason",
            0x031D => "the redundant connections differ",
            0x031E | 0x031F => "the producer has no resources for another consumer left",
            0x0800 => "a network on the way is offline",
            0x0810 => "the target has no data of its application",
            0x0811 => "the originator has no data of its application",
            0x0812 => "the target's address changed since the network was scheduled",
            0x0813 => "multicast beyond the subnet is not configured",
            0x0814 => "the format of the data is invalid",
            _ => return None,
        })
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
                 protocol (TCP, PROFINET, the web interface), or listen only; if nobody has it, see whether \
                 the robot is set to monitoring only (EnableEtherNetIp(2))",
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
                "try T->O unicast instead of multicast or the other way round, scheduled priority, fixed \
                 size, and another multiplier",
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
        let (general, remedy) = self.category().text();
        let meaning = self.meaning().unwrap_or(general);
        write!(f, "0x{:04X}: {meaning}; {remedy}", self.0)
    }
}
