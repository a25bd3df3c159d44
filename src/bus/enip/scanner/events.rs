//! What happened to a target and has not been told yet.

use super::ScannerEvent;

/// Events that are kept; more than one opening and its failure produce.
const CAPACITY: usize = 8;

/// The newest events of a target. A caller that does not ask loses the oldest.
#[derive(Debug, Default)]
pub(super) struct EventQueue {
    events: [Option<ScannerEvent>; CAPACITY],
}

impl EventQueue {
    pub(super) fn push(&mut self, event: ScannerEvent) {
        if self.events.last().is_some_and(Option::is_some) {
            self.pop();
        }
        if let Some(place) = self.events.iter_mut().find(|place| place.is_none()) {
            *place = Some(event);
        }
    }

    pub(super) fn pop(&mut self) -> Option<ScannerEvent> {
        let event = self.events.first_mut()?.take()?;
        self.events.rotate_left(1);
        Some(event)
    }
}
