//! The MoveID handshake: one command at a time, exactly once.
//!
//! ```text
//!          something to send              echo, or arm_cycles
//! closed ---------------------> arming ------------------------> open <------------------+
//!   ^     SetPoint 1, ID 0,               MoveID changes, SetPoint   |                   | echo: accepted,
//!   |     fresh MoveID                    stays 1                    v                   | next one in the
//!   |                                                               sent ----------------+ same cycle
//!   |   late echo: accepted; none: verdict                           | no echo in time, or the
//!   +------------------------------------------- withdrawn <---------+ robot can no longer take it
//!                                                 SetPoint 0, the rest frozen
//! ```
//!
//! Why arming: the manual leaves open what a robot compares MoveID with (the last accepted value, or
//! that of the previous cycle, with or without SetPoint). A change of MoveID while SetPoint was
//! already 1 is a trigger under every reading, so the first trigger after SetPoint rises is a "no
//! movement" that may or may not count, and may or may not be acknowledged. While nothing is sent the
//! image again holds "no movement" under the acknowledged MoveID: a robot that triggers when it should
//! not (after a reboot, say) executes nothing.
//!
//! After a bad cycle nothing new is sent for `settle_cycles`, though the echo may be there: outputs
//! that did not arrive may still be under way, and behind newer ones an old MoveID would be a trigger.
//!
//! Invariants: from sending to the echo MoveID, ID and arguments do not change; one MoveID is given
//! to one command; a new MoveID differs from 0, from the echo and from the one before; a command is
//! written to the image once and never again.

use core::num::NonZeroU16;

use super::Engine;
use super::action::Internal;
use super::event::{AbortReason, Event, Fault, Item, UnknownCause, Verdict, WaitReason};
use super::inputs::Inputs;
use super::ledger::Entry;
use super::ticket::{SubmitError, Ticket};
use crate::time::Instant;
use crate::wire::meca500::command::{
    CommandKind, CommandSpec, MotionCommand, MotionCommandId, Requirement,
};

/// State of MoveID, SetPoint, ID and arguments in the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Port {
    /// All zero.
    Closed,
    /// "No movement" under a fresh MoveID, for so many fresh cycles.
    Arming { fresh: u16 },
    /// SetPoint is 1 and the next change of MoveID triggers.
    Open,
    /// A command waits for its echo.
    Sent,
    /// SetPoint is 0 and the command's other fields are frozen, for so many fresh cycles.
    Withdrawn { fresh: u16, why: Withdrawal },
    /// SetPoint 0 on the way to velocity mode.
    Gap { fresh: u16 },
    /// MoveID 0, SetPoint 1.
    Velocity,
}

/// Why a command without an echo was withdrawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Withdrawal {
    AckTimeout,
    Abort(AbortReason),
}

/// When a command is finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Completion {
    /// By a checkpoint behind it.
    Queued,
    /// By its echo.
    Instant,
    /// Not stated: by a checkpoint where the robot has a queue, else by its echo.
    Open,
}

/// What decides when a command can go out, and what becomes of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Terms {
    pub(super) ticket: Ticket,
    completion: Completion,
    requirement: Requirement,
    checkpoint: Option<NonZeroU16>,
}

/// A command to be sent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Waiting {
    pub(super) terms: Terms,
    id: u32,
    arguments: [f32; 6],
}

impl Waiting {
    pub(super) const NONE: Self = Self {
        terms: Terms {
            ticket: Ticket(0),
            completion: Completion::Instant,
            requirement: Requirement::Deactivated,
            checkpoint: None,
        },
        id: 0,
        arguments: [0.0; 6],
    };

    /// A step of an action.
    fn errand(internal: Internal) -> Self {
        Self { id: internal.id().0, ..Self::NONE }
    }

