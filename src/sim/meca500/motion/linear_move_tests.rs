//! Tests of [`super`]: lines of the tool, their errors, singularities and velocities.

use super::*;
use crate::sim::meca500::kinematics::{forward, inverse};
use crate::sim::meca500::motion::{FULL_JOINT_ACCELERATION, RATED_VELOCITY};
use proptest::prelude::*;

fn settings() -> LinearSettings {
    LinearSettings {
        frames: Frames::default(),
        limits: JointLimits::MODEL,
        joint_velocity: RATED_VELOCITY,
        joint_acceleration: FULL_JOINT_ACCELERATION,
        linear_velocity: 150.0,
        angular_velocity: 45.0,
        linear_acceleration: 1000.0,
        angular_acceleration: 500.0,
        pace: Pace::Velocity,
        posture: None,
        turn: None,
    }
}

/// Tool velocities and accelerations that leave the pace to the joints.
fn fast() -> LinearSettings {
    LinearSettings {
        linear_velocity: 2000.0,
        angular_velocity: 1000.0,
        linear_acceleration: 10_000.0,
        angular_acceleration: 5_000.0,
        ..settings()
    }
}

fn posture(numbers: [i8; 3]) -> Option<Posture> {
    Posture::from_numbers(numbers)
}

fn shifted(start: &Joints, [x, y, z]: [f64; 3]) -> Pose {
    let mut pose = forward(start);
    pose.position += glam::DVec3::new(x, y, z);
    pose
}

/// Samples the plan each millisecond and checks what every line promises; returns its largest
/// share of a joint velocity limit.
fn walk(plan: &LinearPlan, settings: &LinearSettings, off_line_mm: f64) -> f64 {
    let step = 0.001;
    let steps = libm::ceil(plan.duration_s() / step) as u32;
    let mut before = plan.sample(0.0);
    let mut share: f64 = 0.0;
    let mut tool_before = plan.tool_at(0.0);
    for index in 1..=steps {
        let seconds = step * f64::from(index);
        let joints = plan.sample(seconds);
        assert_eq!(settings.limits.check(&joints), Ok(()), "at {seconds}");
        for (index, limit) in settings.joint_velocity.iter().enumerate() {
            let velocity = (joints[index] - before[index]).abs() / step;
            assert!(velocity <= *limit, "joint {} at {velocity} at {seconds}", index + 1);
            share = share.max(velocity / limit);
        }
        let tool = forward(&joints) * settings.frames.trf;
        let wanted = plan.tool_at(seconds);
        let (off, turned) = (tool.position.distance(wanted.position), tool.angle_to(&wanted));
        assert!(off < off_line_mm && turned < off_line_mm, "{off} mm, {turned} deg at {seconds}");
        if settings.pace == Pace::Velocity {
            let speed = wanted.position.distance(tool_before.position) / step;
            assert!(speed <= settings.linear_velocity * (1.0 + 1e-6), "{speed} at {seconds}");
            let turn = wanted.angle_to(&tool_before) / step;
            assert!(turn <= settings.angular_velocity * (1.0 + 1e-6), "{turn} at {seconds}");
        }
        (before, tool_before) = (joints, wanted);
    }
    assert_eq!(before, plan.end());
    share
}

fn planned(start: &Joints, target: &Pose, settings: &LinearSettings) -> LinearPlan {
    match plan_linear_move(start, target, settings) {
        Ok(plan) => plan,
        Err(error) => panic!("{start:?} to {target:?}: {error}"),
    }
}

const BENT: Joints = [0.0, 0.0, 0.0, 0.0, 60.0, 0.0];

#[test]
fn a_line_takes_the_time_of_its_trapezoid_and_stays_straight() {
    let target = shifted(&BENT, [0.0, 60.0, -30.0]);
    let plan = planned(&BENT, &target, &settings());
    let length = libm::hypot(60.0, 30.0);
    let ideal = Trapezoid::new(length, 150.0, 1000.0);
    assert!((plan.duration_s() - ideal.duration_s()).abs() < 1e-9);
    assert!((plan.acceleration_s() - ideal.ramp_s()).abs() < 1e-9);
    assert!((plan.deceleration_s() - ideal.ramp_s()).abs() < 1e-9);
    walk(&plan, &settings(), 1e-6);
    let from = forward(&BENT).position;
    let along = (target.position - from).normalize();
    for index in 0..=50 {
        let point = forward(&plan.sample(plan.duration_s() * f64::from(index) / 50.0)).position;
        let across = (point - from) - along * (point - from).dot(along);
        assert!(across.length() < 1e-6);
    }
    assert!(forward(&plan.end()).position.distance(target.position) < 1e-9);
}

