//! Motion of the arm: planning moves and following them in time.
//!
//! Read first: [`Plan`], [`Follower`], [`PathClock`]; for velocity mode [`VelocityMove`].
//!
//! ```text
//!  plan_joint_move --+
//!  plan_pose_move  --+--> Plan --start--> Follower --advance(ClockStep)--> JointState
//!  plan_linear_move -+       \--follow_with (blending)--^         ^
//!                                                        PathClock (pause, time scaling)
//! ```
//!
//! Invariants:
//! * planning allocates, following does not; neither panics on any input;
//! * a plan is checked whole before it starts: reach, limits, singularities;
//! * no joint goes faster than the limit given with the plan, at any sample;
//! * pausing and time scaling change when a point of the path is reached, never the path.
//!
//! The real robot's absolute accelerations and its blending law are not public. What stands in for
//! them is named here and in [`Follower`], and everything is a setting of the plan.

mod clock;
mod follower;
mod joint_move;
mod limits;
mod linear_move;
mod linear_path;
mod linear_track;
mod profile;
mod target;
mod velocity_move;

use alloc::boxed::Box;

use thiserror::Error;

pub use clock::{ClockStep, FULL_RATE_CHANGE_S, PathClock};
pub use follower::{Follower, Handover, Progress};
pub use joint_move::{JointPlan, JointSettings, plan_joint_move};
pub use limits::{JointLimits, LimitExcess, velocity_limits};
pub use linear_move::{LinearPlan, LinearSettings, plan_linear_move};
pub use profile::{Phase, Trapezoid};
pub use target::{TargetSettings, choose_target, plan_pose_move};
pub use velocity_move::{
    CartesianDemand, Halt, TwistFrame, VelocityDemand, VelocityMove, VelocitySettings,
};

use super::kinematics::Joints;

/// Top rated joint velocities, in deg/s: 100 % on both revisions. Source: PM L2671.
pub const RATED_VELOCITY: Joints = [150.0, 150.0, 180.0, 300.0, 300.0, 500.0];
/// Most that percentages above 100 reach on an R3, in deg/s: they are not accepted there.
pub const TOP_VELOCITY_R3: Joints = RATED_VELOCITY;
/// Most that percentages above 100 reach on an R4, in deg/s. Source: PM L2671.
pub const TOP_VELOCITY_R4: Joints = [225.0, 225.0, 225.0, 350.0, 350.0, 500.0];

/// Joint accelerations at `SetJointAcc(100)`, in deg/s²: rated velocity in a tenth of a second.
/// Chosen: the manual gives none.
pub const FULL_JOINT_ACCELERATION: Joints = [1500.0, 1500.0, 1800.0, 3000.0, 3000.0, 5000.0];
/// Linear acceleration of the tool at `SetCartAcc(100)`, in mm/s². Chosen: the manual gives none.
pub const FULL_LINEAR_ACCELERATION: f64 = 2000.0;
/// Angular acceleration of the tool at `SetCartAcc(100)`, in deg/s². Chosen: the manual gives none.
pub const FULL_ANGULAR_ACCELERATION: f64 = 1000.0;

/// Why a move is refused before it starts.
///
/// Codes 1010 and 1012: the manual's Table 1 prints each one's message text beside the other one's
/// explanation. The explanations are followed here (1010 half a turn, 1012 singularity): they agree
/// with the order of the chapters and with the names the vendor's software gives the codes.
/// Source: PM L503-526.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum PlanError {
    /// A joint is outside its limits at the start or at the target of a joint-space move: 1007.
    #[error("{0}")]
    JointOverLimit(LimitExcess),
    /// No allowed posture reaches the target: 1016, "Destination pose out of reach".
    #[error("the target is out of reach in every allowed configuration")]
    OutOfReach,
    /// A pose along the line is out of reach: 1016, "pose out of reach along the path".
    #[error("the pose at {:.1} % of the line is out of reach", .at * 100.0)]
    OutOfReachOnPath {
        /// Where on the line, 0 to 1.
        at: f64,
    },
    /// A joint would leave its limits, or joint 6 the desired turn, along the line. The manual names
    /// no code; 1016 with the text for the path fits best.
    #[error("at {:.1} % of the line: {excess}", .at * 100.0)]
    LimitOnPath {
        /// Where on the line, 0 to 1.
        at: f64,
        /// The joint and its limits.
        excess: LimitExcess,
    },
    /// The line meets a singularity that cannot be crossed, or passes too near one: 1012.
    #[error("the line meets a singularity at {:.1} % that cannot be crossed", .at * 100.0)]
    Singularity {
        /// Where on the line, 0 to 1.
        at: f64,
    },
    /// The tool would have to turn by exactly half a turn, with two ways to do so: 1010.
    #[error("the tool would turn by exactly 180 degrees")]
    HalfTurn,
    /// The start is not in the desired posture or turn: 1033.
    #[error("the start is not in the desired configuration")]
    StartMismatch,
    /// A number is not finite, or a velocity or acceleration is not positive.
    #[error("a number of the move is not finite or not positive")]
    BadNumber,
}

