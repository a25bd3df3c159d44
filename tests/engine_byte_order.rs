//! Finding the byte order from raw images, and refusing to guess.

use fieldarm::cycle::InputQuality::{self, Fresh};
use fieldarm::engine::meca500::{ByteOrderSetting, Config, Engine, Event, Fault, OrderProbe};
use fieldarm::time::Instant;
use fieldarm::wire::meca500::command::MotionCommand;
use fieldarm::wire::meca500::dynamic::DynamicType;
use fieldarm::wire::meca500::image::{INPUT_LEN, InputImage, OUTPUT_LEN, RobotStatusFlags};
use fieldarm::wire::order::{
    Big, BigIntLittleReal, ByteOrder, Endian, ImageOrder, Little, LittleIntBigReal,
};

/// An idle robot after so many milliseconds.
fn idle<O: ImageOrder>(joints: [f32; 6], ms: u32) -> [u8; INPUT_LEN] {
    let mut image = InputImage::<O>::zeroed();
    image.robot_status.flags.set(RobotStatusFlags::ACTIVATED | RobotStatusFlags::HOMED);
    image.motion_status.fifo_space.set(13_000);
    image.robot_timestamp.seconds.set(77 + ms / 1000);
    image.robot_timestamp.microseconds.set(ms % 1000 * 1000);
    for (field, joint) in image.target_joint_set.joint.iter_mut().zip(joints) {
        field.set(joint);
    }
    // Where the flange is at zero joints.
    image.target_end_effector_pose.x.set(190.0);
    image.target_end_effector_pose.z.set(308.0);
    image.target_end_effector_pose.beta.set(90.0);
    let mut bytes = [0; INPUT_LEN];
    bytes.copy_from_slice(zerocopy::IntoBytes::as_bytes(&image));
    bytes
}

fn found<O: ImageOrder>(joints: [f32; 6]) -> Option<ByteOrder> {
    let mut engine = Engine::<8>::new(Config::default());
    engine.submit(MotionCommand::MoveJoints([0.0; 6])).unwrap();
    let mut outputs = [0xAA; OUTPUT_LEN];
    for ms in 1..50 {
        let inputs = idle::<O>(joints, ms);
        let now = Instant::from_millis(ms.into());
        engine.cycle_bytes(now, Fresh, &inputs, &mut outputs).unwrap();
        if engine.byte_order().is_none() {
            assert_eq!(outputs, [0; OUTPUT_LEN], "only zeros before the order is settled");
        }
        if let Some(order) = engine.byte_order() {
            assert_eq!(engine.poll_event(), Some(Event::ByteOrderSettled(order)));
            assert!(ms <= 5, "settled after {ms} images");
            return Some(order);
        }
    }
    None
}

#[test]
fn all_four_orders_are_found_whether_joints_are_zero_or_not() {
    for joints in [[0.0; 6], [12.34, -45.0, 30.5, 0.1, 90.0, -3600.0], [1e-12; 6]] {
        assert_eq!(found::<Big>(joints), Some(Big::VALUE));
        assert_eq!(found::<Little>(joints), Some(Little::VALUE));
        assert_eq!(found::<BigIntLittleReal>(joints), Some(BigIntLittleReal::VALUE));
        assert_eq!(found::<LittleIntBigReal>(joints), Some(LittleIntBigReal::VALUE));
    }
}

/// Runs on one image; the events.
fn listens_to(inputs: [u8; INPUT_LEN], quality: InputQuality) -> Vec<Event> {
    let mut engine = Engine::<8>::new(Config::default());
    let mut outputs = [0xAA; OUTPUT_LEN];
    for ms in 1..6000 {
        let now = Instant::from_millis(ms);
        engine.cycle_bytes(now, quality, &inputs, &mut outputs).unwrap();
        assert_eq!(outputs, [0; OUTPUT_LEN]);
    }
    assert_eq!(engine.byte_order(), None);
    core::iter::from_fn(|| engine.poll_event()).collect()
}

#[test]
fn what_settles_nothing_is_said_once_and_zeros_go_on() {
    let undecidable = [Event::Fault(Fault::ByteOrderUndecidable)];
    assert_eq!(listens_to([0; INPUT_LEN], Fresh), undecidable);
    // Integers settle, but no Real does.
    let mut no_reals = idle::<Big>([0.0; 6], 5);
    no_reals[16..64].fill(0);
    assert_eq!(listens_to(no_reals, Fresh), undecidable);
    // Neither order makes sense of it.
    assert_eq!(listens_to([0xFF; INPUT_LEN], Fresh), undecidable);
    assert_eq!(listens_to(idle::<Big>([1.0; 6], 5), InputQuality::Lost), []);
}

#[test]
fn an_order_can_still_be_found_after_giving_up() {
    let mut engine = Engine::<8>::new(Config::default());
    let mut outputs = [0; OUTPUT_LEN];
    for ms in 1..5100 {
        engine.cycle_bytes(Instant::from_millis(ms), Fresh, &[0; INPUT_LEN], &mut outputs).unwrap();
    }
    for ms in 5100..5110 {
        let inputs = idle::<Little>([1.0; 6], ms);
        let now = Instant::from_millis(ms.into());
        engine.cycle_bytes(now, Fresh, &inputs, &mut outputs).unwrap();
    }
    assert_eq!(engine.byte_order(), Some(ByteOrder::LITTLE));
}

