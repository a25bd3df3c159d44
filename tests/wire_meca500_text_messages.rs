//! Messages of the robot, and what of the command language they share: texts, lists, error codes.

use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::command::{COMMANDS, MotionCommand, MotionCommandId};
use fieldarm::wire::meca500::revision::Revision;
use fieldarm::wire::meca500::text::{
    CommandText, Message, MessageError, MessageValue, MessageWriter, RobotNumber, Statement, Value,
    error_code, parse_command, parse_line, write_message,
};
use proptest::prelude::*;

fn values(line: &str) -> Vec<MessageValue<'_>> {
    Message::parse(line).unwrap().values().collect()
}

#[test]
fn the_examples_of_the_manual_are_read() {
    let joints = Message::parse("[2026][-102.6011,-0.0000,-78.9239,-0.0000,15.7848,110.3150]");
    let joints = joints.unwrap();
    assert_eq!(joints.code, Code(2026));
    assert_eq!(joints.numbers(), Some([-102.6011, -0.0, -78.9239, -0.0, 15.7848, 110.3150]));
    assert_eq!(joints.numbers::<5>(), None);
    assert_eq!(joints.numbers::<7>(), None);
    assert_eq!(values("[2230][58675156984]"), [MessageValue::Integer(58_675_156_984)]);
    // Tables and chapters print blanks here and there.
    assert_eq!(Message::parse("[2015] [p]\r").unwrap(), Message { code: Code(2015), body: "p" });
    let status = Message::parse("[2007][1, 1, 0, 0, 0, 1, 1]").unwrap();
    assert_eq!(status.numbers(), Some([1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0]));
}

#[test]
fn texts_may_hold_brackets_commas_and_commands() {
    let line = "[1007][Joint over limit (80 is not in range [-70,90] for joint 2). - Command: \
                'MoveJoints(0,95,0,0,0,0)']";
    let message = Message::parse(line).unwrap();
    assert_eq!(message.code, Code::JOINT_OVER_LIMIT);
    assert_eq!(message.quoted_command(), Some("MoveJoints(0,95,0,0,0,0)"));
    assert_eq!(message.to_string(), line);
    assert_eq!(Message::parse("[1006][The robot is not homed.]").unwrap().quoted_command(), None);
    assert_eq!(values("[2042][Motion paused.]"), [MessageValue::Text("Motion paused.")]);
    assert_eq!(values("[2117][]"), []);
}

#[test]
fn values_of_variables_may_be_anything() {
    let line = r#"[2551][tour.first,[190.0,[1,2],"a,]b",true],10000]"#;
    let got = values(line);
    assert_eq!(got[0], MessageValue::Text("tour.first"));
    assert_eq!(got[2].integer(), Some(10_000));
    assert_eq!(got.len(), 3);
    let MessageValue::List(list) = got[1] else { panic!("{got:?}") };
    let list: Vec<_> = list.collect();
    assert_eq!(list[0], MessageValue::Real(190.0));
    assert!(matches!(list[1], MessageValue::List(_)));
    assert_eq!(list[2..], [MessageValue::Text("a,]b"), MessageValue::Truth(true)]);
    assert_eq!(
        values("[2552]['it, is',-1.5e3,99999999999999999999]"),
        [
            MessageValue::Text("it, is"),
            MessageValue::Real(-1500.0),
            MessageValue::Real(100_000_000_000_000_000_000.0)
        ]
    );
    assert_eq!(values("[2095][inf]"), [MessageValue::Text("inf")]);
    assert_eq!(values("[2095][-]"), [MessageValue::Text("-")]);
}

#[test]
fn what_is_no_message_is_refused_with_the_reason() {
    for line in ["", "2007", "[207][0]", "[20070][0]", "[+200][0]", "[2007", "hello [2007][0]"] {
        assert_eq!(Message::parse(line), Err(MessageError::NoCode), "{line}");
    }
    assert_eq!(Message::parse("[2007]"), Err(MessageError::NoBody { code: Code(2007) }));
    assert_eq!(Message::parse("[2007]x[1]"), Err(MessageError::NoBody { code: Code(2007) }));
    assert_eq!(Message::parse("[2007][1] x"), Err(MessageError::NoEnd { code: Code(2007) }));
    assert_eq!(
        Message::parse("[2007]").unwrap_err().to_string(),
        "code 2007 is not followed by a text or values in brackets"
    );
}

