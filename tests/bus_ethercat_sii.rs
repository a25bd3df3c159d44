//! The SII: its image byte by byte, and the way to it through registers 0500h to 050Fh.

mod ethercat_support;

use ethercat_support::{Bench, DESCRIPTION, device, sii};
use fieldarm::bus::ethercat::{Settings, SubDevice};
use fieldarm::wire::ethercat::sii::{
    Description, Pdo, PdoDirection, PdoEntry, SII_LEN, SiiFull, SiiImage, category, checksum, word,
};
use fieldarm::wire::meca500::subdevice;

/// CRC-8 bit by bit: polynomial 07h, start FFh, no reflection.
fn crc_by_hand(data: &[u8]) -> u8 {
    let mut crc = 0xFF_u8;
    for byte in data {
        crc ^= byte;
        for _ in 0..8 {
            crc = if crc & 0x80 != 0 { crc << 1 ^ 0x07 } else { crc << 1 };
        }
    }
    crc
}

#[test]
fn the_checksum_is_a_crc_of_fourteen_bytes() {
    let mut data = [0_u8; 14];
    for round in 0..200_u32 {
        for (index, byte) in (0_u32..).zip(&mut data) {
            *byte = (round.wrapping_mul(2_654_435_761).rotate_left(index * 5) >> 7) as u8;
        }
        assert_eq!(checksum(&data), crc_by_hand(&data), "{data:02X?}");
    }
}

#[test]
fn the_fixed_area_of_the_mock() {
    let image = sii();
    assert!(image.checksum_is_right());
    let expected = [
        (0x00, 0x0E08),
        (0x04, 0x0123),
        (0x08, 0x2222),
        (0x09, 0x1111),
        (0x0A, 0x4444),
        (0x0B, 0x3333),
        (0x0C, 0x0002),
        (0x0D, 0x0001),
        (0x0E, 0x0C0D),
        (0x0F, 0x0A0B),
        (0x14, 0x0000),
        (0x18, 0x1000),
        (0x19, 0x0020),
        (0x1A, 0x1080),
        (0x1B, 0x0020),
        (0x1C, 0x0020),
        (0x3E, 31),
        (0x3F, 1),
    ];
    for (address, value) in expected {
        assert_eq!(image.word(address), value, "word {address:02X}h");
    }
    assert_eq!(image.word(7), u16::from(crc_by_hand(&image.as_bytes()[..14])));
}

#[test]
fn the_categories_of_the_meca500() {
    let image = SiiImage::new(&subdevice::DESCRIPTION).unwrap();
    assert_eq!((image.word(0x08), image.word(0x09)), (0xADE1, 0x00EC));
    assert_eq!((image.word(0x0A), image.word(0x0B)), (0xD500, 0x0004));
    assert_eq!((image.word(0x0C), image.word(0x0D)), (1, 0));
    let found: Vec<(u16, &[u8])> = image.categories().collect();
    let kinds: Vec<u16> = found.iter().map(|(kind, _)| *kind).collect();
    assert_eq!(kinds, [10, 30, 40, 41, 60], "no PDO categories");
    assert_eq!(found[0].1, b"\x03\x06Robots\x07Meca500\x07Meca500");
    let general = found[1].1;
    assert_eq!(general.len(), 32);
    // Names 1, 2, 3; CoE with SDO, information, assignment and complete access; two MII ports.
    assert_eq!(general[..8], [1, 0, 2, 3, 0, 0x27, 0, 0]);
    assert_eq!(general[16..18], [0x11, 0]);
    assert_eq!(found[2].1, [1, 2, 3, 0]);
    let managers = [
        [0x00, 0x10, 0x80, 0x00, 0x26, 0x00, 0x01, 0x01],
        [0x80, 0x10, 0x80, 0x00, 0x22, 0x00, 0x01, 0x02],
        [0x00, 0x11, 0x3C, 0x00, 0x64, 0x00, 0x01, 0x03],
        [0x00, 0x14, 0xFC, 0x00, 0x20, 0x00, 0x01, 0x04],
    ];
    assert_eq!(found[3].1, managers.concat());
    assert_eq!(found[4].1.len(), 24);
    assert_eq!(found[4].1[14..16], [0x00, 0x03]);
}

