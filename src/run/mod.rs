//! The fixed-period loop that joins controllers to the robots of one bus segment, and the runner of
//! robot programs.
//!
//! Read [`periodic`] first: one cycle. [`pace`] decides when cycles begin, by the clock or as quickly
//! as they can be computed. [`runner`] gives a [`program`] to an engine, a [`seat`] is one robot's
//! part of a run, [`drive`] is a whole run: one robot on a link, or several on a segment, in one
//! thread and with one bus cycle for all.
//!
//! ```text
//!   Seat 1: Program --> Runner --> Engine --+
//!                         +--> records      |
//!   Seat 2: ...                           --+--> Periodic --> segment
//!   Seat N: ...                           --+       |
//!                                                   +--> CycleStatistics
//! ```
//!
//! [`text`] is the same over the robot's text interface, which has no cycles.
//!
//! Invariants: nothing in a cycle allocates; memory does not grow with the length of a run, only with
//! that of the programs. Left out: every concrete link and every concrete robot at its end.

pub mod decimate;
pub mod drive;
pub mod observation;
pub mod outcome;
pub mod pace;
pub mod periodic;
pub mod program;
pub mod record;
pub mod recording;
pub mod runner;
pub mod seat;
pub mod single;
pub mod statistics;
pub mod text;
