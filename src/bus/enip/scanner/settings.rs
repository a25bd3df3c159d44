//! What a connection shall be like.

use super::MAX_IMAGE_LEN;
use crate::bus::enip::{ConnectionKind, INPUT_ONLY_POINT, LISTEN_ONLY_POINT};
use crate::time::Duration;
use crate::wire::enip::IO_PORT;
use crate::wire::enip::parameters::{Priority, RUN_IDLE_LEN, SEQUENCE_LEN, TimeoutMultiplier};
use crate::wire::enip::path::ElectronicKey;
use crate::wire::meca500::adapter::{
    CONFIG_ASSEMBLY, INPUT_ASSEMBLY, INPUT_ASSEMBLY_LEN, MIN_RPI_US, MONITORING_BIT,
    OUTPUT_ASSEMBLY, OUTPUT_ASSEMBLY_LEN,
};

/// Which configuration assembly the path names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConfigPath {
    /// The one with this number: `20 04 24 97 2C 96 2C 64` for 151.
    Named(u32),
    /// None: `20 04 2C 96 2C 64`.
    None,
}

impl ConfigPath {
    /// What is tried when the path with this one is refused: a path without, or with the robot's assembly.
    pub(super) const fn other(self) -> Self {
        match self {
            Self::Named(_) => Self::None,
            Self::None => Self::Named(CONFIG_ASSEMBLY),
        }
    }

    pub(super) const fn number(self) -> Option<u32> {
        match self {
            Self::Named(number) => Some(number),
            Self::None => None,
        }
    }
}

/// How the target's frames travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum T2oType {
    /// To the scanner alone.
    Unicast,
    /// To a group that the target names, for every scanner that opened such a connection.
    Multicast,
}

/// Who opens the connections: vendor number and serial number of the scanner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Originator {
    /// Vendor number as ODVA gives it out.
    pub vendor: u16,
    /// Serial number; two scanners that reach the same target must not have the same.
    pub serial: u32,
}

/// What a connection shall be like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConnectionSettings {
    /// What it may do with the robot.
    pub kind: ConnectionKind,
    /// Assembly 150 of the robot; the heartbeat points for input-only and listen-only.
    pub o2t_assembly: u32,
    /// Assembly 100 of the robot.
    pub t2o_assembly: u32,
    /// Bytes of the output image, without sequence count and header: 60, at most [`MAX_IMAGE_LEN`].
    /// Heartbeats have none.
    pub o2t_len: u16,
    /// Bytes of the input image, without sequence count: 252, at most [`MAX_IMAGE_LEN`].
    pub t2o_len: u16,
    /// Which path is tried first.
    pub config: ConfigPath,
    /// Whether the other one is tried when the path is refused: without a configuration assembly if `config`
    /// names one, with assembly 151 if it does not.
    pub tries_other_config: bool,
    /// Which device is expected; `None` sends no key, all zeros is a wildcard.
    pub key: Option<ElectronicKey>,
    /// Requested interval of the frames to the target; whole us, up to 4294 s.
    pub o2t_rpi: Duration,
    /// Requested interval of the frames from the target; whole us, up to 4294 s.
    pub t2o_rpi: Duration,
    /// How many intervals without a frame end the connection, in both directions.
    pub multiplier: TimeoutMultiplier,
    /// How the target's frames travel.
    pub t2o_type: T2oType,
    /// Bit of the input image that is 1 while the connection only watches, counted from bit 0 of the first byte. An
    /// owner whose outputs do not arrive may go on receiving what the target produces to a group for others:
    /// when its bit becomes 1 and stays so for the whole timeout, it has lost control, and its connection is
    /// opened again. `None`: the image has no such bit.
    ///
    /// Source: choice.
    pub monitoring_bit: Option<u16>,
    /// Priority of both directions.
    pub priority: Priority,
    /// UDP port of our I/O socket; told to the target in a socket address item when it is not 2222.
    pub io_port: u16,
    /// Time for each step of opening, and for an explicit request.
    pub step_limit: Duration,
    /// Pause before the next attempt, doubled after each failure up to the longest. Begins anew once frames
    /// have arrived.
    pub first_retry: Duration,
    /// Longest pause.
    pub longest_retry: Duration,
    /// Whether a refusal that time alone does not mend is tried again too.
    pub retries_permanent: bool,
}

