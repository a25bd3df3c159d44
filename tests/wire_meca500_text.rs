//! Text commands against the table typed from the manual, the line parser, and program statements.

use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::command::{
    COMMANDS, Conf, ConfSign, GripperAction, MotionCommand, Pose, Unit, ValveAction,
    VelocityCommand,
};
use fieldarm::wire::meca500::revision::Revision;
use fieldarm::wire::meca500::text::{
    AllowedState, Category, CyclicEquivalent, Statement, TEXT_COMMANDS, TextArgumentKind,
    TextCommandSpec, Timing, Value, parse_line,
};
use proptest::prelude::*;
use std::collections::HashMap;

type Row = HashMap<String, String>;

fn rows() -> Vec<Row> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/spec/meca500_tcp_commands.csv");
    csv::Reader::from_path(path).unwrap().deserialize().map(Result::unwrap).collect()
}

/// The fields of one argument of the table's small JSON, as text; `null` becomes empty.
type JsonObject = HashMap<String, String>;

/// Reads a JSON array of flat objects whose values are strings, numbers, booleans or null.
fn json_objects(json: &str) -> Vec<JsonObject> {
    let mut objects = Vec::new();
    let mut tokens = json_tokens(json).into_iter().peekable();
    let mut object = JsonObject::new();
    let mut key: Option<String> = None;
    while let Some(token) = tokens.next() {
        match token.as_str() {
            "{" => object = JsonObject::new(),
            "}" => objects.push(std::mem::take(&mut object)),
            "[" | "]" | "," => {}
            ":" => {
                let value = tokens.next().unwrap();
                let value = if value == "null" { "" } else { value.trim_matches('"') };
                object.insert(key.take().unwrap(), value.to_owned());
            }
            text => key = Some(text.trim_matches('"').to_owned()),
        }
    }
    objects
}

fn json_tokens(json: &str) -> Vec<String> {
    let mut tokens = Vec::new();
    let mut rest = json.trim_start();
    while let Some(first) = rest.chars().next() {
        let length = match first {
            '[' | ']' | '{' | '}' | ':' | ',' => 1,
            '"' => rest[1..].find('"').unwrap() + 2,
            _ => rest.find(|c: char| "[]{}:, ".contains(c)).unwrap_or(rest.len()),
        };
        tokens.push(rest[..length].to_owned());
        rest = rest[length..].trim_start();
    }
    tokens
}

fn category_of(cell: &str) -> Category {
    match cell {
        "motion" => Category::Motion,
        "control" => Category::Control,
        "data" => Category::Data,
        "realtime" => Category::RealTime,
        "workzone" => Category::WorkZone,
        "accessory" => Category::Accessory,
        "variable" => Category::Variable,
        other => panic!("{other}"),
    }
}

fn equivalent_matches(spec: &TextCommandSpec, cell: &str) -> bool {
    match spec.equivalent {
        CyclicEquivalent::Unavailable => spec.available == Some(false),
        CyclicEquivalent::None => cell.is_empty() || cell.starts_with("none"),
        CyclicEquivalent::HostTime => cell == "HostTime",
        CyclicEquivalent::Motion(id) => {
            let number: String = cell
                .strip_prefix("MotionCommandID ")
                .unwrap_or("")
                .chars()
                .take_while(char::is_ascii_digit)
                .collect();
            number == id.0.to_string()
        }
        CyclicEquivalent::RobotControl(bit) => cell.starts_with(&format!("RobotControl.{bit:?}")),
        CyclicEquivalent::MotionControl(bit) => cell == format!("MotionControl.{bit:?}"),
        CyclicEquivalent::Dynamic(types) => {
            let numbers: Vec<u32> = cell
                .split(|c: char| !c.is_ascii_digit())
                .filter_map(|digits| digits.parse().ok())
                .collect();
            cell.contains("DynamicTypeID") && types.iter().map(|ty| ty.0).eq(numbers)
        }
        CyclicEquivalent::Input(section) => {
            // The two legacy requests have no cell; they ask for what a newer one asks for.
            let legacy = matches!(spec.name, "GetJoints" | "GetPose");
            legacy
                || cell == section.name()
                || cell.starts_with(&format!("{} section", section.name()))
        }
    }
}

