//! A segment on real sockets against a target written by hand: its start, exchanges and end, and what it
//! says when a target does not do what it should.
#![cfg(all(feature = "enip", target_os = "linux"))]

#[path = "support/enip_target.rs"]
mod enip_target;
#[path = "support/loopback.rs"]
mod loopback;

use std::net::SocketAddrV4;

use enip_target::{Script, Target};
use fieldarm::bus::enip::scanner::{ConnectionSettings, Originator, ScannerEvent, Trouble};
use fieldarm::cycle::{CyclicSegment, InputQuality};
use fieldarm::link::clock::MonotonicClock;
use fieldarm::link::enip::network::Network;
use fieldarm::link::enip::sockets::{SocketNetwork, SocketSettings};
use fieldarm::link::enip::{EnipError, EnipSegment, EnipSettings, StartFailure, TargetSettings};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::enip::status::ExtendedStatus;
use loopback::address;

const CYCLE: Duration = Duration::from_millis(10);

fn settings(targets: &[SocketAddrV4], start_limit: Duration) -> EnipSettings {
    let connection = ConnectionSettings::meca500().with_rpi(CYCLE);
    let target = |address: &SocketAddrV4| TargetSettings { address: *address, connection };
    EnipSettings {
        targets: targets.iter().map(target).collect(),
        originator: Originator { vendor: 0x1234, serial: std::process::id() },
        seed: 7,
        cycle: CYCLE,
        start_limit,
    }
}

fn network() -> SocketNetwork {
    let settings = SocketSettings { bind: Some(address()), ..SocketSettings::default() };
    SocketNetwork::open(settings, &[]).unwrap()
}

type Started = Result<EnipSegment<SocketNetwork>, Box<StartFailure<SocketNetwork>>>;

fn start(targets: &[SocketAddrV4], limit_ms: u64) -> Started {
    let settings = settings(targets, Duration::from_millis(limit_ms));
    EnipSegment::start(network(), settings).map_err(Box::new)
}

fn started(target: &Target) -> EnipSegment<SocketNetwork> {
    start(&[target.address], 20_000).unwrap_or_else(|failure| panic!("{}", failure.error))
}

fn error(started: Started) -> EnipError {
    started.err().map(|failure| failure.error).expect("it cannot start")
}

/// Exchanges at the beat of the settings until `is_done`; too many fail.
fn exchange_until(
    segment: &mut EnipSegment<SocketNetwork>,
    mut is_done: impl FnMut(&mut EnipSegment<SocketNetwork>) -> bool,
) {
    let clock = MonotonicClock::new();
    let mut due = clock.now();
    for _ in 0..1_000 {
        segment.exchange(due).unwrap();
        if is_done(segment) {
            return;
        }
        due += CYCLE;
        clock.sleep_until(due);
    }
    panic!("it did not happen in 1000 cycles");
}

fn inputs(segment: &EnipSegment<SocketNetwork>) -> (InputQuality, [u8; 252]) {
    let mut inputs = [0; 252];
    (segment.read_inputs(0, &mut inputs), inputs)
}

#[test]
fn images_pass_both_ways_and_the_end_is_told() {
    let target = Target::start(address(), Script::default());
    target.set_input(&[0x11; 252]);
    let mut segment = started(&target);
    assert_eq!((segment.robot_count(), segment.cycle()), (1, CYCLE));
    let mut events = Vec::new();
    while let Some(event) = segment.poll_event() {
        events.push(event);
    }
    assert!(
        matches!(
            events[..],
            [ScannerEvent::Opened { target: 0, .. }, ScannerEvent::Running { target: 0 }]
        ),
        "{events:?}"
    );
    exchange_until(&mut segment, |segment| inputs(segment) == (InputQuality::Fresh, [0x11; 252]));
    assert!(target.seen().frames.iter().all(|(run, image)| *run && image == &[0; 60]));

    let outputs: [u8; 60] = std::array::from_fn(|index| index as u8 + 1);
    segment.write_outputs(0, &outputs);
    segment.write_outputs(0, &outputs[1..]);
    segment.write_outputs(1, &outputs);
    exchange_until(&mut segment, |_| {
        target.seen().frames.last() == Some(&(true, outputs.to_vec()))
    });
    target.set_input(&std::array::from_fn::<u8, 252, _>(|index| index as u8));
    exchange_until(&mut segment, |segment| {
        inputs(segment) == (InputQuality::Fresh, std::array::from_fn(|index| index as u8))
    });
    assert_eq!(segment.read_inputs(0, &mut [0; 251]), InputQuality::Lost);
    assert_eq!(segment.read_inputs(1, &mut [0; 252]), InputQuality::Lost);

    let counters = segment.status(0).unwrap().counters;
    let statistics = segment.statistics();
    assert!(statistics.exchanges > 0 && statistics.unsent == 0 && statistics.unjoined == 0);
    assert!(!statistics.o2t_gap_ns.is_empty() && statistics.o2t_gap_ns.len() < counters.produced);
    assert!(!statistics.t2o_gap_ns.is_empty() && statistics.t2o_gap_ns.len() < counters.consumed);
    assert_eq!(statistics.exchange_ns.len(), statistics.exchanges);

    let before = target.seen();
    assert_eq!((before.opened, before.closed), (1, 0));
    drop(segment.close());
    let after = target.seen();
    assert_eq!((after.opened, after.closed), (1, 1));
    assert_eq!(after.frames.last(), Some(&(false, vec![0; 60])), "zeros and idle come last");
}

