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
use crate::link::clock::MonotonicClock;
use crate::link::text::Monitor;
use crate::time::Duration;
use crate::wire::meca500::code::Code;

/// Longest wait for a message, so that Ctrl-C is seen.
const LISTEN: Duration = Duration::from_millis(100);

/// Longest time between two rounds of monitoring messages. Source: PM L3679.
const LONGEST_INTERVAL: Duration = Duration::from_secs(1);

/// A control port does not tell the robot's state, or is taken.
fn other_port(address: SocketAddr) -> Failure {
    Failure::link(format!(
        "{address} does not tell the robot's state: it is no monitoring port\n  Remedy: --monitor is for the \
         monitoring port, 10001; the control port is 10000."
    ))
}

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
    let clock = MonotonicClock::new();
    let start = clock.now();
    let mut is_monitoring = false;
    while !interrupted.load(Ordering::Relaxed) {
        let elapsed = clock.now().saturating_duration_since(start);
        let message = match monitor.messages().wait_next(LISTEN) {
            Ok(None) if !is_monitoring && elapsed > LONGEST_INTERVAL * 2 => {
                return Err(other_port(address));
            }
            Ok(None) => continue,
            Ok(Some(message)) if message.code == Code::ANOTHER_USER && !is_monitoring => {
                return Err(other_port(address));
            }
            Ok(Some(message)) => message,
            Err(reason) => {
                return Err(Failure::link(format!(
                    "{address}: {reason}\n  Remedy: too many may be watching, or the robot has closed its \
                     ports; try again."
                )));
            }
        };
        is_monitoring |= message.code == Code::STATUS_ROBOT;
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
