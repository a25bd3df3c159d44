//! `fieldarm probe enip:...`: who is on EtherNet/IP, and what one robot accepts and sends.
//!
//! Read `observe.rs` first: what is done on the wire. `report.rs` says what it means, `text.rs`
//! writes it for people.

mod observe;
mod report;
mod text;

use core::net::{Ipv4Addr, SocketAddrV4};
use std::prelude::v1::*;

use super::ProbeArgs;
use crate::cli::enip::connect::look_up;
use crate::cli::enip::link_name::EnipName;
use crate::cli::exit::{Exit, Failure};
use crate::cli::grid::{pretty, print};
use crate::cli::run_program::{catch_interrupts, set_nothing_moves};
use crate::link::enip::list_identity::list_identity;
use crate::time::Duration;
use crate::wire::enip::MESSAGE_PORT;
use observe::{Plan, observe};
use report::{EnipProbeReport, of_everybody, of_one};

/// How long answers to a broadcast are waited for.
const LISTEN: Duration = Duration::from_secs(2);
/// Broadcast address of the loopback interface.
const LOOPBACK_BROADCAST: Ipv4Addr = Ipv4Addr::new(127, 255, 255, 255);

/// Everybody that a broadcast reaches.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Everybody {
    /// Local address to ask from; chooses the interface.
    bind: Option<Ipv4Addr>,
    /// Where to ask.
    to: Ipv4Addr,
    /// As it was given.
    text: String,
}

impl Everybody {
    /// Reads `enip:broadcast[?bind=ADDR&to=ADDR]`; `None` if it is something else.
    pub(super) fn parse(text: &str) -> Option<Result<Self, String>> {
        let query = text.strip_prefix("enip:broadcast")?;
        let query = match query.strip_prefix('?') {
            Some(query) => query,
            None if query.is_empty() => "",
            None => return None,
        };
        Some(Self::with_query(text, query))
    }

    fn with_query(text: &str, query: &str) -> Result<Self, String> {
        let (mut bind, mut to) = (None, None);
        for (key, value) in form_urlencoded::parse(query.as_bytes()) {
            let place = match &*key {
                "bind" => &mut bind,
                "to" => &mut to,
                _ => {
                    return Err(format!(
                        "`{key}` is no option of a broadcast; there are bind and to"
                    ));
                }
            };
            let address = value.parse::<Ipv4Addr>().map_err(|_| {
                format!("{key}=`{value}`: an IPv4 address, for `to` that of everybody on a network")
            })?;
            if place.replace(address).is_some() {
                return Err(format!("`{key}` is given twice"));
            }
        }
        let to = to.unwrap_or(match bind {
            Some(bind) if bind.is_loopback() => LOOPBACK_BROADCAST,
            _ => Ipv4Addr::BROADCAST,
        });
        Ok(Self { bind, to, text: text.into() })
    }
}

/// Lists who answers a broadcast.
pub(super) fn run_everybody(args: &ProbeArgs, everybody: &Everybody) -> Result<Exit, Failure> {
    let Everybody { bind, to, text } = everybody;
    let listing = list_identity(*bind, SocketAddrV4::new(*to, MESSAGE_PORT), LISTEN);
    let listing = listing.map_err(|error| {
        Failure::link(format!(
            "{text}: cannot ask at {to}: {error}; choose the interface with ?bind=ADDR, the address of \
             this machine on the robots' network"
        ))
    })?;
    let (report, exit) = of_everybody(text.clone(), &listing);
    tell(args, &report)?;
    Ok(exit)
}

/// Looks at one robot.
pub(super) fn run_one(args: &ProbeArgs, name: &EnipName) -> Result<Exit, Failure> {
    let [address] = look_up(&name.hosts)?[..] else {
        return Err(Failure::usage(format!(
            "{name}: probe looks at one robot at a time; `enip:broadcast` lists all"
        )));
    };
    let interrupted = catch_interrupts()?;
    // Until it is known who is there nothing is connected: whoever interrupts need not wait for a silent device.
    set_nothing_moves(true);
    let plan = Plan { address, options: name.options, frames: args.cycles.unwrap_or(FRAMES) };
    let seen = observe(&plan, &interrupted).map_err(|failure| Failure {
        message: format!("{name}: {}", failure.message),
        ..failure
    })?;
    let (report, exit) = of_one(name.to_string(), &seen);
    tell(args, &report)?;
    Ok(exit)
}

/// Frames to look at where nobody says how many.
const FRAMES: u32 = 300;

fn tell(args: &ProbeArgs, report: &EnipProbeReport) -> Result<(), Failure> {
    if !args.json {
        return print(&text::text(report));
    }
    let value = serde_json::to_value(report);
    print(&pretty(&value.map_err(|error| Failure::internal(error.to_string()))?)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_broadcast_goes_where_it_is_sent_to() {
        let parse =
            |text: &str| Everybody::parse(text).map(|parsed| parsed.map(|it| (it.bind, it.to)));
        let local = Ipv4Addr::new(10, 0, 0, 7);
        let cases = [
            ("enip:broadcast", None, Ipv4Addr::BROADCAST),
            ("enip:broadcast?bind=10.0.0.7", Some(local), Ipv4Addr::BROADCAST),
            ("enip:broadcast?to=10.0.0.255", None, Ipv4Addr::new(10, 0, 0, 255)),
            ("enip:broadcast?bind=127.0.0.1", Some(Ipv4Addr::LOCALHOST), LOOPBACK_BROADCAST),
        ];
        for (text, bind, to) in cases {
            assert_eq!(parse(text), Some(Ok((bind, to))), "{text}");
        }
        assert_eq!(parse("enip:broadcaster"), None, "the name of a host");
        let cases = [
            (
                "enip:broadcast?rpi_ms=1",
                "`rpi_ms` is no option of a broadcast; there are bind and to",
            ),
            ("enip:broadcast?to=eth0", "to=`eth0`: an IPv4 address"),
            ("enip:broadcast?to=1.2.3.4&to=1.2.3.5", "`to` is given twice"),
        ];
        for (text, message) in cases {
            let error = parse(text).expect(text).expect_err(text);
            assert!(error.contains(message), "{text}: {error}");
        }
    }
}
