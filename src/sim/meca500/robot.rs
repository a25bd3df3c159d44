//! The virtual Meca500: one model, shared by the cyclic and the text face.
//!
//! Read first: [`VirtualRobot::new`], [`VirtualRobot::advance`], and the method
//! [`cycle`](crate::cycle::CyclicDevice::cycle) of its cyclic face.
//!
//! Time is handed in. [`VirtualRobot::advance`] lets the robot live in steps of a millisecond; a
//! robot with nothing to do skips the time. In fast simulation the steps of the robot's own time are
//! longer than those handed in, until there is nothing left to do. However far `now` jumps, a call
//! takes a bounded number of steps: after 20,000 of them what is left passes in 100 equal ones.
//!
//! Invariants: no input makes it panic; time never runs back; after construction only queueing,
//! planning and setting variables allocate, and the text face once it is used.

use super::cyclic::CyclicFace;
use super::event::{EventLog, RobotEvent};
use super::executor::MoveTimes;
use super::halt::Halts;
use super::kinematics::Joints;
use super::lifecycle::{IMAGE_DATE_S, Lifecycle};
use super::motion::{FULL_RATE_CHANGE_S, Follower, JointState, PathClock};
use super::motion_settings::MotionSettings;
use super::queue::Queue;
use super::safety::Safety;
use super::settings::{BootSettings, PersistentSettings, RobotSettings, SimulationType};
use super::store::Programs;
use super::text::TextFace;
use super::tool::Tool;
use super::torque::{self, Disturbance};
use super::variables::Variables;
use super::velocity::VelocityRun;
use super::zones::{self, Object};
use crate::time::Instant;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::command::{Severity, TorqueSeverity};

/// Step of the robot's life.
const STEP_NS: u64 = 1_000_000;
/// Such steps in one call: twenty seconds, far longer than a velocity timeout or a fault's delay.
const FINE_STEPS: u32 = 20_000;
/// Steps in which the rest of a longer jump passes.
const COARSE_STEPS: u64 = 100;
/// Times in one call at which the text face has something to do, and a long step ends early.
const TEXT_STOPS: u32 = 20_000;
/// Step of the robot's own time in fast simulation, in s.
const FAST_STEP_S: f64 = 0.01;
/// How much farther than its stop the arm looks for a breach, in s: two steps.
const LOOK_AHEAD_S: f64 = 0.002;
/// Fast steps in one step of the time handed in: twenty seconds of motion.
const FAST_STEPS: u32 = 2_000;

/// What the compiler knows of the place in the queue it has come to.
#[derive(Clone, Copy, Debug)]
pub(super) struct LookAhead {
    pub(super) joints: Joints,
    pub(super) settings: MotionSettings,
}

/// A virtual Meca500.
#[derive(Clone, Debug)]
pub struct VirtualRobot {
    pub(super) settings: RobotSettings,
    pub(super) boot: BootSettings,
    pub(super) motion_settings: MotionSettings,

    pub(super) now: Instant,
    /// Where RobotTimestamp counts from.
    pub(super) timestamp_origin: Instant,
    pub(super) rtc_set_at: (Instant, u64),

    pub(super) lifecycle: Lifecycle,
    pub(super) lifecycle_left_ns: u64,
    pub(super) lifecycle_total_ns: u64,
    pub(super) arm_homed: bool,
    pub(super) simulating: bool,
    /// The kind of simulation that ActivateSim(m) asked for, in place of the configured one.
    pub(super) asked_simulation: Option<SimulationType>,
    pub(super) brakes_released: bool,
    pub(super) failed_activation: Code,

    pub(super) safety: Safety,
    pub(super) halts: Halts,
    pub(super) cleared: bool,
    pub(super) abandoning: bool,
    pub(super) resume_when_stopped: bool,
    pub(super) error: Code,
    pub(super) shown_code: Code,

    pub(super) queue: Queue,
    pub(super) ahead: LookAhead,
    pub(super) follower: Follower,
    pub(super) move_times: MoveTimes,
    pub(super) pending_times: Option<MoveTimes>,
    pub(super) velocity: Option<VelocityRun>,
    pub(super) clock: PathClock,
    pub(super) delay_s: Option<f64>,
    pub(super) program: u16,
    pub(super) checkpoint_reached: u16,
    pub(super) checkpoint_discarded: u16,

    pub(super) tool: Tool,
    pub(super) disturbance: Disturbance,
    pub(super) torque_exceeded: bool,
    pub(super) zone_event: Option<Object>,
    pub(super) collision_event: Option<[Object; 2]>,

    pub(super) variables: Variables,
    pub(super) programs: Programs,
    pub(super) events: EventLog,
    pub(super) face: CyclicFace,
    pub(super) text: TextFace,
}

