//! Where a port of the text interface is, as a person writes it.

use core::net::{IpAddr, SocketAddr};
use core::str::FromStr;
use std::prelude::v1::*;

/// `ADDR` or `ADDR:PORT`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::cli) struct Place {
    pub(in crate::cli) address: IpAddr,
    /// `None` is the usual one.
    pub(in crate::cli) port: Option<u16>,
}

impl Place {
    /// With `usual` where no port was given.
    pub(in crate::cli) fn with_port(self, usual: u16) -> SocketAddr {
        SocketAddr::new(self.address, self.port.unwrap_or(usual))
    }
}

impl FromStr for Place {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Ok(address) = text.parse() {
            return Ok(Self { address, port: None });
        }
        let whole: SocketAddr = text.parse().map_err(|_| {
            "an IP address, with a port behind it if need be: 192.168.0.100, 127.0.0.1:10000, \
             [::1]:10000"
        })?;
        Ok(Self { address: whole.ip(), port: Some(whole.port()) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_may_bring_its_port() {
        let read = |text: &str| text.parse::<Place>().map(|place| place.with_port(10_000));
        for (text, place) in [
            ("127.0.0.1", "127.0.0.1:10000"),
            ("127.0.0.1:0", "127.0.0.1:0"),
            ("::1", "[::1]:10000"),
            ("[::1]:7", "[::1]:7"),
        ] {
            assert_eq!(read(text), Ok(place.parse().unwrap()), "{text}");
        }
        for text in ["", "robot", "127.0.0.1:", "127.0.0.1:65536", "127.0.0", ":10000"] {
            assert!(read(text).unwrap_err().contains("an IP address"), "{text}");
        }
    }
}
