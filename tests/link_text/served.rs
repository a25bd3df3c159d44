//! A scripted robot served by a thread, and a plain socket to talk to it.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::text_support::ScriptedDevice;
use fieldarm::link::text::{Endpoints, PortCounts, ServerEvent, TextServer};

/// Longer than anything here takes; what takes longer hangs.
pub(crate) const LONG: Duration = Duration::from_secs(20);

type Change = Box<dyn FnOnce(&mut TextServer<ScriptedDevice>) + Send>;

pub(crate) struct Served {
    pub(crate) endpoints: Endpoints,
    changes: mpsc::Sender<Change>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Served {
    pub(crate) fn start(device: ScriptedDevice) -> Self {
        let endpoints = Endpoints {
            control: "127.0.0.1:0".parse().unwrap(),
            monitoring: "127.0.0.1:0".parse().unwrap(),
        };
        let mut server = TextServer::bind(device, endpoints).unwrap();
        let endpoints = server.endpoints();
        let (changes, todo) = mpsc::channel::<Change>();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            while !stopped.load(Ordering::Relaxed) {
                server.step().unwrap();
                while let Ok(change) = todo.try_recv() {
                    change(&mut server);
                }
            }
        });
        Self { endpoints, changes, stop, thread: Some(thread) }
    }

    /// Does something with the server between two steps.
    pub(crate) fn with<R: Send + 'static>(
        &self,
        change: impl FnOnce(&mut TextServer<ScriptedDevice>) -> R + Send + 'static,
    ) -> R {
        let (sender, answer) = mpsc::channel();
        let change: Change = Box::new(move |server| {
            let _ = sender.send(change(server));
        });
        self.changes.send(change).unwrap();
        answer.recv_timeout(LONG).expect("the server does not step")
    }

    pub(crate) fn counts(&self) -> PortCounts {
        self.with(|server| server.counts())
    }

    pub(crate) fn commands(&self) -> Vec<String> {
        self.with(|server| server.device().commands().into_iter().map(str::to_owned).collect())
    }

    /// Waits until an event comes that is wanted.
    pub(crate) fn wait_for_event(&self, is_it: impl Fn(&ServerEvent) -> bool) -> ServerEvent {
        for _ in 0..20_000 {
            match self.with(TextServer::next_event) {
                Some(event) if is_it(&event) => return event,
                Some(_) => {}
                None => std::thread::sleep(Duration::from_millis(1)),
            }
        }
        panic!("the event does not come");
    }

    pub(crate) fn control(&self) -> Line {
        let mut line = Line::connect(self.endpoints.control);
        assert_eq!(line.next(), "[3000][Connected to Meca500 R3 v11.3.84]");
        line
    }

    pub(crate) fn monitor(&self) -> Line {
        Line::connect(self.endpoints.monitoring)
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let ended = self.thread.take().map(JoinHandle::join);
        if !std::thread::panicking() {
            assert!(matches!(ended, Some(Ok(()))), "the server's thread panicked");
        }
    }
}

/// A plain connection.
pub(crate) struct Line {
    pub(crate) stream: TcpStream,
    held: Vec<u8>,
}

impl Line {
    pub(crate) fn connect(address: SocketAddr) -> Self {
        Self::over(TcpStream::connect(address).unwrap())
    }

    pub(crate) fn over(stream: TcpStream) -> Self {
        stream.set_read_timeout(Some(LONG)).unwrap();
        stream.set_write_timeout(Some(LONG)).unwrap();
        stream.set_nodelay(true).unwrap();
        Self { stream, held: Vec::new() }
    }

    pub(crate) fn send(&mut self, bytes: &[u8]) {
        self.stream.write_all(bytes).unwrap();
    }

    /// The next message; `None` when the connection is closed.
    pub(crate) fn try_next(&mut self) -> Option<String> {
        let mut room = [0; 4096];
        loop {
            if let Some(end) = self.held.iter().position(|byte| *byte == 0) {
                let message: Vec<u8> = self.held.drain(..=end).collect();
                return Some(String::from_utf8(message[..end].to_vec()).unwrap());
            }
            match self.stream.read(&mut room) {
                Ok(0) => {
                    assert!(self.held.is_empty(), "a torn message: {:?}", self.held);
                    return None;
                }
                Ok(count) => self.held.extend_from_slice(&room[..count]),
                Err(error) if error.kind() == ErrorKind::ConnectionReset => return None,
                Err(error) => panic!("nothing comes: {error}"),
            }
        }
    }

    pub(crate) fn next(&mut self) -> String {
        self.try_next().expect("the connection is closed")
    }
}
