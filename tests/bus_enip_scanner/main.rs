//! The scanner against a target that is written down byte by byte: nothing of the crate's own writers
//! stands behind what the scripted target says. Time is a number here.

mod allocations;
mod bench;
mod closing;
mod consuming;
mod groups;
mod limits;
mod noise;
mod opening;
mod producing;
mod refusals;
mod requests;
