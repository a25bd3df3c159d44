//! `fieldarm run`: robot programs through the whole house.

use std::path::PathBuf;
use std::prelude::v1::*;
use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use clap::{Args, ValueEnum};

use super::ending::Endings;
use super::enip::words;
use super::ethercat_options::EthercatOptions;
use super::exit::{Exit, Failure};
use super::link_choice::LinkChoice;
use super::link_text::MOST_ROBOTS;
use super::order::OrderName;
use super::report::{Cyclic, Report, ReportedBus, Settings, Sources};
use super::segment::{Opening, Segment, open_segment};
use super::source::{self, Source};
use super::text::run::TcpRun;
use super::watch::{self, Watcher};
use super::wording::counted;
use super::{report_files, text, virtual_robot, wording};
use crate::engine::meca500::{ByteOrderSetting, CheckpointPolicy, CheckpointRange, Config, Engine};
use crate::link::clock::MonotonicClock;
use crate::link::ethercat::MAX_ROBOTS;
use crate::run::drive::drive_all;
use crate::run::outcome::Outcome;
use crate::run::pace::{AnyPace, RealTime, SimulatedTime};
use crate::run::periodic::Periodic;
use crate::run::program::Program;
use crate::run::recording::Recording;
use crate::run::runner::Runner;
use crate::run::seat::Seat;
use crate::time::{Duration, Instant};
use crate::wire::meca500::image::FirmwareLayout;
use crate::wire::meca500::revision::Revision;
use crate::wire::order::ByteOrder;

/// Commands the engine holds beyond those the robot has taken.
const QUEUE: usize = 64;
/// Period of the bus cycle where nobody says another, in microseconds.
const CYCLE_US: u64 = 1_000;
/// Checkpoint numbers set aside for following single commands, if the program leaves so many free.
const OWN_CHECKPOINTS: [u16; 4] = [1_000, 500, 100, 20];
/// Cycles between two looks at the progress when time is simulated.
const SIMULATED_PROGRESS_CYCLES: u64 = 4_096;
/// Microseconds between two looks at the progress in real time.
const REAL_PROGRESS_US: u64 = 200_000;
/// Longest time that a frame may be under way on a network interface: in the queues of a busy machine.
const LONGEST_DELAY: Duration = Duration::from_millis(25);
/// Two signals closer than this are one wish to end the run.
const SECOND_SIGNAL_AFTER: Duration = Duration::from_millis(300);

