//! Ends: wanted ones, lost streams, targets that start again.

use fieldarm::bus::enip::scanner::{ScannerEvent, Trouble};
use fieldarm::time::Duration;

use crate::bench::{Bench, Deed, SESSION, frame, hex, ms, t2o_id, triad};

const CLOSED: ScannerEvent = ScannerEvent::Closed { target: 0 };

#[test]
fn closing_byte_by_byte() {
    let mut bench = Bench::meca500();
    let open = bench.up_to_open(0);
    bench.answer(0, &open, &Bench::acceptance(&open, t2o_id(&open), 10_000, 10_000));
    bench.frames();
    bench.events();
    bench.scanner.close(bench.now, 0);
    let close = bench.sent();
    let mut expected = hex("6F 00 2A 00 44 33 22 11 00 00 00 00");
    expected.extend(crate::bench::context(&close));
    expected.extend(hex("00 00 00 00 00 00 00 00 00 00 02 00 00 00 00 00 B2 00 1A 00"));
    expected.extend(hex("4E 02 20 06 24 01 0A 02"));
    expected.extend(triad(&open));
    expected.extend(hex("04 00 20 04 24 97 2C 96 2C 64"));
    assert_eq!(close, expected);
    assert_eq!(bench.events(), []);
    bench.now += ms(10);
    assert_eq!(bench.frames(), Vec::<Vec<u8>>::new());
    bench.confirm_close(0, &close);
    assert_eq!(bench.events(), [CLOSED]);
    let mut unregister = hex("66 00 00 00");
    unregister.extend(SESSION);
    unregister.extend([0; 16]);
    assert_eq!(bench.deeds(), [Deed::Stream(0, unregister), Deed::Disconnect(0)]);
    assert_eq!(bench.pass(Duration::from_secs(60)), []);
    assert_eq!(bench.events(), []);
    // And open again.
    bench.scanner.open(bench.now, 0);
    bench.open(0);
    assert!(bench.status().is_open);
}

#[test]
fn a_close_that_is_not_answered_is_given_up() {
    let mut bench = Bench::meca500();
    bench.open(0);
    bench.events();
    bench.scanner.close(bench.now, 0);
    assert_eq!(bench.sent()[40], 0x4E);
    let deeds = bench.pass(Duration::from_secs(2));
    assert!(matches!(deeds[..], [(_, Deed::Disconnect(0))]), "{deeds:?}");
    assert_eq!(bench.events(), []);
    // Once more on a new stream, then no more.
    let deeds = bench.pass(ms(200));
    assert!(matches!(deeds[..], [(_, Deed::Connect(0))]), "{deeds:?}");
    bench.pass(Duration::from_secs(2));
    assert_eq!(bench.events(), [CLOSED]);
    assert_eq!(bench.pass(Duration::from_secs(60)), []);
}

#[test]
fn closing_in_the_middle_of_opening_closes_what_was_opened() {
    let mut bench = Bench::meca500();
    let open = bench.up_to_open(0);
    bench.scanner.close(bench.now, 0);
    assert_eq!(bench.deeds(), []);
    bench.answer(0, &open, &Bench::acceptance(&open, t2o_id(&open), 10_000, 10_000));
    assert!(!bench.status().is_open);
    let close = bench.sent();
    assert_eq!(close[48..56], triad(&open));
    bench.confirm_close(0, &close);
    assert_eq!(bench.events(), [CLOSED]);
}

#[test]
fn closing_before_there_is_anything() {
    let mut bench = Bench::meca500();
    assert_eq!(bench.deeds(), [Deed::Connect(0)]);
    bench.scanner.close(bench.now, 0);
    assert_eq!(bench.events(), [CLOSED]);
    assert_eq!(bench.deeds(), [Deed::Disconnect(0)]);
    bench.scanner.handle_connected(bench.now, 0);
    assert_eq!(bench.pass(Duration::from_secs(10)), []);
    // While it waits for the next attempt, too.
    let mut bench = Bench::meca500();
    let open = bench.up_to_open(0);
    bench.refuse(0, &open, &[0x0106]);
    bench.events();
    bench.scanner.close(bench.now, 0);
    assert_eq!(bench.events(), [CLOSED]);
    assert_eq!(bench.deeds().len(), 2, "UnRegisterSession and its end");
}

