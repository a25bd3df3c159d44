//! Engine against virtual robot in simulated time, one file a behaviour. The two share nothing but
//! the wire; the checkers share nothing with either.

mod checkers;
mod connecting;
mod exhaustive;
mod faults;
mod harness;
#[path = "../support/quick_robot.rs"]
mod quick_robot;
mod readings;
mod recovery;
mod restarts;
mod soak;
mod streaming;
mod velocity;
