//! Safety signals: which are present, which may be reset, and what they hold off.
//!
//! ```text
//! Off --present--> Present --gone--> Resettable --reset--> Off
//!                     ^------present------'
//! ```
//!
//! | signal | reset by | holds off |
//! |---|---|---|
//! | E-Stop (revision 4) | the Reset button | motor power |
//! | P-Stop 2 | ResumeMotion | motion |
//! | connection dropped | ResumeMotion, once connected | motion |
//! | reboot | the Reset button | motor power |
//! | redundancy fault | a reboot only | motor power |
//!
//! Source: PM L878-922, L1540-1587. Leaves out: what the robot does about them (`lifecycle`,
//! `halt`).

use super::readings::{DeprecatedBits, PowerAfterReboot, Readings, RebootSignal, RedundancySignal};
use crate::wire::meca500::image::{SafetyPower, SafetyResettable, SafetySignals};
use crate::wire::meca500::revision::Revision;

/// How long redundant inputs may disagree: one second. Source: PM L920.
const MISMATCH_NS: u64 = 1_000_000_000;

/// One safety signal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Signal {
    /// Not there.
    #[default]
    Off,
    /// There.
    Present,
    /// Gone, but not yet reset.
    Resettable,
}

impl Signal {
    /// The signal comes or goes.
    pub(super) const fn set_present(&mut self, present: bool) {
        *self = match (*self, present) {
            (_, true) => Self::Present,
            (Self::Present, false) => Self::Resettable,
            (other, false) => other,
        };
    }

    /// Resets it, if it may be reset. Returns whether it was.
    pub(super) fn reset(&mut self) -> bool {
        let resets = *self == Self::Resettable;
        if resets {
            *self = Self::Off;
        }
        resets
    }

    /// Whether SafetyStatus shows it: present or resettable.
    #[must_use]
    pub fn is_shown(self) -> bool {
        self != Self::Off
    }
}

/// All signals of the robot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Safety {
    pub(super) e_stop: Signal,
    pub(super) p_stop2: Signal,
    pub(super) connection_dropped: Signal,
    pub(super) reboot: Signal,
    pub(super) redundancy_fault: bool,
    mismatch: bool,
    mismatch_ns: u64,
    motor_power: bool,
}

impl Safety {
    /// After a boot whose Reset button was pressed.
    pub(super) const fn reset_and_powered() -> Self {
        Self {
            e_stop: Signal::Off,
            p_stop2: Signal::Off,
            connection_dropped: Signal::Off,
            reboot: Signal::Off,
            redundancy_fault: false,
            mismatch: false,
            mismatch_ns: 0,
            motor_power: true,
        }
    }

    /// After a boot, with the buttons as they are now.
    pub(super) fn after_boot(&self, readings: &Readings) -> Self {
        let held = |signal: Signal| match signal {
            Signal::Present => Signal::Present,
            Signal::Off | Signal::Resettable => Signal::Off,
        };
        let needs_reset = readings.power_after_reboot == PowerAfterReboot::NeedsReset;
        let mut safety = Self::reset_and_powered();
        safety.e_stop = held(self.e_stop);
        safety.p_stop2 = held(self.p_stop2);
        safety.mismatch = self.mismatch;
        safety.reboot = if needs_reset { Signal::Resettable } else { Signal::Off };
        safety.motor_power = !needs_reset && safety.e_stop == Signal::Off;
        safety
    }

    /// Whether the motors can be powered.
    pub(super) const fn motor_power(&self) -> bool {
        self.motor_power
    }

    /// Whether a signal demands that motor power go off, which it has not yet done. A button that
    /// is released while the arm still slows down changes nothing: only Reset does.
    pub(super) fn demands_power_cut(&self) -> bool {
        self.motor_power && (self.e_stop.is_shown() || self.redundancy_fault)
    }

    /// Motor power is gone.
    pub(super) const fn cut_power(&mut self) {
        self.motor_power = false;
    }

