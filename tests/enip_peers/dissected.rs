//! Our own two ends, as a dissector sees them: run and idle, sequence numbers, sizes.

use std::process::Command;
use std::time::Duration;

use crate::capture::{Capture, check};
use crate::loopback::address;
use crate::namespaces::Running;
use crate::recording::Recorded;

/// Far longer than anything takes.
const LONG: Duration = Duration::from_secs(120);

/// One field of each frame that a filter finds, as numbers.
fn numbers(recorded: &Recorded, filter: &str, field: &str) -> Vec<u32> {
    let number = |text: &str| match text.strip_prefix("0x") {
        Some(hex) => u32::from_str_radix(hex, 16),
        None => text.parse(),
    };
    let read = recorded.read(filter, &[field]);
    let number = |line: &str| number(line).unwrap_or_else(|_| panic!("{field} is `{line}`"));
    read.lines().map(number).collect()
}

#[test]
fn a_run_shows_run_then_idle_and_counts_every_frame() {
    let robot = address();
    let Some(capture) = Capture::start(robot, "enip-run") else { return };
    let here = address();
    let mut command = Command::new(env!("CARGO_BIN_EXE_fieldarm"));
    command.args(["sim", "--enip", &robot.to_string()]);
    let mut serving = Running::start(&mut command);
    serving.wait_for("Ctrl-C ends it", LONG);
    let mut command = Command::new(env!("CARGO_BIN_EXE_fieldarm"));
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    let link = format!("enip:{robot}?bind={here}&multiplier=64");
    command.args(["run", "programs/square.txt", "--link", &link]);
    let (status, said) = Running::start(&mut command).end(LONG);
    let (_, served) = serving.interrupt(LONG);
    assert!(status.success(), "{said}\n{served}");
    let recorded = capture.end();
    check(&recorded, 200);

    let outputs = format!("cipio && ip.src == {here}");
    let runs = numbers(&recorded, &outputs, "cip.32bitheader.run_idle");
    let idle = runs.iter().filter(|&&run| run == 0).count();
    assert!(runs.contains(&1), "no frame says run");
    assert!(idle > 0 && runs.ends_with(&[0]), "the last frames say idle: {idle}");
    let first_run = runs.iter().position(|&run| run == 1).expect("some frame says run");
    let run = runs.iter().skip(first_run).take_while(|&&run| run == 1).count();
    assert_eq!(first_run + run + idle, runs.len() + first_run.min(idle), "run once, then idle");

    for (filter, len) in [(outputs, 60 + 6), (format!("cipio && ip.src == {robot}"), 252 + 2)] {
        let sequence = numbers(&recorded, &filter, "enip.cpf.sai.seq");
        let gaps = sequence.windows(2).filter(|pair| pair[1] != pair[0].wrapping_add(1)).count();
        assert_eq!(gaps, 0, "{filter}: each frame has the next number: {sequence:?}");
        let counts = numbers(&recorded, &filter, "cip.seq");
        let backwards = counts.windows(2).filter(|pair| {
            let ahead = pair[1].wrapping_sub(pair[0]) & 0xFFFF;
            ahead > 1
        });
        assert_eq!(backwards.count(), 0, "{filter}: new data are counted one by one");
        let lengths = recorded.read(&filter, &["enip.cpf.length"]);
        let data = |line: &str| line.rsplit(',').next().map(str::to_owned);
        for line in lengths.lines() {
            assert_eq!(data(line), Some(len.to_string()), "{filter}: {line}");
        }
    }
}
