//! Motion commands against the table typed from the manual, their ranges at the edges, and their
//! way over the wire.

use fieldarm::wire::meca500::command::{
    ArgumentRange, COMMANDS, CommandError, CommandKind, CommandSpec, Conf, ConfSign, GripperAction,
    MODEL_JOINT_LIMITS, MotionCommand, MotionCommandId, Pose, Requirement, Unit, ValveAction,
    VelocityCommand, WorkZoneLimits,
};
use fieldarm::wire::meca500::revision::Revision;
use proptest::prelude::*;
use std::collections::HashMap;

type Row = HashMap<String, String>;

fn rows() -> Vec<Row> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/spec/meca500_motion_commands.csv");
    csv::Reader::from_path(path).unwrap().deserialize().map(Result::unwrap).collect()
}

const BOTH: [Revision; 2] = [Revision::R3, Revision::R4];

/// Bounds decided by this crate where the manual states none, or states them in words; see the
/// head of `command/table.rs`.
fn decided_bounds(command: &str, argument: &str) -> Option<(Option<f32>, Option<f32>)> {
    Some(match (command, argument) {
        ("Delay", "t") => (Some(0.0), None),
        ("StartProgram", "program") => (Some(1.0), Some(500.0)),
        ("SetGripperVel", "p") => (Some(5.0), Some(200.0)),
        ("MoveGripper", "d") => (Some(0.0), Some(48.0)),
        _ => return None,
    })
}

fn bound(cell: &str, revision: Revision) -> Option<f32> {
    if cell.is_empty() {
        return None;
    }
    if let Some((r3, r4)) = cell.split_once(';') {
        let (part, prefix) = match revision {
            Revision::R3 => (r3, "R3:"),
            Revision::R4 => (r4, "R4:"),
        };
        return Some(part.strip_prefix(prefix).unwrap().parse().unwrap());
    }
    Some(cell.parse().unwrap_or_else(|_| panic!("bound {cell}")))
}

fn unit_of(cell: &str) -> Unit {
    match cell {
        "deg" => Unit::Degree,
        "deg/s" => Unit::DegreePerSecond,
        "mm" => Unit::Millimetre,
        "mm/s" => Unit::MillimetrePerSecond,
        "%" => Unit::Percent,
        "s" => Unit::Second,
        "kg" => Unit::Kilogram,
        _ => Unit::None,
    }
}

fn choices_of(cell: &str) -> Option<Vec<(i16, String)>> {
    let inner = cell.strip_prefix("enum{")?.strip_suffix('}')?;
    Some(
        inner
            .split(',')
            .map(|part| match part.split_once('=') {
                Some((value, meaning)) => (value.parse().unwrap(), meaning.to_owned()),
                None => (part.parse().unwrap(), String::new()),
            })
            .collect(),
    )
}

#[test]
fn every_row_of_the_table_is_in_commands_and_nothing_else() {
    let rows = rows();
    assert_eq!(rows.len(), 64);
    assert_eq!(COMMANDS.len(), rows.len());
    for (spec, row) in COMMANDS.iter().zip(&rows) {
        let ids = match row["id"].split_once('-') {
            Some((first, last)) => (first.parse().unwrap(), last.parse().unwrap()),
            None => (row["id"].parse().unwrap(), row["id"].parse().unwrap()),
        };
        assert_eq!((spec.id.0, spec.last_id.0), ids);
        let unnamed = ["NoMovement", "Gripper", "ClearHoming", "SetVariable"];
        if !unnamed.contains(&spec.name) {
            assert_eq!(spec.name, row["name"]);
        }
        assert_eq!(spec.available, row["meca500_available"] == "yes", "{}", spec.name);
        let kind = match row["kind"].as_str() {
            "none" => CommandKind::NoMovement,
            "queued" => CommandKind::Queued,
            "instantaneous" => CommandKind::Instantaneous,
            "velocity" => CommandKind::Velocity,
            "variable" => CommandKind::Variable,
            "" => CommandKind::Unknown,
            other => panic!("kind {other}"),
        };
        assert_eq!(spec.kind, kind, "{}", spec.name);
        assert_eq!(spec.persistent, row["persistent"] == "yes", "{}", spec.name);
        let requires = match row["requires"].as_str() {
            "" => Requirement::NotStated,
            "any_state" => Requirement::AnyState,
            "deactivated" => Requirement::Deactivated,
            "activated;homed_or_recovery" => Requirement::ActivatedAndHomed,
            "activated;homed_or_recovery;no_error;no_safety_stop" => Requirement::ReadyForMotion,
            "activated;homed;no_error;no_safety_stop" => Requirement::ReadyAndHomed,
            "to be sent before activating (L3101)" => Requirement::BeforeActivation,
            other => panic!("requires {other}"),
        };
        assert_eq!(spec.requires, requires, "{}", spec.name);
        let line: u16 = match row["chapter_line"].as_str() {
            "" => row["manual_line"].parse().unwrap(),
            line => line.parse().unwrap(),
        };
        assert_eq!(spec.manual_line, line, "{}", spec.name);
        if spec.available {
            let count = spec.argument_count();
            assert_eq!(count.min.to_string(), row["arg_count_min"], "{}", spec.name);
            assert_eq!(count.max.to_string(), row["arg_count_max"], "{}", spec.name);
        } else {
            assert!(spec.arguments.is_empty());
        }
    }
}

