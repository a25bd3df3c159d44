//! A scanner and an adapter in simulated time on a network that misbehaves, one fault at a time.
#![cfg(all(feature = "enip", feature = "sim"))]

#[path = "support/enip_robots.rs"]
mod enip_robots;

use core::net::{Ipv4Addr, SocketAddrV4};
use std::io;

use enip_robots::{Plc, RPI, Robots, WATCHDOG_CYCLES, robots};
use fieldarm::bus::enip::adapter::{AdapterEvent, AdapterSettings};
use fieldarm::bus::enip::scanner::{
    ConnectionSettings, ScannerEvent, T2oType, TargetCounters, Trouble,
};
use fieldarm::cycle::{CyclicSegment, InputQuality};
use fieldarm::link::enip::faulty_network::{Direction, FaultPlan, FaultyNetwork, NetworkFault};
use fieldarm::link::enip::network::{Arrival, Network};
use fieldarm::time::Instant;
use fieldarm::wire::enip::io::IoFrame;
use fieldarm::wire::enip::status::ExtendedStatus;
use fieldarm::wire::meca500::image::{INPUT_LEN, InputImage, RobotStatusFlags};
use fieldarm::wire::order::Little;

type Faulty = FaultyNetwork<Robots>;

const FRESH: InputQuality = InputQuality::Fresh;

fn stale(age_cycles: u32) -> InputQuality {
    InputQuality::Stale { age_cycles }
}

fn perfect() -> Faulty {
    FaultyNetwork::new(robots(1, AdapterSettings::meca500()), FaultPlan::NONE)
}

/// An owner whose inputs have been fresh for a while, and whose events were read.
fn running() -> Plc<Faulty> {
    let mut plc = Plc::owner(perfect());
    plc.until_fresh(3);
    assert_eq!(plc.cycles(50), [FRESH; 50]);
    scanner_events(&mut plc);
    adapter_events(&mut plc);
    plc
}

fn scanner_events(plc: &mut Plc<Faulty>) -> Vec<ScannerEvent> {
    core::iter::from_fn(|| plc.segment.poll_event()).collect()
}

fn adapter_events(plc: &mut Plc<Faulty>) -> Vec<AdapterEvent> {
    let robot = &mut plc.segment.network_mut().inner_mut().robots_mut()[0];
    core::iter::from_fn(|| robot.poll_event()).collect()
}

fn counters(plc: &Plc<Faulty>) -> TargetCounters {
    plc.segment.status(0).expect("there is a target").counters
}

#[test]
fn a_lost_input_frame_is_one_stale_cycle() {
    let mut plc = running();
    plc.segment.network_mut().inject(Direction::Received, NetworkFault::Drop);
    assert_eq!(plc.cycles(4), [stale(1), FRESH, FRESH, FRESH]);
    assert_eq!(counters(&plc).missed, 1);
    assert_eq!((counters(&plc).out_of_order, counters(&plc).opened), (0, 1));
    assert_eq!(scanner_events(&mut plc), []);
}

#[test]
fn a_doubled_input_frame_is_counted_and_changes_nothing() {
    let mut plc = running();
    plc.segment.network_mut().inject(Direction::Received, NetworkFault::Duplicate);
    assert_eq!(plc.cycles(4), [FRESH; 4]);
    assert_eq!((counters(&plc).out_of_order, counters(&plc).missed), (1, 0));
}

#[test]
fn an_overtaken_input_frame_is_thrown_away() {
    let mut plc = running();
    plc.segment.network_mut().inject(Direction::Received, NetworkFault::Reorder);
    assert_eq!(plc.cycles(4), [stale(1), FRESH, FRESH, FRESH]);
    assert_eq!(counters(&plc).out_of_order, 1);
}

#[test]
fn a_late_input_frame_is_taken_or_thrown_away_but_never_taken_for_a_later_one() {
    let mut plc = running();
    for _ in 0..200 {
        plc.segment.network_mut().inject(Direction::Received, NetworkFault::Delay);
        let qualities = plc.cycles(8);
        let bad = qualities.iter().filter(|quality| !quality.is_fresh()).count();
        assert!(bad <= 2, "{qualities:?}");
        assert_eq!(qualities[4..], [FRESH; 4]);
    }
    assert_eq!(counters(&plc).opened, 1);
}

#[test]
fn faults_of_output_frames_do_not_disturb_the_inputs() {
    let mut plc = running();
    let faults =
        [NetworkFault::Drop, NetworkFault::Duplicate, NetworkFault::Reorder, NetworkFault::Delay];
    for fault in faults {
        plc.segment.network_mut().inject(Direction::Sent, fault);
        assert_eq!(plc.cycles(10), [FRESH; 10], "{fault}");
        assert_eq!(plc.segment.network().last_fault(), Some(fault));
    }
    assert_eq!(adapter_events(&mut plc), []);
}

