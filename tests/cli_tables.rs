//! `fieldarm table` and `fieldarm decode`.
#![cfg(feature = "cli")]

mod cli_support;

use cli_support::{Scratch, run, run_with_input};
use serde_json::Value;

/// Rows of a CSV text, without its header.
fn csv_rows(text: &str) -> Vec<csv::StringRecord> {
    csv::Reader::from_reader(text.as_bytes()).records().map(|row| row.expect("CSV")).collect()
}

fn json(arguments: &[&str]) -> Value {
    let ended = run(arguments);
    assert_eq!(ended.code, Some(0), "{ended:?}");
    serde_json::from_str(&ended.stdout).expect("JSON")
}

#[test]
fn image_tables_have_the_rows_of_the_specification() {
    for (table, bits) in [("output", 480), ("input", 2016)] {
        let specification =
            std::fs::read_to_string(format!("fixtures/spec/meca500_{table}_fields.csv")).unwrap();
        let ended = run(&["table", table, "--csv"]);
        assert_eq!(ended.code, Some(0));
        let rows = csv_rows(&ended.stdout);
        assert_eq!(rows.len(), csv_rows(&specification).len(), "{table}");
        let total: u32 = rows.iter().map(|row| row[2].parse::<u32>().unwrap()).sum();
        assert_eq!(total, bits, "{table}");
        let objects = json(&["table", table, "--json"]);
        assert_eq!(objects.as_array().unwrap().len(), rows.len());
        let text = run(&["table", table]).stdout;
        assert_eq!(text.lines().count(), rows.len() + 1, "a header and the rows");
    }
}

#[test]
fn a_field_is_where_the_manual_puts_it() {
    let objects = json(&["table", "input", "--json"]);
    let fifo = objects.as_array().unwrap().iter().find(|row| row["name"] == "FifoSpace").unwrap();
    assert_eq!(fifo["byte"], 10);
    assert_eq!(fifo["type"], "u16");
    assert_eq!(fifo["object"], "6015h");
    assert_eq!(fifo["pdo"], "1A01h");
    assert_eq!(fifo["table"], 14);
}

/// The row of a table in which `key` is `value`: as JSON, and the same row of the CSV text by name.
fn row_by(table: &str, key: &str, value: &Value) -> (Value, Vec<(String, String)>) {
    let objects = json(&["table", table, "--json"]);
    let objects = objects.as_array().expect("an array");
    let position = objects.iter().position(|row| row[key] == *value).expect("a row");
    let csv_text = run(&["table", table, "--csv"]).stdout;
    let headers = csv_text.lines().next().expect("a header").split(',').map(String::from);
    let cells: Vec<String> = csv_rows(&csv_text)[position].iter().map(String::from).collect();
    (objects[position].clone(), headers.zip(cells).collect())
}

#[test]
fn every_cell_stands_under_its_own_header() {
    let cases: [(&str, &str, Value, Value); 5] = [
        (
            "output",
            "name",
            "MotionCommandID".into(),
            serde_json::json!({
                "byte": 8, "bit": 0, "bits": 32, "type": "u32", "section": "MotionCommand",
                "name": "MotionCommandID", "unit": null,
            }),
        ),
        (
            "input",
            "name",
            "FifoSpace".into(),
            serde_json::json!({
                "byte": 10, "bit": 0, "bits": 16, "type": "u16", "section": "MotionStatus",
                "name": "FifoSpace", "object": "6015h", "pdo": "1A01h", "table": 14,
            }),
        ),
        (
            "commands",
            "name",
            "SetJointLimits".into(),
            serde_json::json!({
                "name": "SetJointLimits", "meca500": true, "needs": "deactivated",
                "persistent": true,
            }),
        ),
        (
            "dynamic",
            "id",
            40.into(),
            serde_json::json!({
                "id": 40, "last_id": null, "name": "Actual joint position", "meca500": true,
            }),
        ),
        (
            "errors",
            "code",
            1016.into(),
            serde_json::json!({ "code": 1016, "kind": "error", "resettable": null }),
        ),
    ];
    for (table, key, value, expected) in cases {
        let (object, cells) = row_by(table, key, &value);
        for (name, expected) in expected.as_object().expect("an object") {
            assert_eq!(object[name], *expected, "{table}: {name} in {object}");
        }
        assert_eq!(object.as_object().expect("an object").len(), cells.len(), "{table}");
        for ((name, cell), (header, written)) in
            object.as_object().expect("an object").iter().zip(&cells)
        {
            assert_eq!(name, header, "{table}");
            let as_csv = match cell {
                Value::Null => String::new(),
                Value::Bool(yes) => if *yes { "yes" } else { "no" }.into(),
                Value::String(text) => text.clone(),
                other => other.to_string(),
            };
            assert_eq!(as_csv, *written, "{table}: {name}");
        }
    }
    let (move_lin, _) = row_by("commands", "name", &"MoveLin".into());
    assert!(move_lin["arguments"].as_str().is_some_and(|list| list.starts_with("x mm, y mm")));
    let text = run(&["table", "commands"]).stdout;
    let headers: Vec<&str> = text.lines().next().expect("a header").split_whitespace().collect();
    assert_eq!(headers.last(), Some(&"arguments"));
    let line = text.lines().find(|line| line.contains(" MoveLin ")).expect("MoveLin");
    assert!(line.ends_with("gamma deg"), "arguments are the last column: {line}");
}

