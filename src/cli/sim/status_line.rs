//! A line about each robot below what is said, while standard error is a terminal.
//!
//! What it shows is gathered and put into words here ([`lines`]); drawing is done by a thread of its own
//! ([`Screen`]), so that a terminal that is held up does not hold up the robots. While it draws it owns
//! the terminal: whatever is said goes through [`say`].

use std::io::{IsTerminal, Write};
use std::prelude::v1::*;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::cell::Cell;
use crate::cli::wording::counted;
use crate::sim::meca500::{Lifecycle, Signal, Standing};
use crate::time::{Duration, Instant};
use crate::wire::meca500::code::Code;

/// Time between two looks at the robots.
const INTERVAL: Duration = Duration::from_millis(200);
/// Robots with a line of their own.
const MOST_LINES: usize = 8;
/// What may wait to be drawn; what finds no room is left out, and that is told.
const ROOM: usize = 1_024;

/// The lines, one a robot; the last one sums up those that find no room.
pub(super) fn lines<C: Cell>(cell: &mut C) -> Vec<String> {
    let count = cell.count();
    let shown = if count > MOST_LINES { MOST_LINES - 1 } else { count };
    let mut lines: Vec<String> = (0..shown)
        .map(|number| {
            let label = if count == 1 { String::new() } else { format!("robot {}: ", number + 1) };
            label + &about(cell, number)
        })
        .collect();
    if shown < count {
        lines.push(sum_up(cell, shown..count));
    }
    lines
}

/// One robot: what matters most comes first, for the end may not fit.
fn about<C: Cell>(cell: &mut C, number: usize) -> String {
    let (controller, monitors) = (cell.controller(number), cell.monitors(number));
    let is_plugged = cell.is_plugged(number);
    let robot = cell.robot(number);
    let standing = robot.standing();
    let mut parts = vec![mode(&standing)];
    parts.extend(signals(&standing));
    if !is_plugged {
        parts.push("cable pulled".into());
    }
    parts.push(match controller {
        Some(controller) => format!("controlled over {controller}"),
        None => "nobody controls it".into(),
    });
    if monitors > 0 {
        parts.push(counted(monitors as u64, "monitor"));
    }
    if robot.pending_commands() > 0 {
        parts.push(format!("{} in the queue", counted(robot.pending_commands() as u64, "command")));
    }
    let joints = robot.target_joints().map(|joint| format!("{joint:.2}")).join(" ");
    parts.push(format!("[{joints}] deg"));
    parts.join("   ")
}

/// Where it is in its life, and what it does.
fn mode(standing: &Standing) -> String {
    let mut words = String::from(match standing.lifecycle {
        Lifecycle::Off => "off",
        Lifecycle::Booting => "boots",
        Lifecycle::Deactivated => "deactivated",
        Lifecycle::Activating => "activating",
        Lifecycle::Homing => "homing",
        Lifecycle::Deactivating => "deactivating",
        Lifecycle::Activated if !standing.homed => "activated, not homed",
        Lifecycle::Activated if standing.moving => "moves",
        Lifecycle::Activated => "ready",
    });
    if standing.simulating {
        words += ", simulating";
    }
    match standing.error {
        Code(0) if standing.paused && standing.lifecycle == Lifecycle::Activated => {
            words += ", paused"
        }
        Code(0) => {}
        code => words += &format!(", error {}", code.0),
    }
    words
}

/// What keeps it from moving, in the manual's words.
fn signals(standing: &Standing) -> Vec<String> {
    let mut words = Vec::new();
    for (name, signal) in [
        ("E-Stop", standing.e_stop),
        ("P-Stop 2", standing.p_stop2),
        ("connection dropped", standing.connection_dropped),
    ] {
        match signal {
            Signal::Off => {}
            Signal::Present => words.push(name.into()),
            Signal::Resettable => words.push(format!("{name} to be reset")),
        }
    }
    if standing.redundancy_fault {
        words.push("redundancy fault".into());
    }
    let is_up = !matches!(standing.lifecycle, Lifecycle::Off | Lifecycle::Booting);
    if is_up && !standing.motor_power && words.is_empty() {
        words.push("no motor power: press Reset".into());
    }
    for (joint, _) in (1..).zip(standing.blocked).filter(|(_, is_blocked)| *is_blocked) {
        words.push(format!("joint {joint} blocked"));
    }
    words
}

/// Several robots in a line.
fn sum_up<C: Cell>(cell: &mut C, numbers: core::ops::Range<usize>) -> String {
    let (first, last) = (numbers.start + 1, numbers.end);
    let mut counts: Vec<(String, u64)> = Vec::new();
    for number in numbers {
        let mode = mode(&cell.robot(number).standing());
        match counts.iter_mut().find(|(other, _)| *other == mode) {
            Some((_, count)) => *count += 1,
            None => counts.push((mode, 1)),
        }
    }
    let parts: Vec<String> =
        counts.into_iter().map(|(mode, count)| format!("{count} {mode}")).collect();
    format!("robots {first} to {last}: {}", parts.join("   "))
}

/// What the drawing thread is handed.
enum Order {
    Say(String),
    Show(Vec<String>),
}

/// Where messages go while a screen is there. A process has one standard error.
static ORDERS: Mutex<Option<SyncSender<Order>>> = Mutex::new(None);

fn orders() -> std::sync::MutexGuard<'static, Option<SyncSender<Order>>> {
    ORDERS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Says something above the lines; `false` while there are none, and nothing is done.