impl ConnectionSettings {
    /// Controls a Meca500: assemblies 150 and 100 (60 and 252 bytes), configuration assembly 151 and without
    /// one if that is refused, no electronic key, 10 ms both ways, timeout after 16 intervals, T->O unicast.
    ///
    /// Source: choice; the assemblies are those of the vendor's published PLC projects.
    #[must_use]
    pub fn meca500() -> Self {
        let rpi = Duration::from_micros(u64::from(MIN_RPI_US));
        Self {
            kind: ConnectionKind::ExclusiveOwner,
            o2t_assembly: OUTPUT_ASSEMBLY,
            t2o_assembly: INPUT_ASSEMBLY,
            o2t_len: OUTPUT_ASSEMBLY_LEN,
            t2o_len: INPUT_ASSEMBLY_LEN,
            config: ConfigPath::Named(CONFIG_ASSEMBLY),
            tries_other_config: true,
            key: None,
            o2t_rpi: rpi,
            t2o_rpi: rpi,
            multiplier: TimeoutMultiplier::from_factor(16).unwrap_or_default(),
            t2o_type: T2oType::Unicast,
            monitoring_bit: Some(MONITORING_BIT),
            priority: Priority::Scheduled,
            io_port: IO_PORT,
            step_limit: Duration::from_secs(2),
            first_retry: Duration::from_millis(200),
            longest_retry: Duration::from_secs(5),
            retries_permanent: false,
        }
    }

    /// The same without outputs: receives inputs, whether the robot has an owner or not.
    #[must_use]
    pub const fn input_only(self) -> Self {
        Self { kind: ConnectionKind::InputOnly, o2t_assembly: INPUT_ONLY_POINT, o2t_len: 0, ..self }
    }

    /// The same without outputs: receives what is produced to a group for somebody else, as long as it is.
    #[must_use]
    pub const fn listen_only(self) -> Self {
        Self {
            kind: ConnectionKind::ListenOnly,
            o2t_assembly: LISTEN_ONLY_POINT,
            o2t_len: 0,
            t2o_type: T2oType::Multicast,
            ..self
        }
    }

    /// The same with another requested interval, in both directions.
    #[must_use]
    pub const fn with_rpi(self, rpi: Duration) -> Self {
        Self { o2t_rpi: rpi, t2o_rpi: rpi, ..self }
    }

    /// Bytes of O->T data with sequence count and header.
    pub(super) const fn o2t_size(&self) -> u16 {
        match self.kind {
            ConnectionKind::ExclusiveOwner => {
                self.o2t_len.saturating_add(SEQUENCE_LEN + RUN_IDLE_LEN)
            }
            ConnectionKind::InputOnly | ConnectionKind::ListenOnly => SEQUENCE_LEN,
        }
    }

    /// Bytes of T->O data with sequence count.
    pub(super) const fn t2o_size(&self) -> u16 {
        self.t2o_len.saturating_add(SEQUENCE_LEN)
    }

    pub(super) fn check(&self) -> Result<(), Mistake> {
        if rpi_us(self.o2t_rpi).is_none() || rpi_us(self.t2o_rpi).is_none() {
            return Err(Mistake::Interval);
        }
        let is_heartbeat = self.kind != ConnectionKind::ExclusiveOwner;
        let fits = |len| usize::from(len) <= MAX_IMAGE_LEN;
        if !fits(self.o2t_len) || !fits(self.t2o_len) || (is_heartbeat && self.o2t_len != 0) {
            return Err(Mistake::Length);
        }
        if self.step_limit.is_zero() || self.first_retry.is_zero() {
            return Err(Mistake::Limit);
        }
        Ok(())
    }
}

/// An interval in whole us, as it goes on the wire; `None` if it cannot.
pub(super) fn rpi_us(rpi: Duration) -> Option<u32> {
    let us = u32::try_from(rpi.as_micros()).ok().filter(|us| *us > 0)?;
    (Duration::from_micros(u64::from(us)) == rpi).then_some(us)
}

/// Settings that no connection can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Mistake {
    /// A requested interval is zero, too long, or not a whole number of us.
    #[error(
        "o2t_rpi or t2o_rpi: give a whole number of microseconds from 1 us to 4294 s (the robot takes 10 ms and more)"
    )]
    Interval,
    /// An image is too long, or a heartbeat has one.
    #[error(
        "o2t_len or t2o_len: give at most {MAX_IMAGE_LEN} bytes, and 0 for o2t_len of a connection that is input-only or listen-only"
    )]
    Length,
    /// A step may take no time, or nothing waits between two attempts.
    #[error("step_limit or first_retry: give more than zero")]
    Limit,
}
