//! What was seen on a segment, for people and programs to read: `fieldarm probe --json` is one
//! [`ProbeReport`].
//!
//! The names of the fields are the names in the JSON. The meaning of a field changes only together
//! with [`SCHEMA_VERSION`]; new fields may appear at any time.

use std::prelude::v1::*;

use serde::Serialize;

use super::evidence::{ReportedOrder, order};
use super::observe::{Exchanged, Observation, RobotObserved, read};
use crate::cli::exit::Exit;
use crate::link::ethercat::layout::{Direction, Layout, MappingEntry};
use crate::link::ethercat::{EthercatError, MappingFound, SubDeviceFound};
use crate::time::Duration;
use crate::wire::ethercat::al::AlStatusCode;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::dynamic::{DynamicValue, DynamicView, Eoat, ExternalTool, ProductType};
use crate::wire::meca500::image::{
    FieldType, FieldValue, FirmwareLayout, INPUT_FIELDS, INPUT_LEN, OUTPUT_FIELDS, Support,
};
use crate::wire::order::ByteOrder;

/// Version of the meaning of the fields.
const SCHEMA_VERSION: u32 = 1;

/// A segment.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ProbeReport {
    /// Always `fieldarm.probe`.
    pub(super) schema: &'static str,
    pub(super) schema_version: u32,
    pub(super) fieldarm_version: &'static str,
    /// What was looked at, as it was given.
    pub(super) target: String,
    /// The code that the command exits with.
    pub(super) exit_code: u8,
    pub(super) subdevices: Vec<ReportedSubDevice>,
    pub(super) robots: Vec<ReportedRobot>,
    /// `null` when no robot could be cycled.
    pub(super) exchange: Option<ReportedExchange>,
    pub(super) notes: Vec<String>,
}

/// Anything on the segment.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ReportedSubDevice {
    pub(super) position: u16,
    pub(super) name: String,
    pub(super) vendor: u32,
    pub(super) product: u32,
    pub(super) revision: u32,
    pub(super) serial: u32,
    /// 0 is none.
    pub(super) alias: u16,
    /// The AL state before anything was touched; `null` for one that does not exist.
    pub(super) found_in: Option<String>,
    pub(super) has_clock: bool,
    pub(super) is_meca500: bool,
    /// Number among `robots`, from 1; `null` for what was not looked at more closely.
    pub(super) robot: Option<usize>,
}

/// A robot that was looked at.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ReportedRobot {
    /// From 1.
    pub(super) robot: usize,
    pub(super) position: u16,
    /// Whether `fieldarm run` can drive it as it is on the wire; its own state is in `state`.
    pub(super) usable: bool,
    /// Why it is not usable, and what to do about it.
    pub(super) trouble: Option<String>,
    pub(super) outputs: ReportedLayout,
    pub(super) inputs: ReportedLayout,
    /// Exchanges that brought new inputs.
    pub(super) fresh_inputs: u32,
    /// `null` when it was not cycled.
    pub(super) byte_order: Option<ReportedOrder>,
    pub(super) identity: ReportedIdentity,
    /// `null` while the byte order is open.
    pub(super) state: Option<ReportedState>,
    /// What the link noticed while it was cycled.
    pub(super) events: Vec<String>,
}

/// One image of a robot.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ReportedLayout {
    /// `equal`, `by name`, `refused`, or `unread` when the robot did not tell.
    pub(super) verdict: &'static str,
    /// Length of the robot's process data; `null` when unread.
    pub(super) bytes: Option<usize>,
    /// Length of our image.
    pub(super) expected_bytes: usize,
    /// Which firmware's image it is; `null` unless it can be used.
    pub(super) firmware: Option<&'static str>,
    /// Objects of our table that are not mapped; their fields read as 0.
    pub(super) missing: Vec<String>,
    /// What is mapped and not in our table; it is passed over.
    pub(super) foreign: Vec<String>,
    /// What makes it unusable.
    pub(super) difference: Option<String>,
}

