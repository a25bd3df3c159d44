//! The dictionary against the manual's tables, walked as a main device walks it.

mod coe_support;

use coe_support::*;
use fieldarm::bus::ethercat::meca500::Meca500Settings;
use fieldarm::wire::meca500::image::pdo::PdoLayout;

/// A row of the tables that somebody else typed from the manual.
#[derive(Debug)]
struct Row {
    field: String,
    field_type: String,
    byte_offset: usize,
    bit: usize,
    size_bits: usize,
    ecat_index: String,
    pdo: String,
    pdo_subindex: Option<u8>,
}

impl Row {
    fn object(&self) -> u16 {
        u16::from_str_radix(self.ecat_index.trim_end_matches('h'), 16).unwrap()
    }

    fn pdo(&self) -> u16 {
        u16::from_str_radix(self.pdo.trim_end_matches('h'), 16).unwrap()
    }

    /// The sub-index that a robot maps: the manual's, but for what was seen to differ.
    fn sub_index(&self) -> u8 {
        let manual = self.pdo_subindex.unwrap();
        match self.object() {
            // Variables; and the arguments, which the manual counts behind the command's ID.
            0x7305 | 0x7400 | 0x7420..=0x7423 | 0x7306 => manual - 1,
            _ => manual,
        }
    }

    /// The entry of the mapping object.
    fn mapping(&self) -> u32 {
        let size = u32::try_from(self.size_bits).unwrap();
        if self.field_type == "reserved" {
            return size;
        }
        u32::from(self.object()) << 16 | u32::from(self.sub_index()) << 8 | size
    }

    fn data_type(&self) -> u16 {
        match self.field_type.as_str() {
            "bool" => 0x0001,
            "i8" => 0x0002,
            "u8" => 0x0005,
            "u16" => 0x0006,
            "u32" => 0x0007,
            "f32" => 0x0008,
            other => panic!("{other}"),
        }
    }
}

fn rows(name: &str) -> Vec<Row> {
    let path = format!("{}/fixtures/spec/meca500_{name}_fields.csv", env!("CARGO_MANIFEST_DIR"));
    let mut table = csv::Reader::from_path(path).unwrap();
    let columns = table.headers().unwrap().clone();
    table
        .records()
        .map(|record| {
            let record = record.unwrap();
            let cell = |name: &str| {
                record[columns.iter().position(|column| column == name).unwrap()].to_owned()
            };
            Row {
                field: cell("field"),
                field_type: cell("type"),
                byte_offset: cell("byte_offset").parse().unwrap(),
                bit: cell("bit").parse().unwrap(),
                size_bits: cell("size_bits").parse().unwrap(),
                ecat_index: cell("ecat_index"),
                pdo: cell("pdo"),
                pdo_subindex: cell("pdo_subindex").parse().ok(),
            }
        })
        .collect()
}

/// Uploads an entry of at most four bytes.
fn read(robot: &mut Firmware, index: u16, sub_index: u8) -> u32 {
    let [low, high] = index.to_le_bytes();
    let request = [0, 0x20, 0x40, low, high, sub_index, 0, 0, 0, 0];
    let answer = bytes(&ask(robot, &hex(&request)));
    assert_eq!(answer[2] & 0xE3, 0x43, "{index:04X}:{sub_index:02X}: {}", hex(&answer));
    let len = 4 - usize::from(answer[2] >> 2 & 3);
    answer[6..6 + len].iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte))
}

fn sub_indices(robot: &mut Firmware, index: u16) -> std::ops::RangeInclusive<u8> {
    1..=u8::try_from(read(robot, index, 0)).unwrap()
}

/// The PDOs that an assignment names, each with its mapping.
fn walk(robot: &mut Firmware, assignment: u16) -> Vec<(u16, Vec<u32>)> {
    sub_indices(robot, assignment)
        .map(|sub_index| {
            let pdo = u16::try_from(read(robot, assignment, sub_index)).unwrap();
            let mapped = sub_indices(robot, pdo).map(|entry| read(robot, pdo, entry)).collect();
            (pdo, mapped)
        })
        .collect()
}

fn bits(pdos: &[(u16, Vec<u32>)]) -> u32 {
    pdos.iter().flat_map(|(_, mapped)| mapped).map(|entry| entry & 0xFF).sum()
}

#[test]
fn the_mappings_are_the_manuals_tables_row_by_row() {
    let mut robot = firmware(Meca500Settings::default());
    for (name, assignment, total) in [("output", 0x1C12, 480), ("input", 0x1C13, 2016)] {
        let walked = walk(&mut robot, assignment);
        assert_eq!(bits(&walked), total, "{name}s");
        let found: Vec<(u16, u32)> = walked
            .iter()
            .flat_map(|(pdo, mapped)| mapped.iter().map(|entry| (*pdo, *entry)))
            .collect();
        let expected: Vec<(u16, u32)> =
            rows(name).iter().map(|row| (row.pdo(), row.mapping())).collect();
        assert_eq!(found, expected, "{name}s");
    }
}

