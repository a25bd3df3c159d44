//! Following plans in time, and blending one into the next.
//!
//! ```text
//!            start(plan)            follow_with(next)
//!   at rest ------------> one move ------------------> move and next
//!      ^                     |  ^                        |     |
//!      +------- end ---------+  +--- end of the first ---+     | blending: next begins while
//!                                                              | the first decelerates
//! ```
//!
//! The blending law stands in for the real robot's, which is not public. The next move begins in the
//! deceleration of the first; both run, and what they cover adds up: joint by joint between
//! joint-space moves, translation and rotation of the tool between lines. At 100 % they overlap over
//! the shorter of the first one's deceleration and the second one's acceleration, below that over
//! this share of it. Falling and rising ramps of such an overlap never add up to more than the
//! greater of the two velocities; accelerations may, up to the sum of both settings.
//!
//! The corner between two lines is sampled before it is used: where a joint would exceed its range or
//! velocity, or a singularity is met, the overlap is halved, twice, and then dropped.

use super::{ClockStep, JointState, LinearPlan, Plan};
use crate::sim::meca500::kinematics::{Joints, nearest_turn, solve};

/// Points at which a corner between two lines is examined.
const CORNER_SAMPLES: u32 = 64;
/// Part of a joint's velocity limit that a corner may need between two samples.
const CORNER_VELOCITY_SHARE: f64 = 0.98;

/// How one move is followed by the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Handover {
    /// The next one begins after a full stop.
    Stop,
    /// The next one begins this long before the first one ends, in s of path time.
    Blended {
        /// Time in which both run.
        overlap_s: f64,
    },
}

/// What happened in one step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// The next move began; with blending, while the first one ends. Checkpoints placed after the
    /// first move are reached here (PM L2467).
    pub next_began: bool,
    /// Moves that came to their end in this step: 0, 1 or 2.
    pub ended: u8,
}

#[derive(Clone, Debug)]
struct Next {
    plan: Plan,
    /// Path time of the first move at which this one begins.
    begins_s: f64,
    began: bool,
}

#[derive(Clone, Debug)]
struct Running {
    plan: Plan,
    seconds: f64,
    next: Option<Next>,
}

/// Where the arm is on its way along one plan, or from one into the next.
#[derive(Clone, Debug)]
pub struct Follower {
    state: JointState,
    running: Option<Running>,
}

impl Follower {
    /// An arm at rest.
    #[must_use]
    pub const fn at_rest(joints: Joints) -> Self {
        Self { state: JointState::at_rest(joints), running: None }
    }

    /// Where the arm is and how it moves.
    #[must_use]
    pub const fn state(&self) -> &JointState {
        &self.state
    }

    /// Whether a plan is being followed (also while its clock stands still).
    #[must_use]
    pub const fn is_busy(&self) -> bool {
        self.running.is_some()
    }

    /// Whether [`follow_with`](Self::follow_with) would take a plan.
    #[must_use]
    pub fn has_room(&self) -> bool {
        self.running.as_ref().is_none_or(|running| running.next.is_none())
    }

    /// Where the last plan taken will end: the start of the one to plan next.
    #[must_use]
    pub fn end(&self) -> Joints {
        match &self.running {
            Some(Running { next: Some(next), .. }) => next.plan.end(),
            Some(running) => running.plan.end(),
            None => self.state.position,
        }
    }

    /// Takes `plan`, which starts at [`end`](Self::end): begins it at once when at rest, else lets it
    /// follow the present one. `blending` is `SetBlending` as a fraction, 0 to 1; the caller gives 0
    /// when a command between the two moves demands a stop.
    ///
    /// # Errors
    ///
    /// Gives the plan back when [`has_room`](Self::has_room) is false.
    // The plan is owned by whoever can use it; boxing it would allocate on the way back.
    #[expect(clippy::result_large_err)]
    pub fn follow_with(&mut self, plan: Plan, blending: f64) -> Result<Handover, Plan> {
        let Some(running) = &mut self.running else {
            self.running = Some(Running { plan, seconds: 0.0, next: None });
            return Ok(Handover::Stop);
        };
        if running.next.is_some() {
            return Err(plan);
        }
        let overlap_s = overlap_s(running, &plan, blending);
        let begins_s = running.plan.duration_s() - overlap_s;
        running.next = Some(Next { plan, begins_s, began: false });
        Ok(if overlap_s > 0.0 { Handover::Blended { overlap_s } } else { Handover::Stop })
    }

    /// Stays where it is and forgets its plans: after a pause that was cleared, or a hard stop.
    pub fn stop_here(&mut self) {
        self.state = JointState::at_rest(self.state.position);
        self.running = None;
    }

    /// Forgets the plan that has not begun; `true` if there was one.
    pub fn discard_next(&mut self) -> bool {
        self.running.as_mut().and_then(|running| running.next.take_if(|next| !next.began)).is_some()
    }

