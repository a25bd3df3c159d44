//! What every link owes the engine, in one suite that runs for each of them, in simulated time; and
//! a hundred faults in one life of each link. Read `contract.rs` first.
#![cfg(all(feature = "enip", feature = "ethercat", feature = "sim"))]

mod cell;
#[path = "../cell/checkers.rs"]
mod checkers;
mod contract;
mod direct;
mod enip;
mod enip_faults;
mod ethercat;
mod faults;
mod faults_of_four;
mod layouts;
mod lives;
mod losses;
mod one_way;
mod plc;
#[path = "../support/quick_robot.rs"]
mod quick_robot;
mod restarts;
mod stream;
mod watched;
