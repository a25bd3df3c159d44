//! Assigned PDOs between the sync managers' bytes and the robot's images, and what the states allow.

#![cfg(feature = "sim")]

mod coe_support;

use coe_support::*;
use fieldarm::bus::ethercat::application::Application;
use fieldarm::bus::ethercat::meca500::{Meca500Application, Meca500Settings};
use fieldarm::sim::meca500::{CyclicBus, RobotSettings, VirtualRobot};
use fieldarm::time::Instant;
use fieldarm::wire::ethercat::al::{AlState, AlStatusCode};
use fieldarm::wire::meca500::image::{
    FieldValue, INPUT_FIELDS, InputImage, OutputImage, RobotControlFlags,
};
use fieldarm::wire::order::{ByteOrder, Little};

/// Assigns `pdos` to 1C12h or 1C13h, entry by entry.
fn assign(robot: &mut impl Application, assignment: u16, pdos: &[u16]) {
    let mut write = |size: u8, sub_index: u8, value: u16| {
        let ([low, high], [a, b]) = (assignment.to_le_bytes(), value.to_le_bytes());
        let request = [0, 0x20, size, low, high, sub_index, a, b, 0, 0];
        let answer = ask(robot, &hex(&request));
        assert!(answer.starts_with("00 30 60"), "{assignment:04X}:{sub_index:02X}: {answer}");
    };
    write(0x2F, 0, 0);
    for (sub_index, pdo) in (1..).zip(pdos) {
        write(0x2B, sub_index, *pdo);
    }
    write(0x2F, 0, u16::try_from(pdos.len()).unwrap());
}

/// One cycle; returns the inputs.
fn cycle(robot: &mut impl Application, outputs: Option<&[u8]>) -> Vec<u8> {
    let mut inputs = vec![0xAA; robot.input_len()];
    robot.cycle(Instant::ZERO, outputs, &mut inputs);
    inputs
}

/// Every input PDO but 1A08h.
const WITHOUT_CONFIGURATION: &[u16] = &[
    0x1A00, 0x1A01, 0x1A02, 0x1A03, 0x1A09, 0x1A0A, 0x1A10, 0x1A11, 0x1A20, 0x1A21, 0x1A22, 0x1A23,
];

fn numbered(len: u8) -> Vec<u8> {
    (1..=len).collect()
}

#[test]
fn the_whole_assignment_is_the_image() {
    let mut robot = firmware(Meca500Settings::default());
    assert_eq!((robot.output_len(), robot.input_len()), (60, 252));
    let outputs = numbered(60);
    let inputs = cycle(&mut robot, Some(&outputs));
    assert_eq!(inputs, robot.device().inputs);
    assert_eq!(robot.device().outputs.as_deref(), Some(outputs.as_slice()));
    // What the outputs are can be read by SDO: MoveID is bytes 5 and 6 of 1 to 60.
    dialogue(
        &mut robot,
        &[
            ("00 20 40 10 73 01 00 00 00 00", "00 30 4B 10 73 01 05 06 00 00"),
            ("00 20 40 23 74 00 00 00 00 00", "00 30 43 23 74 00 39 3A 3B 3C"),
        ],
    );
}

#[test]
fn no_outputs_are_passed_on_as_none() {
    let mut robot = firmware(Meca500Settings::default());
    cycle(&mut robot, Some(&numbered(60)));
    cycle(&mut robot, None);
    assert_eq!(robot.device().outputs, None);
    dialogue(&mut robot, &[("00 20 40 10 73 01 00 00 00 00", "00 30 4B 10 73 01 00 00 00 00")]);
    // Bytes that are not the assigned outputs are none.
    for len in [0, 1, 59, 61] {
        cycle(&mut robot, Some(&numbered(len)));
        assert_eq!(robot.device().outputs, None, "{len} bytes");
    }
    let mut short = [0xAA; 251];
    robot.cycle(Instant::ZERO, Some(&numbered(60)), &mut short);
    assert_eq!(short, [0xAA; 251], "no room for the inputs");
}

#[test]
fn a_dropped_pdo_moves_what_follows() {
    let mut robot = firmware(Meca500Settings::default());
    assign(&mut robot, 0x1C13, WITHOUT_CONFIGURATION);
    assert_eq!(robot.input_len(), 248);
    let inputs = cycle(&mut robot, None);
    assert_eq!(inputs[..64], robot.device().inputs[..64]);
    assert_eq!(inputs[64..], robot.device().inputs[68..]);
}

