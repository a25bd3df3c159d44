//! The messages of EtherNet/IP: byte vectors typed by hand from public descriptions, read and written; each
//! cut off at every place and with every bit flipped; and properties that hold for any values and any bytes.

mod attributes;
mod closing;
mod control;
mod explicit;
mod frames;
mod harness;
mod opening;
mod paths;
mod properties;
mod statuses;
mod strictness;
