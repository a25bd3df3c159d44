//! A segment in operation: one bus cycle for all robots, and whoever falls brought back.
//!
//! Read `condition.rs` first: what becomes of one robot.
//!
//! Invariants: inputs are handed on only from an exchange in which the robot was in OP and the working
//! counter added up; an exchange does not allocate, except that a robot which left OP gets a task; no
//! robot is started again by itself except to OP with the outputs that the caller has set then, which
//! an engine that has seen [`InputQuality::Lost`] keeps at zero.

use std::sync::Arc;
use std::vec::Vec;

use super::care::{CareKind, CareOutcome, Carer};
use super::condition::{Condition, GONE_AFTER, Robot};
use super::driver::{Driver, FrameCounters, LongTask};
use super::error::{EthercatError, Step};
use super::event::{EventKind, EventQueue, SegmentEvent};
use super::exchange::{MAX_GROUPS, PER_ROBOT, Replies, Verdict, exchange_groups, judge};
use super::group::{GroupReply, Member, Shared};
use super::monitor::only_dynamic_data;
use super::notice::NoticeKind;
use super::pdu_core::PduCore;
use super::robot::{RobotFound, SubDeviceFound};
use super::settings::{Clocks, SegmentSettings};
use super::start::{Started, Starter};
use super::statistics::{ClockTrack, SegmentStatistics, WorkingCounter};
use super::wire::Wire;
use crate::cycle::{CyclicSegment, InputQuality};
use crate::time::{Duration, Instant};
use crate::wire::ethercat::al::{AlState, AlStatusCode};
use crate::wire::meca500::image::INPUT_LEN;

/// Attempts to start before the error is told: frames can get lost on the way.
pub(super) const START_ATTEMPTS: u32 = 3;
/// Time between two looks for a robot that is gone.
const FIND_EVERY: Duration = Duration::from_millis(100);
/// Time before the next attempt to bring a robot back.
const TRY_AGAIN_AFTER: Duration = Duration::from_millis(500);
/// Exchanges between two looks for a reason while robots do not reach OP.
const LOOK_EVERY: u64 = 50;

/// The task that brings a robot back, one at a time.
struct Care {
    kind: CareKind,
    robot: usize,
    give_up_at: Instant,
}

/// What each exchange needs of the settings, worked out once.
struct Pace {
    late_after_ns: u64,
    reply_limit_ns: u64,
    monitor_only: bool,
}

impl Pace {
    fn new(settings: &SegmentSettings) -> Self {
        let ns = |duration: Duration| u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX);
        Self {
            late_after_ns: ns(settings.cycle * 3 / 2),
            reply_limit_ns: ns(settings.reply_limit),
            monitor_only: settings.monitor_only,
        }
    }

    /// After which moment the exchange after one that `began` is late.
    const fn late_from(&self, began: Instant) -> Instant {
        Instant::from_nanos(began.as_nanos().saturating_add(self.late_after_ns))
    }

    /// Until when an exchange that `began` waits for its frames.
    const fn deadline(&self, began: Instant) -> Instant {
        Instant::from_nanos(began.as_nanos().saturating_add(self.reply_limit_ns))
    }
}

/// A segment whose robots are in OP.
pub struct EthercatSegment<W> {
    task: Option<LongTask<CareOutcome>>,
    care: Option<Care>,
    /// A restart that waits while a robot is helped that needs less.
    parked: Option<(Care, LongTask<CareOutcome>)>,
    shared: Arc<Shared>,
    robots: Vec<Robot>,
    found: Vec<RobotFound>,
    subdevices: Vec<SubDeviceFound>,
    settings: Arc<SegmentSettings>,
    events: EventQueue,
    statistics: SegmentStatistics,
    clock: Option<ClockTrack>,
    nudge_ns: i64,
    pace: Pace,
    /// From when on the next exchange counts as late.
    late_from: Option<Instant>,
    /// Times of the caller and of the wire at the first exchange, for wires whose time is simulated.
    began: Option<(Instant, Instant)>,
    next_care: usize,
    driver: Driver<W>,
}

/// A segment that could not be started, and its wire.
#[derive(Debug)]
pub struct StartFailure<W> {
    /// Why.
    pub error: EthercatError,
    /// The wire, to try again on.
    pub wire: W,
}

