//! The program runner over the text interface.
//!
//! ```text
//!            told all              state confirmed            timeout over
//! SettingUp ---------> Streaming <--------------- Acting   Streaming -----> Holding
//!                       |   |  ^---- answered ---- Asking      ^---------------'
//!    all steps ended <--'   '-- error, stop signal --> Troubled --> Stopping --> end
//! ```
//!
//! What a line means is what it means over a bus (see [`crate::run::runner`]):
//!
//! * **Queued commands** stream ahead, each with a checkpoint of ours behind it. [`TextSettings::window`]
//!   bounds how many are under way, so the robot's queue is never full, and an allowance how many
//!   leave in a second.
//! * **PauseMotion, ClearMotion, ResumeMotion, ResetError** act when the robot has read every line before
//!   them, every other action when those are done.
//! * **A velocity line** waits for the lines before it, is sent once, and lasts as long as the robot's own
//!   velocity timeout; the next velocity line leaves just before that is over. Behind the last one a
//!   `Delay(0)` with a checkpoint tells when the arm stands.
//!
//! Three things are known here that a bus does not tell. A command that the robot refuses ends the run at
//! its line: nothing behind a line that may be refused for what the robot lacks (a gripper, a stored
//! program) is sent before the robot has taken it. A setting that acts at once is waited for. Behind
//! StartProgram nothing is sent until its checkpoint is reached, for a stored program may be as long as
//! the queue.
//!
//! Invariants: done is what a checkpoint or an answer says, never EOB or EOM; no run ends with motion
//! going on, unless the connection is lost, upon which the robot stops by itself (PM L904).

mod acting;
mod ending;
mod sending;

use std::format;
use std::string::String;
use std::vec::Vec;

use super::action::{Answers, Step};
use super::in_flight::InFlight;
use super::link::Heard;
use super::robot::{Robot, is_error, is_of_the_state, is_refusal, safety_signal};
use super::settings::TextSettings;
use super::stop::{Halt, Progress};
use super::talk::{Talk, TalkStatistics};
use super::trace::Trace;
use crate::engine::meca500::{AbortReason, Action, Event, Fault, WaitReason};
use crate::run::observation::Observation;
use crate::run::outcome::{End, LinkMessage, Outcome, Stop};
use crate::run::program::Program;
use crate::run::record::{Counts, Ledger, StepEnd, StepRecord};
use crate::run::runner::{Phase, STOP_LIMIT, VELOCITY_TIMEOUT_S};
use crate::time::{Duration, Instant};
use crate::wire::meca500::code::Code;
use crate::wire::meca500::command::MotionCommand;
use crate::wire::meca500::image::SafetySignals;
use crate::wire::meca500::text::{CommandText, Message, Statement, TextCommandSpec};
use ending::{is_undecided, reason_of};

/// Time for the robot to read a line and to answer.
///
/// Source: choice, as the vendor's client has it. Source: client
pub const ANSWER_LIMIT: Duration = Duration::from_secs(10);
/// Silence after which the robot is asked for its state.
const SILENCE: Duration = Duration::from_secs(2);
/// Time between two looks at a state that is waited for, if nothing is heard.
const LOOK_AGAIN: Duration = Duration::from_millis(100);
/// Time after which a robot that was busy is told again to stop.
const STOP_AGAIN: Duration = Duration::from_millis(20);
/// Time in which an idle robot must have told the checkpoints of what it did.
const IDLE_LIMIT: Duration = Duration::from_secs(10);

/// What the runner is at.
#[derive(Clone, Debug)]
enum Stage {
    /// Settings and questions are sent; `mark` stands behind them.
    SettingUp {
        mark: u32,
    },
    Streaming,
    /// A line that acts at once is sent and not answered.
    Asking {
        step: usize,
        since: Instant,
    },
    Acting(Acting),
    /// A velocity line lasts.
    Holding {
        step: usize,
        until: Instant,
    },
    /// The robot was told to reboot.
    Rebooting {
        step: Option<usize>,
        since: Instant,
        is_gone: bool,
    },
    /// Something ends the run; what it did to the lines under way is being told.
    Troubled {
        outcome: Outcome,
        since: Instant,
        mark: u32,
    },
    Stopping {
        outcome: Outcome,
        since: Instant,
        halt: Halt,
        again_at: Option<Instant>,
    },
    Ended(Outcome),
}

