//! A virtual robot served by `fieldarm sim --tcp` among peers that mean no good: whoever controls it is
//! answered all the time, everybody else is told clearly, and the memory of the process stays bounded.
//!
//! What a session does with each kind of bytes is in `bus_text` and `link_text`; here it is the whole
//! process, as a person runs it.
#![cfg(all(feature = "cli", target_os = "linux"))]

mod cli_support;
#[path = "support/loopback.rs"]
mod loopback;
#[path = "support/message_line.rs"]
mod message_line;
#[path = "support/namespaces.rs"]
mod namespaces;
#[path = "support/serving.rs"]
mod serving;

use std::io::Write;
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use message_line::Line;
use namespaces::{Cable, End, INTERFACE, Running};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use socket2::SockRef;

/// Far longer than anything takes; what takes longer hangs.
const LONG: Duration = Duration::from_secs(60);
/// Connections held at once.
const HELD: usize = 2_000;
/// Monitoring connections that a robot takes.
const PLACES: usize = fieldarm::link::text::MONITORS;
/// What the process may grow by, in pages of 4 kB; every buffer of it is smaller.
const MOST_PAGES: u64 = 1_024;

/// A robot in a process of its own.
struct Robot {
    serving: Running,
    address: Ipv4Addr,
}

impl Robot {
    fn start() -> Self {
        let address = loopback::address();
        Self { serving: serving::serve(&["--tcp", &address.to_string()]), address }
    }

    fn control(&self) -> SocketAddr {
        SocketAddr::from((self.address, 10_000))
    }

    fn monitoring(&self) -> SocketAddr {
        SocketAddr::from((self.address, 10_001))
    }

    /// Pages of the process that are in memory.
    fn pages(&self) -> u64 {
        let text = std::fs::read_to_string(format!("/proc/{}/statm", self.serving.id())).unwrap();
        text.split_whitespace().nth(1).unwrap().parse().unwrap()
    }

    /// Ends it, and gives what it said.
    fn end(self) -> String {
        serving::end(self.serving)
    }
}

