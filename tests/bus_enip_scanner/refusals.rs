//! What a target refuses, in words, and what is tried again.

use fieldarm::bus::enip::scanner::{ConnectionSettings, ScannerEvent, Trouble};
use fieldarm::time::Duration;

use crate::bench::{Bench, Deed, ms, triad};

/// Refuses the first Forward Open and returns the failure.
fn refused(settings: ConnectionSettings, words: &[u16]) -> (Bench, Trouble, Option<Duration>) {
    let mut bench = Bench::new(&[settings]);
    let open = bench.up_to_open(0);
    bench.refuse(0, &open, words);
    let events = bench.events();
    let [ScannerEvent::Failed { target: 0, trouble, retry_in }] = events.as_slice() else {
        panic!("{words:04X?}: {events:?}")
    };
    let found = (*trouble, *retry_in);
    (bench, found.0, found.1)
}

fn one_path() -> ConnectionSettings {
    ConnectionSettings { tries_other_config: false, ..ConnectionSettings::meca500() }
}

#[test]
fn each_refusal_has_words_and_is_tried_again_or_not() {
    for (words, is_transient, part) in [
        (vec![0x0100], true, "another serial number"),
        (vec![0x0106], true, "close the connection of the other scanner"),
        (vec![0x0113], true, "close one"),
        (vec![0x0119], true, "input-only"),
        (vec![0x0203], true, "check the network"),
        (vec![0x0204], true, "check the network"),
        (vec![0x0103], false, "instead of multicast"),
        (vec![0x0108], false, "instead of multicast"),
        (vec![0x0111], false, "longer"),
        (vec![0x0114], false, "wildcard key"),
        (vec![0x0115], false, "wildcard key"),
        (vec![0x0116], false, "wildcard key"),
        (vec![0x0117], false, "without a configuration assembly"),
        (vec![0x012F], false, "without a configuration assembly"),
        (vec![0x0315], false, "without a configuration assembly"),
        (vec![0x0109], false, "66 bytes O->T and 254 bytes T->O"),
        (vec![0x0127, 68], false, "the target has 68 bytes"),
        (vec![0x0128, 256], false, "the target has 256 bytes"),
        (vec![0x0FFF], true, "manual"),
    ] {
        let (mut bench, trouble, retry_in) = refused(one_path(), &words);
        assert_eq!(trouble.is_transient(), is_transient, "{words:04X?}");
        assert_eq!(retry_in, is_transient.then_some(ms(200)), "{words:04X?}");
        let text = trouble.to_string();
        assert!(text.contains(part), "{words:04X?}: {text}");
        assert!(text.contains(&format!("0x{:04X}", words[0])), "{text}");
        // The session stays, and so does the peace of a target that refuses for good.
        assert!(bench.status().has_session);
        let deeds = bench.pass(Duration::from_secs(1));
        assert_eq!(deeds.is_empty(), !is_transient, "{words:04X?}: {deeds:?}");
    }
}

#[test]
fn a_refusal_for_good_can_be_tried_again_all_the_same() {
    let settings = ConnectionSettings { retries_permanent: true, ..one_path() };
    let (mut bench, _, retry_in) = refused(settings, &[0x0114]);
    assert_eq!(retry_in, Some(ms(200)));
    let deeds = bench.pass(ms(250));
    assert!(matches!(&deeds[..], [(_, Deed::Stream(0, bytes))] if bytes[40] == 0x54), "{deeds:?}");
}

#[test]
fn other_general_statuses_are_told_as_they_are() {
    for (general, is_transient) in
        [(0x02, true), (0x08, false), (0x10, true), (0x15, false), (0x25, false)]
    {
        let mut bench = Bench::new(&[one_path()]);
        let open = bench.up_to_open(0);
        bench.answer(0, &open, &[0xD4, 0, general, 0]);
        let events = bench.events();
        let [ScannerEvent::Failed { trouble, .. }] = events.as_slice() else {
            panic!("{events:?}")
        };
        assert_eq!(trouble.is_transient(), is_transient, "{general}");
        assert!(trouble.to_string().contains(&format!("0x{general:02X}")), "{trouble}");
    }
}

#[test]
fn a_path_that_names_no_object_is_about_the_path() {
    let mut bench = Bench::meca500();
    let open = bench.up_to_open(0);
    bench.answer(0, &open, &[0xD4, 0, 5, 1, 0, 0]);
    assert_eq!(bench.sent()[40], 0x54, "the other path at once");
}

#[test]
fn pauses_double_up_to_the_longest_and_each_attempt_has_its_own_triad() {
    let settings = ConnectionSettings { longest_retry: ms(1000), ..ConnectionSettings::meca500() };
    let mut bench = Bench::new(&[settings]);
    let mut open = bench.up_to_open(0);
    let mut triads = vec![triad(&open)];
    for pause in [200, 400, 800, 1000, 1000] {
        bench.refuse(0, &open, &[0x0106]);
        assert!(matches!(
            bench.events()[..],
            [ScannerEvent::Failed { retry_in: Some(told), .. }] if told == ms(pause)
        ));
        assert_eq!(bench.pass(ms(pause - 1)), []);
        bench.now += ms(1);
        bench.scanner.handle_timeout(bench.now);
        open = bench.sent();
        assert!(!triads.contains(&triad(&open)));
        triads.push(triad(&open));
    }
}

#[test]
fn every_encapsulation_status_ends_the_attempt_in_words() {
    use crate::bench::{SESSION, context, packet};
    for (status, is_transient) in
        [(1, false), (2, true), (3, true), (0x64, true), (0x65, true), (0x69, false)]
    {
        let mut bench = Bench::meca500();
        bench.deeds();
        bench.scanner.handle_connected(bench.now, 0);
        let register = bench.sent();
        bench.stream(0, &packet(0x65, SESSION, status, context(&register), &[1, 0, 0, 0]));
        let events = bench.events();
        let [ScannerEvent::Failed { trouble, retry_in, .. }] = events.as_slice() else {
            panic!("{events:?}")
        };
        assert_eq!(retry_in.is_some(), is_transient, "{status:#X}");
        assert!(trouble.to_string().contains("RegisterSession"), "{trouble}");
        assert!(trouble.to_string().contains(&format!("0x{status:04X}")), "{trouble}");
        assert_eq!(bench.deeds(), [Deed::Disconnect(0)]);
    }
}
