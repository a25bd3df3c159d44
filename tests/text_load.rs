//! One virtual robot at its TCP ports under load: 250 commands a second, three monitoring connections
//! that are told everything every 2 ms, and a fourth one that hardly reads.
//!
//! In release for a minute, as CI runs it; in debug for a few seconds. The clock only says when commands
//! are sent; judged are their number, their answers, and every single message: nothing is lost, torn,
//! doubled or out of order, the three hear the same, the slow one loses its own connection only, and
//! the memory of the process does not grow.
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

use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::{ErrorKind, Read, Write};
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use message_line::Line;
use socket2::{Domain, Socket, Type};

const SECONDS: u32 = if cfg!(debug_assertions) { 4 } else { 60 };
const COMMANDS_PER_SECOND: u32 = 250;
const COMMANDS: u32 = SECONDS * COMMANDS_PER_SECOND;
/// One in ten commands.
const CHECKPOINTS: u32 = COMMANDS / 10;
const MONITORS: usize = 3;
/// Microseconds between two monitoring cycles.
const INTERVAL_US: u64 = 2_000;
/// Far longer than anything takes; what takes longer hangs.
const LONG: Duration = Duration::from_secs(120);
/// What the process may grow by while it serves, in pages of 4 kB.
const MOST_PAGES: u64 = 1_024;
/// Time scalings that mark the beginning and the end for everybody who listens.
const BEGIN: &str = "[2015][99.5]";
const END: &str = "[2015][98.5]";

/// The messages of one monitoring cycle with everything asked for, in their order, and how many values
/// each has; the configuration is told when it changes only.
const CYCLE: [(u16, usize); 18] = [
    (2026, 6),
    (2027, 6),
    (2200, 7),
    (2201, 7),
    (2202, 7),
    (2203, 7),
    (2204, 7),
    (2210, 7),
    (2211, 7),
    (2212, 7),
    (2213, 7),
    (2214, 7),
    (2220, 5),
    (2228, 7),
    (2229, 7),
    (2321, 2),
    (2322, 2),
    (2230, 1),
];
/// What may stand within a cycle too.
const ON_CHANGE: [u16; 2] = [2218, 2219];

/// Code and content of a message; fails unless it is whole.
#[track_caller]
fn parts(message: &str) -> (u16, &str) {
    let inner = message.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
    let found = inner.and_then(|inner| inner.split_once("]["));
    let (code, content) = found.unwrap_or_else(|| panic!("no message: {message:?}"));
    assert_eq!(code.len(), 4, "{message:?}");
    assert!(content.bytes().all(|byte| matches!(byte, b' '..=b'~')), "{message:?}");
    (code.parse().unwrap_or_else(|_| panic!("no code: {message:?}")), content)
}

#[track_caller]
fn numbers(content: &str) -> Vec<f64> {
    content.split(',').map(|value| value.parse().unwrap_or_else(|_| panic!("{content}"))).collect()
}

/// What one monitoring connection heard between the two marks.
#[derive(Clone, Debug, Default, PartialEq)]
struct Heard {
    messages: u64,
    cycles: u64,
    first_us: u64,
    last_us: u64,
    checkpoints: u32,
    /// Of all messages in their order.
    hash: u64,
}

/// Judges the messages of a monitoring connection one after the other.
#[derive(Default)]
struct Judge {
    heard: Heard,
    is_on: bool,
    /// How much of the cycle has come.
    place: usize,
    /// Time of the cycle before, if it was whole.
    last_us: Option<u64>,
    /// Times within the cycle.
    cycle_us: Option<u64>,
    next_checkpoint: u32,
    hasher: DefaultHasher,
}

