//! What can go wrong on the way.

use std::io;
use std::net::SocketAddr;
use std::string::String;

use crate::wire::meca500::code::Code;
use crate::wire::meca500::command::MotionCommandId;
use crate::wire::meca500::text::value::ValueError;

/// One of the two ports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Port {
    /// 10000, for control.
    Control,
    /// 10001, for monitoring.
    Monitoring,
}

impl core::fmt::Display for Port {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Control => "control",
            Self::Monitoring => "monitoring",
        })
    }
}

/// A port that cannot be opened.
#[derive(Debug, thiserror::Error)]
#[error(
    "the {port} port cannot be opened at {address}: {cause}; is the address of this machine, and the port free?"
)]
pub struct BindError {
    /// Which.
    pub port: Port,
    /// Where.
    pub address: SocketAddr,
    /// What the system says.
    #[source]
    pub cause: io::Error,
}

/// Why a connection ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EndReason {
    /// This end closed it.
    #[error("the connection was closed here")]
    Closed,
    /// The robot closed it.
    #[error("the robot closed the connection")]
    ByRobot,
    /// The network broke it.
    #[error("the connection broke: {0}")]
    Broken(io::ErrorKind),
    /// The robot was silent for longer than the limit.
    #[error("the robot was silent for too long; check the network and the robot's power")]
    Silent,
}

/// Why there is no connection.
#[derive(Debug, thiserror::Error)]
pub enum ConnectError {
    /// Nobody answers at the address.
    #[error(
        "no connection to {address}: {cause}; check the address, the cable and whether the robot is in EtherCAT mode"
    )]
    Socket {
        /// The address.
        address: SocketAddr,
        /// What the system says.
        #[source]
        cause: io::Error,
    },
    /// The robot refuses: somebody else controls it (3001), or it is being upgraded (3002).
    #[error("the robot refuses the connection: {0}")]
    Refused(Code),
    /// It ended before the robot greeted.
    #[error("the robot did not greet: {0}")]
    Ended(#[from] EndReason),
    /// It is up, and the robot did not greet within the limit.
    #[error("the robot at {address} did not greet in time; is it a robot's control port?")]
    NoGreeting {
        /// The address.
        address: SocketAddr,
    },
}

/// Why a command was not answered as hoped.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AnswerError {
    /// It was not sent.
    #[error("not sent: {0}")]
    Submit(#[from] crate::bus::text::client::SubmitError),
    /// The command exists on cyclic buses only.
    #[error("motion command {id} cannot be said in text")]
    NoText {
        /// Its ID.
        id: MotionCommandId,
    },
    /// The robot answered with an error.
    #[error("{code} ({text})")]
    Refused {
        /// Its code.
        code: Code,
        /// The robot's own words.
        text: String,
    },
    /// The robot answered, and not with what its code promises.
    #[error("the robot's answer {text} cannot be read: {error}")]
    Unreadable {
        /// The message; empty when there is none.
        text: String,
        /// What is wrong with it.
        error: ValueError,
    },
    /// Something that the robot could not read as one argument: a name with a comma or a blank in it, a
    /// number that is none, a duration that is too long. Nothing was sent.
    #[error("not sent: {argument} cannot be `{value}`; {allowed}")]
    Argument {
        /// Which argument.
        argument: &'static str,
        /// What it was.
        value: String,
        /// What it may be.
        allowed: &'static str,
    },
    /// The checkpoint was discarded (3040): it will not be reached.
    #[error("the checkpoint was discarded: motion was cleared, or the robot stopped for an error")]
    Discarded,
    /// No answer within the limit; it may still come.
    #[error("no answer within the time limit")]
    TimedOut,
    /// The connection ended before.
    #[error("no answer: {0}")]
    Ended(EndReason),
}
