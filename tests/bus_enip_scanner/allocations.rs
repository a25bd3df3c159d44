//! Cycles with frames both ways take no memory.

use fieldarm::bus::enip::scanner::{TRANSMIT_LEN, Transmit};
use fieldarm::cycle::InputQuality;

use crate::bench::{Bench, frame, io_address, ms};

#[test]
fn ten_thousand_cycles_take_no_memory() {
    let mut bench = Bench::meca500();
    bench.scanner.set_early(ms(5));
    let id = bench.open(0);
    let mut arriving = frame(id, 0, 0, &[0; 252]);
    let mut room = [0; TRANSMIT_LEN];
    let (mut sent, mut fresh) = (0, 0);
    let taken = allocation_counter::measure(|| {
        for cycle in 1..=10_000_u32 {
            bench.now += ms(10);
            arriving[10..14].copy_from_slice(&cycle.to_le_bytes());
            arriving[18..20].copy_from_slice(&(cycle as u16).to_le_bytes());
            bench.scanner.handle_datagram(bench.now, io_address(0), &arriving);
            bench.scanner.handle_timeout(bench.now);
            bench.scanner.begin_cycle();
            let mut inputs = [0; 252];
            fresh += u32::from(bench.scanner.read_inputs(0, &mut inputs) == InputQuality::Fresh);
            bench.scanner.write_outputs(0, &[cycle as u8; 60]);
            while let Some(transmit) = bench.scanner.poll_transmit(bench.now, &mut room) {
                sent += u32::from(matches!(transmit, Transmit::Datagram { .. }));
            }
            while bench.scanner.poll_event().is_some() {}
            std::hint::black_box(bench.scanner.poll_timeout());
        }
    });
    assert_eq!((sent, fresh), (10_000, 10_000));
    assert_eq!(taken.count_total, 0);
    let wasteful = allocation_counter::measure(|| drop(std::hint::black_box(vec![0_u8; 16])));
    assert!(wasteful.count_total > 0, "what is taken is counted");
}
