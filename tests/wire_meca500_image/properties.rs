//! What holds for any bytes and any values, in every order.

use fieldarm::wire::meca500::image::*;
use fieldarm::wire::order::ImageOrder;
use proptest::collection::vec;
use proptest::prelude::*;

use super::{in_each_order, leaf, leaves};

/// Hands out generated bools and numbers one by one. Reals are any bits: NaN and infinity too.
#[derive(Debug)]
struct Source {
    bools: std::vec::IntoIter<bool>,
    numbers: std::vec::IntoIter<u32>,
}

fn source() -> impl Strategy<Value = Source> {
    (vec(any::<bool>(), 46), vec(any::<u32>(), 75)).prop_map(|(bools, numbers)| Source {
        bools: bools.into_iter(),
        numbers: numbers.into_iter(),
    })
}

impl Source {
    fn bool(&mut self) -> bool {
        self.bools.next().expect("46 bools are enough")
    }

    fn u32(&mut self) -> u32 {
        self.numbers.next().expect("75 numbers are enough")
    }

    fn u16(&mut self) -> u16 {
        self.u32() as u16
    }

    fn i8(&mut self) -> i8 {
        self.u32() as i8
    }

    fn real(&mut self) -> f32 {
        f32::from_bits(self.u32())
    }

    fn six_reals(&mut self) -> [f32; 6] {
        std::array::from_fn(|_| self.real())
    }

    fn pose(&mut self) -> PoseBlockValues {
        let [x, y, z, alpha, beta, gamma] = self.six_reals();
        PoseBlockValues { x, y, z, alpha, beta, gamma }
    }
}

fn output_values(mut s: Source) -> OutputValues {
    OutputValues {
        robot_control: RobotControlValues {
            flags: RobotControlBits {
                deactivate_robot: s.bool(),
                activate_robot: s.bool(),
                home: s.bool(),
                reset_error: s.bool(),
                activate_sim: s.bool(),
                enable_recovery_mode: s.bool(),
                disable_ethercat: s.bool(),
            },
        },
        motion_control: MotionControlValues {
            move_id: s.u16(),
            flags: MotionControlBits {
                set_point: s.bool(),
                pause_motion: s.bool(),
                clear_motion: s.bool(),
                resume_motion: s.bool(),
                use_variables: s.bool(),
            },
        },
        motion_command: MotionCommandFieldValues { motion_command_id: s.u32() },
        motion_command_args: MotionCommandArgsValues { argument: s.six_reals() },
        host_time: HostTimeValues { host_time: s.u32() },
        brakes_control: BrakesControlValues {
            flags: BrakesControlBits { brakes_control_allowed: s.bool(), brakes_engaged: s.bool() },
        },
        dynamic_data_configuration: DynamicDataConfigurationValues {
            dynamic_data_type_id: std::array::from_fn(|_| s.u32()),
        },
    }
}

fn input_values(mut s: Source) -> InputValues {
    InputValues {
        robot_status: RobotStatusValues {
            flags: RobotStatusBits {
                busy: s.bool(),
                activated: s.bool(),
                homed: s.bool(),
                sim_activated: s.bool(),
                brakes_engaged: s.bool(),
                recovery_mode: s.bool(),
                e_stop: s.bool(),
                collision_status: s.bool(),
                work_zone_status: s.bool(),
                monitoring_mode: s.bool(),
            },
            error_code: s.u16(),
        },
        motion_status: MotionStatusValues {
            checkpoint_reached: s.u16(),
            checkpoint_discarded: s.u16(),
            move_id: s.u16(),
            fifo_space: s.u16(),
            flags: MotionStatusBits {
                paused: s.bool(),
                eob: s.bool(),
                eom: s.bool(),
                cleared: s.bool(),
                p_stop2: s.bool(),
                excessive_torque: s.bool(),
            },
            offline_program_id: s.u16(),
        },
        target_joint_set: TargetJointSetValues { joint: s.six_reals() },
        target_end_effector_pose: s.pose(),
        target_configuration: TargetConfigurationValues {
            shoulder: s.i8(),
            elbow: s.i8(),
            wrist: s.i8(),
            turn: s.i8(),
        },
        target_wrf: s.pose(),
        target_trf: s.pose(),
        robot_timestamp: RobotTimestampValues {
            seconds: s.u32(),
            microseconds: s.u32(),
            dynamic_data_cycles: s.u32(),
        },
        safety_status: SafetyStatusValues {
            signals: SafetySignalBits {
                e_stop: s.bool(),
                p_stop1: s.bool(),
                p_stop2: s.bool(),
                operation_mode_change: s.bool(),
                enabling_device_released: s.bool(),
                voltage_fluctuation: s.bool(),
                reboot: s.bool(),
                redundancy_fault: s.bool(),
                standstill_fault: s.bool(),
                connection_dropped: s.bool(),
                minor_error: s.bool(),
            },
            resettable: SafetyResettableBits {
                e_stop: s.bool(),
                p_stop1: s.bool(),
                p_stop2: s.bool(),
                operation_mode_change: s.bool(),
                enabling_device_released: s.bool(),
                voltage_fluctuation: s.bool(),
                reboot: s.bool(),
                redundancy_fault: s.bool(),
                standstill_fault: s.bool(),
                connection_dropped: s.bool(),
                minor_error: s.bool(),
            },
            operation_mode: s.u32() as u8,
            power: SafetyPowerBits { reset_ready: s.bool(), v_motor_on: s.bool() },
            psu_inputs: PsuInputBits {
                e_stop: s.bool(),
                p_stop1: s.bool(),
                p_stop2: s.bool(),
                reset_external: s.bool(),
                reset_keypad: s.bool(),
                enabling_device: s.bool(),
            },
        },
        dynamic_data: std::array::from_fn(|_| DynamicDataSlotValues {
            dynamic_type: s.u32(),
            value_idx: s.six_reals(),
        }),
    }
}