/// Who the robot says it is in its dynamic data; each `null` when it did not come.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct ReportedIdentity {
    /// Major, minor, patch and build.
    pub(super) firmware: Option<String>,
    pub(super) product: Option<String>,
    pub(super) serial: Option<u32>,
    pub(super) tool: Option<String>,
}

/// RobotStatus and SafetyStatus.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ReportedState {
    pub(super) busy: bool,
    pub(super) activated: bool,
    pub(super) homed: bool,
    pub(super) sim_activated: bool,
    pub(super) brakes_engaged: bool,
    pub(super) recovery_mode: bool,
    pub(super) collision: bool,
    pub(super) work_zone_breach: bool,
    /// This connection may only watch: somebody else controls the robot.
    pub(super) monitoring_mode: bool,
    pub(super) motors_powered: bool,
    pub(super) error_code: u16,
    pub(super) error_text: Option<&'static str>,
    pub(super) error_remedy: Option<&'static str>,
    /// Safety signals that are present or still to be reset, by the manual's names.
    pub(super) safety_signals: Vec<&'static str>,
    /// Those that may be reset now.
    pub(super) resettable: Vec<&'static str>,
    pub(super) fifo_space: u16,
    pub(super) move_id: u16,
}

/// The exchanges with all robots that were cycled.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ReportedExchange {
    pub(super) robots: usize,
    pub(super) cycle_us: u64,
    pub(super) count: u64,
    /// Of the last exchange whose frames all came back: 3 for each robot.
    pub(super) working_counter_expected: u16,
    pub(super) working_counter_found: Option<u16>,
    /// Robots and exchanges in which it did not add up.
    pub(super) wrong_working_counter: u64,
    pub(super) latency_us: ReportedLatency,
    /// Exchanges in which a frame did not come back in time: lost, or late.
    pub(super) lost: u64,
    /// How long an exchange waited for its frames.
    pub(super) reply_limit_us: u64,
    /// Frames that answered nothing: late, twice, mangled, or somebody else's.
    pub(super) stray: u64,
    /// Exchanges that began more than half a cycle late.
    pub(super) late: u64,
    /// `null` without distributed clocks.
    pub(super) clock: Option<ReportedClock>,
}

/// From sending the first frame to having all answers.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ReportedLatency {
    pub(super) p50: f64,
    pub(super) p99: f64,
    pub(super) max: f64,
}

/// The segment's clock against ours.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ReportedClock {
    pub(super) drift_ppm: f64,
    pub(super) phase_error_ns: i64,
    pub(super) worst_phase_error_ns: i64,
}

/// `seen` as a report, and how to exit.
pub(super) fn report(target: String, seen: &Observation, writes: bool) -> (ProbeReport, Exit) {
    let subdevices: Vec<_> = seen.subdevices.iter().map(subdevice).collect();
    let robots: Vec<_> =
        seen.robots.iter().zip(1..).map(|(seen, robot)| self::robot(robot, seen, writes)).collect();
    let exit = match () {
        // What was seen in a shorter time may lack something.
        () if seen.interrupted => Exit::Interrupted,
        () if robots.is_empty() || robots.iter().any(|robot| !robot.usable) => Exit::Link,
        () if robots.iter().filter_map(|robot| robot.state.as_ref()).any(is_in_trouble) => {
            Exit::Robot
        }
        () => Exit::Done,
    };
    let report = ProbeReport {
        schema: "fieldarm.probe",
        schema_version: SCHEMA_VERSION,
        fieldarm_version: env!("CARGO_PKG_VERSION"),
        target,
        exit_code: exit as u8,
        notes: notes(seen, &subdevices),
        subdevices,
        robots,
        exchange: seen.exchange.as_ref().map(exchange),
    };
    (report, exit)
}

/// Whether the robot itself keeps from being driven.
fn is_in_trouble(state: &ReportedState) -> bool {
    state.error_code != 0 || !state.safety_signals.is_empty() || state.monitoring_mode
}