#[test]
fn every_row_of_the_table_is_there_and_nothing_else() {
    let rows = rows();
    assert_eq!(rows.len(), 191);
    assert_eq!(TextCommandSpec::all().count(), 191);
    assert_eq!(TEXT_COMMANDS.len(), 7);
    for row in rows {
        let name = row["name"].as_str();
        let spec = TextCommandSpec::by_name(name).unwrap_or_else(|| panic!("{name}"));
        assert_eq!(spec.category, category_of(&row["category"]), "{name}");
        let timing = match row["queued_or_instant"].as_str() {
            "instant" => Timing::Instantaneous,
            "" | "not stated" => Timing::NotStated,
            cell => {
                assert!(cell.starts_with("queued"), "{cell}");
                Timing::Queued
            }
        };
        assert_eq!(spec.timing, timing, "{name}");
        let available = match row["meca500_available"].as_str() {
            "yes" => Some(true),
            "no" => Some(false),
            _ => None,
        };
        assert_eq!(spec.available, available, "{name}");
        assert_eq!(spec.manual_line.to_string(), row["manual_line"], "{name}");
        let cell = row["cyclic_equivalent"].as_str();
        assert!(equivalent_matches(spec, cell), "{name}: {:?} and {cell}", spec.equivalent);
    }
}

/// Bounds decided by this crate, or that a wider type cannot express; the files say why.
fn decided(command: &str, argument: &str) -> Option<(Option<f64>, Option<f64>)> {
    let largest = Some(f64::from(u32::MAX));
    Some(match (command, argument) {
        ("Delay", "t") => (Some(0.0), None),
        ("SetGripperVel", "p") => (Some(5.0), Some(200.0)),
        ("MoveGripper", "d") => (Some(0.0), Some(48.0)),
        ("ConnectionWatchdog", "t") => (Some(0.0), Some(4_294_967.5)),
        ("StartSaving", "n") => (Some(1.0), Some(500.0)),
        ("SetRtc", "t") => (Some(1.0), largest),
        ("TcpDump", "n") => (Some(0.0), largest),
        ("CreateVariable", "cyclicId") => (Some(0.0), Some(19_999.0)),
        // The table lists the four codes without bounds.
        ("GetSafetyStopStatus", "n") => (Some(3032.0), Some(3086.0)),
        _ => return None,
    })
}

fn close(a: Option<f64>, b: Option<f64>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => a as f32 == b as f32,
        (a, b) => a == b,
    }
}

#[test]
fn every_argument_has_the_name_unit_range_and_default_of_the_table() {
    let mut compared = 0;
    for row in rows().iter().filter(|row| !row["args_json"].trim().is_empty()) {
        let spec = TextCommandSpec::by_name(&row["name"]).unwrap();
        let expected = json_objects(&row["args_json"]);
        let arguments: Vec<_> = spec.arguments().collect();
        assert_eq!(arguments.len(), expected.len(), "{}", spec.name);
        for (argument, json) in arguments.iter().zip(&expected) {
            compared += 1;
            let label = format!("{} {}", spec.name, argument.name);
            assert_eq!(argument.name, json["name"], "{label}");
            assert_eq!(argument.optional, json.contains_key("optional"), "{label}");
            let unit = match json["unit"].as_str() {
                "s since UNIX epoch" => "s",
                unit if unit == Unit::None.symbol() => unit,
                unit if ["mm", "deg", "deg/s", "mm/s", "%", "s", "kg"].contains(&unit) => unit,
                _ => "",
            };
            assert_eq!(argument.unit.symbol(), unit, "{label}");
            assert_eq!(argument.default, json["default"].parse().ok(), "{label}");
            let (min, max) = match argument.kind {
                TextArgumentKind::Number(range) => (range.min(), range.max(Revision::R4)),
                TextArgumentKind::Whole { min, max } => (Some(min as f32), Some(max as f32)),
                TextArgumentKind::Text { max_chars } => (None, max_chars.map(f32::from)),
                TextArgumentKind::Json | TextArgumentKind::List => (None, None),
            };
            let number = |key: &str| -> Option<f64> {
                let cell = json[key].rsplit(':').next().unwrap();
                (!cell.is_empty())
                    .then(|| cell.parse().unwrap_or_else(|_| panic!("{label} {cell}")))
            };
            let (low, high) = decided(spec.name, argument.name).unwrap_or_else(|| {
                // The program's name is limited to 63 characters in words only.
                let high = if spec.name == "StartProgram" { Some(63.0) } else { number("max") };
                (number("min"), high)
            });
            assert!(close(min.map(f64::from), low), "{label}: {min:?} {low:?}");
            assert!(close(max.map(f64::from), high), "{label}: {max:?} {high:?}");
            if let Some(list) =
                json["unit"].strip_prefix("enum{").and_then(|unit| unit.strip_suffix('}'))
            {
                let TextArgumentKind::Number(range) = argument.kind else { panic!("{label}") };
                for value in list.split(',').map(|part| part.split('=').next().unwrap()) {
                    assert!(
                        range.contains(value.parse().unwrap(), Revision::R3),
                        "{label} {value}"
                    );
                }
                for value in -2..200 {
                    let listed = list.split(',').any(|part| {
                        part.split('=').next().unwrap().parse::<i32>().unwrap() == value
                    });
                    assert_eq!(range.contains(value as f32, Revision::R3), listed, "{label}");
                }
            }
        }
    }
    assert_eq!(compared, 160);
}

