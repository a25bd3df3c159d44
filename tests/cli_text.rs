//! `fieldarm text` with lines from a pipe, and its look at the monitoring port, against `fieldarm sim`.
//!
//! Every test serves at a loopback address of its own. The prompt at a terminal is in `cli_text_prompt.rs`.
#![cfg(all(target_os = "linux", feature = "cli"))]

mod cli_support;
#[path = "support/loopback.rs"]
mod loopback;
#[path = "support/namespaces.rs"]
mod namespaces;
#[path = "support/serving.rs"]
mod serving;

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::Stdio;

use cli_support::{Ended, fieldarm, run, run_with_input};
use loopback::address;
use namespaces::Running;
use serving::{LONG, serve};

struct Robot {
    serving: Running,
    address: String,
}

impl Robot {
    fn start() -> Self {
        let address = address().to_string();
        Self { serving: serve(&["--tcp", &address]), address }
    }

    fn text(&self, options: &[&str], input: &str) -> Ended {
        run_with_input(&[&["text", &self.address], options].concat(), input)
    }
}

#[track_caller]
fn expect(ended: &Ended, code: i32, stdout: &[&str], stderr: &[&str]) {
    assert_eq!(ended.code, Some(code), "{ended:?}");
    for words in stdout {
        assert!(ended.stdout.contains(words), "no `{words}`:\n{}", ended.stdout);
    }
    for words in stderr {
        assert!(ended.stderr.contains(words), "no `{words}`:\n{}", ended.stderr);
    }
}

#[test]
fn lines_are_answered_in_words_and_executed_to_their_end() {
    let robot = Robot::start();
    let ended = robot.text(
        &[],
        "# up\nActivateRobot\nHome()\n\nSetJointVel(100) // quick\nMoveJoints(30, 0, 0, 0, 20, 0)\nSetCheckpoint(5)\n",
    );
    let said = [
        "[3000] Connected.",
        "[2000] The robot is activated.\n",
        "[2002] The robot is homed.\n",
        "[3030] A checkpoint was reached: 5\n",
    ];
    expect(&ended, 0, &said, &[]);
    assert_eq!(ended.stderr, "", "{ended:?}");
    // What is only ours is not told.
    assert!(!ended.stdout.contains("[2097]") && !ended.stdout.contains("8000"), "{}", ended.stdout);
    // It was not stopped by the end of the connection.
    let there = robot.text(&[], "GetRtJointPos\nGetStatusRobot\n:state\n");
    let said = ["theta1 = 30 deg", "theta5 = 20 deg", "[2007] activated, homed, idle"];
    expect(&there, 0, &said, &[]);
    assert!(!there.stdout.contains('\u{1b}'), "colour is for terminals: {:?}", there.stdout);
    // What is recorded is executed too, and to its end.
    let saving = "StartSaving(3)\nMoveJoints(-30,0,0,0,20,0)\nStopSaving\n";
    expect(&robot.text(&[], saving), 0, &["[2060]", "(1 commands saved.)"], &[]);
    expect(&robot.text(&[], "GetRtJointPos\n"), 0, &["theta1 = -30 deg"], &[]);
    let raw = robot.text(&["--raw"], "GetRobotName\nSetBlending(50)\nGetBlending\n:quit\nHome\n");
    expect(&raw, 0, &["[3000][Connected to Meca500", "\n[2095][", "\n[2150][50]\n"], &[]);
    assert!(!raw.stdout.contains("[2002]"), "after :quit: {}", raw.stdout);
}

#[test]
fn a_line_that_would_be_refused_is_not_sent() {
    let robot = Robot::start();
    let ended = robot.text(&[], "GetRobotName\nMoveJoints(0, 200, 0, 0, 0, 0)\nGetFwVersion\n");
    let remedy =
        ["line 2: not sent: column 15", "-70 to 90 deg", "[1003]", "with !", "--keep-going"];
    expect(&ended, 2, &["[2095]"], &remedy);
    assert!(!ended.stdout.contains("[1003]") && !ended.stdout.contains("[2081]"), "{ended:?}");
    let ended = robot.text(&["--keep-going"], "getfwversion\nGetFwVersion\n");
    expect(&ended, 2, &["[2081]"], &["did you mean `GetFwVersion`?", "it is: GetFwVersion"]);
    let ended = robot.text(&[], ":stat\nGetFwVersion\n");
    expect(&ended, 2, &[], &["line 1: there is no `:stat`; there are :help, :state, :quit"]);
    assert!(!ended.stdout.contains("[2081]"), "{ended:?}");
    let ended = robot.text(&[], "!SetEob(7)\nGetFwVersion\n");
    expect(&ended, 3, &["[1003]"], &["line 1: SetEob(7): 1003"]);
    assert!(!ended.stdout.contains("[2081]"), "{ended:?}");
}

