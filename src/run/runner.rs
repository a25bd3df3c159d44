//! The program runner: gives the steps of a [`Program`] to an engine and follows what becomes of them.
//!
//! ```text
//!            connected             action                      hold
//! Connecting ---------> Streaming --------> Acting   Streaming -----> Holding --> Fencing
//!                          |  ^-----done------'          ^-------------------------'
//!                          |all steps ended
//!                          v            interrupt, refusal, fault
//!                      Completed        any stage ---------------> Stopping --> end
//! ```
//!
//! Stopping is pausing and clearing where the robot is ready for motion, and deactivation where it is
//! being activated or homed: a pause does not end a homing. Nothing is asked of a robot that is not
//! activated, or that an error or a safety signal has stopped.
//!
//! * **Commands** stream ahead: they are submitted as fast as the engine has room.
//! * **PauseMotion, ClearMotion, ResumeMotion, ResetError** act when the robot has *accepted* every
//!   line before them, as they would when typed: on what is queued by then.
//! * **Every other action** (ActivateRobot, Home, DeactivateRobot, ...) waits until every line before
//!   it is *done*, and the lines after it wait for its confirmation.
//! * **A velocity line** waits until every line before it is done, holds its velocity for the velocity
//!   timeout in force (0.05 s unless SetVelTimeout said otherwise, stretched by SetTimeScaling), and
//!   goes on to the next line; consecutive velocity lines follow each other without a stop. Behind the
//!   last one a `Delay(0)` is queued: it is executed when the motion has come to a stop, and its
//!   checkpoint says so.
//!
//! Invariants: completion comes from tickets alone, never from EOB or EOM; [`Runner::after_turn`] does
//! not allocate; no run ends with motion going on, unless the link is lost.

use super::outcome::{End, Outcome, Stop};
use super::program::Program;
use super::record::{Counts, Ledger, StepEnd, StepRecord};
use super::statistics::Distribution;
use crate::engine::meca500::{
    Action, ConnectionPhase, Engine, Event, Fault, RequestError, SubmitError, Ticket, WaitReason,
};
use crate::time::{Duration, Instant};
use crate::wire::meca500::code::Code;
use crate::wire::meca500::command::{MotionCommand, VelocityCommand};
use crate::wire::meca500::image::{MotionStatusFlags, RobotStatusFlags};
use crate::wire::meca500::text::Statement;

/// Time for a connection to be made. Longer than the engine's own limit for the byte order.
const CONNECT_LIMIT: Duration = Duration::from_secs(10);
/// Time for stopping the robot, after which outputs go safe all the same.
pub const STOP_LIMIT: Duration = Duration::from_secs(2);
/// Time after which commands that the robot's state holds back end the run.
const HELD_BACK_LIMIT: Duration = Duration::from_secs(2);
/// Cycles after an error in which the fate of the other commands is waited for.
const GRACE_CYCLES: u32 = 8;
/// Velocity timeout in force until SetVelTimeout changes it. Source: PM L385.
pub(super) const VELOCITY_TIMEOUT_S: f64 = 0.05;

/// What the runner is at.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Connecting {
        since: Option<Instant>,
    },
    Streaming,
    /// Waiting for the confirmation of `action`; `then` follows it. No step: bringing up.
    Acting {
        action: Action,
        then: Option<Action>,
        step: Option<usize>,
    },
    Holding {
        step: usize,
        velocity: VelocityCommand,
        until: Instant,
    },
    Fencing {
        step: usize,
    },
    Stopping {
        outcome: Outcome,
        since: Instant,
        action: Action,
    },
    Ended(Outcome),
}

/// What a run is at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Phase {
    /// No connection yet.
    #[default]
    Connecting,
    /// The robot is being activated and homed before the first line that needs it.
    BringingUp,
    /// Lines are being executed.
    Running,
    /// Motion is being paused and cleared.
    Stopping,
}

/// Follows one program through one engine.
#[derive(Debug)]
pub struct Runner<'p> {
    program: &'p Program,
    stage: Stage,
    next: usize,
    is_brought_up: bool,
    ledger: Ledger,
    acknowledgement_cycles: Distribution,
    trouble: Option<(End, u32)>,
    held_back: Option<(WaitReason, Instant)>,
    velocity_timeout_s: f64,
    time_scaling_percent: f64,
}

