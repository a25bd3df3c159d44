//! An EtherCAT cycle beside the least it can cost and beside other main devices, in one run.
//!
//! `cargo bench --bench ethercat`, with `-- --quick` for a first look. In memory: time and
//! instructions of one exchange. Over a pair of virtual interfaces, which needs root: latencies of
//! a raw socket, of our link with engines, of `ethercrab` as its examples run it, and of `pysoem`,
//! in turns against the same served robots, everything on one core with SCHED_FIFO.
#![cfg(target_os = "linux")]

mod support;
mod ethercat {
    pub(crate) mod beat;
    pub(crate) mod frame;
    pub(crate) mod memory;
    pub(crate) mod ours;
    pub(crate) mod raw;
    pub(crate) mod report;
    pub(crate) mod rounds;
    pub(crate) mod stock;
}
#[path = "../tests/support/ethercat_line.rs"]
mod ethercat_line;
#[path = "../tests/support/namespaces.rs"]
mod namespaces;
#[path = "../tests/support/python.rs"]
mod python;
#[path = "../tests/support/stock_line.rs"]
mod stock_line;

use std::process::ExitCode;
use std::time::Duration;

use ethercat::{beat, frame, memory, ours, raw, report, rounds, stock};
use support::timing::Effort;

#[global_allocator]
static ALLOCATOR: support::alloc::CountingAllocator = support::alloc::CountingAllocator;

fn main() -> ExitCode {
    if let Some(played) = rounds::play_here() {
        return match played {
            Ok(()) => ExitCode::SUCCESS,
            Err(reason) => {
                eprintln!("{reason}");
                ExitCode::FAILURE
            }
        };
    }
    let mut groups = memory::groups();
    let figures = support::measure(&mut groups, Effort::from_args());
    println!("One exchange of the link with emulated robots in memory, 1 ms of theirs included.");
    support::table::print(&groups, &figures);
    memory::print_allocations();
    over_a_cable(std::env::args().any(|arg| arg == "--quick"));
    ExitCode::SUCCESS
}

/// The cases, those of 1 ms first.
fn cases(is_quick: bool) -> Vec<rounds::Case> {
    let case = |robots, period_us: u64, cycles, rounds, has_foreign| rounds::Case {
        robots,
        beat: beat::Beat { period: Duration::from_micros(period_us), warm_up: 100, cycles },
        rounds,
        has_foreign,
    };
    if is_quick {
        vec![
            case(1, 1000, 200, 6, true),
            case(4, 1000, 200, 4, true),
            case(1, 250, 500, 4, false),
            case(4, 250, 500, 4, false),
        ]
    } else {
        vec![
            case(1, 1000, 500, 16, true),
            case(4, 1000, 500, 16, true),
            case(1, 250, 1000, 16, true),
            case(4, 250, 1000, 16, true),
        ]
    }
}

fn over_a_cable(is_quick: bool) {
    // Says itself why there is none.
    println!();
    let Some(cable) = namespaces::Cable::plug() else {
        println!("Only the part in memory was run.");
        return;
    };
    let placement = rounds::Placement::find();
    let python = python::python("pysoem==1.1.13", "pysoem");
    if let Err(reason) = &python {
        println!("No pysoem: {reason}.");
    }
    println!(
        "One exchange over a pair of virtual interfaces, from outputs in hand to inputs in hand."
    );
    println!("Main device and served robots: {}.", placement.told);
    println!(
        "The raw socket sends the frame that ours sends; its time is that of the kernel and the robots."
    );
    for case in cases(is_quick) {
        let mut outcome = rounds::run(&cable, &placement, case, python.as_ref());
        report::print(case, &mut outcome);
    }
}
