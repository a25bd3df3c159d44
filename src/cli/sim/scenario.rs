//! Playing a scenario: each event once its time has come, in the order of the file.
//!
//! Invariants: nothing happens before its time; an event happens in the first pass that is not before
//! it; times of events that follow each other count from when the one before was due, not from the
//! pass that saw it, so that they do not drift; a pass ends, whatever is repeated.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;
use std::prelude::v1::*;

use super::cell::Cell;
use super::deed::perform;
use super::scenario_file::{Act, Condition, Event, Scenario, When, parse};
use crate::cli::exit::{Exit, Failure};
use crate::cli::wording::counted;
use crate::sim::meca500::{Lifecycle, Signal, Standing};
use crate::time::{Duration, Instant};
use crate::wire::meca500::code::Code;

/// Reads the file for so many robots.
pub(super) fn read(path: &Path, robots: usize) -> Result<Scenario, Failure> {
    let name = path.display();
    let text = fs::read_to_string(path).map_err(|error| match error.kind() {
        ErrorKind::InvalidData => Failure::usage(format!(
            "--scenario: {name} is not a text; a scenario is plain text (UTF-8)"
        )),
        _ => Failure::internal(format!("--scenario: cannot read {name}: {error}")),
    })?;
    parse(&text, robots).map_err(|mistakes| {
        let mut message: String =
            mistakes.iter().map(|mistake| format!("{name}:{mistake}\n")).collect();
        let errors = counted(mistakes.len() as u64, "error");
        message += &format!("{errors} in {name}; nothing was served");
        Failure { exit: Exit::Usage, message, is_located: true }
    })
}

/// A scenario that is being played.
pub(super) struct Play {
    events: Vec<Event>,
    next: usize,
    /// How often it still begins anew; `None` is without end.
    repeats_left: Option<u32>,
    /// What absolute times count from.
    began: Instant,
    /// When the event before the next one was due.
    before: Instant,
    /// Whether the wait that is next was told.
    tells_wait: bool,
}

/// What has come of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Course {
    GoesOn,
    /// The scenario ends the simulation.
    Quits,
}

impl Play {
    pub(super) fn new(scenario: Scenario, began: Instant) -> Self {
        Self {
            events: scenario.events,
            next: 0,
            repeats_left: scenario.times.map(|times| times - 1),
            began,
            before: began,
            tells_wait: true,
        }
    }

    fn due(&self, event: &Event) -> Instant {
        match event.when {
            When::At(time) => (self.began + time).max(self.before),
            When::After(time) => self.before + time,
        }
    }

    /// Does what is due; `tell` hears of it.
    pub(super) fn act<C: Cell>(&mut self, cell: &mut C, tell: &mut dyn FnMut(String)) -> Course {
        let now = cell.now();
        while let Some(event) = self.events.get(self.next).copied() {
            let due = self.due(&event);
            if due > now {
                break;
            }
            match event.act {
                Act::Do(deed) => {
                    for number in concerned(&event, cell) {
                        let words = perform(deed, cell, number);
                        tell(format!("{}{words}", label(number, cell)));
                    }
                    self.before = due;
                }
                Act::Quit => {
                    self.next = self.events.len();
                    tell("the scenario ends the simulation".into());
                    return Course::Quits;
                }
                Act::Wait(condition) => {
                    let holds =
                        concerned(&event, cell).all(|number| is_so(condition, cell, number));
                    if !holds {
                        if core::mem::take(&mut self.tells_wait) {
                            tell(format!("waits until {}{condition}", whose(&event, cell)));
                        }
                        break;
                    }
                    tell(format!("is so: {}{condition}", whose(&event, cell)));
                    self.tells_wait = true;
                    self.before = now;
                }
            }
            self.next += 1;
            if self.next == self.events.len() {
                if self.begins_anew() {
                    // Once a pass, however short it is and however late the pass.
                    break;
                }
                tell("the scenario is at its end; what is served stays".into());
            }
        }
        Course::GoesOn
    }

    fn begins_anew(&mut self) -> bool {
        let again = match &mut self.repeats_left {
            None => true,
            Some(0) => false,
            Some(left) => {
                *left -= 1;
                true
            }
        };
        if again {
            self.next = 0;
            self.began = self.before;
        }
        again
    }
}

