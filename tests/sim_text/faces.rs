//! The text face and the cyclic face drive one robot: the same commands through either give the same
//! trajectory, the same settings, the same checkpoints.

use fieldarm::cycle::CyclicDevice;
use fieldarm::sim::meca500::{MotionSettings, RobotEvent, RobotSettings, VirtualRobot};
use fieldarm::text_device::TextDevice;
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::command::MotionCommand;
use fieldarm::wire::meca500::image::{
    INPUT_LEN, MotionControlFlags, OutputImage, RobotControlFlags,
};
use fieldarm::wire::meca500::revision::Revision;
use fieldarm::wire::meca500::text::{Statement, parse_line};
use fieldarm::wire::order::Big;
use proptest::prelude::*;

const MOTION_MS: u32 = 12_000;

/// What a robot did.
#[derive(Debug, PartialEq)]
struct Record {
    trajectory: Vec<[f64; 6]>,
    settings: MotionSettings,
    events: Vec<RobotEvent>,
}

struct Rig {
    robot: VirtualRobot,
    now: Instant,
    outputs: OutputImage<Big>,
    inputs: [u8; INPUT_LEN],
}

impl Rig {
    fn new() -> Self {
        let mut rig = Self {
            robot: VirtualRobot::new(RobotSettings { homed: true, ..RobotSettings::default() }),
            now: Instant::ZERO,
            outputs: OutputImage::zeroed(),
            inputs: [0; INPUT_LEN],
        };
        rig.robot.activate().unwrap();
        rig.now += Duration::from_millis(1000);
        rig.robot.advance(rig.now);
        rig.robot.panel().drain_events().for_each(drop);
        rig
    }

    fn record(mut self, mut trajectory: Vec<[f64; 6]>, mut live: impl FnMut(&mut Self)) -> Record {
        for _ in 0..MOTION_MS {
            live(&mut self);
            trajectory.push(self.robot.target_joints());
        }
        let settings = *self.robot.motion_settings();
        let refusals = |event: &RobotEvent| !matches!(event, RobotEvent::Refused(_));
        let events = self.robot.panel().drain_events().filter(refusals).collect();
        Record { trajectory, settings, events }
    }

    fn cycle(&mut self) {
        self.now += Duration::from_millis(1);
        let Self { robot, outputs, inputs, now } = self;
        robot.cycle(*now, Some(outputs.as_bytes()), inputs);
    }
}

/// One command a millisecond over the cyclic images.
fn cyclically(lines: &[String]) -> Record {
    let mut rig = Rig::new();
    let mut trajectory = Vec::new();
    rig.outputs.motion_control.flags.assign(MotionControlFlags::SET_POINT, true);
    for (move_id, line) in (1_u16..).zip(lines) {
        let parsed = parse_line(line, Revision::R4).unwrap().unwrap();
        let command: MotionCommand = match Statement::from_parsed(&parsed, Revision::R4).unwrap() {
            Statement::Motion(command) => command,
            other => panic!("{other:?}"),
        };
        let (id, arguments) = command.encode();
        rig.outputs.motion_command.motion_command_id.set(id.0);
        for (slot, value) in rig.outputs.motion_command_args.argument.iter_mut().zip(arguments) {
            slot.set(value);
        }
        rig.outputs.motion_control.move_id.set(move_id);
        rig.cycle();
        trajectory.push(rig.robot.target_joints());
    }
    rig.record(trajectory, Rig::cycle)
}

/// The same as text, while somebody watches.
fn by_text(lines: &[String]) -> Record {
    let mut rig = Rig::new();
    assert!(rig.robot.open_control(rig.now));
    let mut trajectory = Vec::new();
    for line in lines {
        rig.now += Duration::from_millis(1);
        rig.robot.command(rig.now, line);
        trajectory.push(rig.robot.target_joints());
    }
    rig.record(trajectory, |rig| {
        rig.now += Duration::from_millis(1);
        TextDevice::advance(&mut rig.robot, rig.now);
    })
}

