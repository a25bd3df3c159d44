//! Colour, where it is wanted: on terminals, and not with NO_COLOR.

use core::fmt::Display;
use std::env;
use std::io::IsTerminal;
use std::prelude::v1::*;

use anstyle::{AnsiColor, Style};

/// How much a line stands out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tone {
    Plain,
    /// Of less weight than what the robot says.
    Faint,
    /// The robot stands, and will go on when it is told to.
    Warning,
    Error,
}

/// Whether there is colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Paint {
    pub(super) is_on: bool,
}

impl Paint {
    pub(super) fn of_stdout() -> Self {
        let is_terminal = std::io::stdout().is_terminal();
        Self { is_on: is_on(is_terminal, is_set("NO_COLOR"), env::var("TERM").ok().as_deref()) }
    }

    pub(super) fn text(self, tone: Tone, text: impl Display) -> String {
        let style = match tone {
            _ if !self.is_on => return text.to_string(),
            Tone::Plain => return text.to_string(),
            Tone::Faint => Style::new().dimmed(),
            Tone::Warning => AnsiColor::Yellow.on_default(),
            Tone::Error => AnsiColor::Red.on_default().bold(),
        };
        format!("{style}{text}{style:#}")
    }
}

fn is_set(variable: &str) -> bool {
    env::var_os(variable).is_some_and(|value| !value.is_empty())
}

fn is_on(is_terminal: bool, no_color: bool, terminal: Option<&str>) -> bool {
    is_terminal && !no_color && terminal != Some("dumb")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_is_for_terminals_that_want_it() {
        assert!(is_on(true, false, Some("xterm")) && is_on(true, false, None));
        assert!(!is_on(false, false, Some("xterm")));
        assert!(!is_on(true, true, Some("xterm")));
        assert!(!is_on(true, false, Some("dumb")));
        assert_eq!(Paint { is_on: false }.text(Tone::Error, "x"), "x");
        let red = Paint { is_on: true }.text(Tone::Error, "x");
        assert!(red.starts_with('\u{1b}') && red.ends_with("\u{1b}[0m"), "{red:?}");
        assert_eq!(Paint { is_on: true }.text(Tone::Plain, "x"), "x");
    }
}
