//! Straight lines of the tool: `MoveLin`, `MoveLinRelTrf`, `MoveLinRelWrf`.
//!
//! A line is walked along first ([`linear_track`](super::linear_track)), which also finds every
//! reason to refuse it, and then gets a schedule: the highest speed that each stretch allows its
//! joints, and accelerations forward and backward over all of them. Sampling solves the inverse
//! kinematics at the exact point of the line; only the schedule rests on knots.
//!
//! Invariants: the tool stays on the line (where a singularity is crossed, as near as the line itself
//! passes it, and while the hand turns on the spot, within 0.013 mm); tool velocities and accelerations stay within the settings; no
//! joint exceeds its velocity. Joint accelerations are free, as the manual says (PM L381).

use alloc::vec::Vec;

use super::joint_move::pace_for;
use super::linear_path::LinearPath;
use super::linear_track::{Knot, Stretch, Track, between};
use super::{JointLimits, Pace, PlanError, Trapezoid, all_positive};
use crate::sim::meca500::kinematics::{
    Configuration, Frames, Joints, Posture, turn_of, turn_range,
};
use crate::sim::meca500::pose::Pose;

/// Stretches of equal length into which every line is cut at least.
const STRETCHES: u32 = 64;
/// Part of a joint's velocity limit that the schedule uses: the rest covers how much faster a joint
/// may be within a stretch than on the mean of its quarters.
const VELOCITY_SHARE: f64 = 0.97;

/// What a line obeys.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearSettings {
    /// World and tool frame.
    pub frames: Frames,
    /// Range of each joint.
    pub limits: JointLimits,
    /// Joint velocities that are never exceeded, in deg/s: `SetJointVelLimit`.
    pub joint_velocity: Joints,
    /// Joint accelerations while the hand turns on the spot in a singularity, in deg/s².
    pub joint_acceleration: Joints,
    /// `SetCartLinVel`, in mm/s; without effect when the pace is a duration.
    pub linear_velocity: f64,
    /// `SetCartAngVel`, in deg/s; without effect when the pace is a duration.
    pub angular_velocity: f64,
    /// Linear part of `SetCartAcc`, in mm/s².
    pub linear_acceleration: f64,
    /// Angular part of `SetCartAcc`, in deg/s².
    pub angular_acceleration: f64,
    /// `SetMoveMode`.
    pub pace: Pace,
    /// `SetConf`; `None` while the automatic selection is on.
    pub posture: Option<Posture>,
    /// `SetConfTurn`; `None` while the automatic selection is on.
    pub turn: Option<i32>,
}

/// When a knot is reached, and how fast.
#[derive(Clone, Copy, Debug)]
struct Timing {
    seconds: f64,
    /// Extent per second at the knot.
    speed: f64,
    /// Most extent per second up to the next knot.
    cap: f64,
}

/// A checked straight line of the tool.
#[derive(Clone, Debug)]
pub struct LinearPlan {
    path: LinearPath,
    knots: Vec<Knot>,
    timings: Vec<Timing>,
    acceleration: f64,
    limits: JointLimits,
    joint_velocity: Joints,
    shortest_duration_s: Option<f64>,
}

/// Plans the line from the tool's pose at `start` to `target`, the tool in the world.
///
/// # Errors
///
/// [`PlanError::StartMismatch`], [`PlanError::HalfTurn`], [`PlanError::OutOfReach`],
/// [`PlanError::OutOfReachOnPath`], [`PlanError::LimitOnPath`], [`PlanError::Singularity`] as they
/// say; [`PlanError::BadNumber`] for velocities or accelerations that are not positive.
pub fn plan_linear_move(
    start: &Joints,
    target: &Pose,
    settings: &LinearSettings,
) -> Result<LinearPlan, PlanError> {
    let scalars = [
        settings.linear_velocity,
        settings.angular_velocity,
        settings.linear_acceleration,
        settings.angular_acceleration,
    ];
    let joints_are_positive =
        all_positive(&settings.joint_velocity) && all_positive(&settings.joint_acceleration);
    if !(all_positive(&scalars) && joints_are_positive) {
        return Err(PlanError::BadNumber);
    }
    let path = LinearPath::new(start, target, &settings.frames)?;
    let limits = limits_of(start, settings)?;
    let slower = |linear: f64, angular: f64| {
        (linear / path.length_mm()).min(angular / path.angle_deg()).min(f64::MAX)
    };
    let acceleration = slower(settings.linear_acceleration, settings.angular_acceleration);
    let velocity = match settings.pace {
        Pace::Velocity => slower(settings.linear_velocity, settings.angular_velocity),
        Pace::Duration(wanted_s) => pace_for(1.0, wanted_s, f64::MAX, acceleration)?.0,
    };
    let ideal = Trapezoid::new(1.0, velocity, acceleration);
    let turning = settings.joint_acceleration[3].min(settings.joint_acceleration[5]);
    let track = Track {
        path: &path,
        limits,
        posture_is_free: settings.posture.is_none(),
        extent_per_deg: acceleration / turning,
    };
    let moves = path.length_mm() > 1e-9 || path.angle_deg() > 1e-9;
    let grid = if moves { grid_of(ideal.ramp_distance()) } else { Vec::new() };
    let posture = settings.posture.unwrap_or_else(|| Posture::exactly_of(start));
    let knots = track.walk(start, posture, &grid).map_err(|error| match error {
        PlanError::OutOfReachOnPath { .. } if !ends_in_reach(&path, start, posture) => {
            PlanError::OutOfReach
        }
        other => other,
    })?;
    let timings = schedule(&path, &knots, velocity, acceleration, &settings.joint_velocity);
    let mut plan = LinearPlan {
        path,
        knots,
        timings,
        acceleration,
        limits,
        joint_velocity: settings.joint_velocity,
        shortest_duration_s: None,
    };
    if let Pace::Duration(wanted_s) = settings.pace {
        let late_s = if moves { plan.duration_s() - ideal.duration_s() } else { 0.0 };
        if moves && (wanted_s <= 0.0 || late_s > 1e-6) {
            plan.shortest_duration_s = Some(wanted_s + late_s.max(0.0));
        }
    }
    Ok(plan)
}

