//! Whether a Forward Open may be granted.
//!
//! Checks, in this order: that it is not open already (0100), transport (0103), key (0114 to 0116) and
//! path (0315, 0117, 0126, 0129 to 012B, 012F), types (0108, 0123, 0124), sizes (0127, 0128), intervals (0111),
//! ownership (0106, 0119), room (0113). Source: choice; the standard leaves the order open.
//!
//! A refusal because of the path tells how many of its words were left when it happened, the segment in
//! question included; other refusals tell 0. A refusal because of a size has the right size, sequence count
//! and header included, as second word of status. Source: choice for the words that are left.

use super::produce::Production;
use super::target::Target;
use super::{AdapterSettings, ConnectionKind};
use crate::time::Duration;
use crate::wire::enip::connection::{ForwardOpen, Transport};
use crate::wire::enip::identity::Identity;
use crate::wire::enip::parameters::{
    ConnectionType, NetworkParameters, RUN_IDLE_LEN, SEQUENCE_LEN,
};
use crate::wire::enip::path::{ASSEMBLY, ElectronicKey, Segment, segments};
use crate::wire::enip::status::ExtendedStatus;

/// Configuration data of another size than the assembly's; it has none.
///
/// Source: CIP volume 1, chapter 3.
const CONFIGURATION_SIZE: ExtendedStatus = ExtendedStatus(0x0126);

/// What is to be opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Plan {
    pub(super) kind: ConnectionKind,
    pub(super) o2t_api: Duration,
    /// As requested and rounded; a group that exists already may be faster.
    pub(super) t2o_api: Duration,
    pub(super) has_o2t: bool,
    pub(super) is_multicast: bool,
    /// The production of a group to be joined.
    pub(super) joined: Option<usize>,
}

/// Why not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Refused {
    pub(super) status: ExtendedStatus,
    /// The right size, in bytes.
    pub(super) size: Option<u16>,
    pub(super) remaining_words: u8,
}

impl Refused {
    pub(super) const fn new(status: ExtendedStatus) -> Self {
        Self { status, size: None, remaining_words: 0 }
    }

    fn path(status: ExtendedStatus, remaining_words: usize) -> Self {
        let remaining_words = u8::try_from(remaining_words).unwrap_or(u8::MAX);
        Self { remaining_words, ..Self::new(status) }
    }

    const fn size(status: ExtendedStatus, size: u16) -> Self {
        Self { size: Some(size), ..Self::new(status) }
    }
}

/// Checks `open` against what the adapter offers and what is open already.
pub(super) fn check(open: &ForwardOpen<'_>, target: &Target) -> Result<Plan, Refused> {
    let settings = &target.settings;
    if target.connections.iter().any(|other| other.triad == open.triad) {
        return Err(Refused::new(ExtendedStatus::IN_USE));
    }
    check_transport(open.transport)?;
    let kind = check_path(open.path, settings)?;
    let has_o2t = check_types(kind, open)?;
    check_sizes(kind, has_o2t, open, settings)?;
    let o2t_api = match has_o2t {
        true => interval(open.o2t_rpi_us, settings)?,
        false => Duration::from_micros(u64::from(open.o2t_rpi_us)),
    };
    let t2o_api = interval(open.t2o_rpi_us, settings)?;
    let is_multicast = open.t2o.connection_type == ConnectionType::Multicast;
    let plan = Plan { kind, o2t_api, t2o_api, has_o2t, is_multicast, joined: None };
    check_ownership(plan, target)?;
    let joined = if is_multicast { group_to_join(plan, target)? } else { None };
    let has_group = !is_multicast || joined.is_some() || target.productions.free_group().is_some();
    if !target.connections.has_room() || !has_group {
        return Err(Refused::new(ExtendedStatus::OUT_OF_CONNECTIONS));
    }
    Ok(Plan { joined, ..plan })
}

/// Class 1, produced cyclically. The direction bit means nothing there.
fn check_transport(transport: Transport) -> Result<(), Refused> {
    let wanted = Transport::CLASS_1_CYCLIC;
    if (transport.class(), transport.trigger()) == (wanted.class(), wanted.trigger()) {
        Ok(())
    } else {
        Err(Refused::new(ExtendedStatus::TRANSPORT_NOT_SUPPORTED))
    }
}

/// An instance or connection point, and the words of the path that are left where it stands.
type Point = (u32, usize);

