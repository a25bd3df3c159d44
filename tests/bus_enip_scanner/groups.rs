//! Multicast: the group of the answer, joined once and left with the last.

use std::net::Ipv4Addr;

use fieldarm::bus::enip::scanner::{ConnectionSettings, ScannerEvent, T2oType, Trouble};
use fieldarm::cycle::InputQuality;
use fieldarm::time::Duration;

use crate::bench::{Bench, Deed, frame, io_address, ms, socket, t2o_id};

const GROUP: [u8; 4] = [239, 192, 1, 32];
/// Id that the target chooses for what it produces to the group.
const ID: [u8; 4] = [5, 6, 7, 8];

fn multicast() -> ConnectionSettings {
    ConnectionSettings { t2o_type: T2oType::Multicast, ..ConnectionSettings::meca500() }
}

/// Brings each target up with this id and group.
fn open_all(bench: &mut Bench, agreed: &[([u8; 4], [u8; 4])]) -> Vec<Deed> {
    let mut others = Vec::new();
    for _ in 0..10 {
        for deed in bench.deeds() {
            match deed {
                Deed::Connect(target) => bench.scanner.handle_connected(bench.now, target),
                Deed::Stream(target, bytes) if bytes[0] == 0x65 => {
                    let context = crate::bench::context(&bytes);
                    let session = crate::bench::SESSION;
                    let reply = crate::bench::packet(0x65, session, 0, context, &[1, 0, 0, 0]);
                    bench.stream(target, &reply);
                }
                Deed::Stream(target, bytes) if bytes[40] == 1 => {
                    bench.answer(target, &bytes, &[0x81, 0, 8, 0]);
                }
                Deed::Stream(target, open) if open[40] == 0x54 => {
                    let (id, group) = agreed[target];
                    let message = Bench::acceptance(&open, id, 10_000, 10_000);
                    bench.answer_with(target, &open, &message, &[(0x8001, socket(group, 2222))]);
                }
                other => others.push(other),
            }
        }
    }
    others
}

fn membership(deeds: Vec<Deed>) -> Vec<Deed> {
    deeds.into_iter().filter(|deed| matches!(deed, Deed::Join(_) | Deed::Leave(_))).collect()
}

#[test]
fn the_group_and_the_id_are_those_of_the_answer() {
    let mut bench = Bench::new(&[multicast()]);
    let open = bench.up_to_open(0);
    assert_ne!(t2o_id(&open), ID);
    let message = Bench::acceptance(&open, ID, 10_000, 10_000);
    bench.answer_with(0, &open, &message, &[(0x8001, socket(GROUP, 2222))]);
    assert!(matches!(
        bench.events()[..],
        [ScannerEvent::Opened { multicast: Some(group), .. }] if group.octets() == GROUP
    ));
    assert_eq!(membership(bench.deeds()), [Deed::Join(Ipv4Addr::from(GROUP))]);
    assert_eq!(membership(bench.deeds()), []);
    bench.receive(&frame(ID, 1, 1, &[3; 252]));
    assert_eq!(bench.events(), [ScannerEvent::Running { target: 0 }]);
    // Given up with the connection.
    let deeds = bench.pass(ms(160)).into_iter().map(|(_, deed)| deed).collect();
    assert_eq!(membership(deeds), [Deed::Leave(Ipv4Addr::from(GROUP))]);
}

#[test]
fn a_shared_group_is_joined_once_and_left_with_the_last() {
    let mut bench = Bench::new(&[multicast(), multicast()]);
    let deeds = open_all(&mut bench, &[(ID, GROUP), (ID, GROUP)]);
    assert_eq!(membership(deeds), [Deed::Join(Ipv4Addr::from(GROUP))]);
    // The same id twice: told apart by where they come from.
    let mut inputs = [0; 252];
    bench.scanner.handle_datagram(bench.now, io_address(1), &frame(ID, 1, 1, &[2; 252]));
    bench.scanner.begin_cycle();
    assert_eq!(bench.scanner.read_inputs(0, &mut inputs), InputQuality::Lost);
    assert_eq!(bench.scanner.read_inputs(1, &mut inputs), InputQuality::Fresh);
    assert_eq!(inputs, [2; 252]);
    bench.scanner.close(bench.now, 0);
    assert_eq!(membership(bench.deeds()), []);
    bench.scanner.close(bench.now, 1);
    assert_eq!(membership(bench.deeds()), [Deed::Leave(Ipv4Addr::from(GROUP))]);
}

