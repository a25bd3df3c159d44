//! From the first fresh image to a lost connection, and what is lost on the way.
//!
//! ```text
//!                fresh                 settle_cycles of zeros, MonitoringMode 0
//!   offline ------------> settling ----------------------------------------------> ready
//!      ^                   |   ^  ^--- robot rebooted --------------------------------|
//!      |    MonitoringMode v   | MonitoringMode 0                                     |
//!      |                 monitoring <----------- MonitoringMode ----------------------|
//!      +----------------------------- bad_cycles_limit, or the link says lost --------+
//! ```
//!
//! Outputs are all zero in every phase but ready: the safe image.
//!
//! When the connection is lost, waiting commands are aborted, the command without an echo is judged
//! after the next connection (accepted, not accepted, unknown), and commands the robot has taken stay
//! in the ledger: the robot may go on with them, and their checkpoints tell.
//!
//! Invariants: bad inputs change nothing but timers and the safe image; `reached` of an image is
//! looked at before anything that loses commands in the same image; the work of a cycle does not
//! depend on how many commands are under way (but for the searches the ledger names).

use super::Engine;
use super::Purge;
use super::clock::ClockVerdict;
use super::event::{AbortReason, Event, Item, UnknownCause, VelocityStop, Verdict, WaitReason};
use super::handshake::{InFlight, Owner, Port, Withdrawal};
use super::inputs::Inputs;
use super::ledger::Reached;
use super::outputs::Outputs;
use crate::cycle::InputQuality;
use crate::time::Instant;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::command::MotionCommandId;
use crate::wire::meca500::image::MotionControlFlags;

/// Where the connection stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Phase {
    Offline,
    Settling { fresh: u16 },
    Monitoring,
    Ready,
}

/// Cycles a robot must look idle before its queue counts as empty.
const IDLE_CYCLES: u16 = 20;
/// The same for one whose FifoSpace is not that of an empty queue, though nothing is left in it.
const IDLE_CYCLES_OF_ODD_SPACE: u16 = 500;

impl<const QUEUE: usize> Engine<QUEUE> {
    pub(super) fn is_connected(&self) -> bool {
        self.phase == Phase::Ready
    }

    pub(super) fn is_monitoring(&self) -> bool {
        self.phase == Phase::Monitoring
    }

    /// One cycle, once the fields are read.
    pub(super) fn step(&mut self, now: Instant, quality: InputQuality, inputs: &Inputs) {
        self.now = now;
        self.cycles = self.cycles.wrapping_add(1);
        if self.trust(quality, inputs) {
            self.bad_cycles = 0;
            self.live(inputs);
            self.overtaken = self.overtaken.saturating_sub(1);
            self.actions.count_low(&self.outputs);
        } else {
            self.bad(quality);
        }
        self.watch_ack_timeout();
        self.watch_action_limits();
        self.watch_dead_man();
        self.actions.say_results(&mut self.events);
        let low = !self.outputs.motion.contains(MotionControlFlags::SET_POINT);
        self.set_point_low = if low { self.set_point_low.saturating_add(1) } else { 0 };
    }

    /// Whether the image may be believed; notices a reboot.
    fn trust(&mut self, quality: InputQuality, inputs: &Inputs) -> bool {
        if !quality.is_fresh() || inputs.is_blank() {
            return false;
        }
        match self.clock.see(inputs.clock_us, self.now, self.pace.reboot_confirm_cycles) {
            ClockVerdict::Suspect { far_back } => {
                if far_back {
                    self.hold_set_point();
                }
                return false;
            }
            ClockVerdict::WentBack => self.rebooted(),
            ClockVerdict::Steady
                if self.fell_back_to_power_up(inputs) || self.came_back_from_reboot(inputs) =>
            {
                self.rebooted();
            }
            ClockVerdict::Steady => {}
        }
        true
    }

    /// The robot may have rebooted and take what is in the image for new: SetPoint goes at once. A
    /// command without an echo keeps its fields, and gets SetPoint back when it was a false alarm.
    fn hold_set_point(&mut self) {
        self.end_velocity(VelocityStop::InputsBad);
        match self.port {
            Port::Sent => self.outputs.set_point(false),
            Port::Open | Port::Arming { .. } => self.close_port(),
            _ => {}
        }
    }

