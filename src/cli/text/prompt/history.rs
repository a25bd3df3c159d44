//! Where the lines typed are kept.

use std::path::PathBuf;
use std::prelude::v1::*;

use etcetera::BaseStrategy;

/// What was asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum HistoryChoice {
    Off,
    At(PathBuf),
    InStateDir,
}

/// Most lines that are kept.
pub(super) const LINES: usize = 1_000;

/// The file; `None` for none. A user without a home keeps nothing.
pub(super) fn file(choice: &HistoryChoice) -> Option<PathBuf> {
    file_in(choice, state_dir)
}

fn file_in(choice: &HistoryChoice, state_dir: impl Fn() -> Option<PathBuf>) -> Option<PathBuf> {
    match choice {
        HistoryChoice::Off => None,
        HistoryChoice::At(path) => Some(path.clone()),
        HistoryChoice::InStateDir => Some(state_dir()?.join("fieldarm").join("text_history")),
    }
}

/// `$XDG_STATE_HOME`, or what stands for it on this system.
fn state_dir() -> Option<PathBuf> {
    let strategy = etcetera::choose_base_strategy().ok()?;
    strategy.state_dir().or_else(|| Some(strategy.data_dir()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_is_in_the_state_directory_unless_it_is_named_or_unwanted() {
        let state = || Some(PathBuf::from("/home/x/.local/state"));
        let usual = file_in(&HistoryChoice::InStateDir, state);
        assert_eq!(usual, Some("/home/x/.local/state/fieldarm/text_history".into()));
        let named = HistoryChoice::At("here".into());
        assert_eq!(file_in(&named, || None), Some("here".into()));
        assert_eq!(file_in(&HistoryChoice::Off, state), None);
        assert_eq!(file_in(&HistoryChoice::InStateDir, || None), None);
    }
}