#[test]
fn numbers_have_nine_places_at_most_and_no_zeros_behind() {
    for (number, text) in [
        (0.0, "0"),
        (-0.0, "0"),
        (-0.000_000_000_4, "0"),
        (0.000_000_000_6, "0.000000001"),
        (-0.000_000_001, "-0.000000001"),
        (15.0, "15"),
        (100.0, "100"),
        (-102.601_1, "-102.6011"),
        (0.5, "0.5"),
        (10.05, "10.05"),
        (1.0 / 3.0, "0.333333333"),
        (36_000.000_000_5, "36000.0000005"),
        (1e15, "1000000000000000"),
    ] {
        assert_eq!(RobotNumber(number).to_string(), text);
    }
}

#[test]
fn messages_are_written_without_blanks_or_ends_of_line() {
    let mut line = String::new();
    let writer = MessageWriter::begin(&mut line, Code(2026)).unwrap();
    let writer = writer.four_places(-102.6011).unwrap().four_places(15.0).unwrap();
    writer
        .flag(true)
        .unwrap()
        .text("a\0b\nc")
        .unwrap()
        .numbers([1.5_f32, 2.0])
        .unwrap()
        .end()
        .unwrap();
    assert_eq!(line, "[2026][-102.6011,15.0000,1,a b c,1.5,2]");
    line.clear();
    write_message(&mut line, Code(1001), format_args!("Unknown: '{}'", "x\r\ny")).unwrap();
    assert_eq!(line, "[1001][Unknown: 'x  y']");
    line.clear();
    write_message(&mut line, Code(7), format_args!("")).unwrap();
    assert_eq!(line, "[0007][]");
}

#[test]
fn every_motion_command_has_a_text_that_means_the_same() {
    let mut with_text = 0;
    for spec in COMMANDS {
        let mut arguments = match spec.id {
            MotionCommandId::SET_WORK_ZONE_LIMITS => [-1.5, -2.0, -3.0, 1.0, 2.0, 3.0],
            MotionCommandId::SET_JOINT_LIMITS => [6.0, -100.0, 100.5, 0.0, 0.0, 0.0],
            _ => [0.0; 6],
        };
        if arguments == [0.0; 6] {
            for (number, argument) in arguments.iter_mut().zip(spec.arguments) {
                *number = argument.range.max(Revision::R3).unwrap_or(1.25);
            }
        }
        let command = MotionCommand::decode(spec.id, arguments);
        let Some(text) = CommandText::of(&command) else {
            let on_a_bus_only = [MotionCommandId::NO_MOVEMENT, MotionCommandId::CLEAR_HOMING];
            let is_variable = spec.id == MotionCommandId::VARIABLE_FIRST;
            assert!(on_a_bus_only.contains(&spec.id) || is_variable || !spec.available, "{spec:?}");
            continue;
        };
        let text = text.to_string();
        let statement = Statement::parse(&text, Revision::R4);
        let statement = statement.unwrap_or_else(|error| panic!("{text}: {error}")).unwrap();
        match statement {
            Statement::Motion(again) => assert_eq!(again, command, "{text}"),
            Statement::Velocity(again) => assert_eq!(MotionCommand::from(again), command, "{text}"),
            other => panic!("{text}: {other:?}"),
        }
        with_text += 1;
    }
    assert!(with_text > 40, "{with_text}");
    let exact = MotionCommand::MoveJoints([0.1, -1.0 / 3.0, 1e-7, 0.0, 0.0, 36_000.0]);
    let text = CommandText::of(&exact).unwrap().to_string();
    assert_eq!(text, "MoveJoints(0.1,-0.33333334,0.0000001,0,0,36000)");
}