    /// Everything at once as after power-up, whatever the clock says. In velocity mode an echo of 0
    /// proves nothing.
    fn fell_back_to_power_up(&self, inputs: &Inputs) -> bool {
        inputs.move_id == 0
            && self.phase == Phase::Ready
            && matches!(self.port, Port::Sent | Port::Open)
            && self.inputs.move_id != 0
            && self.inputs.activated()
            && !inputs.activated()
            && self.inputs.homed()
            && !inputs.homed()
    }

    fn live(&mut self, inputs: &Inputs) {
        let stopped_before = !self.inputs.stops.is_empty();
        self.inputs = *inputs;
        self.watch.see(inputs, &mut self.events);
        match self.phase {
            Phase::Ready if inputs.monitoring() => {
                self.let_go(AbortReason::LinkLost);
                self.enter_monitoring();
            }
            Phase::Ready => self.run(inputs, stopped_before),
            Phase::Monitoring if inputs.monitoring() => {}
            Phase::Settling { .. } if inputs.monitoring() => self.enter_monitoring(),
            Phase::Offline | Phase::Monitoring => self.phase = Phase::Settling { fresh: 1 },
            Phase::Settling { fresh } => {
                let fresh = fresh.saturating_add(1);
                self.phase = Phase::Settling { fresh };
                if fresh >= self.config.settle_cycles.max(1) {
                    self.connect(inputs);
                }
            }
        }
    }

    fn enter_monitoring(&mut self) {
        self.phase = Phase::Monitoring;
        self.events.state_or_merge(Event::MonitoringOnly);
    }

    fn connect(&mut self, inputs: &Inputs) {
        let again = self.statistics.connections > 0;
        self.statistics.connections += 1;
        self.phase = Phase::Ready;
        self.events.state_or_merge(Event::Connected { again });
        if !again {
            let seed = self.clock.seed();
            self.move_id = match self.config.first_move_id {
                Some(first) => first.wrapping_sub(1),
                None => seed,
            };
            let queue_is_empty =
                inputs.stands_still() && inputs.fifo_space >= super::FIFO_SPACE_MAX;
            self.ledger.adopt(inputs.reached, inputs.discarded, queue_is_empty);
        } else {
            self.ledger.doubt_absence(self.config.layout);
        }
        self.actions.adopt(inputs);
        self.had_motion = motion_lost(inputs).is_none();
        if let Some(sent) = self.suspect.take() {
            self.judge(&sent, inputs);
        }
        self.run(inputs, !inputs.stops.is_empty());
    }

    /// Waits until the robot has surely nothing of an earlier PLC left in its queue. FifoSpace alone
    /// may leave out commands that are compiled already, and EOB alone may come early.
    fn watch_foreign_queue(&mut self, inputs: &Inputs) {
        let idle = inputs.stands_still() || inputs.cleared() || !inputs.activated();
        self.foreign_idle = if idle { self.foreign_idle.saturating_add(1) } else { 0 };
        let full = inputs.fifo_space >= super::FIFO_SPACE_MAX;
        if self.foreign_idle >= if full { IDLE_CYCLES } else { IDLE_CYCLES_OF_ODD_SPACE } {
            self.ledger.own();
        }
    }

    /// A fresh cycle of a connected engine.
    fn run(&mut self, inputs: &Inputs, stopped_before: bool) {
        self.acknowledge(inputs);
        if self.ledger.is_foreign() {
            self.watch_foreign_queue(inputs);
        }
        if self.port == Port::Sent {
            self.outputs.set_point(true);
        }
        if let Reached::Foreign(number) = self.ledger.see_reached(inputs.reached) {
            self.events.state_or_merge(Event::CheckpointReached { number });
        }
        self.ledger.settle_reached(&mut self.events);
        let discarded = self.ledger.see_discarded(inputs.discarded);
        self.check_motion(inputs, stopped_before, discarded);
        if !inputs.paused()
            && let Some(ticket) = self.ledger.starting()
            && self.events.state(Event::Started { ticket })
        {
            self.ledger.started();
        }
        self.drive_actions(inputs);
        if self.drive_velocity(inputs) {
            self.say_waiting_for_velocity();
        } else {
            self.send(inputs);
        }
        self.actions.apply(inputs, &mut self.outputs);
    }

