//! How a line on standard error names its robot, and its bus where there is more than one.

use std::prelude::v1::*;

/// How robots and buses are named.
#[derive(Clone, Copy, Debug)]
pub(in crate::cli) struct Labels {
    /// Whether there is more than one robot.
    pub(in crate::cli) are_several: bool,
    /// Whether they have more than one face.
    pub(in crate::cli) is_mixed: bool,
}

impl Labels {
    /// `robot 2: ` for the second of several, nothing for the only one.
    pub(in crate::cli) fn of(self, robot: usize) -> String {
        match self.are_several {
            true => format!("robot {}: ", robot + 1),
            false => String::new(),
        }
    }

    /// What stands before a word about the bus, on EtherNet/IP.
    pub(in crate::cli) const fn bus(self) -> &'static str {
        if self.is_mixed { "EtherNet/IP: " } else { "" }
    }
}
