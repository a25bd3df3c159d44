//! The ESC itself: what a datagram does to registers and memory, and they to it.
//!
//! Read [`Controller::process`] first. Everything that the firmware has to look at is left in
//! [`Pending`]; it is dealt with when the whole frame has passed.
//!
//! Source: ETG.1000 part 4.

use crate::time::Instant;
use crate::wire::ethercat::command::Command;
use crate::wire::ethercat::frame::{DatagramMut, MAX_DATA};
use crate::wire::ethercat::register::{
    AL_CONTROL, AL_EVENT_AL_CONTROL, AL_EVENT_REQUEST, AL_EVENT_SYNC_MANAGER_CHANGE,
    AL_EVENT_SYNC_MANAGER_SHIFT, AL_EVENT_WATCHDOG, AL_STATUS, DC_ACTIVATION, DC_OFFSET,
    DC_RECEIVE_TIMES, DC_SPEED_START, DC_SYSTEM_TIME, DL_CONTROL, DL_CONTROL_ALIAS, DL_STATUS,
    ECAT_EVENT_AL_STATUS, ECAT_EVENT_DL_STATUS, ECAT_EVENT_MASK, ECAT_EVENT_REQUEST,
    ECAT_EVENT_SYNC_MANAGER_SHIFT, FMMU, FMMU_LEN, LOST_LINKS, PROCESS_WATCHDOG_COUNTER,
    PROCESSING_ERRORS, RAM_START, RX_ERRORS, SII_ACCESS, SII_ADDRESS, SII_CONTROL, STATION_ADDRESS,
    STATION_ALIAS, SYNC_MANAGER, SYNC_MANAGER_LEN,
};

use super::clock::Clock;
use super::eeprom::Eeprom;
use super::fmmu::{Fmmu, Overlap, copy_bits};
use super::memory::{MEMORY_LEN, Memory};
use super::registers::{self, FMMUS, SYNC_MANAGERS};
use super::sync_manager::SyncManager;
use super::watchdog::Watchdogs;

/// What the firmware has not looked at yet.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pending {
    /// AL control was written.
    pub(super) al_control: bool,
    /// A sync manager's registers were written.
    pub(super) sync_managers_changed: bool,
    /// Sync managers, one bit each, that the main device wrote to the end.
    pub(super) written: u8,
    /// Sync managers, one bit each, that the main device read to the end.
    pub(super) read: u8,
}

/// Registers, memory, FMMUs, sync managers, SII, clock and watchdogs of one ESC.
#[derive(Clone, Debug)]
pub(super) struct Controller {
    pub(super) memory: Memory,
    fmmus: [Fmmu; FMMUS],
    pub(super) sync_managers: [SyncManager; SYNC_MANAGERS],
    pub(super) eeprom: Eeprom,
    pub(super) clock: Option<Clock>,
    pub(super) watchdogs: Watchdogs,
    pub(super) pending: Pending,
    /// Events for the main device that it clears by reading.
    pub(super) events: u16,
    /// The latch of receive times waits for the frame to come back.
    latched: bool,
    now: Instant,
}

/// What an access does to what it finds.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Access {
    Read,
    Write,
    ReadWrite,
    /// Reads with the datagram's data OR-ed in.
    BroadcastRead,
    BroadcastReadWrite,
}

/// Where the next bytes of a physical access lie.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    Registers,
    Ram,
    SyncManager(usize),
    Nowhere,
}

impl Controller {
    /// An ESC at the moment its power comes.
    pub(super) fn new(eeprom: Eeprom, clock: Option<Clock>) -> Self {
        let mut memory = Memory::new();
        registers::power_up(&mut memory, clock.is_some());
        if let Some(clock) = &clock {
            clock.load(&mut memory);
        }
        eeprom.load(&mut memory);
        let mut controller = Self {
            memory,
            fmmus: [Fmmu::default(); FMMUS],
            sync_managers: [SyncManager::default(); SYNC_MANAGERS],
            eeprom,
            clock,
            watchdogs: Watchdogs::default(),
            pending: Pending::default(),
            events: 0,
            latched: false,
            now: Instant::ZERO,
        };
        controller.load_sync_managers();
        controller
    }

