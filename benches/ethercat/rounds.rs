//! The contenders in turns, each in a process of its own at the main device's end of one cable, all
//! against the same served robots.
//!
//! Every process begins anew: it brings the robots to OP by itself, cycles, and ends. Only the
//! baseline cannot; it goes on with the robots that our link has left in OP, in the same process.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use crate::beat::{Beat, Figures};
use crate::frame::Frame;
use crate::namespaces::{Cable, End, INTERFACE, Running};
use crate::{ours, raw, stock};

/// Names the part that a process is to play; its arguments follow in the same variable.
const PART: &str = "FIELDARM_BENCH_PART";
/// Far longer than a process takes.
const LONG: Duration = Duration::from_secs(60);
/// Real-time priority of everything that takes part; any, as long as it is the same.
const PRIORITY: &str = "50";

/// Where the processes run: what stands before their names.
pub(crate) struct Placement {
    prefix: Vec<String>,
    /// For the reader.
    pub(crate) told: String,
}

impl Placement {
    /// One core for all, with SCHED_FIFO, as far as this machine allows.
    pub(crate) fn find() -> Self {
        let core = rustix::thread::sched_getaffinity(None).ok().and_then(|allowed| {
            (0..rustix::thread::CpuSet::MAX_CPU).rev().find(|&core| allowed.is_set(core))
        });
        let mut placement = Self { prefix: vec!["env".into()], told: String::new() };
        let mut told = Vec::new();
        match core.map(|core| ["taskset".into(), "-c".into(), core.to_string()]) {
            Some(taskset) if placement.works_with(&taskset) => {
                told.push(format!("pinned to core {}", taskset[2]));
                placement.prefix.extend(taskset);
            }
            _ => told.push("not pinned (`taskset` cannot)".into()),
        }
        let chrt = ["chrt".into(), "-f".into(), PRIORITY.into()];
        if placement.works_with(&chrt) {
            told.push(format!("SCHED_FIFO {PRIORITY}"));
            placement.prefix.extend(chrt);
        } else {
            told.push("no SCHED_FIFO (`chrt` cannot)".into());
        }
        placement.told = told.join(", ");
        placement
    }

    fn works_with(&self, more: &[String]) -> bool {
        let words: Vec<_> = self.prefix.iter().chain(more).collect();
        let mut command = Command::new(words[0]);
        command.args(&words[1..]).arg("true");
        command.output().is_ok_and(|output| output.status.success())
    }

    fn command(&self, cable: &Cable, end: End, program: &str) -> Command {
        let mut command = cable.command(end, &self.prefix[0]);
        command.args(&self.prefix[1..]).arg(program);
        command
    }
}

/// What is measured in a row of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Contender {
    Raw,
    Ours,
    Stock,
    Pysoem,
}

impl Contender {
    pub(crate) const ALL: [Self; 4] = [Self::Raw, Self::Ours, Self::Stock, Self::Pysoem];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Raw => "raw",
            Self::Ours => "ours",
            Self::Stock => "stock",
            Self::Pysoem => "pysoem",
        }
    }
}

/// One case of the comparison.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Case {
    pub(crate) robots: usize,
    pub(crate) beat: Beat,
    pub(crate) rounds: usize,
    /// Whether the foreign ones take part.
    pub(crate) has_foreign: bool,
}

/// What came of a case.
#[derive(Default)]
pub(crate) struct Outcome {
    pub(crate) frame: Frame,
    pub(crate) figures: BTreeMap<Contender, Figures>,
    /// What went wrong, in the words of who said it.
    pub(crate) mishaps: Vec<String>,
}

