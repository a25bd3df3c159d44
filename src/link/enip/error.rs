//! Why a segment cannot be driven, with what to do about it.

use core::net::{Ipv4Addr, SocketAddrV4};
use std::io;

use crate::bus::enip::scanner::{Mistake, Trouble};

/// Why an EtherNet/IP segment cannot be driven. Lost frames and robots that go away are not errors: they
/// show in [`InputQuality`](crate::cycle::InputQuality) and as events.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EnipError {
    /// The settings contradict themselves.
    #[error("settings of the segment: {0}")]
    Settings(&'static str),
    /// Nothing to drive.
    #[error("settings of the segment: no target is given; name the address of a robot at least")]
    NoTarget,
    /// More robots than a segment drives.
    #[error("{wanted} targets are more than the {} of one segment", super::settings::MAX_TARGETS)]
    TooManyTargets {
        /// Targets asked for.
        wanted: usize,
    },
    /// The settings of a target's connection contradict themselves.
    #[error("settings of target {target} at {address}: {mistake}")]
    Connection {
        /// Number of the target.
        target: usize,
        /// Its address.
        address: SocketAddrV4,
        /// What is wrong.
        mistake: Mistake,
    },
    /// A target's connection could not be opened.
    #[error("target {target} at {address}: {trouble}")]
    Target {
        /// Number of the target.
        target: usize,
        /// Its address.
        address: SocketAddrV4,
        /// What happened, and what to do about it.
        trouble: Trouble,
    },
    /// A target accepted the connection, but its frames do not arrive.
    #[error(
        "target {target} at {address}: the connection is open but no frame of it arrives; let UDP port {port} \
         through the firewall, and see that the target's way back leads to this machine"
    )]
    NoFrames {
        /// Number of the target.
        target: usize,
        /// Its address.
        address: SocketAddrV4,
        /// UDP port that the frames should come to.
        port: u16,
    },
    /// A target sends to a group that could not be joined.
    #[error(
        "target {target} at {address}: its frames go to the group {group}, which cannot be joined ({kind}); \
         bind to the address of the interface that the target is on, or ask for unicast"
    )]
    Group {
        /// Number of the target.
        target: usize,
        /// Its address.
        address: SocketAddrV4,
        /// The multicast group.
        group: Ipv4Addr,
        /// Why it cannot be joined.
        kind: io::ErrorKind,
    },
    /// The time for the start was over before anything could be said about a target.
    #[error(
        "target {target} at {address}: not connected when the time for the start was over; check that it is \
         switched on and booted, or allow more time"
    )]
    NotConnected {
        /// Number of the target.
        target: usize,
        /// Its address.
        address: SocketAddrV4,
    },
    /// The sockets do not work any more.
    #[error(
        "the network of this machine cannot be used: {0}; check the interface, then start again"
    )]
    Network(io::ErrorKind),
}

impl EnipError {
    /// Whether trying again can help without anybody changing anything: a target that is not there yet,
    /// that has no connection left, that another scanner owns.
    #[must_use]
    pub const fn is_transient(self) -> bool {
        match self {
            Self::Target { trouble, .. } => trouble.is_transient(),
            Self::NoFrames { .. } | Self::NotConnected { .. } | Self::Network(_) => true,
            _ => false,
        }
    }

    /// The target that it is about, if it is about one.
    #[must_use]
    pub const fn target(self) -> Option<usize> {
        match self {
            Self::Connection { target, .. }
            | Self::Target { target, .. }
            | Self::NoFrames { target, .. }
            | Self::Group { target, .. }
            | Self::NotConnected { target, .. } => Some(target),
            _ => None,
        }
    }
}
