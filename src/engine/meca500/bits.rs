//! Bits of RobotControl, MotionControl and BrakesControl, step by step.
//!
//! ```text
//! trigger bit:  start --preconditions, all triggers low long enough--> held --confirmed--> done
//!                 | already so: done; can never be: failed               | new error: failed
//! level bit:    start --> commanded --confirmed--> done (the level stays commanded)
//! clear:        raised --Cleared, nothing unacknowledged--> low
//!                  ^------ again if the robot took a command meanwhile
//! ```
//!
//! Whether a trigger acts by level or by edge is not stated but for ResumeMotion. Held until confirmed
//! and then kept 0 for several fresh cycles, a bit does its work under both readings and never twice.
//!
//! Invariants: at most one trigger bit is 1; DeactivateRobot and ActivateRobot are never 1 together;
//! ResumeMotion rises only while PauseMotion and ClearMotion have been 0 for several fresh cycles and
//! no safety signal is left that it cannot reset; BrakesControlAllowed is 1 only while the robot is
//! deactivated and brakes are commanded.

use super::Engine;
use super::Purge;
use super::action::{Action, Actions, Clearing, Errand, Internal};
use super::event::Fault;
use super::inputs::Inputs;
use super::outputs::Outputs;
use crate::time::Instant;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::image::{
    BrakesControlFlags, MotionControlFlags, RobotControlFlags, RobotStatusFlags, SafetySignals,
};

/// One thing to be done and confirmed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    Activate,
    Deactivate,
    Home {
        or_recovery: bool,
    },
    ResetError,
    /// An edge of ResumeMotion that resets what it can, before activation or homing.
    ResetStops,
    Resume {
        always: bool,
    },
    Simulation(bool),
    Recovery(bool),
    Brakes(bool),
    HostTime(u32),
    Send(Internal),
    AwaitReboot,
    DisableEtherCat,
}

/// How far a step is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    Start,
    /// Commanded for so many fresh cycles; `resets` are the signals a resume shall reset.
    Held {
        fresh: u16,
        resets: SafetySignals,
    },
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Running {
    pub(super) action: Action,
    pub(super) index: u8,
    pub(super) step: Step,
    pub(super) stage: Stage,
    pub(super) deadline: Instant,
    pub(super) error_before: u16,
}

enum Progress {
    Pending(Stage),
    Done,
    Failed(Fault),
}

const TRIGGERS: RobotControlFlags = RobotControlFlags::DEACTIVATE_ROBOT
    .union(RobotControlFlags::ACTIVATE_ROBOT)
    .union(RobotControlFlags::HOME)
    .union(RobotControlFlags::RESET_ERROR);
const STOPS: MotionControlFlags =
    MotionControlFlags::PAUSE_MOTION.union(MotionControlFlags::CLEAR_MOTION);

impl Step {
    const fn trigger(self) -> RobotControlFlags {
        match self {
            Self::Activate => RobotControlFlags::ACTIVATE_ROBOT,
            Self::Deactivate => RobotControlFlags::DEACTIVATE_ROBOT,
            Self::Home { .. } => RobotControlFlags::HOME,
            Self::ResetError => RobotControlFlags::RESET_ERROR,
            Self::DisableEtherCat => RobotControlFlags::DISABLE_ETHERCAT,
            _ => RobotControlFlags::empty(),
        }
    }

    /// Whether the robot already is as it shall be.
    fn confirmed(self, inputs: &Inputs) -> bool {
        match self {
            Self::Activate => inputs.activated(),
            Self::Deactivate => !inputs.activated() && !inputs.busy(),
            Self::Home { or_recovery } => inputs.homed() || or_recovery && inputs.recovery(),
            Self::ResetError => inputs.error_code == 0,
            Self::ResetStops => {
                let up = inputs.activated() && (inputs.homed() || inputs.recovery());
                let in_vain = !inputs.blocking_stops().is_empty();
                up || in_vain || inputs.resettable_stops().is_empty()
            }
            Self::Resume { .. } => !inputs.paused(),
            Self::Simulation(on) => inputs.robot.contains(RobotStatusFlags::SIM_ACTIVATED) == on,
            Self::Recovery(on) => inputs.recovery() == on,
            Self::Brakes(engaged) => {
                inputs.robot.contains(RobotStatusFlags::BRAKES_ENGAGED) == engaged
            }
            Self::HostTime(_) | Self::Send(_) | Self::AwaitReboot | Self::DisableEtherCat => false,
        }
    }

