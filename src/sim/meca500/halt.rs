//! Pause, clear, resume and error mode: what keeps the arm from moving, and what lets it go on.
//!
//! ```text
//!            PauseMotion, ClearMotion, error, P-Stop 2, torque pause ...
//!  moving ---------------------------------------------------------------> halted
//!     ^                                                                       |
//!     '---- ResumeMotion (no error, no signal present, nothing held at 1) ----'
//! ```
//!
//! A halt slows the arm down along its path. When the queue was cleared meanwhile, the path is
//! forgotten as soon as the arm stands. Source: PM L868-884, L1118-1135, L3369-3466.

use bitflags::bitflags;

use super::event::RobotEvent;
use super::readings::{
    PStop2Cleared, PStop2Paused, PausedInErrorMode, RefusalCode, ReleasedStopBeforeReady,
    ResetBeforeReady, ResumeAfterSafetyStop,
};
use super::robot::VirtualRobot;
use super::safety::Signal;
use super::settings::PStop2Mode;
use super::torque;
use crate::wire::meca500::code::Code;

bitflags! {
    /// Why the arm must not move until ResumeMotion.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub(super) struct Halts: u16 {
        /// PauseMotion.
        const PAUSE = 1;
        /// ClearMotion.
        const CLEAR = 1 << 1;
        /// Error mode, and after it.
        const ERROR = 1 << 2;
        /// P-Stop 2.
        const P_STOP2 = 1 << 3;
        /// A dropped connection.
        const CONNECTION = 1 << 4;
        /// A torque limit of severity 2.
        const TORQUE = 1 << 5;
        /// Deactivation, until the next activation.
        const DEACTIVATED = 1 << 6;
        /// An activation, under the reading that it leaves the robot paused.
        const ACTIVATION = 1 << 7;
        /// Motor power is about to go.
        const POWER = 1 << 8;
    }
}

impl VirtualRobot {
    /// Whether something keeps the arm from moving.
    pub(super) fn is_halted(&self) -> bool {
        !self.halts.is_empty() || self.error != Code(0) || self.safety.stops_motion()
    }

    /// The bit Paused.
    pub(super) fn is_paused(&self) -> bool {
        let mut shown = self.halts;
        let readings = &self.settings.readings;
        if readings.paused_in_error_mode == PausedInErrorMode::Clear {
            shown.remove(Halts::ERROR);
        }
        if readings.p_stop2_paused == PStop2Paused::Unchanged {
            shown.remove(Halts::P_STOP2);
        }
        shown.remove(Halts::POWER);
        !shown.is_empty()
    }

    /// Ready for motion: activated, and homed or in recovery mode. Source: PM L7122.
    pub(super) fn ready_for_motion(&self) -> Result<(), Code> {
        if !self.is_activated() {
            return Err(Code::NOT_ACTIVATED);
        }
        if !self.is_homed() && !self.boot.recovery_mode {
            return Err(Code::NOT_HOMED);
        }
        Ok(())
    }

    /// PauseMotion. Refused unless the robot is ready for motion (PM L3390).
    ///
    /// # Errors
    ///
    /// 1005 or 1006.
    pub fn pause_motion(&mut self) -> Result<(), Code> {
        self.ready_for_motion()?;
        self.halt(Halts::PAUSE);
        self.resume_when_stopped = false;
        self.events.push(RobotEvent::MotionPaused);
        Ok(())
    }

    /// ClearMotion. Refused unless the robot is ready for motion (PM L3149).
    ///
    /// # Errors
    ///
    /// 1005 or 1006.
    pub fn clear_motion(&mut self) -> Result<(), Code> {
        self.ready_for_motion()?;
        self.halt(Halts::CLEAR);
        self.resume_when_stopped = false;
        self.empty_queue();
        self.cleared = true;
        self.events.push(RobotEvent::MotionCleared);
        Ok(())
    }

    /// ResumeMotion. Refused unless the robot is ready for motion, without an error and without a
    /// safety signal that is present (PM L1133, L3466).
    ///
    /// # Errors
    ///
    /// 1005, 1006 or 1011; 1040 while a safety signal is present.
    pub fn resume_motion(&mut self) -> Result<(), Code> {
        if self.ready_for_motion().is_err()
            && self.settings.readings.released_stop_before_ready
                == ReleasedStopBeforeReady::NeedsResume
            && !self.safety.any_present()
            && self.safety.reset_by_resume()
        {
            return Ok(());
        }
        self.ready_for_motion()?;
        if self.error != Code(0) {
            return Err(Code::IN_ERROR);
        }
        if self.safety.any_present() || self.halts.contains(Halts::POWER) {
            return Err(Code::COMMAND_FAILED);
        }
        let had_signal = self.safety.reset_by_resume();
        if had_signal
            && self.settings.readings.resume_after_safety_stop == ResumeAfterSafetyStop::ResetsOnly
        {
            return Ok(());
        }
        if self.abandoning {
            // The path that was cleared is still being left; resuming follows.
            self.resume_when_stopped = true;
        } else {
            self.resume_now();
        }
        Ok(())
    }

