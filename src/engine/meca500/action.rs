//! Actions: what a caller asks of the robot's state, and the lane they are done in.
//!
//! Pause and clear act at once, each in its own right, and drop what could still power or move the
//! robot. Everything else is done one after another in the order it was asked for; deactivation drops
//! all that is before it. The steps themselves are in `bits.rs`.
//!
//! ```text
//! request -> queue -> running: step 1 .. step n -> result -> ActionDone / ActionFailed
//!                       |  time limit, error, superseded, link lost, reboot -> failed
//! ```
//!
//! Invariants: each request ends in exactly one event; a kind can be asked for again when that event
//! has found its place in the event queue; a time limit never counts as confirmation.

use super::Engine;
use super::bits::{Running, Stage, Step};
use super::connection::Phase;
use super::event::{AbortReason, Event, Events, Fault, VelocityStop};
use super::inputs::Inputs;
use super::ring::Ring;
use super::ticket::RequestError;
use crate::time::{Duration, Instant};
use crate::wire::meca500::command::MotionCommandId;
use crate::wire::meca500::image::SafetySignals;

/// Something the robot's state shall become.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Power the motors. Confirmed by Activated.
    Activate,
    /// Cut the motors; what is asked for and not done yet is superseded. Confirmed by Activated 0.
    Deactivate,
    /// Home. Confirmed by Homed.
    Home,
    /// Leave error mode. Confirmed by ErrorCode 0.
    ResetError,
    /// Resume motion, after clearing what an error may have left. Confirmed by Paused 0.
    Resume,
    /// Pause motion at once and keep the queue; PauseMotion stays set until the next resume. An
    /// activation, homing, resume, bring-up or recovery asked for before is superseded; a homing that
    /// goes on in the robot is only ended by [`Deactivate`](Self::Deactivate). Confirmed by Paused.
    Pause,
    /// Stop at once and empty the queue; what waits in the engine is dropped, and the same actions are
    /// superseded as by [`Pause`](Self::Pause). Confirmed by Cleared.
    Clear,
    /// Simulation on or off, while deactivated. Confirmed by SimActivated.
    Simulation(bool),
    /// Recovery mode on or off. Confirmed by RecoveryMode.
    RecoveryMode(bool),
    /// Brakes of a deactivated robot, if the configuration allows it. Released ones stay released
    /// until engaged, activated or disconnected: the arm may fall. Confirmed by BrakesEngaged.
    Brakes {
        /// Whether they shall hold.
        engaged: bool,
    },
    /// Sets the robot's clock to this UNIX time, in seconds. The robot does not confirm it: done means
    /// that it was shown for the configured number of cycles.
    HostTime(u32),
    /// Reboot a deactivated robot. Confirmed by its clock going back, or by the loss of the connection
    /// and a robot behind it that is as after power-up: deactivated, not homed, MoveID 0.
    Reboot,
    /// Forget the homing, while deactivated. Confirmed by the echo.
    ClearHoming,
    /// Reset what ResumeMotion can reset, activate, home, and resume where motion is paused.
    BringUp,
    /// Reset the error and resume.
    Recover,
    /// Leave EtherCAT for TCP/IP. Confirmed by the loss of the connection.
    DisableEtherCat,
}

impl Action {
    const fn bit(self) -> u32 {
        1 << match self {
            Self::Activate => 0,
            Self::Deactivate => 1,
            Self::Home => 2,
            Self::ResetError => 3,
            Self::Resume => 4,
            Self::Pause => 5,
            Self::Clear => 6,
            Self::Simulation(_) => 7,
            Self::RecoveryMode(_) => 8,
            Self::Brakes { .. } => 9,
            Self::HostTime(_) => 10,
            Self::Reboot => 11,
            Self::ClearHoming => 12,
            Self::BringUp => 13,
            Self::Recover => 14,
            Self::DisableEtherCat => 15,
        }
    }

    /// Whether it could power or move the robot, so that a stop goes before it.
    const fn moves(self) -> bool {
        matches!(self, Self::BringUp | Self::Activate | Self::Home | Self::Resume | Self::Recover)
    }

