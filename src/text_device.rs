//! The words the floors share about the robot's text interface.
//!
//! A [`TextDevice`] is the robot's end: a virtual robot offers it, a server of the text interface
//! drives it. Lines go in without their terminator and messages come out without theirs; splitting
//! the stream, the limits of a line and everything about connections belong to the server.
//!
//! Who calls what when, in this order:
//!
//! 1. [`advance`](TextDevice::advance) before anything else at a new time, and at least once a
//!    millisecond while somebody is connected. Time never goes back.
//! 2. [`is_on_text`](TextDevice::is_on_text) after each `advance`. While it is false the server
//!    closes every connection (with `close_control` for the controlling one) and accepts none.
//! 3. For what arrived, in the order of arrival: [`open_control`](TextDevice::open_control),
//!    [`command`](TextDevice::command) or [`reject`](TextDevice::reject),
//!    [`close_control`](TextDevice::close_control);
//!    [`monitoring_snapshot`](TextDevice::monitoring_snapshot) for each new monitoring connection.
//! 4. After each of these and after each `advance`:
//!    [`next_control_message`](TextDevice::next_control_message) and
//!    [`next_monitoring_message`](TextDevice::next_monitoring_message) until they return false,
//!    whether or not anybody is connected. What nobody is connected for is thrown away.
//! 5. [`drops_control`](TextDevice::drops_control) after the messages are taken.
//!
//! Invariants: `command`, `reject` and `close_control` come between an `open_control` that
//! returned true and the `close_control` that ends it, and never outside; at most one control
//! connection is open. Nothing here allocates.

use core::fmt;

use crate::time::Instant;

/// Why a line cannot be a command at all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LineProblem {
    /// More characters than the server takes came before a terminator; error 3003.
    TooLong,
    /// A byte that is neither printable ASCII nor a tab; error 1001, since no command has such a name.
    NotAscii,
    /// Nothing but blanks; error 1001. A line without any character is no line: it is ignored.
    Empty,
}

/// The robot's end of the text interface, with its control and its monitoring port.
pub trait TextDevice {
    /// Asks for the control of the robot for a new connection on the control port.
    ///
    /// `true`: granted; the messages that greet it (\[3000\] first) come from
    /// [`next_control_message`](Self::next_control_message). `false`: somebody else controls the
    /// robot, over whatever protocol; the server sends \[3001\] and closes.
    fn open_control(&mut self, now: Instant) -> bool;

    /// The control connection is gone, however it ended. Messages still waiting are for nobody.
    fn close_control(&mut self, now: Instant);

    /// Acts on one line of the control connection: not empty, printable ASCII and tabs, without its
    /// terminator, not longer than the server's limit.
    fn command(&mut self, now: Instant, line: &str);

    /// Answers a line that cannot be a command; the robot reports the error as it does others.
    fn reject(&mut self, now: Instant, problem: LineProblem);

    /// Writes the oldest waiting message for the control connection, in one or several pieces and
    /// without terminator, and forgets it. `false`, with nothing written, when none waits.
    ///
    /// An error of `into` (no room) is the server's business: the message counts as written.
    fn next_control_message(&mut self, into: &mut dyn fmt::Write) -> bool;

    /// Calls `each` with every message that a new monitoring connection is told first, in order and
    /// without terminators.
    fn monitoring_snapshot(&mut self, now: Instant, each: &mut dyn FnMut(&str));

    /// As [`next_control_message`](Self::next_control_message), for the messages that go to all
    /// monitoring connections.
    fn next_monitoring_message(&mut self, into: &mut dyn fmt::Write) -> bool;

    /// Lets the robot live until `now`.
    fn advance(&mut self, now: Instant);

    /// Whether the two ports are open: false while the robot is off, boots, or is in EtherCAT mode.
    fn is_on_text(&self) -> bool;

    /// Whether the robot itself ends the control connection now, because its connection watchdog
    /// ran out. The server sends what it holds, closes, and calls
    /// [`close_control`](Self::close_control), after which the answer is false again.
    fn drops_control(&self) -> bool {
        false
    }

    /// Keep-alive packets of TCP in a row that may be lost before a connection made from now on
    /// counts as broken, 0 to 60. Source: PM L3693-3707.
    fn keep_alive_packets(&self) -> u8 {
        3
    }
}
