//! What the robot has taken and not finished: every queued command in order, and the checkpoints
//! that will tell that they are finished.
//!
//! ```text
//!   polled  |  settled, not polled  |  live: on the robot            |
//!           ^ entries.front()       ^ settled                        ^ next
//!   automatic checkpoints:            7003 -> boundary  7004 -> boundary
//! ```
//!
//! An automatic checkpoint stands for all entries below its boundary; a user checkpoint is an entry
//! itself. Reaching either settles everything below it as done.
//!
//! Invariants: the numbers of outstanding automatic checkpoints are consecutive in their range and
//! all differ, also from the one reached last; `settled` only grows; work in a cycle is constant
//! except for a changed user number (a search of [`LEDGER`] entries at most) and for dropping the
//! checkpoints a reached one has passed (each dropped once).
//!
//! Left out: why commands are lost (`connection.rs` decides), and the tickets of instantaneous commands,
//! which never enter.

use core::mem::offset_of;
use core::num::NonZeroU16;

use super::config::{CheckpointPolicy, CheckpointRange};
use super::doubt::{Doubt, above};
use super::event::{Events, Item, UnknownCause, Verdict};
use super::ring::Ring;
use super::ticket::Ticket;
use crate::wire::meca500::image::FirmwareLayout;

/// Commands that may be unfinished on the robot, or finished and not polled.
pub(super) const LEDGER: usize = 256;

#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) ticket: Ticket,
    /// Number of a user checkpoint, until its event was polled.
    pub(super) checkpoint: Option<NonZeroU16>,
    /// Whether the manual leaves open if the command waits in the queue at all.
    pub(super) kind_open: bool,
}

/// `repr(C)`: what every cycle looks at lies in one cache line, the rings behind it.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Ledger {
    /// Index of the entry to come.
    next: u32,
    /// Entries below are settled.
    settled: u32,
    /// Entries below were reached by a checkpoint.
    reached_through: u32,
    /// Entries below were said to have started.
    started: u32,
    /// Boundary of the automatic checkpoint sent last.
    marked: u32,
    range: CheckpointRange,
    /// Number of the oldest outstanding automatic checkpoint.
    first_mark: u16,
    /// Number of the automatic checkpoint to come.
    next_mark: u16,
    /// Number of the checkpoint sent last, whoever asked for it.
    last_sent: u32,
    reached: u32,
    discarded: u32,
    /// Whether the robot's queue may hold checkpoints of an earlier run of the PLC.
    foreign: bool,
    doubt: Doubt,
    entries: Ring<Entry, LEDGER>,
    /// Boundaries of the outstanding automatic checkpoints.
    marks: Ring<u32, LEDGER>,
}

const _: () = assert!(offset_of!(Ledger, entries) < 64);

/// A checkpoint number as the robot shows it; 0 is none.
fn checkpoint(shown: u32) -> Option<NonZeroU16> {
    u16::try_from(shown).ok().and_then(NonZeroU16::new)
}

/// What a change of CheckpointReached means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reached {
    /// Nothing new, or only the engine's own.
    Known,
    /// A number nobody sent through this engine (an offline program's).
    Foreign(u16),
}

impl Ledger {
    pub(super) fn new(range: CheckpointRange) -> Self {
        let range = range.usable();
        Self {
            next: 0,
            settled: 0,
            reached_through: 0,
            started: 0,
            marked: 0,
            range,
            first_mark: range.first,
            next_mark: range.first,
            last_sent: 0,
            reached: 0,
            discarded: 0,
            foreign: false,
            doubt: Doubt::none(),
            entries: Ring::new(Entry { ticket: Ticket(0), checkpoint: None, kind_open: false }),
            marks: Ring::new(0),
        }
    }

    pub(super) const fn range(&self) -> CheckpointRange {
        self.range
    }

    fn size(&self) -> u16 {
        self.range.last - self.range.first + 1
    }

    /// The number `steps` after `number` in the range.
    fn ahead(&self, number: u16, steps: u16) -> u16 {
        let offset = u32::from(number.saturating_sub(self.range.first)) + u32::from(steps);
        let offset = u16::try_from(offset % u32::from(self.size())).unwrap_or(0);
        self.range.first + offset
    }

    /// Commands on the robot that are not finished.
    #[inline]
    pub(super) fn live(&self) -> u32 {
        self.next.wrapping_sub(self.settled)
    }

