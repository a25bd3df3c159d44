//! What was seen on EtherNet/IP, for people and programs to read: `fieldarm probe enip:... --json` is one
//! [`EnipProbeReport`].
//!
//! The names of the fields are the names in the JSON. The meaning of a field changes only together
//! with [`SCHEMA_VERSION`]; new fields may appear at any time.

use core::net::SocketAddrV4;
use std::prelude::v1::*;

use serde::Serialize;

use super::observe::{Attempt, Held, Observation, is_meca500};
use crate::bus::enip::scanner::{ConfigPath, T2oType};
use crate::cli::enip::words;
use crate::cli::exit::Exit;
use crate::cli::probe::evidence::{ReportedOrder, order};
use crate::cli::probe::report::{ReportedIdentity, ReportedState, identity, state};
use crate::cli::report::{ReportedCounters, ReportedQuantiles};
use crate::link::enip::list_identity::{Found, Listing};
use crate::time::Duration;
use crate::wire::enip::identity::Identity;

/// Version of the meaning of the fields.
const SCHEMA_VERSION: u32 = 1;
/// Bit of the identity object's status: an owner is connected.
///
/// Source: CIP volume 1, identity object.
const OWNED: u16 = 1;

/// Devices on EtherNet/IP, and one of them closely.
#[derive(Clone, Debug, Serialize)]
pub(super) struct EnipProbeReport {
    /// Always `fieldarm.probe.enip`.
    schema: &'static str,
    schema_version: u32,
    fieldarm_version: &'static str,
    /// What was looked at, as it was given.
    pub(super) target: String,
    /// The code that the command exits with.
    exit_code: u8,
    pub(super) devices: Vec<ReportedDevice>,
    /// `null` after a broadcast, and when the device is no Meca500.
    pub(super) robot: Option<ReportedRobot>,
    pub(super) notes: Vec<String>,
}

/// A device that told who it is.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ReportedDevice {
    /// Where it is reached from here, with the port.
    pub(super) address: String,
    /// Where it says it is reached; `null` when it was not asked by ListIdentity.
    pub(super) told_address: Option<String>,
    pub(super) vendor: u16,
    pub(super) device_type: u16,
    pub(super) product_code: u16,
    /// Major and minor.
    pub(super) revision: String,
    /// Status word of the identity object.
    pub(super) status: u16,
    pub(super) serial: u32,
    pub(super) name: String,
    /// State of the identity object, 3 is operational; `null` when it was not asked by ListIdentity.
    pub(super) state: Option<u8>,
    pub(super) is_meca500: bool,
    /// Whether it says that an owner is connected.
    pub(super) owned: bool,
}

/// A robot that was looked at.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ReportedRobot {
    /// Whether it lets itself be watched and its byte order is known. Whether it lets itself be controlled
    /// is known only to who tries.
    pub(super) usable: bool,
    /// Why it is not usable, and what to do about it.
    pub(super) trouble: Option<String>,
    /// Whether it says that an owner is connected; `null` when it does not tell.
    pub(super) owned: Option<bool>,
    /// Connections that were tried, in this order.
    pub(super) connections: Vec<ReportedConnection>,
    /// `null` when none was accepted.
    pub(super) frames: Option<ReportedFrames>,
    /// `null` when no inputs came.
    pub(super) byte_order: Option<ReportedOrder>,
    /// Who it says it is in its dynamic data, as far as it showed them without being asked.
    pub(super) identity: ReportedIdentity,
    /// `null` while the byte order is open. Its `monitoring_mode` is that of a connection that only watches.
    pub(super) state: Option<ReportedState>,
    /// What the link noticed while the connection was held.
    pub(super) events: Vec<String>,
}

/// A connection that was tried.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ReportedConnection {
    /// `input-only` or `listen-only`.
    pub(super) kind: &'static str,
    /// Configuration assembly in the path; `null` without one.
    pub(super) config_assembly: Option<u32>,
    /// `unicast` or `multicast`.
    pub(super) t2o: &'static str,
    pub(super) accepted: bool,
    /// Intervals that it granted; `null` when it refused.
    pub(super) o2t_api_us: Option<f64>,
    pub(super) t2o_api_us: Option<f64>,
    /// Group that its inputs go to; `null` when they go to us alone.
    pub(super) multicast: Option<String>,
    /// Why it was not accepted, and what to do about it.
    pub(super) refusal: Option<String>,
}

/// The frames of the connection that was held.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ReportedFrames {
    /// Which of `connections` it was, from 1.
    pub(super) connection: usize,
    /// Interval that the robot granted.
    pub(super) api_us: f64,
    /// Between two frames from the robot, told apart by a millisecond; `null` when fewer than two came.
    pub(super) gap_us: Option<ReportedQuantiles>,
    /// Mean of these.
    pub(super) mean_gap_us: Option<f64>,
    pub(super) counters: ReportedCounters,
}

fn new(target: String, exit: Exit) -> EnipProbeReport {
    EnipProbeReport {
        schema: "fieldarm.probe.enip",
        schema_version: SCHEMA_VERSION,
        fieldarm_version: env!("CARGO_PKG_VERSION"),
        target,
        exit_code: exit as u8,
        devices: Vec::new(),
        robot: None,
        notes: Vec::new(),
    }
}

/// Who answered a broadcast, and how to exit.
pub(super) fn of_everybody(target: String, listing: &Listing) -> (EnipProbeReport, Exit) {
    let devices: Vec<_> = listing.found.iter().map(listed).collect();
    let has_robot = devices.iter().any(|device| device.is_meca500);
    let exit = if has_robot { Exit::Done } else { Exit::Link };
    let mut report = new(target, exit);
    if devices.is_empty() {
        report.notes.push(
            "nobody answers: check cables and power, and choose the interface with ?bind=ADDR, the address \
             of this machine on the robots' network; a firewall must let UDP 44818 pass"
                .into(),
        );
    } else if !has_robot {
        report.notes.push("none of the devices is a Meca500".into());
    }
    if listing.malformed > 0 {
        report.notes.push(format!("{} answers could not be read", listing.malformed));
    }
    report.devices = devices;
    (report, exit)
}

