//! Frames from the target: which are taken, what they say about the inputs, and when they are missed.
//!
//! Any sequence number is taken as the first. Then a frame must be numbered later than the one before, across
//! the wrap; others came twice or late and are dropped. Two kinds of earlier numbers are taken all the same,
//! because a target that counts anew would otherwise be shut out:
//!
//! * a number far away in either direction (65536 and more): no network delivers frames that late;
//! * a number that follows one dropped before, once nothing later has come for half of the timeout.
//!
//! Dropped frames do not feed the watchdog. A frame with an unchanged data sequence count does, but carries
//! nothing new. Source: CIP volume 1, chapter 3; how a restart is told from a late frame: choice.

use super::{MAX_IMAGE_LEN, TargetCounters};
use crate::cycle::InputQuality;
use crate::time::{Duration, Instant};
use crate::wire::enip::io::{IoFrame, is_later};
use crate::wire::enip::parameters::TimeoutMultiplier;

/// How long the first frame may take at least: longer than running frames, since the target may have to start
/// its producer and switches may have to learn the group.
///
/// Source: CIP volume 1, chapter 3.
pub(super) const FIRST_FRAME_LIMIT: Duration = Duration::from_secs(10);
/// Numbers this far apart do not belong to the same count.
const FAR: u32 = 1 << 16;

/// Inputs of a target and when they came.
#[derive(Debug)]
pub(super) struct Consumer {
    /// What came last, and what the caller's cycle sees of it.
    newest: [u8; MAX_IMAGE_LEN],
    seen: [u8; MAX_IMAGE_LEN],
    len: usize,
    has_news: bool,
    /// Cycles since the inputs were new; `None` without any of this connection.
    age_cycles: Option<u32>,
    watch: Option<Watch>,
}

/// What is known about an open connection's frames.
#[derive(Clone, Copy, Debug)]
struct Watch {
    timeout: Duration,
    fed: Instant,
    /// Encapsulation sequence number and data sequence count of the last frame taken.
    last: Option<(u32, u16)>,
    /// The last frame dropped since then for its number.
    dropped: Option<u32>,
    /// Length of frames since then that had the wrong one.
    wrong_len: Option<u16>,
    control: Control,
}

/// What the frames say about who controls the target.
#[derive(Clone, Copy, Debug)]
enum Control {
    /// Nothing that matters.
    Unwatched,
    /// They have this bit; it has not been 0 yet.
    Awaited { bit: u16 },
    /// The connection controls the target.
    Held { bit: u16 },
    /// It did, and only monitors since then.
    Lost { bit: u16, since: Instant },
}

impl Control {
    /// What an image says, which came now.
    fn after(self, now: Instant, image: &[u8]) -> Self {
        let (Self::Awaited { bit } | Self::Held { bit } | Self::Lost { bit, .. }) = self else {
            return self;
        };
        let byte = image.get(usize::from(bit / 8)).copied().unwrap_or_default();
        let monitors = byte & (1 << (bit % 8)) != 0;
        match self {
            _ if !monitors => Self::Held { bit },
            Self::Held { .. } => Self::Lost { bit, since: now },
            _ => self,
        }
    }
}

impl Watch {
    fn limit(&self) -> Duration {
        match self.last {
            Some(_) => self.timeout,
            None => self.timeout.max(FIRST_FRAME_LIMIT),
        }
    }

    /// When control counts as lost.
    fn control_lost_at(&self) -> Option<Instant> {
        match self.control {
            Control::Lost { since, .. } => Some(since + self.timeout),
            _ => None,
        }
    }
}

/// What a frame brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Arrival {
    /// The first of its connection.
    First,
    /// One of many, or none to be taken.
    Other,
}

/// Why no frame is taken any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Silence {
    /// None came for so long.
    Nothing(Duration),
    /// Those that came had this many bytes.
    WrongLength(u16),
    /// Those that came said for so long that the connection does not control the target any more.
    ControlLost(Duration),
}

/// API times multiplier: at most 2^32 us times 512, far below the range of a duration.
fn timeout(api: Duration, multiplier: TimeoutMultiplier) -> Duration {
    api.saturating_mul(multiplier.factor())
}

impl Consumer {
    pub(super) fn new(len: u16) -> Self {
        Self {
            newest: [0; MAX_IMAGE_LEN],
            seen: [0; MAX_IMAGE_LEN],
            len: usize::from(len).min(MAX_IMAGE_LEN),
            has_news: false,
            age_cycles: None,
            watch: None,
        }
    }

