//! The distributed clock of one ESC: a local clock, system time, the loop that makes it follow,
//! and SYNC0.
//!
//! ```text
//!  local clock (own offset and drift, corrected by the loop) + offset 0920h = system time 0910h
//! ```
//!
//! A write to system time is the reference clock's time when the frame left it. The loop compares
//! it with the own system time minus the delay 0928h and lets the local clock run faster or slower.
//! A real ESC does this by inserting and leaving out nanoseconds; here a proportional part moves
//! the clock and an integral part its rate, at most by a tenth of the time since the last write,
//! as fast as a real one can.
//!
//! Source: ETG.1000 part 4; choice, for the gains of the loop.

use crate::time::Instant;
use crate::wire::ethercat::register::{
    DC_ACTIVATION, DC_ACTIVATION_SYNC0, DC_DELAY, DC_DIFFERENCE, DC_DIFFERENCE_BEHIND,
    DC_DIFFERENCE_FILTER, DC_OFFSET, DC_RECEIVE_TIME, DC_RECEIVE_TIMES, DC_SPEED_DIFFERENCE,
    DC_SPEED_FILTER, DC_SPEED_START, DC_SYNC0_CYCLE, DC_SYNC0_TIME, DC_SYNC1_CYCLE, DC_SYNC1_TIME,
    DC_SYSTEM_TIME,
};

use super::memory::Memory;

const BILLION: i128 = 1_000_000_000;
/// Parts of a nanosecond in which the mean difference is kept.
const DIFFERENCE_UNIT: i64 = 65_536;
const SPEED_START_POWER_UP: u16 = 0x1000;
const DIFFERENCE_FILTER_POWER_UP: u8 = 4;
const SPEED_FILTER_POWER_UP: u8 = 12;
/// The phase moves by this part of a difference at each write.
const PHASE_DIVISOR: i64 = 8;
/// The rate moves by this part of a difference for each time between writes.
const RATE_DIVISOR: i128 = 64;
/// The most that the loop may speed the clock up or slow it down, in parts per billion.
const RATE_LIMIT_PPB: i128 = BILLION / 10;

/// The clock of one ESC.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    /// The moment at which `local_ns` was the local time.
    at: Instant,
    local_ns: u64,
    /// The quartz, in parts per billion.
    drift_ppb: i64,
    /// The loop's part of the rate, in parts per billion.
    correction_ppb: i64,
    /// The last write to system time since the loop was restarted.
    compared_at: Option<Instant>,
    /// Mean difference in 1/65,536 ns; positive when the own system time is ahead.
    difference: i64,
    /// System time of the next SYNC0 while it is active.
    next_sync0: Option<u64>,
}

impl Clock {
    /// A clock that shows `start_ns` at `now` and runs off by `drift_ppb`.
    pub(super) const fn new(now: Instant, start_ns: u64, drift_ppb: i32) -> Self {
        Self {
            at: now,
            local_ns: start_ns,
            drift_ppb: drift_ppb as i64,
            correction_ppb: 0,
            compared_at: None,
            difference: 0,
            next_sync0: None,
        }
    }

    /// Sets the registers as after power-up.
    pub(super) fn load(&self, memory: &mut Memory) {
        memory.set_u16(DC_SPEED_START, SPEED_START_POWER_UP);
        memory.set_u8(DC_DIFFERENCE_FILTER, DIFFERENCE_FILTER_POWER_UP);
        memory.set_u8(DC_SPEED_FILTER, SPEED_FILTER_POWER_UP);
    }

    /// Local time in ns. `now` may lie before the last frame, which came later by its way here.
    pub(super) fn local(&self, now: Instant) -> u64 {
        let elapsed = i128::from(now.as_nanos()) - i128::from(self.at.as_nanos());
        let rate = i128::from(self.drift_ppb) + i128::from(self.correction_ppb);
        let gained = elapsed + elapsed * rate / BILLION;
        self.local_ns.wrapping_add(gained as u64)
    }

    /// System time in ns.
    pub(super) fn system(&self, now: Instant, memory: &Memory) -> u64 {
        self.local(now).wrapping_add(memory.u64(DC_OFFSET))
    }

    /// Makes `now` the moment that the clock counts from.
    fn rebase(&mut self, now: Instant) {
        self.local_ns = self.local(now);
        self.at = now;
    }

    /// Port 0 and the processing unit saw the frame that latches.
    pub(super) fn latch(&self, now: Instant, memory: &mut Memory) {
        let local = self.local(now);
        memory.set_u32(DC_RECEIVE_TIMES, local as u32);
        memory.set_u64(DC_RECEIVE_TIME, local);
    }

    /// Port 1 saw it come back.
    pub(super) fn latch_return(&self, now: Instant, memory: &mut Memory) {
        memory.set_u32(DC_RECEIVE_TIMES + 4, self.local(now) as u32);
    }

