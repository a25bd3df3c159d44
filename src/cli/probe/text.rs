//! The report as a person reads it: names on the left, one thing a line.

use std::prelude::v1::*;

use serde_json::Value;

use super::evidence::{Piece, ReportedOrder};
use super::report::{
    ProbeReport, ReportedExchange, ReportedIdentity, ReportedLayout, ReportedRobot, ReportedState,
    ReportedSubDevice,
};
use crate::cli::grid::Grid;
use crate::cli::wording::{counted, not_back_in_time};

/// Lines of names and values.
#[derive(Default)]
pub(super) struct Lines(pub(super) String);

impl Lines {
    pub(super) fn add(&mut self, name: &str, value: impl AsRef<str>) {
        self.0 += &format!("  {name:<16} {}\n", value.as_ref());
    }

    /// Another line of the value above.
    pub(super) fn add_more(&mut self, value: impl AsRef<str>) {
        self.add("", value);
    }
}

/// The whole report.
pub(super) fn text(report: &ProbeReport) -> String {
    let robots = report.subdevices.iter().filter(|found| found.is_meca500).count();
    let mut text = format!(
        "{}: {}, {robots} of them Meca500\n\n{}",
        report.target,
        counted(report.subdevices.len(), "subdevice"),
        grid(&report.subdevices).to_text(),
    );
    for note in &report.notes {
        text += &format!("\nnote: {note}\n");
    }
    for robot in &report.robots {
        text += &format!("\n{}", of_robot(robot));
    }
    if let Some(exchange) = &report.exchange {
        text += &format!("\n{}", of_exchange(exchange));
    }
    text
}

fn grid(subdevices: &[ReportedSubDevice]) -> Grid<10> {
    let hex = |number: u32| Value::from(format!("{number:08X}h"));
    let row = |found: &ReportedSubDevice| {
        let what = match (found.robot, found.is_meca500) {
            (Some(robot), _) => format!("robot {robot}"),
            (None, true) => "Meca500".into(),
            (None, false) => "left alone".into(),
        };
        [
            ("position", found.position.into()),
            ("name", found.name.clone().into()),
            ("vendor", hex(found.vendor)),
            ("product", hex(found.product)),
            ("revision", found.revision.into()),
            ("serial", found.serial.into()),
            ("alias", (found.alias != 0).then_some(found.alias).into()),
            ("found in", found.found_in.clone().unwrap_or_else(|| "no known state".into()).into()),
            ("clock", found.has_clock.into()),
            ("is", what.into()),
        ]
    };
    subdevices.iter().map(row).collect()
}

fn of_robot(robot: &ReportedRobot) -> String {
    let mut lines = Lines::default();
    // What a layout lacks stands with the layout.
    let is_said = [&robot.outputs, &robot.inputs].iter().any(|layout| layout.difference.is_some());
    if let Some(trouble) = robot.trouble.as_ref().filter(|_| !is_said) {
        lines.add("trouble", trouble);
    }
    add_layout(&mut lines, "outputs", &robot.outputs);
    add_layout(&mut lines, "inputs", &robot.inputs);
    if let Some(order) = &robot.byte_order {
        add_order(&mut lines, order);
        add_identity(&mut lines, &robot.identity);
    }
    if let Some(state) = &robot.state {
        let control = if state.monitoring_mode {
            "MonitoringMode: this connection may only watch, another one controls the robot"
        } else {
            "this connection may control it"
        };
        add_state(&mut lines, state, control);
    }
    for event in &robot.events {
        lines.add("event", event);
    }
    let verdict = if robot.usable { "usable" } else { "not usable" };
    format!("robot {} at position {}: {verdict}\n\n{}", robot.robot, robot.position, lines.0)
}

pub(super) fn add_identity(lines: &mut Lines, identity: &ReportedIdentity) {
    let told = |value: &Option<String>| value.clone().unwrap_or_else(|| NOT_TOLD.into());
    lines.add("firmware", told(&identity.firmware));
    lines.add("serial number", told(&identity.serial.map(|serial| serial.to_string())));
    lines.add("product", told(&identity.product));
    lines.add("tool", told(&identity.tool));
}

/// A dynamic type that did not come.
const NOT_TOLD: &str = "not told";

fn add_layout(lines: &mut Lines, name: &str, layout: &ReportedLayout) {
    let ReportedLayout { bytes, expected_bytes, firmware, .. } = layout;
    let length = match bytes {
        Some(bytes) if bytes == expected_bytes => format!("{}, ", counted(*bytes, "byte")),
        Some(bytes) => format!("{} ({expected_bytes} in our table), ", counted(*bytes, "byte")),
        None => String::new(),
    };
    let verdict = match layout.verdict {
        "equal" => "equal to our table",
        "by name" => "laid out by name",
        "refused" => "refused",
        _ => "the layout could not be read",
    };
    let of = firmware.map(|firmware| format!(", firmware {firmware}")).unwrap_or_default();
    lines.add(name, format!("{length}{verdict}{of}"));
    if let Some(difference) = &layout.difference {
        lines.add_more(difference);
    }
    if !layout.missing.is_empty() {
        lines.add_more(format!("not mapped, reads as 0: {}", layout.missing.join(", ")));
    }
    if !layout.foreign.is_empty() {
        lines.add_more(format!("foreign, passed over: {}", layout.foreign.join(", ")));
    }
}

