//! An Ethernet segment for one test: two network namespaces joined by a cable (a veth pair), made
//! at its beginning and removed at its end, and processes that live inside. The cable may be cut in
//! two with a namespace between, for a test that passes the frames on itself.
//!
//! Read [`Cable::plug`] first. Needs root and the command `ip`; without them a test says so and
//! passes, but never in CI.

#![allow(dead_code, unreachable_pub, reason = "each test binary uses a part of it")]

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::os::fd::AsFd;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use rustix::thread::{LinkNameSpaceType, move_into_link_name_space};

/// The interface at either end of the cable.
pub const INTERFACE: &str = "ecat0";
/// The interface between the two halves of a cable, towards the main device.
pub const TO_MAIN: &str = "to-main";
/// The interface between the two halves of a cable, towards the robots.
pub const TO_ROBOTS: &str = "to-robots";

/// Whose frames have to be in time has the cores for itself.
static CORES: RwLock<()> = RwLock::new(());
static CABLES: AtomicU32 = AtomicU32::new(0);

/// One end of the cable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Where the main device sits.
    Main,
    /// Where the robots sit.
    Robots,
    /// Between the two halves of a cable that was cut in two.
    Between,
}

/// How a test has the cores while its cable is there.
#[allow(dead_code, reason = "held, not read")]
enum Turn {
    Shared(RwLockReadGuard<'static, ()>),
    Alone(RwLockWriteGuard<'static, ()>),
}

impl Turn {
    fn shared() -> Self {
        Self::Shared(CORES.read().unwrap_or_else(PoisonError::into_inner))
    }

    fn alone() -> Self {
        Self::Alone(CORES.write().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Two namespaces and the cable between them.
pub struct Cable {
    main: String,
    robots: String,
    /// Where a cable in two halves has a third one.
    between: String,
    _turn: Turn,
}

impl Cable {
    /// A new cable, both ends up; `None` where it cannot be had, which the test has been told then.
    pub fn plug() -> Option<Self> {
        let cable = Self::prepare(Turn::shared)?;
        cable.plug_another(INTERFACE);
        Some(cable)
    }

    /// A new cable in two halves, all their ends up, as [`Cable::plug`]: nothing passes from
    /// [`TO_MAIN`] to [`TO_ROBOTS`] but what the test passes on. No other test has a cable meanwhile.
    pub fn plug_in_two() -> Option<Self> {
        let cable = Self::prepare(Turn::alone)?;
        cable.join((End::Main, INTERFACE), (End::Between, TO_MAIN));
        cable.join((End::Between, TO_ROBOTS), (End::Robots, INTERFACE));
        Some(cable)
    }

    /// Namespaces without a cable.
    fn prepare(turn: impl FnOnce() -> Turn) -> Option<Self> {
        if !rustix::process::geteuid().is_root() {
            return skip("needs root (network namespaces)");
        }
        if Command::new("ip").arg("-V").output().is_err() {
            return skip("needs the command `ip` (package iproute2)");
        }
        let turn = turn();
        let number = CABLES.fetch_add(1, Ordering::Relaxed);
        let name = |end: &str| format!("fieldarm-{}-{number}-{end}", std::process::id());
        let (main, robots, between) = (name("main"), name("robots"), name("between"));
        let cable = Self { main, robots, between, _turn: turn };
        for namespace in cable.namespaces() {
            let added = Command::new("ip").args(["netns", "add", namespace]).output();
            let added = added.expect("ip starts");
            if !added.status.success() {
                let said = String::from_utf8_lossy(&added.stderr).trim().to_owned();
                return skip(&format!("no network namespace can be made here: {said}"));
            }
        }
        Some(cable)
    }

    /// A second cable beside the first, with another name for its interfaces.
    pub fn plug_another(&self, interface: &str) {
        self.join((End::Main, interface), (End::Robots, interface));
    }

    /// A pair of interfaces, both up.
    fn join(&self, one: (End, &str), other: (End, &str)) {
        let [(name, namespace), (peer, peer_namespace)] =
            [one, other].map(|(end, interface)| (interface, self.namespace(end)));
        let pair = ["link", "add", name, "netns", namespace, "type", "veth"];
        ip(&[&pair[..], &["peer", "name", peer, "netns", peer_namespace]].concat());
        for (end, interface) in [one, other] {
            self.set_interface_up(end, interface, true);
        }
    }

    /// Takes the interface at `end` down, or up again.
    pub fn set_up(&self, end: End, up: bool) {
        self.set_interface_up(end, INTERFACE, up);
    }

    /// Takes one of the interfaces at `end` down, or up again.
    pub fn set_interface_up(&self, end: End, interface: &str, up: bool) {
        let state = if up { "up" } else { "down" };
        ip(&["-n", self.namespace(end), "link", "set", interface, state]);
    }

    /// Removes the cable for good.
    pub fn cut(&self) {
        ip(&["-n", &self.main, "link", "delete", INTERFACE]);
    }

    fn namespace(&self, end: End) -> &str {
        match end {
            End::Main => &self.main,
            End::Robots => &self.robots,
            End::Between => &self.between,
        }
    }

    fn namespaces(&self) -> [&String; 3] {
        [&self.main, &self.robots, &self.between]
    }

    /// A command that will run at `end`.
    pub fn command(&self, end: End, program: &str) -> Command {
        let mut command = Command::new("ip");
        command.args(["netns", "exec", self.namespace(end), program]);
        command.current_dir(env!("CARGO_MANIFEST_DIR"));
        command
    }

    /// The command `fieldarm` at `end`.
    pub fn fieldarm(&self, end: End, arguments: &[&str]) -> Command {
        let mut command = self.command(end, env!("CARGO_BIN_EXE_fieldarm"));
        command.args(arguments);
        command
    }

    /// Does `work` on a thread that lives at `end`: sockets opened there are of that end for ever.
    /// A thread that is not done `within` that time fails the test.
    pub fn inside<T: Send + 'static>(
        &self,
        end: End,
        within: Duration,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> T {
        let namespace = File::open(format!("/var/run/netns/{}", self.namespace(end)));
        let namespace = namespace.expect("the namespace is there");
        let (done, result) = mpsc::channel();
        let worker = thread::spawn(move || {
            move_into_link_name_space(namespace.as_fd(), Some(LinkNameSpaceType::Network))
                .expect("root may enter a namespace");
            let _ = done.send(work());
        });
        match result.recv_timeout(within) {
            Ok(result) => {
                worker.join().expect("it has sent its result");
                result
            }
            Err(mpsc::RecvTimeoutError::Timeout) => panic!("still at work after {within:?}"),
            Err(mpsc::RecvTimeoutError::Disconnected) => match worker.join() {
                Ok(()) => panic!("it ended without a result"),
                Err(panic) => std::panic::resume_unwind(panic),
            },
        }
    }
}

impl Drop for Cable {
    fn drop(&mut self) {
        for namespace in self.namespaces() {
            // One that was not made cannot be removed.
            let _ = Command::new("ip").args(["netns", "delete", namespace]).output();
        }
    }
}

fn ip(arguments: &[&str]) {
    let done = Command::new("ip").args(arguments).output().expect("ip starts");
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "ip {}: {said}", arguments.join(" "));
}

/// Tells why a test does not run; in CI as root, where everything is there, that is a failure.
pub fn skip<T>(reason: &str) -> Option<T> {
    let in_ci = std::env::var_os("CI").is_some_and(|value| !value.is_empty());
    assert!(!(in_ci && rustix::process::geteuid().is_root()), "nothing is skipped in CI: {reason}");
    println!("skipped: {reason}");
    None
}

/// A process of a test; it ends with the test at the latest.
pub struct Running {
    child: Child,
    said: Arc<Mutex<String>>,
    readers: Vec<thread::JoinHandle<()>>,
}

impl Running {
    pub fn start(command: &mut Command) -> Self {
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the command starts");
        let said = Arc::new(Mutex::new(String::new()));
        let mut readers = vec![listen(child.stdout.take().expect("piped"), &said)];
        readers.push(listen(child.stderr.take().expect("piped"), &said));
        Self { child, said, readers }
    }

    /// Its process id.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// What it said so far, on standard output and standard error.
    pub fn said(&self) -> String {
        self.said.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Waits until it has said `text`; fails when it has not `within` that time, or has ended.
    pub fn wait_for(&mut self, text: &str, within: Duration) {
        let deadline = Instant::now() + within;
        while !self.said().contains(text) {
            let ended = self.child.try_wait().expect("it is our child");
            let said = self.said();
            assert!(ended.is_none() || said.contains(text), "ended before `{text}`:\n{said}");
            assert!(Instant::now() < deadline, "no `{text}` after {within:?}:\n{said}");
            thread::sleep(Duration::from_millis(5));
        }
    }

    /// Sends it a signal, by its process id.
    pub fn signal(&self, signal: &str) {
        let id = self.child.id().to_string();
        let killed = Command::new("kill").args([signal, &id]).status().expect("kill starts");
        assert!(killed.success());
    }

    /// Waits for its end and returns how it ended and all it said; fails when it runs on.
    pub fn end(mut self, within: Duration) -> (ExitStatus, String) {
        let deadline = Instant::now() + within;
        let status = loop {
            if let Some(status) = self.child.try_wait().expect("it is our child") {
                break status;
            }
            assert!(Instant::now() < deadline, "still there after {within:?}:\n{}", self.said());
            thread::sleep(Duration::from_millis(5));
        };
        for reader in self.readers.drain(..) {
            reader.join().expect("a reader only reads");
        }
        (status, self.said())
    }

    /// Ends it as Ctrl-C does.
    pub fn interrupt(self, within: Duration) -> (ExitStatus, String) {
        self.signal("-INT");
        self.end(within)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn listen(stream: impl Read + Send + 'static, said: &Arc<Mutex<String>>) -> thread::JoinHandle<()> {
    let said = Arc::clone(said);
    thread::spawn(move || {
        let mut lines = BufReader::new(stream);
        let mut line = Vec::new();
        while lines.read_until(b'\n', &mut line).is_ok_and(|read| read > 0) {
            let text = String::from_utf8_lossy(&line).into_owned();
            said.lock().unwrap_or_else(PoisonError::into_inner).push_str(&text);
            line.clear();
        }
    })
}