fn notes(seen: &Observation, subdevices: &[ReportedSubDevice]) -> Vec<String> {
    let mut notes = Vec::new();
    if seen.robots.is_empty() {
        notes.push("none of the subdevices is a Meca500".into());
    }
    let unseen = subdevices.iter().filter(|found| found.is_meca500 && found.robot.is_none());
    let unseen: Vec<String> = unseen.map(|found| found.position.to_string()).collect();
    if !unseen.is_empty() {
        notes.push(format!("not looked at: the Meca500 at position {}", unseen.join(", ")));
    }
    if !seen.without_clock.is_empty() {
        let without: Vec<String> = seen.without_clock.iter().map(ToString::to_string).collect();
        notes.push(format!(
            "cycled without clocks: none is offered at position {}",
            without.join(", ")
        ));
    }
    if seen.interrupted {
        notes.push("interrupted: the figures are of a shorter time".into());
    }
    notes
}

fn subdevice(found: &SubDeviceFound) -> ReportedSubDevice {
    ReportedSubDevice {
        position: found.position,
        name: found.name.clone(),
        vendor: found.identity.vendor,
        product: found.identity.product,
        revision: found.identity.revision,
        serial: found.identity.serial,
        alias: found.alias,
        found_in: found.state_before.map(|state| state.to_string()),
        has_clock: found.has_clock,
        is_meca500: found.identity.is_meca500(),
        robot: found.robot.map(|robot| robot + 1),
    }
}

fn robot(number: usize, seen: &RobotObserved, writes: bool) -> ReportedRobot {
    let sent = &seen.sent;
    let verdict = sent.evidence.and_then(|evidence| evidence.verdict());
    let trouble = match (seen.trouble, sent.fresh, &sent.evidence, verdict) {
        (Some(error), ..) => Some(refusal(error, writes)),
        (None, 0, ..) | (None, _, None, _) => {
            Some("came to OP, but none of its inputs arrived: look at the cables".into())
        }
        (None, _, Some(_), None) => Some(
            "the byte order cannot be decided from what it sends: once its cause is known (a robot that \
             is still booting?), probe again, or give `fieldarm run` the --byte-order"
                .into(),
        ),
        _ => None,
    };
    ReportedRobot {
        robot: number,
        position: seen.images.position,
        usable: trouble.is_none(),
        trouble,
        outputs: layout(Direction::Outputs, &seen.images.outputs),
        inputs: layout(Direction::Inputs, &seen.images.inputs),
        fresh_inputs: sent.fresh,
        byte_order: sent.evidence.as_ref().map(order),
        identity: identity(seen.sent.dynamic.iter().flatten()),
        state: sent.inputs.zip(verdict).and_then(|(inputs, order)| state(&inputs, order)),
        events: sent.events.clone(),
    }
}

fn refusal(error: EthercatError, writes: bool) -> String {
    match error {
        EthercatError::Refused { code, .. }
            if code == AlStatusCode::INVALID_PROCESS_DATA_MAPPING && !writes =>
        {
            format!(
                "{error}. It wants its PDO assignment written, which `fieldarm run` does; to look \
                 further, probe with --write-assignment"
            )
        }
        error => error.to_string(),
    }
}

fn layout(direction: Direction, found: &Result<MappingFound, EthercatError>) -> ReportedLayout {
    let mut reported = ReportedLayout {
        verdict: "unread",
        bytes: None,
        expected_bytes: direction.image_len(),
        firmware: None,
        missing: Vec::new(),
        foreign: Vec::new(),
        difference: None,
    };
    match found {
        Err(error) => reported.difference = Some(error.to_string()),
        Ok(MappingFound { bytes, layout }) => {
            reported.bytes = Some(*bytes);
            match layout {
                Err(error) => {
                    reported.verdict = "refused";
                    reported.difference = Some(match error {
                        EthercatError::Layout { mismatch, .. } => mismatch.to_string(),
                        error => error.to_string(),
                    });
                }
                Ok(layout) => {
                    reported.verdict = if layout.is_equal() { "equal" } else { "by name" };
                    reported.firmware = Some(match layout.firmware() {
                        FirmwareLayout::V11_3 => "11.3",
                        FirmwareLayout::V10_2 => "10.2",
                    });
                    reported.missing = missing(layout);
                    reported.foreign = foreign(layout);
                }
            }
        }
    }
    reported
}

