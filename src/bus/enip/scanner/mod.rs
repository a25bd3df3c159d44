//! The PLC's side: one scanner, many targets, one UDP socket.

mod settings;

use core::net::{Ipv4Addr, SocketAddrV4};

pub use settings::{ConfigPath, ConnectionSettings, Mistake, Originator, T2oType};

use super::ConnectionKind;
use crate::cycle::InputQuality;
use crate::time::{Duration, Instant};
use crate::wire::enip::DecodeError;
use crate::wire::enip::encapsulation::EncapsulationStatus;
use crate::wire::enip::identity::Identity;
use crate::wire::enip::message::Service;
use crate::wire::enip::path::ObjectPath;
use crate::wire::enip::status::{ExtendedStatus, GeneralStatus};

/// What the I/O is to do. Bytes, if any, stand in the room given to [`Scanner::poll_transmit`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transmit {
    /// Connect TCP to the target's address; told back with `handle_connected` or `handle_disconnected`.
    Connect { target: usize },
    /// Send the first `len` bytes of the room on the target's TCP connection, all of them.
    Stream { target: usize, len: usize },
    /// Close the target's TCP connection; not told back.
    Disconnect { target: usize },
    /// Send the first `len` bytes from the I/O socket.
    Datagram { to: SocketAddrV4, len: usize },
    /// Receive frames sent to this group as well.
    JoinGroup { group: Ipv4Addr },
    /// No longer.
    LeaveGroup { group: Ipv4Addr },
}

/// Why a connection ended or could not be opened. Every variant has words with a remedy in `Display`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Trouble {
    /// No TCP connection to the target's address.
    #[error("todo")]
    Unreachable,
    /// The target does not answer an encapsulated request in time.
    #[error("todo")]
    NoAnswer { step: Step },
    /// It refuses the encapsulated request.
    #[error("todo")]
    Encapsulation { step: Step, status: EncapsulationStatus },
    /// It refuses the Forward Open (or another request).
    #[error("todo")]
    Refused { general: GeneralStatus, extended: Option<ExtendedStatus>, detail: Option<u16> },
    /// What it answered cannot be read.
    #[error("todo")]
    Malformed { step: Step, error: DecodeError },
    /// No T->O frame came for so long.
    #[error("todo")]
    TimedOut { after: Duration },
    /// The frames have another size than was agreed.
    #[error("todo")]
    FrameSize { expected: u16, found: u16 },
}

/// Steps of opening a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    Connect,
    RegisterSession,
    Identity,
    ForwardOpen,
    ForwardClose,
    Request,
}

/// What happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScannerEvent {
    /// The connection is open. The intervals are those that hold (API).
    Opened {
        target: usize,
        o2t_api: Duration,
        t2o_api: Duration,
        config: ConfigPath,
        multicast: Option<Ipv4Addr>,
    },
    /// The first T->O frame of an opened connection has arrived.
    Running { target: usize },
    /// It is over or could not be opened; `retry_in` says when it is tried again, `None` never (closed by the
    /// caller, or `Trouble::is_transient` is false and `ConnectionSettings::retry_permanent` is off).
    Failed { target: usize, trouble: Trouble, retry_in: Option<Duration> },
    /// The target closed its TCP connection while frames go on.
    StreamLost { target: usize },
    /// A Forward Close was confirmed, or given up.
    Closed { target: usize },
    /// An explicit request was answered; its data: [`Scanner::answer`].
    Answered { target: usize, status: GeneralStatus, extended: Option<ExtendedStatus> },
}

/// One target of a scanner. Holds its images and buffers; about 2 kB.
#[derive(Debug)]
pub struct Target {/* ... */}

impl Target {
    /// # Errors  [`Mistake`]
    pub fn new(address: SocketAddrV4, settings: ConnectionSettings) -> Result<Self, Mistake> {
        todo!()
    }
}