impl<W: Wire> EthercatSegment<W> {
    /// Brings every chosen robot to OP, with outputs of zero, and returns when all are there.
    ///
    /// All subdevices are reset first. Those that are not chosen stay in PRE-OP.
    ///
    /// # Errors
    ///
    /// Why it cannot be done, with the wire. Losses on the wire are tried three times.
    pub fn start(wire: W, settings: SegmentSettings) -> Result<Self, StartFailure<W>> {
        if let Some(error) = settings.mistake() {
            return Err(StartFailure { error, wire });
        }
        let core = PduCore::take(settings.clocks != Clocks::Off);
        let settings = Arc::new(settings);
        let mut driver = Driver::new(wire, core);
        let mut attempt = 1;
        loop {
            let deadline = driver.now() + settings.start_limit;
            // What an attempt before has left under way must not reach a robot now.
            driver.forget_task();
            let mut starter = Starter { driver: &mut driver, settings: &settings, deadline };
            let error = match starter.run() {
                Ok(started) => {
                    let mut segment = Self::assemble(driver, Arc::clone(&settings), started);
                    match segment.cycle_until_op(deadline) {
                        Ok(()) => return Ok(segment),
                        Err(error) => {
                            driver = segment.into_driver();
                            error
                        }
                    }
                }
                Err(error) => error,
            };
            if attempt == START_ATTEMPTS || !is_worth_another_attempt(error) {
                return Err(StartFailure { error, wire: driver.into_wire() });
            }
            attempt += 1;
        }
    }

    fn assemble(mut driver: Driver<W>, settings: Arc<SegmentSettings>, started: Started) -> Self {
        let Started { shared, seats } = started;
        driver.open_lanes(shared.groups.iter().map(|group| group.frame_len(&shared.main_device)));
        let subdevices: Vec<SubDeviceFound> = seats.into_iter().map(|seat| seat.found).collect();
        let found = shared.members.iter().map(|member| RobotFound {
            position: member.position,
            identity: member.identity,
            alias: subdevices
                .get(usize::from(member.position))
                .map_or(0, |subdevice| subdevice.alias),
            outputs: member.outputs.clone(),
            inputs: member.inputs.clone(),
        });
        let clock = match settings.clocks {
            Clocks::Off => None,
            Clocks::Sync0 { shift } => Some(ClockTrack::new(settings.cycle, shift)),
        };
        Self {
            task: None,
            care: None,
            parked: None,
            found: found.collect(),
            robots: shared.members.iter().map(|_| Robot::new()).collect(),
            shared: Arc::new(shared),
            subdevices,
            pace: Pace::new(&settings),
            settings,
            events: EventQueue::new(),
            statistics: SegmentStatistics::new(),
            clock,
            nudge_ns: 0,
            late_from: None,
            began: None,
            next_care: 0,
            driver,
        }
    }

    fn into_driver(self) -> Driver<W> {
        self.driver
    }

    /// Cycles with outputs of zero until every robot is in OP.
    fn cycle_until_op(&mut self, deadline: Instant) -> Result<(), EthercatError> {
        let mut due = self.driver.now();
        let mut cycles = 0_u64;
        loop {
            self.cycle();
            if self.robots.iter().all(|robot| robot.condition == Condition::InOp) {
                self.statistics = SegmentStatistics::new();
                return Ok(());
            }
            let now = self.driver.now();
            if now >= deadline {
                let counters = self.driver.counters();
                let (sent, received) = (counters.sent, counters.received);
                return Err(EthercatError::TimedOut { step: Step::Op, sent, received });
            }
            cycles += 1;
            if cycles.is_multiple_of(LOOK_EVERY) {
                let settings = Arc::clone(&self.settings);
                let mut starter =
                    Starter { driver: &mut self.driver, settings: &settings, deadline };
                if let Some(refusal) =
                    starter.refusal(&self.shared.main_device, &self.shared.members, AlState::Op)
                {
                    return Err(refusal);
                }
            }
            let (later, earlier) = nudge(self.nudge_ns);
            due = (due + (self.settings.cycle + later).saturating_sub(earlier)).max(now);
            self.driver.idle_until(due);
        }
    }

