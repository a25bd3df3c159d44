//! Whoever stands beside the virtual robots of `fieldarm sim`: scenario files and kept state, as somebody
//! sees them who is connected over TCP. Keys have a test of their own, `cli_keys.rs`.
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
#[path = "support/text_line.rs"]
mod text_line;

use std::io::{Read, Write};
use std::time::{Duration, Instant};

use cli_support::{Scratch, run};
use loopback::address;
use serving::{LONG, end, serve};
use text_line::Line;

/// The places of these words in what was said, which come in this order.
fn in_order(said: &str, words: &[&str]) {
    let mut from = 0;
    for word in words {
        let place = said[from..].find(word);
        from += place.unwrap_or_else(|| panic!("no `{word}` after the others: {said}"));
    }
}

fn activate_and_home(control: &mut Line) {
    control.ask("ActivateRobot", "[2000]");
    control.ask("Home", "[2002]");
}

#[test]
fn stops_are_told_in_the_manuals_order() {
    let (address, scratch) = (address().to_string(), Scratch::new("scenario_stops"));
    let scenario = scratch.write(
        "stops.txt",
        "wait homed\npstop2 press\n+20ms pstop2 release\nwait ready // resumed\n\
         estop press\nwait deactivated\n+20ms estop release\n+20ms reset\n",
    );
    let arguments = ["--tcp", &address, "--revision", "r4", "--scenario", &scenario];
    let mut serving = serve(&arguments);
    let mut control = Line::controlling(&address);
    activate_and_home(&mut control);
    control.expect("[3032][1]");
    control.expect("[3032][2]");
    control.ask("ResumeMotion", "[2043]");
    control.expect("[3032][0]");
    for message in ["[3070][1]", "[2044]", "[2004]", "[3070][2]", "[3070][0]"] {
        control.expect(message);
    }
    control.ask("ActivateRobot", "[2000]");
    serving.wait_for("the scenario is at its end", LONG);
    let said = end(serving);
    in_order(
        &said,
        &[
            "waits until the robot is homed\n",
            " s: is so: the robot is homed\n",
            " s: P-Stop 2 pressed\n",
            " s: P-Stop 2 released; ResumeMotion resets it\n",
            "is so: the robot is ready\n",
            " s: E-Stop pressed\n",
            " s: E-Stop released; the Reset button resets it\n",
            " s: Reset pressed: the motors can be powered\n",
        ],
    );
}

#[test]
fn a_blocked_joint_ends_a_move_with_an_error() {
    let (address, scratch) = (address().to_string(), Scratch::new("scenario_blocked"));
    let scenario =
        scratch.write("block.txt", "wait homed\nblock joint 1\nwait error\nunblock joint 1\n");
    let mut serving = serve(&["--tcp", &address, "--scenario", &scenario]);
    let mut control = Line::controlling(&address);
    activate_and_home(&mut control);
    serving.wait_for("joint 1 is blocked at 0.00 deg", LONG);
    control.ask("MoveJoints(40, 0, 0, 0, 0, 0)", "[3005]");
    serving.wait_for("joint 1 is free", LONG);
    control.ask("ResetError", "[2005]");
    control.ask("ResumeMotion", "[2043]");
    control.ask("MoveJoints(40, 0, 0, 0, 0, 0)", "[3012]");
    control.ask("GetJoints", "[2026][40.0000,0.0000,");
    end(serving);
}