#[test]
fn the_tool_frame_keeps_its_point_still_while_it_turns() {
    let mut settings = settings();
    settings.frames.trf = Pose::from_xyz_euler([0.0, 0.0, 50.0, 0.0, 0.0, 0.0]);
    settings.frames.wrf = Pose::from_xyz_euler([30.0, 0.0, 0.0, 0.0, 0.0, 90.0]);
    let turn = Pose::from_xyz_euler([0.0, 0.0, 0.0, 20.0, 10.0, 30.0]);
    let target = settings.frames.target_relative_to_tool(&BENT, &turn);
    let plan = planned(&BENT, &target, &settings);
    walk(&plan, &settings, 1e-6);
    let tip = plan.tool_at(0.0).position;
    let middle = forward(&plan.sample(0.5 * plan.duration_s())) * settings.frames.trf;
    assert!(middle.position.distance(tip) < 1e-6);
    // Smallest rotation: half the way is half the angle, about one axis.
    let whole = plan.tool_at(0.0).angle_to(&plan.tool_at(plan.duration_s()));
    assert!((plan.tool_at(0.0).angle_to(&middle) - 0.5 * whole).abs() < 1e-6);
}

#[test]
fn half_a_turn_is_refused_and_a_little_less_is_not() {
    let base = forward(&BENT);
    for (angle, refused) in [(180.0, true), (-180.0, true), (179.9, false), (-179.9, false)] {
        let target = base * Pose::from_xyz_euler([0.0, 0.0, 0.0, 0.0, 0.0, angle]);
        let result = plan_linear_move(&BENT, &target, &settings());
        assert_eq!(matches!(result, Err(PlanError::HalfTurn)), refused, "{angle}");
        assert_eq!(result.is_ok(), !refused);
    }
}

#[test]
fn poses_out_of_reach_are_told_apart_by_where() {
    let far = plan_linear_move(&BENT, &shifted(&BENT, [400.0, 0.0, 0.0]), &settings());
    assert_eq!(far.err(), Some(PlanError::OutOfReach));
    // The tool's point lies behind the wrist centre, which swings around it on an arc: both ends
    // are 252 mm from the shoulder, the middle 266 mm, the reach is 261 mm.
    let mut settings = settings();
    settings.frames.trf = Pose::from_xyz_euler([0.0, 0.0, -150.0, 0.0, 0.0, 0.0]);
    settings.limits.max[1] = 120.0;
    let tool = |pitch: f64| Pose::from_xyz_euler([186.0, 0.0, 135.0, 0.0, pitch, 0.0]);
    let start = inverse(&settings.frames.flange_of_tool(&tool(130.0)), &[0.0; 6])
        .iter()
        .map(|solution| solution.joints)
        .find(|joints| JointLimits::MODEL.check(joints).is_ok());
    let outcome = start.map(|start| plan_linear_move(&start, &tool(50.0), &settings));
    assert!(
        matches!(outcome, Some(Err(PlanError::OutOfReachOnPath { at })) if at < 0.5),
        "{outcome:?}"
    );
}

#[test]
fn a_joint_limit_on_the_way_is_told() {
    let mut settings = settings();
    settings.limits.max[0] = 5.0;
    let refused = plan_linear_move(&BENT, &shifted(&BENT, [0.0, 60.0, 0.0]), &settings);
    let Err(PlanError::LimitOnPath { at, excess }) = refused else {
        panic!("{refused:?}");
    };
    assert!(excess.joint == 1 && at > 0.0 && at < 1.0);
}

