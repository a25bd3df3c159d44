//! The names of EtherNet/IP links: `enip:ADDR[,ADDR...][?KEY=VALUE&...]` and what stands in them.
//!
//! Addresses are only read here, not looked up: a name may be checked on a machine without a network.

use core::fmt;
use core::net::Ipv4Addr;
use std::prelude::v1::*;

use crate::bus::enip::scanner::{ConfigPath, T2oType};
use crate::cli::link_text::{
    check_count, is_host_name, no_option, no_port, read_options, split_query,
};
use crate::time::Duration;
use crate::wire::enip::MESSAGE_PORT;
use crate::wire::enip::parameters::TimeoutMultiplier;
use crate::wire::meca500::adapter::{CONFIG_ASSEMBLY, MIN_RPI_US};

/// Intervals that may be asked for, in ms.
const RPI_MS: core::ops::RangeInclusive<f64> = 0.1..=100.0;
/// The keys, for messages about what is none.
const KEYS: &str = "rpi_ms, multiplier, t2o, config, key, bind and io_port";
/// Those that mean something without sockets.
const KEYS_IN_MEMORY: &str = "rpi_ms, multiplier, t2o, config and key";

/// A robot's address as it was given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::cli) struct Host {
    /// An IPv4 address or a name to be looked up.
    pub(in crate::cli) name: String,
    /// TCP port, and UDP port of ListIdentity.
    pub(in crate::cli) port: u16,
}

/// What identity the target must have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::cli) enum KeyChoice {
    /// Not asked.
    #[default]
    None,
    /// A key that fits every device, for targets that want one.
    Wildcard,
    /// A Meca500 with firmware 11.3.
    Exact,
}

/// How the connections shall be, and from where.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::cli) struct EnipOptions {
    /// Interval to ask for, both ways.
    pub(in crate::cli) rpi: Duration,
    /// How many intervals without a frame end a connection.
    pub(in crate::cli) multiplier: TimeoutMultiplier,
    /// How inputs travel.
    pub(in crate::cli) t2o: T2oType,
    /// Configuration assembly in the path; `None` means 151 first, and none when that is refused.
    pub(in crate::cli) config: Option<ConfigPath>,
    /// Electronic key.
    pub(in crate::cli) key: KeyChoice,
    /// Local address; `None` leaves it to the system.
    pub(in crate::cli) bind: Option<Ipv4Addr>,
    /// Local UDP port, 0 for any free one; `None` means 2222, and any for targets on this machine.
    pub(in crate::cli) io_port: Option<u16>,
}

impl Default for EnipOptions {
    fn default() -> Self {
        Self {
            rpi: Duration::from_micros(MIN_RPI_US.into()),
            multiplier: TimeoutMultiplier::from_factor(16).unwrap_or_default(),
            t2o: T2oType::Unicast,
            config: None,
            key: KeyChoice::None,
            bind: None,
            io_port: None,
        }
    }
}

/// Everything that stands behind `enip:`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::cli) struct EnipName {
    /// The robots, at least one, each once.
    pub(in crate::cli) hosts: Vec<Host>,
    /// How they are connected to.
    pub(in crate::cli) options: EnipOptions,
    /// The name as it was given, without `enip:`.
    text: String,
}

impl EnipName {
    /// Reads what stands behind `enip:`.
    pub(in crate::cli) fn parse(text: &str) -> Result<Self, String> {
        let (hosts, query) = split_query(text);
        let hosts = parse_hosts(hosts)?;
        let options = EnipOptions::parse(query, KEYS)?;
        Ok(Self { hosts, options, text: text.into() })
    }
}

impl fmt::Display for EnipName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "enip:{}", self.text)
    }
}

fn parse_hosts(text: &str) -> Result<Vec<Host>, String> {
    if text.is_empty() {
        return Err("enip needs the address of a robot, as in enip:192.168.0.100; enip-sim needs \
                    none, and `fieldarm probe enip:broadcast` shows who is there"
            .into());
    }
    let mut hosts: Vec<Host> = Vec::new();
    for part in text.split(',') {
        for host in parse_host(part)? {
            if hosts.contains(&host) {
                return Err(format!(
                    "{} stands twice in `{text}`: a robot has one owner",
                    host.name
                ));
            }
            hosts.push(host);
        }
    }
    check_count(hosts.len())?;
    Ok(hosts)
}

/// `ADDR`, `ADDR:PORT`, or `A.B.C.D-E` for a row of addresses.
fn parse_host(text: &str) -> Result<Vec<Host>, String> {
    let (name, port) = match text.split_once(':') {
        None => (text, MESSAGE_PORT),
        Some((_, rest)) if rest.contains(':') => {
            return Err(format!(
                "`{text}` has more than one colon; EtherNet/IP runs over IPv4 only"
            ));
        }
        Some((name, port)) => match port.parse() {
            Ok(port) if port != 0 => (name, port),
            _ => return Err(no_port(port, MESSAGE_PORT)),
        },
    };
    if let Some((first, last)) = name.split_once('-')
        && let Ok(first) = first.parse::<Ipv4Addr>()
    {
        return row(name, first, last)
            .map(|names| names.map(|address| Host { name: address.to_string(), port }).collect());
    }
    if name.parse::<Ipv4Addr>().is_err() && !is_host_name(name) {
        return Err(format!(
            "`{name}` is neither an IPv4 address nor the name of a host; several robots are \
             enip:ADDR,ADDR or enip:192.168.0.101-104"
        ));
    }
    Ok(vec![Host { name: name.into(), port }])
}

