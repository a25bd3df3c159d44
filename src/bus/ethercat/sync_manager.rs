//! Sync managers: whole data only, and never the same mailbox twice.
//!
//! A buffer opens with the access to its first byte and closes with the access to its last; bytes
//! between are reachable only while it is open. Three buffers let both sides work at any time on
//! the newest whole data; a mailbox is written, then read, then written. The firmware's accesses
//! happen between frames and at once, so only the main device's side has to be remembered.
//!
//! Source: ETG.1000 part 4.

use crate::wire::ethercat::register::{
    RAM_START, SyncManagerActivation, SyncManagerControl, SyncManagerStatus,
};

use super::memory::MEMORY_LEN;

/// One sync manager.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SyncManager {
    start: u16,
    length: u16,
    control: SyncManagerControl,
    enabled: bool,
    /// The main device is between first and last byte.
    open: bool,
    /// The buffer the main device works on, 0 to 2; a mailbox has only 0.
    buffer: u8,
    /// The buffer with the newest whole data.
    newest: Option<u8>,
    /// Whole data that the other side has not taken; a mailbox is full.
    unread: bool,
    status: SyncManagerStatus,
}

impl SyncManager {
    /// Takes over the registers; switching it on or off empties it.
    pub(super) fn configure(&mut self, registers: [u8; 8]) {
        let [s0, s1, l0, l1, control, _, activation, _] = registers;
        let enabled = SyncManagerActivation::from_bits_retain(activation)
            .contains(SyncManagerActivation::ENABLED);
        if enabled != self.enabled {
            *self = Self { enabled, status: SyncManagerStatus::BUFFER, ..Self::default() };
        }
        self.start = u16::from_le_bytes([s0, s1]);
        self.length = u16::from_le_bytes([l0, l1]);
        self.control = SyncManagerControl::from_bits_retain(control);
    }

    /// Whether it is switched on and makes sense: a length, memory behind it, no reserved mode.
    pub(super) fn is_usable(&self) -> bool {
        let buffers = if self.is_mailbox() { 1 } else { 3 };
        let end = usize::from(self.start) + buffers * usize::from(self.length);
        let reserved =
            SyncManagerControl::RESERVED_MODE.union(SyncManagerControl::RESERVED_DIRECTION);
        self.enabled
            && self.length > 0
            && self.start >= RAM_START
            && end <= MEMORY_LEN
            && !self.control.intersects(reserved)
    }

    pub(super) const fn is_enabled(&self) -> bool {
        self.enabled
    }

    pub(super) const fn is_mailbox(&self) -> bool {
        self.control.contains(SyncManagerControl::MAILBOX)
    }

    /// Whether the main device writes and the firmware reads.
    pub(super) const fn is_output(&self) -> bool {
        self.control.contains(SyncManagerControl::OUTPUT)
    }

    pub(super) const fn feeds_watchdog(&self) -> bool {
        self.control.contains(SyncManagerControl::WATCHDOG)
    }

    pub(super) fn length(&self) -> usize {
        usize::from(self.length)
    }

    pub(super) const fn start(&self) -> u16 {
        self.start
    }

    /// First address behind everything it occupies.
    pub(super) fn end(&self) -> usize {
        let buffers = if self.is_mailbox() { 1 } else { 3 };
        usize::from(self.start) + buffers * self.length()
    }

    /// Whole data that the other side has not taken.
    pub(super) const fn has_unread(&self) -> bool {
        self.unread
    }

    pub(super) const fn status(&self) -> SyncManagerStatus {
        self.status
    }

    /// Address of one of its buffers.
    fn address(&self, buffer: u8) -> u16 {
        self.start.saturating_add(self.length.saturating_mul(u16::from(buffer)))
    }

    fn is_first(&self, offset: u16) -> bool {
        offset == 0
    }

    fn is_last(&self, offset: u16, count: usize) -> bool {
        usize::from(offset) + count >= self.length()
    }

    /// Asks for an access of the main device to `count` bytes from `offset` on; the answer is where
    /// they are. It may open the buffer; [`close`](Self::close) must follow the access.
    pub(super) fn open(&mut self, write: bool, offset: u16) -> Option<u16> {
        if write != self.is_output() {
            return None;
        }
        let allowed = match (self.is_mailbox(), write) {
            (true, true) => !self.unread,
            (true, false) => self.unread,
            (false, true) => true,
            (false, false) => self.newest.is_some(),
        };
        if !allowed {
            return None;
        }
        if self.is_first(offset) {
            self.open = true;
            self.status.remove(if write {
                SyncManagerStatus::READ
            } else {
                SyncManagerStatus::WRITTEN
            });
            if let (false, Some(newest)) = (write, self.newest) {
                self.buffer = newest;
            }
        }
        let offset = self.open.then_some(offset)?;
        Some(self.address(self.buffer).saturating_add(offset))
    }

    /// Where a write of the main device would go, without any effect.
    pub(super) fn peek(&self, offset: u16) -> u16 {
        self.address(self.buffer).saturating_add(offset)
    }

    /// Ends an access that [`open`](Self::open) allowed; true if it closed the buffer.
    pub(super) fn close(&mut self, write: bool, offset: u16, count: usize) -> bool {
        if !self.is_last(offset, count) {
            return false;
        }
        self.open = false;
        if write {
            self.newest = Some(self.buffer);
            self.unread = true;
            self.written();
            if !self.is_mailbox() {
                self.buffer = (self.buffer + 1) % 3;
            }
        } else {
            self.unread = false;
            self.status.insert(SyncManagerStatus::READ);
            self.status.remove(SyncManagerStatus::FULL);
        }
        true
    }

    /// Status after somebody wrote the buffer to its end.
    fn written(&mut self) {
        self.status.insert(SyncManagerStatus::WRITTEN);
        if self.is_mailbox() {
            self.status.insert(SyncManagerStatus::FULL);
        } else {
            let newest = SyncManagerStatus::from_bits_retain(self.newest.unwrap_or(3) << 4);
            self.status.remove(SyncManagerStatus::BUFFER);
            self.status.insert(newest);
        }
    }

    /// Firmware: where the newest outputs or the mailbox datagram are; `None` before the first.
    pub(super) fn newest_address(&self) -> Option<u16> {
        self.newest.map(|buffer| self.address(buffer))
    }

    /// Firmware: has taken what was there; a mailbox is empty again.
    pub(super) fn take(&mut self) {
        self.unread = false;
        self.status.remove(SyncManagerStatus::FULL.union(SyncManagerStatus::WRITTEN));
        self.status.insert(SyncManagerStatus::READ);
    }

    /// Firmware: where to write the next inputs or mailbox datagram.
    pub(super) fn free_address(&self) -> u16 {
        self.address(self.free_buffer())
    }

    fn free_buffer(&self) -> u8 {
        if self.is_mailbox() {
            return 0;
        }
        let held = self.open.then_some(self.buffer);
        (0..3).find(|buffer| Some(*buffer) != self.newest && Some(*buffer) != held).unwrap_or(0)
    }

    /// Firmware: has written what [`free_address`](Self::free_address) pointed at.
    pub(super) fn put(&mut self) {
        self.newest = Some(self.free_buffer());
        self.unread = true;
        self.status.remove(SyncManagerStatus::READ);
        self.written();
    }
}
