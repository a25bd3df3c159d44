//! From the name of a link to open connections.

use core::hash::{BuildHasher, Hasher};
use core::net::{Ipv4Addr, SocketAddr, SocketAddrV4};
use std::hash::RandomState;
use std::net::ToSocketAddrs;
use std::prelude::v1::*;
use std::process;

use super::link_name::{EnipOptions, Host, KeyChoice};
use crate::bus::enip::scanner::{ConfigPath, ConnectionSettings, Originator, ScannerEvent};
use crate::cli::exit::Failure;
use crate::link::enip::network::Network;
use crate::link::enip::sockets::{OpenError, SocketNetwork, SocketSettings};
use crate::link::enip::{EnipError, EnipSegment, EnipSettings, TargetSettings};
use crate::time::Duration;
use crate::wire::enip::IO_PORT;
use crate::wire::enip::path::ElectronicKey;
use crate::wire::meca500::adapter::{CONFIG_ASSEMBLY, IDENTITY};

/// Vendor number of this scanner. ODVA gives numbers out to members, which this project is none of.
///
/// Source: choice; high enough to be nobody's.
const VENDOR: u16 = 0xFA4D;
/// How long the robots of a run may take until their inputs arrive: longer than the watchdog of a
/// connection that an earlier process left behind.
pub(in crate::cli) const START_LIMIT: Duration = Duration::from_secs(5);

/// A connection of a running segment, as it was opened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::cli) struct Opened {
    /// Interval that holds for the frames to the robot.
    pub(in crate::cli) o2t_api: Duration,
    /// Interval that holds for the frames from the robot.
    pub(in crate::cli) t2o_api: Duration,
    /// The path that was accepted.
    pub(in crate::cli) config: ConfigPath,
    /// Group that inputs come to; `None` when they come to us alone.
    pub(in crate::cli) multicast: Option<Ipv4Addr>,
}

/// A number that differs from process to process.
pub(in crate::cli) fn seed() -> u64 {
    let mut hasher = RandomState::new().build_hasher();
    hasher.write_u32(process::id());
    hasher.finish()
}

/// Who we are in Forward Opens: another one in each process, so that nobody takes our connections for
/// those of an earlier one.
pub(in crate::cli) fn originator(seed: u64) -> Originator {
    let [a, b, c, d, ..] = seed.to_le_bytes();
    Originator { vendor: VENDOR, serial: u32::from_le_bytes([a, b, c, d]) }
}

/// The addresses of `hosts`, names looked up.
pub(in crate::cli) fn look_up(hosts: &[Host]) -> Result<Vec<SocketAddrV4>, Failure> {
    let mut found: Vec<SocketAddrV4> = Vec::new();
    for host in hosts {
        let address = look_up_one(host)?;
        if found.contains(&address) {
            return Err(Failure::usage(format!(
                "{} is {address}, which is among the robots already: a robot has one owner",
                host.name
            )));
        }
        found.push(address);
    }
    Ok(found)
}

fn look_up_one(host: &Host) -> Result<SocketAddrV4, Failure> {
    if let Ok(address) = host.name.parse() {
        return Ok(SocketAddrV4::new(address, host.port));
    }
    let found = (host.name.as_str(), host.port).to_socket_addrs().map_err(|error| {
        Failure::link(format!(
            "no address of `{}` is known ({error}): check the name, or give the robot's IPv4 address",
            host.name
        ))
    })?;
    let version_4 = found.filter_map(|address| match address {
        SocketAddr::V4(address) => Some(address),
        SocketAddr::V6(_) => None,
    });
    version_4.take(1).last().ok_or_else(|| {
        Failure::link(format!("`{}` has no IPv4 address, and EtherNet/IP needs one", host.name))
    })
}

/// UDP port to use for I/O. Whoever serves robots on this machine has port 2222 there, so for robots on
/// loopback addresses any free one does.
pub(in crate::cli) fn io_port(options: &EnipOptions, targets: &[SocketAddrV4]) -> u16 {
    let are_here = targets.iter().all(|target| target.ip().is_loopback());
    match options.io_port {
        Some(port) => port,
        None if are_here => 0,
        None => IO_PORT,
    }
}

/// Sockets to reach `targets` with.
pub(in crate::cli) fn open_sockets(
    options: &EnipOptions,
    targets: &[SocketAddrV4],
) -> Result<SocketNetwork, Failure> {
    let settings = SocketSettings { bind: options.bind, io_port: io_port(options, targets) };
    SocketNetwork::open(settings, targets).map_err(|error| match error {
        OpenError::Bind { .. } => Failure::usage(error.to_string()),
        _ => Failure::link(error.to_string()),
    })
}

