use std::collections::VecDeque;

use super::*;

/// Returns what is sent; waiting moves its clock.
#[derive(Default)]
struct Echo {
    now: Instant,
    frames: VecDeque<Vec<u8>>,
}

impl Wire for Echo {
    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        self.frames.push_back(frame.to_vec());
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Instant) -> io::Result<Option<usize>> {
        let Some(frame) = self.frames.pop_front() else {
            self.now = self.now.max(deadline);
            return Ok(None);
        };
        buffer[..frame.len()].copy_from_slice(&frame);
        Ok(Some(frame.len()))
    }

    fn now(&self) -> Instant {
        self.now
    }

    fn pause_until(&mut self, deadline: Instant) {
        self.now = self.now.max(deadline);
    }
}

/// Two datagrams: BRD of 1 byte and LRW of 4, told apart by `index`.
fn frame(index: u8) -> Vec<u8> {
    let mut frame = vec![0xFF; 12];
    frame.extend([0x88, 0xA4, 13 + 16, 0x10]);
    frame.extend([7, index, 0, 0, 0x30, 0x01, 1, 0x80, 0, 0, 0xAA, 1, 0]);
    frame.extend([12, index, 0, 0, 0, 0, 4, 0, 0, 0, 1, 2, 3, 4, 3, 0]);
    frame
}

fn wire(plan: FaultPlan) -> FaultyWire<Echo> {
    FaultyWire::new(Echo::default(), WireEnd::MainDevice, plan)
}

fn receive(wire: &mut FaultyWire<Echo>, wait_ms: u64) -> Option<Vec<u8>> {
    let deadline = wire.now() + Duration::from_millis(wait_ms);
    let mut buffer = [0; MAX_FRAME];
    let length = wire.receive(&mut buffer, deadline).expect("the link is up")?;
    Some(buffer[..length].to_vec())
}

/// What comes back of one frame sent while the first frame meets `fault`.
fn after(fault: WireFault) -> FaultyWire<Echo> {
    let mut wire = wire(FaultPlan::NONE);
    wire.inject(fault);
    wire.send(&frame(1)).expect("sent");
    assert_eq!((wire.faults_made(), wire.last_fault()), (1, Some(fault)));
    wire
}

#[test]
fn a_perfect_wire_returns_what_was_sent() {
    let mut wire = wire(FaultPlan::NONE);
    for index in 0..200 {
        wire.send(&frame(index)).expect("sent");
        assert_eq!(receive(&mut wire, 1), Some(frame(index)));
    }
    assert_eq!((wire.faults_made(), wire.is_quiet()), (0, true));
}

#[test]
fn a_dropped_frame_is_gone_and_a_doubled_one_comes_twice() {
    let mut dropped = after(WireFault::Drop);
    assert_eq!(receive(&mut dropped, 1_000), None);
    let mut doubled = after(WireFault::Duplicate);
    assert_eq!(receive(&mut doubled, 0), Some(frame(1)));
    assert_eq!(receive(&mut doubled, 0), Some(frame(1)));
    assert_eq!(receive(&mut doubled, 1_000), None);
}

#[test]
fn a_fault_of_what_is_received_leaves_what_is_sent_alone() {
    let mut wire = FaultyWire::new(Echo::default(), WireEnd::MainDevice, FaultPlan::NONE);
    wire.inject_received(WireFault::Drop);
    wire.send(&frame(1)).unwrap();
    assert_eq!((wire.faults_made(), wire.inner().frames.len()), (0, 1));
    assert_eq!(receive(&mut wire, 1_000), None);
    assert_eq!(wire.faults_made(), 1);
}

#[test]
fn a_delayed_frame_comes_by_time_alone() {
    let mut wire = after(WireFault::Delay);
    assert_eq!(receive(&mut wire, 0), None);
    assert!(!wire.is_quiet());
    assert_eq!(receive(&mut wire, 1_000), Some(frame(1)));
    assert!(wire.now() > Instant::ZERO && wire.now() <= Instant::ZERO + LONGEST_DELAY);
    assert!(wire.is_quiet());
}

#[test]
fn an_overtaken_frame_comes_behind_the_next_or_after_a_while() {
    let mut wire = after(WireFault::Reorder);
    wire.send(&frame(2)).expect("sent");
    assert_eq!(receive(&mut wire, 0), Some(frame(2)));
    assert_eq!(receive(&mut wire, 0), Some(frame(1)));
    let mut alone = after(WireFault::Reorder);
    assert_eq!(receive(&mut alone, 100), Some(frame(1)));
    assert_eq!(alone.now(), Instant::ZERO + LONGEST_REORDER);
}

#[test]
fn received_frames_meet_faults_too() {
    let mut wire = wire(FaultPlan::NONE);
    wire.send(&frame(1)).expect("sent");
    wire.send(&frame(2)).expect("sent");
    wire.inject(WireFault::Reorder);
    assert_eq!(receive(&mut wire, 0), Some(frame(2)));
    assert_eq!(receive(&mut wire, 0), Some(frame(1)));
}

