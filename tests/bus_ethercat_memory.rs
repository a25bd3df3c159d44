//! FMMUs down to the bit, sync managers with three buffers, and the mailbox.

mod ethercat_support;

use ethercat_support::{Bench, INPUTS};
use fieldarm::wire::ethercat::command::Command;

/// Writes an FMMU of the first device: logical start and length, bits, physical start and bit, kind.
fn set_fmmu(
    bench: &mut Bench,
    index: u16,
    (logical, length): (u32, u16),
    (start_bit, end_bit): (u8, u8),
    (physical, physical_bit): (u16, u8),
    kind: u8,
) {
    let [l0, l1, l2, l3] = logical.to_le_bytes();
    let ([n0, n1], [p0, p1]) = (length.to_le_bytes(), physical.to_le_bytes());
    let bytes =
        [l0, l1, l2, l3, n0, n1, start_bit, end_bit, p0, p1, physical_bit, kind, 1, 0, 0, 0];
    assert_eq!(bench.write(0x0600 + 16 * index, &bytes), 1);
}

const READ: u8 = 1;
const WRITE: u8 = 2;

#[test]
fn bits_are_read_shifted_and_neighbours_in_the_frame_stay() {
    let mut bench = Bench::single();
    // Physical bits 6..=10 from 0F80h: 1 1 | 1 0 1  -> logical bits 2..=6 of byte 10h.
    bench.write(0x0F80, &[0b1100_0000, 0b0000_0101]);
    set_fmmu(&mut bench, 0, (0x10, 1), (2, 6), (0x0F80, 6), READ);
    assert_eq!(bench.ask(Command::Lrd { address: 0x10 }, &[0x00]), (vec![0b0101_1100], 1));
    assert_eq!(bench.ask(Command::Lrd { address: 0x10 }, &[0xFF]), (vec![0b1101_1111], 1));
    assert_eq!(
        bench.ask(Command::Lrd { address: 0x0F }, &[0xAA, 0x83, 0x55]),
        (vec![0xAA, 0b1101_1111, 0x55], 1)
    );
}

#[test]
fn bits_are_written_shifted_and_neighbours_in_memory_stay() {
    let mut bench = Bench::single();
    for background in [0x00, 0xFF] {
        bench.write(0x0F80, &[background; 3]);
        // Ten logical bits from bit 5 of 20h to bit 6 of 21h -> physical bits from bit 3 of 0F80h.
        set_fmmu(&mut bench, 1, (0x20, 2), (5, 6), (0x0F80, 3), WRITE);
        let sent = u16::from_le_bytes([0b1010_0000, 0b0011_0110]);
        let (data, counter) = bench.ask(Command::Lwr { address: 0x20 }, &sent.to_le_bytes());
        assert_eq!((data, counter), (sent.to_le_bytes().to_vec(), 1));
        let expected = (sent >> 5 & 0x03FF) << 3;
        let mask = 0x03FF << 3;
        let [low, high] = (expected | (u16::from_le_bytes([background; 2]) & !mask)).to_le_bytes();
        assert_eq!(bench.read(0x0F80, 3).0, [low, high, background]);
    }
}

#[test]
fn every_shift_agrees_with_plain_arithmetic() {
    let mut bench = Bench::single();
    for start in 0..8_u8 {
        for shift in 0..8_u8 {
            for length in 1..=16_u16 {
                let last = u16::from(start) + length - 1;
                let bytes = last / 8 + 1;
                set_fmmu(
                    &mut bench,
                    2,
                    (0x40, bytes),
                    (start, (last % 8) as u8),
                    (0x0F90, shift),
                    READ | WRITE,
                );
                let mask = ((1_u64 << length) - 1) << shift;
                let before = 0x5A5A_A5A5_u64;
                let pattern = 0x0096_C3E7_u64;
                bench.write(0x0F90, &before.to_le_bytes()[..4]);
                let sent = &pattern.to_le_bytes()[..4];
                let (data, counter) = bench.ask(Command::Lrw { address: 0x40 }, sent);
                assert_eq!(counter, 3);
                let after = (before & !mask) | (pattern >> start << shift & mask);
                assert_eq!(bench.read(0x0F90, 4).0, after.to_le_bytes()[..4]);
                let in_frame = ((1_u64 << length) - 1) << start;
                let read = (pattern & !in_frame) | (before >> shift << start & in_frame);
                assert_eq!(data, read.to_le_bytes()[..4], "{start} {shift} {length}");
            }
        }
    }
}