/// Whether there may be more to do in this cycle.
enum Flow {
    Again,
    Wait,
}

impl<'p> Runner<'p> {
    /// A runner at the beginning of `program`. Takes all the memory it will ever need.
    #[must_use]
    pub fn new(program: &'p Program) -> Self {
        Self {
            program,
            stage: Stage::Connecting { since: None },
            next: 0,
            is_brought_up: false,
            ledger: Ledger::new(program.steps().len()),
            acknowledgement_cycles: Distribution::of_acknowledgements(),
            trouble: None,
            held_back: None,
            velocity_timeout_s: VELOCITY_TIMEOUT_S,
            time_scaling_percent: 100.0,
        }
    }

    /// What became of each step, in the order of the program.
    #[must_use]
    pub fn records(&self) -> &[StepRecord] {
        self.ledger.records()
    }

    /// Steps by what became of them.
    #[must_use]
    pub const fn counts(&self) -> Counts {
        self.ledger.counts()
    }

    /// Cycles from sending a command to its acknowledgement.
    #[must_use]
    pub const fn acknowledgement_cycles(&self) -> &Distribution {
        &self.acknowledgement_cycles
    }

    /// What the run is at.
    #[must_use]
    pub const fn phase(&self) -> Phase {
        match self.stage {
            Stage::Connecting { .. } => Phase::Connecting,
            Stage::Acting { step: None, .. } => Phase::BringingUp,
            Stage::Stopping { .. } => Phase::Stopping,
            _ => Phase::Running,
        }
    }

    /// The first step that has not ended; the number of steps when all have.
    #[must_use]
    pub const fn current_step(&self) -> usize {
        self.ledger.first_open()
    }

    /// Does what is due after a cycle of the engine; the outcome, once there is one. `tell` hears
    /// every event of the engine.
    pub fn after_turn<const QUEUE: usize>(
        &mut self,
        engine: &mut Engine<QUEUE>,
        now: Instant,
        is_interrupted: bool,
        mut tell: impl FnMut(&Event),
    ) -> Option<Outcome> {
        while let Some(event) = engine.poll_event() {
            tell(&event);
            self.take(engine, event, now);
        }
        let is_ending = matches!(self.stage, Stage::Stopping { .. } | Stage::Ended(_));
        if is_interrupted && !is_ending {
            self.stop(engine, End::Interrupted, now);
        } else if !is_ending {
            self.judge(engine, now);
        }
        while let Flow::Again = self.advance(engine, now) {}
        match self.stage {
            Stage::Ended(outcome) => Some(outcome),
            _ => None,
        }
    }

    /// Ends the run for a reason the engine does not see.
    pub fn give_up<const QUEUE: usize>(
        &mut self,
        engine: &mut Engine<QUEUE>,
        end: End,
        now: Instant,
    ) -> Option<Outcome> {
        if !matches!(self.stage, Stage::Stopping { .. } | Stage::Ended(_)) {
            self.stop(engine, end, now);
        }
        match self.stage {
            Stage::Ended(outcome) => Some(outcome),
            _ => None,
        }
    }

