//! `mecademicpy` from PyPI, in a process of its own, controls the virtual robot. What it does and checks is in
//! `tests/peers/mecademicpy_drive.py`.

use std::process::Command;
use std::time::Duration;

use crate::loopback::address;
use crate::namespaces::{Running, skip};
use crate::python::python;

/// Far longer than anything takes.
const LONG: Duration = Duration::from_secs(240);

/// The package drives a robot that `fieldarm sim` serves with `more` interfaces, at one address.
fn drive(more: &[&str]) {
    let found = python("mecademicpy==3.0.3", "mecademicpy.robot");
    let Some(python) = found.map_or_else(|reason| skip(&reason), Some) else { return };
    let robot = address().to_string();
    let mut command = Command::new(env!("CARGO_BIN_EXE_fieldarm"));
    command.args(["sim", "--tcp", &robot]);
    for interface in more {
        command.args([interface, &robot.as_str()]);
    }
    let mut serving = Running::start(&mut command);
    serving.wait_for("Ctrl-C ends it", LONG);
    let mut command = Command::new(python);
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    command.args(["tests/peers/mecademicpy_drive.py", &robot]);
    let (status, said) = Running::start(&mut command).end(LONG);
    let (ended, served) = serving.interrupt(LONG);
    assert!(status.success(), "{said}\n{served}");
    assert!(said.contains("passed:"), "{said}");
    assert_eq!(ended.code(), Some(0), "{served}");
    // The first connection and the one after it was lost; the monitor; the one that came too late.
    let count = |words: &str| served.lines().filter(|line| line.contains(words)).count();
    let starts = |words: &str| served.lines().filter(|line| line.starts_with(words)).count();
    assert_eq!(starts("control connection of"), 4, "{served}");
    assert_eq!(starts("monitoring connection of"), 2, "{served}");
    assert!(count("refused the control connection of") >= 1, "{served}");
    assert_eq!(count("it did not read"), 0, "{served}");
    println!("mecademicpy {}", said.lines().last().unwrap_or_default());
}

#[test]
fn drives_a_robot_at_its_tcp_ports() {
    drive(&[]);
}

#[test]
fn drives_a_robot_that_is_on_ethernet_ip_too() {
    drive(&["--enip"]);
}