#[test]
fn pdos_come_in_the_order_of_the_assignment() {
    let mut robot = firmware(Meca500Settings::default());
    // Timestamp (116 to 127), robot status (0 to 3), configuration (64 to 67).
    assign(&mut robot, 0x1C13, &[0x1A10, 0x1A00, 0x1A08]);
    let inputs = cycle(&mut robot, None);
    let expected: Vec<u8> = (116..128).chain(0..4).chain(64..68).collect();
    assert_eq!(inputs, expected);

    // Host time (36 to 39), motion control (4 to 7): the rest reads as 0.
    assign(&mut robot, 0x1C12, &[0x1610, 0x1601]);
    assert_eq!(robot.output_len(), 8);
    cycle(&mut robot, Some(&[1, 2, 3, 4, 5, 6, 7, 8]));
    let mut image = [0; 60];
    image[36..40].copy_from_slice(&[1, 2, 3, 4]);
    image[4..8].copy_from_slice(&[5, 6, 7, 8]);
    assert_eq!(robot.device().outputs.as_deref(), Some(image.as_slice()));

    // Every PDO in another order is as long as the image, but not the image.
    let backwards = [0x1623, 0x1622, 0x1621, 0x1620, 0x1611, 0x1610, 0x1602, 0x1601, 0x1600];
    assign(&mut robot, 0x1C12, &backwards);
    assert_eq!(robot.output_len(), 60);
    cycle(&mut robot, Some(&numbered(60)));
    let seen = robot.device().outputs.clone().unwrap();
    assert_eq!(seen[56..], [1, 2, 3, 4]);
    assert_eq!(seen[..4], [57, 58, 59, 60]);

    // Nothing at all is an assignment too: the robot is fed, with zeros.
    assign(&mut robot, 0x1C12, &[]);
    assert_eq!(robot.output_len(), 0);
    cycle(&mut robot, Some(&[]));
    assert_eq!(robot.device().outputs.as_deref(), Some([0; 60].as_slice()));
}

#[test]
fn power_up_restores_the_assignment_of_the_settings() {
    let settings = Meca500Settings { unassigned_at_power_up: &[0x1A08], ..Default::default() };
    let mut robot = firmware(settings);
    assert_eq!((robot.output_len(), robot.input_len()), (60, 248));
    dialogue(
        &mut robot,
        &[
            ("00 20 40 13 1C 00 00 00 00 00", "00 30 4F 13 1C 00 0C 00 00 00"),
            ("00 20 40 13 1C 05 00 00 00 00", "00 30 4B 13 1C 05 09 1A 00 00"),
        ],
    );
    assign(&mut robot, 0x1C13, &[0x1A08]);
    assign(&mut robot, 0x1C12, &[0x1600]);
    robot.receive_mailbox(AlState::PreOp, &coe(&bytes("00 20 40 00 1C 00 00 00 00 00")));
    robot.device_mut().on_bus = false;
    assert_eq!(cycle(&mut robot, None), [0xAA; 4], "off the bus nothing is written");
    assert!(!robot.is_on_bus());
    robot.device_mut().on_bus = true;
    cycle(&mut robot, None);
    assert!(robot.is_on_bus());
    assert_eq!((robot.output_len(), robot.input_len()), (60, 248));
    assert_eq!(fetch(&mut robot, MAILBOX), None, "an answer from before");
    assert_eq!(cycle(&mut robot, None)[64..], robot.device().inputs[68..]);
}

#[test]
fn a_robot_that_wants_its_assignment_written_refuses_safe_op_until_then() {
    let (pre_op, safe_op) = (AlState::PreOp, AlState::SafeOp);
    let refused = Err(AlStatusCode::INVALID_PROCESS_DATA_MAPPING);
    let mut easy = firmware(Meca500Settings::default());
    assert_eq!(easy.check_transition(pre_op, safe_op), Ok(()));

    let settings = Meca500Settings { assignment_must_be_written: true, ..Default::default() };
    let mut robot = firmware(settings);
    assert_eq!(robot.check_transition(AlState::Init, pre_op), Ok(()));
    assert_eq!(robot.check_transition(pre_op, safe_op), refused);
    assign(&mut robot, 0x1C12, &[0x1600]);
    assert_eq!(robot.check_transition(pre_op, safe_op), refused);
    assign(&mut robot, 0x1C13, WITHOUT_CONFIGURATION);
    assert_eq!(robot.check_transition(pre_op, safe_op), Ok(()));
    assert_eq!(robot.check_transition(AlState::Op, safe_op), Ok(()));

    // Until the next power-up. Then with complete access.
    robot.device_mut().on_bus = false;
    cycle(&mut robot, None);
    robot.device_mut().on_bus = true;
    cycle(&mut robot, None);
    assert_eq!(robot.check_transition(pre_op, safe_op), refused);
    dialogue(
        &mut robot,
        &[
            ("00 20 33 12 1C 00 01 00 00 16", "00 30 70 12 1C 00 00 00 00 00"),
            ("00 20 33 13 1C 00 01 00 00 1A", "00 30 70 13 1C 00 00 00 00 00"),
        ],
    );
    assert_eq!(robot.check_transition(pre_op, safe_op), Ok(()));
}

