//! An EtherNet/IP adapter among scanners that obey arbitrary bytes: nothing panics, every answer is a whole
//! packet to a stream that is open, events and connections agree, one owner at most, time always moves on.
#![no_main]

#[path = "../../tests/enip_hostile/adapter.rs"]
mod adapter;
#[path = "../../tests/enip_hostile/choices.rs"]
mod choices;
#[path = "../../tests/enip_hostile/messages.rs"]
mod messages;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| adapter::Surrounded::new().obey(bytes));