    fn take<const QUEUE: usize>(&mut self, engine: &mut Engine<QUEUE>, event: Event, now: Instant) {
        match event {
            Event::Connected { .. } => {
                if let Stage::Connecting { .. } = self.stage {
                    self.stage = Stage::Streaming;
                }
            }
            Event::Accepted { ticket, latency_cycles } => {
                self.held_back = None;
                self.acknowledgement_cycles.record(latency_cycles.into());
                self.note(ticket, |ledger, step| ledger.accepted(step, now));
            }
            Event::Started { ticket } => {
                self.note(ticket, |ledger, step| ledger.started(step, now));
            }
            Event::Done { ticket } => {
                self.note(ticket, |ledger, step| ledger.ended(step, now, StepEnd::Done));
            }
            Event::Aborted { ticket, reason } => {
                let end = StepEnd::Aborted(reason);
                self.note(ticket, |ledger, step| ledger.ended(step, now, end));
            }
            Event::Unknown { ticket, .. } => {
                self.note(ticket, |ledger, step| ledger.ended(step, now, StepEnd::Unknown));
            }
            Event::Waiting(reason) => self.held_back = Some((reason, now)),
            Event::ActionDone(action) => self.action_ended(engine, action, None, now),
            Event::ActionFailed { action, fault } => {
                self.action_ended(engine, action, Some(fault), now);
            }
            Event::RobotError { code } if self.is_streaming() => {
                self.trouble(End::RobotError(code));
            }
            Event::RobotError { code } if self.is_acting() => {
                // A failed activation or homing is told before the signal that made it fail.
                let status = engine.status();
                self.trouble(if status.blocking_stops.is_empty() {
                    End::RobotError(code)
                } else {
                    End::SafetyStop(status.stops)
                });
            }
            Event::SafetyStop { signals }
                if self.is_streaming()
                    // What can be reset is what bringing up and resuming are for.
                    || self.is_acting() && !engine.status().blocking_stops.is_empty() =>
            {
                self.trouble(End::SafetyStop(signals));
            }
            Event::VelocityStopped(stop) => {
                if let Stage::Holding { .. } = self.stage {
                    self.trouble(End::VelocityStopped(stop));
                }
            }
            Event::MonitoringOnly => self.trouble(End::MonitoringOnly),
            Event::ConnectionLost { .. } if !self.is_rebooting() => match self.stage {
                Stage::Stopping { outcome, .. } => {
                    self.stage = Stage::Ended(Outcome { stop: Stop::LinkLost, ..outcome });
                }
                _ => self.trouble(End::ConnectionLost),
            },
            Event::RobotRebooted if !self.is_rebooting() => self.trouble(End::Rebooted),
            Event::Fault(Fault::ByteOrderUndecidable) => self.trouble(End::ByteOrderUndecidable),
            Event::Fault(fault) => self.trouble(End::Fault(fault)),
            _ => {}
        }
    }

    fn note(&mut self, ticket: Ticket, note: impl FnOnce(&mut Ledger, usize)) {
        if let Some(step) = self.ledger.step_of(ticket) {
            note(&mut self.ledger, step);
        }
    }

    /// Whether the robot is past its bringing up and no action is under way that reports by itself.
    const fn is_streaming(&self) -> bool {
        matches!(self.stage, Stage::Streaming | Stage::Holding { .. } | Stage::Fencing { .. })
            && self.ledger.counts().submitted > 0
    }

    /// Whether an action other than a reboot, after which everything is new, is under way.
    const fn is_acting(&self) -> bool {
        matches!(self.stage, Stage::Acting { .. }) && !self.is_rebooting()
    }

    const fn is_rebooting(&self) -> bool {
        matches!(self.stage, Stage::Acting { action: Action::Reboot, .. })
    }

    /// Remembers the first trouble; what follows from it is no news.
    const fn trouble(&mut self, end: End) {
        if self.trouble.is_none() {
            self.trouble = Some((end, GRACE_CYCLES));
        }
    }

    /// Ends the run over trouble once the fate of the commands under way is told, or over commands
    /// that are held back for too long.
    fn judge<const QUEUE: usize>(&mut self, engine: &mut Engine<QUEUE>, now: Instant) {
        if let Some((end, cycles_left)) = &mut self.trouble {
            if *cycles_left > 0 && self.ledger.counts().open() > 0 {
                *cycles_left -= 1;
                return;
            }
            let end = *end;
            return self.stop(engine, end, now);
        }
        if let Stage::Connecting { since } = &mut self.stage {
            let since = *since.get_or_insert(now);
            if now - since > CONNECT_LIMIT {
                self.finish(End::NotConnected, Stop::NotNeeded);
            }
            return;
        }
        let is_acting = matches!(self.stage, Stage::Acting { .. });
        if let Some((reason, since)) = self.held_back
            && !is_acting
            && is_lasting(reason)
            && self.ledger.counts().open() > 0
            && now - since > HELD_BACK_LIMIT
        {
            self.stop(engine, End::HeldBack(reason), now);
        }
    }

    /// Ends the run, after stopping what the robot does or may be about to do: its state decides how,
    /// whatever the reason is.
    fn stop<const QUEUE: usize>(&mut self, engine: &mut Engine<QUEUE>, end: End, now: Instant) {
        engine.stop_velocity();
        let action = match self.way_to_stop(engine, end) {
            Ok(action) => action,
            Err(stop) => return self.finish(end, stop),
        };
        let outcome = self.outcome(end, Stop::Unconfirmed);
        self.stage = Self::stop_by(engine, action, outcome, now);
    }