impl VirtualRobot {
    /// A robot that has booted and whose Reset button was pressed: deactivated, motors powered.
    ///
    /// Settings it could not live with are replaced, as [`RobotSettings`] says of each.
    #[must_use]
    pub fn new(settings: RobotSettings) -> Self {
        let settings = settings.made_livable();
        let joints = settings.joints;
        let motion_settings = MotionSettings::default();
        let mut robot = Self {
            boot: BootSettings::default(),
            motion_settings,
            now: Instant::ZERO,
            timestamp_origin: Instant::ZERO,
            rtc_set_at: (Instant::ZERO, IMAGE_DATE_S),
            lifecycle: Lifecycle::Deactivated,
            lifecycle_left_ns: 0,
            lifecycle_total_ns: 0,
            arm_homed: settings.homed,
            simulating: false,
            asked_simulation: None,
            brakes_released: false,
            failed_activation: Code(0),
            safety: Safety::reset_and_powered(),
            halts: Halts::empty(),
            cleared: false,
            abandoning: false,
            resume_when_stopped: false,
            error: Code(0),
            shown_code: Code(0),
            queue: Queue::default(),
            ahead: LookAhead { joints, settings: motion_settings },
            follower: Follower::at_rest(joints),
            move_times: MoveTimes::default(),
            pending_times: None,
            velocity: None,
            clock: PathClock::default(),
            delay_s: None,
            program: 0,
            checkpoint_reached: 0,
            checkpoint_discarded: 0,
            tool: Tool::new(settings.tool),
            disturbance: Disturbance::default(),
            torque_exceeded: false,
            zone_event: None,
            collision_event: None,
            variables: Variables::default(),
            programs: Programs::default(),
            events: EventLog::default(),
            face: CyclicFace::default(),
            text: TextFace::new(settings.network.keep_alive_packets),
            settings,
        };
        robot.set_power_up_bits();
        robot
    }

    /// How the robot was built, with its persistent settings as they are now.
    #[must_use]
    pub const fn settings(&self) -> &RobotSettings {
        &self.settings
    }

    /// The settings that survive power-off, for what is set through the text port only.
    pub const fn persistent_mut(&mut self) -> &mut PersistentSettings {
        &mut self.settings.persistent
    }

    /// Where the robot wants its joints, in degrees.
    #[must_use]
    pub fn target_joints(&self) -> Joints {
        self.target_state().position
    }

    /// The next event, oldest first.
    pub fn poll_event(&mut self) -> Option<RobotEvent> {
        self.events.pop()
    }

    /// Commands in the queue, without those compiled ahead (GetCmdPendingCount, PM L5229).
    #[must_use]
    pub const fn pending_commands(&self) -> usize {
        self.queue.pending()
    }

    /// Time of the last [`advance`](Self::advance).
    #[must_use]
    pub const fn now(&self) -> Instant {
        self.now
    }

    /// Whether the arm moves: the inverse of the bit EOM.
    pub(super) fn is_moving(&self) -> bool {
        let follows = self.follower.is_busy() || self.velocity.is_some();
        (follows && !self.clock.is_stopped()) || self.lifecycle == Lifecycle::Homing
    }

    /// The bit EOB: at rest with nothing left to do.
    pub(super) fn is_block_ended(&self) -> bool {
        !self.is_moving()
            && !self.follower.is_busy()
            && self.delay_s.is_none()
            && self.queue.is_empty()
    }

    /// Lets the robot live until `now`. A `now` in the past does nothing.
    ///
    /// A jump of more than twenty seconds while something is going on loses detail: in its coarse
    /// steps each move begins a step after the one before, and limits are looked at once a step.
    pub fn advance(&mut self, now: Instant) {
        let mut left = now.as_nanos().saturating_sub(self.now.as_nanos());
        let mut fine_steps = FINE_STEPS;
        let mut coarse_ns = None;
        let mut text_stops = TEXT_STOPS;
        while left > 0 {
            let mut step = if self.is_quiet() {
                left
            } else if fine_steps > 0 {
                left.min(STEP_NS)
            } else {
                left.min(*coarse_ns.get_or_insert_with(|| left.div_ceil(COARSE_STEPS).max(STEP_NS)))
            };
            if text_stops > 0
                && let Some(due_ns) = self.text.due_in(self.now)
                && due_ns < step
            {
                step = due_ns.max(1);
                text_stops -= 1;
            }
            self.now = Instant::from_nanos(self.now.as_nanos().saturating_add(step));
            left -= step;
            fine_steps = fine_steps.saturating_sub(self.live(step));
            self.observe_text();
            self.take_up_waiting();
        }
    }

    /// Whether time has nothing to change.
    fn is_quiet(&self) -> bool {
        let at_rest =
            |state: &JointState| state.velocity == [0.0; 6] && state.acceleration == [0.0; 6];
        !self.is_changing()
            && !self.safety.is_waiting()
            && !self.safety.demands_power_cut()
            && self.velocity.is_none()
            && !self.follower.is_busy()
            && self.delay_s.is_none()
            && (self.queue.is_empty() || self.is_halted())
            && !self.resume_when_stopped
            && (self.tool.is_at_rest() || self.is_halted())
            && !self.tool_error_is_due()
            && self.disturbance.is_none()
            && !self.torque_exceeded
            && at_rest(self.follower.state())
    }