#[test]
fn the_clock_of_the_caller_may_be_any() {
    let target = Target::start(address(), Script::default());
    target.set_input(&[9; 252]);
    let mut segment = started(&target);
    // One ahead of the network's, then one behind, and one that stands still.
    for origin in [Instant::from_millis(86_400_000_000), Instant::ZERO] {
        let (clock, mut fresh) = (MonotonicClock::new(), 0);
        for cycle in 0..300_u32 {
            segment.exchange(origin + CYCLE * cycle).unwrap();
            fresh += u32::from(inputs(&segment).0.is_fresh());
            if fresh == 10 {
                break;
            }
            clock.sleep_until(Instant::ZERO + CYCLE * (cycle + 1));
        }
        assert_eq!(fresh, 10, "from {origin:?}");
    }
    assert!(segment.status(0).unwrap().is_open);
}

#[test]
fn the_interval_that_the_target_grants_is_the_beat() {
    let script = Script { apis_us: Some((40_000, 20_000)), ..Script::default() };
    let target = Target::start(address(), script);
    let segment = started(&target);
    assert_eq!(segment.cycle(), Duration::from_millis(20));
    let status = segment.status(0).unwrap();
    assert_eq!(status.o2t_api, Duration::from_millis(40));
    drop(segment.close());
}

#[test]
fn frames_go_on_when_the_target_closes_the_stream() {
    let target = Target::start(address(), Script { hangs_up: true, ..Script::default() });
    let mut segment = started(&target);
    let before = segment.status(0).unwrap().counters;
    exchange_until(&mut segment, |segment| {
        segment.status(0).unwrap().counters.consumed > before.consumed + 40
    });
    let after = segment.status(0).unwrap().counters;
    assert_eq!((after.opened, after.timed_out), (1, 0));
}

#[test]
fn a_target_that_does_not_listen_is_named() {
    let nobody = SocketAddrV4::new(address(), 44_818);
    let error = error(start(&[nobody], 300));
    assert_eq!(
        error,
        EnipError::Target { target: 0, address: nobody, trouble: Trouble::Unreachable }
    );
    assert!(error.is_transient());
    assert!(error.to_string().contains(&nobody.to_string()), "{error}");
}

#[test]
fn a_refusal_that_time_does_not_mend_ends_the_start_at_once() {
    let target = Target::start(address(), Script { refuses: Some(0x0115), ..Script::default() });
    // An hour: it must not be waited for.
    let error = error(start(&[target.address], 3_600_000));
    let EnipError::Target { trouble: Trouble::Refused { extended, .. }, .. } = error else {
        panic!("{error}");
    };
    assert_eq!(extended, Some(ExtendedStatus::DEVICE_TYPE_MISMATCH));
    assert!(!error.is_transient());
}

#[test]
fn another_owner_is_waited_for_and_then_named() {
    let target = Target::start(address(), Script { refuses: Some(0x0106), ..Script::default() });
    let error = error(start(&[target.address], 600));
    let EnipError::Target { target: 0, trouble: Trouble::Refused { extended, .. }, .. } = error
    else {
        panic!("{error}");
    };
    assert_eq!(extended, Some(ExtendedStatus::OWNERSHIP_CONFLICT));
    assert!(error.is_transient());
    assert!(error.to_string().contains("somebody else controls the robot"), "{error}");
}