    /// Why the robot can never get there from where it is.
    fn impossible(self, inputs: &Inputs) -> Option<Fault> {
        let deactivated = !inputs.activated() && !inputs.busy();
        match self {
            // The E-Stop cuts the motors, a P-Stop 2 ends the homing: waiting leads nowhere.
            Self::Activate | Self::Home { .. } if !inputs.blocking_stops().is_empty() => {
                Some(Fault::SafetyStopPresent)
            }
            Self::Home { .. } if !inputs.activated() => Some(Fault::WrongState),
            Self::Resume { .. } if inputs.error_code != 0 => {
                Some(Fault::RobotError(Code(inputs.error_code)))
            }
            Self::Resume { .. } if !inputs.activated() => Some(Fault::WrongState),
            Self::Simulation(_) if deactivated && !inputs.stops.is_empty() => {
                Some(Fault::SafetyStopPresent)
            }
            Self::Simulation(_) | Self::Brakes(_) | Self::Send(_) if !deactivated => {
                Some(Fault::WrongState)
            }
            _ => None,
        }
    }
}

impl Actions {
    /// Counts how long bits have been low in what the robot was shown.
    #[inline]
    pub(super) fn count_low(&mut self, outputs: &Outputs) {
        let low = !outputs.robot.intersects(TRIGGERS)
            && !outputs.motion.contains(MotionControlFlags::RESUME_MOTION);
        self.triggers_low = if low { self.triggers_low.saturating_add(1) } else { 0 };
        let low = !outputs.motion.intersects(STOPS);
        self.stops_low = if low { self.stops_low.saturating_add(1) } else { 0 };
    }

    /// Writes the levels.
    #[inline]
    pub(super) fn apply(&mut self, inputs: &Inputs, outputs: &mut Outputs) {
        let on = |level: Option<bool>| level == Some(true);
        outputs.robot.set(RobotControlFlags::ACTIVATE_SIM, on(self.simulation));
        outputs.robot.set(RobotControlFlags::ENABLE_RECOVERY_MODE, on(self.recovery));
        outputs.motion.set(MotionControlFlags::PAUSE_MOTION, self.pause);
        let clear = self.clearing.is_some_and(|clearing| clearing.raised);
        outputs.motion.set(MotionControlFlags::CLEAR_MOTION, clear);
        let activating = outputs.robot.contains(RobotControlFlags::ACTIVATE_ROBOT);
        if inputs.activated() || inputs.busy() || activating {
            self.brakes = None;
        }
        outputs.brakes = match self.brakes {
            None => BrakesControlFlags::empty(),
            Some(false) => BrakesControlFlags::BRAKES_CONTROL_ALLOWED,
            Some(true) => BrakesControlFlags::all(),
        };
    }
}

impl<const QUEUE: usize> Engine<QUEUE> {
    /// One fresh cycle of every action.
    pub(super) fn drive_actions(&mut self, inputs: &Inputs) {
        // A clear may outlast the resume it was for.
        if !self.actions.is_acting() && !self.actions.is_clearing() {
            return;
        }
        if self.actions.pausing.is_some() && inputs.paused() && self.pause_was_shown() {
            self.actions.pausing = None;
            self.actions.end(Action::Pause, None);
        }
        self.drive_clear(inputs);
        self.begin_next_action();
        let Some(mut running) = self.actions.running else { return };
        match self.drive_step(&running, inputs) {
            Progress::Pending(stage) => {
                running.stage = stage;
                self.actions.running = Some(running);
            }
            Progress::Failed(fault) => self.end_running(Some(fault)),
            Progress::Done => {
                self.release(running.step, false);
                if !self.begin_step(running.action, running.index.saturating_add(1)) {
                    self.end_running(None);
                }
            }
        }
    }

    /// Paused as it was before the bit was written confirms nothing.
    fn pause_was_shown(&self) -> bool {
        self.outputs.motion.contains(MotionControlFlags::PAUSE_MOTION)
    }