/// Run robot programs.
///
/// A program is the robot's own text commands, one a line, with // and # comments. It is checked as
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
///
/// With --robots N, N robots share one segment and its bus cycle, each with a program of its own or
/// all with the same. A robot that is done, or has failed, gets outputs of zero while the others go
/// on; the run ends with the last of them. Ctrl-C stops all.
#[derive(Args, Debug)]
#[command(after_help = super::exit::EXIT_CODES, after_long_help = super::exit::EXIT_CODES)]
pub(super) struct RunArgs {
    /// File with the program; standard input when it is `-`. One for all robots, or one for each.
    #[arg(value_name = "PROGRAM", required = true)]
    programs: Vec<PathBuf>,
    /// How the robots are reached: sim, virtual robots in this process; ethercat-sim, the same behind
    /// the whole EtherCAT stack; ethercat:IFACE, the first robots on the segment of a network
    /// interface; ethercat:IFACE:POSITION, the one at that position, from 0; enip-sim, virtual robots
    /// behind the whole EtherNet/IP stack; enip:ADDR, the robot at an IPv4 address or host name;
    /// enip:ADDR,ADDR and enip:192.168.0.101-104, several; tcp-sim, virtual robots behind the text
    /// interface in memory; tcp:ADDR, the robot's TCP text interface at an IP address or host name, port
    /// 10000 without :PORT; tcp:ADDR,ADDR, several. Behind enip-sim and enip:ADDR may stand
    /// ?KEY=VALUE&... with rpi_ms (10), multiplier (16), t2o (unicast or multicast), config (151, a number
    /// or none), key (none, wildcard or exact), and behind enip:ADDR also bind (a local IPv4 address) and
    /// io_port (2222, 0 for any). Behind tcp:ADDR and tcp-sim may stand interval_ms (of the positions, as
    /// the robot has it) and watchdog_ms (none), and behind tcp:ADDR also monitor (address and port of the
    /// monitoring port; without it positions come over the control port).
    #[arg(long, default_value = "sim", value_parser = LinkChoice::parse)]
    link: LinkChoice,
    /// Robots on the segment: 1 to 16, on EtherNet/IP and TCP to 64; 1 without it. Of --link enip:ADDR,ADDR
    /// and tcp:ADDR,ADDR each address is one.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=64))]
    robots: Option<u8>,
    /// Period of the bus cycle, in microseconds: 100 to 100000; 1000 without it. On EtherNet/IP the robot
    /// decides, after ?rpi_ms= asked.
    #[arg(long, value_parser = clap::value_parser!(u64).range(100..=100_000))]
    cycle_us: Option<u64>,
    /// Byte order of the images; auto decides from what each robot sends.
    #[arg(long, value_enum, default_value_t = OrderSetting::Auto)]
    byte_order: OrderSetting,
    /// Run as quickly as possible, in simulated time; virtual robots only.
    #[arg(long)]
    fast: bool,
    /// Write report.json and SVG plots into this directory; of several robots into robot-1, robot-2
    /// and so on below it.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Hardware revision of the robots, which decides some limits.
    #[arg(long, value_enum, default_value_t = RevisionName::R3, ignore_case = true)]
    revision: RevisionName,
    /// Say nothing on standard error unless something goes wrong.
    #[arg(long, short)]
    quiet: bool,
    #[command(flatten)]
    ethercat: EthercatOptions,
    #[command(flatten)]
    sim: virtual_robot::SimArgs,
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

impl RunArgs {
    /// Refuses what fits no run, as far as the arguments alone tell.
    fn check(&self) -> Result<(), Failure> {
        if let (Some((named, example)), Some(robots)) = (self.named_robots(), self.robots)
            && named != usize::from(robots)
        {
            return Err(Failure::usage(format!(
                "--link {} names {}, --robots {robots} wants another number: name one address for each \
                 robot, as in {example}, and leave --robots away",
                self.link,
                counted(named, "robot")
            )));
        }
        if self.link.tcp().is_some() {
            self.check_without_images()?;
        }
        if let (Some(options), Some(cycle_us)) = (self.link.enip_options(), self.cycle_us) {
            return Err(Failure::usage(format!(
                "--cycle-us {cycle_us}: on EtherNet/IP the robot decides the period of the run; ask for one \
                 with ?rpi_ms= behind --link (asked for now: {})",
                words::ms(options.rpi)
            )));
        }
        let most = match self.link {
            LinkChoice::EnipSim { .. } | LinkChoice::Enip(_) | LinkChoice::Tcp(_) => MOST_ROBOTS,
            _ => MAX_ROBOTS,
        };
        let (programs, robots) = (self.programs.len(), self.robots());
        if robots > most {
            return Err(Failure::usage(format!(
                "--robots {robots}: --link {} drives {most} at most{}",
                self.link,
                if most < MOST_ROBOTS { "; on EtherNet/IP there may be more" } else { "" }
            )));
        }
        if programs != 1 && programs != robots {
            let noun = if robots == 1 { "robot" } else { "robots" };
            return Err(Failure::usage(format!(
                "{programs} programs for {robots} {noun}: give one program, which every robot runs, \
                 or one for each robot (--robots says how many there are)"
            )));
        }
        if let LinkChoice::Ethercat { interface, position: Some(_) } = &self.link
            && robots > 1
        {
            return Err(Failure::usage(format!(
                "--link {} is one robot, --robots {robots} wants more: --link ethercat:{interface} \
                 takes the first {robots} of the segment",
                self.link
            )));
        }
        self.ethercat.check(micros(self.cycle())).map_err(Failure::usage)?;
        let is_ethercat =
            matches!(self.link, LinkChoice::EthercatSim | LinkChoice::Ethercat { .. });
        if let (false, Some(option)) = (is_ethercat, self.ethercat.given()) {
            let what = if let LinkChoice::Sim = self.link { "no bus" } else { "another bus" };
            return Err(Failure::usage(format!(
                "{option} is about EtherCAT, and --link {} has {what}: --link ethercat-sim has it",
                self.link
            )));
        }
        if self.link.is_in_process() {
            return Ok(());
        }
        if self.fast {
            return Err(Failure::usage(format!(
                "--fast needs simulated time, and the robots of --link {} live in real time: leave \
                 --fast away, or use --link {}",
                self.link,
                match self.link {
                    LinkChoice::Tcp(_) => "tcp-sim",
                    LinkChoice::Enip(_) => "enip-sim",
                    _ => "ethercat-sim",
                }
            )));
        }
        match self.sim.given() {
            Some(option) => Err(Failure::usage(format!(
                "{option} builds virtual robots in this process, and --link {} has none",
                self.link
            ))),
            None => Ok(()),
        }
    }

