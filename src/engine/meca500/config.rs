//! Settings of one engine.

use crate::time::Duration;
use crate::wire::meca500::image::FirmwareLayout;
use crate::wire::meca500::revision::Revision;
use crate::wire::order::ByteOrder;

/// How [`Engine::cycle_bytes`](super::Engine::cycle_bytes) reads the images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ByteOrderSetting {
    /// Decide from what arrives while the outputs are still zero.
    #[default]
    Auto,
    /// As told.
    Fixed(ByteOrder),
}

/// When the engine places a checkpoint of its own behind queued commands. A command counts as done
/// when a checkpoint behind it is reached, so this sets how fine completion is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CheckpointPolicy {
    /// Behind every queued command: exact, and half the commands per second.
    EachCommand,
    /// Behind every so many queued commands, and behind the last one when none is waiting.
    Every(u16),
    /// Only behind the last one when none is waiting.
    WhenEmpty,
}

/// Checkpoint numbers the engine keeps for itself, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CheckpointRange {
    /// First number, at least 1.
    pub first: u16,
    /// Last number, above the first and at most 8000.
    pub last: u16,
}

impl CheckpointRange {
    const DEFAULT: Self = Self { first: 7000, last: 7999 };

    /// Whether `number` belongs to the engine.
    #[must_use]
    pub const fn contains(&self, number: u16) -> bool {
        self.first <= number && number <= self.last
    }

    /// Itself where it lies within 1 to 8000 and holds two numbers or more, else the default.
    pub(super) const fn usable(self) -> Self {
        if self.first >= 1 && self.first < self.last && self.last <= 8000 {
            self
        } else {
            Self::DEFAULT
        }
    }
}

/// Time limits of the actions. A limit that passes ends the action as failed, never as done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ActionLimits {
    /// Activation.
    pub activate: Duration,
    /// Deactivation.
    pub deactivate: Duration,
    /// Homing; the motion itself takes three seconds (PM L334).
    pub home: Duration,
    /// Resetting an error.
    pub reset_error: Duration,
    /// Resuming, with the wait for safety signals to become resettable.
    pub resume: Duration,
    /// Pausing.
    pub pause: Duration,
    /// Clearing.
    pub clear: Duration,
    /// Simulation, recovery mode, brakes, host time, clearing the homing.
    pub setting: Duration,
    /// Rebooting, until the robot is back.
    pub reboot: Duration,
}

/// Settings of an [`Engine`](super::Engine); `Default` is meant for a 1 to 10 ms cycle.
///
/// Counts of cycles mean cycles with fresh inputs. All of them are waited for at least once, so 0
/// acts as 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// How `cycle_bytes` reads the images.
    pub byte_order: ByteOrderSetting,
    /// Time after which `auto` gives up and says so (it goes on listening).
    pub byte_order_timeout: Duration,
    /// Layout of the images.
    pub layout: FirmwareLayout,
    /// Hardware revision: sets the argument limits.
    pub revision: Revision,
    /// Cycles of zeros before the connection counts as made, and before an unacknowledged command
    /// of a lost connection is judged, and after any bad cycle before the next command is sent. Must
    /// cover the longest time a frame may be under way.
    pub settle_cycles: u16,
    /// Cycles the arming "no movement" command waits for its echo before real commands follow; an
    /// echo ends the wait at once. Must cover one way to the robot.
    pub arm_cycles: u16,
    /// Cycles a withdrawn command (SetPoint dropped) is watched for a late echo.
    pub withdraw_cycles: u16,
    /// Time within which a command must be acknowledged.
    pub ack_timeout: Duration,
    /// Consecutive bad cycles after which outputs go safe and the connection counts as lost.
    pub bad_cycles_limit: u16,
    /// Consecutive bad cycles after which a velocity motion is stopped.
    pub velocity_bad_cycles_limit: u16,
    /// Consecutive cycles with a clock that went back before it counts as a reboot.
    pub reboot_confirm_cycles: u8,
    /// First MoveID; `None` takes one from the robot's clock, so that two runs of a PLC differ.
    pub first_move_id: Option<u16>,
    /// When automatic checkpoints are placed.
    pub checkpoints: CheckpointPolicy,
    /// Numbers of the automatic checkpoints; an unusable range acts as the default 7000 to 7999.
    /// Offline programs must not use them either.
    pub checkpoint_range: CheckpointRange,
    /// Cycles ResumeMotion and ClearMotion stay set at least.
    pub edge_hold_cycles: u16,
    /// Cycles a trigger bit stays 0 before any trigger bit rises again.
    pub edge_low_cycles: u16,
    /// Time after the last `set_velocity` at which the motion is stopped.
    pub velocity_dead_man: Duration,
    /// Cycles after the last `set_velocity` at which the motion is stopped whatever the time.
    pub velocity_dead_man_cycles: u16,
    /// Cycles with SetPoint 0 between modes and between velocity commands of different IDs.
    pub mode_gap_cycles: u16,
    /// Whether [`Action::Brakes`](super::Action::Brakes) is allowed: released brakes let the arm fall.
    pub allow_brakes: bool,
    /// Cycles HostTime is shown to the robot.
    pub host_time_cycles: u16,
    /// Cycles a dynamic slot waits for its type before the next one gets its turn.
    pub dynamic_patience_cycles: u16,
    /// Time limits of the actions.
    pub limits: ActionLimits,
}

impl Default for ActionLimits {
    fn default() -> Self {
        Self {
            activate: Duration::from_secs(30),
            deactivate: Duration::from_secs(10),
            home: Duration::from_secs(60),
            reset_error: Duration::from_secs(5),
            resume: Duration::from_secs(5),
            pause: Duration::from_secs(2),
            clear: Duration::from_secs(2),
            setting: Duration::from_secs(5),
            reboot: Duration::from_secs(180),
        }
    }
}

impl Default for Config {
    fn default() -> Self {
        Self {
            byte_order: ByteOrderSetting::Auto,
            byte_order_timeout: Duration::from_secs(5),
            layout: FirmwareLayout::V11_3,
            revision: Revision::R3,
            settle_cycles: 8,
            arm_cycles: 16,
            withdraw_cycles: 16,
            ack_timeout: Duration::from_secs(1),
            bad_cycles_limit: 20,
            velocity_bad_cycles_limit: 2,
            reboot_confirm_cycles: 2,
            first_move_id: None,
            checkpoints: CheckpointPolicy::Every(16),
            checkpoint_range: CheckpointRange::DEFAULT,
            edge_hold_cycles: 4,
            edge_low_cycles: 4,
            velocity_dead_man: Duration::from_millis(100),
            velocity_dead_man_cycles: 1_000,
            mode_gap_cycles: 1,
            allow_brakes: false,
            host_time_cycles: 10,
            dynamic_patience_cycles: 20,
            limits: ActionLimits::default(),
        }
    }
}
