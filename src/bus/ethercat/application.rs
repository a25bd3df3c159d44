//! What stands behind an ESC: the device's own firmware, as the ESC sees it.

use crate::time::Instant;
use crate::wire::ethercat::al::{AlState, AlStatusCode};

/// The firmware behind an ESC: it answers the mailbox, says how long the process data are, and
/// lives through the cycles.
pub trait Application {
    /// Takes a datagram that the main device wrote into the mailbox: its 6-byte header and what
    /// follows, as long as the sync manager's buffer. `state` is the state the device is in.
    ///
    /// The answer, if there is one, comes from [`next_mailbox`](Self::next_mailbox).
    fn receive_mailbox(&mut self, state: AlState, datagram: &[u8]);

    /// Writes the next datagram for the main device, header included, and returns its length;
    /// `None` while there is none. Called only when the input mailbox is empty. `room` is as long
    /// as the sync manager's buffer.
    fn next_mailbox(&mut self, room: &mut [u8]) -> Option<usize>;

    /// Forgets what is left of a mailbox conversation: the mailbox was switched off (INIT).
    fn reset_mailbox(&mut self);

    /// Length of the assigned outputs in bytes, as the main device sends them.
    fn output_len(&self) -> usize;

    /// Length of the assigned inputs in bytes, as the main device receives them.
    fn input_len(&self) -> usize;

    /// Whether the firmware agrees to a step that the ESC's own rules allow.
    ///
    /// # Errors
    ///
    /// The code that AL status shall show; the state stays.
    fn check_transition(&mut self, from: AlState, to: AlState) -> Result<(), AlStatusCode>;

    /// One cycle: takes the newest outputs (`None` outside OP, or after the watchdog expired), lets
    /// the device live until `now`, and writes its inputs. Both are as assigned.
    fn cycle(&mut self, now: Instant, outputs: Option<&[u8]>, inputs: &mut [u8]);

    /// Whether the device is on the bus. While it is not (off, booting, switched to another
    /// protocol) its ports are closed: frames turn back at the device before it.
    fn is_on_bus(&self) -> bool;
}
