//! The PLC's side: one scanner, many targets, one UDP socket.
//!
//! Read [`Scanner`] first, then [`ConnectionSettings`], [`ScannerEvent`] and [`Trouble`]. Each target goes
//! through
//!
//! ```text
//! Connect -> RegisterSession -> identity (optional) -> Forward Open -> open -> frames both ways
//!    ^                                                                             |
//!    +------ back-off, new serial number <---- Forward Close <---- watchdog, close +
//! ```
//!
//! The I/O connection outlives the TCP connection: while frames come, a lost stream is opened again in the
//! background, so that the Forward Close finds its way.
//!
//! Invariants: a connection's triad is never used again; an answer counts only if session, sender context,
//! service and triad are those of the request; every step has a time limit; frames follow the intervals that the
//! target granted (API), not those requested; nothing allocates or panics.
//!
//! Leaves out: sockets and their DSCP, connected explicit messages, routing through bridges.

mod answers;
mod consuming;
mod events;
mod explicit;
mod groups;
mod ids;
mod producing;
mod requests;
mod session;
mod settings;
mod target;
mod trouble;

use core::net::{Ipv4Addr, SocketAddrV4};

pub use settings::{ConfigPath, ConnectionSettings, Mistake, Originator, T2oType};
pub use target::Target;
pub use trouble::{RequestError, Step, Trouble};

use super::ConnectionKind;
use crate::cycle::InputQuality;
use crate::time::{Duration, Instant};
use crate::wire::enip::identity::Identity;
use crate::wire::enip::io::IoFrame;
use crate::wire::enip::message::Service;
use crate::wire::enip::path::ObjectPath;
use crate::wire::enip::status::{ExtendedStatus, GeneralStatus};
use ids::Ids;

/// Longest image of either direction in bytes.
///
/// Source: choice; it is beyond what fits into the 9 bits of a Forward Open.
pub const MAX_IMAGE_LEN: usize = 512;
/// Room that always suffices for [`Scanner::poll_transmit`], in bytes.
pub const TRANSMIT_LEN: usize = 640;

/// What the I/O is to do. Bytes, if any, stand in the room given to [`Scanner::poll_transmit`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transmit {
    /// Connect TCP to the target's address; told back with `handle_connected` or `handle_disconnected`.
    Connect {
        /// Number of the target.
        target: usize,
    },
    /// Send the first `len` bytes of the room on the target's TCP connection, all of them.
    Stream {
        /// Number of the target.
        target: usize,
        /// Bytes to send.
        len: usize,
    },
    /// Close the target's TCP connection, or give up connecting; not told back.
    Disconnect {
        /// Number of the target.
        target: usize,
    },
    /// Send the first `len` bytes from the I/O socket.
    Datagram {
        /// Where to.
        to: SocketAddrV4,
        /// Bytes to send.
        len: usize,
    },
    /// Receive frames sent to this group as well.
    JoinGroup {
        /// The group.
        group: Ipv4Addr,
    },
    /// No longer.
    LeaveGroup {
        /// The group.
        group: Ipv4Addr,
    },
}

/// What happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScannerEvent {
    /// The connection is open. The intervals are those that hold (API).
    Opened {
        /// Number of the target.
        target: usize,
        /// Interval of the frames to the target.
        o2t_api: Duration,
        /// Interval of the frames from the target.
        t2o_api: Duration,
        /// The path that was accepted.
        config: ConfigPath,
        /// The group that the target sends to, if it does.
        multicast: Option<Ipv4Addr>,
    },
    /// The first T->O frame of an opened connection has arrived.
    Running {
        /// Number of the target.
        target: usize,
    },
    /// It is over or could not be opened.
    Failed {
        /// Number of the target.
        target: usize,
        /// Why.
        trouble: Trouble,
        /// When it is tried again; `None` never (closed by the caller, or [`Trouble::is_transient`] is false
        /// and [`ConnectionSettings::retries_permanent`] is off).
        retry_in: Option<Duration>,
    },
    /// The TCP connection ended while frames go on.
    StreamLost {
        /// Number of the target.
        target: usize,
    },
    /// A Forward Close was confirmed, or given up.
    Closed {
        /// Number of the target.
        target: usize,
    },
    /// An explicit request was answered; its data: [`Scanner::answer`]. If no answer came in time, or the
    /// stream ended before, the status is 0x01 with 0x0204, as a router on the way would answer.
    Answered {
        /// Number of the target.
        target: usize,
        /// What came of it.
        status: GeneralStatus,
        /// The first word of additional status, if there is one.
        extended: Option<ExtendedStatus>,
    },
}

