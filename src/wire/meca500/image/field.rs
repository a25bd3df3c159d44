//! One row per field of the images: what people, generators and sweeps read.

use crate::wire::order::ByteOrder;

/// Type of a field as it lies in the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FieldType {
    /// One bit.
    Bool,
    /// Unsigned 8-bit integer.
    U8,
    /// Signed 8-bit integer, two's complement.
    I8,
    /// Unsigned 16-bit integer.
    U16,
    /// Unsigned 32-bit integer.
    U32,
    /// IEEE-754 single precision (the manual's Real).
    F32,
    /// Bits without a meaning; written as 0, kept as received.
    Reserved,
}

impl FieldType {
    /// The name used in tables: `bool`, `u8`, `i8`, `u16`, `u32`, `f32`, `reserved`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bool => "bool",
            Self::U8 => "u8",
            Self::I8 => "i8",
            Self::U16 => "u16",
            Self::U32 => "u32",
            Self::F32 => "f32",
            Self::Reserved => "reserved",
        }
    }
}

/// Whether a Meca500 drives the field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Support {
    /// On every revision.
    Yes,
    /// Only on revision 4.
    R4Only,
    /// Driven, but a newer field should be read instead.
    Deprecated,
    /// Belongs to another model and stays 0.
    No,
    /// Reserved bits: the question does not arise.
    Reserved,
}

impl Support {
    /// The word used in tables; empty for reserved bits.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Yes => "yes",
            Self::R4Only => "R4 only",
            Self::Deprecated => "deprecated",
            Self::No => "no",
            Self::Reserved => "",
        }
    }
}

/// One field of an image, with its place on every bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// The manual's section, e.g. `RobotStatus`.
    pub section: &'static str,
    /// The manual's field name, e.g. `ErrorCode`; `(Reserved)` for reserved bits.
    pub name: &'static str,
    /// Type in the image.
    pub field_type: FieldType,
    /// First byte in the image.
    pub byte_offset: u16,
    /// First bit within that byte; bit 0 is the least significant.
    pub bit: u8,
    /// Size in bits.
    pub size_bits: u16,
    /// EtherCAT object index, e.g. `0x6010`.
    pub object: u16,
    /// EtherCAT PDO index, e.g. `0x1A00`.
    pub pdo: u16,
    /// Sub-index of the EtherCAT *object*; reserved bits have none. Not the order in the image.
    pub sub_index: Option<u8>,
    /// Number of the manual's table (`13` is PM Table 13).
    pub table: u8,
    /// Unit, e.g. `mm`; empty if it has none.
    pub unit: &'static str,
    /// Whether a Meca500 drives the field.
    pub support: Support,
    /// What it means.
    pub doc: &'static str,
}

impl Field {
    /// Reads this field from the bytes of its image; `None` if they are too short.
    #[must_use]
    pub fn read(&self, image: &[u8], order: ByteOrder) -> Option<FieldValue> {
        let bytes = image.get(usize::from(self.byte_offset)..)?;
        Some(match self.field_type {
            FieldType::Bool => FieldValue::Bool(bytes.first()? >> self.bit & 1 == 1),
            FieldType::U8 => FieldValue::Unsigned(u32::from(*bytes.first()?)),
            FieldType::I8 => FieldValue::Signed(i32::from(bytes.first()?.cast_signed())),
            FieldType::U16 => {
                FieldValue::Unsigned(u32::from(order.integers.u16(*bytes.first_chunk()?)))
            }
            FieldType::U32 => FieldValue::Unsigned(order.integers.u32(*bytes.first_chunk()?)),
            FieldType::F32 => {
                FieldValue::Real(f32::from_bits(order.reals.u32(*bytes.first_chunk()?)))
            }
            FieldType::Reserved => FieldValue::Unsigned(self.read_bits(bytes)?),
        })
    }

    /// The reserved bits as a number; at most 32 bits, which may cross bytes.
    fn read_bits(&self, bytes: &[u8]) -> Option<u32> {
        let end = usize::from(self.bit) + usize::from(self.size_bits);
        let covered = bytes.get(..end.div_ceil(8))?;
        let joined = covered.iter().rev().fold(0_u64, |bits, &byte| bits << 8 | u64::from(byte));
        let mask = (1_u64 << self.size_bits) - 1;
        u32::try_from(joined >> self.bit & mask).ok()
    }
}

/// The value of a field, as [`Field::read`] finds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldValue {
    /// A bit.
    Bool(bool),
    /// An unsigned integer, or reserved bits.
    Unsigned(u32),
    /// A signed integer.
    Signed(i32),
    /// A Real.
    Real(f32),
}

impl core::fmt::Display for FieldValue {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Bool(value) => u8::from(*value).fmt(f),
            Self::Unsigned(value) => value.fmt(f),
            Self::Signed(value) => value.fmt(f),
            Self::Real(value) => value.fmt(f),
        }
    }
}

