//! `report.json`: everything that is known about the run of one robot, for programs to read.
//!
//! The file is one [`Report`]; the names of the fields are the names in the file. The meaning of a
//! field changes only together with [`SCHEMA_VERSION`]; new fields may appear at any time.

mod enip;
mod tcp;

use std::prelude::v1::*;

use serde::Serialize;

pub use enip::{ReportedCounters, ReportedEnip};
pub use tcp::ReportedTcp;

use crate::link::ethercat::{FrameCounters, SegmentStatistics};
use crate::run::outcome::{End, Outcome, Stop};
use crate::run::periodic::Port;
use crate::run::program::{Program, needs_a_tool};
use crate::run::record::{Counts, StepEnd, StepRecord};
use crate::run::recording::{Recording, Sample};
use crate::run::statistics::{CycleStatistics, Quantiles};
use crate::time::{Duration, Instant};
use crate::wire::meca500::command::MotionCommand;
use crate::wire::meca500::text::Statement;

/// Version of the meaning of the fields.
pub const SCHEMA_VERSION: u32 = 1;

/// The run of one robot.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Always `fieldarm.run`.
    pub schema: &'static str,
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Version of the program that wrote the report.
    pub fieldarm_version: &'static str,
    /// Number of the robot on its segment, from 1.
    pub robot: usize,
    /// Path of the robot program as it was given.
    pub program: String,
    /// How the run was set up.
    pub settings: Settings,
    /// How it ended.
    pub outcome: ReportedOutcome,
    /// Commands by what became of them.
    pub commands: ReportedCounts,
    /// Cycles from sending a command to its acknowledgement; `null` over TCP, which has no cycles.
    pub acknowledgement_cycles: Option<ReportedQuantiles>,
    /// Bus cycles: of the whole run, so those of all robots on the segment; `null` over TCP.
    pub cycles: Option<ReportedCycles>,
    /// What the frames were like; without a bus there are none.
    pub bus: Option<ReportedBus>,
    /// The robot's connection on EtherNet/IP; on another link there is none.
    pub enip: Option<ReportedEnip>,
    /// The robot's text interface; on another link there is none.
    pub tcp: Option<ReportedTcp>,
    /// Path length of the tool in mm, homing included; `null` where the inputs made no sense.
    pub distance_mm: Option<f64>,
    /// Time that passed on the robot's clock, in seconds; `null` where the inputs made no sense, or where a
    /// robot on TCP tells no time.
    pub robot_time_s: Option<f64>,
    /// Time that passed on the wall, in seconds.
    pub wall_time_s: f64,
    /// The output image that was sent last, in hex; `null` over TCP, which has none.
    pub final_outputs: Option<String>,
    /// Every command of the program.
    pub steps: Vec<ReportedStep>,
    /// Lines that are done as far as anybody can know, but that the robot may have refused without
    /// telling: it acknowledges a gripper command without a gripper. None over TCP, where it tells.
    pub unconfirmed_lines: Vec<u32>,
    /// Samples of the run, evenly spaced.
    pub samples: Samples,
}

/// How a run was set up.
#[derive(Clone, Debug, Serialize)]
pub struct Settings {
    /// The link as it was given.
    pub link: String,
    /// Robots that share the segment and its bus cycles.
    pub robots: usize,
    /// Period of the bus, in microseconds; `null` over TCP.
    pub cycle_us: Option<u64>,
    /// `real` or `simulated`.
    pub pace: &'static str,
    /// `auto` or the order that was set; `null` over TCP, which sends text.
    pub byte_order: Option<String>,
    /// The order that was used; `null` if it was never found.
    pub byte_order_used: Option<String>,
    /// Hardware revision, `R3` or `R4`.
    pub revision: String,
}

/// How a run ended.
#[derive(Clone, Debug, Serialize)]
pub struct ReportedOutcome {
    /// `completed`, `interrupted`, `robot_error`, `safety_stop`, `action_failed`,
    /// `velocity_stopped`, `held_back`, `monitoring_only`, `rebooted`, `refused`,
    /// `connection_lost`, `not_connected`, `implausible_inputs`, `byte_order_undecidable` or `fault`.
    pub end: &'static str,
    /// Exit code that the command has for it; of several robots the worst decides.
    pub exit_code: u8,
    /// The robot's error code.
    pub robot_error: Option<u16>,
    /// Line of the program that caused it or was under way, from 1.
    pub line: Option<u32>,
    /// Text of that line.
    pub text: Option<String>,
    /// `not_needed`, `confirmed` or `unconfirmed`: whether motion was stopped on purpose.
    pub stop: &'static str,
    /// What was said on standard error.
    pub message: String,
}