    /// Does what one datagram that arrives at `now` asks for.
    pub(super) fn process(&mut self, now: Instant, datagram: &mut DatagramMut<'_>) {
        self.now = now;
        let Some(command) = datagram.command() else { return };
        let selected = match command {
            Command::Nop => return,
            Command::Aprd { position, register } => {
                (position == 0).then_some((Access::Read, register))
            }
            Command::Apwr { position, register } => {
                (position == 0).then_some((Access::Write, register))
            }
            Command::Aprw { position, register } => {
                (position == 0).then_some((Access::ReadWrite, register))
            }
            Command::Armw { position, register } => {
                Some((if position == 0 { Access::Read } else { Access::Write }, register))
            }
            Command::Fprd { station, register } => {
                self.is_called(station).then_some((Access::Read, register))
            }
            Command::Fpwr { station, register } => {
                self.is_called(station).then_some((Access::Write, register))
            }
            Command::Fprw { station, register } => {
                self.is_called(station).then_some((Access::ReadWrite, register))
            }
            Command::Frmw { station, register } => {
                let access = if self.is_called(station) { Access::Read } else { Access::Write };
                Some((access, register))
            }
            Command::Brd { register, .. } => Some((Access::BroadcastRead, register)),
            Command::Bwr { register, .. } => Some((Access::Write, register)),
            Command::Brw { register, .. } => Some((Access::BroadcastReadWrite, register)),
            Command::Lrd { address } => {
                let counted = self.logical(Access::Read, address, datagram.data);
                datagram.add_to_working_counter(counted);
                None
            }
            Command::Lwr { address } => {
                let counted = self.logical(Access::Write, address, datagram.data);
                datagram.add_to_working_counter(counted);
                None
            }
            Command::Lrw { address } => {
                let counted = self.logical(Access::ReadWrite, address, datagram.data);
                datagram.add_to_working_counter(counted);
                None
            }
        };
        if matches!(
            command,
            Command::Aprd { .. }
                | Command::Apwr { .. }
                | Command::Aprw { .. }
                | Command::Armw { .. }
                | Command::Brd { .. }
                | Command::Bwr { .. }
                | Command::Brw { .. }
        ) {
            datagram.count_device();
        }
        if let Some((access, address)) = selected {
            let counted = self.physical(access, address, datagram.data);
            datagram.add_to_working_counter(counted);
        }
        let mask = self.memory.u16(ECAT_EVENT_MASK);
        if mask != 0 {
            datagram.raise_event(self.ecat_events() & mask);
        }
    }

    /// Whether a station address means this ESC.
    fn is_called(&self, station: u16) -> bool {
        station == self.memory.u16(STATION_ADDRESS)
            || (self.memory.u32(DL_CONTROL) & DL_CONTROL_ALIAS != 0
                && station == self.memory.u16(STATION_ALIAS))
    }

    /// A physical access; the answer is what it adds to the working counter.
    fn physical(&mut self, access: Access, address: u16, data: &mut [u8]) -> u16 {
        let mut copy = [0; MAX_DATA];
        match access {
            Access::Read => u16::from(self.read(address, data)),
            Access::Write => u16::from(self.write(address, data)),
            Access::BroadcastRead => {
                let read = self.read_or(address, data, &mut copy);
                u16::from(read)
            }
            Access::ReadWrite | Access::BroadcastReadWrite => {
                // The old memory goes to the frame, what the frame held goes to the memory.
                let Some(sent) = copy.get_mut(..data.len()) else { return 0 };
                sent.copy_from_slice(data);
                let read = if access == Access::ReadWrite {
                    self.read(address, data)
                } else {
                    self.read_or(address, data, &mut [0; MAX_DATA])
                };
                u16::from(read) + 2 * u16::from(self.write(address, sent))
            }
        }
    }

