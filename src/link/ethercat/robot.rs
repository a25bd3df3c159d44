//! What stands on a segment, as the start found it.

use std::string::String;

use super::layout::Layout;
use crate::wire::ethercat::al::AlState;
use crate::wire::ethercat::identity::Identity;

/// Any subdevice of the segment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SubDeviceFound {
    /// Its place on the segment, counted from 0.
    pub position: u16,
    /// Vendor, product, revision and serial number from its SII.
    pub identity: Identity,
    /// Name from its SII.
    pub name: String,
    /// Station alias from its SII; 0 is none.
    pub alias: u16,
    /// Whether it has a clock that can give SYNC0.
    pub has_clock: bool,
    /// State it was in before the start.
    pub state_before: Option<AlState>,
    /// Number of the robot it is driven as, counted from 0.
    pub robot: Option<usize>,
}

/// A robot that is driven.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RobotFound {
    /// Its place on the segment, counted from 0.
    pub position: u16,
    /// Vendor, product, revision and serial number.
    pub identity: Identity,
    /// Station alias; 0 is none.
    pub alias: u16,
    /// Where its outputs lie.
    pub outputs: Layout,
    /// Where its inputs lie.
    pub inputs: Layout,
}

/// A subdevice and the group it was put into.
pub(super) struct Seat {
    pub(super) found: SubDeviceFound,
    /// Group, and place in that group.
    pub(super) place: Option<(usize, usize)>,
}
