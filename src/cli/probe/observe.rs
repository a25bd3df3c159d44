//! Looking at a segment without acting on a robot.
//!
//! ```text
//!  survey (PRE-OP) --> start, monitor only --> cycles --> INIT
//!                        ^          |
//!                        +- without the robot that refused
//! ```
//!
//! Invariants: outputs hold nothing but the choice of dynamic data, and zeros at the end; no robot
//! that refuses keeps the others from being looked at.

use core::sync::atomic::{AtomicBool, Ordering};
use std::prelude::v1::*;

use crate::cycle::CyclicSegment;
use crate::engine::meca500::{OrderEvidence, OrderProbe};
use crate::link::ethercat::wire::Wire;
use crate::link::ethercat::{
    Assignment, Clocks, EthercatError, EthercatSegment, RobotAddress, RobotChoice, RobotSurveyed,
    SegmentSettings, SegmentStatistics, StartFailure, SubDeviceFound, release, survey,
};
use crate::time::Duration;
use crate::wire::meca500::dynamic::{DynamicType, DynamicValue};
use crate::wire::meca500::image::{INPUT_LEN, InputImage, InputValues, OUTPUT_LEN};
use crate::wire::order::{Big, BigIntLittleReal, ByteOrder, Endian, Little, LittleIntBigReal};

/// What tells who a robot is, one for each slot.
pub(super) const ASKED: [DynamicType; 4] = [
    DynamicType::FIRMWARE_VERSION,
    DynamicType::PRODUCT_TYPE,
    DynamicType::SERIAL_NUMBER,
    DynamicType::EXTERNAL_TOOL_STATUS,
];
/// Cycles at the end in which the choice of dynamic data is 0 again.
const FAREWELL: u32 = 20;

/// How to look.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub(super) robots: RobotChoice,
    pub(super) assignment: Assignment,
    pub(super) clocks: bool,
    pub(super) take_over: bool,
    pub(super) cycle: Duration,
    pub(super) cycles: u32,
}

/// What there is to see.
#[derive(Debug)]
pub(super) struct Observation {
    pub(super) subdevices: Vec<SubDeviceFound>,
    pub(super) robots: Vec<RobotObserved>,
    pub(super) exchange: Option<Exchanged>,
    /// Robots without a clock, when clocks were asked for: nobody used them then.
    pub(super) without_clock: Vec<u16>,
    pub(super) interrupted: bool,
}

/// One robot.
#[derive(Debug)]
pub(super) struct RobotObserved {
    pub(super) images: RobotSurveyed,
    /// Why it was not cycled.
    pub(super) trouble: Option<EthercatError>,
    /// What it sent.
    pub(super) sent: Sent,
}

/// What a robot sent while it was cycled.
#[derive(Debug, Default)]
pub(super) struct Sent {
    /// Exchanges that brought new inputs.
    pub(super) fresh: u32,
    /// Why the byte order is what it is.
    pub(super) evidence: Option<OrderEvidence>,
    /// The newest inputs.
    pub(super) inputs: Option<[u8; INPUT_LEN]>,
    /// The dynamic data asked for, as far as they came.
    pub(super) dynamic: [Option<DynamicValue>; ASKED.len()],
    /// What the link noticed.
    pub(super) events: Vec<String>,
}

/// The exchanges with all robots that were cycled.
#[derive(Debug)]
pub(super) struct Exchanged {
    pub(super) statistics: SegmentStatistics,
    pub(super) cycle: Duration,
    pub(super) robots: usize,
    pub(super) stray: u64,
}

/// Looks at what is behind `wire`, until done or `interrupted`.
pub(super) fn observe<W: Wire>(
    wire: W,
    plan: &Plan,
    interrupted: &AtomicBool,
) -> Result<Observation, EthercatError> {
    let mut settings = SegmentSettings {
        robots: plan.robots.clone(),
        assignment: plan.assignment,
        monitor_only: true,
        take_over: plan.take_over,
        ..SegmentSettings::with_cycle(plan.cycle)
    };
    let (survey, mut wire) = survey(wire, &settings).map_err(|failure| failure.error)?;
    let robots = survey.robots.into_iter().map(|images| RobotObserved {
        trouble: images.refusal(),
        images,
        sent: Sent::default(),
    });
    let mut seen = Observation {
        robots: robots.collect(),
        subdevices: survey.subdevices,
        exchange: None,
        without_clock: Vec::new(),
        interrupted: false,
    };
    if plan.clocks {
        let robots = seen.subdevices.iter().filter(|found| found.robot.is_some());
        let without = robots.filter(|found| !found.has_clock).map(|found| found.position);
        seen.without_clock = without.collect();
        if seen.without_clock.is_empty() {
            // Half a cycle from the frame to SYNC0 leaves both sides the most room.
            settings.clocks = Clocks::Sync0 { shift: plan.cycle / 2 };
        }
    }
    loop {
        let usable = seen.robots.iter().filter(|robot| robot.trouble.is_none());
        let these: Vec<_> =
            usable.map(|robot| RobotAddress::Position(robot.images.position)).collect();
        if these.is_empty() {
            break;
        }
        settings.robots = RobotChoice::These(these);
        match EthercatSegment::start(wire, settings.clone()) {
            Ok(segment) => {
                wire = cycle(segment, plan, interrupted, &mut seen);
                break;
            }
            Err(StartFailure { error, wire: back }) => {
                wire = back;
                take_out(error, &mut seen.robots);
            }
        }
    }
    release(wire);
    Ok(seen)
}