    /// A connection is open. `monitoring_bit` is the one by which its frames tell that it lost control.
    pub(super) fn start(
        &mut self,
        now: Instant,
        api: Duration,
        multiplier: TimeoutMultiplier,
        monitoring_bit: Option<u16>,
    ) {
        self.watch = Some(Watch {
            timeout: timeout(api, multiplier),
            fed: now,
            last: None,
            dropped: None,
            wrong_len: None,
            control: monitoring_bit.map_or(Control::Unwatched, |bit| Control::Awaited { bit }),
        });
        self.has_news = false;
        self.age_cycles = None;
    }

    /// It is over.
    pub(super) const fn stop(&mut self) {
        self.watch = None;
        self.has_news = false;
        self.age_cycles = None;
    }

    /// When the watchdog expires.
    pub(super) fn deadline(&self) -> Option<Instant> {
        let watch = self.watch?;
        let silence = watch.fed + watch.limit();
        Some(watch.control_lost_at().map_or(silence, |lost| lost.min(silence)))
    }

    /// Whether the watchdog has expired, and why.
    pub(super) fn silence(&self, now: Instant) -> Option<Silence> {
        let watch = self.watch?;
        if now >= watch.fed + watch.limit() {
            return Some(
                watch.wrong_len.map_or(Silence::Nothing(watch.limit()), Silence::WrongLength),
            );
        }
        let is_lost = watch.control_lost_at().is_some_and(|lost| now >= lost);
        is_lost.then_some(Silence::ControlLost(watch.timeout))
    }

    /// A frame of this connection arrived.
    pub(super) fn take(
        &mut self,
        now: Instant,
        frame: &IoFrame<'_>,
        counters: &mut TargetCounters,
    ) -> Arrival {
        let Some(watch) = &mut self.watch else { return Arrival::Other };
        if frame.data.len() != self.len {
            watch.wrong_len = Some(u16::try_from(frame.data.len()).unwrap_or(u16::MAX));
            return Arrival::Other;
        }
        let mut has_news = true;
        if let Some((last, last_count)) = watch.last {
            let (ahead, behind) =
                (frame.sequence.wrapping_sub(last), last.wrapping_sub(frame.sequence));
            let is_far = ahead >= FAR && behind >= FAR;
            if !is_far && is_later(frame.sequence, last) {
                counters.missed =
                    counters.missed.saturating_add(u64::from(ahead.saturating_sub(1)));
                has_news = frame.data_sequence != last_count;
            } else if !is_far {
                let follows = watch.dropped.is_some_and(|one| is_later(frame.sequence, one));
                let counts_anew = follows && now - watch.fed >= watch.timeout / 2;
                if !counts_anew {
                    counters.out_of_order = counters.out_of_order.saturating_add(1);
                    watch.dropped = Some(frame.sequence);
                    return Arrival::Other;
                }
            }
        }
        let arrival = if watch.last.is_none() { Arrival::First } else { Arrival::Other };
        watch.last = Some((frame.sequence, frame.data_sequence));
        watch.fed = now;
        (watch.dropped, watch.wrong_len) = (None, None);
        watch.control = watch.control.after(now, frame.data);
        counters.consumed = counters.consumed.saturating_add(1);
        if !has_news {
            counters.repeated = counters.repeated.saturating_add(1);
        } else if let Some(newest) = self.newest.get_mut(..self.len) {
            newest.copy_from_slice(frame.data);
            self.has_news = true;
        }
        arrival
    }

    /// A cycle of the caller begins: it sees what has come until now, and the same until the next one.
    pub(super) fn begin_cycle(&mut self) {
        if self.has_news {
            if let (Some(seen), Some(newest)) =
                (self.seen.get_mut(..self.len), self.newest.get(..self.len))
            {
                seen.copy_from_slice(newest);
            }
            self.has_news = false;
            self.age_cycles = Some(0);
        } else {
            self.age_cycles = self.age_cycles.map(|age| age.saturating_add(1));
        }
    }

    /// The inputs of this cycle.
    pub(super) fn read(&self, inputs: &mut [u8]) -> InputQuality {
        let (Some(age_cycles), Some(seen)) = (self.age_cycles, self.seen.get(..self.len)) else {
            return InputQuality::Lost;
        };
        if inputs.len() != seen.len() {
            return InputQuality::Lost;
        }
        inputs.copy_from_slice(seen);
        if age_cycles == 0 { InputQuality::Fresh } else { InputQuality::Stale { age_cycles } }
    }
}
