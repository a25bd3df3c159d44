//! EtherCAT on real interfaces, in network namespaces that each test makes for itself.
//!
//! Needs root; a test that cannot run says `skipped:` and why. CI runs them all.
#![cfg(all(target_os = "linux", feature = "cli"))]

#[path = "../cell/checkers.rs"]
mod checkers;
#[path = "../support/ethercat_line.rs"]
mod ethercat_line;
#[path = "../support/namespaces.rs"]
mod namespaces;
#[allow(dead_code, reason = "another suite uses the rest of it")]
#[path = "../link_contract/plc.rs"]
mod plc;
#[path = "../support/python.rs"]
mod python;
#[path = "../support/quick_robot.rs"]
mod quick_robot;
#[path = "../support/recording.rs"]
mod recording;
#[path = "../support/stock_line.rs"]
mod stock_line;
#[path = "../link_contract/watched.rs"]
mod watched;

mod capture;
mod faults;
mod probe;
mod pysoem;
mod relay;
mod robot_in_thread;
mod run;
mod served;
mod sim;
mod socket;
mod stock_ethercrab;