/// The addresses from `first` to the one that ends in `last`.
fn row(
    text: &str,
    first: Ipv4Addr,
    last: &str,
) -> Result<impl Iterator<Item = Ipv4Addr> + use<>, String> {
    let [a, b, c, from] = first.octets();
    match last.parse::<u8>() {
        Ok(last) if last >= from => Ok((from..=last).map(move |d| Ipv4Addr::new(a, b, c, d))),
        _ => Err(format!(
            "`{text}` is no row of addresses: behind - stands the last number of the last address, \
             {from} to 255"
        )),
    }
}

impl EnipOptions {
    /// Reads the part behind `?` of a link with robots in memory.
    pub(in crate::cli) fn parse_in_memory(query: Option<&str>) -> Result<Self, String> {
        let options = Self::parse(query, KEYS_IN_MEMORY)?;
        match options {
            Self { bind: Some(_), .. } => Err("bind"),
            Self { io_port: Some(_), .. } => Err("io_port"),
            options => Ok(options),
        }
        .map_err(|key| {
            format!("enip-sim has no sockets, so `{key}` means nothing; there are {KEYS_IN_MEMORY}")
        })
    }

    fn parse(query: Option<&str>, keys: &str) -> Result<Self, String> {
        let mut options = Self::default();
        read_options(query, keys, |key, value| options.set(key, value, keys))?;
        Ok(options)
    }

