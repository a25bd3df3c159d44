//! What the engine tells its caller, and the queue it waits in.
//!
//! Invariants: a ticket's final event is never lost. The queue holds ranges ("all ledger entries up
//! to this one are done") instead of one event for each ticket, and nothing is sent to the robot
//! unless [`RESERVE`] places are free, which is more than the tickets under way can need. Events
//! about the robot's state leave that reserve alone: without room they wait, and what comes and goes
//! meanwhile is merged and counted by [`Event::Merged`].

use super::action::Action;
use super::ring::Ring;
use super::ticket::Ticket;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::image::SafetySignals;
use crate::wire::order::ByteOrder;

/// Something the caller should know.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Inputs are fresh and zeros were shown long enough: commands can go out.
    Connected {
        /// Whether an earlier connection of this engine had been lost.
        again: bool,
    },
    /// Inputs stayed bad; outputs are all zero until they are good again.
    ConnectionLost {
        /// Bad cycles until then.
        bad_cycles: u32,
    },
    /// The byte order was found.
    ByteOrderSettled(ByteOrder),
    /// The robot takes no control from this connection (MonitoringMode); outputs stay zero.
    MonitoringOnly,
    /// The robot has taken the command.
    Accepted {
        /// The command.
        ticket: Ticket,
        /// Cycles from sending to its echo; 1 on a direct link.
        latency_cycles: u32,
    },
    /// Everything before the command is known to be done and motion is not paused.
    Started {
        /// The command.
        ticket: Ticket,
    },
    /// The command was executed. Final.
    Done {
        /// The command.
        ticket: Ticket,
    },
    /// The command was not executed, or not to its end. Final.
    Aborted {
        /// The command.
        ticket: Ticket,
        /// Why.
        reason: AbortReason,
    },
    /// Nobody can tell whether the command was or will be executed. Final.
    Unknown {
        /// The command.
        ticket: Ticket,
        /// Why.
        cause: UnknownCause,
    },
    /// Commands are held back; said once for each reason until none is waiting any more.
    Waiting(WaitReason),
    /// A checkpoint that is not the engine's own was reached.
    CheckpointReached {
        /// Its number.
        number: u16,
    },
    /// A checkpoint that is not the engine's own will never be reached.
    CheckpointDiscarded {
        /// Its number.
        number: u16,
    },
    /// The robot confirmed the action.
    ActionDone(Action),
    /// The action ended without confirmation.
    ActionFailed {
        /// The action.
        action: Action,
        /// Why.
        fault: Fault,
    },
    /// ErrorCode became this code.
    RobotError {
        /// The code.
        code: Code,
    },
    /// ErrorCode became 0.
    RobotErrorCleared,
    /// Safety signals changed and at least one is present or still to be reset.
    SafetyStop {
        /// All signals that are 1 now.
        signals: SafetySignals,
    },
    /// No safety signal is left.
    SafetyCleared,
    /// Paused became 1.
    Paused,
    /// Paused became 0.
    Resumed,
    /// Cleared became 1: the robot's queue is empty.
    Cleared,
    /// The robot's clock went back or its state fell back to that after power-up.
    RobotRebooted,
    /// Velocity motion was stopped.
    VelocityStopped(VelocityStop),
    /// So many changes of the robot's state went by while the event queue was full.
    Merged {
        /// How many.
        count: u32,
    },
    /// Something went wrong that belongs to no action.
    Fault(Fault),
}

/// Why a command was not executed to its end.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AbortReason {
    /// The queue was cleared.
    Cleared,
    /// The robot reported this error.
    Error(Code),
    /// A safety signal.
    SafetyStop,
    /// The robot was deactivated.
    Deactivated,
    /// The connection was lost before the robot took the command.
    LinkLost,
    /// The robot rebooted.
    RobotRebooted,
    /// The caller discarded the waiting commands.
    Discarded,
}

/// Why nothing is known about a command.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnknownCause {
    /// Its echo never came.
    AckTimeout,
    /// The connection was lost, and nothing the robot shows since proves what became of it.
    LinkLost,
    /// The robot rebooted before the echo of an instantaneous command came.
    RobotRebooted,
    /// A safety stop or a resume came while no checkpoint was behind it: the robot may have dropped it.
    SafetyStop,
    /// It was in the way of an abort, but may have been executed at once (a variable, a raw ID).
    KindUnknown,
}

/// Why commands are held back.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WaitReason {
    /// The robot is not activated.
    NotActivated,
    /// The robot is neither homed nor in recovery mode.
    NotHomed,
    /// The command needs a deactivated robot.
    NotDeactivated,
    /// ErrorCode is not 0.
    RobotError,
    /// A safety signal is present or still to be reset.
    SafetyStop,
    /// The queue was cleared and motion not resumed yet.
    Cleared,
    /// The queue must be cleared before motion may go on; [`Action::Resume`] does it.
    ResumeNeeded,
    /// FifoSpace is 0: the robot ignores commands.
    FifoFull,
    /// As many commands are unfinished on the robot as the ledger can hold.
    LedgerFull,
    /// Events wait to be polled.
    EventsUnread,
    /// Velocity mode is on.
    VelocityMode,
    /// The fate of a command is unknown; see [`Engine::proceed`](super::Engine::proceed).
    Undecided,
}

