//! Velocity mode: `MoveJointsVel`, `MoveLinVelTrf`, `MoveLinVelWrf`.
//!
//! ```text
//!  demand() --> accelerate towards it --> hold it --> demand() with another, or stop()
//!                     \                    /
//!                      +-- slow down so that no joint passes its limit; stand, no error --> Halt
//! ```
//!
//! Invariants, at every step of the clock: no joint exceeds its velocity or leaves its range; the
//! direction asked for is kept, only its size is reduced. Leaves out the timeout (the caller counts
//! it and calls [`VelocityMove::stop`]). Source: PM L383-393, L2070-2086, L2194-2227.
//!
//! At the edge of reach and before a singularity that cannot be crossed the tool stops as fast as
//! the joints' velocity limits make it, not within a set deceleration.

use glam::{DQuat, DVec3};

use super::{ClockStep, JointLimits, JointState, LimitExcess};
use crate::sim::meca500::kinematics::{
    Configuration, Frames, Jacobian, Joints, Posture, forward, nearest_turn, solve, turn_of,
    turn_range,
};
use crate::sim::meca500::pose::Pose;

/// How far before its limit a joint halts, in degrees: "slightly before" (PM L2070). Chosen.
const HALT_MARGIN_DEG: f64 = 0.01;
/// Attempts at finding how much of a step the joints can follow.
const ATTEMPTS: u32 = 12;
/// Share of a step under which the arm counts as blocked.
const BLOCKED_SHARE: f64 = 1e-3;
/// Share of a step under which another posture is tried.
const HINDERED_SHARE: f64 = 0.5;

/// The frame in which a tool velocity is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TwistFrame {
    /// `MoveLinVelTrf`.
    Tool,
    /// `MoveLinVelWrf`.
    World,
}

/// A velocity of the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CartesianDemand {
    /// The frame of both vectors.
    pub frame: TwistFrame,
    /// Velocity of the tool's origin, in mm/s.
    pub linear: [f64; 3],
    /// Angular velocity of the tool, in deg/s.
    pub angular: [f64; 3],
}

/// What a velocity command asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VelocityDemand {
    /// `MoveJointsVel`, in deg/s.
    Joints(Joints),
    /// `MoveLinVelTrf` and `MoveLinVelWrf`.
    Cartesian(CartesianDemand),
}

/// What velocity mode obeys; may change from step to step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocitySettings {
    /// Range of each joint.
    pub limits: JointLimits,
    /// Joint velocities that are never exceeded, in deg/s: `SetJointVelLimit`.
    pub joint_velocity: Joints,
    /// `SetJointAcc`, in deg/s²; also the braking before a limit.
    pub joint_acceleration: Joints,
    /// Linear part of `SetCartAcc`, in mm/s².
    pub linear_acceleration: f64,
    /// Angular part of `SetCartAcc`, in deg/s².
    pub angular_acceleration: f64,
    /// World and tool frame.
    pub frames: Frames,
    /// `SetConf`, for tool velocities; `None` while the automatic selection is on.
    pub posture: Option<Posture>,
    /// `SetConfTurn`, for tool velocities; `None` while the automatic selection is on.
    pub turn: Option<i32>,
}

/// Why the arm stands though a velocity is demanded. None of these is an error of the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Halt {
    /// A joint is at its limit, or joint 6 at the end of the desired turn.
    JointLimit(LimitExcess),
    /// A singularity that cannot be crossed, or the edge of reach.
    Blocked,
    /// The arm is not in the desired posture or turn.
    StartMismatch,
}

/// The way in which the arm moves at present.
#[derive(Clone, Copy, Debug)]
enum Mode {
    Joints { demand: Joints },
    Cartesian { demand: CartesianDemand, linear: DVec3, angular: DVec3, posture: Posture },
}

/// An arm in velocity mode.
#[derive(Clone, Copy, Debug)]
pub struct VelocityMove {
    state: JointState,
    /// deg/s of path time.
    velocity: Joints,
    mode: Mode,
}