pub(super) fn add_order(lines: &mut Lines, order: &ReportedOrder) {
    let open = |part: &Option<String>| part.clone().unwrap_or_else(|| "open".into());
    let verdict = order.verdict.clone().unwrap_or_else(|| {
        format!("undecided: integers {}, Reals {}", open(&order.integers), open(&order.reals))
    });
    lines.add("byte order", verdict);
    for piece in &order.evidence {
        lines.add_more(sentence(piece));
    }
    if let Some(echo) = &order.echo {
        let answer = if echo.answered { "reported with a value" } else { "not reported" };
        lines.add_more(format!(
            "dynamic type {}, asked for in {}-endian: {answer}",
            echo.asked, echo.integers
        ));
    }
}

/// As `FifoSpace C8 32 reads 13000 little-endian, 51250 big-endian: little`.
fn sentence(piece: &Piece) -> String {
    let Piece { what, bytes, little, big, speaks_for } = piece;
    let bytes = bytes.as_ref().map(|bytes| format!(" {bytes} reads")).unwrap_or(":".into());
    let speaks_for = speaks_for.unwrap_or("says nothing");
    format!(
        "{what}{bytes} {} little-endian, {} big-endian: {speaks_for}",
        number(little),
        number(big)
    )
}

/// Reals of no sensible size in few digits.
fn number(value: &Value) -> String {
    match value.as_f64() {
        Some(real) if value.is_f64() && real != 0.0 && !(1e-3..1e7).contains(&real.abs()) => {
            format!("{real:.3e}")
        }
        _ => value.as_str().map_or_else(|| value.to_string(), Into::into),
    }
}

pub(super) fn add_state(lines: &mut Lines, state: &ReportedState, control: &str) {
    let mut words = vec![
        if state.activated { "activated" } else { "not activated" },
        if state.homed { "homed" } else { "not homed" },
    ];
    let more = [
        (state.busy, "busy"),
        (state.sim_activated, "in simulation mode"),
        (state.brakes_engaged, "brakes engaged"),
        (state.recovery_mode, "in recovery mode"),
        (state.collision, "a collision is imminent"),
        (state.work_zone_breach, "the work zone is left"),
    ];
    words.extend(more.into_iter().filter(|(is_so, _)| *is_so).map(|(_, word)| word));
    lines.add("state", words.join(", "));
    match (state.error_code, state.error_text) {
        (0, _) => lines.add("error", "none"),
        (code, text) => {
            lines.add("error", format!("{code}: {}", text.unwrap_or("not in the manual")));
        }
    }
    if let Some(remedy) = state.error_remedy {
        lines.add_more(format!("remedy: {remedy}"));
    }
    let mut safety = match state.safety_signals.as_slice() {
        [] => "no signals".into(),
        signals => signals.join(", "),
    };
    if !state.resettable.is_empty() {
        safety += &format!("; may be reset now: {}", state.resettable.join(", "));
    }
    safety += if state.motors_powered { "; motors powered" } else { "; motors not powered" };
    lines.add("safety", safety);
    lines.add("control", control);
    lines.add("queue", format!("FifoSpace {}, MoveID {}", state.fifo_space, state.move_id));
}

fn of_exchange(exchange: &ReportedExchange) -> String {
    let mut lines = Lines::default();
    let found = exchange.working_counter_found.map_or("none".into(), |found| found.to_string());
    let mut counter =
        format!("{found} found, {} expected (3 a robot)", exchange.working_counter_expected);
    if exchange.wrong_working_counter > 0 {
        counter += &format!("; wrong {}", counted(exchange.wrong_working_counter, "time"));
    }
    lines.add("working counter", counter);
    let latency = &exchange.latency_us;
    lines.add(
        "latency",
        format!("p50 {:.1}   p99 {:.1}   max {:.1} us", latency.p50, latency.p99, latency.max),
    );
    lines.add(
        "frames",
        format!(
            "{}, {} stray; {} began late",
            not_back_in_time(exchange.lost, exchange.reply_limit_us),
            exchange.stray,
            counted(exchange.late, "exchange")
        ),
    );
    if let Some(clock) = &exchange.clock {
        lines.add(
            "clock",
            format!(
                "drift {:+.3} ppm, phase error {:+.1} us, worst {:.1} us",
                clock.drift_ppm,
                clock.phase_error_ns as f64 * 1e-3,
                clock.worst_phase_error_ns as f64 * 1e-3
            ),
        );
    }
    format!(
        "{} of {} at {:.3} ms\n\n{}",
        counted(exchange.count, "exchange"),
        counted(exchange.robots, "robot"),
        exchange.cycle_us as f64 * 1e-3,
        lines.0
    )
}
