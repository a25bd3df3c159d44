//! What happened and nobody has asked about yet.

use super::AdapterEvent;

/// Events that are kept; of more, the oldest are forgotten.
const EVENTS: usize = 32;

#[derive(Debug)]
pub(super) struct Events {
    /// Oldest first, without gaps.
    places: [Option<AdapterEvent>; EVENTS],
}

impl Events {
    pub(super) const fn new() -> Self {
        Self { places: [None; EVENTS] }
    }

    pub(super) fn push(&mut self, event: AdapterEvent) {
        if self.places.iter().all(Option::is_some) {
            self.pop();
        }
        if let Some(place) = self.places.iter_mut().find(|place| place.is_none()) {
            *place = Some(event);
        }
    }

    pub(super) fn pop(&mut self) -> Option<AdapterEvent> {
        let event = self.places.first_mut()?.take()?;
        self.places.rotate_left(1);
        Some(event)
    }
}
