//! The keys and the status line of `fieldarm sim` on a terminal, which is a pseudo-terminal here.
//!
//! The command `setsid` (util-linux) makes it the controlling terminal; without it the tests say so and
//! pass, but never in CI.
#![cfg(all(target_os = "linux", feature = "cli"))]

#[path = "support/loopback.rs"]
mod loopback;
#[path = "support/namespaces.rs"]
mod namespaces;
#[path = "support/terminal.rs"]
mod terminal;

use std::process::Command;
use std::thread;
use std::time::Duration;

use loopback::address;
use namespaces::skip;
use rustix::process::{Signal, kill_process};
use terminal::Terminal;

/// `fieldarm sim` at an address of its own, on a terminal that it controls; `None` where that cannot be had.
fn start(arguments: &[&str]) -> Option<Terminal> {
    let address = address().to_string();
    let command = [env!("CARGO_BIN_EXE_fieldarm"), "sim", "--tcp", &address];
    run(&[&command[..], arguments].concat())
}

/// A command, as a person at the terminal runs it.
fn run(command: &[&str]) -> Option<Terminal> {
    if Command::new("setsid").arg("--version").output().is_err() {
        return skip("needs the command `setsid` (package util-linux)");
    }
    Some(Terminal::start(Command::new("setsid").arg("--ctty").args(command)))
}

#[test]
fn keys_act_and_the_line_below_shows_it() {
    let Some(mut terminal) = start(&["--revision", "r4"]) else { return };
    terminal.expect("Ctrl-C ends it");
    terminal.expect("deactivated   nobody controls it");
    terminal.press("h");
    terminal.expect("e E-Stop, press and release");
    terminal.press("e");
    terminal.expect("E-Stop pressed");
    terminal.expect("deactivated   E-Stop   nobody");
    terminal.press("e");
    terminal.expect("E-Stop released");
    terminal.press("r");
    terminal.expect("Reset pressed: the motors can be powered");
    terminal.press("p");
    terminal.expect("P-Stop 2 pressed");
    terminal.press("p");
    terminal.expect("P-Stop 2 released");
    terminal.press("b3");
    terminal.expect("joint 3 is blocked");
    terminal.expect("joint 3 blocked   nobody");
    terminal.press("c");
    terminal.expect("the cable pulled");
    terminal.expect("cable pulled   nobody");
    terminal.press("c");
    terminal.expect("the cable plugged");
    terminal.press("o");
    terminal.expect("power off");
    terminal.press("o");
    terminal.expect("power on");
    // An arrow key is no letter.
    terminal.press("\u{1b}[A");
    terminal.press("q");
    terminal.expect_exit(0);
    assert!(terminal.is_plain(), "{}", terminal.shown());
}

#[test]
fn ctrl_c_is_the_signal_it_is() {
    let Some(mut terminal) = start(&[]) else { return };
    terminal.until("taken over", |terminal| !terminal.is_plain());
    terminal.expect("Ctrl-C ends it");
    terminal.press("\u{3}");
    terminal.expect_exit(0);
    assert!(terminal.is_plain());
    assert!(terminal.shown().contains("TCP: 0 connections"), "{}", terminal.shown());
}

#[test]
fn a_shell_can_stop_it_and_bring_it_back() {
    if Command::new("bash").arg("--version").output().is_err() {
        let _: Option<()> = skip("needs the command `bash`");
        return;
    }
    let Some(mut shell) = run(&["bash", "--noprofile", "--norc", "--noediting", "-i"]) else {
        return;
    };
    // In the background it neither reads nor stops. The words are put together so that the shell's echo of
    // what is typed is not what is waited for.
    let program = env!("CARGO_BIN_EXE_fieldarm");
    shell.press("set -b; PS1=; s=ervi\n");
    shell.press(&format!("{program} sim --tcp {} &\n", address()));
    shell.expect("Ctrl-C ends it");
    assert!(shell.is_plain(), "it is the shell's");
    shell.press("sleep 0.3; jobs; echo s${s}ng\n");
    shell.expect("Running");
    shell.expect("serving");
    assert!(shell.is_plain(), "it is the shell's");
    // In the foreground it does.
    shell.press("fg\n");
    shell.until("taken over", |shell| !shell.is_plain());
    shell.press("p");
    shell.expect("P-Stop 2 pressed");
    // Ctrl-Z gives the terminal back.
    shell.press("\u{1a}");
    shell.expect("Stopped");
    shell.until("given back", Terminal::is_plain);
    shell.press("fg\n");
    shell.until("taken over", |shell| !shell.is_plain());
    shell.press("p");
    shell.expect("P-Stop 2 released");
    shell.press("q");
    shell.until("given back", Terminal::is_plain);
    shell.press("exit 7\n");
    shell.expect_exit(7);
}

#[test]
fn who_is_quiet_has_no_keys() {
    let Some(mut terminal) = start(&["--quiet"]) else { return };
    thread::sleep(Duration::from_millis(300));
    assert!(terminal.is_plain());
    kill_process(terminal.pid(), Signal::TERM).expect("it is there");
    terminal.expect_exit(0);
    assert!(!terminal.shown().contains("nobody controls it"), "{}", terminal.shown());
}
