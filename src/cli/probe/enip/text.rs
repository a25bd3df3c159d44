//! The report as a person reads it: names on the left, one thing a line.

use std::prelude::v1::*;

use serde_json::Value;

use super::report::{
    EnipProbeReport, ReportedConnection, ReportedDevice, ReportedFrames, ReportedRobot,
};
use crate::cli::grid::Grid;
use crate::cli::probe::text::{Lines, add_identity, add_order, add_state};
use crate::cli::wording::counted;

/// The whole report.
pub(super) fn text(report: &EnipProbeReport) -> String {
    let robots = report.devices.iter().filter(|device| device.is_meca500).count();
    let mut text = format!(
        "{}: {}, {robots} of them Meca500\n",
        report.target,
        counted(report.devices.len(), "device")
    );
    if !report.devices.is_empty() {
        text += &format!("\n{}", grid(&report.devices).to_text());
    }
    for note in &report.notes {
        text += &format!("\nnote: {note}\n");
    }
    if let Some(robot) = &report.robot {
        text += &format!("\n{}", of_robot(robot));
    }
    text
}

fn grid(devices: &[ReportedDevice]) -> Grid<9> {
    let row = |device: &ReportedDevice| {
        let state = match device.state {
            None => Value::Null,
            Some(0) => "does not exist".into(),
            Some(1) => "self-test".into(),
            Some(2) => "standby".into(),
            Some(3) => "operational".into(),
            Some(4) => "recoverable fault".into(),
            Some(5) => "fault".into(),
            Some(255) => "not told".into(),
            Some(other) => other.into(),
        };
        [
            ("address", device.address.clone().into()),
            ("name", device.name.clone().into()),
            ("vendor", device.vendor.into()),
            ("type", device.device_type.into()),
            ("product", device.product_code.into()),
            ("revision", device.revision.clone().into()),
            ("serial", device.serial.into()),
            ("state", state),
            ("owner", if device.owned { "yes" } else { "no" }.into()),
        ]
    };
    devices.iter().map(row).collect()
}

fn of_robot(robot: &ReportedRobot) -> String {
    let mut lines = Lines::default();
    if let Some(trouble) = &robot.trouble {
        lines.add("trouble", trouble);
    }
    for (number, connection) in (1..).zip(&robot.connections) {
        let name = if number == 1 { "connections" } else { "" };
        lines.add(name, of_connection(connection));
    }
    if let Some(owned) = robot.owned {
        lines.add(
            "owner",
            match owned {
                true => "somebody controls it; a second owner will be refused",
                false => "nobody controls it over EtherNet/IP",
            },
        );
    }
    if let Some(order) = &robot.byte_order {
        add_order(&mut lines, order);
        add_identity(&mut lines, &robot.identity);
        if robot.identity.firmware.is_none() {
            lines.add_more(
                "(it shows these only when its outputs ask for them, and only an owner sends outputs)",
            );
        }
    }
    if let Some(state) = &robot.state {
        add_state(&mut lines, state, "not tried: this connection only watches");
    }
    if let Some(frames) = &robot.frames {
        add_frames(&mut lines, frames);
    }
    for event in &robot.events {
        lines.add("event", event);
    }
    let verdict = if robot.usable { "usable" } else { "not usable" };
    format!("robot: {verdict}\n\n{}", lines.0)
}

/// As `input-only, configuration assembly 151, unicast: accepted, frames every 10 ms`.
fn of_connection(connection: &ReportedConnection) -> String {
    let config = match connection.config_assembly {
        Some(number) => format!("configuration assembly {number}"),
        None => "no configuration assembly".into(),
    };
    let verdict = match (&connection.refusal, connection.o2t_api_us, connection.t2o_api_us) {
        (Some(refusal), ..) => refusal.clone(),
        (None, Some(o2t_us), Some(t2o_us)) => {
            let mut verdict = format!("accepted, frames every {} ms", t2o_us * 1e-3);
            if o2t_us != t2o_us {
                verdict += &format!(" (heartbeats every {} ms)", o2t_us * 1e-3);
            }
            if let Some(group) = &connection.multicast {
                verdict += &format!(", to the group {group}");
            }
            verdict
        }
        _ => "accepted".into(),
    };
    format!("{}, {config}, {}: {verdict}", connection.kind, connection.t2o)
}

fn add_frames(lines: &mut Lines, frames: &ReportedFrames) {
    let counters = &frames.counters;
    lines.add(
        "frames",
        format!(
            "{} received, {} missed, {} out of order, {} without new data",
            counters.consumed, counters.missed, counters.out_of_order, counters.repeated
        ),
    );
    let granted = format!("granted {} ms", frames.api_us * 1e-3);
    let text = match (&frames.gap_us, frames.mean_gap_us) {
        (Some(gap), Some(mean_us)) => format!(
            "mean {:.3}   p50 {:.1}   p99 {:.1}   max {:.1} ms, {granted}",
            mean_us * 1e-3,
            gap.p50 * 1e-3,
            gap.p99 * 1e-3,
            gap.max * 1e-3,
        ),
        _ => format!("too few frames came to tell, {granted}"),
    };
    lines.add("gaps", text);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::enip::scanner::TargetCounters;

    #[test]
    fn without_gaps_there_are_no_figures_of_them() {
        let mut lines = Lines::default();
        let frames = ReportedFrames {
            connection: 1,
            api_us: 10_000.0,
            gap_us: None,
            mean_gap_us: None,
            counters: TargetCounters::default().into(),
        };
        add_frames(&mut lines, &frames);
        assert!(lines.0.contains("too few frames came to tell, granted 10 ms"), "{}", lines.0);
        assert!(!lines.0.contains("mean"), "{}", lines.0);
    }
}
