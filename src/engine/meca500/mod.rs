//! The PLC side of a Meca500: owns MoveID, the trigger bits, and the fate of every command.
//!
//! Read `connection.rs` first (the life of a connection and the order of a cycle), then
//! `handshake.rs` (one command at a time, exactly once), `ledger.rs` (what is finished),
//! `action.rs` with `bits.rs` (activate, home, resume ...), `velocity.rs`, `dynamic.rs`.
//!
//! ```text
//!            submit                    echo                       checkpoint
//!   caller ----------> waiting ----> in flight ----> ledger ----------------> Done
//!                         |              |              |
//!                         +--------------+--------------+---> Aborted, Unknown
//! ```
//!
//! [`Engine::cycle`] is the whole contact with the bus, once per bus cycle. It allocates nothing,
//! never panics, and its work is bounded (see `connection.rs`).
//!
//! Invariants: every ticket ends in exactly one of `Done`, `Aborted`, `Unknown`; nothing is sent to the
//! robot twice; outputs are zero until inputs are fresh, the byte order is settled and the robot takes
//! control from this connection, and zero again when inputs stay bad.
//!
//! Left out: UseVariables (not on EtherCAT, and its rules are open), and recording of programs, which
//! is TCP only.
//!
//! ```
//! use fieldarm::cycle::InputQuality;
//! use fieldarm::engine::meca500::{Config, Engine};
//! use fieldarm::time::Instant;
//! use fieldarm::wire::meca500::command::MotionCommand;
//! use fieldarm::wire::meca500::image::{InputImage, OutputImage};
//! use fieldarm::wire::order::Big;
//!
//! let mut engine = Engine::<64>::new(Config::default());
//! let ticket = engine.submit(MotionCommand::MoveJoints([0.0; 6]))?;
//! let inputs = InputImage::<Big>::zeroed();
//! let mut outputs = OutputImage::<Big>::zeroed();
//! engine.cycle(Instant::from_millis(1), InputQuality::Fresh, &inputs, &mut outputs);
//! assert!(!outputs.motion_control.flags.get().bits() != 0, "nothing is sent yet");
//! assert_eq!(engine.pending(), 1);
//! # assert_eq!(ticket.number(), 1);
//! # Ok::<(), fieldarm::engine::meca500::SubmitError>(())
//! ```

mod action;
mod bits;
mod clock;
mod config;
mod connection;
mod doubt;
mod dynamic;
mod event;
mod handshake;
mod inputs;
mod ledger;
mod order;
mod order_evidence;
mod outputs;
mod ring;
mod status;
mod ticket;
mod velocity;
mod watch;

pub use action::Action;
pub use config::{ActionLimits, ByteOrderSetting, CheckpointPolicy, CheckpointRange, Config};
pub use dynamic::DynamicReading;
pub use event::{AbortReason, Event, Fault, UnknownCause, VelocityStop, WaitReason};
pub use order_evidence::{Echo, OrderEvidence, OrderProbe, OrderReading, REALS_READ};
pub use status::{ConnectionPhase, Statistics, Status};
pub use ticket::{RequestError, SubmitError, SubscribeError, Ticket};

use core::mem::offset_of;

use crate::cycle::InputQuality;
use crate::time::Instant;
use crate::wire::meca500::image::{FirmwareLayout, InputImage, OutputImage};
use crate::wire::order::{ByteOrder, ImageOrder};
use inputs::Inputs;

/// FifoSpace of an empty motion queue. Source: PM L1423.
const FIFO_SPACE_MAX: u16 = 13_000;

/// Whether the robot's queue must be cleared before motion resumes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Purge {
    No,
    /// Unless the robot itself says that its queue was cleared.
    UnlessCleared,
    /// Even if it says so: it took a command afterwards.
    Always,
}

/// What every cycle needs of the configuration, apart from what special cycles need.
#[derive(Clone, Copy, Debug)]
struct Pace {
    ack_timeout_ns: u64,
    checkpoints: CheckpointPolicy,
    layout: FirmwareLayout,
    reboot_confirm_cycles: u8,
}

