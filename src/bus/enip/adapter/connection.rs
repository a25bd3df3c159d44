//! Open connections and what arrives on them.
//!
//! A frame is taken if its id is that of a connection, it comes from the address of the originator, its
//! size is right and its encapsulation sequence number is later than the last one (the first may be any).
//! A frame that is taken feeds the watchdog and says run or idle; its image counts only if the sequence
//! count of the data differs from the last one.

use core::net::SocketAddrV4;

use super::{CONNECTIONS, ConnectionStatus, StreamId};
use crate::bus::enip::ConnectionKind;
use crate::time::{Duration, Instant};
use crate::wire::enip::connection::Triad;
use crate::wire::enip::io::{IoFrame, is_later};

/// One connection.
#[derive(Clone, Copy, Debug)]
pub(super) struct Connection {
    pub(super) kind: ConnectionKind,
    pub(super) triad: Triad,
    /// The TCP peer that opened it.
    pub(super) originator: SocketAddrV4,
    pub(super) o2t_id: u32,
    pub(super) t2o_id: u32,
    pub(super) o2t_api: Duration,
    pub(super) t2o_api: Duration,
    /// Where its T->O frames are produced, and whether others receive the same ones.
    pub(super) production: usize,
    pub(super) is_multicast: bool,
    /// The TCP connection that it lives and dies with, because no O->T frames are agreed on.
    pub(super) bound_to: Option<StreamId>,
    /// Time without a frame that ends it.
    pub(super) timeout: Duration,
    /// When it ends, unless a frame comes; `None` if none is to come.
    pub(super) ends_at: Option<Instant>,
    pub(super) is_running: bool,
    /// Sequence number of the last frame taken.
    pub(super) sequence: Option<u32>,
    /// Sequence count of the last data taken.
    pub(super) data_sequence: Option<u16>,
}

impl Connection {
    pub(super) const fn status(&self) -> ConnectionStatus {
        ConnectionStatus {
            kind: self.kind,
            triad: self.triad,
            originator: self.originator,
            o2t_id: self.o2t_id,
            t2o_id: self.t2o_id,
            o2t_api: self.o2t_api,
            t2o_api: self.t2o_api,
            is_multicast: self.is_multicast,
            is_running: self.is_running,
        }
    }

    /// Whether it keeps inputs coming for those who only listen.
    pub(super) fn is_listened_to(&self) -> bool {
        self.kind != ConnectionKind::ListenOnly
    }

    pub(super) fn is_owner(&self) -> bool {
        self.kind == ConnectionKind::ExclusiveOwner
    }

    /// Takes a frame, or drops it: what it brought.
    pub(super) fn consume<'a>(
        &mut self,
        now: Instant,
        frame: &IoFrame<'a>,
        output_len: usize,
    ) -> Option<Consumed<'a>> {
        if self.sequence.is_some_and(|last| !is_later(frame.sequence, last)) {
            return None;
        }
        let (is_running, image) = match self.kind {
            ConnectionKind::ExclusiveOwner => {
                frame.split_run_idle().ok().filter(|(_, image)| image.len() == output_len)?
            }
            // A heartbeat: nothing behind the sequence count.
            _ if frame.data.is_empty() => (false, frame.data),
            _ => return None,
        };
        let has_changed = is_running != self.is_running;
        let is_new = self.data_sequence != Some(frame.data_sequence);
        self.is_running = is_running;
        self.sequence = Some(frame.sequence);
        self.data_sequence = Some(frame.data_sequence);
        self.ends_at = Some(now + self.timeout);
        Some(Consumed {
            image: (self.is_owner() && is_new).then_some(image),
            run_changed: has_changed.then_some(is_running),
        })
    }
}

/// What a frame brought.
pub(super) struct Consumed<'a> {
    /// New outputs.
    pub(super) image: Option<&'a [u8]>,
    /// Run after idle, or idle after run.
    pub(super) run_changed: Option<bool>,
}

/// All connections.
#[derive(Debug)]
pub(super) struct Connections {
    places: [Option<Connection>; CONNECTIONS],
}

impl Connections {
    pub(super) const fn new() -> Self {
        Self { places: [None; CONNECTIONS] }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Connection> {
        self.places.iter().flatten()
    }

    pub(super) fn owner(&self) -> Option<&Connection> {
        self.iter().find(|connection| connection.is_owner())
    }

    /// The one that `is_wanted` finds.
    pub(super) fn find_mut(
        &mut self,
        is_wanted: impl Fn(&Connection) -> bool,
    ) -> Option<&mut Connection> {
        self.places.iter_mut().flatten().find(|connection| is_wanted(connection))
    }

    /// Takes out the first that `is_wanted` finds.
    pub(super) fn take(&mut self, is_wanted: impl Fn(&Connection) -> bool) -> Option<Connection> {
        let mut places = self.places.iter_mut();
        places.find(|place| place.as_ref().is_some_and(&is_wanted))?.take()
    }

    pub(super) fn has_room(&self) -> bool {
        self.places.iter().any(Option::is_none)
    }

    /// Adds one if there is room.
    pub(super) fn add(&mut self, connection: Connection) {
        if let Some(place) = self.places.iter_mut().find(|place| place.is_none()) {
            *place = Some(connection);
        }
    }

    /// When the next watchdog expires.
    pub(super) fn ends_at(&self) -> Option<Instant> {
        self.iter().filter_map(|connection| connection.ends_at).min()
    }
}
