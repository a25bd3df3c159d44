//! The virtual robot's text interface against a client that others wrote, on loopback: the vendor's own
//! package `mecademicpy`.
//!
//! Without it the test says `skipped:` and why. CI runs it.
#![cfg(all(feature = "cli", target_os = "linux"))]

#[path = "../support/loopback.rs"]
mod loopback;
#[path = "../support/namespaces.rs"]
mod namespaces;
#[path = "../support/python.rs"]
mod python;

mod mecademicpy;
