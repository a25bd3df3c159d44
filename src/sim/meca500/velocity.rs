//! Velocity mode: commands 21, 22 and 23, whether repeated with MoveID 0 or queued.
//!
//! ```text
//! command --> moving --(timeout, or told to stop)--> decelerating --> at rest: position mode again
//!               ^                                         |
//!               '----------- another command -------------'
//! ```
//!
//! Invariants: never an error at a limit or a singularity, the arm stands; the timeout runs in the
//! robot's scaled time. Source: PM L385-393, L1044-1059, L2070, L2952-2968.

use super::motion::{
    CartesianDemand, ClockStep, Follower, RATED_VELOCITY, TwistFrame, VelocityDemand, VelocityMove,
};
use super::readings::JointVelLimit;
use super::robot::VirtualRobot;
use crate::wire::meca500::command::VelocityCommand;

/// The arm in velocity mode.
#[derive(Clone, Copy, Debug)]
pub(super) struct VelocityRun {
    pub(super) arm: VelocityMove,
    remaining_s: f64,
    stopping: bool,
}

impl VirtualRobot {
    /// A velocity command that shall act now: in velocity mode it replaces the one before, with an
    /// arm at rest and an empty queue it begins; otherwise it has no effect.
    pub(super) fn velocity_command(&mut self, command: VelocityCommand) {
        let free = self.velocity.is_some()
            || (!self.is_following() && self.delay_s.is_none() && self.queue.is_empty());
        if free && !self.is_halted() {
            self.begin_velocity(command);
        }
    }

    /// Begins velocity mode, or goes over to another velocity.
    pub(super) fn begin_velocity(&mut self, command: VelocityCommand) {
        let demand = self.demand_of(command);
        let frames = self.motion_settings.frames;
        let position = self.follower.state().position;
        let run = self.velocity.get_or_insert_with(|| VelocityRun {
            arm: VelocityMove::at_rest(position),
            remaining_s: 0.0,
            stopping: false,
        });
        run.arm.demand(demand, &frames);
        run.remaining_s = self.motion_settings.vel_timeout.into();
        run.stopping = false;
    }

    fn demand_of(&self, command: VelocityCommand) -> VelocityDemand {
        let cartesian = |frame, [x, y, z, a, b, c]: [f32; 6]| {
            VelocityDemand::Cartesian(CartesianDemand {
                frame,
                linear: [x, y, z].map(f64::from),
                angular: [a, b, c].map(f64::from),
            })
        };
        match command {
            VelocityCommand::MoveJointsVel(omega) => {
                let mut omega = omega.map(f64::from);
                if self.settings.readings.joint_vel_limit == JointVelLimit::Scales {
                    let percent = f64::from(self.motion_settings.joint_vel_limit);
                    for (omega, rated) in omega.iter_mut().zip(RATED_VELOCITY) {
                        // Above 100 % only velocities over the rated ones change.
                        let factor = if omega.abs() > rated { percent } else { percent.min(100.0) };
                        *omega *= factor / 100.0;
                    }
                }
                VelocityDemand::Joints(omega)
            }
            VelocityCommand::MoveLinVelWrf(velocity) => cartesian(TwistFrame::World, velocity),
            VelocityCommand::MoveLinVelTrf(velocity) => cartesian(TwistFrame::Tool, velocity),
        }
    }

    /// Decelerates at once.
    pub(super) const fn stop_velocity(&mut self) {
        if let Some(run) = &mut self.velocity {
            run.arm.stop();
            run.stopping = true;
        }
    }

    /// Lets an arm in velocity mode go on.
    pub(super) fn advance_velocity(&mut self, step: ClockStep) {
        let settings = self.velocity_settings();
        let Some(run) = &mut self.velocity else { return };
        // Why it stands, if it stands, is no concern of the robot's: no error.
        let _ = run.arm.advance(step, &settings);
        run.remaining_s -= step.path_s;
        if run.remaining_s <= 0.0 && !run.stopping {
            run.arm.stop();
            run.stopping = true;
        }
        if run.stopping && run.arm.is_at_rest() {
            self.follower = Follower::at_rest(run.arm.state().position);
            self.velocity = None;
            self.queue.decompile();
            self.look_ahead_anew();
        }
    }
}
