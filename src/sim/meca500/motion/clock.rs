//! The clock of the path: pause, resume and time scaling without leaving the path.
//!
//! ```text
//! pause() ---> rate falls to 0 ---> resume() ---> rate rises to the scaling
//! ```
//!
//! Invariant: the rate changes by no more than [`FULL_RATE_CHANGE_S`] allows, so a pause slows the
//! arm down along its path instead of stopping it dead.

/// Time in which the rate falls from 1 to 0 or rises back, in s. Chosen: the manual gives none.
pub const FULL_RATE_CHANGE_S: f64 = 0.05;

/// One step of real time and the path time that passed in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockStep {
    /// Real time, in s.
    pub real_s: f64,
    /// Path time, in s; never more than `real_s`.
    pub path_s: f64,
}

impl ClockStep {
    /// A step in which path time runs as fast as real time.
    #[must_use]
    pub const fn full(seconds: f64) -> Self {
        Self { real_s: seconds, path_s: seconds }
    }
}

/// Turns real time into path time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathClock {
    rate: f64,
    scaling: f64,
    paused: bool,
}

impl Default for PathClock {
    fn default() -> Self {
        Self { rate: 1.0, scaling: 1.0, paused: false }
    }
}

impl PathClock {
    /// Path time per real time, 0 to 1.
    #[must_use]
    pub const fn rate(&self) -> f64 {
        self.rate
    }

    /// `SetTimeScaling`, as a fraction; kept between 0 and 1. Source: PM L3970-3992.
    pub const fn set_time_scaling(&mut self, scaling: f64) {
        if scaling.is_finite() {
            self.scaling = scaling.clamp(0.0, 1.0);
        }
    }

    /// Slows down to a stop along the path.
    pub const fn pause(&mut self) {
        self.paused = true;
    }

    /// Speeds up again along the path.
    pub const fn resume(&mut self) {
        self.paused = false;
    }

    /// Whether the clock stands still because of a pause.
    #[must_use]
    pub const fn is_stopped(&self) -> bool {
        self.paused && self.rate <= 0.0
    }

    /// Stops or starts at once: for an arm at rest, where nothing has to slow down.
    pub const fn settle(&mut self) {
        self.rate = self.wanted();
    }

    /// Lets `seconds` of real time pass.
    pub fn advance(&mut self, seconds: f64) -> ClockStep {
        if !(seconds > 0.0 && seconds.is_finite()) {
            return ClockStep { real_s: 0.0, path_s: 0.0 };
        }
        let before = self.rate;
        let change = self.wanted() - before;
        let needed_s = change.abs() * FULL_RATE_CHANGE_S;
        let path_s = if needed_s >= seconds {
            self.rate = before + seconds / FULL_RATE_CHANGE_S * change.signum();
            0.5 * (before + self.rate) * seconds
        } else {
            self.rate = self.wanted();
            0.5 * (before + self.rate) * needed_s + self.rate * (seconds - needed_s)
        };
        ClockStep { real_s: seconds, path_s }
    }

    const fn wanted(&self) -> f64 {
        if self.paused { 0.0 } else { self.scaling }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pause_takes_its_ramp_and_no_longer() {
        let mut clock = PathClock::default();
        clock.pause();
        let path: f64 = (0..50).map(|_| clock.advance(0.001).path_s).sum();
        assert!(clock.rate().abs() < 1e-12);
        assert!((path - 0.025).abs() < 1e-12);
        clock.advance(0.001);
        assert!(clock.is_stopped());
        assert_eq!(clock.advance(1.0).path_s, 0.0);
        clock.resume();
        assert!((clock.advance(1.05).path_s - 1.025).abs() < 1e-12);
    }

    #[test]
    fn scaling_is_reached_within_one_long_step_or_many_short_ones() {
        let mut long = PathClock::default();
        let mut short = PathClock::default();
        long.set_time_scaling(0.25);
        short.set_time_scaling(0.25);
        let in_one = long.advance(0.1).path_s;
        let in_many: f64 = (0..1000).map(|_| short.advance(0.0001).path_s).sum();
        assert!((in_one - in_many).abs() < 1e-9);
        assert_eq!(long.rate(), 0.25);
        long.set_time_scaling(f64::NAN);
        assert_eq!(long.advance(1.0).path_s, 0.25);
    }

    #[test]
    fn an_arm_at_rest_needs_no_ramp() {
        let mut clock = PathClock::default();
        clock.pause();
        clock.settle();
        assert!(clock.is_stopped());
        assert_eq!(clock.advance(f64::INFINITY).path_s, 0.0);
    }
}
