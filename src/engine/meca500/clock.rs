//! The robot's clock as a witness: it goes back when the robot rebooted, and only then for long.
//!
//! ```text
//! steady --odd value--> suspect (inputs not trusted) --again, consistent--> steady (rebooted / jumped)
//!   ^------------------------back on time-------------------|
//! ```
//!
//! A single frame that comes late, or carries a flipped bit, must not look like a reboot, so an odd
//! value has to repeat itself consistently before it counts.

use crate::time::Instant;

/// Tolerated difference between the robot's clock and ours since the last trusted image, in
/// microseconds.
const SLACK_US: u64 = 10_000_000;

/// How far back the clock of a late image may be, in microseconds.
const LATE_US: u64 = 1_000_000;

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RobotClock {
    trusted: Option<(u64, Instant)>,
    candidate_us: u64,
    suspicions: u8,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ClockVerdict {
    /// As it should be.
    Steady,
    /// Odd, once: do not trust this image. `far_back` is what a reboot looks like; a late image is
    /// only a little back.
    Suspect { far_back: bool },
    /// It went back for good.
    WentBack,
}

fn on_time(clock_us: u64, from_us: u64, slack_us: u64) -> bool {
    clock_us >= from_us && clock_us.saturating_sub(from_us) <= slack_us
}

impl RobotClock {
    #[inline]
    pub(super) fn see(&mut self, clock_us: u64, now: Instant, confirm: u8) -> ClockVerdict {
        let Some((last_us, at)) = self.trusted else {
            self.trusted = Some((clock_us, now));
            return ClockVerdict::Steady;
        };
        // Plain numbers: this runs in every cycle, and a `Duration` counts microseconds in 128 bits.
        let slack_us = now.as_nanos().saturating_sub(at.as_nanos()) / 1000 + SLACK_US;
        if on_time(clock_us, last_us, slack_us) {
            self.trusted = Some((clock_us, now));
            self.suspicions = 0;
            return ClockVerdict::Steady;
        }
        self.suspect(clock_us, last_us, slack_us, now, confirm)
    }

    fn suspect(
        &mut self,
        clock_us: u64,
        last_us: u64,
        slack_us: u64,
        now: Instant,
        confirm: u8,
    ) -> ClockVerdict {
        let consistent = self.suspicions > 0 && on_time(clock_us, self.candidate_us, slack_us);
        self.suspicions = if consistent { self.suspicions.saturating_add(1) } else { 1 };
        self.candidate_us = clock_us;
        if self.suspicions < confirm.max(1) {
            let far_back = clock_us.saturating_add(LATE_US) < last_us;
            return ClockVerdict::Suspect { far_back };
        }
        self.suspicions = 0;
        self.trusted = Some((clock_us, now));
        if clock_us < last_us { ClockVerdict::WentBack } else { ClockVerdict::Steady }
    }

    /// Something to start numbers from that differs between two runs.
    pub(super) fn seed(&self) -> u16 {
        let us = self.trusted.map_or(0, |(us, _)| us);
        let mixed = (us ^ (us >> 17)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        (mixed >> 48) as u16
    }
}
