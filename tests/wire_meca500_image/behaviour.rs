//! Lengths, unknown and reserved bits, `Debug`, older layouts, NaN.

use fieldarm::wire::WireError;
use fieldarm::wire::meca500::image::*;
use fieldarm::wire::order::{Big, BigIntLittleReal, ImageOrder, Little};

use super::in_each_order;
use super::vectors::{INPUT, OUTPUT, bytes};

#[test]
fn every_other_length_is_an_error_that_says_so() {
    let bytes = [0xA5; INPUT_LEN + 1];
    for found in (0..=INPUT_LEN + 1).filter(|&len| len != INPUT_LEN) {
        let error = WireError::Length { image: "InputImage", expected: 252, found };
        assert_eq!(InputImage::<Big>::from_bytes(&bytes[..found]).err(), Some(error));
        let mut bytes = bytes;
        assert_eq!(InputImage::<Little>::from_bytes_mut(&mut bytes[..found]).err(), Some(error));
    }
    for found in (0..=OUTPUT_LEN + 1).filter(|&len| len != OUTPUT_LEN) {
        let error = WireError::Length { image: "OutputImage", expected: 60, found };
        assert_eq!(OutputImage::<Big>::from_bytes(&bytes[..found]).err(), Some(error));
        let mut bytes = bytes;
        assert_eq!(OutputImage::<Little>::from_bytes_mut(&mut bytes[..found]).err(), Some(error));
    }
    let error = OutputImage::<Big>::from_bytes(&bytes[..59]).expect_err("59 bytes");
    assert_eq!(error.to_string(), "OutputImage is 60 bytes long, found 59");
    let error = InputImage::<Big>::from_bytes(&bytes).expect_err("253 bytes");
    assert_eq!(error.to_string(), "InputImage is 252 bytes long, found 253");
}

#[test]
fn rows_read_nothing_from_bytes_that_end_before_the_field() {
    for (fields, whole) in
        [(OUTPUT_FIELDS, bytes::<Big>(OUTPUT)), (INPUT_FIELDS, bytes::<Big>(INPUT))]
    {
        for field in fields {
            let end = 8 * field.byte_offset + u16::from(field.bit) + field.size_bits;
            let end = usize::from(end.div_ceil(8));
            assert!(field.read(&whole[..end], Big::VALUE).is_some(), "{field:?}");
            assert_eq!(field.read(&whole[..end - 1], Big::VALUE), None, "{field:?}");
            assert_eq!(field.read(&[], Big::VALUE), None);
        }
    }
}

#[test]
fn an_image_views_the_bytes_it_was_given_at_any_alignment() {
    let mut bytes = [0; OUTPUT_LEN + 1];
    let image = OutputImage::<Big>::from_bytes_mut(&mut bytes[1..]).expect("60 bytes");
    image.motion_control.move_id.set(0x1267);
    assert_eq!(bytes[5..7], [0x12, 0x67]);
    let image = OutputImage::<Big>::from_bytes(&bytes[1..]).expect("60 bytes");
    assert!(std::ptr::eq(image.as_bytes(), &bytes[1..]));
}

#[test]
fn unknown_bits_are_kept_and_shown() {
    let mut bytes = [0; INPUT_LEN];
    bytes[0] = 0x02;
    bytes[1] = 0x80;
    bytes[135] = 0x40;
    let image = InputImage::<Big>::from_bytes(&bytes).expect("252 bytes");
    let status = image.robot_status.flags.get();
    assert_eq!(status.bits(), 0x8002);
    assert_eq!(format!("{:?}", image.robot_status.flags), "RobotStatusFlags(ACTIVATED | 0x8000)");
    assert_eq!(image.safety_status.resettable.get().bits(), 0x4000_0000);
    let debug = format!("{image:?}");
    assert!(debug.contains("flags: RobotStatusFlags(ACTIVATED | 0x8000)"), "{debug}");
    assert!(debug.contains("resettable: SafetyResettable(0x40000000)"), "{debug}");
}

/// The bits of `fields` that are reserved, as an image.
fn reserved_bits(fields: &[Field], len: usize) -> Vec<u8> {
    let mut image = vec![0; len];
    for field in fields.iter().filter(|field| field.field_type == FieldType::Reserved) {
        let first = 8 * usize::from(field.byte_offset) + usize::from(field.bit);
        for bit in first..first + usize::from(field.size_bits) {
            image[bit / 8] |= 1 << (bit % 8);
        }
    }
    image
}