#[test]
fn the_connection_outlives_its_stream() {
    let mut bench = Bench::meca500();
    let id = bench.open(0);
    bench.receive(&frame(id, 1, 1, &[0; 252]));
    bench.events();
    bench.frames();
    bench.scanner.handle_disconnected(bench.now, 0);
    assert_eq!(bench.events(), [ScannerEvent::StreamLost { target: 0 }]);
    let mut frames = 0;
    let mut connects = 0;
    for step in 0..200 {
        for (_, deed) in bench.pass(ms(10)) {
            match deed {
                Deed::Datagram(..) => frames += 1,
                Deed::Connect(0) => {
                    connects += 1;
                    bench.scanner.handle_disconnected(bench.now, 0);
                }
                other => panic!("{other:?}"),
            }
        }
        bench.receive(&frame(id, 2 + step, 2, &[0; 252]));
    }
    assert_eq!((frames, connects), (200, 3), "after 0.2, 0.6 and 1.4 s");
    assert_eq!(bench.events(), [], "nothing to tell as long as frames come");
    assert!(bench.status().is_open);
    // The stream comes back; then frames stop, and the close finds its way.
    let mut connected = false;
    for step in 200..600 {
        connected |= bench.pass(ms(10)).iter().any(|(_, deed)| *deed == Deed::Connect(0));
        bench.receive(&frame(id, 2 + step, 2, &[0; 252]));
        if connected {
            break;
        }
    }
    assert!(connected);
    bench.reconnect(0);
    assert_eq!(Bench::requests(&bench.pass(ms(100)), 0x54), Vec::<Vec<u8>>::new());
    assert_eq!(Bench::requests(&bench.pass(ms(100)), 0x4E).len(), 1);
}

#[test]
fn a_target_that_starts_again_is_opened_again() {
    let mut bench = Bench::meca500();
    let id = bench.open(0);
    bench.receive(&frame(id, 1, 1, &[0; 252]));
    bench.events();
    // It is switched off: no frames, and nobody takes the Forward Close.
    let deeds = bench.pass(ms(200));
    assert_eq!(Bench::requests(&deeds, 0x4E).len(), 1);
    assert!(matches!(
        bench.events()[..],
        [ScannerEvent::Failed { trouble: Trouble::TimedOut { .. }, .. }]
    ));
    // It is back and knows nothing of the stream.
    bench.scanner.handle_disconnected(bench.now, 0);
    let deeds = bench.pass(ms(300));
    assert!(matches!(deeds[0], (_, Deed::Connect(0))), "{deeds:?}");
    bench.reconnect(0);
    let close = bench.sent();
    assert_eq!(close[40], 0x4E);
    bench.refuse(0, &close, &[0x0107]);
    // Not failed in between: the attempt that was due goes on.
    assert_eq!(bench.events(), []);
    let request = bench.sent();
    bench.answer(0, &request, &[0x81, 0, 8, 0]);
    let open = bench.sent();
    bench.answer(0, &open, &Bench::acceptance(&open, t2o_id(&open), 10_000, 10_000));
    bench.receive(&frame(t2o_id(&open), 1, 1, &[5; 252]));
    let events = bench.events();
    assert!(
        matches!(events[..], [ScannerEvent::Opened { .. }, ScannerEvent::Running { .. }]),
        "{events:?}"
    );
}

#[test]
fn events_that_nobody_asks_for_do_not_pile_up() {
    let mut bench = Bench::meca500();
    let mut open = bench.up_to_open(0);
    for _ in 0..40 {
        bench.refuse(0, &open, &[0x0106]);
        bench.now += Duration::from_secs(5);
        bench.scanner.handle_timeout(bench.now);
        open = bench.sent();
    }
    bench.answer(0, &open, &Bench::acceptance(&open, t2o_id(&open), 10_000, 10_000));
    let events = bench.events();
    assert_eq!(events.len(), 8);
    assert!(matches!(events.last(), Some(ScannerEvent::Opened { .. })), "the newest are kept");
}