/// Commands by what became of them.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ReportedCounts {
    /// In the program.
    pub total: usize,
    /// Given to the engine.
    pub submitted: u32,
    /// Taken by the robot.
    pub accepted: u32,
    /// Executed.
    pub done: u32,
    /// Dropped.
    pub aborted: u32,
    /// Of unknown fate.
    pub unknown: u32,
}

/// Summary of a quantity.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ReportedQuantiles {
    /// How many values were counted.
    pub count: u64,
    /// Smallest.
    pub min: f64,
    /// Median.
    pub p50: f64,
    /// 99 of 100 are not above it.
    pub p99: f64,
    /// Largest.
    pub max: f64,
}

/// What the bus cycles were like.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ReportedCycles {
    /// Cycles that took place.
    pub count: u64,
    /// Deadlines that passed without a cycle.
    pub overruns: u64,
    /// Cycles with stale inputs from this robot, until its program ended.
    pub stale: u64,
    /// Cycles without inputs to be trusted from this robot, until its program ended.
    pub lost: u64,
    /// From beginning to beginning, in microseconds of the pace.
    pub cycle_time_us: ReportedQuantiles,
    /// From deadline to beginning, in microseconds of the pace.
    pub lateness_us: ReportedQuantiles,
    /// What the link and all engines took in a cycle, in microseconds of the wall clock.
    pub work_us: ReportedQuantiles,
    /// What this robot's engine took in a cycle, in microseconds of the wall clock.
    pub engine_us: ReportedQuantiles,
}

impl ReportedCycles {
    fn new(statistics: &CycleStatistics, port: &Port) -> Self {
        let of_robot = port.statistics();
        Self {
            count: statistics.cycles,
            overruns: statistics.overruns,
            stale: of_robot.stale,
            lost: of_robot.lost,
            cycle_time_us: quantiles(statistics.cycle_time_ns.quantiles(), 1e-3),
            lateness_us: quantiles(statistics.lateness_ns.quantiles(), 1e-3),
            work_us: quantiles(statistics.work_ns.quantiles(), 1e-3),
            engine_us: quantiles(of_robot.controller_ns.quantiles(), 1e-3),
        }
    }
}

/// What the frames of a real bus were like, for all its robots.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ReportedBus {
    /// From sending the frames of a cycle to having all of them back, in microseconds.
    pub exchange_us: ReportedQuantiles,
    /// Cycles in which a frame did not come back in time: lost, or late.
    pub lost: u64,
    /// How long a cycle waited for its frames, in microseconds.
    pub reply_limit_us: u64,
    /// Frames that answered nothing: late, twice, mangled or somebody else's.
    pub stray: u64,
    /// Robots and cycles in which the working counter did not add up.
    pub wrong_counter: u64,
    /// How much faster the distributed clock runs than ours, in parts per million.
    pub clock_drift_ppm: Option<f64>,
    /// Largest distance of a frame from its place before SYNC0, in microseconds.
    pub worst_phase_error_us: Option<f64>,
}

impl ReportedBus {
    pub(super) fn new(
        statistics: &SegmentStatistics,
        frames: FrameCounters,
        reply_limit: Duration,
    ) -> Self {
        let exchange = &statistics.exchange_ns;
        let us = |ns: u64| if exchange.is_empty() { 0.0 } else { ns as f64 * 1e-3 };
        Self {
            exchange_us: ReportedQuantiles {
                count: exchange.len(),
                min: us(exchange.min()),
                p50: us(exchange.value_at_quantile(0.5)),
                p99: us(exchange.value_at_quantile(0.99)),
                max: us(exchange.max()),
            },
            lost: statistics.lost,
            reply_limit_us: u64::try_from(reply_limit.as_micros()).unwrap_or(u64::MAX),
            stray: frames.stray,
            wrong_counter: statistics.wrong_counter,
            clock_drift_ppm: statistics.clock.map(|clock| clock.drift_ppb * 1e-3),
            worst_phase_error_us: statistics
                .clock
                .map(|clock| clock.worst_phase_error_ns as f64 * 1e-3),
        }
    }
}