/// What a target's connection is like now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TargetStatus {
    pub address: SocketAddrV4,
    pub is_open: bool,
    pub o2t_api: Duration,
    pub t2o_api: Duration,
    pub o2t_id: u32,
    pub t2o_id: u32,
    /// Read over TCP before the Forward Open, if the target tells.
    pub identity: Option<Identity>,
    pub counters: TargetCounters,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TargetCounters {
    pub produced: u64,
    pub consumed: u64,
    /// Frames that came twice or behind a later one.
    pub out_of_order: u64,
    /// Sequence numbers that never came.
    pub missed: u64,
    /// Frames without new data.
    pub repeated: u64,
    /// Production deadlines that passed without a frame.
    pub overruns: u64,
    pub opened: u64,
    pub timed_out: u64,
}

/// `T` holds the targets: `[Target; N]` without an allocator, `Vec<Target>` with one.
#[derive(Debug)]
pub struct Scanner<T> {
    targets: T,
}

impl<T: AsRef<[Target]> + AsMut<[Target]>> Scanner<T> {
    /// Targets are numbered in their order. `seed` makes ids and serial numbers differ from those of an earlier
    /// process; nothing else is random. Connections are opened from the first `handle_timeout` on.
    pub fn new(targets: T, originator: Originator, seed: u64) -> Self {
        todo!()
    }

    pub fn target_count(&self) -> usize {
        todo!()
    }
    pub fn status(&self, target: usize) -> Option<TargetStatus> {
        todo!()
    }

    pub fn handle_connected(&mut self, now: Instant, target: usize) {
        todo!()
    }
    pub fn handle_stream(&mut self, now: Instant, target: usize, bytes: &[u8]) {
        todo!()
    }
    pub fn handle_disconnected(&mut self, now: Instant, target: usize) {
        todo!()
    }
    /// A datagram that arrived at the I/O socket (unicast or of a joined group).
    pub fn handle_datagram(&mut self, now: Instant, from: SocketAddrV4, datagram: &[u8]) {
        todo!()
    }
    pub fn handle_timeout(&mut self, now: Instant) {
        todo!()
    }
    /// When to call `handle_timeout` at the latest.
    pub fn poll_timeout(&self) -> Option<Instant> {
        todo!()
    }
    pub fn poll_transmit(&mut self, now: Instant, room: &mut [u8]) -> Option<Transmit> {
        todo!()
    }
    pub fn poll_event(&mut self) -> Option<ScannerEvent> {
        todo!()
    }

    /// How much earlier than its deadline a frame may leave. A caller that produces on a beat of its own, as long
    /// as the API, gives half of it: each of its cycles then sends exactly one frame. Zero by default.
    pub fn set_early(&mut self, early: Duration) {
        todo!()
    }

    /// Outputs of the next frames; a slice of another length than `o2t_len` changes nothing.
    pub fn write_outputs(&mut self, target: usize, outputs: &[u8]) {
        todo!()
    }
    /// Run (true, default) or idle.
    pub fn set_run(&mut self, target: usize, run: bool) {
        todo!()
    }
    /// Begins an application cycle: inputs that arrived since the last call count as fresh until the next call.
    pub fn begin_cycle(&mut self) {
        todo!()
    }
    /// The newest good inputs (kept while stale) and their quality.
    pub fn read_inputs(&self, target: usize, inputs: &mut [u8]) -> InputQuality {
        todo!()
    }

    /// Closes the connection (Forward Close, then the session) and does not open it again until `open`.
    pub fn close(&mut self, now: Instant, target: usize) {
        todo!()
    }
    pub fn open(&mut self, now: Instant, target: usize) {
        todo!()
    }

    /// Sends an unconnected explicit request on the target's session; one at a time, told with `Answered`.
    /// # Errors  one is under way already, no session yet, data too long.
    pub fn request(
        &mut self,
        now: Instant,
        target: usize,
        service: Service,
        path: ObjectPath,
        data: &[u8],
    ) -> Result<(), RequestError> {
        todo!()
    }
    /// Data of the last answer.
    pub fn answer(&self, target: usize) -> &[u8] {
        todo!()
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RequestError {
    #[error("todo")]
    Busy,
    #[error("todo")]
    NoSession,
    #[error("todo")]
    TooLong { room: usize },
    #[error("todo")]
    NoSuchTarget,
}
