//! Time limits of each step, and answers that are none.

use fieldarm::bus::enip::scanner::{ConnectionSettings, ScannerEvent, Step, T2oType, Trouble};
use fieldarm::time::Duration;

use crate::bench::{Bench, Deed, O2T_ID, SESSION, context, ms, packet, t2o_id, unconnected};

fn failure(bench: &mut Bench) -> Trouble {
    let events = bench.events();
    let [ScannerEvent::Failed { trouble, .. }] = events.as_slice() else { panic!("{events:?}") };
    *trouble
}

#[test]
fn a_target_that_is_not_there() {
    let mut bench = Bench::meca500();
    assert_eq!(bench.deeds(), [Deed::Connect(0)]);
    bench.scanner.handle_disconnected(bench.now, 0);
    assert_eq!(failure(&mut bench), Trouble::Unreachable);
    assert_eq!(bench.pass(ms(199)), []);
    assert!(matches!(bench.pass(ms(1))[..], [(_, Deed::Connect(0))]));
    // Nor does it answer: given up after 2 s, and the I/O is told so.
    let deeds = bench.pass(ms(2_000));
    assert!(matches!(deeds[..], [(_, Deed::Disconnect(0))]), "{deeds:?}");
    assert_eq!(failure(&mut bench), Trouble::Unreachable);
    assert!(Trouble::Unreachable.to_string().contains("address"));
}

#[test]
fn each_step_has_a_limit_and_the_stream_ends_with_it() {
    for (answers, step) in [(0, Step::RegisterSession), (1, Step::Identity), (2, Step::ForwardOpen)]
    {
        let mut bench = Bench::meca500();
        bench.deeds();
        bench.scanner.handle_connected(bench.now, 0);
        let request = bench.sent();
        if answers > 0 {
            bench.stream(0, &packet(0x65, SESSION, 0, context(&request), &[1, 0, 0, 0]));
            let request = bench.sent();
            if answers > 1 {
                bench.answer(0, &request, &[0x81, 0, 8, 0]);
                bench.sent();
            }
        }
        assert_eq!(bench.pass(ms(1_999)), []);
        let deeds = bench.pass(ms(1));
        assert!(matches!(deeds[..], [(_, Deed::Disconnect(0))]), "{step:?}: {deeds:?}");
        assert_eq!(failure(&mut bench), Trouble::NoAnswer { step });
        assert!(matches!(bench.pass(ms(200))[..], [(_, Deed::Connect(0))]));
        // What it may have opened unheard is closed first.
        bench.reconnect(0);
        let next = bench.sent();
        let service = if step == Step::ForwardOpen { 0x4E } else { 1 };
        assert_eq!(next[40], service, "{step:?}");
    }
}

#[test]
fn a_target_that_hangs_up_in_the_middle() {
    let mut bench = Bench::meca500();
    bench.up_to_open(0);
    bench.scanner.handle_disconnected(bench.now, 0);
    assert_eq!(failure(&mut bench), Trouble::NoAnswer { step: Step::ForwardOpen });
    assert_eq!(bench.deeds(), [], "there is nothing to hang up");
}

#[test]
fn answers_to_others_are_not_taken() {
    let mut bench = Bench::meca500();
    let open = bench.up_to_open(0);
    let good = Bench::acceptance(&open, t2o_id(&open), 10_000, 10_000);
    let data = unconnected(&good, &[]);
    let right = context(&open);
    let mut options = packet(0x6F, SESSION, 0, right, &data);
    options[20] = 1;
    let mut wrong_triads = Vec::new();
    for byte in 12..20 {
        let mut message = good.clone();
        message[byte] ^= 1;
        wrong_triads.push(packet(0x6F, SESSION, 0, right, &unconnected(&message, &[])));
    }
    let mut other_service = good.clone();
    other_service[0] = 0xCE;
    let mut foreign_refusal = vec![0xD4, 0, 1, 1, 6, 1];
    foreign_refusal.extend([1; 8]);
    foreign_refusal.extend([0, 0]);
    let strangers = [
        packet(0x6F, SESSION, 0, [1; 8], &data),
        packet(0x6F, [9; 4], 0, right, &data),
        packet(0x65, SESSION, 0, right, &[1, 0, 0, 0]),
        packet(0x70, SESSION, 0, right, &data),
        packet(0x6F, SESSION, 0, right, &unconnected(&other_service, &[])),
        packet(0x6F, SESSION, 0, right, &unconnected(&foreign_refusal, &[])),
        options,
    ];
    for stranger in strangers.iter().chain(&wrong_triads) {
        bench.stream(0, stranger);
        assert_eq!(bench.events(), [], "{stranger:02X?}");
        assert!(!bench.status().is_open, "{stranger:02X?}");
        assert_eq!(bench.deeds(), []);
    }
    bench.stream(0, &packet(0x6F, SESSION, 0, right, &data));
    assert!(bench.status().is_open);
    assert_eq!(bench.status().o2t_id, u32::from_le_bytes(O2T_ID));
}

