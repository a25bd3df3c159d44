//! MoveID, SetPoint, MotionCommandID: what is taken, and what is returned.
#![cfg(feature = "sim")]

mod sim_support;

use fieldarm::sim::meca500::RobotEvent;
use fieldarm::sim::meca500::readings::*;
use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::image::{MotionControlFlags, RobotControlFlags};
use sim_support::Cell;

const SET_POINT: MotionControlFlags = MotionControlFlags::SET_POINT;

#[test]
fn a_stream_is_accepted_at_one_command_a_cycle() {
    let mut cell = Cell::ready();
    for n in 1..=500 {
        cell.sent(17, &[f32::from(n as u16)]);
    }
    cell.until("all", |cell| cell.reached() == 500);
    let reached: Vec<_> = cell
        .events()
        .into_iter()
        .filter_map(|event| match event {
            RobotEvent::CheckpointReached(n) => Some(n),
            _ => None,
        })
        .collect();
    assert_eq!(reached, (1..=500).collect::<Vec<_>>());
}

#[test]
fn nothing_is_looked_at_while_set_point_is_0() {
    let mut cell = Cell::ready();
    let before = cell.echo();
    cell.write_with(900, 1, &[20.0]);
    cell.motion(SET_POINT, false);
    cell.cycles(100);
    assert_eq!(cell.echo(), before);
    assert!(cell.is_at([0.0; 6]));
}

#[test]
fn the_same_move_id_sends_a_command_once() {
    let mut cell = Cell::ready();
    cell.write_with(7, 29, &[5.0]);
    cell.cycles(1000);
    assert_eq!(cell.echo(), 7);
    assert!(cell.is_at([5.0, 0.0, 0.0, 0.0, 0.0, 0.0]), "{:?}", cell.joints());
    cell.write_with(7, 29, &[9.0]);
    cell.cycles(1000);
    assert!(cell.is_at([5.0, 0.0, 0.0, 0.0, 0.0, 0.0]), "changed arguments send nothing");
}

#[test]
fn the_first_command_is_triggered_as_the_reading_says() {
    // MoveID changes before SetPoint, with it, or after it.
    for (reading, expected) in [
        (MoveIdTrigger::LastAccepted, [true, true, true]),
        (MoveIdTrigger::PreviousCycle, [false, true, true]),
        (MoveIdTrigger::PreviousCycleWithSetPoint, [false, false, true]),
    ] {
        for (order, expected) in expected.into_iter().enumerate() {
            let mut cell = Cell::ready_with(|settings| {
                settings.readings.move_id_trigger = reading;
                settings.readings.configuration_without_move_id =
                    ConfigurationWithoutMoveId::Ignored;
            });
            match order {
                0 => {
                    cell.write_with(5, 17, &[3.0]);
                    cell.motion(SET_POINT, false);
                    cell.cycle();
                    cell.motion(SET_POINT, true);
                }
                1 => cell.write_with(5, 17, &[3.0]),
                _ => {
                    cell.write_with(0, 17, &[3.0]);
                    cell.cycle();
                    cell.write_with(5, 17, &[3.0]);
                }
            }
            cell.cycles(3);
            assert_eq!(cell.echo() == 5, expected, "{reading:?}, order {order}");
            assert_eq!(cell.reached() == 3, expected);
        }
    }
}

#[test]
fn the_echo_over_a_reconnection_follows_the_readings() {
    for (echo, shown) in [
        (EchoAtConnection::Kept, 9),
        (EchoAtConnection::Zero, 0),
        (EchoAtConnection::Arbitrary, 0xA5C3),
    ] {
        for (memory, is_new) in [(MoveIdMemory::Kept, false), (MoveIdMemory::Forgotten, true)] {
            let mut cell = Cell::ready_with(|settings| {
                settings.readings.echo_at_connection = echo;
                settings.readings.move_id_memory = memory;
            });
            cell.write_with(9, 17, &[1.0]);
            cell.cycle();
            cell.motion(SET_POINT, false);
            cell.lost_cycle();
            cell.cycle();
            assert_eq!(cell.echo(), shown);
            cell.write_with(9, 17, &[2.0]);
            cell.cycles(3);
            assert_eq!(cell.reached() == 2, is_new, "{echo:?} {memory:?}");
        }
    }
}

#[test]
fn the_echo_in_cyclic_mode_follows_the_reading() {
    for (reading, expected) in [(EchoInCyclicMode::Kept, 9), (EchoInCyclicMode::Zero, 0)] {
        let mut cell = Cell::ready_with(|settings| settings.readings.echo_in_cyclic_mode = reading);
        cell.write_with(9, 17, &[1.0]);
        cell.cycle();
        cell.write_with(0, 21, &[0.0]);
        cell.cycles(2);
        assert_eq!(cell.echo(), expected);
    }
}

#[test]
fn a_move_with_move_id_0_floods_the_queue() {
    let mut cell = Cell::ready();
    cell.sent(6, &[100.0]);
    cell.write_with(0, 1, &[5.0]);
    cell.cycles(1000);
    assert!(cell.fifo_space() <= 12_001, "{}", cell.fifo_space());
    cell.cycles(13_000);
    assert_eq!(cell.fifo_space(), 0);
}

#[test]
fn a_configuration_command_with_move_id_0_follows_the_reading() {
    for (reading, repeats) in [
        (ConfigurationWithoutMoveId::EachCycle, true),
        (ConfigurationWithoutMoveId::Ignored, false),
    ] {
        let mut cell =
            Cell::ready_with(|settings| settings.readings.configuration_without_move_id = reading);
        cell.write_with(0, 48, &[50.0]);
        cell.cycles(2);
        assert_eq!(cell.read(54)[0] == 50.0, repeats);
    }
}

