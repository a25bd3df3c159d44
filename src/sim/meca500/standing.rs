//! How the robot stands, for whoever looks at it from outside: its lamps, and what people did to it.

use super::lifecycle::Lifecycle;
use super::robot::VirtualRobot;
use super::safety::Signal;
use crate::wire::meca500::code::Code;

/// What a person beside the robot sees, at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Standing {
    /// Where it is in its life.
    pub lifecycle: Lifecycle,
    /// Whether arm and gripper are homed.
    pub homed: bool,
    /// Whether it only simulates its motion (ActivateSim).
    pub simulating: bool,
    /// Why it is in error mode; 0 while it is not.
    pub error: Code,
    /// Whether its motion is paused.
    pub paused: bool,
    /// Whether its arm moves, homing included.
    pub moving: bool,
    /// Whether it is at rest with nothing left to do.
    pub idle: bool,
    /// The E-Stop, P-Stop 1 included.
    pub e_stop: Signal,
    /// P-Stop 2, also called SWStop.
    pub p_stop2: Signal,
    /// A connection that dropped.
    pub connection_dropped: Signal,
    /// A boot after which nobody pressed the Reset button.
    pub reboot: Signal,
    /// Redundant safety inputs that disagreed for too long.
    pub redundancy_fault: bool,
    /// Whether the motors can be powered.
    pub motor_power: bool,
    /// Which joints something holds, joint 1 first.
    pub blocked: [bool; 6],
}

impl VirtualRobot {
    /// How it stands now.
    #[must_use]
    pub fn standing(&self) -> Standing {
        let safety = &self.safety;
        Standing {
            lifecycle: self.lifecycle,
            homed: self.is_homed(),
            simulating: self.simulating,
            error: self.error,
            paused: self.is_paused(),
            moving: self.is_moving(),
            idle: self.is_block_ended(),
            e_stop: safety.e_stop,
            p_stop2: safety.p_stop2,
            connection_dropped: safety.connection_dropped,
            reboot: safety.reboot,
            redundancy_fault: safety.redundancy_fault,
            motor_power: safety.motor_power(),
            blocked: self.disturbance.blocked_at.map(|at| at.is_some()),
        }
    }

    /// A number that grows whenever a variable or an offline program is written or deleted, so that
    /// a caller who stores them need not compare them.
    #[must_use]
    pub const fn store_revision(&self) -> u64 {
        self.variables.revision().wrapping_add(self.programs.revision())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::meca500::RobotSettings;
    use crate::time::Instant;
    use crate::wire::meca500::revision::Revision;
    use alloc::vec;
    use alloc::vec::Vec;

    #[test]
    fn it_follows_what_people_do() {
        let settings = RobotSettings { revision: Revision::R4, ..RobotSettings::default() };
        let mut robot = VirtualRobot::new(settings);
        let calm = robot.standing();
        assert_eq!((calm.lifecycle, calm.e_stop), (Lifecycle::Deactivated, Signal::Off));
        assert!(calm.motor_power && calm.idle && !calm.moving && !calm.homed);
        robot.panel().press_p_stop2();
        robot.panel().block_joint(4, true);
        robot.panel().press_e_stop();
        let stopped = robot.standing();
        assert_eq!((stopped.p_stop2, stopped.e_stop), (Signal::Present, Signal::Present));
        assert!(!stopped.motor_power);
        assert_eq!(stopped.blocked, [false, false, false, true, false, false]);
        robot.panel().release_e_stop();
        assert_eq!(robot.standing().e_stop, Signal::Resettable);
        robot.panel().set_safety_mismatch(true);
        robot.advance(Instant::from_millis(2_000));
        assert!(robot.standing().redundancy_fault);
    }

    #[test]
    fn the_revision_grows_with_every_write() {
        let mut robot = VirtualRobot::new(RobotSettings::default());
        let mut seen = vec![robot.store_revision()];
        let mut look = |robot: &VirtualRobot| seen.push(robot.store_revision());
        robot.create_variable(10_000, &[1.0]).expect("it is free");
        look(&robot);
        robot.set_variable(10_000, &[2.0]).expect("it is there");
        look(&robot);
        assert!(robot.delete_variable(10_000));
        look(&robot);
        robot.save_program(1, Vec::new()).expect("there is room");
        look(&robot);
        assert!(seen.is_sorted_by(|before, after| before < after), "{seen:?}");
        assert!(!robot.delete_variable(10_000));
        assert_eq!(robot.store_revision(), seen[seen.len() - 1]);
    }
}
