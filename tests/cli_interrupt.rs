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