#[test]
fn a_tcp_connection_that_is_cut_does_not_end_the_frames() {
    let mut plc = running();
    plc.segment.network_mut().inject(Direction::Sent, NetworkFault::StreamDrop);
    assert_eq!(plc.cycles(500), [FRESH; 500]);
    assert_eq!(counters(&plc).opened, 1);
    let events = scanner_events(&mut plc);
    assert!(events.contains(&ScannerEvent::StreamLost { target: 0 }), "{events:?}");
    assert_eq!(adapter_events(&mut plc), []);
}

#[test]
fn silence_for_longer_than_the_watchdog_ends_the_connection_and_it_is_opened_again() {
    for direction in [Direction::Sent, Direction::Received] {
        let mut plc = running();
        let ids = plc.segment.status(0).map(|status| (status.o2t_id, status.t2o_id));
        plc.segment.network_mut().cut(direction, true);
        plc.cycles(4 * WATCHDOG_CYCLES);
        assert_eq!(plc.quality(0), InputQuality::Lost, "{direction:?}");
        let timed_out = |event: &ScannerEvent| {
            let ScannerEvent::Failed { target: 0, trouble, retry_in } = event else { return false };
            matches!(trouble, Trouble::TimedOut { after } if *after == 16 * RPI)
                && retry_in.is_some()
        };
        let events = scanner_events(&mut plc);
        assert!(events.iter().any(timed_out), "{direction:?}: {events:?}");
        plc.segment.network_mut().cut(direction, false);
        plc.until_fresh(1_000);
        assert_eq!(plc.cycles(100), [FRESH; 100]);
        let again = plc.segment.status(0).map(|status| (status.o2t_id, status.t2o_id));
        assert_ne!(again, ids, "the ids of the old connection");
        let closed = |event: &AdapterEvent| {
            matches!(event, AdapterEvent::TimedOut(_) | AdapterEvent::Closed(_))
        };
        let events = adapter_events(&mut plc);
        assert!(events.iter().any(closed), "{direction:?}: {events:?}");
        let robot = &plc.segment.network().inner().robots()[0];
        assert_eq!(robot.adapter().connections().count(), 1, "the old one is gone");
    }
}

#[test]
fn silence_just_shorter_than_the_watchdog_is_survived() {
    for direction in [Direction::Sent, Direction::Received] {
        let mut plc = running();
        plc.segment.network_mut().cut(direction, true);
        plc.cycles(WATCHDOG_CYCLES - 2);
        plc.segment.network_mut().cut(direction, false);
        plc.until_fresh(1);
        assert_eq!(plc.cycles(100), [FRESH; 100]);
        assert_eq!(counters(&plc).opened, 1);
        assert_eq!(adapter_events(&mut plc), []);
    }
}

#[test]
fn a_robot_that_loses_its_power_is_driven_again_once_it_has_booted() {
    for off_cycles in [1, 10, 300] {
        let mut plc = running();
        switch(&mut plc, false);
        plc.cycles(off_cycles);
        switch(&mut plc, true);
        plc.cycles(WATCHDOG_CYCLES);
        plc.until_fresh(1_500);
        assert_eq!(plc.cycles(100), [FRESH; 100]);
        assert_eq!(counters(&plc).opened, 2, "off for {off_cycles} cycles");
    }
}

fn switch(plc: &mut Plc<Faulty>, on: bool) {
    let robot = &mut plc.segment.network_mut().inner_mut().robots_mut()[0];
    let mut panel = robot.device_mut().panel();
    if on { panel.switch_on() } else { panel.switch_off() }
}

#[test]
fn a_robot_that_was_off_while_tcp_is_refused_is_driven_again() {
    let mut plc = running();
    plc.segment.network_mut().inject(Direction::Sent, NetworkFault::StreamRefuse);
    plc.cycle();
    switch(&mut plc, false);
    plc.cycles(50);
    switch(&mut plc, true);
    plc.until_fresh(2_000);
    assert_eq!(plc.cycles(100), [FRESH; 100]);
}

/// A scanner that starts again with the same seed gives its connection the numbers of the one before.
#[test]
fn the_same_triad_is_refused_until_the_robot_has_given_up_the_old_connection() {
    let (first, again, refused) = restart(1, 1);
    assert_eq!(refused, ExtendedStatus::IN_USE);
    assert!(again.saturating_duration_since(first) >= 15 * RPI, "{first:?} {again:?}");
}

