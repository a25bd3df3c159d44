//! Looking at a robot on EtherNet/IP without controlling it.
//!
//! ```text
//!  ListIdentity, identity over TCP --> each kind of connection opened and closed --> one held for a while
//! ```
//!
//! Invariants: never an owner's connection, so that nothing moves and no owner is kept out; a device that is
//! no Meca500 is left alone.

use core::net::SocketAddrV4;
use core::sync::atomic::{AtomicBool, Ordering};
use std::prelude::v1::*;

use crate::bus::enip::ConnectionKind;
use crate::bus::enip::scanner::{ConfigPath, ConnectionSettings, T2oType, TargetCounters};
use crate::cli::enip::connect::{Opened, connection, open_sockets, start};
use crate::cli::enip::link_name::EnipOptions;
use crate::cli::enip::words;
use crate::cli::exit::Failure;
use crate::cli::probe::observe::{ASKED, read};
use crate::cli::run_program::set_nothing_moves;
use crate::cycle::CyclicSegment;
use crate::engine::meca500::{OrderEvidence, OrderProbe};
use crate::link::clock::MonotonicClock;
use crate::link::enip::explicit::ExplicitClient;
use crate::link::enip::list_identity::{Found, list_identity};
use crate::link::enip::sockets::SocketNetwork;
use crate::link::enip::{EnipError, EnipSegment, EnipStatistics};
use crate::time::Duration;
use crate::wire::enip::identity::Identity;
use crate::wire::meca500::adapter::{CONFIG_ASSEMBLY, IDENTITY};
use crate::wire::meca500::dynamic::{DynamicType, DynamicValue};
use crate::wire::meca500::image::INPUT_LEN;

/// How long the robot may take for each thing that is asked of it.
const PATIENCE: Duration = Duration::from_secs(2);
/// Time between two looks at the sockets: how exactly gaps are known.
const LOOK: Duration = Duration::from_millis(1);

/// How to look.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plan {
    pub(super) address: SocketAddrV4,
    pub(super) options: EnipOptions,
    /// Frames to look at.
    pub(super) frames: u32,
}

/// What there is to see.
#[derive(Debug)]
pub(super) struct Observation {
    pub(super) address: SocketAddrV4,
    /// What it answered to ListIdentity.
    pub(super) listed: Option<Found>,
    /// What its identity object says, or why it could not be asked.
    pub(super) identity: Result<Identity, String>,
    /// Connections that were tried.
    pub(super) attempts: Vec<Attempt>,
    /// What came over the one that was held.
    pub(super) held: Option<Held>,
    pub(super) interrupted: bool,
}

impl Observation {
    /// Who it is, as far as it told.
    pub(super) fn identity(&self) -> Option<Identity> {
        self.identity.as_ref().ok().copied().or(self.listed.map(|found| found.listed.identity))
    }
}

/// Whether this is the identity of a Meca500, whatever its firmware.
pub(super) fn is_meca500(identity: &Identity) -> bool {
    (identity.vendor, identity.product_code) == (IDENTITY.vendor, IDENTITY.product_code)
}

/// A connection that was tried.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attempt {
    pub(super) kind: ConnectionKind,
    pub(super) config: ConfigPath,
    pub(super) t2o: T2oType,
    pub(super) result: Result<Opened, EnipError>,
}

/// What came over a connection.
#[derive(Debug)]
pub(super) struct Held {
    /// Which of the attempts it is like.
    pub(super) attempt: usize,
    pub(super) statistics: EnipStatistics,
    pub(super) counters: TargetCounters,
    /// Looks that brought new inputs.
    pub(super) fresh: u32,
    pub(super) evidence: Option<OrderEvidence>,
    /// The newest inputs.
    pub(super) inputs: Option<[u8; INPUT_LEN]>,
    /// Dynamic data about who it is, as far as they came by themselves.
    pub(super) dynamic: Vec<DynamicValue>,
    pub(super) events: Vec<String>,
}