impl VelocityMove {
    /// An arm at rest at `joints`.
    #[must_use]
    pub const fn at_rest(joints: Joints) -> Self {
        Self {
            state: JointState::at_rest(joints),
            velocity: [0.0; 6],
            mode: Mode::Joints { demand: [0.0; 6] },
        }
    }

    /// Where the arm is and how it moves.
    #[must_use]
    pub const fn state(&self) -> &JointState {
        &self.state
    }

    /// Whether the arm stands still and nothing is demanded.
    #[must_use]
    pub fn is_at_rest(&self) -> bool {
        let nothing_demanded = match &self.mode {
            Mode::Joints { demand } => *demand == [0.0; 6],
            Mode::Cartesian { demand, .. } => {
                demand.linear == [0.0; 3] && demand.angular == [0.0; 3]
            }
        };
        nothing_demanded && self.velocity.iter().all(|velocity| velocity.abs() < 1e-9)
    }

    /// Replaces the demanded velocity at once; the arm goes over to it from the velocity it has.
    /// A demand that is not finite counts as zero.
    pub fn demand(&mut self, demand: VelocityDemand, frames: &Frames) {
        let finite = |value: f64| if value.is_finite() { value } else { 0.0 };
        self.mode = match demand {
            VelocityDemand::Joints(demand) => Mode::Joints { demand: demand.map(finite) },
            VelocityDemand::Cartesian(demand) => {
                let posture = match &self.mode {
                    Mode::Cartesian { posture, .. } => *posture,
                    Mode::Joints { .. } => Posture::of(&self.state.position),
                };
                let demand = CartesianDemand {
                    linear: demand.linear.map(finite),
                    angular: demand.angular.map(finite),
                    ..demand
                };
                let tool = forward(&self.state.position) * frames.trf;
                let jacobian = Jacobian::at(&self.state.position, tool.position);
                let [x, y, z, wx, wy, wz] = jacobian.twist(&self.velocity);
                let to_frame = frame_in_base(demand.frame, &tool, frames).inverse();
                let linear = to_frame * DVec3::new(x, y, z);
                let angular = to_frame * DVec3::new(wx, wy, wz);
                Mode::Cartesian { demand, linear, angular, posture }
            }
        };
    }

    /// Demands zero velocity, in the same way of moving.
    pub const fn stop(&mut self) {
        match &mut self.mode {
            Mode::Joints { demand } => *demand = [0.0; 6],
            Mode::Cartesian { demand, .. } => {
                demand.linear = [0.0; 3];
                demand.angular = [0.0; 3];
            }
        }
    }

    /// Goes on by one step of the clock.
    ///
    /// Gives the reason when the arm stands though a velocity is demanded.
    pub fn advance(&mut self, step: ClockStep, settings: &VelocitySettings) -> Option<Halt> {
        if step.path_s.is_nan() || step.path_s <= 0.0 {
            self.state = self.state.moved_to(self.state.position, step.real_s);
            return None;
        }
        let (position, halt) = match self.mode {
            Mode::Joints { demand } => self.advance_joints(&demand, step.path_s, settings),
            Mode::Cartesian { .. } => self.advance_tool(step.path_s, settings),
        };
        for (velocity, (now, before)) in
            self.velocity.iter_mut().zip(position.iter().zip(self.state.position))
        {
            *velocity = (now - before) / step.path_s;
        }
        self.state = self.state.moved_to(position, step.real_s);
        halt
    }

