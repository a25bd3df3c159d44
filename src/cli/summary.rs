//! The summary of a run, on standard output.

use std::prelude::v1::*;

use super::report::Report;

/// The report in a dozen lines.
pub(super) fn text(report: &Report, files: &[String]) -> String {
    let mut lines = Vec::new();
    let mut line = |name: &str, value: String| lines.push(format!("  {name:<16} {value}\n"));
    let commands = &report.commands;
    let mut counts =
        format!("{} of {} done, {} accepted", commands.done, commands.total, commands.accepted);
    for (count, what) in [(commands.aborted, "aborted"), (commands.unknown, "unknown")] {
        if count > 0 {
            counts += &format!(", {count} {what}");
        }
    }
    line("commands", counts);
    let latency = &report.acknowledgement_cycles;
    line(
        "acknowledgement",
        if latency.count == 0 {
            "none".into()
        } else {
            format!(
                "min {}   p50 {}   p99 {}   max {} cycles",
                latency.min, latency.p50, latency.p99, latency.max
            )
        },
    );
    let cycles = &report.cycles;
    let simulated = report.settings.pace == "simulated";
    let quantiles = |q: &super::report::ReportedQuantiles, unit: &str, scale: f64| {
        format!(
            "min {:.3}   p50 {:.3}   p99 {:.3}   max {:.3} {unit}",
            q.min * scale,
            q.p50 * scale,
            q.p99 * scale,
            q.max * scale
        )
    };
    line(
        "cycle time",
        quantiles(&cycles.cycle_time_us, "ms", 1e-3) + if simulated { " (simulated)" } else { "" },
    );
    line("work per cycle", quantiles(&cycles.work_us, "us", 1.0));
    line(
        "cycles",
        format!(
            "{} at {:.3} ms, {} {}",
            cycles.count,
            report.settings.cycle_us as f64 * 1e-3,
            cycles.overruns,
            if cycles.overruns == 1 { "overrun" } else { "overruns" }
        ),
    );
    let order = report.settings.byte_order_used.as_deref().unwrap_or("never settled");
    let how = if report.settings.byte_order == "auto" { "found" } else { "as told" };
    line("byte order", format!("{order} ({how})"));
    if let Some(distance_mm) = report.distance_mm {
        line("distance", format!("{distance_mm:.1} mm, homing included"));
    }
    if let Some(robot_time_s) = report.robot_time_s {
        line("robot time", format!("{robot_time_s:.3} s"));
    }
    line("wall time", format!("{:.3} s", report.wall_time_s));
    if !report.unconfirmed_lines.is_empty() {
        line("unconfirmed", unconfirmed(&report.unconfirmed_lines));
    }
    if !files.is_empty() {
        line("report", files.join(", "));
    }
    let verdict = match (report.outcome.end, report.outcome.line) {
        ("completed", _) => "done".to_string(),
        ("interrupted", Some(at)) => format!("interrupted at line {at}"),
        ("interrupted", None) => "interrupted".to_string(),
        (_, Some(at)) => format!("stopped at line {at}"),
        (_, None) => "stopped".to_string(),
    };
    format!("{}: {verdict}\n\n{}", report.program, lines.concat())
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
