//! The command `fieldarm`.
//!
//! Read `exit.rs` first: every kind of trouble ends in one of its codes, which `--help` lists.
//! Standard output carries what was asked for (tables, decoded images, the summary of a run);
//! standard error carries progress, notes and trouble.

mod decode;
#[cfg(target_os = "linux")]
mod emulated_robot;
mod ending;
mod enip;
mod ethercat_options;
mod exit;
mod grid;
mod hex;
mod link_choice;
mod link_text;
mod order;
mod plots;
#[cfg(target_os = "linux")]
mod probe;
pub mod report;
mod report_files;
mod run_program;
mod segment;
#[cfg(target_os = "linux")]
mod sim;
mod source;
mod summary;
mod table;
mod text;
mod virtual_robot;
mod watch;
mod wording;

use std::prelude::v1::*;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use exit::{EXIT_CODES, Exit};

/// Drive industrial robot arms: run robot programs, look into process images.
#[derive(Debug, Parser)]
#[command(name = "fieldarm", version, after_help = EXIT_CODES, after_long_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Run(run_program::RunArgs),
    #[cfg(target_os = "linux")]
    Sim(sim::SimArgs),
    #[cfg(target_os = "linux")]
    Probe(probe::ProbeArgs),
    Text(text::prompt::TextArgs),
    Table(table::TableArgs),
    Decode(decode::DecodeArgs),
}

/// Runs the command that the process was started with.
#[must_use]
pub fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Command::Run(args) => run_program::run(&args),
        #[cfg(target_os = "linux")]
        Command::Sim(args) => sim::run(&args),
        #[cfg(target_os = "linux")]
        Command::Probe(args) => probe::run(&args),
        Command::Text(args) => text::prompt::run(&args),
        Command::Table(args) => table::run(&args).map(|()| Exit::Done),
        Command::Decode(args) => decode::run(&args).map(|()| Exit::Done),
    };
    match done {
        Ok(exit) => exit.into(),
        Err(failure) => {
            eprintln!("{}", failure.text());
            failure.exit.into()
        }
    }
}