    /// Reads into `found` and ORs that to `data`.
    fn read_or(&mut self, address: u16, data: &mut [u8], found: &mut [u8; MAX_DATA]) -> bool {
        let Some(found) = found.get_mut(..data.len()) else { return false };
        let read = self.read(address, found);
        for (byte, found) in data.iter_mut().zip(found) {
            *byte |= *found;
        }
        read
    }

    /// A logical access through all FMMUs; the answer is what it adds to the working counter.
    fn logical(&mut self, access: Access, address: u32, data: &mut [u8]) -> u16 {
        let mut copy = [0; MAX_DATA];
        let Some(sent) = copy.get_mut(..data.len()) else { return 0 };
        sent.copy_from_slice(data);
        let (mut read, mut written) = (false, false);
        for fmmu in self.fmmus {
            let Some(overlap) = fmmu.overlap(address, data.len()) else { continue };
            if fmmu.read && access != Access::Write {
                read |= self.read_mapped(overlap, data);
            }
            if fmmu.write && access != Access::Read {
                written |= self.write_mapped(overlap, sent);
            }
        }
        let weight = if access == Access::ReadWrite { 2 } else { 1 };
        u16::from(read) + weight * u16::from(written)
    }

    fn read_mapped(&mut self, overlap: Overlap, data: &mut [u8]) -> bool {
        if let Some((at, address, length)) = overlap.in_bytes() {
            let target = data.get_mut(at..).and_then(|rest| rest.get_mut(..length));
            return target.is_some_and(|target| self.read(address, target));
        }
        let mut found = [0; MAX_DATA + 1];
        let Some(found) = found.get_mut(..overlap.physical_len()) else { return false };
        let read = self.read(overlap.first_address(), found);
        if read {
            copy_bits(data, overlap.data_bit, found, overlap.physical_bit % 8, overlap.bits);
        }
        read
    }

    fn write_mapped(&mut self, overlap: Overlap, data: &[u8]) -> bool {
        if let Some((at, address, length)) = overlap.in_bytes() {
            let source = data.get(at..).and_then(|rest| rest.get(..length));
            return source.is_some_and(|source| self.write(address, source));
        }
        let mut changed = [0; MAX_DATA + 1];
        let Some(changed) = changed.get_mut(..overlap.physical_len()) else { return false };
        let mut address = overlap.first_address();
        for byte in changed.iter_mut() {
            *byte = self.memory.u8(self.under(address));
            address = address.saturating_add(1);
        }
        copy_bits(changed, overlap.physical_bit % 8, data, overlap.data_bit, overlap.bits);
        self.write(overlap.first_address(), changed)
    }

    /// Where a write to this address would go, for reading the bits around it.
    fn under(&self, address: u16) -> u16 {
        self.sync_manager_at(address).map_or(address, |(_, manager)| {
            if manager.is_output() { manager.peek(address - manager.start()) } else { address }
        })
    }

    /// The sync manager that guards this address.
    fn sync_manager_at(&self, address: u16) -> Option<(usize, &SyncManager)> {
        self.sync_managers.iter().enumerate().find(|(_, manager)| {
            manager.is_usable()
                && address
                    .checked_sub(manager.start())
                    .is_some_and(|offset| usize::from(offset) < manager.length())
        })
    }

    /// What lies at `address` and how many of `length` bytes lie there too.
    fn place(&self, address: u16, length: usize) -> (Place, usize) {
        let start = usize::from(address);
        let until = |end: usize| length.min(end.saturating_sub(start));
        if address < RAM_START {
            return (Place::Registers, until(usize::from(RAM_START)));
        }
        if start >= MEMORY_LEN {
            return (Place::Nowhere, length);
        }
        if let Some((index, manager)) = self.sync_manager_at(address) {
            let end = usize::from(manager.start()) + manager.length();
            return (Place::SyncManager(index), until(end));
        }
        let next = self
            .sync_managers
            .iter()
            .filter(|manager| manager.is_usable())
            .map(|manager| usize::from(manager.start()))
            .filter(|next| *next > start)
            .min()
            .unwrap_or(MEMORY_LEN);
        (Place::Ram, until(next))
    }

