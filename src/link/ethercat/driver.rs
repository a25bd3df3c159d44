//! Drives `ethercrab` over a [`Wire`] in the calling thread: no executor, no hand-off.
//!
//! A future of `ethercrab` puts a frame into its storage and waits; the driver sends what is there,
//! waits for the answer, gives it to the storage and polls again. Frames that answer nothing are
//! counted and dropped; a wire that fails is a wire that loses frames. The cycle of each group has a
//! lane of its own (`lane.rs`), everything else shares a storage.
//!
//! Invariants: [`Driver::exchange`] does not allocate; a finished future is never polled again.

use core::future::Future;
use core::pin::{Pin, pin};
use core::sync::atomic::{AtomicU64, Ordering};
use core::task::{Context, Poll, Waker};
use std::boxed::Box;
use std::sync::Arc;
use std::vec;
use std::vec::Vec;

use ethercrab::MainDevice;

use super::answer::is_answer;
use super::in_flight::{InFlight, Settled};
use super::lane::Lane;
use super::mailbox_repeat::lost_answer;
use super::notice::{MailboxNotice, take_notice};
use super::pdu_core::PduCore;
use super::wire::{MAX_FRAME, Wire};
use crate::time::{Duration, Instant};

/// How long a frame may be under way before it is sent again, outside the cycle.
const RESEND_AFTER: Duration = Duration::from_millis(25);
/// How long to wait when a future waits for time to pass and not for a frame.
const IDLE_WAIT: Duration = Duration::from_micros(200);

/// What happened to frames, in numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameCounters {
    /// Frames handed to the wire.
    pub sent: u64,
    /// Frames that the wire did not take (interface down).
    pub unsent: u64,
    /// Frames that came back as the answer to one that was sent.
    pub received: u64,
    /// Frames that answered nothing: late, twice, mangled, or somebody else's.
    pub stray: u64,
    /// Frames that were sent once more because no answer came; only outside the cycle.
    pub resent: u64,
}

/// The time of the wire in ns, where futures can read it.
#[derive(Clone, Debug, Default)]
pub(super) struct SharedTime(Arc<AtomicU64>);

impl SharedTime {
    pub(super) fn now(&self) -> Instant {
        Instant::from_nanos(self.0.load(Ordering::Relaxed))
    }

    fn set(&self, now: Instant) {
        self.0.store(now.as_nanos(), Ordering::Relaxed);
    }
}

/// A future did not end in the time given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Elapsed;

/// Something that is polled until it says that it has ended.
pub(super) trait Turn {
    /// Polls; `true` once everything has ended. Not called again after that.
    fn poll(&mut self, context: &mut Context<'_>) -> bool;
}

/// A future that may go on over many cycles.
pub(super) type LongTask<T> = Pin<Box<dyn Future<Output = T> + Send>>;

pub(super) struct Driver<W> {
    wire: W,
    main_device: Arc<MainDevice<'static>>,
    /// Behind the main device: it goes back to the pool only when nobody holds that any more.
    core: PduCore,
    in_flight: InFlight,
    lanes: Vec<Lane>,
    buffer: Box<[u8]>,
    counters: FrameCounters,
    time: SharedTime,
    notice: Option<MailboxNotice>,
    lost_mailbox: Option<LostMailbox>,
    is_outside_the_cycle: bool,
}

/// A mailbox that was found empty because its answer got lost; the frame that found it is in the
/// buffer.
#[derive(Clone, Copy)]
struct LostMailbox {
    /// Station and address.
    mailbox: (u16, u16),
    settled: Settled,
    len: usize,
}

impl<W: Wire> Driver<W> {
    pub(super) fn new(wire: W, core: PduCore) -> Self {
        let time = SharedTime::default();
        time.set(wire.now());
        Self {
            wire,
            main_device: Arc::clone(&core.main_device),
            core,
            in_flight: InFlight::new(),
            lanes: Vec::new(),
            buffer: vec![0; MAX_FRAME].into(),
            counters: FrameCounters::default(),
            time,
            notice: None,
            lost_mailbox: None,
            is_outside_the_cycle: false,
        }
    }

    pub(super) const fn wire(&self) -> &W {
        &self.wire
    }

    pub(super) const fn wire_mut(&mut self) -> &mut W {
        &mut self.wire
    }

    pub(super) const fn counters(&self) -> FrameCounters {
        self.counters
    }

