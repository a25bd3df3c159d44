//! The summary of a run, on standard output.

use std::prelude::v1::*;

use super::report::{Report, ReportedEnip, ReportedQuantiles};
use super::wording::{counted, not_back_in_time};

/// Lines of a summary: names and values.
#[derive(Default)]
struct Lines(String);

impl Lines {
    fn add(&mut self, name: &str, value: impl AsRef<str>) {
        self.0 += &format!("  {name:<16} {}\n", value.as_ref());
    }
}

/// The report of the only robot of a run, in a dozen lines.
pub(super) fn of_one(report: &Report, files: &[String]) -> String {
    let mut lines = Lines::default();
    add_commands(&mut lines, report);
    add_bus(&mut lines, report);
    add_robot(&mut lines, report);
    lines.add("wall time", wall_time(report));
    add_notes(&mut lines, report, files);
    format!("{}\n\n{}", headline(report), lines.0)
}

/// The reports of all robots of a run with the files written, one block each; what the robots share
/// comes last.
pub(super) fn of_several(reports: &[(Report, Vec<String>)]) -> String {
    let mut text = String::new();
    for (report, files) in reports {
        let mut lines = Lines::default();
        add_commands(&mut lines, report);
        if let Some(cycles) = &report.cycles {
            lines.add("engine per cycle", quantiles(&cycles.engine_us, "us", 1.0));
        }
        add_robot(&mut lines, report);
        add_notes(&mut lines, report, files);
        text += &format!("robot {}: {}\n\n{}\n", report.robot, headline(report), lines.0);
    }
    if let Some((report, _)) = reports.first() {
        let mut lines = Lines::default();
        add_bus(&mut lines, report);
        lines.add("wall time", wall_time(report));
        let settings = &report.settings;
        text += &format!("{} robots over {}\n\n{}", settings.robots, settings.link, lines.0);
    }
    text
}

/// The program and what came of it.
fn headline(report: &Report) -> String {
    let verdict = match (report.outcome.end, report.outcome.line) {
        ("completed", _) => "done".to_string(),
        ("interrupted", Some(at)) => format!("interrupted at line {at}"),
        ("interrupted", None) => "interrupted".to_string(),
        (_, Some(at)) => format!("stopped at line {at}"),
        (_, None) => "stopped".to_string(),
    };
    format!("{}: {verdict}", report.program)
}

/// What became of the commands, and how soon the robot took them.
fn add_commands(lines: &mut Lines, report: &Report) {
    let commands = &report.commands;
    let mut counts =
        format!("{} of {} done, {} accepted", commands.done, commands.total, commands.accepted);
    for (count, what) in [(commands.aborted, "aborted"), (commands.unknown, "unknown")] {
        if count > 0 {
            counts += &format!(", {count} {what}");
        }
    }
    lines.add("commands", counts);
    if let Some(tcp) = &report.tcp {
        lines.add("answers", quantiles(&tcp.answer_us, "ms", 1e-3));
    }
    let Some(latency) = &report.acknowledgement_cycles else { return };
    lines.add(
        "acknowledgement",
        if latency.count == 0 {
            "none".into()
        } else {
            format!(
                "min {}   p50 {}   p99 {}   max {}",
                latency.min,
                latency.p50,
                latency.p99,
                counted(latency.max as u64, "cycle")
            )
        },
    );
}

/// What the bus cycles were like.
fn add_bus(lines: &mut Lines, report: &Report) {
    let (Some(cycles), Some(cycle_us)) = (&report.cycles, report.settings.cycle_us) else { return };
    let simulated = if report.settings.pace == "simulated" { " (simulated)" } else { "" };
    lines.add("cycle time", quantiles(&cycles.cycle_time_us, "ms", 1e-3) + simulated);
    lines.add("work per cycle", quantiles(&cycles.work_us, "us", 1.0));
    lines.add(
        "cycles",
        format!(
            "{} at {:.3} ms, {}",
            cycles.count,
            cycle_us as f64 * 1e-3,
            counted(cycles.overruns, "overrun")
        ),
    );
    if let Some(enip) = &report.enip {
        lines.add("gaps to robot", quantiles(&enip.o2t_gap_us, "ms", 1e-3));
        lines.add("gaps from robot", quantiles(&enip.t2o_gap_us, "ms", 1e-3));
    }
    let Some(bus) = &report.bus else { return };
    lines.add("exchange", quantiles(&bus.exchange_us, "us", 1.0));
    lines.add(
        "frames",
        format!(
            "{}, {} stray, {}",
            not_back_in_time(bus.lost, bus.reply_limit_us),
            bus.stray,
            counted(bus.wrong_counter, "wrong counter")
        ),
    );
    if let (Some(drift), Some(worst)) = (bus.clock_drift_ppm, bus.worst_phase_error_us) {
        lines.add("clock", format!("drift {drift:.1} ppm, worst phase error {worst:.1} us"));
    }
}

