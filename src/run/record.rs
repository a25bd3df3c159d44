//! What became of each step of a program, and how many became what.

use std::prelude::v1::*;

use crate::engine::meca500::{AbortReason, Ticket};
use crate::time::Instant;

/// What became of one step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepRecord {
    /// When it was given to the engine.
    pub submitted: Option<Instant>,
    /// When the robot's acknowledgement was seen.
    pub accepted: Option<Instant>,
    /// When everything before it was known to be done.
    pub started: Option<Instant>,
    /// When its end was known.
    pub ended: Option<Instant>,
    /// How it ended.
    pub end: StepEnd,
}

/// How a step ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StepEnd {
    /// It has not.
    #[default]
    Open,
    /// Executed.
    Done,
    /// Not executed, or not to its end.
    Aborted(AbortReason),
    /// Nobody can tell.
    Unknown,
}

/// Steps by what became of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Given to the engine.
    pub submitted: u32,
    /// Of these, taken by the robot.
    pub accepted: u32,
    /// Of these, executed.
    pub done: u32,
    /// Dropped by a ClearMotion, a DeactivateRobot, or an error.
    pub aborted: u32,
    /// Of unknown fate.
    pub unknown: u32,
}

impl Counts {
    /// Without a final event yet.
    #[must_use]
    pub const fn open(&self) -> u32 {
        self.submitted.saturating_sub(self.done + self.aborted + self.unknown)
    }
}

/// The records of all steps. All memory is taken when it is made.
#[derive(Clone, Debug)]
pub(super) struct Ledger {
    records: Vec<StepRecord>,
    /// Ascending by ticket; each step has at most one.
    tickets: Vec<(Ticket, usize)>,
    first_open: usize,
    counts: Counts,
}

impl Ledger {
    pub(super) fn new(steps: usize) -> Self {
        Self {
            records: vec![StepRecord::default(); steps],
            tickets: Vec::with_capacity(steps),
            first_open: 0,
            counts: Counts::default(),
        }
    }

    pub(super) fn records(&self) -> &[StepRecord] {
        &self.records
    }

    pub(super) const fn counts(&self) -> Counts {
        self.counts
    }

    /// The first step that has not ended.
    pub(super) const fn first_open(&self) -> usize {
        self.first_open
    }

    pub(super) fn step_of(&self, ticket: Ticket) -> Option<usize> {
        let found = self.tickets.binary_search_by_key(&ticket, |(ticket, _)| *ticket).ok()?;
        self.tickets.get(found).map(|(_, step)| *step)
    }

    /// Ties a ticket to a step that has none yet.
    pub(super) fn tie(&mut self, ticket: Ticket, step: usize) {
        if self.tickets.len() < self.tickets.capacity() {
            self.tickets.push((ticket, step));
        }
    }

    pub(super) fn submitted(&mut self, step: usize, at: Instant) {
        if let Some(record) = self.records.get_mut(step)
            && record.submitted.is_none()
        {
            record.submitted = Some(at);
            self.counts.submitted += 1;
        }
    }

    pub(super) fn accepted(&mut self, step: usize, at: Instant) {
        if let Some(record) = self.records.get_mut(step)
            && record.accepted.is_none()
        {
            record.accepted = Some(at);
            self.counts.accepted += 1;
        }
    }

    pub(super) fn started(&mut self, step: usize, at: Instant) {
        if let Some(record) = self.records.get_mut(step) {
            record.started.get_or_insert(at);
        }
    }

    pub(super) fn ended(&mut self, step: usize, at: Instant, end: StepEnd) {
        if let Some(record) = self.records.get_mut(step)
            && record.end == StepEnd::Open
        {
            (record.ended, record.end) = (Some(at), end);
            match end {
                StepEnd::Open => {}
                StepEnd::Done => self.counts.done += 1,
                StepEnd::Aborted(_) => self.counts.aborted += 1,
                StepEnd::Unknown => self.counts.unknown += 1,
            }
        }
        let is_ended = |record: &StepRecord| record.end != StepEnd::Open;
        while self.records.get(self.first_open).is_some_and(is_ended) {
            self.first_open += 1;
        }
    }

    /// The first step that an error dropped; without one, the first that has not ended.
    pub(super) fn culprit(&self) -> Option<usize> {
        let dropped = self.records.iter().position(|record| {
            matches!(record.end, StepEnd::Aborted(reason) if reason != AbortReason::Cleared)
                || record.end == StepEnd::Unknown
        });
        let is_given =
            |step: &usize| self.records.get(*step).is_some_and(|record| record.submitted.is_some());
        dropped.or_else(|| Some(self.first_open).filter(is_given))
    }
}
