//! The SII: the small memory beside an ESC that says what the device is, built and read.
//!
//! ```text
//!  words 00h-07h configuration, the last one its checksum | 08h identity | 14h mailboxes
//!  3Eh size | 40h categories: type, length in words, data | FFFFh
//! ```
//!
//! [`SiiImage::new`] builds it from a [`Description`]; the PDO categories, which many devices leave
//! out, are added with [`SiiImage::push_pdos`]. Addresses are of words of two bytes.
//!
//! Source: ETG.1000 part 6.

use crc::{Algorithm, Crc};

use super::register::SyncManagerControl;

/// Length of the memory in bytes: 32 kbit.
pub const SII_LEN: usize = 4_096;

/// Word addresses in the fixed area.
pub mod word {
    /// What the firmware is attached by; goes to register 0140h.
    pub const PDI_CONTROL: u16 = 0x00;
    /// The second station address; goes to register 0012h.
    pub const ALIAS: u16 = 0x04;
    /// CRC-8 over the bytes before it, in its low byte.
    pub const CHECKSUM: u16 = 0x07;
    /// Vendor, two words; product, revision and serial number follow.
    pub const VENDOR: u16 = 0x08;
    /// Mailboxes after BOOT's: receive start and length, send start and length, protocols.
    pub const MAILBOX: u16 = 0x18;
    /// Size of the memory in kbit, minus one; the version of the layout follows.
    pub const SIZE: u16 = 0x3E;
    /// First category.
    pub const CATEGORIES: u16 = 0x40;
}

/// Types of categories.
pub mod category {
    /// Strings.
    pub const STRINGS: u16 = 10;
    /// General.
    pub const GENERAL: u16 = 30;
    /// Use of the FMMUs.
    pub const FMMU: u16 = 40;
    /// Sync managers.
    pub const SYNC_MANAGERS: u16 = 41;
    /// Process data from the device: inputs of the main device.
    pub const TX_PDO: u16 = 50;
    /// Process data to the device: outputs of the main device.
    pub const RX_PDO: u16 = 51;
    /// Distributed clocks.
    pub const DC: u16 = 60;
    /// No more categories.
    pub const END: u16 = 0xFFFF;
}

/// CRC-8 of the configuration area: polynomial 07h, start FFh.
const CHECKSUM: Algorithm<u8> = Algorithm {
    width: 8,
    poly: 0x07,
    init: 0xFF,
    refin: false,
    refout: false,
    xorout: 0x00,
    check: 0xFB,
    residue: 0x00,
};

/// The checksum of the configuration area, the first seven words.
#[must_use]
pub fn checksum(configuration: &[u8; 14]) -> u8 {
    const { Crc::<u8>::new(&CHECKSUM) }.checksum(configuration)
}

/// A mailbox's place in the memory of the ESC.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MailboxArea {
    /// First address.
    pub start: u16,
    /// Length in bytes.
    pub length: u16,
}

/// The mailboxes of a device and what it speaks there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MailboxDescription {
    /// What the main device writes.
    pub receive: MailboxArea,
    /// What the main device reads.
    pub send: MailboxArea,
    /// Protocols; [`PROTOCOL_COE`] is one bit of it.
    pub protocols: u16,
    /// What CoE can do, the bits `COE_..`.
    pub coe_details: u8,
}

/// Mailbox protocol: CANopen over EtherCAT.
pub const PROTOCOL_COE: u16 = 0x0004;
/// CoE: service data objects.
pub const COE_SDO: u8 = 0x01;
/// CoE: SDO information.
pub const COE_SDO_INFO: u8 = 0x02;
/// CoE: the PDO assignment can be written.
pub const COE_PDO_ASSIGN: u8 = 0x04;
/// CoE: the PDO mapping can be written.
pub const COE_PDO_CONFIGURATION: u8 = 0x08;
/// CoE: complete access.
pub const COE_COMPLETE_ACCESS: u8 = 0x20;

/// What an FMMU is meant for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FmmuUse {
    /// Nothing in particular.
    Unused,
    /// Outputs.
    Outputs,
    /// Inputs.
    Inputs,
    /// The state of the input mailbox.
    MailboxState,
}