/// What a row must read for each number that [`leaves`] shows; NaN reads as NaN.
fn rows<O: ImageOrder>(fields: &[Field], bytes: &[u8]) -> Vec<String> {
    fields
        .iter()
        .filter(|field| field.field_type != FieldType::Reserved)
        .map(|field| leaf(field.read(bytes, O::VALUE).expect("the image is long enough")))
        .collect()
}

fn outputs_round_trip<O: ImageOrder>(values: &OutputValues, before: &[u8]) {
    // From values.
    let mut image = OutputImage::<O>::zeroed();
    image.set_values(values);
    let found = image.values();
    assert_eq!(leaves(&found), leaves(values));
    assert_eq!(rows::<O>(OUTPUT_FIELDS, image.as_bytes()), leaves(values));
    assert_eq!(
        found.motion_command_args.argument.map(f32::to_bits),
        values.motion_command_args.argument.map(f32::to_bits)
    );
    // From bytes: writing what was read changes nothing, reserved bits included.
    let mut bytes = before.to_vec();
    let image = OutputImage::<O>::from_bytes_mut(&mut bytes).expect("60 bytes");
    let found = image.values();
    image.set_values(&found);
    assert_eq!(bytes, before);
    assert_eq!(rows::<O>(OUTPUT_FIELDS, before), leaves(&found));
    // Any values over any bytes: the values arrive, the reserved bits stay.
    let image = OutputImage::<O>::from_bytes_mut(&mut bytes).expect("60 bytes");
    image.set_values(values);
    assert_eq!(leaves(&image.values()), leaves(values));
    assert_eq!(reserved::<O>(OUTPUT_FIELDS, &bytes), reserved::<O>(OUTPUT_FIELDS, before));
}

fn inputs_round_trip<O: ImageOrder>(values: &InputValues, before: &[u8]) {
    let mut image = InputImage::<O>::zeroed();
    image.set_values(values);
    let found = image.values();
    assert_eq!(leaves(&found), leaves(values));
    assert_eq!(rows::<O>(INPUT_FIELDS, image.as_bytes()), leaves(values));
    for (found, value) in found.dynamic_data.iter().zip(&values.dynamic_data) {
        assert_eq!(found.value_idx.map(f32::to_bits), value.value_idx.map(f32::to_bits));
    }

    let mut bytes = before.to_vec();
    let image = InputImage::<O>::from_bytes_mut(&mut bytes).expect("252 bytes");
    let found = image.values();
    image.set_values(&found);
    assert_eq!(bytes, before);
    assert_eq!(rows::<O>(INPUT_FIELDS, before), leaves(&found));

    let image = InputImage::<O>::from_bytes_mut(&mut bytes).expect("252 bytes");
    image.set_values(values);
    assert_eq!(leaves(&image.values()), leaves(values));
    assert_eq!(reserved::<O>(INPUT_FIELDS, &bytes), reserved::<O>(INPUT_FIELDS, before));
}

fn reserved<O: ImageOrder>(fields: &[Field], bytes: &[u8]) -> Vec<Option<FieldValue>> {
    fields
        .iter()
        .filter(|field| field.field_type == FieldType::Reserved)
        .map(|field| field.read(bytes, O::VALUE))
        .collect()
}

proptest! {
    #[test]
    fn outputs_round_trip_in_each_order(
        values in source().prop_map(output_values),
        bytes in vec(any::<u8>(), OUTPUT_LEN),
    ) {
        in_each_order!(outputs_round_trip, &values, &bytes);
    }

    #[test]
    fn inputs_round_trip_in_each_order(
        values in source().prop_map(input_values),
        bytes in vec(any::<u8>(), INPUT_LEN),
    ) {
        in_each_order!(inputs_round_trip, &values, &bytes);
    }

    #[test]
    fn any_bytes_of_any_length_are_an_image_or_an_error(bytes in vec(any::<u8>(), 0..300)) {
        fn test<O: ImageOrder>(bytes: &[u8]) {
            assert_eq!(InputImage::<O>::from_bytes(bytes).is_ok(), bytes.len() == INPUT_LEN);
            assert_eq!(OutputImage::<O>::from_bytes(bytes).is_ok(), bytes.len() == OUTPUT_LEN);
            for field in OUTPUT_FIELDS.iter().chain(INPUT_FIELDS) {
                let whole_bytes = usize::from(field.byte_offset)
                    + (usize::from(field.bit) + usize::from(field.size_bits)).div_ceil(8);
                assert_eq!(field.read(bytes, O::VALUE).is_some(), whole_bytes <= bytes.len());
            }
        }
        in_each_order!(test, &bytes);
    }
}
