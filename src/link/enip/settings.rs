//! What the user decides about a segment before it starts.

use core::net::SocketAddrV4;
use std::vec::Vec;

use super::error::EnipError;
use crate::bus::enip::scanner::{ConnectionSettings, Originator};
use crate::time::Duration;

/// Most robots that one segment drives.
///
/// Source: choice; at 10 ms each sends and receives 100 frames a second.
pub const MAX_TARGETS: usize = 256;

/// A robot to be driven.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetSettings {
    /// Where it is reached over TCP; the port is usually [`MESSAGE_PORT`](crate::wire::enip::MESSAGE_PORT).
    pub address: SocketAddrV4,
    /// What its connection shall be like. Its `io_port` is overwritten with that of the network.
    pub connection: ConnectionSettings,
}

/// How a segment is started and cycled.
#[derive(Clone, Debug, PartialEq)]
pub struct EnipSettings {
    /// The robots, in the order of their numbers; 1 to [`MAX_TARGETS`].
    pub targets: Vec<TargetSettings>,
    /// Who opens the connections.
    pub originator: Originator,
    /// Something that differs from process to process, so that connection ids and serial numbers do not
    /// repeat: a target refuses those of a connection that it believes to be open.
    pub seed: u64,
    /// Time between two exchanges. Frames that become due within half of it are sent by the exchange
    /// before, so that a caller whose cycle is the API sends one frame in each exchange.
    pub cycle: Duration,
    /// How long the start may take until the inputs of every robot arrive.
    pub start_limit: Duration,
}

impl EnipSettings {
    /// What is wrong with the settings, if something is.
    pub(super) fn mistake(&self) -> Option<EnipError> {
        if self.targets.is_empty() {
            return Some(EnipError::NoTarget);
        }
        if self.targets.len() > MAX_TARGETS {
            return Some(EnipError::TooManyTargets { wanted: self.targets.len() });
        }
        if self.cycle.is_zero() {
            return Some(EnipError::Settings(
                "the cycle is 0: give the time between two exchanges",
            ));
        }
        if self.start_limit.is_zero() {
            return Some(EnipError::Settings("the limit for the start is 0: give it some seconds"));
        }
        None
    }
}
