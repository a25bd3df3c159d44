//! The prompt at a terminal.

use std::fs;
use std::path::Path;
use std::prelude::v1::*;
use std::thread;

use rustyline::config::Configurer;
use rustyline::error::ReadlineError;
use rustyline::history::FileHistory;
use rustyline::{ColorMode, CompletionType, Config, Editor, ExternalPrinter};

use super::assist::Assist;
use super::entry::{self, BuiltIn, Entry};
use super::history::{self, HistoryChoice};
use super::paint::{Paint, Tone};
use super::view::View;
use super::{Session, help, messages, signals, state};
use crate::cli::exit::{Exit, Failure};
use crate::link::text::{AnswerError, Client, EndReason, Messages};
use crate::time::Duration;
use crate::wire::meca500::revision::Revision;

const PROMPT: &str = "> ";
/// Longest wait of the thread that prints, so that it sees its end.
const LISTEN: Duration = Duration::from_secs(1);
/// How long to wait for the state of the robot when the prompt is left.
const LAST_LOOK: Duration = Duration::from_millis(500);

type Line = Editor<Assist, FileHistory>;

/// Runs the prompt until it is left or the connection ends.
pub(super) fn run(session: Session, history: &HistoryChoice) -> Result<Exit, Failure> {
    let Session { client, messages, view, paint, revision } = session;
    signals::end_in_good_order()?;
    let mut line = editor(revision, paint)?;
    let file = history::file(history);
    if let Some(file) = &file {
        load(&mut line, file);
    }
    let printer = line.create_external_printer().map_err(|error| broken(&error))?;
    let printing = {
        let view = view.clone();
        thread::spawn(move || print_all(&messages, &view, paint, printer))
    };
    println!("{}", paint.text(Tone::Faint, ":help tells what there is, Ctrl-D ends"));
    // What it is like now; its answer is shown as any other.
    let _ = client.send("-GetStatusRobot");
    let talked = talk(&mut line, &client, &view, paint, revision);
    if let Some(file) = &file {
        keep(&mut line, file);
    }
    let exit = talked.map(|()| match client.ended() {
        Some(_) => Exit::Link,
        None => {
            tell_of_motion(&client, paint);
            Exit::Done
        }
    });
    // Whoever still prints finds the terminal as it was, and then the end of the connection.
    drop(line);
    drop(client);
    let _ = printing.join();
    exit
}

fn editor(revision: Revision, paint: Paint) -> Result<Line, Failure> {
    let config = Config::builder()
        .completion_type(CompletionType::List)
        .history_ignore_space(true)
        .color_mode(if paint.is_on { ColorMode::Enabled } else { ColorMode::Disabled })
        .build();
    let mut line = Line::with_config(config).map_err(|error| broken(&error))?;
    line.set_max_history_size(history::LINES).map_err(|error| broken(&error))?;
    line.set_helper(Some(Assist { revision, paint }));
    Ok(line)
}

fn broken(error: &ReadlineError) -> Failure {
    Failure::internal(format!("the terminal cannot be used: {error}"))
}

fn load(line: &mut Line, file: &Path) {
    let read = line.load_history(file);
    let is_new = !file.exists();
    if let Err(error) = read
        && !is_new
    {
        eprintln!("fieldarm: the history in {} cannot be read: {error}", file.display());
    }
}

fn keep(line: &mut Line, file: &Path) {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
    let made = folder.map_or(Ok(()), fs::create_dir_all);
    let kept = made.map_err(ReadlineError::from).and_then(|()| line.append_history(file));
    if let Err(error) = kept {
        eprintln!(
            "fieldarm: the history cannot be kept in {}: {error}; --history names another file, --no-history \
             keeps none",
            file.display()
        );
    }
}

/// Prints what the robot says above the line that is typed, until the connection ends.
fn print_all(messages: &Messages, view: &View, paint: Paint, mut printer: impl ExternalPrinter) {
    loop {
        let text = match messages.wait_next(LISTEN) {
            Ok(Some(message)) if view.shows(&message) => {
                messages::line(&message, view.is_raw(), paint)
            }
            Ok(_) => continue,
            Err(EndReason::Closed) => return,
            Err(reason) => {
                let text = format!("{reason}; Enter leaves the prompt");
                let _ = printer.print(format!("{}\n", paint.text(Tone::Error, text)));
                return;
            }
        };
        if printer.print(format!("{text}\n")).is_err() {
            return;
        }
    }
}

/// Reads line after line. Ends when the person wants it, or after the connection has ended.
fn talk(
    line: &mut Line,
    client: &Client,
    view: &View,
    paint: Paint,
    revision: Revision,
) -> Result<(), Failure> {
    let mut was_interrupted = false;
    loop {
        let typed = match line.readline(PROMPT) {
            Ok(typed) => typed,
            Err(ReadlineError::Interrupted) if was_interrupted => return Ok(()),
            Err(ReadlineError::Interrupted) => {
                was_interrupted = true;
                println!("{}", paint.text(Tone::Faint, "Ctrl-C again, or Ctrl-D, ends"));
                continue;
            }
            Err(ReadlineError::Eof) => return Ok(()),
            Err(error) => return Err(broken(&error)),
        };
        was_interrupted = false;
        if client.ended().is_some() {
            return Ok(());
        }
        if !typed.trim().is_empty() {
            line.add_history_entry(typed.as_str()).map_err(|error| broken(&error))?;
        }
        match entry::read(&typed, revision) {
            Entry::Nothing => {}
            Entry::BuiltIn(BuiltIn::Quit) => return Ok(()),
            Entry::BuiltIn(built_in) => answer(built_in, client, paint, revision),
            Entry::Mistake(mistake) => {
                let mark = format!("{:>width$}", '^', width = PROMPT.len() + mistake.column);
                println!("{}", paint.text(Tone::Error, mark));
                println!("{}", paint.text(Tone::Warning, mistake.words()));
            }
            Entry::Command { text, spec } => {
                view.asks(spec.map_or(&[], |spec| spec.answers()));
                if let Err(error) = client.send(text).map(drop) {
                    println!("{}", paint.text(Tone::Error, unsent(&error)));
                }
            }
        }
    }
}

fn unsent(error: &AnswerError) -> String {
    match error {
        AnswerError::Ended(reason) => format!("not sent: {reason}"),
        error => error.to_string(),
    }
}

fn answer(built_in: BuiltIn<'_>, client: &Client, paint: Paint, revision: Revision) {
    match built_in {
        BuiltIn::Help(None) => println!("{}", help::overview()),
        BuiltIn::Help(Some(name)) => match help::of(name, revision) {
            Ok(text) => println!("{text}"),
            Err(error) => println!("{}", paint.text(Tone::Warning, error)),
        },
        BuiltIn::State => println!("{}", state::words(&client.state())),
        BuiltIn::Quit => {}
        BuiltIn::Unknown(text) => {
            println!("{}", paint.text(Tone::Warning, entry::unknown_built_in(text)));
        }
    }
}

/// Says what becomes of a robot that moves when the connection ends. Source: PM L904, L908.
fn tell_of_motion(client: &Client, paint: Paint) {
    let status = client.get_status_robot().and_then(|mut answer| answer.wait(LAST_LOOK));
    let Ok(status) = status else { return };
    let text = match (status.is_end_of_motion, status.is_end_of_block) {
        (true, true) => return,
        (true, false) => "the robot has commands left in its queue",
        (false, _) => "the robot is moving",
    };
    let text = format!(
        "{text}: it stops now, because the connection ends; ResumeMotion is needed after the next one"
    );
    println!("{}", paint.text(Tone::Warning, text));
}