    /// The step at `index`.
    fn step(self, index: u8) -> Option<Step> {
        let steps: &[Step] = match self {
            Self::Activate => &[Step::Activate],
            Self::Deactivate => &[Step::Deactivate],
            Self::Home => &[Step::Home { or_recovery: false }],
            Self::ResetError => &[Step::ResetError],
            Self::Resume => &[Step::Resume { always: true }],
            Self::Simulation(true) => &[Step::Simulation(true)],
            Self::Simulation(false) => &[Step::Simulation(false)],
            Self::RecoveryMode(true) => &[Step::Recovery(true)],
            Self::RecoveryMode(false) => &[Step::Recovery(false)],
            Self::Brakes { engaged: true } => &[Step::Brakes(true)],
            Self::Brakes { engaged: false } => &[Step::Brakes(false)],
            Self::HostTime(seconds) => {
                return (index == 0).then_some(Step::HostTime(seconds));
            }
            Self::Reboot => &[Step::Send(Internal::Reboot), Step::AwaitReboot],
            Self::ClearHoming => &[Step::Send(Internal::ClearHoming)],
            Self::BringUp => &[
                // A released P-Stop 2 may keep the robot from being activated, or homed.
                Step::ResetStops,
                Step::Activate,
                Step::ResetStops,
                Step::Home { or_recovery: true },
                Step::Resume { always: false },
            ],
            Self::Recover => &[Step::ResetError, Step::Resume { always: true }],
            Self::DisableEtherCat => &[Step::DisableEtherCat],
            Self::Pause | Self::Clear => &[],
        };
        steps.get(usize::from(index)).copied()
    }
}

/// A command that belongs to an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Internal {
    Reboot,
    ClearHoming,
}

impl Internal {
    pub(super) const fn id(self) -> MotionCommandId {
        match self {
            Self::Reboot => MotionCommandId::REBOOT_ROBOT,
            Self::ClearHoming => MotionCommandId::CLEAR_HOMING,
        }
    }
}

/// How far such a command is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Errand {
    Wanted(Internal),
    Sent,
    Acknowledged,
    Refused,
}

/// The end of a time limit, which counts from the first cycle after the request: however long the
/// caller takes to call the next one, the robot was shown the bit.
#[derive(Clone, Copy, Debug)]
pub(super) enum Deadline {
    NotBegun,
    At(Instant),
}

impl Deadline {
    fn passed(&mut self, now: Instant, limit: Duration) -> bool {
        match *self {
            Self::NotBegun => {
                *self = Self::At(now + limit);
                false
            }
            Self::At(deadline) => now >= deadline,
        }
    }
}

/// The clearing of the queue.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clearing {
    pub(super) for_action: bool,
    /// Cycles ClearMotion is set, or 0 between two pulses.
    pub(super) raised: bool,
    pub(super) fresh: u16,
    pub(super) deadline: Deadline,
}

/// `repr(C)`: what every cycle looks at comes first, behind the engine's own hot fields.
#[derive(Clone, Debug)]
#[repr(C)]
pub(super) struct Actions {
    pub(super) running: Option<Running>,
    /// Kinds without their final event.
    pending: u32,
    /// PauseMotion as commanded.
    pub(super) pause: bool,
    pub(super) pausing: Option<Deadline>,
    pub(super) clearing: Option<Clearing>,
    pub(super) simulation: Option<bool>,
    pub(super) recovery: Option<bool>,
    pub(super) brakes: Option<bool>,
    pub(super) errand: Option<Errand>,
    /// Fresh cycles in which every trigger bit was 0.
    pub(super) triggers_low: u16,
    /// Fresh cycles in which PauseMotion and ClearMotion were 0.
    pub(super) stops_low: u16,
    queue: Ring<Action, 16>,
    results: Ring<(Action, Option<Fault>), 16>,
}