/// What a target's connection is like now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TargetStatus {
    /// Where its TCP connection goes.
    pub address: SocketAddrV4,
    /// Whether the I/O connection is open.
    pub is_open: bool,
    /// Whether there is a session for explicit requests.
    pub has_session: bool,
    /// Interval of the frames to the target; zero while it is not open.
    pub o2t_api: Duration,
    /// Interval of the frames from the target; zero while it is not open.
    pub t2o_api: Duration,
    /// Id of the frames to the target; 0 while it is not open.
    pub o2t_id: u32,
    /// Id of the frames from the target; 0 while it is not open.
    pub t2o_id: u32,
    /// Read over TCP before the Forward Open, if the target tells.
    pub identity: Option<Identity>,
    /// What was counted since the scanner began.
    pub counters: TargetCounters,
}

/// What was counted for a target since the scanner began. All saturate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TargetCounters {
    /// Frames sent.
    pub produced: u64,
    /// Frames taken.
    pub consumed: u64,
    /// Frames that came twice or behind a later one.
    pub out_of_order: u64,
    /// Sequence numbers that never came, or came behind a later one.
    pub missed: u64,
    /// Frames without new data.
    pub repeated: u64,
    /// Frames that were given up: their deadlines passed in a stall too long to be made up for.
    pub overruns: u64,
    /// Connections opened.
    pub opened: u64,
    /// Connections that the watchdog ended.
    pub timed_out: u64,
}

/// `T` holds the targets: `[Target; N]` without an allocator, `Vec<Target>` with one.
#[derive(Debug)]
pub struct Scanner<T> {
    targets: T,
    originator: Originator,
    ids: Ids,
    early: Duration,
    has_begun: bool,
    /// Where the search for a frame that is due goes on.
    next_producer: usize,
}

impl<T: AsRef<[Target]> + AsMut<[Target]>> Scanner<T> {
    /// Targets are numbered in their order. `seed` makes ids and serial numbers differ from those of an earlier
    /// process; nothing else is random. Connections are opened from the first `handle_timeout` on.
    pub fn new(mut targets: T, originator: Originator, seed: u64) -> Self {
        for (index, target) in targets.as_mut().iter_mut().enumerate() {
            target.set_index(index);
        }
        let (ids, early) = (Ids::new(seed), Duration::ZERO);
        Self { targets, originator, ids, early, has_begun: false, next_producer: 0 }
    }

    /// How many there are.
    pub fn target_count(&self) -> usize {
        self.targets.as_ref().len()
    }

    fn target(&self, index: usize) -> Option<&Target> {
        self.targets.as_ref().get(index)
    }

    fn target_mut(&mut self, index: usize) -> Option<&mut Target> {
        self.targets.as_mut().get_mut(index)
    }

    /// What a target's connection is like now; `None` without such a target.
    pub fn status(&self, target: usize) -> Option<TargetStatus> {
        self.target(target).map(Target::status)
    }

    /// The TCP connection asked for is there.
    pub fn handle_connected(&mut self, now: Instant, target: usize) {
        if let Some(target) = self.target_mut(target) {
            target.handle_connected(now);
        }
    }

    /// Bytes arrived on a target's TCP connection, split and joined in whatever way.
    pub fn handle_stream(&mut self, now: Instant, target: usize, bytes: &[u8]) {
        if let Some(target) = self.target_mut(target) {
            target.handle_stream(now, bytes);
        }
    }

    /// The TCP connection ended, or could not be made.
    pub fn handle_disconnected(&mut self, now: Instant, target: usize) {
        if let Some(target) = self.target_mut(target) {
            target.handle_disconnected(now);
        }
    }

    /// A datagram that arrived at the I/O socket (unicast or of a joined group). What is no frame of an open
    /// connection, with its id and from its target's address, is passed over.
    pub fn handle_datagram(&mut self, now: Instant, from: SocketAddrV4, datagram: &[u8]) {
        let Ok(frame) = IoFrame::read(datagram) else { return };
        // Two connections to the same target may share what it produces to a group.
        for target in self.targets.as_mut() {
            target.handle_frame(now, *from.ip(), &frame);
        }
    }

    /// Time passed: opens what is to be opened, gives up what took too long.
    pub fn handle_timeout(&mut self, now: Instant) {
        let is_first = !core::mem::replace(&mut self.has_begun, true);
        for target in self.targets.as_mut() {
            if is_first {
                target.begin(now);
            }
            target.handle_timeout(now);
        }
    }