#[test]
fn who_does_not_read_has_his_commands_executed() {
    let robot = Robot::start();
    let mut command = fieldarm(&["text", &robot.address]);
    let mut child = command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    drop(child.stdout.take());
    let lines = b":help\n:state\nSetRobotName(unread)\n";
    child.stdin.take().expect("piped").write_all(lines).expect("it reads its input");
    let ended: Ended = child.wait_with_output().expect("the command ends").into();
    expect(&ended, 0, &[], &[]);
    assert_eq!(ended.stderr, "");
    expect(&robot.text(&[], "GetRobotName\n"), 0, &["unread"], &[]);
}

#[test]
fn an_error_of_the_robot_ends_it() {
    let robot = Robot::start();
    let ended = robot.text(&[], "Home\nGetFwVersion\n");
    let words = ["line 1: Home: 1005: The command needs an activated robot."];
    expect(&ended, 3, &["[1005] The command needs an activated robot.", "Remedy: "], &words);
    assert!(!ended.stdout.contains("[2081]"), "{ended:?}");
    // A motion command has no answer, and its error is found all the same.
    let ended = robot.text(&[], "MoveJoints(0,0,0,0,0,0)\nGetFwVersion\n");
    expect(&ended, 3, &["[1005]"], &["line 1: MoveJoints"]);
    assert!(!ended.stdout.contains("[2081]"), "{ended:?}");
    let ended = robot.text(&["-k"], "Home\nGetFwVersion\n");
    expect(&ended, 3, &["[1005]", "[2081]"], &["line 1"]);
    // An error on the way, after all lines were taken.
    let ended = robot.text(&[], "ActivateRobot\nHome\nMovePose(5000,0,0,0,0,0)\n");
    assert_eq!(ended.code, Some(3), "{ended:?}");
}

#[test]
fn who_comes_second_learns_why_and_what_to_do() {
    let robot = Robot::start();
    let mut first = TcpStream::connect(format!("{}:10000", robot.address)).unwrap();
    first.set_read_timeout(Some(LONG)).unwrap();
    assert_ne!(first.read(&mut [0; 64]).unwrap(), 0);
    let ended = robot.text(&[], "GetFwVersion\n");
    expect(&ended, 4, &[], &["[3001]", "controlled by somebody else", "Remedy: ", "--monitor"]);
    assert_eq!(ended.stdout, "");
    drop(first);
}

#[test]
fn wrong_addresses_and_ports_are_told_apart() {
    let robot = Robot::start();
    let nobody = address().to_string();
    let silent = TcpListener::bind((nobody.as_str(), 12_345)).unwrap();
    let at = |place: &str| run(&["text", place, "--limit", "0.5"]);
    expect(&at(&nobody), 4, &[], &["nobody listens at", "Remedy: ", "EtherCAT mode"]);
    expect(&at(&format!("{nobody}:12345")), 4, &[], &["no robot greets", "10001"]);
    let monitoring = at(&format!("{}:10001", robot.address));
    expect(&monitoring, 4, &[], &["answers nothing", "10001", "--monitor"]);
    let control = run(&["text", &format!("{}:10000", robot.address), "--monitor"]);
    expect(&control, 4, &[], &["no monitoring port", "10001"]);
    expect(&at("203.0.113.7"), 4, &[], &["203.0.113.7:10000", "Remedy: "]);
    expect(&at("300.0.0.1"), 2, &[], &["neither an IP address nor the name", ":10000"]);
    expect(&at(&format!("{nobody}:0")), 2, &[], &["1 to 65535"]);
    expect(&at("localhost:1"), 4, &[], &["nobody listens at 127.0.0.1:1", "Remedy: "]);
    for options in [
        &["--monitor", "--watchdog", "1"][..],
        &["--history", "x", "--no-history"],
        &["--limit", "0"],
    ] {
        let ended = run(&[&["text", &nobody], options].concat());
        assert_eq!(ended.code, Some(2), "{options:?}: {ended:?}");
    }
    drop(silent);
}

