//! `fieldarm run --link tcp:` as a person uses it, against `fieldarm sim --tcp` in a process of its own, and
//! `--link tcp-sim`: the same programs and the same reports as over the links with cycles.
//!
//! Every test serves at a loopback address of its own, so that all can run at once, and nothing needs root.
#![cfg(all(target_os = "linux", feature = "cli"))]

mod cli_support;
#[path = "support/loopback.rs"]
mod loopback;
#[path = "support/namespaces.rs"]
mod namespaces;
#[path = "support/serving.rs"]
mod serving;

use std::net::{TcpListener, TcpStream};
use std::time::Duration;

use cli_support::{Ended, Scratch, fieldarm, run};
use loopback::address;
use namespaces::Running;
use serde_json::Value;

/// Far longer than anything here takes.
const LONG: Duration = Duration::from_secs(90);

fn serve(address: &str) -> Running {
    serving::serve(&["--tcp", address])
}

fn report(scratch: &Scratch, directory: &str) -> Value {
    let text = std::fs::read_to_string(scratch.path(&format!("{directory}/report.json")))
        .expect("the report was written");
    serde_json::from_str(&text).expect("it is JSON")
}

/// What a run says over any link: its end, its counts, and what became of every line. That a setting had
/// begun is not seen over a bus where it is done in the same cycle, so beginnings may differ.
fn common(report: &Value) -> Value {
    let steps: Vec<Value> = report["steps"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|step| {
            let has = |time: &str| !step[time].is_null();
            serde_json::json!([
                step["line"],
                step["text"],
                step["end"],
                has("submitted_s"),
                has("accepted_s"),
                has("ended_s")
            ])
        })
        .collect();
    let outcome = &report["outcome"];
    serde_json::json!({
        "schema": report["schema"], "version": report["schema_version"], "program": report["program"],
        "end": outcome["end"], "code": outcome["exit_code"], "error": outcome["robot_error"],
        "line": outcome["line"], "text": outcome["text"], "commands": report["commands"], "steps": steps,
        "columns": report["samples"]["columns"], "revision": report["settings"]["revision"],
    })
}

/// Joints of the last sample, in degrees.
fn last_joints(report: &Value) -> Vec<f64> {
    let rows = report["samples"]["rows"].as_array().expect("a list");
    let row = rows.last().expect("there are samples").as_array().expect("a row");
    row[1..7].iter().map(|joint| joint.as_f64().expect("a number")).collect()
}

#[track_caller]
fn assert_alike(cyclic: &Value, tcp: &Value) {
    assert_eq!(common(cyclic), common(tcp));
    for (one, other) in last_joints(cyclic).iter().zip(last_joints(tcp)) {
        assert!((one - other).abs() < 0.002, "{one} {other}");
    }
    let distance = |report: &Value| report["distance_mm"].as_f64().expect("a number");
    assert!((distance(cyclic) / distance(tcp) - 1.0).abs() < 0.02);
    // What only a bus has is not there, instead of being made up.
    for field in ["acknowledgement_cycles", "cycles", "final_outputs", "bus", "enip"] {
        assert!(tcp[field].is_null(), "{field}");
    }
    assert!(cyclic["tcp"].is_null() && tcp["tcp"]["lines_sent"].as_u64() > Some(10));
    assert!(tcp["settings"]["cycle_us"].is_null() && tcp["settings"]["byte_order"].is_null());
    let row = &tcp["samples"]["rows"][0];
    assert!(row[13].is_null() && row[14].is_null() && row[15].is_null(), "{row}");
}

#[test]
fn a_program_gives_the_same_report_over_either_way() {
    let scratch = Scratch::new("tcp_sim_reports");
    for name in ["square", "pick_and_place", "postures", "out_of_reach"] {
        let program = format!("programs/{name}.txt");
        let reports = ["sim", "tcp-sim"].map(|link| {
            let directory = format!("{name}-{link}");
            let path = scratch.path(&directory);
            let ended = run(&["run", &program, "--link", link, "--fast", "-q", "--report", &path]);
            let code = if name == "out_of_reach" { 3 } else { 0 };
            assert_eq!(ended.code, Some(code), "{name} {link}: {ended:?}");
            report(&scratch, &directory)
        });
        let [cyclic, tcp] = &reports;
        assert_alike(cyclic, tcp);
        assert_eq!(cyclic["outcome"], tcp["outcome"], "{name}");
    }
}

