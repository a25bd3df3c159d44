//! Grippers and valves.
#![cfg(feature = "sim")]

mod sim_support;

use fieldarm::sim::meca500::{FittedTool, Part, RobotEvent, RobotSettings};
use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::image::{MotionStatusFlags, RobotControlFlags, RobotStatusFlags};
use sim_support::Cell;

fn with(tool: FittedTool) -> Cell {
    Cell::ready_with(|settings| settings.tool = tool)
}

#[test]
fn a_gripper_opens_closes_and_reports() {
    let mut cell = with(FittedTool::Megp25E);
    assert_eq!(cell.read(52)[..2], [10.0, 1.0]);
    assert_eq!(cell.read(23)[..4], [50.0, 40.0, 0.0, 6.0]);
    cell.sent(18, &[1.0]);
    cell.cycle();
    cell.read(53);
    let state = cell.robot.gripper_state();
    assert!(!state.target_reached && !state.open);
    // 6 mm at 40 % of 50 mm/s.
    cell.cycles(310);
    let [holding, reached, closed, open, force, opening] = cell.read(53);
    assert_eq!([holding, reached, closed, open, force, opening], [0.0, 1.0, 0.0, 1.0, 0.0, 6.0]);
    cell.sent(18, &[0.0]);
    cell.cycles(310);
    assert_eq!(cell.read(53), [0.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
}

#[test]
fn a_part_between_the_fingers_is_held() {
    let mut cell = with(FittedTool::Megp25Ls);
    cell.sent(20, &[80.0]);
    cell.sent(32, &[40.0]);
    cell.cycles(2200);
    assert_eq!(cell.read(53)[5], 40.0);
    cell.robot.panel().place_part(Some(Part::Outer(25.0)));
    cell.sent(18, &[0.0]);
    cell.cycles(1000);
    assert_eq!(cell.read(53), [1.0, 0.0, 0.0, 0.0, -80.0, 25.0]);
    assert_eq!(cell.error(), 0, "being blocked is no error");
    cell.robot.panel().place_part(None);
    cell.cycles(1500);
    assert_eq!(cell.read(53)[5], 0.0, "the fingers go on when the part is gone");
}

#[test]
fn the_range_redefines_open_and_close_but_not_move_gripper() {
    let mut cell = with(FittedTool::Megp25Ls);
    cell.sent(31, &[8.0, 13.0]);
    cell.sent(18, &[1.0]);
    cell.cycles(800);
    assert_eq!(cell.read(53)[2..], [0.0, 1.0, 0.0, 13.0]);
    cell.sent(32, &[14.0]);
    cell.cycles(200);
    assert_eq!(cell.read(53)[2..], [0.0, 1.0, 0.0, 14.0]);
    cell.sent(18, &[0.0]);
    cell.cycles(600);
    assert_eq!(cell.read(53)[2..], [1.0, 0.0, 0.0, 8.0]);
    cell.sent(31, &[0.0, 0.0]);
    cell.cycle();
    assert_eq!(cell.read(23)[2..4], [0.0, 48.0]);
    cell.sent(32, &[49.0]);
    assert!(cell.events().contains(&RobotEvent::Refused(Code::ARGUMENT_ERROR)));
}

#[test]
fn finger_velocity_above_100_needs_full_force() {
    let mut cell = with(FittedTool::Megp25Ls);
    cell.sent(19, &[200.0]);
    cell.finish(1);
    assert_eq!(cell.read(23)[1], 100.0);
    cell.sent(20, &[100.0]);
    cell.sent(19, &[200.0]);
    cell.finish(2);
    assert_eq!(cell.read(23)[1], 200.0);
}

#[test]
fn a_gripper_command_runs_in_parallel_from_the_deceleration_on() {
    let mut cell = with(FittedTool::Megp25Ls);
    cell.sent(9, &[2.0]);
    cell.sent(1, &[60.0]);
    cell.sent(18, &[1.0]);
    cell.until("the fingers move", |cell| cell.robot.gripper_state().opening_mm > 0.0);
    assert!(!cell.has(MotionStatusFlags::EOM), "the arm is still decelerating");
    assert!(cell.joints()[0] > 20.0);
    cell.sent(1, &[0.0]);
    cell.sent(17, &[1.0]);
    cell.until("the arm is back", |cell| cell.reached() == 1);
}

#[test]
fn gripper_commands_keep_joint_moves_blending_and_stop_linear_ones() {
    for (linear, stops) in [(false, false), (true, true)] {
        let mut cell = with(FittedTool::Megp25E);
        cell.sent(1, &[0.0, 0.0, 0.0, 0.0, 30.0, 0.0]);
        cell.sent(9, &[5.0]);
        cell.sent(12, &[10.0]);
        cell.finish(1);
        if linear {
            cell.sent(5, &[0.0, 30.0, 0.0]);
            cell.sent(18, &[1.0]);
            cell.sent(5, &[0.0, 30.0, 0.0]);
        } else {
            cell.sent(1, &[20.0, 0.0, 0.0, 0.0, 30.0, 0.0]);
            cell.sent(18, &[1.0]);
            cell.sent(1, &[40.0, 0.0, 0.0, 0.0, 30.0, 0.0]);
        }
        cell.sent(17, &[2.0]);
        cell.cycles(5);
        let mut slowest = f32::MAX;
        let mut fastest = 0.0_f32;
        let mut before = cell.joints()[0];
        let mut speeds = Vec::new();
        while cell.reached() != 2 {
            cell.cycle();
            let speed = (cell.joints()[0] - before).abs();
            before = cell.joints()[0];
            speeds.push(speed);
            fastest = fastest.max(speed);
        }
        for speed in &speeds[speeds.len() / 4..speeds.len() * 3 / 4] {
            slowest = slowest.min(*speed);
        }
        assert_eq!(slowest < 0.1 * fastest, stops, "{linear}: {slowest} {fastest}");
    }
}

#[test]
fn a_gripper_needs_homing_after_reactivation_and_only_it_moves() {
    let mut cell = with(FittedTool::Megp25E);
    cell.deactivate();
    cell.activate();
    assert!(!cell.is(RobotStatusFlags::HOMED));
    let at = cell.joints();
    cell.control(RobotControlFlags::HOME, true);
    cell.until("homed", |cell| {
        assert_eq!(cell.joints(), at);
        cell.is(RobotStatusFlags::HOMED)
    });
}

#[test]
fn recovery_mode_limits_an_unhomed_gripper() {
    let mut cell =
        Cell::new(RobotSettings { tool: FittedTool::Megp25Ls, ..RobotSettings::default() });
    cell.control(RobotControlFlags::ENABLE_RECOVERY_MODE, true);
    cell.activate();
    cell.events();
    cell.send(32, &[10.0]);
    assert!(cell.events().contains(&RobotEvent::Refused(Code::NOT_HOMED)));
    cell.sent(19, &[100.0]);
    cell.sent(18, &[1.0]);
    cell.cycles(1000);
    let opening = cell.robot.gripper_state().opening_mm;
    // At 20 % of 50 mm/s.
    assert!((9.0..11.0).contains(&opening), "{opening}");
}

#[test]
fn an_overheated_gripper_lets_go() {
    let mut cell = with(FittedTool::Megp25E);
    cell.robot.panel().set_gripper_overheated(true);
    cell.until("the error", |cell| cell.error() == 3025);
    assert_eq!(cell.read(53)[4], 0.0);
    assert_eq!(cell.read(52)[3], 1.0);
    assert_eq!(cell.robot.reset_error(), Err(Code::RESET_IMPOSSIBLE));
    cell.robot.panel().set_gripper_overheated(false);
    cell.reset_error();
    cell.cycles(10);
    assert_eq!(cell.error(), 0);
}

#[test]
fn valves_open_close_and_close_on_deactivation() {
    let mut cell = with(FittedTool::Mpm500);
    assert_eq!(cell.read(52)[0], 20.0);
    for (command, arguments, expected) in [
        (30, &[1.0, 1.0][..], [1.0, 1.0]),
        (30, &[0.0, -1.0], [0.0, 1.0]),
        (18, &[1.0], [1.0, 0.0]),
        (18, &[0.0], [0.0, 1.0]),
        (30, &[-1.0, -1.0], [0.0, 1.0]),
    ] {
        cell.sent(command, arguments);
        cell.cycles(3);
        assert_eq!(cell.read(53)[..2], expected);
    }
    cell.deactivate();
    assert_eq!(cell.read(53)[..2], [0.0, 0.0]);
    assert!(cell.robot.panel().fit_tool(FittedTool::None));
    assert_eq!(cell.read(53), [0.0; 6]);
}

#[test]
fn valves_do_not_stop_the_robot() {
    let mut cell = with(FittedTool::Mpm500);
    cell.sent(9, &[5.0]);
    cell.finish(1);
    cell.sent(1, &[20.0]);
    cell.sent(30, &[1.0, 0.0]);
    cell.sent(1, &[40.0]);
    cell.sent(17, &[2.0]);
    cell.until("the valve", |cell| cell.dynamic_of(53)[0] == 1.0);
    assert!(!cell.has(MotionStatusFlags::EOM));
    assert!(cell.joints()[0] < 39.0);
}

trait DynamicOf {
    fn dynamic_of(&self, ty: u32) -> [f32; 6];
}

impl DynamicOf for Cell {
    fn dynamic_of(&self, ty: u32) -> [f32; 6] {
        (0..4)
            .map(|slot| self.dynamic(slot))
            .find(|(found, _)| *found == ty)
            .map_or([0.0; 6], |(_, v)| v)
    }
}
