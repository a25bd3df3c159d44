//! Both roles of EtherNet/IP among peers that lie, stop in the middle, or talk nonsense. Nothing panics,
//! everything stays within its bounds, and what the role says of itself stays consistent.

mod adapter;
mod choices;
mod messages;
mod scanner;

use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::Duration;

use choices::{Choices, spoil};

fn random(seed: u64, len: usize) -> Vec<u8> {
    let mut random = fastrand::Rng::with_seed(seed);
    std::iter::repeat_with(|| random.u8(..)).take(len).collect()
}

#[test]
fn adapter_among_anybody() {
    let mut sums = [0; 4];
    for seed in 0..300 {
        let mut surrounded = adapter::Surrounded::new();
        surrounded.obey(&random(seed, 12_000));
        sums = std::array::from_fn(|index| sums[index] + surrounded.counts[index]);
    }
    assert!(sums.iter().all(|sum| *sum > 300), "hardly anything was reached: {sums:?}");
}

#[test]
fn scanner_among_anybody() {
    let mut sums = [0; 4];
    for seed in 0..300 {
        let mut surrounded = scanner::Surrounded::new();
        // Alone it takes long until all three are open; half of the runs begin there.
        for index in 0..3 * (seed as usize % 2) {
            surrounded.open(index);
        }
        surrounded.obey(&random(seed, 8_000));
        sums = std::array::from_fn(|index| sums[index] + surrounded.counts[index]);
    }
    assert!(sums.iter().all(|sum| *sum > 300), "hardly anything was reached: {sums:?}");
}

/// Bytes of a good request, split at every point: the adapter answers as if they had come at once.
#[test]
fn adapter_with_every_split() {
    for seed in 0..40 {
        let choices = random(seed, 200);
        let register = messages::request(0, &mut Choices::new(&[0, 0]));
        let whole = |split: Option<usize>| {
            let mut surrounded = adapter::Surrounded::new();
            surrounded.accept(&mut Choices::new(&[]));
            surrounded.stream_bytes(0, &register);
            let session = surrounded.session(0);
            assert_ne!(session, 0);
            let message = messages::request(session, &mut Choices::new(&choices));
            let split = split.unwrap_or(message.len()).min(message.len());
            surrounded.stream_bytes(0, &message[..split]);
            surrounded.stream_bytes(0, &message[split..]);
            let summary =
                (surrounded.counts, surrounded.stream_count(), surrounded.connection_count());
            (summary, message.len())
        };
        let (expected, len) = whole(None);
        for split in 0..len {
            assert_eq!(whole(Some(split)).0, expected, "seed {seed}, split at {split}");
        }
    }
}

/// Answers of a good target, split at every point: the connection opens all the same.
#[test]
fn scanner_with_every_split() {
    for split in 0..120 {
        let mut surrounded = scanner::Surrounded::new();
        for _ in 0..20 {
            if surrounded.is_asked_for(0) {
                surrounded.connect(0);
            }
            let Some(answer) = surrounded.answer(0, &mut Choices::new(&[])) else { continue };
            let split = split.min(answer.len());
            surrounded.stream_bytes(0, &answer[..split]);
            surrounded.stream_bytes(0, &answer[split..]);
        }
        assert!(surrounded.is_open(0), "split at {split}");
    }
}

/// Megabytes of nonsense on a stream, in pieces of any size: the adapter closes it or passes it over, and
/// serves the next one.
#[test]
fn adapter_in_garbage() {
    let garbage = random(3, 4 << 20);
    let mut surrounded = adapter::Surrounded::new();
    let mut rest = garbage.as_slice();
    let mut piece = 1;
    while !rest.is_empty() {
        if surrounded.stream_count() == 0 {
            surrounded.accept(&mut Choices::new(&[]));
        }
        let (part, behind) = rest.split_at(piece.min(rest.len()));
        surrounded.stream_bytes(0, part);
        rest = behind;
        piece = piece * 7 % 65_521;
    }
    surrounded.pass(Duration::from_secs(3_600));
    let index = surrounded.stream_count();
    surrounded.accept(&mut Choices::new(&[]));
    surrounded.stream_bytes(index, &messages::request(0, &mut Choices::new(&[0, 0])));
    assert_ne!(surrounded.session(index), 0, "it does not serve any more");
}

/// Megabytes of nonsense from a target while another's connection is open; the bad one opens afterwards.
#[test]
fn scanner_in_garbage() {
    let garbage = random(4, 4 << 20);
    let mut surrounded = scanner::Surrounded::new();
    surrounded.open(0);
    assert!(surrounded.is_open(0));
    let mut piece = 1;
    let mut rest = garbage.as_slice();
    let from = SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 1), 2_222);
    while !rest.is_empty() {
        let (part, behind) = rest.split_at(piece.min(rest.len()));
        if surrounded.is_asked_for(1) {
            surrounded.connect(1);
        }
        surrounded.stream_bytes(1, part);
        surrounded.datagram(from, part);
        rest = behind;
        piece = piece * 7 % 65_521;
    }
    assert!(surrounded.is_open(0), "garbage ended the connection of another target");
    for _ in 0..100 {
        surrounded.pass(Duration::from_secs(6));
        surrounded.open(1);
        if surrounded.is_open(1) {
            return;
        }
    }
    panic!("the target does not open any more: connected {}", surrounded.is_connected(1));
}

/// Good messages, each spoiled in many ways, one after the other on streams of their own.
#[test]
fn adapter_with_spoiled_messages() {
    for seed in 0..3_000 {
        let bytes = random(seed, 300);
        let mut choices = Choices::new(&bytes);
        let mut surrounded = adapter::Surrounded::new();
        surrounded.accept(&mut Choices::new(&[]));
        surrounded.stream_bytes(0, &messages::request(0, &mut Choices::new(&[0, 0])));
        let mut message = messages::request(surrounded.session(0), &mut choices);
        spoil(&mut message, &mut choices);
        surrounded.stream_bytes(0, &message);
        surrounded.pass(Duration::from_millis(15));
        surrounded.pass(Duration::from_secs(30_000));
    }
}
