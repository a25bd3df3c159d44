//! Actions as lines: what is asked for, and by what the robot's state confirms it.
//!
//! ```text
//! state asked for --> already so: next step | impossible: failed | line sent, state asked for again ...
//! ```
//!
//! The robot's own answers come in their own time and not always (a resumption that only resets a signal
//! has none), so the state that it tells afterwards counts, as over a bus.

use std::format;
use std::string::String;
use std::vec::Vec;

use super::robot::{Robot, is_of_the_state};
use crate::engine::meca500::{Action, ActionLimits, Fault};
use crate::time::Duration;
use crate::wire::meca500::code::Code;

/// Recovery mode on, and off.
const RECOVERY: [Code; 2] = [Code(2049), Code(2050)];

/// A part of an action: one line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// ResumeMotion for the sake of safety signals, on a robot that is not ready for motion.
    ResetStops,
    Activate,
    /// With the drives initialised anew.
    Initialise,
    Deactivate,
    Home {
        or_recovery: bool,
    },
    ResetError,
    Pause,
    Clear,
    Resume,
    Simulation(bool),
    Recovery(bool),
    HostTime(u32),
    Reboot,
}

/// What to do about a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Judgement {
    Done,
    /// Its line is due.
    Send,
    /// Ask again soon.
    Wait,
    Failed(Fault),
}

/// The parts of an action.
pub(super) const fn steps(action: Action) -> &'static [Step] {
    match action {
        Action::Activate => &[Step::Activate],
        Action::ClearHoming => &[Step::Initialise],
        Action::Deactivate => &[Step::Deactivate],
        Action::Home => &[Step::Home { or_recovery: false }],
        Action::ResetError => &[Step::ResetError],
        Action::Pause => &[Step::Pause],
        Action::Clear => &[Step::Clear],
        Action::Resume => &[Step::Resume],
        Action::Simulation(true) => &[Step::Simulation(true)],
        Action::Simulation(false) => &[Step::Simulation(false)],
        Action::RecoveryMode(true) => &[Step::Recovery(true)],
        Action::RecoveryMode(false) => &[Step::Recovery(false)],
        Action::Reboot => &[Step::Reboot],
        Action::BringUp => &[
            Step::ResetStops,
            Step::Activate,
            Step::ResetStops,
            Step::Home { or_recovery: true },
            // Whatever somebody else has left in the queue, nobody knows what it does.
            Step::Clear,
            // A robot whose error was reset needs it too, and need not say so.
            Step::Resume,
        ],
        // Its only part carries a value; the others have no place in a program.
        Action::HostTime(_) | Action::Recover | Action::Brakes { .. } | Action::DisableEtherCat => {
            &[]
        }
    }
}

/// The part of an action at `index`.
pub(super) fn step(action: Action, index: usize) -> Option<Step> {
    match action {
        Action::HostTime(seconds) => (index == 0).then_some(Step::HostTime(seconds)),
        action => steps(action).get(index).copied(),
    }
}

impl Step {
    pub(super) fn line(self) -> String {
        match self {
            Self::ResetStops | Self::Resume => "ResumeMotion",
            Self::Activate => "ActivateRobot",
            Self::Initialise => "ActivateRobot(1)",
            Self::Deactivate => "DeactivateRobot",
            Self::Home { .. } => "Home",
            Self::ResetError => "ResetError",
            Self::Pause => "PauseMotion",
            Self::Clear => "ClearMotion",
            Self::Simulation(true) => "ActivateSim",
            Self::Simulation(false) => "DeactivateSim",
            Self::Recovery(true) => "SetRecoveryMode(1)",
            Self::Recovery(false) => "SetRecoveryMode(0)",
            Self::HostTime(seconds) => return format!("SetRtc({seconds})"),
            Self::Reboot => "RebootRobot",
        }
        .into()
    }

    pub(super) fn limit(self) -> Duration {
        let limits = ActionLimits::default();
        match self {
            Self::Activate | Self::Initialise => limits.activate,
            Self::Deactivate => limits.deactivate,
            Self::Home { .. } => limits.home,
            Self::ResetError => limits.reset_error,
            Self::Resume => limits.resume,
            Self::Pause => limits.pause,
            Self::Clear => limits.clear,
            Self::ResetStops | Self::Simulation(_) | Self::Recovery(_) | Self::HostTime(_) => {
                limits.setting
            }
            Self::Reboot => limits.reboot,
        }
    }