/// An action under way.
#[derive(Clone, Debug)]
struct Acting {
    action: Action,
    /// Which line of the program it is for; none for bringing up.
    step: Option<usize>,
    /// What follows it.
    then: Option<Action>,
    index: usize,
    /// The mark behind the question for the state.
    mark: Option<u32>,
    answers: Option<Answers>,
    look_at: Instant,
    /// When a line that was refused may be sent again.
    again_at: Instant,
    deadline: Instant,
}

/// What is waited for before another line is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Barrier {
    step: usize,
    until_done: bool,
}

/// Follows one program on one robot.
#[derive(Debug)]
pub struct TextRunner<'p> {
    program: &'p Program,
    settings: TextSettings,
    stage: Stage,
    next: usize,
    is_brought_up: bool,
    ledger: Ledger,
    in_flight: InFlight,
    talk: Talk,
    robot: Robot,
    trace: Trace,
    barrier: Option<Barrier>,
    /// Steps in front of the last mark.
    marked: usize,
    copies_monitoring: bool,
    interval_before: Option<f64>,
    velocity_timeout_s: f64,
    time_scaling_percent: f64,
    idle_since: Option<Instant>,
    /// When the robot last told its state.
    status_at: Instant,
    lost: Option<LinkMessage>,
}

/// Who hears what happens; see [`crate::run::drive::Observer::event`].
pub(super) type Tell<'a> = &'a mut dyn FnMut(&Event);

/// Whether there may be more to do at once.
enum Flow {
    Again,
    Wait,
}

impl<'p> TextRunner<'p> {
    /// A runner at the beginning of `program`.
    #[must_use]
    pub fn new(program: &'p Program, settings: TextSettings) -> Self {
        Self {
            program,
            settings,
            stage: Stage::SettingUp { mark: 0 },
            next: 0,
            is_brought_up: false,
            ledger: Ledger::new(program.steps().len()),
            in_flight: InFlight::new(settings.checkpoints, settings.window),
            talk: Talk::new(settings.watchdog),
            robot: Robot::unknown(),
            trace: Trace::new(),
            barrier: None,
            marked: 0,
            copies_monitoring: false,
            interval_before: None,
            velocity_timeout_s: VELOCITY_TIMEOUT_S,
            time_scaling_percent: 100.0,
            idle_since: None,
            status_at: Instant::ZERO,
            lost: None,
        }
    }

