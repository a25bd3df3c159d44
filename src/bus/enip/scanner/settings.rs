//! What a connection shall be like.

use crate::bus::enip::ConnectionKind;
use crate::time::Duration;
use crate::wire::enip::parameters::{Priority, TimeoutMultiplier};
use crate::wire::enip::path::ElectronicKey;

/// Which configuration assembly the path names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConfigPath {
    Named(u32),
    None,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum T2oType {
    Unicast,
    Multicast,
}

/// Who opens the connections: vendor number and serial number of the scanner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Originator {
    pub vendor: u16,
    pub serial: u32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConnectionSettings {
    pub kind: ConnectionKind,
    /// Assemblies 150 and 100 of the robot; the heartbeat points for input-only and listen-only.
    pub o2t_assembly: u32,
    pub t2o_assembly: u32,
    /// Image lengths without sequence count and header: 60 and 252. Heartbeats have none.
    pub o2t_len: u16,
    pub t2o_len: u16,
    /// Which path is tried first.
    pub config: ConfigPath,
    /// Whether the other one is tried when the path is refused.
    pub tries_other_config: bool,
    pub key: Option<ElectronicKey>,
    pub o2t_rpi: Duration,
    pub t2o_rpi: Duration,
    pub multiplier: TimeoutMultiplier,
    pub t2o_type: T2oType,
    pub priority: Priority,
    /// UDP port of our I/O socket; told to the target in a socket address item when it is not 2222.
    pub io_port: u16,
    /// Time for each step of opening.
    pub step_limit: Duration,
    /// Pause before the next attempt, doubled up to the longest.
    pub first_retry: Duration,
    pub longest_retry: Duration,
    /// Whether a refusal that time alone does not mend is tried again too.
    pub retries_permanent: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Mistake {
    #[error("todo")]
    Interval,
    #[error("todo")]
    Length,
}