#[test]
fn pdo_categories_hold_what_the_caller_gives() {
    let image = sii();
    let of = |kind: u16| image.categories().find(|(found, _)| *found == kind).unwrap().1;
    let rx = of(category::RX_PDO);
    assert_eq!(rx.len(), 8 + 4 * 8);
    assert_eq!(rx[..8], [0x00, 0x16, 4, 2, 0, 0, 0, 0]);
    assert_eq!(rx[8..16], [0x00, 0x70, 1, 0, 5, 8, 0, 0]);
    assert_eq!(rx[32..40], [0x00, 0x70, 4, 0, 5, 8, 0, 0]);
    let tx = of(category::TX_PDO);
    assert_eq!(tx[..8], [0x00, 0x1A, 6, 3, 0, 0, 0, 0]);
}

fn many(count: usize) -> impl Iterator<Item = Pdo<impl Iterator<Item = PdoEntry>>> {
    let entry = |sub_index| PdoEntry { index: 0x6000, sub_index, data_type: 7, bits: 32 };
    (0..count).map(move |_| Pdo { index: 0x1A00, sync_manager: 3, entries: (1..=10).map(entry) })
}

#[test]
fn what_does_not_fit_is_refused_and_leaves_no_trace() {
    let mut image = SiiImage::new(&DESCRIPTION).unwrap();
    let before = image.clone();
    let full = SiiFull { category: category::TX_PDO };
    assert_eq!(image.push_pdos(PdoDirection::Inputs, many(50)), Err(full));
    assert_eq!(image, before);
    let too_many = Pdo {
        index: 0x1600,
        sync_manager: 2,
        entries: (0..256).map(|_| PdoEntry { index: 0, sub_index: 0, data_type: 0, bits: 1 }),
    };
    assert!(image.push_pdos(PdoDirection::Outputs, [too_many]).is_err());
    assert_eq!(image, before);
    // As many as fit, one by one: the end mark stays.
    while image.push_pdos(PdoDirection::Inputs, many(1)).is_ok() {
        assert!(image.as_bytes().ends_with(&[0xFF, 0xFF]));
    }
    let used: usize = image.categories().map(|(_, data)| 4 + data.len()).sum();
    assert!(used + 2 * usize::from(word::CATEGORIES) > SII_LEN - 100);
    const LONG: &str = match core::str::from_utf8(&[b'x'; 256]) {
        Ok(text) => text,
        Err(_) => "",
    };
    let description = Description { name: LONG, ..DESCRIPTION };
    assert_eq!(SiiImage::new(&description).unwrap_err().category, category::STRINGS);
}