    /// Ends what the robot will not execute any more.
    fn check_motion(&mut self, inputs: &Inputs, stopped_before: bool, discarded: bool) {
        let lost = motion_lost(inputs);
        match lost {
            Some(reason) if self.had_motion || self.ledger.live() > 0 => {
                self.lose_motion(reason, inputs);
            }
            Some(_) => {}
            None if discarded => {
                let stopped = !inputs.stops.is_empty();
                let reason = if stopped { AbortReason::SafetyStop } else { AbortReason::Cleared };
                self.lose_motion(reason, inputs);
            }
            None if !inputs.stops.is_empty() && !stopped_before => {
                // The queue may have been kept (P-Stop 2 in pause mode) or not: see the ledger.
                self.ledger.doubt_stop(self.config.layout);
                self.withdraw_motion(AbortReason::SafetyStop);
            }
            None => {}
        }
        self.had_motion = lost.is_none();
        if !inputs.activated() || self.purge == Purge::UnlessCleared && inputs.cleared() {
            self.purge = Purge::No;
        }
    }

    fn lose_motion(&mut self, reason: AbortReason, inputs: &Inputs) {
        let in_flight = self.in_flight.is_some_and(|sent| sent.needs_motion());
        let by_error = matches!(reason, AbortReason::Error(_));
        if by_error && !inputs.cleared() && (self.ledger.live() > 0 || in_flight) {
            // Which errors empty the robot's queue is not stated: make sure before it moves again.
            self.purge = self.purge.max(Purge::UnlessCleared);
        }
        self.ledger.settle_all(Verdict::Aborted(reason), &mut self.events);
        self.withdraw_motion(reason);
        // What came after a request to clear belongs to the time after it.
        if !(reason == AbortReason::Cleared && self.actions.is_clearing()) {
            self.drop_waiting(self.waiting_motion_live(), reason);
        }
    }

    pub(super) fn withdraw_motion(&mut self, reason: AbortReason) {
        if self.in_flight.is_some_and(|sent| sent.needs_motion()) {
            self.withdraw(Withdrawal::Abort(reason));
        }
    }

    fn bad(&mut self, quality: InputQuality) {
        self.bad_cycles = self.bad_cycles.saturating_add(1);
        self.statistics.bad_cycles += 1;
        self.overtaken = self.config.settle_cycles.max(1);
        if self.bad_cycles >= self.config.velocity_bad_cycles_limit.max(1).into() {
            self.end_velocity(VelocityStop::InputsBad);
        }
        let lost = quality == InputQuality::Lost
            || self.bad_cycles >= self.config.bad_cycles_limit.max(1).into();
        if !lost || self.phase == Phase::Offline {
            return;
        }
        if matches!(self.phase, Phase::Ready | Phase::Monitoring) {
            let bad_cycles = self.bad_cycles;
            self.events.state_or_merge(Event::ConnectionLost { bad_cycles });
        }
        self.let_go(AbortReason::LinkLost);
        self.phase = Phase::Offline;
    }

    /// Safe image; what was not sent is dropped, what was sent is judged later.
    fn let_go(&mut self, reason: AbortReason) {
        self.end_velocity(VelocityStop::InputsBad);
        self.drop_waiting(self.waiting_next, reason);
        if let Some(sent) = self.in_flight.take() {
            self.suspect = Some(sent);
        }
        self.halted = None;
        self.close_port();
        self.outputs = Outputs::default();
        self.await_reboot();
        self.actions.link_lost();
    }

    /// The robot forgot everything.
    fn rebooted(&mut self) {
        self.statistics.reboots += 1;
        self.events.state_or_merge(Event::RobotRebooted);
        for sent in [self.suspect.take(), self.in_flight.take()].into_iter().flatten() {
            self.forgotten(&sent);
        }
        self.ledger.settle_all(Verdict::Aborted(AbortReason::RobotRebooted), &mut self.events);
        self.drop_waiting(self.waiting_next, AbortReason::RobotRebooted);
        self.end_velocity(VelocityStop::RobotState);
        self.close_port();
        self.outputs = Outputs::default();
        self.actions.rebooted();
        self.purge = Purge::No;
        self.halted = None;
        self.had_motion = false;
        self.phase = Phase::Settling { fresh: 0 };
    }