fn command() -> impl Strategy<Value = String> {
    let joint = || -20_i32..20;
    prop_oneof![
        (joint(), joint(), joint(), joint(), joint(), joint())
            .prop_map(|(a, b, c, d, e, f)| format!("MoveJoints({a},{b},{c},{d},{e},{f})")),
        (joint(), joint()).prop_map(|(a, b)| format!("MoveJointsRel({a},0,0,0,{b},0)")),
        (-30..30, -30..30).prop_map(|(x, z)| format!("MoveLinRelWrf({x},0,{z},0,0,0)")),
        (-15..15, -15..15).prop_map(|(y, z)| format!("MoveLinRelTrf(0,{y},{z},0,0,5)")),
        (-40..40, -40..40).prop_map(|(y, z)| format!("MovePose(190,{y},{},0,90,0)", 300 + z)),
        (1..100).prop_map(|p| format!("SetJointVel({p})")),
        (1..100).prop_map(|p| format!("SetJointAcc({p})")),
        (10..500).prop_map(|v| format!("SetCartLinVel({v})")),
        (0..=100).prop_map(|p| format!("SetBlending({p})")),
        (0..50).prop_map(|z| format!("SetTrf(0,0,{z},0,0,0)")),
        (0..50).prop_map(|x| format!("SetWrf({x},0,0,0,0,0)")),
        (0..=1).prop_map(|e| format!("SetAutoConf({e})")),
        (1..8000).prop_map(|n| format!("SetCheckpoint({n})")),
        (1..20).prop_map(|t| format!("Delay(0.{t:02})")),
        Just("SetPayload(0.1,1,2,3)".to_owned()),
        Just("SetTorqueLimits(90,90,90,90,90,90)".to_owned()),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn the_same_commands_do_the_same(lines in proptest::collection::vec(command(), 1..25)) {
        let cyclic = cyclically(&lines);
        let text = by_text(&lines);
        prop_assert_eq!(&cyclic.events, &text.events);
        prop_assert_eq!(cyclic.settings, text.settings);
        prop_assert_eq!(cyclic.trajectory.len(), text.trajectory.len());
        // A command over the images acts in its cycle, one as text in the next millisecond's step.
        for (index, (one, other)) in cyclic.trajectory.iter().zip(&text.trajectory).enumerate() {
            for (one, other) in one.iter().zip(other) {
                prop_assert!((one - other).abs() < 1e-9, "at {} ms: {} {}", index, one, other);
            }
        }
    }

    #[test]
    fn no_line_breaks_the_robot(lines in proptest::collection::vec(".{0,60}", 1..40)) {
        let mut rig = Rig::new();
        assert!(rig.robot.open_control(rig.now));
        for line in lines {
            rig.now += Duration::from_millis(1);
            rig.robot.command(rig.now, &line);
        }
        rig.robot.command(rig.now, "GetStatusRobot");
        let mut all = String::new();
        while rig.robot.next_control_message(&mut all) {}
        prop_assert!(all.contains("[2007]["));
    }
}

#[test]
fn what_one_face_does_the_other_tells() {
    let mut rig = Rig::new();
    let mut told = Vec::new();
    rig.robot.monitoring_snapshot(rig.now, &mut |message| told.push(message.to_owned()));
    assert!(told.contains(&"[2007][1,1,0,0,0,1,1]".to_owned()));
    rig.outputs.motion_control.flags.assign(MotionControlFlags::PAUSE_MOTION, true);
    rig.cycle();
    rig.outputs.robot_control.flags.assign(RobotControlFlags::ENABLE_RECOVERY_MODE, true);
    rig.cycle();
    let mut heard = String::new();
    while rig.robot.next_monitoring_message(&mut heard) {}
    assert!(heard.contains("[2007][1,1,0,0,1,1,1]"), "{heard}");
    assert!(!heard.contains("[2042]"), "{heard}");
    rig.robot.advance(rig.now + Duration::from_millis(1));
    while rig.robot.next_monitoring_message(&mut heard) {}
    assert!(heard.contains("[2049]"), "{heard}");
}
