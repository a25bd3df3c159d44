//! Forward Open and Forward Close.

use core::net::SocketAddrV4;

use super::AdapterEvent;
use super::connection::Connection;
use super::explicit::{Origin, Outcome};
use super::multicast;
use super::open::{self, Plan, Refused};
use super::produce::Production;
use super::target::{Target, count};
use crate::time::{Duration, Instant};
use crate::wire::enip::bytes::Reader;
use crate::wire::enip::connection::{
    ConnectionRefusal, ForwardClose, ForwardCloseReply, ForwardOpen, ForwardOpenReply, Triad,
};
use crate::wire::enip::status::{ExtendedStatus, GeneralStatus};
use crate::wire::enip::{DecodeError, IO_PORT};

/// The status of a request that cannot be read.
pub(super) const fn malformed(error: DecodeError) -> GeneralStatus {
    match error {
        DecodeError::Truncated { .. } => GeneralStatus::NOT_ENOUGH_DATA,
        DecodeError::Trailing { .. } => GeneralStatus::TOO_MUCH_DATA,
        DecodeError::Value { .. } => GeneralStatus::CONNECTION_FAILURE,
    }
}

impl Target {
    /// Opens a connection, or says why not.
    pub(super) fn forward_open(
        &mut self,
        now: Instant,
        origin: Origin,
        data: &[u8],
        is_large: bool,
        room: &mut [u8],
    ) -> Outcome {
        count(&mut self.counters.opens);
        let open = match ForwardOpen::read(data, is_large) {
            Ok(open) => open,
            Err(error) => {
                count(&mut self.counters.malformed_opens);
                let general = malformed(error);
                if general != GeneralStatus::CONNECTION_FAILURE {
                    self.tell_refused(origin, general, ExtendedStatus(0));
                    return Outcome::refusal(general);
                }
                // Whole but for a value out of range: the multiplier.
                let refused = Refused::new(ExtendedStatus::INVALID_PARAMETERS);
                return self.refuse(origin, triad_of(data), refused, room);
            }
        };
        let opened = match open::check(&open, self) {
            Ok(plan) => self.open(now, origin, &open, plan),
            Err(refused) => Err(refused),
        };
        let (connection, group) = match opened {
            Ok(opened) => opened,
            Err(refused) => {
                count(match refused.status {
                    ExtendedStatus::OUT_OF_CONNECTIONS => &mut self.counters.opens_without_room,
                    _ => &mut self.counters.refused_opens,
                });
                return self.refuse(origin, open.triad, refused, room);
            }
        };
        let reply = ForwardOpenReply {
            o2t_id: connection.o2t_id,
            t2o_id: connection.t2o_id,
            triad: connection.triad,
            o2t_api_us: micros(connection.o2t_api),
            t2o_api_us: micros(connection.t2o_api),
            application: &[],
        };
        Outcome { t2o_address: group, ..Outcome::written(reply.write(room)) }
    }

    fn refuse(
        &mut self,
        origin: Origin,
        triad: Triad,
        refused: Refused,
        room: &mut [u8],
    ) -> Outcome {
        self.tell_refused(origin, GeneralStatus::CONNECTION_FAILURE, refused.status);
        refusal(triad, refused, room)
    }

    fn tell_refused(&mut self, origin: Origin, general: GeneralStatus, extended: ExtendedStatus) {
        let originator = origin.peer;
        self.events.push(AdapterEvent::Refused { originator, general, extended });
    }