pub(super) fn say(message: &str) -> bool {
    match orders().as_ref() {
        None => false,
        // A full channel means that nobody sees the terminal move: messages are lost there.
        Some(orders) => {
            let sent = orders.try_send(Order::Say(message.into()));
            !matches!(sent, Err(TrySendError::Disconnected(_)))
        }
    }
}

/// The lines on a terminal. They go when it is dropped.
pub(super) struct Screen {
    next_look: Instant,
    /// What is shown.
    lines: Vec<String>,
    thread: Option<JoinHandle<()>>,
}

impl Screen {
    /// Begins to draw; `None` where standard error is no terminal.
    pub(super) fn open(now: Instant) -> Option<Self> {
        std::io::stderr().is_terminal().then(|| {
            let (sender, receiver) = sync_channel(ROOM);
            *orders() = Some(sender);
            let thread = thread::spawn(move || draw(&receiver));
            Self { next_look: now, lines: Vec::new(), thread: Some(thread) }
        })
    }

    /// Shows how the robots are, when it is time to.
    pub(super) fn show<C: Cell>(&mut self, cell: &mut C) {
        let now = cell.now();
        if now < self.next_look {
            return;
        }
        self.next_look = now + INTERVAL;
        let lines = lines(cell);
        if lines != self.lines
            && let Some(orders) = orders().as_ref()
            && orders.try_send(Order::Show(lines.clone())).is_ok()
        {
            self.lines = lines;
        }
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        *orders() = None;
        if let Some(thread) = self.thread.take() {
            // What it still has to say is said; it does nothing else that could fail.
            let _ = thread.join();
        }
    }
}

/// Draws until everybody has hung up, and clears the lines then.
fn draw(receiver: &Receiver<Order>) {
    let bars = MultiProgress::with_draw_target(ProgressDrawTarget::stderr_with_hz(10));
    let mut rows: Vec<ProgressBar> = Vec::new();
    for order in receiver {
        match order {
            Order::Say(message) if bars.is_hidden() => {
                let _ = writeln!(std::io::stderr(), "{message}");
            }
            Order::Say(message) => {
                // A terminal that is gone hears nothing.
                let _ = bars.println(message);
            }
            Order::Show(lines) => {
                while rows.len() < lines.len() {
                    let row = bars.add(ProgressBar::new_spinner());
                    if let Ok(style) = ProgressStyle::with_template("{wide_msg}") {
                        row.set_style(style);
                    }
                    rows.push(row);
                }
                for (row, line) in rows.iter().zip(lines) {
                    row.set_message(line);
                    row.tick();
                }
            }
        }
    }
    for row in &rows {
        row.finish_and_clear();
    }
    let _ = bars.clear();
}

#[cfg(test)]
mod tests {
    use super::super::cell::Bench;
    use super::*;
    use crate::wire::meca500::revision::Revision;

    fn only(bench: &mut Bench) -> String {
        let lines = lines(bench);
        assert_eq!(lines.len(), 1);
        lines[0].clone()
    }

    #[test]
    fn a_robots_life_is_told() {
        let mut bench = Bench::of(Revision::R4, 1);
        assert_eq!(
            only(&mut bench),
            "deactivated   nobody controls it   [0.00 0.00 0.00 0.00 0.00 0.00] deg"
        );
        bench.robot(0).activate().expect("it may");
        assert!(only(&mut bench).starts_with("activating "));
        bench.pass(Duration::from_secs(1));
        assert!(only(&mut bench).starts_with("activated, not homed "));
        bench.robot(0).home().expect("it may");
        assert!(only(&mut bench).starts_with("homing "));
        bench.pass(Duration::from_secs(4));
        bench.controller = Some("TCP");
        assert!(
            only(&mut bench).starts_with("ready   controlled over TCP "),
            "{}",
            only(&mut bench)
        );
        bench.robot(0).pause_motion().expect("it may");
        assert!(only(&mut bench).starts_with("ready, paused "));
        bench.robot(0).panel().press_e_stop();
        bench.robot(0).panel().block_joint(3, true);
        bench.pass(Duration::from_secs(1));
        let line = only(&mut bench);
        assert!(line.starts_with("deactivated   E-Stop   joint 3 blocked   "), "{line}");
        bench.robot(0).panel().release_e_stop();
        assert!(only(&mut bench).contains("E-Stop to be reset"));
        bench.robot(0).panel().switch_off();
        bench.pulled[0] = true;
        let line = only(&mut bench);
        assert!(line.starts_with("off   ") && line.contains("cable pulled"), "{line}");
        bench.robot(0).panel().switch_on();
        assert!(only(&mut bench).starts_with("boots   "));
        bench.pass(Duration::from_secs(6));
        assert!(only(&mut bench).contains("press Reset"), "{}", only(&mut bench));
    }

    #[test]
    fn an_error_shows_its_code_and_its_queue() {
        let mut bench = Bench::of(Revision::R4, 1);
        bench.robot(0).activate().expect("it may");
        bench.pass(Duration::from_secs(1));
        bench.robot(0).panel().break_drives();
        assert!(
            only(&mut bench).starts_with("activated, not homed, error 3006"),
            "{}",
            only(&mut bench)
        );
    }

    #[test]
    fn many_robots_are_summed_up() {
        let mut bench = Bench::of(Revision::R4, 8);
        assert_eq!(lines(&mut bench).len(), 8);
        let mut bench = Bench::of(Revision::R4, 11);
        bench.robot(10).panel().switch_off();
        let lines = lines(&mut bench);
        assert_eq!(lines.len(), 8);
        assert!(lines[6].starts_with("robot 7: deactivated"), "{}", lines[6]);
        assert_eq!(lines[7], "robots 8 to 11: 3 deactivated   1 off");
    }
}
