//! Joint limits, work zone, collisions, torque.
#![cfg(feature = "sim")]

mod sim_support;

use fieldarm::sim::meca500::{
    FittedTool, Part, PersistentSettings, RecoveryCaps, RobotEvent, RobotSettings, SimulationType,
};
use fieldarm::time::Duration;
use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::image::{
    MotionControlFlags, MotionStatusFlags, RobotControlFlags, RobotStatusFlags,
};
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

#[test]
fn settings_that_make_no_sense_break_nothing() {
    for odd in [-20.0, 0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MIN, f64::MAX] {
        let mut settings = RobotSettings {
            tool: FittedTool::Megp25E,
            joints: [odd; 6],
            position_error_before_homing_deg: odd,
            recovery_caps: RecoveryCaps {
                joint_velocity_percent: odd,
                joint_acceleration_percent: odd,
                linear_velocity_mm_per_s: odd,
                angular_velocity_deg_per_s: odd,
                cart_acceleration_percent: odd,
                gripper_percent: odd,
            },
            ..RobotSettings::default()
        };
        settings.times.activation = Duration::ZERO;
        let mut cell = Cell::new(settings);
        cell.control(RobotControlFlags::ENABLE_RECOVERY_MODE, true);
        cell.cycle();
        cell.activate();
        for (id, arguments) in
            [(18, &[1.0][..]), (1, &[5.0]), (2, &[190.0, 0.0, 308.0]), (4, &[1.0]), (9, &[1.0])]
        {
            cell.sent(id, arguments);
            cell.cycles(200);
        }
        assert!(cell.joints().iter().all(|joint| joint.is_finite()), "{odd}");
        assert!(cell.read(40).iter().all(|joint| joint.is_finite()), "{odd}");

        let persistent = cell.robot.persistent_mut();
        persistent.joint_limits_enabled = true;
        persistent.user_joint_limits.min = [odd; 6];
        persistent.user_joint_limits.max = [-odd; 6];
        persistent.tool_sphere = [odd; 4];
        persistent.work_zone_min = [odd; 3];
        persistent.work_zone_max = [-odd; 3];
        cell.control(RobotControlFlags::ENABLE_RECOVERY_MODE, false);
        let mut panel = cell.robot.panel();
        panel.place_part(Some(Part::Outer(odd)));
        panel.push_joint(1, odd);
        panel.push_joint(usize::MAX, odd);
        panel.block_joint(0, true);
        panel.move_by_hand([odd; 6]);
        for (id, arguments) in
            [(1, &[1.0][..]), (21, &[5.0]), (22, &[5.0]), (18, &[1.0]), (18, &[0.0])]
        {
            cell.send(id, arguments);
            cell.cycles(100);
        }
        cell.robot.panel().place_part(Some(Part::Inner(odd)));
        cell.cycles(100);
        assert!(cell.joints().iter().all(|joint| joint.is_finite()), "{odd}");
    }
}

#[test]
fn a_jump_of_days_takes_a_bounded_time() {
    let days = Duration::from_secs(30 * 86_400);
    for simulation in [SimulationType::Normal, SimulationType::Fast] {
        let mut settings = RobotSettings { homed: true, ..RobotSettings::default() };
        settings.persistent.simulation = simulation;
        let mut cell = Cell::new(settings);
        cell.control(RobotControlFlags::ACTIVATE_SIM, simulation == SimulationType::Fast);
        cell.cycle();
        cell.activate();
        cell.home();
        cell.robot.panel().push_joint(1, 10.0);
        cell.write_with(0, 21, &[5.0]);
        cell.cycles(100);
        cell.motion(MotionControlFlags::SET_POINT, false);
        cell.now += days;
        // Minutes, when each of its milliseconds is lived through.
        let begun = std::time::Instant::now();
        cell.cycle();
        assert!(begun.elapsed().as_secs() < 60);
        let timestamp = cell.inputs.robot_timestamp.values();
        assert!(u64::from(timestamp.seconds) >= days.as_secs());
        assert!(cell.has(MotionStatusFlags::EOM), "the velocity ended with its timeout");
        let is_near = cell.joints()[0].abs() < 2.0;
        assert!(is_near || simulation == SimulationType::Fast, "{:?}", cell.joints());
        cell.sent(6, &[1_000_000.0]);
        cell.sent(17, &[3.0]);
        cell.cycles(2);
        cell.now += days;
        cell.cycle();
        cell.cycles(2);
        assert_eq!(cell.reached(), 3);
    }
}

#[test]
fn user_limits_never_widen_those_of_the_model() {
    let mut persistent = PersistentSettings { joint_limits_enabled: true, ..Default::default() };
    persistent.user_joint_limits.min = [f64::NAN, f64::NEG_INFINITY, -10.0, -900.0, 0.0, 0.0];
    persistent.user_joint_limits.max = [f64::INFINITY, 10.0, f64::NAN, 900.0, 1.0, 1e9];
    let limits = persistent.effective_joint_limits();
    assert_eq!(limits.min, [-175.0, -70.0, -10.0, -170.0, 0.0, 0.0]);
    assert_eq!(limits.max, [175.0, 10.0, 70.0, 170.0, 1.0, 36_000.0]);
}