/// Reads words through the registers, as a main device does.
fn read_words(bench: &mut Bench, address: u16, words: usize) -> Vec<u16> {
    let [low, high] = address.to_le_bytes();
    assert_eq!(bench.write(0x0502, &[0x00, 0x01, low, high, 0, 0]), 1);
    assert_eq!(bench.read_u16(0x0502) & 0xFF00, 0, "no error, not busy");
    let data = bench.read(0x0508, 2 * words).0;
    data.chunks(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect()
}

#[test]
fn reads_fetch_four_bytes_or_eight() {
    let mut bench = Bench::single();
    assert_eq!(bench.read_u16(0x0502), 0x0080);
    assert_eq!(read_words(&mut bench, 0x08, 4), [0x2222, 0x1111, 0, 0]);
    let mut bench = Bench::new(1, Settings { sii_reads_8_bytes: true, ..Settings::default() });
    assert_eq!(bench.read_u16(0x0502), 0x00C0);
    assert_eq!(read_words(&mut bench, 0x08, 4), [0x2222, 0x1111, 0x4444, 0x3333]);
    assert_eq!(read_words(&mut bench, 0x07FE, 4), [0xFFFF; 4], "behind the end");
}

#[test]
fn address_and_command_may_come_apart() {
    let mut bench = Bench::single();
    bench.write(0x0504, &[0x0A, 0, 0, 0]);
    bench.write(0x0502, &[0x00, 0x01]);
    assert_eq!(bench.read(0x0508, 4).0, [0x44, 0x44, 0x33, 0x33]);
    bench.write(0x0504, &[0x0C, 0, 0, 0]);
    bench.write(0x0503, &[0x01]);
    assert_eq!(bench.read(0x0508, 4).0, [0x02, 0x00, 0x01, 0x00]);
}

#[test]
fn an_address_that_does_not_exist_is_an_error() {
    let mut bench = Bench::single();
    for address in [[0x00, 0x08, 0, 0], [0, 0, 1, 0], [0xFF; 4]] {
        bench.write(0x0504, &address);
        bench.write(0x0502, &[0x00, 0x01]);
        assert_eq!(bench.read_u16(0x0502), 0x2080, "{address:02X?}");
        bench.write(0x0502, &[0x00, 0x00]);
        assert_eq!(bench.read_u16(0x0502), 0x0080, "cleared");
    }
    bench.write(0x0504, &[0; 4]);
    for command in [3, 5, 6, 7] {
        bench.write(0x0502, &[0x01, command]);
        assert_eq!(bench.read_u16(0x0502), 0x2080, "command {command}");
    }
}

#[test]
fn while_the_firmware_owns_it_nothing_moves() {
    let mut bench = Bench::single();
    bench.write(0x0508, &[0; 8]);
    bench.write(0x0500, &[0x01]);
    bench.write(0x0502, &[0x00, 0x01, 0x08, 0, 0, 0]);
    assert_eq!(bench.read(0x0504, 8).0, [0; 8]);
    // Force takes it back, then the offer is withdrawn.
    bench.write(0x0500, &[0x02]);
    bench.write(0x0500, &[0x00]);
    assert_eq!(read_words(&mut bench, 0x08, 2), [0x2222, 0x1111]);
}

/// Writes one word through the registers.
fn write_word(bench: &mut Bench, address: u16, value: u16) {
    bench.write(0x0508, &value.to_le_bytes());
    let [low, high] = address.to_le_bytes();
    bench.write(0x0502, &[0x01, 0x02, low, high, 0, 0]);
    assert_eq!(bench.read_u16(0x0502) & 0xF000, 0);
}

/// Switches the device off and on.
fn power_cycle(bench: &mut Bench) {
    bench.line[0].application_mut().on_bus = false;
    bench.millis(1);
    bench.line[0].application_mut().on_bus = true;
    bench.millis(1);
}

#[test]
fn a_new_alias_with_its_checksum_counts_from_the_next_power_up() {
    let mut bench = Bench::single();
    bench.write(0x0508, &[0x34, 0x12]);
    bench.write(0x0502, &[0x00, 0x02, 0x04, 0, 0, 0]);
    assert_eq!(bench.read_u16(0x0502), 0x4080, "not enabled");
    assert_eq!(bench.line[0].sii(), &sii());
    write_word(&mut bench, 0x04, 0x1234);
    assert_eq!(bench.read_u16(0x0502), 0x0880, "the checksum is the old one");
    let mut configuration = [0; 14];
    configuration.copy_from_slice(&bench.line[0].sii().as_bytes()[..14]);
    write_word(&mut bench, 0x07, u16::from(crc_by_hand(&configuration)));
    assert_eq!(bench.read_u16(0x0502), 0x0080);
    assert_eq!(bench.read_u16(0x0012), 0x0123);
    power_cycle(&mut bench);
    assert_eq!(bench.read_u16(0x0012), 0x1234);
    let mut expected = sii();
    expected.set_alias(0x1234);
    assert_eq!(bench.line[0].sii(), &expected);
}

#[test]
fn a_wrong_checksum_keeps_the_configuration_from_being_loaded() {
    let mut bench = Bench::single();
    write_word(&mut bench, 0x04, 0x5555);
    power_cycle(&mut bench);
    assert_eq!((bench.read_u16(0x0012), bench.read_u16(0x0140)), (0, 0));
    assert_eq!(bench.read_u16(0x0502), 0x0880);
}

#[test]
fn devices_of_one_kind_can_have_their_own_alias() {
    let mut image = sii();
    image.set_alias(0x0777);
    assert!(image.checksum_is_right());
    let application = device(Settings::default()).application().clone();
    let other = SubDevice::new(application, &DESCRIPTION, image, Settings::default());
    assert_eq!(other.register(0x0012), 0x0777);
}