/// The robots that an event is about.
fn concerned<C: Cell>(event: &Event, cell: &C) -> core::ops::Range<usize> {
    event.robot.map_or(0..cell.count(), |number| number..number + 1)
}

/// What stands before words about one of several robots.
pub(super) fn label<C: Cell>(number: usize, cell: &C) -> String {
    match cell.count() {
        1 => String::new(),
        _ => format!("robot {}: ", number + 1),
    }
}

fn whose<C: Cell>(event: &Event, cell: &C) -> String {
    match (event.robot, cell.count()) {
        (_, 1) => "the robot is ".into(),
        (Some(number), _) => format!("robot {} is ", number + 1),
        (None, _) => "every robot is ".into(),
    }
}

fn is_so<C: Cell>(condition: Condition, cell: &mut C, number: usize) -> bool {
    let standing = cell.robot(number).standing();
    let Standing { lifecycle, homed, error, paused, moving, idle, .. } = standing;
    let is_activated = matches!(lifecycle, Lifecycle::Activated | Lifecycle::Homing);
    match condition {
        Condition::Activated => is_activated,
        // Neither off nor on the way up.
        Condition::Deactivated => lifecycle == Lifecycle::Deactivated,
        Condition::Homed => is_activated && homed,
        Condition::Ready => {
            let signals = [standing.e_stop, standing.p_stop2, standing.connection_dropped];
            is_activated && homed && error == Code(0) && !paused && signals == [Signal::Off; 3]
        }
        Condition::Moving => moving,
        Condition::Idle => is_activated && idle,
        Condition::Paused => is_activated && paused,
        Condition::Error => error != Code(0),
        Condition::Connected => cell.controller(number).is_some(),
        Condition::Disconnected => cell.controller(number).is_none(),
    }
}