#[test]
fn every_argument_has_the_name_unit_range_and_default_of_the_table() {
    let mut compared = 0;
    for (spec, row) in COMMANDS.iter().zip(rows()) {
        for position in 0..6 {
            let cell = |what: &str| row[&format!("arg{}_{what}", position + 1)].as_str();
            let Some(argument) = spec.arguments.get(position) else {
                assert_eq!(cell("name"), "", "{} argument {position}", spec.name);
                continue;
            };
            let label = format!("{} {}", spec.name, argument.name);
            compared += 1;
            assert_eq!(argument.name, cell("name"), "{label}");
            assert_eq!(argument.unit, unit_of(cell("unit")), "{label}");
            for revision in BOTH {
                let expected = decided_bounds(spec.name, argument.name).unwrap_or_else(|| {
                    (bound(cell("min"), revision), bound(cell("max"), revision))
                });
                let range = (argument.range.min(), argument.range.max(revision));
                assert_eq!(range, expected, "{label}");
            }
            if let Some(expected) = choices_of(cell("unit")) {
                let ArgumentRange::OneOf(choices) = argument.range else {
                    panic!("{label} is a choice");
                };
                assert_eq!(choices.len(), expected.len(), "{label}");
                for (choice, (value, meaning)) in choices.iter().zip(expected) {
                    assert_eq!(choice.value, value, "{label}");
                    if !meaning.is_empty() {
                        assert_eq!(choice.meaning, meaning, "{label}");
                    }
                }
            }
            let is_integer = matches!(argument.range, ArgumentRange::Integer { .. });
            assert_eq!(is_integer, cell("unit").starts_with("integer"), "{label}");
            assert_eq!(argument.default, cell("default").parse().ok(), "{label}");
        }
    }
    assert_eq!(compared, 131);
}

#[test]
fn lookup_finds_exactly_the_ids_of_the_table() {
    for id in 0..25_000 {
        let found = CommandSpec::of(MotionCommandId(id));
        let expected =
            COMMANDS.iter().find(|spec| spec.id.0 <= id && id <= spec.last_id.0).map(|s| s.name);
        assert_eq!(found.map(|spec| spec.name), expected, "{id}");
    }
    assert_eq!(CommandSpec::of(MotionCommandId(u32::MAX)), None);
    assert_eq!(CommandSpec::by_name("MoveLin").unwrap().id, MotionCommandId::MOVE_LIN);
    assert_eq!(CommandSpec::by_name("movelin"), None);
}

/// Arguments every command accepts on both revisions.
fn acceptable(spec: &CommandSpec) -> Vec<f32> {
    let mut values: Vec<f32> = spec
        .arguments
        .iter()
        .map(|argument| argument.range.max(Revision::R3).unwrap_or(1.0))
        .collect();
    if spec.id == MotionCommandId::SET_WORK_ZONE_LIMITS {
        values = vec![-1.0, -2.0, -3.0, 1.0, 2.0, 3.0];
    }
    if spec.id == MotionCommandId::SET_JOINT_LIMITS {
        values = vec![6.0, -12.5, 12.5];
    }
    values
}