/// Objects that the robot does not map, as `6046h TargetConfiguration`.
fn missing(layout: &Layout) -> Vec<String> {
    let fields = match layout.direction() {
        Direction::Outputs => OUTPUT_FIELDS,
        Direction::Inputs => INPUT_FIELDS,
    };
    let section = |object: u16| {
        fields.iter().find(|field| field.object == object).map_or("", |field| field.section)
    };
    layout.missing().iter().map(|object| format!("{object:04X}h {}", section(*object))).collect()
}

fn foreign(layout: &Layout) -> Vec<String> {
    let entry = |entry: &MappingEntry| {
        let unit = if entry.bits == 1 { "bit" } else { "bits" };
        format!(
            "{:04X}h:{:02X} in PDO {:04X}h, {} {unit}",
            entry.object, entry.sub_index, entry.pdo, entry.bits
        )
    };
    layout.foreign().iter().map(entry).collect()
}

/// What some dynamic data say about who sent them.
pub(super) fn identity<'v>(slots: impl Iterator<Item = &'v DynamicValue>) -> ReportedIdentity {
    let mut identity = ReportedIdentity::default();
    for slot in slots {
        match slot.view(Eoat::None) {
            DynamicView::FirmwareVersion { major, minor, patch, build } => {
                identity.firmware = Some(format!("{major}.{minor}.{patch} build {build}"));
            }
            DynamicView::ProductType(product) => {
                identity.product = Some(
                    match product {
                        ProductType::Meca500R3 => "Meca500 R3",
                        ProductType::Meca500R4 => "Meca500 R4",
                        ProductType::Mcs500R1 => "MCS500 R1",
                    }
                    .into(),
                );
            }
            DynamicView::SerialNumber(serial) => identity.serial = Some(serial),
            DynamicView::ExternalToolStatus { tool, .. } => {
                identity.tool = Some(
                    match tool {
                        ExternalTool::None => "none",
                        ExternalTool::Megp25E => "MEGP 25E",
                        ExternalTool::Megp25Ls => "MEGP 25LS",
                        ExternalTool::Mpm500 => "MPM500",
                    }
                    .into(),
                );
            }
            // A number without a meaning: nothing is known.
            _ => {}
        }
    }
    identity
}

/// Bits of SafetyStatus that are set and that a Meca500 drives, by their names in the manual.
fn set_bits(inputs: &[u8; INPUT_LEN], order: ByteOrder) -> Vec<&'static str> {
    let safety = INPUT_FIELDS.iter().filter(|field| {
        field.section == "SafetyStatus"
            && field.field_type == FieldType::Bool
            && field.support != Support::Deprecated
    });
    safety
        .filter(|field| field.read(inputs, order) == Some(FieldValue::Bool(true)))
        .map(|field| field.name)
        .collect()
}

