//! The scanner against targets that others wrote, on loopback.
#![cfg(all(feature = "enip", target_os = "linux"))]

mod ciplink;
#[path = "../support/loopback.rs"]
mod loopback;