#[test]
fn every_field_has_its_entry_with_name_type_and_live_value() {
    let mut robot = firmware(Meca500Settings::default());
    let mut checked = 0;
    for row in rows("input").into_iter().chain(rows("output")) {
        if row.field_type == "reserved" {
            continue;
        }
        let (object, sub_index) = (row.object(), row.sub_index());
        let [low, high] = object.to_le_bytes();
        let request = [0, 0x80, 5, 0, 0, 0, low, high, sub_index, 7];
        let answer = bytes(&ask(&mut robot, &hex(&request)));
        assert_eq!(answer[2], 6, "{row:?}");
        assert_eq!(answer[10..12], row.data_type().to_le_bytes(), "{row:?}");
        assert_eq!(answer[12..14], u16::try_from(row.size_bits).unwrap().to_le_bytes(), "{row:?}");
        let mappable = if object < 0x7000 { 0x87 } else { 0x47 };
        assert_eq!(answer[14..16], [mappable, 0], "{row:?}");
        assert_eq!(String::from_utf8_lossy(&answer[16..]), row.field, "{row:?}");

        // Input byte n holds n; there are no outputs.
        let image = |byte: usize| if object < 0x7000 { byte as u64 } else { 0 };
        let joined = (0..4).map(|n| image(row.byte_offset + n) << (8 * n)).sum::<u64>();
        let value = joined >> row.bit & ((1 << row.size_bits) - 1);
        assert_eq!(u64::from(read(&mut robot, object, sub_index)), value, "{row:?}");
        checked += 1;
    }
    assert!(checked > 100, "only {checked} fields");
}

#[test]
fn the_printed_sub_indices_can_be_had_too() {
    let settings = Meca500Settings { layout: PdoLayout::V11_3Printed, ..Default::default() };
    let mut robot = firmware(settings);
    for (name, assignment) in [("output", 0x1C12), ("input", 0x1C13)] {
        let mapped: Vec<u32> =
            walk(&mut robot, assignment).into_iter().flat_map(|(_, mapped)| mapped).collect();
        let printed = |row: &Row| match row.pdo_subindex {
            Some(sub_index) => {
                u32::from(row.object()) << 16 | u32::from(sub_index) << 8 | row.size_bits as u32
            }
            None => row.size_bits as u32,
        };
        assert_eq!(mapped, rows(name).iter().map(printed).collect::<Vec<_>>(), "{name}s");
    }
    dialogue(
        &mut robot,
        &[
            ("00 20 40 06 73 01 00 00 00 00", "00 20 80 06 73 01 11 00 09 06"),
            ("00 20 40 06 73 00 00 00 00 00", "00 30 4F 06 73 00 07 00 00 00"),
            ("00 20 40 05 73 01 00 00 00 00", "00 30 43 05 73 01 00 00 00 00"),
        ],
    );
}

#[test]
fn older_firmware_maps_the_same_bytes_otherwise() {
    for layout in [PdoLayout::V10_2, PdoLayout::V9_3] {
        let mut robot = firmware(Meca500Settings { layout, ..Default::default() });
        let (outputs, inputs) = (walk(&mut robot, 0x1C12), walk(&mut robot, 0x1C13));
        assert_eq!((bits(&outputs), bits(&inputs)), (480, 2016), "{layout:?}");
        let mapped = |pdo| inputs.iter().find(|(index, _)| *index == pdo).map(|(_, m)| m.clone());
        let motion = mapped(0x1A01).unwrap();
        assert_eq!(motion[..3], [0x6015_0120, 0x6015_0210, 0x6015_0310], "{layout:?}");
        // One checkpoint of 32 bits, bytes 4 to 7 of the image.
        assert_eq!(read(&mut robot, 0x6015, 1), 0x0706_0504);
        assert_eq!(read(&mut robot, 0x6015, 2), 0x0908);
        match layout {
            PdoLayout::V9_3 => {
                let stamp = [0x6060_0120, 0x6060_0220, 0x6060_0320, 32, 32, 32];
                assert_eq!(mapped(0x1A10).unwrap(), stamp);
                assert_eq!(mapped(0x1A11), None);
                let gone = ask(&mut robot, "00 20 40 65 60 01 00 00 00 00");
                assert_eq!(gone, "00 20 80 65 60 01 00 00 02 06");
                assert_eq!(outputs[0].1.last(), Some(&26), "no DisableEtherCAT");
            }
            _ => {
                assert_eq!(mapped(0x1A11).unwrap().len(), 37);
                assert_eq!(outputs[0].1.last(), Some(&25));
            }
        }
        assert_eq!(outputs[1].1.last(), Some(&12), "no UseVariables");
    }
}

#[test]
fn the_error_register_follows_the_error_code() {
    use fieldarm::bus::ethercat::application::Application;
    use fieldarm::time::Instant;

    let mut robot = firmware(Meca500Settings::default());
    assert_eq!(read(&mut robot, 0x1001, 0), 1, "bytes 2 and 3 are not 0");
    robot.device_mut().inputs[2..4].fill(0);
    robot.cycle(Instant::ZERO, None, &mut [0; 252]);
    assert_eq!(read(&mut robot, 0x1001, 0), 0);
    robot.device_mut().inputs[3] = 1;
    robot.cycle(Instant::ZERO, None, &mut [0; 252]);
    assert_eq!(read(&mut robot, 0x1001, 0), 1);
}