#[test]
fn set_values_leaves_reserved_bits_as_they_are() {
    fn test<O: ImageOrder>() {
        let mut ones = [0xFF; INPUT_LEN];
        let image = InputImage::<O>::from_bytes_mut(&mut ones).expect("252 bytes");
        let all_set = image.values();
        image.set_values(&InputValues::default());
        assert_eq!(ones[..], reserved_bits(INPUT_FIELDS, INPUT_LEN));
        let mut zeros = InputImage::<O>::zeroed();
        zeros.set_values(&all_set);
        let complement = zeros.as_bytes().iter().map(|byte| !byte).collect::<Vec<u8>>();
        assert_eq!(complement, reserved_bits(INPUT_FIELDS, INPUT_LEN));

        let mut ones = [0xFF; OUTPUT_LEN];
        let image = OutputImage::<O>::from_bytes_mut(&mut ones).expect("60 bytes");
        let all_set = image.values();
        image.set_values(&OutputValues::default());
        assert_eq!(ones[..], reserved_bits(OUTPUT_FIELDS, OUTPUT_LEN));
        let mut zeros = OutputImage::<O>::zeroed();
        zeros.set_values(&all_set);
        let complement = zeros.as_bytes().iter().map(|byte| !byte).collect::<Vec<u8>>();
        assert_eq!(complement, reserved_bits(OUTPUT_FIELDS, OUTPUT_LEN));
    }
    in_each_order!(test);
}

#[test]
fn bit_setters_leave_all_other_bits_as_they_are() {
    let mut image = OutputImage::<Big>::zeroed();
    let flags = &mut image.motion_control.flags;

    flags.set_raw(MotionControlFlags::from_bits_retain(0xABFF));
    flags.set(MotionControlFlags::SET_POINT);
    assert_eq!(flags.get().bits(), 0xABE1);
    flags.assign(MotionControlFlags::USE_VARIABLES, true);
    assert_eq!(flags.get().bits(), 0xABF1);
    flags.assign(MotionControlFlags::SET_POINT, false);
    assert_eq!(flags.get().bits(), 0xABF0);
    flags.set(MotionControlFlags::empty());
    assert_eq!(flags.get().bits(), 0xABE0);
    // Reserved bits of the argument are not written, named ones are.
    flags.set(MotionControlFlags::from_bits_retain(0x5402));
    assert_eq!(flags.get().bits(), 0xABE2);
    flags.set_raw(MotionControlFlags::empty());
    assert_eq!(image.as_bytes(), [0; OUTPUT_LEN]);
}

#[test]
fn every_named_bit_sets_the_bit_of_its_row() {
    fn check<F: FlagSet>(section: &str, image: impl Fn(F) -> Vec<u8>, fields: &[Field]) {
        for flag in F::all().iter() {
            let bytes = image(flag);
            let set: Vec<&Field> = fields
                .iter()
                .filter(|field| field.read(&bytes, Big::VALUE) == Some(FieldValue::Bool(true)))
                .collect();
            let [field] = set[..] else { panic!("{flag:?} sets {set:?}") };
            assert_eq!(field.section, section);
            let plain = |text: &str| text.replace(['_', ' '], "").to_lowercase();
            let name = format!("{flag:?}");
            let name = plain(name.split(['(', ')']).nth(1).unwrap_or_default());
            assert!(plain(field.name).contains(&name), "{name} is {}", field.name);
        }
    }
    macro_rules! check {
        ($image:ident, $fields:ident, $section:literal, $block:ident.$field:ident) => {
            check(
                $section,
                |flag| {
                    let mut image = $image::<Big>::zeroed();
                    image.$block.$field.set(flag);
                    image.as_bytes().to_vec()
                },
                $fields,
            );
        };
    }
    check!(OutputImage, OUTPUT_FIELDS, "RobotControl", robot_control.flags);
    check!(OutputImage, OUTPUT_FIELDS, "MotionControl", motion_control.flags);
    check!(OutputImage, OUTPUT_FIELDS, "BrakesControl", brakes_control.flags);
    check!(InputImage, INPUT_FIELDS, "RobotStatus", robot_status.flags);
    check!(InputImage, INPUT_FIELDS, "MotionStatus", motion_status.flags);
    check!(InputImage, INPUT_FIELDS, "SafetyStatus", safety_status.signals);
    check!(InputImage, INPUT_FIELDS, "SafetyStatus", safety_status.resettable);
    check!(InputImage, INPUT_FIELDS, "SafetyStatus", safety_status.power);
    check!(InputImage, INPUT_FIELDS, "SafetyStatus", safety_status.psu_inputs);
}

