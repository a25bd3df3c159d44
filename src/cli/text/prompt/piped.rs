//! Lines from a pipe or a file: each is sent when the one before is answered.
//!
//! A motion command has no answer. SyncCmdQueue behind it makes the robot say when it has taken it, so
//! that an error is that of its line; not while a program is being saved, which it might disturb. After the
//! last line a checkpoint tells when all is executed: the robot would stop if the connection ended
//! before.

use std::io::{self, BufRead, Write};
use std::prelude::v1::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread;

use super::entry::{self, BuiltIn, Entry};
use super::paint::Paint;
use super::view::View;
use super::{Session, help, messages, state};
use crate::cli::exit::{Exit, Failure};
use crate::cli::run_program::catch_interrupts;
use crate::link::clock::MonotonicClock;
use crate::link::text::{Answer, AnswerError, Client, Messages};
use crate::time::Duration;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::revision::Revision;
use crate::wire::meca500::text::value::RobotStatus;
use crate::wire::meca500::text::{TextCommandSpec, Timing};

/// Longest wait for an answer. Homing and activation take some seconds.
const ANSWER: Duration = Duration::from_secs(60);
/// How often it is looked at Ctrl-C and the connection while waiting.
const STEP: Duration = Duration::from_millis(50);
/// How often the state of a robot is asked for that has not come to the end of its queue.
const ASKING: Duration = Duration::from_secs(1);
/// The checkpoint behind the last line.
///
/// Source: choice of the last one that the manual allows.
const LAST_CHECKPOINT: u16 = 8_000;
/// Lines read ahead.
const AHEAD: usize = 16;

/// Why no more lines are sent.
enum Stop {
    /// The robot, or the person's line, is at fault; it has been told.
    Error(Exit),
    Interrupted,
    Ended,
}

/// Sends all lines of standard input and waits for what comes of them.
pub(super) fn run(session: Session, keep_going: bool) -> Result<Exit, Failure> {
    let Session { client, messages, view, paint, revision } = session;
    let interrupted = catch_interrupts()?;
    let in_trouble = Arc::new(AtomicBool::new(false));
    let printing = {
        let (view, in_trouble) = (view.clone(), Arc::clone(&in_trouble));
        thread::spawn(move || print_all(&messages, &view, paint, &in_trouble))
    };
    let talk = Talk { client: &client, view: &view, revision, interrupted: &interrupted };
    let lines = read_ahead();
    let ended =
        Sending { talk: &talk, keep_going, worst: Exit::Done, open: Vec::new() }.run(&lines);
    let reason = client.ended();
    drop(client);
    let _ = printing.join();
    let exit = match ended? {
        exit if exit != Exit::Done => exit,
        _ if in_trouble.load(Ordering::Relaxed) => Exit::Robot,
        exit => exit,
    };
    match (exit, reason) {
        (Exit::Link, Some(reason)) => Err(Failure::link(format!(
            "{reason}\n  Remedy: look at cable, power and the robot's state; what was queued on it is lost."
        ))),
        (exit, _) => Ok(exit),
    }
}

/// Prints what the robot says and remembers whether it was trouble.
fn print_all(messages: &Messages, view: &View, paint: Paint, in_trouble: &AtomicBool) {
    let mut output = io::stdout();
    loop {
        match messages.wait_next(ASKING) {
            Ok(Some(message)) => {
                if messages::is_trouble(&message.as_message()) {
                    in_trouble.store(true, Ordering::Relaxed);
                }
                if view.shows(&message) {
                    // Whoever does not read any more still wants the commands to be executed.
                    let _ = writeln!(output, "{}", messages::line(&message, view.is_raw(), paint));
                }
            }
            Ok(None) => {}
            Err(_) => return,
        }
    }
}

/// Reads standard input in a thread of its own, so that the connection is seen to end meanwhile.
fn read_ahead() -> Receiver<io::Result<String>> {
    let (sender, lines) = sync_channel(AHEAD);
    thread::spawn(move || {
        let mut input = io::stdin().lock();
        loop {
            let mut line = Vec::new();
            let read = match input.read_until(b'\n', &mut line) {
                Ok(0) => return,
                Ok(_) => Ok(String::from_utf8_lossy(&line).trim_end().to_string()),
                Err(error) => Err(error),
            };
            let is_broken = read.is_err();
            if sender.send(read).is_err() || is_broken {
                return;
            }
        }
    });
    lines
}

/// Whom the lines go to.
struct Talk<'a> {
    client: &'a Client,
    view: &'a View,
    revision: Revision,
    interrupted: &'a AtomicBool,
}

