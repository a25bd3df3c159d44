//! The connection to one robot's text interface, as a run sees it.

use crate::time::Instant;
use crate::wire::meca500::text::Message;

/// A message, and where it came in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Heard<'a> {
    /// On the control port: answers and news, in the robot's order.
    Control(Message<'a>),
    /// On a monitoring connection beside it. How it lies in time to the control port is not known.
    Monitoring(Message<'a>),
}

/// A control connection that the robot has granted, with or without a monitoring connection beside it.
///
/// An error means that the control connection is gone; what it says is told to people. A lost
/// monitoring connection is no error: its messages just end.
pub trait TextLink {
    /// What can go wrong with it.
    type Error: core::fmt::Display;

    /// The time that its messages come in.
    fn now(&self) -> Instant;

    /// Takes a command, without terminator. `false`: there is no room for it now, try again later.
    ///
    /// # Errors
    ///
    /// The connection is gone.
    fn send(&mut self, command: &str) -> Result<bool, Self::Error>;

    /// Waits for messages until `until` at most and hands over all that are there, with the time at which
    /// they came. It may return early, with or without any.
    ///
    /// # Errors
    ///
    /// The connection is gone; all messages before that were handed over.
    fn receive(
        &mut self,
        until: Instant,
        take: &mut dyn FnMut(Instant, Heard<'_>),
    ) -> Result<(), Self::Error>;

    /// Tries once to connect to a robot that has rebooted, for a second at most. `false`: it is not there yet.
    fn reconnect(&mut self) -> bool;
}
