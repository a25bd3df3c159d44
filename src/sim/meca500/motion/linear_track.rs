//! Walking along a line before it starts: the joints at as many points as it takes.
//!
//! The line is cut until no joint turns by more than [`STEP_DEG`] from knot to knot. A stretch that
//! is at its finest and still turns a joint further meets a singularity:
//!
//! ```text
//!  a jump ahead
//!    |-- line begins just outside the desired posture and enters it --> cross into it
//!    |-- posture free, another posture continues --------> cross in it
//!    |-- the line ends there -----------------------------> keep joint 4 to the end
//!    |-- wrist singularity, posture desired or line just
//!    |   begun, joints 4 and 6 have room ----------------> turn them on the spot, cross
//!    +-- else -------------------------------------------> refuse (1012)
//! ```
//!
//! Source: PM L289-326. A line that passes a singularity at a small distance is not a jump: joints 4
//! and 6 turn fast and the tool waits for them. Between the two lies a narrow band, about
//! [`FINEST`] wide, where the line is refused.

use alloc::vec::Vec;

use super::linear_path::LinearPath;
use super::{JointLimits, PlanError};
use crate::sim::meca500::kinematics::{
    Bridge, Joints, Posture, Side, forward, nearest_turn, solve, solve_across,
};
use crate::sim::meca500::pose::Pose;

/// Most that a joint turns from knot to knot, in degrees.
const STEP_DEG: f64 = 5.0;
/// Turn of a joint in half a stretch, in degrees, under which bends do not matter.
const BEND_DEG: f64 = 0.1;
/// How much further a joint may turn in one half of a stretch than in the other.
const BEND_RATIO: f64 = 1.1;
/// Length of the shortest stretch cut because of a bend, in finest stretches.
const FINEST_BEND: f64 = 1.0 / 256.0;
/// Length of the shortest stretch, in mm of travel or degrees of turn, whichever is more of them.
/// The manual tells a line through a singularity from one a micrometre beside it.
const FINEST: f64 = 1e-3;
/// Most knots of a line; more are needed only for lines that follow a singularity.
const MOST_KNOTS: usize = 768;
/// How far beyond a jump the line is taken up again, in finest stretches, the best first.
const CLEARANCES: [f64; 3] = [4.0, 2.0, 1.0];
/// How far the start may be from the solution of its own posture, in degrees: the rounding of the
/// inverse kinematics beside a singularity.
const ROUNDING_DEG: f64 = 1e-3;
/// Where a stretch is looked at between its knots.
const INSIDE: [f64; 3] = [0.25, 0.5, 0.75];
/// Longest stretch over which a line may enter the desired posture, in finest stretches.
const LONGEST_ENTRY: f64 = 1024.0;
/// Most that the tool may be off the line meanwhile, in mm or degrees: as much as turning on the spot.
const ENTRY_MISS: f64 = 0.012;
/// How far joint 1 or 4 may be from the mean of its knots, in degrees. Where the stretch was cut for
/// its bends it is nearer; where it is further, the solution is that of another way to stand.
const STRAY_DEG: f64 = 0.25;
/// Joint 5 under which the hand may turn on the spot, in degrees: some of the finest stretches. The
/// tool tilts by up to twice as much meanwhile, 0.012 mm at the flange.
const TURNING_WRIST_DEG: f64 = 0.005;

/// How the joints follow from the line between two knots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stretch {
    /// By inverse kinematics in this posture.
    Follow(Posture),
    /// Through a singularity, with a joint held.
    Cross(Posture, Bridge),
    /// The tool stands still while joints 4 and 6 turn against each other.
    Turn,
}

/// A point of the line whose joints are known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Knot {
    /// Fraction of the line.
    pub(super) at: f64,
    /// Fraction of the line plus the extent of turns on the spot: what the schedule runs over.
    pub(super) extent: f64,
    pub(super) joints: Joints,
    /// What lies between this knot and the next.
    pub(super) next: Stretch,
}

/// What the walk obeys.
pub(super) struct Track<'a> {
    pub(super) path: &'a LinearPath,
    pub(super) limits: JointLimits,
    /// Whether the posture may change where the line allows it.
    pub(super) posture_is_free: bool,
    /// Extent of a degree of turning on the spot.
    pub(super) extent_per_deg: f64,
}

