//! How a run over the text interface ends.

use std::vec::Vec;

use super::{Acting, Flow, Stage, TextRunner};
use crate::engine::meca500::{AbortReason, Fault, WaitReason};
use crate::run::outcome::{End, LinkMessage, Outcome, Stop};
use crate::run::record::StepEnd;
use crate::run::text::action::{self, Step};
use crate::run::text::stop::Halt;
use crate::time::{Duration, Instant};

/// Time after trouble in which the fate of the lines under way is waited for.
const GRACE: Duration = Duration::from_secs(1);

/// Why lines were dropped that an end like this dropped.
pub(super) const fn reason_of(end: &End) -> AbortReason {
    match end {
        End::RobotError(code) => AbortReason::Error(*code),
        End::SafetyStop(_) => AbortReason::SafetyStop,
        End::Rebooted => AbortReason::RobotRebooted,
        End::HeldBack(WaitReason::NotActivated) => AbortReason::Deactivated,
        End::ConnectionLost => AbortReason::LinkLost,
        _ => AbortReason::Cleared,
    }
}

/// Whether a run ends because lines were dropped, and nobody has told why yet.
pub(super) const fn is_undecided(end: &End) -> bool {
    matches!(end, End::HeldBack(WaitReason::Cleared))
}

impl TextRunner<'_> {
    /// Remembers what ends the run, and asks what became of the rest.
    pub(super) fn trouble(&mut self, end: End, step: Option<usize>, now: Instant) {
        self.talk.hush();
        let mark = self.talk.ask_for_status(self.next, now);
        let mut outcome = self.outcome_of(end, Stop::NotNeeded);
        outcome.step = step.or(outcome.step);
        self.stage = Stage::Troubled { outcome, since: now, mark };
    }

    pub(super) fn interrupt(&mut self, now: Instant) {
        let outcome = match &self.stage {
            Stage::Troubled { outcome, .. } => *outcome,
            _ => self.outcome_of(End::Interrupted, Stop::NotNeeded),
        };
        if self.wants_link() {
            return self.end(outcome, now);
        }
        self.stop(outcome, now);
    }

    pub(super) fn settle_trouble(
        &mut self,
        outcome: Outcome,
        since: Instant,
        mark: u32,
        now: Instant,
    ) -> Flow {
        if self.talk.awaits(mark) && now - since < GRACE {
            return Flow::Wait;
        }
        self.stop(outcome, now);
        Flow::Wait
    }

    /// Stops what the robot does, whatever the reason is, and ends the run.
    pub(super) fn stop(&mut self, outcome: Outcome, now: Instant) {
        // An activation that has failed leads nowhere any more; what comes after it ends with the motors.
        let is_readying = match &self.stage {
            Stage::Acting(Acting { action, index, answers: Some(answers), .. }) => {
                let step = action::step(*action, *index);
                answers.error.is_none()
                    && match step {
                        Some(Step::Activate | Step::Initialise) => true,
                        Some(Step::Home { .. } | Step::Deactivate) => self.robot.is_activated(),
                        _ => false,
                    }
            }
            _ => false,
        };
        self.talk.hush();
        match Halt::first(&self.robot, outcome.end, is_readying) {
            Ok(halt) => {
                self.talk.say(halt.line());
                let outcome = Outcome { stop: Stop::Unconfirmed, ..outcome };
                self.stage = Stage::Stopping { outcome, since: now, halt, again_at: None };
            }
            Err(stop) => self.end(Outcome { stop, ..outcome }, now),
        }
    }

    /// The run is over: nothing is left open that was given to the robot.
    pub(super) fn end(&mut self, outcome: Outcome, now: Instant) {
        let end = match outcome.end {
            End::Completed => StepEnd::Done,
            End::ConnectionLost | End::Fault(Fault::AckTimeout) => StepEnd::Unknown,
            _ if outcome.stop == Stop::Unconfirmed || outcome.stop == Stop::LinkLost => {
                StepEnd::Unknown
            }
            end => StepEnd::Aborted(reason_of(&end)),
        };
        let open: Vec<usize> = self.in_flight.clear().collect();
        for step in open {
            self.ledger.ended(step, now, end);
        }
        if let Stage::Asking { step, .. } | Stage::Holding { step, .. } = self.stage {
            self.ledger.ended(step, now, end);
        }
        if let Some(step) = outcome.step {
            let is_given =
                self.ledger.records().get(step).is_some_and(|record| record.submitted.is_some());
            if is_given {
                self.ledger.ended(step, now, end);
            }
        }
        let step = outcome.step.or_else(|| match outcome.end {
            End::Completed => None,
            _ => self.ledger.culprit(),
        });
        self.talk.hush();
        self.stage = Stage::Ended(Outcome { step, ..outcome });
    }

    pub(super) fn outcome_of(&self, end: End, stop: Stop) -> Outcome {
        let step = match &self.stage {
            _ if end == End::Completed => None,
            Stage::Acting(Acting { step, .. }) | Stage::Rebooting { step, .. } => *step,
            Stage::Asking { step, .. } | Stage::Holding { step, .. } => Some(*step),
            _ => self.ledger.culprit(),
        };
        Outcome { end, step, stop }
    }

    /// The connection is gone: nothing can be asked of the robot any more.
    pub(in crate::run::text) fn link_lost(&mut self, message: LinkMessage, now: Instant) {
        match &mut self.stage {
            Stage::Ended(_) => return,
            Stage::Rebooting { is_gone, .. } => {
                *is_gone = true;
                self.talk.hush();
                return;
            }
            Stage::Stopping { outcome, .. } => {
                let outcome = Outcome { stop: Stop::LinkLost, ..*outcome };
                self.lost = Some(message);
                return self.end(outcome, now);
            }
            _ => {}
        }
        self.lost = Some(message);
        let outcome = match &self.stage {
            Stage::Troubled { outcome, .. } => Outcome { stop: Stop::LinkLost, ..*outcome },
            _ => self.outcome_of(End::ConnectionLost, Stop::NotNeeded),
        };
        self.end(outcome, now);
    }
}
