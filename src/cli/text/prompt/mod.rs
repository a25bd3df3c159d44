//! `fieldarm text`: a prompt at a robot's control port, or a look at its monitoring port.
//!
//! Read `entry.rs` first: what a line that somebody typed is. At a terminal `interactive.rs` edits lines,
//! otherwise `piped.rs` reads them from standard input; `watch.rs` is for the monitoring port.
//!
//! Invariants: what the robot says goes to standard output, everything else to standard error; what the
//! robot sends cannot act on the terminal.

mod arguments;
mod assist;
mod connect;
mod entry;
mod help;
mod history;
mod interactive;
mod messages;
mod paint;
mod piped;
mod signals;
mod state;
mod view;
mod watch;

use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::prelude::v1::*;

use clap::Args;

use super::link_name::Host;
use crate::bus::text::client::ClientSettings;
use crate::bus::text::{CONTROL_PORT, MONITORING_PORT};
use crate::cli::exit::{Exit, Failure};
use crate::link::text::{AnswerError, Client, ClientOptions, Messages};
use crate::time::Duration;
use crate::wire::meca500::revision::Revision;
use crate::wire::meca500::text::value::Greeting;
use history::HistoryChoice;
use paint::Paint;
use view::View;

/// Exit codes of this command, where they mean something of their own.
const EXIT_CODES: &str = "\
Exit codes:
    0  everything was sent and answered without an error; the prompt was left
    1  standard input cannot be read, or an internal error
    2  bad usage, or a line that the robot would refuse and that was not sent
    3  the robot reported an error, or stopped for safety (lines from standard input only)
    4  no connection, or it ended; a command was not answered
  130  interrupted with Ctrl-C, or by the signal TERM or HUP; a robot that moved stops

Examples:
    fieldarm text 192.168.0.100
    printf 'ActivateRobot\\nHome\\nMoveJoints(0,10,-10,0,20,0)\\n' | fieldarm text 192.168.0.100
    fieldarm text 192.168.0.100 --monitor";

/// Talk to a robot in its own text commands.
///
/// At a terminal this is a prompt with line editing, history, completion of names with Tab and a hint for
/// the argument that comes next. What the robot says is shown as it comes, with its meaning. A line that the
/// robot would refuse is not sent, and what would be right is said; with `!` before it, it is sent as it is.
/// `:help`, `:help COMMAND`, `:state` and `:quit` are for the prompt itself. Ctrl-C clears the line; a
/// second one, or Ctrl-D, ends. A robot that moves stops when the connection ends.
///
/// From a pipe or a file, each line is sent when the one before is answered; `//` and `#` begin comments. After
/// the last line it waits until the robot has executed everything. The first error ends it, unless --keep-going
/// is given.
#[derive(Args, Debug)]
#[command(after_help = EXIT_CODES, after_long_help = EXIT_CODES)]
pub(in crate::cli) struct TextArgs {
    /// IP address or host name of the robot; its port is 10000, with --monitor 10001, unless it is given as
    /// ADDR:PORT.
    #[arg(value_name = "ADDR[:PORT]", value_parser = robot)]
    address: String,
    /// Watch the monitoring port and send nothing: others may control the robot meanwhile. Ctrl-C ends
    /// it.
    #[arg(long)]
    monitor: bool,
    /// Show messages as the robot sends them, one a line, all of them.
    #[arg(long)]
    raw: bool,
    /// Longest time for the connection, and again for the robot's greeting.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, default_value = "5")]
    limit: Duration,
    /// Let the robot stop when it does not hear from here for so long (ConnectionWatchdog); it is fed as long
    /// as this runs.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, conflicts_with = "monitor")]
    watchdog: Option<Duration>,
    /// Go on after an error when lines come from a pipe or a file.
    #[arg(long, short, conflicts_with = "monitor")]
    keep_going: bool,
    /// File that keeps the lines typed; without it one in the directory for the state of programs
    /// (~/.local/state/fieldarm).
    #[arg(long, value_name = "FILE", conflicts_with = "monitor")]
    history: Option<PathBuf>,
    /// Keep no lines.
    #[arg(long, conflicts_with_all = ["history", "monitor"])]
    no_history: bool,
}

/// The robot on the command line: what stands there is right, whichever port is wanted.
fn robot(text: &str) -> Result<String, String> {
    Host::parse(text, CONTROL_PORT).map(|_| text.into())
}

/// A time on the command line.
fn seconds(text: &str) -> Result<Duration, String> {
    let known = text.parse().ok().filter(|seconds| (0.001..=86_400.0).contains(seconds));
    known
        .map(Duration::from_secs_f64)
        .ok_or_else(|| format!("a time is 0.001 to 86400 seconds, given `{text}`"))
}

/// A connection that is up, and how to talk about it.
struct Session {
    client: Client,
    /// From the greeting on.
    messages: Messages,
    view: View,
    paint: Paint,
    revision: Revision,
}

/// Runs `fieldarm text`.
pub(in crate::cli) fn run(args: &TextArgs) -> Result<Exit, Failure> {
    let paint = Paint::of_stdout();
    let view = View::new(args.raw);
    let usual = if args.monitor { MONITORING_PORT } else { CONTROL_PORT };
    let address = Host::parse(&args.address, usual).map_err(Failure::usage)?.look_up()?;
    if args.monitor {
        return watch::run(address, args.limit, view, paint);
    }
    let settings = ClientSettings { watchdog: args.watchdog, ..ClientSettings::default() };
    let options = ClientOptions { settings, limit: args.limit };
    let (client, messages) = Client::connect_listening(address, options)
        .map_err(|error| connect::failure(&error, address, args.limit))?;
    // A monitoring port greets too, and never answers.
    let first = client.sync().and_then(|mut answer| answer.wait(args.limit));
    if first == Err(AnswerError::TimedOut) {
        return Err(connect::mute(address, args.limit));
    }
    // The greeting is there already: the connection waited for it.
    let greeting = messages.wait_next(Duration::ZERO).ok().flatten();
    let told = greeting.as_ref().map(|message| Greeting::read(&message.as_message()));
    let revision = told.and_then(|greeting| greeting.revision).unwrap_or(Revision::R3);
    if let Some(message) = greeting {
        // Whoever does not read still wants the commands to be executed.
        let _ = writeln!(std::io::stdout(), "{}", messages::line(&message, args.raw, paint));
    }
    let session = Session { client, messages, view, paint, revision };
    if std::io::stdin().is_terminal() && std::io::stdout().is_terminal() {
        let history = match (&args.history, args.no_history) {
            (_, true) => HistoryChoice::Off,
            (Some(path), false) => HistoryChoice::At(path.clone()),
            (None, false) => HistoryChoice::InStateDir,
        };
        interactive::run(session, &history)
    } else {
        piped::run(session, args.keep_going)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read() {
        assert_eq!(seconds("0.5"), Ok(Duration::from_millis(500)));
        for text in ["0", "-1", "x", "1e9", "NaN", ""] {
            assert!(seconds(text).is_err(), "{text}");
        }
    }
}
