//! Power, activation, homing, deactivation, simulation, recovery mode, brakes, reboot.
//!
//! ```text
//!  Off --power on--> Booting --> Deactivated --activate--> Activating --> Activated <--> Homing
//!   ^                   ^           ^  ^                                   |
//!   |                   |           |  '------ Deactivating <--deactivate--'
//!   |                   '--reboot---'<-------- E-Stop (R4): power cut once the arm stands
//!   '------------------------------------------ E-Stop (R3)
//! ```
//!
//! Invariants: Busy is 1 in Activating, Homing and Deactivating only; a robot that is not activated
//! has no error mode, an empty queue and an arm at rest. Source: PM L330-342, L886-922, L3075-3215.

use super::event::RobotEvent;
use super::halt::Halts;
use super::kinematics::Joints;
use super::motion::JointState;
use super::motion_settings::MotionSettings;
use super::readings::{
    ActivationFailureCode, ActivationOutsideLimits, PausedAfterActivation, ReleasedStopBeforeReady,
    TimestampAfterBoot,
};
use super::robot::VirtualRobot;
use super::safety::Signal;
use super::settings::{BootSettings, SimulationType};
use super::zones;
use crate::time::Duration;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::revision::Revision;

/// How far homing turns each joint, in degrees. Source: PM L334.
pub const HOMING_TRAVEL_DEG: Joints = [3.6, 3.6, 3.6, 7.2, 10.8, 12.0];
/// Date of the robot's image, to which a boot sets the clock: 2 December 2025. Chosen: the
/// manual's own date.
pub(super) const IMAGE_DATE_S: u64 = 1_764_633_600;

/// Where the robot is in its life.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lifecycle {
    /// Without power; not on its bus.
    Off,
    /// Starting; not on its bus yet.
    Booting,
    /// Motors off.
    Deactivated,
    /// Motors are being powered.
    Activating,
    /// Motors on.
    Activated,
    /// Motors on, finding the joints' exact positions.
    Homing,
    /// Motors are being switched off.
    Deactivating,
}