/// The connection on EtherNet/IP and its frames.
fn add_connection(lines: &mut Lines, enip: &ReportedEnip) {
    let ReportedEnip { o2t_api_us, t2o_api_us, .. } = *enip;
    let mut interval = format!("frames every {} ms", o2t_api_us * 1e-3);
    if o2t_api_us != t2o_api_us {
        interval += &format!(" to the robot, every {} ms from it", t2o_api_us * 1e-3);
    }
    if (o2t_api_us, t2o_api_us) != (enip.rpi_us, enip.rpi_us) {
        interval += &format!(" (asked for {} ms)", enip.rpi_us * 1e-3);
    }
    let config = match enip.config_assembly {
        Some(number) => format!("configuration assembly {number}"),
        None => "no configuration assembly".into(),
    };
    let to = match &enip.multicast {
        Some(group) => format!("inputs to the group {group}"),
        None => "inputs to us alone".into(),
    };
    lines.add("connection", format!("{interval}; {config}, {to}"));
    let counters = &enip.counters;
    let mut frames = format!(
        "{} sent, {} received, {} missed, {} out of order",
        counters.produced, counters.consumed, counters.missed, counters.out_of_order
    );
    if counters.timed_out > 0 {
        frames += &format!("; timed out {}", counted(counters.timed_out, "time"));
    }
    lines.add("frames", frames);
}

/// What is known of the robot.
fn add_robot(lines: &mut Lines, report: &Report) {
    if let Some(enip) = &report.enip {
        add_connection(lines, enip);
    }
    if let Some(tcp) = &report.tcp {
        lines.add(
            "connection",
            format!("{} lines sent, {} messages heard", tcp.lines_sent, tcp.messages_heard),
        );
    }
    if let Some(asked) = &report.settings.byte_order {
        let order = report.settings.byte_order_used.as_deref().unwrap_or("never settled");
        let how = if asked == "auto" { "found" } else { "as told" };
        lines.add("byte order", format!("{order} ({how})"));
    }
    if let Some(distance_mm) = report.distance_mm {
        lines.add("distance", format!("{distance_mm:.1} mm, homing included"));
    }
    if let Some(robot_time_s) = report.robot_time_s {
        lines.add("robot time", format!("{robot_time_s:.3} s"));
    }
}

fn wall_time(report: &Report) -> String {
    format!("{:.3} s", report.wall_time_s)
}

/// What to know beside the figures.
fn add_notes(lines: &mut Lines, report: &Report, files: &[String]) {
    if !report.unconfirmed_lines.is_empty() {
        lines.add("unconfirmed", unconfirmed(&report.unconfirmed_lines));
    }
    if !files.is_empty() {
        lines.add("report", files.join(", "));
    }
}

fn quantiles(q: &ReportedQuantiles, unit: &str, scale: f64) -> String {
    format!(
        "min {:.3}   p50 {:.3}   p99 {:.3}   max {:.3} {unit}",
        q.min * scale,
        q.p50 * scale,
        q.p99 * scale,
        q.max * scale
    )
}

/// Which lines only count as done because nothing would tell otherwise.
fn unconfirmed(lines: &[u32]) -> String {
    const SHOWN: usize = 5;
    let (shown, rest) = lines.split_at(lines.len().min(SHOWN));
    let shown: Vec<String> = shown.iter().map(ToString::to_string).collect();
    let (noun, more) = (
        if lines.len() == 1 { "line" } else { "lines" },
        if rest.is_empty() { "" } else { ", ..." },
    );
    format!(
        "{noun} {}{more}: the robot may refuse gripper, valve and StartProgram commands without \
         telling",
        shown.join(", ")
    )
}
