//! Both ends against peers that others wrote, on loopback: `ciplink`'s adapter, the scanner
//! `ethernetip`, and a dissector that reads everything.
//!
//! What needs root or a peer that is not installed says `skipped:` and why. CI runs all.
#![cfg(all(feature = "cli", target_os = "linux"))]

#[path = "../support/loopback.rs"]
mod loopback;
#[path = "../support/namespaces.rs"]
mod namespaces;
#[path = "../support/python.rs"]
mod python;
#[path = "../support/recording.rs"]
mod recording;

mod capture;
mod ciplink;
mod dissected;
mod ethernetip;
