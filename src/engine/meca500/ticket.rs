//! What a caller holds for a submitted command, and what it is told when misusing the engine.

use crate::wire::meca500::command::ArgumentError;

/// A submitted command. Ordered by submission; ends in exactly one of `Done`, `Aborted`, `Unknown`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Ticket(pub(super) u32);

impl Ticket {
    /// The number of the submission, counted from 1.
    #[must_use]
    pub const fn number(self) -> u32 {
        self.0
    }
}

/// Why a command was not taken; the engine is as before.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SubmitError {
    /// An argument the robot would refuse.
    #[error(transparent)]
    Argument(#[from] ArgumentError),
    /// As many commands are waiting as the queue holds.
    #[error("the queue of waiting commands is full")]
    QueueFull,
    /// The event queue must be polled first: it has no room for how the command ends.
    #[error("events wait to be polled before another command can be taken")]
    EventsUnread,
    /// Velocity commands run continuously and go through `set_velocity`.
    #[error("velocity commands go through set_velocity")]
    VelocityCommand,
    /// ID 0 does nothing, and whether the robot acknowledges it is not stated.
    #[error("the command does nothing and may never be acknowledged")]
    NoMovement,
    /// Another robot's command.
    #[error("command ID {id} is not available on the Meca500")]
    NotAvailable {
        /// Its ID.
        id: u32,
    },
    /// A number the engine keeps for its own checkpoints.
    #[error("checkpoint {number} belongs to the engine's own range")]
    ReservedCheckpoint {
        /// The number.
        number: u16,
    },
    /// A raw checkpoint whose number is no integer from 1 to 8000.
    #[error("a checkpoint number is an integer from 1 to 8000")]
    BadCheckpoint,
    /// The connection only allows monitoring.
    #[error("this connection only allows monitoring")]
    MonitoringOnly,
    /// A velocity command needs a connected robot that is ready for motion and not paused.
    #[error("the robot is not ready for a velocity motion")]
    NotReady,
}

/// Why an action was not taken; the engine is as before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RequestError {
    /// One of this kind is still pending, or its final event was not polled.
    #[error("an action of this kind is still pending")]
    Pending,
    /// There is no connection to a robot yet, or none any more.
    #[error("not connected")]
    NotConnected,
    /// The connection only allows monitoring.
    #[error("this connection only allows monitoring")]
    MonitoringOnly,
    /// Brakes were not allowed in the configuration.
    #[error("control of the brakes is not allowed by the configuration")]
    BrakesNotAllowed,
    /// HostTime 0 means "leave the clock alone".
    #[error("a host time of 0 sets nothing")]
    HostTimeZero,
}

/// Why a dynamic type cannot be subscribed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SubscribeError {
    /// As many types are subscribed as the engine keeps.
    #[error("no more than {max} dynamic types can be subscribed")]
    Full {
        /// How many it keeps.
        max: usize,
    },
    /// Type 0 is a request to rotate, not a type.
    #[error("the automatic type carries no data of its own")]
    Automatic,
}
