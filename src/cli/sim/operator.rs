//! Whoever stands beside the virtual robots while they are served: plays the scenario, presses what the
//! keys say, keeps what the robots keep, and shows how they are.

use std::path::PathBuf;
use std::prelude::v1::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Args;

use super::beside::{Beside, Cut};
use super::cell::Cell;
use super::deed::perform;
use super::keyboard::{Keyboard, Stroke};
use super::keys::Keys;
use super::scenario::{self, Course, Play, label, shown_time};
use super::scenario_file::Scenario;
use super::stage::Stage;
use super::state::State;
use super::status_line::Screen;
use crate::cli::exit::Failure;
use crate::sim::meca500::{RobotSettings, VirtualRobot};
use crate::time::Instant;

/// What the command line says of it.
#[derive(Args, Debug)]
#[command(next_help_heading = "The person at the cell")]
pub(super) struct OperatorArgs {
    /// File with what happens to the robots: E-Stop, P-Stop 2, Reset, pulled cables, blocked joints, power,
    /// each at its time, as `2.5 s estop press`. docs/scenarios.md has all of it.
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Directory with what the robots keep over power-off: variables, offline programs, persistent
    /// settings, a file for each robot. It is made unless it is there.
    #[arg(long, value_name = "DIR")]
    state: Option<PathBuf>,
}

/// The person, before anything is served.
pub(super) struct Prepared {
    scenario: Option<Scenario>,
    state: Option<State>,
}

impl Prepared {
    /// Reads all files for so many robots.
    pub(super) fn read(args: &OperatorArgs, robots: usize) -> Result<Self, Failure> {
        let scenario = match &args.scenario {
            Some(path) => Some(scenario::read(path, robots)?),
            None => None,
        };
        let state = match &args.state {
            Some(directory) => Some(State::open(directory, robots)?),
            None => None,
        };
        Ok(Self { scenario, state })
    }

    /// Whether a robot was switched to EtherCAT when it was served last; `None` when nothing is known
    /// of it.
    pub(super) fn was_in_ethercat_mode(&self, number: usize) -> Option<bool> {
        self.state.as_ref()?.is_in_ethercat_mode(number)
    }

    /// Makes a robot of these settings with all that it has kept; and what is to be told of that.
    pub(super) fn robot(
        &self,
        number: usize,
        mut settings: RobotSettings,
    ) -> Result<(VirtualRobot, Option<String>), Failure> {
        let Some(state) = &self.state else { return Ok((VirtualRobot::new(settings), None)) };
        let told = state.furnish(number, &mut settings)?;
        let mut robot = VirtualRobot::new(settings);
        state.fill(number, &mut robot)?;
        Ok((robot, told))
    }

    /// Begins: from here on times count. `interrupted` is what ends the serving; a person in a hurry
    /// wants `quiet`: no line, no keys.
    pub(super) fn begin(self, now: Instant, interrupted: Arc<AtomicBool>, quiet: bool) -> Operator {
        Operator {
            began: now,
            play: self.scenario.map(|scenario| Play::new(scenario, now)),
            state: self.state,
            keyboard: Keyboard::default(),
            keys: if quiet { None } else { Keys::open() },
            screen: if quiet { None } else { Screen::open(now) },
            cut: Cut::default(),
            interrupted,
        }
    }
}

/// The person at work.
pub(super) struct Operator {
    began: Instant,
    play: Option<Play>,
    state: Option<State>,
    keyboard: Keyboard,
    keys: Option<Keys>,
    screen: Option<Screen>,
    cut: Cut,
    interrupted: Arc<AtomicBool>,
}

impl Operator {
    /// Whether keys do something, for the words at the beginning.
    pub(super) const fn has_keys(&self) -> bool {
        self.keys.is_some()
    }

    /// Does what is due and what was asked for. Never waits.
    pub(super) fn act(&mut self, stage: &mut Stage<'_>, tell: &mut dyn FnMut(String)) {
        self.cut.give_back(stage);
        let cell = &mut Beside { stage, cut: &mut self.cut };
        let time = shown_time(cell.now() - self.began);
        if let Some(play) = &mut self.play {
            let course = play.act(cell, &mut |words| tell(format!("{time}{words}")));
            if course == Course::Quits {
                self.interrupted.store(true, Ordering::Relaxed);
            }
        }
        while let Some(key) = self.keys.as_ref().and_then(Keys::next) {
            match self.keyboard.press(key, cell) {
                None => {}
                Some(Stroke::Tell(words)) => tell(words),
                Some(Stroke::Quit) => self.interrupted.store(true, Ordering::Relaxed),
                Some(Stroke::Do(robots, deed)) => {
                    for number in robots {
                        let words = perform(deed, cell, number);
                        tell(format!("{time}{}{words}", label(number, cell)));
                    }
                }
            }
        }
        if let Some(state) = &mut self.state
            && let Some(refusal) = state.keep(cell)
        {
            tell(refusal);
        }
        if let Some(screen) = &mut self.screen {
            screen.show(cell);
        }
    }

    /// Gives the terminal back and waits until what the robots keep is written.
    pub(super) fn end(mut self, stage: &mut Stage<'_>) -> Result<(), Failure> {
        drop(self.keys);
        drop(self.screen);
        self.state.map_or(Ok(()), |state| state.end(&mut Beside { stage, cut: &mut self.cut }))
    }
}