    /// Whether a signal that stops motion is there or not yet reset.
    pub(super) fn stops_motion(&self) -> bool {
        self.e_stop.is_shown()
            || self.p_stop2.is_shown()
            || self.connection_dropped.is_shown()
            || self.redundancy_fault
    }

    /// Whether a signal is present, so that ResumeMotion cannot act. Source: PM L1133.
    pub(super) fn any_present(&self) -> bool {
        [self.e_stop, self.p_stop2, self.connection_dropped].contains(&Signal::Present)
            || self.redundancy_fault
    }

    /// What ResumeMotion resets. Returns whether there was something.
    pub(super) fn reset_by_resume(&mut self) -> bool {
        let p_stop2 = self.p_stop2.reset();
        let connection = self.connection_dropped.reset();
        p_stop2 || connection
    }

    /// Whether the Reset button would bring motor power back.
    pub(super) fn reset_ready(&self) -> bool {
        !self.motor_power && self.e_stop != Signal::Present && !self.redundancy_fault
    }

    /// The Reset button.
    pub(super) fn press_reset(&mut self) {
        if self.reset_ready() {
            self.e_stop.reset();
            self.reboot.reset();
            self.motor_power = true;
        }
    }

    /// The redundant inputs agree or not.
    pub(super) const fn set_mismatch(&mut self, mismatch: bool) {
        self.mismatch = mismatch;
        self.mismatch_ns = 0;
    }

    /// Lets time pass.
    pub(super) const fn advance(&mut self, nanos: u64) {
        if self.mismatch {
            self.mismatch_ns = self.mismatch_ns.saturating_add(nanos);
            if self.mismatch_ns > MISMATCH_NS {
                self.redundancy_fault = true;
            }
        }
    }

    /// Whether time matters.
    pub(super) const fn is_waiting(&self) -> bool {
        self.mismatch && !self.redundancy_fault
    }

    /// SafetyStatus, signals.
    pub(super) fn signals(&self, readings: &Readings) -> SafetySignals {
        let mut signals = SafetySignals::empty();
        signals.set(SafetySignals::E_STOP, self.e_stop.is_shown());
        signals.set(SafetySignals::P_STOP2, self.p_stop2.is_shown());
        signals.set(SafetySignals::CONNECTION_DROPPED, self.connection_dropped.is_shown());
        let reboot = readings.reboot_signal == RebootSignal::Reported && self.reboot.is_shown();
        signals.set(SafetySignals::REBOOT, reboot);
        let fault =
            readings.redundancy_signal == RedundancySignal::Reported && self.redundancy_fault;
        signals.set(SafetySignals::REDUNDANCY_FAULT, fault);
        signals
    }

    /// SafetyStatus, what may be reset now.
    pub(super) fn resettable(&self, revision: Revision) -> SafetyResettable {
        let mut resettable = SafetyResettable::empty();
        let e_stop = revision == Revision::R4 && self.e_stop == Signal::Resettable;
        resettable.set(SafetyResettable::E_STOP, e_stop);
        resettable.set(SafetyResettable::P_STOP2, self.p_stop2 == Signal::Resettable);
        let connection = self.connection_dropped == Signal::Resettable;
        resettable.set(SafetyResettable::CONNECTION_DROPPED, connection);
        resettable
    }

    /// SafetyStatus, motor power.
    pub(super) fn power(&self, revision: Revision) -> SafetyPower {
        let mut power = SafetyPower::empty();
        let ready = revision == Revision::R4 && self.reset_ready();
        power.set(SafetyPower::RESET_READY, ready);
        power.set(SafetyPower::V_MOTOR_ON, self.motor_power);
        power
    }

    /// A deprecated bit for `signal`.
    pub(super) fn deprecated(signal: Signal, readings: &Readings) -> bool {
        match readings.deprecated_bits {
            DeprecatedBits::Present => signal == Signal::Present,
            DeprecatedBits::PresentOrResettable => signal.is_shown(),
        }
    }
}