    /// Live commands without an automatic checkpoint behind them.
    #[inline]
    pub(super) fn unmarked(&self) -> u32 {
        self.next.wrapping_sub(self.marked).min(self.live())
    }

    #[inline]
    pub(super) fn is_full(&self) -> bool {
        self.entries.free() == 0
    }

    /// Whether one more automatic checkpoint can be told from the others.
    #[inline]
    pub(super) fn can_mark(&self) -> bool {
        !self.foreign && self.marks.free() > 0 && self.marks.len() + 1 < u32::from(self.size())
    }

    /// Whether a checkpoint of the engine must go before anything else: the policy asks for it, or a
    /// user checkpoint `upcoming` would repeat the number before it, which nobody could see reached.
    #[inline]
    pub(super) fn mark_due(&self, policy: CheckpointPolicy, upcoming: Option<NonZeroU16>) -> bool {
        let unmarked = self.unmarked();
        let by_policy = match policy {
            CheckpointPolicy::EachCommand => unmarked > 0,
            CheckpointPolicy::Every(count) => unmarked >= u32::from(count.max(1)),
            CheckpointPolicy::WhenEmpty => unmarked >= LEDGER as u32 - 1,
        };
        by_policy || upcoming.is_some_and(|number| u32::from(number.get()) == self.last_sent)
    }

    /// Takes the number of a new automatic checkpoint; call it when the checkpoint is sent, so that
    /// numbers stay consecutive whatever becomes of it.
    pub(super) fn mark(&mut self) -> u16 {
        let number = self.next_mark;
        if self.marks.is_empty() {
            self.first_mark = number;
        }
        self.marks.push(self.next);
        self.marked = self.next;
        self.next_mark = self.ahead(number, 1);
        self.last_sent = number.into();
        number
    }

    /// The checkpoint sent last may never have arrived: what it stood for needs another one.
    pub(super) fn mark_again(&mut self) {
        self.marked = self.settled;
    }

    /// Notes that the robot took a queued command.
    #[inline]
    pub(super) fn accept(&mut self, entry: Entry) {
        if let Some(number) = entry.checkpoint {
            self.last_sent = number.get().into();
        }
        if self.entries.push(entry) {
            self.next = self.next.wrapping_add(1);
        }
    }

    /// Starts from what the robot shows at the first connection. While its queue may still hold
    /// checkpoints of an earlier run of the PLC none is placed: their numbers could be the same.
    pub(super) fn adopt(&mut self, reached: u32, discarded: u32, queue_is_empty: bool) {
        self.reached = reached;
        self.discarded = discarded;
        self.last_sent = reached;
        self.foreign = !queue_is_empty;
        if self.marks.is_empty() {
            self.number_after(reached);
        }
    }

    #[inline]
    pub(super) const fn is_foreign(&self) -> bool {
        self.foreign
    }

    /// The robot's queue holds nothing of an earlier run any more.
    pub(super) fn own(&mut self) {
        self.foreign = false;
        self.last_sent = self.reached;
        self.number_after(self.reached);
    }

    fn number_after(&mut self, reached: u32) {
        let shown = u16::try_from(reached).ok().filter(|number| self.range.contains(*number));
        self.next_mark = shown.map_or(self.range.first, |number| self.ahead(number, 1));
    }

    /// Takes CheckpointReached of this cycle.
    #[inline]
    pub(super) fn see_reached(&mut self, number: u32) -> Reached {
        if number == self.reached { Reached::Known } else { self.take_reached(number) }
    }

    fn take_reached(&mut self, number: u32) -> Reached {
        self.reached = number;
        let Some(short) = checkpoint(number) else { return Reached::Known };
        if self.range.contains(short.get()) {
            let boundary = self.mark_position(short.get()).and_then(|at| self.marks.get(at));
            if let Some(&boundary) = boundary {
                self.doubt.mark_reached(boundary);
                self.reach(boundary);
            }
            return Reached::Known;
        }
        match self.find_user(short) {
            Some(index) => {
                self.doubt.entry_reached(index);
                self.reach(index.wrapping_add(1));
                Reached::Known
            }
            None => Reached::Foreign(short.get()),
        }
    }

    fn reach(&mut self, boundary: u32) {
        if above(boundary, self.reached_through) {
            self.reached_through = boundary;
        }
    }

    /// Takes CheckpointDiscarded of this cycle; true if a checkpoint of ours was discarded.
    #[inline]
    pub(super) fn see_discarded(&mut self, number: u32) -> bool {
        number != self.discarded && self.take_discarded(number)
    }