fn virtual_robot(settings: Meca500Settings) -> Meca500Application<VirtualRobot> {
    let robot = VirtualRobot::new(RobotSettings {
        bus: CyclicBus::EtherCat,
        byte_order: ByteOrder::LITTLE,
        joints: [10.0, -20.0, 30.0, 40.0, 50.0, -60.0],
        homed: true,
        ..RobotSettings::default()
    });
    Meca500Application::new(robot, settings)
}

/// Sends the assigned `outputs` for so many milliseconds from `from` on; returns the last inputs.
fn live(
    robot: &mut Meca500Application<VirtualRobot>,
    from: u64,
    cycles: u64,
    outputs: &[u8],
) -> Vec<u8> {
    let mut inputs = vec![0; robot.input_len()];
    for ms in from..from + cycles {
        robot.cycle(Instant::from_millis(ms), Some(outputs), &mut inputs);
    }
    inputs
}

#[test]
fn without_1a08_every_value_is_found_by_name_four_bytes_earlier() {
    let mut outputs = OutputImage::<Little>::zeroed();
    outputs.robot_control.flags.assign(RobotControlFlags::ACTIVATE_ROBOT, true);
    outputs.dynamic_data_configuration.dynamic_data_type_id[3].set(2);

    let mut whole = virtual_robot(Meca500Settings::default());
    let reference = live(&mut whole, 1, 500, outputs.as_bytes());
    let image = InputImage::<Little>::from_bytes(&reference).unwrap();
    assert_eq!(
        image.target_joint_set.joint.map(|joint| joint.get().round()),
        [10.0, -20.0, 30.0, 40.0, 50.0, -60.0]
    );

    let mut short = virtual_robot(Meca500Settings::default());
    assign(&mut short, 0x1C13, WITHOUT_CONFIGURATION);
    let inputs = live(&mut short, 1, 500, outputs.as_bytes());
    assert_eq!(inputs.len(), 248);

    let mut compared = 0;
    for field in INPUT_FIELDS.iter().filter(|field| field.pdo != 0x1A08) {
        let mut moved = *field;
        if field.byte_offset >= 68 {
            moved.byte_offset -= 4;
        }
        let expected = field.read(&reference, ByteOrder::LITTLE).unwrap();
        assert_eq!(moved.read(&inputs, ByteOrder::LITTLE), Some(expected), "{}", field.name);
        compared +=
            usize::from(expected != FieldValue::Unsigned(0) && expected != FieldValue::Bool(false));
    }
    assert!(compared > 20, "only {compared} values that say something");
    // The last slot reports what was asked for: product type 4, an R4.
    assert_eq!(inputs[220..228], [2, 0, 0, 0, 0, 0, 0x80, 0x40]);
}

#[test]
fn sdo_reads_live_values_in_the_robots_byte_order() {
    let mut robot = virtual_robot(Meca500Settings::default());
    let mut outputs = OutputImage::<Little>::zeroed();
    live(&mut robot, 1, 2, outputs.as_bytes());
    let activated = "00 20 40 10 60 03 00 00 00 00";
    dialogue(
        &mut robot,
        &[
            // FifoSpace: 13000, as C8 32.
            ("00 20 40 15 60 04 00 00 00 00", "00 30 4B 15 60 04 C8 32 00 00"),
            // Joint 1: 10.0.
            ("00 20 40 30 60 01 00 00 00 00", "00 30 43 30 60 01 00 00 20 41"),
            (activated, "00 30 4F 10 60 03 00 00 00 00"),
        ],
    );
    outputs.robot_control.flags.assign(RobotControlFlags::ACTIVATE_ROBOT, true);
    live(&mut robot, 3, 1_000, outputs.as_bytes());
    dialogue(&mut robot, &[(activated, "00 30 4F 10 60 03 01 00 00 00")]);
}

#[test]
fn disable_ethercat_leaves_the_bus() {
    let mut robot = virtual_robot(Meca500Settings::default());
    let mut outputs = OutputImage::<Little>::zeroed();
    live(&mut robot, 1, 10, outputs.as_bytes());
    assert!(robot.is_on_bus());
    outputs.robot_control.flags.assign(RobotControlFlags::DISABLE_ETHERCAT, true);
    live(&mut robot, 11, 10_000, outputs.as_bytes());
    assert!(!robot.is_on_bus());
}
