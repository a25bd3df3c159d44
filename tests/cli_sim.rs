//! `fieldarm sim`: what it refuses, and how it and `fieldarm run` end on a network interface.
#![cfg(all(target_os = "linux", feature = "cli"))]

#[path = "support/namespaces.rs"]
mod namespaces;

use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use namespaces::{Cable, End, INTERFACE, Running};

/// Far longer than the command takes to begin or to end.
const LONG: Duration = Duration::from_secs(20);
/// A program that would take long.
const LONG_PROGRAM: &str = "MoveJoints(10, 0, 0, 0, 0, 0)\nDelay(60)\n";

/// What stands on standard error after arguments that are refused before any interface is opened.
fn refusal(arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fieldarm"));
    command.args(["sim", "--ethercat", "no-such-name"]).args(arguments);
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
    said
}

#[test]
fn impossible_robots_are_refused_with_the_argument_and_what_would_do() {
    let cases: [(&[&str], &str); 7] = [
        (&["--alias", "1,2"], "--alias: 2 aliases for 1 robot: give at most one each"),
        (&["--robots", "2", "--alias", "1,2,3"], "--alias: 3 aliases for 2 robots"),
        (&["--robots", "3", "--alias", "7,0,7"], "--alias: 7 is given twice"),
        // Any number of robots may have none.
        (&["--robots", "3", "--alias", "0,7,0"], "no network interface `no-such-name`"),
        (&["--unassigned", "1A77"], "--unassigned: no PDO 1A77 in this firmware's image"),
        (&["--unassigned", "1A08,7305"], "--unassigned: no PDO 7305 in this firmware's image"),
        (&["--unassigned", "1A08,1600"], "no network interface `no-such-name`"),
    ];
    for (arguments, message) in cases {
        let said = refusal(arguments);
        assert!(said.contains(message), "{arguments:?}: {said}");
    }
    let said = refusal(&["--unassigned", "1A77"]);
    assert!(said.contains("there are 1600, 1601") && said.contains(", 1A08"), "{said}");
}

#[test]
fn its_help_tells_its_own_exit_codes() {
    let output = Command::new(env!("CARGO_BIN_EXE_fieldarm")).args(["sim", "--help"]).output();
    let said = String::from_utf8_lossy(&output.unwrap().stdout).into_owned();
    for code in
        ["0  ended with Ctrl-C", "2  bad usage", "4  the interface", "130  ended by a second"]
    {
        assert!(said.contains(code), "{code}: {said}");
    }
}

/// `fieldarm` at `end`, before others where that may be.
fn fieldarm(cable: &Cable, end: End, arguments: &[&str]) -> Command {
    let tried = Command::new("chrt").args(["--fifo", "1", "true"]).output();
    if !tried.is_ok_and(|tried| tried.status.success()) {
        return cable.fieldarm(end, arguments);
    }
    let mut command = cable.command(end, "chrt");
    command.args(["--fifo", "1", env!("CARGO_BIN_EXE_fieldarm")]).args(arguments);
    command
}

fn serve(cable: &Cable) -> Running {
    let arguments = ["sim", "--ethercat", INTERFACE];
    let mut serving = Running::start(&mut fieldarm(cable, End::Robots, &arguments));
    serving.wait_for("Ctrl-C ends it", LONG);
    serving
}

#[test]
fn who_asks_it_to_stop_is_answered_with_0_and_the_figures() {
    for signal in ["-INT", "-TERM", "-HUP"] {
        let Some(cable) = Cable::plug() else { return };
        let serving = serve(&cable);
        serving.signal(signal);
        let (status, said) = serving.end(LONG);
        assert_eq!(status.code(), Some(0), "{signal}: {said}");
        assert!(said.contains("0 frames received, 0 returned"), "{signal}: {said}");
    }
}

/// A robot that has begun to move over the cable.
fn running(cable: &Cable, name: &str) -> Running {
    let program = PathBuf::from(env!("CARGO_TARGET_TMPDIR"))
        .join(format!("{name}-{}.txt", std::process::id()));
    fs::write(&program, LONG_PROGRAM).unwrap();
    let link = format!("ethercat:{INTERFACE}");
    let mut command = fieldarm(cable, End::Main, &["run", "--link", &link]);
    let mut running = Running::start(command.arg(program));
    running.wait_for("activated, homed", 2 * LONG);
    running
}

#[test]
fn a_run_whose_interface_is_removed_says_so_and_ends() {
    let Some(cable) = Cable::plug() else { return };
    let serving = serve(&cable);
    let running = running(&cable, "removed");
    cable.cut();
    let (status, said) = running.end(LONG);
    assert_eq!(status.code(), Some(4), "{said}");
    assert!(said.contains("network interface ecat0 was removed: No such device"), "{said}");
    let (status, said) = serving.end(LONG);
    assert_eq!(status.code(), Some(4), "{said}");
    assert!(said.contains("ecat0: No such device"), "{said}");
}

#[test]
fn an_interface_that_is_only_down_is_not_called_removed() {
    let Some(cable) = Cable::plug() else { return };
    let serving = serve(&cable);
    let running = running(&cable, "down");
    cable.set_up(End::Main, false);
    let (status, said) = running.end(LONG);
    assert_eq!(status.code(), Some(4), "{said}");
    assert!(said.contains("connection lost") && !said.contains("removed"), "{said}");
    let (status, said) = serving.interrupt(LONG);
    assert_eq!(status.code(), Some(0), "{said}");
}
