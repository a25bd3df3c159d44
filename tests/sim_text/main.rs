//! The virtual robot's text face: every command of the table in every state, the order of messages,
//! the monitoring port, programs, variables, and that it is one robot with the cyclic face.

mod desk;
mod exclusivity;
mod faces;
mod log;
mod monitoring;
mod programs;
mod requests;
mod sequences;
mod settings;
mod table;
mod variables;