impl Actions {
    pub(super) const fn new() -> Self {
        Self {
            queue: Ring::new(Action::Pause),
            results: Ring::new((Action::Pause, None)),
            running: None,
            pending: 0,
            pause: false,
            pausing: None,
            clearing: None,
            simulation: None,
            recovery: None,
            brakes: None,
            errand: None,
            triggers_low: 0,
            stops_low: 0,
        }
    }

    #[inline]
    pub(super) const fn is_acting(&self) -> bool {
        self.pending != 0
    }

    #[inline]
    pub(super) const fn is_clearing(&self) -> bool {
        self.clearing.is_some()
    }

    /// Whether ResumeMotion is 1.
    #[inline]
    pub(super) fn is_resuming(&self) -> bool {
        self.running.is_some_and(|running| {
            matches!(running.step, Step::Resume { .. }) && running.stage != Stage::Start
        })
    }

    pub(super) fn end(&mut self, action: Action, fault: Option<Fault>) {
        self.results.push((action, fault));
    }

    /// Moves results to the event queue as far as there is room.
    #[inline]
    pub(super) fn say_results(&mut self, events: &mut Events) {
        // Each result belongs to a pending kind.
        if self.is_acting() {
            self.say_pending_results(events);
        }
    }

    fn say_pending_results(&mut self, events: &mut Events) {
        while let Some(&(action, fault)) = self.results.front() {
            let event = match fault {
                None => Event::ActionDone(action),
                Some(fault) => Event::ActionFailed { action, fault },
            };
            if !events.state(event) {
                return;
            }
            self.results.pop();
            self.pending &= !action.bit();
        }
    }

    /// The command an action wants to send.
    #[inline]
    pub(super) fn wants_to_send(&self) -> Option<Internal> {
        match self.errand? {
            Errand::Wanted(internal) => Some(internal),
            _ => None,
        }
    }

    pub(super) fn sent(&mut self, _: Internal) {
        self.errand = Some(Errand::Sent);
    }

    pub(super) fn acknowledged(&mut self, _: Internal) {
        if self.errand == Some(Errand::Sent) {
            self.errand = Some(Errand::Acknowledged);
        }
    }

    pub(super) fn refused(&mut self, _: Internal) {
        if self.errand == Some(Errand::Sent) {
            self.errand = Some(Errand::Refused);
        }
    }

    /// Takes over the levels the robot shows, where the caller has not commanded any.
    pub(super) fn adopt(&mut self, inputs: &Inputs) {
        use crate::wire::meca500::image::RobotStatusFlags;
        let simulation = inputs.robot.contains(RobotStatusFlags::SIM_ACTIVATED);
        self.simulation.get_or_insert(simulation);
        self.recovery.get_or_insert(inputs.recovery());
    }

    /// The connection is gone: only a reboot is still waited for.
    pub(super) fn link_lost(&mut self) {
        self.end_all(Fault::LinkLost);
        // What the robot shows next time counts, not what was commanded before.
        self.simulation = None;
        self.recovery = None;
    }

    /// The robot rebooted: its levels are those of power-up.
    pub(super) fn rebooted(&mut self) {
        if let Some(Running { action: Action::Reboot, .. }) = self.running {
            self.running = None;
            self.end(Action::Reboot, None);
        }
        self.end_all(Fault::RobotRebooted);
        self.simulation = None;
        self.recovery = None;
    }

    fn end_all(&mut self, fault: Fault) {
        match self.running {
            Some(Running { step: Step::AwaitReboot, .. }) => {}
            Some(Running { action: action @ Action::DisableEtherCat, stage, .. }) => {
                let left = fault == Fault::LinkLost && stage != Stage::Start;
                self.running = None;
                self.end(action, if left { None } else { Some(fault) });
            }
            Some(Running { action, .. }) => {
                self.running = None;
                self.end(action, Some(fault));
            }
            None => {}
        }
        while let Some(action) = self.queue.pop() {
            self.end(action, Some(fault));
        }
        if self.pausing.take().is_some() {
            self.end(Action::Pause, Some(fault));
        }
        if self.clearing.take().is_some_and(|clearing| clearing.for_action) {
            self.end(Action::Clear, Some(fault));
        }
        self.pause = false;
        self.brakes = None;
        if self.running.is_none() {
            self.errand = None;
        }
    }
}