    /// The loop forgets what it has seen: offset, delay or speed start were written.
    pub(super) fn restart(&mut self, now: Instant, memory: &mut Memory) {
        self.rebase(now);
        self.compared_at = None;
        self.difference = 0;
        self.show(memory);
    }

    /// System time of the reference clock came in.
    pub(super) fn compare(&mut self, now: Instant, received: u32, memory: &mut Memory) {
        let delay = u64::from(memory.u32(DC_DELAY));
        let own = self.system(now, memory).wrapping_sub(delay);
        // The comparison is 32 bits wide, as the registers are.
        let error = i64::from((own as u32).wrapping_sub(received) as i32);
        let Some(before) = self.compared_at.replace(now) else {
            self.difference = error * DIFFERENCE_UNIT;
            self.show(memory);
            return;
        };
        let depth = u32::from(memory.u8(DC_DIFFERENCE_FILTER) & 0x0F);
        self.difference += (error * DIFFERENCE_UNIT - self.difference) / (1_i64 << depth);
        let elapsed = i64::try_from((now - before).as_nanos()).unwrap_or(i64::MAX);
        if elapsed > 0 {
            self.rebase(now);
            let limit = elapsed / 10;
            let step = (error / PHASE_DIVISOR).clamp(-limit, limit);
            self.local_ns = self.local_ns.wrapping_sub(step as u64);
            let rate = i128::from(self.correction_ppb)
                - i128::from(error) * BILLION / (RATE_DIVISOR * i128::from(elapsed));
            let rate = rate.clamp(-RATE_LIMIT_PPB, RATE_LIMIT_PPB);
            self.correction_ppb = i64::try_from(rate).unwrap_or(0);
        }
        self.show(memory);
    }

    /// Writes the difference, and the rate in the speed counter's unit, to the registers.
    fn show(&self, memory: &mut Memory) {
        let difference_ns = self.difference / DIFFERENCE_UNIT;
        let magnitude = u32::try_from(difference_ns.unsigned_abs())
            .unwrap_or(u32::MAX)
            .min(!DC_DIFFERENCE_BEHIND);
        let sign = if difference_ns < 0 { DC_DIFFERENCE_BEHIND } else { 0 };
        memory.set_u32(DC_DIFFERENCE, sign | magnitude);
        let counts = i128::from(self.correction_ppb) * i128::from(memory.u16(DC_SPEED_START));
        memory.set_u16(DC_SPEED_DIFFERENCE, (counts / BILLION) as i16 as u16);
    }

    /// Whether SYNC0 is active.
    pub(super) const fn has_sync0(&self) -> bool {
        self.next_sync0.is_some()
    }

    /// The activation register was written. A start in the past counts as reached: SYNC0 then comes
    /// at the next full cycle after it.
    ///
    /// Source: choice, for a start in the past.
    pub(super) fn activate(&mut self, now: Instant, memory: &mut Memory) {
        let active = memory.u8(DC_ACTIVATION) & DC_ACTIVATION_SYNC0 == DC_ACTIVATION_SYNC0;
        if !active {
            self.next_sync0 = None;
        } else if self.next_sync0.is_none() {
            let start = memory.u64(DC_SYNC0_TIME);
            self.next_sync0 = Some(start);
            if start < self.system(now, memory) {
                self.advance(now, memory);
            }
        }
        self.show_sync(memory);
    }

    /// Whether a SYNC0 came since the last call; several count as one.
    pub(super) fn sync0_came(&mut self, now: Instant, memory: &mut Memory) -> bool {
        let came = self.next_sync0.is_some_and(|next| self.system(now, memory) >= next);
        if came {
            self.advance(now, memory);
            self.show_sync(memory);
        }
        came
    }

    /// Moves the next SYNC0 behind `now` by whole cycles; a cycle of zero is a single shot.
    fn advance(&mut self, now: Instant, memory: &Memory) {
        let (system, cycle) = (self.system(now, memory), u64::from(memory.u32(DC_SYNC0_CYCLE)));
        let passed = self.next_sync0.map_or(0, |next| system.saturating_sub(next));
        self.next_sync0 = match passed.checked_div(cycle) {
            Some(cycles) => self
                .next_sync0
                .map(|next| next.saturating_add(cycles.saturating_add(1).saturating_mul(cycle))),
            None => Some(u64::MAX),
        };
    }

    fn show_sync(&self, memory: &mut Memory) {
        if let Some(next) = self.next_sync0 {
            memory.set_u64(DC_SYNC0_TIME, next);
            let shift = u64::from(memory.u32(DC_SYNC1_CYCLE));
            memory.set_u64(DC_SYNC1_TIME, next.saturating_add(shift));
        }
    }

    /// Brings the registers that show the time up to date.
    pub(super) fn refresh(&self, now: Instant, memory: &mut Memory) {
        let system = self.system(now, memory);
        memory.set_u64(DC_SYSTEM_TIME, system);
    }
}