/// What became of one command. Times are in seconds since the first cycle.
#[derive(Clone, Debug, Serialize)]
pub struct ReportedStep {
    /// Line in the program, from 1.
    pub line: u32,
    /// Text of the line.
    pub text: String,
    /// `open`, `done`, `aborted` or `unknown`.
    pub end: &'static str,
    /// Given to the engine.
    pub submitted_s: Option<f64>,
    /// Acknowledgement seen.
    pub accepted_s: Option<f64>,
    /// Everything before it known to be done.
    pub started_s: Option<f64>,
    /// End known.
    pub ended_s: Option<f64>,
}

/// Samples of a run, one row each.
#[derive(Clone, Debug, Serialize)]
pub struct Samples {
    /// One of so many cycles is a row; over TCP, one of so many monitoring intervals.
    pub every_cycles: u64,
    /// Names of the columns, units last.
    pub columns: &'static [&'static str],
    /// The rows; `null` where the link does not tell.
    pub rows: Vec<Vec<f64>>,
}

/// What only a link with cycles has.
#[derive(Clone, Copy)]
pub(super) struct Cyclic<'a> {
    pub(super) acknowledgement_cycles: Quantiles,
    pub(super) statistics: &'a CycleStatistics,
    pub(super) port: &'a Port,
}

/// What a report is made of.
pub(super) struct Sources<'a> {
    pub(super) program: &'a Program,
    pub(super) outcome: &'a Outcome,
    pub(super) exit_code: u8,
    pub(super) message: &'a str,
    pub(super) counts: Counts,
    pub(super) records: &'a [StepRecord],
    /// What only a link with cycles has.
    pub(super) cyclic: Option<Cyclic<'a>>,
    pub(super) tcp: Option<ReportedTcp>,
    pub(super) bus: Option<ReportedBus>,
    pub(super) enip: Option<ReportedEnip>,
    pub(super) recording: &'a Recording,
    pub(super) wall_time_s: f64,
}

impl Report {
    pub(super) fn new(
        robot: usize,
        program_path: String,
        settings: Settings,
        sources: &Sources<'_>,
    ) -> Self {
        let Sources { program, outcome, counts, recording, cyclic, .. } = *sources;
        let makes_sense = !matches!(outcome.end, End::ImplausibleInputs);
        let line = outcome.step.and_then(|step| program.steps().get(step)).map(|step| step.line);
        Self {
            schema: "fieldarm.run",
            schema_version: SCHEMA_VERSION,
            fieldarm_version: env!("CARGO_PKG_VERSION"),
            robot,
            program: program_path,
            settings,
            outcome: ReportedOutcome {
                end: end_name(&outcome.end),
                exit_code: sources.exit_code,
                robot_error: match outcome.end {
                    End::RobotError(code) => Some(code.0),
                    _ => None,
                },
                line,
                text: line.map(|line| program.line_text(line).to_string()),
                stop: match outcome.stop {
                    Stop::NotNeeded => "not_needed",
                    Stop::Confirmed => "confirmed",
                    Stop::Deactivated => "deactivated",
                    Stop::NotActivated => "not_activated",
                    Stop::LinkLost => "link_lost",
                    Stop::Unconfirmed => "unconfirmed",
                },
                message: sources.message.to_string(),
            },
            commands: ReportedCounts {
                total: program.steps().len(),
                submitted: counts.submitted,
                accepted: counts.accepted,
                done: counts.done,
                aborted: counts.aborted,
                unknown: counts.unknown,
            },
            acknowledgement_cycles: cyclic
                .map(|cyclic| quantiles(cyclic.acknowledgement_cycles, 1.0)),
            cycles: cyclic.map(|cyclic| ReportedCycles::new(cyclic.statistics, cyclic.port)),
            bus: sources.bus,
            enip: sources.enip.clone(),
            tcp: sources.tcp.clone(),
            distance_mm: makes_sense.then(|| recording.distance_mm()),
            robot_time_s: Some(recording.robot_time_us())
                .filter(|us| makes_sense && (cyclic.is_some() || *us > 0))
                .map(|us| us as f64 * 1e-6),
            wall_time_s: sources.wall_time_s,
            final_outputs: cyclic
                .map(|cyclic| cyclic.port.outputs().iter().map(|b| format!("{b:02x}")).collect()),
            steps: steps(sources),
            unconfirmed_lines: match cyclic {
                Some(_) => unconfirmed_lines(sources),
                None => Vec::new(),
            },
            samples: Samples {
                every_cycles: recording.stride(),
                columns: COLUMNS,
                rows: recording.samples().iter().map(row).collect(),
            },
        }
    }
}

