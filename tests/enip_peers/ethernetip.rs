//! The scanner `ethernetip` from PyPI, in a process of its own, against the virtual robot. What it does
//! and checks is in `tests/peers/ethernetip_scan.py`.

use std::process::Command;
use std::time::Duration;

use crate::capture::{Capture, check};
use crate::loopback::address;
use crate::namespaces::{Running, skip};
use crate::python::python;

/// Far longer than anything takes.
const LONG: Duration = Duration::from_secs(120);
/// How long images are exchanged, in s; in CI as long as the project promises.
const SECONDS: u32 = 3;
const SECONDS_IN_CI: u32 = 30;

fn own(order: &str, seconds: u32) {
    let found = python("ethernetip==1.2.0", "ethernetip");
    let Some(python) = found.map_or_else(|reason| skip(&reason), Some) else { return };
    let robot = address();
    let capture = Capture::start(robot, &format!("ethernetip-{order}"));
    let robot = robot.to_string();
    let mut command = Command::new(env!("CARGO_BIN_EXE_fieldarm"));
    command.args(["sim", "--enip", &robot, "--byte-order", order]);
    let mut serving = Running::start(&mut command);
    serving.wait_for("Ctrl-C ends it", LONG);
    let mut command = Command::new(python);
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    command.args(["tests/peers/ethernetip_scan.py", &robot, order, &seconds.to_string()]);
    let (status, said) = Running::start(&mut command).end(LONG);
    let (ended, served) = serving.interrupt(LONG);
    assert!(status.success(), "{said}\n{served}");
    assert!(said.contains("passed:"), "{said}");
    assert_eq!(ended.code(), Some(0), "{served}");
    for change in ["owner connection of", "its owner runs", "0x0106", "closed"] {
        assert!(served.contains(change), "{change}: {served}");
    }
    assert!(!served.contains("timed out"), "{served}");
    println!("ethernetip {}", said.trim());
    if let Some(capture) = capture {
        // Both directions, every 10 ms.
        check(&capture.end(), usize::try_from(seconds).expect("few") * 100);
    }
}

#[test]
fn owns_a_little_endian_robot() {
    let in_ci = std::env::var_os("CI").is_some_and(|value| !value.is_empty());
    own("little", if in_ci { SECONDS_IN_CI } else { SECONDS });
}

#[test]
fn owns_a_big_endian_robot() {
    own("big", SECONDS);
}
