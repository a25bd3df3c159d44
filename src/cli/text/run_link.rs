//! The links of a run over TCP: sockets, and robots in this process.

use std::io::Write;
use std::net::SocketAddr;
use std::prelude::v1::*;
use std::thread;

use super::link_name::TcpOptions;
use crate::bus::text::client::{ClientSettings, SubmitError};
use crate::bus::text::{CONTROL_PORT, MONITORING_PORT};
use crate::cli::exit::Failure;
use crate::link::clock::MonotonicClock;
use crate::link::text::memory::MemoryConnection;
use crate::link::text::{
    AnswerError, Client, ClientOptions, ConnectError, Messages, Monitor, OwnedMessage, Port,
};
use crate::run::text::{Heard, TextLink};
use crate::sim::meca500::VirtualRobot;
use crate::time::{Duration, Instant};
use crate::wire::meca500::code::Code;
use crate::wire::meca500::revision::Revision;
use crate::wire::meca500::text::value::Greeting;

/// Time for a connection, and again for the robot's greeting.
const CONNECT_LIMIT: Duration = Duration::from_secs(10);
/// How long somebody else's control is waited for: a robot may need that to see that a client has vanished.
const CONTROL_LIMIT: Duration = Duration::from_secs(5);
/// Time for the first answer.
const ANSWER_LIMIT: Duration = Duration::from_secs(5);
/// Time between two attempts to connect.
const RETRY: Duration = Duration::from_millis(250);
/// Time for one attempt to connect to a robot that reboots.
const REBOOT_TRY: Duration = Duration::from_millis(500);
/// Messages that are taken in at once, so that a person who wants the end is seen to.
const AT_ONCE: usize = 4_096;

/// Feeds the watchdog; only the first one is answered, so nobody may wait for it.
const FEEDING: &str = "-ConnectionWatchdog(";

/// Where a robot's ports are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Ports {
    pub(super) control: SocketAddr,
    /// `None` where positions come over the control port.
    pub(super) monitor: Option<SocketAddr>,
}

/// A robot at its ports.
pub(super) struct SocketLink {
    ports: Ports,
    client: Client,
    messages: Messages,
    monitor: Option<Monitor>,
    clock: MonotonicClock,
    label: String,
    is_quiet: bool,
}

impl SocketLink {
    /// Connects to both ports; and the revision that the robot says it is.
    pub(super) fn open(
        ports: Ports,
        label: String,
        is_quiet: bool,
    ) -> Result<(Self, Option<Revision>), Failure> {
        let Ports { control, monitor } = ports;
        let clock = MonotonicClock::new();
        let options = options(CONNECT_LIMIT);
        let (client, greeted) = loop {
            match Client::connect_listening(control, options) {
                Ok(connected) => break connected,
                Err(ConnectError::Refused(Code::ANOTHER_USER))
                    if clock.now() - Instant::ZERO < CONTROL_LIMIT =>
                {
                    thread::sleep(RETRY);
                }
                Err(error) => return Err(refused(control, &error)),
            }
        };
        let answered = client.sync().and_then(|mut answer| answer.wait(ANSWER_LIMIT));
        if let Err(error) = answered {
            return Err(Failure::link(format!(
                "{control} greets as a robot and answers no command ({error}); is it the control port \
                 ({CONTROL_PORT}), not the monitoring port ({MONITORING_PORT})?"
            )));
        }
        // The greeting is there already: the connection waited for it.
        let greeting = greeted.wait_next(Duration::ZERO).ok().flatten();
        let revision = greeting.and_then(|message| Greeting::read(&message.as_message()).revision);
        let messages = client.messages();
        let monitor = monitor.map(|at| Monitor::connect(at, CONNECT_LIMIT)).transpose();
        let monitor = monitor.map_err(|error| Failure::link(format!("monitoring: {error}")))?;
        Ok((Self { ports, client, messages, monitor, clock, label, is_quiet }, revision))
    }

    pub(super) fn say(&self, text: &str) {
        if !self.is_quiet {
            // Nobody reads standard error any more: the run goes on.
            let _ = writeln!(std::io::stderr(), "{}{text}", self.label);
        }
    }

    /// What the monitoring connection has told; its end is worth a word and no more.
    fn take_monitored(&mut self, take: &mut dyn FnMut(Instant, Heard<'_>)) {
        let Some(monitor) = &self.monitor else { return };
        for _ in 0..AT_ONCE {
            match monitor.messages().wait_next(Duration::ZERO) {
                Ok(Some(message)) => {
                    take(self.clock.now(), Heard::Monitoring(message.as_message()));
                }
                Ok(None) => return,
                Err(reason) => {
                    self.monitor = None;
                    return self.say(&format!(
                        "the monitoring connection ended, positions are not followed from here on: \
                         {reason}"
                    ));
                }
            }
        }
    }
}

fn options(limit: Duration) -> ClientOptions {
    ClientOptions { settings: ClientSettings::default(), limit }
}

/// Why there is no control connection.
fn refused(control: SocketAddr, error: &ConnectError) -> Failure {
    Failure::link(match error {
        ConnectError::Refused(Code::ANOTHER_USER) => format!(
            "{control}: somebody else controls the robot ([3001]); end the other client, or take control \
             away from the web interface or the bus, and try again"
        ),
        ConnectError::Refused(Code::FIRMWARE_UPGRADE) => {
            format!("{control}: the robot's firmware is being upgraded ([3002]); try again later")
        }
        // They name the address.
        ConnectError::Socket { .. } | ConnectError::NoGreeting { .. } => error.to_string(),
        error => format!("{control}: {error}"),
    })
}

impl TextLink for SocketLink {
    type Error = String;

