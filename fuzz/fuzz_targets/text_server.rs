//! The robot's end of the text interface, a virtual robot behind it, among peers that obey arbitrary bytes:
//! nothing panics, messages are whole, one controls at most, what waits has its bounds.
#![no_main]

#[allow(dead_code)]
#[path = "../../tests/enip_hostile/choices.rs"]
mod choices;
#[path = "../../tests/text_sessions/server.rs"]
mod server;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| server::Surrounded::new().obey(bytes));