    fn advance_joints(
        &self,
        demand: &Joints,
        seconds: f64,
        settings: &VelocitySettings,
    ) -> (Joints, Option<Halt>) {
        let wanted_share = share_within(demand, &settings.joint_velocity);
        let mut change = [0.0; 6];
        for (change, (demand, velocity)) in change.iter_mut().zip(demand.iter().zip(self.velocity))
        {
            *change = demand * wanted_share - velocity;
        }
        let most_change = settings.joint_acceleration.map(|acceleration| acceleration * seconds);
        let change_share = share_within(&change, &most_change);
        let mut travel = self.velocity;
        for (travel, change) in travel.iter_mut().zip(change) {
            *travel = (*travel + change * change_share) * seconds;
        }
        let allowed = allowed_travel(&self.state.position, &travel, seconds, settings);
        let share = share_within(&travel, &allowed);
        let mut position = self.state.position;
        for (position, travel) in position.iter_mut().zip(travel) {
            *position += travel * share;
        }
        let is_blocked = share < BLOCKED_SHARE && *demand != [0.0; 6];
        let halt = is_blocked.then(|| halt_at_limit(&self.state.position, &travel, settings));
        (position, halt)
    }

    fn advance_tool(
        &mut self,
        seconds: f64,
        settings: &VelocitySettings,
    ) -> (Joints, Option<Halt>) {
        let here = self.state.position;
        let Mode::Cartesian { demand, mut linear, mut angular, posture } = self.mode else {
            return (here, None);
        };
        let demands_motion = demand.linear != [0.0; 3] || demand.angular != [0.0; 3];
        let stand = |halt: Halt| (here, demands_motion.then_some(halt));
        let mut settings = *settings;
        if let Some(turn) = settings.turn {
            settings.limits = settings.limits.with_joint_6(turn_range(turn));
        }
        let configuration = Configuration::of(&here);
        let posture_fits = settings.posture.is_none_or(|posture| configuration.allows(posture));
        let turn_fits = settings.turn.is_none_or(|turn| turn_of(here[5]) == turn);
        if !(posture_fits && turn_fits) {
            self.rest_tool();
            return stand(Halt::StartMismatch);
        }
        approach(&mut linear, demand.linear, settings.linear_acceleration * seconds);
        approach(&mut angular, demand.angular, settings.angular_acceleration * seconds);
        let tool = forward(&here) * settings.frames.trf;
        let to_base = frame_in_base(demand.frame, &tool, &settings.frames);
        let step = ToolStep {
            tool,
            travel: to_base * linear * seconds,
            turn: (to_base * angular * seconds).map(f64::to_radians),
            seconds,
            here,
            settings: &settings,
        };
        let (share, joints, posture) = step.best(settings.posture, posture);
        // Rounding of the inverse kinematics is no motion.
        let moves = linear.length() + angular.length() > 1e-9;
        if share < BLOCKED_SHARE && moves {
            self.rest_tool();
            return stand(step.halt(posture));
        }
        let (linear, angular) = (linear * share, angular * share);
        self.mode = Mode::Cartesian { demand, linear, angular, posture };
        (if moves { joints } else { here }, None)
    }

    const fn rest_tool(&mut self) {
        if let Mode::Cartesian { linear, angular, .. } = &mut self.mode {
            *linear = DVec3::ZERO;
            *angular = DVec3::ZERO;
        }
    }
}

/// One step that the tool is asked to take.
struct ToolStep<'a> {
    tool: Pose,
    /// mm in the base frame.
    travel: DVec3,
    /// Axis times angle in radians, base frame.
    turn: DVec3,
    seconds: f64,
    here: Joints,
    settings: &'a VelocitySettings,
}

