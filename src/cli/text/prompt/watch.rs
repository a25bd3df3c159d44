//! `--monitor`: what a robot tells at its monitoring port.

use core::net::SocketAddr;
use std::io::Write;
use std::prelude::v1::*;
use std::sync::atomic::Ordering;

use super::messages;
use super::paint::Paint;
use super::view::View;
use crate::cli::exit::{Exit, Failure};
use crate::cli::run_program::catch_interrupts;
use crate::link::text::Monitor;
use crate::time::Duration;
use crate::wire::meca500::code::Code;

/// Longest wait for a message, so that Ctrl-C is seen.
const LISTEN: Duration = Duration::from_millis(100);

/// Shows messages until interrupted.
pub(super) fn run(
    address: SocketAddr,
    limit: Duration,
    view: View,
    paint: Paint,
) -> Result<Exit, Failure> {
    let monitor = Monitor::connect(address, limit)
        .map_err(|error| super::connect::failure(&error, address, limit))?;
    let interrupted = catch_interrupts()?;
    let mut is_first = true;
    while !interrupted.load(Ordering::Relaxed) {
        let message = match monitor.messages().wait_next(LISTEN) {
            Ok(Some(message)) => message,
            Ok(None) => continue,
            Err(reason) => {
                return Err(Failure::link(format!(
                    "{address}: {reason}\n  Remedy: too many may be watching, or the robot has closed its \
                     ports; try again."
                )));
            }
        };
        // A monitoring port begins with the robot's state.
        let greets = matches!(message.code, Code::CONNECTED | Code::ANOTHER_USER);
        if core::mem::take(&mut is_first) && greets {
            return Err(Failure::link(format!(
                "{address} is a control port: {message}\n  Remedy: --monitor is for the monitoring port, \
                 10001."
            )));
        }
        if view.shows(&message) {
            // Nobody reads any more: `head` has enough.
            if writeln!(std::io::stdout(), "{}", messages::line(&message, view.is_raw(), paint))
                .is_err()
            {
                return Ok(Exit::Done);
            }
        }
    }
    Ok(Exit::Done)
}