    /// The time of the wire, for futures.
    pub(super) fn time(&self) -> SharedTime {
        self.time.clone()
    }

    pub(super) fn now(&self) -> Instant {
        self.wire.now()
    }

    pub(super) fn main_device(&self) -> Arc<MainDevice<'static>> {
        Arc::clone(&self.main_device)
    }

    /// Opens a lane for the cycle of each group, for frames of these lengths; those there were are
    /// closed.
    pub(super) fn open_lanes(&mut self, frame_lens: impl Iterator<Item = usize>) {
        self.lanes.clear();
        self.lanes.extend(frame_lens.map(Lane::take));
    }

    /// The main device of a group's cycle.
    pub(super) fn cycle_device(&self, group: usize) -> Option<&'static MainDevice<'static>> {
        self.lanes.get(group).map(Lane::main_device)
    }

    /// The last thing a subdevice said in its mailbox since the last call, beyond answers.
    pub(super) fn take_notice(&mut self) -> Option<MailboxNotice> {
        self.notice.take()
    }

    /// The wire, when the driver is no longer needed.
    pub(super) fn into_wire(self) -> W {
        self.wire
    }

    /// Runs `future` to its end, or until `limit` is over. Lost frames are sent again.
    pub(super) fn block_on<T>(
        &mut self,
        limit: Duration,
        future: impl Future<Output = T>,
    ) -> Result<T, Elapsed> {
        let mut future = pin!(future);
        let mut context = Context::from_waker(Waker::noop());
        let deadline = self.wire.now() + limit;
        self.is_outside_the_cycle = true;
        loop {
            self.time.set(self.wire.now());
            if let Poll::Ready(value) = future.as_mut().poll(&mut context) {
                return Ok(value);
            }
            self.send_pending();
            let now = self.wire.now();
            if now >= deadline {
                // What is under way answers a future that is about to be dropped.
                self.in_flight.forget_all();
                return Err(Elapsed);
            }
            let wake_at = match self.in_flight.next_resend(RESEND_AFTER) {
                Some(resend_at) => resend_at,
                None => now + IDLE_WAIT,
            };
            self.receive_one(wake_at.min(deadline));
            self.fetch_lost_mailbox();
            self.resend_overdue();
        }
    }

    /// Lets time pass until `deadline`; takes what comes meanwhile.
    pub(super) fn idle_until(&mut self, deadline: Instant) {
        while self.receive_one(deadline) {}
    }

    /// Polls `turn` until it has ended or `deadline` is over, and `task` once on the way: its frames
    /// leave behind those of the turn, its answers are taken when they come. `true` if the turn ended.
    pub(super) fn exchange<T>(
        &mut self,
        deadline: Instant,
        turn: &mut dyn Turn,
        task: &mut Option<LongTask<T>>,
    ) -> (bool, Option<T>) {
        let mut context = Context::from_waker(Waker::noop());
        self.is_outside_the_cycle = false;
        let mut has_ended = turn.poll(&mut context);
        self.send_cycle();
        let outcome = match task {
            Some(_) => self.advance(task, &mut context),
            None => None,
        };
        while !has_ended && self.receive_one(deadline) {
            has_ended = turn.poll(&mut context);
            if !has_ended {
                self.send_cycle();
            }
        }
        (has_ended, outcome)
    }

    /// Polls `task`, if there is one, and sends what it has to say; its outcome if it has ended.
    #[cold]
    fn advance<T>(
        &mut self,
        task: &mut Option<LongTask<T>>,
        context: &mut Context<'_>,
    ) -> Option<T> {
        let future = task.as_mut()?;
        // What is still under way from earlier belongs to the task.
        self.resend_overdue();
        self.time.set(self.wire.now());
        let polled = future.as_mut().poll(context);
        self.send_pending();
        match polled {
            Poll::Ready(outcome) => {
                *task = None;
                Some(outcome)
            }
            Poll::Pending => None,
        }
    }

    /// Forgets the cycle's frames: what waited for them is gone. Those of a long task stay.
    pub(super) fn give_up_cycle(&mut self) {
        self.lanes.iter_mut().for_each(Lane::give_up);
    }

    /// Forgets the frames of a long task that is given up.
    pub(super) fn forget_task(&mut self) {
        self.in_flight.forget_all();
    }

    /// Sends every frame that waits in a lane.
    fn send_cycle(&mut self) {
        for lane in &mut self.lanes {
            lane.send_pending(&mut self.wire, &mut self.counters);
        }
    }