/// Reads the path: perhaps a key, class 4, perhaps the configuration, O->T point, T->O point, perhaps
/// an empty data segment. What it opens.
fn check_path(path: &[u8], settings: &AdapterSettings) -> Result<ConnectionKind, Refused> {
    let mut left = segments(path);
    let mut has_class = false;
    let mut is_first = true;
    let mut points: [Option<Point>; 3] = [None; 3];
    loop {
        let words = left.rest().len() / 2;
        let Some(segment) = left.next() else { break };
        let invalid = Refused::path(ExtendedStatus::INVALID_SEGMENT, words);
        match segment.map_err(|_| invalid)? {
            Segment::Key(key) if is_first => {
                check_key(key, &settings.identity)
                    .map_err(|status| Refused::path(status, words))?;
            }
            Segment::Class(ASSEMBLY) if !has_class => has_class = true,
            Segment::Class(_) if !has_class => {
                return Err(Refused::path(ExtendedStatus::INVALID_APPLICATION_PATH, words));
            }
            Segment::Instance(number) | Segment::ConnectionPoint(number) if has_class => {
                let place = points.iter_mut().find(|place| place.is_none());
                let too_many = Refused::path(ExtendedStatus::INVALID_APPLICATION_PATH, words);
                *place.ok_or(too_many)? = Some((number, words));
            }
            Segment::ProductionInhibit(_) => {}
            Segment::Data([]) if has_class => {}
            Segment::Data(_) if has_class => {
                let refused = Refused::path(CONFIGURATION_SIZE, words);
                return Err(Refused { size: Some(0), ..refused });
            }
            _ => return Err(invalid),
        }
        is_first = false;
    }
    let (config, o2t, t2o) = match points {
        [Some(o2t), Some(t2o), None] => (None, o2t, t2o),
        [config @ Some(_), Some(o2t), Some(t2o)] => (config, o2t, t2o),
        _ => return Err(Refused::path(ExtendedStatus::INVALID_APPLICATION_PATH, 0)),
    };
    check_points(config, o2t, t2o, settings)
}

fn check_points(
    config: Option<Point>,
    (o2t, o2t_words): Point,
    (t2o, t2o_words): Point,
    settings: &AdapterSettings,
) -> Result<ConnectionKind, Refused> {
    if let (Some((number, words)), Some(known)) = (config, settings.config_assembly)
        && number != known
    {
        return Err(Refused::path(ExtendedStatus::INVALID_CONFIGURATION_PATH, words));
    }
    let kind = kind_of(o2t, settings);
    let is_known_o2t = kind.is_some() || o2t == settings.input_assembly;
    let is_known_t2o = t2o == settings.input_assembly || kind_of(t2o, settings).is_some();
    match kind {
        _ if !is_known_o2t => Err(Refused::path(ExtendedStatus::INVALID_CONSUMING_PATH, o2t_words)),
        _ if !is_known_t2o => Err(Refused::path(ExtendedStatus::INVALID_PRODUCING_PATH, t2o_words)),
        Some(kind) if t2o == settings.input_assembly => Ok(kind),
        _ => Err(Refused::path(ExtendedStatus::INCONSISTENT_PATH, o2t_words)),
    }
}

/// What an O->T point is for.
pub(super) fn kind_of(point: u32, settings: &AdapterSettings) -> Option<ConnectionKind> {
    match point {
        _ if point == settings.output_assembly => Some(ConnectionKind::ExclusiveOwner),
        _ if point == settings.input_only_point => Some(ConnectionKind::InputOnly),
        _ if point == settings.listen_only_point => Some(ConnectionKind::ListenOnly),
        _ => None,
    }
}

/// Zeros fit everything; a major revision of 0 makes the minor one fit too. Otherwise all must be equal,
/// except that with the compatibility bit an older minor revision will do: a newer firmware can stand in
/// for an older one.
///
/// Source: CIP volume 1, appendix C.
fn check_key(key: ElectronicKey, identity: &Identity) -> Result<(), ExtendedStatus> {
    let fits = |wanted: u16, found: u16| wanted == 0 || wanted == found;
    if !fits(key.vendor, identity.vendor) || !fits(key.product_code, identity.product_code) {
        return Err(ExtendedStatus::VENDOR_OR_PRODUCT_MISMATCH);
    }
    if !fits(key.device_type, identity.device_type) {
        return Err(ExtendedStatus::DEVICE_TYPE_MISMATCH);
    }
    let is_minor_fine = match key.is_compatible {
        true => key.minor <= identity.minor,
        false => fits(key.minor.into(), identity.minor.into()),
    };
    if key.major == 0 || (key.major == identity.major && is_minor_fine) {
        Ok(())
    } else {
        Err(ExtendedStatus::REVISION_MISMATCH)
    }
}