/// Somebody who controls the robot and asks it something all the time; every answer must be the right one.
struct Controller {
    answered: Arc<AtomicU64>,
    stop: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl Controller {
    fn start(robot: &Robot) -> Self {
        let mut line = Line::controlling(robot.control());
        let answered = Arc::new(AtomicU64::new(0));
        let stop = Arc::new(AtomicBool::new(false));
        let (counter, stopped) = (Arc::clone(&answered), Arc::clone(&stop));
        let thread = thread::spawn(move || {
            for number in 1.. {
                line.send(format!("-SyncCmdQueue({number})\0").as_bytes());
                assert_eq!(line.next(), Some(format!("[2097][{number}]")));
                counter.store(number, Ordering::Relaxed);
                if stopped.load(Ordering::Relaxed) {
                    return;
                }
                thread::sleep(Duration::from_millis(1));
            }
        });
        Self { answered, stop, thread }
    }

    /// Waits for a few more answers.
    fn is_still_answered(&self) {
        let wanted = self.answered.load(Ordering::Relaxed) + 5;
        let answered = (0..LONG.as_millis()).any(|_| {
            thread::sleep(Duration::from_millis(1));
            self.thread.is_finished() || self.answered.load(Ordering::Relaxed) >= wanted
        });
        assert!(answered && !self.thread.is_finished(), "the controller is not answered any more");
    }

    fn end(self) {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().expect("it was answered to the end");
    }
}

/// How many of `wanted` connections this process may hold at once.
fn may_hold(wanted: usize) -> usize {
    let needed = wanted as u64 + 100;
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    let most = maximum.unwrap_or(u64::MAX).min(needed);
    let current = current.unwrap_or(u64::MAX);
    if current < most {
        setrlimit(Resource::Nofile, Rlimit { current: Some(most), maximum }).unwrap();
    }
    let may = current.max(most).saturating_sub(100).min(wanted as u64);
    assert!(may >= 200, "this process may hold {may} connections at once");
    may as usize
}

#[test]
fn the_controller_is_answered_whoever_else_comes() {
    let robot = Robot::start();
    let controller = Controller::start(&robot);
    controller.is_still_answered();
    let pages = robot.pages();

    // A storm of connections that are gone at once: closed, reset, or with words nobody asked for.
    for round in 0..3_000 {
        let port = if round % 2 == 0 { robot.control() } else { robot.monitoring() };
        let mut stream = TcpStream::connect(port).unwrap();
        match round % 3 {
            0 => {}
            1 => SockRef::from(&stream).set_linger(Some(Duration::ZERO)).unwrap(),
            _ => drop(stream.write(b"DeactivateRobot\0")),
        }
        if round % 500 == 0 {
            controller.is_still_answered();
        }
    }

    // Thousands that stay: each is told why it cannot.
    let held = may_hold(HELD);
    let mut at_control: Vec<Line> = (0..held).map(|_| Line::open(robot.control())).collect();
    controller.is_still_answered();
    for line in &mut at_control {
        let told = line.next().expect("it is told why");
        assert_eq!(told, "[3001][Another user is already connected, closing connection.]");
        assert_eq!(line.next(), None);
    }
    drop(at_control);
    let mut at_monitoring: Vec<Line> = (0..held).map(|_| Line::open(robot.monitoring())).collect();
    controller.is_still_answered();
    let mut places = 0;
    for line in &mut at_monitoring {
        match line.next().expect("it is told something") {
            first if first.starts_with("[3000][Connected to Meca500") => places += 1,
            first => {
                let why = "[3001][Too many monitoring connections, closing connection.]";
                assert_eq!(first, why);
                assert_eq!(line.next(), None);
            }
        }
    }
    // Some of the storm may not have been found gone when the first of these came.
    assert!((1..=PLACES).contains(&places), "{places}");
    drop(at_monitoring);
    controller.is_still_answered();

    // Those who listen may say what they like, and as much as they like.
    let mut random = fastrand::Rng::with_seed(11);
    let noise: Vec<u8> = (0..1 << 20).map(|_| random.u8(..)).collect();
    for bytes in [noise, vec![0; 1 << 20], vec![b'A'; 1 << 20], b"RebootRobot\0".repeat(10_000)] {
        let mut line = Line::open(robot.monitoring());
        let mut writer = line.stream.try_clone().unwrap();
        let sender = thread::spawn(move || writer.write_all(&bytes).unwrap());
        while !sender.is_finished() {
            assert!(line.next().is_some_and(|message| message.starts_with('[')));
        }
        sender.join().unwrap();
        controller.is_still_answered();
    }

    let grown = robot.pages().saturating_sub(pages);
    assert!(grown < MOST_PAGES, "{grown} pages more");
    controller.end();
    let said = robot.end();
    assert!(said.contains(": there are too many"), "nobody was told");
}

#[test]
fn the_controller_itself_may_send_anything() {
    let robot = Robot::start();
    let mut line = Line::controlling(robot.control());
    line.send(b"SyncCmdQueue(1)\0");
    assert!(line.until_synced(1).is_empty());
    let pages = robot.pages();
    let mut random = fastrand::Rng::with_seed(12);
    let noise: Vec<u8> = (0..1 << 18).map(|_| random.u8(..)).collect();
    let endless = [b"LogTrace(".to_vec(), vec![b'x'; 4 << 20], b")\0".to_vec()].concat();
    let too_deep = [b"SetVariable(a,".to_vec(), vec![b'['; 4_000], b"\0".to_vec()].concat();
    type Judge = fn(&[String]);
    let acts: [(&str, Vec<u8>, Judge); 7] = [
        ("terminators", b"\0\r\n".repeat(1 << 20), |said| assert!(said.is_empty())),
        ("a line of megabytes", endless, |said| {
            assert_eq!(said, ["[3003][Command has reached the maximum length.]"]);
        }),
        ("noise", noise, |said| {
            assert!(said.iter().all(|one| one.starts_with("[1") || one.starts_with("[3003]")));
        }),
        ("bytes of no alphabet", b"\xFF\xFE\0".repeat(20_000), |said| {
            assert_eq!(said.len(), 20_000);
            assert!(said.iter().all(|one| one.starts_with("[1001][Empty command or")));
        }),
        ("requests without a pause", b"GetRtTargetJointPos\0".repeat(20_000), |said| {
            assert_eq!(said.len(), 20_000);
            assert!(said.iter().all(|one| one.starts_with("[2200][")));
        }),
        ("moves without a pause", b"MoveJoints(0,0,0,0,0,0)\n".repeat(20_000), |said| {
            assert_eq!(said.len(), 20_000);
            assert!(said.iter().all(|one| one.starts_with("[1005]")));
        }),
        ("brackets", too_deep.repeat(100), |said| assert_eq!(said.len(), 100)),
    ];
    for (number, (what, bytes, judge)) in (2_u32..).zip(acts) {
        let mut writer = line.stream.try_clone().unwrap();
        let sender = thread::spawn(move || {
            writer.write_all(&bytes)?;
            // Behind an end of line, whatever came before.
            writer.write_all(format!("\0SyncCmdQueue({number})\0").as_bytes())
        });
        let said = line.until_synced(number);
        println!("{what}: {} messages", said.len());
        judge(&said);
        sender.join().unwrap().expect("the connection is open");
    }
    let grown = robot.pages().saturating_sub(pages);
    assert!(grown < MOST_PAGES, "{grown} pages more");
    robot.end();
}

/// As above with a full queue: the robot's answers to what it cannot take, and its memory with 13,000
/// moves.
#[test]
fn a_full_queue_is_told_and_keeps_its_size() {
    let robot = Robot::start();
    let mut line = Line::controlling(robot.control());
    for (command, answer) in [("ActivateRobot\0", "[2000]"), ("Home\0", "[2002]")] {
        line.send(command.as_bytes());
        let answered = (0..100).any(|_| line.next().is_some_and(|said| said.starts_with(answer)));
        assert!(answered, "{command}");
    }
    line.send(b"PauseMotion\0SyncCmdQueue(1)\0");
    line.until_synced(1);
    let pages = robot.pages();
    for number in 2..6_u32 {
        let mut writer = line.stream.try_clone().unwrap();
        let sender = thread::spawn(move || {
            writer.write_all(&b"MoveJoints(1,0,0,0,0,0)\0".repeat(20_000))?;
            writer.write_all(format!("SyncCmdQueue({number})\0").as_bytes())
        });
        let said = line.until_synced(number);
        sender.join().unwrap().expect("the connection is open");
        let full = if number == 2 { 7_000 } else { 20_000 };
        assert_eq!(said.len(), full, "{:?}", said.first());
        assert!(said.iter().all(|one| one == "[1000][Command buffer is full.]"));
    }
    let grown = robot.pages().saturating_sub(pages);
    assert!(grown < MOST_PAGES, "{grown} pages more");
    robot.end();
}

/// The cable of a controller is pulled while the arm moves: no last words, no end of the connection. The
/// robot finds out by its keep-alive packets, stops, and lets somebody else take over.
#[test]
fn a_controller_that_vanished_is_found_out() {
    let Some(cable) = Cable::plug() else { return };
    for (end, address) in [(End::Robots, "10.217.3.1/24"), (End::Main, "10.217.3.2/24")] {
        let added =
            cable.command(end, "ip").args(["addr", "add", address, "dev", INTERFACE]).status();
        assert!(added.expect("ip starts").success());
    }
    // Whoever takes over is on the robot's side of the cable.
    cable.set_interface_up(End::Robots, "lo", true);
    let serving =
        serving::serve_by(&mut cable.fieldarm(End::Robots, &["sim", "--tcp", "10.217.3.1"]));
    let control: SocketAddr = "10.217.3.1:10000".parse().unwrap();

    let mut vanishing = cable.inside(End::Main, LONG, move || Line::open(control));
    assert!(vanishing.next().is_some_and(|first| first.starts_with("[3000][")));
    for (number, commands) in
        (1..).zip(["ActivateRobot\0Home\0", "SetJointVel(1)\0MoveJoints(90,0,0,0,0,0)\0"])
    {
        vanishing.send(commands.as_bytes());
        vanishing.send(format!("SetCheckpoint({number})\0").as_bytes());
        if number == 1 {
            let is_up = (0..100).any(|_| vanishing.next() == Some("[3030][1]".into()));
            assert!(is_up);
        }
    }
    vanishing.send(b"SyncCmdQueue(3)\0");
    vanishing.until_synced(3);
    cable.set_up(End::Main, false);

    let mut refusals = 0;
    let mut next = loop {
        let mut next = cable.inside(End::Robots, LONG, move || Line::open(control));
        let first = next.next().expect("it is told something");
        if first.starts_with("[3000][") {
            break next;
        }
        assert!(first.starts_with("[3001]["), "{first}");
        refusals += 1;
        assert!(refusals < 600, "nobody finds out that the controller is gone");
        thread::sleep(Duration::from_millis(50));
    };
    assert!(refusals > 0, "its connection ended, it did not vanish");
    next.send(b"GetStatusRobot\0SyncCmdQueue(4)\0");
    let said = next.until_synced(4);
    assert_eq!(said[0], "[3086][2]", "the robot stopped and wants a reset");
    assert!(said[1].starts_with("[2007][1,1,0,0,1,0,"), "{said:?}");
    next.send(b"ResumeMotion\0SyncCmdQueue(5)\0");
    assert!(next.until_synced(5)[0].starts_with("[2043]"));
    drop((vanishing, next));
    serving::end(serving);
}