#[test]
fn the_start_must_be_in_the_desired_configuration() {
    let target = shifted(&BENT, [0.0, 10.0, 0.0]);
    let wrong = LinearSettings { posture: posture([1, 1, -1]), ..settings() };
    assert_eq!(plan_linear_move(&BENT, &target, &wrong).err(), Some(PlanError::StartMismatch));
    let wrong = LinearSettings { turn: Some(1), ..settings() };
    assert_eq!(plan_linear_move(&BENT, &target, &wrong).err(), Some(PlanError::StartMismatch));
    let right = LinearSettings { posture: posture([1, 1, 1]), turn: Some(0), ..settings() };
    assert!(plan_linear_move(&BENT, &target, &right).is_ok());
}

#[test]
fn a_desired_turn_must_not_be_left() {
    let start = [0.0, 0.0, 0.0, 0.0, 60.0, 170.0];
    let target = forward(&start) * Pose::from_xyz_euler([0.0, 0.0, 0.0, 0.0, 0.0, 30.0]);
    let free = planned(&start, &target, &settings());
    assert_eq!(turn_of(free.end()[5]), 1);
    let kept = LinearSettings { turn: Some(0), ..settings() };
    let refused = plan_linear_move(&start, &target, &kept);
    assert!(matches!(refused, Err(PlanError::LimitOnPath { excess, .. }) if excess.joint == 6));
}

/// From A over Z1 (all joints at zero) to B: joint 5 changes its sign. Manual, Figure 12a.
fn through_zero() -> (Joints, Pose) {
    let zero = forward(&[0.0; 6]);
    let start = Pose { position: zero.position + glam::DVec3::new(0.0, 0.0, -40.0), ..zero };
    let target = Pose { position: zero.position + glam::DVec3::new(0.0, 0.0, 40.0), ..zero };
    let joints = inverse(&start, &[0.0; 6])
        .iter()
        .map(|solution| solution.joints)
        .find(|joints| joints[3].abs() < 1e-9 && joints[0].abs() < 1e-9 && joints[1] > -70.0);
    (joints.unwrap_or([f64::NAN; 6]), target)
}

#[test]
fn a_wrist_singularity_is_crossed_when_the_posture_is_free() {
    let (start, target) = through_zero();
    let plan = planned(&start, &target, &settings());
    walk(&plan, &settings(), 1e-6);
    assert_eq!(start[4].signum(), -plan.end()[4].signum());
    assert!(plan.end()[3].abs() < 1e-6 && plan.end()[4].abs() > 5.0);
    // Undisturbed: as long as the same line far from any singularity would take.
    let ideal = Trapezoid::new(80.0, 150.0, 1000.0);
    assert!((plan.duration_s() - ideal.duration_s()).abs() < 1e-3);
}

#[test]
fn a_wrist_singularity_is_refused_when_joint_4_has_no_room_to_turn() {
    let (start, target) = through_zero();
    let kept = LinearSettings { posture: Some(Posture::of(&start)), ..settings() };
    let refused = plan_linear_move(&start, &target, &kept);
    let Err(PlanError::Singularity { at }) = refused else { panic!("{refused:?}") };
    assert!((at - 0.5).abs() < 0.01);
}

#[test]
fn the_hand_turns_on_the_spot_when_the_posture_is_desired() {
    // Figure 12c: Z2 has joint 4 at 90 and joint 6 at -90; lines along y change joint 5.
    let (start, mut target) = beside_z2(0.0);
    target.position.y -= 40.0;
    let free = planned(&start, &target, &settings());
    walk(&free, &settings(), 1e-6);
    assert!((free.end()[3] - start[3]).abs() < 90.0);
    let kept = LinearSettings { posture: Some(Posture::of(&start)), ..settings() };
    let plan = planned(&start, &target, &kept);
    walk(&plan, &kept, 1e-6);
    assert_eq!(Posture::of(&plan.end()), Posture::of(&start));
    assert!((plan.end()[3] - free.end()[3]).abs() > 179.0);
    assert!(forward(&plan.end()).position.distance(target.position) < 1e-9);
    assert!(plan.duration_s() > free.duration_s() + 180.0 / 300.0);
}

#[test]
fn a_line_that_starts_blocked_turns_the_hand_first() {
    // The manual's zero posture cannot move sideways before joints 4 and 6 have turned a quarter.
    let target = shifted(&[0.0; 6], [0.0, 40.0, 0.0]);
    let plan = planned(&[0.0; 6], &target, &settings());
    walk(&plan, &settings(), 1e-6);
    assert!(plan.end()[3].abs() > 45.0);
}

