//! One robot with several faces: whoever holds a [`SharedRobot`] holds the same one.
//!
//! A cyclic bus gets a view of it, [`OnEtherCat`] or [`OnEtherNetIp`], which is on its bus only in the
//! mode that this bus needs: in any other the robot only lives on, and outputs do nothing.
//!
//! Invariants: all faces live by one clock and in one thread; nobody keeps a borrowed robot while a
//! face is served. Two faces may let the robot live until the same time: the second changes nothing.

use core::cell::{Ref, RefCell, RefMut};
use std::prelude::v1::*;
use std::rc::Rc;

use crate::cycle::CyclicDevice;
use crate::sim::meca500::VirtualRobot;
use crate::time::Instant;

/// A robot that several hold.
#[derive(Clone, Debug)]
pub(in crate::cli) struct SharedRobot(Rc<RefCell<VirtualRobot>>);

impl SharedRobot {
    pub(in crate::cli) fn new(robot: VirtualRobot) -> Self {
        Self(Rc::new(RefCell::new(robot)))
    }

    /// To be looked at.
    pub(in crate::cli) fn borrow(&self) -> Ref<'_, VirtualRobot> {
        self.0.borrow()
    }

    /// To be acted upon.
    pub(in crate::cli) fn borrow_mut(&self) -> RefMut<'_, VirtualRobot> {
        self.0.borrow_mut()
    }
}

/// The robot as an EtherCAT line sees it: there in EtherCAT mode only.
#[derive(Clone, Debug)]
pub(in crate::cli) struct OnEtherCat(pub(in crate::cli) SharedRobot);

impl CyclicDevice for OnEtherCat {
    const OUTPUT_LEN: usize = VirtualRobot::OUTPUT_LEN;
    const INPUT_LEN: usize = VirtualRobot::INPUT_LEN;

    fn cycle(&mut self, now: Instant, outputs: Option<&[u8]>, inputs: &mut [u8]) {
        let mut robot = self.0.borrow_mut();
        match robot.protocol_settings().ethercat {
            true => robot.cycle(now, outputs, inputs),
            false => robot.advance(now),
        }
    }

    fn is_on_bus(&self) -> bool {
        let robot = self.0.borrow();
        robot.is_online() && robot.protocol_settings().ethercat
    }
}

/// The robot as an EtherNet/IP adapter sees it: there in TCP/IP mode only.
#[derive(Clone, Debug)]
pub(in crate::cli) struct OnEtherNetIp(pub(in crate::cli) SharedRobot);

impl CyclicDevice for OnEtherNetIp {
    const OUTPUT_LEN: usize = VirtualRobot::OUTPUT_LEN;
    const INPUT_LEN: usize = VirtualRobot::INPUT_LEN;

    fn cycle(&mut self, now: Instant, outputs: Option<&[u8]>, inputs: &mut [u8]) {
        let mut robot = self.0.borrow_mut();
        match robot.protocol_settings().ethercat {
            true => robot.advance(now),
            false => robot.cycle(now, outputs, inputs),
        }
    }

    fn is_on_bus(&self) -> bool {
        let robot = self.0.borrow();
        robot.is_online() && !robot.protocol_settings().ethercat
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::meca500::{CyclicBus, RobotSettings};
    use crate::wire::meca500::image::{INPUT_LEN, InputImage, OutputImage, RobotControlFlags};
    use crate::wire::order::Big;

    /// Outputs with these bits of RobotControl.
    fn outputs(bits: RobotControlFlags) -> OutputImage<Big> {
        let mut outputs = OutputImage::zeroed();
        outputs.robot_control.flags.assign(bits, true);
        outputs
    }

    fn is_activated(inputs: &[u8; INPUT_LEN]) -> bool {
        InputImage::<Big>::from_bytes(inputs).unwrap().robot_status.flags.get().bits() & 2 != 0
    }

    #[test]
    fn only_the_bus_of_the_robots_mode_moves_it() {
        let settings = RobotSettings { bus: CyclicBus::EtherNetIp, ..RobotSettings::default() };
        let shared = SharedRobot::new(VirtualRobot::new(settings));
        let (mut ethercat, mut enip) = (OnEtherCat(shared.clone()), OnEtherNetIp(shared.clone()));
        assert!(enip.is_on_bus() && !ethercat.is_on_bus());
        let activate = outputs(RobotControlFlags::ACTIVATE_ROBOT);
        let mut inputs = [0; INPUT_LEN];
        ethercat.cycle(Instant::from_millis(1), Some(activate.as_bytes()), &mut inputs);
        ethercat.cycle(Instant::from_millis(900), None, &mut inputs);
        assert_eq!(inputs, [0; INPUT_LEN], "it is not on this bus");
        enip.cycle(Instant::from_millis(900), None, &mut inputs);
        assert!(!is_activated(&inputs), "nobody who may has asked for it");
        // A bus that lags behind the others does not turn the time back.
        enip.cycle(Instant::from_millis(2), Some(activate.as_bytes()), &mut inputs);
        assert_eq!(shared.borrow().now(), Instant::from_millis(900));
        enip.cycle(Instant::from_millis(2_000), Some(activate.as_bytes()), &mut inputs);
        assert!(is_activated(&inputs));

        shared.borrow_mut().switch_to_ethercat();
        assert!(!enip.is_on_bus() && ethercat.is_on_bus());
        let leave = outputs(RobotControlFlags::DISABLE_ETHERCAT);
        let deactivate = outputs(RobotControlFlags::DEACTIVATE_ROBOT);
        enip.cycle(Instant::from_millis(4_000), Some(deactivate.as_bytes()), &mut inputs);
        ethercat.cycle(Instant::from_millis(4_000), Some(activate.as_bytes()), &mut inputs);
        assert!(is_activated(&inputs), "the other bus has no say");
        ethercat.cycle(Instant::from_millis(4_000), Some(leave.as_bytes()), &mut inputs);
        assert!(enip.is_on_bus() && !ethercat.is_on_bus());
    }
}
