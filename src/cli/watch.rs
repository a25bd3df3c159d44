//! Progress of a run on standard error, drawn by a thread of its own: the bus never waits for it.

use std::io::{IsTerminal, Write};
use std::prelude::v1::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::enip::words;
use super::wording;
use crate::bus::enip::scanner::ScannerEvent;
use crate::engine::meca500::Event;
use crate::link::clock::MonotonicClock;
use crate::link::ethercat::{EventKind, SegmentEvent};
use crate::run::drive::{Observer, Progress};
use crate::run::program::Program;
use crate::run::runner::Phase;
use crate::time::{Duration, Instant};

/// Messages of a robot that may wait to be drawn; what finds no room is left out.
const ROOM: usize = 1_024;
/// Wall time between two plain lines about progress.
const PLAIN_INTERVAL: Duration = Duration::from_secs(5);

/// What the drawing thread hears of a robot.
pub(super) struct Message {
    /// Position of the robot among the programs.
    robot: usize,
    news: News,
}

enum News {
    Event(Event, Option<usize>),
    Progress(Progress),
    /// What happened to its connection on EtherCAT.
    Ethercat(EventKind),
    /// What happened to its connection on EtherNet/IP.
    Enip(ScannerEvent),
}

/// The bus's end of the channel.
pub(super) struct LinkWatcher(SyncSender<Message>);

impl LinkWatcher {
    /// Tells what happened on EtherCAT; left out when nobody keeps up. Does not allocate.
    pub(super) fn tell(&self, event: SegmentEvent) {
        let _ = self.0.try_send(Message { robot: event.robot, news: News::Ethercat(event.kind) });
    }

    /// Tells what happened on EtherNet/IP; left out when nobody keeps up. Does not allocate.
    pub(super) fn tell_enip(&self, event: ScannerEvent) {
        let robot = words::target_of(&event);
        let _ = self.0.try_send(Message { robot, news: News::Enip(event) });
    }
}

/// One robot's end of the channel.
pub(super) struct Watcher {
    robot: usize,
    sender: SyncSender<Message>,
    interrupted: Arc<AtomicBool>,
    every_cycles: u64,
}

impl Watcher {
    /// Watchers of so many robots that report progress once in so many cycles, one of their bus, and the
    /// other end of their channel, which is open until all of them are gone.
    pub(super) fn all(
        robots: usize,
        interrupted: &Arc<AtomicBool>,
        every_cycles: u64,
    ) -> (Vec<Self>, LinkWatcher, Receiver<Message>) {
        let (sender, receiver) = sync_channel(ROOM * robots);
        let watcher = |robot| Self {
            robot,
            sender: sender.clone(),
            interrupted: Arc::clone(interrupted),
            every_cycles: every_cycles.max(1),
        };
        ((0..robots).map(watcher).collect(), LinkWatcher(sender.clone()), receiver)
    }

    fn tell(&self, news: News) {
        let _ = self.sender.try_send(Message { robot: self.robot, news });
    }
}

impl Observer for Watcher {
    fn is_interrupted(&mut self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }

    fn event(&mut self, event: &Event, step: Option<usize>) {
        // Most events are about single commands; only those that will be shown are worth sending.
        if !matches!(event, Event::Accepted { .. } | Event::Started { .. } | Event::Done { .. }) {
            self.tell(News::Event(*event, step));
        }
    }

    fn wants_progress(&mut self, cycles: u64) -> bool {
        cycles.is_multiple_of(self.every_cycles)
    }

    fn progress(&mut self, progress: &Progress) {
        self.tell(News::Progress(*progress));
    }
}

/// Draws until the run hangs up. `programs` are those of the robots.
pub(super) fn draw(receiver: Receiver<Message>, programs: &[&Program], is_quiet: bool) {
    if is_quiet {
        receiver.iter().for_each(drop);
    } else if std::io::stderr().is_terminal() {
        draw_bars(&receiver, programs);
    } else {
        draw_lines(&receiver, programs);
    }
}