#[test]
fn a_velocity_command_with_a_move_id_follows_the_reading() {
    for (reading, moves) in
        [(VelocityWithMoveId::RunsForTimeout, true), (VelocityWithMoveId::Ignored, false)]
    {
        let mut cell =
            Cell::ready_with(|settings| settings.readings.velocity_with_move_id = reading);
        cell.sent(21, &[10.0]);
        cell.cycles(1000);
        assert_eq!(cell.joints()[0] > 0.3, moves, "{:?}", cell.joints());
        assert!(cell.joints()[0] < 0.8, "only for the timeout");
        cell.sent(1, &[5.0]);
        cell.finish(1);
    }
}

#[test]
fn refused_commands_are_answered_as_the_readings_say() {
    for (echo, acknowledged) in
        [(RefusedCommand::Acknowledged, true), (RefusedCommand::NotAcknowledged, false)]
    {
        for code in
            [RefusalCode::Hidden, RefusalCode::ShownForOneCycle, RefusalCode::ShownUntilReset]
        {
            let mut cell = Cell::new(fieldarm::sim::meca500::RobotSettings::default());
            let mut settings = fieldarm::sim::meca500::RobotSettings::default();
            settings.readings.refused_command = echo;
            settings.readings.refusal_code = code;
            cell.robot = fieldarm::sim::meca500::VirtualRobot::new(settings);
            cell.cycle();
            assert_eq!(cell.send(1, &[5.0]), acknowledged);
            let first = cell.error();
            cell.cycle();
            let second = cell.error();
            let expected = match code {
                RefusalCode::Hidden => (0, 0),
                RefusalCode::ShownForOneCycle => (1005, 0),
                RefusalCode::ShownUntilReset => (1005, 1005),
            };
            assert_eq!((first, second), expected);
            cell.control(RobotControlFlags::RESET_ERROR, true);
            cell.cycle();
            assert_eq!(cell.error(), 0);
        }
    }
}

#[test]
fn refusals_have_the_codes_of_the_manual() {
    let mut cell = Cell::new(fieldarm::sim::meca500::RobotSettings::default());
    cell.cycle();
    let refused = |cell: &mut Cell, id: u32, arguments: &[f32]| {
        cell.events();
        cell.send(id, arguments);
        cell.events().into_iter().find_map(|event| match event {
            RobotEvent::Refused(Code(code)) => Some(code),
            _ => None,
        })
    };
    assert_eq!(refused(&mut cell, 1, &[5.0]), Some(1005));
    assert_eq!(refused(&mut cell, 100, &[1.0]), Some(1005));
    cell.activate();
    assert_eq!(refused(&mut cell, 1, &[5.0]), Some(1006));
    assert_eq!(refused(&mut cell, 151, &[1.0]), Some(1026));
    assert_eq!(refused(&mut cell, 1002, &[]), Some(1026));
    cell.home();
    for (id, arguments) in [
        (7, &[101.0][..]),
        (8, &[0.0]),
        (15, &[0.0, 1.0, 1.0]),
        (17, &[0.0]),
        (17, &[8001.0]),
        (24, &[1.5]),
        (1, &[f32::NAN]),
        (2, &[f32::INFINITY]),
        (6, &[-1.0]),
        (28, &[3.0, 2.0]),
        (48, &[100.1]),
    ] {
        assert_eq!(refused(&mut cell, id, arguments), Some(1003), "{id} {arguments:?}");
    }
    for id in (34..=47).chain([52, 59, 61, 99, 1001, 9_999, 20_000, u32::MAX]) {
        assert_eq!(refused(&mut cell, id, &[1.0]), Some(1001), "{id}");
    }
    assert_eq!(refused(&mut cell, 18, &[1.0]), Some(1038));
    assert_eq!(refused(&mut cell, 32, &[1.0]), Some(1038));
    assert_eq!(refused(&mut cell, 30, &[1.0, 1.0]), Some(1041));
    assert_eq!(refused(&mut cell, 100, &[5.0]), Some(3017));
    assert_eq!(cell.error(), 0, "a refusal is no error mode");
}

#[test]
fn a_refusal_starts_error_mode_only_under_that_reading() {
    let mut cell =
        Cell::ready_with(|settings| settings.readings.refusal = Refusal::StartsErrorMode);
    cell.send(7, &[200.0]);
    assert_eq!(cell.error(), 1003);
    cell.reset_error();
    cell.resume();
    cell.sent(1, &[5.0]);
    cell.finish(1);
}

#[test]
fn no_movement_is_acknowledged_as_the_reading_says() {
    for (reading, acknowledged) in
        [(NoMovementCommand::Acknowledged, true), (NoMovementCommand::NotAcknowledged, false)]
    {
        let mut cell = Cell::ready_with(|settings| settings.readings.no_movement = reading);
        assert_eq!(cell.send(0, &[1.0, 2.0]), acknowledged);
        cell.cycles(10);
        assert!(cell.is_at([0.0; 6]));
        cell.sent(17, &[5.0]);
    }
}

#[test]
fn extra_arguments_are_ignored() {
    let mut cell = Cell::ready();
    cell.sent(7, &[40.0, f32::NAN, 1e9, -7.0, 3.0, 2.0]);
    cell.finish(1);
    assert_eq!(cell.read(21)[0], 40.0);
}

#[test]
fn without_outputs_nothing_changes() {
    let mut cell = Cell::ready();
    cell.sent(1, &[5.0]);
    cell.finish(1);
    for _ in 0..100 {
        cell.lost_cycle();
    }
    assert!(cell.is_at([5.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
    assert_eq!(cell.reached(), 1);
}
