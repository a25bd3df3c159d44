//! Why there is no connection, and what to do about it.

use core::net::SocketAddr;
use std::io::ErrorKind;
use std::prelude::v1::*;

use crate::cli::exit::Failure;
use crate::link::text::ConnectError;
use crate::time::Duration;
use crate::wire::meca500::code::Code;

/// The failure with its remedy.
pub(super) fn failure(error: &ConnectError, address: SocketAddr, limit: Duration) -> Failure {
    let seconds = limit.as_secs_f64();
    Failure::link(match error {
        ConnectError::Socket { cause, .. } => match cause.kind() {
            ErrorKind::ConnectionRefused => format!(
                "nobody listens at {address}\n  Remedy: is the robot on and started, is it out of EtherCAT mode \
                 (in which it has no TCP), is this its address? Its control port is 10000, for --monitor \
                 10001."
            ),
            ErrorKind::TimedOut | ErrorKind::WouldBlock => format!(
                "no answer from {address} within {seconds} s\n  Remedy: check address, cable and power; this \
                 machine needs an address in the robot's network. --limit waits longer."
            ),
            ErrorKind::HostUnreachable | ErrorKind::NetworkUnreachable => format!(
                "no way to {address}: {cause}\n  Remedy: check address and cable; this machine needs an \
                 address in the robot's network (a robot comes with 192.168.0.100)."
            ),
            _ => format!("no connection to {address}: {cause}\n  Remedy: check the address."),
        },
        ConnectError::Refused(Code::ANOTHER_USER) => format!(
            "[3001] the robot at {address} is controlled by somebody else\n  Remedy: end the other \
             connection (another program, the web interface, an EtherNet/IP or PROFINET controller), or only \
             watch with --monitor."
        ),
        ConnectError::Refused(code) => {
            let remedy = code.describe().map_or("", |info| info.remedy);
            format!("the robot at {address} refuses the connection: {code}\n  Remedy: {remedy}")
        }
        ConnectError::NoGreeting { .. } => format!(
            "{address} takes connections, but no robot greets there within {seconds} s\n  Remedy: is it a \
             robot's control port? That is 10000; 10001 is its monitoring port, which takes --monitor."
        ),
        ConnectError::Ended(reason) => format!(
            "{address} took the connection, and it ended before a robot greeted: {reason}\n  Remedy: is it \
             a robot's control port (10000)? A robot that starts needs a moment."
        ),
    })
}

/// Somebody greets as a robot does and answers nothing, as a monitoring port.
pub(super) fn mute(address: SocketAddr, limit: Duration) -> Failure {
    Failure::link(format!(
        "the robot at {address} greets and answers nothing within {} s\n  Remedy: is it its monitoring port \
         (10001)? That takes --monitor; commands go to its control port, 10000.",
        limit.as_secs_f64()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::exit::Exit;
    use crate::link::text::EndReason;

    #[test]
    fn every_refusal_has_a_remedy_and_the_address() {
        let address: SocketAddr = "192.168.0.100:10000".parse().unwrap();
        let socket = |kind: ErrorKind| ConnectError::Socket { address, cause: kind.into() };
        for (error, words) in [
            (socket(ErrorKind::ConnectionRefused), "nobody listens"),
            (socket(ErrorKind::TimedOut), "within 5 s"),
            (socket(ErrorKind::NetworkUnreachable), "no way"),
            (socket(ErrorKind::PermissionDenied), "permission denied"),
            (ConnectError::Refused(Code::ANOTHER_USER), "--monitor"),
            (ConnectError::Refused(Code::FIRMWARE_UPGRADE), "3002"),
            (ConnectError::NoGreeting { address }, "10001"),
            (ConnectError::Ended(EndReason::ByRobot), "closed the connection"),
        ] {
            let failure = failure(&error, address, Duration::from_secs(5));
            assert_eq!(failure.exit, Exit::Link);
            let text = failure.text();
            let (_, remedy) = text.split_once("Remedy: ").unwrap();
            assert!(remedy.len() > 10, "{text}");
            assert!(text.contains(words) && text.contains("192.168.0.100:10000"), "{text}");
        }
    }
}