/// A time since the beginning, as it stands before what is told.
pub(super) fn shown_time(since: Duration) -> String {
    format!("{:.3} s: ", since.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::super::cell::Bench;
    use super::*;
    use crate::wire::meca500::revision::Revision;

    /// A pass each millisecond; what was told, with the time of the pass.
    fn played(text: &str, bench: &mut Bench, millis: u64) -> Vec<(u64, String)> {
        let scenario = parse(text, bench.robots.len()).expect("it is right");
        let mut play = Play::new(scenario, bench.now);
        let mut told = Vec::new();
        for _ in 0..=millis {
            let at = bench.now.as_nanos() / 1_000_000;
            let course = play.act(bench, &mut |words| told.push((at, words)));
            if course == Course::Quits {
                break;
            }
            bench.pass(Duration::from_millis(1));
        }
        told
    }

    fn times(told: &[(u64, String)], words: &str) -> Vec<u64> {
        told.iter().filter(|(_, said)| said.contains(words)).map(|(at, _)| *at).collect()
    }

    #[test]
    fn events_happen_in_order_at_their_times() {
        let mut bench = Bench::of(Revision::R4, 1);
        let text = "5ms estop press\n+2 ms estop release\nreset\n20ms pstop2 press\n";
        let told = played(text, &mut bench, 30);
        let at: Vec<u64> = told.iter().map(|(at, _)| *at).collect();
        assert_eq!(at, [5, 7, 7, 20, 20], "{told:?}");
        assert!(told[2].1.contains("can be powered"), "{told:?}");
        assert!(told[4].1.contains("at its end"), "{told:?}");
    }

    #[test]
    fn passes_that_come_late_do_not_move_what_follows() {
        let mut bench = Bench::of(Revision::R4, 1);
        let scenario =
            parse("3ms block joint 1\n+4ms block joint 2\n+4ms block joint 3", 1).unwrap();
        let mut play = Play::new(scenario, bench.now);
        bench.pass(Duration::from_millis(5));
        play.act(&mut bench, &mut |_| {});
        assert_eq!(bench.robot(0).standing().blocked, [true, false, false, false, false, false]);
        // Due at 7 ms, not at 9.
        bench.pass(Duration::from_millis(2));
        play.act(&mut bench, &mut |_| {});
        assert_eq!(bench.robot(0).standing().blocked, [true, true, false, false, false, false]);
        bench.pass(Duration::from_millis(3));
        play.act(&mut bench, &mut |_| {});
        assert_eq!(bench.robot(0).standing().blocked, [true, true, false, false, false, false]);
        bench.pass(Duration::from_millis(1));
        play.act(&mut bench, &mut |_| {});
        assert_eq!(bench.robot(0).standing().blocked, [true, true, true, false, false, false]);
    }

    #[test]
    fn what_follows_a_wait_counts_from_its_end() {
        let mut bench = Bench::of(Revision::R4, 1);
        bench.robot(0).activate().expect("it is at rest");
        // Activation takes 200 ms.
        let told =
            played("wait activated\n+50ms pstop2 press\n100ms pstop2 release", &mut bench, 400);
        assert_eq!(times(&told, "waits until the robot is activated"), [0]);
        let ends = times(&told, "is so: ");
        assert_eq!(ends.len(), 1, "{told:?}");
        let activated = ends[0];
        assert!((199..=201).contains(&activated), "{told:?}");
        assert_eq!(times(&told, "P-Stop 2 pressed"), [activated + 50]);
        // Its own time was over long before.
        assert_eq!(times(&told, "P-Stop 2 released"), [activated + 50]);
    }

    #[test]
    fn all_robots_or_one() {
        let mut bench = Bench::of(Revision::R4, 3);
        let told = played("robot 2 pstop2 press\n1ms estop press", &mut bench, 0);
        assert_eq!(told, [(0, "robot 2: P-Stop 2 pressed".to_string())]);
        let told = played("estop press", &mut bench, 0);
        let said: Vec<_> = told.iter().map(|(_, said)| said.as_str()).collect();
        let all = ["robot 1: E-Stop pressed", "robot 2: E-Stop pressed", "robot 3: E-Stop pressed"];
        assert_eq!(said[..3], all);
    }

    #[test]
    fn repetitions_shift_all_times() {
        let mut bench = Bench::of(Revision::R4, 1);
        let told = played("10ms pstop2 press\n15ms pstop2 release\nrepeat 3", &mut bench, 100);
        assert_eq!(times(&told, "pressed"), [10, 25, 40]);
        assert_eq!(times(&told, "released"), [15, 30, 45]);
        assert_eq!(times(&told, "at its end"), [45]);
        let told = played("+10ms pstop2 press\nrepeat", &mut bench, 100);
        assert_eq!(times(&told, "pressed").len(), 10, "{told:?}");
    }

    #[test]
    fn quitting_ends_it() {
        let mut bench = Bench::of(Revision::R4, 1);
        let told = played("3ms quit\n4ms reset", &mut bench, 10);
        assert_eq!(times(&told, ""), [3]);
    }

    #[test]
    fn conditions_tell_states_apart() {
        let mut bench = Bench::of(Revision::R4, 1);
        let holds = |bench: &mut Bench, condition| is_so(condition, bench, 0);
        assert!(
            holds(&mut bench, Condition::Deactivated) && holds(&mut bench, Condition::Disconnected)
        );
        assert!(!holds(&mut bench, Condition::Idle), "it is not even activated");
        bench.controller = Some("TCP");
        assert!(holds(&mut bench, Condition::Connected));
        bench.robot(0).activate().expect("it may");
        bench.pass(Duration::from_millis(300));
        assert!(holds(&mut bench, Condition::Activated) && !holds(&mut bench, Condition::Homed));
        bench.robot(0).home().expect("it may");
        bench.pass(Duration::from_millis(100));
        assert!(holds(&mut bench, Condition::Moving));
        bench.pass(Duration::from_secs(4));
        assert!(holds(&mut bench, Condition::Homed) && holds(&mut bench, Condition::Idle));
        assert!(holds(&mut bench, Condition::Ready));
        bench.robot(0).pause_motion().expect("it may");
        assert!(!holds(&mut bench, Condition::Ready));
        assert!(holds(&mut bench, Condition::Paused) && !holds(&mut bench, Condition::Error));
    }
}