/// What a sync manager is meant for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SyncManagerUse {
    /// Nothing.
    Unused,
    /// Mailbox, written by the main device.
    MailboxOut,
    /// Mailbox, read by the main device.
    MailboxIn,
    /// Outputs.
    Outputs,
    /// Inputs.
    Inputs,
}

/// A sync manager as the device wants it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SyncManagerDescription {
    /// First address of its buffer.
    pub start: u16,
    /// Length of its buffer in bytes; 0 where the assignment decides.
    pub length: u16,
    /// Control byte.
    pub control: SyncManagerControl,
    /// Whether it is to be switched on.
    pub enable: bool,
    /// What it is for.
    pub usage: SyncManagerUse,
}

/// How a device wants its distributed clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DcDescription {
    /// What goes to 0980h (low byte) and 0981h (high byte).
    pub assign_activate: u16,
    /// Shortest SYNC0 cycle in ns.
    pub min_cycle_ns: u32,
}

/// What the SII says of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Description {
    /// Vendor number.
    pub vendor: u32,
    /// Product code.
    pub product: u32,
    /// Revision.
    pub revision: u32,
    /// Serial number.
    pub serial: u32,
    /// Second station address, 0 for none.
    pub alias: u16,
    /// What the firmware is attached by; goes to register 0140h.
    pub pdi_control: u16,
    /// Group of devices; at most 255 bytes, as the other names.
    pub group: &'static str,
    /// Order number; a main device shows it as the short name.
    pub order: &'static str,
    /// Full name.
    pub name: &'static str,
    /// Mailboxes, if it has any.
    pub mailbox: Option<MailboxDescription>,
    /// What its FMMUs are for.
    pub fmmus: &'static [FmmuUse],
    /// Its sync managers.
    pub sync_managers: &'static [SyncManagerDescription],
    /// Its distributed clock, if it has one.
    pub dc: Option<DcDescription>,
}

/// Whose PDOs a category holds; directions are the main device's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PdoDirection {
    /// TxPDO of the device.
    Inputs,
    /// RxPDO of the device.
    Outputs,
}

/// A PDO for the SII.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pdo<E> {
    /// Index of its mapping object.
    pub index: u16,
    /// Sync manager it is assigned to.
    pub sync_manager: u8,
    /// Its entries, at most 255.
    pub entries: E,
}

/// An entry of a PDO for the SII.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PdoEntry {
    /// Index of the mapped object; 0 for a gap.
    pub index: u16,
    /// Sub-index of the mapped object.
    pub sub_index: u8,
    /// CoE data type; 0 for a gap.
    pub data_type: u8,
    /// Length in bits.
    pub bits: u8,
}

/// The image has no room for a category, or one of its counts does not fit its byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("category {category} does not fit the SII of 4096 bytes: leave out PDOs or shorten names")]
pub struct SiiFull {
    /// Type of the category.
    pub category: u16,
}

/// The content of a device's SII.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SiiImage {
    bytes: [u8; SII_LEN],
    used: usize,
}

impl SiiImage {
    /// The image of a device without PDO categories.
    ///
    /// # Errors
    ///
    /// A category that does not fit.
    pub fn new(description: &Description) -> Result<Self, SiiFull> {
        let mut image = Self { bytes: [0xFF; SII_LEN], used: 2 * usize::from(word::CATEGORIES) };
        if let Some(fixed) = image.bytes.get_mut(..image.used) {
            fixed.fill(0);
        }
        image.set_word(word::PDI_CONTROL, description.pdi_control);
        image.set_word(word::ALIAS, description.alias);
        image.update_checksum();
        let identity =
            [description.vendor, description.product, description.revision, description.serial];
        for (address, value) in (word::VENDOR..).step_by(2).zip(identity) {
            let [a, b, c, d] = value.to_le_bytes();
            image.set_word(address, u16::from_le_bytes([a, b]));
            image.set_word(address + 1, u16::from_le_bytes([c, d]));
        }
        if let Some(mailbox) = description.mailbox {
            let words = [
                mailbox.receive.start,
                mailbox.receive.length,
                mailbox.send.start,
                mailbox.send.length,
                mailbox.protocols,
            ];
            for (address, value) in (word::MAILBOX..).zip(words) {
                image.set_word(address, value);
            }
        }
        image.set_word(word::SIZE, (SII_LEN * 8 / 1_024 - 1) as u16);
        image.set_word(word::SIZE + 1, 1);
        image.push_strings([description.group, description.order, description.name])?;
        image.push_general(description)?;
        image.push_fmmus(description.fmmus)?;
        image.push_sync_managers(description.sync_managers)?;
        if let Some(dc) = description.dc {
            image.push_dc(dc)?;
        }
        Ok(image)
    }