    /// What to do, as the robot is before its line was sent.
    pub(super) fn before(self, robot: &Robot) -> Judgement {
        let is_blocked = !robot.blocking_stops().is_empty();
        let done_if = |is_done| if is_done { Judgement::Done } else { Judgement::Send };
        let wrong_state = Judgement::Failed(Fault::WrongState);
        match self {
            Self::Activate if robot.is_activated() => Judgement::Done,
            Self::Initialise if robot.is_activated() => wrong_state,
            Self::Home { or_recovery } if or_recovery && robot.is_ready() => Judgement::Done,
            Self::Home { .. } if robot.is(|status| status.is_activated && status.is_homed) => {
                Judgement::Done
            }
            Self::Activate | Self::Initialise | Self::Home { .. } if is_blocked => {
                Judgement::Failed(Fault::SafetyStopPresent)
            }
            Self::Home { .. } if !robot.is_activated() => wrong_state,
            Self::ResetStops => done_if(robot.is_ready() || is_blocked || robot.stops.is_empty()),
            Self::Deactivate => done_if(!robot.is_activated()),
            Self::ResetError => done_if(!robot.is(|status| status.is_in_error)),
            Self::Resume if robot.is(|status| status.is_in_error) => {
                Judgement::Failed(Fault::RobotError(robot.error))
            }
            Self::Resume if !robot.is_activated() => wrong_state,
            // A signal may go away by itself.
            Self::Resume if is_blocked => Judgement::Wait,
            Self::Simulation(on) if robot.is(|status| status.is_simulated == on) => Judgement::Done,
            Self::Simulation(_) | Self::Reboot if robot.is_activated() => wrong_state,
            Self::Simulation(_) if !robot.stops.is_empty() => {
                Judgement::Failed(Fault::SafetyStopPresent)
            }
            _ => Judgement::Send,
        }
    }

    /// What to do, as the robot is after it has read the line: it answered with `answers`.
    pub(super) fn after(self, robot: &Robot, answers: &Answers) -> Judgement {
        if let Some(code) = answers.error {
            return self.refused(robot, code, answers.had_stops);
        }
        let done_if = |is_done| if is_done { Judgement::Done } else { Judgement::Wait };
        match self {
            Self::ResetStops => Judgement::Done,
            Self::Activate | Self::Initialise | Self::Home { .. }
                if !robot.blocking_stops().is_empty() =>
            {
                Judgement::Failed(Fault::SafetyStopPresent)
            }
            Self::Activate | Self::Initialise => done_if(robot.is_activated()),
            Self::Home { or_recovery } => {
                done_if(robot.is(|status| status.is_homed) || or_recovery && robot.is_in_recovery)
            }
            Self::Deactivate => done_if(!robot.is_activated()),
            Self::ResetError => done_if(!robot.is(|status| status.is_in_error)),
            Self::Pause => done_if(robot.is(|status| status.is_paused)),
            Self::Clear => done_if(answers.has(Code::MOTION_CLEARED)),
            Self::Resume if robot.is(|status| status.is_in_error) => {
                Judgement::Failed(Fault::RobotError(robot.error))
            }
            Self::Resume if is_resumed(robot) => Judgement::Done,
            // It reset a signal; under one reading motion needs a line of its own.
            Self::Resume if answers.had_stops && robot.stops.is_empty() => Judgement::Send,
            Self::Resume => Judgement::Wait,
            Self::Simulation(on) => done_if(robot.is(|status| status.is_simulated == on)),
            Self::Recovery(_) => done_if(RECOVERY.iter().any(|code| answers.has(*code))),
            Self::HostTime(_) => done_if(answers.has(Code::COMMAND_SUCCESSFUL)),
            Self::Reboot => Judgement::Wait,
        }
    }

    fn refused(self, robot: &Robot, code: Code, had_stops: bool) -> Judgement {
        match (self, code) {
            // Whether the robot listens before it is ready is not stated: the next step will tell.
            (Self::ResetStops, _) => Judgement::Done,
            (_, code) if is_of_the_state(code) => Judgement::Failed(Fault::WrongState),
            (Self::Resume, Code::COMMAND_FAILED) if had_stops => {
                if robot.blocking_stops().is_empty() { Judgement::Send } else { Judgement::Wait }
            }
            (_, Code::IN_ERROR) if robot.error.is_set() => {
                Judgement::Failed(Fault::RobotError(robot.error))
            }
            (_, code) => Judgement::Failed(Fault::RobotError(code)),
        }
    }
}

fn is_resumed(robot: &Robot) -> bool {
    robot.stops.is_empty() && robot.is(|status| !status.is_paused)
}

/// What the robot said since the line of a step was sent.
#[derive(Clone, Debug, Default)]
pub(super) struct Answers {
    codes: Vec<Code>,
    /// The first error.
    pub(super) error: Option<Code>,
    /// Whether a safety signal was there when the line was sent.
    pub(super) had_stops: bool,
}

/// Codes kept: none of a run's own steps needs more than one of a few.
const MOST_CODES: usize = 64;

impl Answers {
    /// Nothing yet.
    pub(super) fn since(had_stops: bool) -> Self {
        Self { had_stops, ..Self::default() }
    }

    pub(super) fn take_in(&mut self, code: Code, is_error: bool) {
        if is_error {
            self.error.get_or_insert(code);
        } else if self.codes.len() < MOST_CODES && !self.has(code) {
            self.codes.push(code);
        }
    }

    pub(super) fn has(&self, code: Code) -> bool {
        self.codes.contains(&code)
    }
}
