//! How a run can end.

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
    /// The robot did not confirm it in time.
    Unconfirmed,
}