    fn forgotten(&mut self, sent: &InFlight) {
        let Owner::Ticket(ticket) = sent.owner else { return };
        let verdict = if sent.id == MotionCommandId::REBOOT_ROBOT.0 {
            Verdict::Done
        } else if sent.needs_motion() {
            Verdict::Aborted(AbortReason::RobotRebooted)
        } else {
            Verdict::Unknown(UnknownCause::RobotRebooted)
        };
        self.finish(ticket, verdict);
    }

    /// The next event, oldest first; `None` when there is none.
    #[inline]
    pub fn poll_event(&mut self) -> Option<Event> {
        // Every reader ends with a question that is answered by nothing: that answer needs no call.
        if self.events.is_empty() { None } else { self.next_event() }
    }

    fn next_event(&mut self) -> Option<Event> {
        loop {
            let Some(&item) = self.events.front() else { return self.events.take_merged() };
            let event = match item {
                Item::Event(event) => {
                    self.events.pop();
                    return Some(event);
                }
                Item::Final(ticket, verdict) => {
                    self.events.pop();
                    self.pending = self.pending.saturating_sub(1);
                    return Some(verdict.event(ticket));
                }
                Item::Finish { upto, verdict } => self.poll_ledger(upto, verdict),
                Item::Drop { upto, reason } => self.poll_dropped(upto, reason),
            };
            match event {
                Some(event) => return Some(event),
                None => self.events.pop(),
            }
        }
    }

    fn poll_ledger(&mut self, upto: u32, verdict: Verdict) -> Option<Event> {
        let entry = self.ledger.polling(upto)?;
        let checkpoint = match verdict {
            Verdict::Unknown(_) => None,
            Verdict::Done | Verdict::Aborted(_) => entry.checkpoint.take(),
        };
        if let Some(number) = checkpoint {
            return Some(match verdict {
                Verdict::Done => Event::CheckpointReached { number: number.get() },
                _ => Event::CheckpointDiscarded { number: number.get() },
            });
        }
        let (ticket, kind_open) = (entry.ticket, entry.kind_open);
        self.ledger.polled();
        self.pending = self.pending.saturating_sub(1);
        Some(match verdict {
            Verdict::Aborted(_) if kind_open => {
                Event::Unknown { ticket, cause: UnknownCause::KindUnknown }
            }
            verdict => verdict.event(ticket),
        })
    }

    fn poll_dropped(&mut self, upto: u32, reason: AbortReason) -> Option<Event> {
        let length = self.waiting.len();
        let left_before_upto = upto.wrapping_sub(self.waiting_next.wrapping_sub(length));
        if left_before_upto == 0 || left_before_upto > length {
            return None;
        }
        let waiting = self.waiting.pop()?;
        self.pending = self.pending.saturating_sub(1);
        Some(Event::Aborted { ticket: waiting.terms.ticket, reason })
    }

    /// Why nothing is sent although commands wait, if the caller has to decide.
    #[must_use]
    pub fn undecided(&self) -> bool {
        self.halted == Some(WaitReason::Undecided)
    }
}

impl Verdict {
    fn event(self, ticket: super::ticket::Ticket) -> Event {
        match self {
            Self::Done => Event::Done { ticket },
            Self::Aborted(reason) => Event::Aborted { ticket, reason },
            Self::Unknown(cause) => Event::Unknown { ticket, cause },
        }
    }
}

/// Why the robot executes nothing of what it was sent, if so. A safety signal alone is no reason: in
/// pause mode the queue is kept.
fn motion_lost(inputs: &Inputs) -> Option<AbortReason> {
    let stopped = !inputs.stops.is_empty();
    if inputs.error_code != 0 {
        Some(AbortReason::Error(Code(inputs.error_code)))
    } else if !inputs.activated() {
        Some(if stopped { AbortReason::SafetyStop } else { AbortReason::Deactivated })
    } else if inputs.cleared() {
        Some(if stopped { AbortReason::SafetyStop } else { AbortReason::Cleared })
    } else {
        None
    }
}
