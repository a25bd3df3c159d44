//! Events about the robot's state: the difference between what was said and what is.
//!
//! Invariants: events of one kind alternate; what could not be said for want of room is said later
//! from the difference, and changes that took themselves back meanwhile are counted as merged.

use super::event::{Event, Events};
use super::inputs::Inputs;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::image::{MotionStatusFlags, SafetySignals};

/// What the caller was told last, and what the robot showed last.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Watch {
    said: Shown,
    seen: Shown,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Shown {
    error_code: u16,
    stops: SafetySignals,
    motion: MotionStatusFlags,
}

const WATCHED: MotionStatusFlags = MotionStatusFlags::PAUSED.union(MotionStatusFlags::CLEARED);

impl Watch {
    #[inline]
    pub(super) fn see(&mut self, inputs: &Inputs, events: &mut Events) {
        let shown = Shown {
            error_code: inputs.error_code,
            stops: inputs.stops,
            motion: inputs.motion.intersection(WATCHED),
        };
        if shown == self.said {
            if self.seen != self.said {
                events.merge();
            }
            self.seen = shown;
        } else {
            self.see_change(shown, events);
        }
    }

    fn see_change(&mut self, shown: Shown, events: &mut Events) {
        if self.seen != self.said && self.seen != shown {
            events.merge();
        }
        self.seen = shown;
        self.say(shown, events);
    }

    fn say(&mut self, shown: Shown, events: &mut Events) {
        if shown.error_code != self.said.error_code {
            let event = match shown.error_code {
                0 => Event::RobotErrorCleared,
                code => Event::RobotError { code: Code(code) },
            };
            if !events.state(event) {
                return;
            }
            self.said.error_code = shown.error_code;
        }
        if shown.stops != self.said.stops {
            let event = if shown.stops.is_empty() {
                Event::SafetyCleared
            } else {
                Event::SafetyStop { signals: shown.stops }
            };
            if !events.state(event) {
                return;
            }
            self.said.stops = shown.stops;
        }
        let changed = shown.motion.symmetric_difference(self.said.motion);
        if changed.contains(MotionStatusFlags::PAUSED) {
            let paused = shown.motion.contains(MotionStatusFlags::PAUSED);
            if !events.state(if paused { Event::Paused } else { Event::Resumed }) {
                return;
            }
            self.said.motion.set(MotionStatusFlags::PAUSED, paused);
        }
        if changed.contains(MotionStatusFlags::CLEARED) {
            let cleared = shown.motion.contains(MotionStatusFlags::CLEARED);
            if cleared && !events.state(Event::Cleared) {
                return;
            }
            self.said.motion.set(MotionStatusFlags::CLEARED, cleared);
        }
    }
}
