//! EtherCAT on real interfaces, in network namespaces that each test makes for itself.
//!
//! Needs root; a test that cannot run says `skipped:` and why. CI runs them all.
#![cfg(all(target_os = "linux", feature = "cli"))]

#[path = "../support/namespaces.rs"]
mod namespaces;

mod capture;
mod probe;
mod pysoem;
mod run;
mod served;
mod sim;
mod socket;
mod stock_ethercrab;
