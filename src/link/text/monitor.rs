//! A connection to the monitoring port: the robot tells, nobody controls.

use std::net::SocketAddr;
use std::sync::Arc;

use super::connection::{Connection, Role};
use super::error::{ConnectError, EndReason};
use super::message::{Messages, Queue};
use crate::bus::text::RobotState;
use crate::bus::text::client::ClientSettings;
use crate::time::Duration;

/// Silence after which a robot counts as gone: it sends something every second at least.
///
/// Source: choice, as for the control port.
const SILENCE: Duration = Duration::from_secs(10);

/// One who listens at the monitoring port. Any number may, whoever controls the robot.
#[derive(Debug)]
pub struct Monitor {
    connection: Connection,
    messages: Messages,
}

impl Monitor {
    /// Connects to a monitoring port, at most for `limit`.
    ///
    /// # Errors
    ///
    /// [`ConnectError::Socket`].
    pub fn connect(address: SocketAddr, limit: Duration) -> Result<Self, ConnectError> {
        let settings = ClientSettings { watchdog: None, silence_limit: Some(SILENCE) };
        let queue = Arc::new(Queue::default());
        let connection = Connection::open(address, settings, limit, Role::Monitoring(&queue))?;
        Ok(Self { connection, messages: Messages { queue } })
    }

    /// Everything the robot tells, from its state at the beginning on.
    #[must_use]
    pub const fn messages(&self) -> &Messages {
        &self.messages
    }

    /// The newest of what the robot told.
    #[must_use]
    pub fn state(&self) -> RobotState {
        *self.connection.shared.lock().session.state()
    }

    /// Why the connection ended, if it did.
    #[must_use]
    pub fn ended(&self) -> Option<EndReason> {
        self.connection.shared.lock().ended
    }
}