#[test]
fn a_new_triad_finds_the_robot_owned_until_it_has_given_up_the_old_connection() {
    let (first, again, refused) = restart(1, 2);
    assert_eq!(refused, ExtendedStatus::OWNERSHIP_CONFLICT);
    assert!(again.saturating_duration_since(first) >= 15 * RPI, "{first:?} {again:?}");
}

/// Lets an owner die and starts another: when it died, when the new one ran, and what it was told in between.
fn restart(seed: u64, next_seed: u64) -> (Instant, Instant, ExtendedStatus) {
    let owner = [(0, ConnectionSettings::meca500())];
    let mut plc = Plc::start(perfect(), seed, &owner);
    plc.cycles(20);
    let network = plc.segment.abandon();
    let died = network.now();
    let mut plc = Plc::start(network, next_seed, &owner);
    let runs = plc.segment.network().now();
    let told = scanner_events(&mut plc).into_iter().find_map(|event| match event {
        ScannerEvent::Failed { trouble: Trouble::Refused { extended, .. }, .. } => extended,
        _ => None,
    });
    plc.until_fresh(3);
    assert_eq!(plc.cycles(50), [FRESH; 50]);
    (died, runs, told.expect("it was refused first"))
}

#[test]
fn a_scanner_that_closed_in_good_order_leaves_nothing_behind() {
    let owner = [(0, ConnectionSettings::meca500())];
    let mut plc = Plc::start(perfect(), 1, &owner);
    plc.cycles(20);
    let network = plc.segment.close();
    assert_eq!(network.inner().robots()[0].adapter().connections().count(), 0);
    let mut plc = Plc::start(network, 1, &owner);
    let events = scanner_events(&mut plc);
    assert!(!events.iter().any(|event| matches!(event, ScannerEvent::Failed { .. })), "{events:?}");
}

/// A network on which all sequence numbers are higher by some number.
struct Shifted {
    network: Robots,
    sequence: u32,
    data_sequence: u16,
}

impl Shifted {
    fn shift(&self, bytes: &mut [u8]) {
        // Read and written by the wire's own hand, so that nothing else changes.
        let Ok(frame) = IoFrame::read(bytes) else { return };
        let sequence = frame.sequence.wrapping_add(self.sequence);
        let data_sequence = frame.data_sequence.wrapping_add(self.data_sequence);
        let data = frame.data.to_vec();
        let frame = IoFrame { sequence, data_sequence, data: &data, ..frame };
        let mut room = [0; 512];
        let len = frame.write(None, &mut room).expect("there is room");
        bytes.copy_from_slice(&room[..len]);
    }
}

impl Network for Shifted {
    fn now(&self) -> Instant {
        self.network.now()
    }

    fn advance_to(&mut self, now: Instant) {
        self.network.advance_to(now);
    }

    fn receive(&mut self, room: &mut [u8], deadline: Instant) -> io::Result<Option<Arrival>> {
        let arrival = self.network.receive(room, deadline)?;
        if let Some(Arrival::Datagram { len, .. }) = arrival {
            self.shift(&mut room[..len]);
        }
        Ok(arrival)
    }

    fn connect(&mut self, target: usize, address: SocketAddrV4) -> io::Result<()> {
        self.network.connect(target, address)
    }

    fn send_stream(&mut self, target: usize, bytes: &[u8]) -> io::Result<()> {
        self.network.send_stream(target, bytes)
    }

    fn disconnect(&mut self, target: usize) {
        self.network.disconnect(target);
    }

    fn send_datagram(&mut self, to: SocketAddrV4, bytes: &[u8]) -> io::Result<()> {
        let mut bytes = bytes.to_vec();
        self.shift(&mut bytes);
        self.network.send_datagram(to, &bytes)
    }

    fn join_group(&mut self, group: Ipv4Addr) -> io::Result<()> {
        self.network.join_group(group)
    }

    fn leave_group(&mut self, group: Ipv4Addr) {
        self.network.leave_group(group);
    }
}

#[test]
fn sequence_numbers_wrap_in_both_directions_without_a_gap() {
    let network = Shifted {
        network: robots(1, AdapterSettings::meca500()),
        sequence: u32::MAX - 500,
        data_sequence: u16::MAX - 700,
    };
    let mut plc = Plc::owner(network);
    plc.until_fresh(3);
    assert_eq!(plc.cycles(2_000), [FRESH; 2_000]);
    let counters = plc.segment.status(0).expect("there is a target").counters;
    assert_eq!((counters.missed, counters.out_of_order, counters.opened), (0, 0, 1));
    let robot = &mut plc.segment.network_mut().network.robots_mut()[0];
    assert!(robot.adapter().owner().is_some_and(|owner| owner.is_running));
    let lost = |event: &AdapterEvent| matches!(event, AdapterEvent::TimedOut(_));
    assert!(!core::iter::from_fn(|| robot.poll_event()).any(|event| lost(&event)));
}