proptest! {
    #[test]
    fn what_is_written_is_read_again(numbers in prop::collection::vec(-1e9_f64..1e9, 1..8)) {
        let mut line = String::new();
        let writer = MessageWriter::begin(&mut line, Code(2210)).unwrap();
        writer.numbers(numbers.iter().copied()).unwrap().end().unwrap();
        let message = Message::parse(&line).unwrap();
        prop_assert!(!line.contains(' ') && !line.contains("-0,") && !line.contains(".]"), "{line}");
        let read: Vec<f64> = message.values().map(|value| value.number().unwrap()).collect();
        prop_assert_eq!(read.len(), numbers.len());
        for (read, written) in read.iter().zip(&numbers) {
            prop_assert!((read - written).abs() <= 0.5e-9 + written.abs() * 1e-15, "{read} {written}");
        }
    }

    #[test]
    fn no_line_makes_the_reader_panic(line in ".{0,80}") {
        if let Ok(message) = Message::parse(&line) {
            let _ = message.values().count();
            let again = message.to_string();
            prop_assert_eq!(Message::parse(&again), Ok(message));
        }
    }

    #[test]
    fn brackets_and_quotes_make_no_reader_panic(body in "[\\[\\]{}\"',\\\\a1.]{0,40}") {
        let line = format!("[2551][{body}]");
        let mut open: Vec<_> = values(&line);
        let mut steps = 0;
        while let Some(value) = open.pop() {
            steps += 1;
            prop_assert!(steps < 1_000);
            if let MessageValue::List(list) = value {
                open.extend(list);
            }
        }
        let command = format!("CreateVariable({body})");
        if let Ok(Some(parsed)) = parse_command(&command, Revision::R4) {
            prop_assert!(parsed.arguments().all(|argument| command[argument.offset..].starts_with(argument.text)));
        }
    }
}

fn arguments(line: &str) -> Vec<Value<'_>> {
    let parsed = parse_command(line, Revision::R3).unwrap().unwrap();
    parsed.arguments().map(|argument| argument.value()).collect()
}

#[test]
fn texts_stand_in_either_kind_of_mark_or_in_none() {
    assert_eq!(arguments("SetRobotName('left, arm')"), [Value::Text("left, arm")]);
    assert_eq!(arguments("SetRobotName( \"it's\" )"), [Value::Text("it's")]);
    assert_eq!(arguments("SetRobotName(Bob's)"), [Value::Text("Bob's")]);
    assert_eq!(arguments(r"LogTrace('a\'b)')"), [Value::Text(r"a\'b)")]);
    let lost = parse_command("LogTrace('a)", Revision::R3).unwrap_err();
    assert_eq!((lost.column, error_code(&lost)), (10, Code::SYNTAX_ERROR));
}

#[test]
fn arrays_have_elements_and_variables_have_names() {
    let got = arguments("CreateVariable(tour.first, [1, 'a,b', [2,3]], 10000, 1)");
    let Value::List(elements) = got[1] else { panic!("{got:?}") };
    assert_eq!(elements.collect::<Vec<_>>(), ["1", "'a,b'", "[2,3]"]);
    let line = "SetPayload(vars.m, 0, *vars.group.c)";
    let parsed = parse_command(line, Revision::R3).unwrap().unwrap();
    let names: Vec<_> = parsed.variables().map(|v| (v.offset, v.text)).collect();
    assert_eq!(names, [(11, "vars.m"), (22, "*vars.group.c")]);
}

#[test]
fn comments_belong_to_programs_only() {
    assert!(parse_line("Delay(1) // wait", Revision::R3).is_ok());
    let error = parse_command("Delay(1) // wait", Revision::R3).unwrap_err();
    assert_eq!(error_code(&error), Code::SYNTAX_ERROR);
    assert_eq!(arguments("LogTrace(see #5 // there)"), [Value::Text("see #5 // there")]);
    assert_eq!(parse_command(" \t", Revision::R3), Ok(None));
}

#[test]
fn each_mistake_has_the_code_that_the_manual_gives_it() {
    let code = |line: &str| error_code(&parse_command(line, Revision::R3).unwrap_err());
    for line in ["Foo()", "(1)", "12", "-", "--Home", "movejoints(1)", "Größe(1)"] {
        assert_eq!(code(line), Code::UNKNOWN_COMMAND, "{line}");
    }
    for line in ["Delay(1", "Delay 1)", "MoveJoints(0 0,0,0,0,0)", "Home() Home()", "Delay(1))"] {
        assert_eq!(code(line), Code::SYNTAX_ERROR, "{line}");
    }
    for line in [
        "Delay()",
        "Delay",
        "Delay(1,2)",
        "Delay(,)",
        "Delay(abc)",
        "SetBlending(101)",
        "SetBlending(1e60)",
        "SyncCmdQueue(-1)",
        "MoveJoints(0,0,0,0,0)",
        "Home(1)",
    ] {
        assert_eq!(code(line), Code::ARGUMENT_ERROR, "{line}");
    }
    let long = format!("SetRobotName({})", "x".repeat(64));
    assert_eq!(code(&long), Code::ARGUMENT_ERROR);
}
