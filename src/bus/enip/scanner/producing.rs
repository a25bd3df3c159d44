//! Frames to the target, by absolute deadlines.
//!
//! The deadlines are whole intervals from the first frame on, so a frame that leaves late does not move the ones
//! behind it. Of deadlines that pass without a frame, one frame is sent and the others are counted: a target
//! that was starved gains nothing from a burst.

use super::{MAX_IMAGE_LEN, TargetCounters};
use crate::time::{Duration, Instant};
use crate::wire::enip::NoRoom;
use crate::wire::enip::io::IoFrame;

/// Outputs of a target and when they are sent.
#[derive(Debug)]
pub(super) struct Producer {
    image: [u8; MAX_IMAGE_LEN],
    len: usize,
    has_header: bool,
    is_run: bool,
    schedule: Option<Schedule>,
}

/// When the next frame is due.
#[derive(Clone, Copy, Debug)]
struct Schedule {
    connection_id: u32,
    api: Duration,
    deadline: Instant,
    last: Option<Instant>,
    sequence: u32,
    count: u16,
    beat: Beat,
}

/// Whether the deadlines have been laid on the caller's cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Beat {
    /// Not yet.
    Unknown,
    /// A cycle has begun; the next time that is asked for frames is its time.
    Begun,
    /// Yes.
    Settled,
}

impl Schedule {
    /// How much earlier than its deadline a frame may leave.
    fn early(&self, early: Duration) -> Duration {
        early.min(self.api / 2)
    }

    /// Frames keep this distance, so that a late one is not followed at once by an early one.
    fn not_before(&self, early: Duration) -> Instant {
        self.last.map_or(Instant::ZERO, |last| last + self.early(early))
    }

    fn is_due(&self, now: Instant, early: Duration) -> bool {
        now + self.early(early) >= self.deadline && now >= self.not_before(early)
    }

    /// Lays the deadlines on the beat of a caller that has one: opening ends somewhere between two beats, and
    /// frames would stay late by that forever.
    fn align(&mut self, now: Instant, early: Duration) {
        if self.beat == Beat::Begun && !early.is_zero() {
            let is_too_soon = now < self.not_before(early);
            self.deadline = if is_too_soon { now + self.api } else { now };
            self.beat = Beat::Settled;
        }
    }

    /// A frame leaves. Returns the number of deadlines that passed without one.
    fn advance(&mut self, now: Instant) -> u64 {
        self.sequence = self.sequence.wrapping_add(1);
        self.count = self.count.wrapping_add(1);
        self.last = Some(now);
        self.deadline += self.api;
        if self.deadline > now {
            return 0;
        }
        let api_ns = self.api.as_nanos().max(1);
        let missed = u64::try_from((now - self.deadline).as_nanos() / api_ns).unwrap_or(u64::MAX);
        let missed = missed.saturating_add(1);
        let skipped = u64::try_from(api_ns).unwrap_or(u64::MAX).saturating_mul(missed);
        self.deadline += Duration::from_nanos(skipped);
        missed
    }
}

impl Producer {
    pub(super) fn new(len: u16, has_header: bool) -> Self {
        let len = usize::from(len).min(MAX_IMAGE_LEN);
        Self { image: [0; MAX_IMAGE_LEN], len, has_header, is_run: true, schedule: None }
    }

    /// Sets the outputs if their length is right.
    pub(super) fn write(&mut self, outputs: &[u8]) {
        if outputs.len() == self.len
            && let Some(image) = self.image.get_mut(..self.len)
        {
            image.copy_from_slice(outputs);
        }
    }

    pub(super) const fn set_run(&mut self, is_run: bool) {
        self.is_run = is_run;
    }

    /// Begins to produce: the first frame is due now.
    pub(super) const fn start(&mut self, now: Instant, connection_id: u32, api: Duration) {
        let (sequence, count) = (1, 1);
        let (last, beat) = (None, Beat::Unknown);
        let schedule = Schedule { connection_id, api, deadline: now, last, sequence, count, beat };
        self.schedule = Some(schedule);
    }

    pub(super) const fn stop(&mut self) {
        self.schedule = None;
    }

    /// A cycle of the caller begins.
    pub(super) fn begin_cycle(&mut self) {
        if let Some(schedule) = self.schedule.as_mut().filter(|it| it.beat == Beat::Unknown) {
            schedule.beat = Beat::Begun;
        }
    }

    /// When a frame must leave.
    pub(super) fn wake(&self, early: Duration) -> Option<Instant> {
        self.schedule.map(|schedule| schedule.deadline.max(schedule.not_before(early)))
    }

    /// Writes the next frame if one is due.
    pub(super) fn produce(
        &mut self,
        now: Instant,
        early: Duration,
        room: &mut [u8],
        counters: &mut TargetCounters,
    ) -> Option<usize> {
        let schedule = self.schedule.as_mut()?;
        schedule.align(now, early);
        if !schedule.is_due(now, early) {
            return None;
        }
        let frame = IoFrame {
            connection_id: schedule.connection_id,
            sequence: schedule.sequence,
            data_sequence: schedule.count,
            data: self.image.get(..self.len)?,
        };
        let written: Result<usize, NoRoom> =
            frame.write(self.has_header.then_some(self.is_run), room);
        counters.overruns = counters.overruns.saturating_add(schedule.advance(now));
        let len = written.ok()?;
        counters.produced = counters.produced.saturating_add(1);
        Some(len)
    }
}