#[test]
fn every_edge_is_accepted_and_the_next_number_beyond_is_refused() {
    let mut edges = 0;
    for spec in COMMANDS.iter().filter(|spec| spec.available) {
        for (position, argument) in spec.arguments.iter().enumerate() {
            for revision in BOTH {
                let at = |value: f32| {
                    let mut values = acceptable(spec);
                    values[position] = value;
                    MotionCommand::from_arguments(spec.id, &values, revision)
                };
                let bounds = [
                    (argument.range.min(), f32::NEG_INFINITY),
                    (argument.range.max(revision), f32::INFINITY),
                ];
                for (edge, outward) in bounds {
                    let Some(edge) = edge else { continue };
                    edges += 1;
                    let command = at(edge).unwrap_or_else(|e| panic!("{e}"));
                    assert_eq!(command.check(revision), Ok(()));
                    let beyond = if outward > 0.0 { edge.next_up() } else { edge.next_down() };
                    let Err(CommandError::Argument(error)) = at(beyond) else {
                        panic!("{} {} = {beyond}", spec.name, argument.name);
                    };
                    assert_eq!(error.command, spec.name);
                    assert_eq!(error.argument, argument.name);
                    assert_eq!(error.position, position);
                    assert_eq!(error.value, beyond);
                }
            }
        }
    }
    assert!(edges > 150, "{edges}");
}

#[test]
fn nan_and_infinities_are_refused_in_every_argument() {
    for spec in COMMANDS.iter().filter(|spec| spec.available) {
        for (position, argument) in spec.arguments.iter().enumerate() {
            for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let mut values = acceptable(spec);
                values[position] = value;
                let made = MotionCommand::from_arguments(spec.id, &values, Revision::R4);
                let Err(CommandError::Argument(error)) = made else {
                    panic!("{} {} = {value}", spec.name, argument.name);
                };
                assert_eq!((error.command, error.argument), (spec.name, argument.name));

                let mut arguments = [0.0; 6];
                arguments[..values.len()].copy_from_slice(&values);
                assert!(MotionCommand::decode(spec.id, arguments).check(Revision::R4).is_err());
            }
        }
    }
    let arguments = [0.0, 0.0, 0.0, 0.0, 0.0, f32::NAN];
    let raw = MotionCommand::Raw { id: MotionCommandId(77), arguments };
    assert_eq!(
        raw.check(Revision::R3).unwrap_err().to_string(),
        "Raw: argument 6 = NaN, allowed: any finite number"
    );
}

#[test]
fn integers_must_be_whole() {
    let make =
        |n| MotionCommand::from_arguments(MotionCommandId::SET_CHECKPOINT, &[n], Revision::R3);
    assert_eq!(make(7999.0), Ok(MotionCommand::SetCheckpoint(7999)));
    for n in [1.5, 0.0, 8001.0, 7999.5, -1.0, 1e30] {
        assert!(make(n).is_err(), "{n}");
    }
}

#[test]
fn the_faster_revision_takes_more() {
    let fast = MotionCommand::SetJointVel(150.0);
    assert_eq!(fast.check(Revision::R4), Ok(()));
    assert_eq!(
        fast.check(Revision::R3).unwrap_err().to_string(),
        "SetJointVel: p = 150 %, allowed: 0.001 to 100 % on a Meca500 R3"
    );
}

#[test]
fn two_arguments_are_checked_together() {
    let limits = |n, q_min, q_max| MotionCommand::SetJointLimits { n, q_min, q_max };
    assert_eq!(limits(2, -70.0, -45.0).check(Revision::R3), Ok(()));
    assert_eq!(limits(5, 0.0, 0.0).check(Revision::R3), Ok(()), "restores the factory's");
    assert_eq!(
        limits(2, -71.0, 0.0).check(Revision::R3).unwrap_err().to_string(),
        "SetJointLimits: q_min = -71 deg, allowed: -70 to 90 deg for joint 2"
    );
    assert_eq!(
        limits(1, 0.0, 24.0).check(Revision::R3).unwrap_err().to_string(),
        "SetJointLimits: q_max = 24 deg, allowed: 25 deg or more, to leave q_min room"
    );
    for (n, (min, max)) in (1..).zip(MODEL_JOINT_LIMITS) {
        assert_eq!(limits(n, min, max).check(Revision::R3), Ok(()));
        assert!(limits(n, min.next_down(), max).check(Revision::R3).is_err());
        assert!(limits(n, min, max.next_up()).check(Revision::R3).is_err());
    }

    let zone = WorkZoneLimits { x_max: 1.0, y_max: 1.0, z_max: 0.0, ..WorkZoneLimits::default() };
    assert_eq!(
        MotionCommand::SetWorkZoneLimits(zone).check(Revision::R3).unwrap_err().to_string(),
        "SetWorkZoneLimits: z_min = 0 mm, allowed: less than z_max, which is 0 mm"
    );
    let whole = MotionCommand::SetWorkZoneLimits(WorkZoneLimits::default());
    assert_eq!(whole.check(Revision::R3), Ok(()));
}

