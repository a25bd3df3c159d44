//! What the robot would say on its text ports: bounded lists, one for whoever wants to read it and
//! one for the text face.
//!
//! The cyclic image shows only the last of several checkpoints; here every one appears. When nobody
//! reads, the oldest events are dropped. The text face's list stays empty until somebody uses it.

use alloc::collections::VecDeque;

use crate::wire::meca500::code::Code;

/// Events kept for a slow reader.
const KEPT: usize = 4096;

/// Something the robot did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RobotEvent {
    /// 3030: a checkpoint was reached.
    CheckpointReached(u16),
    /// 3040: a checkpoint will never be reached.
    CheckpointDiscarded(u16),
    /// A code of Table 1 put the robot in error mode.
    Error(Code),
    /// A code of Table 1 answered a request that was refused.
    Refused(Code),
    /// A severity-1 warning with the code of the error it stands beside.
    Warning(Code),
    /// 2042: motion paused.
    MotionPaused,
    /// 2044: the queue was cleared.
    MotionCleared,
    /// 2043: motion resumed.
    MotionResumed,
    /// 2000: motors activated.
    Activated,
    /// 2002: homing done, or not needed.
    Homed,
    /// 2004: motors deactivated.
    Deactivated,
    /// 2063: an offline program began.
    ProgramStarted(u16),
    /// 3013: an offline program ended.
    ProgramEnded(u16),
    /// 2051: recovery mode reduced a requested velocity or acceleration.
    RecoveryCap,
}

/// The list.
#[derive(Clone, Debug, Default)]
pub(super) struct EventLog {
    events: VecDeque<RobotEvent>,
    for_text: VecDeque<RobotEvent>,
    text_listens: bool,
}

impl EventLog {
    pub(super) fn push(&mut self, event: RobotEvent) {
        let lists = [Some(&mut self.events), self.text_listens.then_some(&mut self.for_text)];
        for list in lists.into_iter().flatten() {
            if list.len() >= KEPT {
                list.pop_front();
            }
            list.push_back(event);
        }
    }

    pub(super) fn pop(&mut self) -> Option<RobotEvent> {
        self.events.pop_front()
    }

    /// From now on events are kept for the text face too.
    pub(super) const fn listen_for_text(&mut self) {
        self.text_listens = true;
    }

    /// The next event for the text face.
    pub(super) fn pop_for_text(&mut self) -> Option<RobotEvent> {
        self.for_text.pop_front()
    }
}
