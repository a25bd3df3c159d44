//! The way to an open connection, byte by byte.

use std::net::{Ipv4Addr, SocketAddrV4};

use fieldarm::bus::enip::scanner::{
    ConfigPath, ConnectionSettings, Mistake, ScannerEvent, T2oType, Target,
};
use fieldarm::time::Duration;
use fieldarm::wire::enip::parameters::TimeoutMultiplier;
use fieldarm::wire::enip::path::ElectronicKey;

use crate::bench::{
    Bench, Deed, O2T_ID, SESSION, address, context, hex, ms, packet, socket, t2o_id, triad,
};

/// Everything of a Forward Open behind its triad.
fn tail(open: &[u8]) -> &[u8] {
    &open[64..]
}

#[test]
fn every_byte_of_an_opening() {
    let mut bench = Bench::meca500();
    assert_eq!(bench.deeds(), [Deed::Connect(0)]);
    assert_eq!(bench.deeds(), []);
    bench.scanner.handle_connected(bench.now, 0);

    let register = bench.sent();
    let mut expected = hex("65 00 04 00 00 00 00 00 00 00 00 00");
    expected.extend(context(&register));
    expected.extend(hex("00 00 00 00 01 00 00 00"));
    assert_eq!(register, expected);
    let reply = packet(0x65, SESSION, 0, context(&register), &[1, 0, 0, 0]);
    for byte in reply {
        assert_eq!(bench.deeds(), []);
        bench.stream(0, &[byte]);
    }

    let request = bench.sent();
    let mut expected = hex("6F 00 16 00 44 33 22 11 00 00 00 00");
    expected.extend(context(&request));
    expected.extend(hex("00 00 00 00 00 00 00 00 00 00 02 00 00 00 00 00 B2 00 06 00"));
    expected.extend(hex("01 02 20 01 24 01"));
    assert_eq!(request, expected);
    assert_ne!(context(&request), context(&register));
    let mut identity = hex("81 00 00 00 1D 06 2B 00 F4 01 0B 03 30 00 78 56 34 12 07");
    identity.extend(b"Meca500");
    bench.answer(0, &request, &identity);
    let told = bench.status().identity.expect("it was told");
    assert_eq!((told.vendor, told.device_type, told.product_code), (1565, 43, 500));
    assert_eq!((told.major, told.minor, told.serial), (11, 3, 0x1234_5678));
    assert_eq!(told.name.as_bytes(), b"Meca500");

    let open = bench.sent();
    let mut expected = hex("6F 00 42 00 44 33 22 11 00 00 00 00");
    expected.extend(context(&open));
    expected.extend(hex("00 00 00 00 00 00 00 00 00 00 02 00 00 00 00 00 B2 00 32 00"));
    // 2 s are two ticks of 1024 ms; O->T has no id yet.
    expected.extend(hex("54 02 20 06 24 01 0A 02 00 00 00 00"));
    expected.extend(t2o_id(&open));
    expected.extend(&open[56..58]);
    expected.extend(hex("34 12 DD CC BB AA 02 00 00 00"));
    expected.extend(hex("10 27 00 00 42 48 10 27 00 00 FE 48 01 04"));
    expected.extend(hex("20 04 24 97 2C 96 2C 64"));
    assert_eq!(open, expected);

    let mut reply = hex("D4 00 00 00 01 A0 B0 C0");
    reply.extend(t2o_id(&open));
    reply.extend(triad(&open));
    reply.extend(hex("10 27 00 00 E0 2E 00 00 00 00"));
    bench.answer(0, &open, &reply);
    let opened = ScannerEvent::Opened {
        target: 0,
        o2t_api: ms(10),
        t2o_api: ms(12),
        config: ConfigPath::Named(151),
        multicast: None,
    };
    assert_eq!(bench.events(), [opened]);
    let status = bench.status();
    assert!(status.is_open && status.has_session);
    assert_eq!((status.o2t_api, status.t2o_api), (ms(10), ms(12)));
    assert_eq!(status.o2t_id, u32::from_le_bytes(O2T_ID));
    assert_eq!(status.t2o_id, u32::from_le_bytes(t2o_id(&open)));

    let mut outputs = [0; 60];
    outputs[..2].copy_from_slice(&[0xAB, 0xCD]);
    bench.scanner.write_outputs(0, &outputs);
    let to = SocketAddrV4::new(Ipv4Addr::new(192, 168, 0, 100), 2222);
    let mut frame = hex("02 00 02 80 08 00 01 A0 B0 C0 01 00 00 00 B1 00 42 00 01 00 01 00 00 00");
    frame.extend(outputs);
    assert_eq!(frame.len(), 84);
    assert_eq!(bench.deeds(), [Deed::Datagram(to, frame)]);
}