fn nanos(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

impl VirtualRobot {
    /// Where the robot is in its life.
    #[must_use]
    pub const fn lifecycle(&self) -> Lifecycle {
        self.lifecycle
    }

    /// Whether the robot answers on its bus.
    #[must_use]
    pub const fn is_online(&self) -> bool {
        !matches!(self.lifecycle, Lifecycle::Off | Lifecycle::Booting)
    }

    /// Activated and not about to be deactivated.
    pub(super) const fn is_activated(&self) -> bool {
        matches!(self.lifecycle, Lifecycle::Activated | Lifecycle::Homing)
    }

    /// Whether an error would put the robot in error mode.
    pub(super) const fn is_powered_up(&self) -> bool {
        self.is_activated()
    }

    /// The bit Activated: motors powered.
    pub(super) const fn has_motors_on(&self) -> bool {
        self.is_activated() || matches!(self.lifecycle, Lifecycle::Deactivating)
    }

    /// The bit Busy.
    pub(super) const fn is_busy(&self) -> bool {
        matches!(
            self.lifecycle,
            Lifecycle::Activating | Lifecycle::Homing | Lifecycle::Deactivating
        )
    }

    /// Whether arm and gripper are homed.
    #[must_use]
    pub fn is_homed(&self) -> bool {
        self.arm_homed && !self.tool.needs_homing()
    }

    /// ActivateRobot. Nothing happens when the robot is activated already.
    ///
    /// # Errors
    ///
    /// 1013 when it fails, 3039 for a tool with older firmware, 1040 while the robot is busy
    /// otherwise.
    pub fn activate(&mut self) -> Result<(), Code> {
        match self.lifecycle {
            Lifecycle::Deactivated => {}
            Lifecycle::Activated | Lifecycle::Homing | Lifecycle::Activating => return Ok(()),
            Lifecycle::Off | Lifecycle::Booting | Lifecycle::Deactivating => {
                return Err(Code::COMMAND_FAILED);
            }
        }
        if let Err(code) = self.may_activate() {
            if self.failed_activation != code {
                self.failed_activation = code;
                self.events.push(RobotEvent::Refused(code));
            }
            let shown = self.settings.readings.activation_failure_code;
            if shown == ActivationFailureCode::Shown {
                self.shown_code = code;
            }
            return Err(code);
        }
        self.failed_activation = Code(0);
        self.shown_code = Code(0);
        self.begin(Lifecycle::Activating, self.settings.times.activation);
        Ok(())
    }

    /// Whether a safety signal stands between the robot and being activated and homed.
    fn is_kept_from_readiness(&self) -> bool {
        match self.settings.readings.released_stop_before_ready {
            ReleasedStopBeforeReady::KeepsNothing => self.safety.any_present(),
            ReleasedStopBeforeReady::NeedsResume => self.safety.stops_motion(),
        }
    }

    fn may_activate(&self) -> Result<(), Code> {
        if self.is_kept_from_readiness()
            || !self.safety.motor_power()
            || self.error == Code::DRIVE_COMMUNICATION
        {
            return Err(Code::ACTIVATION_FAILED);
        }
        let strict =
            self.settings.readings.activation_outside_limits == ActivationOutsideLimits::Fails;
        let limits = self.joint_limits();
        if strict && limits.check(&self.follower.state().position).is_err() {
            return Err(Code::ACTIVATION_FAILED);
        }
        if self.tool.old_firmware {
            return Err(Code::TOOL_FIRMWARE_OUTDATED);
        }
        Ok(())
    }

    /// DeactivateRobot: at once the motion ends and the queue is empty; the motors follow.
    ///
    /// # Errors
    ///
    /// 1005 unless the robot is activated.
    pub fn deactivate(&mut self) -> Result<(), Code> {
        if matches!(self.lifecycle, Lifecycle::Deactivating) {
            return Ok(());
        }
        if !self.is_activated() {
            return Err(Code::NOT_ACTIVATED);
        }
        self.let_go();
        self.begin(Lifecycle::Deactivating, self.settings.times.deactivation);
        Ok(())
    }

    /// Ends motion, queue and error mode.
    fn let_go(&mut self) {
        self.halt(Halts::DEACTIVATED);
        self.empty_queue();
        self.drop_motion();
        self.halts = Halts::DEACTIVATED;
        self.resume_when_stopped = false;
        self.cleared = true;
        if self.error != Code::DRIVE_COMMUNICATION {
            self.error = Code(0);
        }
        self.shown_code = Code(0);
        self.torque_exceeded = false;
        self.events.push(RobotEvent::MotionCleared);
    }

    /// Motors are off: settings of motion are lost, valves close. Source: PM L3207.
    fn end_deactivation(&mut self) {
        self.lifecycle = Lifecycle::Deactivated;
        self.motion_settings = MotionSettings::default();
        self.tool.deactivate();
        self.brakes_released = false;
        self.look_ahead_anew();
        self.events.push(RobotEvent::Deactivated);
    }

    /// Home. Ignored when homing is not needed (PM L338).
    ///
    /// # Errors
    ///
    /// 1005 unless activated, 1011 in error mode, 1040 while a safety signal is there.
    pub fn home(&mut self) -> Result<(), Code> {
        match self.lifecycle {
            Lifecycle::Activated => {}
            Lifecycle::Homing => return Ok(()),
            _ => return Err(Code::NOT_ACTIVATED),
        }
        if self.is_homed() {
            self.events.push(RobotEvent::Homed);
            return Ok(());
        }
        if self.error != Code(0) {
            return Err(Code::IN_ERROR);
        }
        if self.is_kept_from_readiness() || self.is_moving() {
            return Err(Code::COMMAND_FAILED);
        }
        let joints = self.follower.state().position;
        let persistent = &self.settings.persistent;
        if persistent.effective_joint_limits().check(&joints).is_err() {
            self.raise(Code::HOMING_OUTSIDE_LIMITS);
            return Ok(());
        }
        let is_blocked = self.disturbance.blocked_at.iter().any(Option::is_some);
        if is_blocked || !zones::inspect(&joints, persistent, self.tool.kind()).is_none() {
            self.raise(Code::HOMING_FAILED);
            return Ok(());
        }
        self.begin(Lifecycle::Homing, self.settings.times.homing);
        Ok(())
    }

    /// Homing is interrupted: by an error or a stop.
    pub(super) fn abort_homing(&mut self) {
        if self.lifecycle == Lifecycle::Homing {
            self.lifecycle = Lifecycle::Activated;
            self.raise(Code::HOMING_FAILED);
        }
    }

    fn begin(&mut self, lifecycle: Lifecycle, duration: Duration) {
        self.lifecycle = lifecycle;
        self.lifecycle_total_ns = if self.is_fast() { 0 } else { nanos(duration) };
        self.lifecycle_left_ns = self.lifecycle_total_ns;
    }

    /// Whether a change of lifecycle is under way.
    pub(super) const fn is_changing(&self) -> bool {
        matches!(
            self.lifecycle,
            Lifecycle::Booting
                | Lifecycle::Activating
                | Lifecycle::Homing
                | Lifecycle::Deactivating
        )
    }

    /// Lets time pass for a change that is under way.
    pub(super) fn advance_lifecycle(&mut self, nanos: u64) {
        if !self.is_changing() {
            return;
        }
        self.lifecycle_left_ns = self.lifecycle_left_ns.saturating_sub(nanos);
        if self.lifecycle_left_ns > 0 {
            return;
        }
        match self.lifecycle {
            Lifecycle::Booting => self.lifecycle = Lifecycle::Deactivated,
            Lifecycle::Activating => self.end_activation(),
            Lifecycle::Homing => {
                self.lifecycle = Lifecycle::Activated;
                self.arm_homed = true;
                self.tool.home();
                self.events.push(RobotEvent::Homed);
            }
            Lifecycle::Deactivating => self.end_deactivation(),
            Lifecycle::Off | Lifecycle::Deactivated | Lifecycle::Activated => {}
        }
    }

    fn end_activation(&mut self) {
        self.lifecycle = Lifecycle::Activated;
        let paused = self.settings.readings.paused_after_activation == PausedAfterActivation::Set;
        self.halts = if paused { Halts::ACTIVATION } else { Halts::empty() };
        self.cleared = false;
        self.brakes_released = false;
        self.clock.resume();
        self.clock.settle();
        self.look_ahead_anew();
        self.events.push(RobotEvent::Activated);
    }

    /// How far homing has turned the joints at present, in degrees.
    pub(super) fn homing_offset(&self) -> Joints {
        let mut offset = [0.0; 6];
        if self.lifecycle != Lifecycle::Homing || self.arm_homed || self.lifecycle_total_ns == 0 {
            return offset;
        }
        let done = 1.0 - self.lifecycle_left_ns as f64 / self.lifecycle_total_ns as f64;
        let out_and_back = 1.0 - (2.0 * done - 1.0).abs();
        let limits = self.joint_limits();
        let joints = self.follower.state().position;
        for (index, offset) in offset.iter_mut().enumerate() {
            let travel = HOMING_TRAVEL_DEG[index];
            let is_near_limit = joints[index] + travel > limits.max[index];
            *offset = if is_near_limit { -travel } else { travel } * out_and_back;
        }
        offset
    }

    /// Where the robot wants its joints, and how they move.
    pub(super) fn target_state(&self) -> JointState {
        let mut state =
            self.velocity.as_ref().map_or(*self.follower.state(), |run| *run.arm.state());
        if self.lifecycle == Lifecycle::Homing {
            for (joint, offset) in state.position.iter_mut().zip(self.homing_offset()) {
                *joint += offset;
            }
        }
        state
    }

    /// E-Stop or redundancy fault: once the arm stands, motor power goes, the brakes close and the
    /// robot is deactivated. A revision 3 shuts down. Source: PM L890, L920.
    pub(super) fn cut_power_when_stopped(&mut self) {
        if !self.safety.demands_power_cut() {
            return;
        }
        if self.is_activated() {
            self.halt(Halts::POWER);
            if self.is_moving() {
                return;
            }
            self.let_go();
        }
        if self.has_motors_on() {
            self.end_deactivation();
        } else if self.lifecycle == Lifecycle::Activating {
            self.lifecycle = Lifecycle::Deactivated;
        }
        self.safety.cut_power();
        if self.settings.revision == Revision::R3 && self.safety.e_stop == Signal::Present {
            self.switch_off();
        }
    }

    /// Power goes: nothing but persistent settings, variables and programs remains.
    pub(super) fn switch_off(&mut self) {
        self.forget();
        self.lifecycle = Lifecycle::Off;
    }

    /// Power comes.
    pub(super) fn switch_on(&mut self) {
        if self.lifecycle == Lifecycle::Off {
            self.boot();
        }
    }

    /// RebootRobot.
    pub(super) fn reboot(&mut self) {
        self.forget();
        self.boot();
    }

    fn boot(&mut self) {
        self.safety = self.safety.after_boot(&self.settings.readings);
        if self.settings.readings.timestamp_after_boot == TimestampAfterBoot::Restarts {
            self.timestamp_origin = self.now;
        }
        self.lifecycle = Lifecycle::Booting;
        self.lifecycle_total_ns = nanos(self.settings.times.boot);
        self.lifecycle_left_ns = self.lifecycle_total_ns;
    }

    fn forget(&mut self) {
        self.empty_queue();
        self.drop_motion();
        self.boot = BootSettings::default();
        self.clock = Default::default();
        self.motion_settings = MotionSettings::default();
        self.look_ahead_anew();
        self.tool.emulate(false);
        self.tool.deactivate();
        self.simulating = false;
        self.asked_simulation = None;
        self.text.forget(self.settings.network.keep_alive_packets);
        self.arm_homed = false;
        self.brakes_released = false;
        self.error = Code(0);
        self.shown_code = Code(0);
        self.failed_activation = Code(0);
        self.zone_event = None;
        self.collision_event = None;
        self.torque_exceeded = false;
        self.checkpoint_reached = 0;
        self.checkpoint_discarded = 0;
        self.rtc_set_at = (self.now, IMAGE_DATE_S);
        self.set_power_up_bits();
        self.forget_connection();
    }

    /// Paused and Cleared before the first activation.
    pub(super) fn set_power_up_bits(&mut self) {
        use super::readings::{ClearedAtPowerUp, PausedAtPowerUp};
        let readings = &self.settings.readings;
        let paused = readings.paused_at_power_up == PausedAtPowerUp::Set;
        self.halts = if paused { Halts::DEACTIVATED } else { Halts::empty() };
        self.cleared = readings.cleared_at_power_up == ClearedAtPowerUp::Set;
    }

    /// ActivateSim and DeactivateSim with the default type. Source: PM L1111, L3129, L6509.
    ///
    /// # Errors
    ///
    /// 1027 unless the robot is deactivated; 1040 while a safety signal is there.
    pub fn set_simulation(&mut self, on: bool) -> Result<(), Code> {
        if on == self.simulating {
            return Ok(());
        }
        if self.lifecycle != Lifecycle::Deactivated {
            return Err(Code::SIM_NEEDS_DEACTIVATION);
        }
        if self.safety.stops_motion() {
            return Err(Code::COMMAND_FAILED);
        }
        self.simulating = on;
        self.asked_simulation = None;
        self.tool.emulate(on);
        Ok(())
    }

    /// How a simulating robot passes its time: as asked for, otherwise as configured.
    pub(super) fn simulation_type(&self) -> SimulationType {
        self.asked_simulation.unwrap_or(self.settings.persistent.simulation)
    }

    /// Whether commands are executed as quickly as possible.
    pub(super) fn is_fast(&self) -> bool {
        self.simulating && self.simulation_type() == SimulationType::Fast
    }

    /// SetRecoveryMode. Allowed in every state; what is compiled is planned anew.
    pub fn set_recovery_mode(&mut self, on: bool) {
        if on != self.boot.recovery_mode {
            self.boot.recovery_mode = on;
            self.queue.decompile();
            self.look_ahead_anew();
        }
    }

    /// Brakes of a deactivated robot. Without effect on an activated one.
    pub fn set_brakes(&mut self, engaged: bool) {
        if self.lifecycle == Lifecycle::Deactivated {
            self.brakes_released = !engaged;
        }
    }

    /// The bit BrakesEngaged.
    pub(super) const fn has_brakes_engaged(&self) -> bool {
        !self.has_motors_on() && !self.brakes_released
    }

    /// Sets the date and time, in seconds since 1970 (SetRtc, HostTime).
    pub const fn set_rtc(&mut self, unix_s: u64) {
        self.rtc_set_at = (self.now, unix_s);
    }

    /// Date and time, in seconds since 1970.
    #[must_use]
    pub fn rtc_s(&self) -> u64 {
        let (at, unix_s) = self.rtc_set_at;
        unix_s.saturating_add((self.now - at).as_secs())
    }
}
