//! The images as EtherCAT maps them: which PDO holds which bytes, and what a PDO maps in order.
//!
//! Everything here is read off [`OUTPUT_FIELDS`] and [`INPUT_FIELDS`]; no place is spelled again.
//! The virtual robot's dictionary (1600h.., 1A00h.., 1C12h, 1C13h) and the link's check of a real
//! robot both come from it.
//!
//! Three things are not in the manual's tables, and follow from mappings read off real robots:
//! an object with one field is a variable (sub-index 0, not 1), an object that shares a PDO counts
//! its own fields from 1 (the manual counts 1602h:1 to 1602h:7 across 7305h and 7306h, the robot
//! maps 7305h:00 and 7306h:01 to 7306h:06), and reserved bits are gaps: index 0, at most 32 bits.
//! Source: mapping. Unverified: that firmware 11.3 numbers the same way.
//!
//! ```
//! use fieldarm::wire::meca500::image::pdo::{PdoLayout, input_pdos};
//!
//! let status = input_pdos(PdoLayout::V11_3).next().unwrap();
//! assert_eq!((status.index, status.byte_offset, status.byte_len), (0x1A00, 0, 4));
//! let mapped: Vec<u32> = status.entries().map(|entry| entry.mapping()).collect();
//! assert_eq!(mapped[0], 0x6010_0201); // 6010h:02, 1 bit: Busy
//! assert_eq!(mapped[10], 0x0000_0006); // 6 reserved bits
//! assert_eq!(mapped[11], 0x6010_0110); // 6010h:01, 16 bits: ErrorCode
//! ```

use super::{Field, FieldType, FirmwareLayout, INPUT_FIELDS, OUTPUT_FIELDS};

/// Which firmware's objects are mapped; bytes that two layouts share lie at the same place in all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum PdoLayout {
    /// Firmware 11.3, the programming manual.
    #[default]
    V11_3,
    /// The same with the sub-indices exactly as the manual prints them: 7305h:01, 7306h:02 to
    /// 7306h:07, 7400h:01, 7420h:01 and so on. Source: PM Tables 4 to 25. Unverified: no robot was
    /// seen like this, none with firmware 11.3 otherwise either.
    V11_3Printed,
    /// Firmware 10.2: one 32-bit checkpoint (6015h:01) instead of reached and discarded, the rest
    /// of 6015h numbered one lower; gaps for UseVariables and MonitoringMode. Source: choice, after
    /// the mapping of firmware 9.3.
    V10_2,
    /// Firmware 9.3: as 10.2, with gaps also for DisableEtherCAT, EStop, CollisionStatus and
    /// WorkZoneStatus; no PDO 1A11h, but three gaps of 32 bits at the end of 1A10h. Source: mapping.
    V9_3,
}

impl From<FirmwareLayout> for PdoLayout {
    fn from(layout: FirmwareLayout) -> Self {
        match layout {
            FirmwareLayout::V11_3 => Self::V11_3,
            FirmwareLayout::V10_2 => Self::V10_2,
        }
    }
}

impl PdoLayout {
    /// Fields that this firmware does not have: their bits are gaps.
    const fn missing(self) -> &'static [&'static str] {
        match self {
            Self::V11_3 | Self::V11_3Printed => &[],
            Self::V10_2 => &["UseVariables", "MonitoringMode"],
            Self::V9_3 => &[
                "UseVariables",
                "MonitoringMode",
                "DisableEtherCAT",
                "EStop (deprecated)",
                "CollisionStatus",
                "WorkZoneStatus",
            ],
        }
    }

    fn is_gap(self, field: &Field) -> bool {
        field.field_type == FieldType::Reserved
            || self.missing().contains(&field.name)
            || self == Self::V9_3 && field.pdo == SAFETY_PDO
    }

    /// The PDO that holds `field`.
    fn pdo_of(self, field: &Field) -> u16 {
        if self == Self::V9_3 && field.pdo == SAFETY_PDO { TIMESTAMP_PDO } else { field.pdo }
    }

    /// Whether `field` is the lower half of the 32-bit checkpoint of older firmware.
    fn is_wide_checkpoint(self, field: &Field) -> bool {
        matches!(self, Self::V10_2 | Self::V9_3) && field.name == CHECKPOINT
    }
}