    fn now(&self) -> Instant {
        self.clock.now()
    }

    fn send(&mut self, command: &str) -> Result<bool, String> {
        let sent = if command.starts_with(FEEDING) {
            self.client.send_expecting(command, &[])
        } else {
            self.client.send(command)
        };
        match sent {
            Ok(answer) => {
                // The runner finds answers among all messages.
                drop(answer);
                Ok(true)
            }
            Err(AnswerError::Submit(SubmitError::Busy | SubmitError::OutboxFull)) => Ok(false),
            Err(AnswerError::Ended(reason)) => Err(reason.to_string()),
            Err(error) => Err(error.to_string()),
        }
    }

    fn receive(
        &mut self,
        until: Instant,
        take: &mut dyn FnMut(Instant, Heard<'_>),
    ) -> Result<(), String> {
        let mut tell = |clock: &MonotonicClock, message: &OwnedMessage| {
            take(clock.now(), Heard::Control(message.as_message()));
        };
        let mut limit = until - self.clock.now();
        for _ in 0..AT_ONCE {
            match self.messages.wait_next(limit) {
                Ok(Some(message)) => tell(&self.clock, &message),
                Ok(None) => break,
                Err(reason) => return Err(reason.to_string()),
            }
            limit = Duration::ZERO;
        }
        if self.messages.missed() > 0 {
            return Err("this computer was too busy to read what the robot said".into());
        }
        self.take_monitored(take);
        Ok(())
    }

    fn reconnect(&mut self) -> bool {
        match Client::connect(self.ports.control, options(REBOOT_TRY)) {
            Ok(client) => {
                self.messages = client.messages();
                self.client = client;
                self.monitor = None;
                match self.ports.monitor.map(|at| Monitor::connect(at, REBOOT_TRY)) {
                    None => {}
                    Some(Ok(monitor)) => self.monitor = Some(monitor),
                    Some(Err(error)) => self.say(&format!(
                        "positions are not followed after the reboot: monitoring: {error}"
                    )),
                }
                true
            }
            Err(_) => {
                thread::sleep(RETRY);
                false
            }
        }
    }
}

/// A virtual robot in this process.
pub(super) struct MemoryLink {
    connection: MemoryConnection<VirtualRobot>,
    /// Where time is real: when the run began.
    clock: Option<MonotonicClock>,
}

/// Longest step of a robot that lives in real time.
const REAL_STEP: Duration = Duration::from_millis(1);

impl MemoryLink {
    /// Connects to `robot`, in simulated time if it may be `fast`.
    pub(super) fn open(robot: VirtualRobot, fast: bool) -> Result<Self, Failure> {
        let mut connection = MemoryConnection::new(robot);
        connection.connect().map_err(|error| Failure::link(error.to_string()))?;
        Ok(Self { connection, clock: (!fast).then(MonotonicClock::new) })
    }
}

impl TextLink for MemoryLink {
    type Error = String;

    fn now(&self) -> Instant {
        self.connection.now()
    }

    fn send(&mut self, command: &str) -> Result<bool, String> {
        self.connection.send(command).map(|()| true).map_err(|reason| reason.to_string())
    }

    fn receive(
        &mut self,
        until: Instant,
        take: &mut dyn FnMut(Instant, Heard<'_>),
    ) -> Result<(), String> {
        let until = match &self.clock {
            None => until,
            Some(clock) => {
                let step = until.min(self.connection.now() + REAL_STEP);
                clock.sleep_until(step);
                step
            }
        };
        let received = self.connection.receive(until, &mut |at, port, message| {
            take(
                at,
                match port {
                    Port::Control => Heard::Control(message),
                    Port::Monitoring => Heard::Monitoring(message),
                },
            );
        });
        received.map_err(|reason| reason.to_string())
    }

    fn reconnect(&mut self) -> bool {
        self.connection.pass(RETRY);
        self.connection.connect().is_ok()
    }
}

/// Any of the links of a run over TCP.
pub(super) enum AnyLink {
    Sockets(Box<SocketLink>),
    Memory(Box<MemoryLink>),
}

impl TextLink for AnyLink {
    type Error = String;

    fn now(&self) -> Instant {
        match self {
            Self::Sockets(link) => link.now(),
            Self::Memory(link) => link.now(),
        }
    }

    fn send(&mut self, command: &str) -> Result<bool, String> {
        match self {
            Self::Sockets(link) => link.send(command),
            Self::Memory(link) => link.send(command),
        }
    }

    fn receive(
        &mut self,
        until: Instant,
        take: &mut dyn FnMut(Instant, Heard<'_>),
    ) -> Result<(), String> {
        match self {
            Self::Sockets(link) => link.receive(until, take),
            Self::Memory(link) => link.receive(until, take),
        }
    }

    fn reconnect(&mut self) -> bool {
        match self {
            Self::Sockets(link) => link.reconnect(),
            Self::Memory(link) => link.reconnect(),
        }
    }
}

/// Where the ports of the robot at `place` are.
pub(super) fn ports(
    hosts: &[super::link_name::Host],
    options: &TcpOptions,
    place: usize,
) -> Result<Option<Ports>, Failure> {
    let Some(host) = hosts.get(place) else { return Ok(None) };
    let monitor = options.monitors.get(place).map(super::link_name::Host::look_up).transpose()?;
    Ok(Some(Ports { control: host.look_up()?, monitor }))
}
