//! Options of a main device on EtherCAT, for every command that is one.

use std::prelude::v1::*;

use clap::Args;

use crate::link::ethercat::{Assignment, Clocks, EthercatError, RobotChoice, SegmentSettings};
use crate::time::Duration;

/// How the segment is driven.
#[derive(Args, Debug)]
#[command(next_help_heading = "EtherCAT (--link ethercat:IFACE, --link ethercat-sim)")]
pub(super) struct EthercatOptions {
    /// Use distributed clocks: robots take their cycle from SYNC0, so many microseconds after the
    /// frame (a third of the cycle without a number). Cycles of 1000 us and more.
    #[arg(long, value_name = "SHIFT_US", num_args = 0..=1, require_equals = true)]
    clocks: Option<Option<u64>>,
    /// Process data watchdog of the robots: without outputs for so long they fall to SAFE-OP.
    /// Without it they keep their own, 100 ms at power-up.
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u64).range(1..=6_500))]
    watchdog_ms: Option<u64>,
    #[command(flatten)]
    reply_limit: ReplyLimit,
    /// Take the PDO assignment of the robots as it is instead of writing it.
    #[arg(long)]
    keep_assignment: bool,
    /// Start although another main device drives the segment; its robots stop.
    #[arg(long)]
    take_over: bool,
}

impl EthercatOptions {
    /// The first option that was given, if one was.
    pub(super) const fn given(&self) -> Option<&'static str> {
        match self {
            Self { clocks: Some(_), .. } => Some("--clocks"),
            Self { watchdog_ms: Some(_), .. } => Some("--watchdog-ms"),
            Self { reply_limit: ReplyLimit { reply_limit_us: Some(_) }, .. } => {
                Some("--reply-limit-us")
            }
            Self { keep_assignment: true, .. } => Some("--keep-assignment"),
            Self { take_over: true, .. } => Some("--take-over"),
            _ => None,
        }
    }

    /// Refuses clocks that no cycle of `cycle_us` can have.
    pub(super) fn check(&self, cycle_us: u64) -> Result<(), String> {
        match self.clocks {
            Some(Some(shift_us)) if shift_us >= cycle_us => Err(format!(
                "--clocks={shift_us}: SYNC0 comes within the cycle of {cycle_us} us (--cycle-us)"
            )),
            Some(_) if cycle_us < SHORTEST_SYNC0_US => Err(format!(
                "--clocks: a robot takes SYNC0 every {SHORTEST_SYNC0_US} us or less often, the cycle is \
                 {cycle_us} us (--cycle-us)"
            )),
            _ => Ok(()),
        }
    }

    /// The settings of a segment with these robots and this cycle.
    pub(super) fn settings(&self, robots: RobotChoice, cycle_us: u64) -> SegmentSettings {
        let cycle = Duration::from_micros(cycle_us);
        let defaults = SegmentSettings::with_cycle(cycle);
        SegmentSettings {
            robots,
            reply_limit: self.reply_limit.of(cycle),
            watchdog: self.watchdog_ms.map(Duration::from_millis),
            clocks: match self.clocks {
                None => Clocks::Off,
                Some(None) => Clocks::Sync0 { shift: cycle / 3 },
                Some(Some(shift_us)) => Clocks::Sync0 { shift: Duration::from_micros(shift_us) },
            },
            assignment: if self.keep_assignment { Assignment::Keep } else { Assignment::Write },
            take_over: self.take_over,
            ..defaults
        }
    }
}

/// How long a cycle waits.
#[derive(Args, Debug)]
pub(super) struct ReplyLimit {
    /// How long a cycle waits for its frames, in microseconds; three quarters of a cycle, but not less
    /// than 5000, without it. On a machine without real time a frame is late more often than lost, and
    /// a late one costs less than a lost one.
    #[arg(long, value_name = "US", value_parser = clap::value_parser!(u64).range(50..=50_000))]
    reply_limit_us: Option<u64>,
}

impl ReplyLimit {
    /// Whether it was said.
    pub(super) const fn is_given(&self) -> bool {
        self.reply_limit_us.is_some()
    }

    /// What was said, or what fits this cycle.
    pub(super) fn of(&self, cycle: Duration) -> Duration {
        let patient = SegmentSettings::with_cycle(cycle).reply_limit.max(PATIENCE);
        self.reply_limit_us.map_or(patient, Duration::from_micros)
    }
}

/// Why a segment cannot be driven, with the option that helps where there is one.
pub(super) fn explained(error: EthercatError) -> String {
    let option = match error {
        EthercatError::Driven { .. } => "; --take-over does that",
        _ => "",
    };
    format!("{error}{option}")
}

/// How long a cycle waits for its frames at least, unless it is told otherwise.
const PATIENCE: Duration = Duration::from_millis(5);

/// Shortest SYNC0 cycle of a Meca500, in us. Source: capture.
pub(super) const SHORTEST_SYNC0_US: u64 = 1_000;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_that_somebody_drives_is_told_with_the_option_that_takes_it_over() {
        let text = explained(EthercatError::Driven { position: 2 });
        assert!(text.contains("position 2 is in OP"), "{text}");
        assert!(text.ends_with("; --take-over does that"), "{text}");
        assert!(!explained(EthercatError::Silent).contains("--take-over"));
    }
}