impl Judge {
    /// `false` behind the end.
    fn take(&mut self, message: &str) -> bool {
        let (code, content) = parts(message);
        match CYCLE.iter().position(|(of_cycle, _)| *of_cycle == code) {
            Some(place) => self.take_of_cycle(place, code, content),
            None if self.place == 0 || ON_CHANGE.contains(&code) => {}
            None => panic!("within a cycle: {message}"),
        }
        if code == 3030 && self.is_on {
            assert_eq!(content, (self.next_checkpoint % 8_000 + 1).to_string(), "checkpoints");
            self.next_checkpoint += 1;
            self.heard.checkpoints += 1;
        }
        if message == BEGIN {
            self.is_on = true;
        }
        if self.is_on {
            self.heard.messages += 1;
            message.hash(&mut self.hasher);
        }
        message != END
    }

    fn take_of_cycle(&mut self, place: usize, code: u16, content: &str) {
        // The first cycle may have begun before the connection did, and with fewer messages.
        if !self.is_on && place != self.place {
            self.place = if code == 2230 { 0 } else { place + 1 };
            self.last_us = None;
            return;
        }
        assert_eq!(place, self.place, "[{code}][{content}] is not what comes next in a cycle");
        let values = numbers(content);
        assert_eq!(values.len(), CYCLE[place].1, "[{code}][{content}]");
        if CYCLE[place].0 >= 2200 {
            let time = values[0] as u64;
            assert_eq!(*self.cycle_us.get_or_insert(time), time, "[{code}][{content}]");
        }
        self.place += 1;
        if self.place < CYCLE.len() {
            return;
        }
        self.place = 0;
        let time = self.cycle_us.take().expect("the mark of the end has one");
        if self.is_on {
            if let Some(before) = self.last_us {
                assert_eq!(
                    time - before,
                    INTERVAL_US,
                    "a cycle is missing or doubled at {time} us"
                );
            }
            if self.heard.cycles == 0 {
                self.heard.first_us = time;
            }
            self.heard.cycles += 1;
            self.heard.last_us = time;
        }
        self.last_us = Some(time);
    }

    fn verdict(self) -> Heard {
        Heard { hash: self.hasher.finish(), ..self.heard }
    }
}

/// Listens until the end mark.
fn listen(mut line: Line) -> Heard {
    let mut judge = Judge::default();
    loop {
        let message = line.next().expect("a connection that reads stays open");
        if !judge.take(&message) {
            return judge.verdict();
        }
    }
}

/// Reads far less than is said until it is told to hurry, and then to the end of the connection; all that
/// comes is whole and in order, but for what the end cut off.
fn dawdle(mut line: Line, hurries: &AtomicBool) -> u64 {
    let mut judge = Judge::default();
    let mut room = [0; 512];
    let mut held = Vec::new();
    let mut count = 0;
    // Enough for all that the system keeps, and for the time until the robot has had enough.
    for _ in 0..200_000 {
        match line.stream.read(&mut room) {
            Ok(0) => return count,
            Ok(some) => held.extend_from_slice(&room[..some]),
            Err(error) if error.kind() == ErrorKind::ConnectionReset => return count,
            Err(error) => panic!("nothing comes: {error}"),
        }
        while let Some(end) = held.iter().position(|byte| *byte == 0) {
            let message: Vec<u8> = held.drain(..=end).collect();
            judge.take(std::str::from_utf8(&message[..end]).expect("ASCII"));
            count += 1;
        }
        if !hurries.load(Ordering::Relaxed) {
            thread::sleep(Duration::from_millis(20));
        }
    }
    panic!("the robot goes on talking to somebody who hardly reads");
}

