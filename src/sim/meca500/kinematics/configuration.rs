//! Posture configuration: shoulder, elbow, wrist, and the turn of joint 6.
//!
//! A [`Configuration`] is what the robot reports and may hold zeros near a singularity; a
//! [`Posture`] is what a program asks for and never does.

use super::inverse::{elbow_angle, shoulder_radius};
use super::{Joints, MODEL_MAX};

/// Distance of joint 3 or joint 5 from its singularity, in degrees, under which 0 is reported.
/// The manual says "near" only. Unverified: the figure.
pub const NEAR_SINGULAR_DEG: f64 = 0.01;
/// Distance of the wrist centre from the axis of joint 1, in mm, under which 0 is reported.
/// Unverified: the figure.
pub const NEAR_SINGULAR_MM: f64 = 0.01;

/// One of the two sides of a singularity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Side {
    /// -1: back, elbow down, flip.
    Negative,
    /// 1: front, elbow up, no flip.
    Positive,
}

impl Side {
    /// Both sides.
    pub const BOTH: [Self; 2] = [Self::Positive, Self::Negative];

    /// The side with the sign of `value`; zero counts as positive.
    #[must_use]
    pub fn of(value: f64) -> Self {
        if value < 0.0 { Self::Negative } else { Self::Positive }
    }

    /// 1 or -1.
    #[must_use]
    pub const fn sign(self) -> f64 {
        match self {
            Self::Negative => -1.0,
            Self::Positive => 1.0,
        }
    }

    /// 1 or -1 as the robot reports it.
    #[must_use]
    pub const fn number(self) -> i8 {
        match self {
            Self::Negative => -1,
            Self::Positive => 1,
        }
    }

    /// The side of a number of the protocol: 1 or -1.
    #[must_use]
    pub const fn from_number(number: i8) -> Option<Self> {
        match number {
            -1 => Some(Self::Negative),
            1 => Some(Self::Positive),
            _ => None,
        }
    }
}

/// The posture that a program asks for: `SetConf`.
///
/// Source: PM L198-211.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Posture {
    /// c_s: wrist centre in front of the axis of joint 1 or behind it.
    pub shoulder: Side,
    /// c_e: joint 3 over or under -atan(60/19) degrees.
    pub elbow: Side,
    /// c_w: joint 5 positive or negative.
    pub wrist: Side,
}

impl Posture {
    /// The posture of `joints`; at a singularity the positive side of it.
    ///
    /// This is what `SetAutoConf(0)` makes the desired posture: {0,0,0,0,0,0} gives 1, 1, 1.
    /// Source: PM L2297.
    #[must_use]
    pub fn of(joints: &Joints) -> Self {
        let configuration = Configuration::of(joints);
        let side = |number: i8| if number < 0 { Side::Negative } else { Side::Positive };
        Self {
            shoulder: side(configuration.shoulder),
            elbow: side(configuration.elbow),
            wrist: side(configuration.wrist),
        }
    }

    /// The posture whose inverse kinematics gives `joints` back, however near a singularity they are;
    /// exactly at one, the positive side of it.
    #[must_use]
    pub(in crate::sim::meca500) fn exactly_of(joints: &Joints) -> Self {
        Self {
            shoulder: Side::of(shoulder_radius(joints)),
            elbow: Side::of(elbow_angle(joints)),
            wrist: Side::of(joints[4]),
        }
    }

    /// The posture with the protocol's numbers, each 1 or -1.
    #[must_use]
    pub const fn from_numbers([shoulder, elbow, wrist]: [i8; 3]) -> Option<Self> {
        match (Side::from_number(shoulder), Side::from_number(elbow), Side::from_number(wrist)) {
            (Some(shoulder), Some(elbow), Some(wrist)) => Some(Self { shoulder, elbow, wrist }),
            _ => None,
        }
    }

    /// c_s, c_e, c_w.
    #[must_use]
    pub const fn numbers(self) -> [i8; 3] {
        [self.shoulder.number(), self.elbow.number(), self.wrist.number()]
    }

    /// All eight, (1,1,1) first.
    pub fn all() -> impl Iterator<Item = Self> {
        Side::BOTH.into_iter().flat_map(|shoulder| {
            Side::BOTH.into_iter().flat_map(move |elbow| {
                Side::BOTH.into_iter().map(move |wrist| Self { shoulder, elbow, wrist })
            })
        })
    }
}