#[test]
fn nothing_passes_a_pulled_cable() {
    let (first, scratch) = (address(), Scratch::new("scenario_cable"));
    let second = std::net::Ipv4Addr::from_bits(first.to_bits() + 1).to_string();
    let first = first.to_string();
    // Whoever connects to the second robot has the first one's cable plugged again.
    let scenario = scratch.write(
        "cable.txt",
        "robot 1 wait connected\nrobot 1 cable pull enip\nrobot 1 cable pull\n\
         robot 2 wait connected\nrobot 1 cable plug tcp\n",
    );
    let scenario = scenario.as_str();
    let mut serving = serve(&["--tcp", &first, "--robots", "2", "--scenario", scenario]);
    let mut control = Line::controlling(&first);
    serving.wait_for("robot 1: the cable pulled", LONG);
    control.stream.write_all(b"GetFwVersion\0").expect("the other end is not missed yet");
    let mut heard = Vec::new();
    for _ in 0..10 {
        let mut room = [0; 4096];
        // Most often nothing comes until its time is over.
        let count = control.stream.read(&mut room).unwrap_or(0);
        heard.extend_from_slice(&room[..count]);
    }
    let heard = String::from_utf8_lossy(&heard);
    assert!(!heard.contains("[2081]"), "{heard}");
    let _second = Line::controlling(&second);
    serving.wait_for("robot 1: the TCP cable plugged", LONG);
    control.expect("[2081]");
    let said = end(serving);
    assert!(
        said.contains("the EtherNet/IP cable cannot be pulled: nothing is served there"),
        "{said}"
    );
}

#[test]
fn the_power_goes_and_comes() {
    let (address, scratch) = (address().to_string(), Scratch::new("scenario_power"));
    let scenario = scratch.write(
        "power.txt",
        "wait connected\npower off\nwait disconnected\npower on\nwait deactivated\nreset\n\
         wait connected\npower cycle\nwait deactivated\nquit\n",
    );
    let mut serving = serve(&["--tcp", &address, "--scenario", &scenario]);
    Line::controlling(&address).expect_end();
    serving.wait_for("Reset pressed: the motors can be powered", LONG);
    let mut control = Line::controlling(&address);
    control.expect_end();
    let (status, said) = serving.end(LONG);
    assert_eq!(status.code(), Some(0), "{said}");
    in_order(
        &said,
        &["power off\n", "power on: ", "power cut for a moment", "ends the simulation"],
    );
}

#[test]
fn the_example_is_a_scenario() {
    let address = address().to_string();
    let example = "examples/scenarios/first_shift.txt";
    let mut serving = serve(&["--tcp", &address, "--scenario", example]);
    serving.wait_for("waits until the robot is connected", LONG);
    end(serving);
}

#[test]
fn a_scenario_with_mistakes_serves_nothing() {
    let (address, scratch) = (address().to_string(), Scratch::new("scenario_bad"));
    let path = scratch.write("bad.txt", "1s estop press\n2s jump\n0.5 s robot 2 reset\n");
    let ended = run(&["sim", "--tcp", &address, "--scenario", &path]);
    assert_eq!(ended.code, Some(2), "{}", ended.stderr);
    let lines: Vec<&str> = ended.stderr.lines().collect();
    assert!(lines[0].starts_with(&format!("{path}:2:4: no event: `jump`; there are estop,")));
    assert!(lines[1].starts_with(&format!("{path}:3:1: too early: line 2 is due at 2 s")));
    assert_eq!(lines[2], format!("2 errors in {path}; nothing was served"));
    let ended = run(&["sim", "--tcp", &address, "--scenario", &scratch.path("none.txt")]);
    assert_eq!(ended.code, Some(1), "{}", ended.stderr);
    assert!(ended.stderr.contains("cannot read") && ended.stderr.contains("none.txt"));
}

