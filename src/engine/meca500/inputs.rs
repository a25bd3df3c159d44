//! The few fields the engine reads in a cycle, borrowed from the image and kept as plain values.

use crate::wire::meca500::image::{
    FirmwareLayout, InputImage, MotionStatusFlags, RobotStatusFlags, SafetyResettable,
    SafetySignals,
};
use crate::wire::order::ImageOrder;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Inputs {
    pub(super) robot: RobotStatusFlags,
    pub(super) error_code: u16,
    pub(super) motion: MotionStatusFlags,
    pub(super) move_id: u16,
    pub(super) fifo_space: u16,
    pub(super) reached: u32,
    pub(super) discarded: u32,
    /// Safety signals that are 1, the deprecated bits included: the two may differ while resettable.
    pub(super) stops: SafetySignals,
    pub(super) resettable: SafetyResettable,
    /// The robot's clock in microseconds.
    pub(super) clock_us: u64,
}

impl Inputs {
    #[inline]
    pub(super) fn read<O: ImageOrder>(image: &InputImage<O>, layout: FirmwareLayout) -> Self {
        let motion = &image.motion_status;
        let checkpoints = motion.checkpoints(layout);
        let time = &image.robot_timestamp;
        let robot = image.robot_status.flags.get();
        let motion_flags = motion.flags.get();
        Self {
            robot,
            error_code: image.robot_status.error_code.get(),
            motion: motion_flags,
            move_id: motion.move_id.get(),
            fifo_space: motion.fifo_space.get(),
            reached: checkpoints.reached,
            discarded: checkpoints.discarded,
            stops: stops(image.safety_status.signals.get(), robot, motion_flags),
            resettable: image.safety_status.resettable.get(),
            clock_us: u64::from(time.seconds.get()) * 1_000_000
                + u64::from(time.microseconds.get()),
        }
    }

    /// An image nobody has filled: a living robot has a running clock or queue space.
    pub(super) fn is_blank(&self) -> bool {
        self.clock_us == 0 && self.fifo_space == 0 && self.move_id == 0 && self.robot.is_empty()
    }

    pub(super) fn activated(&self) -> bool {
        self.robot.contains(RobotStatusFlags::ACTIVATED)
    }

    pub(super) fn homed(&self) -> bool {
        self.robot.contains(RobotStatusFlags::HOMED)
    }

    pub(super) fn busy(&self) -> bool {
        self.robot.contains(RobotStatusFlags::BUSY)
    }

    pub(super) fn recovery(&self) -> bool {
        self.robot.contains(RobotStatusFlags::RECOVERY_MODE)
    }

    pub(super) fn monitoring(&self) -> bool {
        self.robot.contains(RobotStatusFlags::MONITORING_MODE)
    }

    pub(super) fn paused(&self) -> bool {
        self.motion.contains(MotionStatusFlags::PAUSED)
    }

    pub(super) fn cleared(&self) -> bool {
        self.motion.contains(MotionStatusFlags::CLEARED)
    }

    /// The robot says that nothing moves and nothing is left to do.
    pub(super) fn stands_still(&self) -> bool {
        self.motion.contains(MotionStatusFlags::EOB | MotionStatusFlags::EOM)
    }

    /// Safety signals that ResumeMotion cannot reset now. The E-Stop is reset by a button only.
    pub(super) fn blocking_stops(&self) -> SafetySignals {
        let resettable = SafetySignals::from_bits_retain(self.resettable.bits());
        self.stops.difference(resettable.difference(SafetySignals::E_STOP))
    }

    /// Safety signals that ResumeMotion can reset now.
    pub(super) fn resettable_stops(&self) -> SafetySignals {
        self.stops.difference(self.blocking_stops())
    }

    pub(super) fn ready_for_motion(&self) -> bool {
        self.activated()
            && (self.homed() || self.recovery())
            && self.error_code == 0
            && self.stops.is_empty()
            && !self.cleared()
    }
}

#[inline]
fn stops(
    signals: SafetySignals,
    robot: RobotStatusFlags,
    motion: MotionStatusFlags,
) -> SafetySignals {
    let mut stops = signals;
    if robot.contains(RobotStatusFlags::E_STOP) {
        stops |= SafetySignals::E_STOP;
    }
    if motion.contains(MotionStatusFlags::P_STOP2) {
        stops |= SafetySignals::P_STOP2;
    }
    stops
}
