//! The fixed-period loop that joins one controller to one link, and the runner of robot programs.
//!
//! Read [`periodic`] first: one cycle. [`pace`] decides when cycles begin, by the clock or as quickly
//! as they can be computed. [`runner`] gives a [`program`] to an engine, [`drive`] is a whole run.
//!
//! ```text
//!   Program --> Runner --> Engine --> Periodic --> link
//!                 |                      |
//!                 +--> records           +--> CycleStatistics, Recording
//! ```
//!
//! Invariants: nothing in a cycle allocates; memory does not grow with the length of a run, only with
//! that of the program. Left out: every concrete link and every concrete robot at its end.

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
pub mod statistics;
