//! What all TCP connections of an adapter act on: its connections, productions and images.

use core::net::{Ipv4Addr, SocketAddrV4};

use super::connection::{Connection, Connections};
use super::events::Events;
use super::ids::Ids;
use super::produce::{Inputs, Productions};
use super::{Access, AdapterEvent, AdapterSettings, MAX_IMAGE_LEN, StreamId};
use crate::time::Instant;
use crate::wire::enip::connection::Triad;
use crate::wire::enip::identity::Identity;
use crate::wire::enip::io::IoFrame;

/// What the connection manager has counted; all stay at their greatest value.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counters {
    pub(super) opens: u16,
    pub(super) malformed_opens: u16,
    pub(super) opens_without_room: u16,
    pub(super) refused_opens: u16,
    pub(super) closes: u16,
    pub(super) malformed_closes: u16,
    pub(super) refused_closes: u16,
    pub(super) timeouts: u16,
}

pub(super) const fn count(counter: &mut u16) {
    *counter = counter.saturating_add(1);
}

/// The adapter without its TCP connections.
#[derive(Debug)]
pub(super) struct Target {
    pub(super) settings: AdapterSettings,
    pub(super) address: Ipv4Addr,
    pub(super) access: Access,
    pub(super) is_controlled_elsewhere: bool,
    pub(super) ids: Ids,
    pub(super) connections: Connections,
    pub(super) productions: Productions,
    pub(super) inputs: Inputs,
    outputs: [u8; MAX_IMAGE_LEN],
    pub(super) counters: Counters,
    pub(super) events: Events,
}

/// How a connection ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ending {
    Closed,
    TimedOut,
}

impl Target {
    pub(super) fn new(settings: AdapterSettings, address: Ipv4Addr, seed: u64) -> Self {
        let longest = u16::try_from(MAX_IMAGE_LEN).unwrap_or(u16::MAX);
        let settings = AdapterSettings {
            output_len: settings.output_len.min(longest),
            input_len: settings.input_len.min(longest),
            ..settings
        };
        Self {
            settings,
            address,
            access: settings.access,
            is_controlled_elsewhere: false,
            ids: Ids::new(seed),
            connections: Connections::new(),
            productions: Productions::new(),
            inputs: Inputs::new(usize::from(settings.input_len)),
            outputs: [0; MAX_IMAGE_LEN],
            counters: Counters::default(),
            events: Events::new(),
        }
    }

    /// As after a power cycle; what may be opened and the counting of ids stay.
    pub(super) fn restart(&mut self, seed: u64) {
        self.ids.restart(seed);
        self.is_controlled_elsewhere = false;
        self.connections = Connections::new();
        self.productions = Productions::new();
        self.inputs = Inputs::new(usize::from(self.settings.input_len));
        self.outputs = [0; MAX_IMAGE_LEN];
        self.counters = Counters::default();
        self.events = Events::new();
    }

    /// Who the adapter is at this moment: the status word says whether it is owned and how its connections
    /// are.
    ///
    /// Source: CIP volume 1, chapter 5: bit 0 owned; bits 4 to 7: 3 no I/O connection, 6 at least one
    /// runs, 7 all idle.
    pub(super) fn identity(&self) -> Identity {
        const OWNED: u16 = 1;
        const STATE: u16 = 0x00F0;
        let owner = self.connections.owner();
        let state = match (owner, self.connections.iter().next()) {
            (Some(owner), _) if owner.is_running => 0x60,
            (_, Some(_)) => 0x70,
            (_, None) => 0x30,
        };
        let fixed = self.settings.identity.status & !(OWNED | STATE);
        let status = fixed | state | u16::from(owner.is_some());
        Identity { status, ..self.settings.identity }
    }

    /// An id that no connection has.
    pub(super) fn fresh_id(&mut self) -> u32 {
        let mut id = self.ids.next();
        // Each connection can be in the way twice at most.
        for _ in 0..2 * super::CONNECTIONS {
            let is_taken = |other: &Connection| id == other.o2t_id || id == other.t2o_id;
            if !self.connections.iter().any(is_taken) {
                break;
            }
            id = self.ids.next();
        }
        id
    }