    /// The first command of a program that has no text, which no program from a file has.
    #[must_use]
    pub fn without_text(program: &Program) -> Option<usize> {
        program.steps().iter().position(|step| match step.statement {
            Statement::Motion(command) => CommandText::of(&command).is_none(),
            _ => false,
        })
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

    /// What passed between both ends.
    #[must_use]
    pub fn statistics(&self) -> TalkStatistics {
        self.talk.statistics()
    }

    /// What was said when the connection was lost, if it was.
    #[must_use]
    pub const fn lost(&self) -> Option<LinkMessage> {
        self.lost
    }

    /// What the run is at.
    #[must_use]
    pub fn phase(&self) -> Phase {
        match &self.stage {
            Stage::SettingUp { .. } => Phase::Connecting,
            Stage::Acting(Acting { step: None, .. }) => Phase::BringingUp,
            Stage::Stopping { .. } => Phase::Stopping,
            _ => Phase::Running,
        }
    }

    /// The first step that has not ended; the number of steps when all have.
    #[must_use]
    pub const fn current_step(&self) -> usize {
        self.ledger.first_open()
    }

    /// The outcome, once there is one.
    #[must_use]
    pub const fn outcome(&self) -> Option<Outcome> {
        match &self.stage {
            Stage::Ended(outcome) => Some(*outcome),
            _ => None,
        }
    }

    /// Whether the connection has ended on purpose and is to be made anew.
    pub(super) const fn wants_link(&self) -> bool {
        matches!(self.stage, Stage::Rebooting { is_gone: true, .. })
    }

    /// The connection is there: asks for all that a run must know.
    pub(super) fn connected(&mut self, now: Instant) {
        self.talk.restart(now);
        self.robot = Robot::unknown();
        self.copies_monitoring = false;
        self.talk.feed(now);
        self.talk.say("GetStatusRobot");
        for code in [Code::P_STOP_2, Code::E_STOP, Code::REBOOTED, Code::CONNECTION_DROPPED] {
            self.talk.say(format!("GetSafetyStopStatus({})", code.0));
        }
        self.talk.say("GetRtTargetJointPos");
        self.talk.say("GetRtTargetCartPos");
        if let Some(interval) = self.settings.interval {
            self.talk.say("GetMonitoringInterval");
            self.talk.say(format!("SetMonitoringInterval({})", interval.as_secs_f64()));
        }
        self.ask_for_copies();
        let mark = self.talk.mark(0, now);
        self.stage = Stage::SettingUp { mark };
    }

    fn ask_for_copies(&mut self) {
        if self.settings.copies_monitoring && !self.copies_monitoring {
            self.talk.say("SetCtrlPortMonitoring(1)");
        }
    }

    /// The robot rebooted and is connected again.
    pub(super) fn reconnected(&mut self, now: Instant, tell: Tell<'_>) {
        if let Stage::Rebooting { step, .. } = self.stage {
            if let Some(step) = step {
                self.finish_step(step, now);
                self.next += 1;
            }
            tell(&Event::ActionDone(Action::Reboot));
            (self.velocity_timeout_s, self.time_scaling_percent) = (VELOCITY_TIMEOUT_S, 100.0);
            self.trace.reset_frames();
            self.connected(now);
        }
    }

    /// What is to be asked and put back at the end, while the connection is still there.
    pub(super) fn farewell(&mut self, now: Instant) {
        self.talk.hush();
        self.talk.say("GetRtTargetJointPos");
        self.talk.say("GetRtTargetCartPos");
        if let Some(interval) = self.interval_before {
            self.talk.say(format!("SetMonitoringInterval({interval})"));
        }
        if self.copies_monitoring {
            self.talk.say("SetCtrlPortMonitoring(0)");
        }
        self.talk.stop_feeding();
        self.talk.mark(0, now);
    }

    /// Whether all of that has been read by the robot.
    pub(super) fn has_said_farewell(&self) -> bool {
        !self.talk.is_awaiting()
    }

    /// The next line to be sent.
    pub(super) fn next_line(&self) -> Option<&str> {
        self.talk.next_line()
    }

    /// It is sent.
    pub(super) fn sent_line(&mut self) {
        self.talk.sent_line();
    }

    /// When something is to be done at the latest, if nothing is heard.
    pub(super) fn due(&self, now: Instant) -> Instant {
        let of_stage = match &self.stage {
            Stage::Holding { until, .. } => Some(*until),
            Stage::Acting(acting) if acting.mark.is_none() => Some(acting.look_at),
            Stage::Stopping { again_at, .. } => *again_at,
            Stage::Streaming => Some(self.talk.allowance.due(3)).filter(|due| *due > now),
            _ => None,
        };
        let other = self.talk.feed_due();
        let soon = now + LOOK_AGAIN;
        of_stage.into_iter().chain(other).fold(soon, Instant::min).max(now)
    }

    /// Takes in a message; an observation, where one is whole.
    pub(super) fn heard(
        &mut self,
        now: Instant,
        heard: Heard<'_>,
        tell: Tell<'_>,
    ) -> Option<Observation> {
        let message = match heard {
            Heard::Monitoring(message) => return self.trace.take_in(&message),
            Heard::Control(message) => message,
        };
        self.talk.has_heard(now);
        self.robot.take_in(&message);
        let code = message.code;
        let number = || message.values().next().and_then(|value| value.integer());
        let checkpoint = || number().and_then(|number| u16::try_from(number).ok());
        if let Some((signals, value)) = safety_signal(&message) {
            self.safety(signals, value, now, tell);
        } else if is_error(code) {
            self.error(&message, now, tell);
        } else {
            match code {
                Code(2097) => {
                    if let Some(upto) = number().and_then(|n| self.talk.answered(n, now)) {
                        self.accept(upto, now);
                    }
                }
                Code(2096) => self.copies_monitoring = message.body.contains("enabled"),
                Code(2116) => self.interval_before = message.number().or(self.interval_before),
                Code::CHECKPOINT_REACHED => {
                    if let Some(number) = checkpoint() {
                        self.reached(number, now, tell);
                    }
                }
                Code::CHECKPOINT_DISCARDED => {
                    if let Some(number) = checkpoint() {
                        self.discarded(number, now, tell);
                    }
                }
                Code::ERROR_RESET => tell(&Event::RobotErrorCleared),
                Code::STATUS_ROBOT => {
                    self.status_at = now;
                    self.watch_error_mode(now);
                }
                // A mere warning, unless it has stopped the robot: that is told with its state.
                Code::MOVE_DURATION_TOO_SHORT => drop(self.talk.ask_for_status(0, now)),
                _ => {}
            }
        }
        self.answer(code, now, tell);
        if matches!(code, Code::STATUS_ROBOT) { None } else { self.trace.take_in(&message) }
    }

    /// Gives a message to whoever waits for it.
    fn answer(&mut self, code: Code, now: Instant, tell: Tell<'_>) {
        let is_error = is_error(code);
        match &mut self.stage {
            Stage::Acting(Acting { answers: Some(answers), look_at, .. }) => {
                answers.take_in(code, is_error);
                if is_error
                    || matches!(code.0, 2000..=2006 | 2042..=2050 | 3032 | 3070 | 3081..=3087)
                {
                    *look_at = now;
                }
            }
            Stage::Asking { step, .. } => {
                let step = *step;
                if self.answers_of(step).contains(&code) {
                    self.ledger.accepted(step, now);
                    self.finish_step(step, now);
                    self.next += 1;
                    self.stage = Stage::Streaming;
                }
            }
            Stage::Stopping { outcome, halt, again_at, .. } => match halt.heard(code, is_error) {
                Progress::None => {}
                Progress::Again => *again_at = Some(now + STOP_AGAIN),
                Progress::Next(next) => {
                    *halt = next;
                    self.talk.say(next.line());
                }
                Progress::Over(stop) => {
                    let outcome = Outcome { stop, ..*outcome };
                    if stop == Stop::Confirmed {
                        tell(&Event::ActionDone(Action::Clear));
                    }
                    self.end(outcome, now);
                }
            },
            _ => {}
        }
    }

    fn answers_of(&self, step: usize) -> &'static [Code] {
        let statement = self.program.steps().get(step).map(|step| step.statement);
        let Some(Statement::Motion(command)) = statement else { return &[] };
        spec_of(&command).map_or(&[], TextCommandSpec::answers)
    }

