//! A connection to one of the two ports of a robot, byte by byte, as no client of ours makes it.

#![allow(dead_code, reason = "each test file uses a part of it")]

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// Far longer than any answer takes.
const PATIENCE: Duration = Duration::from_secs(60);

/// A connection to one of the ports, byte by byte.
pub(crate) struct Line {
    pub(crate) stream: TcpStream,
    heard: String,
}

impl Line {
    pub(crate) fn open(address: &str, port: u16) -> Self {
        let at = format!("{address}:{port}");
        let stream = TcpStream::connect(&at).unwrap_or_else(|error| panic!("{at}: {error}"));
        stream.set_read_timeout(Some(Duration::from_millis(50))).expect("not zero");
        Self { stream, heard: String::new() }
    }

    /// With the control of the robot.
    pub(crate) fn controlling(address: &str) -> Self {
        let mut line = Self::open(address, 10_000);
        line.expect("[3000][Connected to Meca500");
        line
    }

    /// `false` once the robot has closed the connection.
    fn hear(&mut self) -> bool {
        let mut room = [0; 4096];
        match self.stream.read(&mut room) {
            Ok(0) => false,
            Ok(count) => {
                self.heard.push_str(&String::from_utf8_lossy(&room[..count]));
                true
            }
            Err(error) => {
                assert!(matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut));
                true
            }
        }
    }

    /// Waits for `words` and forgets all up to them.
    pub(crate) fn expect(&mut self, words: &str) {
        let deadline = Instant::now() + PATIENCE;
        loop {
            if let Some(place) = self.heard.find(words) {
                self.heard.drain(..place + words.len());
                return;
            }
            let is_open = self.hear();
            // What a monitor hears in that time would fill a book.
            let beginning = self.heard.get(..1_000).unwrap_or(&self.heard);
            assert!(is_open || self.heard.contains(words), "closed, no {words}: {beginning}");
            assert!(Instant::now() < deadline, "no {words}: {beginning}");
        }
    }

    pub(crate) fn expect_end(&mut self) {
        let deadline = Instant::now() + PATIENCE;
        while self.hear() {
            assert!(Instant::now() < deadline, "still open: {}", self.heard);
        }
    }

    pub(crate) fn ask(&mut self, command: &str, answer: &str) {
        self.stream.write_all(format!("{command}\0").as_bytes()).expect("it is open");
        self.expect(answer);
    }
}