/// The PLC side of one robot. `QUEUE` commands can wait to be sent.
// Thousands of engines do not fit into a cache: what a cycle costs is how many cache lines it touches.
// So the order of the fields is their order in memory: first what only special cycles touch, then what
// every cycle touches, then the rings, of which a cycle touches one place. Counted with a simulated
// cache of 1 MiB, images included: 18.3 lines a streaming cycle, 19.3 where the compiler orders the
// fields of this struct, 22.9 before the parts below were ordered and their entries packed. The last
// line is within the noise of the clock; the order is fixed so that the count stays what it is.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Engine<const QUEUE: usize = 64> {
    config: Config,
    detector: order::Detector,
    /// The command without an echo when the connection was lost.
    suspect: Option<handshake::InFlight>,
    dynamic: dynamic::Dynamic,
    velocity: velocity::Velocity,
    pace: Pace,
    now: Instant,
    cycles: u64,
    clock: clock::RobotClock,
    /// The newest inputs that could be trusted.
    inputs: Inputs,
    watch: watch::Watch,
    outputs: outputs::Outputs,
    order: Option<ByteOrder>,
    phase: connection::Phase,
    bad_cycles: u32,
    /// Fresh cycles for which outputs of before a bad one may still be under way.
    overtaken: u16,
    port: handshake::Port,
    /// Cycles whose image had SetPoint 0.
    set_point_low: u16,
    /// The MoveID used last.
    move_id: u16,
    /// Why nothing is sent until the caller decides.
    halted: Option<WaitReason>,
    purge: Purge,
    /// Whether the robot could hold motion commands in the cycle before.
    had_motion: bool,
    /// Reasons for waiting that were said, one bit each.
    said_waiting: u32,
    /// Own checkpoints in a row that were never acknowledged.
    marks_unanswered: u8,
    /// Cycles in which the robot looked idle, while its queue may be an earlier PLC's.
    foreign_idle: u16,
    next_ticket: u32,
    /// Index of the command to be submitted next.
    waiting_next: u32,
    /// Waiting commands below are dropped or gone.
    waiting_dead: u32,
    /// Waiting commands below are lost when the robot's queue is lost.
    waiting_motion: u32,
    pending: usize,
    in_flight: Option<handshake::InFlight>,
    statistics: Statistics,
    actions: action::Actions,
    waiting: ring::Ring<handshake::Waiting, QUEUE>,
    ledger: ledger::Ledger,
    events: event::Events,
}

/// The fields of every cycle, from the velocity up to the actions, stay within seven cache lines.
const _: () = assert!(offset_of!(Engine, actions) - offset_of!(Engine, velocity) <= 7 * 64);

impl<const QUEUE: usize> Engine<QUEUE> {
    /// An engine that has seen nothing yet. All memory it will ever use is inside.
    #[must_use]
    pub fn new(config: Config) -> Self {
        Self {
            now: Instant::ZERO,
            cycles: 0,
            phase: connection::Phase::Offline,
            bad_cycles: 0,
            overtaken: 0,
            set_point_low: 0,
            inputs: Inputs::default(),
            outputs: outputs::Outputs::default(),
            clock: clock::RobotClock::default(),
            watch: watch::Watch::default(),
            port: handshake::Port::Closed,
            move_id: 0,
            in_flight: None,
            suspect: None,
            halted: None,
            purge: Purge::No,
            had_motion: false,
            said_waiting: 0,
            waiting_next: 0,
            waiting_dead: 0,
            waiting_motion: 0,
            marks_unanswered: 0,
            foreign_idle: 0,
            next_ticket: 1,
            pending: 0,
            velocity: velocity::Velocity::default(),
            actions: action::Actions::new(),
            statistics: Statistics::default(),
            order: Self::order_of(config.byte_order),
            detector: order::Detector::default(),
            dynamic: dynamic::Dynamic::new(),
            ledger: ledger::Ledger::new(config.checkpoint_range),
            waiting: ring::Ring::new(handshake::Waiting::NONE),
            events: event::Events::new(),
            pace: Pace {
                ack_timeout_ns: config.ack_timeout.as_nanos().try_into().unwrap_or(u64::MAX),
                checkpoints: config.checkpoints,
                layout: config.layout,
                reboot_confirm_cycles: config.reboot_confirm_cycles,
            },
            config,
        }
    }

    /// The configuration.
    #[must_use]
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// One bus cycle: looks at `inputs` as far as `quality` allows, and fills `outputs`.
    ///
    /// The byte order is that of the images; the setting of the configuration is for
    /// [`cycle_bytes`](Self::cycle_bytes).
    #[inline]
    pub fn cycle<O: ImageOrder>(
        &mut self,
        now: Instant,
        quality: InputQuality,
        inputs: &InputImage<O>,
        outputs: &mut OutputImage<O>,
    ) {
        self.order = Some(O::VALUE);
        let fields = Inputs::read(inputs, self.pace.layout);
        self.step(now, quality, &fields);
        if self.is_connected() {
            if self.bad_cycles == 0 {
                self.dynamic.take(inputs, now);
            }
            self.dynamic.schedule(now, &self.config, &mut self.outputs);
        }
        self.outputs.write(outputs);
    }
}