pub(super) fn state(inputs: &[u8; INPUT_LEN], order: ByteOrder) -> Option<ReportedState> {
    let values = read(inputs, order)?;
    let flags = values.robot_status.flags;
    let code = values.robot_status.error_code;
    let info = (code != 0).then(|| Code(code).describe()).flatten();
    let safety = set_bits(inputs, order);
    let is_signal = |name: &&str| {
        !name.ends_with("Resettable")
            && !["ResetReady", "VMotorOn"].contains(name)
            && !name.starts_with("PsuInputs")
    };
    Some(ReportedState {
        busy: flags.busy,
        activated: flags.activated,
        homed: flags.homed,
        sim_activated: flags.sim_activated,
        brakes_engaged: flags.brakes_engaged,
        recovery_mode: flags.recovery_mode,
        collision: flags.collision_status,
        work_zone_breach: flags.work_zone_status,
        monitoring_mode: flags.monitoring_mode,
        motors_powered: values.safety_status.power.v_motor_on,
        error_code: code,
        error_text: info.map(|info| info.text),
        error_remedy: info.map(|info| info.remedy).filter(|remedy| !remedy.is_empty()),
        safety_signals: safety.iter().copied().filter(is_signal).collect(),
        resettable: safety.iter().filter_map(|name| name.strip_suffix("Resettable")).collect(),
        fifo_space: values.motion_status.fifo_space,
        move_id: values.motion_status.move_id,
    })
}

fn exchange(exchanged: &Exchanged) -> ReportedExchange {
    let statistics = &exchanged.statistics;
    let latency = &statistics.exchange_ns;
    let us = |ns: u64| ns as f64 * 1e-3;
    let whole_us = |time: Duration| u64::try_from(time.as_micros()).unwrap_or(u64::MAX);
    let expected = u16::try_from(exchanged.robots * 3).unwrap_or(u16::MAX);
    ReportedExchange {
        robots: exchanged.robots,
        cycle_us: whole_us(exchanged.cycle),
        count: statistics.exchanges,
        working_counter_expected: statistics.working_counter.map_or(expected, |wkc| wkc.expected),
        working_counter_found: statistics.working_counter.map(|wkc| wkc.found),
        wrong_working_counter: statistics.wrong_counter,
        latency_us: ReportedLatency {
            p50: us(latency.value_at_quantile(0.5)),
            p99: us(latency.value_at_quantile(0.99)),
            max: us(latency.max()),
        },
        lost: statistics.lost,
        reply_limit_us: whole_us(exchanged.reply_limit),
        stray: exchanged.stray,
        late: statistics.late,
        clock: statistics.clock.map(|clock| ReportedClock {
            drift_ppm: clock.drift_ppb * 1e-3,
            phase_error_ns: clock.phase_error_ns,
            worst_phase_error_ns: clock.worst_phase_error_ns,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::meca500::image::pdo::{PdoLayout, input_pdos};

    #[test]
    fn what_is_missing_and_what_is_foreign_is_named() {
        let mut entries: Vec<MappingEntry> = input_pdos(PdoLayout::V11_3)
            .flat_map(|pdo| {
                pdo.entries().map(move |entry| MappingEntry::from_wire(pdo.index, entry.mapping()))
            })
            .filter(|entry| entry.pdo != 0x1A0A)
            .collect();
        entries.push(MappingEntry { pdo: 0x1AFF, object: 0x6FFF, sub_index: 2, bits: 32 });
        entries.push(MappingEntry { pdo: 0x1AFF, object: 0x6FFF, sub_index: 3, bits: 1 });
        let layout = Layout::compare(Direction::Inputs, &entries)
            .map_err(|mismatch| EthercatError::Layout { position: 0, mismatch });
        let reported = super::layout(Direction::Inputs, &Ok(MappingFound { bytes: 233, layout }));
        assert_eq!(reported.verdict, "by name");
        assert_eq!(reported.missing, ["6051h TargetTrf"]);
        assert_eq!(
            reported.foreign,
            ["6FFFh:02 in PDO 1AFFh, 32 bits", "6FFFh:03 in PDO 1AFFh, 1 bit"]
        );
    }

    #[test]
    fn a_robot_that_does_not_tell_its_layout_is_unread() {
        let error =
            EthercatError::Aborted { position: 2, index: 0x1C13, sub_index: 0, code: 0x0602_0000 };
        let reported = super::layout(Direction::Inputs, &Err(error));
        assert_eq!((reported.verdict, reported.bytes), ("unread", None));
        assert!(reported.difference.is_some_and(|text| text.contains("1C13h:00")));
    }
}