#[test]
fn answers_may_come_joined_with_what_nobody_asked_for() {
    let mut bench = Bench::meca500();
    bench.deeds();
    bench.scanner.handle_connected(bench.now, 0);
    let register = bench.sent();
    let mut joined = packet(0, [0; 4], 0, [0; 8], &[1, 2, 3]);
    joined.extend(packet(0x65, SESSION, 0, context(&register), &[1, 0, 0, 0]));
    joined.extend(packet(0x63, SESSION, 0, [9; 8], &[0, 0]));
    joined.extend(&packet(0, [0; 4], 0, [0; 8], &[])[..10]);
    bench.stream(0, &joined);
    assert_eq!(bench.sent()[40], 1, "the request for the identity");
    assert_eq!(bench.events(), []);
}

#[test]
fn a_target_without_identity_is_opened_all_the_same() {
    let mut bench = Bench::meca500();
    bench.open(0);
    assert_eq!(bench.status().identity, None);
    assert!(bench.status().is_open);
}

#[test]
fn monitors_send_a_heartbeat_without_data() {
    for (settings, point, t2o) in [
        (ConnectionSettings::meca500().input_only(), 0xEE, [0xFE, 0x48]),
        (ConnectionSettings::meca500().listen_only(), 0xED, [0xFE, 0x28]),
    ] {
        let settings = ConnectionSettings { config: ConfigPath::None, ..settings };
        let mut bench = Bench::new(&[settings]);
        let open = bench.up_to_open(0);
        let mut expected = hex("02 00 00 00 10 27 00 00 02 48 10 27 00 00");
        expected.extend(t2o);
        expected.extend([0x01, 0x03, 0x20, 0x04, 0x2C, point, 0x2C, 0x64]);
        assert_eq!(tail(&open), expected);
        let message = Bench::acceptance(&open, t2o_id(&open), 10_000, 10_000);
        bench.answer_with(0, &open, &message, &[(0x8001, socket([239, 192, 1, 32], 2222))]);
        let heartbeat = hex("02 00 02 80 08 00 01 A0 B0 C0 01 00 00 00 B1 00 02 00 01 00");
        assert_eq!(bench.frames(), [heartbeat]);
        // Outputs are of no use to it.
        bench.scanner.write_outputs(0, &[1; 60]);
        bench.now += ms(10);
        assert_eq!(bench.frames()[0].len(), 20);
    }
}

#[test]
fn a_large_forward_open_only_where_a_size_needs_it() {
    for (len, service, size) in [(505, 0x54, 0x01FF_u16), (506, 0x5B, 0x0200)] {
        let settings = ConnectionSettings { o2t_len: len, ..ConnectionSettings::meca500() };
        let open = Bench::new(&[settings]).up_to_open(0);
        assert_eq!(open[40], service, "{len} bytes");
        if service == 0x5B {
            let mut expected = hex("02 00 00 00 10 27 00 00");
            expected.extend(size.to_le_bytes());
            expected.extend(hex("00 48 10 27 00 00 FE 00 00 48 01 04"));
            assert_eq!(tail(&open)[..expected.len()], expected);
        } else {
            assert_eq!(tail(&open)[8..10], (0x4800 | size).to_le_bytes());
        }
    }
    let settings = ConnectionSettings { o2t_len: 506, ..ConnectionSettings::meca500() };
    let mut bench = Bench::new(&[settings]);
    bench.open(0);
    assert!(bench.status().is_open);
    assert_eq!(bench.frames()[0].len(), 20 + 4 + 506);
}

#[test]
fn another_port_is_told_to_the_target() {
    let settings = ConnectionSettings { io_port: 2300, ..ConnectionSettings::meca500() };
    let open = Bench::new(&[settings]).up_to_open(0);
    assert_eq!(open[30..32], [3, 0], "items");
    let item = hex("01 80 10 00 00 02 08 FC 00 00 00 00 00 00 00 00 00 00 00 00");
    assert_eq!(open[open.len() - 20..], item);
}

