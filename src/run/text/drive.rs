//! One whole run over the text interface: the link, the runner, and whoever watches.

use super::link::TextLink;
use super::runner::TextRunner;
use crate::run::drive::{Observer, Progress};
use crate::run::observation::Observation;
use crate::run::outcome::{LinkMessage, Outcome};
use crate::run::recording::{Recording, Sample};
use crate::time::{Duration, Instant};

/// Longest time between two looks at what a person wants.
const LOOK: Duration = Duration::from_millis(10);
/// Longest time that settings are put back in.
const FAREWELL_LIMIT: Duration = Duration::from_secs(1);

/// Runs a program to its end on the robot of a link, and puts back what was set for the run. A link that
/// fails is an outcome like any other.
///
/// Calls of [`Observer::wants_progress`] count passes here, at least one every 10 ms.
pub fn drive_text(
    link: &mut impl TextLink,
    runner: &mut TextRunner<'_>,
    recording: &mut Recording,
    observer: &mut impl Observer,
) -> Outcome {
    let mut run = Run { link, runner, recording, observer, seen: None, passes: 0 };
    run.runner.connected(run.link.now());
    let outcome = loop {
        if let Some(outcome) = run.pass() {
            break outcome;
        }
    };
    run.say_farewell();
    run.recording.close();
    run.tell_progress();
    outcome
}

struct Run<'a, 'p, L, O> {
    link: &'a mut L,
    runner: &'a mut TextRunner<'p>,
    recording: &'a mut Recording,
    observer: &'a mut O,
    seen: Option<Observation>,
    passes: u64,
}

impl<L: TextLink, O: Observer> Run<'_, '_, L, O> {
    fn pass(&mut self) -> Option<Outcome> {
        let now = self.link.now();
        self.recording.cycle(now);
        if self.runner.wants_link() && self.link.reconnect() {
            let Self { runner, observer, link, .. } = self;
            let step = Some(runner.current_step());
            runner.reconnected(link.now(), &mut |event| observer.event(event, step));
        }
        let is_interrupted = self.observer.is_interrupted();
        let step = self.step();
        let Self { runner, observer, .. } = self;
        runner.advance(now, is_interrupted, &mut |event| observer.event(event, step));
        if self.runner.outcome().is_none() && !self.runner.wants_link() {
            let exchanged = match self.send() {
                Ok(()) => self.receive(),
                // What came before the end counts.
                Err(error) => self.receive().and(Err(error)),
            };
            if let Err(error) = exchanged {
                self.runner.link_lost(LinkMessage::of(&error), self.link.now());
            }
        }
        self.passes += 1;
        if self.observer.wants_progress(self.passes) {
            self.tell_progress();
        }
        self.runner.outcome()
    }

    fn step(&self) -> Option<usize> {
        let is_running = self.runner.phase() == crate::run::runner::Phase::Running;
        is_running.then(|| self.runner.current_step())
    }

    fn send(&mut self) -> Result<(), L::Error> {
        while let Some(line) = self.runner.next_line() {
            if !self.link.send(line)? {
                break;
            }
            self.runner.sent_line();
        }
        Ok(())
    }

    fn receive(&mut self) -> Result<(), L::Error> {
        let now = self.link.now();
        let until = self.runner.due(now).min(now + LOOK);
        let step = self.step();
        let Self { link, runner, recording, observer, seen, .. } = self;
        link.receive(until, &mut |at, heard| {
            let told = runner.heard(at, heard, &mut |event| observer.event(event, step));
            if let Some(told) = told {
                *seen = Some(told);
                record(recording, runner, at, told);
            }
        })
    }

    /// Asks for the last position and puts settings back, as long as there is a connection.
    fn say_farewell(&mut self) {
        if self.runner.lost().is_some() || self.runner.wants_link() {
            return;
        }
        let deadline = self.link.now() + FAREWELL_LIMIT;
        self.runner.farewell(self.link.now());
        while !self.runner.has_said_farewell() && self.link.now() < deadline {
            // Whoever is gone now has no settings to be put back.
            if self.send().and_then(|()| self.receive()).is_err() {
                return;
            }
        }
    }

    fn tell_progress(&mut self) {
        let at = self.recording.cycle(self.link.now());
        self.observer.progress(&Progress {
            bus_time: at,
            phase: self.runner.phase(),
            step: self.runner.current_step(),
            seen: self.seen,
            ..Progress::default()
        });
    }
}

fn record(recording: &mut Recording, runner: &TextRunner<'_>, at: Instant, seen: Observation) {
    let at = recording.cycle(at);
    let counts = runner.counts();
    recording.record(Sample {
        at,
        seen,
        submitted: counts.submitted,
        accepted: counts.accepted,
        done: counts.done,
    });
}