    /// When to call `handle_timeout`, then `poll_transmit`, at the latest.
    pub fn poll_timeout(&self) -> Option<Instant> {
        if !self.has_begun {
            return Some(Instant::ZERO);
        }
        self.targets.as_ref().iter().filter_map(Target::poll_timeout).min()
    }

    /// The next thing to do; ask until there is none. [`TRANSMIT_LEN`] bytes of `room` always suffice; what
    /// does not fit is not sent.
    pub fn poll_transmit(&mut self, now: Instant, room: &mut [u8]) -> Option<Transmit> {
        let Self { targets, originator, ids, early, next_producer, .. } = self;
        let targets = targets.as_mut();
        // Frames first: they have deadlines.
        let count = targets.len();
        let start = (*next_producer).min(count);
        let order = (start..count).chain(0..start);
        for index in order {
            let Some(target) = targets.get_mut(index) else { continue };
            if let Some(transmit) = target.poll_frame(now, *early, room) {
                *next_producer = index.saturating_add(1);
                return Some(transmit);
            }
        }
        if let Some(transmit) = groups::poll(targets) {
            return Some(transmit);
        }
        targets.iter_mut().find_map(|target| target.poll_stream(now, *originator, ids, room))
    }

    /// The next event of any target; those of one target come in order.
    pub fn poll_event(&mut self) -> Option<ScannerEvent> {
        self.targets.as_mut().iter_mut().find_map(Target::poll_event)
    }

    /// How much earlier than its deadline a frame may leave. A caller that produces on a beat of its own, as long
    /// as the API, gives half of it: each of its cycles then sends exactly one frame. Zero by default; more than
    /// half of a connection's API counts as half of it.
    ///
    /// With anything but zero, the deadlines are laid on the caller's cycles: the first `poll_transmit` behind
    /// the first [`begin_cycle`](Self::begin_cycle) of an open connection is one.
    pub const fn set_early(&mut self, early: Duration) {
        self.early = early;
    }

    /// Outputs of the next frames; a slice of another length than `o2t_len` changes nothing. Zeros until then.
    pub fn write_outputs(&mut self, target: usize, outputs: &[u8]) {
        if let Some(target) = self.target_mut(target) {
            target.write_outputs(outputs);
        }
    }

    /// Run (true, default) or idle: what the header of the next frames says.
    pub fn set_run(&mut self, target: usize, run: bool) {
        if let Some(target) = self.target_mut(target) {
            target.set_run(run);
        }
    }

    /// Begins an application cycle: inputs that arrived since the last call count as fresh until the next call.
    pub fn begin_cycle(&mut self) {
        for target in self.targets.as_mut() {
            target.begin_cycle();
        }
    }

    /// The newest good inputs (kept while stale) and their quality, as they were when the cycle began. Lost, and
    /// nothing copied, while the connection is not open, before its first frame, without such a target, and with
    /// a slice of another length than `t2o_len`.
    pub fn read_inputs(&self, target: usize, inputs: &mut [u8]) -> InputQuality {
        self.target(target).map_or(InputQuality::Lost, |target| target.read_inputs(inputs))
    }

    /// Closes the connection (Forward Close, then the session) and does not open it again until `open`.
    pub fn close(&mut self, now: Instant, target: usize) {
        if let Some(target) = self.target_mut(target) {
            target.close(now);
        }
    }

    /// Opens the connection if it is not open: after `close`, after a failure that is not tried again, or
    /// without waiting for the next attempt.
    pub fn open(&mut self, now: Instant, target: usize) {
        if let Some(target) = self.target_mut(target) {
            target.open(now);
        }
    }

    /// Sends an unconnected explicit request on the target's session; one at a time, told with `Answered`.
    ///
    /// # Errors
    ///
    /// One is under way already, there is no session, the data are longer than 504 bytes, or there is no such
    /// target.
    pub fn request(
        &mut self,
        _now: Instant,
        target: usize,
        service: Service,
        path: ObjectPath,
        data: &[u8],
    ) -> Result<(), RequestError> {
        self.target_mut(target).ok_or(RequestError::NoSuchTarget)?.request(service, path, data)
    }

    /// Data of the last answer; none while one is waited for. 504 bytes at most.
    pub fn answer(&self, target: usize) -> &[u8] {
        self.target(target).map_or(&[], Target::answer)
    }
}
