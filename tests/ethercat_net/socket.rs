//! The raw socket: what passes, what does not, and what a link that goes down does to it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use fieldarm::link::ethercat::raw_socket::{self, OpenError, RawSocket};
use fieldarm::link::ethercat::wire::{MAX_FRAME, Wire};

use crate::namespaces::{Cable, End, INTERFACE};

/// Far longer than anything here takes.
const LONG: Duration = Duration::from_secs(10);
/// How long to look for a frame that must not come.
const LOOK: Duration = Duration::from_millis(50);

fn open(cable: &Cable, end: End) -> RawSocket {
    cable.inside(end, LONG, || RawSocket::open(INTERFACE)).expect("root opens it")
}

/// A frame of `length` bytes, of EtherCAT unless said otherwise, filled with `mark`.
fn frame(ethertype: u16, mark: u8, length: usize) -> Vec<u8> {
    let mut frame = vec![0xFF; 6];
    frame.extend([0x10; 6]);
    frame.extend(ethertype.to_be_bytes());
    frame.resize(length, mark);
    frame
}

fn receive(socket: &mut RawSocket, wait: Duration) -> Option<Vec<u8>> {
    let mut buffer = [0; MAX_FRAME];
    let deadline = socket.now() + wait;
    let length = socket.receive(&mut buffer, deadline).expect("the link is up");
    assert!(length.is_some() || socket.now() >= deadline, "it returns at its deadline, not before");
    length.map(|length| buffer[..length].to_vec())
}

#[test]
fn a_frame_arrives_at_the_other_end_and_only_there() {
    let Some(cable) = Cable::plug() else { return };
    let (mut here, mut there) = (open(&cable, End::Main), open(&cable, End::Robots));
    for (mark, length) in [(1, 30), (2, 60), (3, MAX_FRAME)] {
        here.send(&frame(0x88A4, mark, length)).expect("sent");
        assert_eq!(receive(&mut there, LONG), Some(frame(0x88A4, mark, length)));
        there.send(&frame(0x88A4, mark + 100, length)).expect("sent");
        assert_eq!(receive(&mut here, LONG), Some(frame(0x88A4, mark + 100, length)));
    }
    assert_eq!(receive(&mut here, LOOK), None, "what it sent does not come back");
    assert_eq!(receive(&mut there, LOOK), None, "what it sent does not come back");
}

#[test]
fn other_protocols_and_frames_without_room_are_not_seen() {
    let Some(cable) = Cable::plug() else { return };
    let (mut here, mut there) = (open(&cable, End::Main), open(&cable, End::Robots));
    here.send(&frame(0x88B5, 1, 60)).expect("sent");
    here.send(&frame(0x88A4, 2, 61)).expect("sent");
    here.send(&frame(0x88A4, 3, 60)).expect("sent");
    let mut buffer = [0; 60];
    let deadline = there.now() + LONG;
    assert_eq!(there.receive(&mut buffer, deadline).expect("the link is up"), Some(60));
    assert_eq!(buffer[14], 3);
    assert_eq!(receive(&mut there, Duration::ZERO), None);
}

#[test]
fn what_arrived_on_other_interfaces_before_the_opening_is_not_seen() {
    let Some(cable) = Cable::plug() else { return };
    cable.plug_another("other0");
    let mut flood = cable.inside(End::Main, LONG, || RawSocket::open("other0")).expect("opens");
    let done = Arc::new(AtomicBool::new(false));
    let is_done = Arc::clone(&done);
    let flooding = thread::spawn(move || {
        let foreign = frame(0x88A4, 0xEE, 60);
        let mut sent = 0_u64;
        while !is_done.load(Ordering::Relaxed) {
            sent += u64::from(flood.send(&foreign).is_ok());
        }
        sent
    });
    let seen: Vec<_> = (0..20)
        .filter_map(|_| {
            let mut socket = open(&cable, End::Robots);
            receive(&mut socket, Duration::from_millis(1))
        })
        .collect();
    done.store(true, Ordering::Relaxed);
    assert!(flooding.join().expect("it only sends") > 0);
    assert!(seen.is_empty(), "{} openings saw foreign frames", seen.len());
}

