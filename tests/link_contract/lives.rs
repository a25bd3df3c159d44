//! Lives of a link among random faults, each with its own seed. `FIELDARM_FAULT_SEED` replays one of them.

use std::env;
use std::panic::catch_unwind;

use crate::cell::Cell;
use crate::checkers::End;
use crate::contract::Bus;

/// Commands that wait in the engine while it streams.
const WAITING: u32 = 6;
/// Fewest commands that a life gets done.
const FEWEST_DONE: usize = 500;

/// Lives `lives` lives. One of them is `live`, which gets its seed and returns the longest way back in cycles.
pub(crate) fn lead(lives: u64, live: fn(u64) -> u64) {
    if let Some(seed) = env::var("FIELDARM_FAULT_SEED").ok().and_then(|seed| seed.parse().ok()) {
        println!("seed {seed}: back within {} cycles", live(seed));
        return;
    }
    for seed in 1..=lives {
        let Ok(longest) = catch_unwind(|| live(seed)) else {
            panic!("replay with FIELDARM_FAULT_SEED={seed}");
        };
        println!("seed {seed}: back within {longest} cycles");
    }
}

/// Streams for one cycle: keeps some commands waiting, whatever the robot does.
pub(crate) fn stream<B: Bus>(cell: &mut Cell<B>) {
    while cell.plc.is_connected() && cell.plc.engine.status().waiting < WAITING {
        if cell.submit_next().is_none() {
            break;
        }
    }
    cell.step();
}

/// The end of a life: everything ends, and enough was done.
pub(crate) fn finish<B: Bus>(cell: &mut Cell<B>) {
    cell.finish(5_000);
    let done = cell.plc.submitted.iter();
    let done = done.filter(|s| cell.plc.state(s.ticket).end == Some(End::Done)).count();
    assert!(done > FEWEST_DONE, "only {done} commands done\n{cell:#?}");
}