impl Track<'_> {
    /// The knots from `start` over the fractions of `grid`, rising to 1.
    pub(super) fn walk(
        &self,
        start: &Joints,
        posture: Posture,
        grid: &[f64],
    ) -> Result<Vec<Knot>, PlanError> {
        self.check(0.0, start)?;
        let fits = self.solve(0.0, posture, start).is_some_and(|own| {
            own.iter().zip(start).all(|(own, start)| (own - start).abs() < ROUNDING_DEG)
        });
        if !fits && Posture::exactly_of(start).elbow != posture.elbow {
            return Err(PlanError::Singularity { at: 0.0 });
        }
        let size = self.path.length_mm().max(self.path.angle_deg());
        let finest = FINEST / size.max(FINEST);
        let mut posture = posture;
        let mut here =
            Knot { at: 0.0, extent: 0.0, joints: *start, next: Stretch::Follow(posture) };
        let mut knots = Vec::with_capacity(grid.len() * 2);
        let mut pending = Vec::new();
        for &goal in grid {
            if goal > here.at {
                pending.push(goal);
            }
            while let Some(&at) = pending.last() {
                if knots.len() > MOST_KNOTS {
                    return Err(PlanError::Singularity { at: here.at });
                }
                let joints = self
                    .solve(at, posture, &here.joints)
                    .ok_or(PlanError::OutOfReachOnPath { at })?;
                let stands_in_posture = fits || here.at > 0.0;
                let knot = Knot { at, joints, ..here };
                if stands_in_posture
                    && is_near(&here.joints, &joints)
                    && self.is_continuous(&here, &knot, posture)
                {
                    if at - here.at > finest * FINEST_BEND
                        && self.bends(&here, at, &joints, posture)
                    {
                        pending.push(0.5 * (here.at + at));
                        continue;
                    }
                    self.check(at, &joints)?;
                    for inside in INSIDE {
                        let joints = between(self.path, &here, &knot, inside);
                        self.check(here.at + inside * (at - here.at), &joints)?;
                    }
                    knots.push(here);
                    let extent = here.extent + at - here.at;
                    here = Knot { at, extent, joints, next: Stretch::Follow(posture) };
                    pending.pop();
                } else if at - here.at > finest {
                    pending.push(0.5 * (here.at + at));
                } else {
                    let entry =
                        if stands_in_posture { None } else { self.enter(&here, posture, finest) };
                    (here, posture) = match entry {
                        Some((knot, there)) => {
                            knots.push(knot);
                            (there, posture)
                        }
                        None => self.cross(here, posture, finest, &mut knots)?,
                    };
                    while pending.pop_if(|at| *at <= here.at).is_some() {}
                }
            }
        }
        knots.push(here);
        Ok(knots)
    }

    /// From a start just outside `posture` into it, joints held that would have to turn by half a
    /// turn to be in it at once.
    fn enter(&self, here: &Knot, posture: Posture, finest: f64) -> Option<(Knot, Knot)> {
        let actual = Posture::exactly_of(&here.joints);
        let bridge = Bridge {
            waist: actual.shoulder != posture.shoulder,
            forearm: actual.wrist != posture.wrist,
        };
        let from = Knot { next: Stretch::Cross(posture, bridge), ..*here };
        core::iter::successors(Some(1.0), |stretches| Some(2.0 * stretches))
            .take_while(|stretches| *stretches <= LONGEST_ENTRY && stretches * finest < 1.0)
            .find_map(|stretches| {
                let at = here.at + stretches * finest;
                let joints = self.solve(at, posture, &here.joints)?;
                let extent = here.extent + at - here.at;
                let to = Knot { at, extent, joints, next: Stretch::Follow(posture) };
                let fits = is_near(&here.joints, &joints)
                    && self.limits.check(&joints).is_ok()
                    && INSIDE.iter().all(|inside| self.is_on_line(&from, &to, *inside));
                fits.then_some((from, to))
            })
    }

    fn is_on_line(&self, from: &Knot, to: &Knot, fraction: f64) -> bool {
        let joints = between(self.path, from, to, fraction);
        let wanted = self.path.flange_at(from.at + fraction * (to.at - from.at));
        let reached = forward(&joints);
        let miss = reached.position.distance(wanted.position).max(reached.angle_to(&wanted));
        miss < ENTRY_MISS && is_near(&from.joints, &joints) && self.limits.check(&joints).is_ok()
    }

    /// Whether `posture` holds all the way: a line may leave it and be back at the next knot.
    fn is_continuous(&self, here: &Knot, there: &Knot, posture: Posture) -> bool {
        INSIDE.iter().all(|inside| {
            let at = here.at + inside * (there.at - here.at);
            self.solve(at, posture, &here.joints)
                .is_some_and(|joints| is_near(&here.joints, &joints))
        })
    }

    /// Goes on from `here` through the singularity that lies just ahead, as far as it takes to be
    /// clear of rounding in it.
    fn cross(
        &self,
        here: Knot,
        posture: Posture,
        finest: f64,
        knots: &mut Vec<Knot>,
    ) -> Result<(Knot, Posture), PlanError> {
        let ahead = CLEARANCES.map(|stretches| (here.at + stretches * finest).min(1.0));
        for at in ahead {
            let crossed = self.continue_in_other_posture(&here, posture, at)?;
            if let Some((knot, there, other)) = crossed {
                knots.push(knot);
                return Ok((there, other));
            }
        }
        if let Some((knot, there)) = self.end_in_singularity(&here, posture, ahead[0]) {
            knots.push(knot);
            return Ok((there, posture));
        }
        let (turn, knot, there, other) = ahead
            .into_iter()
            .find_map(|at| self.turn_and_continue(&here, posture, at))
            .ok_or(PlanError::Singularity { at: here.at })?;
        knots.extend([turn, knot]);
        Ok((there, other))
    }

    /// Straight on: the posture changes and no joint notices.
    fn continue_in_other_posture(
        &self,
        here: &Knot,
        posture: Posture,
        at: f64,
    ) -> Result<Option<(Knot, Knot, Posture)>, PlanError> {
        if !self.posture_is_free {
            return Ok(None);
        }
        let found = Posture::all()
            .filter(|other| other.elbow == posture.elbow && *other != posture)
            .filter_map(|other| Some((self.solve(at, other, &here.joints)?, other)))
            .find(|(joints, _)| is_near(&here.joints, joints));
        let Some((joints, other)) = found else { return Ok(None) };
        self.check(at, &joints)?;
        let bridge = Bridge {
            waist: other.shoulder != posture.shoulder,
            forearm: other.wrist != posture.wrist,
        };
        let extent = here.extent + at - here.at;
        Ok(Some((
            Knot { next: Stretch::Cross(other, bridge), ..*here },
            Knot { at, extent, joints, next: Stretch::Follow(other) },
            other,
        )))
    }

    /// A stop in which joints 4 and 6 turn against each other, then on in the desired posture.
    fn turn_and_continue(
        &self,
        here: &Knot,
        posture: Posture,
        at: f64,
    ) -> Option<(Knot, Knot, Knot, Posture)> {
        let may_turn =
            here.joints[4].abs() < TURNING_WRIST_DEG && (!self.posture_is_free || here.at <= 0.0);
        if !may_turn {
            return None;
        }
        let amount = |turned: &Joints| (turned[3] - here.joints[3]).abs();
        let (turned, joints, other) = Side::BOTH
            .into_iter()
            .filter(|side| self.posture_is_free || *side == posture.wrist)
            .filter_map(|wrist| self.turn_on_the_spot(here, Posture { wrist, ..posture }, at))
            .min_by(|(a, ..), (b, ..)| amount(a).total_cmp(&amount(b)))?;
        let extent = here.extent + self.extent_per_deg * amount(&turned);
        let bridge = Bridge { waist: false, forearm: true };
        Some((
            Knot { next: Stretch::Turn, ..*here },
            Knot { extent, joints: turned, next: Stretch::Cross(other, bridge), ..*here },
            Knot { at, extent: extent + at - here.at, joints, next: Stretch::Follow(other) },
            other,
        ))
    }

    /// The line ends so near the wrist singularity that joint 4 of its end is rounding: it stays.
    fn end_in_singularity(&self, here: &Knot, posture: Posture, at: f64) -> Option<(Knot, Knot)> {
        if at < 1.0 {
            return None;
        }
        let bridge = Bridge { waist: false, forearm: true };
        let target = self.path.flange_at(at);
        let mut joints = solve_across(&target, posture, bridge, &here.joints)?;
        joints[5] = nearest_turn(joints[5], here.joints[5]);
        let reached = forward(&joints);
        let miss = reached.position.distance(target.position).max(reached.angle_to(&target));
        let fits = miss < FINEST && is_near(&here.joints, &joints);
        let extent = here.extent + at - here.at;
        (fits && self.limits.check(&joints).is_ok()).then_some((
            Knot { next: Stretch::Cross(posture, bridge), ..*here },
            Knot { at, extent, joints, next: Stretch::Follow(posture) },
        ))
    }

    /// The joints after turning on the spot so that `posture` continues the line, and those at
    /// `at`; `None` when a joint has no room for it.
    fn turn_on_the_spot(
        &self,
        here: &Knot,
        posture: Posture,
        at: f64,
    ) -> Option<(Joints, Joints, Posture)> {
        let mut joints = self.solve(at, posture, &here.joints)?;
        let mut turned = here.joints;
        turned[3] = joints[3];
        turned[5] -= joints[3] - here.joints[3];
        joints[5] = nearest_turn(joints[5], turned[5]);
        let has_room = is_near(&turned, &joints)
            && self.limits.check(&turned).is_ok()
            && self.limits.check(&joints).is_ok();
        has_room.then_some((turned, joints, posture))
    }

    /// Whether a joint is so much faster in one half of the stretch from `here` to `at` than in the
    /// other that the mean says little of it.
    fn bends(&self, here: &Knot, at: f64, joints: &Joints, posture: Posture) -> bool {
        let Some(middle) = self.solve(0.5 * (here.at + at), posture, &here.joints) else {
            return false;
        };
        let ends = here.joints.iter().zip(joints);
        middle.iter().zip(ends).any(|(middle, (from, to))| {
            let (first, second) = ((middle - from).abs(), (to - middle).abs());
            first.max(second) > BEND_DEG && first.max(second) > BEND_RATIO * first.min(second)
        })
    }

    fn solve(&self, at: f64, posture: Posture, before: &Joints) -> Option<Joints> {
        let mut joints = solve(&self.path.flange_at(at), posture, before)?;
        joints[5] = nearest_turn(joints[5], before[5]);
        Some(joints)
    }

    fn check(&self, at: f64, joints: &Joints) -> Result<(), PlanError> {
        self.limits.check(joints).map_err(|excess| PlanError::LimitOnPath { at, excess })
    }
}