#[test]
fn commands_dynamic_types_and_errors_are_listed() {
    let commands = run(&["table", "commands"]).stdout;
    assert!(commands.contains("theta2 deg [-70 to 90]"), "{commands}");
    assert!(commands.contains("p % [0.001 to 100, R4 to 150]"));
    let errors = json(&["table", "errors", "--json"]);
    let row = errors.as_array().unwrap().iter().find(|row| row["code"] == 1016).unwrap();
    assert_eq!(row["kind"], "error");
    assert!(row["text"].as_str().is_some_and(|text| text.contains("cannot be reached")));
    let dynamic = run(&["table", "dynamic", "--csv"]);
    assert!(dynamic.stdout.lines().any(|line| line.starts_with("53,")), "{}", dynamic.stdout);
}

#[test]
fn all_tables_at_once() {
    let tables = json(&["table", "--json"]);
    let names: Vec<&String> = tables.as_object().unwrap().keys().collect();
    assert_eq!(names, ["output", "input", "commands", "dynamic", "errors"]);
    let text = run(&["table"]).stdout;
    assert!(text.starts_with("Output image: what the PLC sends, 60 bytes\n\n"), "{text}");
    assert_eq!(run(&["table", "--csv"]).code, Some(2), "several tables are no CSV");
    assert_eq!(run(&["table", "inputs"]).code, Some(2));
}

/// An input image in hex: activated and homed, error 1016, FifoSpace 13000, joint 1 at 12.5 degrees,
/// slot 0 with the serial number.
fn input_image(little: bool) -> String {
    let order = |bytes: &[u8]| -> Vec<u8> {
        if little { bytes.iter().rev().copied().collect() } else { bytes.to_vec() }
    };
    let mut image = vec![0; 252];
    image[0] = 0b110;
    image[2..4].copy_from_slice(&order(&[0x03, 0xF8]));
    image[10..12].copy_from_slice(&order(&[0x32, 0xC8]));
    image[16..20].copy_from_slice(&order(&[0x41, 0x48, 0x00, 0x00]));
    image[140..144].copy_from_slice(&order(&[0, 0, 0, 3]));
    image[148..152].copy_from_slice(&order(&[0x05, 0x39, 0x7F, 0xB1]));
    image.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn decoded(arguments: &[&str], input: &str) -> Vec<Value> {
    let ended = run_with_input(&[&["decode", "--json"], arguments].concat(), input);
    assert_eq!(ended.code, Some(0), "{ended:?}");
    let rows: Value = serde_json::from_str(&ended.stdout).expect("JSON");
    rows.as_array().expect("an array").clone()
}

fn field<'a>(rows: &'a [Value], section: &str, name: &str) -> &'a Value {
    rows.iter()
        .find(|row| row["section"] == section && row["name"] == name)
        .unwrap_or_else(|| panic!("no {section}.{name}"))
}

