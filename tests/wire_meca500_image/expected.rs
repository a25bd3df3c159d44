//! The values of the hand-typed vectors, decoded and encoded in every way and order.

use fieldarm::wire::meca500::image::*;
use fieldarm::wire::order::{Big, ImageOrder, Little};

use super::vectors::{INPUT, OUTPUT, bytes};
use super::{in_each_order, leaf, leaves};

fn output_values() -> OutputValues {
    OutputValues {
        robot_control: RobotControlValues {
            flags: RobotControlBits {
                activate_robot: true,
                reset_error: true,
                disable_ethercat: true,
                ..RobotControlBits::default()
            },
        },
        motion_control: MotionControlValues {
            move_id: 4711,
            flags: MotionControlBits {
                set_point: true,
                clear_motion: true,
                use_variables: true,
                ..MotionControlBits::default()
            },
        },
        motion_command: MotionCommandFieldValues { motion_command_id: 10_291 },
        motion_command_args: MotionCommandArgsValues {
            argument: [77.0, 210.0, 300.0, -103.0, 36.0, 0.1],
        },
        host_time: HostTimeValues { host_time: 1_760_000_000 },
        brakes_control: BrakesControlValues {
            flags: BrakesControlBits { brakes_control_allowed: true, brakes_engaged: false },
        },
        dynamic_data_configuration: DynamicDataConfigurationValues {
            dynamic_data_type_id: [21, 32, 44, 10_291],
        },
    }
}

fn input_values() -> InputValues {
    InputValues {
        robot_status: RobotStatusValues {
            flags: RobotStatusBits {
                activated: true,
                homed: true,
                brakes_engaged: true,
                work_zone_status: true,
                monitoring_mode: true,
                ..RobotStatusBits::default()
            },
            error_code: 1011,
        },
        motion_status: MotionStatusValues {
            checkpoint_reached: 8000,
            checkpoint_discarded: 17,
            move_id: 4711,
            fifo_space: 13_000,
            flags: MotionStatusBits {
                paused: true,
                eom: true,
                excessive_torque: true,
                ..MotionStatusBits::default()
            },
            offline_program_id: 258,
        },
        target_joint_set: TargetJointSetValues {
            joint: [10.5, -20.25, 30.125, -40.0625, 50.03125, -36_000.0],
        },
        target_end_effector_pose: PoseBlockValues {
            x: 190.0,
            y: -0.5,
            z: 308.0,
            alpha: 1.0,
            beta: 90.0,
            gamma: -2.0,
        },
        target_configuration: TargetConfigurationValues {
            shoulder: 1,
            elbow: -1,
            wrist: 0,
            turn: -100,
        },
        target_wrf: PoseBlockValues { x: 1.5, y: 2.5, z: 3.5, alpha: 4.5, beta: 5.5, gamma: 6.5 },
        target_trf: PoseBlockValues {
            x: -1.5,
            y: -2.5,
            z: -3.5,
            alpha: -4.5,
            beta: -5.5,
            gamma: -6.5,
        },
        robot_timestamp: RobotTimestampValues {
            seconds: 86_399,
            microseconds: 999_999,
            dynamic_data_cycles: 66_051,
        },
        safety_status: SafetyStatusValues {
            signals: SafetySignalBits {
                e_stop: true,
                p_stop2: true,
                voltage_fluctuation: true,
                standstill_fault: true,
                connection_dropped: true,
                ..SafetySignalBits::default()
            },
            resettable: SafetyResettableBits {
                p_stop2: true,
                reboot: true,
                redundancy_fault: true,
                minor_error: true,
                ..SafetyResettableBits::default()
            },
            operation_mode: 167,
            power: SafetyPowerBits { reset_ready: false, v_motor_on: true },
            psu_inputs: PsuInputBits {
                p_stop1: true,
                reset_external: true,
                enabling_device: true,
                ..PsuInputBits::default()
            },
        },
        dynamic_data: [
            DynamicDataSlotValues {
                dynamic_type: 21,
                value_idx: [7.5, 8.5, 9.5, 10.5, 11.5, 12.5],
            },
            DynamicDataSlotValues {
                dynamic_type: 3,
                value_idx: [1_234_567.0, f32::from_bits(1_234_567), 0.0, 0.0, 0.0, 0.0],
            },
            DynamicDataSlotValues {
                dynamic_type: 10_291,
                value_idx: [13.5, 14.5, 15.5, 16.5, 17.5, 18.5],
            },
            DynamicDataSlotValues {
                dynamic_type: 53,
                value_idx: [-7.5, -8.5, -9.5, -10.5, -11.5, -12.5],
            },
        ],
    }
}

