//! Who says what happens, on standard error.

use std::io::Write;
use std::prelude::v1::*;

use super::status_line;

/// Says things on standard error, if anybody wants to hear them.
#[derive(Clone, Copy, Debug)]
pub(in crate::cli) struct Teller {
    pub(in crate::cli) quiet: bool,
}

impl Teller {
    pub(in crate::cli) fn say(self, message: impl core::fmt::Display) {
        if !self.quiet && !status_line::say(&message.to_string()) {
            // Nobody reads standard error any more: the robots are served on.
            let _ = writeln!(std::io::stderr(), "{message}");
        }
    }
}
