//! A network cable that is pulled, as one socket sees it (Linux).
//!
//! A filter on the socket drops every packet before the system looks at it: nothing is received and
//! nothing acknowledged, as without a cable. What the socket's owner sends is the owner's business.

use std::io::{self, ErrorKind};

use rustix::fd::BorrowedFd;
use socket2::{SockFilter, SockRef};

/// A program that returns at once how much of the packet to keep.
const RETURN: u16 = 0x06;

/// Lets nothing more arrive at `socket`, or lets it arrive again.
///
/// # Errors
///
/// The system knows no such filters.
pub(super) fn set_plugged(socket: BorrowedFd<'_>, plugged: bool) -> io::Result<()> {
    let socket = SockRef::from(&socket);
    if !plugged {
        return socket.attach_filter(&[SockFilter::new(RETURN, 0, 0, 0)]);
    }
    match socket.detach_filter() {
        // It was never pulled.
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        done => done,
    }
}