#[test]
fn only_a_connection_that_monitors_is_told_so() {
    for t2o_type in [T2oType::Unicast, T2oType::Multicast] {
        let owner = ConnectionSettings { t2o_type, ..ConnectionSettings::meca500() };
        let monitor = ConnectionSettings::meca500().input_only();
        let mut plc = Plc::start(perfect(), 1, &[(0, owner), (0, monitor)]);
        plc.cycles(10);
        for (target, is_monitoring) in [(0, false), (1, true)] {
            let mut inputs = [0; INPUT_LEN];
            assert_eq!(plc.segment.read_inputs(target, &mut inputs), FRESH);
            let image = InputImage::<Little>::from_bytes(&inputs).expect("252 bytes");
            let flags = image.robot_status.flags;
            assert_eq!(flags.contains(RobotStatusFlags::MONITORING_MODE), is_monitoring);
            assert_eq!(image.motion_status.fifo_space.get(), 13_000);
        }
    }
}

#[test]
fn a_listener_hears_as_long_as_somebody_else_does() {
    let owner =
        ConnectionSettings { t2o_type: T2oType::Multicast, ..ConnectionSettings::meca500() };
    let listener = ConnectionSettings::meca500().listen_only();
    let mut plc = Plc::start(perfect(), 1, &[(0, owner), (0, listener)]);
    plc.cycles(20);
    assert_eq!((plc.quality(0), plc.quality(1)), (FRESH, FRESH));
    assert_eq!(plc.segment.network().inner().robots()[0].adapter().connections().count(), 2);
}

/// A network that can lose the frames of owners, and those only.
struct Deaf {
    network: Robots,
    loses_outputs: bool,
}

impl Network for Deaf {
    fn now(&self) -> Instant {
        self.network.now()
    }

    fn advance_to(&mut self, now: Instant) {
        self.network.advance_to(now);
    }

    fn receive(&mut self, room: &mut [u8], deadline: Instant) -> io::Result<Option<Arrival>> {
        self.network.receive(room, deadline)
    }

    fn connect(&mut self, target: usize, address: SocketAddrV4) -> io::Result<()> {
        self.network.connect(target, address)
    }

    fn send_stream(&mut self, target: usize, bytes: &[u8]) -> io::Result<()> {
        self.network.send_stream(target, bytes)
    }

    fn disconnect(&mut self, target: usize) {
        self.network.disconnect(target);
    }

    fn send_datagram(&mut self, to: SocketAddrV4, bytes: &[u8]) -> io::Result<()> {
        let carries_outputs = IoFrame::read(bytes).is_ok_and(|frame| !frame.data.is_empty());
        if self.loses_outputs && carries_outputs {
            return Ok(());
        }
        self.network.send_datagram(to, bytes)
    }

    fn join_group(&mut self, group: Ipv4Addr) -> io::Result<()> {
        self.network.join_group(group)
    }

    fn leave_group(&mut self, group: Ipv4Addr) {
        self.network.leave_group(group);
    }
}

#[test]
fn an_owner_whose_outputs_get_lost_while_others_keep_its_group_is_opened_again() {
    let owner =
        ConnectionSettings { t2o_type: T2oType::Multicast, ..ConnectionSettings::meca500() };
    let network = Deaf { network: robots(1, AdapterSettings::meca500()), loses_outputs: false };
    let mut plc = Plc::start(network, 1, &[(0, owner), (0, owner.input_only())]);
    plc.cycles(50);
    let owns =
        |plc: &Plc<Deaf>| plc.segment.network().network.robots()[0].adapter().owner().is_some();
    assert!(owns(&plc));
    plc.segment.network_mut().loses_outputs = true;
    // The robot gives up after one watchdog, the scanner one later.
    plc.cycles(3 * WATCHDOG_CYCLES);
    let lost = core::iter::from_fn(|| plc.segment.poll_event()).any(|event| {
        matches!(
            event,
            ScannerEvent::Failed { target: 0, trouble: Trouble::ControlLost { .. }, .. }
        )
    });
    assert!(lost);
    plc.segment.network_mut().loses_outputs = false;
    plc.cycles(500);
    plc.until_fresh(3);
    assert!(owns(&plc), "it is the owner again");
    let mut inputs = [0; INPUT_LEN];
    assert_eq!(plc.segment.read_inputs(0, &mut inputs), FRESH);
    let image = InputImage::<Little>::from_bytes(&inputs).expect("252 bytes");
    assert!(!image.robot_status.flags.contains(RobotStatusFlags::MONITORING_MODE));
    assert_eq!(
        plc.segment.status(1).expect("it watches").counters.opened,
        1,
        "the other one stays"
    );
}