    /// Goes on by one step of the clock.
    pub fn advance(&mut self, step: ClockStep) -> Progress {
        let mut progress = Progress::default();
        let Some(running) = &mut self.running else {
            self.state = self.state.moved_to(self.state.position, step.real_s);
            return progress;
        };
        running.seconds += step.path_s.max(0.0);
        if let Some(next) = &mut running.next
            && running.seconds >= next.begins_s
            && !next.began
        {
            next.began = true;
            progress.next_began = true;
        }
        let mut position = running.position(&self.state.position);
        if running.seconds >= running.plan.duration_s() {
            progress.ended = 1;
            if let Some(next) = running.next.take() {
                let seconds = running.seconds - next.begins_s;
                if seconds >= next.plan.duration_s() {
                    progress.ended = 2;
                    position = next.plan.end();
                    self.running = None;
                } else {
                    self.running = Some(Running { plan: next.plan, seconds, next: None });
                }
            } else {
                self.running = None;
            }
        }
        self.state = self.state.moved_to(position, step.real_s);
        progress
    }
}

impl Running {
    fn position(&self, before: &Joints) -> Joints {
        match &self.next {
            Some(next) if next.began => {
                let next_s = self.seconds - next.begins_s;
                blend(&self.plan, self.seconds, &next.plan, next_s, before)
                    .unwrap_or_else(|| next.plan.sample(next_s))
            }
            _ => self.plan.sample(self.seconds),
        }
    }
}

/// The joints while `first` ends and `next` has begun.
fn blend(
    first: &Plan,
    seconds: f64,
    next: &Plan,
    next_seconds: f64,
    before: &Joints,
) -> Option<Joints> {
    if seconds >= first.duration_s() {
        return Some(next.sample(next_seconds));
    }
    if let (Plan::Linear(first), Plan::Linear(next)) = (first, next) {
        return blend_lines(first, seconds, next, next_seconds, before);
    }
    let mut joints = first.sample(seconds);
    let covered = next.sample(next_seconds).into_iter().zip(next.start());
    for (joint, (now, start)) in joints.iter_mut().zip(covered) {
        *joint += now - start;
    }
    Some(joints)
}

fn blend_lines(
    first: &LinearPlan,
    seconds: f64,
    next: &LinearPlan,
    next_seconds: f64,
    before: &Joints,
) -> Option<Joints> {
    let flange = first.flange_blended(seconds, next, next_seconds);
    let mut joints = solve(&flange, next.first_posture()?, before)?;
    joints[5] = nearest_turn(joints[5], before[5]);
    Some(joints)
}

/// Time in which both moves run, 0 when the second one begins after a full stop.
fn overlap_s(running: &Running, next: &Plan, blending: f64) -> f64 {
    let first = &running.plan;
    let blending = if blending > 0.0 { blending.min(1.0) } else { 0.0 };
    let left_s = (first.duration_s() - running.seconds).max(0.0);
    let overlap_s = (blending * first.deceleration_s().min(next.acceleration_s())).min(left_s);
    match (first, next) {
        (Plan::Joint(_), Plan::Joint(_)) => overlap_s,
        (Plan::Linear(first), Plan::Linear(next)) => [1.0, 0.5, 0.25]
            .into_iter()
            .map(|share| share * overlap_s)
            .find(|overlap_s| corner_is_free(first, next, *overlap_s))
            .unwrap_or(0.0),
        (Plan::Joint(_), Plan::Linear(_)) | (Plan::Linear(_), Plan::Joint(_)) => 0.0,
    }
}

/// Whether the joints can follow the corner between two lines.
fn corner_is_free(first: &LinearPlan, next: &LinearPlan, overlap_s: f64) -> bool {
    if first.last_posture() != next.first_posture() || overlap_s <= 0.0 {
        return false;
    }
    let begins_s = first.duration_s() - overlap_s;
    let step_s = overlap_s / f64::from(CORNER_SAMPLES);
    let mut before = first.sample(begins_s);
    (1..=CORNER_SAMPLES).all(|index| {
        let next_s = step_s * f64::from(index);
        let joints = if index == CORNER_SAMPLES {
            Some(next.sample(overlap_s))
        } else {
            blend_lines(first, begins_s + next_s, next, next_s, &before)
        };
        let Some(joints) = joints else { return false };
        let mut limits = next.joint_velocity().iter().zip(before.iter().zip(joints));
        let is_slow = limits.all(|(limit, (before, now))| {
            (now - before).abs() <= limit * step_s * CORNER_VELOCITY_SHARE
        });
        before = joints;
        is_slow && next.limits().check(&joints).is_ok()
    })
}

#[cfg(test)]
#[path = "follower_tests.rs"]
mod tests;