/// The limits in force, after the start's posture and turn were compared with the desired ones.
fn limits_of(start: &Joints, settings: &LinearSettings) -> Result<JointLimits, PlanError> {
    let configuration = Configuration::of(start);
    let posture_fits = settings.posture.is_none_or(|posture| configuration.allows(posture));
    let turn_fits = settings.turn.is_none_or(|turn| turn_of(start[5]) == turn);
    if !(posture_fits && turn_fits) {
        return Err(PlanError::StartMismatch);
    }
    Ok(settings.turn.map_or(settings.limits, |turn| settings.limits.with_joint_6(turn_range(turn))))
}

fn ends_in_reach(path: &LinearPath, start: &Joints, posture: Posture) -> bool {
    crate::sim::meca500::kinematics::solve(&path.flange_at(1.0), posture, start).is_some()
}

/// Fractions at which every line gets a knot: equal stretches and the ends of the ramps.
fn grid_of(ramp: f64) -> Vec<f64> {
    let mut grid: Vec<f64> =
        (1..=STRETCHES).map(|index| f64::from(index) / f64::from(STRETCHES)).collect();
    for end_of_ramp in [ramp, 1.0 - ramp] {
        let is_new = grid.iter().all(|at| (at - end_of_ramp).abs() > 1e-9);
        if is_new && end_of_ramp > 1e-9 && end_of_ramp < 1.0 {
            grid.push(end_of_ramp);
        }
    }
    grid.sort_by(f64::total_cmp);
    grid
}

/// When each knot is reached, as fast as `velocity`, `acceleration` and the joints allow.
fn schedule(
    path: &LinearPath,
    knots: &[Knot],
    velocity: f64,
    acceleration: f64,
    joint_velocity: &Joints,
) -> Vec<Timing> {
    let mut timings: Vec<Timing> = knots
        .windows(2)
        .map(|pair| velocity.min(fastest_between(path, &pair[0], &pair[1], joint_velocity)))
        .map(|cap| Timing { seconds: 0.0, speed: 0.0, cap })
        .collect();
    timings.push(Timing { seconds: 0.0, speed: 0.0, cap: velocity });
    let stands = |index: usize| {
        index == 0
            || index + 1 >= knots.len()
            || knots[index].next == Stretch::Turn
            || knots[index - 1].next == Stretch::Turn
    };
    let reach = |from: f64, distance: f64| libm::sqrt(from * from + 2.0 * acceleration * distance);
    for index in 1..knots.len() {
        let distance = knots[index].extent - knots[index - 1].extent;
        let cap = timings[index].cap.min(timings[index - 1].cap);
        let reachable = reach(timings[index - 1].speed, distance);
        timings[index].speed = if stands(index) { 0.0 } else { cap.min(reachable) };
    }
    for index in (1..knots.len()).rev() {
        let distance = knots[index].extent - knots[index - 1].extent;
        let reachable = reach(timings[index].speed, distance);
        timings[index - 1].speed = timings[index - 1].speed.min(reachable);
    }
    for index in 1..knots.len() {
        let distance = knots[index].extent - knots[index - 1].extent;
        let (before, after) = (timings[index - 1], timings[index].speed);
        let seconds = if before.speed + after > 0.0 {
            2.0 * distance / (before.speed + after)
        } else {
            Trapezoid::new(distance, before.cap, acceleration).duration_s()
        };
        timings[index].seconds = before.seconds + seconds;
    }
    timings
}

/// Highest speed between two knots at which no joint exceeds its velocity.
fn fastest_between(path: &LinearPath, from: &Knot, to: &Knot, limits: &Joints) -> f64 {
    let quarter = 0.25 * (to.extent - from.extent);
    let mut before = from.joints;
    let mut slope: f64 = 0.0;
    for fraction in [0.25, 0.5, 0.75, 1.0] {
        let now = if fraction < 1.0 { between(path, from, to, fraction) } else { to.joints };
        for (limit, (before, now)) in limits.iter().zip(before.iter().zip(now)) {
            slope = slope.max((now - before).abs() / (quarter * limit));
        }
        before = now;
    }
    if slope > 0.0 { VELOCITY_SHARE / slope } else { f64::MAX }
}

