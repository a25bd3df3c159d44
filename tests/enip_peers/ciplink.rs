//! `ciplink`'s adapter, set up as the robot: owner, input-only and listen-only connections, unicast and
//! multicast, images by value, both watchdogs, a restart.

use std::net::{Ipv4Addr, SocketAddrV4};

use ciplink::adapter::{Adapter, AdapterConfig, AdapterIdentity, Assembly, ConnectionKind, Event};
use fieldarm::bus::enip::scanner::{
    ConfigPath, ConnectionSettings, Originator, ScannerEvent, T2oType, Trouble,
};
use fieldarm::cycle::{CyclicSegment, InputQuality};
use fieldarm::link::clock::MonotonicClock;
use fieldarm::link::enip::explicit::{ExplicitClient, ExplicitError};
use fieldarm::link::enip::list_identity::list_identity;
use fieldarm::link::enip::sockets::{SocketNetwork, SocketSettings};
use fieldarm::link::enip::{EnipError, EnipSegment, EnipSettings, TargetSettings};
use fieldarm::time::Duration;
use fieldarm::wire::enip::parameters::TimeoutMultiplier;
use fieldarm::wire::enip::path::{ElectronicKey, ObjectPath};
use fieldarm::wire::enip::status::{ExtendedStatus, GeneralStatus};

use crate::loopback::address;

const CYCLE: Duration = Duration::from_millis(10);
const PATIENCE: Duration = Duration::from_secs(20);

type Segment = EnipSegment<SocketNetwork>;

fn robot(at: Ipv4Addr) -> Adapter {
    Adapter::start(AdapterConfig {
        identity: AdapterIdentity {
            vendor_id: 1_565,
            device_type: 43,
            product_code: 500,
            revision: (11, 3),
            serial: 0x00C0_FFEE,
            product_name: "Meca500".into(),
        },
        assemblies: vec![
            Assembly::input(100, 252),
            Assembly::output(150, 60),
            Assembly::config(151, 0),
        ],
        bind: at,
        ..AdapterConfig::default()
    })
    .unwrap()
}

/// The robot's connection; its watchdog bears a busy machine.
fn owner() -> ConnectionSettings {
    let multiplier = TimeoutMultiplier::from_factor(32).unwrap();
    ConnectionSettings { multiplier, ..ConnectionSettings::meca500().with_rpi(CYCLE) }
}

fn try_start(
    at: Ipv4Addr,
    connection: ConnectionSettings,
    start_limit: Duration,
) -> Result<Segment, EnipError> {
    let bind = address();
    let settings = SocketSettings { bind: Some(bind), ..SocketSettings::default() };
    let network = SocketNetwork::open(settings, &[]).unwrap();
    let [_, b, c, d] = bind.octets();
    let settings = EnipSettings {
        targets: vec![TargetSettings { address: SocketAddrV4::new(at, 44_818), connection }],
        originator: Originator { vendor: 0x1234, serial: u32::from_be_bytes([1, b, c, d]) },
        seed: u64::from(u32::from(bind)),
        cycle: CYCLE,
        start_limit,
    };
    EnipSegment::start(network, settings).map_err(|failure| failure.error)
}

fn start(at: Ipv4Addr, connection: ConnectionSettings) -> Segment {
    try_start(at, connection, PATIENCE).unwrap_or_else(|error| panic!("{error}"))
}

/// Exchanges of all segments until `is_done`; too many fail.
fn exchange_until<const N: usize>(
    mut segments: [&mut Segment; N],
    what: &str,
    mut is_done: impl FnMut(&mut [&mut Segment; N]) -> bool,
) {
    let clock = MonotonicClock::new();
    let mut due = clock.now();
    for _ in 0..2_000 {
        for segment in &mut segments {
            segment.exchange(due).unwrap();
        }
        if is_done(&mut segments) {
            return;
        }
        due += CYCLE;
        clock.sleep_until(due);
    }
    panic!("in 2000 cycles it did not happen: {what}");
}