    /// Refuses what means something for images only.
    fn check_without_images(&self) -> Result<(), Failure> {
        let refused = |option: &str, why: &str| {
            Err(Failure::usage(format!("{option}: --link {} {why}", self.link)))
        };
        if let Some(cycle_us) = self.cycle_us {
            return refused(
                &format!("--cycle-us {cycle_us}"),
                "has no cycles; ?interval_ms= sets how often the robot tells its position",
            );
        }
        if self.byte_order != OrderSetting::Auto {
            return refused("--byte-order", "sends text, which has no byte order; leave it away");
        }
        if let Some(option @ "--sim-byte-order") = self.sim.given() {
            return refused(option, "sends text, which has no byte order; leave it away");
        }
        Ok(())
    }

    /// How many robots the link itself names, and how several are named.
    fn named_robots(&self) -> Option<(usize, &'static str)> {
        match &self.link {
            LinkChoice::Enip(name) => {
                Some((name.hosts.len(), "enip:ADDR,ADDR or enip:192.168.0.101-104"))
            }
            LinkChoice::Tcp(name) if !name.is_in_process() => {
                Some((name.hosts.len(), "tcp:ADDR,ADDR"))
            }
            _ => None,
        }
    }

    /// How many robots there are.
    fn robots(&self) -> usize {
        match (self.named_robots(), self.robots) {
            (Some((named, _)), None) => named,
            (_, robots) => usize::from(robots.unwrap_or(1)),
        }
    }

    /// Period of the bus cycle to ask for.
    fn cycle(&self) -> Duration {
        match self.link.enip_options() {
            Some(options) => options.rpi,
            None => Duration::from_micros(self.cycle_us.unwrap_or(CYCLE_US)),
        }
    }

    /// Cycles between two looks at the progress.
    fn progress_cycles(&self, cycle: Duration) -> u64 {
        match self.fast {
            true => SIMULATED_PROGRESS_CYCLES,
            false => REAL_PROGRESS_US / micros(cycle).max(1),
        }
    }

    fn pace(&self) -> AnyPace {
        if self.fast {
            AnyPace::Simulated(SimulatedTime)
        } else {
            AnyPace::Real(RealTime::default())
        }
    }

    /// Where the reports go, robot by robot.
    fn report_directories(&self) -> Vec<Option<PathBuf>> {
        let directory = |number| {
            let directory = self.report.as_ref()?;
            Some(match self.robots() {
                1 => directory.clone(),
                _ => directory.join(format!("robot-{number}")),
            })
        };
        (1..=self.robots()).map(directory).collect()
    }

    /// What messages and plots call a robot: its program, and its number where there are several.
    fn title(&self, number: usize, source: &Source) -> String {
        match self.robots() {
            1 => source.name.clone(),
            _ => format!("robot {number}: {}", source.name),
        }
    }
}

/// While a link is opened: an interrupt ends the process at once.
static NOTHING_MOVES: AtomicBool = AtomicBool::new(false);

/// Says whether anything moves or is connected that would have to be ended in good order.
pub(super) fn set_nothing_moves(nothing_moves: bool) {
    NOTHING_MOVES.store(nothing_moves, Ordering::Relaxed);
}

/// One robot of the run, and what becomes of it.
struct Robot<'p> {
    source: &'p Source,
    engine: Engine<QUEUE>,
    runner: Runner<'p>,
    recording: Recording,
}

impl<'p> Robot<'p> {
    fn new(
        source: &'p Source,
        args: &RunArgs,
        period: Duration,
        layout: FirmwareLayout,
    ) -> Result<Self, Failure> {
        Ok(Self {
            source,
            engine: Engine::new(Config { layout, ..config(args, period, &source.program)? }),
            runner: Runner::new(&source.program),
            recording: Recording::new(),
        })
    }
}