/// A field as its block declares it: no place yet, that follows from the rows before it.
#[derive(Clone, Copy)]
pub(super) struct Row {
    pub(super) name: &'static str,
    pub(super) field_type: FieldType,
    pub(super) size_bits: u16,
    pub(super) sub_index: Option<u8>,
    /// Added to the block's object and PDO index, for blocks that span several.
    pub(super) object_step: u16,
    pub(super) unit: &'static str,
    pub(super) support: Support,
    pub(super) doc: &'static str,
}

impl Row {
    /// Bits without a meaning.
    pub(super) const fn reserved(size_bits: u16) -> Self {
        Self {
            name: "(Reserved)",
            field_type: FieldType::Reserved,
            size_bits,
            sub_index: None,
            object_step: 0,
            unit: "",
            support: Support::Reserved,
            doc: "Reserved: written as 0, kept as received.",
        }
    }

    /// A field driven on every revision.
    pub(super) const fn value(
        name: &'static str,
        field_type: FieldType,
        sub_index: u8,
        unit: &'static str,
        doc: &'static str,
    ) -> Self {
        let size_bits = match field_type {
            FieldType::Bool | FieldType::Reserved => 1,
            FieldType::U8 | FieldType::I8 => 8,
            FieldType::U16 => 16,
            FieldType::U32 | FieldType::F32 => 32,
        };
        Self {
            name,
            field_type,
            size_bits,
            sub_index: Some(sub_index),
            object_step: 0,
            unit,
            support: Support::Yes,
            doc,
        }
    }

    pub(super) const fn support(mut self, support: Support) -> Self {
        self.support = support;
        self
    }

    pub(super) const fn object_step(mut self, step: u16) -> Self {
        self.object_step = step;
        self
    }
}

/// Consecutive rows that start at a byte of their block.
#[derive(Clone, Copy)]
pub(super) struct Part {
    pub(super) at: u16,
    pub(super) rows: &'static [Row],
}

/// A block at its place in an image.
#[derive(Clone, Copy)]
pub(super) struct Placed {
    pub(super) section: &'static str,
    pub(super) at: u16,
    pub(super) object: u16,
    pub(super) pdo: u16,
    pub(super) table: u8,
    pub(super) parts: &'static [Part],
}

/// Number of rows of an image.
pub(super) const fn count(mut blocks: &[Placed]) -> usize {
    let mut total = 0;
    while let Some((block, more_blocks)) = blocks.split_first() {
        let mut parts = block.parts;
        while let Some((part, more_parts)) = parts.split_first() {
            total += part.rows.len();
            parts = more_parts;
        }
        blocks = more_blocks;
    }
    total
}

/// The rows of an image with their places; `N` is their [`count`].
pub(super) const fn place<const N: usize>(mut blocks: &[Placed]) -> [Field; N] {
    let mut fields = [NOWHERE; N];
    let mut room: &mut [Field] = &mut fields;
    let (mut block, mut parts, mut rows): (Option<&Placed>, &[Part], &[Row]) = (None, &[], &[]);
    let mut bit = 0;
    while let Some((slot, more_room)) = room.split_first_mut() {
        let row = loop {
            if let Some((row, more)) = rows.split_first() {
                rows = more;
                break row;
            } else if let (Some(block), Some((part, more))) = (block, parts.split_first()) {
                (rows, parts) = (part.rows, more);
                bit = (block.at + part.at) * 8;
            } else if let Some((next, more)) = blocks.split_first() {
                (block, parts, blocks) = (Some(next), next.parts, more);
            } else {
                return [NOWHERE; N];
            }
        };
        if let Some(block) = block {
            *slot = block.field(row, bit);
        }
        bit += row.size_bits;
        room = more_room;
    }
    fields
}

/// What fills the array before the rows are placed.
const NOWHERE: Field = Field {
    section: "",
    name: "",
    field_type: FieldType::Reserved,
    byte_offset: 0,
    bit: 0,
    size_bits: 0,
    object: 0,
    pdo: 0,
    sub_index: None,
    table: 0,
    unit: "",
    support: Support::Reserved,
    doc: "",
};

impl Placed {
    /// `row` of this block at bit `bit` of the image.
    const fn field(&self, row: &Row, bit: u16) -> Field {
        Field {
            section: self.section,
            name: row.name,
            field_type: row.field_type,
            byte_offset: bit / 8,
            bit: (bit % 8) as u8,
            size_bits: row.size_bits,
            object: self.object + row.object_step,
            pdo: self.pdo + row.object_step,
            sub_index: row.sub_index,
            table: self.table,
            unit: row.unit,
            support: row.support,
            doc: row.doc,
        }
    }
}