    /// Reads what can be read of a range; false if nothing can. Other bytes of `data` stay.
    fn read(&mut self, mut address: u16, mut data: &mut [u8]) -> bool {
        let mut any = false;
        while !data.is_empty() {
            let (place, count) = self.place(address, data.len());
            let Some((part, rest)) = data.split_at_mut_checked(count) else { break };
            any |= match place {
                Place::Registers => self.read_registers(address, part),
                Place::Ram => self.read_ram(address, part),
                Place::SyncManager(index) => self.read_guarded(index, address, part),
                Place::Nowhere => false,
            };
            data = rest;
            let Some(next) = advance(address, count) else { break };
            address = next;
        }
        any
    }

    /// Writes what can be written of a range; false if nothing can.
    fn write(&mut self, mut address: u16, mut data: &[u8]) -> bool {
        let mut any = false;
        while !data.is_empty() {
            let (place, count) = self.place(address, data.len());
            let Some((part, rest)) = data.split_at_checked(count) else { break };
            any |= match place {
                Place::Registers => self.write_registers(address, part),
                Place::Ram => self.write_ram(address, part),
                Place::SyncManager(index) => self.write_guarded(index, address, part),
                Place::Nowhere => false,
            };
            data = rest;
            let Some(next) = advance(address, count) else { break };
            address = next;
        }
        any
    }

    fn read_ram(&self, address: u16, target: &mut [u8]) -> bool {
        let source = self.memory.get(address, target.len());
        source.map(|source| target.copy_from_slice(source)).is_some()
    }

    fn write_ram(&mut self, address: u16, source: &[u8]) -> bool {
        let target = self.memory.get_mut(address, source.len());
        target.map(|target| target.copy_from_slice(source)).is_some()
    }

    fn read_guarded(&mut self, index: usize, address: u16, target: &mut [u8]) -> bool {
        let Some(manager) = self.sync_managers.get_mut(index) else { return false };
        let offset = address - manager.start();
        let Some(at) = manager.open(false, offset) else { return false };
        if let Some(source) = self.memory.get(at, target.len()) {
            target.copy_from_slice(source);
        }
        if manager.close(false, offset, target.len()) {
            self.pending.read |= 1 << index;
        }
        self.show_sync_manager(index);
        true
    }

    fn write_guarded(&mut self, index: usize, address: u16, source: &[u8]) -> bool {
        let Some(manager) = self.sync_managers.get_mut(index) else { return false };
        let offset = address - manager.start();
        let Some(at) = manager.open(true, offset) else { return false };
        if let Some(target) = self.memory.get_mut(at, source.len()) {
            target.copy_from_slice(source);
        }
        if manager.close(true, offset, source.len()) {
            self.pending.written |= 1 << index;
            if manager.feeds_watchdog() {
                self.watchdogs.feed_process(self.now);
            }
        }
        self.show_sync_manager(index);
        true
    }

    /// Copies a sync manager's status to its register.
    pub(super) fn show_sync_manager(&mut self, index: usize) {
        if let (Some(manager), Some(base)) = (self.sync_managers.get(index), sync_manager_at(index))
        {
            self.memory.set_u8(base + 5, manager.status().bits());
        }
    }

    fn load_sync_managers(&mut self) {
        for index in 0..SYNC_MANAGERS {
            let Some(base) = sync_manager_at(index) else { continue };
            let bytes = self.memory.read(base);
            if let Some(manager) = self.sync_managers.get_mut(index) {
                manager.configure(bytes);
            }
            self.show_sync_manager(index);
        }
    }

