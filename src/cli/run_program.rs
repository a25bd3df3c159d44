//! `fieldarm run`: a robot program through the whole house.

use std::fs;
use std::path::{Path, PathBuf};
use std::prelude::v1::*;
use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::{io, thread};

use clap::{Args, ValueEnum};

use super::exit::{Exit, Failure};
use super::grid::print;
use super::order::OrderName;
use super::plots;
use super::report::{Report, Settings, Sources};
use super::source::{self, Source};
use super::watch::{self, Watcher};
use super::{summary, virtual_robot, wording};
use crate::engine::meca500::{ByteOrderSetting, CheckpointPolicy, CheckpointRange, Config, Engine};
use crate::link::clock::MonotonicClock;
use crate::link::direct::DirectLink;
use crate::run::drive::drive;
use crate::run::pace::{AnyPace, RealTime, SimulatedTime};
use crate::run::periodic::Periodic;
use crate::run::program::Program;
use crate::run::recording::Recording;
use crate::run::runner::Runner;
use crate::time::Duration;
use crate::wire::meca500::revision::Revision;
use crate::wire::order::ByteOrder;

/// Commands the engine holds beyond those the robot has taken.
const QUEUE: usize = 64;
/// Checkpoint numbers set aside for following single commands, if the program leaves so many free.
const OWN_CHECKPOINTS: [u16; 4] = [1_000, 500, 100, 20];
/// Cycles between two looks at the progress when time is simulated.
const SIMULATED_PROGRESS_CYCLES: u64 = 4_096;
/// Microseconds between two looks at the progress in real time.
const REAL_PROGRESS_US: u64 = 200_000;
/// Two signals closer than this are one wish to end the run.
const SECOND_SIGNAL_AFTER: Duration = Duration::from_millis(300);

/// Run a robot program.
///
/// The program is the robot's own text commands, one a line, with // and # comments. It is checked as
/// a whole before anything moves: every mistake is printed as file:line:column: message.
///
/// The robot is activated and homed just before the first line that needs it, unless ActivateRobot
/// stands before that line. Commands stream ahead; PauseMotion, ClearMotion, ResumeMotion and
/// ResetError act when the lines before them are accepted by the robot, every other action when they
/// are done. A velocity line (MoveJointsVel, MoveLinVelWrf, MoveLinVelTrf) waits for the lines before
/// it and lasts as long as the velocity timeout (0.05 s, or what SetVelTimeout said).
///
/// The run ends when the last command is known to be done. Ctrl-C pauses the robot, clears its queue
/// and leaves outputs of zero, within two seconds; a second Ctrl-C ends at once. The signals TERM and
/// HUP do the same.
#[derive(Args, Debug)]
#[command(after_help = super::exit::EXIT_CODES, after_long_help = super::exit::EXIT_CODES)]
pub(super) struct RunArgs {
    /// File with the program; standard input when it is `-`.
    program: PathBuf,
    /// How the robot is reached: sim, the built-in virtual robot.
    #[arg(long, default_value = "sim", value_parser = parse_link)]
    link: LinkName,
    /// Period of the bus cycle, in microseconds: 100 to 100000.
    #[arg(long, default_value_t = 1_000, value_parser = clap::value_parser!(u64).range(100..=100_000))]
    cycle_us: u64,
    /// Byte order of the images; auto decides from what the robot sends.
    #[arg(long, value_enum, default_value_t = OrderSetting::Auto)]
    byte_order: OrderSetting,
    /// Run as quickly as possible, in simulated time.
    #[arg(long)]
    fast: bool,
    /// Write report.json and SVG plots into this directory.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Hardware revision of the robot, which decides some limits.
    #[arg(long, value_enum, default_value_t = RevisionName::R3, ignore_case = true)]
    revision: RevisionName,
    /// Say nothing on standard error unless something goes wrong.
    #[arg(long, short)]
    quiet: bool,
    #[command(flatten)]
    sim: virtual_robot::SimArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LinkName {
    Sim,
}

impl LinkName {
    const fn name(self) -> &'static str {
        match self {
            Self::Sim => "sim",
        }
    }
}