impl Talk<'_> {
    fn stopped(&self) -> Result<(), Stop> {
        if self.interrupted.load(Ordering::Relaxed) {
            return Err(Stop::Interrupted);
        }
        if self.client.ended().is_some() { Err(Stop::Ended) } else { Ok(()) }
    }

    /// Waits in steps, at most for `limit`: the inner error is the command's.
    fn wait<T>(
        &self,
        limit: Option<Duration>,
        mut wait: impl FnMut(Duration) -> Result<T, AnswerError>,
    ) -> Result<Result<T, AnswerError>, Stop> {
        let clock = MonotonicClock::new();
        let start = clock.now();
        loop {
            match wait(STEP) {
                Err(AnswerError::TimedOut) => self.stopped()?,
                Err(AnswerError::Ended(_)) => return Err(Stop::Ended),
                result => return Ok(result),
            }
            if limit.is_some_and(|limit| clock.now().saturating_duration_since(start) >= limit) {
                return Ok(Err(AnswerError::TimedOut));
            }
        }
    }

    fn status(&self) -> Result<Option<RobotStatus>, Stop> {
        let Ok(mut answer) = self.client.get_status_robot() else { return Ok(None) };
        Ok(self.wait(Some(ANSWER), |step| answer.wait(step))?.ok())
    }
}

/// Whether a command leaves something in the queue that takes its time.
fn is_queued(spec: &TextCommandSpec) -> bool {
    spec.timing == Timing::Queued || spec.name == "StartProgram"
}

/// Whether SetOfflineProgramLoop and the like stand between StartSaving and StopSaving.
fn is_saving_after(was: bool, spec: Option<&TextCommandSpec>) -> bool {
    match spec.map(|spec| spec.name) {
        Some("StartSaving") => true,
        Some("StopSaving") => false,
        _ => was,
    }
}

/// The lines, one after the other.
struct Sending<'a> {
    talk: &'a Talk<'a>,
    keep_going: bool,
    worst: Exit,
    /// Checkpoints that the person has set and the robot has not reached, with their lines.
    open: Vec<(usize, Answer)>,
}

