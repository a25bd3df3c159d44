//! The PDO structure of the images against the manual's tables and a mapping that a robot reported.

use fieldarm::wire::meca500::image::pdo::{PdoLayout, Pdos, input_pdos, output_pdos};
use fieldarm::wire::meca500::image::{INPUT_LEN, OUTPUT_LEN};

#[test]
fn pdos_tile_the_images_in_every_layout() {
    for layout in [PdoLayout::V11_3, PdoLayout::V11_3Printed, PdoLayout::V10_2, PdoLayout::V9_3] {
        for (pdos, len) in [(output_pdos(layout), OUTPUT_LEN), (input_pdos(layout), INPUT_LEN)] {
            let mut bit = 0;
            for pdo in pdos {
                assert_eq!(pdo.byte_offset * 8, bit, "{:04X}", pdo.index);
                for entry in pdo.entries() {
                    assert_eq!(entry.image_bit, bit, "{:04X} {entry:?}", pdo.index);
                    bit += u16::from(entry.bits);
                }
                assert_eq!((pdo.byte_offset + pdo.byte_len) * 8, bit, "{:04X}", pdo.index);
            }
            assert_eq!(usize::from(bit), len * 8);
        }
    }
}

/// Typed from a mapping that a robot with firmware 9.3 reported.
#[test]
fn the_mapping_of_firmware_9_3_is_the_one_seen() {
    let mapped = |pdo: u16| -> Vec<u32> {
        output_pdos(PdoLayout::V9_3)
            .chain(input_pdos(PdoLayout::V9_3))
            .find(|found| found.index == pdo)
            .map(|found| found.entries().map(|entry| entry.mapping()).collect())
            .unwrap_or_default()
    };
    let bits = |object: u32, subs: std::ops::RangeInclusive<u32>| -> Vec<u32> {
        subs.map(|sub| object << 16 | sub << 8 | 1).collect()
    };
    assert_eq!(mapped(0x1600), [bits(0x7200, 1..=6), vec![26]].concat());
    let move_id = vec![0x7310_0110];
    assert_eq!(mapped(0x1601), [move_id, bits(0x7310, 2..=5), vec![12]].concat());
    let arguments = (1..=6).map(|sub| 0x7306_0020 | sub << 8);
    let movement: Vec<u32> = std::iter::once(0x7305_0020).chain(arguments).collect();
    assert_eq!(mapped(0x1602), movement);
    assert_eq!(mapped(0x1610), [0x7400_0020]);
    assert_eq!(mapped(0x1611), [bits(0x7410, 1..=2), vec![30]].concat());
    assert_eq!(mapped(0x1623), [0x7423_0020]);
    assert_eq!(mapped(0x1A00), [bits(0x6010, 2..=7), vec![10, 0x6010_0110]].concat());
    let words = vec![0x6015_0120, 0x6015_0210, 0x6015_0310];
    let tail = vec![10, 0x6015_0410];
    assert_eq!(mapped(0x1A01), [words, bits(0x6015, 5..=10), tail].concat());
    assert_eq!(mapped(0x1A08), [0x6046_0108, 0x6046_0208, 0x6046_0308, 0x6046_0408]);
    assert_eq!(mapped(0x1A10), [0x6060_0120, 0x6060_0220, 0x6060_0320, 32, 32, 32]);
    assert!(mapped(0x1A11).is_empty());
}

#[test]
fn the_pdos_are_those_of_the_manual() {
    let index = |pdos: Pdos| pdos.map(|pdo| pdo.index).collect::<Vec<_>>();
    assert_eq!(
        index(output_pdos(PdoLayout::V11_3)),
        [0x1600, 0x1601, 0x1602, 0x1610, 0x1611, 0x1620, 0x1621, 0x1622, 0x1623]
    );
    assert_eq!(
        index(input_pdos(PdoLayout::V11_3)),
        [
            0x1A00, 0x1A01, 0x1A02, 0x1A03, 0x1A08, 0x1A09, 0x1A0A, 0x1A10, 0x1A11, 0x1A20, 0x1A21,
            0x1A22, 0x1A23
        ]
    );
}
