//! A text device that answers by a script and writes down what it was told.

#![allow(dead_code, reason = "each test file uses a part of it")]

use std::collections::VecDeque;
use std::fmt::Write;

use fieldarm::text_device::{LineProblem, TextDevice};
use fieldarm::time::{Duration, Instant};

/// What a device was told.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Told {
    Opened,
    Closed,
    Command(String),
    Rejected(LineProblem),
}

/// Echoes: `Say(x)` is answered with `[2000][x]`, `Flood(n)` with n messages, `Wide(n)` with one of n
/// letters, `Shout(x)` goes to the monitoring connections, `SyncCmdQueue(n)` is answered as by the robot,
/// `GetStatusRobot` too, `Home` is answered after 50 ms, `Break` with error 1005, `Bad` with 1001 and the
/// command quoted; everything else with nothing.
#[derive(Debug)]
pub(crate) struct ScriptedDevice {
    pub(crate) told: Vec<Told>,
    pub(crate) control: VecDeque<String>,
    pub(crate) monitoring: VecDeque<String>,
    pub(crate) snapshot: Vec<String>,
    /// A message for all monitoring connections with this period.
    pub(crate) interval: Option<Duration>,
    pub(crate) next_report: Instant,
    pub(crate) homed_at: Option<Instant>,
    pub(crate) is_free: bool,
    pub(crate) is_on_text: bool,
    pub(crate) drops: bool,
    /// Whether it answers nothing.
    pub(crate) mute: bool,
    pub(crate) now: Instant,
    pub(crate) is_open: bool,
}

impl Default for ScriptedDevice {
    fn default() -> Self {
        Self {
            told: Vec::new(),
            control: VecDeque::new(),
            monitoring: VecDeque::new(),
            snapshot: vec!["[2007][0,0,0,0,0,1,1]".into(), "[2095][m500]".into()],
            interval: None,
            next_report: Instant::ZERO,
            homed_at: None,
            is_free: true,
            is_on_text: true,
            drops: false,
            mute: false,
            now: Instant::ZERO,
            is_open: false,
        }
    }
}

impl ScriptedDevice {
    pub(crate) fn commands(&self) -> Vec<&str> {
        self.told
            .iter()
            .filter_map(|told| match told {
                Told::Command(line) => Some(line.as_str()),
                _ => None,
            })
            .collect()
    }

    pub(crate) fn rejected(&self) -> Vec<LineProblem> {
        let problem = |told: &Told| match told {
            Told::Rejected(problem) => Some(*problem),
            _ => None,
        };
        self.told.iter().filter_map(problem).collect()
    }

    fn live(&mut self, now: Instant) {
        assert!(now >= self.now, "time went back");
        self.now = now;
    }
}

impl TextDevice for ScriptedDevice {
    fn open_control(&mut self, now: Instant) -> bool {
        self.live(now);
        assert!(!self.is_open, "opened twice");
        if self.is_free {
            self.is_open = true;
            self.told.push(Told::Opened);
            self.control.push_back("[3000][Connected to Meca500 R3 v11.3.84]".into());
        }
        self.is_free
    }

    fn close_control(&mut self, now: Instant) {
        self.live(now);
        assert!(self.is_open, "closed and was not open");
        self.is_open = false;
        self.drops = false;
        self.homed_at = None;
        self.told.push(Told::Closed);
    }

    fn command(&mut self, now: Instant, line: &str) {
        self.live(now);
        assert!(self.is_open, "a command and nobody is connected");
        assert!(!line.trim().is_empty() && line.bytes().all(|b| matches!(b, b' '..=b'~' | b'\t')));
        self.told.push(Told::Command(line.to_owned()));
        if self.mute {
            return;
        }
        let (name, rest) = line.trim_start_matches('-').split_once('(').unwrap_or((line, ""));
        let argument = rest.trim_end_matches(')');
        match name {
            "Say" => self.control.push_back(format!("[2000][{argument}]")),
            "Flood" => {
                for number in 0..argument.parse().unwrap() {
                    self.control.push_back(format!("[2157][{number}]"));
                }
            }
            "Wide" => {
                let letters = "x".repeat(argument.parse().unwrap());
                self.control.push_back(format!("[2095][{letters}]"));
            }
            "Shout" => self.monitoring.push_back(format!("[2095][{argument}]")),
            "SyncCmdQueue" => self.control.push_back(format!("[2097][{argument}]")),
            "GetStatusRobot" | "-GetStatusRobot" => {
                self.control.push_back("[2007][1,0,0,0,0,1,1]".into());
            }
            "SetCheckpoint" => self.control.push_back(format!("[3030][{argument}]")),
            "Home" => self.homed_at = Some(now + Duration::from_millis(50)),
            "Break" => self.control.push_back("[1005][The robot is not activated.]".into()),
            "Bad" => self.control.push_back(format!(
                "[1001][Empty command or command unrecognized. - Command: '{line}']"
            )),
            "Hang" => self.drops = true,
            _ => {}
        }
    }

    fn reject(&mut self, now: Instant, problem: LineProblem) {
        self.live(now);
        assert!(self.is_open);
        self.told.push(Told::Rejected(problem));
        self.control.push_back(match problem {
            LineProblem::TooLong => "[3003][Command has reached the maximum length.]".into(),
            _ => "[1001][Empty command or command unrecognized. - Command: '']".into(),
        });
    }

    fn next_control_message(&mut self, into: &mut dyn Write) -> bool {
        let Some(message) = self.control.pop_front() else { return false };
        // In pieces, as a writer of values does.
        let (front, back) = message.split_at(message.len() / 2);
        let _ = into.write_str(front);
        let _ = into.write_str(back);
        true
    }

    fn monitoring_snapshot(&mut self, now: Instant, each: &mut dyn FnMut(&str)) {
        self.live(now);
        self.snapshot.iter().for_each(|message| each(message));
    }

    fn next_monitoring_message(&mut self, into: &mut dyn Write) -> bool {
        let Some(message) = self.monitoring.pop_front() else { return false };
        let _ = into.write_str(&message);
        true
    }

    fn advance(&mut self, now: Instant) {
        self.live(now);
        if self.homed_at.is_some_and(|at| at <= now) {
            self.homed_at = None;
            self.control.push_back("[2002][Homing done.]".into());
        }
        if let Some(interval) = self.interval
            && now >= self.next_report
        {
            self.next_report = now + interval;
            self.monitoring.push_back(format!("[2230][{}]", now.as_nanos() / 1_000));
        }
    }

    fn is_on_text(&self) -> bool {
        self.is_on_text
    }

    fn drops_control(&self) -> bool {
        self.drops
    }
}
