//! Joint limits, work zone, collisions, torque.
#![cfg(feature = "sim")]

mod sim_support;

use fieldarm::sim::meca500::RobotEvent;
use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::image::{MotionStatusFlags, RobotStatusFlags};
use sim_support::Cell;

/// A ready robot that got persistent settings while it was deactivated.
fn configured(commands: &[(u32, &[f32])]) -> Cell {
    let mut cell = Cell::ready();
    cell.deactivate();
    for (id, arguments) in commands {
        cell.sent(*id, arguments);
    }
    cell.activate();
    cell.events();
    cell
}

#[test]
fn user_limits_apply_only_when_enabled() {
    let mut cell = configured(&[(150, &[1.0, -20.0, 20.0])]);
    assert_eq!(cell.read(61)[..], [-20.0, -70.0, -135.0, 20.0, 90.0, 70.0]);
    assert_eq!(cell.read(14)[0], -175.0, "effective limits are the model's");
    assert_eq!(cell.read(12)[0], -175.0);
    assert_eq!(cell.read(15)[2], -36_000.0);
    cell.sent(1, &[30.0]);
    cell.finish(1);
    cell.sent(1, &[0.0]);
    cell.finish(2);
    cell.deactivate();
    cell.sent(151, &[1.0]);
    cell.activate();
    assert_eq!(cell.read(11)[0], 1.0);
    assert_eq!(cell.read(14)[0], -20.0);
    cell.sent(1, &[30.0]);
    cell.until("the error", |cell| cell.error() == 1007);
    cell.reset_error();
    cell.deactivate();
    cell.sent(150, &[1.0, 0.0, 0.0]);
    assert_eq!(cell.read(61)[0], -175.0, "two zeros restore the factory's");
}

#[test]
fn user_limits_stay_within_the_model_and_leave_25_degrees() {
    let mut cell =
        configured(&[(150, &[2.0, -80.0, 0.0]), (150, &[2.0, 0.0, 24.0]), (150, &[7.0, 0.0, 0.0])]);
    assert_eq!(cell.read(61)[1], -70.0);
    assert_eq!(cell.read(61)[4], 90.0);
}

#[test]
fn a_work_zone_breach_follows_its_severity() {
    let zone: (u32, &[f32]) = (153, &[-300.0, -50.0, 0.0, 300.0, 50.0, 500.0]);
    for (severity, error, bit) in [(0.0, 0, false), (1.0, 0, true), (4.0, 3049, true)] {
        let mut cell = configured(&[zone, (152, &[severity, 1.0])]);
        assert_eq!(cell.read(17)[..2], [severity, 1.0]);
        assert_eq!(cell.read(18), [-300.0, -50.0, 0.0, 300.0, 50.0, 500.0]);
        cell.sent(1, &[45.0]);
        cell.cycles(2500);
        assert_eq!(cell.error(), error);
        assert_eq!(cell.is(RobotStatusFlags::WORK_ZONE_STATUS), bit);
        let expected = if bit { [1.0, 1.0, 0.0] } else { [0.0; 3] };
        assert_eq!(cell.read(38)[..3], expected);
        assert_eq!(cell.is_at([45.0, 0.0, 0.0, 0.0, 0.0, 0.0]), error == 0);
        if error != 0 {
            assert!(cell.pose()[1] <= 50.0, "stopped before the border: {:?}", cell.pose());
            cell.reset_error();
            cell.resume();
            assert!(!cell.is(RobotStatusFlags::WORK_ZONE_STATUS), "resuming clears the event");
            cell.sent(1, &[0.0]);
            cell.finish(1);
            assert_eq!(cell.error(), 0);
        }
    }
}

#[test]
fn work_zone_commands_need_good_corners_and_restore_the_factory() {
    let mut cell = configured(&[
        (153, &[-300.0, -50.0, 0.0, 300.0, 50.0, 500.0]),
        (153, &[10.0, -50.0, 0.0, -10.0, 50.0, 500.0]),
    ]);
    assert_eq!(cell.read(18)[0], -300.0);
    cell.deactivate();
    cell.sent(153, &[0.0; 6]);
    assert_eq!(cell.read(18), [-10e3, -10e3, -10e3, 10e3, 10e3, 10e3]);
}