#[test]
fn a_truncated_frame_keeps_its_ethernet_header() {
    for _ in 0..50 {
        let mut wire = after(WireFault::Truncate);
        let short = receive(&mut wire, 0).expect("it comes");
        assert!((ETHERNET_HEADER..frame(1).len()).contains(&short.len()));
        assert_eq!(short, frame(1)[..short.len()]);
    }
}

#[test]
fn a_link_down_is_told_once_and_ends_by_itself() {
    let mut wire = after(WireFault::LinkDown);
    let mut buffer = [0; MAX_FRAME];
    let error = wire.receive(&mut buffer, Instant::from_millis(1)).unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::NetworkDown);
    assert_eq!(wire.send(&frame(2)).unwrap_err().kind(), io::ErrorKind::NetworkDown);
    assert_eq!(receive(&mut wire, 10), None);
    assert_eq!(receive(&mut wire, 1_000), None);
    wire.send(&frame(3)).expect("the link is up");
    assert_eq!(receive(&mut wire, 0), Some(frame(3)));
}

#[test]
fn a_power_cycle_is_said_once() {
    let mut wire = after(WireFault::PowerCycle);
    assert!(wire.take_power_cycle());
    assert!(!wire.take_power_cycle());
    assert_eq!(receive(&mut wire, 10), None);
}

/// Which bytes differ between `frame(1)` and what 2,000 corruptions made of it.
fn corrupted_places(goes_back: bool) -> Vec<usize> {
    let mut random = fastrand::Rng::with_seed(7);
    let mut places = Vec::new();
    for _ in 0..2_000 {
        let mut bytes = frame(1);
        corrupt(&mut random, &mut bytes, goes_back);
        assert_ne!(bytes, frame(1), "a corruption changes something");
        places.extend((0..bytes.len()).filter(|at| bytes[*at] != frame(1)[*at]));
    }
    places.sort_unstable();
    places.dedup();
    places
}

#[test]
fn corruption_hits_what_the_receiver_can_notice() {
    // EtherType, length and protocol type, and the length of either datagram.
    assert_eq!(corrupted_places(false), [12, 13, 14, 15, 22, 23, 35, 36]);
    // Beside them command, index, 16 bits of address and the working counter of both.
    assert_eq!(
        corrupted_places(true),
        [12, 13, 14, 15, 16, 17, 18, 19, 22, 23, 27, 28, 29, 30, 31, 32, 35, 36, 43, 44]
    );
}

#[test]
fn a_frame_without_datagrams_is_corrupted_in_its_header() {
    let mut random = fastrand::Rng::with_seed(7);
    for length in 0..frame(1).len() {
        let mut bytes = frame(1)[..length].to_vec();
        corrupt(&mut random, &mut bytes, true);
        assert_eq!(bytes.len(), length);
    }
}

fn run(seed: u64, limit: Option<u32>) -> (Vec<Option<Vec<u8>>>, Vec<WireFault>) {
    let chances = WireFault::ALL.iter().map(|fault| (*fault, 20)).collect();
    let mut wire = wire(FaultPlan { chances, seed, limit });
    let mut faults = Vec::new();
    let came = (0..2_000u32)
        .map(|index| {
            let made = wire.faults_made();
            let _ = wire.send(&frame(index as u8));
            let deadline = wire.now() + Duration::from_millis(1);
            let mut buffer = [0; MAX_FRAME];
            let received = wire.receive(&mut buffer, deadline).ok().flatten();
            if wire.faults_made() > made {
                faults.extend(wire.last_fault());
            }
            received.map(|length| buffer[..length].to_vec())
        })
        .collect();
    (came, faults)
}

#[test]
fn the_same_seed_gives_the_same_faults() {
    assert_eq!(run(3, None), run(3, None));
    assert_ne!(run(3, None).1, run(4, None).1);
    for fault in WireFault::ALL {
        assert!(run(3, None).1.contains(fault), "{fault}");
    }
}

#[test]
fn after_the_last_fault_of_a_plan_the_wire_is_perfect() {
    let (came, faults) = run(3, Some(10));
    assert!((5..=10).contains(&faults.len()), "{faults:?}");
    assert!(came.iter().rev().take(500).all(Option::is_some));
}

#[test]
fn more_frames_than_can_be_held_pass() {
    let plan = FaultPlan { chances: vec![(WireFault::Delay, 1000)], seed: 1, limit: None };
    let mut wire = wire(plan);
    for index in 0..100 {
        wire.send(&frame(index)).expect("sent");
    }
    assert_eq!(wire.inner().frames.len(), 100 - HELD_FRAMES);
}

#[test]
fn every_fault_has_a_name_of_its_own() {
    for fault in WireFault::ALL {
        assert_eq!(WireFault::from_name(fault.name()), Some(*fault));
    }
    assert_eq!(WireFault::from_name("melt"), None);
}