/// Whether O->T frames are agreed on.
fn check_types(kind: ConnectionKind, open: &ForwardOpen<'_>) -> Result<bool, Refused> {
    if open.o2t.is_redundant_owner || open.t2o.is_redundant_owner {
        return Err(Refused::new(ExtendedStatus::INVALID_PARAMETERS));
    }
    let has_o2t = match (open.o2t.connection_type, kind) {
        (ConnectionType::PointToPoint, _) => true,
        (ConnectionType::Null, ConnectionKind::InputOnly | ConnectionKind::ListenOnly) => false,
        _ => return Err(Refused::new(ExtendedStatus::O2T_TYPE)),
    };
    match open.t2o.connection_type {
        ConnectionType::PointToPoint | ConnectionType::Multicast => Ok(has_o2t),
        ConnectionType::Null | ConnectionType::Reserved => {
            Err(Refused::new(ExtendedStatus::T2O_TYPE))
        }
    }
}

/// Sizes are those of the assemblies, also where frames may be shorter; the size of a direction without
/// frames means nothing.
fn check_sizes(
    kind: ConnectionKind,
    has_o2t: bool,
    open: &ForwardOpen<'_>,
    settings: &AdapterSettings,
) -> Result<(), Refused> {
    let o2t_size = match kind {
        ConnectionKind::ExclusiveOwner => SEQUENCE_LEN + RUN_IDLE_LEN + settings.output_len,
        ConnectionKind::InputOnly | ConnectionKind::ListenOnly => SEQUENCE_LEN,
    };
    let t2o_size = SEQUENCE_LEN + settings.input_len;
    let is_wrong = |given: NetworkParameters, right: u16| given.size != right;
    if has_o2t && is_wrong(open.o2t, o2t_size) {
        return Err(Refused::size(ExtendedStatus::O2T_SIZE, o2t_size));
    }
    if is_wrong(open.t2o, t2o_size) {
        return Err(Refused::size(ExtendedStatus::T2O_SIZE, t2o_size));
    }
    Ok(())
}

/// The interval that holds when `rpi_us` is requested.
fn interval(rpi_us: u32, settings: &AdapterSettings) -> Result<Duration, Refused> {
    let refused = Refused::new(ExtendedStatus::RPI_NOT_SUPPORTED);
    let rpi = Duration::from_micros(u64::from(rpi_us));
    if rpi.is_zero() || rpi < settings.min_rpi || rpi > settings.max_rpi {
        return Err(refused);
    }
    let step = u64::try_from(settings.rpi_step.as_micros()).unwrap_or(u64::MAX).max(1);
    let api = u64::from(rpi_us).div_ceil(step).saturating_mul(step);
    // What is told as the API must fit its field.
    let api = u32::try_from(api).map_err(|_| refused)?;
    Ok(Duration::from_micros(u64::from(api)))
}

fn check_ownership(plan: Plan, target: &Target) -> Result<(), Refused> {
    let is_denied = match plan.kind {
        ConnectionKind::ExclusiveOwner => {
            target.access != super::Access::Full
                || target.is_controlled_elsewhere
                || target.connections.owner().is_some()
        }
        ConnectionKind::InputOnly | ConnectionKind::ListenOnly => false,
    };
    if is_denied {
        return Err(Refused::new(ExtendedStatus::OWNERSHIP_CONFLICT));
    }
    let is_heard = target.connections.iter().any(|other| other.is_listened_to());
    match plan.kind {
        ConnectionKind::ListenOnly if !is_heard => Err(Refused::new(ExtendedStatus::NO_OWNER)),
        _ => Ok(()),
    }
}

/// The group that suits best: the slowest one that is fast enough. Who only listens takes the fastest if
/// none is; others get a group of their own then.
fn group_to_join(plan: Plan, target: &Target) -> Result<Option<usize>, Refused> {
    let groups = || target.productions.multicast();
    let by_interval = |(_, one): &(usize, &Production)| one.api;
    let suits = |(_, one): &(usize, &Production)| one.api <= plan.t2o_api;
    let best = groups().filter(suits).max_by_key(by_interval);
    let place = |(place, _): (usize, &Production)| place;
    match plan.kind {
        ConnectionKind::ListenOnly => {
            let found = best.or_else(|| groups().min_by_key(by_interval)).map(place);
            found.map(Some).ok_or(Refused::new(ExtendedStatus::NO_OWNER))
        }
        ConnectionKind::ExclusiveOwner | ConnectionKind::InputOnly => Ok(best.map(place)),
    }
}
