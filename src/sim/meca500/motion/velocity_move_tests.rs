//! Tests of [`super`]: velocity mode.

use super::*;
use crate::sim::meca500::motion::{FULL_JOINT_ACCELERATION, RATED_VELOCITY};
use proptest::prelude::*;

const STEP: ClockStep = ClockStep::full(0.001);
const BENT: Joints = [0.0, 0.0, 0.0, 0.0, 60.0, 0.0];

fn settings() -> VelocitySettings {
    VelocitySettings {
        limits: JointLimits::MODEL,
        joint_velocity: RATED_VELOCITY,
        joint_acceleration: FULL_JOINT_ACCELERATION,
        linear_acceleration: 1000.0,
        angular_acceleration: 500.0,
        frames: Frames::default(),
        posture: None,
        turn: None,
    }
}

fn tool(frame: TwistFrame, linear: [f64; 3], angular: [f64; 3]) -> VelocityDemand {
    VelocityDemand::Cartesian(CartesianDemand { frame, linear, angular })
}

/// One checked step.
fn step(arm: &mut VelocityMove, settings: &VelocitySettings) -> Option<Halt> {
    let before = *arm.state();
    let halt = arm.advance(STEP, settings);
    let inside = settings.limits.check(&before.position).is_ok();
    assert!(!inside || settings.limits.check(&arm.state().position).is_ok(), "{:?}", arm.state());
    for (velocity, limit) in arm.state().velocity.iter().zip(settings.joint_velocity) {
        assert!(velocity.abs() <= limit * (1.0 + 1e-9), "{:?}", arm.state());
    }
    halt
}

fn run(arm: &mut VelocityMove, settings: &VelocitySettings, steps: u32) -> Option<Halt> {
    (0..steps).fold(None, |_, _| step(arm, settings))
}

#[test]
fn joints_reach_their_velocities_together_and_stop_together() {
    let mut arm = VelocityMove::at_rest([0.0; 6]);
    arm.demand(VelocityDemand::Joints([75.0, -15.0, 0.0, 30.0, 0.0, 60.0]), &Frames::default());
    // Joint 1 needs 50 ms at 1500 deg/s².
    for millisecond in 1..=50 {
        assert_eq!(step(&mut arm, &settings()), None);
        let share = f64::from(millisecond) / 50.0;
        let wanted = [75.0, -15.0, 0.0, 30.0, 0.0, 60.0].map(|velocity| velocity * share);
        for (velocity, wanted) in arm.state().velocity.iter().zip(wanted) {
            assert!((velocity - wanted).abs() < 1e-6);
        }
    }
    run(&mut arm, &settings(), 100);
    arm.stop();
    assert!(!arm.is_at_rest());
    run(&mut arm, &settings(), 51);
    assert!(arm.is_at_rest());
}

#[test]
fn too_much_is_scaled_in_proportion() {
    let mut arm = VelocityMove::at_rest([0.0; 6]);
    arm.demand(VelocityDemand::Joints([300.0, 30.0, 0.0, 0.0, 0.0, 0.0]), &Frames::default());
    run(&mut arm, &settings(), 200);
    assert!((arm.state().velocity[0] - 150.0).abs() < 1e-6);
    assert!((arm.state().velocity[1] - 15.0).abs() < 1e-6);
}

