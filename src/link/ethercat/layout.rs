//! How a robot lays out its process data, against our table.
//!
//! The identity of a Meca500 does not tell its layout, so the link reads what the robot reports over
//! CoE: which PDOs are assigned (1C12h, 1C13h) and what each maps. From that comes a [`Layout`]: equal
//! to the table, or every field found by its object and sub-index at another place, or refused with
//! the first difference spelled out.
//!
//! Invariants: a field is copied from where the robot says it is, or not at all; what must be there
//! (`ESSENTIAL` below) is there. Fields that the robot does not map read as zero.

use core::cmp::Reverse;
use std::vec::Vec;

use crate::wire::meca500::image::pdo::{Pdo, PdoEntry, PdoLayout, Pdos, input_pdos, output_pdos};
use crate::wire::meca500::image::{Field, FirmwareLayout, INPUT_LEN, OUTPUT_LEN, Support};

/// Objects without which a robot is not driven: control, commands, state, joints and safety. The
/// others may be missing from an assignment.
///
/// Source: choice.
const ESSENTIAL: [u16; 8] = [0x7200, 0x7310, 0x7305, 0x7306, 0x6010, 0x6015, 0x6030, 0x6065];

/// The numberings that are told apart, newest first. Robots were seen to number the values of an object
/// from 0 or 1; the manual prints other numbers for some.
const FIRMWARES: [PdoLayout; 4] =
    [PdoLayout::V11_3, PdoLayout::V11_3Printed, PdoLayout::V10_2, PdoLayout::V9_3];

/// Most runs of a layout that is not the table's own; more would be no image of a Meca500.
const MAX_RUNS: usize = 256;

/// One entry of a PDO mapping object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MappingEntry {
    /// PDO it stands in.
    pub pdo: u16,
    /// Object; 0 is padding.
    pub object: u16,
    /// Sub-index of the object.
    pub sub_index: u8,
    /// Length in bits.
    pub bits: u8,
}

impl MappingEntry {
    /// The entry as it stands in a mapping object: object, sub-index, length.
    #[must_use]
    pub const fn from_wire(pdo: u16, value: u32) -> Self {
        let [bits, sub_index, low, high] = value.to_le_bytes();
        Self { pdo, object: u16::from_le_bytes([low, high]), sub_index, bits }
    }
}

impl MappingEntry {
    /// Whether a table has this entry, with the same length.
    fn is_in(&self, known: &[(u16, PdoEntry)]) -> bool {
        known.iter().any(|(_, ours)| {
            self.object != 0
                && (ours.object, ours.sub_index, ours.bits)
                    == (self.object, self.sub_index, self.bits)
        })
    }
}

/// The direction of a process image, as the PLC sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Direction {
    /// To the robot: RxPDOs, 1C12h.
    Outputs,
    /// From the robot: TxPDOs, 1C13h.
    Inputs,
}

impl Direction {
    /// Our table's PDOs, as this firmware has them.
    #[must_use]
    pub fn table(self, layout: PdoLayout) -> Pdos {
        match self {
            Self::Outputs => output_pdos(layout),
            Self::Inputs => input_pdos(layout),
        }
    }

    /// The object that holds the assignment.
    #[must_use]
    pub const fn assignment_object(self) -> u16 {
        match self {
            Self::Outputs => 0x1C12,
            Self::Inputs => 0x1C13,
        }
    }

    /// Length of our image in bytes.
    #[must_use]
    pub const fn image_len(self) -> usize {
        match self {
            Self::Outputs => OUTPUT_LEN,
            Self::Inputs => INPUT_LEN,
        }
    }

    /// The entries of our table, as this firmware numbers them, each with its PDO.
    fn entries(self, layout: PdoLayout) -> Vec<(u16, PdoEntry)> {
        let of = |pdo: Pdo| pdo.entries().map(move |entry| (pdo.index, entry));
        self.table(layout).flat_map(of).collect()
    }

    /// The PDOs of our image in order.
    pub fn pdos(self) -> impl Iterator<Item = u16> {
        self.table(PdoLayout::V11_3).map(|pdo| pdo.index)
    }
}

impl core::fmt::Display for Direction {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Outputs => "outputs",
            Self::Inputs => "inputs",
        })
    }
}

