//! The segment that a run drives, behind whichever link was chosen.

use core::convert::Infallible;
use std::prelude::v1::*;

use super::exit::Failure;
use super::link_choice::LinkChoice;
use super::virtual_robot::{self, SimArgs};
use crate::cycle::{CyclicSegment, InputQuality};
use crate::link::direct::DirectSegment;
use crate::run::outcome::LinkMessage;
use crate::sim::meca500::VirtualRobot;
use crate::time::Instant;
use crate::wire::meca500::revision::Revision;

/// Any of the segments a run can drive. A cycle costs one `match`, and no memory.
#[derive(Debug)]
pub(super) enum Segment {
    /// Virtual robots without a bus.
    Direct(DirectSegment<VirtualRobot>),
}

/// Opens the segment behind `link` with so many robots on it, ready for its first exchange.
pub(super) fn open_segment(
    link: &LinkChoice,
    robots: usize,
    sim: &SimArgs,
    revision: Revision,
) -> Result<Segment, Failure> {
    match link {
        LinkChoice::Sim => {
            let order = link.sim_byte_order();
            let devices = (0..robots).map(|_| virtual_robot::new(sim, order, revision));
            Ok(Segment::Direct(DirectSegment::new(devices)))
        }
        LinkChoice::EthercatSim | LinkChoice::Ethercat { .. } => Err(Failure::link(format!(
            "--link {link} is not built yet; for now only --link sim has robots"
        ))),
    }
}

impl CyclicSegment for Segment {
    type Error = LinkMessage;

    fn robot_count(&self) -> usize {
        match self {
            Self::Direct(segment) => segment.robot_count(),
        }
    }

    fn write_outputs(&mut self, robot: usize, outputs: &[u8]) {
        match self {
            Self::Direct(segment) => segment.write_outputs(robot, outputs),
        }
    }

    fn exchange(&mut self, now: Instant) -> Result<(), LinkMessage> {
        match self {
            Self::Direct(segment) => {
                segment.exchange(now).map_err(|error: Infallible| match error {})
            }
        }
    }

    fn read_inputs(&self, robot: usize, inputs: &mut [u8]) -> InputQuality {
        match self {
            Self::Direct(segment) => segment.read_inputs(robot, inputs),
        }
    }
}