impl<const QUEUE: usize> Engine<QUEUE> {
    /// Asks for an action; it ends in one `ActionDone` or `ActionFailed`.
    ///
    /// # Errors
    ///
    /// One of its kind is pending, there is no connection that allows control, or it is not allowed.
    pub fn request(&mut self, action: Action) -> Result<(), RequestError> {
        if self.is_monitoring() {
            return Err(RequestError::MonitoringOnly);
        }
        if !self.is_connected() {
            return Err(RequestError::NotConnected);
        }
        match action {
            Action::Brakes { .. } if !self.config.allow_brakes => {
                return Err(RequestError::BrakesNotAllowed);
            }
            Action::HostTime(0) => return Err(RequestError::HostTimeZero),
            _ => {}
        }
        if self.actions.pending & action.bit() != 0 {
            return Err(RequestError::Pending);
        }
        self.actions.pending |= action.bit();
        match action {
            Action::Pause => self.start_pause(),
            Action::Clear => self.start_clear(true),
            Action::Deactivate => {
                self.supersede_all();
                self.actions.queue.push(action);
            }
            _ => {
                self.actions.queue.push(action);
            }
        }
        Ok(())
    }

    /// Activates, homes, and resumes where motion is paused: [`Action::BringUp`].
    ///
    /// # Errors
    ///
    /// As [`request`](Self::request).
    pub fn bring_up(&mut self) -> Result<(), RequestError> {
        self.request(Action::BringUp)
    }

    /// Resets the error and resumes: [`Action::Recover`]. A robot the error deactivated needs
    /// [`bring_up`](Self::bring_up) afterwards.
    ///
    /// # Errors
    ///
    /// As [`request`](Self::request).
    pub fn recover(&mut self) -> Result<(), RequestError> {
        self.request(Action::Recover)
    }

    /// Whether a stop is being commanded.
    pub(super) fn stops_commanded(&self) -> bool {
        self.actions.pause || self.actions.is_clearing()
    }

    fn start_pause(&mut self) {
        self.actions.pause = true;
        self.actions.pausing = Some(Deadline::NotBegun);
        self.supersede_moving();
        self.end_velocity(VelocityStop::RobotState);
    }

    /// Clears the robot's queue; for the caller, or before motion resumes.
    pub(super) fn start_clear(&mut self, for_action: bool) {
        let deadline = Deadline::NotBegun;
        if let Some(clearing) = &mut self.actions.clearing {
            clearing.for_action |= for_action;
            clearing.deadline = deadline;
        } else {
            let clearing = Clearing { for_action, raised: true, fresh: 0, deadline };
            self.actions.clearing = Some(clearing);
        }
        if for_action {
            self.supersede_moving();
            self.end_velocity(VelocityStop::RobotState);
            self.drop_waiting(self.waiting_motion_live(), AbortReason::Cleared);
        }
        self.withdraw_motion(AbortReason::Cleared);
    }

    /// A stop goes before everything under way or queued that could power or move the robot.
    fn supersede_moving(&mut self) {
        if self.actions.running.is_some_and(|running| running.action.moves()) {
            self.end_running(Some(Fault::Superseded));
        }
        for _ in 0..self.actions.queue.len() {
            match self.actions.queue.pop() {
                Some(action) if action.moves() => {
                    self.actions.end(action, Some(Fault::Superseded));
                }
                Some(action) => {
                    self.actions.queue.push(action);
                }
                None => {}
            }
        }
    }