    /// One bus cycle, in the time of the wire.
    fn cycle(&mut self) {
        let began = self.driver.now();
        if let Some(late_from) = self.late_from.replace(self.pace.late_from(began)) {
            self.statistics.late += u64::from(began > late_from);
        }
        let main_device = &self.shared.main_device;
        for (member, robot) in self.shared.members.iter().zip(&self.robots) {
            let Some(group) = self.shared.groups.get(member.group) else { continue };
            let outputs = match self.pace.monitor_only {
                true => &only_dynamic_data(&robot.outputs),
                false => &robot.outputs,
            };
            group.write(main_device, member.index, &member.outputs, outputs);
        }
        let deadline = self.pace.deadline(began);
        let mut replies: Replies = [None; MAX_GROUPS];
        let outcome = exchange_groups(
            &mut self.driver,
            &self.shared.groups,
            &mut replies,
            deadline,
            &mut self.task,
        );
        let ended = self.driver.now();
        self.count(began, ended, &replies);
        self.take_replies(&replies);
        if let Some(outcome) = outcome {
            self.take_outcome(outcome, ended);
        }
        self.take_notice();
        let has_tasks = self.care.is_some() || self.parked.is_some();
        if has_tasks || self.robots.iter().any(|robot| robot.wants().is_some()) {
            self.look_after(ended);
        }
    }

    fn count(&mut self, began: Instant, ended: Instant, replies: &Replies) {
        let groups = self.shared.groups.len();
        let (mut answered, mut found) = (0, 0_u16);
        for reply in replies.iter().take(groups).flatten() {
            answered += 1;
            found = found.saturating_add(reply.working_counter);
        }
        self.statistics.exchanges += 1;
        if answered == groups {
            self.statistics.record_exchange(ended.as_nanos().saturating_sub(began.as_nanos()));
            let robots = u16::try_from(self.robots.len()).unwrap_or(u16::MAX);
            let expected = robots.saturating_mul(PER_ROBOT);
            self.statistics.working_counter = Some(WorkingCounter { expected, found });
        } else {
            self.statistics.lost += 1;
        }
        let Some(clock) = &mut self.clock else { return };
        self.nudge_ns = match replies.iter().flatten().find_map(|reply| reply.clock) {
            Some(reading) => clock.take(began, reading, &mut self.statistics.clock),
            None => 0,
        };
    }

    fn take_replies(&mut self, replies: &Replies) {
        let has_tasks = self.care.is_some() || self.parked.is_some();
        let mut all_answer = true;
        for number in 0..self.robots.len() {
            let (Some(member), Some(robot)) =
                (self.shared.members.get(number), self.robots.get_mut(number))
            else {
                continue;
            };
            let reply = replies.get(member.group).and_then(Option::as_ref);
            let group = self.shared.groups.get(member.group);
            if let (Some(reply), Some(group)) = (reply, group) {
                let verdict = judge(reply, member.index, group.len());
                if verdict == Verdict::Fresh && robot.condition == Condition::InOp && !has_tasks {
                    robot.refresh(&self.shared, member, group);
                } else {
                    self.take_unusual(number, verdict, reply);
                }
            } else {
                robot.unanswered = robot.unanswered.saturating_add(1);
                robot.grow_stale();
            }
            all_answer &= self.robots.get(number).is_some_and(|robot| robot.unanswered == 0);
        }
        if !all_answer {
            self.let_go();
        }
    }

