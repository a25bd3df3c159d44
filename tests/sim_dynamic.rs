//! The four dynamic slots.
#![cfg(feature = "sim")]

mod sim_support;

use std::collections::BTreeSet;

use fieldarm::cycle::CyclicDevice;
use fieldarm::sim::meca500::readings::*;
use fieldarm::sim::meca500::{FittedTool, RobotSettings, VirtualRobot};
use fieldarm::time::Instant;
use fieldarm::wire::meca500::image::InputImage;
use fieldarm::wire::order::{ByteOrder, Little};
use sim_support::Cell;

fn cell_with(change: impl FnOnce(&mut Readings)) -> Cell {
    let mut settings = RobotSettings::default();
    change(&mut settings.readings);
    let mut cell = Cell::new(settings);
    cell.robot.create_variable(10_005, &[7.5]).expect("free");
    cell.cycle();
    cell
}

#[test]
fn a_change_takes_one_cycle_or_two_and_the_slot_says_what_it_shows() {
    for (reading, cycles) in [(DynamicDelay::OneCycle, 1), (DynamicDelay::TwoCycles, 2)] {
        let mut cell = cell_with(|readings| readings.dynamic_delay = reading);
        cell.request([54, 21, 2, 19]);
        cell.cycles(5);
        cell.request([2, 2, 2, 2]);
        cell.cycle();
        for _ in 0..cycles {
            assert_eq!(cell.dynamic(0), (54, [100.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
            cell.cycle();
        }
        assert_eq!(cell.dynamic(0), (2, [4.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
    }
}

#[test]
fn slots_are_independent() {
    let mut cell = cell_with(|_| {});
    cell.request([54, 21, 2, 29]);
    cell.cycles(5);
    let types: Vec<u32> = (0..4).map(|slot| cell.dynamic(slot).0).collect();
    assert_eq!(types, [54, 21, 2, 29]);
    assert_eq!(cell.dynamic(3).1[..3], [0.0, 4.0, 3.0]);
}

/// Types seen in a slot during `cycles`, in their order.
fn rotation(cell: &mut Cell, cycles: u32) -> Vec<[u32; 4]> {
    (0..cycles)
        .map(|_| {
            cell.cycle();
            [0, 1, 2, 3].map(|slot| cell.dynamic(slot).0)
        })
        .collect()
}

#[test]
fn automatic_slots_go_through_all_types_and_count_rotations() {
    let mut cell = cell_with(|_| {});
    cell.request([0, 54, 54, 54]);
    cell.cycles(5);
    let before = cell.inputs.robot_timestamp.values().dynamic_data_cycles;
    let seen: Vec<u32> = rotation(&mut cell, 200).into_iter().map(|slots| slots[0]).collect();
    let all: BTreeSet<u32> = seen.iter().copied().collect();
    assert!(!all.contains(&0) && !all.contains(&26) && !all.contains(&5) && !all.contains(&10_005));
    for ty in [1, 2, 3, 11, 22, 34, 46, 53, 62] {
        assert!(all.contains(&ty), "{ty}");
    }
    assert!(seen.windows(2).all(|pair| pair[0] != pair[1]), "a different type each cycle");
    let rotations = cell.inputs.robot_timestamp.values().dynamic_data_cycles - before;
    let expected = 200 / u32::try_from(all.len()).expect("few");
    assert!(rotations.abs_diff(expected) <= 1, "{rotations} {expected}");
    cell.request([54; 4]);
    cell.cycles(3);
    let fixed = cell.inputs.robot_timestamp.values().dynamic_data_cycles;
    cell.cycles(500);
    assert_eq!(cell.inputs.robot_timestamp.values().dynamic_data_cycles, fixed);
}

#[test]
fn several_automatic_slots_share_or_rotate_together() {
    let mut cell = cell_with(|_| {});
    let shared = rotation(&mut cell, 5);
    assert!(shared.iter().all(|slots| BTreeSet::from(*slots).len() == 4));
    let mut cell = cell_with(|readings| readings.automatic_slots = AutomaticSlots::Together);
    let together = rotation(&mut cell, 5);
    assert!(together.iter().all(|slots| BTreeSet::from(*slots).len() == 1));
}

#[test]
fn variables_and_missing_types_take_part_as_the_readings_say() {
    let mut cell = cell_with(|readings| {
        readings.variables_in_rotation = VariablesInRotation::Present;
        readings.unavailable_in_rotation = UnavailableInRotation::Present;
    });
    let all: BTreeSet<u32> = rotation(&mut cell, 100).into_iter().flatten().collect();
    assert!([5, 26, 27, 72, 73, 10_005].iter().all(|ty| all.contains(ty)));
}

#[test]
fn an_unknown_type_follows_the_reading() {
    for reading in [
        UnknownDynamicType::EchoedWithZeros,
        UnknownDynamicType::KeepsPrevious,
        UnknownDynamicType::Automatic,
    ] {
        let mut cell = cell_with(|readings| readings.unknown_dynamic_type = reading);
        cell.request([54; 4]);
        cell.cycles(5);
        cell.request([999; 4]);
        cell.cycles(3);
        let (ty, values) = cell.dynamic(0);
        match reading {
            UnknownDynamicType::EchoedWithZeros => assert_eq!((ty, values), (999, [0.0; 6])),
            UnknownDynamicType::KeepsPrevious => assert_eq!((ty, values[0]), (54, 100.0)),
            UnknownDynamicType::Automatic => assert!(ty != 999 && ty != 0),
        }
    }
}

#[test]
fn identity_types_say_who_the_robot_is() {
    let mut cell =
        Cell::new(RobotSettings { serial_number: 4_294_967_001, ..RobotSettings::default() });
    assert_eq!(cell.read(1), [11.0, 3.0, 84.0, 0.0, 0.0, 0.0]);
    assert_eq!(cell.read(2)[0], 4.0);
    let serial = cell.read(3);
    assert_eq!(serial[1].to_bits(), 4_294_967_001, "the integer, laid over the Real");
    assert_eq!(serial[0], 4_294_967_001_u32 as f32);
}

#[test]
fn queue_parameters_are_reported_with_their_defaults() {
    let mut cell = cell_with(|_| {});
    for (ty, expected) in [
        (11, [0.0; 6]),
        (17, [4.0, 1.0, 0.0, 0.0, 0.0, 0.0]),
        (19, [0.0; 6]),
        (21, [100.0, 0.05, 0.0, 0.0, 0.0, 0.0]),
        (22, [25.0, 100.0, 150.0, 45.0, 50.0, 100.0]),
        (24, [0.0, 2.0, 0.0, 0.0, 0.0, 0.0]),
        (25, [100.0; 6]),
        (29, [0.0, 4.0, 3.0, 0.0, 0.0, 0.0]),
        (30, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        (31, [0.0; 6]),
        (36, [4.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        (54, [100.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    ] {
        assert_eq!(cell.read(ty), expected, "{ty}");
    }
    assert!(cell.read(20)[..4].iter().all(|value| value.is_nan()));
}

#[test]
fn payload_is_queued_and_reported_and_changes_the_torque() {
    let mut cell = Cell::ready();
    let before = cell.read(33)[1];
    cell.sent(60, &[0.5, 0.0, 0.0, 20.0]);
    cell.finish(1);
    assert_eq!(cell.read(31)[..4], [0.5, 0.0, 0.0, 20.0]);
    assert!((cell.read(33)[1] - before).abs() > 1.0);
}

#[test]
fn before_homing_positions_are_less_accurate_or_zero() {
    let mut cell = cell_with(|_| {});
    assert!((cell.read(40)[0] - cell.joints()[0]).abs() > 0.1);
    cell.activate();
    cell.home();
    assert!((cell.read(40)[0] - cell.joints()[0]).abs() < 1e-6);
    assert!(sim_support::close(cell.read(41), cell.pose(), 1e-3));
    assert_eq!(cell.read(45)[..4], [1.0, 1.0, 0.0, 0.0]);
    let mut cell = cell_with(|readings| readings.dynamic_before_homing = DynamicBeforeHoming::Zero);
    assert_eq!(cell.read(40), [0.0; 6]);
    assert_eq!(cell.read(46), [0.0; 6]);
}

#[test]
fn velocities_of_joints_and_tool_are_reported_while_moving() {
    let mut cell = Cell::ready();
    cell.sent(1, &[60.0]);
    cell.cycles(800);
    let joint = cell.read(42)[0];
    assert!((joint - 37.5).abs() < 0.1, "{joint}");
    let tool = cell.read(44);
    let speed = (tool[0] * tool[0] + tool[1] * tool[1]).sqrt();
    assert!((speed - 37.5_f32.to_radians() * 190.0).abs() < 1.0, "{tool:?}");
    assert!((tool[5] - 37.5).abs() < 0.1);
}

#[test]
fn the_accelerometer_feels_gravity() {
    let mut cell = Cell::ready();
    let values = cell.read(46);
    let size = values.iter().map(|value| value * value).sum::<f32>().sqrt();
    assert!((size - 16_000.0).abs() < 1.0, "{values:?}");
}

#[test]
fn type_52_names_the_emulated_or_the_fitted_tool() {
    for (reading, expected) in [(ExternalToolType::Emulated, 10.0), (ExternalToolType::Fitted, 0.0)]
    {
        let mut cell = cell_with(|readings| readings.external_tool_type = reading);
        assert_eq!(cell.robot.set_simulation(true), Ok(()));
        let bits = fieldarm::wire::meca500::image::RobotControlFlags::ACTIVATE_SIM;
        cell.control(bits, true);
        assert_eq!(cell.read(52)[0], expected);
    }
    let mut cell =
        Cell::new(RobotSettings { tool: FittedTool::Megp25Ls, ..RobotSettings::default() });
    assert_eq!(cell.read(52)[..2], [11.0, 0.0]);
}

#[test]
fn the_images_follow_the_byte_order_of_the_settings() {
    for order in ByteOrder::ALL {
        let mut robot =
            VirtualRobot::new(RobotSettings { byte_order: order, ..RobotSettings::default() });
        let mut inputs = [0; 252];
        robot.cycle(Instant::from_millis(1), Some(&[0; 60]), &mut inputs);
        assert_eq!(order.integers.u16([inputs[10], inputs[11]]), 13_000);
        let x = order.reals.u32([inputs[40], inputs[41], inputs[42], inputs[43]]);
        assert!((f32::from_bits(x) - 190.0).abs() < 1e-3);
    }
    let mut robot = VirtualRobot::new(RobotSettings {
        byte_order: ByteOrder::LITTLE,
        ..RobotSettings::default()
    });
    let mut inputs = [0; 252];
    robot.cycle(Instant::from_millis(1), Some(&[0; 60]), &mut inputs);
    let image = InputImage::<Little>::from_bytes(&inputs).expect("252 bytes");
    assert_eq!(image.motion_status.fifo_space.get(), 13_000);
}