#[test]
fn debug_prints_named_fields() {
    let output = bytes::<Big>(OUTPUT);
    let output = format!("{:?}", OutputImage::<Big>::from_bytes(&output).expect("60 bytes"));
    for part in [
        "OutputImage { robot_control: RobotControl { flags: RobotControlFlags(ACTIVATE_ROBOT | \
         RESET_ERROR | DISABLE_ETHERCAT) }",
        "motion_control: MotionControl { move_id: 4711, flags: MotionControlFlags(SET_POINT | \
         CLEAR_MOTION | USE_VARIABLES) }",
        "motion_command: MotionCommandField { motion_command_id: 10291 }",
        "argument: [77.0, 210.0, 300.0, -103.0, 36.0, 0.1]",
        "host_time: 1760000000",
        "dynamic_data_type_id: [21, 32, 44, 10291]",
    ] {
        assert!(output.contains(part), "no {part} in {output}");
    }
    let input = bytes::<Little>(INPUT);
    let input = format!("{:?}", InputImage::<Little>::from_bytes(&input).expect("252 bytes"));
    for part in [
        "error_code: 1011",
        "fifo_space: 13000",
        "joint: [10.5, -20.25, 30.125, -40.0625, 50.03125, -36000.0]",
        "target_trf: PoseBlock { x: -1.5, y: -2.5, z: -3.5, alpha: -4.5, beta: -5.5, gamma: -6.5 }",
        "shoulder: 1, elbow: -1, wrist: 0, turn: -100",
        "operation_mode: 167, power: SafetyPower(V_MOTOR_ON)",
        "DynamicDataSlot { dynamic_type: 53, value_idx: [-7.5, ",
    ] {
        assert!(input.contains(part), "no {part} in {input}");
    }
}

#[test]
fn checkpoints_follow_the_firmware_layout() {
    let mut bytes = [0; INPUT_LEN];
    bytes[4..8].copy_from_slice(&[0x00, 0x01, 0x1F, 0x40]);
    let big = InputImage::<Big>::from_bytes(&bytes).expect("252 bytes").motion_status;
    let little = InputImage::<Little>::from_bytes(&bytes).expect("252 bytes").motion_status;
    let mixed = InputImage::<BigIntLittleReal>::from_bytes(&bytes).expect("252 bytes");

    let now = FirmwareLayout::V11_3;
    assert_eq!(FirmwareLayout::default(), now);
    assert_eq!(big.checkpoints(now), Checkpoints { reached: 0x0001, discarded: 0x1F40 });
    assert_eq!(little.checkpoints(now), Checkpoints { reached: 0x0100, discarded: 0x401F });

    let old = FirmwareLayout::V10_2;
    assert_eq!(big.checkpoints(old), Checkpoints { reached: 0x0001_1F40, discarded: 0 });
    assert_eq!(little.checkpoints(old), Checkpoints { reached: 0x401F_0100, discarded: 0 });
    assert_eq!(mixed.motion_status.checkpoints(old), big.checkpoints(old));
}

/// The x87 of 32-bit x86 makes signalling NaNs quiet when it moves them.
#[cfg(not(target_arch = "x86"))]
#[test]
fn the_payload_of_a_nan_survives() {
    const NANS: [u32; 6] =
        [0x7FC0_0000, 0xFFC1_2345, 0x7FA0_0001, 0xFF80_0001, 0x7FFF_FFFF, 0x7F80_0000];
    fn test<O: ImageOrder>() {
        let reals = NANS.map(f32::from_bits);
        let mut image = InputImage::<O>::zeroed();
        for (joint, real) in image.target_joint_set.joint.iter_mut().zip(reals) {
            joint.set(real);
        }
        assert_eq!(image.target_joint_set.joint.map(|joint| joint.get().to_bits()), NANS);
        let values = image.values();
        assert_eq!(values.target_joint_set.joint.map(f32::to_bits), NANS);
        let mut copy = InputImage::<O>::zeroed();
        copy.set_values(&values);
        assert_eq!(copy.as_bytes(), image.as_bytes());
    }
    in_each_order!(test);
}