    /// Takes a reply of a robot that was not in OP or is not now, that has a task, or whose working
    /// counter does not add up.
    #[cold]
    fn take_unusual(&mut self, number: usize, verdict: Verdict, reply: &GroupReply) {
        let Self { shared, robots, care, parked, events, statistics, .. } = self;
        let (Some(member), Some(robot)) = (shared.members.get(number), robots.get_mut(number))
        else {
            return;
        };
        let Some(group) = shared.groups.get(member.group) else { return };
        // A task that changes the robot's state tells when it is done.
        let parked = parked.as_ref().map(|(care, _)| care);
        let is_changed = care.iter().chain(parked).any(|care| {
            care.robot == number && matches!(care.kind, CareKind::Lift | CareKind::Restore)
        });
        match verdict {
            Verdict::Fresh if robot.condition == Condition::Blocked || is_changed => {
                (robot.unanswered, robot.doubtful) = (0, 0);
            }
            Verdict::Fresh => {
                if !matches!(robot.condition, Condition::InOp | Condition::Starting) {
                    events.push(number, EventKind::BackInOp);
                }
                robot.condition = Condition::InOp;
                robot.refresh(shared, member, group);
            }
            Verdict::Doubtful => {
                statistics.wrong_counter += 1;
                robot.grow_stale();
                if robot.doubt() {
                    let (expected, found) = (counter_of(reply), reply.working_counter);
                    events.push(number, EventKind::WrongCounter { expected, found });
                }
            }
            Verdict::NotInOp(_) => {
                (robot.unanswered, robot.doubtful) = (0, 0);
                match robot.condition {
                    Condition::InOp => {
                        robot.condition = Condition::Away { seen: None, is_told: false };
                    }
                    // It was only out of sight: what it was told is still there.
                    Condition::Gone { .. } if !is_changed => {
                        events.push(number, EventKind::Returned);
                        robot.condition = Condition::Away { seen: None, is_told: false };
                    }
                    _ => {}
                }
                robot.quality = InputQuality::Lost;
            }
            Verdict::Silent => {
                robot.unanswered = robot.unanswered.saturating_add(1);
                robot.doubtful = 0;
                robot.quality = InputQuality::Lost;
            }
        }
    }

    /// Gives up robots that have not answered for long.
    #[cold]
    fn let_go(&mut self) {
        for (number, robot) in self.robots.iter_mut().enumerate() {
            let may_leave = matches!(robot.condition, Condition::InOp | Condition::Away { .. });
            if robot.unanswered >= GONE_AFTER && may_leave {
                robot.condition = Condition::Gone { answers: false, is_told: false };
                robot.quality = InputQuality::Lost;
                self.events.push(number, EventKind::Gone);
            }
        }
    }

    /// Hands on what a subdevice said in its mailbox.
    fn take_notice(&mut self) {
        let Some(notice) = self.driver.take_notice() else { return };
        if let NoticeKind::Emergency { code, register } = notice.kind {
            let station = |member: &Member| member.station == notice.station;
            if let Some(robot) = self.shared.members.iter().position(station) {
                self.events.push(robot, EventKind::Emergency { code, register });
            }
        }
    }

    /// What came of the task for a robot.
    #[cold]
    fn take_outcome(&mut self, outcome: CareOutcome, now: Instant) {
        let Some(Care { robot: number, kind, .. }) = self.care.take() else { return };
        let Some(robot) = self.robots.get_mut(number) else { return };
        let mut tell = |kind| self.events.push(number, kind);
        match outcome {
            CareOutcome::Seen { state, code } => {
                if let Condition::Away { is_told, .. } = robot.condition {
                    if !is_told {
                        let state = state.unwrap_or(AlState::Init);
                        tell(EventKind::Fell { state, code });
                    }
                    robot.condition = Condition::Away { seen: state, is_told: true };
                    if state.is_none() {
                        robot.care_at = now + TRY_AGAIN_AFTER;
                    }
                }
            }
            CareOutcome::Answers => {
                if let Condition::Gone { answers, is_told } = &mut robot.condition {
                    if !*is_told {
                        tell(EventKind::Returned);
                    }
                    (*answers, *is_told) = (true, true);
                }
            }
            CareOutcome::InSight => {
                if let Condition::Gone { is_told, .. } = robot.condition {
                    if !is_told {
                        tell(EventKind::Returned);
                    }
                    robot.condition = Condition::Away { seen: None, is_told: true };
                }
            }
            CareOutcome::Silent => {
                robot.care_at = now + FIND_EVERY;
                if matches!(kind, CareKind::Lift | CareKind::Restore) {
                    tell(EventKind::NotYetBack { state: None, code: AlStatusCode::NO_ERROR });
                    robot.care_at = now + TRY_AGAIN_AFTER;
                }
                match &mut robot.condition {
                    Condition::Gone { answers, .. } => *answers = false,
                    Condition::Away { seen, .. } => *seen = None,
                    _ => {}
                }
            }
            CareOutcome::InOp => {
                tell(EventKind::BackInOp);
                robot.condition = Condition::InOp;
                (robot.unanswered, robot.doubtful) = (0, 0);
                // The first inputs come with the next exchange.
                robot.quality = InputQuality::Lost;
            }
            CareOutcome::Failed { state, code } => {
                tell(EventKind::NotYetBack { state: Some(state), code });
                robot.condition = Condition::Away { seen: None, is_told: true };
                robot.care_at = now + TRY_AGAIN_AFTER;
            }
            CareOutcome::LayoutChanged(mismatch) => {
                tell(EventKind::LayoutChanged(mismatch));
                robot.condition = Condition::Blocked;
            }
            CareOutcome::ImageChanged => {
                tell(EventKind::ImageChanged);
                robot.condition = Condition::Blocked;
            }
            CareOutcome::AnotherDevice => {
                tell(EventKind::AnotherDevice);
                robot.condition = Condition::Blocked;
            }
        }
    }