#[test]
fn a_part_of_a_mapping_is_reached_by_a_part_of_a_datagram() {
    let mut bench = Bench::single();
    bench.write(0x0F80, &[1, 2, 3, 4, 5, 6, 7, 8]);
    set_fmmu(&mut bench, 0, (0x100, 8), (0, 7), (0x0F80, 0), READ);
    assert_eq!(bench.ask(Command::Lrd { address: 0x106 }, &[0; 4]).0, [7, 8, 0, 0]);
    assert_eq!(bench.ask(Command::Lrd { address: 0xFE }, &[0; 4]).0, [0, 0, 1, 2]);
    // At the very end of the logical address space nothing wraps around.
    set_fmmu(&mut bench, 0, (0xFFFF_FFFE, 8), (0, 7), (0x0F80, 0), READ);
    assert_eq!(bench.ask(Command::Lrd { address: 0xFFFF_FFFE }, &[0; 4]).0, [1, 2, 3, 4]);
    assert_eq!(bench.ask(Command::Lrd { address: 0 }, &[0; 4]), (vec![0; 4], 0));
}

#[test]
fn the_state_of_the_mailbox_can_be_mapped() {
    let mut bench = Bench::single();
    bench.bring_to_pre_op();
    // Bit 3 of 080Dh is "full" of sync manager 1.
    set_fmmu(&mut bench, 2, (0x09, 1), (0, 0), (0x080D, 3), READ);
    assert_eq!(bench.ask(Command::Lrd { address: 0x09 }, &[0]), (vec![0], 1));
    bench.write(0x1000, &[0x11; 32]);
    assert_eq!(bench.ask(Command::Lrd { address: 0x09 }, &[0]), (vec![1], 1));
    bench.read(0x1080, 32);
    assert_eq!(bench.ask(Command::Lrd { address: 0x09 }, &[0]), (vec![0], 1));
}

#[test]
fn overlapping_images_take_outputs_before_inputs_cover_them() {
    let mut bench = Bench::single();
    bench.write(0x0F80, &[1, 2]);
    bench.write(0x0F90, &[3, 4]);
    set_fmmu(&mut bench, 0, (0x10, 2), (0, 7), (0x0F80, 0), READ);
    set_fmmu(&mut bench, 1, (0x10, 2), (0, 7), (0x0F90, 0), WRITE);
    assert_eq!(bench.ask(Command::Lrw { address: 0x10 }, &[8, 9]), (vec![1, 2], 3));
    assert_eq!(bench.read(0x0F90, 2).0, [8, 9]);
}

#[test]
fn a_full_mailbox_refuses_and_an_empty_one_has_nothing() {
    let mut bench = Bench::single();
    // In INIT the firmware leaves the mailbox alone.
    bench.set_sync_manager(0, true);
    bench.set_sync_manager(1, true);
    assert_eq!(bench.read(0x1080, 32), (vec![0; 32], 0), "empty");
    assert_eq!(bench.read(0x0805, 1).0[0] & 0x08, 0);
    assert_eq!(bench.write(0x1000, &[0x22; 32]), 1);
    assert_eq!(bench.read(0x0805, 1).0[0] & 0x09, 0x09);
    assert_eq!(bench.write(0x1000, &[0x33; 32]), 0, "full");
    assert_eq!(bench.read(0x1000, 32).1, 0, "not for reading");
    assert_eq!(bench.write(0x1080, &[0; 32]), 0, "not for writing");
    // Both halves of APRW fail.
    assert_eq!(bench.ask(Command::Aprw { position: 0, register: 0x1000 }, &[0; 32]).1, 0);
    // In PRE-OP the first one arrives, and its answer comes; the second never existed.
    assert_eq!(bench.request(2), (2, 0));
    assert_eq!(bench.line[0].application().received, [vec![0x22; 32]]);
    assert_eq!(bench.read(0x080D, 1).0[0] & 0x08, 0x08);
    assert_eq!(bench.read(0x1080, 32), (vec![0xDD; 32], 1));
    assert_eq!(bench.read(0x1080, 32), (vec![0; 32], 0));
}

#[test]
fn a_mailbox_is_full_when_its_last_byte_is_written_and_empty_when_it_is_read() {
    let mut bench = Bench::single();
    bench.bring_to_pre_op();
    assert_eq!(bench.write(0x1004, &[1]), 0, "not open yet");
    assert_eq!(bench.write(0x1000, &[0x10; 16]), 1);
    assert_eq!(bench.write(0x1010, &[0x20; 15]), 1);
    assert!(bench.line[0].application().received.is_empty());
    assert_eq!(bench.write(0x101F, &[0x30]), 1);
    let mut expected = vec![0x10; 16];
    expected.extend([0x20; 15]);
    expected.push(0x30);
    assert_eq!(bench.line[0].application().received, [expected]);
    assert_eq!(bench.read(0x1081, 1).1, 0, "not open yet");
    assert_eq!(bench.read(0x1080, 8), (vec![0xEF; 8], 1));
    assert_eq!(bench.read(0x080D, 1).0[0] & 0x08, 0x08);
    assert_eq!(bench.read(0x109F, 1), (vec![0xCF], 1));
    assert_eq!(bench.read(0x080D, 1).0[0] & 0x08, 0);
}

