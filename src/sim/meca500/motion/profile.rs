//! The trapezoid of velocity over time that moves follow.

/// Where a profile is at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Phase {
    /// Distance covered.
    pub position: f64,
    /// Distance per second.
    pub velocity: f64,
}

/// Accelerate, hold, decelerate; without the middle part when the distance is short.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trapezoid {
    distance: f64,
    peak: f64,
    acceleration: f64,
    ramp_s: f64,
    duration_s: f64,
}

impl Trapezoid {
    /// The fastest profile over `distance` (zero or more) within `velocity` and `acceleration`
    /// (both positive).
    #[must_use]
    pub fn new(distance: f64, velocity: f64, acceleration: f64) -> Self {
        let peak = velocity.min(libm::sqrt(distance * acceleration));
        if !(distance > 0.0 && peak > 0.0) {
            return Self { distance: 0.0, peak: 0.0, acceleration, ramp_s: 0.0, duration_s: 0.0 };
        }
        let ramp_s = peak / acceleration;
        Self { distance, peak, acceleration, ramp_s, duration_s: distance / peak + ramp_s }
    }

    /// The velocity at which the middle part over `distance` lasts `duration_s`.
    #[must_use]
    pub fn velocity_for(distance: f64, duration_s: f64, acceleration: f64) -> f64 {
        // The root of v²/a + v t = d, in the form that does not cancel for long durations.
        let four_d_over_a = 4.0 * distance / acceleration;
        let root = libm::sqrt(duration_s * duration_s + four_d_over_a);
        2.0 * distance / (duration_s + root)
    }

    /// From start to stop, in s.
    #[must_use]
    pub const fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Length of the acceleration, and of the deceleration, in s.
    #[must_use]
    pub const fn ramp_s(&self) -> f64 {
        self.ramp_s
    }

    /// Length of the part at constant velocity, in s.
    #[must_use]
    pub fn hold_s(&self) -> f64 {
        (self.duration_s - 2.0 * self.ramp_s).max(0.0)
    }

    /// Distance covered while accelerating.
    #[must_use]
    pub fn ramp_distance(&self) -> f64 {
        0.5 * self.peak * self.ramp_s
    }

    /// Position and velocity `seconds` after the start.
    #[must_use]
    pub fn at(&self, seconds: f64) -> Phase {
        let left_s = self.duration_s - seconds;
        if seconds.is_nan() || seconds <= 0.0 {
            Phase::default()
        } else if left_s <= 0.0 {
            Phase { position: self.distance, velocity: 0.0 }
        } else if seconds < self.ramp_s {
            let velocity = self.acceleration * seconds;
            Phase { position: 0.5 * velocity * seconds, velocity }
        } else if left_s < self.ramp_s {
            let velocity = self.acceleration * left_s;
            Phase { position: self.distance - 0.5 * velocity * left_s, velocity }
        } else {
            let position = self.peak * (seconds - 0.5 * self.ramp_s);
            Phase { position, velocity: self.peak }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_profile_computed_by_hand() {
        // 0.5 s up to 10, 1 s hold, 0.5 s down: 2.5 + 10 + 2.5.
        let profile = Trapezoid::new(15.0, 10.0, 20.0);
        assert_eq!((profile.ramp_s(), profile.hold_s(), profile.duration_s()), (0.5, 1.0, 2.0));
        assert_eq!(profile.at(0.25), Phase { position: 0.625, velocity: 5.0 });
        assert_eq!(profile.at(1.0), Phase { position: 7.5, velocity: 10.0 });
        assert_eq!(profile.at(1.75), Phase { position: 14.375, velocity: 5.0 });
        assert_eq!(profile.at(9.0), Phase { position: 15.0, velocity: 0.0 });
        assert_eq!(Trapezoid::velocity_for(15.0, 1.0, 20.0), 10.0);
    }

    #[test]
    fn no_distance_takes_no_time() {
        assert_eq!(Trapezoid::new(0.0, 1.0, 1.0).duration_s(), 0.0);
        assert_eq!(Trapezoid::new(f64::NAN, 1.0, 1.0).at(1.0), Phase::default());
    }

    proptest! {
        #[test]
        fn stays_within_its_limits_and_arrives(
            distance in 1e-6..1e3f64, velocity in 1e-3..1e3f64, acceleration in 1e-2..1e4f64,
        ) {
            let profile = Trapezoid::new(distance, velocity, acceleration);
            let step = profile.duration_s() / 200.0;
            let mut before = profile.at(0.0);
            for index in 1..=200 {
                let now = profile.at(step * f64::from(index));
                prop_assert!(now.velocity <= velocity * (1.0 + 1e-12));
                prop_assert!((now.velocity - before.velocity).abs() <= acceleration * step * (1.0 + 1e-6));
                // The mean of the velocities is the slope wherever the acceleration is constant.
                prop_assert!(now.position - before.position <= velocity * step * (1.0 + 1e-6));
                prop_assert!(now.position >= before.position);
                before = now;
            }
            prop_assert!((profile.at(profile.duration_s()).position - distance).abs() < 1e-9 * distance);
        }
    }
}
