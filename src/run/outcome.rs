//! How a run can end.

use core::fmt;

use crate::engine::meca500::{Action, Fault, RequestError, SubmitError, VelocityStop, WaitReason};
use crate::wire::meca500::code::Code;
use crate::wire::meca500::image::SafetySignals;

/// How the run of a program ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// What ended it.
    pub end: End,
    /// Position of the step that caused it or was under way, where there is one.
    pub step: Option<usize>,
    /// Whether motion was stopped on purpose, and whether the robot confirmed it.
    pub stop: Stop,
}

/// What ended a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// The last checkpoint was reached: every command is known to be executed.
    Completed,
    /// Somebody asked for it.
    Interrupted,
    /// The robot reported an error.
    RobotError(Code),
    /// A safety signal stopped the robot.
    SafetyStop(SafetySignals),
    /// The link itself failed and cannot exchange images any more; what it said.
    LinkFailed(LinkMessage),
    /// The robot did not confirm an action.
    ActionFailed(Action, Fault),
    /// The robot left velocity mode by itself.
    VelocityStopped(VelocityStop),
    /// The robot's state keeps commands from being sent, and nothing in the program changes it.
    HeldBack(WaitReason),
    /// The connection takes no control.
    MonitoringOnly,
    /// The robot rebooted.
    Rebooted,
    /// The engine did not take a command.
    Refused(SubmitError),
    /// The engine did not take an action.
    RequestRefused(RequestError),
    /// Inputs stayed bad after the connection had been made.
    ConnectionLost,
    /// No connection was made in time.
    NotConnected,
    /// What arrives makes no sense in the byte order that was set; nothing was sent.
    ImplausibleInputs,
    /// The byte order cannot be told from what arrives.
    ByteOrderUndecidable,
    /// Something else went wrong with the handshake.
    Fault(Fault),
}

/// Whether motion was stopped on purpose before the run ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stop {
    /// There was no need to: all motion had ended, or the robot had stopped by itself.
    #[default]
    NotNeeded,
    /// Paused and cleared, both confirmed by the robot.
    Confirmed,
    /// An activation or homing was ended by deactivating the robot, which it confirmed.
    Deactivated,
    /// The robot was not activated: its brakes hold, and nothing was asked of it.
    NotActivated,
    /// The link was lost before the robot had confirmed it.
    LinkLost,
    /// The robot did not confirm it in time.
    Unconfirmed,
}

/// What a link said when it failed, cut off after 120 bytes: an outcome takes no memory.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct LinkMessage {
    bytes: [u8; 120],
    len: usize,
}

impl LinkMessage {
    /// The message of `error`.
    #[must_use]
    pub fn of(error: &impl fmt::Display) -> Self {
        let mut message = Self { bytes: [0; 120], len: 0 };
        // Its only error is that there is no more room.
        let _ = fmt::write(&mut message, format_args!("{error}"));
        message
    }

    /// The message.
    #[must_use]
    pub fn as_str(&self) -> &str {
        let bytes = self.bytes.get(..self.len).unwrap_or_default();
        core::str::from_utf8(bytes).unwrap_or_default()
    }
}

impl fmt::Write for LinkMessage {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for character in text.chars() {
            let end = self.len + character.len_utf8();
            let place = self.bytes.get_mut(self.len..end).ok_or(fmt::Error)?;
            character.encode_utf8(place);
            self.len = end;
        }
        Ok(())
    }
}

impl fmt::Debug for LinkMessage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.as_str(), f)
    }
}

impl fmt::Display for LinkMessage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}