    /// The engine's own checkpoint.
    fn mark(number: u16) -> Self {
        let mut arguments = [0.0; 6];
        if let Some(first) = arguments.first_mut() {
            *first = f32::from(number);
        }
        Self {
            terms: Terms {
                ticket: Ticket(0),
                completion: Completion::Queued,
                requirement: Requirement::ReadyForMotion,
                checkpoint: None,
            },
            id: MotionCommandId::SET_CHECKPOINT.0,
            arguments,
        }
    }
}

impl Terms {
    /// Whether it is lost when the robot's queue is.
    fn needs_motion(&self) -> bool {
        matches!(
            self.requirement,
            Requirement::ReadyForMotion
                | Requirement::ReadyAndHomed
                | Requirement::ActivatedAndHomed
        )
    }
}

/// Whose command it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Owner {
    Ticket(Ticket),
    /// The engine's own checkpoint.
    Mark,
    /// A step of an action.
    Action(Internal),
}

/// The command that waits for its echo.
#[derive(Clone, Copy, Debug)]
pub(super) struct InFlight {
    pub(super) owner: Owner,
    pub(super) id: u32,
    pub(super) move_id: u16,
    /// The echo when it was sent.
    pub(super) previous: u16,
    pub(super) error_before: u16,
    pub(super) completion: Completion,
    needs_motion: bool,
    checkpoint: Option<NonZeroU16>,
    expires: Instant,
    sent_cycle: u64,
}

/// Checkpoints of the engine that may go unanswered before the caller has to decide.
const MARK_TRIES: u8 = 3;

impl InFlight {
    pub(super) const fn needs_motion(&self) -> bool {
        self.needs_motion
    }
}

fn completion_of(kind: CommandKind) -> Completion {
    match kind {
        CommandKind::Queued => Completion::Queued,
        CommandKind::Instantaneous | CommandKind::NoMovement | CommandKind::Velocity => {
            Completion::Instant
        }
        CommandKind::Variable | CommandKind::Unknown => Completion::Open,
    }
}

impl<const QUEUE: usize> Engine<QUEUE> {
    /// Queues a command to be sent as soon as its turn comes and the robot can take it.
    ///
    /// # Errors
    ///
    /// An argument the robot would refuse, a command that cannot be sent this way, no room, or a
    /// connection that only allows monitoring. Nothing was queued then.
    pub fn submit(&mut self, command: MotionCommand) -> Result<Ticket, SubmitError> {
        command.check(self.config.revision)?;
        let (id, arguments) = command.encode();
        let spec = CommandSpec::of(id);
        if spec.is_some_and(|spec| !spec.available) {
            return Err(SubmitError::NotAvailable { id: id.0 });
        }
        let kind = spec.map_or(CommandKind::Unknown, |spec| spec.kind);
        match kind {
            CommandKind::Velocity => return Err(SubmitError::VelocityCommand),
            CommandKind::NoMovement => return Err(SubmitError::NoMovement),
            _ => {}
        }
        let checkpoint = match id {
            MotionCommandId::SET_CHECKPOINT => match MotionCommand::decode(id, arguments) {
                MotionCommand::SetCheckpoint(number @ 1..=8000) => NonZeroU16::new(number),
                _ => return Err(SubmitError::BadCheckpoint),
            },
            _ => None,
        };
        if let Some(number) = checkpoint
            && self.ledger.range().contains(number.get())
        {
            return Err(SubmitError::ReservedCheckpoint { number: number.get() });
        }
        if self.is_monitoring() {
            return Err(SubmitError::MonitoringOnly);
        }
        if self.waiting.free() == 0 {
            return Err(SubmitError::QueueFull);
        }
        if !self.events.has_reserve() {
            return Err(SubmitError::EventsUnread);
        }
        let ticket = Ticket(self.next_ticket);
        let terms = Terms {
            ticket,
            completion: completion_of(kind),
            requirement: spec.map_or(Requirement::NotStated, |spec| spec.requires),
            checkpoint,
        };
        self.waiting.push(Waiting { terms, id: id.0, arguments });
        self.next_ticket = self.next_ticket.wrapping_add(1).max(1);
        self.waiting_next = self.waiting_next.wrapping_add(1);
        if terms.needs_motion() || terms.completion != Completion::Instant {
            self.waiting_motion = self.waiting_next;
        }
        self.pending = self.pending.saturating_add(1);
        Ok(ticket)
    }