#[test]
fn different_groups_are_joined_each() {
    let other = [239, 192, 2, 32];
    let mut bench = Bench::new(&[multicast(), multicast()]);
    let mut deeds = membership(open_all(&mut bench, &[(ID, GROUP), (ID, other)]));
    deeds.sort_by_key(|deed| format!("{deed:?}"));
    let joins = [GROUP, other].map(|group| Deed::Join(Ipv4Addr::from(group)));
    assert_eq!(deeds, joins);
}

#[test]
fn an_answer_without_a_group_is_malformed() {
    for items in [vec![], vec![(0x8001, socket([192, 168, 0, 100], 2222))]] {
        let mut bench = Bench::new(&[multicast()]);
        let open = bench.up_to_open(0);
        let message = Bench::acceptance(&open, ID, 10_000, 10_000);
        bench.answer_with(0, &open, &message, &items);
        let events = bench.events();
        let [ScannerEvent::Failed { trouble, .. }] = events.as_slice() else {
            panic!("{events:?}")
        };
        assert!(trouble.to_string().contains("group"), "{trouble}");
        assert_eq!(membership(bench.deeds()), []);
    }
}

#[test]
fn a_unicast_connection_joins_nothing() {
    let mut bench = Bench::meca500();
    let open = bench.up_to_open(0);
    let message = Bench::acceptance(&open, t2o_id(&open), 10_000, 10_000);
    bench.answer_with(0, &open, &message, &[(0x8001, socket(GROUP, 2222))]);
    assert!(bench.status().is_open);
    let deeds = bench.pass(Duration::from_secs(1)).into_iter().map(|(_, deed)| deed).collect();
    assert_eq!(membership(deeds), []);
}

/// A frame of the group, whose MonitoringMode says whether the connection only watches.
fn told(sequence: u32, monitors: bool) -> Vec<u8> {
    let mut image = [0; 252];
    // Bit 9 of the image.
    image[1] = u8::from(monitors) << 1;
    frame(ID, sequence, sequence as u16, &image)
}

/// Brings up one target, and lets frames come each 10 ms that say whether it controls: whether it is open then,
/// how many Forward Closes it sent, and what it said.
fn after_frames(
    settings: ConnectionSettings,
    monitors: &[bool],
) -> (bool, usize, Vec<ScannerEvent>) {
    let mut bench = Bench::new(&[settings]);
    open_all(&mut bench, &[(ID, GROUP)]);
    let mut closes = 0;
    for (sequence, monitors) in (1..).zip(monitors) {
        bench.receive(&told(sequence, *monitors));
        closes += Bench::requests(&bench.pass(ms(10)), 0x4E).len();
    }
    (bench.status().is_open, closes, bench.events())
}

fn lost(events: &[ScannerEvent]) -> bool {
    events.iter().any(|event| {
        matches!(
            event,
            ScannerEvent::Failed { trouble: Trouble::ControlLost { after }, retry_in: Some(_), .. }
                if *after == ms(160)
        )
    })
}

#[test]
fn an_owner_that_lost_control_while_its_group_goes_on_is_opened_again() {
    let mut told = vec![false; 5];
    told.extend([true; 16]);
    let (is_open, closes, events) = after_frames(multicast(), &told[..20]);
    assert!(is_open && closes == 0 && !lost(&events), "not a whole timeout yet: {events:?}");
    let (is_open, closes, events) = after_frames(multicast(), &told);
    assert!(!is_open && closes == 1 && lost(&events), "{closes} Forward Closes, {events:?}");
}

#[test]
fn control_is_lost_only_by_an_owner_that_had_it_and_does_not_get_it_back() {
    let mut back = vec![false; 2];
    (0..5).for_each(|_| back.extend([[true; 14].as_slice(), &[false]].concat()));
    let never = vec![true; 100];
    let mut gone = vec![false; 2];
    gone.extend([true; 100]);
    let without = ConnectionSettings { monitoring_bit: None, ..multicast() };
    for (settings, told) in [
        (multicast(), &back),
        (multicast(), &never),
        (without, &gone),
        (multicast().input_only(), &gone),
        (ConnectionSettings { t2o_type: T2oType::Unicast, ..multicast() }, &gone),
    ] {
        let (is_open, closes, events) = after_frames(settings, told);
        assert!(is_open && closes == 0 && !lost(&events), "{settings:?}: {events:?}");
    }
}
