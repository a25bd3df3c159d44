//! One robot's part of a run: its engine, its program, and what is seen and kept of it.
//!
//! ```text
//!   running --outcome--> ended: outputs of zero in every further cycle of the segment
//! ```
//!
//! Invariants: an outcome stays, except that a good one turns into a failed link when the safe outputs
//! behind it could not be sent; nothing in a cycle allocates.

use super::drive::{CycleProgress, Observer, Progress, RELEASE_CYCLES};
use super::observation::Observation;
use super::outcome::{End, LinkMessage, Outcome};
use super::periodic::Port;
use super::recording::{Recording, Sample};
use super::runner::{Phase, Runner};
use super::statistics::CycleStatistics;
use crate::engine::meca500::Engine;
use crate::time::Instant;

/// Cycles in a row that make no sense before the first command, after which the run ends. Fewer than
/// the engine waits before it sends anything.
const IMPLAUSIBLE_CYCLES: u32 = 4;

/// What a seat is at.
#[derive(Clone, Copy, Debug)]
enum State {
    Running {
        /// Cycles in a row whose inputs made no sense.
        implausible: u32,
    },
    Ended {
        outcome: Outcome,
        /// Safe images that have left since; saturates.
        safe_cycles: u32,
    },
}

/// One robot's part of a run. It borrows what the caller wants to look at afterwards.
#[derive(Debug)]
pub struct Seat<'r, 'p, O, const QUEUE: usize> {
    engine: &'r mut Engine<QUEUE>,
    runner: &'r mut Runner<'p>,
    recording: &'r mut Recording,
    observer: &'r mut O,
    state: State,
}

impl<'r, 'p, O: Observer, const QUEUE: usize> Seat<'r, 'p, O, QUEUE> {
    /// A seat whose program has not begun.
    pub const fn new(
        engine: &'r mut Engine<QUEUE>,
        runner: &'r mut Runner<'p>,
        recording: &'r mut Recording,
        observer: &'r mut O,
    ) -> Self {
        Self { engine, runner, recording, observer, state: State::Running { implausible: 0 } }
    }

    /// Whether the program has not ended yet.
    #[must_use]
    pub const fn is_running(&self) -> bool {
        matches!(self.state, State::Running { .. })
    }

    /// How the program ended; `None` while it runs.
    #[must_use]
    pub const fn outcome(&self) -> Option<Outcome> {
        match self.state {
            State::Running { .. } => None,
            State::Ended { outcome, .. } => Some(outcome),
        }
    }

    /// How the program ended. One that was not driven to its end had no robot.
    #[must_use]
    pub fn into_outcome(self) -> Outcome {
        match self.state {
            State::Running { .. } => self.runner.link_failed(End::NotConnected),
            State::Ended { outcome, .. } => outcome,
        }
    }

    /// The engine, while there is something to control.
    pub(super) const fn controller(&mut self) -> Option<&mut Engine<QUEUE>> {
        if self.is_running() { Some(self.engine) } else { None }
    }

    /// Does what is due after a cycle of the loop that the engine took part in; `port` is the
    /// robot's, `statistics` are those of the bus.
    pub(super) fn after_turn(&mut self, now: Instant, port: &Port, statistics: &CycleStatistics) {
        let implausible = match &mut self.state {
            State::Running { implausible } => *implausible,
            State::Ended { safe_cycles, .. } => {
                *safe_cycles = safe_cycles.saturating_add(1);
                return;
            }
        };
        let since_begin = self.recording.cycle(now);
        let step = (self.runner.phase() == Phase::Running).then(|| self.runner.current_step());
        let is_interrupted = self.observer.is_interrupted();
        let observer = &mut *self.observer;
        let outcome = self.runner.after_turn(self.engine, now, is_interrupted, |event| {
            observer.event(event, step);
        });
        let order = self.engine.byte_order();
        let seen = order.and_then(|order| Observation::read(port.inputs(), port.outputs(), order));
        if let Some(seen) = seen {
            let counts = self.runner.counts();
            self.recording.record(Sample {
                at: since_begin,
                seen,
                submitted: counts.submitted,
                accepted: counts.accepted,
                done: counts.done,
            });
        }
        let is_implausible =
            seen.is_some_and(|seen| self.runner.counts().submitted == 0 && !seen.is_plausible());
        let implausible = if is_implausible { implausible + 1 } else { 0 };
        let outcome = match outcome {
            None if implausible >= IMPLAUSIBLE_CYCLES => {
                self.runner.give_up(self.engine, End::ImplausibleInputs, now)
            }
            outcome => outcome,
        };
        if outcome.is_some() || self.observer.wants_progress(statistics.cycles) {
            self.observer.progress(&Progress {
                bus_time: since_begin,
                phase: self.runner.phase(),
                step: self.runner.current_step(),
                seen,
                cycles: Some(CycleProgress {
                    count: statistics.cycles,
                    overruns: statistics.overruns,
                    time_ns: statistics.cycle_time_ns.quantiles(),
                }),
            });
        }
        match outcome {
            Some(outcome) => self.end(outcome),
            None => self.state = State::Running { implausible },
        }
    }

    /// Ends a program that still runs, for a reason that lies outside of it and its robot.
    pub(super) fn cut_off(&mut self, end: End) {
        if self.is_running() {
            let outcome = self.runner.link_failed(end);
            self.end(outcome);
        }
    }

    /// The safe outputs behind the end of the run could not be sent. Without enough of them before,
    /// that is no good end, nor a clean interrupt.
    pub(super) const fn release_failed(&mut self, message: LinkMessage) {
        if let State::Ended { outcome, safe_cycles } = &mut self.state
            && *safe_cycles < RELEASE_CYCLES
            && matches!(outcome.end, End::Completed | End::Interrupted)
        {
            outcome.end = End::LinkFailed(message);
        }
    }

    fn end(&mut self, outcome: Outcome) {
        self.recording.close();
        self.state = State::Ended { outcome, safe_cycles: 0 };
    }
}