/// Looks at the robot of `plan`, until done or `interrupted`.
///
/// # Errors
///
/// Nobody answers there, or there are no sockets to ask with.
pub(super) fn observe(plan: &Plan, interrupted: &AtomicBool) -> Result<Observation, Failure> {
    let (address, bind) = (plan.address, plan.options.bind);
    let listing = list_identity(bind, address, PATIENCE).ok();
    let listed = listing.and_then(|listing| listing.found.first().copied());
    let client = ExplicitClient::connect(bind, address, PATIENCE);
    let identity =
        client.and_then(|mut client| client.identity()).map_err(|error| error.to_string());
    let mut seen = Observation {
        address,
        listed,
        identity,
        attempts: Vec::new(),
        held: None,
        interrupted: false,
    };
    let is_other = seen.identity().is_some_and(|identity| !is_meca500(&identity));
    match &seen.identity {
        Err(error) if listed.is_none() => return Err(Failure::link(error.clone())),
        Err(_) => return Ok(seen),
        Ok(_) if is_other => return Ok(seen),
        Ok(_) => {}
    }
    set_nothing_moves(false);
    let mut network = open_sockets(&plan.options, &[address])?;
    for connection in connections(&plan.options) {
        if interrupted.load(Ordering::Relaxed) {
            seen.interrupted = true;
            return Ok(seen);
        }
        let result;
        (result, network) = match start(network, &[address], connection, LOOK, PATIENCE) {
            Ok((segment, opened)) => {
                let opened = opened.first().copied();
                (opened.ok_or(EnipError::NotConnected { target: 0, address }), segment.close())
            }
            Err((error, network)) => (Err(error), network),
        };
        let ConnectionSettings { kind, config, t2o_type: t2o, .. } = connection;
        seen.attempts.push(Attempt { kind, config, t2o, result });
    }
    let Some(best) = seen.attempts.iter().position(|attempt| attempt.result.is_ok()) else {
        return Ok(seen);
    };
    let Some(connection) = connections(&plan.options).nth(best) else { return Ok(seen) };
    if let Ok((segment, _)) = start(network, &[address], connection, LOOK, PATIENCE) {
        let mut held = hold(segment, plan, interrupted, &mut seen.interrupted);
        held.attempt = best;
        seen.held = Some(held);
    }
    Ok(seen)
}

/// The connections to try, the best for watching first: none of them carries outputs.
fn connections(options: &EnipOptions) -> impl Iterator<Item = ConnectionSettings> + use<> {
    let base = ConnectionSettings {
        tries_other_config: false,
        // Once is enough.
        first_retry: 2 * PATIENCE,
        longest_retry: 2 * PATIENCE,
        ..connection(options)
    };
    let configs = match options.config {
        Some(config) => vec![config],
        None => vec![ConfigPath::Named(CONFIG_ASSEMBLY), ConfigPath::None],
    };
    let with = move |config| ConnectionSettings { config, ..base };
    let input_only: Vec<_> = [T2oType::Unicast, T2oType::Multicast]
        .into_iter()
        .flat_map(|t2o_type| {
            configs
                .iter()
                .map(move |config| ConnectionSettings { t2o_type, ..with(*config).input_only() })
        })
        .collect();
    let listen_only = configs.first().map(|config| with(*config).listen_only());
    input_only.into_iter().chain(listen_only)
}

/// Takes in what the robot sends for as many frames as planned, then closes the connection.
fn hold(
    mut segment: EnipSegment<SocketNetwork>,
    plan: &Plan,
    interrupted: &AtomicBool,
    was_interrupted: &mut bool,
) -> Held {
    let mut held = Held {
        attempt: 0,
        statistics: segment.statistics().clone(),
        counters: TargetCounters::default(),
        fresh: 0,
        evidence: None,
        inputs: None,
        dynamic: Vec::new(),
        events: Vec::new(),
    };
    let mut probe = OrderProbe::new();
    let interval = segment.status(0).map_or(plan.options.rpi, |status| status.t2o_api);
    let clock = MonotonicClock::new();
    let mut now = clock.now();
    let end = now + interval * plan.frames;
    let mut due = now;
    while now < end {
        if interrupted.load(Ordering::Relaxed) {
            *was_interrupted = true;
            break;
        }
        if let Err(error) = segment.exchange(now) {
            held.events.push(error.to_string());
            break;
        }
        let mut inputs = [0; INPUT_LEN];
        if segment.read_inputs(0, &mut inputs).is_fresh() {
            held.fresh += 1;
            // Of the right length by its type.
            let _ = probe.see(&inputs);
            held.inputs = Some(inputs);
            held.take_dynamic(&probe, &inputs);
        }
        while let Some(event) = segment.poll_event() {
            held.events.extend(words::scanner_event(&event));
        }
        due = (due + LOOK).max(now);
        now = clock.sleep_until(due);
    }
    held.evidence = probe.evidence();
    held.statistics = segment.statistics().clone();
    held.counters = segment.status(0).map(|status| status.counters).unwrap_or_default();
    segment.close();
    held
}

impl Held {
    /// Keeps what says who the robot is, if a slot shows it.
    fn take_dynamic(&mut self, probe: &OrderProbe, inputs: &[u8; INPUT_LEN]) {
        let Some(values) = probe.verdict().and_then(|order| read(inputs, order)) else { return };
        for slot in values.dynamic_data {
            let ty = DynamicType(slot.dynamic_type);
            let is_known = self.dynamic.iter().any(|known| known.dynamic_type() == ty);
            if ASKED.contains(&ty) && !is_known {
                self.dynamic.push(DynamicValue::from_values(ty, slot.value_idx));
            }
        }
    }
}
