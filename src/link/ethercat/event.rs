//! What happens to the robots of a running segment, told once each.

use super::layout::LayoutMismatch;
use crate::wire::ethercat::al::{AlState, AlStatusCode};

/// Something that happened to one robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SegmentEvent {
    /// Number of the robot, counted from 0 in the order they were chosen.
    pub robot: usize,
    /// What happened.
    pub kind: EventKind,
}

/// What can happen to a robot's connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum EventKind {
    /// It answers in OP, but the working counter of its frame has been wrong for 20 exchanges: a robot
    /// of that frame takes no outputs or gives no inputs. Told once until the counter is right again.
    WrongCounter {
        /// 3 for each robot in OP of the frame.
        expected: u16,
        /// What came back.
        found: u16,
    },
    /// It left OP by itself, with its reason; it is being brought back.
    Fell {
        /// State it is in.
        state: AlState,
        /// Its reason.
        code: AlStatusCode,
    },
    /// It does not answer any more: off, restarting, unplugged, or behind one that is.
    Gone,
    /// It answers again after it was gone, and is being brought up.
    Returned,
    /// It is in OP again.
    BackInOp,
    /// It could not be brought back this time; the next attempt follows by itself.
    NotYetBack {
        /// State it stays in; `None` when it stopped answering on the way.
        state: Option<AlState>,
        /// Its reason, 0 if it gave none.
        code: AlStatusCode,
    },
    /// It came back with an image that cannot be used, as after a change of firmware: it is not driven
    /// any more.
    LayoutChanged(LayoutMismatch),
    /// It came back with another image than before: it is not driven any more until the link is
    /// started again.
    ImageChanged,
    /// Another device stands in its place: it is not driven any more.
    AnotherDevice,
    /// It sent an emergency message.
    Emergency {
        /// Emergency error code.
        code: u16,
        /// Error register (1001h).
        register: u8,
    },
}

impl core::fmt::Display for SegmentEvent {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "robot {}: {}", self.robot + 1, self.kind)
    }
}

impl core::fmt::Display for EventKind {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Fell { state, code } => write!(f, "fell to {state}: {code}"),
            Self::WrongCounter { expected, found } => write!(
                f,
                "the working counter of its frame stays wrong, {found} instead of {expected}: inputs \
                 are not used"
            ),
            Self::Gone => f.write_str("does not answer any more"),
            Self::Returned => f.write_str("answers again"),
            Self::BackInOp => f.write_str("back in OP"),
            Self::NotYetBack { state: None, .. } => {
                f.write_str("could not be brought to OP, as answers are missing; trying again")
            }
            Self::NotYetBack { state: Some(state), code } => {
                write!(f, "could not be brought to OP and is in {state} ({code}); trying again")
            }
            Self::LayoutChanged(mismatch) => {
                write!(f, "came back with another image and is left alone: {mismatch}")
            }
            Self::ImageChanged => {
                f.write_str("came back with another image and is left alone: start the link again")
            }
            Self::AnotherDevice => f.write_str("another device stands in its place"),
            Self::Emergency { code, register } => {
                write!(f, "sent the emergency {code:#06x}, error register {register:#04x}")
            }
        }
    }
}

/// The last events, oldest first; the oldest is dropped when nobody reads them.
#[derive(Debug)]
pub(super) struct EventQueue {
    events: [Option<SegmentEvent>; Self::ROOM],
    first: usize,
    len: usize,
}

impl EventQueue {
    const ROOM: usize = 64;

    pub(super) const fn new() -> Self {
        Self { events: [None; Self::ROOM], first: 0, len: 0 }
    }

    pub(super) fn push(&mut self, robot: usize, kind: EventKind) {
        if self.len == Self::ROOM {
            self.pop();
        }
        if let Some(place) = self.events.get_mut((self.first + self.len) % Self::ROOM) {
            *place = Some(SegmentEvent { robot, kind });
            self.len += 1;
        }
    }

    pub(super) fn pop(&mut self) -> Option<SegmentEvent> {
        let event = self.events.get_mut(self.first)?.take()?;
        self.first = (self.first + 1) % Self::ROOM;
        self.len -= 1;
        Some(event)
    }
}