impl ToolStep<'_> {
    /// The greatest share of the step that the joints can follow, where it leads, and in which
    /// posture; another posture only where the present one is hindered and none is desired.
    fn best(&self, desired: Option<Posture>, present: Posture) -> (f64, Joints, Posture) {
        let posture = desired.unwrap_or(present);
        let (share, joints) = self.within(posture);
        let mut best = (share, joints, posture);
        if desired.is_none() && share < HINDERED_SHARE {
            for other in Posture::all().filter(|other| other.elbow == posture.elbow) {
                let (share, joints) = self.within(other);
                if share > best.0 {
                    best = (share, joints, other);
                }
            }
        }
        best
    }

    fn within(&self, posture: Posture) -> (f64, Joints) {
        let mut share = 1.0;
        for _ in 0..ATTEMPTS {
            let Some(joints) = self.solve(posture, share) else { return (0.0, self.here) };
            let travel = difference(&self.here, &joints);
            let allowed = allowed_travel(&self.here, &travel, self.seconds, self.settings);
            let fits = share_within(&travel, &allowed);
            if fits >= 1.0 {
                return (share, joints);
            }
            share *= 0.999 * fits;
            if share < BLOCKED_SHARE {
                break;
            }
        }
        (0.0, self.here)
    }

    fn solve(&self, posture: Posture, share: f64) -> Option<Joints> {
        let moved = Pose {
            position: self.tool.position + self.travel * share,
            orientation: (DQuat::from_scaled_axis(self.turn * share) * self.tool.orientation)
                .normalize(),
        };
        let flange = moved * self.settings.frames.trf.inverse();
        let mut joints = solve(&flange, posture, &self.here)?;
        joints[5] = nearest_turn(joints[5], self.here[5]);
        Some(joints)
    }

    fn halt(&self, posture: Posture) -> Halt {
        let Some(joints) = self.solve(posture, BLOCKED_SHARE) else { return Halt::Blocked };
        halt_at_limit(&self.here, &difference(&self.here, &joints), self.settings)
    }
}

fn frame_in_base(frame: TwistFrame, tool: &Pose, frames: &Frames) -> DQuat {
    match frame {
        TwistFrame::Tool => tool.orientation,
        TwistFrame::World => frames.wrf.orientation,
    }
}

/// Moves `value` towards `wanted` by `most` at most.
fn approach(value: &mut DVec3, wanted: [f64; 3], most: f64) {
    let change = DVec3::from_array(wanted) - *value;
    let length = change.length();
    *value += if length > most { change * (most / length) } else { change };
}

fn difference(from: &Joints, to: &Joints) -> Joints {
    let mut difference = *to;
    for (difference, from) in difference.iter_mut().zip(from) {
        *difference -= from;
    }
    difference
}

/// The share of `values`, 0 to 1, that keeps each of them within its limit.
fn share_within(values: &Joints, limits: &Joints) -> f64 {
    values
        .iter()
        .zip(limits)
        .filter(|(value, limit)| value.abs() > **limit)
        .map(|(value, limit)| limit / value.abs())
        .fold(1.0, f64::min)
}

/// How far each joint may go in the direction of `travel` within `seconds`, in degrees: so far that
/// it keeps its velocity limit and can still brake before its position limit.
fn allowed_travel(
    position: &Joints,
    travel: &Joints,
    seconds: f64,
    settings: &VelocitySettings,
) -> Joints {
    let mut allowed = settings.joint_velocity.map(|velocity| velocity * seconds);
    for (index, allowed) in allowed.iter_mut().enumerate() {
        let room = if travel[index] > 0.0 {
            settings.limits.max[index] - HALT_MARGIN_DEG - position[index]
        } else {
            position[index] - settings.limits.min[index] - HALT_MARGIN_DEG
        };
        // v t + v²/2a = room: the step, then braking.
        let braking = settings.joint_acceleration[index];
        let root = libm::sqrt(seconds * seconds + 2.0 * room.max(0.0) / braking);
        let braked = braking * (root - seconds) * seconds;
        *allowed = if braked.is_finite() { allowed.min(braked) } else { 0.0 };
    }
    allowed
}

/// The joint at whose limit the arm stands, if that is why it stands.
fn halt_at_limit(position: &Joints, travel: &Joints, settings: &VelocitySettings) -> Halt {
    let mut ahead = *position;
    for (ahead, travel) in ahead.iter_mut().zip(travel) {
        if *travel != 0.0 {
            *ahead += 2.0 * HALT_MARGIN_DEG * travel.signum();
        }
    }
    match settings.limits.check(&ahead) {
        Err(excess) => Halt::JointLimit(excess),
        Ok(()) => Halt::Blocked,
    }
}

#[cfg(test)]
#[path = "velocity_move_tests.rs"]
mod tests;