fn steps(sources: &Sources<'_>) -> Vec<ReportedStep> {
    let begin = sources.recording.begin().unwrap_or_default();
    let since_begin = |at: Option<Instant>| at.map(|at| (at - begin).as_secs_f64());
    let steps = sources.program.steps().iter().zip(sources.records);
    steps
        .map(|(step, record)| ReportedStep {
            line: step.line,
            text: sources.program.line_text(step.line).to_string(),
            end: match record.end {
                StepEnd::Open => "open",
                StepEnd::Done => "done",
                StepEnd::Aborted(_) => "aborted",
                StepEnd::Unknown => "unknown",
            },
            submitted_s: since_begin(record.submitted),
            accepted_s: since_begin(record.accepted),
            started_s: since_begin(record.started),
            ended_s: since_begin(record.ended),
        })
        .collect()
}

fn unconfirmed_lines(sources: &Sources<'_>) -> Vec<u32> {
    let steps = sources.program.steps().iter().zip(sources.records);
    steps
        .filter(|(step, record)| {
            matches!(record.end, StepEnd::Done) && tells_no_refusal(&step.statement)
        })
        .map(|(step, _)| step.line)
        .collect()
}

/// Whether nothing in the cyclic image would tell that the robot refused the command: it needs a tool
/// or a program that may not be there.
const fn tells_no_refusal(statement: &Statement) -> bool {
    match statement {
        Statement::Motion(MotionCommand::StartProgram(_)) => true,
        Statement::Motion(command) => needs_a_tool(command),
        _ => false,
    }
}

const COLUMNS: &[&str] = &[
    "time_s",
    "joint_1_deg",
    "joint_2_deg",
    "joint_3_deg",
    "joint_4_deg",
    "joint_5_deg",
    "joint_6_deg",
    "x_mm",
    "y_mm",
    "z_mm",
    "alpha_deg",
    "beta_deg",
    "gamma_deg",
    "fifo_space",
    "move_id_sent",
    "move_id_echoed",
    "submitted",
    "accepted",
    "done",
];

fn row(sample: &Sample) -> Vec<f64> {
    let seen = &sample.seen;
    let mut row = vec![sample.at.as_secs_f64()];
    // Reals go through their shortest text, so that the file does not show digits nobody sent.
    row.extend(
        seen.joints_deg
            .iter()
            .chain(&seen.pose)
            .map(|value| value.to_string().parse::<f64>().unwrap_or(f64::NAN)),
    );
    // What is no number becomes `null` in the file.
    let or_null = |value: Option<u16>| value.map_or(f64::NAN, f64::from);
    let [sent, echoed] = [seen.move_ids.map(|ids| ids.sent), seen.move_ids.map(|ids| ids.echoed)];
    row.extend([seen.fifo_space, sent, echoed].map(or_null));
    row.extend([sample.submitted, sample.accepted, sample.done].map(f64::from));
    row
}

pub(super) fn quantiles(quantiles: Quantiles, scale: f64) -> ReportedQuantiles {
    ReportedQuantiles {
        count: quantiles.count,
        min: quantiles.min as f64 * scale,
        p50: quantiles.p50 as f64 * scale,
        p99: quantiles.p99 as f64 * scale,
        max: quantiles.max as f64 * scale,
    }
}

const fn end_name(end: &End) -> &'static str {
    match end {
        End::Completed => "completed",
        End::Interrupted => "interrupted",
        End::RobotError(_) => "robot_error",
        End::SafetyStop(_) => "safety_stop",
        End::LinkFailed(_) => "link_failed",
        End::ActionFailed(..) => "action_failed",
        End::VelocityStopped(_) => "velocity_stopped",
        End::HeldBack(_) => "held_back",
        End::MonitoringOnly => "monitoring_only",
        End::Rebooted => "rebooted",
        End::Refused(_) | End::RequestRefused(_) => "refused",
        End::ConnectionLost => "connection_lost",
        End::NotConnected => "not_connected",
        End::ImplausibleInputs => "implausible_inputs",
        End::ByteOrderUndecidable => "byte_order_undecidable",
        End::Fault(_) => "fault",
    }
}
