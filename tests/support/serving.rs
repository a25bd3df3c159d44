//! `fieldarm sim` in a process of its own, from its beginning to its end.

#![allow(dead_code, reason = "each test file uses a part of it")]

use std::process::Command;
use std::time::Duration;

use crate::cli_support::fieldarm;
use crate::namespaces::Running;

/// Far longer than anything takes that is waited for.
pub(crate) const LONG: Duration = Duration::from_secs(60);

/// `fieldarm sim` with these arguments, once it serves.
pub(crate) fn serve(arguments: &[&str]) -> Running {
    serve_by(&mut fieldarm(&[&["sim"], arguments].concat()))
}

/// As [`serve`], for a command that is started elsewhere.
pub(crate) fn serve_by(command: &mut Command) -> Running {
    let mut serving = Running::start(command);
    serving.wait_for("Ctrl-C ends it", LONG);
    serving
}

/// What was said, once it was told to end.
pub(crate) fn end(serving: Running) -> String {
    let (status, said) = serving.interrupt(LONG);
    assert_eq!(status.code(), Some(0), "{said}");
    said
}

/// `fieldarm` with arguments after which it must end by itself: its exit code and all it said.
pub(crate) fn ended(arguments: &[&str]) -> (Option<i32>, String) {
    ended_by(&mut fieldarm(arguments))
}

/// As [`ended`], for a command that is started elsewhere.
pub(crate) fn ended_by(command: &mut Command) -> (Option<i32>, String) {
    let (status, said) = Running::start(command).end(LONG);
    (status.code(), said)
}
