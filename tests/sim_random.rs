//! Whatever the outputs, the robot lives, and its inputs make sense.
#![cfg(feature = "sim")]

mod sim_support;

use fieldarm::cycle::CyclicDevice;
use fieldarm::sim::meca500::kinematics::{MODEL_MAX, MODEL_MIN};
use fieldarm::sim::meca500::readings::Readings;
use fieldarm::sim::meca500::{FittedTool, RobotSettings, VirtualRobot};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::image::{InputImage, OutputImage};
use fieldarm::wire::order::Big;
use proptest::prelude::*;

/// One cycle of a nonsensical controller.
#[derive(Clone, Debug)]
enum Act {
    Noise(Vec<u8>),
    Command { id: u32, arguments: [f32; 6], move_id: u16, bits: u16 },
    Lost,
    Panel(u8),
    Wait(u32),
}

fn act() -> impl Strategy<Value = Act> {
    let argument = prop_oneof![
        8 => -200.0..200.0_f32,
        2 => (-2..4_i32).prop_map(|value| value as f32),
        1 => any::<f32>(),
    ];
    let id = prop_oneof![10 => 0..70_u32, 2 => 100..160_u32, 1 => any::<u32>(), 1 => Just(200)];
    prop_oneof![
        1 => proptest::collection::vec(any::<u8>(), 60).prop_map(Act::Noise),
        12 => (id, proptest::array::uniform6(argument), 0..6_u16, any::<u16>()).prop_map(
            |(id, arguments, move_id, bits)| Act::Command {
                id,
                arguments,
                move_id,
                // Mostly SetPoint, rarely pause, clear and resume.
                bits: 1 | if bits % 8 == 0 { bits & 0b1_1110 } else { 0 },
            }
        ),
        1 => Just(Act::Lost),
        1 => any::<u8>().prop_map(Act::Panel),
        3 => (1..400_u32).prop_map(Act::Wait),
    ]
}

struct Checker {
    robot: VirtualRobot,
    now: Instant,
    inputs: [u8; 252],
    stamp: u64,
}

impl Checker {
    fn cycle(&mut self, outputs: Option<&[u8]>) -> Result<(), TestCaseError> {
        self.now += Duration::from_millis(1);
        self.robot.cycle(self.now, outputs, &mut self.inputs);
        let image = InputImage::<Big>::from_bytes(&self.inputs).expect("252 bytes");
        let timestamp = image.robot_timestamp.values();
        let stamp = u64::from(timestamp.seconds) * 1_000_000 + u64::from(timestamp.microseconds);
        prop_assert!(stamp >= self.stamp && timestamp.microseconds < 1_000_000);
        // A boot sets the clock back.
        self.stamp = if self.robot.is_on_bus() { stamp } else { 0 };
        prop_assert!(image.motion_status.fifo_space.get() <= 13_000);
        prop_assert!(image.motion_status.checkpoint_reached.get() <= 8_000);
        for (index, joint) in image.target_joint_set.joint.iter().enumerate() {
            let joint = f64::from(joint.get());
            let inside = joint >= MODEL_MIN[index] - 1e-2 && joint <= MODEL_MAX[index] + 1e-2;
            prop_assert!(inside, "joint {} at {joint}", index + 1);
        }
        let pose = image.target_end_effector_pose.values();
        for value in [pose.x, pose.y, pose.z, pose.alpha, pose.beta, pose.gamma] {
            prop_assert!(value.is_finite());
        }
        Ok(())
    }

    fn panel(&mut self, which: u8) {
        let mut panel = self.robot.panel();
        match which % 16 {
            0 => panel.press_p_stop2(),
            1..=3 => panel.release_p_stop2(),
            4 => panel.press_e_stop(),
            5..=7 => panel.release_e_stop(),
            8 => panel.switch_off(),
            9 | 10 => panel.switch_on(),
            11 => panel.push_joint(usize::from(which / 16), 80.0),
            12 => panel.block_joint(usize::from(which / 16), which >= 128),
            13 => panel.set_gripper_overheated(which >= 128),
            _ => panel.press_reset(),
        }
    }
}

fn run(readings: Readings, acts: Vec<Act>) -> Result<(), TestCaseError> {
    let mut settings = RobotSettings {
        tool: FittedTool::Megp25E,
        readings,
        homed: true,
        ..RobotSettings::default()
    };
    settings.times.boot = Duration::from_millis(50);
    settings.times.homing = Duration::from_millis(50);
    let robot = VirtualRobot::new(settings);
    let mut checker = Checker { robot, now: Instant::ZERO, inputs: [0; 252], stamp: 0 };
    let mut outputs = OutputImage::<Big>::zeroed();
    for act in acts {
        match act {
            Act::Noise(bytes) => checker.cycle(Some(&bytes))?,
            Act::Command { id, arguments, move_id, bits } => {
                outputs.motion_command.motion_command_id.set(id);
                let slots = outputs.motion_command_args.argument.iter_mut();
                for (slot, argument) in slots.zip(arguments) {
                    slot.set(argument);
                }
                outputs.motion_control.move_id.set(move_id);
                let flags =
                    fieldarm::wire::meca500::image::MotionControlFlags::from_bits_retain(bits);
                outputs.motion_control.flags.set_raw(flags);
                // Activate, home, reset.
                let flags =
                    fieldarm::wire::meca500::image::RobotControlFlags::from_bits_retain(0b1110);
                outputs.robot_control.flags.set_raw(flags);
                checker.cycle(Some(outputs.as_bytes()))?;
            }
            Act::Lost => checker.cycle(None)?,
            Act::Panel(which) => checker.panel(which),
            Act::Wait(cycles) => {
                for _ in 0..cycles {
                    checker.cycle(Some(outputs.as_bytes()))?;
                }
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn no_outputs_break_the_robot(
        variation in 0..Readings::variations().len(),
        acts in proptest::collection::vec(act(), 1..120),
    ) {
        let readings = Readings::variations().nth(variation).map_or_else(Readings::default, |v| v.readings);
        run(readings, acts)?;
    }

    #[test]
    fn no_length_of_images_breaks_the_robot(
        outputs in proptest::collection::vec(any::<u8>(), 0..80),
        room in 0..300_usize,
    ) {
        let mut robot = VirtualRobot::new(RobotSettings::default());
        let mut inputs = vec![0xAA; room];
        robot.cycle(Instant::from_millis(1), Some(&outputs), &mut inputs);
        prop_assert_eq!(inputs.iter().all(|byte| *byte == 0xAA), room != 252);
    }

    #[test]
    fn time_may_jump(jumps in proptest::collection::vec(0..10_000_000_000_u64, 1..20)) {
        let mut robot = VirtualRobot::new(RobotSettings { homed: true, ..RobotSettings::default() });
        let mut inputs = [0; 252];
        for now in jumps {
            robot.cycle(Instant::from_nanos(now), Some(&[0; 60]), &mut inputs);
            prop_assert!(robot.now() >= Instant::from_nanos(now));
        }
    }
}