#[test]
fn messages_name_command_argument_value_and_range() {
    let make = |id, values: &[f32]| {
        MotionCommand::from_arguments(id, values, Revision::R3).unwrap_err().to_string()
    };
    assert_eq!(
        make(MotionCommandId::MOVE_JOINTS, &[0.0, 95.0, 0.0, 0.0, 0.0, 0.0]),
        "MoveJoints: theta2 = 95 deg, allowed: -70 to 90 deg"
    );
    assert_eq!(
        make(MotionCommandId::SET_CONF, &[1.0, 0.0, 1.0]),
        "SetConf: c_e = 0, allowed: -1, 1"
    );
    assert_eq!(
        make(MotionCommandId::SET_VALVE_STATE, &[1.0, 2.0]),
        "SetValveState: v2 = 2, allowed: -1 (keep), 0 (close), 1 (open)"
    );
    assert_eq!(
        make(MotionCommandId::SET_CHECKPOINT, &[0.0]),
        "SetCheckpoint: n = 0, allowed: an integer from 1 to 8000"
    );
    assert_eq!(make(MotionCommandId::DELAY, &[]), "Delay takes 1 argument, not 0");
    assert_eq!(make(MotionCommandId::MOVE_LIN, &[1.0]), "MoveLin takes 6 arguments, not 1");
    assert_eq!(
        make(MotionCommandId::REBOOT_ROBOT, &[1.0]),
        "RebootRobot takes no arguments, not 1"
    );
    assert_eq!(make(MotionCommandId(10_000), &[]), "SetVariable takes 1 to 6 arguments, not 0");
    assert_eq!(
        make(MotionCommandId(61), &[]),
        "command ID 61 is not defined; use MotionCommand::Raw to send it all the same"
    );
}

#[test]
fn commands_of_other_robots_are_refused_by_name() {
    for id in 34..=47 {
        let error = MotionCommand::from_arguments(MotionCommandId(id), &[1.0], Revision::R3);
        let name = CommandSpec::of(MotionCommandId(id)).unwrap().name;
        assert_eq!(
            error.unwrap_err().to_string(),
            format!("{name} (command ID {id}) is not available on the Meca500")
        );
    }
}

#[test]
fn wire_forms_typed_by_hand() {
    let cases = [
        (MotionCommand::NoMovement, 0, [0.0; 6]),
        (MotionCommand::MoveJoints([1., 2., 3., 4., 5., 6.]), 1, [1., 2., 3., 4., 5., 6.]),
        (
            MotionCommand::MoveLin(Pose { x: 1., y: 2., z: 3., alpha: 4., beta: 5., gamma: 6. }),
            3,
            [1., 2., 3., 4., 5., 6.],
        ),
        (MotionCommand::Delay(0.5), 6, [0.5, 0., 0., 0., 0., 0.]),
        (
            MotionCommand::SetConf(Conf {
                c_s: ConfSign::Plus,
                c_e: ConfSign::Minus,
                c_w: ConfSign::Plus,
            }),
            15,
            [1., -1., 1., 0., 0., 0.],
        ),
        (MotionCommand::SetCheckpoint(8000), 17, [8000., 0., 0., 0., 0., 0.]),
        (MotionCommand::Gripper(GripperAction::Close), 18, [0.; 6]),
        (MotionCommand::Gripper(GripperAction::Open), 18, [1., 0., 0., 0., 0., 0.]),
        (
            MotionCommand::SetValveState([ValveAction::Keep, ValveAction::Open]),
            30,
            [-1., 1., 0., 0., 0., 0.],
        ),
        (MotionCommand::StartProgram(2), 100, [2., 0., 0., 0., 0., 0.]),
        (MotionCommand::RebootRobot, 200, [0.; 6]),
        (MotionCommand::ClearHoming, 1002, [0.; 6]),
    ];
    for (command, id, arguments) in cases {
        assert_eq!(command.encode(), (MotionCommandId(id), arguments));
        assert_eq!(MotionCommand::decode(MotionCommandId(id), arguments), command);
    }
}