    fn take_discarded(&mut self, number: u32) -> bool {
        self.discarded = number;
        let Some(short) = checkpoint(number) else { return false };
        if self.range.contains(short.get()) {
            self.mark_position(short.get()).is_some()
        } else {
            self.find_user(short).is_some()
        }
    }

    /// Place of an outstanding automatic checkpoint.
    fn mark_position(&self, number: u16) -> Option<u32> {
        let size = u32::from(self.size());
        let offset = (u32::from(number) + size - u32::from(self.first_mark)) % size;
        (offset < self.marks.len()).then_some(offset)
    }

    /// Index of the oldest entry that was not polled.
    #[inline]
    fn polled_through(&self) -> u32 {
        self.next.wrapping_sub(self.entries.len())
    }

    /// Index of the oldest live user checkpoint with this number.
    fn find_user(&self, number: NonZeroU16) -> Option<u32> {
        let polled = self.polled_through();
        (self.settled.wrapping_sub(polled)..self.entries.len())
            .find(|at| self.entries.get(*at).is_some_and(|entry| entry.checkpoint == Some(number)))
            .map(|at| polled.wrapping_add(at))
    }

    /// Says what was reached.
    #[inline]
    pub(super) fn settle_reached(&mut self, events: &mut Events) {
        if above(self.reached_through, self.settled) {
            self.settle_live(events);
        }
    }

    fn settle_live(&mut self, events: &mut Events) {
        if self.doubt.is_open(self.settled) {
            let (proven, doubtful, cause) = self.doubt.split(self.reached_through);
            if above(proven, self.settled) {
                self.settle(proven, Verdict::Done, events);
            }
            if above(doubtful, self.settled) {
                self.settle(doubtful, Verdict::Unknown(cause), events);
            }
        }
        if above(self.reached_through, self.settled) {
            self.settle(self.reached_through, Verdict::Done, events);
        }
    }

    /// Says that everything live ended like this.
    pub(super) fn settle_all(&mut self, verdict: Verdict, events: &mut Events) {
        if self.live() > 0 {
            self.settle(self.next, verdict, events);
        }
        if self.live() == 0 {
            self.marks.clear();
            self.marked = self.next;
            self.reached_through = self.next;
        }
    }

    fn settle(&mut self, upto: u32, verdict: Verdict, events: &mut Events) {
        if !events.ticket(Item::Finish { upto, verdict }) {
            return;
        }
        self.settled = upto;
        while self.marks.front().is_some_and(|boundary| !above(*boundary, upto)) {
            self.marks.pop();
            self.first_mark = self.ahead(self.first_mark, 1);
        }
    }

    /// A safety stop came, or motion resumes: the robot may have dropped its queue. Its discarded
    /// checkpoints tell, if it reports them and there were some.
    pub(super) fn doubt_stop(&mut self, layout: FirmwareLayout) {
        if layout == FirmwareLayout::V10_2 || self.marks.is_empty() {
            self.doubt_from(self.settled, UnknownCause::SafetyStop);
        }
    }

    /// The robot was out of sight: whatever became of its queue, only checkpoints sent before tell.
    pub(super) fn doubt_absence(&mut self, layout: FirmwareLayout) {
        let from = match layout {
            FirmwareLayout::V11_3 if above(self.marked, self.settled) => self.marked,
            FirmwareLayout::V11_3 | FirmwareLayout::V10_2 => self.settled,
        };
        self.doubt_from(from, UnknownCause::LinkLost);
    }

    fn doubt_from(&mut self, from: u32, cause: UnknownCause) {
        self.doubt.arise(from, self.next, self.marked, self.settled, cause);
    }

    /// The command that starts now because everything before it is finished, once.
    #[inline]
    pub(super) fn starting(&self) -> Option<Ticket> {
        if self.live() == 0 || above(self.started, self.settled) {
            return None;
        }
        let at = self.settled.wrapping_sub(self.polled_through());
        self.entries.get(at).map(|entry| entry.ticket)
    }

    /// Notes that the start was said.
    #[inline]
    pub(super) fn started(&mut self) {
        self.started = self.settled.wrapping_add(1);
    }

    /// The oldest entry not polled, if its index is below `upto`.
    #[inline]
    pub(super) fn polling(&mut self, upto: u32) -> Option<&mut Entry> {
        if above(upto, self.polled_through()) { self.entries.get_mut(0) } else { None }
    }

    #[inline]
    pub(super) fn polled(&mut self) {
        self.entries.pop();
    }
}