#[test]
fn a_fixed_order_is_taken_as_told() {
    for order in ByteOrder::ALL {
        let config = Config { byte_order: ByteOrderSetting::Fixed(order), ..Config::default() };
        let engine = Engine::<8>::new(config);
        assert_eq!(engine.byte_order(), Some(order));
    }
    let config =
        Config { byte_order: ByteOrderSetting::Fixed(ByteOrder::LITTLE), ..Config::default() };
    let mut engine = Engine::<8>::new(config);
    engine.submit(MotionCommand::MoveJoints([1.0; 6])).unwrap();
    let mut outputs = [0; OUTPUT_LEN];
    let mut commanded = Vec::new();
    for ms in 1..60 {
        let inputs = idle::<Little>([0.0; 6], ms);
        let now = Instant::from_millis(ms.into());
        engine.cycle_bytes(now, Fresh, &inputs, &mut outputs).unwrap();
        commanded.push(outputs[8..12].to_vec());
    }
    assert!(commanded.contains(&vec![1, 0, 0, 0]), "MoveJoints, little-endian");
    assert!(!commanded.contains(&vec![0, 0, 0, 1]));
}

#[test]
fn wrong_lengths_are_refused_and_change_nothing() {
    let mut engine = Engine::<8>::new(Config::default());
    let mut outputs = [0xAA; OUTPUT_LEN];
    assert!(engine.cycle_bytes(Instant::ZERO, Fresh, &[0; 251], &mut outputs).is_err());
    assert_eq!(outputs, [0xAA; OUTPUT_LEN]);
    assert!(engine.cycle_bytes(Instant::ZERO, Fresh, &[0; INPUT_LEN], &mut [0; 61]).is_err());
    assert_eq!(engine.statistics().cycles, 0);
}

fn probed<O: ImageOrder>(joints: [f32; 6]) -> OrderProbe {
    let mut probe = OrderProbe::new();
    for ms in 1..10 {
        probe.see(&idle::<O>(joints, ms)).unwrap();
    }
    probe
}

#[test]
fn a_probe_comes_to_the_engines_verdict_and_shows_why() {
    let joints = [12.34, -45.0, 30.5, 0.1, 90.0, -3600.0];
    assert_eq!(probed::<Big>(joints).verdict(), found::<Big>(joints));
    assert_eq!(probed::<LittleIntBigReal>(joints).verdict(), found::<LittleIntBigReal>(joints));
    let evidence = probed::<Little>(joints).evidence().unwrap();
    assert_eq!(evidence.verdict(), Some(ByteOrder::LITTLE));
    assert_eq!(evidence.images, 3, "of the image that settled it");
    assert_eq!((evidence.little.fifo_space, evidence.big.fifo_space), (13_000, 51_250));
    assert!(evidence.little.fifo_space_fits() && !evidence.big.fifo_space_fits());
    assert_eq!(evidence.little.microseconds, 3_000);
    assert_eq!(evidence.little.reals[..6], joints);
    assert_eq!((evidence.little.sensible_reals(), evidence.echo), (9, None));
    assert!(evidence.little.has_better_reals_than(&evidence.big));
}

#[test]
fn a_probe_that_is_not_told_enough_says_which_part_is_open() {
    let mut probe = OrderProbe::new();
    assert_eq!(probe.evidence(), None);
    assert!(probe.see(&[0; INPUT_LEN - 1]).is_err());
    assert_eq!(probe.evidence(), None);
    for ms in 1..10 {
        let mut no_reals = idle::<Big>([0.0; 6], ms);
        no_reals[16..64].fill(0);
        probe.see(&no_reals).unwrap();
    }
    let evidence = probe.evidence().unwrap();
    assert_eq!((evidence.integers, evidence.reals), (Some(Endian::BigEndian), None));
    assert_eq!((evidence.verdict(), evidence.images), (None, 9));
}

#[test]
fn an_echo_counts_when_it_stays_and_brings_a_value() {
    let types = [DynamicType::FIRMWARE_VERSION, DynamicType(2), DynamicType(3), DynamicType(52)];
    let mut probe = probed::<Little>([1.0; 6]);
    let outputs = probe.ask(types, Endian::LittleEndian);
    assert_eq!(outputs[..44], [0; 44]);
    assert_eq!(outputs[44..], [1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 52, 0, 0, 0]);
    let mut answer = |value: f32, ms| {
        let mut inputs = idle::<Little>([1.0; 6], ms);
        inputs[140..144].copy_from_slice(&1_u32.to_le_bytes());
        inputs[144..148].copy_from_slice(&value.to_le_bytes());
        probe.see(&inputs).unwrap();
        probe.evidence().unwrap().echo.unwrap().answered
    };
    assert!((10..20).all(|ms| !answer(0.0, ms)), "a type without a value is no answer");
    assert_eq!([20, 21, 22].map(|ms| answer(11.0, ms)), [false, false, true]);
    let big = probe.ask(types, Endian::BigEndian);
    assert_eq!(big[44..48], [0, 0, 0, 1]);
    assert!(!probe.evidence().unwrap().echo.unwrap().answered, "a new question");
}
