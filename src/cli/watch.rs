//! Progress of a run on standard error, drawn by a thread of its own: the bus never waits for it.

use std::io::{IsTerminal, Write};
use std::prelude::v1::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::wording;
use crate::engine::meca500::Event;
use crate::link::clock::MonotonicClock;
use crate::run::drive::{Observer, Progress};
use crate::run::program::Program;
use crate::run::runner::Phase;
use crate::time::Duration;

/// Messages that may wait to be drawn; what finds no room is left out.
const ROOM: usize = 1_024;
/// Wall time between two plain lines about progress.
const PLAIN_INTERVAL: Duration = Duration::from_secs(5);

/// What the drawing thread hears.
pub(super) enum Message {
    Event(Event, Option<usize>),
    Progress(Progress),
}

/// The run's end of the channel.
pub(super) struct Watcher {
    sender: SyncSender<Message>,
    interrupted: Arc<AtomicBool>,
    every_cycles: u64,
}

impl Watcher {
    /// A watcher that reports progress once in so many cycles, and the other end of its channel.
    pub(super) fn new(
        interrupted: Arc<AtomicBool>,
        every_cycles: u64,
    ) -> (Self, Receiver<Message>) {
        let (sender, receiver) = sync_channel(ROOM);
        (Self { sender, interrupted, every_cycles: every_cycles.max(1) }, receiver)
    }
}

impl Observer for Watcher {
    fn is_interrupted(&mut self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }

    fn event(&mut self, event: &Event, step: Option<usize>) {
        // Most events are about single commands; only those that will be shown are worth sending.
        if !matches!(event, Event::Accepted { .. } | Event::Started { .. } | Event::Done { .. }) {
            let _ = self.sender.try_send(Message::Event(*event, step));
        }
    }

    fn wants_progress(&mut self, cycles: u64) -> bool {
        cycles.is_multiple_of(self.every_cycles)
    }

    fn progress(&mut self, progress: &Progress) {
        let _ = self.sender.try_send(Message::Progress(*progress));
    }
}

/// Draws until the run hangs up.
pub(super) fn draw(receiver: Receiver<Message>, program: &Program, is_quiet: bool) {
    if is_quiet {
        receiver.iter().for_each(drop);
    } else if std::io::stderr().is_terminal() {
        draw_bar(&receiver, program);
    } else {
        draw_lines(&receiver, program);
    }
}

fn draw_bar(receiver: &Receiver<Message>, program: &Program) {
    let steps = u64::try_from(program.steps().len()).unwrap_or(u64::MAX);
    let bar = ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::stderr_with_hz(10));
    let template = "[{elapsed_precise}] {bar:30} {pos}/{len} commands  {prefix}\n{msg}";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("=> "));
    }
    for message in receiver {
        match message {
            Message::Event(event, step) => {
                if let Some(line) = wording::event(&event, line_of(program, step)) {
                    bar.println(line);
                }
            }
            Message::Progress(progress) => {
                bar.set_position(u64::try_from(progress.step).unwrap_or(u64::MAX));
                bar.set_prefix(current_line(program, &progress));
                bar.set_message(state(&progress).join("\n"));
            }
        }
    }
    bar.finish_and_clear();
}

fn draw_lines(receiver: &Receiver<Message>, program: &Program) {
    let clock = MonotonicClock::new();
    let mut last = None;
    for message in receiver {
        let line = match message {
            Message::Event(event, step) => wording::event(&event, line_of(program, step)),
            Message::Progress(progress) => {
                let now = clock.now();
                let is_due = last.is_none_or(|last| now - last >= PLAIN_INTERVAL);
                is_due.then(|| {
                    last = Some(now);
                    format!(
                        "{}   {}",
                        current_line(program, &progress),
                        state(&progress).join("   ")
                    )
                })
            }
        };
        if let Some(line) = line {
            // Nobody reads standard error any more: the run goes on.
            let _ = writeln!(std::io::stderr(), "{line}");
        }
    }
}

fn line_of(program: &Program, step: Option<usize>) -> Option<u32> {
    program.steps().get(step?).map(|step| step.line)
}

/// `line 12: MoveLin(...)`, shortened to fit beside the bar.
fn current_line(program: &Program, progress: &Progress) -> String {
    const WIDTH: usize = 48;
    match progress.phase {
        Phase::Connecting => return "connecting".into(),
        Phase::BringingUp => return "bringing the robot up: activate, home, resume".into(),
        Phase::Stopping => return "stopping: pause, clear".into(),
        Phase::Running => {}
    }
    let Some(step) = program.steps().get(progress.step) else { return "all lines done".into() };
    let text = program.line_text(step.line);
    let shown: String = text.chars().take(WIDTH).collect();
    let rest = if text.chars().count() > WIDTH { "..." } else { "" };
    format!("line {}: {shown}{rest}", step.line)
}

/// Joints and queue, then the cycles.
fn state(progress: &Progress) -> [String; 2] {
    let seen = match progress.seen {
        // Later on the run itself would have ended over it.
        Some(seen) if progress.step == 0 && !seen.is_plausible() => {
            "the robot's values look wrong in this byte order".into()
        }
        Some(seen) => {
            let joints: Vec<String> = seen.joints_deg.iter().map(|j| format!("{j:7.2}")).collect();
            format!("joints [{}] deg   queue space {:5}", joints.join(" "), seen.fifo_space)
        }
        None => "waiting for the robot".into(),
    };
    let cycle = progress.cycle_time_ns;
    let ms = |nanos: u64| nanos as f64 * 1e-6;
    let cycles = format!(
        "cycle p50 {:.3} max {:.3} ms   overruns {}",
        ms(cycle.p50),
        ms(cycle.max),
        progress.overruns
    );
    [seen, cycles]
}