#[test]
fn a_robot_at_its_ports_runs_programs_one_after_another() {
    let scratch = Scratch::new("tcp_reports");
    let program = scratch.write(
        "short.txt",
        "SetJointVel(80)\nMoveJoints(10, -10, 10, 5, 20, 0)\nSetCheckpoint(3)\nGripperOpen()\n\
         MoveJointsVel(5, 0, 0, 0, 0, 0)\nMoveJoints(1, 2, 3, 4, 5, 6)\n",
    );
    let address = address().to_string();
    let serving = serve(&address);
    let cyclic = ["run", &program, "--fast", "-q", "--report", &scratch.path("cyclic")];
    assert_eq!(run(&cyclic).code, Some(0));
    for (number, query) in ["", "?watchdog_ms=800&interval_ms=5", &format!("?monitor={address}")]
        .into_iter()
        .enumerate()
    {
        let link = format!("tcp:{address}{query}");
        let directory = format!("tcp-{number}");
        let path = scratch.path(&directory);
        let ended = run(&["run", &program, "--link", &link, "--report", &path]);
        assert_eq!(ended.code, Some(0), "{link}: {ended:?}");
        for words in ["connected", "robot is activated, homed and ready", "checkpoint 3 reached"] {
            assert!(ended.stderr.contains(words), "{words}: {ended:?}");
        }
        assert!(ended.stdout.contains("6 of 6 done, 6 accepted"), "{ended:?}");
        let tcp = report(&scratch, &directory);
        if number == 0 {
            assert_alike(&report(&scratch, "cyclic"), &tcp);
        } else {
            // The robot is homed already, so it goes a shorter way.
            assert_eq!(common(&report(&scratch, "cyclic")), common(&tcp));
        }
        assert_eq!(tcp["tcp"]["control"], format!("{address}:10000"));
        let monitor = &tcp["tcp"]["monitor"];
        assert!(if number == 2 {
            *monitor == format!("{address}:10001")
        } else {
            monitor.is_null()
        });
        for file in ["joints.svg", "path.svg", "handshake.svg"] {
            assert!(
                std::fs::metadata(scratch.path(&format!("{directory}/{file}"))).is_ok(),
                "{file}"
            );
        }
    }
    serving::end(serving);
}

#[test]
fn several_robots_run_at_once_each_with_its_own_end() {
    let scratch = Scratch::new("tcp_several");
    let good = scratch.write("good.txt", "MoveJoints(5, 0, 0, 0, 0, 0)\n");
    let bad = scratch
        .write("bad.txt", "MoveJoints(5, 0, 0, 0, 0, 0)\nMovePose(480, 0, 180, 180, 0, 180)\n");
    let addresses = [address().to_string(), address().to_string()];
    let _serving = addresses.each_ref().map(|address| serve(address));
    let link = format!("tcp:{}", addresses.join(","));
    let directory = scratch.path("report");
    let ended = run(&["run", &good, &bad, "--link", &link, "-q", "--report", &directory]);
    assert_eq!(ended.code, Some(3), "{ended:?}");
    let [first, second] = [1, 2].map(|number| report(&scratch, &format!("report/robot-{number}")));
    assert_eq!(
        (&first["outcome"]["end"], &second["outcome"]["end"]),
        (&"completed".into(), &"robot_error".into())
    );
    assert!(
        ended.stderr.contains("robot 2:\n") && ended.stdout.contains("2 robots over tcp:"),
        "{ended:?}"
    );
    let ended = run(&["run", &good, "--link", "tcp-sim", "--robots", "3", "--fast", "-q"]);
    assert_eq!(ended.code, Some(0), "{ended:?}");
    assert_eq!(ended.stdout.matches("1 of 1 done").count(), 3, "{ended:?}");
}

#[test]
fn a_robot_is_let_go_when_its_own_run_is_over() {
    let scratch = Scratch::new("tcp_let_go");
    let short = scratch.write("short.txt", "Delay(0.01)\n");
    let long = scratch.write("long.txt", "Delay(3600)\n");
    let addresses = [address().to_string(), address().to_string()];
    let [mut first, _second] = addresses.each_ref().map(|address| serve(address));
    let link = format!("tcp:{}", addresses.join(","));
    let running = Running::start(&mut fieldarm(&["run", &short, &long, "--link", &link]));
    first.wait_for(" closed", LONG);
    let (status, said) = running.interrupt(LONG);
    assert_eq!(status.code(), Some(130), "the other one went on: {said}");
}

#[test]
fn an_interrupt_stops_the_robot_and_ends_in_good_order() {
    let scratch = Scratch::new("tcp_interrupt");
    let program =
        scratch.write("long.txt", "SetJointVel(5)\nMoveJoints(90, 0, 0, 0, 0, 0)\nDelay(3600)\n");
    let address = address().to_string();
    let serving = serve(&address);
    let link = format!("tcp:{address}");
    let mut running = Running::start(&mut fieldarm(&["run", &program, "--link", &link]));
    running.wait_for("robot is activated, homed and ready", LONG);
    let (status, said) = running.interrupt(LONG);
    assert_eq!(status.code(), Some(130), "{said}");
    let place = format!("interrupted at {program}:");
    assert!(said.contains(&place) && said.contains("Motion was paused and cleared"), "{said}");
    // The next one takes over where it stands.
    let short = scratch.write("short.txt", "Delay(0.1)\n");
    let ended = run(&["run", &short, "--link", &link, "-q"]);
    assert_eq!(ended.code, Some(0), "{ended:?}");
    drop(serving);
}