    /// Events for the main device.
    fn ecat_events(&self) -> u16 {
        let inputs = self.sync_manager_bits(|manager| !manager.is_output());
        self.events | u16::from(inputs) << ECAT_EVENT_SYNC_MANAGER_SHIFT
    }

    /// Events for the firmware.
    fn al_events(&self) -> u32 {
        let outputs = self.sync_manager_bits(SyncManager::is_output);
        let mut events = u32::from(outputs) << AL_EVENT_SYNC_MANAGER_SHIFT;
        for (raised, event) in [
            (self.pending.al_control, AL_EVENT_AL_CONTROL),
            (self.pending.sync_managers_changed, AL_EVENT_SYNC_MANAGER_CHANGE),
            (self.watchdogs.process_has_expired(), AL_EVENT_WATCHDOG),
        ] {
            if raised {
                events |= event;
            }
        }
        events
    }

    /// One bit for each sync manager of a kind that holds unread data.
    fn sync_manager_bits(&self, kind: impl Fn(&SyncManager) -> bool) -> u8 {
        self.sync_managers.iter().rev().fold(0, |bits, manager| {
            bits << 1 | u8::from(manager.is_usable() && manager.has_unread() && kind(manager))
        })
    }

    fn read_registers(&mut self, address: u16, target: &mut [u8]) -> bool {
        let touched = Touched { address, length: target.len() };
        if !registers::any_exists(address, target.len(), self.clock.is_some()) {
            return false;
        }
        if touched.any(ECAT_EVENT_REQUEST, 2) {
            self.memory.set_u16(ECAT_EVENT_REQUEST, self.ecat_events());
        }
        if touched.any(AL_EVENT_REQUEST, 4) {
            self.memory.set_u32(AL_EVENT_REQUEST, self.al_events());
        }
        if let (Some(clock), true) = (&self.clock, touched.any(DC_SYSTEM_TIME, 8)) {
            clock.refresh(self.now, &mut self.memory);
        }
        let read = self.read_ram(address, target);
        if touched.any(DL_STATUS, 2) {
            self.events &= !ECAT_EVENT_DL_STATUS;
        }
        if touched.any(AL_STATUS, 2) {
            self.events &= !ECAT_EVENT_AL_STATUS;
        }
        read
    }

    fn write_registers(&mut self, address: u16, source: &[u8]) -> bool {
        let clock = self.clock.is_some();
        let touched = Touched { address, length: source.len() };
        if !registers::any_exists(address, source.len(), clock) {
            return false;
        }
        let sii_open = self.eeprom.is_open(&self.memory);
        for (at, byte) in (address..).zip(source) {
            let stores = match at {
                SII_ACCESS => true,
                SII_ADDRESS..0x0510 => sii_open,
                _ if is_in_sync_managers(at) => self.sync_manager_stores(at),
                _ => registers::stores(at, clock),
            };
            if stores {
                self.memory.set_u8(at, *byte);
            }
        }
        self.written(touched, source, sii_open);
        true
    }

    /// Whether a byte of a sync manager can be written: activation always, the configuration while
    /// it was off, status and the firmware's byte never.
    fn sync_manager_stores(&self, address: u16) -> bool {
        let offset = address - SYNC_MANAGER;
        let manager = self.sync_managers.get(usize::from(offset / SYNC_MANAGER_LEN));
        match offset % SYNC_MANAGER_LEN {
            0..=4 => manager.is_some_and(|manager| !manager.is_enabled()),
            6 => true,
            _ => false,
        }
    }

