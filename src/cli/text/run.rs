//! `fieldarm run --link tcp:...`: the same programs, reports and exit codes over the text interface.
//!
//! Each robot has a connection and a thread of its own: nothing is shared but the wish to end.

use std::path::PathBuf;
use std::prelude::v1::*;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread;

use super::link_name::TcpName;
use super::run_link::{AnyLink, MemoryLink, Ports, SocketLink, ports};
use super::run_words;
use crate::cli::ending::Endings;
use crate::cli::exit::{Exit, Failure};
use crate::cli::order::OrderName;
use crate::cli::report::{Report, ReportedTcp, Settings, Sources};
use crate::cli::run_program::{self, set_nothing_moves};
use crate::cli::source::Source;
use crate::cli::virtual_robot::{self, SimArgs};
use crate::cli::watch::{self, Watcher};
use crate::link::clock::MonotonicClock;
use crate::run::outcome::Outcome;
use crate::run::program::Program;
use crate::run::recording::Recording;
use crate::run::text::{TextRunner, drive_text};
use crate::sim::meca500::CyclicBus;
use crate::time::{Duration, Instant};
use crate::wire::meca500::revision::Revision;

/// Passes between two looks at the progress in real time, at about 80 a second.
const REAL_PROGRESS_PASSES: u64 = 16;
/// The same when time is simulated.
const SIMULATED_PROGRESS_PASSES: u64 = 4_096;

/// A run as the command line has it.
pub(in crate::cli) struct TcpRun<'a> {
    pub(in crate::cli) link: &'a TcpName,
    /// The program of each robot.
    pub(in crate::cli) sources: Vec<&'a Source>,
    /// Where the report of each robot goes.
    pub(in crate::cli) directories: Vec<Option<PathBuf>>,
    /// What plots call each robot.
    pub(in crate::cli) titles: Vec<String>,
    pub(in crate::cli) interrupted: Arc<AtomicBool>,
    pub(in crate::cli) sim: &'a SimArgs,
    pub(in crate::cli) revision: Revision,
    pub(in crate::cli) fast: bool,
    pub(in crate::cli) is_quiet: bool,
}

/// One robot of the run, and what becomes of it.
struct Robot<'p> {
    source: &'p Source,
    /// Where its ports are; none where it is in this process.
    ports: Option<Ports>,
    /// Until it is driven: a robot whose run has ended is let go, and stops if it has not yet.
    link: Option<AnyLink>,
    runner: TextRunner<'p>,
    recording: Recording,
}

/// How the run of one robot ended, and how long it took.
struct Ended {
    outcome: Outcome,
    wall_time: Duration,
}

pub(in crate::cli) fn run(run: &TcpRun<'_>) -> Result<Exit, Failure> {
    // Nothing moves yet, so whoever interrupts now need not wait.
    set_nothing_moves(true);
    let mut robots = open_all(run)?;
    set_nothing_moves(false);
    let ended = drive_all(run, &mut robots);
    tell(run, &robots, &ended)
}

fn open_all<'a>(run: &TcpRun<'a>) -> Result<Vec<Robot<'a>>, Failure> {
    let several = run.sources.len() > 1;
    let mut robots = Vec::new();
    for (place, source) in run.sources.iter().copied().enumerate() {
        if let Some(step) = TextRunner::without_text(&source.program) {
            let line = source.program.steps().get(step).map_or(0, |step| step.line);
            return Err(Failure::usage(format!(
                "{}:{line}: the command has no text, so it cannot be sent over TCP",
                source.name
            )));
        }
        let checkpoints = run_program::own_checkpoints(&source.program)?;
        let label = if several { format!("robot {}: ", place + 1) } else { String::new() };
        let named = |failure: Failure| Failure {
            message: format!("--link {}: {label}{}", run.link, failure.message),
            ..failure
        };
        let ports = ports(&run.link.hosts, &run.link.options, place).map_err(named)?;
        let link = open(run, ports, &label).map_err(named)?;
        robots.push(Robot {
            source,
            ports,
            link: Some(link),
            runner: TextRunner::new(&source.program, run.link.options.settings(checkpoints)),
            recording: Recording::new(),
        });
    }
    Ok(robots)
}

