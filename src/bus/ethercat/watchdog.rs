//! The two watchdogs of an ESC: over the process data, and over the firmware.
//!
//! The process data watchdog starts with the first write to a sync manager that feeds it.
//!
//! Source: ETG.1000 part 4.

use crate::time::{Duration, Instant};
use crate::wire::ethercat::register::{
    PDI_WATCHDOG, PDI_WATCHDOG_COUNTER, PROCESS_WATCHDOG, PROCESS_WATCHDOG_COUNTER,
    PROCESS_WATCHDOG_STATUS, WATCHDOG_DIVIDER,
};

use super::memory::Memory;

/// When the two were fed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Watchdogs {
    process_fed: Option<Instant>,
    process_expired: bool,
    firmware_fed: Option<Instant>,
    firmware_expired: bool,
}

/// The time limit in a register; `None` when it is switched off.
fn limit(memory: &Memory, register: u16) -> Option<Duration> {
    let unit_ns = (u64::from(memory.u16(WATCHDOG_DIVIDER)) + 2) * 40;
    let units = u64::from(memory.u16(register));
    (units > 0).then(|| Duration::from_nanos(units * unit_ns))
}

impl Watchdogs {
    /// Process data were written.
    pub(super) fn feed_process(&mut self, now: Instant) {
        self.process_fed = Some(now);
        self.process_expired = false;
    }

    /// The firmware has shown that it lives.
    pub(super) fn feed_firmware(&mut self, now: Instant) {
        self.firmware_fed = Some(now);
        self.firmware_expired = false;
    }

    /// Whether the process data came and then stopped.
    pub(super) const fn process_has_expired(&self) -> bool {
        self.process_expired
    }

    /// Whether the firmware has stopped.
    pub(super) const fn firmware_has_expired(&self) -> bool {
        self.firmware_expired
    }

    /// Lets time pass: counts what expired and shows it in the status.
    pub(super) fn update(&mut self, now: Instant, memory: &mut Memory) {
        let process = limit(memory, PROCESS_WATCHDOG);
        let late = |fed: Option<Instant>, limit: Option<Duration>| {
            fed.zip(limit).is_some_and(|(fed, limit)| now - fed > limit)
        };
        if late(self.process_fed, process) {
            self.process_fed = None;
            self.process_expired = true;
            memory.count(PROCESS_WATCHDOG_COUNTER);
        }
        if late(self.firmware_fed, limit(memory, PDI_WATCHDOG)) {
            self.firmware_fed = None;
            self.firmware_expired = true;
            memory.count(PDI_WATCHDOG_COUNTER);
        }
        if process.is_none() {
            self.process_expired = false;
        }
        let healthy = self.process_fed.is_some() || process.is_none();
        memory.set_u16(PROCESS_WATCHDOG_STATUS, u16::from(healthy));
    }
}