    /// Sends every frame that waits in the storage.
    fn send_pending(&mut self) {
        while let Some(frame) = self.core.next_sendable_frame() {
            let (wire, in_flight, counters) =
                (&mut self.wire, &mut self.in_flight, &mut self.counters);
            let _ = frame.send_blocking(|bytes| {
                match wire.send(bytes) {
                    Ok(()) => counters.sent += 1,
                    Err(_) => counters.unsent += 1,
                }
                in_flight.sent(bytes, wire.now());
                // Said to be sent in either case: a frame that did not leave is a lost frame.
                Ok(bytes.len())
            });
        }
    }

    /// Waits for one answer until `deadline`; what answers nothing does not end the wait.
    fn receive_one(&mut self, deadline: Instant) -> bool {
        loop {
            match self.wire.receive(&mut self.buffer, deadline) {
                Ok(Some(len)) => {
                    if self.take_of_cycle(len) || self.take_other(len) {
                        self.counters.received += 1;
                        return true;
                    }
                    self.counters.stray += 1;
                    if self.wire.now() >= deadline {
                        return false;
                    }
                }
                Ok(None) => return false,
                Err(_) => {
                    // A wire that is down loses what is under way. It must not turn the wait into a
                    // busy loop either.
                    if self.wire.now() >= deadline {
                        return false;
                    }
                    self.wire.pause_until(deadline);
                    return false;
                }
            }
        }
    }

    /// Hands the frame in the buffer on if it answers a group's cycle; whether it does. No mailbox is
    /// read there.
    fn take_of_cycle(&mut self, len: usize) -> bool {
        let Some(frame) = self.buffer.get(..len) else { return false };
        self.lanes.iter_mut().any(|lane| lane.receive(frame))
    }

    /// Hands the frame in the buffer on if it answers anything else; whether it does.
    #[cold]
    fn take_other(&mut self, len: usize) -> bool {
        let Some(frame) = self.buffer.get_mut(..len) else { return false };
        let Some(settled) = self.in_flight.settle(frame) else { return false };
        // In the cycle there is no time for it: the task that asked begins anew.
        if settled.was_resent
            && self.is_outside_the_cycle
            && let Some(sent) = self.in_flight.sent_bytes(settled)
            && let Some(mailbox) = lost_answer(sent, frame)
        {
            self.lost_mailbox = Some(LostMailbox { mailbox, settled, len });
            return true;
        }
        self.notice = take_notice(frame).or(self.notice);
        // The future may be gone meanwhile; then the storage has no place for it.
        self.core.receive_frame(frame);
        true
    }

    /// Has a mailbox answer that got lost put there again, and reads it again. A subdevice that cannot
    /// do it has answered that its mailbox is empty.
    fn fetch_lost_mailbox(&mut self) {
        let Some(LostMailbox { mailbox: (station, address), settled, len }) =
            self.lost_mailbox.take()
        else {
            return;
        };
        let empty = self.buffer.get(..len).map(<[u8]>::to_vec);
        if self.repeat_mailbox(station, address) {
            let now = self.wire.now();
            if let Some(frame) = self.in_flight.reopen(settled, now)
                && self.wire.send(frame).is_ok()
            {
                self.counters.resent += 1;
            }
        } else if let Some(empty) = empty {
            self.core.receive_frame(&empty);
        }
    }

    /// Sends a frame of our own and waits for its answer until `patience` is over.
    pub(super) fn own_round_trip(&mut self, frame: &[u8], patience: Duration) -> Option<&[u8]> {
        let deadline = self.wire.now() + patience;
        self.wire.send(frame).ok()?;
        self.counters.sent += 1;
        loop {
            let len = self.wire.receive(&mut self.buffer, deadline).ok()??;
            let back = self.buffer.get(..len)?;
            if is_answer(frame, back) {
                self.counters.received += 1;
                return self.buffer.get(..len);
            }
            self.counters.stray += 1;
            if self.wire.now() >= deadline {
                return None;
            }
        }
    }

    fn resend_overdue(&mut self) {
        let now = self.wire.now();
        let (wire, counters) = (&mut self.wire, &mut self.counters);
        self.in_flight.resend(now, RESEND_AFTER, |bytes| {
            counters.resent += 1;
            if wire.send(bytes).is_err() {
                counters.unsent += 1;
            }
        });
    }
}
