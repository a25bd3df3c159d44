//! Variables and offline programs.
#![cfg(feature = "sim")]

mod sim_support;

use fieldarm::sim::meca500::readings::*;
use fieldarm::sim::meca500::{CyclicBus, RobotEvent, StoreError};
use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::command::MotionCommand;
use fieldarm::wire::meca500::image::MotionControlFlags;
use sim_support::Cell;

const USE_VARIABLES: MotionControlFlags = MotionControlFlags::USE_VARIABLES;

fn cell_with(change: impl FnOnce(&mut Readings)) -> Cell {
    let mut cell = Cell::ready_with(|settings| change(&mut settings.readings));
    cell.robot.create_variable(10_000, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).expect("free");
    cell.robot.create_variable(10_001, &[0.0]).expect("free");
    cell.robot.create_variable(10_002, &[10.0, 20.0]).expect("free");
    cell.robot.create_variable(10_003, &[0.0; 8]).expect("free");
    cell
}

#[test]
fn variables_are_set_by_their_id_and_read_as_dynamic_types() {
    let mut cell = cell_with(|_| {});
    cell.sent(10_001, &[42.0, 9.0, 9.0]);
    assert_eq!(cell.read(10_001), [42.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    cell.sent(10_002, &[7.0, 8.0, 9.0]);
    assert_eq!(cell.read(10_002)[..3], [7.0, 8.0, 0.0], "the size never changes");
    assert_eq!(cell.robot.variable(10_002), Some(&[7.0, 8.0][..]));
    for id in [10_500, 10_003] {
        cell.events();
        cell.send(id, &[1.0]);
        assert!(cell.events().contains(&RobotEvent::Refused(Code::SET_VARIABLE_FAILED)), "{id}");
    }
}

#[test]
fn variables_may_be_created_set_read_and_deleted_in_any_state() {
    for (state, mut cell) in sim_support::cells_in_many_states() {
        cell.robot.create_variable(10_001, &[0.0]).expect("free");
        cell.sent(10_001, &[42.0]);
        cell.cycle();
        assert_eq!(cell.robot.variable(10_001), Some(&[42.0][..]), "{state}");
        assert_eq!(cell.read(10_001)[0], 42.0, "{state}");
        assert_eq!(cell.robot.set_variable(10_001, &[43.0]), Ok(()), "{state}");
        assert!(cell.robot.delete_variable(10_001), "{state}");
        assert_eq!(cell.robot.variable(10_001), None, "{state}");
    }
}

#[test]
fn variables_survive_a_reboot() {
    let mut cell = cell_with(|_| {});
    cell.deactivate();
    cell.sent(10_001, &[42.0]);
    cell.write(200, &[]);
    cell.cycle();
    cell.motion(MotionControlFlags::SET_POINT, false);
    cell.until("booted", |cell| cell.robot.is_online());
    assert_eq!(cell.read(10_001)[0], 42.0);
}

#[test]
fn cyclic_ids_are_unique_and_in_range() {
    let mut cell = cell_with(|_| {});
    assert_eq!(cell.robot.create_variable(9_999, &[1.0]), Err(StoreError::CyclicId(9_999)));
    assert_eq!(cell.robot.create_variable(20_000, &[1.0]), Err(StoreError::CyclicId(20_000)));
    assert_eq!(cell.robot.create_variable(10_001, &[1.0]), Err(StoreError::Taken(10_001)));
    let wrong = StoreError::Size { expected: 2, found: 1 };
    assert_eq!(cell.robot.set_variable(10_002, &[1.0]), Err(wrong));
    assert!(cell.robot.delete_variable(10_002));
    assert_eq!(cell.robot.set_variable(10_002, &[1.0]), Err(StoreError::NoVariable(10_002)));
}

#[test]
fn setting_a_variable_is_immediate_or_queued() {
    for (reading, waits) in [(SetVariableClass::Immediate, false), (SetVariableClass::Queued, true)]
    {
        let mut cell = cell_with(|readings| readings.set_variable = reading);
        cell.sent(6, &[1.0]);
        cell.sent(10_001, &[42.0]);
        cell.cycles(10);
        assert_eq!(cell.robot.variable(10_001) == Some(&[0.0][..]), waits);
        cell.cycles(1100);
        assert_eq!(cell.robot.variable(10_001), Some(&[42.0][..]));
    }
}

#[test]
fn use_variables_takes_the_values_in_place_of_the_ids() {
    let mut cell = cell_with(|_| {});
    cell.motion(USE_VARIABLES, true);
    cell.sent(1, &[10_000.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    cell.motion(USE_VARIABLES, false);
    cell.finish(1);
    assert!(cell.is_at([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
    cell.motion(USE_VARIABLES, true);
    cell.sent(1, &[10_002.0, 10_001.0, 10_002.0]);
    cell.motion(USE_VARIABLES, false);
    cell.finish(2);
    assert!(cell.is_at([10.0, 20.0, 0.0, 10.0, 20.0, 0.0]), "{:?}", cell.joints());
    cell.motion(USE_VARIABLES, true);
    cell.events();
    cell.send(1, &[10_777.0]);
    assert!(cell.events().contains(&RobotEvent::Refused(Code::ARGUMENT_ERROR)));
}

#[test]
fn zeros_and_too_many_values_follow_the_readings() {
    for (reading, expected) in [
        (ZeroVariableId::EndsList, [10.0, 20.0, 0.0, 0.0, 0.0, 0.0]),
        (ZeroVariableId::Skipped, [10.0, 20.0, 10.0, 20.0, 0.0, 0.0]),
        (ZeroVariableId::IsZero, [10.0, 20.0, 0.0, 10.0, 20.0, 0.0]),
    ] {
        let mut cell = cell_with(|readings| readings.zero_variable_id = reading);
        cell.motion(USE_VARIABLES, true);
        cell.sent(1, &[10_002.0, 0.0, 10_002.0]);
        cell.motion(USE_VARIABLES, false);
        cell.finish(1);
        assert!(cell.is_at(expected), "{reading:?} {:?}", cell.joints());
    }
    for (reading, moves) in [(TooManyValues::Cut, true), (TooManyValues::Refused, false)] {
        let mut cell = cell_with(|readings| readings.too_many_values = reading);
        cell.motion(USE_VARIABLES, true);
        cell.send(1, &[10_000.0, 10_001.0]);
        cell.motion(USE_VARIABLES, false);
        cell.finish(1);
        assert_eq!(cell.is_at([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]), moves);
    }
}

#[test]
fn use_variables_on_ethercat_follows_the_reading() {
    for reading in [
        UseVariablesOnEtherCat::Ignored,
        UseVariablesOnEtherCat::Refused,
        UseVariablesOnEtherCat::Works,
    ] {
        let mut cell = Cell::ready_with(|settings| {
            settings.bus = CyclicBus::EtherCat;
            settings.readings.use_variables_on_ethercat = reading;
        });
        cell.robot.create_variable(10_000, &[5.0]).expect("free");
        cell.motion(USE_VARIABLES, true);
        cell.send(1, &[10_000.0]);
        cell.cycles(500);
        match reading {
            UseVariablesOnEtherCat::Ignored => assert_eq!(cell.error(), 1007),
            UseVariablesOnEtherCat::Refused => assert!(cell.is_at([0.0; 6])),
            UseVariablesOnEtherCat::Works => {
                assert!(cell.is_at([5.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
            }
        }
    }
}

fn program() -> Vec<MotionCommand> {
    vec![
        MotionCommand::MoveJoints([10.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        MotionCommand::SetTimeScaling(100.0),
        MotionCommand::SetCheckpoint(100),
        MotionCommand::Delay(0.2),
    ]
}

#[test]
fn a_program_runs_once_and_is_reported_while_it_runs() {
    for reading in [StartProgramClass::Immediate, StartProgramClass::Queued] {
        let mut cell = cell_with(|readings| readings.start_program = reading);
        cell.robot.save_program(12, program()).expect("a good number");
        cell.sent(100, &[12.0]);
        cell.cycles(3);
        assert_eq!(cell.inputs.motion_status.offline_program_id.get(), 12);
        cell.until("its checkpoint", |cell| cell.reached() == 100);
        assert_eq!(cell.inputs.motion_status.offline_program_id.get(), 12, "still in its delay");
        cell.until("its end", |cell| cell.inputs.motion_status.offline_program_id.get() == 0);
        assert!(cell.is_at([10.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
        let events = cell.events();
        assert!(events.contains(&RobotEvent::ProgramStarted(12)));
        assert!(events.contains(&RobotEvent::ProgramEnded(12)));
    }
}

#[test]
fn start_program_is_immediate_or_queued() {
    for (reading, space) in
        [(StartProgramClass::Immediate, 12_996), (StartProgramClass::Queued, 12_999)]
    {
        let mut cell = cell_with(|readings| readings.start_program = reading);
        cell.robot.save_program(12, program()).expect("a good number");
        cell.motion(MotionControlFlags::PAUSE_MOTION, true);
        cell.cycles(2);
        cell.sent(100, &[12.0]);
        assert_eq!(cell.fifo_space(), space);
    }
}

#[test]
fn missing_and_invalid_programs_have_their_codes() {
    let mut cell = cell_with(|_| {});
    cell.robot.save_program(3, vec![MotionCommand::RebootRobot]).expect("a good number");
    for (number, code) in [(2.0, 3017), (3.0, 3020)] {
        cell.events();
        cell.send(100, &[number]);
        assert!(cell.events().contains(&RobotEvent::Refused(Code(code))));
    }
    assert_eq!(cell.robot.panel().press_start(), Err(Code::NO_OFFLINE_PROGRAM));
    cell.robot.save_program(1, program()).expect("a good number");
    assert_eq!(cell.robot.panel().press_start(), Ok(()));
    cell.until("its checkpoint", |cell| cell.reached() == 100);
    assert_eq!(cell.robot.save_program(501, Vec::new()), Err(StoreError::ProgramNumber(501)));
    let long = vec![MotionCommand::Delay(0.0); 13_001];
    assert_eq!(cell.robot.save_program(1, long), Err(StoreError::ProgramSize(13_001)));
}

#[test]
fn the_start_button_repeats_program_1_when_it_shall_loop_and_start_program_does_not() {
    for loops in [false, true] {
        let mut cell = cell_with(|_| {});
        cell.robot.persistent_mut().offline_program_loop = loops;
        cell.robot.save_program(1, program()).expect("a good number");
        let runs = |cell: &mut Cell| {
            cell.cycles(5_000);
            let started = |event: &RobotEvent| *event == RobotEvent::ProgramStarted(1);
            cell.events().iter().filter(|event| started(event)).count()
        };
        cell.sent(100, &[1.0]);
        assert_eq!(runs(&mut cell), 1, "StartProgram executes it once");
        assert_eq!(cell.robot.panel().press_start(), Ok(()));
        let many = runs(&mut cell);
        assert_eq!(many > 10, loops, "{many}");
        assert!(many > 0);
        cell.motion(MotionControlFlags::CLEAR_MOTION, true);
        cell.cycles(100);
        cell.motion(MotionControlFlags::CLEAR_MOTION, false);
        cell.resume();
        cell.events();
        assert_eq!(runs(&mut cell), 0, "clearing ends the repetition");
    }
}

#[test]
fn clearing_ends_a_program() {
    let mut cell = cell_with(|_| {});
    cell.robot.save_program(12, program()).expect("a good number");
    cell.sent(100, &[12.0]);
    cell.cycles(50);
    cell.motion(MotionControlFlags::CLEAR_MOTION, true);
    cell.cycles(3);
    assert_eq!(cell.inputs.motion_status.offline_program_id.get(), 0);
    assert_eq!(cell.discarded(), 100);
}