    /// Does what `plan` says; the connection, and its group if it has one.
    fn open(
        &mut self,
        now: Instant,
        origin: Origin,
        open: &ForwardOpen<'_>,
        plan: Plan,
    ) -> Result<(Connection, Option<SocketAddrV4>), Refused> {
        let o2t_id = self.fresh_id();
        let production = match plan.joined {
            Some(place) => Some(place),
            None => {
                let one = self.new_production(now, origin, open, plan, o2t_id);
                one.and_then(|one| self.productions.add(one))
            }
        };
        let found = production.and_then(|place| Some((place, *self.productions.get(place)?)));
        // Unreachable: there is a place for each connection.
        let (production, produced) =
            found.ok_or(Refused::new(ExtendedStatus::OUT_OF_CONNECTIONS))?;
        let timeout = plan.o2t_api.saturating_mul(open.multiplier.factor());
        let first = timeout.max(self.settings.initial_watchdog);
        let connection = Connection {
            kind: plan.kind,
            triad: open.triad,
            originator: origin.peer,
            o2t_id,
            t2o_id: produced.id,
            o2t_api: plan.o2t_api,
            t2o_api: produced.api,
            production,
            is_multicast: plan.is_multicast,
            bound_to: (!plan.has_o2t).then_some(origin.stream),
            timeout,
            ends_at: plan.has_o2t.then_some(now + first),
            is_running: false,
            sequence: None,
            data_sequence: None,
        };
        self.connections.add(connection);
        self.events.push(AdapterEvent::Opened(connection.status()));
        Ok((connection, plan.is_multicast.then_some(produced.to)))
    }

    fn new_production(
        &mut self,
        now: Instant,
        origin: Origin,
        open: &ForwardOpen<'_>,
        plan: Plan,
        o2t_id: u32,
    ) -> Option<Production> {
        if plan.is_multicast {
            let number = self.productions.free_group()?;
            let first = multicast::first_group(self.address, self.settings.netmask);
            let to = SocketAddrV4::new(multicast::group(first, number), IO_PORT);
            // Not in the table yet, so `fresh_id` does not see it.
            let mut id = self.fresh_id();
            if id == o2t_id {
                id = self.fresh_id();
            }
            return Some(Production::new(now, id, to, plan.t2o_api, Some(number)));
        }
        // Only the port is taken from the request: frames go to nobody but the one who asked.
        let port = origin.t2o_address.map(|address| address.port()).filter(|port| *port != 0);
        let to = SocketAddrV4::new(*origin.peer.ip(), port.unwrap_or(IO_PORT));
        Some(Production::new(now, open.t2o_id, to, plan.t2o_api, None))
    }

    /// Closes a connection, whoever opened it and with whichever path.
    pub(super) fn forward_close(&mut self, data: &[u8], room: &mut [u8]) -> Outcome {
        count(&mut self.counters.closes);
        let triad = match ForwardClose::read(data) {
            Ok(close) => close.triad,
            Err(error) => {
                count(&mut self.counters.malformed_closes);
                return Outcome::refusal(malformed(error));
            }
        };
        if !self.close(triad) {
            count(&mut self.counters.refused_closes);
            return refusal(triad, Refused::new(ExtendedStatus::NOT_FOUND), room);
        }
        Outcome::written(ForwardCloseReply { triad, application: &[] }.write(room))
    }
}

/// A refusal with what the standard wants behind it.
fn refusal(triad: Triad, refused: Refused, room: &mut [u8]) -> Outcome {
    let bytes =
        ConnectionRefusal { triad, remaining_path_words: refused.remaining_words }.to_bytes();
    let Some(place) = room.first_chunk_mut() else {
        return Outcome::refusal(GeneralStatus::REPLY_TOO_LARGE);
    };
    *place = bytes;
    Outcome {
        extended: [Some(refused.status.0), refused.size],
        len: bytes.len(),
        ..Outcome::refusal(GeneralStatus::CONNECTION_FAILURE)
    }
}

/// The triad of a Forward Open that is long enough, though not right.
fn triad_of(data: &[u8]) -> Triad {
    let mut reader = Reader::new("Forward Open", data);
    let mut read = || {
        // Priority, ticks and both ids stand in front.
        reader.take("front", 10)?;
        Ok::<_, DecodeError>(Triad {
            connection_serial: reader.u16("connection serial number")?,
            vendor: reader.u16("originator vendor")?,
            originator_serial: reader.u32("originator serial number")?,
        })
    };
    read().unwrap_or_default()
}

/// An interval as it stands in a reply; it came from such a field.
fn micros(interval: Duration) -> u32 {
    u32::try_from(interval.as_micros()).unwrap_or(u32::MAX)
}
