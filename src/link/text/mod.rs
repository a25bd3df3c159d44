//! The robot's text interface on TCP sockets: both ports of a robot, and clients.
//!
//! Read [`TextServer`] for the robot's side, [`Client`] for the PC's and [`Monitor`] for one who only
//! listens. The protocol is in [`bus::text`](crate::bus::text); here are sockets, the clock and, for
//! clients, a thread that reads.
//!
//! ```no_run
//! use fieldarm::link::text::{Client, ClientOptions};
//! use std::time::Duration;
//!
//! let address = "192.168.0.100:10000".parse()?;
//! let client = Client::connect(address, ClientOptions::default())?;
//! let limit = Duration::from_secs(10);
//! client.request("ActivateRobot", limit)?;
//! client.request("Home", Duration::from_secs(60))?;
//! client.request("MoveJoints(0, 10, -10, 0, 20, 0)", limit)?;
//! client.checkpoint(1)?.wait(limit)?;
//! println!("{:?}", client.state().joints);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! In async code the same things are awaited, on any runtime, since a thread of the client's own waits for
//! the network: `Client::connecting(address, options).await?`, `client.send("Home")?.await?`,
//! `client.checkpoint(1)?.await?`, `client.until(|state| ...).await?`, `messages.next().await?`. Limits are
//! the runtime's business there.

mod answer;
mod client;
mod connection;
mod error;
pub mod memory;
mod message;
mod monitor;
mod ports;
mod server;

pub use answer::{Answer, Checkpoint, Reply};
pub use client::{Client, ClientOptions, Connecting, StateReached};
pub use error::{AnswerError, BindError, ConnectError, EndReason, Port};
pub use message::{Messages, NextMessage, OwnedMessage};
pub use monitor::Monitor;
pub use ports::{
    Endpoints, KEEP_ALIVE, KEEP_ALIVES_LOST, LEAVING_TIME, MONITORS, PortCounts, ServerEvent,
    TextPorts,
};
pub use server::{STEP, TextServer};
