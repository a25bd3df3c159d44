//! Ctrl-C: the robot is paused and cleared, outputs are left safe, and all that in bounded time.
#![cfg(all(unix, feature = "cli"))]

mod cli_support;

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};

use cli_support::{Scratch, fieldarm};

#[test]
fn ctrl_c_pauses_clears_and_leaves_zeros() {
    interrupt_with(&["-INT"]);
}

#[test]
fn the_signal_to_end_does_the_same() {
    interrupt_with(&["-TERM"]);
}

#[test]
fn a_closed_terminal_does_the_same_though_it_tells_twice() {
    interrupt_with(&["-HUP", "-HUP"]);
}

fn interrupt_with(signals: &[&str]) {
    let scratch = Scratch::new(&format!("interrupt{}", signals.concat()));
    let program = scratch.write("long.txt", "SetCheckpoint(1)\nDelay(3600)\nSetCheckpoint(2)\n");
    let report = scratch.path("report");
    std::fs::create_dir(&report).expect("writable");
    std::fs::write(format!("{report}/report.json"), "earlier").expect("writable");
    let mut child = fieldarm(&["run", &program, "--report", &report])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    let mut stderr = BufReader::new(child.stderr.take().expect("piped"));
    let mut said = String::new();
    while !said.contains("checkpoint 1 reached") {
        let read = stderr.read_line(&mut said).expect("readable");
        assert_ne!(read, 0, "ended too early: {said}");
    }
    // What was there before stays until the report is whole.
    let earlier = format!("{report}/report.json");
    assert_eq!(std::fs::read_to_string(&earlier).expect("still there"), "earlier");
    for signal in signals {
        let killed = Command::new("kill").args([signal, &*child.id().to_string()]).status();
        assert!(killed.expect("kill is there").success());
    }
    stderr.read_to_string(&mut said).expect("readable");
    let mut stdout = String::new();
    child.stdout.take().expect("piped").read_to_string(&mut stdout).expect("readable");
    let status = child.wait().expect("it ends");

    assert_eq!(status.code(), Some(130), "{said}");
    let place = format!("interrupted at {program}:2: Delay(3600)");
    assert!(said.contains(&place), "{said}");
    assert!(said.contains("Motion was paused and cleared, both confirmed by the robot"), "{said}");
    assert!(stdout.contains(": interrupted at line 2\n"), "{stdout}");

    let report = std::fs::read_to_string(format!("{report}/report.json")).expect("written");
    let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
    assert_eq!(report["outcome"]["end"], "interrupted");
    assert_eq!(report["outcome"]["stop"], "confirmed");
    assert_eq!(report["final_outputs"], "00".repeat(60), "the safe image is all zero");
    assert_eq!(report["steps"][1]["end"], "aborted");
    assert_eq!(report["steps"][2]["end"], "aborted");
}

#[test]
fn ctrl_c_stops_every_robot_that_still_runs() {
    let scratch = Scratch::new("interrupt_robots");
    let long = scratch.write("long.txt", "SetCheckpoint(1)\nDelay(3600)\nSetCheckpoint(2)\n");
    // Needs no homing, so it ends long before the others begin.
    let short = scratch.write("short.txt", "ActivateSim()\n");
    let report = scratch.path("report");
    let programs = [&*long, &short, &long];
    let flags = ["run", "--robots", "3", "--report", &report];
    let mut child = fieldarm(&[&flags[..], &programs].concat())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    let mut stderr = BufReader::new(child.stderr.take().expect("piped"));
    let mut said = String::new();
    while [1, 3].iter().any(|robot| !said.contains(&format!("robot {robot}: checkpoint 1 reached")))
    {
        let read = stderr.read_line(&mut said).expect("readable");
        assert_ne!(read, 0, "ended too early: {said}");
    }
    let killed = Command::new("kill").args(["-INT", &*child.id().to_string()]).status();
    assert!(killed.expect("kill is there").success());
    stderr.read_to_string(&mut said).expect("readable");
    let mut stdout = String::new();
    child.stdout.take().expect("piped").read_to_string(&mut stdout).expect("readable");
    let status = child.wait().expect("it ends");

    assert_eq!(status.code(), Some(130), "{said}");
    for (robot, end) in [(1, "interrupted"), (2, "completed"), (3, "interrupted")] {
        let path = format!("{report}/robot-{robot}/report.json");
        let json = std::fs::read_to_string(path).expect("written");
        let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        assert_eq!(json["outcome"]["end"], end, "robot {robot}: {said}");
        let stop = if end == "interrupted" { "confirmed" } else { "not_needed" };
        assert_eq!(json["outcome"]["stop"], stop, "robot {robot}: {said}");
        assert_eq!(json["final_outputs"], "00".repeat(60), "robot {robot}");
        let place = format!("robot {robot}:\ninterrupted at {long}:2: Delay(3600)\n");
        assert_eq!(said.contains(&place), end == "interrupted", "{said}");
    }
    assert!(stdout.contains(&format!("robot 2: {short}: done\n")), "{stdout}");
}
