//! One whole run: the loop, the seats of its robots, and whoever watches.

use super::observation::Observation;
use super::outcome::{End, LinkMessage, Outcome};
use super::pace::Pace;
use super::periodic::{Controller, CycleError, Periodic};
use super::recording::Recording;
use super::runner::{Phase, Runner};
use super::seat::Seat;
use super::single::Single;
use super::statistics::Quantiles;
use crate::cycle::{CyclicLink, CyclicSegment, InputQuality};
use crate::engine::meca500::{Engine, Event};
use crate::time::{Duration, Instant};
use crate::wire::WireError;
use crate::wire::meca500::image::{INPUT_LEN, OUTPUT_LEN};

/// Cycles in which the safe image is sent at the end of a run. A robot that got it so often is safe,
/// whatever becomes of the bus.
pub(super) const RELEASE_CYCLES: u32 = 10;

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
    /// What the cycles are like; `None` over the text interface, which has none.
    pub cycles: Option<CycleProgress>,
}

/// What the cycles of a run are like so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CycleProgress {
    /// Cycles so far.
    pub count: u64,
    /// Deadlines missed so far.
    pub overruns: u64,
    /// Cycle times so far, in nanoseconds.
    pub time_ns: Quantiles,
}

/// Whoever watches one robot of a run. Nothing here may block: the bus waits for it.
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

/// Runs a program to its end on the robot of a link and leaves safe outputs behind. A link that fails
/// is an outcome like any other; the safe outputs are still tried.
///
/// # Errors
///
/// The link brings other images than those of a Meca500.
pub fn drive<L: CyclicLink, P: Pace, const QUEUE: usize>(
    periodic: &mut Periodic<Single<L>, P>,
    engine: &mut Engine<QUEUE>,
    runner: &mut Runner<'_>,
    recording: &mut Recording,
    observer: &mut impl Observer,
) -> Result<Outcome, CycleError<L::Error>>
where
    L::Error: core::fmt::Display,
{
    let mut seat = Seat::new(engine, runner, recording, observer);
    drive_all(periodic, core::slice::from_mut(&mut seat))?;
    Ok(seat.into_outcome())
}

/// Runs the program of every seat to its end, each on the robot of its number, and leaves safe outputs
/// behind; the outcomes are in the seats. Does not allocate.
///
/// The robot of a seat that ends gets safe outputs from then on while the others go on. When the
/// segment fails, every seat that still runs ends over it; the safe outputs are still tried. A seat beyond the robots of the segment ends
/// unconnected; a robot beyond the seats gets outputs of zero.
///
/// # Errors
///
/// The segment brings other images than those of a Meca500.
pub fn drive_all<S: CyclicSegment, P: Pace, O: Observer, const QUEUE: usize>(
    periodic: &mut Periodic<S, P>,
    seats: &mut [Seat<'_, '_, O, QUEUE>],
) -> Result<(), CycleError<S::Error>>
where
    S::Error: core::fmt::Display,
{
    while seats.iter().any(Seat::is_running) {
        match periodic.turn(seats.iter_mut().map(Seat::controller)) {
            Ok(now) => after_turn(periodic, seats, now),
            Err(CycleError::Link(error)) => {
                let end = End::LinkFailed(LinkMessage::of(&error));
                seats.iter_mut().for_each(|seat| seat.cut_off(end));
            }
            Err(image) => {
                let _ = periodic.release(RELEASE_CYCLES);
                return Err(image);
            }
        }
    }
    if let Err(error) = periodic.release(RELEASE_CYCLES) {
        let message = LinkMessage::of(&error);
        seats.iter_mut().for_each(|seat| seat.release_failed(message));
    }
    Ok(())
}

fn after_turn<S: CyclicSegment, P: Pace, O: Observer, const QUEUE: usize>(
    periodic: &mut Periodic<S, P>,
    seats: &mut [Seat<'_, '_, O, QUEUE>],
    now: Instant,
) {
    for (robot, seat) in seats.iter_mut().enumerate() {
        match periodic.ports().get(robot) {
            Some(port) => seat.after_turn(now, port, periodic.statistics()),
            None => seat.cut_off(End::NotConnected),
        }
        if !seat.is_running() {
            periodic.make_safe(robot);
        }
    }
}
