//! The names of TCP links: `tcp:ADDR[:PORT][,ADDR...][?KEY=VALUE&...]` and what stands in them.
//!
//! Addresses are only read here, not looked up.

use core::fmt;
use core::net::{IpAddr, SocketAddr};
use std::net::ToSocketAddrs;
use std::prelude::v1::*;

use super::place::Place;
use crate::bus::text::{CONTROL_PORT, MONITORING_PORT};
use crate::cli::exit::Failure;
use crate::cli::link_text::{
    check_count, is_host_name, no_option, no_port, read_options, split_query,
};
use crate::run::text::TextSettings;
use crate::time::Duration;

/// The keys, for messages about what is none.
const KEYS: &str = "monitor, interval_ms and watchdog_ms";
/// Those that mean something without sockets.
const KEYS_IN_MEMORY: &str = "interval_ms and watchdog_ms";

/// A port of a robot as it was given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::cli) struct Host {
    /// An IP address or a name to be looked up.
    name: String,
    port: u16,
}

impl Host {
    /// Reads `ADDR` or `ADDR:PORT`; the port is `usual` where none is given.
    pub(in crate::cli) fn parse(text: &str, usual: u16) -> Result<Self, String> {
        if let Ok(place) = text.parse::<Place>() {
            let place = place.with_port(usual);
            return Self { name: place.ip().to_string(), port: place.port() }.with_a_port();
        }
        let (name, port) = match text.split_once(':') {
            Some((name, port)) => (name, port.parse().map_err(|_| no_port(port, usual))?),
            None => (text, usual),
        };
        if !is_host_name(name) {
            return Err(format!(
                "`{name}` is neither an IP address nor the name of a host; with a port it is \
                 192.168.0.100:{usual} or [::1]:{usual}"
            ));
        }
        Self { name: name.into(), port }.with_a_port()
    }

    fn with_a_port(self) -> Result<Self, String> {
        match self.port {
            0 => Err("`0` is no port of TCP: 1 to 65535".into()),
            _ => Ok(self),
        }
    }

    /// Where it is; of a name with several addresses, an IPv4 address first, for that is what a Meca500
    /// has: `localhost` is often `::1` before it is `127.0.0.1`.
    pub(in crate::cli) fn look_up(&self) -> Result<SocketAddr, Failure> {
        if let Ok(address) = self.name.parse::<IpAddr>() {
            return Ok(SocketAddr::new(address, self.port));
        }
        let found = (self.name.as_str(), self.port).to_socket_addrs();
        let none =
            |why: String| Failure::link(format!("the host `{}` is not known: {why}", self.name));
        let found = found.map_err(|error| none(error.to_string()))?;
        found.min_by_key(SocketAddr::is_ipv6).ok_or_else(|| none("it has no address".into()))
    }
}

/// How the run shall be.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(in crate::cli) struct TcpOptions {
    /// Monitoring ports, one for each robot, or none: then positions come over the control ports.
    pub(in crate::cli) monitors: Vec<Host>,
    /// Interval of the positions; `None` leaves the robot's.
    pub(in crate::cli) interval: Option<Duration>,
    /// Connection watchdog; `None` for none.
    pub(in crate::cli) watchdog: Option<Duration>,
}

impl TcpOptions {
    fn parse(query: Option<&str>, keys: &str) -> Result<Self, String> {
        let mut options = Self::default();
        read_options(query, keys, |key, value| options.set(key, value, keys))?;
        Ok(options)
    }

    fn set(&mut self, key: &str, value: &str, keys: &str) -> Result<(), String> {
        let ms = |range: core::ops::RangeInclusive<f64>, what: &str| {
            let number = value.parse::<f64>().ok().filter(|ms| range.contains(ms));
            let whole = number.map(|ms| Duration::from_micros((ms * 1e3).round() as u64));
            whole.map(Some).ok_or(format!("{key}=`{value}`: {what}"))
        };
        match key {
            "monitor" if keys == KEYS => {
                let hosts = value.split(',').map(|host| Host::parse(host, MONITORING_PORT));
                self.monitors = hosts
                    .collect::<Result<_, _>>()
                    .map_err(|error| format!("monitor=`{value}`: {error}"))?;
            }
            "monitor" => {
                return Err(format!(
                    "tcp-sim has no sockets, so `{key}` means nothing; there are {keys}"
                ));
            }
            "interval_ms" => {
                self.interval = ms(1.0..=1_000.0, "the interval of positions in ms, 1 to 1000")?;
            }
            "watchdog_ms" => {
                let what =
                    "the time in ms after which a robot that hears nothing stops, 100 to 60000";
                self.watchdog = ms(100.0..=60_000.0, what)?;
            }
            _ => return Err(no_option(key, keys)),
        }
        Ok(())
    }

    /// The settings of a run with these checkpoint numbers of its own.
    pub(in crate::cli) fn settings(&self, checkpoints: (u16, u16)) -> TextSettings {
        TextSettings {
            checkpoints,
            copies_monitoring: self.monitors.is_empty(),
            interval: self.interval,
            watchdog: self.watchdog,
            ..TextSettings::default()
        }
    }
}

/// Robots on TCP: at their addresses, or virtual ones in this process.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::cli) struct TcpName {
    /// The control ports; none for robots in this process.
    pub(in crate::cli) hosts: Vec<Host>,
    /// How the run shall be.
    pub(in crate::cli) options: TcpOptions,
    /// The name as it was given.
    text: String,
}