    /// Bytes of the output image.
    pub(super) fn output_len(&self) -> usize {
        usize::from(self.settings.output_len)
    }

    /// The outputs of an owner that runs.
    pub(super) fn outputs(&self) -> Option<&[u8]> {
        self.connections.owner().filter(|owner| owner.is_running)?;
        self.outputs.get(..self.output_len())
    }

    /// Takes a class 1 frame.
    pub(super) fn consume(&mut self, now: Instant, from: SocketAddrV4, datagram: &[u8]) {
        let Ok(frame) = IoFrame::read(datagram) else { return };
        let output_len = self.output_len();
        let connection = self.connections.find_mut(|connection| {
            connection.o2t_id == frame.connection_id
                && connection.originator.ip() == from.ip()
                && connection.ends_at.is_some()
        });
        let Some(consumed) = connection.and_then(|it| it.consume(now, &frame, output_len)) else {
            return;
        };
        if let Some(image) = consumed.image
            && let Some(outputs) = self.outputs.get_mut(..image.len())
        {
            outputs.copy_from_slice(image);
        }
        if let Some(is_running) = consumed.run_changed {
            self.events.push(AdapterEvent::RunChanged { is_running });
        }
    }

    /// Whether there is a connection that was opened over the TCP connection with `peer`.
    pub(super) fn has_opened(&self, peer: SocketAddrV4) -> bool {
        self.connections.iter().any(|connection| connection.originator == peer)
    }

    /// Ends connections whose watchdog has expired.
    pub(super) fn expire(&mut self, now: Instant) {
        while self.end(Ending::TimedOut, |it| it.ends_at.is_some_and(|end| end <= now)) {
            count(&mut self.counters.timeouts);
        }
    }

    /// Ends the connection with `triad`; whether there was one.
    pub(super) fn close(&mut self, triad: Triad) -> bool {
        self.end(Ending::Closed, |connection| connection.triad == triad)
    }

    /// Ends connections that nothing but `stream` kept alive.
    pub(super) fn close_bound_to(&mut self, stream: StreamId) {
        while self.end(Ending::Closed, |it| it.bound_to == Some(stream)) {}
    }

    /// Ends the owner.
    pub(super) fn close_owner(&mut self) {
        self.end(Ending::Closed, Connection::is_owner);
    }

    /// Ends everything.
    pub(super) fn close_all(&mut self) {
        while self.end(Ending::Closed, |_| true) {}
    }

    /// Ends the first connection that `is_meant` finds, those that listened to it and to nobody else, and
    /// productions that nobody needs any more; whether one was found.
    fn end(&mut self, how: Ending, is_meant: impl Fn(&Connection) -> bool) -> bool {
        let Some(ended) = self.connections.take(is_meant) else { return false };
        let status = ended.status();
        self.events.push(match how {
            Ending::Closed => AdapterEvent::Closed(status),
            Ending::TimedOut => AdapterEvent::TimedOut(status),
        });
        self.end_listeners();
        let connections = &self.connections;
        let is_needed = |place| connections.iter().any(|other| other.production == place);
        self.productions.retain(is_needed);
        true
    }

    /// Ends who only listens and has nobody to listen to: on a group, nobody else on this group; alone,
    /// nobody else at all.
    fn end_listeners(&mut self) {
        loop {
            let triad = self.connections.iter().find(|it| !self.is_kept(it)).map(|it| it.triad);
            let Some(triad) = triad else { return };
            let Some(ended) = self.connections.take(|it| it.triad == triad) else { return };
            self.events.push(AdapterEvent::Closed(ended.status()));
        }
    }

    fn is_kept(&self, connection: &Connection) -> bool {
        let mut others = self.connections.iter().filter(|other| other.is_listened_to());
        connection.is_listened_to()
            || others
                .any(|other| !connection.is_multicast || other.production == connection.production)
    }
}
