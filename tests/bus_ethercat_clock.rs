//! Distributed clocks: latched receive times, system time, the loop that follows, SYNC0.

mod ethercat_support;

use ethercat_support::{Bench, OUTPUTS, device};
use fieldarm::bus::ethercat::Settings;
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::ethercat::command::{Command, position_of};

fn settings(delay_ns: u64, start_ns: u64, drift_ppb: i32) -> Settings {
    Settings {
        line_delay: Duration::from_nanos(delay_ns),
        clock_start_ns: start_ns,
        clock_drift_ppb: drift_ppb,
        ..Settings::default()
    }
}

/// Three devices with their own delays, starts and drifts.
fn three() -> Bench {
    let mut bench = Bench::new(0, Settings::default());
    bench.line = vec![
        device(settings(300, 1_000, 0)),
        device(settings(700, 5_000_000_000, 40_000)),
        device(settings(1_100, 77, -60_000)),
    ];
    bench
}

fn read<const N: usize>(bench: &mut Bench, index: u16, register: u16) -> [u8; N] {
    let command = Command::Aprd { position: position_of(index), register };
    let (data, counter) = bench.ask(command, &[0; N]);
    assert_eq!(counter, 1);
    data.try_into().unwrap()
}

fn write(bench: &mut Bench, index: u16, register: u16, data: &[u8]) {
    let command = Command::Apwr { position: position_of(index), register };
    assert_eq!(bench.ask(command, data).1, 1);
}

fn ports(bench: &mut Bench, index: u16) -> (u32, u32) {
    let [a, b, c, d, e, f, g, h] = read::<8>(bench, index, 0x0900);
    (u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h]))
}

fn latch(bench: &mut Bench) {
    let command = Command::Bwr { counter: 0, register: 0x0900 };
    assert_eq!(bench.ask(command, &[0; 4]).1, 3);
}

#[test]
fn a_broadcast_latches_the_times_at_both_ports() {
    let mut bench = Bench::new(0, Settings::default());
    bench.line = [(300, 1_000), (700, 0xFFFF_FFFF), (1_100, 77)]
        .map(|(delay, start)| device(settings(delay, start, 0)))
        .to_vec();
    latch(&mut bench);
    let sent = bench.now.as_nanos();
    // Out: 300, 700, 1100; back from the last: 1100, 700.
    assert_eq!(ports(&mut bench, 0), ((sent + 1_300) as u32, (sent + 4_900) as u32));
    let start = 0xFFFF_FFFF;
    assert_eq!(
        ports(&mut bench, 1),
        ((sent + 1_000 + start) as u32, (sent + 3_200 + start) as u32)
    );
    assert_eq!(ports(&mut bench, 2), ((sent + 2_177) as u32, 0));
    let arrival = u64::from_le_bytes(read(&mut bench, 1, 0x0918));
    assert_eq!(arrival, sent + 1_000 + start, "64 bits wide");
    // What a main device makes of it: half the difference of the loops is the way between.
    let loops = [0, 1].map(|index| {
        let (first, second) = ports(&mut bench, index);
        second.wrapping_sub(first)
    });
    assert_eq!(((loops[0] - loops[1]) / 2, loops[1] / 2), (700, 1_100));
    // Another broadcast elsewhere latches nothing.
    bench.ask(Command::Bwr { counter: 0, register: 0x0F80 }, &[0; 4]);
    assert_eq!(ports(&mut bench, 2).0, (sent + 2_177) as u32);
}

#[test]
fn system_time_is_local_time_and_offset() {
    let mut bench = Bench::new(0, Settings::default());
    bench.line = vec![device(settings(0, 500, 0))];
    let system = u64::from_le_bytes(read(&mut bench, 0, 0x0910));
    assert_eq!(system, bench.now.as_nanos() + 500);
    write(&mut bench, 0, 0x0920, &(-1_000_000_i64).to_le_bytes());
    let system = u64::from_le_bytes(read(&mut bench, 0, 0x0910));
    assert_eq!(system, bench.now.as_nanos() + 500 - 1_000_000);
    assert_eq!(bench.line[0].system_time(bench.now), Some(system));
}

#[test]
fn a_drifting_clock_runs_off() {
    let mut bench = Bench::new(0, Settings::default());
    bench.line = vec![device(settings(0, 0, 100_000)), device(settings(0, 0, -100_000))];
    bench.millis(999);
    let origin = bench.now.as_nanos();
    for (index, gained) in [(0, 100_000_i64), (1, -100_000)] {
        let time = bench.line[index].system_time(Instant::from_nanos(origin)).unwrap();
        assert_eq!(time as i64 - origin as i64, gained, "in the first second");
    }
}

