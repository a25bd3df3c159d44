//! The way from registers 0500h to 050Fh to the SII.
//!
//! A command is done at once: the busy bit is never seen set. While the SII is handed to the
//! firmware, the main device's accesses have no effect.
//!
//! Source: ETG.1000 part 4.

use crate::wire::ethercat::register::{
    PDI_CONTROL, SII_ACCESS, SII_ADDRESS, SII_CHECKSUM_ERROR, SII_COMMAND, SII_COMMAND_ERROR,
    SII_COMMAND_READ, SII_COMMAND_RELOAD, SII_COMMAND_WRITE, SII_CONTROL, SII_DATA,
    SII_READS_8_BYTES, SII_TWO_ADDRESS_BYTES, SII_WRITE_ENABLE, SII_WRITE_ERROR, STATION_ALIAS,
};
use crate::wire::ethercat::sii::{SII_LEN, SiiImage, word};

use super::memory::Memory;

const OFFERED_TO_FIRMWARE: u8 = 0x01;
const TAKEN_BACK: u8 = 0x02;

/// The SII and how much of it one read fetches.
#[derive(Clone, Debug)]
pub(super) struct Eeprom {
    pub(super) image: SiiImage,
    reads_8_bytes: bool,
}

impl Eeprom {
    pub(super) const fn new(image: SiiImage, reads_8_bytes: bool) -> Self {
        Self { image, reads_8_bytes }
    }

    /// Status without a command and without errors but that of the checksum.
    fn idle_status(&self) -> u16 {
        let mut status = SII_TWO_ADDRESS_BYTES;
        if self.reads_8_bytes {
            status |= SII_READS_8_BYTES;
        }
        if !self.image.checksum_is_right() {
            status |= SII_CHECKSUM_ERROR;
        }
        status
    }

    /// What an ESC loads when its power comes: nothing if the checksum is wrong.
    pub(super) fn load(&self, memory: &mut Memory) {
        memory.set_u16(SII_CONTROL, self.idle_status());
        if self.image.checksum_is_right() {
            memory.set_u16(PDI_CONTROL, self.image.word(word::PDI_CONTROL));
            memory.set_u16(STATION_ALIAS, self.image.word(word::ALIAS));
        }
    }

    /// Whether the main device may use the SII.
    pub(super) fn is_open(&self, memory: &Memory) -> bool {
        memory.u8(SII_ACCESS) & OFFERED_TO_FIRMWARE == 0
    }

    /// The access register was written: force wins over an offer.
    pub(super) fn access_written(&self, memory: &mut Memory) {
        let value = memory.u8(SII_ACCESS);
        if value & TAKEN_BACK != 0 {
            memory.set_u8(SII_ACCESS, value & !OFFERED_TO_FIRMWARE);
        }
    }

    /// Carries out what the main device wrote to the control register.
    pub(super) fn control_written(&mut self, memory: &mut Memory, control: u16) {
        let address = u16::try_from(memory.u32(SII_ADDRESS))
            .ok()
            .filter(|address| usize::from(*address) * 2 < SII_LEN);
        let error = match (control & SII_COMMAND, address) {
            // No command: clears the errors of the last one.
            (0, _) => 0,
            (SII_COMMAND_READ, Some(address)) => {
                let words = if self.reads_8_bytes { 4 } else { 2 };
                for (place, at) in (SII_DATA..).step_by(2).zip(address..).take(words) {
                    memory.set_u16(place, self.image.word(at));
                }
                0
            }
            (SII_COMMAND_WRITE, Some(_)) if control & SII_WRITE_ENABLE == 0 => SII_WRITE_ERROR,
            (SII_COMMAND_WRITE, Some(address)) => {
                self.image.set_word(address, memory.u16(SII_DATA));
                0
            }
            // The alias stays as it was at power-up, as in an ESC with a real memory.
            (SII_COMMAND_RELOAD, _) => 0,
            _ => SII_COMMAND_ERROR,
        };
        memory.set_u16(SII_CONTROL, self.idle_status() | error);
    }
}
