//! The system's monotonic clock, as [`Instant`]s of this crate.
//!
//! Invariants: time never goes back; the origin is the moment the clock was made, so instants of
//! two clocks are not comparable.

use std::thread;
use std::time::Instant as SystemInstant;

use crate::time::{Duration, Instant};

/// A monotonic clock that starts at [`Instant::ZERO`] when it is made.
#[derive(Clone, Copy, Debug)]
pub struct MonotonicClock {
    origin: SystemInstant,
}

impl MonotonicClock {
    /// A clock whose origin is now.
    #[must_use]
    pub fn new() -> Self {
        Self { origin: SystemInstant::now() }
    }

    /// Time since the clock was made.
    #[must_use]
    pub fn now(&self) -> Instant {
        Instant::ZERO + self.origin.elapsed()
    }

    /// Sleeps until `deadline`, and returns the time of waking up.
    ///
    /// A deadline in the past returns at once. The operating system wakes the caller at or after
    /// the deadline, never before; how much after is its own business and shows in the return value.
    pub fn sleep_until(&self, deadline: Instant) -> Instant {
        loop {
            let now = self.now();
            let remaining = deadline.saturating_duration_since(now);
            if remaining == Duration::ZERO {
                return now;
            }
            thread::sleep(remaining);
        }
    }
}

/// Asks the system to wake the calling thread as exactly as it can, whatever it waits for.
///
/// Linux lets a thread sleep up to 50 us longer than it asked for, by chance, to wake several at once. For who
/// sends at deadlines that is jitter. Elsewhere, and where the system refuses, nothing changes; in a thread with
/// real-time priority there is no such slack anyway.
pub fn wake_exactly() {
    #[cfg(all(target_os = "linux", any(feature = "enip", feature = "ethercat", feature = "text")))]
    let _ = rustix::thread::set_current_timer_slack(core::num::NonZeroU64::new(1));
}

impl Default for MonotonicClock {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waking_up_never_comes_before_the_deadline() {
        let clock = MonotonicClock::new();
        let deadline = clock.now() + Duration::from_millis(2);
        let woken = clock.sleep_until(deadline);
        assert!(woken >= deadline);
        assert!(clock.now() >= woken);
    }

    #[test]
    fn a_deadline_in_the_past_does_not_sleep() {
        let clock = MonotonicClock::new();
        let before = clock.now();
        assert!(clock.sleep_until(Instant::ZERO) >= before);
    }

    #[cfg(all(target_os = "linux", feature = "enip"))]
    #[test]
    fn a_thread_can_give_up_its_slack() {
        let slack = thread::spawn(|| {
            wake_exactly();
            rustix::thread::current_timer_slack()
        });
        assert_eq!(slack.join().unwrap().unwrap(), 1);
    }
}
