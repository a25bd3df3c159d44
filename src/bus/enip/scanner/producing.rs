//! Frames to the target, by absolute deadlines.
//!
//! When a frame leaves is said in `deadlines`. A caller with a beat of its own cannot come back half an interval
//! behind a late frame, so a quarter is enough for what is overdue: its late cycle and the next one, which is in
//! time, still send one frame each. What is early keeps half an interval.

use super::{MAX_IMAGE_LEN, TargetCounters};
use crate::bus::enip::deadlines::Deadlines;
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

/// What the next frame is numbered, and when it is due.
#[derive(Clone, Copy, Debug)]
struct Schedule {
    connection_id: u32,
    deadlines: Deadlines,
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
    /// How much earlier than its deadline a frame may leave, and how long behind the one before.
    fn early(&self, early: Duration) -> Duration {
        early.min(self.deadlines.interval() / 2)
    }

    fn is_due(&self, now: Instant, early: Duration) -> bool {
        let early = self.early(early);
        let is_overdue = now >= self.deadlines.next();
        let distance = if is_overdue { self.deadlines.interval() / 4 } else { early };
        now + early >= self.deadlines.next() && now >= self.deadlines.behind_last(distance)
    }

    /// Lays the deadlines on the beat of a caller that has one: opening ends somewhere between two beats, and
    /// frames would stay late by that forever.
    fn align(&mut self, now: Instant, early: Duration) {
        if self.beat == Beat::Begun && !early.is_zero() {
            let is_too_soon = now < self.deadlines.behind_last(self.early(early));
            self.deadlines.lay(if is_too_soon { now + self.deadlines.interval() } else { now });
            self.beat = Beat::Settled;
        }
    }

    /// A frame leaves. Returns the number of those that were given up.
    fn advance(&mut self, now: Instant) -> u64 {
        self.sequence = self.sequence.wrapping_add(1);
        self.count = self.count.wrapping_add(1);
        self.deadlines.pass(now)
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
        let deadlines = Deadlines::new(now, api);
        let (sequence, count, beat) = (1, 1, Beat::Unknown);
        self.schedule = Some(Schedule { connection_id, deadlines, sequence, count, beat });
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
    pub(super) fn wake(&self) -> Option<Instant> {
        self.schedule.map(|schedule| schedule.deadlines.due())
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
