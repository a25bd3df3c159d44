//! Which messages are shown: answers always, news once.
//!
//! A robot that is told to monitor says the same again and again, and the connection itself asks for its
//! state now and then. What nobody asked for is shown when it says something new; the time stamps that
//! end a round of monitoring and the answers to our own SyncCmdQueue never are.

use std::collections::HashMap;
use std::prelude::v1::*;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::link::text::OwnedMessage;
use crate::wire::meca500::code::Code;

/// Ends a round of monitoring messages.
const END_OF_ROUND: Code = Code(2230);
/// Answer to SyncCmdQueue.
const SYNCED: Code = Code(2097);
/// Questions that were never answered are forgotten, the oldest first.
const MOST_ASKED: usize = 64;

#[derive(Debug, Default)]
struct Seen {
    /// Codes that answer what somebody asked, oldest question first.
    asked: Vec<&'static [Code]>,
    /// The newest body of each code that comes again and again.
    newest: HashMap<Code, String>,
    /// A checkpoint of our own, of which nothing is told.
    hidden: Option<u16>,
}

/// Decides for whoever prints; who sends says what was asked.
#[derive(Clone, Debug)]
pub(super) struct View {
    shows_all: bool,
    seen: Arc<Mutex<Seen>>,
}

impl View {
    pub(super) fn new(shows_all: bool) -> Self {
        Self { shows_all, seen: Arc::default() }
    }

    pub(super) const fn is_raw(&self) -> bool {
        self.shows_all
    }

    fn lock(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Somebody asks for something that one of these codes answers.
    pub(super) fn asks(&self, answers: &'static [Code]) {
        if answers.is_empty() {
            return;
        }
        let mut seen = self.lock();
        if seen.asked.len() >= MOST_ASKED {
            seen.asked.remove(0);
        }
        seen.asked.push(answers);
    }

    /// The end of a checkpoint with this number is not shown, once.
    pub(super) fn hides_checkpoint(&self, number: u16) {
        self.lock().hidden = Some(number);
    }

    /// Whether to show a message that came.
    pub(super) fn shows(&self, message: &OwnedMessage) -> bool {
        let mut seen = self.lock();
        let asked = seen.asked.iter().position(|answers| answers.contains(&message.code));
        if let Some(place) = asked {
            seen.asked.remove(place);
        }
        let is_new = match content(message) {
            Some(content) => {
                seen.newest.insert(message.code, content.to_string()).as_deref() != Some(content)
            }
            None => true,
        };
        let ends_checkpoint =
            matches!(message.code, Code::CHECKPOINT_REACHED | Code::CHECKPOINT_DISCARDED);
        let is_hidden = |number: u16| message.body.trim().parse() == Ok(number);
        let is_hidden = ends_checkpoint && seen.hidden.is_some_and(is_hidden);
        if is_hidden {
            seen.hidden = None;
        }
        let is_ours = is_hidden || matches!(message.code, END_OF_ROUND | SYNCED);
        self.shows_all || asked.is_some() || (is_new && !is_ours)
    }
}

/// What is new or not of a message that comes again and again; `None` for others.
fn content(message: &OwnedMessage) -> Option<&str> {
    match message.code.0 {
        2007 | 2026 | 2027 | 2079 => Some(&message.body),
        // Behind the time.
        2200..=2399 => Some(message.body.split_once(',').map_or("", |(_, content)| content)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(code: u16, body: &str) -> OwnedMessage {
        OwnedMessage { code: Code(code), body: body.into() }
    }

    #[test]
    fn repeated_news_is_shown_once_and_answers_always() {
        let view = View::new(false);
        let status = message(2007, "1,0,0,0,0,1,1");
        assert!(view.shows(&status));
        assert!(!view.shows(&status));
        view.asks(&[Code(2007)]);
        assert!(view.shows(&status));
        assert!(!view.shows(&status));
        assert!(view.shows(&message(2007, "1,1,0,0,0,1,1")));
        assert!(view.shows(&message(2211, "100,1,2,3,4,5,6")));
        assert!(!view.shows(&message(2211, "115,1,2,3,4,5,6")));
        assert!(view.shows(&message(2211, "130,1,2,3,4,5,7")));
        for _ in 0..2 {
            assert!(view.shows(&message(3030, "1")));
        }
    }

    #[test]
    fn what_is_only_ours_is_hidden_unless_asked_for() {
        let view = View::new(false);
        assert!(!view.shows(&message(2097, "1")) && !view.shows(&message(2230, "5")));
        view.asks(&[Code(2097)]);
        assert!(view.shows(&message(2097, "7")));
        view.hides_checkpoint(8_000);
        assert!(view.shows(&message(3030, "7")));
        assert!(!view.shows(&message(3030, "8000")) && view.shows(&message(3030, "8000")));
        let raw = View::new(true);
        assert!(raw.shows(&message(2230, "5")) && raw.shows(&message(2230, "5")));
    }

    #[test]
    fn questions_without_an_answer_do_not_pile_up() {
        let view = View::new(false);
        for _ in 0..10_000 {
            view.asks(&[Code(2177)]);
        }
        assert_eq!(view.lock().asked.len(), MOST_ASKED);
    }
}