/// What was seen of one robot, and how to exit.
pub(super) fn of_one(target: String, seen: &Observation) -> (EnipProbeReport, Exit) {
    let device = match (seen.listed.as_ref().map(listed), &seen.identity) {
        (Some(device), _) => Some(device),
        (None, Ok(identity)) => Some(device(seen.address, identity)),
        (None, Err(_)) => None,
    };
    let is_robot = seen.identity().is_none_or(|identity| is_meca500(&identity));
    let robot = is_robot.then(|| robot(seen));
    let exit = match &robot {
        // What was seen in a shorter time may lack something.
        _ if seen.interrupted => Exit::Interrupted,
        Some(robot) if robot.usable => match &robot.state {
            Some(state) if state.error_code != 0 || !state.safety_signals.is_empty() => Exit::Robot,
            _ => Exit::Done,
        },
        _ => Exit::Link,
    };
    let mut report = new(target, exit);
    if seen.listed.is_none() {
        report
            .notes
            .push("does not answer ListIdentity over UDP; who it is was asked over TCP".into());
    }
    if !is_robot {
        report.notes.push("no Meca500: left alone".into());
    }
    if seen.interrupted {
        report.notes.push("interrupted: the figures are of a shorter time".into());
    }
    report.devices.extend(device);
    report.robot = robot;
    (report, exit)
}

fn listed(found: &Found) -> ReportedDevice {
    ReportedDevice {
        told_address: Some(found.listed.address.to_string()),
        state: Some(found.listed.state),
        ..device(found.from, &found.listed.identity)
    }
}

fn device(address: SocketAddrV4, identity: &Identity) -> ReportedDevice {
    ReportedDevice {
        address: address.to_string(),
        told_address: None,
        vendor: identity.vendor,
        device_type: identity.device_type,
        product_code: identity.product_code,
        revision: format!("{}.{}", identity.major, identity.minor),
        status: identity.status,
        serial: identity.serial,
        name: identity.name.to_string(),
        state: None,
        is_meca500: is_meca500(identity),
        owned: identity.status & OWNED != 0,
    }
}

fn robot(seen: &Observation) -> ReportedRobot {
    let held = seen.held.as_ref();
    let evidence = held.and_then(|held| held.evidence);
    let verdict = evidence.and_then(|evidence| evidence.verdict());
    let trouble = match (&seen.identity, held) {
        (Err(error), _) => Some(error.clone()),
        (Ok(_), None) if seen.interrupted => None,
        (Ok(_), None) => Some(
            "accepts no connection to watch it, neither input-only nor listen-only; `fieldarm run` may \
             control it nevertheless"
                .into(),
        ),
        (Ok(_), Some(held)) if held.fresh == 0 => Some(
            "accepts connections, but none of its inputs arrive: let UDP port 2222 through the firewall"
                .into(),
        ),
        (Ok(_), Some(_)) if verdict.is_none() => Some(
            "the byte order cannot be decided from what it sends: once its cause is known (a robot that is \
             still booting?), probe again, or give `fieldarm run` the --byte-order"
                .into(),
        ),
        (Ok(_), Some(_)) => None,
    };
    let inputs = held.and_then(|held| held.inputs);
    ReportedRobot {
        usable: trouble.is_none() && verdict.is_some(),
        trouble,
        owned: seen.identity().map(|identity| identity.status & OWNED != 0),
        connections: seen.attempts.iter().map(connection).collect(),
        frames: held.and_then(|held| frames(held, &seen.attempts)),
        byte_order: evidence.as_ref().map(order),
        identity: identity(held.into_iter().flat_map(|held| &held.dynamic)),
        state: inputs.zip(verdict).and_then(|(inputs, order)| state(&inputs, order)),
        events: held.map(|held| held.events.clone()).unwrap_or_default(),
    }
}

fn us(duration: Duration) -> f64 {
    duration.as_nanos() as f64 * 1e-3
}

fn connection(attempt: &Attempt) -> ReportedConnection {
    let opened = attempt.result.as_ref().ok();
    ReportedConnection {
        kind: words::kind(attempt.kind),
        config_assembly: match attempt.config {
            ConfigPath::Named(number) => Some(number),
            ConfigPath::None => None,
        },
        t2o: match attempt.t2o {
            T2oType::Unicast => "unicast",
            T2oType::Multicast => "multicast",
        },
        accepted: opened.is_some(),
        o2t_api_us: opened.map(|opened| us(opened.o2t_api)),
        t2o_api_us: opened.map(|opened| us(opened.t2o_api)),
        multicast: opened.and_then(|opened| opened.multicast).map(|group| group.to_string()),
        refusal: attempt.result.err().map(|error| words::refusal(error, 1)),
    }
}

fn frames(held: &Held, attempts: &[Attempt]) -> Option<ReportedFrames> {
    let opened = attempts.get(held.attempt)?.result.as_ref().ok()?;
    let gaps = &held.statistics.t2o_gap_ns;
    Some(ReportedFrames {
        connection: held.attempt + 1,
        api_us: us(opened.t2o_api),
        gap_us: (!gaps.is_empty()).then(|| ReportedQuantiles::of_ns(gaps)),
        mean_gap_us: (!gaps.is_empty()).then(|| gaps.mean() * 1e-3),
        counters: held.counters.into(),
    })
}
