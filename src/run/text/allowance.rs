//! How many commands may be sent: a robot that gets more than 250 a second for long may drop its
//! connections. Source: PM L465.

use crate::time::{Duration, Instant};

/// Commands a second that are sent for long.
///
/// Source: choice. It leaves room for those of others on the same robot.
pub(super) const PER_SECOND: u32 = 200;
/// Commands that may be sent at once after a pause.
const AT_ONCE: u32 = 100;

/// Commands that may still be sent now; grows with time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Allowance {
    /// Unspent time: a command costs a 200th of a second.
    saved: Duration,
    at: Instant,
}

/// What one command costs.
const PRICE: Duration = Duration::from_nanos(1_000_000_000 / PER_SECOND as u64);

impl Allowance {
    pub(super) const fn new() -> Self {
        Self { saved: PRICE.saturating_mul(AT_ONCE), at: Instant::ZERO }
    }

    /// Lets time pass.
    pub(super) fn advance(&mut self, now: Instant) {
        let most = PRICE.saturating_mul(AT_ONCE);
        self.saved = self.saved.saturating_add(now - self.at).min(most);
        self.at = self.at.max(now);
    }

    /// Whether `commands` may be sent now.
    pub(super) const fn allows(&self, commands: u32) -> bool {
        self.saved.as_nanos() >= PRICE.saturating_mul(commands).as_nanos()
    }

    /// A command is sent, allowed or not: what cannot wait is owed.
    pub(super) const fn spend(&mut self) {
        self.saved = self.saved.saturating_sub(PRICE);
    }

    /// When `commands` may be sent.
    pub(super) fn due(&self, commands: u32) -> Instant {
        self.at + PRICE.saturating_mul(commands).saturating_sub(self.saved)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_row_of_commands_keeps_to_the_rate() {
        let mut allowance = Allowance::new();
        let (mut sent, mut now) = (0, Instant::ZERO);
        while now < Instant::from_millis(10_000) {
            allowance.advance(now);
            while allowance.allows(2) {
                allowance.spend();
                allowance.spend();
                sent += 2;
            }
            let due = allowance.due(2);
            assert!(due > now, "it waits for something");
            now = due;
        }
        let most = AT_ONCE + 10 * PER_SECOND;
        assert!((most - 4..=most).contains(&sent), "{sent}");
    }
}
