//! Robot programs over the robot's text interface: the same programs, the same ends and the same records
//! as over a bus, without one.
//!
//! Read [`runner`] first: what is sent when, and what is known from what. [`drive`] is a whole run over a
//! [`TextLink`]; [`settings`] is how it shall be.
//!
//! ```text
//!   Program --> TextRunner --> lines ----> TextLink ----> robot
//!                   |   ^                     |
//!                   |   '----- messages <-----'      monitoring messages --> Recording
//!                   '--> records, outcome
//! ```
//!
//! Invariants: a line is sent once, never again by itself; nothing is done before its checkpoint or its
//! answer says so; no clock is read here, times come with the link. Left out: sockets, and everything
//! that only a bus has, such as cycles and MoveIDs.

mod action;
mod allowance;
pub mod drive;
mod in_flight;
pub mod link;
mod robot;
pub mod runner;
pub mod settings;
mod stop;
mod talk;
mod trace;

pub use drive::drive_text;
pub use link::{Heard, TextLink};
pub use runner::TextRunner;
pub use settings::TextSettings;
pub use talk::TalkStatistics;
