//! Why a robot cannot be served at its address.

use core::net::{Ipv4Addr, SocketAddrV4};
use std::io;

/// What a socket is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// TCP, port 44818: sessions and connections are opened there.
    Sessions,
    /// UDP, port 44818: ListIdentity.
    Messages,
    /// UDP, port 2222: class 1 frames.
    Frames,
}

impl core::fmt::Display for Purpose {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Sessions => "TCP, for sessions",
            Self::Messages => "UDP, for ListIdentity",
            Self::Frames => "UDP, for class 1 frames",
        })
    }
}

/// Why robots cannot be served.
#[derive(Debug, thiserror::Error)]
pub enum BindError {
    /// Two robots were given the same address.
    #[error(
        "two robots have the address {address}: each needs one of its own, for example 127.0.0.2, 127.0.0.3 and so on \
         on one machine"
    )]
    Twice {
        /// The address.
        address: Ipv4Addr,
    },
    /// A socket cannot be had.
    #[error("cannot listen at {address} ({purpose}): {cause}; {}", remedy(cause, *purpose))]
    Socket {
        /// Where.
        address: SocketAddrV4,
        /// What for.
        purpose: Purpose,
        /// What the system says.
        cause: io::Error,
    },
    /// The system has nothing to wait for sockets with.
    #[error("cannot wait for sockets: {cause}; raise the limit of open files (ulimit -n)")]
    Wait {
        /// What the system says.
        cause: io::Error,
    },
}

fn remedy(cause: &io::Error, purpose: Purpose) -> &'static str {
    match (cause.kind(), purpose) {
        (io::ErrorKind::AddrInUse, Purpose::Frames) => {
            "a scanner or another adapter on this machine holds the port (`ss -lunp` names it): bind the scanner to an \
             address of its own, or stop the other adapter"
        }
        (io::ErrorKind::AddrInUse, _) => {
            "another virtual robot or EtherNet/IP device on this machine holds the port (`ss -lntup` names it): stop it, \
             or take another address"
        }
        (io::ErrorKind::AddrNotAvailable, _) => {
            "the address is not of this machine: take one that `ip addr` lists, one of 127.0.0.0/8, or add it to an \
             interface"
        }
        (io::ErrorKind::PermissionDenied, _) => {
            "the process may not: ports below 1024 need a privilege, and a sandbox may forbid sockets"
        }
        _ => "each robot needs three sockets: see the limit of open files (ulimit -n)",
    }
}