fn inputs(segment: &Segment) -> (InputQuality, [u8; 252]) {
    let mut inputs = [0; 252];
    (segment.read_inputs(0, &mut inputs), inputs)
}

/// An image in which every byte counts.
fn image<const N: usize>(number: u8) -> [u8; N] {
    std::array::from_fn(|index| (index as u8).wrapping_mul(7).wrapping_add(number))
}

/// The next event of a kind.
fn event(adapter: &Adapter, is_it: impl Fn(&Event) -> bool) -> Event {
    for _ in 0..1_000 {
        let event = adapter.next_event(Some(PATIENCE)).expect("an event comes");
        if is_it(&event) {
            return event;
        }
    }
    panic!("a thousand other events came");
}

/// Images pass by value in both directions, several of them.
fn images_pass(adapter: &Adapter, segment: &mut Segment) {
    for number in 1..=5 {
        adapter.set_input(100, &image::<252>(number)).unwrap();
        segment.write_outputs(0, &image::<60>(number));
        exchange_until([segment], "the images are those written", |[segment]| {
            let output = adapter.output(150).unwrap();
            inputs(segment) == (InputQuality::Fresh, image(number))
                && output.run
                && output.data == image::<60>(number)
        });
    }
}

#[test]
fn an_owner_exchanges_images_and_takes_its_leave() {
    let at = address();
    let adapter = robot(at);
    let mut segment = start(at, owner());
    let Event::Opened(opened) = event(&adapter, |event| matches!(event, Event::Opened(_))) else {
        unreachable!()
    };
    assert_eq!((opened.kind, opened.multicast), (ConnectionKind::ExclusiveOwner, false));
    assert_eq!((opened.o_t_rpi, opened.t_o_rpi), (CYCLE, CYCLE));
    assert_eq!((opened.input, opened.output), (100, Some(150)));
    let status = segment.status(0).unwrap();
    assert_eq!((status.o2t_id, status.t2o_id), (opened.o_t_id, opened.t_o_id));
    let identity = status.identity.expect("it tells who it is");
    assert_eq!((identity.vendor, identity.device_type, identity.product_code), (1_565, 43, 500));
    images_pass(&adapter, &mut segment);
    segment.set_run(0, false);
    exchange_until([&mut segment], "idle arrives", |_| !adapter.output(150).unwrap().run);
    segment.set_run(0, true);
    exchange_until([&mut segment], "run arrives", |_| adapter.output(150).unwrap().run);
    drop(segment.close());
    let Event::Closed(closed) =
        event(&adapter, |event| matches!(event, Event::Closed(_) | Event::TimedOut(_)))
    else {
        panic!("its end was not told");
    };
    assert_eq!(closed.o_t_id, opened.o_t_id);
    assert_eq!(adapter.output(150).unwrap().data, vec![0; 60], "zeros came last");
    assert!(adapter.connections().is_empty());
}

#[test]
fn an_owner_without_configuration_assembly_and_with_a_key_is_accepted() {
    let at = address();
    let adapter = robot(at);
    let key = ElectronicKey {
        vendor: 1_565,
        device_type: 43,
        product_code: 500,
        major: 11,
        minor: 3,
        is_compatible: false,
    };
    let settings = ConnectionSettings { config: ConfigPath::None, key: Some(key), ..owner() };
    let mut segment = start(at, settings);
    images_pass(&adapter, &mut segment);
    drop(segment.close());
    let other = ConnectionSettings { key: Some(ElectronicKey { minor: 9, ..key }), ..settings };
    let error =
        try_start(at, other, PATIENCE).map(drop).expect_err("the key names another revision");
    let EnipError::Target { trouble: Trouble::Refused { extended, .. }, .. } = error else {
        panic!("{error}");
    };
    assert_eq!(extended, Some(ExtendedStatus::REVISION_MISMATCH));
}