/// The safety block came with firmware 10; 9.3 has a gap behind the timestamp instead.
const SAFETY_PDO: u16 = 0x1A11;
const TIMESTAMP_PDO: u16 = 0x1A10;
/// The field that is 32 bits wide before firmware 11.3, over its neighbour.
const CHECKPOINT: &str = "CheckpointReached";
/// Longest gap that one mapping entry stands for, in bits.
const LONGEST_GAP: u16 = 32;

/// The PDOs of the outputs (RxPDOs, assigned by 1C12h), in the order of the image.
pub fn output_pdos(layout: PdoLayout) -> Pdos {
    Pdos { layout, rows: OUTPUT_FIELDS }
}

/// The PDOs of the inputs (TxPDOs, assigned by 1C13h), in the order of the image.
pub fn input_pdos(layout: PdoLayout) -> Pdos {
    Pdos { layout, rows: INPUT_FIELDS }
}

/// The PDOs of an image, from [`output_pdos`] or [`input_pdos`].
#[derive(Clone, Debug)]
pub struct Pdos {
    layout: PdoLayout,
    rows: &'static [Field],
}

impl Iterator for Pdos {
    type Item = Pdo;

    fn next(&mut self) -> Option<Pdo> {
        let first = self.rows.first()?;
        let index = self.layout.pdo_of(first);
        let own = self.rows.iter().take_while(|row| self.layout.pdo_of(row) == index).count();
        let (rows, rest) = self.rows.split_at_checked(own)?;
        self.rows = rest;
        let bits: u16 = rows.iter().map(|row| row.size_bits).sum();
        Some(Pdo {
            index,
            byte_offset: first.byte_offset,
            byte_len: bits / 8,
            layout: self.layout,
            rows,
        })
    }
}

/// A PDO: a run of bytes of an image, and what lies in them.
#[derive(Clone, Copy, Debug)]
pub struct Pdo {
    /// Index, e.g. `0x1A00`.
    pub index: u16,
    /// First byte in the image.
    pub byte_offset: u16,
    /// Length in bytes.
    pub byte_len: u16,
    layout: PdoLayout,
    rows: &'static [Field],
}

impl Pdo {
    /// What the PDO maps, in order; the sizes add up to the PDO's bytes.
    #[must_use]
    pub fn entries(&self) -> PdoEntries {
        PdoEntries {
            layout: self.layout,
            rows: self.rows,
            all: self.rows,
            gap: None,
            at_bit: self.byte_offset * 8,
            numbering: Numbering::default(),
        }
    }

    /// The objects that the PDO maps, in order, without the work that their entries take.
    pub fn objects(&self) -> impl Iterator<Item = u16> + use<> {
        let mut last = 0;
        let Self { layout, rows, .. } = *self;
        rows.iter()
            .filter(move |row| !layout.is_gap(row))
            .map(|row| row.object)
            .filter(move |object| core::mem::replace(&mut last, *object) != *object)
    }

    /// The manual's section of its first field, e.g. `RobotStatus`.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.rows.first().map_or("", |row| row.section)
    }
}

/// One entry of a PDO's mapping.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PdoEntry {
    /// Index of the mapped object; 0 for a gap.
    pub object: u16,
    /// Sub-index in that object; 0 for a variable and for a gap.
    pub sub_index: u8,
    /// Size in bits: 1 to 32.
    pub bits: u8,
    /// First bit in the image: byte times 8 plus bit.
    pub image_bit: u16,
    /// Type in the image; [`FieldType::Reserved`] for a gap.
    pub field_type: FieldType,
    /// The manual's field name; `Checkpoint` for the 32-bit checkpoint of older firmware,
    /// `(Reserved)` for a gap.
    pub name: &'static str,
    /// The row behind the entry; a gap has none.
    pub field: Option<&'static Field>,
}

