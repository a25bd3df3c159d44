//! The images that are measured, and the check that every subject finds the same values in them.

use std::fmt::Debug;

use fieldarm::wire::meca500::image::{
    FieldType, INPUT_FIELDS, INPUT_LEN, InputImage, OutputImage, OutputValues,
};
use fieldarm::wire::order::ImageOrder;

/// An input image with a different number in every field and about half of the bits set.
pub(crate) fn input<O: ImageOrder>() -> [u8; INPUT_LEN] {
    let mut bytes = [0; INPUT_LEN];
    let order = O::VALUE;
    for (number, field) in (1_u8..).zip(INPUT_FIELDS) {
        let at = usize::from(field.byte_offset);
        let written: Vec<u8> = match field.field_type {
            FieldType::Bool if number % 3 == 1 => vec![bytes[at] | 1 << field.bit],
            FieldType::Bool | FieldType::Reserved => continue,
            FieldType::U8 | FieldType::I8 => vec![number],
            FieldType::U16 => {
                order.integers.u16((1000 + u16::from(number)).to_be_bytes()).to_be_bytes().to_vec()
            }
            FieldType::U32 => order
                .integers
                .u32((100_000 + u32::from(number)).to_be_bytes())
                .to_be_bytes()
                .to_vec(),
            FieldType::F32 => {
                order.reals.u32((f32::from(number) * -1.25).to_be_bytes()).to_be_bytes().to_vec()
            }
        };
        bytes[at..at + written.len()].copy_from_slice(&written);
    }
    bytes
}

/// A command in flight.
pub(crate) fn output() -> OutputValues {
    let mut values = OutputValues::default();
    values.robot_control.flags.activate_robot = true;
    values.robot_control.flags.disable_ethercat = true;
    values.motion_control.move_id = 4711;
    values.motion_control.flags.set_point = true;
    values.motion_control.flags.use_variables = true;
    values.motion_command.motion_command_id = 2;
    values.motion_command_args.argument = [77.0, 210.0, 300.0, -103.0, 36.0, 175.0];
    values.host_time.host_time = 1_760_000_000;
    values.brakes_control.flags.brakes_engaged = true;
    values.dynamic_data_configuration.dynamic_data_type_id = [21, 32, 44, 53];
    values
}

/// The bytes of [`output`].
pub(crate) fn output_bytes<O: ImageOrder>() -> Vec<u8> {
    let mut image = OutputImage::<O>::zeroed();
    image.set_values(&output());
    image.as_bytes().to_vec()
}

/// Stops the bench unless `found` holds the values of the input image, in the image's order.
pub(crate) fn check_input<O: ImageOrder>(subject: &str, found: &impl Debug) {
    let bytes = input::<O>();
    let image = InputImage::<O>::from_bytes(&bytes).expect("252 bytes");
    check(subject, &image.values(), found);
}

/// Stops the bench unless `found` holds the same values in the same order as `expected`. Reals may
/// be the bits of one.
pub(crate) fn check(subject: &str, expected: &impl Debug, found: &impl Debug) {
    let (expected, found) = (leaves(expected), leaves(found));
    assert_eq!(expected.len(), found.len(), "{subject} has another number of fields");
    for (at, (expected, found)) in expected.iter().zip(&found).enumerate() {
        let bits = expected.parse::<f32>().map(|real| real.to_bits().to_string());
        assert!(
            expected == found || bits.is_ok_and(|bits| bits == *found),
            "{subject}: value {at} is {found}, must be {expected}"
        );
    }
}

/// The numbers and bools that `value` prints.
fn leaves(value: &impl Debug) -> Vec<String> {
    format!("{value:?}")
        .split(|c: char| !c.is_ascii_alphanumeric() && !"_.-".contains(c))
        .filter(|word| {
            matches!(*word, "true" | "false")
                || word.starts_with(|c: char| c.is_ascii_digit() || c == '-')
        })
        .map(str::to_owned)
        .collect()
}
