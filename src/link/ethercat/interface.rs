//! Notices that the network interface under a segment was removed, where all that the cycle sees is
//! frames that do not come back.

use std::io;

use super::raw_socket::{RawSocket, is_transient};
use super::segment::EthercatSegment;
use super::wire::Wire;
use crate::time::Duration;

/// How long to wait for a frame that cannot come: the socket finds out only when a wait is over, and
/// only if giving way to others has not used it up. If it has, the next exchange finds out.
const WAIT: Duration = Duration::from_micros(100);

impl EthercatSegment<RawSocket> {
    /// Whether the network interface is still there, even if it is down. To be asked after an exchange;
    /// costs nothing while frames pass, and does not allocate.
    ///
    /// # Errors
    ///
    /// What the system says of an interface that was removed: no exchange will ever bring inputs again.
    pub fn check_interface(&mut self) -> io::Result<()> {
        let socket = self.wire_mut();
        if !socket.is_down() {
            return Ok(());
        }
        let deadline = socket.now() + WAIT;
        match socket.receive(&mut [], deadline) {
            Err(error) if !is_transient(&error) => Err(error),
            _ => Ok(()),
        }
    }
}
