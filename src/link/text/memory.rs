//! A robot and its control connection joined in memory, in simulated time.
//!
//! Read [`MemoryConnection::receive`] first. Time only passes while messages are waited for, in steps of
//! [`STEP`]; what both ends say takes [`latency`](MemoryConnection::latency) on its way. The robot's end
//! is the same session that serves sockets.

use std::boxed::Box;
use std::collections::VecDeque;
use std::string::String;

use super::error::{ConnectError, EndReason, Port};
use super::message::OwnedMessage;
use super::server::STEP;
use crate::bus::text::server::{Peer, ServerSession};
use crate::bus::text::{Line, LineSplitter, MAX_COMMAND, MAX_MESSAGE, OUTBOX};
use crate::text_device::TextDevice;
use crate::time::{Duration, Instant};
use crate::wire::meca500::code::Code;
use crate::wire::meca500::text::Message;

/// Who gets the messages of [`MemoryConnection::receive`]: when they came, and in at which port.
pub type TakeMessage<'a> = &'a mut dyn FnMut(Instant, Port, Message<'_>);

/// The only monitoring connection.
const MONITOR: Peer = Peer::Monitor(0);

/// A message on its way.
#[derive(Debug)]
struct OnTheWay {
    arrives: Instant,
    port: Port,
    message: OwnedMessage,
}

/// A robot that is controlled in memory.
#[derive(Debug)]
pub struct MemoryConnection<D> {
    /// How long a line or a message is on its way.
    pub latency: Duration,
    session: Box<ServerSession<1, MAX_COMMAND, OUTBOX>>,
    splitters: Box<[LineSplitter<MAX_MESSAGE>; 2]>,
    device: D,
    now: Instant,
    lines: VecDeque<(Instant, String)>,
    messages: VecDeque<OnTheWay>,
    ended: Option<EndReason>,
}

impl<D: TextDevice> MemoryConnection<D> {
    /// Not connected yet.
    #[must_use]
    pub fn new(device: D) -> Self {
        Self {
            latency: Duration::ZERO,
            session: Box::new(ServerSession::new()),
            splitters: Box::new([LineSplitter::new(), LineSplitter::new()]),
            device,
            now: Instant::ZERO,
            lines: VecDeque::new(),
            messages: VecDeque::new(),
            ended: Some(EndReason::Closed),
        }
    }

    /// Opens the control connection.
    ///
    /// # Errors
    ///
    /// Somebody else has the control of the robot, or it is not there.
    pub fn connect(&mut self) -> Result<(), ConnectError> {
        if !self.session.accept_control(self.now, &mut self.device) {
            return Err(ConnectError::Refused(Code::ANOTHER_USER));
        }
        self.lines.clear();
        self.messages.clear();
        self.splitters.iter_mut().for_each(LineSplitter::restart);
        self.ended = None;
        Ok(())
    }

    /// Opens a monitoring connection beside it. Whether the robot let it in.
    pub fn monitor(&mut self) -> bool {
        self.session.accept_monitor(self.now, &mut self.device).is_some()
    }

    /// Cuts the control connection, as a cable that is pulled: what is on its way is lost.
    pub fn cut(&mut self) {
        self.lines.clear();
        self.messages.clear();
        self.end(EndReason::Broken(std::io::ErrorKind::ConnectionReset));
    }

    fn end(&mut self, reason: EndReason) {
        if self.ended.is_none() {
            self.ended = Some(reason);
            self.session.closed(self.now, &mut self.device, Peer::Control);
        }
    }

    /// The simulated time.
    #[must_use]
    pub const fn now(&self) -> Instant {
        self.now
    }

    /// The robot.
    pub const fn device(&self) -> &D {
        &self.device
    }

    /// The robot, to be acted upon as a person beside it would.
    pub const fn device_mut(&mut self) -> &mut D {
        &mut self.device
    }

    /// Sends a command, without terminator.
    ///
    /// # Errors
    ///
    /// The connection has ended.
    pub fn send(&mut self, command: &str) -> Result<(), EndReason> {
        if let Some(reason) = self.ended {
            return Err(reason);
        }
        self.lines.push_back((self.now + self.latency, command.into()));
        Ok(())
    }

    /// Lets time pass until messages arrive, until `until` at most, and hands them over.
    ///
    /// # Errors
    ///
    /// The connection has ended, and every message before that was handed over.
    pub fn receive(&mut self, until: Instant, take: TakeMessage<'_>) -> Result<(), EndReason> {
        loop {
            self.serve();
            if self.deliver(take) {
                return Ok(());
            }
            if let Some(reason) = self.ended
                && self.messages.is_empty()
            {
                return Err(reason);
            }
            if self.now >= until {
                return Ok(());
            }
            self.now = (self.now + STEP).min(until);
        }
    }

    /// Lets time pass, whoever is connected.
    pub fn pass(&mut self, duration: Duration) {
        let until = self.now + duration;
        while self.now < until {
            self.now = (self.now + STEP).min(until);
            self.serve();
        }
    }

    /// The robot reads what has arrived and lives until now.
    fn serve(&mut self) {
        self.session.advance(self.now, &mut self.device);
        while let Some((arrives, _)) = self.lines.front()
            && *arrives <= self.now
            && let Some((_, line)) = self.lines.pop_front()
        {
            for bytes in [line.as_bytes(), b"\0"] {
                self.session.receive(self.now, &mut self.device, Peer::Control, bytes);
            }
            self.collect();
        }
        self.collect();
        if let Some((peer, _)) = self.session.next_to_close() {
            self.session.closed(self.now, &mut self.device, peer);
            if peer == Peer::Control && self.ended.is_none() {
                self.ended = Some(EndReason::ByRobot);
            }
        }
    }

    /// What the robot has said is on its way from now on.
    fn collect(&mut self) {
        let arrives = self.now + self.latency;
        for (port, splitter) in
            [Port::Control, Port::Monitoring].into_iter().zip(&mut *self.splitters)
        {
            let peer = if port == Port::Control { Peer::Control } else { MONITOR };
            let mut bytes = self.session.waiting(peer);
            let count = bytes.len();
            while let Some(line) = splitter.next_line(&mut bytes) {
                if let Line::Text(text) = line
                    && let Ok(message) = Message::parse(text)
                {
                    self.messages.push_back(OnTheWay { arrives, port, message: message.into() });
                }
            }
            self.session.sent(peer, count);
        }
    }

    fn deliver(&mut self, take: TakeMessage<'_>) -> bool {
        let mut is_any = false;
        while let Some(first) = self.messages.front()
            && first.arrives <= self.now
            && let Some(OnTheWay { arrives, port, message }) = self.messages.pop_front()
        {
            take(arrives, port, message.as_message());
            is_any = true;
        }
        is_any
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::fmt::Write;
    use std::vec;
    use std::vec::Vec;

    /// Answers every line with itself as a text, and greets.
    #[derive(Debug, Default)]
    struct Echo {
        said: Vec<String>,
        is_controlled: bool,
        drops: bool,
    }

    impl TextDevice for Echo {
        fn open_control(&mut self, _: Instant) -> bool {
            self.said = vec!["[3000][hello]".into()];
            !core::mem::replace(&mut self.is_controlled, true)
        }
        fn close_control(&mut self, _: Instant) {
            (self.is_controlled, self.drops) = (false, false);
        }
        fn command(&mut self, _: Instant, line: &str) {
            self.drops = line == "leave";
            self.said.push(std::format!("[2085][{line}]"));
        }
        fn reject(&mut self, _: Instant, _: crate::text_device::LineProblem) {}
        fn next_control_message(&mut self, into: &mut dyn Write) -> bool {
            !self.said.is_empty() && into.write_str(&self.said.remove(0)).is_ok()
        }
        fn monitoring_snapshot(&mut self, _: Instant, _: &mut dyn FnMut(&str)) {}
        fn next_monitoring_message(&mut self, _: &mut dyn Write) -> bool {
            false
        }
        fn advance(&mut self, _: Instant) {}
        fn is_on_text(&self) -> bool {
            true
        }
        fn drops_control(&self) -> bool {
            self.drops
        }
    }

    fn heard(
        connection: &mut MemoryConnection<Echo>,
        until: u64,
    ) -> Result<Vec<(u64, String)>, EndReason> {
        let mut heard = Vec::new();
        let until = Instant::from_millis(until);
        connection.receive(until, &mut |at, _, message| {
            heard.push((at.as_nanos() / 1_000_000, message.body.into()));
        })?;
        Ok(heard)
    }

    #[test]
    fn what_is_said_takes_its_time_and_comes_in_order() {
        let mut connection = MemoryConnection::new(Echo::default());
        connection.latency = Duration::from_millis(3);
        assert_eq!(connection.send("early"), Err(EndReason::Closed));
        connection.connect().unwrap();
        assert_eq!(heard(&mut connection, 100), Ok(vec![(3, "hello".into())]));
        connection.send("a").unwrap();
        connection.send("b").unwrap();
        assert_eq!(heard(&mut connection, 100), Ok(vec![(9, "a".into()), (9, "b".into())]));
        assert_eq!(heard(&mut connection, 20), Ok(vec![]));
        assert_eq!(connection.now(), Instant::from_millis(20));
    }

    #[test]
    fn a_connection_that_ends_tells_what_came_before() {
        let mut connection = MemoryConnection::new(Echo::default());
        connection.connect().unwrap();
        heard(&mut connection, 1).unwrap();
        connection.send("leave").unwrap();
        assert_eq!(heard(&mut connection, 9), Ok(vec![(0, "leave".into())]));
        assert_eq!(heard(&mut connection, 9), Err(EndReason::ByRobot));
        connection.connect().unwrap();
        connection.send("lost").unwrap();
        connection.cut();
        let broken = EndReason::Broken(std::io::ErrorKind::ConnectionReset);
        assert_eq!(heard(&mut connection, 99), Err(broken));
        assert!(!connection.device().is_controlled);
    }
}
