//! Moves: profiles, blending, frames, configuration, durations, time scaling, planning errors.
#![cfg(feature = "sim")]

mod sim_support;

use fieldarm::sim::meca500::RobotEvent;
use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::image::{MotionControlFlags, MotionStatusFlags};
use fieldarm::wire::meca500::revision::Revision;
use sim_support::{Cell, close};

/// Cycles from sending a `MoveJoints` to its checkpoint.
fn time_of_move(cell: &mut Cell, target: [f32; 6]) -> u32 {
    cell.sent(1, &target);
    let unused = 100 + cell.echo();
    cell.finish(unused)
}

#[test]
fn joints_start_and_stop_together() {
    let mut cell = Cell::ready();
    cell.sent(1, &[60.0, 10.0, -30.0, 0.0, 5.0, 0.0]);
    cell.sent(17, &[1.0]);
    while cell.reached() != 1 {
        let joints = cell.joints();
        let fraction = joints[0] / 60.0;
        let expected = [60.0, 10.0, -30.0, 0.0, 5.0, 0.0].map(|target| target * fraction);
        assert!(close(joints, expected, 1e-3), "a straight line in joint space: {joints:?}");
        cell.cycle();
    }
}

#[test]
fn joint_velocity_sets_the_pace_and_its_limit_caps_it() {
    let mut cell = Cell::ready();
    let default = time_of_move(&mut cell, [75.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    // 75 deg at 25 % of 150 deg/s, and ramps of 25 ms.
    assert!((2000..2100).contains(&default), "{default}");
    cell.sent(8, &[50.0]);
    let faster = time_of_move(&mut cell, [0.0; 6]);
    assert!((1000..1120).contains(&faster), "{faster}");
    cell.sent(33, &[25.0]);
    let limited = time_of_move(&mut cell, [75.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert!(limited.abs_diff(default) <= 3, "{limited}");
}

#[test]
fn percentages_above_100_need_a_revision_4() {
    for (revision, accepted) in [(Revision::R3, false), (Revision::R4, true)] {
        let mut cell = Cell::ready_with(|settings| settings.revision = revision);
        cell.sent(8, &[150.0]);
        let refused = cell.events().contains(&RobotEvent::Refused(Code::ARGUMENT_ERROR));
        assert_eq!(refused, !accepted);
        assert_eq!(cell.read(2)[0], if accepted { 4.0 } else { 3.0 });
    }
}

#[test]
fn blending_rounds_corners_between_moves_of_one_kind() {
    let times = [0.0, 100.0].map(|blending| {
        let mut cell = Cell::ready();
        cell.sent(7, &[blending]);
        cell.sent(9, &[5.0]);
        cell.finish(9);
        for target in [[20.0, 0.0], [20.0, 20.0], [0.0, 20.0]] {
            cell.sent(1, &target);
        }
        cell.sent(17, &[1.0]);
        let mut stops = 0;
        let mut cycles = 0;
        while cell.reached() != 1 {
            let before = cell.joints();
            cell.cycle();
            cycles += 1;
            let at_an_end =
                cycles < 20 || close(cell.joints(), [0.0, 20.0, 0.0, 0.0, 0.0, 0.0], 0.5);
            stops += u32::from(close(before, cell.joints(), 1e-5) && !at_an_end);
            assert!(cycles < 60_000);
        }
        (cycles, stops)
    });
    let [(stopping, _), (blended, stops)] = times;
    assert!(blended + 500 < stopping, "{blended} {stopping}");
    assert_eq!(stops, 0, "never at rest between blended moves");
}

#[test]
fn moves_of_two_kinds_never_blend_and_acceleration_settings_stop_the_robot() {
    for between in [None, Some(9_u32), Some(13)] {
        let mut cell = Cell::ready();
        cell.sent(1, &[0.0, 0.0, 0.0, 0.0, 30.0, 0.0]);
        cell.finish(1);
        let corner = [20.0, 0.0, 0.0, 0.0, 30.0, 0.0];
        cell.sent(1, &corner);
        match between {
            None => cell.sent(5, &[0.0, 0.0, 30.0]),
            Some(9) => {
                cell.sent(9, &[50.0]);
                cell.sent(1, &[20.0, 20.0, 0.0, 0.0, 30.0, 0.0]);
            }
            Some(_) => {
                cell.sent(13, &[0.0, 0.0, 1.0]);
                cell.sent(1, &[20.0, 20.0, 0.0, 0.0, 30.0, 0.0]);
            }
        }
        cell.sent(17, &[2.0]);
        let mut passed_corner = false;
        while cell.reached() != 2 {
            passed_corner |= close(cell.joints(), corner, 1e-4);
            cell.cycle();
        }
        assert!(passed_corner, "{between:?}");
    }
}

#[test]
fn a_linear_move_keeps_the_line_and_its_velocity() {
    let mut cell = Cell::ready();
    cell.sent(1, &[0.0, 0.0, 0.0, 0.0, 30.0, 0.0]);
    cell.finish(1);
    let start = cell.pose();
    cell.sent(11, &[50.0]);
    cell.sent(5, &[0.0, 60.0, -30.0]);
    cell.sent(17, &[2.0]);
    cell.request([34; 4]);
    let mut fastest = 0.0_f32;
    while cell.reached() != 2 {
        let pose = cell.pose();
        let (y, z) = (pose[1] - start[1], pose[2] - start[2]);
        assert!((y + 2.0 * z).abs() < 1e-2 && (pose[0] - start[0]).abs() < 1e-2, "{pose:?}");
        let (ty, v) = cell.dynamic(0);
        if ty == 34 {
            fastest = fastest.max((v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt());
        }
        cell.cycle();
    }
    assert!((49.0..50.2).contains(&fastest), "{fastest}");
}

#[test]
fn move_pose_takes_the_desired_posture_and_all_eight_exist() {
    let pose = [77.0, 210.0, 300.0, -103.0, 36.0, 175.0];
    let mut cell = Cell::ready();
    for shoulder in [1.0, -1.0] {
        for elbow in [1.0, -1.0] {
            for wrist in [1.0, -1.0] {
                cell.sent(15, &[shoulder, elbow, wrist]);
                cell.sent(2, &pose);
                cell.finish(1);
                cell.sent(17, &[2.0]);
                let found = cell.inputs.target_configuration;
                let found = [found.shoulder, found.elbow, found.wrist].map(f32::from);
                assert_eq!(found, [shoulder, elbow, wrist]);
                assert!(close(cell.pose(), pose, 0.01), "{:?}", cell.pose());
                assert_eq!(&cell.read(20)[..3], &[shoulder, elbow, wrist]);
            }
        }
    }
    assert_eq!(cell.error(), 0);
}

#[test]
fn set_auto_conf_0_takes_the_configuration_at_its_place() {
    let mut cell = Cell::ready();
    cell.sent(16, &[0.0]);
    cell.finish(1);
    assert_eq!(&cell.read(20)[..3], &[1.0, 1.0, 1.0]);
    cell.sent(16, &[1.0]);
    cell.finish(2);
    assert!(cell.read(20)[0].is_nan());
    cell.sent(1, &[0.0, 0.0, 0.0, 0.0, -30.0, 400.0]);
    cell.sent(16, &[0.0]);
    cell.sent(26, &[0.0]);
    cell.finish(3);
    assert_eq!(&cell.read(20)[..4], &[1.0, 1.0, -1.0, 1.0]);
    assert_eq!(cell.inputs.target_configuration.turn, 1);
    // Joint moves ignore it.
    cell.sent(1, &[0.0, 0.0, 0.0, 0.0, 30.0, 0.0]);
    cell.finish(4);
    assert_eq!(cell.error(), 0);
}

#[test]
fn planning_errors_have_the_codes_of_the_manual() {
    let bent = [0.0, 0.0, 0.0, 0.0, 30.0, 0.0];
    for (setup, id, arguments, code) in [
        (&[][..], 1, [200.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1007),
        (&[], 29, [0.0, 300.0, 0.0, 0.0, 0.0, 0.0], 1007),
        (&[], 2, [1000.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1016),
        (&[], 3, [1000.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1016),
        (&[], 4, [0.0, 0.0, 0.0, 0.0, 0.0, 180.0], 1010),
        (&[(15_u32, [1.0_f32, 1.0, -1.0])], 4, [0.0, 0.0, 5.0, 0.0, 0.0, 0.0], 1033),
        (
            &[(49, [1.0, 0.0, 0.0]), (51, [0.01, 0.0, 0.0])],
            1,
            [90.0, 0.0, 0.0, 0.0, 30.0, 0.0],
            3051,
        ),
    ] {
        let mut cell = Cell::ready();
        cell.sent(1, &bent);
        for (id, arguments) in setup {
            cell.sent(*id, arguments);
        }
        cell.finish(1);
        cell.sent(id, &arguments);
        cell.until("the error", |cell| cell.error() != 0);
        assert_eq!(cell.error(), code, "{id} {arguments:?}");
        assert!(close(cell.joints(), bent, 1e-4), "the move does not start");
    }
}

#[test]
fn time_based_moves_keep_their_duration_or_follow_the_severity() {
    let mut cell = Cell::ready();
    cell.sent(49, &[1.0]);
    cell.sent(51, &[2.0]);
    let cycles = time_of_move(&mut cell, [30.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    // The ramps come on top (PM L2687).
    assert!((2000..2100).contains(&cycles), "{cycles}");
    for (severity, warns) in [(0.0, false), (1.0, true)] {
        cell.sent(50, &[severity]);
        cell.sent(51, &[0.0]);
        cell.events();
        time_of_move(&mut cell, [0.0; 6]);
        time_of_move(&mut cell, [30.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let warning = RobotEvent::Warning(Code::MOVE_DURATION_TOO_SHORT);
        assert_eq!(cell.events().contains(&warning), warns);
        assert_eq!(cell.error(), 0);
    }
}

#[test]
fn time_scaling_scales_moves_and_delays() {
    let mut cell = Cell::ready();
    let full = time_of_move(&mut cell, [30.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    cell.sent(48, &[50.0]);
    assert_eq!(cell.read(54)[0], 50.0);
    let half = time_of_move(&mut cell, [0.0; 6]);
    assert!(half.abs_diff(2 * full) < 60, "{full} {half}");
    cell.sent(6, &[0.5]);
    let delay = cell.finish(3);
    assert!((990..1010).contains(&delay), "{delay}");
}

/// Cycles in which a velocity command with a MoveID moves the arm, and how far it goes.
fn time_and_way_of_velocity(cell: &mut Cell) -> (u32, f32) {
    let start = cell.joints()[0];
    cell.sent(21, &[20.0]);
    cell.until("moving", |cell| !cell.has(MotionStatusFlags::EOM));
    let cycles = cell.until("at rest", |cell| cell.has(MotionStatusFlags::EOM));
    (cycles, cell.joints()[0] - start)
}

#[test]
fn time_scaling_scales_the_velocity_timeout_and_keeps_the_way() {
    let mut cell = Cell::ready();
    cell.sent(24, &[0.5]);
    let (full, way) = time_and_way_of_velocity(&mut cell);
    assert!((500..540).contains(&full), "{full}");
    cell.sent(48, &[25.0]);
    cell.cycles(100);
    let (quarter, scaled_way) = time_and_way_of_velocity(&mut cell);
    assert!(quarter.abs_diff(4 * full) < 40, "{full} {quarter}");
    assert!((way - scaled_way).abs() < 0.05, "{way} {scaled_way}");
}

#[test]
fn time_scaling_acts_at_once_during_a_move_and_a_delay_and_keeps_the_path() {
    let steps_of = |cell: &mut Cell| {
        let before = cell.joints();
        cell.cycle();
        [0, 1].map(|joint| cell.joints()[joint] - before[joint])
    };
    let mut cell = Cell::ready();
    cell.sent(1, &[60.0, 30.0]);
    cell.sent(17, &[5.0]);
    cell.cycles(500);
    let [full, _] = steps_of(&mut cell);
    cell.sent(48, &[20.0]);
    let [next, _] = steps_of(&mut cell);
    assert!(next < full - 1e-4, "slower in the next cycle: {full} {next}");
    cell.cycles(60);
    let [scaled, other] = steps_of(&mut cell);
    assert!((scaled - 0.2 * full).abs() < 0.02 * full, "{full} {scaled}");
    assert!((scaled - 2.0 * other).abs() < 1e-3, "the path stays: {scaled} {other}");
    let joints = cell.joints();
    assert!((joints[0] - 2.0 * joints[1]).abs() < 1e-3, "{joints:?}");
    assert_eq!(cell.reached(), 0, "it was the move under way that was slowed");
    cell.sent(48, &[100.0]);
    cell.until("the checkpoint", |cell| cell.reached() == 5);
    assert!(cell.is_at([60.0, 30.0, 0.0, 0.0, 0.0, 0.0]));

    cell.sent(6, &[1.0]);
    cell.cycles(500);
    cell.sent(48, &[25.0]);
    let left = cell.finish(6);
    // Half a second is left, at a quarter of the pace.
    assert!((1950..2010).contains(&left), "{left}");
}

#[test]
fn time_scaling_is_allowed_in_any_state() {
    for (state, mut cell) in sim_support::cells_in_many_states() {
        cell.sent(48, &[10.0]);
        assert_eq!(cell.read(54)[0], 10.0, "{state}");
    }
}

#[test]
fn frames_of_tool_and_world_shift_the_pose() {
    let mut cell = Cell::ready();
    let bare = cell.pose();
    assert!(close(bare, [190.0, 0.0, 308.0, 0.0, 90.0, 0.0], 1e-3));
    cell.sent(13, &[0.0, 0.0, 20.0]);
    cell.finish(1);
    assert!(close(cell.pose(), [210.0, 0.0, 308.0, 0.0, 90.0, 0.0], 1e-3), "{:?}", cell.pose());
    cell.sent(14, &[10.0, 0.0, 8.0]);
    cell.finish(2);
    assert!(close(cell.pose(), [200.0, 0.0, 300.0, 0.0, 90.0, 0.0], 1e-3), "{:?}", cell.pose());
}

#[test]
fn relative_moves_start_where_the_one_before_ends() {
    let mut cell = Cell::ready();
    cell.sent(7, &[0.0]);
    cell.sent(29, &[10.0, 5.0]);
    cell.sent(29, &[10.0, -5.0]);
    cell.finish(1);
    assert!(cell.is_at([20.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
}

#[test]
fn the_turn_of_joint_6_is_reported_and_bounded() {
    let mut cell = Cell::ready();
    cell.sent(8, &[100.0]);
    for (joint, turn) in [(180.0, 0), (181.0, 1), (-180.0, -1), (541.0, 2)] {
        cell.sent(1, &[0.0, 0.0, 0.0, 0.0, 0.0, joint]);
        cell.finish(1);
        cell.sent(17, &[2.0]);
        assert_eq!(cell.inputs.target_configuration.turn, turn, "{joint}");
    }
    cell.sent(1, &[0.0, 0.0, 0.0, 0.0, 0.0, 36_001.0]);
    cell.until("the error", |cell| cell.error() == 1007);
}

#[test]
fn calibration_is_configured_while_deactivated() {
    let mut cell = Cell::ready();
    cell.sent(156, &[0.0]);
    assert_eq!(cell.read(30)[..2], [1.0, 0.0]);
    cell.motion(MotionControlFlags::SET_POINT, false);
    cell.deactivate();
    cell.sent(156, &[0.0]);
    assert_eq!(cell.read(30)[..2], [0.0, 0.0]);
    assert!(cell.has(MotionStatusFlags::EOM));
}