#[test]
fn an_input_image_is_decoded_with_names_values_and_units() {
    for (little, order) in [(false, "big"), (true, "little")] {
        let rows = decoded(&["--byte-order", order], &input_image(little));
        assert_eq!(field(&rows, "RobotStatus", "Activated")["value"], 1);
        assert_eq!(field(&rows, "RobotStatus", "Busy")["value"], 0);
        let error = field(&rows, "RobotStatus", "ErrorCode");
        assert_eq!(error["value"], 1016);
        assert!(error["note"].as_str().is_some_and(|note| note.contains("cannot be reached")));
        assert_eq!(field(&rows, "MotionStatus", "FifoSpace")["value"], 13_000);
        let joint = field(&rows, "TargetJointSet", "Joint 1");
        assert_eq!((&joint["value"], &joint["unit"]), (&12.5.into(), &"deg".into()));
        assert_eq!(field(&rows, "DynamicData0", "DynamicType")["note"], "Serial number");
        let serial = field(&rows, "DynamicData0", "ValueIdx_1");
        assert_eq!(serial["value"], 87_654_321, "an integer in a Real's place");
    }
}

#[test]
fn an_output_image_is_decoded_with_the_command_it_carries() {
    let mut image = vec!["00"; 60];
    (image[5], image[7], image[11]) = ("07", "01", "03");
    (image[12], image[13]) = ("43", "16");
    let spaced = format!("# captured\n{}\n{}", image[..16].join(" "), image[16..].join(","));
    let scratch = Scratch::new("decode_output");
    let file = scratch.write("image.hex", &spaced);
    let ended = run(&["decode", &file]);
    assert_eq!(ended.code, Some(0), "{ended:?}");
    let row = |name: &str| {
        let line = ended.stdout.lines().find(|line| line.contains(&format!(" {name} ")));
        let line = line.unwrap_or_else(|| panic!("no {name} in {}", ended.stdout));
        line.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    assert_eq!(row("MotionCommandID"), "8 MotionCommand MotionCommandID 3 MoveLin");
    assert_eq!(row("Argument 1"), "12 MotionCommandArgs Argument 1 150.0 mm x");
    assert_eq!(row("Argument 4"), "24 MotionCommandArgs Argument 4 0.0 deg alpha");
}

#[test]
fn reserved_bits_show_only_when_set() {
    let mut image = "00".repeat(60);
    assert!(decoded(&[], &image).iter().all(|row| row["name"] != "(Reserved)"));
    image.replace_range(6..8, "80");
    let rows = decoded(&[], &image);
    assert_eq!(rows.iter().filter(|row| row["name"] == "(Reserved)").count(), 1);
}

#[test]
fn wrong_bytes_are_told_with_their_place() {
    let cases = [
        (&[][..], "00 0", "line 1, column 4: odd number of hex digits, `0` has no partner"),
        (&[], "00\n0g", "line 2, column 2: `g` is not a hex digit"),
        (&[], "0000", "found 2 bytes, but an output image has 60 and an input image 252"),
        (&["--output"], "00", "an output image has 60 bytes, found 1 byte"),
        (&["--input"], "", "an input image has 252 bytes, found 0 bytes"),
    ];
    for (arguments, input, message) in cases {
        let ended = run_with_input(&[&["decode"], arguments].concat(), input);
        assert_eq!(ended.code, Some(2), "{ended:?}");
        assert!(ended.stderr.starts_with("fieldarm: standard input: "), "{ended:?}");
        assert!(ended.stderr.contains(message), "{message}: {}", ended.stderr);
    }
    assert_eq!(run(&["decode", "--input", "--output"]).code, Some(2));
    let ended = run(&["decode", "nowhere.hex"]);
    assert_eq!(ended.code, Some(1));
    assert!(ended.stderr.starts_with("fieldarm: cannot read nowhere.hex: "), "{ended:?}");
}

#[test]
fn the_wrong_byte_order_is_noticed() {
    let ended = run_with_input(&["decode", "--byte-order", "big"], &input_image(true));
    assert_eq!(ended.code, Some(0));
    let hint = "note: FifoSpace 51250 is impossible (at most 13000), with --byte-order little it is \
                13000";
    assert!(ended.stderr.contains(hint), "{}", ended.stderr);
    assert_eq!(run_with_input(&["decode"], &input_image(false)).stderr, "");
}
