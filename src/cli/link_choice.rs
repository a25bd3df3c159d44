//! `--link`: which way to the robots.

use core::fmt;
use std::prelude::v1::*;

use super::enip::link_name::{EnipName, EnipOptions};
use super::link_text::split_query;
use super::order::OrderName;
use super::text::link_name::TcpName;
use crate::link::ethercat::RobotAddress;

/// What `--link` takes, for messages about what it does not.
const CHOICES: &str = "sim, ethercat-sim, ethercat:IFACE[:POSITION], enip-sim, enip:ADDR, tcp-sim and \
                       tcp:ADDR";
/// Longest name of a network interface on Linux, in bytes.
const LONGEST_INTERFACE: usize = 15;

/// A way to the robots.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum LinkChoice {
    /// Virtual robots in this process, without a bus.
    Sim,
    /// Virtual robots in this process, behind the whole EtherCAT stack.
    EthercatSim,
    /// The robots on the EtherCAT segment of a network interface.
    Ethercat {
        /// Name of the interface.
        interface: String,
        /// Which subdevice of the segment; `None` means the first robots there are.
        position: Option<RobotAddress>,
    },
    /// Virtual robots in this process, behind the whole EtherNet/IP stack.
    EnipSim {
        /// How they are connected to.
        options: EnipOptions,
        /// The name as it was given.
        text: String,
    },
    /// Robots on EtherNet/IP.
    Enip(EnipName),
    /// Robots on the text interface: at their addresses, or virtual ones in this process.
    Tcp(TcpName),
}

impl LinkChoice {
    /// Reads what stands behind `--link`.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let (name, rest) = match text.split_once(':') {
            Some((name, rest)) => (name, Some(rest)),
            None => (text, None),
        };
        if let Some(rest) = text.strip_prefix("enip:") {
            return EnipName::parse(rest).map(Self::Enip);
        }
        if let ("enip-sim", query) = split_query(text) {
            let options = EnipOptions::parse_in_memory(query)?;
            return Ok(Self::EnipSim { options, text: text.into() });
        }
        if let Some(rest) = text.strip_prefix("tcp:") {
            return TcpName::parse(rest).map(Self::Tcp);
        }
        if let ("tcp-sim", _) = split_query(text) {
            return TcpName::parse_in_memory(text).map(Self::Tcp);
        }
        match (name, rest) {
            ("sim", None) => Ok(Self::Sim),
            ("ethercat-sim", None) => Ok(Self::EthercatSim),
            ("sim" | "ethercat-sim", Some(_)) => {
                Err(format!("{name} has its robots in this process; nothing may follow the name"))
            }
            ("enip-sim", Some(_)) => {
                Err("enip-sim has its robots in this process: no address may \
                                          follow the name, only ?KEY=VALUE"
                    .into())
            }
            ("ethercat", rest) => Self::parse_ethercat(rest.unwrap_or_default()),
            ("enip", _) => EnipName::parse("").map(Self::Enip),
            ("tcp", _) => TcpName::parse("").map(Self::Tcp),
            ("tcp-sim", Some(_)) => {
                Err("tcp-sim has its robots in this process: no address may follow the name, only \
                     ?KEY=VALUE"
                    .into())
            }
            ("profinet", _) => {
                Err(format!("{name} is coming in a later version; for now there are {CHOICES}"))
            }
            _ => Err(format!("for now there are {CHOICES}; profinet is coming")),
        }
    }

    fn parse_ethercat(rest: &str) -> Result<Self, String> {
        let (interface, position) = match rest.split_once(':') {
            Some((interface, position)) => (interface, Some(position)),
            None => (rest, None),
        };
        if interface.is_empty() {
            return Err("ethercat needs the name of a network interface, as in ethercat:eth0; \
                        ethercat-sim needs none"
                .into());
        }
        let is_wrong = |c: char| c.is_whitespace() || c.is_control() || c == '/';
        if interface.len() > LONGEST_INTERFACE || interface.contains(is_wrong) {
            return Err(format!(
                "`{interface}` cannot be the name of a network interface: 1 to \
                 {LONGEST_INTERFACE} bytes without blanks and slashes"
            ));
        }
        let position = position.map(parse_position).transpose()?;
        Ok(Self::Ethercat { interface: interface.into(), position })
    }

    /// Whether the robots are virtual ones in this process, whose time may be simulated.
    pub(super) const fn is_in_process(&self) -> bool {
        match self {
            Self::Sim | Self::EthercatSim | Self::EnipSim { .. } => true,
            Self::Tcp(name) => name.is_in_process(),
            Self::Ethercat { .. } | Self::Enip(_) => false,
        }
    }

    /// The order that virtual robots speak behind this link unless they are told another.
    pub(super) const fn sim_byte_order(&self) -> OrderName {
        match self {
            Self::Sim => OrderName::Big,
            // As seen on a real robot; the manual says big.
            Self::EthercatSim | Self::Ethercat { .. } => OrderName::Little,
            // What the vendor's PLC projects for this bus point to.
            Self::EnipSim { .. } | Self::Enip(_) => OrderName::Little,
            // Text has none.
            Self::Tcp(_) => OrderName::Big,
        }
    }

    /// How connections shall be, where the link is EtherNet/IP: there the robot decides the period.
    pub(super) const fn enip_options(&self) -> Option<&EnipOptions> {
        match self {
            Self::EnipSim { options, .. } | Self::Enip(EnipName { options, .. }) => Some(options),
            Self::Sim | Self::EthercatSim | Self::Ethercat { .. } | Self::Tcp(_) => None,
        }
    }

    /// The text interface, where the link is one: it has neither cycles nor images.
    pub(super) const fn tcp(&self) -> Option<&TcpName> {
        match self {
            Self::Tcp(name) => Some(name),
            _ => None,
        }
    }
}