#[test]
fn the_key_stands_in_front_of_the_path() {
    let exact = ElectronicKey {
        vendor: 1565,
        device_type: 43,
        product_code: 500,
        major: 11,
        minor: 3,
        is_compatible: true,
    };
    for (key, bytes) in [
        (ElectronicKey::default(), "07 34 04 00 00 00 00 00 00 00 00 20 04 2C 96 2C 64"),
        (exact, "08 34 04 1D 06 2B 00 F4 01 8B 03 20 04 2C 96 2C 64"),
    ] {
        let settings = ConnectionSettings {
            key: Some(key),
            config: ConfigPath::None,
            ..ConnectionSettings::meca500()
        };
        let open = Bench::new(&[settings]).up_to_open(0);
        let expected = hex(bytes);
        assert_eq!(open[open.len() - 16..], expected[1..]);
        assert_eq!(open[open.len() - 17], 8, "words");
    }
}

#[test]
fn frames_go_where_the_answer_says() {
    for (item, to) in [
        (None, ([192, 168, 0, 100], 2222)),
        (Some(socket([0; 4], 2300)), ([192, 168, 0, 100], 2300)),
        (Some(socket([10, 0, 0, 9], 0)), ([10, 0, 0, 9], 2222)),
    ] {
        let mut bench = Bench::meca500();
        let open = bench.up_to_open(0);
        let message = Bench::acceptance(&open, t2o_id(&open), 10_000, 10_000);
        let items: Vec<_> = item.into_iter().map(|item| (0x8000, item)).collect();
        bench.answer_with(0, &open, &message, &items);
        let deeds = bench.deeds();
        let [Deed::Datagram(found, _)] = deeds.as_slice() else { panic!("{deeds:?}") };
        assert_eq!((found.ip().octets(), found.port()), to);
    }
}

#[test]
fn the_other_configuration_path_is_tried_at_once() {
    let with = hex("04 20 04 24 97 2C 96 2C 64");
    let without = hex("03 20 04 2C 96 2C 64");
    for (config, first, second) in
        [(ConfigPath::Named(151), &with, &without), (ConfigPath::None, &without, &with)]
    {
        let settings = ConnectionSettings { config, ..ConnectionSettings::meca500() };
        let mut bench = Bench::new(&[settings]);
        let open = bench.up_to_open(0);
        assert!(open.ends_with(first));
        bench.refuse(0, &open, &[0x0129]);
        let again = bench.sent();
        assert!(again.ends_with(second));
        assert_ne!(triad(&again), triad(&open));
        assert_ne!(t2o_id(&again), t2o_id(&open));
        // The path that was accepted is the first one next time.
        let message = Bench::acceptance(&again, t2o_id(&again), 10_000, 10_000);
        bench.answer(0, &again, &message);
        assert!(bench.status().is_open);
        let silence = bench.pass(Duration::from_secs(10));
        let closes = Bench::requests(&silence, 0x4E);
        bench.confirm_close(0, &closes[0]);
        let opens = Bench::requests(&bench.pass(ms(250)), 0x54);
        assert_eq!(opens.len(), 1);
        assert!(opens[0].ends_with(second));
    }
}

#[test]
fn both_paths_refused_is_a_failure_for_good() {
    let mut bench = Bench::meca500();
    let open = bench.up_to_open(0);
    bench.refuse(0, &open, &[0x0117]);
    let again = bench.sent();
    bench.refuse(0, &again, &[0x0117]);
    let events = bench.events();
    let [ScannerEvent::Failed { retry_in: None, trouble, .. }] = events.as_slice() else {
        panic!("{events:?}")
    };
    assert!(!trouble.is_transient());
    assert_eq!(bench.pass(Duration::from_secs(60)), []);
    // Unless the caller wants it, beginning with the path that is set.
    bench.scanner.open(bench.now, 0);
    assert!(bench.sent().ends_with(&hex("20 04 24 97 2C 96 2C 64")));
}

#[test]
fn only_one_path_if_the_other_is_not_wanted() {
    let settings =
        ConnectionSettings { tries_other_config: false, ..ConnectionSettings::meca500() };
    let mut bench = Bench::new(&[settings]);
    let open = bench.up_to_open(0);
    bench.refuse(0, &open, &[0x0315]);
    assert_eq!(bench.deeds(), []);
    assert!(matches!(bench.events()[..], [ScannerEvent::Failed { retry_in: None, .. }]));
}