/// The joints at `fraction` of the way from knot `from` to knot `to`.
pub(super) fn between(path: &LinearPath, from: &Knot, to: &Knot, fraction: f64) -> Joints {
    let mut middle = from.joints;
    for (joint, end) in middle.iter_mut().zip(to.joints) {
        *joint += fraction * (end - *joint);
    }
    let at = from.at + fraction * (to.at - from.at);
    let solved = match from.next {
        Stretch::Follow(posture) => follow(&path.flange_at(at), posture, &middle),
        Stretch::Cross(posture, bridge) => {
            solve_across(&path.flange_at(at), posture, bridge, &middle)
        }
        Stretch::Turn => None,
    };
    match solved {
        Some(mut joints) => {
            joints[5] = nearest_turn(joints[5], middle[5]);
            joints
        }
        None => middle,
    }
}

/// The solution in `posture`, or the one beside `middle` where a singularity makes joint 1 or 4 of
/// it stray: then these are held. Continuous in what the solution strays by.
fn follow(flange: &Pose, posture: Posture, middle: &Joints) -> Option<Joints> {
    let joints = solve(flange, posture, middle)?;
    let strays = |index: usize| (joints[index] - middle[index]).abs() > STRAY_DEG;
    let bridge = Bridge { waist: strays(0), forearm: strays(3) };
    if !(bridge.waist || bridge.forearm) {
        return Some(joints);
    }
    let mut held = *middle;
    for index in [0, 3] {
        let stray = joints[index] - middle[index];
        // As far again beyond the allowance, nothing of it is left.
        let kept = stray.abs().min((2.0 * STRAY_DEG - stray.abs()).max(0.0));
        held[index] += kept * stray.signum();
    }
    solve_across(flange, posture, bridge, &held)
}

fn is_near(a: &Joints, b: &Joints) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= STEP_DEG)
}
