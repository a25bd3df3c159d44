//! EtherCAT, both ends: a main device on the crate `ethercrab`, the wires it can run on, and robots served on one.
//!
//! Read [`wire`] first: all that the link knows of the outside world. [`EthercatSegment`] drives robots over it,
//! [`serve`] is the robots' end, [`memory`] joins both, and [`faulty_wire`] misbehaves between them.

mod answer;
mod borrowed;
mod care;
mod coe;
mod condition;
mod driver;
mod error;
mod event;
mod exchange;
pub mod faulty_wire;
mod group;
mod in_flight;
#[cfg(target_os = "linux")]
mod interface;
mod lane;
pub mod layout;
mod mailbox_repeat;
pub mod memory;
mod monitor;
mod notice;
mod pdu_core;
#[cfg(target_os = "linux")]
pub mod raw_socket;
mod robot;
mod search;
mod segment;
pub mod serve;
mod settings;
mod single;
mod start;
mod statistics;
mod survey;
pub mod wire;

pub use borrowed::GroupRobot;
pub use driver::FrameCounters;
pub use error::{EthercatError, Step};
pub use event::{EventKind, SegmentEvent};
pub use robot::{RobotFound, SubDeviceFound};
pub use segment::{EthercatSegment, StartFailure};
pub use settings::{Assignment, Clocks, MAX_ROBOTS, RobotAddress, RobotChoice, SegmentSettings};
pub use single::EthercatLink;
pub use statistics::{ClockFigures, SegmentStatistics, WorkingCounter};
pub use survey::{MappingFound, RobotSurveyed, Survey, release, survey};