fn open(run: &TcpRun<'_>, ports: Option<Ports>, label: &str) -> Result<AnyLink, Failure> {
    match ports {
        Some(ports) => {
            let (link, revision) = SocketLink::open(ports, label.into(), run.is_quiet)?;
            if let Some(revision) = revision.filter(|revision| *revision != run.revision) {
                link.say(&format!(
                    "the robot is a revision {revision}, and the program was checked for {}; --revision {revision} \
                     knows its limits",
                    run.revision
                ));
            }
            Ok(AnyLink::Sockets(Box::new(link)))
        }
        None => {
            let robot =
                virtual_robot::new(run.sim, OrderName::Big, run.revision, CyclicBus::Direct);
            MemoryLink::open(robot, run.fast).map(Box::new).map(AnyLink::Memory)
        }
    }
}

/// Drives each robot to its end in a thread of its own, while another one tells of it.
fn drive_all(run: &TcpRun<'_>, robots: &mut [Robot<'_>]) -> Vec<Ended> {
    let passes = if run.fast { SIMULATED_PROGRESS_PASSES } else { REAL_PROGRESS_PASSES };
    let (watchers, bus, messages) = Watcher::all(robots.len(), &run.interrupted, passes);
    // There is no bus that could tell anything.
    drop(bus);
    let programs: Vec<&Program> = robots.iter().map(|robot| &robot.source.program).collect();
    thread::scope(|scope| {
        scope.spawn(move || watch::draw(messages, &programs, run.is_quiet));
        let threads: Vec<_> = robots
            .iter_mut()
            .zip(watchers)
            .filter_map(|(robot, mut watcher)| {
                let mut link = robot.link.take()?;
                Some(scope.spawn(move || {
                    let clock = MonotonicClock::new();
                    let Robot { runner, recording, .. } = robot;
                    let outcome = drive_text(&mut link, runner, recording, &mut watcher);
                    Ended { outcome, wall_time: clock.now() - Instant::ZERO }
                }))
            })
            .collect();
        // Nothing in them panics.
        threads.into_iter().filter_map(|thread| thread.join().ok()).collect()
    })
}

/// Reports, messages and the exit code.
fn tell(run: &TcpRun<'_>, robots: &[Robot<'_>], ended: &[Ended]) -> Result<Exit, Failure> {
    let count = robots.len();
    let mut endings = Endings::of(count);
    let places = run.directories.iter().zip(&run.titles);
    for (number, ((robot, Ended { outcome, wall_time }), (directory, title))) in
        (1..).zip(robots.iter().zip(ended).zip(places))
    {
        let Robot { source, ports, runner, recording, .. } = robot;
        let (exit, message) = run_words::outcome(
            outcome,
            &source.name,
            &source.program,
            runner.records(),
            runner.lost(),
        );
        let report = Report::new(
            number,
            source.name.clone(),
            settings(run, count),
            &Sources {
                program: &source.program,
                outcome,
                exit_code: exit as u8,
                message: &message,
                counts: runner.counts(),
                records: runner.records(),
                cyclic: None,
                tcp: Some(reported(run, *ports, runner)),
                bus: None,
                enip: None,
                recording,
                wall_time_s: wall_time.as_secs_f64(),
            },
        );
        endings.add((exit, message), report, recording, directory.as_deref(), title);
    }
    let told = endings.tell();
    if ended.len() < count {
        return Err(Failure::internal("a robot's thread failed"));
    }
    told
}

fn settings(run: &TcpRun<'_>, robots: usize) -> Settings {
    Settings {
        link: run.link.to_string(),
        robots,
        cycle_us: None,
        pace: if run.fast { "simulated" } else { "real" },
        byte_order: None,
        byte_order_used: None,
        revision: run.revision.to_string(),
    }
}

fn reported(run: &TcpRun<'_>, ports: Option<Ports>, runner: &TextRunner<'_>) -> ReportedTcp {
    let ms = |duration: Option<Duration>| duration.map(|duration| duration.as_secs_f64() * 1e3);
    ReportedTcp {
        control: ports.map(|ports| ports.control.to_string()),
        monitor: ports.and_then(|ports| ports.monitor).map(|at| at.to_string()),
        interval_ms: ms(run.link.options.interval),
        watchdog_ms: ms(run.link.options.watchdog),
        ..ReportedTcp::new(runner.statistics())
    }
}