impl LinearPlan {
    /// The joints at the start, in degrees.
    #[must_use]
    pub const fn start(&self) -> Joints {
        match self.knots.as_slice() {
            [first, ..] => first.joints,
            [] => [0.0; 6],
        }
    }

    /// The joints at the end, in degrees.
    #[must_use]
    pub const fn end(&self) -> Joints {
        match self.knots.as_slice() {
            [.., last] => last.joints,
            [] => [0.0; 6],
        }
    }

    /// From start to stop at full pace, in s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.timings.last().map_or(0.0, |last| last.seconds)
    }

    /// From the start until the speed first stops rising, in s.
    #[must_use]
    pub fn acceleration_s(&self) -> f64 {
        self.timings
            .windows(2)
            .find(|pair| pair[1].speed <= pair[0].speed * (1.0 + 1e-9))
            .map_or(0.0, |pair| pair[0].seconds)
    }

    /// From where the speed last starts falling to the end, in s.
    #[must_use]
    pub fn deceleration_s(&self) -> f64 {
        self.timings
            .windows(2)
            .rev()
            .find(|pair| pair[0].speed <= pair[1].speed * (1.0 + 1e-9))
            .map_or(0.0, |pair| self.duration_s() - pair[1].seconds)
    }

    /// See [`Plan::shortest_duration_s`](super::Plan::shortest_duration_s).
    #[must_use]
    pub const fn shortest_duration_s(&self) -> Option<f64> {
        self.shortest_duration_s
    }

    /// The joints `seconds` after the start, in degrees.
    #[must_use]
    pub fn sample(&self, seconds: f64) -> Joints {
        let Some((index, fraction)) = self.locate(seconds) else {
            return if seconds > 0.0 { self.end() } else { self.start() };
        };
        let joints = between(&self.path, &self.knots[index], &self.knots[index + 1], fraction);
        // Between two knots at a limit the line may bulge beyond it by less than shows in the walk.
        self.limits.nearest(&joints)
    }

    /// The tool in the base frame `seconds` after the start.
    #[must_use]
    pub fn tool_at(&self, seconds: f64) -> Pose {
        self.path.tool_at(self.fraction_at(seconds))
    }

    /// The flange while this line ends (at `seconds`) and `next` has begun (at `next_seconds`).
    pub(super) fn flange_blended(&self, seconds: f64, next: &Self, next_seconds: f64) -> Pose {
        self.path.flange_blended(
            self.fraction_at(seconds),
            &next.path,
            next.fraction_at(next_seconds),
        )
    }

    /// The posture in which the line begins, unless it begins with a singularity.
    pub(super) fn first_posture(&self) -> Option<Posture> {
        match self.knots.first()?.next {
            Stretch::Follow(posture) => Some(posture),
            Stretch::Cross(..) | Stretch::Turn => None,
        }
    }

    /// The posture in which the line ends.
    pub(super) fn last_posture(&self) -> Option<Posture> {
        match self.knots.last()?.next {
            Stretch::Follow(posture) => Some(posture),
            Stretch::Cross(..) | Stretch::Turn => None,
        }
    }

    pub(super) const fn limits(&self) -> &JointLimits {
        &self.limits
    }

    pub(super) const fn joint_velocity(&self) -> &Joints {
        &self.joint_velocity
    }

    /// Fraction of the line at `seconds`.
    fn fraction_at(&self, seconds: f64) -> f64 {
        match self.locate(seconds) {
            Some((index, fraction)) => {
                let (from, to) = (&self.knots[index], &self.knots[index + 1]);
                from.at + fraction * (to.at - from.at)
            }
            None if seconds > 0.0 => self.knots.last().map_or(0.0, |last| last.at),
            None => 0.0,
        }
    }

    /// The stretch under way at `seconds` and the fraction of it; `None` before and after.
    fn locate(&self, seconds: f64) -> Option<(usize, f64)> {
        let reached = self.timings.partition_point(|timing| timing.seconds <= seconds);
        let index = reached.checked_sub(1)?;
        let (from, to) = (self.timings.get(index)?, self.timings.get(index + 1)?);
        let distance = self.knots[index + 1].extent - self.knots[index].extent;
        let passed = seconds - from.seconds;
        let covered = if from.speed + to.speed > 0.0 {
            let acceleration = (to.speed * to.speed - from.speed * from.speed) / (2.0 * distance);
            (from.speed + 0.5 * acceleration * passed) * passed
        } else {
            Trapezoid::new(distance, from.cap, self.acceleration).at(passed).position
        };
        let fraction = covered / distance;
        // A stretch shorter than rounding has no inside.
        Some((index, if fraction.is_finite() { fraction.clamp(0.0, 1.0) } else { 0.0 }))
    }
}

#[cfg(test)]
#[path = "linear_move_tests.rs"]
mod tests;
