//! How a run over the text interface shall be.

use crate::time::Duration;

/// Settings of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextSettings {
    /// First and last of the checkpoint numbers that are the run's own: the program uses none of them.
    pub checkpoints: (u16, u16),
    /// Whether positions are asked for on the control port (SetCtrlPortMonitoring). Not needed where a
    /// monitoring connection brings them.
    pub copies_monitoring: bool,
    /// Interval of the positions to be set for the run, 1 ms to 1 s; put back at its end. `None` leaves it
    /// as it is. Source: PM L3679.
    pub interval: Option<Duration>,
    /// Time after which the robot shall stop and end the connection when nothing is heard from here; fed
    /// three times as often, and cancelled at the end. `None`: the robot's own supervision. Source: PM L3158.
    pub watchdog: Option<Duration>,
    /// Lines that may be under way at most.
    ///
    /// Source: choice. With their checkpoints they fill a small part of the robot's queue of 13,000.
    pub window: usize,
}

impl Default for TextSettings {
    fn default() -> Self {
        Self {
            checkpoints: (7_001, 8_000),
            copies_monitoring: true,
            interval: None,
            watchdog: None,
            window: 200,
        }
    }
}