impl PdoEntry {
    /// The entry as the mapping object holds it: index, sub-index, bits. Source: ETG.1000 part 6.
    #[must_use]
    pub const fn mapping(&self) -> u32 {
        (self.object as u32) << 16 | (self.sub_index as u32) << 8 | self.bits as u32
    }

    /// Whether nothing is mapped here.
    #[must_use]
    pub const fn is_gap(&self) -> bool {
        self.object == 0
    }
}

/// The entries of a PDO, from [`Pdo::entries`].
#[derive(Clone, Debug)]
pub struct PdoEntries {
    layout: PdoLayout,
    /// Rows still to come.
    rows: &'static [Field],
    /// All rows of the PDO.
    all: &'static [Field],
    /// Bits of a gap not yet handed out.
    gap: Option<u16>,
    at_bit: u16,
    /// How the object of the newest entry is numbered.
    numbering: Numbering,
}

/// How the sub-indices of one object follow from the manual's numbers.
#[derive(Clone, Copy, Debug, Default)]
struct Numbering {
    object: u16,
    /// Whether it has one field only, and no sub-indices then.
    is_variable: bool,
    /// The manual's number of its first field.
    first: u8,
    has_wide_checkpoint: bool,
}

impl PdoEntries {
    /// Hands out the next piece of the gap.
    fn gap_piece(&mut self, left: u16) -> PdoEntry {
        let bits = left.min(LONGEST_GAP);
        self.gap = Some(left - bits).filter(|more| *more > 0);
        let image_bit = self.at_bit;
        self.at_bit += bits;
        PdoEntry {
            object: 0,
            sub_index: 0,
            bits: u8::try_from(bits).unwrap_or(u8::MAX),
            image_bit,
            field_type: FieldType::Reserved,
            name: "(Reserved)",
            field: None,
        }
    }

    /// The object's sub-index of `field`.
    fn sub_index(&mut self, field: &Field) -> u8 {
        if self.layout == PdoLayout::V11_3Printed {
            return field.sub_index.unwrap_or(0);
        }
        if self.numbering.object != field.object {
            let own = || self.all.iter().filter(|row| row.object == field.object);
            self.numbering = Numbering {
                object: field.object,
                is_variable: own().count() == 1,
                first: own().filter_map(|row| row.sub_index).min().unwrap_or(1),
                has_wide_checkpoint: own().any(|row| self.layout.is_wide_checkpoint(row)),
            };
        }
        if self.numbering.is_variable {
            return 0;
        }
        let number = field.sub_index.unwrap_or(0).saturating_sub(self.numbering.first) + 1;
        // The wide checkpoint took the number of its upper half with it.
        if self.numbering.has_wide_checkpoint && number > 1 { number - 1 } else { number }
    }
}

impl Iterator for PdoEntries {
    type Item = PdoEntry;

    fn next(&mut self) -> Option<PdoEntry> {
        let gaps = self.rows.iter().take_while(|row| self.layout.is_gap(row)).count();
        let (gap_rows, rest) = self.rows.split_at_checked(gaps)?;
        self.rows = rest;
        let gap = self.gap.unwrap_or(0) + gap_rows.iter().map(|row| row.size_bits).sum::<u16>();
        if gap > 0 {
            return Some(self.gap_piece(gap));
        }
        let (row, mut rest) = self.rows.split_first()?;
        let (mut bits, mut field_type, mut name) = (row.size_bits, row.field_type, row.name);
        if self.layout.is_wide_checkpoint(row) {
            let (upper, after) = rest.split_first()?;
            bits += upper.size_bits;
            (field_type, name) = (FieldType::U32, "Checkpoint");
            rest = after;
        }
        let image_bit = self.at_bit;
        self.rows = rest;
        self.at_bit += bits;
        Some(PdoEntry {
            object: row.object,
            sub_index: self.sub_index(row),
            bits: u8::try_from(bits).unwrap_or(u8::MAX),
            image_bit,
            field_type,
            name,
            field: Some(row),
        })
    }
}