    /// The robot has read all lines of the steps before `upto`, and found no fault with those that it did
    /// not refuse.
    fn accept(&mut self, upto: usize, now: Instant) {
        let records = self.ledger.records();
        let is_new = |step: &usize| {
            records.get(*step).is_some_and(|record| {
                record.submitted.is_some()
                    && record.accepted.is_none()
                    && matches!(record.end, StepEnd::Open | StepEnd::Done)
            })
        };
        let held = match self.stage {
            Stage::Holding { step, .. } => Some(step),
            _ => None,
        };
        let steps = self.in_flight.steps().chain(held).filter(|step| *step < upto);
        let steps: Vec<usize> = steps.filter(is_new).collect();
        for step in steps {
            self.ledger.accepted(step, now);
        }
    }

    /// A step is done, and so the next one begins.
    fn finish_step(&mut self, step: usize, now: Instant) {
        self.ledger.accepted(step, now);
        self.ledger.started(step, now);
        self.ledger.ended(step, now, StepEnd::Done);
    }

    fn reached(&mut self, number: u16, now: Instant, tell: Tell<'_>) {
        let is_own = self.in_flight.owns(number);
        let done: Vec<usize> = self.in_flight.reached(number).collect();
        if !done.is_empty() {
            self.idle_since = None;
        }
        for step in done {
            // A line that was refused is not done, though its checkpoint was taken.
            let is_open =
                self.ledger.records().get(step).is_some_and(|record| record.end == StepEnd::Open);
            if is_open {
                self.finish_step(step, now);
                self.end_frame_change(step);
            }
        }
        let next = self.in_flight.steps().next();
        if let Some(step) = next {
            self.ledger.started(step, now);
            self.begin_frame_change(step);
        }
        if !is_own {
            tell(&Event::CheckpointReached { number });
        }
    }