impl Sending<'_> {
    fn run(mut self, lines: &Receiver<io::Result<String>>) -> Result<Exit, Failure> {
        let mut number = 0;
        let mut has_queued = false;
        let mut is_saving = false;
        loop {
            let line = match lines.recv_timeout(STEP) {
                Ok(Ok(line)) => line,
                Ok(Err(error)) => {
                    return Err(Failure::internal(format!(
                        "standard input cannot be read: {error}"
                    )));
                }
                Err(RecvTimeoutError::Disconnected) => break,
                Err(RecvTimeoutError::Timeout) => match self.talk.stopped() {
                    Ok(()) => continue,
                    Err(stop) => return Ok(self.end(stop)),
                },
            };
            number += 1;
            if let Err(stop) = self.talk.stopped() {
                return Ok(self.end(stop));
            }
            let (text, spec) = match entry::read(&line, self.talk.revision) {
                Entry::Nothing => continue,
                Entry::BuiltIn(BuiltIn::Quit) => break,
                Entry::BuiltIn(built_in) => {
                    if !self.built_in(number, built_in)
                        && let Some(exit) = self.fail(Exit::Usage)
                    {
                        return Ok(exit);
                    }
                    continue;
                }
                Entry::Mistake(mistake) => {
                    eprintln!("line {number}: {}", mistake.words());
                    if let Some(exit) = self.fail(Exit::Usage) {
                        return Ok(exit);
                    }
                    continue;
                }
                Entry::Command { text, spec } => (text, spec),
            };
            is_saving = is_saving_after(is_saving, spec);
            // While a program is saved too: a robot that is ready executes what it records.
            has_queued |= spec.is_some_and(is_queued);
            match self.send(number, text, spec, is_saving) {
                Ok(()) => {}
                Err(Stop::Error(exit)) => {
                    if let Some(exit) = self.fail(exit) {
                        return Ok(exit);
                    }
                }
                Err(stop) => return Ok(self.end(stop)),
            }
        }
        match self.finish(has_queued && !is_saving) {
            Ok(()) => Ok(self.worst),
            Err(stop) => Ok(self.end(stop)),
        }
    }

    /// Remembers an error; the exit code where it is the end.
    fn fail(&mut self, exit: Exit) -> Option<Exit> {
        self.worst = Exit::worst([self.worst, exit]);
        if self.keep_going {
            return None;
        }
        eprintln!("nothing more is sent; --keep-going goes on");
        Some(self.worst)
    }

    fn end(&self, stop: Stop) -> Exit {
        match stop {
            Stop::Error(exit) => Exit::worst([self.worst, exit]),
            Stop::Interrupted => {
                eprintln!("interrupted; a robot that moves stops, because the connection ends");
                Exit::Interrupted
            }
            Stop::Ended => Exit::Link,
        }
    }

    /// Does what is asked of the prompt itself; whether there is such a thing.
    fn built_in(&mut self, number: usize, built_in: BuiltIn<'_>) -> bool {
        let told = match built_in {
            BuiltIn::Help(None) => Ok(help::overview()),
            BuiltIn::Help(Some(name)) => help::of(name, self.talk.revision),
            BuiltIn::State => Ok(state::words(&self.talk.client.state())),
            BuiltIn::Quit => return true,
            BuiltIn::Unknown(text) => Err(entry::unknown_built_in(text)),
        };
        match &told {
            // Whoever does not read any more still wants the commands to be executed.
            Ok(text) => drop(writeln!(io::stdout(), "{text}")),
            Err(error) => eprintln!("line {number}: {error}"),
        }
        told.is_ok()
    }

    /// Sends one line and waits until the robot has answered or taken it.
    fn send(
        &mut self,
        number: usize,
        text: &str,
        spec: Option<&'static TextCommandSpec>,
        is_saving: bool,
    ) -> Result<(), Stop> {
        let answers = spec.map_or(&[] as &[Code], |spec| spec.answers());
        self.talk.view.asks(answers);
        let told = |error: &AnswerError| {
            eprintln!("line {number}: {text}: {error}");
            Stop::Error(exit_of(error))
        };
        let mut answer = self.talk.client.send(text).map_err(|error| told(&error))?;
        let name = spec.map_or("", |spec| spec.name);
        if name == "SetCheckpoint" && !is_saving {
            self.open.push((number, answer));
            // Whether it was taken is of interest now, when it is reached later.
            return self.synchronise(number, text);
        }
        // The robot answers the first time only.
        if name == "ConnectionWatchdog" {
            return Ok(());
        }
        if answers.is_empty() && is_saving {
            return Ok(());
        }
        let sync = match answers.is_empty() && !ends_the_connection(name) {
            true => Some(self.talk.client.sync().map_err(|error| told(&error))?),
            false => None,
        };
        let result = self.talk.wait(Some(ANSWER), |step| answer.wait(step))?;
        drop(sync);
        result.map(drop).map_err(|error| told(&error))
    }

    /// Waits until the robot has read everything that was sent; a checkpoint that it refused by then has
    /// failed.
    fn synchronise(&mut self, number: usize, text: &str) -> Result<(), Stop> {
        let told = |error: &AnswerError| {
            eprintln!("line {number}: {text}: {error}");
            Stop::Error(exit_of(error))
        };
        let mut sync = self.talk.client.sync().map_err(|error| told(&error))?;
        let synced = self.talk.wait(Some(ANSWER), |step| sync.wait(step))?;
        synced.map_err(|error| told(&error))?;
        let refused = match self.open.last_mut().map(|(_, answer)| answer.wait(Duration::ZERO)) {
            Some(Err(error @ AnswerError::Refused { .. })) => Err(told(&error)),
            None | Some(Err(AnswerError::TimedOut)) => return Ok(()),
            Some(_) => Ok(()),
        };
        self.open.pop();
        refused
    }

    /// Waits for checkpoints and for the end of the queue.
    fn finish(&mut self, has_queued: bool) -> Result<(), Stop> {
        if !has_queued {
            return Ok(());
        }
        let Some(status) = self.talk.status()? else { return Ok(()) };
        if !moves_on(&status) {
            return Ok(());
        }
        self.talk.view.hides_checkpoint(LAST_CHECKPOINT);
        let Ok(mut last) = self.talk.client.checkpoint(LAST_CHECKPOINT) else { return Ok(()) };
        loop {
            match self.talk.wait(Some(ASKING), |step| last.wait(step))? {
                Err(AnswerError::TimedOut) => {}
                Ok(()) => break,
                Err(error) => {
                    eprintln!("the last commands were not executed: {error}");
                    self.worst = Exit::worst([self.worst, Exit::Robot]);
                    return Ok(());
                }
            }
            if self.talk.status()?.is_none_or(|status| !moves_on(&status)) {
                return Ok(());
            }
        }
        self.stand_still()
    }

    /// Behind the last checkpoint the robot may still come to a stop.
    fn stand_still(&mut self) -> Result<(), Stop> {
        let Ok(mut idle) = self.talk.client.until_end_of_block() else { return Ok(()) };
        let _ = self.talk.wait(Some(ANSWER), |step| idle.wait(step))?;
        for (number, mut answer) in core::mem::take(&mut self.open) {
            if let Err(error) = self.talk.wait(Some(ASKING), |step| answer.wait(step))? {
                eprintln!("line {number}: {error}");
                self.worst = Exit::worst([self.worst, exit_of(&error)]);
            }
        }
        Ok(())
    }
}

/// Whether the robot goes on with its queue; tells why not.
fn moves_on(status: &RobotStatus) -> bool {
    if status.is_paused && !status.is_in_error && !status.is_end_of_block {
        eprintln!("the robot is paused; what is left in its queue is lost with the connection");
    }
    status.is_activated && !status.is_in_error && !status.is_paused
}

/// Whether the robot closes its ports after the command.
fn ends_the_connection(name: &str) -> bool {
    matches!(name, "RebootRobot" | "SwitchToEtherCat")
}

fn exit_of(error: &AnswerError) -> Exit {
    match error {
        AnswerError::Refused { .. } | AnswerError::Discarded => Exit::Robot,
        AnswerError::Submit(_) | AnswerError::NoText { .. } | AnswerError::Argument { .. } => {
            Exit::Usage
        }
        AnswerError::TimedOut | AnswerError::Ended(_) | AnswerError::Unreadable { .. } => {
            Exit::Link
        }
    }
}
