//! What the user decides about a segment before it starts.

use std::vec::Vec;

use super::error::EthercatError;
use crate::time::Duration;

/// Most robots that one segment drives: four frames of four.
///
/// Source: choice. At 1 ms the wire carries 38.
pub const MAX_ROBOTS: usize = 16;

/// Which subdevice is a robot to be driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RobotAddress {
    /// By its place on the segment, counted from 0, the other subdevices included.
    Position(u16),
    /// By the station alias in its SII; 0 is no alias.
    Alias(u16),
}

impl core::fmt::Display for RobotAddress {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Position(position) => write!(f, "position {position}"),
            Self::Alias(alias) => write!(f, "alias {alias}"),
        }
    }
}

/// The robots of a segment that are driven; every other subdevice stays in PRE-OP.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RobotChoice {
    /// Every Meca500 there is, in the order of the segment.
    All,
    /// The first so many Meca500, in the order of the segment.
    First(usize),
    /// Exactly these, in this order.
    These(Vec<RobotAddress>),
}

/// Whether the PDO assignment is written at the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Assignment {
    /// 1C12h and 1C13h are written with all PDOs of the image, as real robots want it (AL status
    /// 0x0025 otherwise). What the robot reports afterwards counts.
    #[default]
    Write,
    /// What the robot reports is taken as it is.
    Keep,
}

/// Distributed clocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Clocks {
    /// Robots take their cycle from the arrival of outputs.
    #[default]
    Off,
    /// Robots take their cycle from SYNC0, one cycle time apart; all share one clock.
    Sync0 {
        /// Time from the beginning of a cycle to SYNC0, less than a cycle time.
        shift: Duration,
    },
}

/// How a segment is started and cycled.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SegmentSettings {
    /// The robots to drive.
    pub robots: RobotChoice,
    /// Time between two exchanges. It paces the start, is the cycle time of SYNC0, and tells whether
    /// a caller was late.
    pub cycle: Duration,
    /// How long an exchange waits for its frames. Later ones count as lost.
    pub reply_limit: Duration,
    /// Process data watchdog of the robots, in steps of 100 us up to 6.5 s; `None` leaves what the
    /// robot has (100 ms at power-up). A robot that gets no outputs for so long falls to SAFE-OP.
    pub watchdog: Option<Duration>,
    /// Distributed clocks.
    pub clocks: Clocks,
    /// Whether the PDO assignment is written.
    pub assignment: Assignment,
    /// Send zeros instead of what the caller writes, except which dynamic data are wanted: for
    /// looking on without taking part.
    pub monitor_only: bool,
    /// Start although a subdevice is in OP, which means that another main device drives it.
    pub take_over: bool,
    /// How long one attempt to start may take, robots' own time to change state included.
    pub start_limit: Duration,
}

impl Default for SegmentSettings {
    /// All robots, 1 ms, no clocks, the robot's own watchdog.
    fn default() -> Self {
        Self::with_cycle(Duration::from_millis(1))
    }
}

impl SegmentSettings {
    /// What is wrong with the settings, if something is.
    pub(super) fn mistake(&self) -> Option<EthercatError> {
        let shift = match self.clocks {
            Clocks::Off => Duration::ZERO,
            Clocks::Sync0 { shift } => shift,
        };
        let longest = Duration::from_nanos(u32::MAX.into());
        let wrong = [
            (self.cycle.is_zero(), "the cycle is 0"),
            (self.cycle > longest, "the cycle is longer than the 4.2 s that SYNC0 can have"),
            (self.reply_limit.is_zero(), "reply_limit is 0: no frame could come back in time"),
            (shift >= self.cycle, "the shift of SYNC0 is not within the cycle"),
        ];
        let found = wrong.into_iter().find(|(is_wrong, _)| *is_wrong);
        found.map(|(_, what)| EthercatError::Settings(what))
    }

    /// The default settings at this cycle time.
    #[must_use]
    pub fn with_cycle(cycle: Duration) -> Self {
        Self {
            robots: RobotChoice::All,
            cycle,
            // What is left pays for the engine and for being woken late.
            reply_limit: cycle * 3 / 4,
            watchdog: None,
            clocks: Clocks::Off,
            assignment: Assignment::Write,
            monitor_only: false,
            take_over: false,
            start_limit: Duration::from_secs(30),
        }
    }
}