/// Bits that the output vector sets, `section.name`.
const OUTPUT_BITS: [&str; 7] = [
    "RobotControl.ActivateRobot",
    "RobotControl.ResetError",
    "RobotControl.DisableEtherCAT",
    "MotionControl.SetPoint",
    "MotionControl.ClearMotion",
    "MotionControl.UseVariables",
    "BrakesControl.BrakesControlAllowed",
];

/// Bits that the input vector sets, `section.name`.
const INPUT_BITS: [&str; 21] = [
    "RobotStatus.Activated",
    "RobotStatus.Homed",
    "RobotStatus.BrakesEngaged",
    "RobotStatus.WorkZoneStatus",
    "RobotStatus.MonitoringMode",
    "MotionStatus.Paused",
    "MotionStatus.EOM",
    "MotionStatus.ExcessiveTorque",
    "SafetyStatus.EStop",
    "SafetyStatus.PStop2",
    "SafetyStatus.VoltageFluctuation",
    "SafetyStatus.StandstillFault",
    "SafetyStatus.ConnectionDropped",
    "SafetyStatus.PStop2Resettable",
    "SafetyStatus.RebootResettable",
    "SafetyStatus.RedundancyFaultResettable",
    "SafetyStatus.MinorErrorResettable",
    "SafetyStatus.VMotorOn",
    "SafetyStatus.PsuInputs_PStop1",
    "SafetyStatus.PsuInputs_ResetExternal",
    "SafetyStatus.PsuInputs_EnablingDevice",
];

fn bits_set<O: ImageOrder>(fields: &[Field], image: &[u8]) -> Vec<String> {
    fields
        .iter()
        .filter(|field| field.read(image, O::VALUE) == Some(FieldValue::Bool(true)))
        .map(|field| format!("{}.{}", field.section, field.name))
        .collect()
}

/// What `Field::read` finds in all fields but reserved ones, in the order of the image.
fn read_all<O: ImageOrder>(fields: &[Field], image: &[u8]) -> Vec<String> {
    fields
        .iter()
        .filter(|field| field.field_type != FieldType::Reserved)
        .map(|field| leaf(field.read(image, O::VALUE).expect("the image is long enough")))
        .collect()
}

fn read<O: ImageOrder>(fields: &[Field], image: &[u8], section: &str, name: &str) -> FieldValue {
    let mut found = fields.iter().filter(|field| (field.section, field.name) == (section, name));
    let field = found.next().expect("the field exists");
    assert!(found.next().is_none(), "{section}.{name} exists twice");
    field.read(image, O::VALUE).expect("the image is long enough")
}

#[test]
fn output_vector_decodes_into_values() {
    fn test<O: ImageOrder>() {
        let bytes = bytes::<O>(OUTPUT);
        let image = OutputImage::<O>::from_bytes(&bytes).expect("60 bytes");
        assert_eq!(image.values(), output_values());
    }
    in_each_order!(test);
}

#[test]
fn output_vector_decodes_through_accessors() {
    fn test<O: ImageOrder>() {
        let bytes = bytes::<O>(OUTPUT);
        let image = OutputImage::<O>::from_bytes(&bytes).expect("60 bytes");
        let control = RobotControlFlags::ACTIVATE_ROBOT
            | RobotControlFlags::RESET_ERROR
            | RobotControlFlags::DISABLE_ETHERCAT;
        assert_eq!(image.robot_control.flags.get(), control);
        assert_eq!(image.motion_control.move_id.get(), 4711);
        let motion = MotionControlFlags::SET_POINT
            | MotionControlFlags::CLEAR_MOTION
            | MotionControlFlags::USE_VARIABLES;
        assert_eq!(image.motion_control.flags.get(), motion);
        assert_eq!(image.motion_command.motion_command_id.get(), 10_291);
        let arguments = image.motion_command_args.argument.map(|argument| argument.get());
        assert_eq!(arguments, [77.0, 210.0, 300.0, -103.0, 36.0, 0.1]);
        assert_eq!(image.host_time.host_time.get(), 1_760_000_000);
        assert!(image.brakes_control.flags.contains(BrakesControlFlags::BRAKES_CONTROL_ALLOWED));
        assert!(!image.brakes_control.flags.contains(BrakesControlFlags::BRAKES_ENGAGED));
        let types = image.dynamic_data_configuration.dynamic_data_type_id.map(|id| id.get());
        assert_eq!(types, [21, 32, 44, 10_291]);
    }
    in_each_order!(test);
}

