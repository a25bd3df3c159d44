//! `fieldarm run --report`: report.json and the plots.
#![cfg(feature = "cli")]

mod cli_support;

use cli_support::{Scratch, run};
use serde_json::Value;

struct Reported {
    _scratch: Scratch,
    json: Value,
    joints: String,
    path: String,
    handshake: String,
}

fn report(name: &str, program: &str) -> Reported {
    let scratch = Scratch::new(name);
    let directory = scratch.path("deep/report");
    let ended = run(&["run", program, "--fast", "-q", "--report", &directory]);
    let read = |file: &str| {
        let path = format!("{directory}/{file}");
        assert!(ended.stdout.contains(&path), "the summary names {path}: {}", ended.stdout);
        std::fs::read_to_string(path).expect("written")
    };
    Reported {
        json: serde_json::from_str(&read("report.json")).expect("JSON"),
        joints: read("joints.svg"),
        path: read("path.svg"),
        handshake: read("handshake.svg"),
        _scratch: scratch,
    }
}

/// Colors of the six series, as the plots write them.
const SERIES: [&str; 6] = ["#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9"];

fn curves(svg: &str, color: &str) -> usize {
    let of_color = format!("stroke=\"{color}\"");
    svg.split('<').filter(|tag| tag.starts_with("polyline") && tag.contains(&of_color)).count()
}

/// Whether tags are closed in the order they were opened: enough of XML for what plots are made of.
fn assert_well_formed(svg: &str) {
    let mut open = Vec::new();
    for tag in svg.split('<').skip(1) {
        let (tag, _) = tag.split_once('>').expect("every tag ends");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name.trim()));
        } else if !tag.ends_with('/') && !tag.starts_with(['?', '!']) {
            open.push(tag.split_whitespace().next().expect("a name"));
        }
    }
    assert!(open.is_empty(), "{open:?} are not closed");
    assert!(svg.starts_with("<svg"));
}

#[test]
fn plots_have_their_series_and_labels() {
    let reported = report("plots", "programs/square.txt");
    for svg in [&reported.joints, &reported.path, &reported.handshake] {
        assert_well_formed(svg);
        assert!(svg.contains("programs/square.txt"));
    }
    for (joint, color) in (1..).zip(SERIES) {
        assert_eq!(curves(&reported.joints, color), 1, "joint {joint}");
        assert!(reported.joints.contains(&format!("Joint {joint}")));
    }
    assert!(reported.joints.contains("time [s]") && reported.joints.contains("[deg]"));
    assert_eq!(curves(&reported.path, SERIES[0]), 3, "three sides");
    for label in ["from above", "from the right side", "from the front", "x [mm]", "z [mm]"] {
        assert!(reported.path.contains(label), "{label}");
    }
    // Sent and accepted in both panels, done in the upper one.
    assert_eq!(SERIES.map(|color| curves(&reported.handshake, color)), [2, 2, 1, 0, 0, 0]);
    for label in ["MoveID sent", "MoveID echoed", "accepted by the robot", "done"] {
        assert!(reported.handshake.contains(label), "{label}");
    }
}

