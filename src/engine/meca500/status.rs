//! Snapshots for callers: where the engine stands and what it has counted.

use super::Engine;
use super::Purge;
use super::connection::Phase;
use super::handshake::Port;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::image::{MotionStatusFlags, RobotStatusFlags, SafetySignals};

/// Where the connection stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConnectionPhase {
    /// No fresh inputs, or not enough of them yet; outputs are zero.
    Offline,
    /// Inputs are fresh; zeros are shown, and the byte order is found.
    Settling,
    /// The connection only allows monitoring; outputs are zero.
    Monitoring,
    /// Commands can go out.
    Connected,
}

/// Counters since the engine was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Commands written to the image, checkpoints and steps of actions included.
    pub sent: u64,
    /// Tickets the robot took.
    pub accepted: u64,
    /// Checkpoints the engine placed.
    pub automatic_checkpoints: u64,
    /// Echoes counted in the latencies below.
    pub acknowledged: u64,
    /// Fewest cycles from a command to its echo; 0 before the first one.
    pub ack_latency_min_cycles: u32,
    /// Most cycles from a command to its echo.
    pub ack_latency_max_cycles: u32,
    /// Sum of the cycles from each command to its echo.
    pub ack_latency_sum_cycles: u64,
    /// Echoes that did not come in time.
    pub ack_timeouts: u64,
    /// Calls of `cycle`.
    pub cycles: u64,
    /// Cycles whose inputs were not used: stale, lost, blank, or with an odd clock.
    pub bad_cycles: u64,
    /// Connections made.
    pub connections: u64,
    /// Reboots of the robot seen.
    pub reboots: u64,
}

impl Statistics {
    #[inline]
    pub(super) fn acknowledged(&mut self, latency_cycles: u32) {
        self.ack_latency_min_cycles = if self.acknowledged == 0 {
            latency_cycles
        } else {
            self.ack_latency_min_cycles.min(latency_cycles)
        };
        self.ack_latency_max_cycles = self.ack_latency_max_cycles.max(latency_cycles);
        self.ack_latency_sum_cycles += u64::from(latency_cycles);
        self.acknowledged += 1;
    }
}

/// A snapshot of the engine and of the robot as last seen in good inputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status {
    /// Where the connection stands.
    pub phase: ConnectionPhase,
    /// State bits of the robot.
    pub robot: RobotStatusFlags,
    /// Motion bits of the robot.
    pub motion: MotionStatusFlags,
    /// ErrorCode; 0 if there is none.
    pub error: Code,
    /// Safety signals that are 1, the deprecated bits included.
    pub stops: SafetySignals,
    /// Those of them that ResumeMotion cannot reset now.
    pub blocking_stops: SafetySignals,
    /// FifoSpace.
    pub fifo_space: u16,
    /// The robot's echo of MoveID.
    pub move_id: u16,
    /// CheckpointReached as shown, the engine's own included.
    pub checkpoint_reached: u32,
    /// Whether queued commands would be executed: ready for motion, not paused, and nothing left
    /// in the robot's queue that [`Action::Resume`](super::Action::Resume) has to clear first.
    pub ready: bool,
    /// Submitted commands that were not sent.
    pub waiting: u32,
    /// Whether a command waits for its echo.
    pub unacknowledged: bool,
    /// Commands the robot took and has not finished.
    pub on_robot: u32,
    /// Submitted commands whose final event was not polled.
    pub pending: usize,
    /// Whether the robot is in velocity mode.
    pub velocity_mode: bool,
    /// Whether an action is pending.
    pub acting: bool,
}

impl<const QUEUE: usize> Engine<QUEUE> {
    /// Where everything stands after the last cycle.
    #[must_use]
    pub fn status(&self) -> Status {
        let inputs = &self.inputs;
        Status {
            phase: match self.phase {
                Phase::Offline => ConnectionPhase::Offline,
                Phase::Settling { .. } => ConnectionPhase::Settling,
                Phase::Monitoring => ConnectionPhase::Monitoring,
                Phase::Ready => ConnectionPhase::Connected,
            },
            robot: inputs.robot,
            motion: inputs.motion,
            error: Code(inputs.error_code),
            stops: inputs.stops,
            blocking_stops: inputs.blocking_stops(),
            fifo_space: inputs.fifo_space,
            move_id: inputs.move_id,
            checkpoint_reached: inputs.reached,
            ready: self.is_connected()
                && inputs.ready_for_motion()
                && !inputs.paused()
                && self.purge == Purge::No,
            waiting: self.waiting_live(),
            unacknowledged: self.in_flight.is_some(),
            on_robot: self.ledger.live(),
            pending: self.pending,
            velocity_mode: self.port == Port::Velocity,
            acting: self.actions.is_acting(),
        }
    }

    /// What has been counted.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        let mut statistics = self.statistics;
        statistics.cycles = self.cycles;
        statistics
    }
}
