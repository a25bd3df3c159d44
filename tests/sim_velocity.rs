//! Velocity mode.
#![cfg(feature = "sim")]

mod sim_support;

use fieldarm::sim::meca500::FittedTool;
use fieldarm::sim::meca500::readings::{JointVelLimit, SetPointDrop};
use fieldarm::wire::meca500::image::{MotionControlFlags, MotionStatusFlags};
use sim_support::Cell;

fn jog(cell: &mut Cell, id: u32, velocity: [f32; 6]) {
    cell.write_with(0, id, &velocity);
}

#[test]
fn a_velocity_lasts_while_set_point_is_1_and_changes_at_once() {
    let mut cell = Cell::ready();
    jog(&mut cell, 21, [20.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    cell.cycles(1000);
    let velocity = cell.read(32)[0];
    assert!((velocity - 20.0).abs() < 1e-2, "{velocity}");
    assert!((cell.joints()[0] - 20.0).abs() < 0.5);
    jog(&mut cell, 21, [-20.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    cell.cycles(100);
    assert!((cell.read(32)[0] + 20.0).abs() < 1e-2);
    jog(&mut cell, 21, [0.0; 6]);
    cell.until("at rest", |cell| cell.read_now(32)[0] == 0.0);
}

trait ReadNow {
    fn read_now(&self, ty: u32) -> [f32; 6];
}

impl ReadNow for Cell {
    fn read_now(&self, ty: u32) -> [f32; 6] {
        (0..4)
            .map(|slot| self.dynamic(slot))
            .find(|(found, _)| *found == ty)
            .map_or([1.0; 6], |(_, v)| v)
    }
}

#[test]
fn set_point_0_stops_at_once_or_after_the_timeout() {
    for (reading, most) in [(SetPointDrop::StopsAtOnce, 25), (SetPointDrop::StopsAfterTimeout, 600)]
    {
        let mut cell = Cell::ready_with(|settings| settings.readings.set_point_drop = reading);
        cell.sent(24, &[0.5]);
        cell.cycle();
        jog(&mut cell, 21, [20.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        cell.cycles(500);
        cell.motion(MotionControlFlags::SET_POINT, false);
        let cycles = cell.until("at rest", |cell| cell.has(MotionStatusFlags::EOM));
        assert!(cycles <= most, "{reading:?}: {cycles}");
        assert!(reading == SetPointDrop::StopsAtOnce || cycles >= 490, "{cycles}");
    }
}

#[test]
fn pause_and_clear_stop_a_velocity_motion() {
    for bit in [MotionControlFlags::PAUSE_MOTION, MotionControlFlags::CLEAR_MOTION] {
        let mut cell = Cell::ready();
        jog(&mut cell, 21, [20.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        cell.cycles(200);
        cell.motion(bit, true);
        cell.cycles(100);
        let at = cell.joints();
        cell.cycles(300);
        assert_eq!(cell.joints(), at);
        assert!(cell.has(MotionStatusFlags::PAUSED | MotionStatusFlags::EOM));
        cell.motion(bit, false);
        cell.resume();
        cell.cycles(300);
        assert!(cell.joints()[0] > at[0] + 2.0, "SetPoint is still 1");
    }
}

#[test]
fn a_joint_limit_stops_without_an_error() {
    let mut cell = Cell::ready();
    jog(&mut cell, 21, [0.0, 100.0, 0.0, 0.0, 0.0, 0.0]);
    cell.cycles(2000);
    assert_eq!(cell.error(), 0);
    let joint = cell.joints()[1];
    assert!((89.9..90.0).contains(&joint), "{joint}");
}

#[test]
fn a_linear_velocity_moves_the_tool_and_stops_at_the_edge_of_reach() {
    let mut cell = Cell::ready();
    cell.sent(1, &[0.0, 0.0, 0.0, 0.0, 30.0, 0.0]);
    cell.finish(1);
    let start = cell.pose();
    jog(&mut cell, 22, [0.0, 0.0, -10.0, 0.0, 0.0, 0.0]);
    cell.cycles(1000);
    let moved = cell.pose();
    assert!((start[2] - moved[2] - 10.0).abs() < 0.5, "{start:?} {moved:?}");
    assert!((start[0] - moved[0]).abs() < 0.01);
    jog(&mut cell, 22, [100.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    cell.cycles(5000);
    assert_eq!(cell.error(), 0);
    let at = cell.joints();
    cell.cycles(100);
    assert!(sim_support::close(cell.joints(), at, 0.01));
}

#[test]
fn a_tool_velocity_is_reduced_so_that_no_joint_exceeds_its_limit() {
    let mut cell = Cell::ready();
    cell.sent(1, &[0.0, 0.0, 0.0, 0.0, 30.0, 0.0]);
    cell.sent(33, &[10.0]);
    cell.finish(1);
    jog(&mut cell, 23, [0.0, 1000.0, 0.0, 0.0, 0.0, 0.0]);
    cell.request([32; 4]);
    let mut fastest = 0.0_f32;
    for _ in 0..400 {
        cell.cycle();
        for (velocity, limit) in cell.read_now(32).iter().zip([15.0, 15.0, 18.0, 30.0, 30.0, 50.0])
        {
            fastest = fastest.max(velocity.abs() / limit);
        }
    }
    assert!(fastest > 0.9 && fastest <= 1.001, "{fastest}");
}

#[test]
fn the_joint_velocity_limit_limits_or_scales() {
    for (reading, expected) in [(JointVelLimit::Limits, 30.0), (JointVelLimit::Scales, 15.0)] {
        let mut cell = Cell::ready_with(|settings| settings.readings.joint_vel_limit = reading);
        cell.sent(33, &[50.0]);
        cell.finish(1);
        jog(&mut cell, 21, [30.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        cell.cycles(500);
        let velocity = cell.read(32)[0];
        assert!((velocity - expected).abs() < 0.1, "{velocity}");
    }
}

#[test]
fn checkpoints_and_the_gripper_pass_a_velocity_motion_and_moves_wait() {
    let mut cell = Cell::ready_with(|settings| settings.tool = FittedTool::Megp25E);
    cell.sent(24, &[1.0]);
    cell.finish(1);
    cell.sent(21, &[10.0]);
    cell.cycles(50);
    cell.sent(17, &[2.0]);
    cell.sent(18, &[1.0]);
    cell.sent(1, &[0.0]);
    cell.sent(17, &[3.0]);
    cell.cycles(200);
    assert_eq!(cell.reached(), 2);
    assert!(!cell.has(MotionStatusFlags::EOM));
    assert!(cell.robot.gripper_state().opening_mm > 1.0);
    assert!((cell.read(32)[0] - 10.0).abs() < 0.1, "still in velocity mode");
    cell.sent(21, &[-10.0]);
    cell.until("the move", |cell| cell.reached() == 3);
    assert_eq!(cell.error(), 0);
}

#[test]
fn a_new_velocity_command_replaces_the_one_before_and_restarts_the_timeout() {
    let mut cell = Cell::ready();
    cell.sent(24, &[0.5]);
    cell.finish(1);
    for _ in 0..5 {
        cell.sent(21, &[10.0]);
        cell.cycles(400);
    }
    assert!((cell.read(32)[0] - 10.0).abs() < 0.1, "never timed out");
    cell.cycles(600);
    assert!(cell.has(MotionStatusFlags::EOM));
}