    /// A robot that was told to reboot leaves the bus, often before it acknowledges: what is waited
    /// for then is its return.
    pub(super) fn await_reboot(&mut self) {
        if let Some(running) = &mut self.actions.running
            && running.step == Step::Send(Internal::Reboot)
            && matches!(self.actions.errand, Some(Errand::Sent | Errand::Acknowledged))
        {
            self.actions.errand = None;
            running.index = running.index.saturating_add(1);
            running.step = Step::AwaitReboot;
            running.stage = Stage::Held { fresh: 0, resets: SafetySignals::empty() };
            running.deadline = self.now + self.config.limits.reboot;
        }
    }

    /// Whether the robot that was told to reboot is back as after power-up. Its clock need not tell:
    /// it may go on, or be ahead of what it was already.
    pub(super) fn came_back_from_reboot(&self, inputs: &Inputs) -> bool {
        self.phase == Phase::Offline
            && self.actions.running.is_some_and(|running| running.step == Step::AwaitReboot)
            && !inputs.activated()
            && !inputs.homed()
            && inputs.move_id == 0
    }

    fn supersede_all(&mut self) {
        if self.actions.running.is_some() {
            self.end_running(Some(Fault::Superseded));
        }
        while let Some(action) = self.actions.queue.pop() {
            self.actions.end(action, Some(Fault::Superseded));
        }
    }

    /// Ends the running action and takes its bits back.
    pub(super) fn end_running(&mut self, fault: Option<Fault>) {
        if let Some(running) = self.actions.running.take() {
            self.release(running.step, fault.is_some());
            self.actions.errand = None;
            self.actions.end(running.action, fault);
        }
    }

    fn limit_of(&self, step: Step) -> Duration {
        let limits = &self.config.limits;
        match step {
            Step::Activate => limits.activate,
            Step::Deactivate => limits.deactivate,
            Step::Home { .. } => limits.home,
            Step::ResetError => limits.reset_error,
            Step::Resume { .. } => limits.resume,
            Step::AwaitReboot => limits.reboot,
            Step::ResetStops
            | Step::Simulation(_)
            | Step::Recovery(_)
            | Step::Brakes(_)
            | Step::HostTime(_)
            | Step::Send(_)
            | Step::DisableEtherCat => limits.setting,
        }
    }

    /// Begins the step at `index` of `action`; false when there is none.
    pub(super) fn begin_step(&mut self, action: Action, index: u8) -> bool {
        let Some(step) = action.step(index) else { return false };
        let deadline = self.now + self.limit_of(step);
        let error_before = self.inputs.error_code;
        let stage = Stage::Start;
        self.actions.running = Some(Running { action, index, step, stage, deadline, error_before });
        true
    }

    pub(super) fn begin_next_action(&mut self) {
        if self.actions.running.is_none()
            && let Some(action) = self.actions.queue.pop()
        {
            self.begin_step(action, 0);
        }
    }

    /// Time limits run whatever the inputs are.
    pub(super) fn watch_action_limits(&mut self) {
        if self.actions.running.is_some_and(|running| self.now >= running.deadline) {
            let waits_for_signal = self
                .actions
                .running
                .is_some_and(|running| matches!(running.step, Step::Resume { .. }))
                && !self.inputs.blocking_stops().is_empty();
            let fault = if waits_for_signal { Fault::SafetyStopPresent } else { Fault::Timeout };
            self.end_running(Some(fault));
        }
        let (now, limits) = (self.now, self.config.limits);
        let pausing = self.actions.pausing.as_mut();
        if pausing.is_some_and(|deadline| deadline.passed(now, limits.pause)) {
            // The bit stays: a stop that nobody confirmed is still wanted.
            self.actions.pausing = None;
            self.actions.end(Action::Pause, Some(Fault::Timeout));
        }
        let clearing = self.actions.clearing.as_mut();
        if clearing.is_some_and(|clearing| clearing.deadline.passed(now, limits.clear)) {
            let for_action =
                self.actions.clearing.take().is_some_and(|clearing| clearing.for_action);
            self.lower_clear();
            if for_action {
                self.actions.end(Action::Clear, Some(Fault::Timeout));
            } else if self.actions.running.is_some() {
                self.end_running(Some(Fault::Timeout));
            }
        }
    }
}
