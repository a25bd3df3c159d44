//! Lines of the program on their way to the robot.

use std::format;
use std::string::ToString;

use super::{Barrier, Flow, Stage, TextRunner};
use crate::engine::meca500::{Action, SubmitError};
use crate::run::outcome::{End, Outcome, Stop};
use crate::run::program::needs_a_tool;
use crate::run::runner::{actions_of, acts_on_the_queue};
use crate::run::text::trace::Frame;
use crate::time::{Duration, Instant};
use crate::wire::meca500::command::{CommandKind, MotionCommand, Pose, VelocityCommand};
use crate::wire::meca500::text::{CommandText, Statement};

/// Time before the end of a velocity line at which the next one is sent, so that the arm does not begin
/// to slow down in between.
const LEAD: Duration = Duration::from_millis(2);
/// Steps behind which a mark is set at the latest.
const STEPS_A_MARK: usize = 16;
/// Lines that one step may need: itself, its checkpoint and a mark.
const LINES_A_STEP: u32 = 3;

impl TextRunner<'_> {
    /// Sends what may be sent now.
    pub(super) fn stream(&mut self, now: Instant) -> Flow {
        if !self.is_past_barrier() {
            return self.mark_all(now);
        }
        let open = self.ledger.counts().open();
        if self.program.bring_up_before() == Some(self.next) && !self.is_brought_up {
            if open > 0 {
                return self.mark_all(now);
            }
            self.begin_action(Action::BringUp, None, None, now);
            return Flow::Again;
        }
        let Some(step) = self.program.steps().get(self.next) else {
            if open > 0 {
                return self.mark_all(now);
            }
            let outcome = Outcome { end: End::Completed, step: None, stop: Stop::NotNeeded };
            self.end(outcome, now);
            return Flow::Wait;
        };
        match step.statement {
            Statement::Motion(MotionCommand::RebootRobot) | Statement::Velocity(_) if open > 0 => {
                self.mark_all(now)
            }
            Statement::Motion(MotionCommand::RebootRobot) => {
                self.begin_action(Action::Reboot, None, Some(self.next), now);
                Flow::Again
            }
            Statement::Motion(command) => self.submit(command, now),
            Statement::Velocity(velocity) => self.begin_velocity(velocity, now),
            statement => {
                let is_due =
                    if acts_on_the_queue(&statement) { self.is_all_accepted() } else { open == 0 };
                match actions_of(&statement) {
                    Some((action, then)) if is_due => {
                        self.begin_action(action, then, Some(self.next), now);
                        Flow::Again
                    }
                    _ => self.mark_all(now),
                }
            }
        }
    }

    fn is_past_barrier(&mut self) -> bool {
        let Some(Barrier { step, until_done }) = self.barrier else { return true };
        let is_passed = self.ledger.records().get(step).is_none_or(|record| {
            record.ended.is_some() || !until_done && record.accepted.is_some()
        });
        if is_passed {
            self.barrier = None;
        }
        is_passed
    }

    fn is_all_accepted(&self) -> bool {
        let records = self.ledger.records();
        self.in_flight
            .steps()
            .all(|step| records.get(step).is_some_and(|record| record.accepted.is_some()))
    }

    /// Asks whether everything sent has been read, if nobody asked yet.
    fn mark_all(&mut self, now: Instant) -> Flow {
        if self.next > self.marked && !self.talk.is_awaiting() {
            self.talk.mark(self.next, now);
            self.marked = self.next;
        }
        Flow::Wait
    }

    fn submit(&mut self, command: MotionCommand, now: Instant) -> Flow {
        let is_slow = self.talk.has_lines() || !self.talk.allowance.allows(LINES_A_STEP);
        if self.in_flight.is_full() || is_slow && self.next > self.marked + STEPS_A_MARK {
            return self.mark_all(now);
        }
        if is_slow {
            return Flow::Wait;
        }
        let Some(text) = CommandText::of(&command) else {
            let end = End::Refused(SubmitError::NoMovement);
            let outcome = Outcome { end, step: Some(self.next), stop: Stop::NotNeeded };
            self.stop(outcome, now);
            return Flow::Wait;
        };
        let step = self.next;
        self.ledger.submitted(step, now);
        match command {
            MotionCommand::SetVelTimeout(seconds) => self.velocity_timeout_s = seconds.into(),
            MotionCommand::SetTimeScaling(percent) => self.time_scaling_percent = percent.into(),
            _ => {}
        }
        let kind = command.spec().map(|spec| spec.kind);
        let starts_program = matches!(command, MotionCommand::StartProgram(_));
        if kind == Some(CommandKind::Instantaneous) && !starts_program {
            self.talk.say(text.to_string());
            self.talk.mark(step, now);
            self.ledger.started(step, now);
            self.stage = Stage::Asking { step, since: now };
            return Flow::Wait;
        }
        if self.in_flight.steps().next().is_none() {
            self.ledger.started(step, now);
            self.begin_frame_change(step);
        }
        self.talk.say(text.to_string());
        let checkpoint = self.in_flight.push(step);
        self.talk.say(format!("SetCheckpoint({checkpoint})"));
        self.next += 1;
        if starts_program || needs_a_tool(&command) {
            self.barrier = Some(Barrier { step, until_done: starts_program });
            self.talk.mark(self.next, now);
            self.marked = self.next;
        } else if self.next >= self.marked + STEPS_A_MARK {
            self.mark_all(now);
        }
        Flow::Again
    }

    /// Takes up the velocity line `self.next`.
    fn begin_velocity(&mut self, velocity: VelocityCommand, now: Instant) -> Flow {
        let step = self.next;
        let Some(text) = CommandText::of(&velocity.into()) else { return Flow::Wait };
        self.ledger.submitted(step, now);
        self.ledger.started(step, now);
        self.next += 1;
        self.talk.say(text.to_string());
        if !self.talk.is_awaiting() {
            self.talk.mark(self.next, now);
        }
        let hold = self.velocity_hold();
        let lead = if self.next_velocity().is_some() { LEAD.min(hold / 4) } else { Duration::ZERO };
        self.stage = Stage::Holding { step, until: now + hold.saturating_sub(lead) };
        Flow::Again
    }

    fn next_velocity(&self) -> Option<VelocityCommand> {
        match self.program.steps().get(self.next)?.statement {
            Statement::Velocity(velocity) => Some(velocity),
            _ => None,
        }
    }

    /// How long a velocity line lasts: the robot's own timeout runs in the robot's scaled time.
    fn velocity_hold(&self) -> Duration {
        let seconds = self.velocity_timeout_s * 100.0 / self.time_scaling_percent;
        Duration::try_from_secs_f64(seconds).unwrap_or(Duration::ZERO)
    }

    /// A velocity line lasts until `until`.
    pub(super) fn hold(&mut self, step: usize, until: Instant, now: Instant) -> Flow {
        if now < until {
            return Flow::Wait;
        }
        if let Some(next) = self.next_velocity() {
            self.finish_step(step, now);
            return self.begin_velocity(next, now);
        }
        // Executed when the motion has come to a stop. Source: PM L387.
        self.talk.say("Delay(0)");
        let checkpoint = self.in_flight.push(step);
        self.talk.say(format!("SetCheckpoint({checkpoint})"));
        self.talk.mark(self.next, now);
        self.marked = self.next;
        self.stage = Stage::Streaming;
        Flow::Again
    }

    /// A step begins that changes a frame, if it does.
    pub(super) fn begin_frame_change(&mut self, step: usize) {
        if let Some((frame, _)) = self.frame_of(step) {
            self.trace.begin_change(frame);
        }
    }

    /// It is done.
    pub(super) fn end_frame_change(&mut self, step: usize) {
        if let Some((frame, value)) = self.frame_of(step) {
            self.trace.set(frame, value);
        }
    }

    fn frame_of(&self, step: usize) -> Option<(Frame, [f32; 6])> {
        let values = |pose: Pose| {
            let Pose { x, y, z, alpha, beta, gamma } = pose;
            [x, y, z, alpha, beta, gamma]
        };
        match self.motion_of(step)? {
            MotionCommand::SetWrf(pose) => Some((Frame::Wrf, values(pose))),
            MotionCommand::SetTrf(pose) => Some((Frame::Trf, values(pose))),
            _ => None,
        }
    }
}