/// The first difference that makes a layout unusable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LayoutMismatch {
    /// A field has another length than ours.
    #[error(
        "{object:04X}h:{sub_index:02X} ({name}) in PDO {pdo:04X}h is {found} bits long, expected {expected}: \
         this firmware has another layout; fieldarm knows those of 11.3 and 10.2"
    )]
    Length {
        /// PDO it stands in.
        pdo: u16,
        /// Object.
        object: u16,
        /// Sub-index.
        sub_index: u8,
        /// Name of the field in our table.
        name: &'static str,
        /// Bits in our table.
        expected: u8,
        /// Bits found.
        found: u8,
    },
    /// A field that is needed is mapped nowhere.
    #[error(
        "the {direction} lack {object:04X}h:{sub_index:02X} ({name}): assign PDO {pdo:04X}h in \
         {}h, or update the robot's firmware to 11.3", 
        if matches!(direction, Direction::Outputs) { "1C12" } else { "1C13" }
    )]
    Missing {
        /// Image it belongs to.
        direction: Direction,
        /// PDO of our table that holds it.
        pdo: u16,
        /// Object.
        object: u16,
        /// Sub-index.
        sub_index: u8,
        /// Name of the field in our table.
        name: &'static str,
    },
    /// The mapping and the process data have different lengths.
    #[error("the {direction} are mapped to {mapped} bytes, but the process data hold {found}")]
    ProcessData {
        /// Image.
        direction: Direction,
        /// Bytes by the mapping.
        mapped: usize,
        /// Bytes of process data.
        found: usize,
    },
    /// More entries than an image of a Meca500 can have.
    #[error(
        "the {direction} are mapped in more than {MAX_RUNS} pieces: no Meca500 lays out its image so"
    )]
    TooScattered {
        /// Image.
        direction: Direction,
    },
}

/// Bits that lie together in both images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Run {
    robot_bit: usize,
    image_bit: usize,
    bits: usize,
}

/// Where each field of one image lies in a robot's process data.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    direction: Direction,
    runs: Vec<Run>,
    robot_bits: usize,
    /// Whether all of it lies in our image as it lies in the process data: copying is looked up in no
    /// runs then.
    is_one_block: bool,
    firmware: FirmwareLayout,
    missing: Vec<u16>,
    foreign: Vec<MappingEntry>,
}

impl Layout {
    /// Compares what a robot maps, entry by entry in order, with our table.
    ///
    /// # Errors
    ///
    /// The first difference that makes the layout unusable.
    pub fn compare(direction: Direction, entries: &[MappingEntry]) -> Result<Self, LayoutMismatch> {
        // The numbering that explains most of what is mapped. Older firmware numbers some images as
        // 11.3 does, but has less in them: a tie goes to the one that misses least, then to the newest.
        // Not to 9.3, which is not driven: what it lacks is to be named.
        let (table, known) = FIRMWARES
            .into_iter()
            .rev()
            .map(|table| (table, direction.entries(table)))
            .max_by_key(|(table, known)| {
                let explained = entries.iter().filter(|entry| entry.is_in(known)).count();
                let fields = known.iter().filter(|(_, ours)| !ours.is_gap()).count();
                (explained, *table != PdoLayout::V9_3, Reverse(fields))
            })
            .unwrap_or((PdoLayout::V11_3, Vec::new()));
        let mut layout = Self {
            direction,
            runs: Vec::new(),
            robot_bits: 0,
            is_one_block: false,
            firmware: match table {
                PdoLayout::V10_2 => FirmwareLayout::V10_2,
                _ => FirmwareLayout::V11_3,
            },
            missing: Vec::new(),
            foreign: Vec::new(),
        };
        for entry in entries {
            if entry.object != 0 {
                layout.take(entry, &known)?;
            }
            layout.robot_bits += usize::from(entry.bits);
        }
        layout.close(&known)?;
        layout.is_one_block = matches!(layout.runs.as_slice(), [run]
            if run.bits == layout.robot_bits && run.image_bit == run.robot_bit);
        Ok(layout)
    }

