//! SOEM, by its Python binding `pysoem`, against the virtual robots. What it does and checks is in
//! `tests/peers/pysoem_op.py`.

use std::time::Duration;

use crate::capture::Capture;
use crate::namespaces::{Cable, End, INTERFACE, Running, skip};
use crate::python::python;
use crate::served::{Robots, end, serve};

/// Far longer than a run takes.
const LONG: Duration = Duration::from_secs(120);

fn bring_to_op(robots: Robots, more: &[&str]) {
    let found = python("pysoem==1.1.13", "pysoem").map_or_else(|reason| skip(&reason), Some);
    let (Some(cable), Some(python)) = (Cable::plug(), found) else { return };
    let capture = Capture::start(&cable, &format!("pysoem-{}-{}", robots.count, robots.order));
    let serving = serve(&cable, robots, more);
    let mut command = cable.command(End::Main, python.to_str().expect("UTF-8"));
    command.args(["tests/peers/pysoem_op.py", INTERFACE, &robots.count.to_string()]);
    command.args([robots.order, if robots.has_clock { "dc" } else { "no-dc" }]);
    let (status, said) = Running::start(&mut command).end(LONG);
    let served = end(serving);
    assert!(status.success(), "{said}\n{served}");
    assert!(said.contains("passed:"), "{said}");
    println!("pysoem {}", said.trim());
    for robot in 0..robots.count {
        for change in ["SAFE-OP -> OP", "OP -> SAFE-OP, 0x001B", "OP -> INIT"] {
            assert!(served.contains(&format!("position {robot}: {change}")), "{change}: {served}");
        }
    }
    if let Some(capture) = capture {
        capture.check(2_000);
    }
}

#[test]
fn one_robot_with_distributed_clocks() {
    bring_to_op(Robots::ONE, &[]);
}

#[test]
fn one_robot_without_distributed_clocks() {
    bring_to_op(Robots::ONE_WITHOUT_CLOCK, &[]);
}

#[test]
fn four_robots_with_distributed_clocks() {
    bring_to_op(Robots::FOUR, &["--sii-pdos", "--alias", "11,12,13,14"]);
}

#[test]
fn four_robots_without_distributed_clocks() {
    bring_to_op(Robots::FOUR_WITHOUT_CLOCK, &[]);
}