    /// Who clears the queue is known from what is under way, or will be from what is told next.
    fn discarded(&mut self, number: u16, now: Instant, tell: Tell<'_>) {
        if !self.in_flight.owns(number) {
            return tell(&Event::CheckpointDiscarded { number });
        }
        let reason = match &self.stage {
            Stage::Acting(Acting { action: Action::Clear, .. }) => Some(AbortReason::Cleared),
            Stage::Acting(Acting { action: Action::Deactivate, .. }) => {
                Some(AbortReason::Deactivated)
            }
            Stage::Troubled { outcome, .. } | Stage::Stopping { outcome, .. } => {
                Some(reason_of(&outcome.end))
            }
            _ => None,
        };
        match reason {
            Some(reason) => {
                if let Some(step) = self.in_flight.discarded(number) {
                    self.ledger.ended(step, now, StepEnd::Aborted(reason));
                }
            }
            // The cause comes with it or right behind: it decides what became of the lines.
            None if self.is_streaming() => {
                let end = if self.robot.stops.is_empty() {
                    End::HeldBack(WaitReason::Cleared)
                } else {
                    End::SafetyStop(self.robot.stops)
                };
                self.trouble(end, None, now);
            }
            None => {}
        }
    }

    const fn is_streaming(&self) -> bool {
        matches!(self.stage, Stage::Streaming | Stage::Asking { .. } | Stage::Holding { .. })
    }

    fn safety(&mut self, signals: SafetySignals, value: i64, now: Instant, tell: Tell<'_>) {
        if self.robot.stops.is_empty() {
            if !matches!(self.stage, Stage::SettingUp { .. }) {
                tell(&Event::SafetyCleared);
            }
            return;
        }
        if value == 0 {
            return;
        }
        tell(&Event::SafetyStop { signals: self.robot.stops });
        let end = End::SafetyStop(signals);
        match &mut self.stage {
            Stage::Streaming | Stage::Asking { .. } | Stage::Holding { .. } if value == 1 => {
                self.trouble(end, None, now);
            }
            // What cleared the queue is known now.
            Stage::Troubled { outcome, .. } if is_undecided(&outcome.end) => outcome.end = end,
            _ => {}
        }
    }

    /// Error mode of which no error was told, or not yet.
    fn watch_error_mode(&mut self, now: Instant) {
        let is_in_error = self.robot.is(|status| status.is_in_error);
        if is_in_error && self.is_streaming() && self.ledger.counts().submitted > 0 {
            let code = if self.robot.error.is_set() { self.robot.error } else { Code::IN_ERROR };
            self.trouble(End::RobotError(code), None, now);
        }
    }

