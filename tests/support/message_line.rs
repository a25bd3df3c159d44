//! A connection to one of the two ports of a robot, message by message. `text_line.rs` looks for words
//! instead.

#![allow(dead_code, reason = "each test file uses a part of it")]

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

/// Far longer than anything takes; what takes longer hangs.
const PATIENCE: Duration = Duration::from_secs(120);

pub(crate) struct Line {
    pub(crate) stream: TcpStream,
    held: Vec<u8>,
    taken: usize,
}

impl Line {
    pub(crate) fn over(stream: TcpStream) -> Self {
        stream.set_read_timeout(Some(PATIENCE)).expect("not zero");
        stream.set_write_timeout(Some(PATIENCE)).expect("not zero");
        stream.set_nodelay(true).expect("a socket of TCP");
        Self { stream, held: Vec::new(), taken: 0 }
    }

    pub(crate) fn open(address: SocketAddr) -> Self {
        let stream = TcpStream::connect(address);
        Self::over(stream.unwrap_or_else(|error| panic!("{address}: {error}")))
    }

    /// With the control of the robot.
    pub(crate) fn controlling(control: SocketAddr) -> Self {
        let mut line = Self::open(control);
        assert!(line.next().is_some_and(|first| first.starts_with("[3000][")));
        line
    }

    /// The next message; `None` at the end of the connection, whatever began before it.
    pub(crate) fn next(&mut self) -> Option<String> {
        let mut room = [0; 65_536];
        loop {
            let rest = &self.held[self.taken..];
            if let Some(end) = rest.iter().position(|byte| *byte == 0) {
                let message = String::from_utf8(rest[..end].to_vec()).expect("ASCII");
                self.taken += end + 1;
                return Some(message);
            }
            self.held.drain(..self.taken);
            self.taken = 0;
            match self.stream.read(&mut room) {
                Ok(0) => return None,
                Ok(count) => self.held.extend_from_slice(&room[..count]),
                Err(error) if error.kind() == ErrorKind::ConnectionReset => return None,
                Err(error) => panic!("nothing comes: {error}"),
            }
        }
    }

    pub(crate) fn send(&mut self, bytes: &[u8]) {
        self.stream.write_all(bytes).expect("the connection is open");
    }

    pub(crate) fn say(&mut self, command: &str) {
        self.send(format!("{command}\0").as_bytes());
    }

    /// Sends a command and passes over everything until a message with this beginning.
    pub(crate) fn ask(&mut self, command: &str, beginning: &str) {
        self.say(command);
        let answered = (0..100_000).any(|_| {
            let message = self.next().unwrap_or_else(|| panic!("closed after {command}"));
            message.starts_with(beginning)
        });
        assert!(answered, "{command}: no {beginning}");
    }

    /// Everything up to the answer to SyncCmdQueue with this number.
    pub(crate) fn until_synced(&mut self, number: u32) -> Vec<String> {
        let end = format!("[2097][{number}]");
        let mut messages = Vec::new();
        loop {
            let message = self.next().expect("the connection stays open");
            if message == end {
                return messages;
            }
            messages.push(message);
        }
    }
}