/// Notes why the robot that `error` is about cannot be cycled, or all when it is about none of them.
fn take_out(error: EthercatError, robots: &mut [RobotObserved]) {
    let is_it = |robot: &RobotObserved| {
        robot.trouble.is_none() && Some(robot.images.position) == error.position()
    };
    let is_about_one = robots.iter().any(is_it);
    for robot in robots.iter_mut() {
        if is_it(robot) || !is_about_one {
            robot.trouble.get_or_insert(error);
        }
    }
}

/// Cycles the robots that came to OP, and notes what they send; the wire, when they have left OP.
fn cycle<W: Wire>(
    mut segment: EthercatSegment<W>,
    plan: &Plan,
    interrupted: &AtomicBool,
    seen: &mut Observation,
) -> W {
    let mut watched: Vec<&mut RobotObserved> =
        seen.robots.iter_mut().filter(|robot| robot.trouble.is_none()).collect();
    let mut probes: Vec<Questioner> = watched.iter().map(|_| Questioner::default()).collect();
    let stray_before = segment.frames().stray;
    let mut due = segment.wire().now();
    let mut last_cycle = plan.cycles;
    let mut number = 0;
    while number < last_cycle {
        if !seen.interrupted && interrupted.load(Ordering::Relaxed) {
            seen.interrupted = true;
            last_cycle = last_cycle.min(number + FAREWELL);
        }
        for (robot, probe) in probes.iter_mut().enumerate() {
            let outputs = match number + FAREWELL < last_cycle {
                true => probe.outputs(number, plan.cycles),
                false => [0; OUTPUT_LEN],
            };
            segment.write_outputs(robot, &outputs);
        }
        segment.wire_mut().pause_until(due);
        let now = segment.wire().now();
        // Never fails: what goes wrong shows in the qualities and the events.
        let _ = segment.exchange(now);
        for (robot, (probe, observed)) in probes.iter_mut().zip(&mut watched).enumerate() {
            let mut inputs = [0; INPUT_LEN];
            if segment.read_inputs(robot, &mut inputs).is_fresh() {
                observed.sent.fresh += 1;
                probe.take(&inputs, &mut observed.sent);
            }
        }
        while let Some(event) = segment.poll_event() {
            if let Some(observed) = watched.get_mut(event.robot) {
                observed.sent.events.push(event.kind.to_string());
            }
        }
        let nudge = segment.nudge_ns();
        let size = Duration::from_nanos(nudge.unsigned_abs());
        let next = if nudge < 0 { plan.cycle.saturating_sub(size) } else { plan.cycle + size };
        due = (due + next).max(now);
        number += 1;
    }
    for (probe, observed) in probes.iter().zip(&mut watched) {
        observed.sent.evidence = probe.probe.evidence();
    }
    seen.exchange = Some(Exchanged {
        statistics: segment.statistics().clone(),
        cycle: plan.cycle,
        robots: segment.robot_count(),
        stray: segment.frames().stray - stray_before,
    });
    segment.close()
}

/// Asks a robot who it is, once its byte order is known.
#[derive(Debug, Default)]
struct Questioner {
    probe: OrderProbe,
    asking: Option<(Endian, [u8; OUTPUT_LEN])>,
}

impl Questioner {
    /// What to send in this cycle, of so many. While the byte order is open, nothing but zeros in the
    /// first half: more may come to light. Then each order is tried for a quarter.
    fn outputs(&mut self, number: u32, of: u32) -> [u8; OUTPUT_LEN] {
        let settled = self.probe.evidence().and_then(|evidence| evidence.integers);
        let tried = match number {
            _ if number < of / 2 => None,
            _ if number < of / 4 * 3 => Some(Endian::BigEndian),
            _ => Some(Endian::LittleEndian),
        };
        let Some(integers) = settled.or(tried) else { return [0; OUTPUT_LEN] };
        match self.asking {
            Some((asking, outputs)) if asking == integers || self.has_answer() => outputs,
            _ => {
                let outputs = self.probe.ask(ASKED, integers);
                self.asking = Some((integers, outputs));
                outputs
            }
        }
    }

    /// Whether the question that was asked without knowing the order has been understood.
    fn has_answer(&self) -> bool {
        let evidence = self.probe.evidence();
        evidence.is_some_and(|evidence| {
            evidence.integers.is_none() && evidence.echo.is_some_and(|echo| echo.answered)
        })
    }

    fn take(&mut self, inputs: &[u8; INPUT_LEN], sent: &mut Sent) {
        // Of the right length by its type.
        let _ = self.probe.see(inputs);
        sent.inputs = Some(*inputs);
        let Some(values) = self.probe.verdict().and_then(|order| read(inputs, order)) else {
            return;
        };
        for (place, asked) in sent.dynamic.iter_mut().zip(ASKED) {
            let slot = values.dynamic_data.iter().find(|slot| slot.dynamic_type == asked.0);
            if let Some(slot) = slot {
                *place = Some(DynamicValue::from_values(asked, slot.value_idx));
            }
        }
    }
}

/// The plain values of an input image.
pub(super) fn read(inputs: &[u8], order: ByteOrder) -> Option<InputValues> {
    use Endian::{BigEndian, LittleEndian};
    let values = match (order.integers, order.reals) {
        (BigEndian, BigEndian) => InputImage::<Big>::from_bytes(inputs).ok()?.values(),
        (LittleEndian, LittleEndian) => InputImage::<Little>::from_bytes(inputs).ok()?.values(),
        (BigEndian, LittleEndian) => {
            InputImage::<BigIntLittleReal>::from_bytes(inputs).ok()?.values()
        }
        (LittleEndian, BigEndian) => {
            InputImage::<LittleIntBigReal>::from_bytes(inputs).ok()?.values()
        }
    };
    Some(values)
}