    /// Commands that can still be submitted.
    #[must_use]
    pub fn queue_space(&self) -> usize {
        self.waiting.free()
    }

    /// Submitted commands whose final event has not been polled.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.pending
    }

    /// Goes on with the waiting commands after one ended as
    /// [`UnknownCause::AckTimeout`]. Until then, or until
    /// [`discard_waiting`](Self::discard_waiting), nothing is sent: the engine does not decide
    /// whether the commands behind it still make sense.
    pub fn proceed(&mut self) {
        self.halted = None;
    }

    /// Drops every command that was not sent yet, as aborted(discarded), and goes on.
    pub fn discard_waiting(&mut self) {
        self.halted = None;
        self.drop_waiting(self.waiting_next, AbortReason::Discarded);
    }

    /// Waiting commands that were neither dropped nor sent.
    pub(super) fn waiting_live(&self) -> u32 {
        self.waiting_next.wrapping_sub(self.waiting_dead)
    }

    /// Drops the waiting commands below `upto`.
    pub(super) fn drop_waiting(&mut self, upto: u32, reason: AbortReason) {
        let live = self.waiting_live();
        let kept = self.waiting_next.wrapping_sub(upto);
        if kept < live && self.events.ticket(Item::Drop { upto, reason }) {
            self.waiting_dead = upto;
        }
    }

    /// SetPoint, MoveID, ID and arguments all zero, for a cycle at least.
    pub(super) fn close_port(&mut self) {
        self.port = Port::Closed;
        self.set_point_low = 0;
        self.outputs.set_point(false);
        self.outputs.move_id = 0;
        self.outputs.idle_command();
    }

    /// A MoveID the robot has no reason to take for an old one.
    fn fresh_move_id(&mut self, echo: u16) -> u16 {
        let mut move_id = self.move_id;
        loop {
            move_id = move_id.wrapping_add(1);
            if move_id != 0 && move_id != echo {
                break;
            }
        }
        self.move_id = move_id;
        move_id
    }

    /// Looks for the echo. Also watches a withdrawn command for a late one.
    pub(super) fn acknowledge(&mut self, inputs: &Inputs) {
        // By reference: all of the command is needed only in the cycle of its echo.
        let Some(sent) = &self.in_flight else { return };
        if inputs.move_id == sent.move_id {
            let sent = *sent;
            let late = matches!(self.port, Port::Withdrawn { .. });
            self.in_flight = None;
            if late {
                // What the robot took after its queue was lost must not run: see `purge`.
                if matches!(
                    self.port,
                    Port::Withdrawn { why: Withdrawal::Abort(reason), .. }
                        if reason != AbortReason::SafetyStop || inputs.cleared()
                ) {
                    self.purge = super::Purge::Always;
                }
                self.close_port();
            } else {
                // It may have been taken away on a suspicion.
                self.outputs.set_point(true);
                self.port = Port::Open;
            }
            self.accepted(&sent, inputs);
            return;
        }
        if let Port::Withdrawn { fresh, why } = self.port {
            let fresh = fresh.saturating_add(1);
            if fresh < self.config.withdraw_cycles.max(1) {
                self.port = Port::Withdrawn { fresh, why };
                return;
            }
            let sent = *sent;
            self.in_flight = None;
            self.close_port();
            self.never_acknowledged(&sent, why);
        }
    }

    fn accepted(&mut self, sent: &InFlight, inputs: &Inputs) {
        let latency = self.cycles.saturating_sub(sent.sent_cycle);
        let latency_cycles = u32::try_from(latency).unwrap_or(u32::MAX);
        self.statistics.acknowledged(latency_cycles);
        let ticket = match sent.owner {
            Owner::Ticket(ticket) => ticket,
            Owner::Mark => {
                self.marks_unanswered = 0;
                return;
            }
            Owner::Action(internal) => {
                self.actions.acknowledged(internal);
                return;
            }
        };
        self.statistics.accepted += 1;
        let refused = inputs.error_code != 0 && inputs.error_code != sent.error_before;
        let in_queue = match sent.completion {
            Completion::Queued => true,
            Completion::Instant => false,
            Completion::Open => inputs.ready_for_motion(),
        };
        if !in_queue && refused {
            let code = crate::wire::meca500::code::Code(inputs.error_code);
            self.finish(ticket, Verdict::Aborted(AbortReason::Error(code)));
            return;
        }
        self.events.ticket(Item::Event(Event::Accepted { ticket, latency_cycles }));
        if in_queue {
            let kind_open = sent.completion == Completion::Open;
            self.ledger.accept(Entry { ticket, checkpoint: sent.checkpoint, kind_open });
        } else {
            self.finish(ticket, Verdict::Done);
        }
    }

    pub(super) fn finish(&mut self, ticket: Ticket, verdict: Verdict) {
        self.events.ticket(Item::Final(ticket, verdict));
    }

    fn never_acknowledged(&mut self, sent: &InFlight, why: Withdrawal) {
        match (why, sent.owner) {
            (Withdrawal::AckTimeout, Owner::Ticket(ticket)) => {
                self.finish(ticket, Verdict::Unknown(UnknownCause::AckTimeout));
                self.halted = Some(WaitReason::Undecided);
            }
            (Withdrawal::AckTimeout, Owner::Mark) if self.marks_unanswered >= MARK_TRIES => {
                self.marks_unanswered = 0;
                let verdict = Verdict::Unknown(UnknownCause::AckTimeout);
                self.ledger.settle_all(verdict, &mut self.events);
                self.halted = Some(WaitReason::Undecided);
            }
            // Nobody's command: another checkpoint, with another number, does as well.
            (why, Owner::Mark) => {
                self.marks_unanswered += u8::from(why == Withdrawal::AckTimeout);
                self.ledger.mark_again();
            }
            (Withdrawal::Abort(reason), Owner::Ticket(ticket)) => {
                self.finish(ticket, Verdict::Aborted(reason));
                self.drop_waiting(self.waiting_motion_live(), reason);
            }
            (_, Owner::Action(internal)) => self.actions.refused(internal),
        }
    }

    /// End of the waiting commands that are lost with the robot's queue.
    pub(super) fn waiting_motion_live(&self) -> u32 {
        let motion = self.waiting_next.wrapping_sub(self.waiting_motion);
        if motion < self.waiting_live() { self.waiting_motion } else { self.waiting_dead }
    }

    /// Takes SetPoint away from a command without an echo; all else stays frozen.
    pub(super) fn withdraw(&mut self, why: Withdrawal) {
        if self.port == Port::Sent {
            self.outputs.set_point(false);
            self.port = Port::Withdrawn { fresh: 0, why };
        }
    }

    /// The time limit of the echo runs whatever the inputs are.
    pub(super) fn watch_ack_timeout(&mut self) {
        if self.port != Port::Sent {
            return;
        }
        // However short the limit, the robot must have had a cycle to see the command.
        let shown = |sent: &InFlight| sent.sent_cycle != self.cycles;
        if self.in_flight.as_ref().is_some_and(|sent| shown(sent) && self.now >= sent.expires) {
            self.withdraw(Withdrawal::AckTimeout);
            self.events.state_or_merge(Event::Fault(Fault::AckTimeout));
            self.statistics.ack_timeouts += 1;
        }
    }

    /// Whether the robot can take a command with this requirement now.
    fn gate(&self, requirement: Requirement, inputs: &Inputs) -> Result<(), WaitReason> {
        if inputs.fifo_space == 0 {
            return Err(WaitReason::FifoFull);
        }
        match requirement {
            Requirement::AnyState | Requirement::NotStated => return Ok(()),
            Requirement::Deactivated | Requirement::BeforeActivation => {
                return if inputs.activated() || inputs.busy() {
                    Err(WaitReason::NotDeactivated)
                } else {
                    Ok(())
                };
            }
            Requirement::ReadyForMotion
            | Requirement::ReadyAndHomed
            | Requirement::ActivatedAndHomed => {}
        }
        let homing_needed = requirement == Requirement::ReadyAndHomed;
        if inputs.error_code != 0 {
            Err(WaitReason::RobotError)
        } else if !inputs.stops.is_empty() {
            Err(WaitReason::SafetyStop)
        } else if !inputs.activated() {
            Err(WaitReason::NotActivated)
        } else if !inputs.homed() && (homing_needed || !inputs.recovery()) {
            Err(WaitReason::NotHomed)
        } else if inputs.cleared() || self.actions.is_clearing() {
            Err(WaitReason::Cleared)
        } else if self.purge != super::Purge::No {
            Err(WaitReason::ResumeNeeded)
        } else if self.ledger.is_full() {
            Err(WaitReason::LedgerFull)
        } else {
            Ok(())
        }
    }

    fn say_waiting(&mut self, reason: WaitReason) {
        let bit = 1_u32 << (reason as u32 & 31);
        if self.waiting_live() > 0 && self.said_waiting & bit == 0 {
            self.said_waiting |= bit;
            if !self.events.state(Event::Waiting(reason)) {
                self.said_waiting &= !bit;
            }
        }
    }

    /// Says that commands wait for velocity mode to end.
    pub(super) fn say_waiting_for_velocity(&mut self) {
        self.say_waiting(WaitReason::VelocityMode);
    }

    /// The next command to go out, if there is one the robot can take.
    fn choose(&mut self, inputs: &Inputs) -> Option<Owner> {
        if let Some(internal) = self.actions.wants_to_send() {
            return match self.gate(Waiting::errand(internal).terms.requirement, inputs) {
                Ok(()) => Some(Owner::Action(internal)),
                Err(_) => None,
            };
        }
        if self.waiting_live() == 0 {
            self.said_waiting = 0;
            if self.ledger.unmarked() == 0 {
                return None;
            }
        }
        // A queue lost in the cycle of the edge leaves no trace: nothing is added to it meanwhile.
        if self.actions.is_resuming() {
            return None;
        }
        if let Some(reason) = self.halted {
            self.say_waiting(reason);
            return None;
        }
        if !self.events.has_reserve() {
            self.say_waiting(WaitReason::EventsUnread);
            return None;
        }
        let dropped = self.waiting.len() > self.waiting_live();
        let front = if self.waiting_live() == 0 {
            None
        } else if dropped {
            // Dropped commands at the front leave with their events.
            self.say_waiting(WaitReason::EventsUnread);
            return None;
        } else {
            self.waiting.front().map(|front| front.terms)
        };
        let upcoming = front.and_then(|front| front.checkpoint);
        let mark_first = self.ledger.unmarked() > 0 && front.is_none()
            || self.ledger.mark_due(self.pace.checkpoints, upcoming);
        let mut blocked = None;
        if mark_first && self.ledger.can_mark() {
            match self.gate(Requirement::ReadyForMotion, inputs) {
                Ok(()) | Err(WaitReason::LedgerFull) => return Some(Owner::Mark),
                Err(reason) => blocked = Some(reason),
            }
        } else if mark_first && upcoming.is_some() {
            blocked = Some(WaitReason::LedgerFull);
        }
        let front = front?;
        let own = self.gate(front.requirement, inputs);
        let reason = match (own, blocked) {
            (Err(reason), _) => reason,
            // A checkpoint that is due goes first, unless the command is none of the queue's.
            (Ok(()), Some(reason)) if front.completion != Completion::Instant => reason,
            (Ok(()), _) => return Some(Owner::Ticket(front.ticket)),
        };
        self.say_waiting(reason);
        None
    }

    /// Sends the next command, or leaves "no movement" in the image.
    pub(super) fn send(&mut self, inputs: &Inputs) {
        if self.in_flight.is_some() {
            return;
        }
        // Outputs that were lost may come late, behind newer ones: as long as they hold the newest
        // command, a robot takes them for what it has already.
        let is_held = self.overtaken > 0 && matches!(self.port, Port::Open | Port::Arming { .. });
        let Some(owner) = (if is_held { None } else { self.choose(inputs) }) else {
            if self.port == Port::Open {
                self.outputs.idle_command();
            }
            if let Port::Arming { fresh } = self.port
                && !is_held
            {
                self.port = Port::Arming { fresh: fresh.saturating_add(1) };
            }
            return;
        };
        match self.port {
            Port::Open => self.emit(owner, inputs),
            Port::Arming { fresh } => {
                let fresh = fresh.saturating_add(1);
                if inputs.move_id == self.move_id || fresh >= self.config.arm_cycles.max(1) {
                    self.emit(owner, inputs);
                } else {
                    self.port = Port::Arming { fresh };
                }
            }
            // A robot that was in velocity mode must have seen SetPoint 0 in between.
            Port::Closed if self.set_point_low < self.config.mode_gap_cycles.max(1) => {}
            Port::Closed => {
                self.outputs.idle_command();
                self.outputs.move_id = self.fresh_move_id(inputs.move_id);
                self.outputs.set_point(true);
                self.port = Port::Arming { fresh: 0 };
            }
            Port::Gap { .. } | Port::Velocity => self.close_port(),
            Port::Sent | Port::Withdrawn { .. } => {}
        }
    }

    fn emit(&mut self, owner: Owner, inputs: &Inputs) {
        let Waiting { terms, id, arguments } = match owner {
            Owner::Ticket(_) => {
                let Some(front) = self.waiting.pop() else { return };
                self.waiting_dead = self.waiting_dead.wrapping_add(1);
                front
            }
            Owner::Mark => {
                self.statistics.automatic_checkpoints += 1;
                Waiting::mark(self.ledger.mark())
            }
            Owner::Action(internal) => {
                self.actions.sent(internal);
                Waiting::errand(internal)
            }
        };
        let move_id = self.fresh_move_id(inputs.move_id);
        self.outputs.command = id;
        self.outputs.arguments = arguments;
        self.outputs.move_id = move_id;
        self.outputs.set_point(true);
        self.port = Port::Sent;
        self.statistics.sent += 1;
        self.in_flight = Some(InFlight {
            owner,
            id,
            move_id,
            previous: inputs.move_id,
            error_before: inputs.error_code,
            completion: terms.completion,
            needs_motion: terms.needs_motion(),
            checkpoint: terms.checkpoint,
            expires: Instant::from_nanos(
                self.now.as_nanos().saturating_add(self.pace.ack_timeout_ns),
            ),
            sent_cycle: self.cycles,
        });
    }

    /// Judges a command of a lost connection by what the robot returns now.
    pub(super) fn judge(&mut self, sent: &InFlight, inputs: &Inputs) {
        if inputs.move_id == sent.move_id {
            self.accepted(sent, inputs);
            return;
        }
        // The echo names the last command received. If it is still the one before, ours was not
        // received; SetPoint has been 0 for longer than a frame is under way. An echo of 0 may as
        // well have been reset with the connection and proves nothing.
        let not_received = inputs.move_id == sent.previous && sent.previous != 0;
        match sent.owner {
            Owner::Ticket(ticket) if not_received => {
                self.finish(ticket, Verdict::Aborted(AbortReason::LinkLost));
            }
            Owner::Ticket(ticket) => {
                self.finish(ticket, Verdict::Unknown(UnknownCause::LinkLost));
            }
            Owner::Action(internal) => self.actions.refused(internal),
            Owner::Mark => self.ledger.mark_again(),
        }
    }
}