    /// The first action that stops the robot, or why there is nothing to stop.
    fn way_to_stop<const QUEUE: usize>(
        &self,
        engine: &Engine<QUEUE>,
        end: End,
    ) -> Result<Action, Stop> {
        let status = engine.status();
        if end == End::Completed || status.phase != ConnectionPhase::Connected {
            return Err(Stop::NotNeeded);
        }
        let is_activated = status.robot.contains(RobotStatusFlags::ACTIVATED);
        let is_busy = status.robot.contains(RobotStatusFlags::BUSY);
        let is_homed = status.robot.contains(RobotStatusFlags::HOMED);
        // The bit of an activation or a homing may be on its way to a robot that does not show it yet.
        let is_readying = matches!(
            self.stage,
            Stage::Acting {
                action: Action::BringUp | Action::Activate | Action::Home | Action::Deactivate,
                ..
            }
        ) && !(is_activated && is_homed);
        if is_busy || is_readying {
            // Pausing does not end a homing.
            return Ok(Action::Deactivate);
        }
        if !is_activated {
            return Err(Stop::NotActivated);
        }
        // An error or a safety signal has stopped the robot if it says so; a mere refusal has not.
        let has_tripped = status.error != Code(0) || !status.stops.is_empty();
        if has_tripped && status.motion.contains(MotionStatusFlags::PAUSED) {
            return Err(Stop::NotNeeded);
        }
        Ok(Action::Pause)
    }

    /// Asks for `action` as a step of the stop; one of its kind that is pending will do.
    fn stop_by<const QUEUE: usize>(
        engine: &mut Engine<QUEUE>,
        action: Action,
        outcome: Outcome,
        since: Instant,
    ) -> Stage {
        match engine.request(action) {
            Ok(()) | Err(RequestError::Pending) => Stage::Stopping { outcome, since, action },
            Err(_) => Stage::Ended(Outcome { stop: Stop::LinkLost, ..outcome }),
        }
    }

    /// The outcome of a run whose link failed: nothing can be asked of the robot any more.
    pub(super) fn link_failed(&mut self, end: End) -> Outcome {
        let outcome = match self.stage {
            Stage::Ended(outcome) => outcome,
            Stage::Stopping { outcome, .. } => Outcome { stop: Stop::LinkLost, ..outcome },
            _ => self.outcome(end, Stop::NotNeeded),
        };
        self.stage = Stage::Ended(outcome);
        outcome
    }

    fn finish(&mut self, end: End, stop: Stop) {
        self.stage = Stage::Ended(self.outcome(end, stop));
    }

    fn outcome(&self, end: End, stop: Stop) -> Outcome {
        let step = match (self.stage, end) {
            (_, End::Completed) => None,
            (Stage::Acting { step, .. }, _) => step,
            (Stage::Holding { step, .. } | Stage::Fencing { step }, _) => Some(step),
            (_, End::Refused(_) | End::RequestRefused(_)) => Some(self.next),
            _ => self.ledger.culprit(),
        };
        Outcome { end, step, stop }
    }

    fn end_of<const QUEUE: usize>(engine: &Engine<QUEUE>, action: Action, fault: Fault) -> End {
        let stops = engine.status().stops;
        match fault {
            Fault::RobotError(code) => End::RobotError(code),
            Fault::LinkLost => End::ConnectionLost,
            Fault::RobotRebooted => End::Rebooted,
            Fault::SafetyStopPresent if !stops.is_empty() => End::SafetyStop(stops),
            fault => End::ActionFailed(action, fault),
        }
    }