#[test]
fn an_answer_that_comes_after_its_limit_opens_nothing() {
    let mut bench = Bench::meca500();
    let open = bench.up_to_open(0);
    let message = Bench::acceptance(&open, t2o_id(&open), 10_000, 10_000);
    bench.pass(ms(2_200));
    bench.answer(0, &open, &message);
    assert!(!bench.status().is_open);
    bench.reconnect(0);
    bench.answer(0, &open, &message);
    assert!(!bench.status().is_open);
}

#[test]
fn a_packet_without_end_ends_the_stream() {
    let mut bench = Bench::meca500();
    let open = bench.up_to_open(0);
    let mut bytes = packet(0x6F, SESSION, 0, context(&open), &[]);
    bytes[2..4].copy_from_slice(&617_u16.to_le_bytes());
    bench.stream(0, &bytes[..23]);
    assert_eq!(bench.events(), []);
    bench.stream(0, &bytes[23..]);
    let trouble = failure(&mut bench);
    let text = trouble.to_string();
    assert!(matches!(trouble, Trouble::Malformed { step: Step::ForwardOpen, .. }));
    assert!(text.contains("length is 617") && text.contains("616"), "{text}");
    assert_eq!(bench.deeds(), [Deed::Disconnect(0)]);
    // What follows on the dead stream is nobody's.
    bench.stream(0, &[0; 1000]);
    assert_eq!(bench.events(), []);
}

#[test]
fn a_careless_end_of_an_acceptance_is_passed_over() {
    let socket = crate::bench::socket([0; 4], 3_333);
    let mut other_order = socket;
    other_order.swap(0, 1);
    let item = |kind: u16, data: &[u8]| {
        [&kind.to_le_bytes()[..], &(data.len() as u16).to_le_bytes(), data].concat()
    };
    // What stands behind the message, how many items that is said to be, and where frames go then.
    for (behind, items, port) in [
        (vec![], 2, 2_222),
        (vec![0; 5], 2, 2_222),
        (item(0x8000, &socket), 3, 3_333),
        (item(0x8000, &other_order), 3, 3_333),
        (item(0x8000, &socket[..8]), 3, 3_333),
        (item(0x8000, &socket[..7]), 3, 2_222),
        (item(0x8000, &[7; 16]), 3, 2_222),
        (item(0x8001, &[]), 3, 2_222),
        (item(0x8000, &socket)[..10].to_vec(), 3, 2_222),
        (vec![], 9, 2_222),
    ] {
        for application in [vec![0, 0], vec![], vec![0], vec![1, 0], vec![0, 0, 1, 2, 3]] {
            let mut bench = Bench::meca500();
            let open = bench.up_to_open(0);
            let mut message = Bench::acceptance(&open, t2o_id(&open), 10_000, 10_000);
            message.truncate(message.len() - 2);
            message.extend(&application);
            let mut data = unconnected(&message, &[]);
            data[6] = items;
            data.extend(&behind);
            bench.stream(0, &packet(0x6F, SESSION, 0, context(&open), &data));
            assert!(
                bench.status().is_open,
                "{behind:02X?} {application:02X?}: {:?}",
                bench.events()
            );
            let to = bench.deeds().into_iter().find_map(|deed| match deed {
                Deed::Datagram(to, _) => Some(to),
                _ => None,
            });
            assert_eq!(to.map(|to| to.port()), Some(port), "{behind:02X?}");
        }
    }
}