/// Why velocity motion was stopped.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VelocityStop {
    /// The caller asked for it.
    Requested,
    /// No `set_velocity` came in time.
    DeadMan,
    /// The robot is not ready for motion any more, or paused.
    RobotState,
    /// Inputs were bad for too long.
    InputsBad,
}

/// What went wrong.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The time limit passed without confirmation.
    Timeout,
    /// The echo of a command did not come in time.
    AckTimeout,
    /// The robot reported this error meanwhile.
    RobotError(Code),
    /// A safety signal that cannot be reset is present.
    SafetyStopPresent,
    /// The robot is not in the state the action needs.
    WrongState,
    /// Another action took its place.
    Superseded,
    /// The connection was lost.
    LinkLost,
    /// The robot rebooted.
    RobotRebooted,
    /// The byte order cannot be told from what arrives; set it (`big` or `little`) instead of `auto`.
    ByteOrderUndecidable,
    /// The connection only allows monitoring.
    MonitoringOnly,
}

/// How a range of commands ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    Done,
    Aborted(AbortReason),
    Unknown(UnknownCause),
}

/// What the event queue holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Item {
    /// One event.
    Event(Event),
    /// The final event of one ticket.
    Final(Ticket, Verdict),
    /// Ledger entries below `upto` ended like this.
    Finish { upto: u32, verdict: Verdict },
    /// Waiting commands below `upto` are dropped.
    Drop { upto: u32, reason: AbortReason },
}

/// Places the queue has.
pub(super) const EVENTS: usize = 64;
/// Places kept for tickets under way: one drop of the waiting commands; accepted, fault and final of
/// the command in flight; done, doubtful, done again and aborted ranges of the ledger; and one to
/// spare.
pub(super) const RESERVE: usize = 9;

/// The event queue.
/// One that is read as it fills stays in its first cache line, see [`Ring`].
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Events {
    merged: u32,
    items: Ring<Item, EVENTS>,
}

impl Events {
    pub(super) const fn new() -> Self {
        Self { merged: 0, items: Ring::new(Item::Event(Event::Paused)) }
    }

    /// Whether a new ticket may get under way.
    #[inline]
    pub(super) const fn has_reserve(&self) -> bool {
        self.items.free() > RESERVE
    }

    /// Says something about a ticket; always has room by the reserve.
    #[inline]
    pub(super) fn ticket(&mut self, item: Item) -> bool {
        if let (Some(Item::Finish { upto, verdict }), Item::Finish { upto: more, verdict: same }) =
            (self.items.back_mut(), item)
            && *verdict == same
        {
            *upto = more;
            return true;
        }
        self.items.push(item) || self.widen(item)
    }

    fn widen(&mut self, item: Item) -> bool {
        // No place left: a range may still grow, out of order with what was said since.
        if let Item::Finish { upto: more, verdict: Verdict::Done } = item {
            let last = (0..self.items.len())
                .rev()
                .find(|position| matches!(self.items.get(*position), Some(Item::Finish { .. })));
            if let Some(Item::Finish { upto, verdict: Verdict::Done }) =
                last.and_then(|position| self.items.get_mut(position))
            {
                *upto = more;
                return true;
            }
        }
        false
    }

    /// Says something about the robot if there is room beside the reserve.
    pub(super) fn state(&mut self, event: Event) -> bool {
        if !self.has_reserve() {
            return false;
        }
        if self.merged > 0 {
            let count = core::mem::take(&mut self.merged);
            self.items.push(Item::Event(Event::Merged { count }));
        }
        self.items.push(Item::Event(event))
    }

    /// Says it, or counts it as merged.
    pub(super) fn state_or_merge(&mut self, event: Event) {
        if !self.state(event) {
            self.merged = self.merged.saturating_add(1);
        }
    }

    /// Counts changes that could not be said.
    pub(super) fn merge(&mut self) {
        self.merged = self.merged.saturating_add(1);
    }

    /// Whether there is nothing to say.
    #[inline]
    pub(super) const fn is_empty(&self) -> bool {
        self.items.is_empty() && self.merged == 0
    }

    #[inline]
    pub(super) fn front(&self) -> Option<&Item> {
        self.items.front()
    }

    #[inline]
    pub(super) fn pop(&mut self) {
        self.items.pop();
    }

    /// What is left to say when the queue is empty.
    pub(super) fn take_merged(&mut self) -> Option<Event> {
        let count = core::mem::take(&mut self.merged);
        (count > 0).then_some(Event::Merged { count })
    }
}