/// Runs all rounds of a case on a cable of its own.
pub(crate) fn run(
    cable: &Cable,
    placement: &Placement,
    case: Case,
    python: Result<&PathBuf, &String>,
) -> Outcome {
    let serving = serve(cable, placement, case.robots);
    let mut outcome = Outcome::default();
    let said = ended(&mut player(cable, placement, &format!("frame {}", arguments(case))));
    let found = said.and_then(|said| {
        let line = said.lines().find_map(|line| line.strip_prefix("frame "));
        line.and_then(Frame::from_hex).ok_or(said)
    });
    match found {
        Ok(frame) => outcome.frame = frame,
        Err(said) => {
            outcome.mishaps.push(said);
            return outcome;
        }
    }
    for round in 0..case.rounds {
        // Every second round runs backwards, so that nobody always follows the same one.
        let is_backward = round % 2 == 1;
        let link = if is_backward { "raw-ours" } else { "ours-raw" };
        let link = format!("{link} {} {}", arguments(case), outcome.frame.to_hex());
        let mut turns: Vec<(&[Contender], Command)> = Vec::new();
        turns.push((&[Contender::Ours, Contender::Raw], player(cable, placement, &link)));
        if case.has_foreign {
            let stock = format!("stock {}", arguments(case));
            turns.push((&[Contender::Stock], player(cable, placement, &stock)));
            if let Ok(python) = python {
                let mut command = placement.command(cable, End::Main, &python.to_string_lossy());
                command.args(["benches/peers/pysoem_cycle.py", INTERFACE]);
                command.args(arguments(case).split(' '));
                turns.push((&[Contender::Pysoem], command));
            }
        }
        if is_backward {
            turns.reverse();
        }
        for (contenders, mut command) in turns {
            outcome.take(ended(&mut command), contenders);
        }
    }
    let (status, said) = serving.interrupt(LONG);
    if !status.success() {
        outcome.mishaps.push(said);
    }
    outcome
}

impl Outcome {
    /// Adds what a process said, or that it failed.
    fn take(&mut self, said: Result<String, String>, contenders: &[Contender]) {
        let said = match said {
            Ok(said) => said,
            Err(said) => return self.mishaps.push(said),
        };
        for &contender in contenders {
            let figures = self.figures.entry(contender).or_default();
            for line in said.lines() {
                figures.read(line.strip_prefix(contender.name()).unwrap_or(line));
            }
        }
    }
}

/// `ROBOTS PERIOD_US WARM_UP CYCLES`.
fn arguments(case: Case) -> String {
    let Beat { period, warm_up, cycles } = case.beat;
    format!("{} {} {warm_up} {cycles}", case.robots, period.as_micros())
}

fn serve(cable: &Cable, placement: &Placement, robots: usize) -> Running {
    let mut command = placement.command(cable, End::Robots, env!("CARGO_BIN_EXE_fieldarm"));
    command.args(["sim", "--ethercat", INTERFACE, "--no-dc", "--robots", &robots.to_string()]);
    let mut serving = Running::start(&mut command);
    serving.wait_for("Ctrl-C ends it", LONG);
    serving
}

/// This program again, to play `part`.
fn player(cable: &Cable, placement: &Placement, part: &str) -> Command {
    let program = std::env::current_exe().unwrap_or_else(|_| "ethercat".into());
    let mut command = placement.command(cable, End::Main, &program.to_string_lossy());
    command.env(PART, part);
    command
}

fn ended(command: &mut Command) -> Result<String, String> {
    let (status, said) = Running::start(command).end(LONG);
    if status.success() { Ok(said) } else { Err(format!("{status}: {}", said.trim())) }
}

/// Plays the part that this process was started for, if it was.
pub(crate) fn play_here() -> Option<Result<(), String>> {
    let part = std::env::var(PART).ok()?;
    Some(play_part(&part.split(' ').collect::<Vec<_>>()))
}

fn play_part(words: &[&str]) -> Result<(), String> {
    let [part, robots, period_us, warm_up, cycles, frame @ ..] = words else {
        return Err(format!("{PART} is for this program alone"));
    };
    let number = |word: &str| word.parse::<usize>().map_err(|error| error.to_string());
    let robots = number(robots)?;
    let period = Duration::from_micros(number(period_us)? as u64);
    let beat = Beat { period, warm_up: number(warm_up)?, cycles: number(cycles)? };
    match (*part, frame) {
        ("frame", _) => {
            println!("frame {}", ours::frame(INTERFACE, period)?.to_hex());
        }
        ("ours-raw", [frame]) => {
            ours::run(INTERFACE, beat)?.print(Contender::Ours.name());
            play_raw(frame, robots, beat)?;
        }
        ("raw-ours", [frame]) => {
            ours::bring_to_op(INTERFACE, period)?;
            play_raw(frame, robots, beat)?;
            ours::run(INTERFACE, beat)?.print(Contender::Ours.name());
        }
        ("stock", _) => stock::run(INTERFACE, robots, beat)?.print(Contender::Stock.name()),
        _ => return Err(format!("no part {part}")),
    }
    Ok(())
}

fn play_raw(frame: &str, robots: usize, beat: Beat) -> Result<(), String> {
    let frame = Frame::from_hex(frame).ok_or("no frame")?;
    let figures = raw::run(INTERFACE, &frame, robots, beat).map_err(|error| error.to_string())?;
    figures.print(Contender::Raw.name());
    Ok(())
}
