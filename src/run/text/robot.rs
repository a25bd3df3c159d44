//! What the robot has told of itself.

use crate::wire::meca500::code::{Code, CodeKind};
use crate::wire::meca500::image::SafetySignals;
use crate::wire::meca500::text::Message;

/// Recovery mode on, and off.
const RECOVERY_ON: Code = Code(2049);
const RECOVERY_OFF: Code = Code(2050);

/// Message 2007, as far as a run needs it. Source: PM L5722.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Status {
    pub(super) is_activated: bool,
    pub(super) is_homed: bool,
    pub(super) is_simulated: bool,
    pub(super) is_in_error: bool,
    pub(super) is_paused: bool,
    pub(super) is_end_of_block: bool,
}

impl Status {
    fn read(message: &Message<'_>) -> Option<Self> {
        let [activated, homed, simulation, error, paused, end_of_block, _] = message.numbers()?;
        Some(Self {
            is_activated: activated != 0.0,
            is_homed: homed != 0.0,
            is_simulated: simulation != 0.0,
            is_in_error: error != 0.0,
            is_paused: paused != 0.0,
            is_end_of_block: end_of_block != 0.0,
        })
    }
}

/// The newest of what the control port told.
#[derive(Clone, Copy, Debug)]
pub(super) struct Robot {
    /// `None` until it is told.
    pub(super) status: Option<Status>,
    pub(super) is_in_recovery: bool,
    /// Safety signals that are present or still to be reset.
    pub(super) stops: SafetySignals,
    /// Those of them that ResumeMotion resets. The E-Stop is reset by a button only.
    pub(super) resettable: SafetySignals,
    /// The last error that may have started error mode.
    pub(super) error: Code,
}

impl Robot {
    pub(super) const fn unknown() -> Self {
        Self {
            status: None,
            is_in_recovery: false,
            stops: SafetySignals::empty(),
            resettable: SafetySignals::empty(),
            error: Code::NONE,
        }
    }

    pub(super) fn is(&self, of: impl Fn(&Status) -> bool) -> bool {
        self.status.as_ref().is_some_and(of)
    }

    pub(super) fn is_activated(&self) -> bool {
        self.is(|status| status.is_activated)
    }

    pub(super) fn is_ready(&self) -> bool {
        self.is(|status| status.is_activated && (status.is_homed || self.is_in_recovery))
    }

    /// Safety signals that ResumeMotion does not reset.
    pub(super) fn blocking_stops(&self) -> SafetySignals {
        self.stops.difference(self.resettable)
    }

    /// Takes in a message of the control port.
    pub(super) fn take_in(&mut self, message: &Message<'_>) {
        let code = message.code;
        if let Some((signals, value)) = safety_signal(message) {
            self.stops.set(signals, value != 0);
            let by_resuming = SafetySignals::P_STOP2 | SafetySignals::CONNECTION_DROPPED;
            self.resettable.set(signals, value == 2 && by_resuming.contains(signals));
            return;
        }
        match code {
            Code::STATUS_ROBOT => {
                if let Some(status) = Status::read(message) {
                    self.status = Some(status);
                    if !status.is_in_error {
                        self.error = Code::NONE;
                    }
                }
            }
            Code::MOTORS_ACTIVATED => self.set(|status| status.is_activated = true),
            Code::MOTORS_DEACTIVATED => self.set(|status| status.is_activated = false),
            Code::HOMING_DONE => self.set(|status| status.is_homed = true),
            Code::MOTION_PAUSED | Code::MOTION_CLEARED => {
                self.set(|status| status.is_paused = true);
            }
            RECOVERY_ON => self.is_in_recovery = true,
            RECOVERY_OFF => self.is_in_recovery = false,
            Code::MOVE_DURATION_TOO_SHORT => self.error = code,
            code if is_error(code) && !is_refusal(code) => self.error = code,
            _ => {}
        }
    }

    fn set(&mut self, change: impl FnOnce(&mut Status)) {
        if let Some(status) = &mut self.status {
            change(status);
        }
    }
}

/// Whether the code tells of an error or a refusal.
pub(super) fn is_error(code: Code) -> bool {
    code.describe().is_some_and(|info| info.kind == CodeKind::Error)
}

/// Whether an error refuses a line for the state that the robot is in.
pub(super) const fn is_of_the_state(code: Code) -> bool {
    matches!(
        code,
        Code::NOT_ACTIVATED
            | Code::NOT_HOMED
            | Code::DEACTIVATION_NEEDED
            | Code::SIM_NEEDS_DEACTIVATION
    )
}

/// Whether an error refuses a line that is being read, instead of one that is being executed. Source: PM
/// Table 1.
pub(super) const fn is_refusal(code: Code) -> bool {
    is_of_the_state(code)
        || matches!(code.0, 1000..=1003 | 1011 | 1022..=1023 | 1031 | 1038 | 1040..=1044)
        || matches!(code.0, 1550..=1554 | 3003 | 3017 | 3020)
}

/// The signal that a safety message is about, and its value: 0 clear, 1 present, 2 to be reset. Source:
/// PM L739.
pub(super) fn safety_signal(message: &Message<'_>) -> Option<(SafetySignals, i64)> {
    let signals = match message.code {
        Code::P_STOP_2 => SafetySignals::P_STOP2,
        Code::E_STOP => SafetySignals::E_STOP,
        Code::REBOOTED => SafetySignals::REBOOT,
        Code::REDUNDANCY_FAULT => SafetySignals::REDUNDANCY_FAULT,
        Code::CONNECTION_DROPPED | Code::CONNECTION_DROPPED_TEXT => {
            SafetySignals::CONNECTION_DROPPED
        }
        _ => return None,
    };
    Some((signals, message.values().next()?.integer()?))
}