#[test]
fn an_owner_hears_a_group() {
    let at = address();
    let adapter = robot(at);
    let mut segment = start(at, ConnectionSettings { t2o_type: T2oType::Multicast, ..owner() });
    let opened = segment.poll_event();
    assert!(
        matches!(opened, Some(ScannerEvent::Opened { multicast: Some(group), .. }) if group.is_multicast()),
        "{opened:?}"
    );
    assert!(adapter.connections().iter().all(|open| open.multicast));
    images_pass(&adapter, &mut segment);
    drop(segment.close());
    event(&adapter, |event| matches!(event, Event::Closed(_)));
}

#[test]
fn inputs_are_read_without_owning_outputs() {
    let at = address();
    let adapter = robot(at);
    let mut watcher = start(at, owner().input_only());
    assert_eq!(adapter.connections()[0].kind, ConnectionKind::InputOnly);
    let mut owner = start(at, owner());
    for number in 1..=3 {
        adapter.set_input(100, &image::<252>(number)).unwrap();
        watcher.write_outputs(0, &[0xEE; 60]);
        owner.write_outputs(0, &image::<60>(number));
        exchange_until([&mut watcher, &mut owner], "both see the inputs", |[watcher, owner]| {
            inputs(watcher) == (InputQuality::Fresh, image(number))
                && inputs(owner) == (InputQuality::Fresh, image(number))
                && adapter.output(150).unwrap().data == image::<60>(number)
        });
    }
    drop(owner.close());
    // It goes on without the owner, longer than any watchdog.
    let before = watcher.status(0).unwrap().counters.consumed;
    exchange_until([&mut watcher], "frames go on", |[watcher]| {
        watcher.status(0).unwrap().counters.consumed > before + 60
    });
    assert_eq!(watcher.status(0).unwrap().counters.timed_out, 0);
    drop(watcher.close());
    assert!(adapter.connections().is_empty());
}

#[test]
fn a_listener_hears_as_long_as_there_is_somebody_to_listen_to() {
    let at = address();
    let adapter = robot(at);
    let listens = owner().listen_only();
    let error =
        try_start(at, listens, Duration::from_millis(500)).map(drop).expect_err("nobody is there");
    let EnipError::Target { trouble: Trouble::Refused { extended, .. }, .. } = error else {
        panic!("{error}");
    };
    assert_eq!(extended, Some(ExtendedStatus::NO_OWNER));
    assert!(
        error.is_transient() && error.to_string().contains("let an owner connect first"),
        "{error}"
    );

    let mut owner = start(at, ConnectionSettings { t2o_type: T2oType::Multicast, ..owner() });
    let mut listener = start(at, listens);
    let kinds: Vec<_> = adapter.connections().iter().map(|open| open.kind).collect();
    assert_eq!(kinds, [ConnectionKind::ExclusiveOwner, ConnectionKind::ListenOnly]);
    for number in 1..=3 {
        adapter.set_input(100, &image::<252>(number)).unwrap();
        exchange_until([&mut owner, &mut listener], "both see the inputs", |[owner, listener]| {
            inputs(owner) == (InputQuality::Fresh, image(number))
                && inputs(listener) == (InputQuality::Fresh, image(number))
        });
    }
    drop(owner.close());
    exchange_until([&mut listener], "the listener loses its inputs", |[listener]| {
        inputs(listener).0 == InputQuality::Lost
    });
    drop(listener.close());
}

#[test]
fn a_second_owner_is_refused_until_the_first_is_gone() {
    let at = address();
    let adapter = robot(at);
    let first = start(at, owner());
    let error =
        try_start(at, owner(), Duration::from_millis(200)).map(drop).expect_err("it is owned");
    let EnipError::Target { trouble: Trouble::Refused { extended, .. }, .. } = error else {
        panic!("{error}");
    };
    assert_eq!(extended, Some(ExtendedStatus::OWNERSHIP_CONFLICT));
    drop(first.close());
    let mut second = start(at, owner());
    images_pass(&adapter, &mut second);
}