/// The configuration that the robot reports: 1, -1, or 0 near the singularity.
///
/// Source: PM L1486-1488.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Configuration {
    /// c_s, 0 near the shoulder singularity.
    pub shoulder: i8,
    /// c_e, 0 near the elbow singularity.
    pub elbow: i8,
    /// c_w, 0 near the wrist singularity.
    pub wrist: i8,
}

impl Configuration {
    /// The configuration of `joints`.
    #[must_use]
    pub fn of(joints: &Joints) -> Self {
        let side = |value: f64, near: f64| {
            if value.abs() < near { 0 } else { Side::of(value).number() }
        };
        Self {
            shoulder: side(shoulder_radius(joints), NEAR_SINGULAR_MM),
            elbow: side(elbow_angle(joints).to_degrees(), NEAR_SINGULAR_DEG),
            wrist: side(joints[4], NEAR_SINGULAR_DEG),
        }
    }

    /// Whether a robot so configured counts as being in `posture`: a singularity belongs to both
    /// its sides.
    #[must_use]
    pub fn allows(self, posture: Posture) -> bool {
        [self.shoulder, self.elbow, self.wrist]
            .into_iter()
            .zip(posture.numbers())
            .all(|(reported, desired)| reported == 0 || reported == desired)
    }
}

/// The turn c_t of joint 6: -180 + 360 c_t < `joint_6` <= 180 + 360 c_t.
///
/// Source: PM L178.
#[must_use]
pub fn turn_of(joint_6: f64) -> i32 {
    let most = MODEL_MAX[5] / 360.0;
    let turn = libm::ceil((joint_6 - 180.0) / 360.0).clamp(-most, most);
    // Within ±100 after the clamp; a NaN becomes 0.
    turn as i32
}

/// The positions of joint 6 with turn `turn`, in degrees: lower end (excluded), upper end.
#[must_use]
pub fn turn_range(turn: i32) -> (f64, f64) {
    let middle = 360.0 * f64::from(turn);
    (middle - 180.0, middle + 180.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_joints_are_at_the_wrist_singularity_and_settle_to_the_positive_side() {
        let zero = Configuration::of(&[0.0; 6]);
        assert_eq!((zero.shoulder, zero.elbow, zero.wrist), (1, 1, 0));
        assert_eq!(Posture::of(&[0.0; 6]).numbers(), [1, 1, 1]);
    }

    #[test]
    fn each_number_turns_at_its_singularity() {
        let elbow = -libm::atan(60.0 / 19.0).to_degrees();
        for (offset, expected) in [(-0.1, -1), (0.0, 0), (0.1, 1)] {
            let joints = [0.0, 20.0, elbow + offset, 0.0, 30.0, 0.0];
            assert_eq!(Configuration::of(&joints).elbow, expected);
            assert_eq!(Configuration::of(&[0.0, 0.0, 0.0, 0.0, offset, 0.0]).wrist, expected);
        }
        // With the forearm upright the wrist centre is 38 mm behind the upper arm's end.
        let over = libm::asin(38.0 / 135.0).to_degrees();
        for (offset, expected) in [(-0.1, -1), (0.0, 0), (0.1, 1)] {
            let lean = over + offset;
            let joints = [0.0, lean, -90.0 - lean, 0.0, 30.0, 0.0];
            assert_eq!(Configuration::of(&joints).shoulder, expected);
        }
    }

    #[test]
    fn turn_changes_just_after_half_a_revolution() {
        for (joint_6, turn) in [
            (0.0, 0),
            (180.0, 0),
            (180.001, 1),
            (540.0, 1),
            (-179.999, 0),
            (-180.0, -1),
            (36_000.0, 100),
            (-36_000.0, -100),
        ] {
            assert_eq!(turn_of(joint_6), turn, "{joint_6}");
            if joint_6.abs() < 1_000.0 {
                let (low, high) = turn_range(turn);
                assert!(low < joint_6 && joint_6 <= high);
            }
        }
    }

    #[test]
    fn a_singularity_belongs_to_both_sides() {
        let zero = Configuration::of(&[0.0; 6]);
        assert!(Posture::from_numbers([1, 1, -1]).is_some_and(|posture| zero.allows(posture)));
        assert!(Posture::from_numbers([-1, 1, 1]).is_some_and(|posture| !zero.allows(posture)));
        assert_eq!(Posture::from_numbers([0, 1, 1]), None);
    }
}