/// What stands before a line about a robot: nothing where there is only one.
fn label(robot: usize, programs: &[&Program]) -> String {
    match programs {
        [_] => String::new(),
        _ => format!("robot {}: ", robot + 1),
    }
}

/// One bar a robot, and the figures below: those of the robot where there is only one.
fn draw_bars(receiver: &Receiver<Message>, programs: &[&Program]) {
    let bars = MultiProgress::with_draw_target(ProgressDrawTarget::stderr_with_hz(10));
    let styled = |length, template: &str| {
        let bar = bars.add(ProgressBar::new(length));
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("=> "));
        }
        bar
    };
    let robots: Vec<ProgressBar> = (0..)
        .zip(programs)
        .map(|(robot, program)| {
            let steps = u64::try_from(program.steps().len()).unwrap_or(u64::MAX);
            let label = label(robot, programs);
            let template = format!(
                "{label}[{{elapsed_precise}}] {{bar:30}} {{pos}}/{{len}} commands  {{prefix}}"
            );
            styled(steps, &template)
        })
        .collect();
    let figures = styled(0, "{msg}");
    for Message { robot, news } in receiver {
        let (Some(program), Some(bar)) = (programs.get(robot), robots.get(robot)) else { continue };
        match news {
            News::Event(event, step) => {
                if let Some(line) = wording::event(&event, line_of(program, step)) {
                    // Nobody reads standard error any more: the run goes on.
                    let _ = bars.println(label(robot, programs) + &line);
                }
            }
            News::Ethercat(kind) => {
                let _ = bars.println(format!("{}{kind}", label(robot, programs)));
            }
            News::Enip(event) => {
                if let Some(line) = words::scanner_event(&event) {
                    let _ = bars.println(label(robot, programs) + &line);
                }
            }
            News::Progress(progress) => {
                bar.set_position(u64::try_from(progress.step).unwrap_or(u64::MAX));
                bar.set_prefix(current_line(program, &progress));
                let [seen, cycles] = state(&progress);
                figures.set_message(match programs {
                    [_] => format!("{seen}\n{cycles}"),
                    _ => cycles,
                });
            }
        }
    }
    for bar in robots.iter().chain([&figures]) {
        bar.finish_and_clear();
    }
}

fn draw_lines(receiver: &Receiver<Message>, programs: &[&Program]) {
    let clock = MonotonicClock::new();
    let mut last: Vec<Option<Instant>> = vec![None; programs.len()];
    for Message { robot, news } in receiver {
        let (Some(program), Some(last)) = (programs.get(robot), last.get_mut(robot)) else {
            continue;
        };
        let line = match news {
            News::Event(event, step) => wording::event(&event, line_of(program, step)),
            News::Ethercat(kind) => Some(kind.to_string()),
            News::Enip(event) => words::scanner_event(&event),
            News::Progress(progress) => {
                let now = clock.now();
                let is_due = last.is_none_or(|last| now - last >= PLAIN_INTERVAL);
                is_due.then(|| {
                    *last = Some(now);
                    let [seen, cycles] = state(&progress);
                    let parts = [current_line(program, &progress), seen, cycles];
                    let parts: Vec<String> =
                        parts.into_iter().filter(|part| !part.is_empty()).collect();
                    parts.join("   ")
                })
            }
        };
        if let Some(line) = line {
            let line = label(robot, programs) + &line;
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
            let space = seen.fifo_space.map(|space| format!("   queue space {space:5}"));
            format!("joints [{}] deg{}", joints.join(" "), space.unwrap_or_default())
        }
        None => "waiting for the robot".into(),
    };
    let Some(cycles) = progress.cycles else { return [seen, String::new()] };
    let ms = |nanos: u64| nanos as f64 * 1e-6;
    let cycles = format!(
        "cycle p50 {:.3} max {:.3} ms   overruns {}",
        ms(cycles.time_ns.p50),
        ms(cycles.time_ns.max),
        cycles.overruns
    );
    [seen, cycles]
}