    /// What a write to registers does beside storing bytes.
    fn written(&mut self, touched: Touched, source: &[u8], sii_open: bool) {
        self.pending.al_control |= touched.any(AL_CONTROL, 1);
        for (register, length) in [(RX_ERRORS, 12), (PROCESSING_ERRORS, 1), (LOST_LINKS, 4)] {
            self.clear_if_touched(touched, register, length);
        }
        self.clear_if_touched(touched, PROCESS_WATCHDOG_COUNTER, 2);
        if touched.any(SII_ACCESS, 1) {
            self.eeprom.access_written(&mut self.memory);
        }
        if touched.any(SII_CONTROL, 2) && sii_open {
            // A write of one of the two bytes leaves the other without a command.
            let low = touched.value(source, SII_CONTROL).map_or(0, u8::from_le_bytes);
            let high = touched.value(source, SII_CONTROL + 1).map_or(0, u8::from_le_bytes);
            let control = u16::from_le_bytes([low, high]);
            self.eeprom.control_written(&mut self.memory, control);
        }
        for (base, fmmu) in (FMMU..).step_by(usize::from(FMMU_LEN)).zip(&mut self.fmmus) {
            if touched.any(base, usize::from(FMMU_LEN)) {
                *fmmu = Fmmu::from_wire(self.memory.read(base));
            }
        }
        if touched.any(SYNC_MANAGER, SYNC_MANAGERS * usize::from(SYNC_MANAGER_LEN)) {
            self.pending.sync_managers_changed = true;
            self.load_sync_managers();
        }
        self.clock_written(touched, source);
    }

    fn clear_if_touched(&mut self, touched: Touched, register: u16, length: usize) {
        if let (Some(counters), true) =
            (self.memory.get_mut(register, length), touched.any(register, length))
        {
            counters.fill(0);
        }
    }

    fn clock_written(&mut self, touched: Touched, source: &[u8]) {
        let Some(clock) = &mut self.clock else { return };
        let (now, memory) = (self.now, &mut self.memory);
        if touched.any(DC_RECEIVE_TIMES, 4) {
            clock.latch(now, memory);
            self.latched = true;
        }
        if touched.any(DC_OFFSET, 12) || touched.any(DC_SPEED_START, 2) {
            clock.restart(now, memory);
        }
        if let Some(low) = touched.value(source, DC_SYSTEM_TIME) {
            clock.compare(now, u32::from_le_bytes(low), memory);
        }
        if touched.any(DC_ACTIVATION, 1) {
            clock.activate(now, memory);
        }
    }

    /// The frame came back at port 1 at `now`.
    pub(super) fn returned(&mut self, now: Instant) {
        if let (Some(clock), true) = (&self.clock, self.latched) {
            clock.latch_return(now, &mut self.memory);
        }
    }

    /// The frame is over.
    pub(super) fn end_frame(&mut self) {
        self.latched = false;
    }
}

/// Address of a sync manager's registers.
fn sync_manager_at(index: usize) -> Option<u16> {
    u16::try_from(index).ok().map(|index| SYNC_MANAGER + SYNC_MANAGER_LEN * index)
}

fn is_in_sync_managers(address: u16) -> bool {
    address
        .checked_sub(SYNC_MANAGER)
        .is_some_and(|offset| usize::from(offset) < SYNC_MANAGERS * usize::from(SYNC_MANAGER_LEN))
}

/// The address behind a part; `None` beyond the end of the address space.
fn advance(address: u16, count: usize) -> Option<u16> {
    address.checked_add(u16::try_from(count).ok()?)
}

/// The registers that an access touches.
#[derive(Clone, Copy)]
struct Touched {
    address: u16,
    length: usize,
}

impl Touched {
    /// Whether it touches any of `length` bytes from `register` on.
    fn any(self, register: u16, length: usize) -> bool {
        let (start, first) = (usize::from(self.address), usize::from(register));
        start < first + length && first < start + self.length
    }

    /// The value written to a whole register.
    fn value<const N: usize>(self, source: &[u8], register: u16) -> Option<[u8; N]> {
        let at = usize::from(register.checked_sub(self.address)?);
        source.get(at..)?.first_chunk().copied()
    }
}