    /// Takes an entry where the table has it.
    fn take(
        &mut self,
        entry: &MappingEntry,
        known: &[(u16, PdoEntry)],
    ) -> Result<(), LayoutMismatch> {
        let mut of_object = known.iter().filter(|(_, ours)| ours.object == entry.object);
        // An object with one value may be numbered 0 or 1.
        let is_one = of_object.clone().count() == 1;
        let is_it = |(_, ours): &&(u16, PdoEntry)| {
            ours.sub_index == entry.sub_index || is_one && entry.sub_index <= 1
        };
        match of_object.find(is_it) {
            Some((_, ours)) if ours.bits == entry.bits => {
                self.push(usize::from(ours.image_bit), usize::from(entry.bits), known)
            }
            Some((_, ours)) => Err(LayoutMismatch::Length {
                pdo: entry.pdo,
                object: entry.object,
                sub_index: entry.sub_index,
                name: ours.name,
                expected: ours.bits,
                found: entry.bits,
            }),
            None => {
                self.foreign.push(*entry);
                Ok(())
            }
        }
    }

    /// Adds a run; joins it to the one before when only padding lies between them on both sides.
    fn push(
        &mut self,
        image_bit: usize,
        bits: usize,
        known: &[(u16, PdoEntry)],
    ) -> Result<(), LayoutMismatch> {
        let run = Run { robot_bit: self.robot_bits, image_bit, bits };
        if let Some(last) = self.runs.last_mut() {
            let same_shift = run.image_bit.checked_sub(last.image_bit)
                == run.robot_bit.checked_sub(last.robot_bit);
            let gap = last.image_bit + last.bits..run.image_bit;
            let only_reserved = known
                .iter()
                .all(|(_, ours)| ours.is_gap() || !gap.contains(&usize::from(ours.image_bit)));
            if same_shift && gap.start <= gap.end && only_reserved {
                last.bits = run.image_bit + run.bits - last.image_bit;
                return Ok(());
            }
        }
        if self.runs.len() == MAX_RUNS {
            return Err(LayoutMismatch::TooScattered { direction: self.direction });
        }
        self.runs.push(run);
        Ok(())
    }

    fn covers(&self, image_bit: u16) -> bool {
        let at = usize::from(image_bit);
        self.runs.iter().any(|run| (run.image_bit..run.image_bit + run.bits).contains(&at))
    }

    /// Looks for fields that no run covers.
    fn close(&mut self, known: &[(u16, PdoEntry)]) -> Result<(), LayoutMismatch> {
        let absent: Vec<&(u16, PdoEntry)> = known
            .iter()
            .filter(|(_, ours)| !ours.is_gap() && !self.covers(ours.image_bit))
            .collect();
        let is_whole = |object: u16| {
            known.iter().all(|(_, ours)| ours.object != object || !self.covers(ours.image_bit))
        };
        let is_needed = |(_, ours): &&&(u16, PdoEntry)| {
            let is_deprecated = |field: &Field| field.support == Support::Deprecated;
            ESSENTIAL.contains(&ours.object) && !ours.field.is_some_and(is_deprecated)
        };
        // A whole object says more than the first of its fields.
        let worst = absent
            .iter()
            .filter(is_needed)
            .max_by_key(|(_, ours)| (is_whole(ours.object), Reverse(ours.image_bit)));
        if let Some((pdo, ours)) = worst {
            return Err(LayoutMismatch::Missing {
                direction: self.direction,
                pdo: *pdo,
                object: ours.object,
                sub_index: ours.sub_index,
                name: ours.name,
            });
        }
        for (_, ours) in absent {
            if !self.missing.contains(&ours.object) {
                self.missing.push(ours.object);
            }
        }
        // Trailing reserved bits belong to the last run, so that an equal layout is one run.
        if let [run] = self.runs.as_mut_slice()
            && self.robot_bits == self.direction.image_len() * 8
            && (run.robot_bit, run.image_bit) == (0, 0)
        {
            run.bits = self.robot_bits;
        }
        Ok(())
    }

    /// Which image it is.
    #[must_use]
    pub const fn direction(&self) -> Direction {
        self.direction
    }

    /// Whether the robot's process data are our image, byte by byte.
    #[must_use]
    pub fn is_equal(&self) -> bool {
        let bits = self.direction.image_len() * 8;
        self.robot_bits == bits && self.runs == [Run { robot_bit: 0, image_bit: 0, bits }]
    }

    /// Length of the robot's process data in bytes.
    #[must_use]
    pub const fn robot_len(&self) -> usize {
        self.robot_bits.div_ceil(8)
    }

