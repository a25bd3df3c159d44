//! Executing the queue: one step of time at a time.
//!
//! ```text
//! compiled:  [setting] [move A] [checkpoint] [gripper] [move B] [delay] ...
//!                         |            |         |        |
//!              the arm follows A       '---------'--------'-- when B begins: at the end of A,
//!              until B begins                                 or in its deceleration (blending)
//! ```
//!
//! Between two moves of one kind, settings that do not stop the robot, checkpoints, valves and
//! (between joint-space moves) gripper commands do not keep them from blending; they are executed
//! when the second move begins. A gripper command that directly follows a move begins with that
//! move's deceleration. Source: PM L371-373, L1991, L2471, L6385-6393.

use super::event::RobotEvent;
use super::motion::{ClockStep, Follower, Space};
use super::motion_settings::stops_the_robot;
use super::queue::Step;
use super::robot::VirtualRobot;
use crate::wire::meca500::command::{GripperAction, MotionCommand, ValveAction};

/// Times of the move that the arm follows, for what begins with its deceleration.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MoveTimes {
    /// Path time since its begin, in s.
    pub(super) elapsed_s: f64,
    /// Path time at which it decelerates, in s.
    pub(super) decelerates_s: f64,
    /// Whether it is a joint-space or a linear move.
    pub(super) space: Option<Space>,
    /// Whether the arm must stop after it, because a gripper command has begun.
    pub(super) must_stop: bool,
}

/// What the arm may do between two moves without stopping.
fn is_transparent(step: &Step, space: Option<Space>) -> bool {
    match step {
        Step::Checkpoint(_)
        | Step::ProgramBegin(_)
        | Step::ProgramEnd(_)
        | Step::ProgramAgain
        | Step::Immediate(_) => true,
        Step::Setting(command, _) => !stops_the_robot(command),
        Step::Tool(MotionCommand::SetValveState(_)) => true,
        Step::Tool(_) => space == Some(Space::Joint),
        Step::Move { .. } | Step::Fail(_) | Step::Delay(_) | Step::Velocity(_) => false,
    }
}

impl VirtualRobot {
    /// Executes what is due, then lets the arm and the running delay go on by one step of the clock.
    pub(super) fn execute(&mut self, step: ClockStep) {
        if !self.is_halted() {
            self.compile_ahead();
            self.start_due();
            self.hand_over();
        }
        if let Some(delay_s) = &mut self.delay_s {
            *delay_s -= step.path_s;
            if *delay_s <= 0.0 {
                self.delay_s = None;
            }
        }
        if self.velocity.is_some() {
            self.advance_velocity(step);
        } else {
            self.advance_follower(step);
        }
        if !self.is_halted() && !self.is_following() && self.delay_s.is_none() {
            // What needs no time after the last move (its checkpoint) happens in the same step.
            self.start_due();
        }
    }

    /// Whether the arm follows a plan.
    pub(super) const fn is_following(&self) -> bool {
        self.follower.is_busy()
    }

    fn advance_follower(&mut self, step: ClockStep) {
        self.move_times.elapsed_s += step.path_s;
        let progress = self.follower.advance(step);
        if progress.next_began {
            self.begin_handed_over();
        }
    }

    /// Starts compiled entries while nothing they must wait for is going on.
    fn start_due(&mut self) {
        if self.velocity.is_some() {
            self.start_during_velocity();
            return;
        }
        if self.is_following() {
            self.start_in_deceleration();
            return;
        }
        // Each entry is left by its turn, so the loop is bounded by what is compiled.
        while self.delay_s.is_none()
            && !self.is_following()
            && self.velocity.is_none()
            && !self.is_halted()
            && let Some(step) = self.queue.pop()
        {
            self.start(step);
        }
    }

    /// Gripper commands right after the move begin with its deceleration. Between two lines they
    /// wait for the stop they force (PM L373 against L6385).
    fn start_in_deceleration(&mut self) {
        let is_linear = self.move_times.space == Some(Space::Cartesian);
        let line_follows = is_linear
            && self
                .queue
                .compiled()
                .any(|step| matches!(step, Step::Move { space: Space::Cartesian, .. }));
        if self.move_times.elapsed_s < self.move_times.decelerates_s || line_follows {
            return;
        }
        let parallel = |step: &Step| match step {
            Step::Tool(MotionCommand::SetValveState(_)) => false,
            Step::Tool(_) => true,
            Step::Setting(command, _) => matches!(
                command,
                MotionCommand::SetGripperForce(_)
                    | MotionCommand::SetGripperVel(_)
                    | MotionCommand::SetGripperRange { .. }
            ),
            _ => false,
        };
        while self.queue.front().is_some_and(parallel)
            && let Some(step) = self.queue.pop()
        {
            self.move_times.must_stop |= is_linear && matches!(step, Step::Tool(_));
            self.start(step);
        }
    }

