//! One whole run: the loop, the engine, the program, and whoever watches.

use super::observation::Observation;
use super::outcome::{End, LinkMessage, Outcome};
use super::pace::Pace;
use super::periodic::{Controller, CycleError, Periodic};
use super::recording::{Recording, Sample};
use super::runner::{Phase, Runner};
use super::statistics::Quantiles;
use crate::cycle::{CyclicLink, InputQuality};
use crate::engine::meca500::{Engine, Event};
use crate::time::{Duration, Instant};
use crate::wire::WireError;
use crate::wire::meca500::image::{INPUT_LEN, OUTPUT_LEN};

/// Cycles in which the safe image is sent at the end of a run.
const RELEASE_CYCLES: u32 = 10;

/// Cycles in a row that make no sense before the first command, after which the run ends. Fewer than
/// the engine waits before it sends anything.
const IMPLAUSIBLE_CYCLES: u32 = 4;

impl<const QUEUE: usize> Controller for Engine<QUEUE> {
    const OUTPUT_LEN: usize = OUTPUT_LEN;
    const INPUT_LEN: usize = INPUT_LEN;

    fn cycle(
        &mut self,
        now: Instant,
        quality: InputQuality,
        inputs: &[u8],
        outputs: &mut [u8],
    ) -> Result<(), WireError> {
        self.cycle_bytes(now, quality, inputs, outputs)
    }
}

/// How far a run has come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// Time since the first cycle.
    pub bus_time: Duration,
    /// What the run is at.
    pub phase: Phase,
    /// The first step that has not ended; the number of steps when all have.
    pub step: usize,
    /// What the images said; `None` until the byte order is known.
    pub seen: Option<Observation>,
    /// Cycles so far.
    pub cycles: u64,
    /// Deadlines missed so far.
    pub overruns: u64,
    /// Cycle times so far, in nanoseconds.
    pub cycle_time_ns: Quantiles,
}

/// Whoever watches a run. Nothing here may block: the bus waits for it.
pub trait Observer {
    /// Whether somebody asked for the end of the run.
    fn is_interrupted(&mut self) -> bool;

    /// Hears every event of the engine, and the step that was current then, if one was.
    fn event(&mut self, event: &Event, step: Option<usize>);

    /// Whether [`progress`](Self::progress) is wanted in this cycle.
    fn wants_progress(&mut self, cycles: u64) -> bool;

    /// Hears how far the run has come.
    fn progress(&mut self, progress: &Progress);
}

/// Runs a program to its end and leaves safe outputs behind. A link that fails is an outcome like any
/// other; the safe outputs are still tried.
///
/// # Errors
///
/// The link brings other images than those of a Meca500.
pub fn drive<L: CyclicLink, P: Pace, const QUEUE: usize>(
    periodic: &mut Periodic<L, P>,
    engine: &mut Engine<QUEUE>,
    runner: &mut Runner<'_>,
    recording: &mut Recording,
    observer: &mut impl Observer,
) -> Result<Outcome, CycleError<L::Error>>
where
    L::Error: core::fmt::Display,
{
    let mut implausible = 0;
    let outcome = loop {
        let turn = match periodic.turn(engine) {
            Ok(turn) => turn,
            Err(CycleError::Link(error)) => {
                break runner.link_failed(End::LinkFailed(LinkMessage::of(&error)));
            }
            Err(image) => {
                let _ = periodic.release(RELEASE_CYCLES);
                return Err(image);
            }
        };
        let since_begin = recording.cycle(turn.now);
        let step = (runner.phase() == Phase::Running).then(|| runner.current_step());
        let is_interrupted = observer.is_interrupted();
        let outcome = runner.after_turn(engine, turn.now, is_interrupted, |event| {
            observer.event(event, step);
        });
        let order = engine.byte_order();
        let seen =
            order.and_then(|order| Observation::read(periodic.inputs(), periodic.outputs(), order));
        if let Some(seen) = seen {
            let counts = runner.counts();
            recording.record(Sample {
                at: since_begin,
                seen,
                submitted: counts.submitted,
                accepted: counts.accepted,
                done: counts.done,
            });
        }
        implausible = match seen {
            Some(seen) if runner.counts().submitted == 0 && !seen.is_plausible() => implausible + 1,
            _ => 0,
        };
        let outcome = match outcome {
            None if implausible >= IMPLAUSIBLE_CYCLES => {
                runner.give_up(engine, End::ImplausibleInputs, turn.now)
            }
            outcome => outcome,
        };
        let statistics = periodic.statistics();
        if outcome.is_some() || observer.wants_progress(statistics.cycles) {
            observer.progress(&Progress {
                bus_time: since_begin,
                phase: runner.phase(),
                step: runner.current_step(),
                seen,
                cycles: statistics.cycles,
                overruns: statistics.overruns,
                cycle_time_ns: statistics.cycle_time_ns.quantiles(),
            });
        }
        if let Some(outcome) = outcome {
            break outcome;
        }
    };
    recording.close();
    match periodic.release(RELEASE_CYCLES) {
        // The safe outputs did not leave: that is no good end, nor a clean interrupt.
        Err(error) if matches!(outcome.end, End::Completed | End::Interrupted) => {
            Ok(Outcome { end: End::LinkFailed(LinkMessage::of(&error)), ..outcome })
        }
        _ => Ok(outcome),
    }
}
