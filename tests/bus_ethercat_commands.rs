//! Every command, in frames typed by hand: data, addresses and working counters as an ESC leaves
//! them. Layout of a frame: destination, source, 88A4, length and type, then per datagram command,
//! index, address, length and flags, event, data, working counter.

mod ethercat_support;

use ethercat_support::Bench;
use fieldarm::bus::ethercat::{Passage, Settings, pass};
use fieldarm::wire::ethercat::command::Command;

fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<char> = hex.chars().filter(|c| !c.is_whitespace()).collect();
    digits
        .chunks(2)
        .map(|pair| u8::from_str_radix(&pair.iter().collect::<String>(), 16).unwrap())
        .collect()
}

const HEAD: &str = "FFFFFFFFFFFF 101010101010 88A4";
const PASSED: &str = "FFFFFFFFFFFF 121010101010 88A4";

/// Sends `sent` behind the Ethernet header and expects `expected` behind the marked one.
fn exchange(bench: &mut Bench, sent: &str, expected: &str) {
    let mut frame = bytes(&format!("{HEAD}{sent}"));
    bench.now += fieldarm::time::Duration::from_micros(1);
    assert_eq!(pass(bench.now, &mut frame, &mut bench.line), Passage::Returned);
    let expected = bytes(&format!("{PASSED}{expected}"));
    assert_eq!(frame, expected, "\nfound    {frame:02X?}\nexpected {expected:02X?}");
}

/// Three devices with station addresses 1001h, 1002h, 1003h.
fn three() -> Bench {
    let mut bench = Bench::new(3, Settings::default());
    for (position, station) in [(0_u16, 0x1001_u16), (0xFFFF, 0x1002), (0xFFFE, 0x1003)] {
        let command = Command::Apwr { position, register: 0x0010 };
        assert_eq!(bench.ask(command, &station.to_le_bytes()).1, 1);
    }
    bench
}

#[test]
fn nop_passes_untouched() {
    exchange(
        &mut three(),
        "0E10 00 07 0000 1000 0200 0000 AABB 0000",
        "0E10 00 07 0000 1000 0200 0000 AABB 0000",
    );
}

#[test]
fn an_unknown_command_passes_untouched() {
    exchange(
        &mut three(),
        "0E10 0F 07 0000 1000 0200 0000 AABB 0500",
        "0E10 0F 07 0000 1000 0200 0000 AABB 0500",
    );
}

#[test]
fn aprd_reads_at_position_zero_and_counts_devices() {
    // Position FFFFh is the second device; three increments make it 2.
    exchange(
        &mut three(),
        "0E10 01 11 FFFF 1000 0200 0000 0000 0000",
        "0E10 01 11 0200 1000 0200 0000 0210 0100",
    );
    // Nobody there.
    exchange(
        &mut three(),
        "0E10 01 11 FDFF 1000 0200 0000 AABB 0000",
        "0E10 01 11 0000 1000 0200 0000 AABB 0000",
    );
}

#[test]
fn apwr_writes_one() {
    let mut bench = three();
    exchange(
        &mut bench,
        "0E10 02 11 FEFF 1000 0200 0000 3412 0000",
        "0E10 02 11 0100 1000 0200 0000 3412 0100",
    );
    let stations: Vec<u16> = bench.line.iter().map(|device| device.station_address()).collect();
    assert_eq!(stations, [0x1001, 0x1002, 0x1234]);
}

#[test]
fn aprw_reads_the_old_and_writes_the_new() {
    let mut bench = three();
    exchange(
        &mut bench,
        "0E10 03 11 0000 1000 0200 0000 3412 0000",
        "0E10 03 11 0300 1000 0200 0000 0110 0300",
    );
    assert_eq!(bench.line[0].station_address(), 0x1234);
}

#[test]
fn fprd_fpwr_fprw_go_by_station_address_which_stays() {
    let mut bench = three();
    exchange(
        &mut bench,
        "0E10 04 11 0210 1000 0200 0000 0000 0000",
        "0E10 04 11 0210 1000 0200 0000 0210 0100",
    );
    // 0F80h is memory for the user.
    exchange(
        &mut bench,
        "0E10 05 11 0310 800F 0200 0000 CDAB 0000",
        "0E10 05 11 0310 800F 0200 0000 CDAB 0100",
    );
    exchange(
        &mut bench,
        "0E10 06 11 0310 800F 0200 0000 0201 0000",
        "0E10 06 11 0310 800F 0200 0000 CDAB 0300",
    );
    let values: Vec<u16> = bench.line.iter().map(|device| device.register(0x0F80)).collect();
    assert_eq!(values, [0, 0, 0x0102]);
    exchange(
        &mut bench,
        "0E10 04 11 0410 1000 0200 0000 1122 0000",
        "0E10 04 11 0410 1000 0200 0000 1122 0000",
    );
}