#[test]
fn a_robot_that_vanishes_ends_the_run_with_what_is_known_of_its_lines() {
    let scratch = Scratch::new("tcp_vanishes");
    let program =
        scratch.write("long.txt", "SetJointVel(5)\nMoveJoints(90, 0, 0, 0, 0, 0)\nDelay(3600)\n");
    let address = address().to_string();
    let serving = serve(&address);
    let link = format!("tcp:{address}");
    let directory = scratch.path("report");
    let arguments = ["run", &program, "--link", &link, "--report", &directory];
    let mut running = Running::start(&mut fieldarm(&arguments));
    running.wait_for("robot is activated, homed and ready", LONG);
    serving.interrupt(LONG);
    let (status, said) = running.end(LONG);
    assert_eq!(status.code(), Some(4), "{said}");
    assert!(said.contains("connection lost: "), "{said}");
    let report = report(&scratch, "report");
    assert_eq!(report["outcome"]["end"], "connection_lost");
    assert_eq!(report["steps"][2]["end"], "unknown");
}

#[test]
fn a_robot_of_another_revision_is_told_apart() {
    let scratch = Scratch::new("tcp_revision");
    let program = scratch.write("short.txt", "Delay(0)\n");
    let address = address().to_string();
    let mut serving =
        Running::start(&mut fieldarm(&["sim", "--tcp", &address, "--revision", "R4"]));
    serving.wait_for("Ctrl-C ends it", LONG);
    let link = format!("tcp:{address}");
    let words = "the robot is a revision R4, and the program was checked for R3";
    let ended = run(&["run", &program, "--link", &link]);
    assert!(ended.code == Some(0) && ended.stderr.contains(words), "{ended:?}");
    let ended = run(&["run", &program, "--link", &link, "--revision", "R4"]);
    assert!(ended.code == Some(0) && !ended.stderr.contains("revision"), "{ended:?}");
}

fn refused(arguments: &[&str], code: i32, words: &str) {
    let ended: Ended = run(&[&["run", "programs/square.txt", "-q"], arguments].concat());
    assert_eq!(ended.code, Some(code), "{arguments:?}: {ended:?}");
    assert!(ended.stderr.contains(words), "{arguments:?}: {}", ended.stderr);
}

#[test]
fn what_does_not_fit_the_link_is_refused_before_anything_moves() {
    let tcp = "tcp:127.0.0.1";
    refused(&["--link", "tcp:"], 2, "tcp needs the address of a robot");
    refused(&["--link", "tcp:300.0.0.1"], 2, "`300.0.0.1` is neither an IP address");
    refused(&["--link", tcp, "--robots", "2"], 2, "names 1 robot, --robots 2 wants another number");
    refused(&["--link", tcp, "--cycle-us", "500"], 2, "has no cycles; ?interval_ms= sets");
    refused(&["--link", tcp, "--byte-order", "big"], 2, "sends text, which has no byte order");
    refused(&["--link", tcp, "--fast"], 2, "leave --fast away, or use --link tcp-sim");
    refused(&["--link", tcp, "--sim-tool", "none"], 2, "has none");
    refused(&["--link", "tcp-sim", "--sim-byte-order", "big"], 2, "sends text");
    refused(&["--link", "tcp-sim", "--reply-limit-us", "500"], 2, "is about EtherCAT");
    let probe = run(&["probe", tcp]);
    assert_eq!(probe.code, Some(2));
    assert!(probe.stderr.contains("the text interface has none"), "{probe:?}");
}

#[test]
fn nobody_the_wrong_port_and_somebody_else_are_told_apart() {
    let address = address().to_string();
    refused(&["--link", &format!("tcp:{address}")], 4, "no connection to");
    let serving = serve(&address);
    let wrong = format!("tcp:{address}:10001");
    refused(
        &["--link", &wrong],
        4,
        "is it the control port (10000), not the monitoring port (10001)?",
    );
    let other = TcpStream::connect(format!("{address}:10000")).expect("it is served");
    refused(&["--link", &format!("tcp:{address}")], 4, "somebody else controls the robot ([3001])");
    drop(other);
    drop(serving);
    // Somebody who is no robot at all.
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let port = listener.local_addr().expect("it has one").port();
    let hangs_up = std::thread::spawn(move || drop(listener.accept()));
    refused(&["--link", &format!("tcp:127.0.0.1:{port}")], 4, "the robot did not greet");
    hangs_up.join().expect("it hung up");
}