    fn drive_clear(&mut self, inputs: &Inputs) {
        let Some(Clearing { for_action, raised, fresh, deadline }) = self.actions.clearing else {
            return;
        };
        let mut next = Clearing { for_action, raised, fresh: fresh.saturating_add(1), deadline };
        if !raised {
            if next.fresh >= self.config.edge_low_cycles.max(1) {
                next.raised = true;
                next.fresh = 0;
            }
            self.actions.clearing = Some(next);
            return;
        }
        if fresh == 0 && self.in_flight.is_none() && self.purge == Purge::Always {
            // This pulse begins with nothing under way: it clears what was taken before.
            self.purge = Purge::UnlessCleared;
        }
        let shown = next.fresh > self.config.edge_hold_cycles.max(1);
        let unsettled = self.in_flight.is_some_and(|sent| sent.needs_motion());
        if !shown || !inputs.cleared() || unsettled {
            self.actions.clearing = Some(next);
            return;
        }
        if self.purge == Purge::Always {
            next.raised = false;
            next.fresh = 0;
            self.actions.clearing = Some(next);
            return;
        }
        self.purge = Purge::No;
        self.actions.clearing = None;
        if for_action {
            self.actions.end(Action::Clear, None);
        }
    }

    fn drive_step(&mut self, running: &Running, inputs: &Inputs) -> Progress {
        let step = running.step;
        match running.stage {
            Stage::Start => {
                let nothing_to_do = match step {
                    Step::Resume { always } => {
                        !always
                            && !inputs.paused()
                            && !inputs.cleared()
                            && inputs.stops.is_empty()
                            && self.purge == Purge::No
                            && !self.actions.pause
                    }
                    // An ActivateRobot that is just withdrawn may still be on its way.
                    Step::Deactivate if self.actions.triggers_low < self.edge_low() => false,
                    _ => step.confirmed(inputs) && self.level_agrees(step),
                };
                let impossible = step.impossible(inputs);
                // Brakes of an activated robot are never ours, whatever they show.
                if nothing_to_do && !(impossible.is_some() && matches!(step, Step::Brakes(_))) {
                    return Progress::Done;
                }
                if let Some(fault) = impossible {
                    return Progress::Failed(fault);
                }
                if !self.may_begin(step, inputs) {
                    return Progress::Pending(Stage::Start);
                }
                self.command(step);
                Progress::Pending(Stage::Held { fresh: 0, resets: inputs.stops })
            }
            Stage::Held { fresh, resets } => {
                let fresh = fresh.saturating_add(1);
                let held = Stage::Held { fresh, resets };
                let ready = step.confirmed(inputs);
                if matches!(step, Step::Activate | Step::Home { .. })
                    && !ready
                    && !inputs.blocking_stops().is_empty()
                {
                    return Progress::Failed(Fault::SafetyStopPresent);
                }
                let new_error = inputs.error_code != 0 && inputs.error_code != running.error_before;
                if new_error && step != Step::ResetError {
                    return Progress::Failed(Fault::RobotError(Code(inputs.error_code)));
                }
                match step {
                    Step::Resume { .. } => self.hold_resume(inputs, fresh, resets),
                    // Whether the robot listens before it is ready is not stated: the next step will tell.
                    Step::ResetStops if fresh >= self.config.edge_hold_cycles.max(1) => {
                        Progress::Done
                    }
                    Step::HostTime(_) if fresh >= self.config.host_time_cycles.max(1) => {
                        Progress::Done
                    }
                    Step::Send(internal) => match (self.actions.errand, internal) {
                        (Some(Errand::Acknowledged), _)
                        | (Some(Errand::Refused), Internal::Reboot) => Progress::Done,
                        (Some(Errand::Refused), Internal::ClearHoming) => {
                            Progress::Failed(Fault::AckTimeout)
                        }
                        (Some(Errand::Wanted(_)), _) if inputs.activated() => {
                            Progress::Failed(Fault::WrongState)
                        }
                        _ => Progress::Pending(held),
                    },
                    _ if ready => Progress::Done,
                    _ => Progress::Pending(held),
                }
            }
        }
    }