#[test]
fn the_report_says_what_happened() {
    let Reported { json, .. } = &report("report_json", "programs/square.txt");
    assert_eq!(json["schema"], "fieldarm.run");
    assert_eq!(json["schema_version"], 1);
    assert_eq!(json["program"], "programs/square.txt");
    assert_eq!(json["settings"]["pace"], "simulated");
    assert_eq!(json["settings"]["byte_order"], "auto");
    assert_eq!(json["settings"]["byte_order_used"], "big");
    assert_eq!(json["outcome"]["end"], "completed");
    assert_eq!(json["outcome"]["exit_code"], 0);
    assert_eq!(json["commands"]["total"], 15);
    assert_eq!(json["commands"]["done"], 15);
    assert_eq!(json["acknowledgement_cycles"]["max"], 1.0);
    assert_eq!(json["cycles"]["overruns"], 0);
    assert_eq!(json["cycles"]["cycle_time_us"]["max"], 1_000.0);
    assert_eq!(json["final_outputs"], "00".repeat(60));

    let steps = json["steps"].as_array().expect("an array");
    assert_eq!(steps.len(), 15);
    let times = ["submitted_s", "accepted_s", "ended_s"];
    let mut last_end = 0.0;
    for step in steps {
        assert_eq!(step["end"], "done");
        let [submitted, accepted, ended] =
            times.map(|time| step[time].as_f64().unwrap_or_else(|| panic!("{time} of {step}")));
        assert!(submitted <= accepted && accepted <= ended, "{step}");
        assert!(ended >= last_end, "the robot works first in, first out: {step}");
        last_end = ended;
    }

    let columns = json["samples"]["columns"].as_array().expect("an array");
    let rows = json["samples"]["rows"].as_array().expect("an array");
    assert!(rows.len() > 1_000 && rows.len() <= 4_001, "{} rows", rows.len());
    assert!(rows.iter().all(|row| row.as_array().is_some_and(|row| row.len() == columns.len())));
    let column = |name: &str| columns.iter().position(|column| column == name).expect("a column");
    let last = rows.last().expect("rows");
    assert_eq!(last[column("done")], 15.0, "the last cycle is a sample");
    assert!(last[column("x_mm")].as_f64().is_some_and(|x| (x - 190.0).abs() < 0.01), "{last}");
    assert!(last[column("z_mm")].as_f64().is_some_and(|z| (z - 308.0).abs() < 0.01), "{last}");
}

#[test]
fn an_older_report_stays_until_the_new_one_is_whole() {
    let scratch = Scratch::new("report_again");
    let directory = scratch.path("report");
    let run = |program: &str| run(&["run", program, "--fast", "-q", "--report", &directory]);
    let names = || {
        let entries = std::fs::read_dir(&directory).expect("a directory");
        let mut names: Vec<_> = entries.map(|entry| entry.expect("an entry").file_name()).collect();
        names.sort();
        names
    };
    assert_eq!(run("programs/square.txt").code, Some(0));
    let expected = ["handshake.svg", "joints.svg", "path.svg", "report.json"];
    assert_eq!(names(), expected, "nothing unfinished is left");

    // A report that cannot be replaced fails, and the run is told all the same.
    let path = format!("{directory}/report.json");
    let first = std::fs::read_to_string(&path).expect("written");
    assert_eq!(run("programs/jog.txt").code, Some(0));
    assert_ne!(std::fs::read_to_string(&path).expect("written"), first, "replaced");
    std::fs::remove_file(&path).expect("removable");
    std::fs::create_dir(&path).expect("writable");
    let ended = run("programs/square.txt");
    assert_eq!(ended.code, Some(1), "{ended:?}");
    assert!(ended.stdout.starts_with("programs/square.txt: done\n"), "{ended:?}");
    assert_eq!(names(), expected, "nothing unfinished is left");
}

#[test]
fn names_are_escaped_in_plots() {
    let scratch = Scratch::new("report_stdin");
    let directory = scratch.path("report");
    let arguments = ["run", "-", "--fast", "-q", "--report", &directory];
    let ended = cli_support::run_with_input(&arguments, "Delay(0.01)\n");
    assert_eq!(ended.code, Some(0), "{ended:?}");
    let svg = std::fs::read_to_string(format!("{directory}/joints.svg")).expect("written");
    assert_well_formed(&svg);
    assert!(svg.contains("&lt;stdin&gt;"), "the name is text, not a tag");
}

#[test]
fn a_failed_run_is_reported_too() {
    let Reported { json, .. } = &report("report_error", "programs/out_of_reach.txt");
    assert_eq!(json["outcome"]["end"], "robot_error");
    assert_eq!(json["outcome"]["exit_code"], 3);
    assert_eq!(json["outcome"]["robot_error"], 1016);
    assert_eq!(json["outcome"]["line"], 7);
    assert_eq!(json["outcome"]["text"], "MovePose(480, 0, 180, 180, 0, 180)");
    let ends: Vec<&Value> =
        json["steps"].as_array().expect("an array").iter().map(|step| &step["end"]).collect();
    assert_eq!(ends, ["done", "done", "done", "aborted", "aborted", "aborted"]);
}