pub(super) fn run(args: &RunArgs) -> Result<Exit, Failure> {
    args.check()?;
    let [.., fewest_checkpoints] = OWN_CHECKPOINTS;
    let sources = source::read_all(&args.programs, args.revision.into(), fewest_checkpoints)?;
    let directories = args.report_directories();
    directories.iter().flatten().try_for_each(|directory| report_files::prepare(directory))?;
    let count = args.robots();
    let interrupted = catch_interrupts()?;
    if let Some(link) = args.link.tcp() {
        let of_robots = || sources.iter().cycle().take(count);
        return text::run::run(&TcpRun {
            link,
            sources: of_robots().collect(),
            titles: (1..)
                .zip(of_robots())
                .map(|(number, source)| args.title(number, source))
                .collect(),
            directories,
            interrupted,
            sim: &args.sim,
            revision: args.revision.into(),
            fast: args.fast,
            is_quiet: args.quiet,
        });
    }
    // Nothing moves yet, so whoever interrupts now need not wait.
    set_nothing_moves(true);
    let segment = open_segment(Opening {
        link: &args.link,
        robots: count,
        cycle: args.cycle(),
        ethercat: &args.ethercat,
        sim: &args.sim,
        revision: args.revision.into(),
        is_quiet: args.quiet,
    })?;
    set_nothing_moves(false);
    // Where the robots decide it, it may be another than was asked for.
    let period = segment.period().unwrap_or(args.cycle());
    // One program serves all robots.
    let of_robots = sources.iter().cycle().take(count).enumerate();
    let mut robots: Vec<Robot<'_>> = of_robots
        .map(|(number, source)| Robot::new(source, args, period, segment.firmware(number)))
        .collect::<Result<_, _>>()?;
    let mut periodic = Periodic::over_segment::<Engine<QUEUE>>(segment, args.pace(), period);
    let driven = drive_robots(args, period, &mut robots, &mut periodic, &interrupted);
    if driven.is_err() {
        periodic.segment_mut().close();
    }
    let (outcomes, wall_time) = driven?;

    let figures = periodic.segment().figures();
    let bus =
        figures.map(|(statistics, frames, limit)| ReportedBus::new(statistics, frames, limit));
    let enip: Vec<_> = (0..count).map(|robot| periodic.segment().enip_report(robot)).collect();
    // Before anything slow: without outputs the watchdogs of the robots run.
    periodic.segment_mut().close();
    let mut endings = Endings::of(count);
    let places = periodic.ports().iter().zip(&directories);
    for (number, (((robot, outcome), (port, directory)), enip)) in
        (1..).zip(robots.iter().zip(&outcomes).zip(places).zip(enip))
    {
        let source = robot.source;
        let order = args.byte_order.fixed();
        let (exit, message) = wording::outcome(outcome, &source.name, &source.program, order);
        let report = Report::new(
            number,
            source.name.clone(),
            settings(args, period, &robot.engine),
            &Sources {
                program: &source.program,
                outcome,
                exit_code: exit as u8,
                message: &message,
                counts: robot.runner.counts(),
                records: robot.runner.records(),
                cyclic: Some(Cyclic {
                    acknowledgement_cycles: robot.runner.acknowledgement_cycles().quantiles(),
                    statistics: periodic.statistics(),
                    port,
                }),
                tcp: None,
                bus,
                enip,
                recording: &robot.recording,
                wall_time_s: wall_time.as_secs_f64(),
            },
        );
        let title = args.title(number, source);
        endings.add((exit, message), report, &robot.recording, directory.as_deref(), &title);
    }
    endings.tell()
}

