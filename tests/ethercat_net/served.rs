//! `fieldarm sim` at the robots' end of a cable.

use std::process::Command;
use std::time::Duration;

use crate::namespaces::{Cable, End, INTERFACE, Running};

/// Far longer than the command takes to begin or to end.
pub(crate) const LONG: Duration = Duration::from_secs(20);

/// A line of robots to be served.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Robots {
    pub(crate) count: usize,
    pub(crate) order: &'static str,
    pub(crate) has_clock: bool,
}

impl Robots {
    /// What the four cases of every peer are.
    pub(crate) const ONE: Self = Self { count: 1, order: "little", has_clock: true };
    pub(crate) const ONE_WITHOUT_CLOCK: Self = Self { count: 1, order: "big", has_clock: false };
    pub(crate) const FOUR: Self = Self { count: 4, order: "little", has_clock: true };
    pub(crate) const FOUR_WITHOUT_CLOCK: Self = Self { count: 4, order: "big", has_clock: false };
}

/// Whether processes may be given priority here.
pub(crate) fn can_go_first() -> bool {
    let tried = Command::new("chrt").args(["--fifo", "1", "true"]).output();
    tried.is_ok_and(|tried| tried.status.success())
}

/// Serves `robots`, and returns when they are there.
pub(crate) fn serve(cable: &Cable, robots: Robots, more: &[&str]) -> Running {
    let count = robots.count.to_string();
    let mut arguments = vec!["sim", "--ethercat", INTERFACE, "--robots", &count];
    arguments.extend(["--byte-order", robots.order]);
    if !robots.has_clock {
        arguments.push("--no-dc");
    }
    arguments.extend(more);
    // SOEM waits 20 ms for a mailbox and then gives up, so a busy machine must not make robots late.
    let mut command = if can_go_first() {
        let mut command = cable.command(End::Robots, "chrt");
        command.args(["--fifo", "1", env!("CARGO_BIN_EXE_fieldarm")]);
        command
    } else {
        cable.command(End::Robots, env!("CARGO_BIN_EXE_fieldarm"))
    };
    let mut running = Running::start(command.args(&arguments));
    running.wait_for("Ctrl-C ends it", LONG);
    running
}

/// Ends the serving as a person does, and returns all it said.
pub(crate) fn end(serving: Running) -> String {
    let (status, said) = serving.interrupt(LONG);
    assert_eq!(status.code(), Some(0), "{said}");
    said
}