    /// ResumeMotion is 1: confirmed by Paused 0 once the edge must have been seen, which matters
    /// where Paused was 0 all along.
    fn hold_resume(&self, inputs: &Inputs, fresh: u16, resets: SafetySignals) -> Progress {
        if !resets.contains(inputs.stops) {
            // A new signal undid the edge; another one is due when it can be reset.
            return Progress::Pending(Stage::Start);
        }
        if fresh < self.config.edge_hold_cycles.max(1) {
            return Progress::Pending(Stage::Held { fresh, resets });
        }
        let reset = !inputs.stops.intersects(resets);
        if reset && !inputs.paused() {
            Progress::Done
        } else if reset && !resets.is_empty() {
            // The edge reset the signals; under one reading motion needs an edge of its own.
            Progress::Pending(Stage::Start)
        } else {
            Progress::Pending(Stage::Held { fresh, resets })
        }
    }

    /// A level that is confirmed must also be commanded, or it would be taken back.
    fn level_agrees(&self, step: Step) -> bool {
        match step {
            Step::Simulation(on) => self.actions.simulation == Some(on),
            Step::Recovery(on) => self.actions.recovery == Some(on),
            Step::Brakes(engaged) => engaged || self.actions.brakes == Some(false),
            _ => true,
        }
    }

    fn edge_low(&self) -> u16 {
        self.config.edge_low_cycles.max(1)
    }

    fn may_begin(&mut self, step: Step, inputs: &Inputs) -> bool {
        let low = self.edge_low();
        if let Step::Resume { .. } = step {
            self.outputs.motion.remove(MotionControlFlags::RESUME_MOTION);
            self.actions.pause = false;
            if self.actions.is_clearing() {
                return false;
            }
            if self.purge != Purge::No {
                self.start_clear(false);
                return false;
            }
            return self.actions.triggers_low >= low
                && self.actions.stops_low >= low
                && inputs.blocking_stops().is_empty();
        }
        if step == Step::ResetStops {
            self.actions.pause = false;
            return !self.actions.is_clearing()
                && self.actions.triggers_low >= low
                && self.actions.stops_low >= low;
        }
        let waits_for_rest = match step {
            Step::Activate | Step::Home { .. } => true,
            // Homing is cut short. An activation may not be: its bit would be spent on nothing.
            Step::Deactivate => !inputs.activated(),
            _ => false,
        };
        let triggers = step.trigger().intersects(TRIGGERS);
        (!triggers || self.actions.triggers_low >= low) && !(waits_for_rest && inputs.busy())
    }

    fn command(&mut self, step: Step) {
        self.outputs.robot.insert(step.trigger());
        match step {
            Step::ResetStops => self.outputs.motion.insert(MotionControlFlags::RESUME_MOTION),
            Step::Resume { .. } => {
                self.outputs.motion.insert(MotionControlFlags::RESUME_MOTION);
                // The edge also hides that the queue was cleared, if it was just before.
                self.ledger.doubt_stop(self.config.layout);
            }
            Step::Simulation(on) => self.actions.simulation = Some(on),
            Step::Recovery(on) => self.actions.recovery = Some(on),
            Step::Brakes(engaged) => self.actions.brakes = Some(engaged),
            Step::HostTime(seconds) => self.outputs.host_time = seconds,
            Step::Send(internal) => self.actions.errand = Some(Errand::Wanted(internal)),
            _ => {}
        }
    }

    /// Takes the bits of a step back; a level that `failed` goes back to what it was.
    pub(super) fn release(&mut self, step: Step, failed: bool) {
        self.outputs.robot.remove(step.trigger());
        match step {
            Step::ResetStops | Step::Resume { .. } => {
                self.outputs.motion.remove(MotionControlFlags::RESUME_MOTION);
            }
            Step::HostTime(_) => self.outputs.host_time = 0,
            Step::Simulation(on) if failed && self.actions.simulation == Some(on) => {
                self.actions.simulation =
                    Some(self.inputs.robot.contains(RobotStatusFlags::SIM_ACTIVATED));
            }
            Step::Recovery(on) if failed && self.actions.recovery == Some(on) => {
                self.actions.recovery = Some(self.inputs.recovery());
            }
            Step::Brakes(engaged) if failed || engaged => self.actions.brakes = None,
            _ => {}
        }
    }

    pub(super) fn lower_clear(&mut self) {
        self.outputs.motion.remove(MotionControlFlags::CLEAR_MOTION);
    }
}
