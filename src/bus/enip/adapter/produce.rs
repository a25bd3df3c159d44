//! T->O frames: what is produced, for whom, and when.
//!
//! What serves the owner, alone or among others of its group, carries the owner's view of the inputs; all
//! else carries that of who only monitors, a group whose owner has left too. Otherwise an originator whose
//! O->T frames got lost, and who still hears its group, would believe for ever that it controls the robot.
//!
//! When a frame leaves is said in `deadlines`.
//!
//! Every frame counts up the encapsulation sequence number. The sequence count of the data counts up with
//! the first frame after new inputs were set, equal or not, or the view changed, and stays while there are none: a consumer sees
//! by it whether the robot still lives. Source: choice; the standard lets the producer say what is new.

use core::net::SocketAddrV4;

use super::{CONNECTIONS, MAX_IMAGE_LEN};
use crate::bus::enip::deadlines::Deadlines;
use crate::time::{Duration, Instant};
use crate::wire::enip::io::IoFrame;

/// Which inputs are produced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum View {
    Controlling,
    Monitoring,
}

/// The newest inputs, in both views.
#[derive(Debug)]
pub(super) struct Inputs {
    controlling: [u8; MAX_IMAGE_LEN],
    monitoring: [u8; MAX_IMAGE_LEN],
    len: usize,
    /// How often they were set.
    generation: u64,
}

impl Inputs {
    /// Zeros. `len` is at most [`MAX_IMAGE_LEN`].
    pub(super) const fn new(len: usize) -> Self {
        Self { controlling: [0; MAX_IMAGE_LEN], monitoring: [0; MAX_IMAGE_LEN], len, generation: 0 }
    }

    pub(super) fn set(&mut self, controlling: &[u8], monitoring: &[u8]) {
        if controlling.len() != self.len || monitoring.len() != self.len {
            return;
        }
        let views = [(&mut self.controlling, controlling), (&mut self.monitoring, monitoring)];
        for (room, image) in views {
            if let Some(room) = room.get_mut(..image.len()) {
                room.copy_from_slice(image);
            }
        }
        self.generation += 1;
    }

    pub(super) fn view(&self, view: View) -> &[u8] {
        let image = match view {
            View::Controlling => &self.controlling,
            View::Monitoring => &self.monitoring,
        };
        image.get(..self.len).unwrap_or_default()
    }
}

/// One stream of T->O frames, for one connection or for all of a group.
#[derive(Clone, Copy, Debug)]
pub(super) struct Production {
    /// Id of the connection, as its consumers know it.
    pub(super) id: u32,
    pub(super) to: SocketAddrV4,
    pub(super) api: Duration,
    /// Number of the group, if it goes to one.
    pub(super) group: Option<u16>,
    deadlines: Deadlines,
    sequence: u32,
    data_sequence: u16,
    /// View and generation of the inputs that went out last; `None` before the first frame, which counts as
    /// new.
    last: Option<(View, u64)>,
}

impl Production {
    /// One whose first frame is due now.
    pub(super) const fn new(
        now: Instant,
        id: u32,
        to: SocketAddrV4,
        api: Duration,
        group: Option<u16>,
    ) -> Self {
        let deadlines = Deadlines::new(now, api);
        Self { id, to, api, group, deadlines, sequence: 0, data_sequence: 0, last: None }
    }

    /// Writes the frame that is due, if one is: its length, and how many were given up.
    fn produce(
        &mut self,
        now: Instant,
        inputs: &Inputs,
        view: View,
        room: &mut [u8],
    ) -> Option<(usize, u64)> {
        if self.deadlines.due() > now {
            return None;
        }
        let given_up = self.deadlines.pass(now);
        if self.last.replace((view, inputs.generation)) != Some((view, inputs.generation)) {
            self.data_sequence = self.data_sequence.wrapping_add(1);
        }
        self.sequence = self.sequence.wrapping_add(1);
        let frame = IoFrame {
            connection_id: self.id,
            sequence: self.sequence,
            data_sequence: self.data_sequence,
            data: inputs.view(view),
        };
        Some((frame.write(None, room).ok()?, given_up))
    }
}

/// All of them; connections name theirs by its place.
#[derive(Debug)]
pub(super) struct Productions {
    places: [Option<Production>; CONNECTIONS],
    /// Frames whose deadlines passed in a stall too long to be made up for.
    given_up: u64,
}

impl Productions {
    pub(super) const fn new() -> Self {
        Self { places: [None; CONNECTIONS], given_up: 0 }
    }

    pub(super) fn get(&self, place: usize) -> Option<&Production> {
        self.places.get(place)?.as_ref()
    }

    /// Puts one into a free place.
    pub(super) fn add(&mut self, production: Production) -> Option<usize> {
        let place = self.places.iter().position(Option::is_none)?;
        *self.places.get_mut(place)? = Some(production);
        Some(place)
    }

    /// Ends those for which `is_needed` says no.
    pub(super) fn retain(&mut self, is_needed: impl Fn(usize) -> bool) {
        for (place, production) in self.places.iter_mut().enumerate() {
            if production.is_some() && !is_needed(place) {
                *production = None;
            }
        }
    }

    /// Those that go to groups, with their places.
    pub(super) fn multicast(&self) -> impl Iterator<Item = (usize, &Production)> {
        let all = self.places.iter().enumerate();
        all.filter_map(|(place, production)| Some((place, production.as_ref()?)))
            .filter(|(_, production)| production.group.is_some())
    }

    /// The lowest number of a group that nothing goes to.
    pub(super) fn free_group(&self) -> Option<u16> {
        (0..super::multicast::GROUPS)
            .find(|number| self.multicast().all(|(_, other)| other.group != Some(*number)))
    }

    /// When the next frame is due.
    pub(super) fn next_at(&self) -> Option<Instant> {
        self.places.iter().flatten().map(|production| production.deadlines.due()).min()
    }

    /// Writes a frame that is due into `room`: where it goes and its length. Frames for which there is no
    /// room are lost. `owners` is the place of what serves the owner.
    pub(super) fn produce(
        &mut self,
        now: Instant,
        inputs: &Inputs,
        owners: Option<usize>,
        room: &mut [u8],
    ) -> Option<(SocketAddrV4, usize)> {
        let Self { places, given_up } = self;
        places.iter_mut().enumerate().find_map(|(place, production)| {
            let production = production.as_mut()?;
            let view = if owners == Some(place) { View::Controlling } else { View::Monitoring };
            let (len, lost) = production.produce(now, inputs, view, room)?;
            *given_up = given_up.saturating_add(lost);
            Some((production.to, len))
        })
    }

    /// Frames that were given up so far.
    pub(super) const fn given_up(&self) -> u64 {
        self.given_up
    }
}