    fn set(&mut self, key: &str, value: &str, keys: &str) -> Result<(), String> {
        let wrong = |right: &str| Err(format!("{key}=`{value}`: {right}"));
        match key {
            "rpi_ms" => match value.parse::<f64>() {
                Ok(ms) if RPI_MS.contains(&ms) => {
                    // On the wire it is a number of microseconds.
                    self.rpi = Duration::from_micros((ms * 1e3).round() as u64);
                }
                _ => {
                    return wrong(
                        "the interval to ask for in ms, 0.1 to 100; a robot takes 10 and more",
                    );
                }
            },
            "multiplier" => match value.parse().ok().and_then(TimeoutMultiplier::from_factor) {
                Some(multiplier) => self.multiplier = multiplier,
                None => {
                    return wrong("4, 8, 16, 32, 64, 128, 256 or 512 intervals without a frame");
                }
            },
            "t2o" => match value {
                "unicast" => self.t2o = T2oType::Unicast,
                "multicast" => self.t2o = T2oType::Multicast,
                _ => return wrong("unicast or multicast"),
            },
            "config" => match (value, value.parse::<u16>()) {
                ("none", _) => self.config = Some(ConfigPath::None),
                (_, Ok(instance)) if instance != 0 => {
                    self.config = Some(ConfigPath::Named(instance.into()));
                }
                _ => {
                    return wrong(&format!(
                        "none or the number of a configuration assembly, for a Meca500 {CONFIG_ASSEMBLY}"
                    ));
                }
            },
            "key" => match value {
                "none" => self.key = KeyChoice::None,
                "wildcard" => self.key = KeyChoice::Wildcard,
                "exact" => self.key = KeyChoice::Exact,
                _ => return wrong("none, wildcard, or exact for a Meca500 with firmware 11.3"),
            },
            "bind" => match value.parse() {
                Ok(address) => self.bind = Some(address),
                Err(_) => return wrong("the IPv4 address of an interface of this machine"),
            },
            "io_port" => match value.parse() {
                Ok(port) => self.io_port = Some(port),
                Err(_) => {
                    return wrong("a UDP port of this machine, 1 to 65535, or 0 for any free one");
                }
            },
            _ => return Err(no_option(key, keys)),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::link_text::MOST_ROBOTS;

    fn names(text: &str) -> Vec<String> {
        let name = EnipName::parse(text).expect(text);
        name.hosts.iter().map(|host| format!("{}:{}", host.name, host.port)).collect()
    }

    #[test]
    fn one_address_many_and_a_row_are_read() {
        assert_eq!(names("192.168.0.100"), ["192.168.0.100:44818"]);
        assert_eq!(names("arm-1.cell:44819"), ["arm-1.cell:44819"]);
        assert_eq!(names("10.0.0.7,arm"), ["10.0.0.7:44818", "arm:44818"]);
        let row = ["127.0.0.9:5", "127.0.0.10:5", "127.0.0.11:5", "localhost:44818"];
        assert_eq!(names("127.0.0.9-11:5,localhost"), row);
        assert_eq!(names("127.1.0.1-64").len(), MOST_ROBOTS);
    }

    #[test]
    fn what_is_right_reads_back_as_it_was_written() {
        for text in ["arm", "127.0.0.1-4?rpi_ms=2.5&multiplier=64", "10.0.0.7:44819,10.0.0.8"] {
            let name = EnipName::parse(text).expect(text);
            assert_eq!(name.to_string(), format!("enip:{text}"));
        }
    }

    #[test]
    fn every_option_is_read() {
        let text = "a?rpi_ms=2.5&multiplier=512&t2o=multicast&config=none&key=exact&bind=10.0.0.1&io_port=0";
        let options = EnipName::parse(text).expect(text).options;
        let expected = EnipOptions {
            rpi: Duration::from_micros(2_500),
            multiplier: TimeoutMultiplier::from_factor(512).expect("a factor"),
            t2o: T2oType::Multicast,
            config: Some(ConfigPath::None),
            key: KeyChoice::Exact,
            bind: Some(Ipv4Addr::new(10, 0, 0, 1)),
            io_port: Some(0),
        };
        assert_eq!(options, expected);
        let with = |query: &str| EnipOptions::parse(Some(query), KEYS).expect(query);
        assert_eq!(with("config=151").config, Some(ConfigPath::Named(151)));
        assert_eq!(with("key=wildcard").key, KeyChoice::Wildcard);
        assert_eq!(with("t2o=%75nicast"), EnipOptions::default());
        assert_eq!(EnipName::parse("a").expect("a").options, EnipOptions::default());
        assert_eq!(EnipOptions::default().rpi, Duration::from_millis(10));
        assert_eq!(EnipOptions::default().multiplier.factor(), 16);
    }

    #[test]
    fn what_is_wrong_is_told_with_what_would_be_right() {
        let cases = [
            ("", "enip needs the address of a robot, as in enip:192.168.0.100"),
            ("?rpi_ms=10", "enip needs the address of a robot"),
            ("10.0.0.1,", "`` is neither an IPv4 address nor the name of a host"),
            ("10.0.0", "`10.0.0` is neither an IPv4 address"),
            ("10.0.0.256", "`10.0.0.256` is neither an IPv4 address"),
            ("-arm", "`-arm` is neither"),
            ("a b", "`a b` is neither"),
            ("::1", "has more than one colon; EtherNet/IP runs over IPv4 only"),
            ("arm:", "`` is no port of TCP: 1 to 65535, usually 44818"),
            ("arm:0", "`0` is no port"),
            ("arm:65536", "`65536` is no port"),
            ("10.0.0.9-8", "is no row of addresses: behind - stands the last number"),
            ("10.0.0.9-256", "is no row of addresses"),
            ("10.0.0.9-10.0.0.11", "is no row of addresses"),
            ("10.0.0.1,10.0.0.1", "10.0.0.1 stands twice"),
            ("10.0.0.1-4,10.0.0.3", "10.0.0.3 stands twice"),
            ("10.0.0.1-65", "65 addresses; one link drives 64 at most"),
            ("a?", "nothing stands behind `?`; there are rpi_ms, multiplier"),
            (
                "a?rpi=10",
                "`rpi` is no option of this link; there are rpi_ms, multiplier, t2o, config, key",
            ),
            ("a?rpi_ms", "rpi_ms=``: the interval to ask for in ms, 0.1 to 100"),
            ("a?rpi_ms=0", "0.1 to 100"),
            ("a?rpi_ms=NaN", "0.1 to 100"),
            ("a?rpi_ms=101", "rpi_ms=`101`"),
            ("a?rpi_ms=10&rpi_ms=10", "`rpi_ms` is given twice"),
            ("a?multiplier=5", "multiplier=`5`: 4, 8, 16, 32, 64, 128, 256 or 512"),
            ("a?t2o=broadcast", "t2o=`broadcast`: unicast or multicast"),
            ("a?config=0", "none or the number of a configuration assembly, for a Meca500 151"),
            ("a?config=x", "config=`x`: none or the number"),
            ("a?key=any", "key=`any`: none, wildcard, or exact"),
            ("a?bind=eth0", "bind=`eth0`: the IPv4 address of an interface"),
            ("a?io_port=65536", "io_port=`65536`: a UDP port"),
        ];
        for (text, message) in cases {
            let error = EnipName::parse(text).expect_err(text);
            assert!(error.contains(message), "{text}: {error}");
        }
    }

    #[test]
    fn robots_in_memory_have_no_sockets() {
        assert_eq!(EnipOptions::parse_in_memory(None), Ok(EnipOptions::default()));
        for query in ["bind=10.0.0.1", "io_port=0"] {
            let error = EnipOptions::parse_in_memory(Some(query)).expect_err(query);
            assert!(error.contains("enip-sim has no sockets"), "{error}");
        }
        let error = EnipOptions::parse_in_memory(Some("rpi=1")).expect_err("no such key");
        assert!(error.ends_with("there are rpi_ms, multiplier, t2o, config and key"), "{error}");
    }
}