    /// Adds a category with the PDOs of one direction.
    ///
    /// # Errors
    ///
    /// It does not fit, or a PDO has more than 255 entries; nothing is added.
    pub fn push_pdos<E: IntoIterator<Item = PdoEntry>>(
        &mut self,
        direction: PdoDirection,
        pdos: impl IntoIterator<Item = Pdo<E>>,
    ) -> Result<(), SiiFull> {
        let kind = match direction {
            PdoDirection::Inputs => category::TX_PDO,
            PdoDirection::Outputs => category::RX_PDO,
        };
        self.push_category(kind, |image| {
            for pdo in pdos {
                let head = image.used;
                let [low, high] = pdo.index.to_le_bytes();
                image.push(&[low, high, 0, pdo.sync_manager, 0, 0, 0, 0])?;
                let mut count = 0_u8;
                for entry in pdo.entries {
                    let [low, high] = entry.index.to_le_bytes();
                    image.push(&[
                        low,
                        high,
                        entry.sub_index,
                        0,
                        entry.data_type,
                        entry.bits,
                        0,
                        0,
                    ])?;
                    count = count.checked_add(1)?;
                }
                *image.bytes.get_mut(head + 2)? = count;
            }
            Some(())
        })
    }

    fn push_strings(&mut self, strings: [&str; 3]) -> Result<(), SiiFull> {
        self.push_category(category::STRINGS, |image| {
            image.push(&[3])?;
            for string in strings {
                image.push(&[u8::try_from(string.len()).ok()?])?;
                image.push(string.as_bytes())?;
            }
            Some(())
        })
    }

    fn push_general(&mut self, description: &Description) -> Result<(), SiiFull> {
        let coe = description.mailbox.map_or(0, |mailbox| mailbox.coe_details);
        // Strings: group 1, no picture, order 2, name 3. Two ports with MII.
        let mut data = [0_u8; 32];
        let facts = [(0, 1), (2, 2), (3, 3), (5, coe), (16, 0x11)];
        for (at, value) in facts {
            if let Some(byte) = data.get_mut(at) {
                *byte = value;
            }
        }
        self.push_category(category::GENERAL, |image| image.push(&data))
    }

    fn push_fmmus(&mut self, fmmus: &[FmmuUse]) -> Result<(), SiiFull> {
        self.push_category(category::FMMU, |image| {
            for fmmu in fmmus {
                image.push(&[match fmmu {
                    FmmuUse::Unused => 0,
                    FmmuUse::Outputs => 1,
                    FmmuUse::Inputs => 2,
                    FmmuUse::MailboxState => 3,
                }])?;
            }
            Some(())
        })
    }

    fn push_sync_managers(&mut self, list: &[SyncManagerDescription]) -> Result<(), SiiFull> {
        self.push_category(category::SYNC_MANAGERS, |image| {
            for entry in list {
                let ([a, b], [c, d]) = (entry.start.to_le_bytes(), entry.length.to_le_bytes());
                let usage = match entry.usage {
                    SyncManagerUse::Unused => 0,
                    SyncManagerUse::MailboxOut => 1,
                    SyncManagerUse::MailboxIn => 2,
                    SyncManagerUse::Outputs => 3,
                    SyncManagerUse::Inputs => 4,
                };
                let control = entry.control.bits();
                image.push(&[a, b, c, d, control, 0, u8::from(entry.enable), usage])?;
            }
            Some(())
        })
    }

    fn push_dc(&mut self, dc: DcDescription) -> Result<(), SiiFull> {
        // Cycle 0 leaves the choice to the main device; the factors of SYNC0 and SYNC1 are 1 and 0.
        let [low, high] = dc.assign_activate.to_le_bytes();
        let mut data = [0_u8; 24];
        for (at, value) in [(14, low), (15, high), (16, 1)] {
            if let Some(byte) = data.get_mut(at) {
                *byte = value;
            }
        }
        self.push_category(category::DC, |image| image.push(&data))
    }