/// All digits, so that `+1` is as wrong as `-1`.
fn parse_position(text: &str) -> Result<RobotAddress, String> {
    if let Some(alias) = text.strip_prefix("alias=") {
        return match alias.parse() {
            Ok(alias) if alias != 0 => Ok(RobotAddress::Alias(alias)),
            _ => Err(format!("`{alias}` is no alias: a number from 1 to {}", u16::MAX)),
        };
    }
    let is_number = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    text.parse().ok().filter(|_| is_number).map(RobotAddress::Position).ok_or_else(|| {
        format!(
            "`{text}` is no position on the segment: a number from 0 to {}, counted from the \
             interface, or alias=N",
            u16::MAX
        )
    })
}

impl fmt::Display for LinkChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sim => f.write_str("sim"),
            Self::EthercatSim => f.write_str("ethercat-sim"),
            Self::Ethercat { interface, position: None } => write!(f, "ethercat:{interface}"),
            Self::Ethercat { interface, position: Some(position) } => match position {
                RobotAddress::Position(position) => {
                    write!(f, "ethercat:{interface}:{position}")
                }
                RobotAddress::Alias(alias) => {
                    write!(f, "ethercat:{interface}:alias={alias}")
                }
            },
            Self::EnipSim { text, .. } => f.write_str(text),
            Self::Enip(name) => name.fmt(f),
            Self::Tcp(name) => name.fmt(f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_right_reads_back_as_it_was_written() {
        let ethercat = |position| LinkChoice::Ethercat { interface: "eth0".into(), position };
        let choices = [
            ("sim", LinkChoice::Sim),
            ("ethercat-sim", LinkChoice::EthercatSim),
            ("ethercat:eth0", ethercat(None)),
            ("ethercat:eth0:0", ethercat(Some(RobotAddress::Position(0)))),
            ("ethercat:eth0:65535", ethercat(Some(RobotAddress::Position(65_535)))),
            ("ethercat:eth0:alias=7", ethercat(Some(RobotAddress::Alias(7)))),
        ];
        for (text, choice) in choices {
            assert_eq!(LinkChoice::parse(text), Ok(choice.clone()), "{text}");
            assert_eq!(choice.to_string(), text);
        }
        for text in ["tcp-sim", "tcp-sim?interval_ms=5", "tcp:127.0.0.1,[::1]:7?watchdog_ms=500"] {
            let choice = LinkChoice::parse(text).expect(text);
            assert!(choice.tcp().is_some() && choice.enip_options().is_none(), "{text}");
            assert_eq!(choice.is_in_process(), text.starts_with("tcp-sim"), "{text}");
            assert_eq!(choice.to_string(), text);
        }
        for text in ["enip-sim", "enip-sim?rpi_ms=2", "enip:127.0.0.1-4?t2o=multicast"] {
            let choice = LinkChoice::parse(text).expect(text);
            assert!(choice.enip_options().is_some(), "{text}");
            assert_eq!(choice.to_string(), text);
        }
    }

    #[test]
    fn virtual_robots_speak_as_robots_on_that_link_do() {
        for (text, order) in [
            ("sim", OrderName::Big),
            ("ethercat-sim", OrderName::Little),
            ("enip-sim", OrderName::Little),
        ] {
            let link = LinkChoice::parse(text).expect(text);
            assert_eq!(link.sim_byte_order(), order, "{text}");
            assert!(link.is_in_process(), "{text}");
        }
        for text in ["ethercat:eth0", "enip:127.0.0.1"] {
            assert!(!LinkChoice::parse(text).is_ok_and(|link| link.is_in_process()), "{text}");
        }
    }

    #[test]
    fn what_is_wrong_is_told_with_what_would_be_right() {
        let cases = [
            ("ethercat", "needs the name of a network interface, as in ethercat:eth0"),
            ("ethercat:", "needs the name of a network interface"),
            ("ethercat::1", "needs the name of a network interface"),
            ("ethercat:eth0:", "`` is no position on the segment: a number from 0 to 65535"),
            ("ethercat:eth0:x", "`x` is no position"),
            ("ethercat:eth0:-1", "`-1` is no position"),
            ("ethercat:eth0:+1", "`+1` is no position"),
            ("ethercat:eth0:alias=0", "`0` is no alias: a number from 1 to 65535"),
            ("ethercat:eth0:alias=x", "`x` is no alias"),
            ("ethercat:eth0:65536", "`65536` is no position"),
            ("ethercat:eth0:1:2", "`1:2` is no position"),
            ("ethercat:e t", "`e t` cannot be the name of a network interface"),
            ("ethercat:/dev/eth0", "cannot be the name of a network interface"),
            ("ethercat:abcdefghijklmnop", "1 to 15 bytes"),
            ("sim:0", "sim has its robots in this process"),
            ("ethercat-sim:eth0", "ethercat-sim has its robots in this process"),
            ("enip", "enip needs the address of a robot, as in enip:192.168.0.100"),
            ("enip:", "enip needs the address of a robot"),
            ("enip?rpi_ms=10", "for now there are sim"),
            ("enip:arm?rpi=10", "`rpi` is no option of this link; there are rpi_ms, multiplier"),
            ("enip-sim:arm", "enip-sim has its robots in this process: no address may follow"),
            ("enip-sim?bind=1.2.3.4", "enip-sim has no sockets, so `bind` means nothing"),
            ("profinet:eth0", "profinet is coming"),
            ("tcp", "tcp needs the address of a robot, as in tcp:192.168.0.100"),
            ("tcp:", "tcp needs the address of a robot"),
            ("tcp:arm?rpi_ms=10", "`rpi_ms` is no option of this link; there are monitor"),
            ("tcp-sim:arm", "tcp-sim has its robots in this process: no address may follow"),
            ("tcp-sim?monitor=arm", "tcp-sim has no sockets"),
            (
                "usb",
                "for now there are sim, ethercat-sim, ethercat:IFACE[:POSITION], enip-sim, enip:ADDR, \
                 tcp-sim and tcp:ADDR",
            ),
            ("", "for now there are sim"),
        ];
        for (text, message) in cases {
            let error = LinkChoice::parse(text).expect_err(text);
            assert!(error.contains(message), "{text}: {error}");
        }
    }
}