#[test]
fn an_owner_that_falls_silent_is_noticed_by_the_robot() {
    let at = address();
    let adapter = robot(at);
    let segment = start(at, owner());
    let network = segment.abandon();
    event(&adapter, |event| matches!(event, Event::TimedOut(_)));
    assert!(adapter.connections().is_empty());
    // A new one is welcome, from the same network.
    let settings = EnipSettings {
        targets: vec![TargetSettings {
            address: SocketAddrV4::new(at, 44_818),
            connection: owner(),
        }],
        originator: Originator { vendor: 0x1234, serial: 2 },
        seed: 99,
        cycle: CYCLE,
        start_limit: PATIENCE,
    };
    let segment = EnipSegment::start(network, settings);
    let mut segment = segment.unwrap_or_else(|failure| panic!("{}", failure.error));
    images_pass(&adapter, &mut segment);
}

#[test]
fn a_robot_that_restarts_is_lost_and_comes_back_by_itself() {
    for t2o_type in [T2oType::Unicast, T2oType::Multicast] {
        let at = address();
        let adapter = robot(at);
        let mut segment = start(at, ConnectionSettings { t2o_type, ..owner() });
        images_pass(&adapter, &mut segment);
        adapter.stop();
        let mut was_stale = false;
        exchange_until([&mut segment], "the inputs are lost", |[segment]| {
            let (quality, bytes) = inputs(segment);
            if let InputQuality::Stale { .. } = quality {
                was_stale = true;
                assert_eq!(bytes, image(5), "the last good image is kept");
            }
            quality == InputQuality::Lost
        });
        assert!(was_stale);
        let failed = std::iter::from_fn(|| segment.poll_event()).find_map(|event| match event {
            ScannerEvent::Failed { trouble, retry_in, .. } => Some((trouble, retry_in.is_some())),
            _ => None,
        });
        assert!(matches!(failed, Some((Trouble::TimedOut { .. }, true))), "{failed:?}");
        let adapter = robot(at);
        images_pass(&adapter, &mut segment);
        assert!(segment.status(0).unwrap().counters.opened >= 2);
        drop(segment.close());
        event(&adapter, |event| matches!(event, Event::Closed(_)));
    }
}

#[test]
fn questions_are_answered_over_tcp() {
    let at = address();
    let _adapter = robot(at);
    let to = SocketAddrV4::new(at, 44_818);
    let mut client = ExplicitClient::connect(Some(address()), to, PATIENCE).unwrap();
    let identity = client.identity().unwrap();
    assert_eq!((identity.vendor, identity.device_type, identity.product_code), (1_565, 43, 500));
    assert_eq!((identity.major, identity.minor, identity.serial), (11, 3, 0x00C0_FFEE));
    assert_eq!(identity.name.to_string(), "Meca500");
    let vendor = ObjectPath { class: 1, instance: 1, attribute: Some(1) };
    assert_eq!(client.get_attribute(vendor).unwrap(), 1_565_u16.to_le_bytes());
    let refused = client.set_attribute(vendor, &[0, 0]).unwrap_err();
    assert!(
        matches!(refused, ExplicitError::Refused { address, .. } if address == to),
        "{refused}"
    );
    assert!(!refused.is_transient());
    let nothing = ObjectPath { class: 0x99, instance: 1, attribute: Some(1) };
    let refused = client.get_attribute(nothing).unwrap_err();
    let ExplicitError::Refused { general, .. } = refused else { panic!("{refused}") };
    assert_eq!(general, GeneralStatus::PATH_DESTINATION_UNKNOWN);
    // A refusal does not end the session.
    assert_eq!(client.identity().unwrap(), identity);
}

#[test]
fn an_identity_is_listed() {
    let at = address();
    let _adapter = robot(at);
    let to = SocketAddrV4::new(at, 44_818);
    let listing = list_identity(Some(address()), to, PATIENCE).unwrap();
    let [found] = listing.found[..] else { panic!("{listing:?}") };
    assert_eq!((found.from, found.listed.address), (to, to));
    assert_eq!((found.listed.identity.vendor, found.listed.identity.product_code), (1_565, 500));
    assert_eq!(listing.malformed, 0);
}