/// Drives all robots to their ends, while another thread tells of it: their outcomes, and the time
/// that it took.
fn drive_robots(
    args: &RunArgs,
    period: Duration,
    robots: &mut [Robot<'_>],
    periodic: &mut Periodic<Segment, AnyPace>,
    interrupted: &Arc<AtomicBool>,
) -> Result<(Vec<Outcome>, Duration), Failure> {
    let (mut watchers, bus, messages) =
        Watcher::all(robots.len(), interrupted, args.progress_cycles(period));
    periodic.segment_mut().watch(Some(bus));
    let programs: Vec<&Program> = robots.iter().map(|robot| &robot.source.program).collect();
    thread::scope(|scope| {
        scope.spawn(move || watch::draw(messages, &programs, args.quiet));
        let mut seats: Vec<_> = robots
            .iter_mut()
            .zip(&mut watchers)
            .map(|(robot, watcher)| {
                Seat::new(&mut robot.engine, &mut robot.runner, &mut robot.recording, watcher)
            })
            .collect();
        let clock = MonotonicClock::new();
        let ended = drive_all(periodic, &mut seats);
        let wall_time = clock.now() - Instant::ZERO;
        let outcomes = seats.into_iter().map(Seat::into_outcome).collect();
        // The other thread draws until nobody can tell it anything.
        drop(watchers);
        periodic.segment_mut().watch(None);
        match ended {
            Ok(()) => Ok((outcomes, wall_time)),
            Err(error) => Err(Failure::link(format!("the link failed: {error}"))),
        }
    })
}

/// How the run was set up, for the report of one robot.
fn settings(args: &RunArgs, period: Duration, engine: &Engine<QUEUE>) -> Settings {
    Settings {
        link: args.link.to_string(),
        robots: args.robots(),
        cycle_us: Some(micros(period)),
        pace: if args.fast { "simulated" } else { "real" },
        byte_order: Some(args.byte_order.fixed().map_or("auto".into(), |order| order.to_string())),
        byte_order_used: engine.byte_order().map(|order| order.to_string()),
        revision: Revision::from(args.revision).to_string(),
    }
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
        if NOTHING_MOVES.load(Ordering::Relaxed) || since_first > SECOND_SIGNAL_AFTER {
            #[cfg(target_os = "linux")]
            super::sim::give_terminal_back();
            process::exit(Exit::Interrupted as i32);
        }
    })
    .map_err(|error| Failure::internal(format!("cannot catch Ctrl-C: {error}")))?;
    Ok(interrupted)
}

/// Whole microseconds of `duration`.
fn micros(duration: Duration) -> u64 {
    u64::try_from(duration.as_micros()).unwrap_or(u64::MAX)
}

/// Checkpoint numbers for following the commands of a program, first and last.
pub(super) fn own_checkpoints(program: &Program) -> Result<(u16, u16), Failure> {
    let free = OWN_CHECKPOINTS.iter().find_map(|count| program.free_checkpoints(*count));
    free.ok_or_else(|| {
        Failure::internal("no checkpoint numbers are free, though the program was checked for it")
    })
}

fn config(args: &RunArgs, period: Duration, program: &Program) -> Result<Config, Failure> {
    let (first, last) = own_checkpoints(program)?;
    let defaults = Config::default();
    // A frame that waited in a queue may still arrive; without a bus none waits.
    let longest_delay = match args.link {
        LinkChoice::Sim | LinkChoice::Tcp(_) => Duration::ZERO,
        LinkChoice::EthercatSim | LinkChoice::Ethercat { .. } => LONGEST_DELAY,
        LinkChoice::EnipSim { .. } | LinkChoice::Enip(_) => LONGEST_DELAY,
    };
    let delay_cycles = longest_delay.as_micros().div_ceil(period.as_micros().max(1));
    let delay_cycles = u16::try_from(delay_cycles).unwrap_or(u16::MAX);
    // Whoever asks for a longer watchdog wants to outlast longer silence: the connection says when it is over.
    let watchdog_cycles = args.link.enip_options().map_or(0, |options| options.multiplier.factor());
    let watchdog_cycles = u16::try_from(watchdog_cycles).unwrap_or(u16::MAX);
    Ok(Config {
        byte_order: match args.byte_order.fixed() {
            Some(order) => ByteOrderSetting::Fixed(order),
            None => ByteOrderSetting::Auto,
        },
        revision: args.revision.into(),
        // Completion of every single line is worth more here than the last command per second.
        checkpoints: CheckpointPolicy::EachCommand,
        checkpoint_range: CheckpointRange { first, last },
        bad_cycles_limit: defaults.bad_cycles_limit.max(watchdog_cycles),
        settle_cycles: defaults.settle_cycles.max(delay_cycles),
        // The runner refreshes a velocity in every cycle; a late one must not stop the motion.
        velocity_dead_man: defaults.velocity_dead_man.max(4 * period),
        ..defaults
    })
}
