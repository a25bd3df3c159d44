//! The PC's end of the text interface among robots that obey arbitrary bytes: nothing panics, commands are
//! whole lines, no request ends twice, what waits has its bounds.
#![no_main]

#[allow(dead_code)]
#[path = "../../tests/enip_hostile/choices.rs"]
mod choices;
#[path = "../../tests/text_sessions/client.rs"]
mod client;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut surrounded = client::Surrounded::new();
    surrounded.connect();
    surrounded.obey(bytes);
});