#[test]
fn two_writes_in_one_frame_find_the_mailbox_full() {
    let mut bench = Bench::single();
    bench.bring_to_pre_op();
    let write = Command::Apwr { position: 0, register: 0x1000 };
    let answers = bench.ask_all(&[(write, &[1; 32]), (write, &[2; 32])]);
    assert_eq!((answers[0].1, answers[1].1), (1, 0));
    assert_eq!(bench.line[0].application().received, [vec![1; 32]]);
}

/// Toggles the repeat bit of the send mailbox to `bit` and waits for the acknowledgement.
fn ask_repeat(bench: &mut Bench, bit: u8) {
    assert_eq!(bench.write(0x080E, &[0x01 | bit << 1]), 1);
    assert_eq!(bench.read(0x080F, 1).0, [bit << 1]);
}

#[test]
fn the_last_datagram_comes_again_on_request() {
    let mut bench = Bench::single();
    bench.bring_to_pre_op();
    ask_repeat(&mut bench, 1);
    assert_eq!(bench.read(0x1080, 32).1, 0, "nothing to repeat");
    bench.write(0x1000, &[0x01; 32]);
    assert_eq!(bench.read(0x1080, 32), (vec![0xFE; 32], 1));
    ask_repeat(&mut bench, 0);
    assert_eq!(bench.read(0x1080, 32), (vec![0xFE; 32], 1));
    assert_eq!(bench.read(0x1080, 32).1, 0);
    // The next answer is there already: the repeated one comes first, then the next.
    bench.write(0x1000, &[0x02; 32]);
    ask_repeat(&mut bench, 1);
    assert_eq!(bench.read(0x1080, 32), (vec![0xFE; 32], 1));
    assert_eq!(bench.read(0x1080, 32), (vec![0xFD; 32], 1));
    assert_eq!(bench.read(0x1080, 32).1, 0);
    ask_repeat(&mut bench, 0);
    assert_eq!(bench.read(0x1080, 32), (vec![0xFD; 32], 1));
}

#[test]
fn outputs_are_taken_whole_or_not_at_all() {
    let mut bench = Bench::single();
    bench.bring_to_op();
    let cycles = bench.line[0].application().cycles.len();
    assert_eq!(bench.write(0x1101, &[9, 9, 9]), 0, "the first byte opens");
    assert_eq!(bench.write(0x1100, &[1, 2]), 1);
    assert_eq!(bench.line[0].application().cycles.len(), cycles);
    assert_eq!(bench.write(0x1102, &[3, 4]), 1);
    let last = bench.line[0].application().cycles.last().unwrap().1.clone();
    assert_eq!(last, Some(vec![1, 2, 3, 4]));
    assert_eq!(bench.line[0].application().cycles.len(), cycles + 1);
    assert_eq!(bench.read(0x1400, INPUTS).0[1..], [1, 2, 3, 4, 1]);
}

#[test]
fn inputs_stay_whole_while_they_are_read_in_parts() {
    let mut bench = Bench::single();
    bench.bring_to_op();
    bench.write(0x1100, &[1, 1, 1, 1]);
    let (first, counter) = bench.read(0x1400, 3);
    assert_eq!((first[1..].to_vec(), counter), (vec![1, 1], 1));
    // Three more sets of inputs come meanwhile.
    for value in 2..5 {
        bench.write(0x1100, &[value; 4]);
    }
    assert_eq!(bench.read(0x1403, 3), (vec![1, 1, 1], 1));
    assert_eq!(bench.read(0x1400, INPUTS).0[1..], [4, 4, 4, 4, 1]);
    // Inputs are never empty, and always the newest.
    assert_eq!(bench.read(0x1400, INPUTS).0[1..], [4, 4, 4, 4, 1]);
}

#[test]
fn inputs_that_were_never_written_cannot_be_read() {
    let mut bench = Bench::single();
    bench.set_sync_manager(3, true);
    assert_eq!(bench.read(0x1400, INPUTS), (vec![0; INPUTS], 0));
    assert_eq!(bench.read(0x081D, 1).0[0] & 0x30, 0x30);
}

#[test]
fn a_sync_manager_that_is_on_keeps_its_configuration() {
    let mut bench = Bench::single();
    bench.set_sync_manager(0, true);
    bench.write(0x0800, &[0x00, 0x12, 0x40, 0x00, 0x00]);
    assert_eq!(bench.read(0x0800, 5).0, [0x00, 0x10, 32, 0, 0x26]);
    bench.write(0x0806, &[0]);
    bench.write(0x0800, &[0x00, 0x12, 0x40, 0x00, 0x00]);
    assert_eq!(bench.read(0x0800, 5).0, [0x00, 0x12, 0x40, 0x00, 0x00]);
}

#[test]
fn an_access_across_borders_does_what_it_can() {
    let mut bench = Bench::single();
    bench.set_sync_manager(1, true);
    bench.write(0x107E, &[0xAA, 0xBB, 0xCC, 0xDD]);
    // The mailbox at 1080h is for reading and empty: only what lies before it moves.
    assert_eq!(bench.read(0x107E, 4), (vec![0xAA, 0xBB, 0, 0], 1));
}