    /// Which firmware's image it is.
    #[must_use]
    pub const fn firmware(&self) -> FirmwareLayout {
        self.firmware
    }

    /// Objects of our image that the robot does not map; their fields read as zero.
    #[must_use]
    pub fn missing(&self) -> &[u16] {
        &self.missing
    }

    /// What the robot maps and our table does not know; it is passed over.
    #[must_use]
    pub fn foreign(&self) -> &[MappingEntry] {
        &self.foreign
    }

    /// Copies our image to where the robot has its fields; other bits stay zero.
    pub(super) fn scatter(&self, image: &[u8], robot: &mut [u8]) {
        if self.is_one_block && image.len() == robot.len() {
            robot.copy_from_slice(image);
            return;
        }
        robot.fill(0);
        for run in &self.runs {
            copy_bits(image, run.image_bit, robot, run.robot_bit, run.bits);
        }
    }

    /// Copies the robot's fields to where our image has them; other bits become zero.
    pub(super) fn gather(&self, robot: &[u8], image: &mut [u8]) {
        if self.is_one_block && image.len() == robot.len() {
            image.copy_from_slice(robot);
            return;
        }
        image.fill(0);
        for run in &self.runs {
            copy_bits(robot, run.robot_bit, image, run.image_bit, run.bits);
        }
    }
}