impl TcpName {
    /// Reads `tcp:...`, of which `rest` stands behind the colon.
    pub(in crate::cli) fn parse(rest: &str) -> Result<Self, String> {
        let (hosts, query) = split_query(rest);
        if hosts.is_empty() {
            return Err(
                "tcp needs the address of a robot, as in tcp:192.168.0.100; tcp-sim needs \
                        none"
                    .into(),
            );
        }
        let options = TcpOptions::parse(query, KEYS)?;
        let hosts: Vec<Host> = hosts
            .split(',')
            .map(|host| Host::parse(host, CONTROL_PORT))
            .collect::<Result<_, _>>()?;
        for (place, host) in hosts.iter().enumerate() {
            if hosts.iter().skip(place + 1).any(|other| other == host) {
                return Err(format!(
                    "{}:{} stands twice: a robot has one controller",
                    host.name, host.port
                ));
            }
        }
        check_count(hosts.len())?;
        if !options.monitors.is_empty() && options.monitors.len() != hosts.len() {
            return Err(format!(
                "monitor names {}, the link {}: name one monitoring port for each robot, with commas \
                 between them",
                options.monitors.len(),
                hosts.len()
            ));
        }
        Ok(Self { hosts, options, text: format!("tcp:{rest}") })
    }

    /// Reads `tcp-sim` or `tcp-sim?...`.
    pub(in crate::cli) fn parse_in_memory(text: &str) -> Result<Self, String> {
        let (_, query) = split_query(text);
        let options = TcpOptions::parse(query, KEYS_IN_MEMORY)?;
        Ok(Self { hosts: Vec::new(), options, text: text.into() })
    }

    /// Whether the robots are virtual ones in this process.
    pub(in crate::cli) const fn is_in_process(&self) -> bool {
        self.hosts.is_empty()
    }
}

impl fmt::Display for TcpName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn controls(text: &str) -> Vec<String> {
        let name = TcpName::parse(text).expect(text);
        name.hosts.iter().map(|host| format!("{} {}", host.name, host.port)).collect()
    }

    #[test]
    fn one_address_and_many_are_read() {
        assert_eq!(controls("192.168.0.100"), ["192.168.0.100 10000"]);
        assert_eq!(controls("[::1]:7,::1"), ["::1 7", "::1 10000"]);
        assert_eq!(controls("arm-1.cell:10002,10.0.0.7"), ["arm-1.cell 10002", "10.0.0.7 10000"]);
        let name =
            TcpName::parse("a?monitor=10.0.0.7&interval_ms=2.5&watchdog_ms=500").expect("good");
        assert_eq!(name.options.monitors, [Host { name: "10.0.0.7".into(), port: 10_001 }]);
        assert_eq!(name.options.interval, Some(Duration::from_micros(2_500)));
        assert_eq!(name.options.watchdog, Some(Duration::from_millis(500)));
        assert_eq!(name.to_string(), "tcp:a?monitor=10.0.0.7&interval_ms=2.5&watchdog_ms=500");
    }

    #[test]
    fn a_name_is_looked_up_as_the_robots_have_addresses() {
        let host = Host::parse("localhost", CONTROL_PORT).expect("a name");
        assert_eq!(host.look_up().map(|at| at.to_string()), Ok("127.0.0.1:10000".into()));
    }

    #[test]
    fn what_is_wrong_is_told_with_what_would_be_right() {
        let cases = [
            ("", "tcp needs the address of a robot, as in tcp:192.168.0.100"),
            ("?watchdog_ms=500", "tcp needs the address of a robot"),
            ("10.0.0.1,", "`` is neither an IP address nor the name of a host"),
            ("10.0.0", "`10.0.0` is neither an IP address"),
            ("a b", "`a b` is neither"),
            ("arm:", "`` is no port of TCP: 1 to 65535, usually 10000"),
            ("arm:65536", "`65536` is no port of TCP"),
            ("arm:0", "`0` is no port of TCP"),
            ("10.0.0.1:0", "`0` is no port of TCP"),
            ("10.0.0.1,10.0.0.1:10000", "10.0.0.1:10000 stands twice"),
            ("a?", "nothing stands behind `?`; there are monitor, interval_ms and watchdog_ms"),
            ("a?rpi_ms=10", "`rpi_ms` is no option of this link; there are monitor"),
            ("a?monitor=", "monitor=``: `` is neither an IP address"),
            (
                "a,b?monitor=c",
                "monitor names 1, the link 2: name one monitoring port for each robot",
            ),
            ("a?interval_ms=0", "interval_ms=`0`: the interval of positions in ms, 1 to 1000"),
            ("a?interval_ms=NaN", "1 to 1000"),
            ("a?watchdog_ms=1", "watchdog_ms=`1`: the time in ms after which a robot"),
            ("a?watchdog_ms=500&watchdog_ms=500", "`watchdog_ms` is given twice"),
        ];
        for (text, message) in cases {
            let error = TcpName::parse(text).expect_err(text);
            assert!(error.contains(message), "{text}: {error}");
        }
    }

    #[test]
    fn robots_in_memory_have_no_sockets() {
        let name = TcpName::parse_in_memory("tcp-sim?watchdog_ms=500").expect("good");
        assert!(name.is_in_process() && name.to_string() == "tcp-sim?watchdog_ms=500");
        let error = TcpName::parse_in_memory("tcp-sim?monitor=a").expect_err("no sockets");
        assert!(error.contains("tcp-sim has no sockets"), "{error}");
    }
}