    /// Lets the next move of the same kind follow without a stop, where nothing stands between.
    fn hand_over(&mut self) {
        let may_follow = self.follower.has_room() && !self.move_times.must_stop;
        if !self.is_following() || !may_follow || self.velocity.is_some() {
            return;
        }
        let space = self.move_times.space;
        for entry in self.queue.compiled_mut() {
            match &mut entry.step {
                Step::Move { plan, space: next, blending } => {
                    if Some(*next) == space
                        && *blending > 0.0
                        && let Some(next_plan) = plan.take()
                    {
                        let decelerates_s = next_plan.duration_s() - next_plan.deceleration_s();
                        self.pending_times =
                            Some(MoveTimes { decelerates_s, ..MoveTimes::default() });
                        // Room was asked for above, so the plan is never given back.
                        let _ = self.follower.follow_with(*next_plan, *blending);
                    }
                    return;
                }
                step if is_transparent(step, space) => {}
                _ => return,
            }
        }
    }

    /// The move that was handed over has begun: what stood before it happens now.
    fn begin_handed_over(&mut self) {
        while let Some(step) = self.queue.pop() {
            if let Step::Move { space, .. } = step {
                self.note_move(space);
                return;
            }
            self.start(step);
        }
    }

    fn note_move(&mut self, space: Space) {
        let times = self.pending_times.take().unwrap_or_default();
        self.move_times = MoveTimes { elapsed_s: 0.0, space: Some(space), ..times };
    }

    fn start(&mut self, step: Step) {
        match step {
            Step::Move { plan: Some(plan), space, .. } => {
                let decelerates_s = plan.duration_s() - plan.deceleration_s();
                self.move_times =
                    MoveTimes { decelerates_s, space: Some(space), ..MoveTimes::default() };
                // The arm is at rest here, so the plan is taken.
                let _ = self.follower.follow_with(*plan, 0.0);
            }
            Step::Move { plan: None, space, .. } => self.note_move(space),
            Step::Fail(code) => self.raise(code),
            Step::Setting(command, joints) => {
                self.motion_settings.apply(&command, &joints);
            }
            Step::Checkpoint(number) => {
                self.checkpoint_reached = number;
                self.events.push(RobotEvent::CheckpointReached(number));
            }
            Step::Delay(seconds) => self.delay_s = Some(seconds),
            Step::Tool(command) => self.start_tool(&command),
            Step::Velocity(command) => self.begin_velocity(command),
            Step::Immediate(command) => {
                if let Err(code) = self.execute_now(&command) {
                    self.note_refusal(code);
                }
            }
            Step::ProgramBegin(number) => {
                self.program = number;
                self.events.push(RobotEvent::ProgramStarted(number));
            }
            Step::ProgramEnd(number) => self.end_program(number),
            Step::ProgramAgain => {
                if let Err(code) = self.start_by_button() {
                    self.note_refusal(code);
                }
            }
        }
    }

    /// The running offline program ends.
    pub(super) fn end_program(&mut self, number: u16) {
        if self.program == number && number != 0 {
            self.program = 0;
            self.events.push(RobotEvent::ProgramEnded(number));
        }
    }

    /// Velocity mode lets velocity commands, checkpoints and GripperOpen and GripperClose through.
    /// Source: PM L387.
    fn start_during_velocity(&mut self) {
        let passes = |step: &Step| {
            matches!(
                step,
                Step::Velocity(_) | Step::Checkpoint(_) | Step::Tool(MotionCommand::Gripper(_))
            )
        };
        while self.queue.front().is_some_and(passes)
            && let Some(step) = self.queue.pop()
        {
            self.start(step);
        }
    }

    fn start_tool(&mut self, command: &MotionCommand) {
        match *command {
            MotionCommand::SetValveState(actions) => {
                self.tool.set_valves(actions.map(|action| match action {
                    ValveAction::Keep => None,
                    ValveAction::Close => Some(false),
                    ValveAction::Open => Some(true),
                }));
            }
            MotionCommand::Gripper(action) if self.tool.is_gripper() => {
                let range = self.motion_settings.gripper_range.map(|range| range.map(f64::from));
                let [closed, open] = range.unwrap_or([0.0, self.tool.range_mm()]);
                self.move_fingers(match action {
                    GripperAction::Close => closed,
                    GripperAction::Open => open,
                });
            }
            // On the MPM500: open is SetValveState(1,0), close SetValveState(0,1). PM L6681.
            MotionCommand::Gripper(GripperAction::Open) => {
                self.tool.set_valves([Some(true), Some(false)]);
            }
            MotionCommand::Gripper(GripperAction::Close) => {
                self.tool.set_valves([Some(false), Some(true)]);
            }
            MotionCommand::MoveGripper(opening) => self.move_fingers(opening.into()),
            _ => {}
        }
    }

    fn move_fingers(&mut self, opening_mm: f64) {
        let mut velocity = f64::from(self.motion_settings.gripper_vel);
        let mut force = f64::from(self.motion_settings.gripper_force);
        if self.boot.recovery_mode && !self.is_homed() {
            let cap = self.settings.recovery_caps.gripper_percent;
            velocity = velocity.min(cap);
            force = force.min(cap);
        }
        self.tool.move_fingers(opening_mm, velocity, force);
    }

    /// Forgets everything that moves the arm: it stays where it is.
    pub(super) fn drop_motion(&mut self) {
        self.abandoning = false;
        self.follower = Follower::at_rest(self.target_state().position);
        self.velocity = None;
        self.delay_s = None;
        self.look_ahead_anew();
    }

    /// Plans what is queued anew, from where the arm will be.
    pub(super) fn look_ahead_anew(&mut self) {
        self.ahead.settings = self.motion_settings;
        self.ahead.joints = self.follower.end();
        self.pending_times = None;
    }
}