#[test]
fn the_alias_is_an_address_only_when_switched_on() {
    let mut bench = three();
    let ask = "0E10 04 11 2301 1000 0200 0000 0000 0000";
    exchange(&mut bench, ask, "0E10 04 11 2301 1000 0200 0000 0000 0000");
    // DL control of the second device: bit 24.
    exchange(
        &mut bench,
        "0D10 05 11 0210 0301 0100 0000 01 0000",
        "0D10 05 11 0210 0301 0100 0000 01 0100",
    );
    exchange(&mut bench, ask, "0E10 04 11 2301 1000 0200 0000 0210 0100");
}

#[test]
fn brd_ors_bwr_writes_all_brw_does_both() {
    let mut bench = three();
    // 1001h | 1002h | 1003h, and what the frame brought.
    exchange(
        &mut bench,
        "0E10 07 11 0000 1000 0200 0000 4000 0000",
        "0E10 07 11 0300 1000 0200 0000 4310 0300",
    );
    exchange(
        &mut bench,
        "0E10 08 11 0000 800F 0200 0000 0301 0000",
        "0E10 08 11 0300 800F 0200 0000 0301 0300",
    );
    // Each writes what reached it: the first 20h, the second 20h | 03h, ...
    exchange(
        &mut bench,
        "0D10 09 11 0000 800F 0100 0000 20 0000",
        "0D10 09 11 0300 800F 0100 0000 23 0900",
    );
    let values: Vec<u16> = bench.line.iter().map(|device| device.register(0x0F80)).collect();
    assert_eq!(values, [0x0120, 0x0123, 0x0123]);
}

#[test]
fn armw_and_frmw_spread_what_one_holds() {
    let mut bench = three();
    // User memory 11h, 22h, 33h.
    for (position, value) in [(0_u16, 0x11_u8), (0xFFFF, 0x22), (0xFFFE, 0x33)] {
        bench.ask(Command::Apwr { position, register: 0x0F80 }, &[value]);
    }
    // The second is read; the first, before it, writes what the frame brought.
    exchange(
        &mut bench,
        "0D10 0D 11 FFFF 800F 0100 0000 55 0000",
        "0D10 0D 11 0200 800F 0100 0000 22 0300",
    );
    let values: Vec<u16> = bench.line.iter().map(|device| device.register(0x0F80)).collect();
    assert_eq!(values, [0x55, 0x22, 0x22]);
    exchange(
        &mut bench,
        "0D10 0E 11 0110 800F 0100 0000 00 0000",
        "0D10 0E 11 0110 800F 0100 0000 55 0300",
    );
    let values: Vec<u16> = bench.line.iter().map(|device| device.register(0x0F80)).collect();
    assert_eq!(values, [0x55, 0x55, 0x55]);
}

/// FMMU 0 of each device maps a logical byte to user memory: read and write.
fn mapped() -> Bench {
    let mut bench = three();
    for (index, position) in [0_u16, 0xFFFF, 0xFFFE].into_iter().enumerate() {
        let logical = 0x20 + index as u8;
        // Physical start 0F80h, bit 0, both directions, active.
        let fmmu = [logical, 0, 1, 0, 1, 0, 0, 7, 0x80, 0x0F, 0, 3, 1, 0, 0, 0];
        bench.ask(Command::Apwr { position, register: 0x0600 }, &fmmu);
        bench.ask(Command::Apwr { position, register: 0x0F80 }, &[0xA0 + index as u8]);
    }
    bench
}

#[test]
fn lrd_lwr_lrw_count_one_one_three_for_each_device() {
    let mut bench = mapped();
    exchange(
        &mut bench,
        "1110 0A 11 1F000100 0500 0000 0102030405 0000",
        "1110 0A 11 1F000100 0500 0000 01A0A1A205 0300",
    );
    exchange(
        &mut bench,
        "1110 0B 11 1F000100 0500 0000 0102030405 0000",
        "1110 0B 11 1F000100 0500 0000 0102030405 0300",
    );
    exchange(
        &mut bench,
        "0F10 0C 11 20000100 0300 0000 717273 0000",
        "0F10 0C 11 20000100 0300 0000 020304 0900",
    );
    let values: Vec<u16> = bench.line.iter().map(|device| device.register(0x0F80)).collect();
    assert_eq!(values, [0x71, 0x72, 0x73]);
    // One of three.
    exchange(
        &mut bench,
        "0D10 0C 11 21000100 0100 0000 00 0000",
        "0D10 0C 11 21000100 0100 0000 72 0300",
    );
    // None.
    exchange(
        &mut bench,
        "0D10 0C 11 21000200 0100 0000 00 0000",
        "0D10 0C 11 21000200 0100 0000 00 0000",
    );
}

