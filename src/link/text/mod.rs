//! The robot's text interface on TCP sockets: both ports of a robot, and clients.
//!
//! Read [`TextServer`] for the robot's side, [`Client`] for the PC's and [`Monitor`] for one who only
//! listens; the robot's commands are methods of the client, in `commands/`. The protocol is in
//! [`bus::text`](crate::bus::text); here are sockets, the clock and, for clients, a thread that reads.
//!
//! ```no_run
//! use fieldarm::link::text::{Client, ClientOptions};
//! use std::time::Duration;
//!
//! let address = "192.168.0.100:10000".parse()?;
//! let client = Client::connect(address, ClientOptions::default())?;
//! let limit = Duration::from_secs(10);
//! client.activate_robot()?.wait(limit)?;
//! client.home()?.wait(Duration::from_secs(60))?;
//! client.request("MoveJoints(0, 10, -10, 0, 20, 0)", limit)?;
//! client.until_idle()?.wait(limit)?;
//! println!("{:?}", client.get_rt_joint_pos()?.wait(limit)?.value);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! In async code the same things are awaited, on any runtime, since a thread of the client's own waits for
//! the network: `Client::connecting(address, options).await?`, `client.home()?.await?`,
//! `client.checkpoint(1)?.await?`, `client.until(|state| ...).await?`, `messages.next().await?`. Limits are
//! the runtime's business there.

mod answer;
mod client;
mod commands;
mod connection;
mod error;
mod message;
mod monitor;
mod ports;
mod server;

pub use answer::{Answer, Checkpoint, Reply};
pub use client::{Client, ClientOptions, Connecting, StateReached};
pub use commands::{Idle, NewVariable, Simulation, StatusWait, Variable, VariableValue};
pub use error::{AnswerError, BindError, ConnectError, EndReason, Port};
pub use message::{Messages, NextMessage, OwnedMessage};
pub use monitor::Monitor;
pub use ports::{
    Endpoints, KEEP_ALIVE, LEAVING_TIME, MONITORS, PATIENCE, PortCounts, ServerEvent, TextPorts,
};
pub use server::{STEP, TextServer};
