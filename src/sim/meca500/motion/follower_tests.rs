//! Tests of [`super`]: blending, pause and resume, time scaling.

use super::*;
use crate::sim::meca500::kinematics::{Frames, forward};
use crate::sim::meca500::motion::{
    FULL_JOINT_ACCELERATION, JointLimits, JointSettings, LinearSettings, Pace, PathClock,
    RATED_VELOCITY, plan_joint_move, plan_linear_move,
};
use crate::sim::meca500::pose::Pose;
use alloc::vec::Vec;
use proptest::prelude::*;

const STEP_S: f64 = 0.001;

fn joint_plan(start: &Joints, end: &Joints) -> Plan {
    let settings = JointSettings {
        limits: JointLimits::MODEL,
        velocity: RATED_VELOCITY,
        acceleration: FULL_JOINT_ACCELERATION,
        pace: Pace::Velocity,
    };
    match plan_joint_move(start, end, &settings) {
        Ok(plan) => plan.into(),
        Err(error) => panic!("{error}"),
    }
}

fn line_plan(start: &Joints, shift: [f64; 3]) -> Plan {
    let settings = LinearSettings {
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
    };
    let mut target: Pose = forward(start);
    target.position += glam::DVec3::from_array(shift);
    match plan_linear_move(start, &target, &settings) {
        Ok(plan) => plan.into(),
        Err(error) => panic!("{error}"),
    }
}

const BENT: Joints = [0.0, 0.0, 0.0, 0.0, 60.0, 0.0];

/// Follows everything to its end; the states of each step.
fn run(follower: &mut Follower) -> (Vec<JointState>, u32) {
    let mut states = Vec::new();
    let mut ended = 0;
    while follower.is_busy() {
        ended += u32::from(follower.advance(ClockStep::full(STEP_S)).ended);
        states.push(*follower.state());
        assert!(states.len() < 100_000, "never ends");
    }
    (states, ended)
}

fn within_velocities(states: &[JointState]) -> bool {
    states.iter().all(|state| {
        state.velocity.iter().zip(RATED_VELOCITY).all(|(v, limit)| v.abs() <= limit * (1.0 + 1e-9))
    })
}

fn two(first: Plan, second: Plan, blending: f64) -> (Follower, Handover) {
    let mut follower = Follower::at_rest(first.start());
    assert_eq!(follower.follow_with(first, blending).ok(), Some(Handover::Stop));
    let Ok(handover) = follower.follow_with(second, blending) else { panic!("no room") };
    (follower, handover)
}

