//! ESC registers that the link uses beyond what `ethercrab` does. Source: ETG.1000 part 4.

pub(super) const STATION: u16 = 0x0010;
pub(super) const AL_CONTROL: u16 = 0x0120;
pub(super) const AL_STATUS: u16 = 0x0130;
pub(super) const AL_STATUS_CODE: u16 = 0x0134;
pub(super) const WATCHDOG_DIVIDER: u16 = 0x0400;
pub(super) const PROCESS_DATA_WATCHDOG: u16 = 0x0420;
pub(super) const FMMUS: u16 = 0x0600;
pub(super) const SYNC_MANAGERS: u16 = 0x0800;
pub(super) const SYSTEM_TIME: u16 = 0x0910;
pub(super) const SYSTEM_TIME_OFFSET: u16 = 0x0920;
pub(super) const SYSTEM_TIME_DELAY: u16 = 0x0928;
pub(super) const SYNC_ACTIVATION: u16 = 0x0981;
pub(super) const SYNC0_START: u16 = 0x0990;
pub(super) const SYNC0_CYCLE: u16 = 0x09A0;