#[test]
fn an_acceptance_whose_group_cannot_be_read_is_named_and_not_asked_for_again() {
    let multicast =
        ConnectionSettings { t2o_type: T2oType::Multicast, ..ConnectionSettings::meca500() };
    for (item, said) in [
        (None, "cut off in its T->O socket address item (the group)"),
        (Some((0x8001, [7; 16])), "socket address item: family is 1799, but must be 2"),
    ] {
        let mut bench = Bench::new(&[multicast]);
        let open = bench.up_to_open(0);
        let message = Bench::acceptance(&open, t2o_id(&open), 10_000, 10_000);
        bench.answer_with(0, &open, &message, item.as_slice());
        let events = bench.events();
        let [ScannerEvent::Failed { trouble, retry_in: None, .. }] = events[..] else {
            panic!("{events:?}")
        };
        let text = trouble.to_string();
        assert!(text.contains("Forward Open") && text.contains(said), "{text}");
        // It may be open on the other side, so it is closed; nothing more is asked for.
        assert_eq!(bench.deeds(), [Deed::Disconnect(0)]);
        let deeds = bench.pass(ms(200));
        assert!(matches!(deeds[..], [(_, Deed::Connect(0))]), "{deeds:?}");
        bench.reconnect(0);
        let close = bench.sent();
        assert_eq!(close[40], 0x4E, "Forward Close");
        bench.confirm_close(0, &close);
        assert_eq!(Bench::requests(&bench.pass(Duration::from_secs(10)), 0x54).len(), 0);
    }
}

#[test]
fn the_longest_packet_is_read_however_it_is_split() {
    for split in [1, 23, 24, 25, 639, 640] {
        let mut bench = Bench::meca500();
        let open = bench.up_to_open(0);
        let message = Bench::acceptance(&open, t2o_id(&open), 10_000, 10_000);
        let mut bytes = packet(0x63, SESSION, 0, [0; 8], &[7; 616]);
        bytes.extend(packet(0x6F, SESSION, 0, context(&open), &unconnected(&message, &[])));
        for part in bytes.chunks(split) {
            bench.stream(0, part);
        }
        assert!(bench.status().is_open, "split into {split}");
    }
}

#[test]
fn an_acceptance_that_makes_no_sense_is_malformed_and_closed_again() {
    let mut bench = Bench::meca500();
    let open = bench.up_to_open(0);
    bench.answer(0, &open, &Bench::acceptance(&open, t2o_id(&open), 0, 10_000));
    let trouble = failure(&mut bench);
    assert!(trouble.to_string().contains("O->T API is 0"), "{trouble}");
    let deeds = bench.pass(ms(200));
    assert!(matches!(deeds[..], [(_, Deed::Disconnect(0)), (_, Deed::Connect(0))]), "{deeds:?}");
    bench.reconnect(0);
    let close = bench.sent();
    assert_eq!(close[40], 0x4E);
    assert_eq!(close[48..56], open[56..64], "of this very connection");
}

#[test]
fn no_prefix_and_no_flipped_bit_of_an_answer_does_harm() {
    let whole = |open: &[u8]| {
        let message = Bench::acceptance(open, t2o_id(open), 10_000, 10_000);
        packet(0x6F, SESSION, 0, context(open), &unconnected(&message, &[]))
    };
    let bits = {
        let open = Bench::meca500().up_to_open(0);
        8 * whole(&open).len()
    };
    for bit in 0..bits {
        let mut bench = Bench::meca500();
        let open = bench.up_to_open(0);
        let mut bytes = whole(&open);
        bytes[bit / 8] ^= 1 << (bit % 8);
        bench.stream(0, &bytes);
        bench.pass(ms(50));
        // And the prefix that ends there, with an end of the stream behind it.
        let mut bench = Bench::meca500();
        let open = bench.up_to_open(0);
        bench.stream(0, &whole(&open)[..bit / 8]);
        assert!(!bench.status().is_open);
        bench.scanner.handle_disconnected(bench.now, 0);
        bench.pass(Duration::from_secs(3));
    }
}
