//! One robot of a segment as a [`CyclicLink`].

use super::error::EthercatError;
use super::segment::{EthercatSegment, StartFailure};
use super::settings::{RobotChoice, SegmentSettings};
use super::wire::Wire;
use crate::cycle::{CyclicLink, CyclicSegment, InputQuality};
use crate::time::Instant;
use crate::wire::meca500::image::{INPUT_LEN, OUTPUT_LEN};

/// The PLC's end of one robot on EtherCAT.
pub struct EthercatLink<W> {
    segment: EthercatSegment<W>,
}

impl<W: Wire> EthercatLink<W> {
    /// Brings one robot to OP: the first on the segment, unless `settings` name another.
    ///
    /// # Errors
    ///
    /// As [`EthercatSegment::start`].
    pub fn start(wire: W, settings: SegmentSettings) -> Result<Self, StartFailure<W>> {
        let robots = match settings.robots {
            RobotChoice::All => RobotChoice::First(1),
            chosen => chosen,
        };
        EthercatSegment::start(wire, SegmentSettings { robots, ..settings })
            .map(|segment| Self { segment })
    }

    /// The segment behind the link: events, statistics, what was found.
    #[must_use]
    pub const fn segment(&self) -> &EthercatSegment<W> {
        &self.segment
    }

    /// The segment behind the link.
    pub const fn segment_mut(&mut self) -> &mut EthercatSegment<W> {
        &mut self.segment
    }

    /// The segment, when the link is no longer needed.
    #[must_use]
    pub fn into_segment(self) -> EthercatSegment<W> {
        self.segment
    }
}

impl<W: Wire> CyclicLink for EthercatLink<W> {
    type Error = EthercatError;

    /// One bus cycle.
    ///
    /// # Errors
    ///
    /// [`EthercatError::ImageLength`] for images that are not a Meca500's, and
    /// [`EthercatError::Replaced`] once another device or another image stands in the robot's place.
    fn exchange(
        &mut self,
        now: Instant,
        outputs: &[u8],
        inputs: &mut [u8],
    ) -> Result<InputQuality, EthercatError> {
        let lengths = [(OUTPUT_LEN, outputs.len()), (INPUT_LEN, inputs.len())];
        if let Some((expected, found)) = lengths.into_iter().find(|(want, have)| want != have) {
            return Err(EthercatError::ImageLength { expected, found });
        }
        self.segment.write_outputs(0, outputs);
        self.segment.exchange(now)?;
        if self.segment.is_blocked(0) {
            let position = self.segment.robots().first().map_or(0, |robot| robot.position);
            return Err(EthercatError::Replaced { position });
        }
        Ok(self.segment.read_inputs(0, inputs))
    }
}
