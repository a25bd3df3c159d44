//! Whatever arrives in whatever order: the scanner goes on, and every deadline it names is served.

use fieldarm::bus::enip::scanner::{ConnectionSettings, T2oType};
use fieldarm::time::Duration;
use fieldarm::wire::enip::message::Service;
use fieldarm::wire::enip::path::ObjectPath;

use crate::bench::{Bench, Deed, SESSION, context, frame, io_address, packet, socket, t2o_id};

/// An answer to a request that may be right, or have a few bytes wrong.
fn answer(random: &mut fastrand::Rng, request: &[u8]) -> Vec<u8> {
    let message = match request.get(40) {
        _ if request[0] == 0x65 => {
            return packet(0x65, SESSION, 0, context(request), &[1, 0, 0, 0]);
        }
        Some(0x54) if random.u8(..4) > 0 => {
            let api = random.choice([700, 5_000, 10_000, u32::MAX]).expect("one");
            Bench::acceptance(request, t2o_id(request), api, 10_000)
        }
        Some(service) => {
            let mut message = vec![service | 0x80, 0, 1, 1];
            message.extend(random.u16(0x100..0x130).to_le_bytes());
            message
        }
        None => return Vec::new(),
    };
    let items = [(0x8001, socket([239, 192, 0, random.u8(..3)], 2222))];
    let data = crate::bench::unconnected(&message, &items);
    let mut bytes = packet(0x6F, SESSION, 0, context(request), &data);
    if random.u8(..4) == 0 {
        for _ in 0..random.usize(1..4) {
            let at = random.usize(..bytes.len());
            bytes[at] = random.u8(..);
        }
    }
    bytes
}

#[test]
fn noise_does_no_harm() {
    let mut opened = 0;
    for seed in 0..60 {
        let mut random = fastrand::Rng::with_seed(seed);
        let unicast = ConnectionSettings::meca500();
        let multicast = ConnectionSettings { t2o_type: T2oType::Multicast, ..unicast };
        let mut bench = Bench::with_seed(&[unicast, multicast.listen_only(), multicast], seed);
        let path = ObjectPath { class: 4, instance: 100, attribute: Some(3) };
        for _ in 0..400 {
            let target = random.usize(..3);
            match random.u8(..16) {
                0 => bench.scanner.handle_connected(bench.now, target),
                1 => bench.scanner.handle_disconnected(bench.now, target),
                2 => {
                    let bytes: Vec<u8> = (0..random.usize(..700)).map(|_| random.u8(..)).collect();
                    bench.stream(target, &bytes);
                }
                3 => bench.scanner.close(bench.now, target),
                4 | 5 => bench.scanner.open(bench.now, target),
                6 => {
                    let service = Service(random.u8(..));
                    // Refused at times; that is part of the noise.
                    let _ = bench.scanner.request(bench.now, target, service, path, &[1]);
                }
                7..10 => {
                    let id = bench.scanner.status(target).expect("there are three").t2o_id;
                    let bytes = frame(id.to_le_bytes(), random.u32(..), 1, &[0; 252]);
                    bench.scanner.handle_datagram(bench.now, io_address(target), &bytes);
                }
                _ => {
                    let time = Duration::from_micros(random.u64(..20_000));
                    for (_, deed) in bench.pass(time) {
                        match deed {
                            Deed::Connect(target) if random.u8(..4) > 0 => {
                                bench.scanner.handle_connected(bench.now, target);
                            }
                            Deed::Stream(target, request) if random.u8(..8) > 0 => {
                                let bytes = answer(&mut random, &request);
                                let (first, rest) = bytes.split_at(random.usize(..=bytes.len()));
                                bench.stream(target, first);
                                bench.stream(target, rest);
                            }
                            _ => {}
                        }
                    }
                }
            }
        }
        let opens = |target| bench.scanner.status(target).expect("there").counters.opened;
        opened += opens(0) + opens(1) + opens(2);
    }
    assert!(opened > 100, "only {opened} connections were ever open: the noise is too loud");
}