#[test]
fn lrw_of_one_direction_counts_one_or_two() {
    let mut bench = mapped();
    bench.ask(Command::Fpwr { station: 0x1001, register: 0x060B }, &[1]);
    bench.ask(Command::Fpwr { station: 0x1002, register: 0x060B }, &[2]);
    bench.ask(Command::Fpwr { station: 0x1003, register: 0x060C }, &[0]);
    exchange(
        &mut bench,
        "0F10 0C 11 20000100 0300 0000 111213 0000",
        "0F10 0C 11 20000100 0300 0000 A01213 0300",
    );
    let values: Vec<u16> = bench.line.iter().map(|device| device.register(0x0F80)).collect();
    assert_eq!(values, [0xA0, 0x12, 0xA2]);
}

#[test]
fn several_datagrams_flags_and_padding_are_kept() {
    // Two datagrams, the first with "more" and both marked as circulating, then padding.
    exchange(
        &mut three(),
        "1C10 07 01 0000 0000 02C0 0000 0000 0000 01 02 0000 1000 0240 0000 0000 0000 EEEEEEEEEE",
        "1C10 07 01 0300 0000 02C0 0000 1100 0300 01 02 0300 1000 0240 0000 0110 0100 EEEEEEEEEE",
    );
}

#[test]
fn the_length_in_the_ethercat_header_is_not_read() {
    exchange(
        &mut three(),
        "0010 07 01 0000 0000 0100 0000 00 0000",
        "0010 07 01 0300 0000 0100 0000 11 0300",
    );
}

#[test]
fn events_pass_the_mask_into_the_datagram() {
    let mut bench = Bench::single();
    // Mask: AL status. The first state after power-up raises nothing.
    bench.write_u16(0x0200, 0x0008);
    exchange(
        &mut bench,
        "0D10 07 01 0000 0000 0100 0000 00 0000",
        "0D10 07 01 0100 0000 0100 0000 11 0100",
    );
    // A refused request changes AL status: seen in any datagram until AL status is read.
    bench.write_u16(0x0120, 0x0008);
    for _ in 0..2 {
        exchange(
            &mut bench,
            "0D10 07 01 0000 0000 0100 0000 00 0000",
            "0D10 07 01 0100 0000 0100 0800 11 0100",
        );
    }
    assert_eq!(bench.read_u16(0x0210), 0x0008);
    assert_eq!(bench.read_u16(0x0130), 0x0011);
    exchange(
        &mut bench,
        "0D10 07 01 0000 0000 0100 0000 00 0000",
        "0D10 07 01 0100 0000 0100 0000 11 0100",
    );
}

#[test]
fn missing_registers_leave_the_counter_and_read_only_ones_ignore_the_write() {
    let mut bench = Bench::single();
    assert_eq!(bench.read(0x0680, 16).1, 0, "a ninth FMMU");
    assert_eq!(bench.read(0x0840, 8).1, 0, "a ninth sync manager");
    assert_eq!(bench.read(0x2000, 4).1, 0, "behind the memory");
    assert_eq!(bench.read(0xFFFF, 4).1, 0, "at the end of the address space");
    assert_eq!(bench.read(0x1FFE, 4).1, 1, "half of it is there");
    assert_eq!(bench.write(0x0000, &[0x55]), 1);
    assert_eq!(bench.read(0x0000, 10), (vec![0x11, 0, 0, 0, 8, 8, 4, 0x0F, 0x0C, 0x01], 1));
}

#[test]
fn power_up_values() {
    let mut bench = Bench::single();
    for (register, value) in [
        (0x0010, 0x0000),
        (0x0012, 0x0123),
        (0x0100, 0x0001),
        (0x0102, 0x0007),
        (0x0120, 0x0000),
        (0x0130, 0x0001),
        (0x0134, 0x0000),
        (0x0140, 0x0E08),
        (0x0400, 0x09C2),
        (0x0410, 0x03E8),
        (0x0420, 0x03E8),
        (0x0930, 0x1000),
        (0x0934, 0x0C04),
    ] {
        assert_eq!(bench.read_u16(register), value, "register {register:04X}h");
    }
}