/// What the control connection must be told next, apart from checkpoints.
#[derive(Debug)]
enum Expected {
    /// This message.
    Exactly(String),
    /// A message with this beginning and so many values behind it.
    Values(&'static str, usize),
    /// This message, and nothing after it.
    Last(String),
}

/// Reads the control connection to the last answer, and says when the last checkpoint is reached.
fn check_answers(mut line: Line, expected: &mpsc::Receiver<Expected>, all: &mpsc::Sender<()>) {
    let mut checkpoints = 0_u32;
    loop {
        let message = line.next().expect("the control connection stays open");
        let (code, content) = parts(&message);
        if code == 3030 {
            assert_eq!(content, (checkpoints % 8_000 + 1).to_string(), "checkpoints");
            checkpoints += 1;
            if checkpoints == CHECKPOINTS {
                all.send(()).unwrap();
            }
            assert!(checkpoints <= CHECKPOINTS, "{message} was not asked for");
            continue;
        }
        match expected.recv_timeout(LONG).unwrap_or_else(|_| panic!("unasked: {message}")) {
            Expected::Exactly(wanted) => assert_eq!(message, wanted),
            Expected::Values(beginning, count) => {
                assert!(message.starts_with(beginning), "{beginning}: {message}");
                assert_eq!(numbers(content).len(), count, "{message}");
            }
            Expected::Last(wanted) => {
                assert_eq!(message, wanted);
                return assert_eq!(checkpoints, CHECKPOINTS);
            }
        }
    }
}

/// The command with this number, and its answer if it has one.
fn command(number: u32) -> (String, Option<Expected>) {
    let round = number / 10;
    let (line, expected) = match number % 10 {
        0 => {
            let angle = if round.is_multiple_of(2) { 0.05 } else { -0.05 };
            (format!("MoveJoints({angle},{angle},0,0,20,0)"), None)
        }
        1 => (format!("SetCheckpoint({})", round % 8_000 + 1), None),
        2 => ("GetRtTargetJointPos".into(), Some(Expected::Values("[2200][", 7))),
        3 => (
            format!("SyncCmdQueue({number})"),
            Some(Expected::Exactly(format!("[2097][{number}]"))),
        ),
        4 => (format!("SetJointVel({})", 50 + round % 50), None),
        5 => ("-GetStatusRobot".into(), Some(Expected::Values("[2007][1,1,0,0,0,", 7))),
        6 => {
            let line = format!("Load({number})");
            let answer =
                format!("[1001][Empty command or command unrecognized. - Command: '{line}']");
            (line, Some(Expected::Exactly(answer)))
        }
        7 => {
            let percent = 60 + round % 38;
            let answer = Expected::Exactly(format!("[2015][{percent}]"));
            (format!("SetTimeScaling({percent})"), Some(answer))
        }
        8 => ("-GetJoints()".into(), Some(Expected::Values("[2026][", 6))),
        _ => ("GetRobotName".into(), Some(Expected::Exactly("[2095][m500]".into()))),
    };
    (line, expected)
}

/// Pages of a process that are in memory.
fn resident_pages(process: u32) -> u64 {
    let text = std::fs::read_to_string(format!("/proc/{process}/statm")).unwrap();
    text.split_whitespace().nth(1).unwrap().parse().unwrap()
}

/// Processor time of a process so far, in ticks of 10 ms.
fn ticks(process: u32) -> u64 {
    let text = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    let fields = text.rsplit(')').next().unwrap();
    let number = |index| fields.split_whitespace().nth(index).unwrap().parse::<u64>().unwrap();
    number(11) + number(12)
}

/// A connection whose system keeps as little for it as it can.
fn narrow(address: SocketAddr) -> Line {
    let socket = Socket::new(Domain::IPV4, Type::STREAM, None).unwrap();
    socket.set_recv_buffer_size(4_096).unwrap();
    socket.connect(&address.into()).unwrap();
    Line::over(socket.into())
}

#[test]
fn a_minute_of_commands_with_three_monitors_loses_nothing() {
    let address = loopback::address();
    let mut serving = serving::serve(&["--tcp", &address.to_string()]);
    let process = serving.id();
    let control_port = SocketAddr::from((address, 10_000));
    let monitoring_port = SocketAddr::from((address, 10_001));

    let mut control = Line::open(control_port);
    let preparations = [
        ("GetRobotName", "[2095]"),
        ("ActivateRobot", "[2000]"),
        ("Home", "[2002]"),
        ("SetEob(0)", "[2055]"),
        ("SetMonitoringInterval(0.002)", "[2085]"),
        ("SetRealTimeMonitoring(All)", "[2117]"),
        ("SyncCmdQueue(1)", "[2097][1]"),
    ];
    for (command, answer) in preparations {
        control.ask(command, answer);
    }
    let slow = narrow(monitoring_port);
    let hurries = Arc::new(AtomicBool::new(false));
    let told_to_hurry = Arc::clone(&hurries);
    let slow = thread::spawn(move || dawdle(slow, &told_to_hurry));
    let monitors: [_; MONITORS] = std::array::from_fn(|_| {
        let mut line = Line::open(monitoring_port);
        assert!(line.next().is_some_and(|first| first.starts_with("[3000][Connected to Meca500")));
        thread::spawn(move || listen(line))
    });

    let mut writer = control.stream.try_clone().unwrap();
    let (expect, expected) = mpsc::channel();
    let (reached, all_reached) = mpsc::channel();
    let answers = thread::spawn(move || check_answers(control, &expected, &reached));
    let mut send = |line: &str| writer.write_all(format!("{line}\0").as_bytes()).unwrap();
    expect.send(Expected::Exactly(BEGIN.into())).unwrap();
    send("SetTimeScaling(99.5)");
    let begin = Instant::now();
    let ticks_before = ticks(process);
    let (mut pages, mut late) = (0, 0);
    for number in 0..COMMANDS {
        let due = begin + Duration::from_secs(1) * number / COMMANDS_PER_SECOND;
        match due.checked_duration_since(Instant::now()) {
            Some(wait) => thread::sleep(wait),
            None => late += 1,
        }
        let (line, answer) = command(number);
        if let Some(answer) = answer {
            expect.send(answer).unwrap();
        }
        send(&line);
        if number == COMMANDS / 4 {
            pages = resident_pages(process);
        }
    }
    let spent = ticks(process) - ticks_before;
    let grown = resident_pages(process).saturating_sub(pages);

    // The end is marked when the arm has done everything and the slow one has lost its connection.
    expect.send(Expected::Exactly("[2015][100]".into())).unwrap();
    send("SetTimeScaling(100)");
    all_reached.recv_timeout(LONG).expect("every checkpoint is reached");
    serving.wait_for("it did not read what the robot said", LONG);
    hurries.store(true, Ordering::Relaxed);
    let dropped = slow.join().expect("what it heard is whole");
    expect.send(Expected::Last(END.into())).unwrap();
    send("SetTimeScaling(98.5)");
    answers.join().expect("every answer is the expected one");
    let heard = monitors.map(|monitor| monitor.join().expect("it heard everything"));

    println!(
        "{COMMANDS} commands in {SECONDS} s, {late} of them late; {} messages to each of \
         {MONITORS} monitors, {dropped} to the slow one before it lost its connection; {} % of one \
         core, {grown} pages more",
        heard[0].messages,
        spent / u64::from(SECONDS),
    );
    for other in &heard {
        assert_eq!(*other, heard[0], "the monitors heard different things");
    }
    let Heard { cycles, first_us, last_us, checkpoints, .. } = heard[0];
    assert_eq!(checkpoints, CHECKPOINTS);
    assert_eq!(last_us - first_us, (cycles - 1) * INTERVAL_US);
    // The last command was sent no sooner than this after the first.
    let least = u64::from(COMMANDS - 1) * 1_000_000 / u64::from(COMMANDS_PER_SECOND) / INTERVAL_US;
    assert!(cycles >= least, "{cycles} cycles of at least {least}");
    assert!(grown < MOST_PAGES, "{grown} pages more after a quarter of the time");

    let said = serving::end(serving);
    assert_eq!(said.matches("it did not read what the robot said").count(), 1, "{said}");
    let sent = COMMANDS as usize + preparations.len() + 3;
    assert!(said.contains(&format!("{sent} commands")), "{sent} commands: {said}");
}