#[test]
fn a_shoulder_singularity_is_crossed_only_when_the_posture_is_free() {
    // Tool at the wrist centre, moved through the axis of joint 1.
    let mut settings = settings();
    settings.frames.trf = Pose::from_xyz_euler([0.0, 0.0, -70.0, 0.0, 0.0, 0.0]);
    let start = [0.0, 10.0, -70.0, 0.0, 60.0, 0.0];
    let mut target = settings.frames.tool_of_joints(&start);
    assert!(target.position.x > 0.0);
    target.position.x = -30.0;
    let plan = planned(&start, &target, &settings);
    walk(&plan, &settings, 1e-6);
    assert_eq!(Posture::of(&plan.end()).numbers()[0], -1);
    let kept = LinearSettings { posture: Some(Posture::of(&start)), ..settings };
    let refused = plan_linear_move(&start, &target, &kept);
    assert!(matches!(refused, Err(PlanError::Singularity { .. })), "{refused:?}");
}

/// A start 40 mm beside Z2 along y, and the pose of Z2; both `off` mm higher.
fn beside_z2(off: f64) -> (Joints, Pose) {
    let z2 = [0.0, 0.0, 0.0, 90.0, 0.0, -90.0];
    let start = inverse(&shifted(&z2, [0.0, 40.0, off]), &z2)
        .iter()
        .map(|solution| solution.joints)
        .filter(|joints| JointLimits::MODEL.check(joints).is_ok())
        .find(|joints| {
            (joints[3] - 90.0).abs() < 60.0 && Posture::of(joints).numbers()[..2] == [1, 1]
        });
    (start.unwrap_or([f64::NAN; 6]), shifted(&z2, [0.0, 0.0, off]))
}

#[test]
fn beside_a_singularity_the_tool_waits_for_the_joints() {
    let (start, mut target) = beside_z2(-0.2);
    target.position.y -= 40.0;
    let plan = planned(&start, &target, &settings());
    let share = walk(&plan, &settings(), 1e-6);
    assert!(share > 0.8, "joints 4 and 6 go nearly as fast as they may: {share}");
    assert!((plan.end()[3] - start[3]).abs() > 150.0);
    assert_eq!(Posture::of(&plan.end()), Posture::of(&start));
}

#[test]
fn beside_a_singularity_joint_4_may_run_out_of_room() {
    let (start, target) = through_zero();
    let beside = |mut pose: Pose| {
        pose.position.y += 0.5;
        pose
    };
    let begin = inverse(&beside(forward(&start)), &start)
        .iter()
        .map(|solution| solution.joints)
        .find(|joints| Posture::of(joints) == Posture::of(&start));
    let refused = begin.map(|begin| plan_linear_move(&begin, &beside(target), &settings()));
    assert!(matches!(
        refused,
        Some(Err(PlanError::LimitOnPath { excess, .. })) if excess.joint == 4
    ));
}

#[test]
fn single_precision_arguments_still_meet_a_singularity() {
    let (start, mut target) = through_zero();
    target.position += glam::DVec3::new(1e-5, -1e-5, 1e-5);
    let plan = planned(&start, &target, &settings());
    walk(&plan, &settings(), 1e-3);
    assert_eq!(start[4].signum(), -plan.end()[4].signum());
    for posture in [None, Some(Posture::of(&start))] {
        let settings = LinearSettings { posture, ..settings() };
        let mut middle = forward(&[0.0; 6]);
        middle.position += glam::DVec3::new(1e-5, -1e-5, 1e-5);
        let plan = planned(&start, &middle, &settings);
        walk(&plan, &settings, 1e-3);
        assert!(plan.end()[3].abs() < 5.0, "{:?}", plan.end());
    }
}