/// A connection that controls a robot, as the options want it.
pub(in crate::cli) fn connection(options: &EnipOptions) -> ConnectionSettings {
    let defaults = ConnectionSettings::meca500();
    ConnectionSettings {
        config: options.config.unwrap_or(ConfigPath::Named(CONFIG_ASSEMBLY)),
        tries_other_config: options.config.is_none(),
        key: match options.key {
            KeyChoice::None => None,
            KeyChoice::Wildcard => Some(ElectronicKey::default()),
            KeyChoice::Exact => Some(ElectronicKey {
                vendor: IDENTITY.vendor,
                device_type: IDENTITY.device_type,
                product_code: IDENTITY.product_code,
                major: IDENTITY.major,
                minor: IDENTITY.minor,
                is_compatible: false,
            }),
        },
        multiplier: options.multiplier,
        t2o_type: options.t2o,
        ..defaults.with_rpi(options.rpi)
    }
}

/// Opens `connection` to all `targets`, and waits at most `limit` for their inputs. Exchanges will follow
/// each other every `cycle`, or at the interval that is granted.
pub(in crate::cli) fn start<N: Network>(
    network: N,
    targets: &[SocketAddrV4],
    connection: ConnectionSettings,
    cycle: Duration,
    limit: Duration,
) -> Result<(EnipSegment<N>, Vec<Opened>), (EnipError, N)> {
    let seed = seed();
    let settings = EnipSettings {
        targets: targets
            .iter()
            .map(|address| TargetSettings { address: *address, connection })
            .collect(),
        originator: originator(seed),
        seed,
        cycle,
        start_limit: limit,
    };
    let mut segment = EnipSegment::start(network, settings)
        .map_err(|failure| (failure.error, failure.network))?;
    let mut opened = vec![None; targets.len()];
    while let Some(event) = segment.poll_event() {
        let ScannerEvent::Opened { target, o2t_api, t2o_api, config, multicast } = event else {
            continue;
        };
        if let Some(place) = opened.get_mut(target) {
            *place = Some(Opened { o2t_api, t2o_api, config, multicast });
        }
    }
    // Every target told that it is open, or the start would have failed.
    let opened = opened.into_iter().flatten().collect();
    Ok((segment, opened))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::enip::link_name::EnipName;

    fn named(text: &str) -> EnipName {
        EnipName::parse(text).expect(text)
    }

    #[test]
    fn addresses_need_no_lookup_and_stand_once() {
        let hosts = named("127.0.0.2:5,10.1.2.3").hosts;
        let expected = ["127.0.0.2:5", "10.1.2.3:44818"].map(|text| text.parse().expect(text));
        assert_eq!(look_up(&hosts), Ok(expected.to_vec()));
        let twice = look_up(&named("127.0.0.1,localhost").hosts).expect_err("the same robot");
        assert!(twice.message.contains("is among the robots already"), "{}", twice.message);
    }

    #[test]
    fn robots_of_this_machine_leave_port_2222_to_whoever_serves_them() {
        let port = |text: &str| {
            let EnipName { hosts, options, .. } = named(text);
            io_port(&options, &look_up(&hosts).expect(text))
        };
        assert_eq!(port("127.0.0.1,127.9.9.9"), 0);
        assert_eq!(port("127.0.0.1?io_port=2222"), 2222);
        assert_eq!(port("10.0.0.1"), 2222);
        assert_eq!(port("10.0.0.1,127.0.0.1"), 2222);
        assert_eq!(port("10.0.0.1?io_port=0"), 0);
    }

    #[test]
    fn a_path_that_was_asked_for_is_the_only_one_tried() {
        let of = |text: &str| {
            let connection = connection(&named(text).options);
            (connection.config, connection.tries_other_config)
        };
        assert_eq!(of("a"), (ConfigPath::Named(151), true));
        assert_eq!(of("a?config=151"), (ConfigPath::Named(151), false));
        assert_eq!(of("a?config=none"), (ConfigPath::None, false));
    }

    #[test]
    fn keys_are_those_asked_for() {
        let key = |text: &str| connection(&named(text).options).key;
        assert_eq!(key("a?key=none"), None);
        assert_eq!(key("a?key=wildcard"), Some(ElectronicKey::default()));
        let exact = key("a?key=exact").expect("a key");
        assert_eq!((exact.vendor, exact.product_code, exact.major), (1565, 500, 11));
    }

    #[test]
    fn two_processes_are_two_originators() {
        // As good as certain: 32 bits out of a keyed hash.
        let serials: Vec<u32> = (0..8).map(|_| originator(seed()).serial).collect();
        assert!(serials.iter().any(|serial| *serial != serials[0]), "{serials:?}");
    }
}