#[test]
fn what_a_robot_keeps_outlives_the_process() {
    let (address, scratch) = (address().to_string(), Scratch::new("state_kept"));
    let directory = scratch.path("robots");
    let arguments = ["--tcp", &address, "--state", &directory];
    let serving = serve(&arguments);
    let mut control = Line::controlling(&address);
    control.ask("SetRobotName(left-arm)", "[");
    control.ask("SetPStop2Cfg(2)", "[2178]");
    control.ask("SetJointLimits(1, -90, 91.5)", "[2092]");
    control.ask("SetJointLimitsCfg(1)", "[2093]");
    control.ask("CreateVariable(width, 12.5, 10001)", "[");
    control.ask("StartSaving(1)", "[2060]");
    control.ask("MoveJoints(vars.width, 0, 0, 0, 0, 0)", "");
    control.ask("SetOfflineProgramLoop(1)", "");
    control.ask("StopSaving", "[2061][1 commands saved.]");
    // Another process keeps away meanwhile.
    let ended = run(&["sim", "--tcp", &loopback::address().to_string(), "--state", &directory]);
    assert_eq!(ended.code, Some(1), "{}", ended.stderr);
    assert!(ended.stderr.contains("another process serves robots from this directory"));
    drop(control);
    end(serving);

    let serving = serve(&arguments);
    let mut control = Line::controlling(&address);
    control.ask("GetRobotName", "[2095][left-arm]");
    control.ask("GetPStop2Cfg", "][2]");
    control.ask("GetJointLimits(1)", ",-90,91.5]");
    control.ask("GetVariable(width)", "12.5");
    activate_and_home(&mut control);
    control.ask("StartProgram(1)", "[2063]");
    control.expect("[3012]");
    control.ask("GetJoints", "[2026][12.5000,0.0000,");
    drop(control);
    end(serving);

    // The arm stays where it was.
    let serving = serve(&arguments);
    let mut control = Line::controlling(&address);
    control.ask("GetJoints", "[2026][12.5000,0.0000,");
    drop(control);
    end(serving);
}

#[test]
fn what_is_kept_is_written_before_the_end() {
    let (address, scratch) = (address().to_string(), Scratch::new("state_soon"));
    let directory = scratch.path("robots");
    let serving = serve(&["--tcp", &address, "--state", &directory]);
    let mut control = Line::controlling(&address);
    control.ask("SetRobotName(soon)", "[");
    let file = format!("{directory}/robot-1.json");
    let deadline = Instant::now() + LONG;
    // Whenever it can be read it is whole.
    loop {
        if let Ok(text) = std::fs::read_to_string(&file) {
            let whole: serde_json::Value = serde_json::from_str(&text).expect("it is JSON");
            if whole["settings"]["SetRobotName"] == "soon" {
                break;
            }
        }
        assert!(Instant::now() < deadline, "not written");
        std::thread::sleep(Duration::from_millis(5));
    }
    // Nobody asks it to end.
    serving.signal("-KILL");
    let (_, said) = serving.end(LONG);
    let mut serving = serve(&["--tcp", &address, "--state", &directory]);
    Line::controlling(&address).ask("GetRobotName", "[2095][soon]");
    serving.wait_for("control connection", LONG);
    end(serving);
    assert!(!said.contains("--state"), "{said}");
}

#[test]
fn a_damaged_state_is_left_alone() {
    let (address, scratch) = (address().to_string(), Scratch::new("state_damaged"));
    let directory = scratch.path("robots");
    std::fs::create_dir_all(&directory).expect("the scratch directory can be written");
    let damaged = "{\n  \"fieldarm_robot_state\": 1,\n  \"serial_number\": 87654321,\n  \"vari";
    let file = scratch.write("robots/robot-1.json", damaged);
    let ended = run(&["sim", "--tcp", &address, "--state", &directory]);
    assert_eq!(ended.code, Some(2), "{}", ended.stderr);
    assert!(ended.stderr.starts_with(&format!("{file}:4:")), "{}", ended.stderr);
    assert!(ended.stderr.contains("stays as it is and nothing was served"), "{}", ended.stderr);
    assert_eq!(std::fs::read_to_string(&file).expect("it is there"), damaged);
    let wrong = "{\"fieldarm_robot_state\": 1, \"serial_number\": 1}";
    let file = scratch.write("robots/robot-1.json", wrong);
    let ended = run(&["sim", "--tcp", &address, "--state", &directory]);
    assert_eq!(ended.code, Some(2), "{}", ended.stderr);
    assert!(
        ended.stderr.starts_with(&format!("{file}: it belongs to the robot")),
        "{}",
        ended.stderr
    );
    // What is no directory is named too.
    let ended = run(&["sim", "--tcp", &address, "--state", &file]);
    assert_eq!(ended.code, Some(1), "{}", ended.stderr);
    assert!(ended.stderr.contains("cannot make this directory"), "{}", ended.stderr);
}