/// Sets offsets and delays as a main device does: all clocks then show the first one's time.
fn align(bench: &mut Bench) {
    latch(bench);
    let sent = bench.now.as_nanos();
    for (index, delay) in [(0, 0_u32), (1, 700), (2, 1_800)] {
        let arrival = u64::from_le_bytes(read(bench, index, 0x0918));
        let offset = (sent + 300 + u64::from(delay)).wrapping_sub(arrival);
        write(bench, index, 0x0920, &offset.to_le_bytes());
        write(bench, index, 0x0928, &delay.to_le_bytes());
    }
    assert_eq!(bench.ask(Command::Bwr { counter: 0, register: 0x0930 }, &[0, 0x10]).1, 3);
}

/// Largest difference to the first clock, in ns.
fn spread(bench: &Bench) -> u64 {
    let times: Vec<u64> =
        bench.line.iter().map(|device| device.system_time(bench.now).unwrap()).collect();
    times.iter().map(|time| time.abs_diff(times[0])).max().unwrap()
}

fn distribute(bench: &mut Bench) {
    let command = Command::Armw { position: 0, register: 0x0910 };
    assert_eq!(bench.ask(command, &[0; 8]).1, 3);
}

#[test]
fn clocks_that_are_left_alone_part_and_clocks_that_are_led_stay_together() {
    let mut bench = three();
    align(&mut bench);
    bench.millis(1_000);
    assert!(spread(&bench) > 30_000, "40 and 60 ppm in a second");
    align(&mut bench);
    for _ in 0..2_000 {
        bench.millis(1);
        distribute(&mut bench);
    }
    for _ in 0..500 {
        bench.millis(1);
        distribute(&mut bench);
        assert!(spread(&bench) <= 20, "{} ns apart", spread(&bench));
    }
    for index in [1, 2] {
        let difference = u32::from_le_bytes(read(&mut bench, index, 0x092C));
        assert!(difference & 0x7FFF_FFFF <= 20, "{difference:08X}");
    }
}

#[test]
fn a_step_of_the_reference_is_followed_without_a_jump() {
    let mut bench = three();
    align(&mut bench);
    for _ in 0..1_000 {
        bench.millis(1);
        distribute(&mut bench);
    }
    // The reference is set 200 us ahead; nobody follows faster than a tenth of the time.
    let offset = u64::from_le_bytes(read(&mut bench, 0, 0x0920)).wrapping_add(200_000);
    write(&mut bench, 0, 0x0920, &offset.to_le_bytes());
    distribute(&mut bench);
    let difference = u32::from_le_bytes(read(&mut bench, 1, 0x092C));
    assert_eq!(difference & 0x8000_0000, 0x8000_0000, "behind: {difference:08X}");
    let mut before = bench.line[1].system_time(bench.now).unwrap();
    let mut at = bench.now;
    for _ in 0..3_000 {
        bench.millis(1);
        distribute(&mut bench);
        let after = bench.line[1].system_time(bench.now).unwrap();
        let (gained, passed) = (after - before, (bench.now - at).as_nanos() as u64);
        assert!(gained.abs_diff(passed) <= passed / 4, "{gained} in {passed}");
        (before, at) = (after, bench.now);
    }
    assert!(spread(&bench) <= 20, "{} ns apart", spread(&bench));
}

#[test]
fn without_a_clock_its_registers_do_not_exist() {
    let mut bench = Bench::new(1, Settings { distributed_clock: false, ..Settings::default() });
    assert_eq!(bench.read(0x0008, 2).0, [0, 0]);
    for register in [0x0900, 0x0910, 0x0920, 0x0981, 0x0990, 0x09A0] {
        assert_eq!(bench.read(register, 4), (vec![0; 4], 0), "{register:04X}h");
        assert_eq!(bench.write(register, &[1; 4]), 0, "{register:04X}h");
    }
    assert_eq!(bench.line[0].system_time(bench.now), None);
}

/// Starts SYNC0 at system time `start` with this cycle on a device without delay or drift.
fn start_sync0(bench: &mut Bench, start: u64, cycle_ns: u32) {
    write(bench, 0, 0x0981, &[0]);
    write(bench, 0, 0x0990, &start.to_le_bytes());
    write(bench, 0, 0x09A0, &cycle_ns.to_le_bytes());
    write(bench, 0, 0x0980, &[0, 3]);
}

fn exact() -> Bench {
    let mut bench = Bench::new(0, Settings::default());
    bench.line = vec![device(settings(0, 0, 0))];
    bench.bring_to_pre_op();
    bench.set_sync_manager(2, true);
    bench.set_sync_manager(3, true);
    bench
}