fn syntax_error(line: &str) -> (usize, String) {
    let error = parse_line(line, Revision::R3).unwrap_err();
    (error.column, error.to_string())
}

#[track_caller]
fn assert_syntax(line: &str, column: usize, message: &str) {
    assert_eq!(syntax_error(line), (column, message.to_owned()), "{line}");
}

#[test]
fn blank_lines_and_comments_are_nothing() {
    for line in ["", "   ", "\t", "// MoveJoints(", "# x", "  //", "\r"] {
        assert_eq!(parse_line(line, Revision::R3), Ok(None), "{line:?}");
    }
}

#[test]
fn a_command_keeps_its_pieces() {
    let line = "  -MoveLin( 208, 50,40 ,0, 0,9e1 )  // over there";
    let parsed = parse_line(line, Revision::R3).unwrap().unwrap();
    assert_eq!(parsed.spec.name, "MoveLin");
    assert!(parsed.silent);
    assert_eq!(parsed.column, 4);
    assert_eq!(parsed.numbers(), [208.0, 50.0, 40.0, 0.0, 0.0, 90.0]);
    let pieces: Vec<_> = parsed.arguments().map(|a| (a.text, a.offset, a.column)).collect();
    assert_eq!(pieces[0], ("208", 12, 13));
    assert_eq!(pieces[2], ("40", 20, 21));
    assert_eq!(pieces[5], ("9e1", 29, 30));

    for line in ["Home", "Home()", "Home ( )", " Home # now", "Home() // now"] {
        let parsed = parse_line(line, Revision::R3).unwrap().unwrap();
        assert_eq!((parsed.spec.name, parsed.silent), ("Home", false), "{line}");
        assert_eq!(parsed.arguments().count(), 0);
    }
}