#[test]
fn the_tool_sphere_widens_what_must_stay_inside() {
    let zone: (u32, &[f32]) = (153, &[-300.0, -100.0, 0.0, 300.0, 100.0, 500.0]);
    let mut cell = configured(&[zone, (152, &[4.0, 2.0]), (155, &[0.0, 0.0, 60.0, 20.0])]);
    assert_eq!(cell.read(19)[..4], [0.0, 0.0, 60.0, 20.0]);
    cell.sent(1, &[45.0]);
    cell.until("the error", |cell| cell.error() == 3049);
    assert!(cell.pose()[1] < 80.0, "{:?}", cell.pose());
    assert_eq!(cell.read(38)[..3], [1.0, 2.0, 0.0]);
    // All links: the hand turned inside, the elbow outside.
    let low: (u32, &[f32]) = (153, &[-300.0, -300.0, 0.0, 300.0, 300.0, 320.0]);
    let mut cell = configured(&[low, (152, &[4.0, 3.0])]);
    cell.sent(1, &[0.0, 1.0]);
    cell.until("the error", |cell| cell.error() == 3049);
    assert_eq!(cell.read(38)[1], 0.0, "a link");
}

#[test]
fn an_imminent_collision_follows_its_severity() {
    let into_base = [0.0, -20.0, 70.0, 0.0, 100.0, 0.0];
    for (severity, error, bit) in [(0.0, 0, false), (1.0, 0, true), (4.0, 3041, true)] {
        let mut cell = configured(&[(154, &[severity])]);
        assert_eq!(cell.read(36)[0], severity);
        cell.sent(1, &into_base);
        cell.cycles(4000);
        assert_eq!(cell.error(), error);
        assert_eq!(cell.is(RobotStatusFlags::COLLISION_STATUS), bit);
        assert_eq!(cell.read(37)[0], f32::from(u8::from(bit)));
        if error != 0 {
            assert!(cell.events().contains(&RobotEvent::Error(Code::COLLISION_ERROR)));
            cell.reset_error();
            cell.resume();
            assert!(!cell.is(RobotStatusFlags::COLLISION_STATUS));
            assert_eq!(cell.read(37), [0.0; 6]);
        }
    }
}

#[test]
fn torque_limits_follow_severity_and_detection() {
    for (severity, detection, expected) in [
        (0.0, 2.0, (false, false, 0)),
        (1.0, 2.0, (true, false, 0)),
        (2.0, 2.0, (true, true, 0)),
        (4.0, 2.0, (true, true, 3029)),
        (1.0, 0.0, (true, false, 0)),
    ] {
        let mut cell = Cell::ready();
        cell.sent(27, &[90.0, 90.0, 90.0, 30.0, 90.0, 90.0]);
        cell.sent(28, &[severity, detection]);
        cell.finish(1);
        assert_eq!(cell.read(24)[..2], [severity, detection]);
        assert_eq!(cell.read(25)[3], 30.0);
        cell.cycles(10);
        assert!(!cell.has(MotionStatusFlags::EXCESSIVE_TORQUE));
        cell.robot.panel().push_joint(4, 60.0);
        cell.cycles(10);
        let found = (
            cell.has(MotionStatusFlags::EXCESSIVE_TORQUE),
            cell.has(MotionStatusFlags::PAUSED),
            cell.error(),
        );
        assert_eq!(found, expected, "{severity} {detection}");
        assert!((cell.read(43)[3] - cell.read(33)[3] - 60.0).abs() < 1.0);
        cell.robot.panel().push_joint(4, 0.0);
        cell.cycles(10);
        assert!(!cell.has(MotionStatusFlags::EXCESSIVE_TORQUE));
        if severity == 2.0 {
            cell.resume();
        }
    }
}

#[test]
fn detection_1_ignores_accelerations() {
    let mut cell = Cell::ready();
    cell.sent(9, &[150.0]);
    cell.sent(8, &[100.0]);
    cell.sent(27, &[15.0, 90.0, 90.0, 90.0, 90.0, 90.0]);
    cell.sent(28, &[4.0, 1.0]);
    cell.sent(1, &[90.0]);
    cell.finish(1);
    assert_eq!(cell.error(), 0);
    cell.sent(28, &[4.0, 0.0]);
    cell.sent(1, &[0.0]);
    cell.until("the error", |cell| cell.error() == 3029);
}

#[test]
fn torque_limits_need_homing() {
    let mut cell = Cell::new(fieldarm::sim::meca500::RobotSettings::default());
    cell.cycle();
    cell.activate();
    cell.events();
    cell.send(27, &[50.0; 6]);
    assert!(cell.events().contains(&RobotEvent::Refused(Code::NOT_HOMED)));
}

#[test]
fn a_blocked_joint_ends_in_an_error_of_motion() {
    let mut cell = Cell::ready();
    cell.robot.panel().block_joint(1, true);
    cell.sent(1, &[30.0]);
    cell.until("the error", |cell| cell.error() == 3005);
    cell.control(fieldarm::wire::meca500::image::RobotControlFlags::RESET_ERROR, false);
    assert!(cell.is_at([0.0; 6]), "the arm is where it was held: {:?}", cell.joints());
    cell.robot.panel().block_joint(1, false);
    cell.reset_error();
    cell.resume();
    cell.sent(1, &[30.0]);
    cell.finish(1);
}