    fn error(&mut self, message: &Message<'_>, now: Instant, tell: Tell<'_>) {
        let code = message.code;
        tell(&Event::RobotError { code });
        if self.is_streaming() {
            let step = self.blamed(message);
            if is_refusal(code)
                && let Some(step) = step
            {
                self.ledger.ended(step, now, StepEnd::Aborted(AbortReason::Error(code)));
            }
            let end = self.end_of_refusal(code);
            self.trouble(end, step, now);
            return;
        }
        match &mut self.stage {
            // What cleared the queue is known now.
            Stage::Troubled { outcome, .. } if is_undecided(&outcome.end) && !is_refusal(code) => {
                outcome.end = End::RobotError(code);
            }
            Stage::Rebooting { is_gone: false, .. } => {
                let fault =
                    if is_of_the_state(code) { Fault::WrongState } else { Fault::RobotError(code) };
                self.act_failed(Action::Reboot, fault, now);
            }
            _ => {}
        }
    }

    /// How a run ends over an error that the robot reports.
    fn end_of_refusal(&self, code: Code) -> End {
        let is_stopped = !self.robot.stops.is_empty();
        match code {
            code if is_of_the_state(code) && is_stopped => End::SafetyStop(self.robot.stops),
            Code::NOT_ACTIVATED => End::HeldBack(WaitReason::NotActivated),
            Code::NOT_HOMED => End::HeldBack(WaitReason::NotHomed),
            Code::DEACTIVATION_NEEDED => End::HeldBack(WaitReason::NotDeactivated),
            Code::IN_ERROR if self.robot.error.is_set() && self.robot.error != code => {
                End::RobotError(self.robot.error)
            }
            Code::IN_ERROR => End::HeldBack(WaitReason::RobotError),
            code => End::RobotError(code),
        }
    }

    /// The line that an error is about: the one it quotes, or, of a refusal, the first that may be refused
    /// so among those whose arrival is not known; else the first that is not done.
    fn blamed(&self, message: &Message<'_>) -> Option<usize> {
        if let Stage::Asking { step, .. } | Stage::Holding { step, .. } = self.stage {
            return Some(step);
        }
        let records = self.ledger.records();
        let is_open =
            |step: &usize| records.get(*step).is_some_and(|record| record.end == StepEnd::Open);
        let open = || self.in_flight.steps().filter(is_open);
        if let Some(quoted) = message.quoted_command()
            && let Some(step) = open().find(|step| self.reads_as(*step, quoted))
        {
            return Some(step);
        }
        if !is_refusal(message.code) {
            return open().next();
        }
        let is_new =
            |step: &usize| records.get(*step).is_some_and(|record| record.accepted.is_none());
        let may_fail = |step: &usize| {
            self.motion_of(*step)
                .and_then(|command| spec_of(&command))
                .is_some_and(|spec| spec.errors().any(|error| error == message.code))
        };
        let new = || open().filter(is_new);
        new().find(may_fail).or_else(|| new().next()).or_else(|| open().next())
    }

    fn motion_of(&self, step: usize) -> Option<MotionCommand> {
        match self.program.steps().get(step)?.statement {
            Statement::Motion(command) => Some(command),
            Statement::Velocity(velocity) => Some(velocity.into()),
            _ => None,
        }
    }

    /// Whether a line was sent as `quoted`, whatever the robot writes the numbers like.
    fn reads_as(&self, step: usize, quoted: &str) -> bool {
        let Some(text) = self.motion_of(step).and_then(|command| CommandText::of(&command)) else {
            return false;
        };
        let plain =
            |text: &str| -> String { text.chars().filter(|c| !c.is_whitespace()).collect() };
        plain(quoted) == plain(&format!("{text}"))
    }

    /// Time has passed, or messages were taken in: does what is due.
    pub(super) fn advance(&mut self, now: Instant, is_interrupted: bool, tell: Tell<'_>) {
        self.talk.allowance.advance(now);
        let is_ending = matches!(self.stage, Stage::Stopping { .. } | Stage::Ended(_));
        if is_interrupted && !is_ending {
            self.interrupt(now);
        }
        if !matches!(self.stage, Stage::Ended(_)) && !self.wants_link() {
            self.talk.feed(now);
            self.keep_in_touch(now);
        }
        while let Flow::Again = self.step(now, tell) {}
    }