    /// Ends a task that does not advance, and gives the next robot that needs one a task.
    #[cold]
    fn look_after(&mut self, now: Instant) {
        if self.care.as_ref().is_some_and(|care| now >= care.give_up_at) {
            self.task = None;
            if self.parked.is_none() {
                self.driver.forget_task();
            }
            self.take_outcome(CareOutcome::Silent, now);
        }
        let is_restart = self.care.as_ref().map(|care| care.kind == CareKind::Restore);
        if is_restart == Some(false) {
            return;
        }
        // A few frames for one that fell must not wait for the thousands of one that restarted.
        let only_short = is_restart.is_some() || self.parked.is_some();
        match (self.next_wanting(now, only_short), is_restart) {
            (Some((robot, kind)), _) => {
                if let (Some(care), Some(task)) = (self.care.take(), self.task.take()) {
                    self.parked = Some((care, task));
                }
                self.begin_care(robot, kind, now);
            }
            (None, None) => {
                if let Some((care, task)) = self.parked.take() {
                    (self.care, self.task) = (Some(care), Some(task));
                }
            }
            (None, Some(_)) => {}
        }
    }

    /// The next robot in turn that needs a task, other than those that have one.
    fn next_wanting(&self, now: Instant, only_short: bool) -> Option<(usize, CareKind)> {
        let count = self.robots.len();
        (0..count)
            .map(|step| (self.next_care + step) % count)
            .filter(|number| !self.has_care(*number))
            .filter_map(|number| Some((number, self.robots.get(number)?.needs(now)?)))
            .find(|(_, kind)| !only_short || matches!(kind, CareKind::Look | CareKind::Lift))
    }

    /// Whether a task for this robot is under way or waits.
    fn has_care(&self, robot: usize) -> bool {
        let parked = self.parked.as_ref().map(|(care, _)| care);
        self.care.iter().chain(parked).any(|care| care.robot == robot)
    }

    fn begin_care(&mut self, robot: usize, kind: CareKind, now: Instant) {
        self.next_care = robot + 1;
        let carer = Carer {
            shared: Arc::clone(&self.shared),
            time: self.driver.time(),
            settings: Arc::clone(&self.settings),
        };
        self.task = Some(std::boxed::Box::pin(carer.run(kind, robot)));
        self.care =
            Some(Care { kind, robot, give_up_at: now + limit_of(kind, self.settings.cycle) });
    }

    /// What happened since, oldest first; 64 are kept.
    pub fn poll_event(&mut self) -> Option<SegmentEvent> {
        self.events.pop()
    }

    /// The robots that are driven, in their order.
    #[must_use]
    pub fn robots(&self) -> &[RobotFound] {
        &self.found
    }

    /// Every subdevice of the segment, in the order of the segment.
    #[must_use]
    pub fn subdevices(&self) -> &[SubDeviceFound] {
        &self.subdevices
    }

    /// What the exchanges were like since all robots were in OP.
    #[must_use]
    pub const fn statistics(&self) -> &SegmentStatistics {
        &self.statistics
    }

    /// The settings that the segment was started with.
    #[must_use]
    pub fn settings(&self) -> &SegmentSettings {
        &self.settings
    }

    /// Frames sent and received, the start included.
    #[must_use]
    pub const fn frames(&self) -> FrameCounters {
        self.driver.counters()
    }

