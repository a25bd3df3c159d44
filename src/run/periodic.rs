//! The loop body: one bus cycle for every robot of a segment.
//!
//! ```text
//!   wait for the deadline --> exchange all outputs --> each controller's cycle(inputs) --> new outputs
//!            ^                                                                                 |
//!            +---------------------------------------------------------------------------------+
//! ```
//!
//! The exchange comes first: outputs computed in a cycle leave exactly at the next deadline, so the
//! computing time does not show on the bus.
//!
//! One robot on a [`CyclicLink`] is a segment of one ([`Single`]); there is no second loop for it.
//!
//! Invariants: [`Periodic::turn`] does not allocate; the first outputs of every robot are all zero,
//! and so are those of a robot without a controller and those of [`Periodic::release`].

use std::prelude::v1::*;

use super::pace::{Beginning, Grid, Pace};
use super::single::Single;
use super::statistics::{CycleStatistics, RobotStatistics};
use crate::cycle::{CyclicLink, CyclicSegment, InputQuality};
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

/// The images of one robot, and what its cycles were like.
#[derive(Clone, Debug)]
pub struct Port {
    outputs: Vec<u8>,
    inputs: Vec<u8>,
    quality: InputQuality,
    statistics: RobotStatistics,
}

impl Port {
    fn new<C: Controller>() -> Self {
        Self {
            outputs: vec![0; C::OUTPUT_LEN],
            inputs: vec![0; C::INPUT_LEN],
            quality: InputQuality::Lost,
            statistics: RobotStatistics::new(),
        }
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

    /// What the segment said about the inputs.
    #[must_use]
    pub const fn quality(&self) -> InputQuality {
        self.quality
    }

    /// What the cycles with a controller were like so far.
    #[must_use]
    pub const fn statistics(&self) -> &RobotStatistics {
        &self.statistics
    }
}

/// A segment, the images on it, and the pace of its cycles.
#[derive(Debug)]
pub struct Periodic<S, P> {
    segment: S,
    pace: P,
    period: Duration,
    grid: Option<Grid>,
    clock: MonotonicClock,
    ports: Vec<Port>,
    statistics: CycleStatistics,
}

impl<L: CyclicLink, P: Pace> Periodic<Single<L>, P> {
    /// A loop with the given `period` for one controller of type `C`; all memory is taken here.
    #[must_use]
    pub fn new<C: Controller>(link: L, pace: P, period: Duration) -> Self {
        let segment = Single::new(link, C::OUTPUT_LEN, C::INPUT_LEN);
        Self::over_segment::<C>(segment, pace, period)
    }

    /// The link.
    #[must_use]
    pub const fn link(&self) -> &L {
        self.segment.link()
    }

    /// The link, to be reached while the loop stands still.
    pub const fn link_mut(&mut self) -> &mut L {
        self.segment.link_mut()
    }
}

impl<S: CyclicSegment, P: Pace> Periodic<S, P> {
    /// A loop with the given `period` for all robots of `segment`, each with a controller of type
    /// `C`; all memory is taken here.
    #[must_use]
    pub fn over_segment<C: Controller>(segment: S, pace: P, period: Duration) -> Self {
        let ports = (0..segment.robot_count()).map(|_| Port::new::<C>()).collect();
        Self {
            segment,
            pace,
            period,
            grid: None,
            clock: MonotonicClock::new(),
            ports,
            statistics: CycleStatistics::new(),
        }
    }

    /// Waits for the next deadline and runs one cycle; when it began. Does not allocate.
    ///
    /// `controllers` are those of the robots, in the order of their numbers. A robot whose
    /// controller is `None`, or for which there is none, gets outputs of zero from the next cycle on.
    ///
    /// # Errors
    ///
    /// The segment failed for good, or a controller expects other images than there are.
    pub fn turn<'c, C: Controller + 'c>(
        &mut self,
        controllers: impl IntoIterator<Item = Option<&'c mut C>>,
    ) -> Result<Instant, CycleError<S::Error>> {
        let beginning = self.begin();
        self.statistics.record_beginning(beginning);
        let work_began = self.clock.now();
        let now = beginning.at;
        self.exchange(now).map_err(CycleError::Link)?;
        let mut at = self.clock.now();
        let mut controllers = controllers.into_iter();
        for (robot, port) in self.ports.iter_mut().enumerate() {
            let Some(controller) = controllers.next().flatten() else {
                port.outputs.fill(0);
                continue;
            };
            port.quality = self.segment.read_inputs(robot, &mut port.inputs);
            controller
                .cycle(now, port.quality, &port.inputs, &mut port.outputs)
                .map_err(CycleError::Image)?;
            let began = at;
            at = self.clock.now();
            port.statistics.record(port.quality, at - began);
        }
        self.statistics.work_ns.record_duration(at - work_began);
        Ok(now)
    }

    /// Waits for the next deadline; the first one is now.
    fn begin(&mut self) -> Beginning {
        let (pace, period, makes_up) = (&mut self.pace, self.period, self.segment.makes_up());
        self.grid.get_or_insert_with(|| Grid::new(pace.start(), period)).next(pace, makes_up)
    }

    /// One bus cycle with the outputs as they are.
    fn exchange(&mut self, now: Instant) -> Result<(), S::Error> {
        for (robot, port) in self.ports.iter().enumerate() {
            self.segment.write_outputs(robot, &port.outputs);
        }
        self.segment.exchange(now)?;
        if let Some(grid) = &mut self.grid {
            grid.nudge(self.segment.nudge_ns());
        }
        Ok(())
    }

    /// Makes the next outputs of a robot the safe image, which is all zero.
    pub fn make_safe(&mut self, robot: usize) {
        if let Some(port) = self.ports.get_mut(robot) {
            port.outputs.fill(0);
        }
    }

    /// Sends the safe image to every robot for so many cycles without asking a controller.
    ///
    /// # Errors
    ///
    /// The segment failed for good.
    pub fn release(&mut self, cycles: u32) -> Result<(), S::Error> {
        self.ports.iter_mut().for_each(|port| port.outputs.fill(0));
        for _ in 0..cycles {
            let beginning = self.begin();
            self.exchange(beginning.at)?;
        }
        Ok(())
    }

    /// The images of all robots, in the order of their numbers.
    #[must_use]
    pub fn ports(&self) -> &[Port] {
        &self.ports
    }

    /// What the bus cycles were like so far.
    #[must_use]
    pub const fn statistics(&self) -> &CycleStatistics {
        &self.statistics
    }

    /// The segment.
    #[must_use]
    pub const fn segment(&self) -> &S {
        &self.segment
    }

    /// The segment, to be reached while the loop stands still.
    pub const fn segment_mut(&mut self) -> &mut S {
        &mut self.segment
    }
}
