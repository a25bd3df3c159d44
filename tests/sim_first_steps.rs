//! Bring-up and a first move through the raw images.
#![cfg(feature = "sim")]

mod sim_support;

use fieldarm::sim::meca500::RobotSettings;
use fieldarm::wire::meca500::image::{MotionStatusFlags, RobotStatusFlags};
use sim_support::Cell;

#[test]
fn a_robot_activates_homes_and_moves() {
    let mut cell = Cell::new(RobotSettings::default());
    cell.cycle();
    assert_eq!(cell.status(), RobotStatusFlags::BRAKES_ENGAGED);
    assert_eq!(cell.fifo_space(), 13_000);
    cell.activate();
    cell.home();
    let target = [10.0, -20.0, 30.0, -40.0, 50.0, -60.0];
    cell.sent(1, &target);
    cell.sent(17, &[7.0]);
    assert!(!cell.has(MotionStatusFlags::EOM));
    cell.until("the checkpoint", |cell| cell.reached() == 7);
    assert!(cell.is_at(target));
    cell.cycle();
    assert!(cell.has(MotionStatusFlags::EOB | MotionStatusFlags::EOM));
    assert_eq!(cell.fifo_space(), 13_000);
}