    /// The wire.
    #[must_use]
    pub const fn wire(&self) -> &W {
        self.driver.wire()
    }

    /// The wire, to be acted upon between exchanges.
    pub const fn wire_mut(&mut self) -> &mut W {
        self.driver.wire_mut()
    }

    /// Asks every robot for INIT and gives the wire back. A robot that does not answer is left to its
    /// watchdog. Outputs of zero should have been exchanged before.
    pub fn close(mut self) -> W {
        let stations: Vec<u16> = self.shared.members.iter().map(|member| member.station).collect();
        for station in stations {
            let leave = super::start::request_init(&self.shared.main_device, station);
            let _ = self.driver.block_on(Duration::from_millis(50), leave);
        }
        self.abandon()
    }

    /// Gives the wire back without a word to the robots, as if this process had died: their watchdogs
    /// will notice.
    pub fn abandon(self) -> W {
        let Self { task, shared, driver, .. } = self;
        // The pool wants its main device back unshared.
        drop((task, shared));
        driver.into_wire()
    }

    /// Whether `robot` is not driven any more: something else stands in its place.
    #[must_use]
    pub fn is_blocked(&self, robot: usize) -> bool {
        self.robots.get(robot).is_some_and(|robot| robot.condition == Condition::Blocked)
    }
}

/// How long a task may take before it counts as stuck: it takes a frame a cycle.
fn limit_of(kind: CareKind, cycle: Duration) -> Duration {
    let own = match kind {
        CareKind::Look | CareKind::Find => Duration::from_millis(300),
        CareKind::Lift => Duration::from_secs(20),
        CareKind::Restore => Duration::from_secs(20),
    };
    let frames = match kind {
        CareKind::Look | CareKind::Find | CareKind::Lift => 20,
        CareKind::Restore => RESTORE_FRAMES,
    };
    own + cycle * frames
}

/// More frames than bringing up a robot takes (about 3,000).
const RESTORE_FRAMES: u32 = 6_000;

/// Losses and a watchdog that was not fed in time may go better the next time.
pub(super) fn is_worth_another_attempt(error: EthercatError) -> bool {
    match error {
        EthercatError::Refused { code, .. } => code == AlStatusCode::SYNC_MANAGER_WATCHDOG,
        EthercatError::TimedOut { .. }
        | EthercatError::Protocol { .. }
        | EthercatError::Emergency { .. } => true,
        _ => false,
    }
}

/// The working counter that the robots in OP of a frame make.
fn counter_of(reply: &GroupReply) -> u16 {
    let in_op = |state: &&u8| AlState::from_wire(**state) == Some(AlState::Op);
    reply.states.iter().filter(in_op).map(|_| PER_ROBOT).sum()
}

/// A signed number of nanoseconds as what to add and what to take away.
fn nudge(ns: i64) -> (Duration, Duration) {
    let size = Duration::from_nanos(ns.unsigned_abs());
    if ns >= 0 { (size, Duration::ZERO) } else { (Duration::ZERO, size) }
}

impl<W: Wire> CyclicSegment for EthercatSegment<W> {
    type Error = EthercatError;

    fn robot_count(&self) -> usize {
        self.robots.len()
    }

    fn write_outputs(&mut self, robot: usize, outputs: &[u8]) {
        if let (Some(robot), Ok(outputs)) = (self.robots.get_mut(robot), outputs.try_into()) {
            robot.outputs = outputs;
        }
    }

    /// One bus cycle. Never fails: what goes wrong shows in the qualities and the events.
    fn exchange(&mut self, now: Instant) -> Result<(), EthercatError> {
        // Either may be ahead of the other.
        let (callers, wires) = *self.began.get_or_insert_with(|| (now, self.driver.now()));
        self.driver.wire_mut().advance_to(wires + now.saturating_duration_since(callers));
        self.cycle();
        Ok(())
    }

    fn read_inputs(&self, robot: usize, inputs: &mut [u8]) -> InputQuality {
        match self.robots.get(robot) {
            Some(robot) if inputs.len() == INPUT_LEN => {
                inputs.copy_from_slice(&robot.inputs);
                robot.quality
            }
            _ => InputQuality::Lost,
        }
    }

    fn nudge_ns(&self) -> i64 {
        self.nudge_ns
    }
}
