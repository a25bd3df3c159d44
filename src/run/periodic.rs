//! The loop body: one bus cycle of one controller over one link.
//!
//! ```text
//!   wait for the deadline --> link.exchange(outputs) --> controller.cycle(inputs) --> new outputs
//!            ^                                                                             |
//!            +-----------------------------------------------------------------------------+
//! ```
//!
//! The exchange comes first: outputs computed in a cycle leave exactly at the next deadline, so the
//! computing time does not show on the bus.
//!
//! Invariants: [`Periodic::turn`] does not allocate; the first outputs are all zero, and so are
//! those of [`Periodic::release`].

use std::prelude::v1::*;

use super::pace::{Beginning, Grid, Pace};
use super::statistics::CycleStatistics;
use crate::cycle::{CyclicLink, InputQuality};
use crate::link::clock::MonotonicClock;
use crate::time::{Duration, Instant};
use crate::wire::WireError;

/// The PLC's side of a handshake: what is called once per bus cycle.
pub trait Controller {
    /// Length of the output image in bytes.
    const OUTPUT_LEN: usize;
    /// Length of the input image in bytes.
    const INPUT_LEN: usize;

    /// Reads the newest inputs and writes the next outputs.
    ///
    /// # Errors
    ///
    /// An image of the wrong length.
    fn cycle(
        &mut self,
        now: Instant,
        quality: InputQuality,
        inputs: &[u8],
        outputs: &mut [u8],
    ) -> Result<(), WireError>;
}

/// Why the loop cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CycleError<E> {
    /// The link cannot exchange images.
    #[error("{0}")]
    Link(E),
    /// Link and controller disagree about an image.
    #[error("{0}")]
    Image(WireError),
}

/// One cycle that took place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Turn {
    /// When it began.
    pub now: Instant,
    /// What the link said about the inputs.
    pub quality: InputQuality,
}

/// A link, the images on it, and the pace of its cycles.
#[derive(Debug)]
pub struct Periodic<L, P> {
    link: L,
    pace: P,
    period: Duration,
    grid: Option<Grid>,
    clock: MonotonicClock,
    outputs: Vec<u8>,
    inputs: Vec<u8>,
    statistics: CycleStatistics,
}

impl<L: CyclicLink, P: Pace> Periodic<L, P> {
    /// A loop with the given `period` for a controller of type `C`; all memory is taken here.
    #[must_use]
    pub fn new<C: Controller>(link: L, pace: P, period: Duration) -> Self {
        Self {
            link,
            pace,
            period,
            grid: None,
            clock: MonotonicClock::new(),
            outputs: vec![0; C::OUTPUT_LEN],
            inputs: vec![0; C::INPUT_LEN],
            statistics: CycleStatistics::new(),
        }
    }

    /// Waits for the next deadline and runs one cycle. Does not allocate.
    ///
    /// # Errors
    ///
    /// The link failed for good, or the controller expects other images than the link brings.
    pub fn turn<C: Controller>(
        &mut self,
        controller: &mut C,
    ) -> Result<Turn, CycleError<L::Error>> {
        let beginning = self.begin();
        self.statistics.record_beginning(beginning);
        let work_began = self.clock.now();
        let now = beginning.at;
        let quality =
            self.link.exchange(now, &self.outputs, &mut self.inputs).map_err(CycleError::Link)?;
        self.statistics.record_quality(quality);
        controller
            .cycle(now, quality, &self.inputs, &mut self.outputs)
            .map_err(CycleError::Image)?;
        self.statistics.work_ns.record_duration(self.clock.now() - work_began);
        Ok(Turn { now, quality })
    }

    /// Waits for the next deadline; the first one is now.
    fn begin(&mut self) -> Beginning {
        let (pace, period) = (&mut self.pace, self.period);
        self.grid.get_or_insert_with(|| Grid::new(pace.start(), period)).next(pace)
    }

    /// Sends the safe image, which is all zero, for so many cycles without asking a controller.
    ///
    /// # Errors
    ///
    /// The link failed for good.
    pub fn release(&mut self, cycles: u32) -> Result<(), L::Error> {
        self.outputs.fill(0);
        for _ in 0..cycles {
            let beginning = self.begin();
            self.link.exchange(beginning.at, &self.outputs, &mut self.inputs)?;
        }
        Ok(())
    }

    /// The newest inputs.
    #[must_use]
    pub fn inputs(&self) -> &[u8] {
        &self.inputs
    }

    /// The outputs that the next exchange will send.
    #[must_use]
    pub fn outputs(&self) -> &[u8] {
        &self.outputs
    }

    /// What the cycles were like so far.
    #[must_use]
    pub const fn statistics(&self) -> &CycleStatistics {
        &self.statistics
    }

    /// The link.
    #[must_use]
    pub const fn link(&self) -> &L {
        &self.link
    }

    /// The link, to be reached while the loop stands still.
    pub const fn link_mut(&mut self) -> &mut L {
        &mut self.link
    }
}