fn parse_link(name: &str) -> Result<LinkName, String> {
    match name {
        "sim" => Ok(LinkName::Sim),
        "ethercat" | "enip" | "profinet" | "tcp" => {
            Err(format!("{name} is coming in a later version; for now there is only sim"))
        }
        _ => Err("for now there is only sim; ethercat, enip, profinet and tcp are coming".into()),
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum OrderSetting {
    /// Decide from what the robot sends.
    Auto,
    /// Integers and Reals big-endian, as the manual says.
    Big,
    /// Integers and Reals little-endian, as seen on EtherCAT.
    Little,
    /// Integers big-endian, Reals little-endian.
    BigIntLittleReal,
    /// Integers little-endian, Reals big-endian.
    LittleIntBigReal,
}

impl OrderSetting {
    fn fixed(self) -> Option<ByteOrder> {
        Some(match self {
            Self::Auto => return None,
            Self::Big => OrderName::Big.into(),
            Self::Little => OrderName::Little.into(),
            Self::BigIntLittleReal => OrderName::BigIntLittleReal.into(),
            Self::LittleIntBigReal => OrderName::LittleIntBigReal.into(),
        })
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum RevisionName {
    #[value(name = "R3")]
    R3,
    #[value(name = "R4")]
    R4,
}

impl From<RevisionName> for Revision {
    fn from(name: RevisionName) -> Self {
        match name {
            RevisionName::R3 => Self::R3,
            RevisionName::R4 => Self::R4,
        }
    }
}

pub(super) fn run(args: &RunArgs) -> Result<Exit, Failure> {
    let [.., fewest_checkpoints] = OWN_CHECKPOINTS;
    let Source { name: file, program } =
        source::read(&args.program, args.revision.into(), fewest_checkpoints)?;
    if let Some(directory) = &args.report {
        prepare(directory)?;
    }
    let interrupted = catch_interrupts()?;
    let mut engine = Engine::<QUEUE>::new(config(args, &program)?);
    let robot = virtual_robot::new(&args.sim, args.revision.into());
    let pace = if args.fast {
        AnyPace::Simulated(SimulatedTime)
    } else {
        AnyPace::Real(RealTime::default())
    };
    let period = Duration::from_micros(args.cycle_us);
    let mut periodic = Periodic::new::<Engine<QUEUE>>(DirectLink::new(robot), pace, period);
    let mut runner = Runner::new(&program);
    let mut recording = Recording::new();
    let every_cycles =
        if args.fast { SIMULATED_PROGRESS_CYCLES } else { REAL_PROGRESS_US / args.cycle_us };
    let (mut watcher, messages) = Watcher::new(interrupted, every_cycles);
    let clock = MonotonicClock::new();
    let (ended, wall_time) = thread::scope(|scope| {
        let program = &program;
        scope.spawn(move || watch::draw(messages, program, args.quiet));
        let ended = drive(&mut periodic, &mut engine, &mut runner, &mut recording, &mut watcher);
        let wall_time = clock.now();
        drop(watcher);
        (ended, wall_time)
    });
    let outcome = ended.map_err(|error| Failure {
        exit: Exit::Link,
        message: format!("the link failed: {error}"),
        is_located: false,
    })?;
    let (exit, message) = wording::outcome(&outcome, &file, &program);
    let settings = Settings {
        link: args.link.name().into(),
        cycle_us: args.cycle_us,
        pace: if args.fast { "simulated" } else { "real" },
        byte_order: args.byte_order.fixed().map_or("auto".into(), |order| order.to_string()),
        byte_order_used: engine.byte_order().map(|order| order.to_string()),
        revision: Revision::from(args.revision).to_string(),
    };
    let sources = Sources {
        program: &program,
        outcome: &outcome,
        exit_code: exit as u8,
        message: &message,
        counts: runner.counts(),
        records: runner.records(),
        acknowledgement_cycles: runner.acknowledgement_cycles().quantiles(),
        statistics: periodic.statistics(),
        recording: &recording,
        wall_time_s: wall_time.as_nanos() as f64 * 1e-9,
        final_outputs: periodic.outputs(),
    };
    let report = Report::new(file, settings, &sources);
    let written = args
        .report
        .as_ref()
        .map_or(Ok(Vec::new()), |directory| write_report(directory, &report, &recording));
    // What happened is worth telling even where it could not be written down.
    print(&summary::text(&report, written.as_deref().unwrap_or_default()))?;
    written?;
    if message.is_empty() { Ok(exit) } else { Err(Failure { exit, message, is_located: true }) }
}

/// Makes sure that the report will have a place, before anything moves. What is there stays.
fn prepare(directory: &Path) -> Result<(), Failure> {
    let failed = |error: io::Error| {
        Failure::internal(format!("cannot write a report into {}: {error}", directory.display()))
    };
    fs::create_dir_all(directory).map_err(failed)?;
    let probe = unfinished(directory, "report.json");
    fs::File::create(&probe).map_err(failed)?;
    fs::remove_file(probe).map_err(failed)
}

/// Where a file is written before it takes the place of an older one.
fn unfinished(directory: &Path, name: &str) -> PathBuf {
    directory.join(format!(".{name}.{}", process::id()))
}

/// A flag that Ctrl-C sets, and so do the signals that ask a process to end; the second one ends it
/// at once.
pub(super) fn catch_interrupts() -> Result<Arc<AtomicBool>, Failure> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    let clock = MonotonicClock::new();
    let mut first = None;
    ctrlc::set_handler(move || {
        let now = clock.now();
        let since_first = now - *first.get_or_insert(now);
        flag.store(true, Ordering::Relaxed);
        // A terminal that is closed sends more than one; nobody meant the second.
        if since_first > SECOND_SIGNAL_AFTER {
            process::exit(Exit::Interrupted as i32);
        }
    })
    .map_err(|error| Failure::internal(format!("cannot catch Ctrl-C: {error}")))?;
    Ok(interrupted)
}

fn config(args: &RunArgs, program: &Program) -> Result<Config, Failure> {
    let free = OWN_CHECKPOINTS.iter().find_map(|count| program.free_checkpoints(*count));
    let (first, last) = free.ok_or_else(|| {
        Failure::internal("no checkpoint numbers are free, though the program was checked for it")
    })?;
    let defaults = Config::default();
    Ok(Config {
        byte_order: match args.byte_order.fixed() {
            Some(order) => ByteOrderSetting::Fixed(order),
            None => ByteOrderSetting::Auto,
        },
        revision: args.revision.into(),
        // Completion of every single line is worth more here than the last command per second.
        checkpoints: CheckpointPolicy::EachCommand,
        checkpoint_range: CheckpointRange { first, last },
        // The runner refreshes a velocity in every cycle; a late one must not stop the motion.
        velocity_dead_man: defaults.velocity_dead_man.max(4 * Duration::from_micros(args.cycle_us)),
        ..defaults
    })
}

/// Writes the report and its plots; the paths written.
fn write_report(
    directory: &Path,
    report: &Report,
    recording: &Recording,
) -> Result<Vec<String>, Failure> {
    let json = serde_json::to_string_pretty(report)
        .map_err(|error| Failure::internal(format!("cannot write the report: {error}")))?;
    let mut files = vec![("report.json", json + "\n")];
    for (name, plot) in plots::all(&report.program, recording) {
        let svg =
            plot.map_err(|error| Failure::internal(format!("cannot draw {name}: {error}")))?;
        files.push((name, svg));
    }
    let mut paths = Vec::new();
    for (name, content) in files {
        let path = directory.join(name);
        // Whoever reads the directory meanwhile finds the old file or the new one, both whole.
        let unfinished = unfinished(directory, name);
        let written = fs::write(&unfinished, content).and_then(|()| fs::rename(&unfinished, &path));
        written.map_err(|error| {
            // It may not even have been made.
            let _ = fs::remove_file(&unfinished);
            Failure::internal(format!("cannot write {}: {error}", path.display()))
        })?;
        paths.push(path.display().to_string());
    }
    Ok(paths)
}