#[test]
fn output_vector_decodes_through_its_rows() {
    fn test<O: ImageOrder>() {
        let bytes = bytes::<O>(OUTPUT);
        let read = |section, name| read::<O>(OUTPUT_FIELDS, &bytes, section, name);
        assert_eq!(bits_set::<O>(OUTPUT_FIELDS, &bytes), OUTPUT_BITS);
        assert_eq!(read("MotionControl", "MoveID"), FieldValue::Unsigned(4711));
        assert_eq!(read("MotionCommand", "MotionCommandID"), FieldValue::Unsigned(10_291));
        assert_eq!(read("MotionCommandArgs", "Argument 4"), FieldValue::Real(-103.0));
        assert_eq!(read("HostTime", "HostTime"), FieldValue::Unsigned(1_760_000_000));
        let type3 = read("DynamicDataConfiguration", "DynamicDataTypeID3");
        assert_eq!(type3, FieldValue::Unsigned(44));
        assert_eq!(read_all::<O>(OUTPUT_FIELDS, &bytes), leaves(&output_values()));
    }
    in_each_order!(test);
}

#[test]
fn output_values_encode_to_the_vector() {
    fn test<O: ImageOrder>() {
        let mut image = OutputImage::<O>::zeroed();
        image.set_values(&output_values());
        assert_eq!(image.as_bytes(), bytes::<O>(OUTPUT));

        let mut in_place = [0; OUTPUT_LEN];
        let image = OutputImage::<O>::from_bytes_mut(&mut in_place).expect("60 bytes");
        image.set_values(&output_values());
        assert_eq!(in_place[..], bytes::<O>(OUTPUT));
    }
    in_each_order!(test);
}

#[test]
fn output_setters_write_the_vector() {
    fn test<O: ImageOrder>() {
        let mut image = OutputImage::<O>::zeroed();
        image.robot_control.flags.assign(RobotControlFlags::ACTIVATE_ROBOT, true);
        image.robot_control.flags.assign(RobotControlFlags::RESET_ERROR, true);
        image.robot_control.flags.assign(RobotControlFlags::DISABLE_ETHERCAT, true);
        image.motion_control.move_id.set(4711);
        image.motion_control.flags.set(
            MotionControlFlags::SET_POINT
                | MotionControlFlags::CLEAR_MOTION
                | MotionControlFlags::USE_VARIABLES,
        );
        image.motion_command.motion_command_id.set(10_291);
        for (argument, value) in image
            .motion_command_args
            .argument
            .iter_mut()
            .zip([77.0, 210.0, 300.0, -103.0, 36.0, 0.1])
        {
            argument.set(value);
        }
        image.host_time.host_time.set(1_760_000_000);
        image.brakes_control.flags.assign(BrakesControlFlags::BRAKES_CONTROL_ALLOWED, true);
        for (id, value) in image
            .dynamic_data_configuration
            .dynamic_data_type_id
            .iter_mut()
            .zip([21, 32, 44, 10_291])
        {
            id.set(value);
        }
        assert_eq!(image.as_bytes(), bytes::<O>(OUTPUT));
    }
    in_each_order!(test);
}

#[test]
fn input_vector_decodes_into_values() {
    fn test<O: ImageOrder>() {
        let bytes = bytes::<O>(INPUT);
        let image = InputImage::<O>::from_bytes(&bytes).expect("252 bytes");
        assert_eq!(image.values(), input_values());
    }
    in_each_order!(test);
}