#[test]
fn a_variable_carries_as_many_values_as_it_was_given() {
    let id = MotionCommandId(10_007);
    let command = MotionCommand::from_arguments(id, &[3.0, 4.0], Revision::R3).unwrap();
    let values = [3.0, 4.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(command, MotionCommand::SetVariable { cyclic_id: 10_007, values, count: 2 });
    assert_eq!(command.encode(), (id, values));
    assert_eq!(command.kind(), CommandKind::Variable);
    let stale = MotionCommand::SetVariable { cyclic_id: 10_007, values: [9.0; 6], count: 1 };
    assert_eq!(stale.encode().1, [9.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    for (cyclic_id, count) in [(9_999, 1), (20_000, 1), (10_000, 0), (10_000, 7)] {
        let command = MotionCommand::SetVariable { cyclic_id, values, count };
        assert!(command.check(Revision::R3).is_err(), "{cyclic_id} {count}");
    }
}

#[test]
fn only_the_three_velocity_commands_convert() {
    for spec in COMMANDS {
        let command = MotionCommand::decode(spec.id, [1.0; 6]);
        let velocity = VelocityCommand::try_from(command);
        assert_eq!(velocity.is_ok(), spec.kind == CommandKind::Velocity, "{}", spec.name);
        if let Ok(velocity) = velocity {
            assert_eq!(velocity.encode(), command.encode());
            assert_eq!(MotionCommand::from(velocity), command);
            assert_eq!(velocity.name(), spec.name);
            assert!(velocity.with_velocities([f32::NAN; 6]).check(Revision::R3).is_err());
        }
    }
}

fn used(id: MotionCommandId, arguments: &[f32; 6]) -> Vec<u32> {
    let count = CommandSpec::of(id).map_or(6, |spec| spec.arguments.len());
    // -0.0 in a choice comes back as 0.0; everything else keeps its bits.
    arguments[..count].iter().map(|value| if *value == 0.0 { 0 } else { value.to_bits() }).collect()
}

proptest! {
    #[test]
    fn decoding_loses_nothing_the_command_uses(
        id in prop_oneof![0_u32..210, 990_u32..1010, 9_990_u32..20_010, any::<u32>()],
        arguments in prop::array::uniform6(prop_oneof![
            any::<f32>(), (-200_i32..9000).prop_map(|n| n as f32), -1_000.0_f32..1_000.0,
        ]),
    ) {
        let id = MotionCommandId(id);
        let command = MotionCommand::decode(id, arguments);
        let (encoded_id, encoded) = command.encode();
        prop_assert_eq!(encoded_id, id);
        let known = CommandSpec::of(id).is_some_and(|spec| spec.available);
        if let MotionCommand::Raw { arguments: kept, .. } = command {
            prop_assert_eq!(kept.map(f32::to_bits), arguments.map(f32::to_bits));
        } else {
            prop_assert!(known);
            prop_assert_eq!(used(id, &encoded), used(id, &arguments));
        }
        // A second trip changes nothing.
        let again = MotionCommand::decode(encoded_id, encoded).encode();
        prop_assert_eq!(again.1.map(f32::to_bits), encoded.map(f32::to_bits));
    }

    #[test]
    fn what_from_arguments_accepts_is_typed_checked_and_encodes_as_given(
        row in 0..COMMANDS.len(),
        arguments in prop::collection::vec(
            prop_oneof![(-3_i32..8).prop_map(|n| n as f32), -200.0_f32..200.0], 0..8),
        r4: bool,
    ) {
        let revision = if r4 { Revision::R4 } else { Revision::R3 };
        let spec = &COMMANDS[row];
        if let Ok(command) = MotionCommand::from_arguments(spec.id, &arguments, revision) {
            let is_raw = matches!(command, MotionCommand::Raw { .. });
            prop_assert!(!is_raw);
            prop_assert_eq!(command.check(revision), Ok(()));
            prop_assert_eq!(command.name(), spec.name);
            prop_assert_eq!(command.kind(), spec.kind);
            let (id, encoded) = command.encode();
            prop_assert_eq!(id, spec.id);
            let mut expected = [0.0; 6];
            expected[..arguments.len()].copy_from_slice(&arguments);
            prop_assert_eq!(encoded, expected);
        }
    }
}
