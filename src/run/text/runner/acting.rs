//! Actions: one after another, each confirmed by the robot's state.

use super::ending::reason_of;
use super::{Acting, Flow, LOOK_AGAIN, Stage, Tell, TextRunner};
use crate::engine::meca500::{AbortReason, Action, Event, Fault};
use crate::run::outcome::{End, Stop};
use crate::run::record::StepEnd;
use crate::run::runner::VELOCITY_TIMEOUT_S;
use crate::run::text::action::{self, Answers, Judgement, Step};
use crate::time::Instant;
use crate::wire::meca500::code::Code;

impl TextRunner<'_> {
    /// Begins an action, for a line of the program or, without one, for bringing the robot up.
    pub(super) fn begin_action(
        &mut self,
        action: Action,
        then: Option<Action>,
        step: Option<usize>,
        now: Instant,
    ) {
        if let Some(step) = step {
            self.ledger.submitted(step, now);
            self.ledger.started(step, now);
        }
        let limit = action::step(action, 0).map_or(LOOK_AGAIN, Step::limit);
        self.stage = Stage::Acting(Acting {
            action,
            then,
            step,
            index: 0,
            mark: None,
            answers: None,
            look_at: now,
            again_at: now,
            deadline: now + limit,
        });
    }

    /// One look at the action under way.
    pub(super) fn act(&mut self, now: Instant, tell: Tell<'_>) -> Flow {
        let Stage::Acting(acting) = &mut self.stage else { return Flow::Wait };
        let Some(step) = action::step(acting.action, acting.index) else {
            return self.act_done(now, tell);
        };
        match acting.mark {
            Some(mark) if self.talk.awaits(mark) => return self.watch_deadline(step, now),
            Some(_) => acting.mark = None,
            None if now < acting.look_at => return self.watch_deadline(step, now),
            None => {
                acting.mark = Some(self.talk.ask_for_status(self.next, now));
                return Flow::Wait;
            }
        }
        let judgement = match &acting.answers {
            None => step.before(&self.robot),
            Some(answers) => step.after(&self.robot, answers),
        };
        let is_refused = acting.answers.as_ref().is_some_and(|answers| answers.error.is_some());
        match judgement {
            Judgement::Done => {
                acting.index += 1;
                acting.answers = None;
                if let Some(next) = action::step(acting.action, acting.index) {
                    acting.deadline = now + next.limit();
                }
                // The next part begins with the state as it is told after this one.
                acting.look_at = now;
                Flow::Again
            }
            Judgement::Send if step == Step::Reboot => {
                self.stage = Stage::Rebooting { step: acting.step, since: now, is_gone: false };
                self.talk.say(step.line());
                Flow::Wait
            }
            Judgement::Send if is_refused && (now < acting.again_at || now >= acting.deadline) => {
                acting.look_at = acting.again_at;
                self.watch_deadline(step, now)
            }
            Judgement::Send => {
                self.talk.say(step.line());
                let had_stops = !self.robot.stops.is_empty();
                if acting.answers.is_none() {
                    acting.deadline = now + step.limit();
                }
                acting.again_at = now + LOOK_AGAIN;
                acting.answers = Some(Answers::since(had_stops));
                acting.mark = Some(self.talk.ask_for_status(self.next, now));
                Flow::Wait
            }
            Judgement::Wait => {
                acting.look_at = now + LOOK_AGAIN;
                self.watch_deadline(step, now)
            }
            Judgement::Failed(fault) => {
                let action = acting.action;
                self.act_failed(action, fault, now);
                Flow::Wait
            }
        }
    }

    fn watch_deadline(&mut self, step: Step, now: Instant) -> Flow {
        if let Stage::Acting(Acting { action, deadline, .. }) = self.stage
            && now >= deadline
        {
            let waits_for_signal =
                matches!(step, Step::Resume) && !self.robot.blocking_stops().is_empty();
            let fault = if waits_for_signal { Fault::SafetyStopPresent } else { Fault::Timeout };
            self.act_failed(action, fault, now);
        }
        Flow::Wait
    }

    fn act_done(&mut self, now: Instant, tell: Tell<'_>) -> Flow {
        let Stage::Acting(Acting { action, then, step, .. }) = self.stage else {
            return Flow::Wait;
        };
        if let Some(then) = then {
            self.begin_action(then, None, step, now);
            return Flow::Again;
        }
        match action {
            Action::Clear => self.drop_lines(AbortReason::Cleared, now),
            Action::Deactivate => {
                self.drop_lines(AbortReason::Deactivated, now);
                // Deactivation sets motion settings back to their defaults. Source: PM L3207.
                self.velocity_timeout_s = VELOCITY_TIMEOUT_S;
                self.trace.reset_frames();
            }
            _ => {}
        }
        match step {
            Some(step) => {
                self.finish_step(step, now);
                self.next += 1;
            }
            None => self.is_brought_up = true,
        }
        // A robot in error mode may have refused it before.
        self.ask_for_copies();
        tell(&Event::ActionDone(action));
        self.stage = Stage::Streaming;
        Flow::Again
    }

    fn drop_lines(&mut self, reason: AbortReason, now: Instant) {
        for step in self.in_flight.clear() {
            self.ledger.ended(step, now, StepEnd::Aborted(reason));
        }
    }

    /// An action has failed, and with it the run.
    pub(super) fn act_failed(&mut self, action: Action, fault: Fault, now: Instant) {
        let stops = self.robot.stops;
        let is_blocked = !self.robot.blocking_stops().is_empty();
        let end = match fault {
            // A failed activation or homing may be told before the signal that made it fail.
            Fault::RobotError(_) if is_blocked => End::SafetyStop(stops),
            Fault::RobotError(Code::NONE) => End::RobotError(Code::IN_ERROR),
            Fault::RobotError(code) => End::RobotError(code),
            Fault::SafetyStopPresent if !stops.is_empty() => End::SafetyStop(stops),
            fault => End::ActionFailed(action, fault),
        };
        let outcome = self.outcome_of(end, Stop::NotNeeded);
        if let Some(step) = outcome.step {
            self.ledger.ended(step, now, StepEnd::Aborted(reason_of(&end)));
        }
        self.stop(outcome, now);
    }
}
