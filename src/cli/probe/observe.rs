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
    pub(super) reply_limit: Duration,
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
    pub(super) reply_limit: Duration,
    pub(super) robots: usize,
    pub(super) stray: u64,
}

/// Looks at what is behind `wire`, until done or `interrupted`. Gives the wire back.
pub(super) fn observe<W: Wire>(
    wire: W,
    plan: &Plan,
    interrupted: &AtomicBool,
) -> Result<(Observation, W), EthercatError> {
    let mut settings = SegmentSettings {
        robots: plan.robots.clone(),
        assignment: plan.assignment,
        monitor_only: true,
        take_over: plan.take_over,
        reply_limit: plan.reply_limit,
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
            // As a run does it.
            settings.clocks = Clocks::Sync0 { shift: plan.cycle / 3 };
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
    Ok((seen, release(wire)))
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
        reply_limit: plan.reply_limit,
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

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;
    use crate::bus::ethercat::meca500::{Meca500Application, Meca500Settings};
    use crate::bus::ethercat::{Settings, SubDevice};
    use crate::cli::exit::Exit;
    use crate::cli::probe::report::report;
    use crate::cycle::CyclicDevice;
    use crate::link::ethercat::memory::MemoryWire;
    use crate::sim::meca500::{CyclicBus, RobotSettings, VirtualRobot};
    use crate::time::Instant;
    use crate::wire::ethercat::al::AlState;
    use crate::wire::ethercat::sii::{Description, SiiImage};
    use crate::wire::meca500::subdevice::DESCRIPTION;

    /// What a robot was told, and what it was like meanwhile.
    #[derive(Default)]
    struct Log {
        cycles: u32,
        /// Different outputs in the order they came; `None` while there were none.
        told: Vec<Option<[u8; OUTPUT_LEN]>>,
        /// All bits of RobotStatus that were ever set.
        status_bits: u16,
        greatest_move_id: u16,
    }

    /// A robot that keeps a log; a blank one sends zeros whatever it is.
    struct Witness {
        robot: VirtualRobot,
        is_blank: bool,
        log: Arc<Mutex<Log>>,
    }

    impl CyclicDevice for Witness {
        const OUTPUT_LEN: usize = VirtualRobot::OUTPUT_LEN;
        const INPUT_LEN: usize = VirtualRobot::INPUT_LEN;

        fn cycle(&mut self, now: Instant, outputs: Option<&[u8]>, inputs: &mut [u8]) {
            self.robot.cycle(now, outputs, inputs);
            let mut log = self.log.lock().unwrap();
            let told = outputs.map(|outputs| outputs.try_into().unwrap());
            if log.told.last() != Some(&told) {
                log.told.push(told);
            }
            log.cycles += 1;
            log.status_bits |= u16::from_le_bytes([inputs[0], inputs[1]]);
            let image = InputImage::<Little>::from_bytes(inputs).unwrap();
            log.greatest_move_id = log.greatest_move_id.max(image.motion_status.move_id.get());
            if self.is_blank {
                inputs.fill(0);
            }
        }

        fn is_on_bus(&self) -> bool {
            self.robot.is_on_bus()
        }
    }

    fn plan() -> Plan {
        Plan {
            robots: RobotChoice::All,
            assignment: Assignment::Keep,
            clocks: false,
            take_over: false,
            cycle: Duration::from_millis(1),
            reply_limit: Duration::from_micros(750),
            cycles: 400,
        }
    }

    fn robot(byte_order: ByteOrder) -> VirtualRobot {
        VirtualRobot::new(RobotSettings {
            byte_order,
            bus: CyclicBus::EtherCat,
            ..RobotSettings::default()
        })
    }

    fn subdevice<D: CyclicDevice>(
        device: D,
        description: &Description,
    ) -> SubDevice<Meca500Application<D>> {
        let application = Meca500Application::new(device, Meca500Settings::default());
        let sii = SiiImage::new(description).unwrap();
        SubDevice::new(application, description, sii, Settings::default())
    }

    fn wire<D: CyclicDevice>(devices: Vec<D>) -> MemoryWire<Meca500Application<D>> {
        let line = devices.into_iter().map(|device| subdevice(device, &DESCRIPTION));
        MemoryWire::new(line.collect())
    }

    fn seen<D: CyclicDevice>(devices: Vec<D>) -> Observation {
        observed(wire(devices), &plan(), false)
    }

    /// What is seen; every subdevice is left in INIT.
    fn observed<D: CyclicDevice>(
        wire: MemoryWire<Meca500Application<D>>,
        plan: &Plan,
        interrupted: bool,
    ) -> Observation {
        let (seen, mut wire) = observe(wire, plan, &AtomicBool::new(interrupted)).unwrap();
        assert!(wire.line().iter().all(|subdevice| subdevice.state() == AlState::Init));
        let later = wire.now() + Duration::from_millis(10);
        wire.pause_until(later);
        seen
    }

    fn witnessed(byte_order: ByteOrder, is_blank: bool) -> (Observation, Log) {
        let log = Arc::new(Mutex::new(Log::default()));
        let witness = Witness { robot: robot(byte_order), is_blank, log: Arc::clone(&log) };
        let seen = seen(vec![witness]);
        let log = Arc::into_inner(log).unwrap().into_inner().unwrap();
        (seen, log)
    }

    /// Nothing in outputs but the choice of dynamic data.
    fn assert_harmless(log: &Log) {
        for told in log.told.iter().flatten() {
            assert_eq!(told[..44], [0; 44], "{told:02X?}");
        }
        assert_eq!(log.greatest_move_id, 0, "it has received no command");
        let moved = 0b1111;
        assert_eq!(log.status_bits & moved, 0, "busy, activated, homed or simulating");
        assert!(log.cycles > 400);
        assert_eq!(log.told.last(), Some(&None), "the robot was left in INIT, without outputs");
        let farewell = log.told.iter().rev().flatten().next();
        assert_eq!(farewell, Some(&[0; OUTPUT_LEN]), "the choices went back to 0");
    }

    #[test]
    fn a_robot_is_asked_who_it_is_and_nothing_else() {
        for byte_order in ByteOrder::ALL {
            let (seen, log) = witnessed(byte_order, false);
            assert_harmless(&log);
            let mut question = [0; OUTPUT_LEN];
            for (slot, ty) in question[44..].chunks_exact_mut(4).zip(ASKED) {
                slot.copy_from_slice(&match byte_order.integers {
                    Endian::BigEndian => ty.0.to_be_bytes(),
                    Endian::LittleEndian => ty.0.to_le_bytes(),
                });
            }
            let mut told: Vec<_> = log.told.iter().flatten().collect();
            told.dedup();
            assert_eq!(told, [&[0; OUTPUT_LEN], &question, &[0; OUTPUT_LEN]]);
            let sent = &seen.robots[0].sent;
            assert_eq!(sent.evidence.unwrap().verdict(), Some(byte_order));
            assert!(sent.evidence.unwrap().echo.unwrap().answered);
            assert!(sent.dynamic.iter().all(Option::is_some), "{:?}", sent.dynamic);
        }
    }

    #[test]
    fn a_robot_that_tells_no_order_is_asked_in_both_and_not_called_usable() {
        let (seen, log) = witnessed(ByteOrder::LITTLE, true);
        assert_harmless(&log);
        let asked: Vec<[u8; 4]> = log
            .told
            .iter()
            .flatten()
            .map(|told| [told[44], told[45], told[46], told[47]])
            .filter(|first| *first != [0; 4])
            .collect();
        assert_eq!(asked, [[0, 0, 0, 1], [1, 0, 0, 0]]);
        let evidence = seen.robots[0].sent.evidence.unwrap();
        assert_eq!((evidence.integers, evidence.reals), (None, None));
        assert!(!evidence.echo.unwrap().answered);
        let (report, exit) = report("test".into(), &seen, false);
        assert_eq!(exit, Exit::Link);
        let trouble = report.robots[0].trouble.as_ref().unwrap();
        assert!(trouble.contains("byte order cannot be decided"), "{trouble}");
        assert!(report.robots[0].state.is_none());
    }

    #[test]
    fn a_robot_that_is_stopped_can_be_driven_but_says_so() {
        let mut stopped = robot(ByteOrder::LITTLE);
        stopped.panel().press_e_stop();
        let (report, exit) =
            report("test".into(), &seen(vec![robot(ByteOrder::BIG), stopped]), false);
        assert_eq!(exit, Exit::Robot);
        assert!(report.robots.iter().all(|robot| robot.usable));
        let [free, stopped] = [0, 1].map(|robot| report.robots[robot].state.clone().unwrap());
        assert!(free.safety_signals.is_empty());
        assert!(stopped.safety_signals.contains(&"EStop"), "{:?}", stopped.safety_signals);
        assert_eq!((free.motors_powered, stopped.motors_powered), (true, false));
    }

    #[test]
    fn other_devices_are_told_and_left_alone() {
        let other = || {
            let mut description = DESCRIPTION;
            (description.vendor, description.product) = (2, 0x044C_2C52);
            subdevice(robot(ByteOrder::BIG), &description)
        };
        let seen = observed(MemoryWire::new(vec![other()]), &plan(), false);
        let (told, exit) = report("test".into(), &seen, false);
        assert_eq!(exit, Exit::Link);
        assert_eq!((told.subdevices.len(), told.robots.len()), (1, 0));
        assert_eq!(told.notes, ["none of the subdevices is a Meca500"]);
        let text = crate::cli::probe::text::text(&told);
        assert!(text.contains("00000002h  044C2C52h"), "{text}");
        assert!(text.contains("left alone"), "{text}");

        let meca500 = subdevice(robot(ByteOrder::BIG), &DESCRIPTION);
        let seen = observed(MemoryWire::new(vec![other(), meca500]), &plan(), false);
        let (told, exit) = report("test".into(), &seen, false);
        assert_eq!((exit, told.robots[0].position), (Exit::Done, 1));
        assert_eq!(told.subdevices.iter().map(|s| s.robot).collect::<Vec<_>>(), [None, Some(1)]);
    }

    #[test]
    fn what_another_main_device_drives_is_left_alone() {
        let driven = || {
            let settings = SegmentSettings {
                watchdog: Some(Duration::from_secs(6)),
                ..SegmentSettings::default()
            };
            let segment = EthercatSegment::start(wire(vec![robot(ByteOrder::BIG)]), settings);
            segment.ok().unwrap().abandon()
        };
        let refused = observe(driven(), &plan(), &AtomicBool::new(false)).err();
        assert_eq!(refused, Some(EthercatError::Driven { position: 0 }));
        let seen = observed(driven(), &Plan { take_over: true, ..plan() }, false);
        assert_eq!(seen.subdevices[0].state_before, Some(AlState::Op));
        assert_eq!(report("test".into(), &seen, false).1, Exit::Done);
    }

    #[test]
    fn an_interrupt_ends_it_early_with_choices_of_zero() {
        let log = Arc::new(Mutex::new(Log::default()));
        let robot = robot(ByteOrder::LITTLE);
        let witness = Witness { robot, is_blank: false, log: Arc::clone(&log) };
        let seen = observed(wire(vec![witness]), &plan(), true);
        assert!(seen.interrupted);
        assert!(seen.robots[0].sent.fresh <= FAREWELL);
        let log = log.lock().unwrap();
        assert!(log.told.iter().flatten().all(|told| *told == [0; OUTPUT_LEN]));
        assert_eq!(report("test".into(), &seen, false).1, Exit::Interrupted);
    }
}