#[test]
fn a_joint_halts_slightly_before_its_limit_and_can_leave_it() {
    let mut arm = VelocityMove::at_rest([170.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    arm.demand(VelocityDemand::Joints([150.0, 10.0, 0.0, 0.0, 0.0, 0.0]), &Frames::default());
    let halt = run(&mut arm, &settings(), 1_000);
    assert!(matches!(halt, Some(Halt::JointLimit(excess)) if excess.joint == 1), "{halt:?}");
    assert!((arm.state().position[0] - 174.99).abs() < 1e-3, "{:?}", arm.state());
    assert!(arm.state().velocity.iter().all(|velocity| velocity.abs() < 1e-3));
    arm.demand(VelocityDemand::Joints([-50.0, 0.0, 0.0, 0.0, 0.0, 0.0]), &Frames::default());
    assert_eq!(run(&mut arm, &settings(), 200), None);
    assert!(arm.state().position[0] < 170.0);
}

#[test]
fn braking_before_a_limit_keeps_the_acceleration() {
    let mut arm = VelocityMove::at_rest([100.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    arm.demand(VelocityDemand::Joints([150.0, 0.0, 0.0, 0.0, 0.0, 0.0]), &Frames::default());
    for _ in 0..1_000 {
        step(&mut arm, &settings());
        let acceleration = arm.state().acceleration[0].abs();
        assert!(acceleration <= 1.01 * FULL_JOINT_ACCELERATION[0], "{:?}", arm.state());
    }
}

#[test]
fn an_arm_outside_its_limits_may_only_come_back() {
    let mut narrow = settings();
    narrow.limits.max[0] = 10.0;
    let mut arm = VelocityMove::at_rest([20.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    arm.demand(VelocityDemand::Joints([50.0, 0.0, 0.0, 0.0, 0.0, 0.0]), &Frames::default());
    let halt = run(&mut arm, &narrow, 100);
    assert!(matches!(halt, Some(Halt::JointLimit(_))) && arm.state().position[0] == 20.0);
    arm.demand(VelocityDemand::Joints([-50.0, 0.0, 0.0, 0.0, 0.0, 0.0]), &Frames::default());
    run(&mut arm, &narrow, 400);
    assert!(arm.state().position[0] < 10.0);
}

#[test]
fn the_tool_moves_in_the_frame_asked_for() {
    let frames = Frames {
        wrf: Pose::from_xyz_euler([10.0, 20.0, 30.0, 0.0, 0.0, 90.0]),
        trf: Pose::from_xyz_euler([0.0, 0.0, 40.0, 0.0, 30.0, 0.0]),
    };
    let settings = VelocitySettings { frames, ..settings() };
    for frame in [TwistFrame::Tool, TwistFrame::World] {
        let mut arm = VelocityMove::at_rest(BENT);
        let start = forward(&BENT) * frames.trf;
        let axis = match frame {
            TwistFrame::Tool => start.orientation * DVec3::Y,
            TwistFrame::World => frames.wrf.orientation * DVec3::Y,
        };
        arm.demand(tool(frame, [0.0, 50.0, 0.0], [0.0; 3]), &frames);
        run(&mut arm, &settings, 500);
        let end = forward(&arm.state().position) * frames.trf;
        let moved = end.position - start.position;
        // 50 ms up to speed, 450 ms at 50 mm/s; sums of steps, so a step's worth more.
        assert!((moved.dot(axis) - 23.75).abs() < 0.06, "{moved}");
        assert!((moved - axis * moved.dot(axis)).length() < 1e-6);
        assert!(end.angle_to(&start) < 1e-6);
        arm.stop();
        run(&mut arm, &settings, 60);
        assert!(arm.is_at_rest());
    }
}

#[test]
fn turning_the_tool_keeps_its_point() {
    let frames =
        Frames { trf: Pose::from_xyz_euler([0.0, 0.0, 40.0, 0.0, 0.0, 0.0]), ..Frames::default() };
    let settings = VelocitySettings { frames, ..settings() };
    let mut arm = VelocityMove::at_rest(BENT);
    let start = forward(&BENT) * frames.trf;
    arm.demand(tool(TwistFrame::World, [0.0; 3], [0.0, 0.0, 30.0]), &frames);
    run(&mut arm, &settings, 560);
    let end = forward(&arm.state().position) * frames.trf;
    assert!(end.position.distance(start.position) < 1e-6);
    assert!((end.angle_to(&start) - 15.9).abs() < 0.05, "{}", end.angle_to(&start));
}

#[test]
fn changing_the_way_of_moving_keeps_the_velocity() {
    let mut arm = VelocityMove::at_rest(BENT);
    arm.demand(VelocityDemand::Joints([30.0, 0.0, 0.0, 0.0, 0.0, 0.0]), &Frames::default());
    run(&mut arm, &settings(), 100);
    let before = arm.state().velocity;
    arm.demand(tool(TwistFrame::World, [0.0, 60.0, 0.0], [0.0; 3]), &Frames::default());
    step(&mut arm, &settings());
    for (before, now) in before.iter().zip(arm.state().velocity) {
        assert!((before - now).abs() < 1.5, "{before} to {now}");
    }
}

#[test]
fn a_wrist_singularity_is_crossed_in_a_free_posture_only() {
    // From below through the zero posture, joint 5 changing its sign.
    for (posture, crosses) in [(None, true), (Posture::from_numbers([1, 1, -1]), false)] {
        let settings = VelocitySettings { posture, ..settings() };
        let mut arm = VelocityMove::at_rest([0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        arm.demand(tool(TwistFrame::World, [0.0, 0.0, 30.0], [0.0; 3]), &Frames::default());
        let free = VelocitySettings { posture: None, ..settings };
        run(&mut arm, &free, 500);
        let side = arm.state().position[4].signum();
        let there = arm.state().position;
        let wrist = if side > 0.0 { 1 } else { -1 };
        let settings = VelocitySettings {
            posture: settings.posture.and_then(|_| Posture::from_numbers([1, 1, wrist])),
            ..settings
        };
        let mut arm = VelocityMove::at_rest(there);
        arm.demand(tool(TwistFrame::World, [0.0, 0.0, -30.0], [0.0; 3]), &Frames::default());
        let halt = run(&mut arm, &settings, 1_500);
        assert_eq!(arm.state().position[4].signum() == -side, crosses, "{:?}", arm.state());
        assert_eq!(halt.is_some(), !crosses, "{halt:?}");
    }
}

#[test]
fn the_edge_of_reach_stops_the_tool_without_error() {
    let mut arm = VelocityMove::at_rest(BENT);
    arm.demand(tool(TwistFrame::World, [100.0, 0.0, 0.0], [0.0; 3]), &Frames::default());
    let halt = run(&mut arm, &settings(), 5_000);
    assert!(halt.is_some());
    assert!(arm.state().velocity.iter().all(|velocity| velocity.abs() < 1.0), "{:?}", arm.state());
}

#[test]
fn a_wrong_start_does_not_move() {
    for settings in [
        VelocitySettings { posture: Posture::from_numbers([1, 1, -1]), ..settings() },
        VelocitySettings { turn: Some(2), ..settings() },
    ] {
        let mut arm = VelocityMove::at_rest(BENT);
        arm.demand(tool(TwistFrame::Tool, [10.0, 0.0, 0.0], [0.0; 3]), &Frames::default());
        assert_eq!(run(&mut arm, &settings, 10), Some(Halt::StartMismatch));
        assert_eq!(arm.state().position, BENT);
    }
}

#[test]
fn a_desired_turn_is_a_limit_of_joint_6() {
    let settings = VelocitySettings { turn: Some(0), ..settings() };
    let mut arm = VelocityMove::at_rest([0.0, 0.0, 0.0, 0.0, 60.0, 170.0]);
    arm.demand(tool(TwistFrame::Tool, [0.0; 3], [0.0, 0.0, 40.0]), &Frames::default());
    let halt = run(&mut arm, &settings, 1_000);
    assert!(matches!(halt, Some(Halt::JointLimit(excess)) if excess.joint == 6), "{halt:?}");
    assert!((arm.state().position[5] - 179.99).abs() < 0.01);
}

#[test]
fn a_standing_clock_and_wild_numbers_move_nothing() {
    let mut arm = VelocityMove::at_rest(BENT);
    arm.demand(
        VelocityDemand::Joints([f64::NAN, f64::INFINITY, 0.0, 0.0, 0.0, 0.0]),
        &Frames::default(),
    );
    run(&mut arm, &settings(), 10);
    assert_eq!(arm.state().position, BENT);
    arm.demand(VelocityDemand::Joints([10.0; 6]), &Frames::default());
    arm.advance(ClockStep { real_s: 0.001, path_s: 0.0 }, &settings());
    assert_eq!(arm.state().position, BENT);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn no_demand_breaks_a_limit(
        start in prop::array::uniform6(0.05..0.95f64),
        demands in prop::collection::vec((0..3u8, prop::array::uniform6(-400.0..400.0f64)), 1..6),
    ) {
        let settings = settings();
        let mut joints = [0.0; 6];
        for (index, fraction) in start.into_iter().enumerate() {
            let (min, max) = (settings.limits.min[index].max(-200.0), settings.limits.max[index].min(200.0));
            joints[index] = min + fraction * (max - min);
        }
        let mut arm = VelocityMove::at_rest(joints);
        for (kind, [a, b, c, d, e, f]) in demands {
            let demand = match kind {
                0 => VelocityDemand::Joints([a, b, c, d, e, f]),
                1 => tool(TwistFrame::Tool, [a, b, c], [d, e, f]),
                _ => tool(TwistFrame::World, [a, b, c], [d, e, f]),
            };
            arm.demand(demand, &settings.frames);
            run(&mut arm, &settings, 300);
        }
    }
}
