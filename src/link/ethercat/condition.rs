//! Where one robot of a running segment is, and what it needs.
//!
//! ```text
//!  Starting --> InOp <----------------- back in OP -----------------+
//!                |                                                  |
//!                +--> Away (fell) -------> look ---> lift, restore -+
//!                |      |        ^                       |          |
//!                |      | no     | still has             | another device, another image
//!                |      v answer | its address           v          |
//!                +--> Gone ----> find                 Blocked       |
//!                                 | has restarted        ^          |
//!                                 +----> restore --------+----------+
//! ```
//!
//! From Away and Gone a robot that exchanges in OP again is InOp, whoever brought it there. Nothing
//! leads out of Blocked but another start.
//!
//! Invariant: inputs are fresh or stale in InOp only.

use super::care::CareKind;
use super::group::{Member, RobotGroup, Shared};
use crate::cycle::InputQuality;
use crate::time::Instant;
use crate::wire::ethercat::al::AlState;
use crate::wire::meca500::image::{INPUT_LEN, OUTPUT_LEN};

/// Exchanges without an answer of a robot before it counts as gone.
pub(super) const GONE_AFTER: u32 = 20;
/// Exchanges with a wrong working counter, none right between them, before it is told.
const DOUBTED_AFTER: u32 = GONE_AFTER;

/// Where a robot is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Condition {
    /// On its way to OP for the first time.
    Starting,
    /// In OP.
    InOp,
    /// In another state; `seen` is what it was in when last looked at.
    Away { seen: Option<AlState>, is_told: bool },
    /// Does not answer; `answers` when something without an address does at its position, `is_told` when
    /// that was said.
    Gone { answers: bool, is_told: bool },
    /// Not driven any more.
    Blocked,
}

/// One robot: its images and how it fares.
pub(super) struct Robot {
    pub(super) outputs: [u8; OUTPUT_LEN],
    pub(super) inputs: [u8; INPUT_LEN],
    pub(super) quality: InputQuality,
    pub(super) condition: Condition,
    /// Exchanges without an answer since the last with one.
    pub(super) unanswered: u32,
    /// Exchanges with a wrong working counter since the last right one.
    pub(super) doubtful: u32,
    /// No task before that.
    pub(super) care_at: Instant,
}

impl Robot {
    pub(super) const fn new() -> Self {
        Self {
            outputs: [0; OUTPUT_LEN],
            inputs: [0; INPUT_LEN],
            quality: InputQuality::Lost,
            condition: Condition::Starting,
            unanswered: 0,
            doubtful: 0,
            care_at: Instant::ZERO,
        }
    }

    /// An exchange with new inputs.
    pub(super) fn refresh(&mut self, shared: &Shared, member: &Member, group: &RobotGroup) {
        (self.unanswered, self.doubtful) = (0, 0);
        self.quality = InputQuality::Fresh;
        group.read(&shared.main_device, member.index, &member.inputs, &mut self.inputs);
    }

    /// One more exchange without new inputs.
    pub(super) fn grow_stale(&mut self) {
        self.quality = match self.quality {
            _ if self.condition != Condition::InOp => InputQuality::Lost,
            InputQuality::Fresh => InputQuality::Stale { age_cycles: 1 },
            InputQuality::Stale { age_cycles } => {
                InputQuality::Stale { age_cycles: age_cycles.saturating_add(1) }
            }
            InputQuality::Lost => InputQuality::Lost,
        };
    }

    /// One more exchange with a wrong working counter; whether it is time to tell, once a spell.
    pub(super) fn doubt(&mut self) -> bool {
        if self.condition != Condition::InOp {
            return false;
        }
        self.doubtful = self.doubtful.saturating_add(1);
        self.doubtful == DOUBTED_AFTER
    }

    /// The task that this robot needs at `now`.
    pub(super) fn needs(&self, now: Instant) -> Option<CareKind> {
        let wanted = self.wants()?;
        (now >= self.care_at).then_some(wanted)
    }

    /// The task that this robot needs sooner or later.
    pub(super) const fn wants(&self) -> Option<CareKind> {
        match self.condition {
            Condition::Starting | Condition::InOp | Condition::Blocked => None,
            Condition::Away { seen: None, .. } => Some(CareKind::Look),
            Condition::Away { seen: Some(AlState::SafeOp | AlState::Op), .. } => {
                Some(CareKind::Lift)
            }
            Condition::Away { .. } | Condition::Gone { answers: true, .. } => {
                Some(CareKind::Restore)
            }
            Condition::Gone { answers: false, .. } => Some(CareKind::Find),
        }
    }
}