    /// Asks a silent robot for its state, and gives up one that answers nothing.
    fn keep_in_touch(&mut self, now: Instant) {
        let is_ending = matches!(self.stage, Stage::Stopping { .. });
        if is_ending || matches!(self.stage, Stage::Rebooting { .. }) {
            return;
        }
        if self.talk.is_overdue(now, ANSWER_LIMIT) {
            // Whether it has taken what was sent, nobody knows.
            let end = match self.stage {
                Stage::SettingUp { .. } => End::NotConnected,
                _ => End::Fault(Fault::AckTimeout),
            };
            let outcome = self.outcome_of(end, Stop::NotNeeded);
            return self.stop(outcome, now);
        }
        let is_silent = now - self.talk.heard_at >= SILENCE;
        // What it told before it read the last lines says nothing about them.
        let is_in_doubt = self.seems_idle() && now - self.status_at >= SILENCE;
        if (is_silent || is_in_doubt) && !self.talk.is_awaiting() {
            self.talk.ask_for_status(self.next, now);
        }
        self.watch_idleness(now);
    }

    /// Whether lines are under way, and the robot has nothing to do as far as it has told.
    fn seems_idle(&self) -> bool {
        matches!(self.stage, Stage::Streaming)
            && self.ledger.counts().open() > 0
            && self.robot.is(|status| status.is_end_of_block && !status.is_paused)
    }

    /// An idle robot whose checkpoints do not come has lost lines: nobody shall wait for them for ever.
    fn watch_idleness(&mut self, now: Instant) {
        if !self.seems_idle() {
            self.idle_since = None;
            return;
        }
        let since = *self.idle_since.get_or_insert(now);
        let is_told_again = self.status_at - since >= SILENCE;
        if now - since > IDLE_LIMIT && is_told_again {
            let outcome = self.outcome_of(End::Fault(Fault::AckTimeout), Stop::NotNeeded);
            self.stop(outcome, now);
        }
    }

    fn step(&mut self, now: Instant, tell: Tell<'_>) -> Flow {
        match &self.stage {
            Stage::Ended(_) => Flow::Wait,
            Stage::SettingUp { mark } => {
                if self.talk.awaits(*mark) || self.robot.status.is_none() {
                    return Flow::Wait;
                }
                tell(&Event::Connected { again: self.next > 0 });
                self.stage = Stage::Streaming;
                Flow::Again
            }
            Stage::Streaming => self.stream(now),
            Stage::Asking { since, .. } => {
                if now - *since > ANSWER_LIMIT {
                    let outcome = self.outcome_of(End::Fault(Fault::AckTimeout), Stop::NotNeeded);
                    self.stop(outcome, now);
                }
                Flow::Wait
            }
            Stage::Acting(_) => self.act(now, tell),
            Stage::Holding { step, until } => {
                let (step, until) = (*step, *until);
                self.hold(step, until, now)
            }
            Stage::Rebooting { since, .. } => {
                if now - *since > Step::Reboot.limit() {
                    let end = End::ActionFailed(Action::Reboot, Fault::Timeout);
                    let outcome = self.outcome_of(end, Stop::NotNeeded);
                    self.end(outcome, now);
                }
                Flow::Wait
            }
            Stage::Troubled { outcome, since, mark } => {
                let (outcome, since, mark) = (*outcome, *since, *mark);
                self.settle_trouble(outcome, since, mark, now)
            }
            Stage::Stopping { outcome, since, halt, again_at } => {
                if now - *since > STOP_LIMIT {
                    let outcome = *outcome;
                    self.end(outcome, now);
                } else if again_at.is_some_and(|at| now >= at) {
                    let line = halt.line();
                    if let Stage::Stopping { again_at, .. } = &mut self.stage {
                        *again_at = None;
                    }
                    self.talk.say(line);
                }
                Flow::Wait
            }
        }
    }
}

/// What the table of text commands says of a motion command.
fn spec_of(command: &MotionCommand) -> Option<&'static TextCommandSpec> {
    let text = format!("{}", CommandText::of(command)?);
    let name = text.split('(').next()?;
    TextCommandSpec::by_name(name)
}