#[test]
fn a_target_whose_frames_do_not_arrive_is_named_with_the_port() {
    let target = Target::start(address(), Script { is_mute: true, ..Script::default() });
    let error = error(start(&[target.address], 600));
    assert_eq!(error, EnipError::NoFrames { target: 0, address: target.address, port: 2_222 });
    assert!(error.to_string().contains("UDP port 2222"), "{error}");
}

#[test]
fn of_several_targets_the_one_with_most_to_say_is_named_and_the_others_are_closed() {
    let well = Target::start(address(), Script::default());
    let nobody = SocketAddrV4::new(address(), 44_818);
    let owned = Target::start(address(), Script { refuses: Some(0x0106), ..Script::default() });
    let failure = start(&[well.address, nobody, owned.address], 800).err().unwrap();
    assert_eq!(failure.error.target(), Some(2), "{}", failure.error);
    assert_eq!((well.seen().opened, well.seen().closed), (1, 1));
    // The network can be used again.
    let settings = settings(&[well.address], Duration::from_secs(20));
    let segment = EnipSegment::start(failure.network, settings);
    let segment = segment.unwrap_or_else(|failure| panic!("{}", failure.error));
    drop(segment.close());
    assert_eq!((well.seen().opened, well.seen().closed), (2, 2));
}

#[test]
fn whoever_is_abandoned_is_not_told() {
    let target = Target::start(address(), Script::default());
    let network = started(&target).abandon();
    let clock = MonotonicClock::new();
    for _ in 0..1_000 {
        if target.seen().ended > 0 {
            break;
        }
        clock.sleep_until(clock.now() + Duration::from_millis(5));
    }
    assert_eq!((target.seen().ended, target.seen().closed), (1, 0));
    drop(network);
}

#[test]
fn another_port_than_the_usual_is_told_to_the_target() {
    let target = Target::start(address(), Script::default());
    target.set_input(&[5; 252]);
    let bind = address();
    let sockets = SocketSettings { bind: Some(bind), ..SocketSettings::default() };
    let first = SocketNetwork::open(sockets, &[]).unwrap();
    let second = SocketNetwork::open(sockets, &[]).unwrap();
    assert_ne!(second.io_port(), first.io_port());
    let settings = settings(&[target.address], Duration::from_secs(20));
    let mut segment =
        EnipSegment::start(second, settings).unwrap_or_else(|failure| panic!("{}", failure.error));
    exchange_until(&mut segment, |segment| inputs(segment) == (InputQuality::Fresh, [5; 252]));
}

#[test]
fn exchanges_take_no_memory() {
    let target = Target::start(address(), Script::default());
    let mut segment = started(&target);
    exchange_until(&mut segment, |segment| inputs(segment).0.is_fresh());
    let (clock, mut fresh) = (MonotonicClock::new(), 0);
    let taken = allocation_counter::measure(|| {
        for cycle in 0..100_u32 {
            clock.sleep_until(Instant::ZERO + CYCLE * cycle);
            segment.write_outputs(0, &[cycle as u8; 60]);
            segment.exchange(clock.now()).unwrap();
            fresh += u32::from(inputs(&segment).0.is_fresh());
        }
    });
    assert_eq!(taken.count_total, 0);
    assert!(fresh > 20, "{fresh} of 100 cycles had new inputs");
}

#[test]
fn settings_that_cannot_be_are_refused_in_words() {
    let somebody = SocketAddrV4::new(address(), 44_818);
    let good = settings(&[somebody], Duration::from_secs(1));
    let refused = |change: fn(&mut EnipSettings)| {
        let mut settings = good.clone();
        change(&mut settings);
        error(EnipSegment::start(network(), settings).map_err(Box::new))
    };
    assert_eq!(refused(|settings| settings.targets.clear()), EnipError::NoTarget);
    let many = refused(|settings| {
        let one = settings.targets[0].clone();
        settings.targets = vec![one; 300];
    });
    assert_eq!(many, EnipError::TooManyTargets { wanted: 300 });
    let zero = refused(|settings| settings.cycle = Duration::ZERO);
    assert!(matches!(zero, EnipError::Settings(words) if words.contains("cycle")), "{zero}");
    let never = refused(|settings| settings.start_limit = Duration::ZERO);
    assert!(matches!(never, EnipError::Settings(words) if words.contains("start")), "{never}");
    let long = refused(|settings| settings.targets[0].connection.t2o_len = 60_000);
    assert!(matches!(long, EnipError::Connection { target: 0, .. }), "{long}");
    for error in [many, zero, never, long] {
        assert!(!error.is_transient());
    }
}
