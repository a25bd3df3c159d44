//! The samples behind the plots: bounded, whatever the length of the run.

use std::prelude::v1::*;

use super::decimate::Decimated;
use super::observation::Observation;
use crate::time::{Duration, Instant};

/// One cycle as a plot needs it.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// When the cycle began, since the first one.
    pub at: Duration,
    /// What the images said.
    pub seen: Observation,
    /// Commands given to the engine so far.
    pub submitted: u32,
    /// Of these, taken by the robot.
    pub accepted: u32,
    /// Of these, known to be executed.
    pub done: u32,
}

/// Samples of a whole run, and each of its first handshakes.
#[derive(Clone, Debug)]
pub struct Recording {
    run: Decimated<Sample>,
    first_handshakes: Vec<Sample>,
    begin: Option<Instant>,
    distance_mm: f64,
    previous: Option<Sample>,
    first_robot_time_us: Option<u64>,
    idle_move_id: Option<u16>,
}

/// Samples kept of a whole run, and every cycle of so many once the first command goes out.
const RUN_SAMPLES: usize = 4_000;
const HANDSHAKE_SAMPLES: usize = 48;

impl Recording {
    /// Takes all the memory it will ever need.
    #[must_use]
    pub fn new() -> Self {
        Self {
            run: Decimated::with_capacity(RUN_SAMPLES),
            first_handshakes: Vec::with_capacity(HANDSHAKE_SAMPLES),
            begin: None,
            distance_mm: 0.0,
            previous: None,
            first_robot_time_us: None,
            idle_move_id: None,
        }
    }

    /// Notes that a cycle began, whether it will be a sample or not; the time since the first one.
    pub fn cycle(&mut self, now: Instant) -> Duration {
        now - *self.begin.get_or_insert(now)
    }

    /// Takes a cycle. Does not allocate.
    pub fn record(&mut self, sample: Sample) {
        let seen = sample.seen;
        if let Some(previous) = self.previous.replace(sample) {
            self.distance_mm += seen.distance_mm(&previous.seen);
        }
        self.first_robot_time_us.get_or_insert(seen.robot_time_us);
        if let Some(move_ids) = seen.move_ids {
            self.record_handshake(sample, move_ids.sent);
        }
        self.run.offer(sample);
    }

    fn record_handshake(&mut self, sample: Sample, sent: u16) {
        let idle = *self.idle_move_id.get_or_insert(sent);
        let is_handshake = sample.submitted > 0 && sent != idle;
        let has_begun = is_handshake || !self.first_handshakes.is_empty();
        if sample.submitted == 0 {
            self.idle_move_id = Some(sent);
        } else if has_begun && self.first_handshakes.len() < HANDSHAKE_SAMPLES {
            self.first_handshakes.push(sample);
        }
    }

    /// Ends the recording: the last cycle becomes a sample, whatever the spacing.
    pub fn close(&mut self) {
        if let Some(last) = self.previous {
            self.run.close(last);
        }
    }

    /// Evenly spaced samples of the whole run, and its last cycle.
    #[must_use]
    pub fn samples(&self) -> &[Sample] {
        self.run.samples()
    }

    /// One cycle of so many is among [`samples`](Self::samples).
    #[must_use]
    pub const fn stride(&self) -> u64 {
        self.run.stride()
    }

    /// Every cycle from the first command on, until there is no more room.
    #[must_use]
    pub fn first_handshakes(&self) -> &[Sample] {
        &self.first_handshakes
    }

    /// When the first cycle of the run began; the origin of the samples' times.
    #[must_use]
    pub const fn begin(&self) -> Option<Instant> {
        self.begin
    }

    /// Path length of the tool, in mm.
    #[must_use]
    pub const fn distance_mm(&self) -> f64 {
        self.distance_mm
    }

    /// Robot time that passed, in microseconds.
    #[must_use]
    pub fn robot_time_us(&self) -> u64 {
        match (self.first_robot_time_us, self.previous) {
            (Some(first), Some(last)) => last.seen.robot_time_us.saturating_sub(first),
            _ => 0,
        }
    }
}

impl Default for Recording {
    fn default() -> Self {
        Self::new()
    }
}
