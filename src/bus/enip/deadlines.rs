//! When the frames of one direction leave: deadlines that lie whole intervals apart.
//!
//! A frame that leaves late does not move those behind it. Who was away for several intervals owes the frames
//! whose deadlines passed, and makes up for them: they follow with the newest data of their moment, at least half
//! an interval apart. So the mean gap is the interval however late single frames are, and a consumer never has to
//! take more than twice the rate it agreed to.
//!
//! Who was away for more than [`MOST_OWED`] intervals lets those frames go. Nothing moves the deadlines from
//! their grid.
//!
//! Source: choice; the standard says at which interval a producer sends, not what follows a delay.

use crate::time::{Duration, Instant};

/// Most frames that are made up for. Of a longer stall, all that it cost are given up.
///
/// Source: choice. Stalls of a busy machine last some 20 ms, and the shortest intervals are 1 to 2 ms; beyond,
/// most consumers' watchdogs have given the connection up.
pub(crate) const MOST_OWED: u32 = 16;

/// Deadlines of one direction of a connection.
#[derive(Clone, Copy, Debug)]
pub(super) struct Deadlines {
    interval: Duration,
    next: Instant,
    /// When the last frame left.
    last: Option<Instant>,
}

impl Deadlines {
    /// The first one is `first`; an `interval` of zero counts as 1 ns.
    pub(super) const fn new(first: Instant, interval: Duration) -> Self {
        let interval = if interval.is_zero() { Duration::from_nanos(1) } else { interval };
        Self { interval, next: first, last: None }
    }

    /// Time between two deadlines.
    pub(super) const fn interval(&self) -> Duration {
        self.interval
    }

    /// The first deadline whose frame has not left.
    pub(super) const fn next(&self) -> Instant {
        self.next
    }

    /// Lays the deadline of the next frame, and with it all behind, on `next`.
    pub(super) const fn lay(&mut self, next: Instant) {
        self.next = next;
    }

    /// When the next frame is to leave: at its deadline, or half an interval behind the frame before.
    pub(super) fn due(&self) -> Instant {
        self.next.max(self.behind_last(self.interval / 2))
    }

    /// The moment that lies so far behind the last frame; the beginning of time before the first.
    pub(super) fn behind_last(&self, distance: Duration) -> Instant {
        self.last.map_or(Instant::ZERO, |last| last + distance)
    }

    /// A frame leaves now, that of the next deadline. Returns how many were given up.
    pub(super) fn pass(&mut self, now: Instant) -> u64 {
        self.last = Some(now);
        self.next += self.interval;
        if self.next > now {
            return 0;
        }
        let interval_ns = u64::try_from(self.interval.as_nanos()).unwrap_or(u64::MAX);
        let behind = now.as_nanos().saturating_sub(self.next.as_nanos()) / interval_ns;
        let owed = behind.saturating_add(1);
        if owed <= u64::from(MOST_OWED) {
            return 0;
        }
        self.next += Duration::from_nanos(owed.saturating_mul(interval_ns));
        owed
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    const INTERVAL: Duration = Duration::from_millis(10);

    fn at(us: u64) -> Instant {
        Instant::from_micros(us)
    }

    /// When frames leave, in us, of a sender that looks at its deadlines at `us`, then whenever one is due, until
    /// `end_us`; and how many were given up.
    fn sent(us: &[u64], end_us: u64) -> (Vec<u64>, u64) {
        let mut deadlines = Deadlines::new(at(0), INTERVAL);
        let (mut sent, mut given_up) = (Vec::new(), 0);
        let mut looks = us.iter().copied();
        for _ in 0..1_000 {
            let due = deadlines.due();
            let now = looks.next().map_or(due, |look| at(look).max(due));
            if now >= at(end_us) {
                return (sent, given_up);
            }
            given_up += deadlines.pass(now);
            sent.push(now.as_nanos() / 1_000);
        }
        panic!("it never ends");
    }

    #[test]
    fn a_stall_is_made_up_for_half_an_interval_apart() {
        let cases: [(&[u64], &[u64]); 5] = [
            (&[0, 14_000], &[0, 14_000, 20_000, 30_000, 40_000]),
            (&[0, 16_000], &[0, 16_000, 21_000, 30_000, 40_000]),
            (&[0, 22_000], &[0, 22_000, 27_000, 32_000, 40_000]),
            (&[0, 35_000], &[0, 35_000, 40_000, 45_000, 50_000, 55_000, 60_000, 70_000]),
            (&[0, 10_000, 20_000], &[0, 10_000, 20_000, 30_000]),
        ];
        for (looks, expected) in cases {
            let end = expected.last().unwrap() + 1;
            assert_eq!(sent(looks, end), (expected.to_vec(), 0), "{looks:?}");
        }
    }

    #[test]
    fn a_stall_longer_than_the_bound_is_given_up_and_the_grid_kept() {
        let bound_us = u64::from(MOST_OWED) * 10_000;
        // The frame due at 10 ms leaves, and as many are owed as are made up for.
        let (times, given_up) = sent(&[0, 10_000 + bound_us + 9_000], 1_000_001);
        assert_eq!((times.len(), given_up), (101, 0), "one each 10 ms of a second, and the first");
        let (times, given_up) = sent(&[0, 20_000 + bound_us + 3_000], 1_000_001);
        assert_eq!((times.len() as u64 + given_up, given_up), (101, u64::from(MOST_OWED) + 1));
        assert_eq!(times[1..4], [183_000, 190_000, 200_000]);
    }

    #[test]
    fn an_interval_of_nothing_is_survived() {
        let mut deadlines = Deadlines::new(at(0), Duration::ZERO);
        assert_eq!(deadlines.pass(at(1_000)), 1_000_000);
        assert!(deadlines.due() > at(1_000));
        let mut deadlines = Deadlines::new(at(0), Duration::MAX);
        assert_eq!(deadlines.pass(at(1_000)), 0);
    }
}