#[test]
fn a_link_that_was_down_for_150_ms_goes_on_by_itself() {
    let Some(cable) = Cable::plug() else { return };
    for end in [End::Main, End::Robots] {
        let (mut here, mut there) = (open(&cable, End::Main), open(&cable, End::Robots));
        cable.set_up(end, false);
        let own = if end == End::Main { &mut here } else { &mut there };
        let mut buffer = [0; MAX_FRAME];
        let deadline = own.now() + LONG;
        let error = own.receive(&mut buffer, deadline).expect_err("told of it at once");
        assert!(raw_socket::is_transient(&error), "{error}");
        assert!(own.is_down());
        let error = own.send(&frame(0x88A4, 1, 60)).expect_err("nowhere to send it");
        assert!(raw_socket::is_transient(&error), "{error}");
        assert_eq!(receive(own, Duration::from_millis(150)), None, "told once, then quiet");
        cable.set_up(end, true);
        let heard = (0..200).find_map(|_| {
            // A cable needs a moment until it carries again.
            let _ = here.send(&frame(0x88A4, 2, 60));
            receive(&mut there, Duration::from_millis(20))
        });
        assert_eq!(heard, Some(frame(0x88A4, 2, 60)));
        there.send(&frame(0x88A4, 3, 60)).expect("the link is up");
        assert_eq!(receive(&mut here, LONG), Some(frame(0x88A4, 3, 60)));
        assert!(!here.is_down() && !there.is_down());
    }
}

#[test]
fn an_interface_that_is_down_can_be_opened_before_it_comes_up() {
    let Some(cable) = Cable::plug() else { return };
    cable.set_up(End::Robots, false);
    let mut there = open(&cable, End::Robots);
    assert!(there.is_down());
    let mut here = open(&cable, End::Main);
    cable.set_up(End::Robots, true);
    let heard = (0..200).find_map(|_| {
        let _ = here.send(&frame(0x88A4, 2, 60));
        receive(&mut there, Duration::from_millis(20))
    });
    assert_eq!(heard, Some(frame(0x88A4, 2, 60)));
}

#[test]
fn an_interface_that_is_removed_is_a_lasting_error() {
    let Some(cable) = Cable::plug() else { return };
    let mut there = open(&cable, End::Robots);
    cable.cut();
    let mut buffer = [0; MAX_FRAME];
    let errors: Vec<_> = (0..100)
        .filter_map(|_| {
            let deadline = there.now() + Duration::from_millis(10);
            there.receive(&mut buffer, deadline).err()
        })
        .collect();
    let last = errors.last().expect("it says something");
    assert!(!raw_socket::is_transient(last), "{errors:?}");
    let error = there.send(&frame(0x88A4, 1, 60)).expect_err("nowhere to send it");
    assert!(!raw_socket::is_transient(&error), "{error}");
    let error = cable.inside(End::Robots, LONG, || RawSocket::open(INTERFACE)).unwrap_err();
    assert!(matches!(error, OpenError::NoSuchInterface { .. }), "{error}");
}

#[test]
fn frames_pass_without_allocation() {
    let Some(cable) = Cable::plug() else { return };
    let (mut here, mut there) = (open(&cable, End::Main), open(&cable, End::Robots));
    let sent = frame(0x88A4, 1, 360);
    let mut buffer = [0; MAX_FRAME];
    let mut passed = 0;
    let used = allocation_counter::measure(|| {
        for _ in 0..100 {
            let _ = here.send(&sent);
            let deadline = there.now() + LONG;
            passed += there.receive(&mut buffer, deadline).unwrap_or(None).unwrap_or(0);
        }
        // Waiting in vain costs nothing either.
        let deadline = there.now() + Duration::from_micros(300);
        passed += there.receive(&mut buffer, deadline).unwrap_or(None).unwrap_or(0);
    });
    assert_eq!(passed, 100 * 360);
    assert_eq!(used.count_total, 0);
}