#[test]
fn a_line_may_end_at_a_singularity() {
    let (start, target) = through_zero();
    let mut middle = target;
    middle.position.z = forward(&[0.0; 6]).position.z;
    for desired in [None, Some(Posture::of(&start))] {
        let settings = LinearSettings { posture: desired, ..settings() };
        let plan = planned(&start, &middle, &settings);
        walk(&plan, &settings, 1e-6);
        assert!(plan.end()[4].abs() < 1e-6);
    }
    // Full stretch: the elbow ends straight.
    let elbow = -libm::atan(60.0 / 19.0).to_degrees();
    let stretched = [0.0, 50.0, elbow, 0.0, 40.0, 0.0];
    let direction = forward(&stretched).orientation * glam::DVec3::new(1.0, 0.0, 0.0);
    let mut nearer = forward(&stretched);
    nearer.position -= glam::DVec3::new(direction.x.abs(), 0.0, 0.0) * 30.0;
    for solution in inverse(&nearer, &stretched).iter() {
        if JointLimits::MODEL.check(&solution.joints).is_ok()
            && solution.posture.numbers() == [1, 1, 1]
        {
            let mut target = forward(&stretched);
            target.position.x -= 1e-7;
            for settings in [settings(), fast()] {
                let plan = planned(&solution.joints, &target, &settings);
                walk(&plan, &settings, 1e-6);
            }
            return;
        }
    }
    panic!("no start for the stretched arm");
}

#[test]
fn a_duration_is_met_or_its_shortfall_told() {
    let target = shifted(&BENT, [0.0, 60.0, 0.0]);
    let slow = LinearSettings { pace: Pace::Duration(2.0), ..settings() };
    let plan = planned(&BENT, &target, &slow);
    assert_eq!(plan.shortest_duration_s(), None);
    let hold = plan.duration_s() - plan.acceleration_s() - plan.deceleration_s();
    assert!((hold - 2.0).abs() < 1e-6, "{hold}");
    let weak = LinearSettings {
        joint_velocity: RATED_VELOCITY.map(|velocity| velocity * 0.02),
        pace: Pace::Duration(0.5),
        ..settings()
    };
    let plan = planned(&BENT, &target, &weak);
    assert!(plan.shortest_duration_s().is_some_and(|shortest| shortest > 0.5));
    walk(&plan, &weak, 1e-6);
    let instant = LinearSettings { pace: Pace::Duration(0.0), ..settings() };
    assert!(planned(&BENT, &target, &instant).shortest_duration_s().is_some());
}

#[test]
fn nowhere_to_go_takes_no_time() {
    let plan = planned(&BENT, &forward(&BENT), &settings());
    assert_eq!(plan.duration_s(), 0.0);
    assert_eq!(plan.sample(0.0), BENT);
    assert_eq!(plan.sample(1.0), BENT);
}

#[test]
fn plans_stay_small() {
    let (start, target) = through_zero();
    let plan = planned(&start, &target, &settings());
    assert!(plan.knots.len() < 200, "{}", plan.knots.len());
}

/// Where `MoveLinRelTrf` with `offset` goes from `start`.
fn relative(start: &Joints, offset: [f64; 6]) -> Pose {
    Frames::default().target_relative_to_tool(start, &Pose::from_xyz_euler(offset))
}

