//! What is told and written when a run is over, robot by robot.

use std::path::Path;
use std::prelude::v1::*;

use super::exit::{Exit, Failure};
use super::grid::print;
use super::report::Report;
use super::{report_files, summary};
use crate::run::recording::Recording;

/// How the robots of a run ended, in the order of their numbers.
#[derive(Debug)]
pub(super) struct Endings {
    /// Robots of the run.
    count: usize,
    /// The reports, each with the files that were written of it.
    told: Vec<(Report, Vec<String>)>,
    exits: Vec<Exit>,
    failures: Vec<Failure>,
}

impl Endings {
    /// Of so many robots, none of which has ended yet.
    pub(super) const fn of(count: usize) -> Self {
        Self { count, told: Vec::new(), exits: Vec::new(), failures: Vec::new() }
    }

    /// The next robot ended with `exit` and the words of `message`, which are none after a good run; writes
    /// its report into `directory`.
    pub(super) fn add(
        &mut self,
        (exit, message): (Exit, String),
        report: Report,
        recording: &Recording,
        directory: Option<&Path>,
        title: &str,
    ) {
        self.exits.push(exit);
        if !message.is_empty() {
            let number = self.exits.len();
            // Editors find a place in a file only at the beginning of a line.
            let message =
                if self.count == 1 { message } else { format!("robot {number}:\n{message}") };
            self.failures.push(Failure { exit, message, is_located: true });
        }
        let written =
            directory.map(|directory| report_files::write(directory, title, &report, recording));
        // What happened is worth telling even where it could not be written down.
        let files = written.transpose().unwrap_or_else(|failure| {
            self.failures.push(failure);
            None
        });
        self.told.push((report, files.unwrap_or_default()));
    }

    /// Prints the summary; how the whole run ended.
    pub(super) fn tell(self) -> Result<Exit, Failure> {
        print(&match &self.told[..] {
            [(report, files)] => summary::of_one(report, files),
            several => summary::of_several(several),
        })?;
        Failure::all(self.failures).map_or(Ok(Exit::worst(self.exits)), Err)
    }
}
