//! What people read about connections to a robot's two ports.

use core::net::SocketAddr;
use std::prelude::v1::*;

use crate::bus::text::server::{CloseReason, Peer};
use crate::link::text::{Port, ServerEvent};

/// Puts what happened into words, with the addresses of those who are connected.
#[derive(Debug, Default)]
pub(super) struct Narrator {
    connected: Vec<(Peer, SocketAddr)>,
}

impl Narrator {
    /// One line about what happened.
    pub(super) fn line(&mut self, event: ServerEvent) -> String {
        match event {
            ServerEvent::Connected { peer, from } => {
                self.connected.retain(|(other, _)| *other != peer);
                self.connected.push((peer, from));
                format!("{} of {from} opened", kind(peer))
            }
            ServerEvent::SentAway { port: Port::Control, from } => {
                format!(
                    "refused the control connection of {from}: somebody else controls the robot"
                )
            }
            ServerEvent::SentAway { port: Port::Monitoring, from } => {
                format!("refused the monitoring connection of {from}: there are too many")
            }
            ServerEvent::Disconnected { peer, reason } => {
                let place = self.connected.iter().position(|(other, _)| *other == peer);
                let from = match place.map(|place| self.connected.swap_remove(place)) {
                    Some((_, from)) => format!(" of {from}"),
                    None => String::new(),
                };
                let why = match reason {
                    None => "",
                    Some(CloseReason::Overfull) => ": it did not read what the robot said",
                    Some(CloseReason::PortsClosed) => ": the robot closed its ports",
                    Some(CloseReason::Dropped) => ": its connection watchdog ran out",
                };
                format!("{}{from} closed{why}", kind(peer))
            }
        }
    }
}

const fn kind(peer: Peer) -> &'static str {
    match peer {
        Peer::Control => "control connection",
        Peer::Monitor(_) => "monitoring connection",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_leaves_is_named_as_who_came() {
        let mut narrator = Narrator::default();
        let [first, second] =
            ["127.0.0.1:5000", "127.0.0.1:5001"].map(|from| from.parse().unwrap());
        let monitor = Peer::Monitor(0);
        let events = [
            ServerEvent::Connected { peer: Peer::Control, from: first },
            ServerEvent::Connected { peer: monitor, from: second },
            ServerEvent::SentAway { port: Port::Control, from: second },
            ServerEvent::Disconnected { peer: Peer::Control, reason: Some(CloseReason::Dropped) },
            ServerEvent::Disconnected { peer: monitor, reason: None },
        ];
        let lines = events.map(|event| narrator.line(event));
        assert_eq!(
            lines,
            [
                "control connection of 127.0.0.1:5000 opened",
                "monitoring connection of 127.0.0.1:5001 opened",
                "refused the control connection of 127.0.0.1:5001: somebody else controls the robot",
                "control connection of 127.0.0.1:5000 closed: its connection watchdog ran out",
                "monitoring connection of 127.0.0.1:5001 closed",
            ]
        );
    }
}