#[test]
fn blending_saves_its_overlap_and_none_stops_between() {
    let via = [60.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let end = [60.0, 40.0, 0.0, 0.0, 0.0, 0.0];
    let plans = || (joint_plan(&[0.0; 6], &via), joint_plan(&via, &end));
    let (first, second) = plans();
    let whole_s = first.duration_s() + second.duration_s();
    for (blending, expected) in [(0.0, 0.0), (0.5, 0.05), (1.0, 0.1), (7.0, 0.1), (f64::NAN, 0.0)] {
        let (first, second) = plans();
        let (mut follower, handover) = two(first, second, blending);
        let overlap_s = match handover {
            Handover::Stop => 0.0,
            Handover::Blended { overlap_s } => overlap_s,
        };
        assert!((overlap_s - expected).abs() < 1e-9);
        let (states, ended) = run(&mut follower);
        assert_eq!(ended, 2);
        assert!((states.len() as f64 * STEP_S - (whole_s - expected)).abs() <= 1.5 * STEP_S);
        assert!(within_velocities(&states));
        assert_eq!(follower.state().position, end);
        let slowest = states[100..states.len() - 110]
            .iter()
            .map(|state| state.velocity[0].abs() + state.velocity[1].abs())
            .fold(f64::MAX, f64::min);
        assert_eq!(slowest < 3.0, expected < 0.05, "{slowest} at {blending}");
    }
}

#[test]
fn joint_moves_and_lines_never_blend() {
    let line = line_plan(&BENT, [0.0, 50.0, 0.0]);
    let joint = joint_plan(&line.end(), &[0.0; 6]);
    assert_eq!(two(line, joint, 1.0).1, Handover::Stop);
    let joint = joint_plan(&[0.0; 6], &BENT);
    let line = line_plan(&BENT, [0.0, 50.0, 0.0]);
    assert_eq!(two(joint, line, 1.0).1, Handover::Stop);
}

#[test]
fn a_corner_of_lines_is_rounded_without_leaving_its_triangle() {
    let first = line_plan(&BENT, [0.0, 50.0, 0.0]);
    let second = line_plan(&first.end(), [0.0, 0.0, -50.0]);
    let corner = forward(&first.end()).position;
    let end = second.end();
    let (mut follower, handover) = two(first, second, 1.0);
    assert!(matches!(handover, Handover::Blended { overlap_s } if (overlap_s - 0.15).abs() < 1e-6));
    let (states, _) = run(&mut follower);
    assert!(within_velocities(&states));
    let mut nearest = f64::MAX;
    let mut before = forward(&BENT).position;
    for state in &states {
        let point = forward(&state.position).position;
        nearest = nearest.min(point.distance(corner));
        assert!(point.y <= corner.y + 1e-6 && point.z <= corner.z + 1e-6);
        assert!(point.distance(before) <= 150.0 * STEP_S * (1.0 + 1e-6));
        before = point;
    }
    // Both ramps last 0.15 s: half-way each line has 2.8125 mm left or covered.
    assert!((nearest - 2.8125 * core::f64::consts::SQRT_2).abs() < 0.05, "{nearest}");
    for (joint, end) in follower.state().position.iter().zip(end) {
        assert!((joint - end).abs() < 1e-9);
    }
}

#[test]
fn checkpoints_can_be_placed_where_the_next_move_begins() {
    let via = [60.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let (mut follower, _) = two(joint_plan(&[0.0; 6], &via), joint_plan(&via, &[0.0; 6]), 1.0);
    let mut events = Vec::new();
    while follower.is_busy() {
        let progress = follower.advance(ClockStep::full(STEP_S));
        if progress != Progress::default() {
            events.push((progress.next_began, progress.ended));
        }
    }
    assert_eq!(events, [(true, 0), (false, 1), (false, 1)]);
}

#[test]
fn a_full_follower_gives_the_plan_back_and_forgets_on_demand() {
    let via = [60.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let (mut follower, _) = two(joint_plan(&[0.0; 6], &via), joint_plan(&via, &[0.0; 6]), 1.0);
    assert!(!follower.has_room());
    assert!(follower.follow_with(joint_plan(&[0.0; 6], &via), 1.0).is_err());
    assert!(follower.discard_next() && !follower.discard_next());
    assert_eq!(follower.end(), via);
    follower.advance(ClockStep::full(0.1));
    follower.stop_here();
    assert!(!follower.is_busy() && follower.state().velocity == [0.0; 6]);
    assert!(follower.end()[0] > 0.0 && follower.end()[0] < 60.0);
}

/// Positions reached with pauses are those reached without, only later.
#[test]
fn pause_and_resume_stay_on_the_path() {
    for plan in [joint_plan(&[0.0; 6], &BENT), line_plan(&BENT, [0.0, 60.0, -20.0])] {
        let mut follower = Follower::at_rest(plan.start());
        assert!(follower.follow_with(plan.clone(), 1.0).is_ok());
        let mut clock = PathClock::default();
        let mut path_s = 0.0;
        for cycle in 0..3_000 {
            match cycle {
                100 => clock.pause(),
                400 => clock.resume(),
                450 => clock.set_time_scaling(0.3),
                _ => {}
            }
            let step = clock.advance(STEP_S);
            path_s += step.path_s;
            follower.advance(step);
            let expected = plan.sample(path_s);
            for (joint, expected) in follower.state().position.iter().zip(expected) {
                assert!((joint - expected).abs() < 1e-9);
            }
            if (150..400).contains(&cycle) {
                assert!(clock.rate() < 1e-9);
            }
            if (152..400).contains(&cycle) {
                assert!(follower.state().velocity.iter().all(|velocity| velocity.abs() < 1e-6));
            }
        }
        assert!(!follower.is_busy());
        assert_eq!(follower.state().position, plan.end());
    }
}

#[test]
fn a_huge_step_ends_everything() {
    let via = [60.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let (mut follower, _) = two(joint_plan(&[0.0; 6], &via), joint_plan(&via, &BENT), 1.0);
    let progress = follower.advance(ClockStep::full(1e9));
    assert_eq!(progress, Progress { next_began: true, ended: 2 });
    assert_eq!(follower.state().position, BENT);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn blended_joint_moves_keep_every_velocity(
        via in prop::array::uniform6(-60.0..60.0f64), end in prop::array::uniform6(-60.0..60.0f64),
        blending in 0.0..1.0f64,
    ) {
        let (first, second) = (joint_plan(&[0.0; 6], &via), joint_plan(&via, &end));
        let (mut follower, _) = two(first, second, blending);
        let (states, ended) = run(&mut follower);
        prop_assert_eq!(ended, 2);
        prop_assert!(within_velocities(&states));
        prop_assert_eq!(follower.state().position, end);
        for state in &states {
            prop_assert!(JointLimits::MODEL.check(&state.position).is_ok());
            for (acceleration, limit) in state.acceleration.iter().zip(FULL_JOINT_ACCELERATION) {
                prop_assert!(acceleration.abs() <= 2.0 * limit * (1.0 + 1e-6));
            }
        }
    }

    #[test]
    fn blended_lines_keep_every_velocity(
        first in prop::array::uniform3(-25.0..25.0f64), second in prop::array::uniform3(-25.0..25.0f64),
        blending in 0.0..1.0f64,
    ) {
        let start = [10.0, -20.0, 20.0, 20.0, 60.0, 0.0];
        let first = line_plan(&start, first);
        let second = line_plan(&first.end(), second);
        let end = second.end();
        let (mut follower, _) = two(first, second, blending);
        let (states, ended) = run(&mut follower);
        prop_assert_eq!(ended, 2);
        prop_assert!(within_velocities(&states));
        prop_assert_eq!(follower.state().position, end);
    }
}