#[test]
fn texts_and_lists_may_hold_commas_and_comment_signs() {
    let arguments = |line: &'static str| -> Vec<Value<'static>> {
        let parsed = parse_line(line, Revision::R3).unwrap().unwrap();
        parsed.arguments().map(|argument| argument.value()).collect()
    };
    assert_eq!(arguments(r##"LogTrace("a, b) # c // d")"##), [Value::Text("a, b) # c // d")]);
    assert_eq!(arguments("StartProgram(pick_2)"), [Value::Text("pick_2")]);
    let variable = arguments("CreateVariable(home, [190.0, 0, 308], 10000)");
    assert_eq!(variable[..1], [Value::Text("home")]);
    let Value::List(elements) = variable[1] else { panic!("{variable:?}") };
    assert_eq!(elements.collect::<Vec<_>>(), ["190.0", "0", "308"]);
    assert_eq!(variable[2..], [Value::Number(10_000.0)]);
    assert_eq!(
        arguments("SetRealTimeMonitoring(2200, TargetCartPos, 2202, 2203, 2204, 2210, 2211, All)")
            .len(),
        8
    );
    assert_eq!(arguments("SetValveState(*, 1)"), [Value::Keep, Value::Number(1.0)]);
    assert_eq!(
        arguments("MoveJoints(*vars.tour.first)"),
        [Value::Variable { name: "tour.first", unrolled: true }]
    );
}

#[test]
fn syntax_errors_name_the_place_and_the_reason() {
    assert_syntax("MovJoints(0)", 1, "there is no command `MovJoints`; did you mean `MoveJoints`?");
    assert_syntax("  movelin(1)", 3, "there is no command `movelin`; did you mean `MoveLin`?");
    assert_syntax("SetTRF(1)", 1, "there is no command `SetTRF`; did you mean `SetTrf`?");
    assert_syntax("Frobnicate()", 1, "there is no command `Frobnicate`");
    assert_syntax("(1)", 1, "a command's name is expected here, not `(1)`");
    assert_syntax("- 12", 3, "a command's name is expected here, not `12`");
    assert_syntax("Delay 1", 7, "`(` is missing after Delay");
    assert_syntax("Delay(1", 8, "`)` is missing at the end of Delay");
    assert_syntax("Delay(1 // wait", 8, "`)` is missing at the end of Delay");
    assert_syntax("MovePose(1, 2 3, 4, 5, 6)", 15, "a comma is missing before `3`");
    assert_syntax("MovePose(1,,3,4,5,6)", 12, "an argument is missing here");
    assert_syntax("Delay(1,)", 9, "an argument is missing here");
    assert_syntax("LogTrace(\"abc)", 10, "the closing quotation mark is missing");
    assert_syntax("Delay(1) Delay(2)", 10, "nothing may follow the command, but `Delay(2)` does");
    assert_syntax("Delay(1);", 9, "nothing may follow the command, but `;` does");
    assert_syntax("Delay()", 7, "Delay takes 1 argument, not 0");
    assert_syntax("MoveJoints(1,2,3)", 17, "MoveJoints takes 6 arguments, not 3");
    assert_syntax("Delay(1, 2)", 10, "Delay takes 1 argument, not 2");
    assert_syntax("Home(1)", 6, "Home takes no arguments, not 1");
    assert_syntax("ActivateRobot(1, 2)", 18, "ActivateRobot takes 0 to 1 arguments, not 2");
    assert_syntax("Delay(soon)", 7, "Delay: t must be a number, not `soon`");
    assert_syntax("Delay(*)", 7, "Delay: t must be a number, not `*`");
    for word in ["nan", "inf", "-inf", "infinity", "0x10", "1_000", "--1"] {
        let line = format!("Delay({word})");
        assert_eq!(syntax_error(&line).0, 7, "{word}");
    }
    assert_syntax("Delay(1e99)", 7, "Delay: t: 1e99 is too large for a 32-bit Real");
    assert_syntax("Delay(-1e99)", 7, "Delay: t: -1e99 is too large for a 32-bit Real");
    assert_syntax(
        "SetJointVel(1e-320)",
        13,
        "SetJointVel: p: 1e-320 is too small for a 32-bit Real",
    );
    assert_syntax(
        "SetJointVel(0e-320)",
        13,
        "SetJointVel: p = 0 %, allowed: 0.001 to 100 % on a Meca500 R3",
    );
    assert_syntax(
        "MoveJoints(0, 95, 0, 0, 0, 0)",
        15,
        "MoveJoints: theta2 = 95 deg, allowed: -70 to 90 deg",
    );
    assert_syntax(
        "SetCheckpoint(1.5)",
        15,
        "SetCheckpoint: n = 1.5, allowed: an integer from 1 to 8000",
    );
    assert_syntax("SetRtc(1.5)", 8, "SetRtc: t = 1.5, allowed: an integer from 1 to 4294967295");
    assert_syntax(
        "SetJointLimits(1, -10, 10)",
        24,
        "SetJointLimits: q_max = 10 deg, allowed: 15 deg or more, to leave q_min room",
    );
    let long = format!("SetRobotName({})", "x".repeat(64));
    assert_syntax(&long, 14, "SetRobotName: s may have 63 characters at most");
    // Columns count characters, not bytes.
    assert_syntax("Delay(1) é ü", 10, "nothing may follow the command, but `é ü` does");
    assert_syntax("é", 1, "there is no command `é`");
    assert_syntax(
        "MöveJoints(0, 0)",
        1,
        "there is no command `MöveJoints`; did you mean `MoveJoints`?",
    );
    assert_syntax("D\0elay(1)", 1, r"there is no command `D\0elay`; did you mean `Delay`?");
    assert_syntax("\u{1b}[2J", 1, r"a command's name is expected here, not `\u{1b}[2J`");
    assert_syntax("Delay(1\u{7})", 7, r"Delay: t must be a number, not `1\u{7}`");
    assert_syntax("UseVariables()", 1, "there is no command `UseVariables`");
    let error = parse_line("LogTrace(\"éé\", 2)", Revision::R3).unwrap_err();
    assert_eq!((error.column, error.offset), (16, 17));
}

#[test]
fn the_range_follows_the_revision() {
    assert!(parse_line("SetJointVel(150)", Revision::R4).is_ok());
    assert_syntax(
        "SetJointVel(150)",
        13,
        "SetJointVel: p = 150 %, allowed: 0.001 to 100 % on a Meca500 R3",
    );
}

fn statement(line: &str) -> Statement {
    Statement::parse(line, Revision::R3).unwrap_or_else(|e| panic!("{line}: {e}")).unwrap()
}

#[test]
fn statements_of_a_cyclic_program() {
    let pose = Pose { x: 1.0, y: 2.0, z: 3.0, alpha: 4.0, beta: 5.0, gamma: 6.0 };
    let plus = ConfSign::Plus;
    let motions = [
        ("MoveJoints(1,2,3,4,5,6)", MotionCommand::MoveJoints([1., 2., 3., 4., 5., 6.])),
        ("MoveLin(1,2,3,4,5,6)", MotionCommand::MoveLin(pose)),
        ("SetTrf(1,2,3,4,5,6)", MotionCommand::SetTrf(pose)),
        ("Delay(0.25)", MotionCommand::Delay(0.25)),
        (
            "SetConf(1,1,-1)",
            MotionCommand::SetConf(Conf { c_s: plus, c_e: plus, c_w: ConfSign::Minus }),
        ),
        ("SetCheckpoint(8000)", MotionCommand::SetCheckpoint(8000)),
        ("GripperOpen()", MotionCommand::Gripper(GripperAction::Open)),
        ("GripperClose", MotionCommand::Gripper(GripperAction::Close)),
        ("MoveGripper(5.5)", MotionCommand::MoveGripper(5.5)),
        (
            "SetValveState(*,1)",
            MotionCommand::SetValveState([ValveAction::Keep, ValveAction::Open]),
        ),
        ("StartProgram(12)", MotionCommand::StartProgram(12)),
        ("StartProgram(\"500\")", MotionCommand::StartProgram(500)),
        ("RebootRobot()", MotionCommand::RebootRobot),
        ("SetTimeScaling(50)", MotionCommand::SetTimeScaling(50.0)),
    ];
    for (line, expected) in motions {
        assert_eq!(statement(line), Statement::Motion(expected), "{line}");
    }
    assert_eq!(
        statement("MoveLinVelTrf(1,2,3,4,5,6)"),
        Statement::Velocity(VelocityCommand::MoveLinVelTrf([1., 2., 3., 4., 5., 6.]))
    );
    let actions = [
        ("ActivateRobot", Statement::Activate { reinitialize: false }),
        ("ActivateRobot()", Statement::Activate { reinitialize: false }),
        ("ActivateRobot(1)", Statement::Activate { reinitialize: true }),
        ("DeactivateRobot()", Statement::Deactivate),
        ("Home()", Statement::Home),
        ("ResetError()", Statement::ResetError),
        ("PauseMotion()", Statement::PauseMotion),
        ("ResumeMotion()", Statement::ResumeMotion),
        ("ClearMotion()", Statement::ClearMotion),
        ("ActivateSim()", Statement::ActivateSim),
        ("ActivateSim(0)", Statement::DeactivateSim),
        ("DeactivateSim()", Statement::DeactivateSim),
        ("SetRecoveryMode(1)", Statement::SetRecoveryMode(true)),
        ("SetRecoveryMode(0)", Statement::SetRecoveryMode(false)),
        ("SetRtc(1763769843)", Statement::SetRtc(1_763_769_843)),
        ("SetRtc(4294967295)", Statement::SetRtc(u32::MAX)),
    ];
    for (line, expected) in actions {
        assert_eq!(statement(line), expected, "{line}");
    }
    assert_eq!(Statement::parse("  # nothing", Revision::R3), Ok(None));
}

#[test]
fn a_message_shows_no_more_of_a_line_than_fits_on_one() {
    let cut = |letter: &str| letter.repeat(40) + "...";
    let (_, message) = syntax_error(&"M".repeat(2_000_000));
    assert_eq!(message, format!("there is no command `{}`", cut("M")));
    let (_, message) = syntax_error(&format!("Delay({})", "x".repeat(1_000)));
    assert_eq!(message, format!("Delay: t must be a number, not `{}`", cut("x")));
    let (_, message) = syntax_error(&format!("Delay(1) {}", "é".repeat(41)));
    assert_eq!(message, format!("nothing may follow the command, but `{}` does", cut("é")));
    let (_, message) = syntax_error(&format!("Delay(1) {}", "é".repeat(40)));
    assert_eq!(message, format!("nothing may follow the command, but `{}` does", "é".repeat(40)));
}

#[test]
fn a_line_of_very_many_arguments_is_read_in_one_pass() {
    // Counting the column of each argument from the beginning would take hours here.
    let line = format!("Delay(1{})", ",é".repeat(400_000));
    let (column, message) = syntax_error(&line);
    assert_eq!((column, message.as_str()), (9, "Delay takes 1 argument, not 400001"));
}

#[test]
fn what_has_no_place_in_a_cyclic_program_is_refused_with_the_reason() {
    let cases = [
        (
            "SetNetworkOptions(3)",
            1,
            "SetNetworkOptions exists only on the robot's TCP interface; nothing in the cyclic image stands for it",
        ),
        (
            " GetRtJointPos()",
            2,
            "GetRtJointPos is a request for data; read it from the cyclic image: dynamic data type 40 (Actual joint position)",
        ),
        (
            "GetStatusRobot",
            1,
            "GetStatusRobot is a request for data; read it from the cyclic image: RobotStatus",
        ),
        ("MoveJump(1,2)", 1, "MoveJump is not available on the Meca500"),
        (
            "StartProgram(pick)",
            14,
            "StartProgram over the cyclic image takes programs named by a number from 1 to 500, not `pick`",
        ),
        (
            "StartProgram(501)",
            14,
            "StartProgram over the cyclic image takes programs named by a number from 1 to 500, not `501`",
        ),
        (
            "ActivateSim(2)",
            13,
            "ActivateSim with a kind exists only on the robot's TCP interface; the cyclic bit starts the kind that SetSimModeCfg chose: write ActivateSim()",
        ),
        (
            "Delay(vars.t)",
            7,
            "`vars.t` is a robot variable, which only the robot's TCP interface looks up by name; write a number",
        ),
        (
            "SetVariable(a, 1)",
            1,
            "SetVariable names its variable, and names exist only on the robot's TCP interface; the cyclic image sets a variable by its cyclic ID",
        ),
        ("Delay(-1)", 7, "Delay: t = -1 s, allowed: 0 s or more"),
    ];
    for (line, column, message) in cases {
        let error = Statement::parse(line, Revision::R3).unwrap_err();
        assert_eq!((error.column, error.to_string().as_str()), (column, message), "{line}");
    }
}

/// A line with arguments the command accepts.
fn good_line(spec: &TextCommandSpec) -> String {
    let arguments: Vec<String> = spec
        .arguments()
        .map(|argument| match argument.kind {
            TextArgumentKind::Number(range) => range.max(Revision::R3).unwrap_or(1.0).to_string(),
            TextArgumentKind::Whole { min, .. } => min.to_string(),
            TextArgumentKind::Text { .. } => "7".to_owned(),
            TextArgumentKind::Json => "[1, 2]".to_owned(),
            TextArgumentKind::List => "2200, All".to_owned(),
        })
        .collect();
    match spec.name {
        "SetWorkZoneLimits" => "SetWorkZoneLimits(-1,-1,-1,1,1,1)".to_owned(),
        "SetJointLimits" => "SetJointLimits(6,-100,100)".to_owned(),
        name => format!("{name}({})", arguments.join(", ")),
    }
}

#[test]
fn every_command_parses_and_every_cyclic_one_becomes_its_motion_command() {
    let mut motions = Vec::new();
    for spec in TextCommandSpec::all() {
        let line = good_line(spec);
        let parsed = parse_line(&line, Revision::R3).unwrap_or_else(|e| panic!("{line}: {e}"));
        assert_eq!(parsed.unwrap().spec, spec);
        let result = Statement::parse(&line, Revision::R3);
        match spec.equivalent {
            CyclicEquivalent::Motion(_) if spec.category == Category::Variable => {
                assert!(result.is_err(), "{line}");
            }
            CyclicEquivalent::Motion(id) => {
                let encoded = match result.unwrap().unwrap() {
                    Statement::Motion(command) => command.encode(),
                    Statement::Velocity(command) => command.encode(),
                    other => panic!("{line}: {other:?}"),
                };
                assert_eq!(encoded.0, id, "{line}");
                motions.push(id);
            }
            CyclicEquivalent::RobotControl(_)
            | CyclicEquivalent::MotionControl(_)
            | CyclicEquivalent::HostTime => {
                // ActivateSim(2), the highest choice, names a kind that the bit cannot choose.
                assert_eq!(result.is_ok(), spec.name != "ActivateSim", "{line}");
            }
            _ => assert!(result.is_err(), "{line}"),
        }
    }
    motions.sort();
    motions.dedup();
    // Every motion command of the Meca500 but 0, 1002 and the variables has a text command.
    let expected: Vec<_> = COMMANDS
        .iter()
        .filter(|spec| spec.available)
        .filter(|spec| !["NoMovement", "ClearHoming", "SetVariable"].contains(&spec.name))
        .map(|spec| spec.id)
        .collect();
    assert_eq!(motions, expected);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn no_line_makes_the_parser_panic(line in "\\PC{0,60}") {
        if let Err(error) = Statement::parse(&line, Revision::R4) {
            prop_assert!(error.column >= 1 && error.column <= line.chars().count() + 1);
            prop_assert!(!error.to_string().is_empty());
        }
    }

    #[test]
    fn nor_does_a_line_made_of_what_the_language_is_made_of(
        pieces in prop::collection::vec(prop_oneof![
            Just("MoveJoints".to_owned()), Just("Delay".to_owned()), Just("SetValveState".to_owned()),
            Just("LogTrace".to_owned()), Just("CreateVariable".to_owned()), Just("(".to_owned()),
            Just(")".to_owned()), Just(",".to_owned()), Just("\"".to_owned()), Just("\\".to_owned()),
            Just("[".to_owned()), Just("]".to_owned()), Just("-".to_owned()), Just("*".to_owned()),
            Just("//".to_owned()), Just("#".to_owned()), Just(" ".to_owned()), Just("é".to_owned()),
            Just("vars.a".to_owned()), any::<f32>().prop_map(|number| number.to_string()),
        ], 0..14),
    ) {
        let line = pieces.concat();
        match parse_line(&line, Revision::R3) {
            Ok(Some(parsed)) => {
                for argument in parsed.arguments() {
                    prop_assert_eq!(line.get(argument.offset..).map(|rest| rest.starts_with(argument.text)), Some(true));
                }
                let _ = Statement::from_parsed(&parsed, Revision::R3);
            }
            Ok(None) => {}
            Err(error) => {
                prop_assert!(line.is_char_boundary(error.offset), "{} in {:?}", error.offset, line);
                let column = line[..error.offset].chars().count() + 1;
                prop_assert_eq!(error.column, column);
            }
        }
    }

    #[test]
    fn the_offending_argument_is_where_the_error_points(
        position in 0_usize..6,
        blanks in prop::collection::vec(" {0,3}", 6),
    ) {
        let mut line = String::from("MovePose(");
        let mut column = 0;
        for (index, blank) in blanks.iter().enumerate() {
            if index > 0 {
                line.push(',');
            }
            line.push_str(blank);
            if index == position {
                column = line.chars().count() + 1;
                line.push_str("oops");
            } else {
                line.push('1');
            }
        }
        line.push(')');
        prop_assert_eq!(syntax_error(&line).0, column);
    }

    #[test]
    fn numbers_come_through_unchanged(joints in prop::array::uniform6(-69.0_f32..69.0)) {
        let [a, b, c, d, e, f] = joints;
        let line = format!("MoveJoints({a}, {b}, {c}, {d}, {e}, {f})");
        prop_assert_eq!(statement(&line), Statement::Motion(MotionCommand::MoveJoints(joints)));
    }

    #[test]
    fn a_mistyped_name_leads_to_the_right_one(row in 0_usize..191, cut in 0_usize..40) {
        let spec = TextCommandSpec::all().nth(row).unwrap();
        // One letter less, unless that is a command too.
        let cut = cut % spec.name.len();
        let mut name = spec.name.to_owned();
        name.remove(cut);
        prop_assume!(cut > 0 && TextCommandSpec::by_name(&name).is_none());
        let message = syntax_error(&name).1;
        prop_assert!(message.contains("did you mean"), "{}", message);
    }
}

/// The codes in square brackets of a cell of answers: `[2000][...] | [2001][...]`.
fn answer_codes(cell: &str) -> Vec<u16> {
    let cell = cell.split(" | ");
    cell.filter_map(|answer| answer.trim().get(1..5)?.parse().ok()).collect()
}

#[test]
fn the_answers_the_states_and_the_memory_are_those_of_the_table() {
    let mut checked = 0;
    for row in rows() {
        let name = row["name"].as_str();
        let spec = TextCommandSpec::by_name(name).unwrap();
        let mut ours: Vec<u16> =
            spec.answers().iter().chain(spec.later_messages()).map(|code| code.0).collect();
        ours.sort_unstable();
        let mut theirs = answer_codes(&row["responses"]);
        theirs.sort_unstable();
        theirs.dedup();
        // Where the chapter and Table 2 of the manual differ, or the chapter says "etc.".
        match name {
            "GetWrf" => assert_eq!((&*ours, &*theirs), (&[2013][..], &[2014][..])),
            "GetPStop2Cfg" => assert_eq!((&*ours, &*theirs), (&[2179][..], &[2178][..])),
            "GetExtToolFwVersion" => assert_eq!(ours, [2086, 2088]),
            "GetSafetyStopStatus" => assert_eq!(ours, [3032, 3070, 3083, 3086]),
            _ => assert_eq!(ours, theirs, "{name}"),
        }
        assert!(ours.iter().all(|code| Code(*code).describe().is_some()), "{name}: {ours:?}");
        let mut errors: Vec<String> = spec.errors().map(|code| code.0.to_string()).collect();
        errors.sort_unstable();
        let mut expected: Vec<&str> =
            row["errors"].split(';').filter(|cell| !cell.is_empty()).collect();
        expected.sort_unstable();
        // Its chapter asks for a robot that is ready and names no error for another.
        if name != "ResetError" {
            assert_eq!(errors, expected, "{name}");
        }
        assert_eq!(spec.is_persistent(), row["persistent"].starts_with("yes"), "{name}");
        let state = match row["allowed_state"].as_str() {
            "any" if spec.available == Some(false) => AllowedState::NotStated,
            "any" => AllowedState::Any,
            "deactivated" => AllowedState::Deactivated,
            "activated" | "activated or already homed" => AllowedState::Activated,
            "ready for motion" => AllowedState::Ready,
            "ready for motion; not in error; no safety signal" => AllowedState::ReadyAndFree,
            cell if cell.contains("homed (not in recovery") => AllowedState::HomedAndFree,
            "while saving a program" => AllowedState::Saving,
            "" => AllowedState::NotStated,
            cell => panic!("{name}: {cell}"),
        };
        assert_eq!(spec.allowed_state(), state, "{name}");
        checked += usize::from(!ours.is_empty());
    }
    assert!(checked > 120, "{checked}");
}