    /// Writes a category's header and lets `fill` write its data; takes all back if it is not whole.
    fn push_category(
        &mut self,
        kind: u16,
        fill: impl FnOnce(&mut Self) -> Option<()>,
    ) -> Result<(), SiiFull> {
        let start = self.used;
        let written = self.push_filled(kind, fill);
        if written.is_none() {
            self.used = start;
            if let Some(rest) = self.bytes.get_mut(start..) {
                rest.fill(0xFF);
            }
        }
        written.ok_or(SiiFull { category: kind })
    }

    fn push_filled(&mut self, kind: u16, fill: impl FnOnce(&mut Self) -> Option<()>) -> Option<()> {
        let start = self.used;
        let [low, high] = kind.to_le_bytes();
        self.push(&[low, high, 0, 0])?;
        fill(self)?;
        if self.used % 2 == 1 {
            self.push(&[0])?;
        }
        // The end of the categories is the word that an empty memory holds: one must be left.
        if self.used + 2 > SII_LEN {
            return None;
        }
        let words = u16::try_from((self.used - start - 4) / 2).ok()?;
        self.bytes.get_mut(start + 2..start + 4)?.copy_from_slice(&words.to_le_bytes());
        Some(())
    }

    fn push(&mut self, data: &[u8]) -> Option<()> {
        let end = self.used.checked_add(data.len())?;
        self.bytes.get_mut(self.used..end)?.copy_from_slice(data);
        self.used = end;
        Some(())
    }

    /// All bytes of the memory; what is not used is FFh.
    #[must_use]
    pub const fn as_bytes(&self) -> &[u8; SII_LEN] {
        &self.bytes
    }

    /// The word at this address; FFFFh beyond the end, as an empty memory reads.
    #[must_use]
    pub fn word(&self, address: u16) -> u16 {
        let at = 2 * usize::from(address);
        self.bytes
            .get(at..)
            .and_then(|rest| rest.first_chunk::<2>())
            .map_or(0xFFFF, |word| u16::from_le_bytes(*word))
    }

    /// Writes the word at this address; false beyond the end. The checksum stays as it is.
    pub fn set_word(&mut self, address: u16, value: u16) -> bool {
        let at = 2 * usize::from(address);
        let place = self.bytes.get_mut(at..).and_then(|rest| rest.first_chunk_mut::<2>());
        place.map(|word| *word = value.to_le_bytes()).is_some()
    }

    /// Sets the second station address, and the checksum to match.
    pub fn set_alias(&mut self, alias: u16) {
        self.set_word(word::ALIAS, alias);
        self.update_checksum();
    }

    fn update_checksum(&mut self) {
        if let Some(configuration) = self.bytes.first_chunk::<14>() {
            let sum = checksum(configuration);
            self.set_word(word::CHECKSUM, u16::from(sum));
        }
    }

    /// Whether the checksum of the configuration area is right.
    #[must_use]
    pub fn checksum_is_right(&self) -> bool {
        self.bytes.first_chunk::<14>().is_some_and(|area| {
            self.word(word::CHECKSUM).to_le_bytes().first() == Some(&checksum(area))
        })
    }

    /// The categories with their data.
    #[must_use]
    pub fn categories(&self) -> Categories<'_> {
        let start = 2 * usize::from(word::CATEGORIES);
        Categories { rest: self.bytes.get(start..).unwrap_or(&[]) }
    }
}

/// The categories of an SII: type and data. Ends at the end mark, or where one is not whole.
#[derive(Clone, Debug)]
pub struct Categories<'a> {
    rest: &'a [u8],
}

impl<'a> Iterator for Categories<'a> {
    type Item = (u16, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let (&[a, b, c, d], rest) = self.rest.split_first_chunk::<4>()?;
        let kind = u16::from_le_bytes([a, b]);
        if kind == category::END {
            return None;
        }
        let (data, rest) = rest.split_at_checked(2 * usize::from(u16::from_le_bytes([c, d])))?;
        self.rest = rest;
        Some((kind, data))
    }
}