#[test]
fn a_robot_that_goes_away_ends_it() {
    let robot = Robot::start();
    let mut command = fieldarm(&["text", &robot.address]);
    let mut child = command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    input.write_all(b"GetFwVersion\n").unwrap();
    let mut said = String::new();
    let mut output = child.stdout.take().unwrap();
    let mut room = [0; 256];
    while !said.contains("[2081]") {
        let count = output.read(&mut room).unwrap();
        assert_ne!(count, 0, "ended: {said}");
        said.push_str(&String::from_utf8_lossy(&room[..count]));
    }
    // Its input stays open.
    robot.serving.signal("-KILL");
    let ended: Ended = child.wait_with_output().unwrap().into();
    assert_eq!(ended.code, Some(4), "{ended:?}");
    assert!(ended.stderr.contains("Remedy: "), "{ended:?}");
    drop(input);
}

#[test]
fn ctrl_c_stops_a_robot_that_moves() {
    let robot = Robot::start();
    let up = robot.text(&[], "ActivateRobot\nHome\n");
    assert_eq!(up.code, Some(0), "{up:?}");
    let program = "SetJointVel(1)\nMoveJoints(100,0,0,0,0,0)\nGetFwVersion\n";
    let scratch = cli_support::Scratch::new("text_ctrl_c");
    let file = std::fs::File::open(scratch.write("slow.txt", program)).unwrap();
    let mut child = fieldarm(&["text", &robot.address])
        .stdin(file)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut output = child.stdout.take().unwrap();
    let (mut said, mut room) = (String::new(), [0; 256]);
    while !said.contains("[2081]") {
        let count = output.read(&mut room).unwrap();
        assert_ne!(count, 0, "ended: {said}");
        said.push_str(&String::from_utf8_lossy(&room[..count]));
    }
    let id = child.id().to_string();
    assert!(std::process::Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    let ended: Ended = child.wait_with_output().unwrap().into();
    expect(&ended, 130, &[], &["interrupted"]);
    let after = robot.text(&[], "GetStatusRobot\n");
    expect(&after, 0, &["paused"], &[]);
}

#[test]
fn a_monitor_watches_while_somebody_else_controls() {
    let robot = Robot::start();
    let mut monitor = Running::start(&mut fieldarm(&["text", &robot.address, "--monitor"]));
    monitor.wait_for("[2007] not activated, not homed, idle", LONG);
    let ended = robot.text(&[], "ActivateRobot\nHome\nMoveJoints(1,0,0,0,0,0)\n");
    assert_eq!(ended.code, Some(0), "{ended:?}");
    monitor.wait_for("[2007] activated, homed", LONG);
    monitor.wait_for("theta1 = 1 deg", LONG);
    let (status, said) = monitor.interrupt(LONG);
    assert_eq!(status.code(), Some(0), "{said}");
    // The same again and again is told once, and time stamps are not.
    assert!(!said.contains("[2230]"), "{said}");
    let mut raw = Running::start(&mut fieldarm(&["text", &robot.address, "--monitor", "--raw"]));
    raw.wait_for("\n[2230][", LONG);
    raw.signal("-TERM");
    assert_eq!(raw.end(LONG).0.code(), Some(0));
    let mut watching = Running::start(&mut fieldarm(&["text", &robot.address, "--monitor"]));
    watching.wait_for("[2007]", LONG);
    drop(robot);
    let (status, said) = watching.end(LONG);
    assert_eq!(status.code(), Some(4), "{said}");
    assert!(said.contains("Remedy: "), "{said}");
}

#[test]
fn the_watchdog_is_fed_while_lines_are_waited_for() {
    let robot = Robot::start();
    let input = "ActivateRobot\nHome\nGetSafetyStopStatus(3086)\n";
    let ended = robot.text(&["--watchdog", "0.5"], input);
    expect(&ended, 0, &["[2177]", "[3086] clear"], &[]);
}

#[test]
fn help_tells_codes_and_examples() {
    let ended = run(&["text", "--help"]);
    expect(&ended, 0, &["--monitor", "Exit codes:", "130", "Examples:", ":help"], &[]);
    let robot = Robot::start();
    let ended = robot.text(&[], ":help\n:help delay\n");
    expect(&ended, 0, &["Tab completes", "Delay(t)", "programming manual 11.3.84"], &[]);
}