/// Copies bits; bit 0 is the least significant bit of the first byte. What does not fit is left.
fn copy_bits(from: &[u8], from_bit: usize, to: &mut [u8], to_bit: usize, bits: usize) {
    if (from_bit | to_bit | bits).is_multiple_of(8) {
        let source = from.get(from_bit / 8..(from_bit + bits) / 8);
        let target = to.get_mut(to_bit / 8..(to_bit + bits) / 8);
        if let (Some(source), Some(target)) = (source, target) {
            target.copy_from_slice(source);
        }
        return;
    }
    for step in 0..bits {
        let (source, target) = (from_bit + step, to_bit + step);
        if let (Some(byte), Some(place)) = (from.get(source / 8), to.get_mut(target / 8)) {
            let bit = byte >> (source % 8) & 1;
            *place = *place & !(1 << (target % 8)) | bit << (target % 8);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    fn mapping_of(direction: Direction, layout: PdoLayout) -> Vec<MappingEntry> {
        let entries = direction.entries(layout).into_iter();
        entries.map(|(pdo, entry)| MappingEntry::from_wire(pdo, entry.mapping())).collect()
    }

    fn own_mapping(direction: Direction) -> Vec<MappingEntry> {
        mapping_of(direction, PdoLayout::V11_3)
    }

    fn counting(len: usize) -> Vec<u8> {
        (0..len).map(|byte| (byte * 7 + 1) as u8).collect()
    }

    #[test]
    fn the_tables_own_mapping_is_equal() {
        for direction in [Direction::Outputs, Direction::Inputs] {
            let layout = Layout::compare(direction, &own_mapping(direction)).unwrap();
            assert!(layout.is_equal(), "{layout:?}");
            assert_eq!(layout.robot_len(), direction.image_len());
            assert!(layout.missing().is_empty() && layout.foreign().is_empty());
            let image = counting(direction.image_len());
            let mut there = vec![0; image.len()];
            layout.scatter(&image, &mut there);
            assert_eq!(there, image);
        }
    }

    #[test]
    fn the_numbers_that_the_manual_prints_are_understood() {
        for direction in [Direction::Outputs, Direction::Inputs] {
            let printed = mapping_of(direction, PdoLayout::V11_3Printed);
            assert!(Layout::compare(direction, &printed).unwrap().is_equal());
        }
    }

    #[test]
    fn pdos_stand_in_the_order_of_the_image() {
        let outputs: Vec<u16> = Direction::Outputs.pdos().collect();
        assert_eq!(outputs[..3], [0x1600, 0x1601, 0x1602]);
        let inputs: Vec<u16> = Direction::Inputs.pdos().collect();
        assert_eq!(inputs[..4], [0x1A00, 0x1A01, 0x1A02, 0x1A03]);
        assert_eq!(inputs.len(), inputs.iter().collect::<std::collections::HashSet<_>>().len());
    }

    #[test]
    fn a_robot_without_the_target_configuration_is_laid_out_by_name() {
        let mut mapping = own_mapping(Direction::Inputs);
        mapping.retain(|entry| entry.pdo != 0x1A08);
        let layout = Layout::compare(Direction::Inputs, &mapping).unwrap();
        assert!(!layout.is_equal());
        assert_eq!(layout.robot_len(), 248);
        assert_eq!(layout.missing(), [0x6046]);
        let robot = counting(248);
        let mut image = vec![0xFF; 252];
        layout.gather(&robot, &mut image);
        assert_eq!(image[..64], robot[..64]);
        assert_eq!(image[64..68], [0; 4]);
        assert_eq!(image[68..], robot[64..]);
    }

    #[test]
    fn a_shuffled_assignment_is_laid_out_by_name() {
        let mapping = own_mapping(Direction::Inputs);
        let (first, second): (Vec<_>, Vec<_>) =
            mapping.iter().partition(|entry| entry.pdo < 0x1A10);
        let shuffled: Vec<MappingEntry> = [second, first].concat();
        let layout = Layout::compare(Direction::Inputs, &shuffled).unwrap();
        let robot = counting(252);
        let mut image = vec![0; 252];
        layout.gather(&robot, &mut image);
        assert_eq!(image[..116], robot[136..]);
        // Reserved bits inside a block travel with it; nothing else is lost.
        assert_eq!(image[140..], robot[24..136]);
        let mut back = vec![0; 252];
        layout.scatter(&image, &mut back);
        let mut again = vec![0; 252];
        layout.gather(&back, &mut again);
        assert_eq!(again, image);
    }

    #[test]
    fn one_checkpoint_of_32_bits_is_the_layout_of_10_2() {
        for direction in [Direction::Outputs, Direction::Inputs] {
            let mapping = mapping_of(direction, PdoLayout::V10_2);
            let layout = Layout::compare(direction, &mapping).unwrap();
            assert_eq!(layout.firmware(), FirmwareLayout::V10_2);
            assert!(layout.is_equal(), "{layout:?}");
        }
    }

    #[test]
    fn firmware_9_3_is_refused_for_its_lack_of_a_safety_block() {
        let mapping = mapping_of(Direction::Inputs, PdoLayout::V9_3);
        let error = Layout::compare(Direction::Inputs, &mapping).unwrap_err();
        assert!(matches!(error, LayoutMismatch::Missing { object: 0x6065, .. }), "{error:?}");
    }

    #[test]
    fn what_cannot_be_used_is_refused_with_the_place() {
        let mut mapping = own_mapping(Direction::Inputs);
        mapping.retain(|entry| entry.pdo != 0x1A11);
        let error = Layout::compare(Direction::Inputs, &mapping).unwrap_err();
        let text = std::format!("{error}");
        assert!(
            text.contains("6065h:01") && text.contains("1A11h") && text.contains("1C13h"),
            "{text}"
        );

        let mut mapping = own_mapping(Direction::Outputs);
        let id = mapping.iter().position(|e| e.object == 0x7305).unwrap();
        mapping[id].bits = 16;
        let error = Layout::compare(Direction::Outputs, &mapping).unwrap_err();
        assert!(
            matches!(error, LayoutMismatch::Length { object: 0x7305, expected: 32, found: 16, .. }),
            "{error:?}"
        );
        assert!(Layout::compare(Direction::Inputs, &[]).is_err());
    }

    #[test]
    fn an_unknown_object_moves_what_follows_and_is_passed_over() {
        let mut mapping = own_mapping(Direction::Inputs);
        mapping.insert(0, MappingEntry { pdo: 0x1AFF, object: 0x6FFF, sub_index: 1, bits: 12 });
        mapping.push(MappingEntry { pdo: 0x1AFF, object: 0, sub_index: 0, bits: 4 });
        let layout = Layout::compare(Direction::Inputs, &mapping).unwrap();
        assert_eq!(layout.foreign().len(), 1);
        assert_eq!(layout.robot_len(), 254);
        let image = counting(252);
        let mut robot = vec![0; 254];
        layout.scatter(&image, &mut robot);
        let mut back = vec![0; 252];
        layout.gather(&robot, &mut back);
        // The reserved bits at the very end of the image are nobody's.
        assert_eq!(back[..250], image[..250]);
    }
}