    fn action_ended<const QUEUE: usize>(
        &mut self,
        engine: &mut Engine<QUEUE>,
        ended: Action,
        fault: Option<Fault>,
        now: Instant,
    ) {
        match self.stage {
            Stage::Stopping { outcome, .. }
                if matches!(fault, Some(Fault::LinkLost | Fault::RobotRebooted)) =>
            {
                self.stage = Stage::Ended(Outcome { stop: Stop::LinkLost, ..outcome });
            }
            // Not paused is one more reason to clear.
            Stage::Stopping { outcome, since, action: Action::Pause } if ended == Action::Pause => {
                self.stage = Self::stop_by(engine, Action::Clear, outcome, since);
            }
            Stage::Stopping { outcome, action, .. } if ended == action => {
                let stop = match (fault, action) {
                    (Some(_), _) => Stop::Unconfirmed,
                    (None, Action::Deactivate) => Stop::Deactivated,
                    (None, _) => Stop::Confirmed,
                };
                self.stage = Stage::Ended(Outcome { stop, ..outcome });
            }
            Stage::Acting { action, then, step } if ended == action => match (fault, then) {
                (Some(fault), _) => {
                    // What came first is the cause, and the failure what followed.
                    let end = match self.trouble {
                        Some((end, _)) => end,
                        None => Self::end_of(engine, action, fault),
                    };
                    self.stop(engine, end, now);
                }
                (None, Some(then)) => self.act(engine, then, None, step, now),
                (None, None) => {
                    match step {
                        Some(step) => {
                            self.ledger.accepted(step, now);
                            self.ledger.ended(step, now, StepEnd::Done);
                            self.next += 1;
                        }
                        None => self.is_brought_up = true,
                    }
                    self.stage = match action {
                        Action::Reboot => Stage::Connecting { since: None },
                        _ => Stage::Streaming,
                    };
                }
            },
            _ => {}
        }
    }

    fn act<const QUEUE: usize>(
        &mut self,
        engine: &mut Engine<QUEUE>,
        action: Action,
        then: Option<Action>,
        step: Option<usize>,
        now: Instant,
    ) {
        if let Some(step) = step {
            self.ledger.submitted(step, now);
            self.ledger.started(step, now);
        }
        match engine.request(action) {
            Ok(()) => self.stage = Stage::Acting { action, then, step },
            Err(error) => self.stop(engine, End::RequestRefused(error), now),
        }
    }

    fn advance<const QUEUE: usize>(&mut self, engine: &mut Engine<QUEUE>, now: Instant) -> Flow {
        match self.stage {
            Stage::Connecting { .. } | Stage::Acting { .. } | Stage::Ended(_) => Flow::Wait,
            Stage::Streaming if self.trouble.is_some() => Flow::Wait,
            Stage::Streaming => self.stream(engine, now),
            Stage::Holding { step, velocity, until } => {
                self.hold(engine, step, velocity, until, now)
            }
            Stage::Fencing { step } => {
                if let Ok(ticket) = engine.submit(MotionCommand::Delay(0.0)) {
                    self.ledger.tie(ticket, step);
                    self.stage = Stage::Streaming;
                    return Flow::Again;
                }
                Flow::Wait
            }
            Stage::Stopping { outcome, since, .. } => {
                if now - since > STOP_LIMIT {
                    self.stage = Stage::Ended(outcome);
                }
                Flow::Wait
            }
        }
    }

    fn stream<const QUEUE: usize>(&mut self, engine: &mut Engine<QUEUE>, now: Instant) -> Flow {
        let open = self.ledger.counts().open();
        if self.program.bring_up_before() == Some(self.next) && !self.is_brought_up {
            if open == 0 {
                self.act(engine, Action::BringUp, None, None, now);
            }
            return Flow::Wait;
        }
        let Some(step) = self.program.steps().get(self.next) else {
            if open == 0 {
                self.finish(End::Completed, Stop::NotNeeded);
            }
            return Flow::Wait;
        };
        match step.statement {
            Statement::Motion(MotionCommand::RebootRobot) if open > 0 => Flow::Wait,
            Statement::Motion(MotionCommand::RebootRobot) => {
                self.act(engine, Action::Reboot, None, Some(self.next), now);
                Flow::Wait
            }
            Statement::Motion(command) => self.submit(engine, command, now),
            Statement::Velocity(_) if open > 0 => Flow::Wait,
            Statement::Velocity(velocity) => self.begin_velocity(engine, velocity, now),
            statement => {
                let counts = self.ledger.counts();
                let is_due = if acts_on_the_queue(&statement) {
                    counts.accepted + counts.aborted + counts.unknown >= counts.submitted
                } else {
                    open == 0
                };
                if is_due && let Some((action, then)) = actions_of(&statement) {
                    self.act(engine, action, then, Some(self.next), now);
                }
                Flow::Wait
            }
        }
    }