#[test]
fn a_line_that_starts_just_under_a_wrist_singularity_keeps_joint_4() {
    for joint_5 in [-0.009, -0.001, -1e-6, 0.0, 1e-6, 0.001, 0.009] {
        let start = [0.0, 5.0, 5.0, 0.0, joint_5, 0.0];
        let target = relative(&start, [0.0, 0.0, -2.0, 0.0, 0.0, 20.0]);
        let plan = planned(&start, &target, &settings());
        walk(&plan, &settings(), 13e-3);
        assert!(plan.end()[3].abs() < 1.0, "{joint_5}: {:?}", plan.end());
        for numbers in [[1, 1, 1], [1, 1, -1]] {
            let kept = LinearSettings { posture: posture(numbers), ..settings() };
            match plan_linear_move(&start, &target, &kept) {
                Ok(plan) => {
                    walk(&plan, &kept, 13e-3);
                }
                Err(error) => assert!(matches!(error, PlanError::Singularity { .. }), "{error}"),
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(120))]
    #[test]
    fn any_line_keeps_its_promises_or_is_refused(
        q1 in -100.0..100.0f64, q2 in -40.0..60.0f64, q3 in -60.0..50.0f64,
        q4 in -150.0..150.0f64, q5 in -100.0..100.0f64, q6 in -180.0..180.0f64,
        shift in prop::array::uniform3(-120.0..120.0f64),
        turn in prop::array::uniform3(-60.0..60.0f64),
        is_fast in prop::bool::ANY,
    ) {
        let start = [q1, q2, q3, q4, q5, q6];
        let [x, y, z] = shift;
        let [a, b, c] = turn;
        let target = shifted(&start, [x, y, z]) * Pose::from_xyz_euler([0.0, 0.0, 0.0, a, b, c]);
        let settings = if is_fast { fast() } else { settings() };
        match plan_linear_move(&start, &target, &settings) {
            Ok(plan) => {
                walk(&plan, &settings, 1e-6);
                prop_assert!(forward(&plan.end()).position.distance(target.position) < 1e-6);
            }
            Err(PlanError::OutOfReach) => prop_assert_eq!(inverse(&target, &start).count(), 0),
            Err(_) => {}
        }
    }

    /// Lines that pass singularities at any distance, from whole millimetres down to rounding.
    #[test]
    fn lines_near_singularities_keep_their_promises_or_are_refused(
        exponent in -9.0..1.0f64, up in prop::bool::ANY, through_shoulder in prop::bool::ANY,
        is_kept in prop::bool::ANY, is_fast in prop::bool::ANY, skew in -0.2..0.2f64,
    ) {
        let off = if up { 1.0 } else { -1.0 } * libm::pow(10.0, exponent);
        let mut settings = if is_fast { fast() } else { settings() };
        let (start, target) = if through_shoulder {
            settings.frames.trf = Pose::from_xyz_euler([0.0, 0.0, -70.0, 0.0, 0.0, 0.0]);
            let start = [20.0, 10.0, -70.0, 30.0, 60.0, 0.0];
            let mut target = settings.frames.tool_of_joints(&start);
            let (x, y) = (target.position.x, target.position.y);
            let across = glam::DVec3::new(-y, x, 0.0).normalize() * off;
            target.position += glam::DVec3::new(-2.0 * x, -2.0 * y, -100.0 * skew.abs()) + across;
            (start, target)
        } else {
            let (start, mut target) = beside_z2(off);
            target.position += glam::DVec3::new(skew * 40.0, -40.0, 0.0);
            (start, target)
        };
        settings.posture = is_kept.then(|| Posture::of(&start));
        match plan_linear_move(&start, &target, &settings) {
            Ok(plan) => { walk(&plan, &settings, 13e-3); }
            Err(PlanError::Singularity { .. } | PlanError::LimitOnPath { .. }) => {}
            Err(error) => prop_assert!(false, "{}", error),
        }
    }

    /// Small lines that begin beside the wrist singularity, on either side of it.
    #[test]
    fn lines_from_beside_a_wrist_singularity_keep_their_promises_or_are_refused(
        q2 in -20.0..40.0f64, q3 in -40.0..40.0f64, q4 in -160.0..160.0f64, q6 in -170.0..170.0f64,
        in_plane in prop::bool::ANY, exponent in -6.0..0.0f64, is_negative in prop::bool::ANY,
        wrist in prop::option::of(prop::sample::select(&[-1i8, 1][..])), is_fast in prop::bool::ANY,
        shift in prop::array::uniform3(-3.0..3.0f64), tilt in prop::array::uniform2(-3.0..3.0f64),
        turn in -40.0..40.0f64, what in 0..4u8,
    ) {
        let q5 = if is_negative { -1.0 } else { 1.0 } * libm::pow(10.0, exponent);
        let q4 = if in_plane { 0.0 } else { q4 };
        let start = [0.0, q2, q3, q4, q5, q6];
        let ([x, y, z], [a, b]) = (shift, tilt);
        let offset = match what {
            0 => [0.0, 0.0, z, 0.0, 0.0, turn],
            1 => [x, y, z, 0.0, 0.0, 0.0],
            2 => [0.0, 0.0, 0.0, 0.0, 0.0, turn],
            _ => [x, y, z, a, b, turn],
        };
        let target = relative(&start, offset);
        let settings = LinearSettings {
            posture: wrist.and_then(|wrist| posture([1, 1, wrist])),
            ..if is_fast { fast() } else { settings() }
        };
        match plan_linear_move(&start, &target, &settings) {
            Ok(plan) => { walk(&plan, &settings, 13e-3); }
            Err(
                PlanError::Singularity { .. }
                | PlanError::LimitOnPath { .. }
                | PlanError::StartMismatch,
            ) => {}
            Err(error) => prop_assert!(false, "{}", error),
        }
    }
}