#[test]
fn ids_and_serials_differ_between_processes_and_never_repeat_in_one() {
    let opens: Vec<_> = (0..50)
        .map(|seed| Bench::with_seed(&[ConnectionSettings::meca500()], seed).up_to_open(0))
        .collect();
    for (index, open) in opens.iter().enumerate() {
        for other in &opens[..index] {
            assert_ne!(triad(open), triad(other));
            assert_ne!(t2o_id(open), t2o_id(other));
            assert_ne!(context(open), context(other));
        }
    }
    let mut bench = Bench::new(&[ConnectionSettings {
        retries_permanent: true,
        longest_retry: ms(1),
        first_retry: ms(1),
        ..ConnectionSettings::meca500()
    }]);
    let mut open = bench.up_to_open(0);
    let mut seen = std::collections::HashSet::new();
    for _ in 0..2_000 {
        assert!(seen.insert((triad(&open), t2o_id(&open))), "it comes again");
        assert!(seen.insert((triad(&open), [0; 4])), "its serial comes again");
        bench.refuse(0, &open, &[0x0100]);
        bench.now += ms(1);
        bench.scanner.handle_timeout(bench.now);
        open = bench.sent();
    }
}

#[test]
fn settings_that_cannot_be_are_refused() {
    let base = ConnectionSettings::meca500();
    let try_it = |settings| Target::new(address(0), settings).map(|_| ());
    assert_eq!(try_it(base), Ok(()));
    assert_eq!(try_it(base.with_rpi(Duration::ZERO)), Err(Mistake::Interval));
    assert_eq!(try_it(base.with_rpi(Duration::from_nanos(10_000_500))), Err(Mistake::Interval));
    assert_eq!(try_it(base.with_rpi(Duration::from_secs(4295))), Err(Mistake::Interval));
    assert_eq!(try_it(base.with_rpi(Duration::from_micros(1))), Ok(()));
    assert_eq!(try_it(ConnectionSettings { t2o_len: 513, ..base }), Err(Mistake::Length));
    let heartbeat = ConnectionSettings { o2t_len: 1, ..base.input_only() };
    assert_eq!(try_it(heartbeat), Err(Mistake::Length));
    assert_eq!(try_it(ConnectionSettings { step_limit: ms(0), ..base }), Err(Mistake::Limit));
    for mistake in [Mistake::Interval, Mistake::Length, Mistake::Limit] {
        assert!(mistake.to_string().contains("give"), "{mistake}");
    }
}

#[test]
fn intervals_and_multiplier_travel_as_they_are() {
    let settings = ConnectionSettings {
        o2t_rpi: Duration::from_micros(2_500),
        t2o_rpi: Duration::from_micros(12_345),
        multiplier: TimeoutMultiplier::from_factor(512).expect("a factor"),
        t2o_type: T2oType::Multicast,
        ..ConnectionSettings::meca500()
    };
    let open = Bench::new(&[settings]).up_to_open(0);
    let expected = hex("07 00 00 00 C4 09 00 00 42 48 39 30 00 00 FE 28 01");
    assert_eq!(tail(&open)[..expected.len()], expected);
}

/// Brings two targets up, whatever the scanner wants first, with these O->T intervals; returns the ids of their
/// frames.
pub(crate) fn open_both(bench: &mut Bench, o2t_api_us: [u32; 2]) -> [[u8; 4]; 2] {
    let mut ids = [[0; 4]; 2];
    for _ in 0..10 {
        for deed in bench.deeds() {
            match deed {
                Deed::Connect(target) => bench.scanner.handle_connected(bench.now, target),
                Deed::Stream(target, bytes) if bytes[0] == 0x65 => {
                    bench.stream(target, &packet(0x65, SESSION, 0, context(&bytes), &[1, 0, 0, 0]));
                }
                Deed::Stream(target, bytes) if bytes[40] == 1 => {
                    bench.answer(target, &bytes, &[0x81, 0, 8, 0]);
                }
                Deed::Stream(target, open) if open[40] == 0x54 => {
                    ids[target] = t2o_id(&open);
                    let message =
                        Bench::acceptance(&open, t2o_id(&open), o2t_api_us[target], 10_000);
                    bench.answer(target, &open, &message);
                }
                other => panic!("{other:?}"),
            }
            if ids.iter().all(|id| *id != [0; 4]) {
                return ids;
            }
        }
    }
    panic!("they are not open");
}

#[test]
fn a_path_that_was_not_the_reason_is_kept_for_the_next_attempt() {
    let mut bench = Bench::meca500();
    let first = bench.up_to_open(0);
    bench.refuse(0, &first, &[0x0117]);
    let other = bench.sent();
    bench.refuse(0, &other, &[0x0106]);
    let opens = Bench::requests(&bench.pass(ms(200)), 0x54);
    assert!(opens[0].ends_with(&hex("03 20 04 2C 96 2C 64")), "the one that was not refused");
    // Each attempt may try both again.
    bench.refuse(0, &opens[0], &[0x0117]);
    assert!(bench.sent().ends_with(&hex("04 20 04 24 97 2C 96 2C 64")));
}
