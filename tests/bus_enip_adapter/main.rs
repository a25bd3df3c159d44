//! The adapter session, talked to in bytes typed by hand and in virtual time.

mod allocations;
mod connections;
mod encapsulation;
mod groups;
mod malformed;
mod objects;
mod production;
mod refusals;
mod support;