#[test]
fn targets_that_are_not_there_are_no_reason_to_fail() {
    let mut bench = Bench::meca500();
    let now = bench.now;
    bench.scanner.handle_connected(now, 9);
    bench.scanner.handle_stream(now, 9, &[0; 100]);
    bench.scanner.handle_disconnected(now, 9);
    bench.scanner.write_outputs(9, &[0; 60]);
    bench.scanner.set_run(9, true);
    bench.scanner.close(now, 9);
    bench.scanner.open(now, 9);
    assert_eq!(bench.scanner.status(9), None);
    assert!(bench.scanner.answer(9).is_empty());
    assert_eq!(bench.scanner.target_count(), 1);
}

#[test]
fn closing_without_a_stream_makes_one_at_once() {
    let mut bench = Bench::meca500();
    bench.open(0);
    bench.frames();
    bench.scanner.handle_disconnected(bench.now, 0);
    assert_eq!(bench.deeds(), []);
    bench.scanner.close(bench.now, 0);
    assert_eq!(bench.deeds(), [Deed::Connect(0)]);
    bench.reconnect(0);
    assert_eq!(bench.sent()[40], 0x4E);
}

#[test]
fn a_stream_that_was_there_begins_with_the_shortest_pause_again() {
    let mut bench = Bench::meca500();
    let id = bench.open(0);
    let mut sequence = 0;
    // Time with frames until the scanner connects; how long that was, in steps of 10 ms.
    let mut until_connect = |bench: &mut Bench| {
        (1..200).find(|_| {
            sequence += 1;
            bench.receive(&frame(id, sequence, 1, &[0; 252]));
            bench.pass(ms(10)).iter().any(|(_, deed)| *deed == Deed::Connect(0))
        })
    };
    bench.scanner.handle_disconnected(bench.now, 0);
    for pause in [20, 40, 80] {
        assert_eq!(until_connect(&mut bench), Some(pause));
        bench.scanner.handle_disconnected(bench.now, 0);
    }
    assert_eq!(until_connect(&mut bench), Some(160));
    bench.reconnect(0);
    bench.scanner.handle_disconnected(bench.now, 0);
    assert_eq!(until_connect(&mut bench), Some(20));
}

#[test]
fn a_connection_that_ran_begins_with_the_shortest_pause_again() {
    for (runs, pause) in [(false, 800), (true, 200)] {
        let mut bench = Bench::meca500();
        let mut open = bench.up_to_open(0);
        for pause in [200, 400] {
            bench.refuse(0, &open, &[0x0106]);
            open = Bench::requests(&bench.pass(ms(pause)), 0x54).remove(0);
        }
        bench.answer(0, &open, &Bench::acceptance(&open, t2o_id(&open), 10_000, 10_000));
        if runs {
            bench.receive(&frame(t2o_id(&open), 1, 1, &[0; 252]));
        }
        bench.events();
        bench.pass(Duration::from_secs(if runs { 0 } else { 10 }) + ms(160));
        let events = bench.events();
        let Some(ScannerEvent::Failed { retry_in, .. }) = events.last() else {
            panic!("{events:?}")
        };
        assert_eq!(*retry_in, Some(ms(pause)));
    }
}

#[test]
fn the_end_of_another_connection_is_not_that_of_this_one() {
    let mut bench = Bench::meca500();
    bench.open(0);
    bench.frames();
    bench.events();
    bench.scanner.close(bench.now, 0);
    let close = bench.sent();
    let mut other = close.clone();
    other[48] ^= 1;
    bench.confirm_close(0, &other);
    bench.refuse(0, &other, &[0x0107]);
    assert_eq!(bench.events(), []);
    bench.confirm_close(0, &close);
    assert_eq!(bench.events(), [CLOSED]);
}