    fn resume_now(&mut self) {
        self.resume_when_stopped = false;
        self.halts = Halts::empty();
        self.cleared = false;
        self.zone_event = None;
        self.collision_event = None;
        self.clock.resume();
        self.events.push(RobotEvent::MotionResumed);
    }

    /// Stops the arm along its path.
    pub(super) fn halt(&mut self, reason: Halts) {
        self.halts.insert(reason);
        self.clock.pause();
        if !self.is_underway() {
            self.clock.settle();
        }
    }

    /// Whether something follows the path clock.
    pub(super) fn is_underway(&self) -> bool {
        self.is_following() || self.velocity.is_some()
    }

    /// Empties the queue; the arm leaves its path as soon as it stands.
    pub(super) fn empty_queue(&mut self) {
        let Self { queue, events, checkpoint_discarded, .. } = self;
        queue.clear(|number| {
            *checkpoint_discarded = number;
            events.push(RobotEvent::CheckpointDiscarded(number));
        });
        self.follower.discard_next();
        self.end_program(self.program);
        self.delay_s = None;
        if self.is_underway() && !self.clock.is_stopped() {
            self.abandoning = true;
        } else {
            self.drop_motion();
        }
    }

    /// After each step: an arm that has come to its stop leaves a path that was cleared, and ends
    /// velocity mode, which is never taken up again.
    pub(super) fn settle_halt(&mut self) {
        if !self.is_halted() {
            return;
        }
        if !self.is_underway() {
            self.clock.settle();
        }
        if !self.clock.is_stopped() {
            return;
        }
        if self.abandoning || self.velocity.is_some() {
            let recompile = self.velocity.is_some();
            self.drop_motion();
            if recompile {
                self.queue.decompile();
            }
        }
        if self.resume_when_stopped {
            self.resume_now();
        }
    }

    /// P-Stop 2 comes or goes. Source: PM L878-884, L3758.
    pub(super) fn set_p_stop2(&mut self, present: bool) {
        let was_present = self.safety.p_stop2 == Signal::Present;
        self.safety.p_stop2.set_present(present);
        if !present || was_present {
            return;
        }
        if !self.is_activated() {
            // Nothing moves; the signal only keeps the robot from being activated.
            return;
        }
        self.halt(Halts::P_STOP2);
        if self.settings.persistent.p_stop2 == PStop2Mode::Clear {
            self.empty_queue();
            if self.settings.readings.p_stop2_cleared == PStop2Cleared::Set {
                self.cleared = true;
            }
            self.events.push(RobotEvent::MotionCleared);
        }
        self.abort_homing();
    }

    /// The controlling connection is lost. A moving robot stops. Source: PM L904.
    pub(super) fn drop_connection(&mut self) {
        if self.is_activated() && self.is_moving() {
            self.safety.connection_dropped.set_present(true);
            self.halt(Halts::CONNECTION);
        }
    }

    /// Puts an activated robot in error mode: the queue is cleared, the arm stops. A deactivated
    /// robot only reports the code. Source: PM L868-874, L3434.
    pub(super) fn raise(&mut self, code: Code) {
        if self.error != Code(0) {
            return;
        }
        self.events.push(RobotEvent::Error(code));
        if !self.is_powered_up() {
            return;
        }
        self.error = code;
        self.halt(Halts::ERROR);
        self.empty_queue();
        self.abort_homing();
    }

    /// ResetError. Refused when the error cannot be reset.
    ///
    /// # Errors
    ///
    /// 1005 or 1006 where only a robot ready for motion may be reset; 1025 for an error that needs
    /// a reboot, or whose cause is still there.
    pub fn reset_error(&mut self) -> Result<(), Code> {
        self.shown_code = Code(0);
        if self.error == Code(0) {
            return Ok(());
        }
        if self.settings.readings.reset_before_ready == ResetBeforeReady::Refused {
            self.ready_for_motion()?;
        }
        let is_lasting = match self.error {
            Code::DRIVE_COMMUNICATION => true,
            Code::GRIPPER_ERROR => self.tool.overheated,
            Code::MOTION_ERROR => torque::is_overloaded(&self.target_state(), &self.disturbance),
            _ => false,
        };
        if is_lasting {
            return Err(Code::RESET_IMPOSSIBLE);
        }
        self.error = Code(0);
        Ok(())
    }

    /// A request was refused.
    pub(super) fn note_refusal(&mut self, code: Code) {
        self.events.push(RobotEvent::Refused(code));
        if self.settings.readings.refusal_code != RefusalCode::Hidden {
            self.shown_code = code;
        }
    }

    /// ErrorCode.
    pub(super) fn error_code(&self) -> Code {
        if self.error == Code(0) { self.shown_code } else { self.error }
    }
}