    fn submit<const QUEUE: usize>(
        &mut self,
        engine: &mut Engine<QUEUE>,
        command: MotionCommand,
        now: Instant,
    ) -> Flow {
        match engine.submit(command) {
            Ok(ticket) => {
                match command {
                    MotionCommand::SetVelTimeout(t) => self.velocity_timeout_s = t.into(),
                    MotionCommand::SetTimeScaling(p) => self.time_scaling_percent = p.into(),
                    _ => {}
                }
                self.ledger.tie(ticket, self.next);
                self.ledger.submitted(self.next, now);
                self.next += 1;
                Flow::Again
            }
            Err(SubmitError::QueueFull | SubmitError::EventsUnread) => Flow::Wait,
            Err(error) => {
                self.stop(engine, End::Refused(error), now);
                Flow::Wait
            }
        }
    }

    /// Takes up the velocity line `self.next`.
    fn begin_velocity<const QUEUE: usize>(
        &mut self,
        engine: &mut Engine<QUEUE>,
        velocity: VelocityCommand,
        now: Instant,
    ) -> Flow {
        match engine.set_velocity(velocity) {
            Ok(()) => {
                let step = self.next;
                self.ledger.submitted(step, now);
                self.ledger.accepted(step, now);
                self.ledger.started(step, now);
                let until = now + self.velocity_hold();
                self.stage = Stage::Holding { step, velocity, until };
                self.next += 1;
            }
            Err(error) => self.stop(engine, End::Refused(error), now),
        }
        Flow::Wait
    }

    /// How long a velocity line lasts: the robot's own timeout runs in the robot's scaled time.
    fn velocity_hold(&self) -> Duration {
        let seconds = self.velocity_timeout_s * 100.0 / self.time_scaling_percent;
        Duration::try_from_secs_f64(seconds).unwrap_or(Duration::ZERO)
    }

    fn hold<const QUEUE: usize>(
        &mut self,
        engine: &mut Engine<QUEUE>,
        step: usize,
        velocity: VelocityCommand,
        until: Instant,
        now: Instant,
    ) -> Flow {
        if self.trouble.is_some() {
            return Flow::Wait;
        }
        if now < until {
            // The engine stops a velocity that nobody asks for again.
            if let Err(error) = engine.set_velocity(velocity) {
                self.stop(engine, End::Refused(error), now);
            }
            return Flow::Wait;
        }
        match self.program.steps().get(self.next).map(|step| step.statement) {
            Some(Statement::Velocity(next)) => {
                self.ledger.ended(step, now, StepEnd::Done);
                self.begin_velocity(engine, next, now)
            }
            _ => {
                engine.stop_velocity();
                self.stage = Stage::Fencing { step };
                Flow::Again
            }
        }
    }
}

/// Whether nothing but another line of the program, or a person, could end the waiting.
#[must_use]
pub const fn is_lasting(reason: WaitReason) -> bool {
    !matches!(
        reason,
        WaitReason::FifoFull
            | WaitReason::LedgerFull
            | WaitReason::EventsUnread
            | WaitReason::VelocityMode
    )
}

/// Whether an action means what is queued by then, instead of what is executed.
pub(super) const fn acts_on_the_queue(statement: &Statement) -> bool {
    matches!(
        statement,
        Statement::PauseMotion
            | Statement::ClearMotion
            | Statement::ResumeMotion
            | Statement::ResetError
    )
}

/// The engine's actions for a statement that is one; two in a row for `ActivateRobot(1)`.
pub(super) const fn actions_of(statement: &Statement) -> Option<(Action, Option<Action>)> {
    Some(match *statement {
        Statement::Motion(_) | Statement::Velocity(_) => return None,
        Statement::Activate { reinitialize: true } => (Action::ClearHoming, Some(Action::Activate)),
        Statement::Activate { reinitialize: false } => (Action::Activate, None),
        Statement::Deactivate => (Action::Deactivate, None),
        Statement::Home => (Action::Home, None),
        Statement::ResetError => (Action::ResetError, None),
        Statement::PauseMotion => (Action::Pause, None),
        Statement::ResumeMotion => (Action::Resume, None),
        Statement::ClearMotion => (Action::Clear, None),
        Statement::ActivateSim => (Action::Simulation(true), None),
        Statement::DeactivateSim => (Action::Simulation(false), None),
        Statement::SetRecoveryMode(on) => (Action::RecoveryMode(on), None),
        Statement::SetRtc(seconds) => (Action::HostTime(seconds), None),
    })
}