/// What sets the pace of a position-mode move: `SetMoveMode`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// As fast as the velocity settings let it.
    Velocity,
    /// The part between acceleration and deceleration takes this long, in s.
    ///
    /// Source: PM L2687. Reading: the phase of constant velocity lasts exactly so long.
    Duration(f64),
}

/// Where the arm is and how it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointState {
    /// Degrees.
    pub position: Joints,
    /// deg/s, mean over the last step of real time.
    pub velocity: Joints,
    /// deg/s², change of velocity over the last step of real time.
    pub acceleration: Joints,
}

impl JointState {
    /// At rest at `position`.
    #[must_use]
    pub const fn at_rest(position: Joints) -> Self {
        Self { position, velocity: [0.0; 6], acceleration: [0.0; 6] }
    }

    /// The state after moving to `position` in `seconds` of real time.
    #[must_use]
    pub fn moved_to(&self, position: Joints, seconds: f64) -> Self {
        if seconds.is_nan() || seconds <= 0.0 {
            return Self { position, ..*self };
        }
        let rate = |from: &Joints, to: &Joints| {
            let mut rate = [0.0; 6];
            for (rate, (from, to)) in rate.iter_mut().zip(from.iter().zip(to)) {
                *rate = (to - from) / seconds;
            }
            rate
        };
        let velocity = rate(&self.position, &position);
        Self { position, velocity, acceleration: rate(&self.velocity, &velocity) }
    }
}

/// Joint-space moves blend with one another, and lines with one another, never across.
///
/// Source: PM L371, L2341.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// `MoveJoints`, `MoveJointsRel`, `MovePose`.
    Joint,
    /// `MoveLin`, `MoveLinRelTrf`, `MoveLinRelWrf`.
    Cartesian,
}

/// A move that was checked whole and can be sampled at any time.
#[derive(Clone, Debug)]
pub enum Plan {
    /// A straight line in joint space.
    Joint(JointPlan),
    /// A straight line of the tool.
    Linear(Box<LinearPlan>),
}

impl From<JointPlan> for Plan {
    fn from(plan: JointPlan) -> Self {
        Self::Joint(plan)
    }
}

impl From<LinearPlan> for Plan {
    fn from(plan: LinearPlan) -> Self {
        Self::Linear(Box::new(plan))
    }
}

impl Plan {
    /// From start to stop at full pace, in s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        match self {
            Self::Joint(plan) => plan.profile().duration_s(),
            Self::Linear(plan) => plan.duration_s(),
        }
    }

    /// From the start to full speed, in s.
    #[must_use]
    pub fn acceleration_s(&self) -> f64 {
        match self {
            Self::Joint(plan) => plan.profile().ramp_s(),
            Self::Linear(plan) => plan.acceleration_s(),
        }
    }

    /// From full speed to the stop, in s.
    #[must_use]
    pub fn deceleration_s(&self) -> f64 {
        match self {
            Self::Joint(plan) => plan.profile().ramp_s(),
            Self::Linear(plan) => plan.deceleration_s(),
        }
    }

    /// The shortest duration possible, in s, when the one asked for by [`Pace::Duration`] cannot be
    /// met: error 3051, a warning or nothing, as `SetMoveDurationCfg` says. The plan is then as fast
    /// as possible. Source: PM L2697, L2717-2730.
    #[must_use]
    pub fn shortest_duration_s(&self) -> Option<f64> {
        match self {
            Self::Joint(plan) => plan.shortest_duration_s(),
            Self::Linear(plan) => plan.shortest_duration_s(),
        }
    }

    /// The joints at the start.
    #[must_use]
    pub fn start(&self) -> Joints {
        match self {
            Self::Joint(plan) => plan.start(),
            Self::Linear(plan) => plan.start(),
        }
    }

    /// The joints at the end.
    #[must_use]
    pub fn end(&self) -> Joints {
        match self {
            Self::Joint(plan) => plan.end(),
            Self::Linear(plan) => plan.end(),
        }
    }

    /// The joints `seconds` after the start; the start before, the end after.
    #[must_use]
    pub fn sample(&self, seconds: f64) -> Joints {
        match self {
            Self::Joint(plan) => plan.sample(seconds),
            Self::Linear(plan) => plan.sample(seconds),
        }
    }

    /// The space in which the move is straight.
    #[must_use]
    pub const fn space(&self) -> Space {
        match self {
            Self::Joint(_) => Space::Joint,
            Self::Linear(_) => Space::Cartesian,
        }
    }
}

/// Whether every one of `values` is finite and over zero.
fn all_positive(values: &[f64]) -> bool {
    values.iter().all(|value| value.is_finite() && *value > 0.0)
}