    /// Lives for `nanos`; returns the steps of the robot's own time that it took, 1 at least.
    fn live(&mut self, nanos: u64) -> u32 {
        let mut steps = 1;
        if self.is_quiet() {
            return steps;
        }
        self.safety.advance(nanos);
        self.advance_lifecycle(nanos);
        if self.is_activated() {
            let seconds = nanos as f64 / 1e9;
            if self.is_fast() {
                let step_s = FAST_STEP_S.max(seconds);
                self.live_activated(step_s);
                while steps < FAST_STEPS && !self.is_idle() {
                    self.live_activated(step_s);
                    steps += 1;
                }
            } else {
                self.live_activated(seconds);
            }
        }
        self.cut_power_when_stopped();
        steps
    }

    fn is_idle(&self) -> bool {
        self.is_halted() || (self.is_block_ended() && self.tool.is_at_rest())
    }

    fn live_activated(&mut self, seconds: f64) {
        let step = self.clock.advance(seconds);
        self.execute(step);
        if !self.is_halted() {
            self.tool.advance(step.path_s);
        }
        self.settle_halt();
        self.supervise();
    }

    /// Looks at torques, work zone and collisions.
    fn supervise(&mut self) {
        self.supervise_torque();
        if self.is_moving() && self.lifecycle == Lifecycle::Activated {
            self.supervise_zones();
        }
        if self.tool_error_is_due() {
            self.tool.release();
            self.raise(Code::GRIPPER_ERROR);
        }
    }

    fn tool_error_is_due(&self) -> bool {
        let is_hot = self.tool.overheated && self.tool.is_gripper();
        is_hot && self.error == Code(0) && self.is_activated()
    }

    fn supervise_torque(&mut self) {
        let settings = &self.motion_settings;
        if self.disturbance.is_none() && settings.torque_severity == TorqueSeverity::None {
            self.torque_exceeded = false;
            return;
        }
        let state = self.target_state();
        // Recovery mode lets the arm be moved out of an overload. Source: PM L3838.
        if !self.boot.recovery_mode && torque::is_overloaded(&state, &self.disturbance) {
            // The motors give up where the joint stands.
            self.raise(Code::MOTION_ERROR);
            self.follower = Follower::at_rest(self.disturbance.actual(&state.position));
            self.velocity = None;
            self.abandoning = false;
            self.look_ahead_anew();
            return;
        }
        let settings = &self.motion_settings;
        let exceeded = settings.torque_severity != TorqueSeverity::None
            && torque::exceeds(
                &settings.torque_limits,
                settings.torque_detection,
                &state,
                &settings.payload,
                &self.disturbance,
            );
        let is_new = exceeded && !self.torque_exceeded;
        self.torque_exceeded = exceeded;
        if !is_new || self.boot.recovery_mode {
            return;
        }
        self.events.push(RobotEvent::Warning(Code::TORQUE_LIMIT_STATUS));
        match settings.torque_severity {
            TorqueSeverity::None | TorqueSeverity::Warning => {}
            TorqueSeverity::Pause => self.halt(Halts::TORQUE),
            TorqueSeverity::Error => self.raise(Code::EXCESSIVE_TORQUE),
        }
    }

    /// Work zone and collisions, at the place where a stop begun now would end. Recovery mode does
    /// not look. Source: PM L3838, L5782.
    fn supervise_zones(&mut self) {
        if self.boot.recovery_mode || !zones::is_watching(&self.settings.persistent) {
            return;
        }
        let state = self.target_state();
        let mut joints = state.position;
        let stop_s = 0.5 * FULL_RATE_CHANGE_S + LOOK_AHEAD_S;
        for (joint, velocity) in joints.iter_mut().zip(state.velocity) {
            *joint += velocity * stop_s;
        }
        let findings = zones::inspect(&joints, &self.settings.persistent, self.tool.kind());
        let persistent = &self.settings.persistent;
        let (zone_severity, collision_severity) =
            (persistent.work_zone_severity, persistent.collision_severity);
        if let Some(object) = findings.breach
            && zone_severity != Severity::Silent
            && self.zone_event.is_none()
        {
            self.zone_event = Some(object);
            self.events.push(RobotEvent::Warning(Code::WORK_ZONE_ERROR));
            if zone_severity == Severity::Error {
                self.raise(Code::WORK_ZONE_ERROR);
            }
        }
        if let Some(objects) = findings.collision
            && collision_severity != Severity::Silent
            && self.collision_event.is_none()
        {
            self.collision_event = Some(objects);
            self.events.push(RobotEvent::Warning(Code::COLLISION_ERROR));
            if collision_severity == Severity::Error {
                self.raise(Code::COLLISION_ERROR);
            }
        }
    }
}
