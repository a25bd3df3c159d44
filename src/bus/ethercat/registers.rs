//! Which registers exist, which of them the main device can write, and their power-up values.
//!
//! A register that does not exist leaves the working counter as it is; one that is read-only
//! counts a write and ignores it.
//!
//! Source: ETG.1000 part 4; choice, for the write to a read-only register.

use crate::wire::ethercat::register::{
    DL_CONTROL, DL_CONTROL_POWER_UP, FEATURES, FEATURES_DC, FMMU_COUNT, PDI_WATCHDOG,
    PORT_DESCRIPTOR, PROCESS_WATCHDOG, RAM_SIZE, SYNC_MANAGER_COUNT, TYPE, WATCHDOG_DIVIDER,
    WATCHDOG_DIVIDER_POWER_UP, WATCHDOG_POWER_UP,
};

use super::memory::Memory;

/// Number of FMMUs.
pub(super) const FMMUS: usize = 8;
/// Number of sync managers.
pub(super) const SYNC_MANAGERS: usize = 8;

/// First and last address of the registers that exist.
const EXISTING: &[(u16, u16)] = &[
    (0x0000, 0x0009),
    (0x0010, 0x0013),
    (0x0100, 0x0103),
    (0x0110, 0x0111),
    (0x0120, 0x0121),
    (0x0130, 0x0135),
    (0x0140, 0x0141),
    (0x0150, 0x0153),
    (0x0200, 0x0207),
    (0x0210, 0x0211),
    (0x0220, 0x0223),
    (0x0300, 0x030D),
    (0x0310, 0x0313),
    (0x0400, 0x0401),
    (0x0410, 0x0411),
    (0x0420, 0x0421),
    (0x0440, 0x0443),
    (0x0500, 0x050F),
    (0x0600, 0x067F),
    (0x0800, 0x083F),
    (0x0F80, 0x0FFF),
];

/// The same for the distributed clock.
const EXISTING_DC: (u16, u16) = (0x0900, 0x09FF);

/// First and last address of what a write simply stores. Registers on which a write does something
/// else are not here: counters, SII control, system time, sync managers.
const STORING: &[(u16, u16)] = &[
    (0x0010, 0x0011),
    (0x0100, 0x0103),
    (0x0120, 0x0121),
    (0x0200, 0x0201),
    (0x0400, 0x0401),
    (0x0410, 0x0411),
    (0x0420, 0x0421),
    (0x0600, 0x067F),
    (0x0F80, 0x0FFF),
];

/// The same for the distributed clock.
const STORING_DC: &[(u16, u16)] = &[
    (0x0920, 0x092B),
    (0x0930, 0x0931),
    (0x0934, 0x0935),
    (0x0980, 0x0981),
    (0x0990, 0x0997),
    (0x09A0, 0x09A7),
    (0x09A8, 0x09A9),
];

fn within(list: &[(u16, u16)], address: u16) -> bool {
    list.iter().any(|(first, last)| (*first..=*last).contains(&address))
}

/// Whether any of `length` registers from `address` on exists.
pub(super) fn any_exists(address: u16, length: usize, clock: bool) -> bool {
    let end = usize::from(address) + length;
    EXISTING.iter().chain(clock.then_some(&EXISTING_DC)).any(|(first, last)| {
        usize::from(address) <= usize::from(*last) && usize::from(*first) < end
    })
}

/// Whether a write to this byte stores it.
pub(super) fn stores(address: u16, clock: bool) -> bool {
    within(STORING, address) || (clock && within(STORING_DC, address))
}

/// Writes the values that all ESCs of this kind have after power-up.
pub(super) fn power_up(memory: &mut Memory, clock: bool) {
    // An ESC with 4 KB of process data memory and two MII ports.
    memory.set_u8(TYPE, 0x11);
    memory.set_u8(FMMU_COUNT, FMMUS as u8);
    memory.set_u8(SYNC_MANAGER_COUNT, SYNC_MANAGERS as u8);
    memory.set_u8(RAM_SIZE, 4);
    memory.set_u8(PORT_DESCRIPTOR, 0x0F);
    memory.set_u16(FEATURES, if clock { FEATURES_DC } else { 0 });
    memory.set_u32(DL_CONTROL, DL_CONTROL_POWER_UP);
    memory.set_u16(WATCHDOG_DIVIDER, WATCHDOG_DIVIDER_POWER_UP);
    memory.set_u16(PDI_WATCHDOG, WATCHDOG_POWER_UP);
    memory.set_u16(PROCESS_WATCHDOG, WATCHDOG_POWER_UP);
}