#[test]
fn input_vector_decodes_through_accessors() {
    fn test<O: ImageOrder>() {
        let bytes = bytes::<O>(INPUT);
        let image = InputImage::<O>::from_bytes(&bytes).expect("252 bytes");
        let status = RobotStatusFlags::ACTIVATED
            | RobotStatusFlags::HOMED
            | RobotStatusFlags::BRAKES_ENGAGED
            | RobotStatusFlags::WORK_ZONE_STATUS
            | RobotStatusFlags::MONITORING_MODE;
        assert_eq!(image.robot_status.flags.get(), status);
        assert_eq!(image.robot_status.error_code.get(), 1011);
        assert_eq!(image.motion_status.checkpoint_reached.get(), 8000);
        assert_eq!(image.motion_status.checkpoint_discarded.get(), 17);
        assert_eq!(image.motion_status.move_id.get(), 4711);
        assert_eq!(image.motion_status.fifo_space.get(), 13_000);
        let motion = MotionStatusFlags::PAUSED
            | MotionStatusFlags::EOM
            | MotionStatusFlags::EXCESSIVE_TORQUE;
        assert_eq!(image.motion_status.flags.get(), motion);
        assert_eq!(image.motion_status.offline_program_id.get(), 258);
        let joints = image.target_joint_set.joint.map(|joint| joint.get());
        assert_eq!(joints, [10.5, -20.25, 30.125, -40.0625, 50.03125, -36_000.0]);
        assert_eq!(image.target_end_effector_pose.z.get(), 308.0);
        assert_eq!(image.target_configuration.elbow, -1);
        assert_eq!(image.target_configuration.turn, -100);
        assert_eq!(image.target_wrf.alpha.get(), 4.5);
        assert_eq!(image.target_trf.gamma.get(), -6.5);
        assert_eq!(image.robot_timestamp.seconds.get(), 86_399);
        assert_eq!(image.robot_timestamp.microseconds.get(), 999_999);
        assert_eq!(image.robot_timestamp.dynamic_data_cycles.get(), 66_051);
        let safety = &image.safety_status;
        let signals = SafetySignals::E_STOP
            | SafetySignals::P_STOP2
            | SafetySignals::VOLTAGE_FLUCTUATION
            | SafetySignals::STANDSTILL_FAULT
            | SafetySignals::CONNECTION_DROPPED;
        assert_eq!(safety.signals.get(), signals);
        let resettable = SafetyResettable::P_STOP2
            | SafetyResettable::REBOOT
            | SafetyResettable::REDUNDANCY_FAULT
            | SafetyResettable::MINOR_ERROR;
        assert_eq!(safety.resettable.get(), resettable);
        assert_eq!(safety.operation_mode, 167);
        assert_eq!(safety.power.get(), SafetyPower::V_MOTOR_ON);
        let psu = PsuInputs::P_STOP1 | PsuInputs::RESET_EXTERNAL | PsuInputs::ENABLING_DEVICE;
        assert_eq!(safety.psu_inputs.get(), psu);
        let types = image.dynamic_data.map(|slot| slot.dynamic_type.get());
        assert_eq!(types, [21, 3, 10_291, 53]);
        let firsts = image.dynamic_data.map(|slot| slot.value_idx[0].get());
        assert_eq!(firsts, [7.5, 1_234_567.0, 13.5, -7.5]);
        assert_eq!(image.dynamic_data[1].value_idx[1].get().to_bits(), 1_234_567);
    }
    in_each_order!(test);
}

#[test]
fn input_vector_decodes_through_its_rows() {
    fn test<O: ImageOrder>() {
        let bytes = bytes::<O>(INPUT);
        let read = |section, name| read::<O>(INPUT_FIELDS, &bytes, section, name);
        assert_eq!(bits_set::<O>(INPUT_FIELDS, &bytes), INPUT_BITS);
        assert_eq!(read("RobotStatus", "ErrorCode"), FieldValue::Unsigned(1011));
        assert_eq!(read("MotionStatus", "FifoSpace"), FieldValue::Unsigned(13_000));
        assert_eq!(read("TargetJointSet", "Joint 6"), FieldValue::Real(-36_000.0));
        assert_eq!(read("TargetConfiguration", "Turn"), FieldValue::Signed(-100));
        assert_eq!(read("TargetTrf", "alpha angle"), FieldValue::Real(-4.5));
        assert_eq!(read("RobotTimestamp", "Microseconds"), FieldValue::Unsigned(999_999));
        assert_eq!(read("SafetyStatus", "OperationMode"), FieldValue::Unsigned(167));
        assert_eq!(read("DynamicData2", "DynamicType"), FieldValue::Unsigned(10_291));
        assert_eq!(read("DynamicData3", "ValueIdx_5"), FieldValue::Real(-12.5));
        assert_eq!(read_all::<O>(INPUT_FIELDS, &bytes), leaves(&input_values()));
    }
    in_each_order!(test);
}

#[test]
fn input_values_encode_to_the_vector() {
    fn test<O: ImageOrder>() {
        let mut image = InputImage::<O>::zeroed();
        image.set_values(&input_values());
        assert_eq!(image.as_bytes(), bytes::<O>(INPUT));
    }
    in_each_order!(test);
}

/// A captured EtherCAT frame of a real robot: everything little-endian.
#[test]
fn facts_of_a_real_frame() {
    let mut bytes = [0; INPUT_LEN];
    bytes[0] = 0x16;
    bytes[10..12].copy_from_slice(&[0xC8, 0x32]);
    let image = InputImage::<Little>::from_bytes(&bytes).expect("252 bytes");
    let status =
        RobotStatusFlags::ACTIVATED | RobotStatusFlags::HOMED | RobotStatusFlags::BRAKES_ENGAGED;
    assert_eq!(image.robot_status.flags.get(), status);
    assert_eq!(image.motion_status.fifo_space.get(), 13_000);
    let wrong = InputImage::<Big>::from_bytes(&bytes).expect("252 bytes");
    assert_eq!(wrong.motion_status.fifo_space.get(), 0xC832);

    let mut bytes = [0; OUTPUT_LEN];
    bytes[8..12].copy_from_slice(&[0x15, 0x00, 0x00, 0x00]);
    let image = OutputImage::<Little>::from_bytes(&bytes).expect("60 bytes");
    assert_eq!(image.motion_command.motion_command_id.get(), 21);
}
