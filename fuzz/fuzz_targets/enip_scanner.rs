//! An EtherNet/IP scanner among targets that obey arbitrary bytes: nothing panics, requests are whole and go to
//! streams that are open, no triad is used twice, groups are joined and left in turn, time always moves on.
#![no_main]

#[path = "../../tests/enip_hostile/choices.rs"]
mod choices;
#[path = "../../tests/enip_hostile/messages.rs"]
mod messages;
#[path = "../../tests/enip_hostile/scanner.rs"]
mod scanner;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut surrounded = scanner::Surrounded::new();
    // The first byte says which connections are open when it begins.
    let (first, rest) = bytes.split_first().unwrap_or((&0, &[]));
    for index in (0..3).filter(|index| first >> index & 1 == 1) {
        surrounded.open(index);
    }
    surrounded.obey(rest);
});