#[test]
fn with_sync0_the_cycle_runs_at_its_instants() {
    let mut bench = exact();
    start_sync0(&mut bench, 20_000_000, 2_000_000);
    assert_eq!(bench.request(4), (4, 0));
    bench.write(0x1100, &[0; OUTPUTS]);
    assert_eq!(bench.request(8), (8, 0));
    bench.line[0].application_mut().cycles.clear();
    // Ticks of 100 us that do not meet the instants, outputs every 500 us.
    bench.now = Instant::from_nanos(10_000_050);
    for step in 0..300_u32 {
        bench.now += Duration::from_micros(100);
        fieldarm::bus::ethercat::tick(bench.now, &mut bench.line);
        if step % 5 == 0 {
            let now = bench.now;
            bench.write(0x1100, &[step as u8; OUTPUTS]);
            bench.now = now;
        }
    }
    let cycles = &bench.line[0].application().cycles;
    let expected: Vec<u64> = (0..11).map(|cycle| 20_000_050 + cycle * 2_000_000).collect();
    let found: Vec<u64> = cycles.iter().map(|(at, _)| at.as_nanos()).collect();
    assert_eq!(found, expected);
    assert!(cycles.iter().all(|(_, outputs)| outputs.is_some()));
    assert_eq!(u64::from_le_bytes(read(&mut bench, 0, 0x0990)), 42_000_000, "the next one");
    // Missed instants count as one.
    bench.line[0].application_mut().cycles.clear();
    bench.now = Instant::from_nanos(51_500_000);
    fieldarm::bus::ethercat::tick(bench.now, &mut bench.line);
    assert_eq!(bench.line[0].application().cycles.len(), 1);
    assert_eq!(u64::from_le_bytes(read(&mut bench, 0, 0x0990)), 52_000_000);
    // Off again: the outputs set the pace.
    write(&mut bench, 0, 0x0981, &[0]);
    bench.line[0].application_mut().cycles.clear();
    bench.write(0x1100, &[1; OUTPUTS]);
    assert_eq!(bench.line[0].application().cycles.len(), 1);
}

#[test]
fn in_safe_op_sync0_sets_the_pace_without_outputs() {
    let mut bench = exact();
    start_sync0(&mut bench, 20_000_000, 5_000_000);
    assert_eq!(bench.request(4), (4, 0));
    bench.now = Instant::from_millis(19);
    bench.line[0].application_mut().cycles.clear();
    bench.millis(16);
    let cycles = &bench.line[0].application().cycles;
    let found: Vec<u64> = cycles.iter().map(|(at, _)| at.as_nanos()).collect();
    assert_eq!(found, [20_000_000, 25_000_000, 30_000_000, 35_000_000]);
    assert!(cycles.iter().all(|(_, outputs)| outputs.is_none()));
}

#[test]
fn a_start_in_the_past_and_a_single_shot() {
    let mut bench = exact();
    bench.now = Instant::from_millis(100);
    start_sync0(&mut bench, 3_000_000, 7_000_000);
    assert_eq!(u64::from_le_bytes(read(&mut bench, 0, 0x0990)), 101_000_000);
    // The largest numbers do no harm.
    start_sync0(&mut bench, 0, 1);
    write(&mut bench, 0, 0x0920, &u64::MAX.to_le_bytes());
    bench.millis(2);
    start_sync0(&mut bench, u64::MAX, u32::MAX);
    bench.millis(2);
    write(&mut bench, 0, 0x0920, &[0; 8]);
    start_sync0(&mut bench, 200_000_000, 0);
    bench.now = Instant::from_millis(300);
    bench.millis(1);
    assert_eq!(u64::from_le_bytes(read(&mut bench, 0, 0x0990)), u64::MAX, "no other comes");
}

#[test]
fn a_sync0_faster_than_the_device_is_refused() {
    let mut bench = exact();
    start_sync0(&mut bench, 0, 999_999);
    assert_eq!(bench.request(4), (0x12, 0x35));
    start_sync0(&mut bench, 0, 1_000_000);
    assert_eq!(bench.request(0x14), (4, 0));
}

#[test]
fn sync1_follows_sync0() {
    let mut bench = exact();
    write(&mut bench, 0, 0x09A4, &300_000_u32.to_le_bytes());
    start_sync0(&mut bench, 50_000_000, 1_000_000);
    assert_eq!(u64::from_le_bytes(read(&mut bench, 0, 0x0998)), 50_300_000);
}
