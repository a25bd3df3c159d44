//! The prompt of `fieldarm text` as a person at a terminal has it.
#![cfg(all(target_os = "linux", feature = "cli"))]

mod cli_support;
#[path = "support/loopback.rs"]
mod loopback;
#[path = "support/namespaces.rs"]
mod namespaces;

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::os::fd::OwnedFd;
use std::process::{Child, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use cli_support::{Scratch, fieldarm};
use loopback::address;
use namespaces::Running;
use rustix::process::{Pid, Signal, kill_process};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{LocalModes, tcgetattr};

const LONG: Duration = Duration::from_secs(60);
const CTRL_C: &str = "\u{3}";
const CTRL_D: &str = "\u{4}";
const UP: &str = "\u{1b}[A";

/// A terminal with the command at it.
struct Terminal {
    keys: File,
    child: Child,
    screen: Arc<Mutex<String>>,
    /// How much of the screen was looked at.
    seen: usize,
}

impl Terminal {
    fn start(arguments: &[&str], variables: &[(&str, &str)]) -> Self {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        grantpt(&master).unwrap();
        unlockpt(&master).unwrap();
        let name = ptsname(&master, Vec::new()).unwrap().into_string().unwrap();
        let slave: OwnedFd = OpenOptions::new().read(true).write(true).open(name).unwrap().into();
        let mut command = fieldarm(arguments);
        command.env("TERM", "xterm").env_remove("NO_COLOR").envs(variables.iter().copied());
        let child = command
            .stdin(Stdio::from(slave.try_clone().unwrap()))
            .stdout(Stdio::from(slave.try_clone().unwrap()))
            .stderr(Stdio::from(slave))
            .spawn()
            .unwrap();
        // Or the terminal would stay open with us.
        drop(command);
        let keys = File::from(master);
        let mut output = keys.try_clone().unwrap();
        let screen = Arc::new(Mutex::new(String::new()));
        let shown = Arc::clone(&screen);
        std::thread::spawn(move || {
            let mut room = [0; 4096];
            // An error is the end of the other side.
            while let Ok(count) = output.read(&mut room) {
                if count == 0 {
                    return;
                }
                let text = String::from_utf8_lossy(&room[..count]).into_owned();
                shown.lock().unwrap_or_else(PoisonError::into_inner).push_str(&text);
            }
        });
        Self { keys, child, screen, seen: 0 }
    }

    fn screen(&self) -> String {
        self.screen.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn press(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).unwrap();
    }

    fn enter(&mut self, line: &str) {
        self.press(&format!("{line}\r"));
    }

    /// Waits for words that were not waited for yet.
    #[track_caller]
    fn wait_for(&mut self, words: &str) {
        let deadline = Instant::now() + LONG;
        loop {
            let screen = self.screen();
            if let Some(place) = screen[self.seen..].find(words) {
                self.seen += place + words.len();
                return;
            }
            assert!(Instant::now() < deadline, "no {words:?} in {:?}", &screen[self.seen..]);
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    fn end(mut self) -> (Option<i32>, String) {
        let deadline = Instant::now() + LONG;
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return (status.code(), self.screen());
            }
            assert!(Instant::now() < deadline, "still there: {:?}", self.screen());
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn robot() -> (Running, String) {
    let address = address().to_string();
    let mut serving = Running::start(&mut fieldarm(&["sim", "--tcp", &address]));
    serving.wait_for("Ctrl-C ends it", LONG);
    (serving, address)
}

#[test]
fn a_session_at_a_terminal() {
    let (_serving, address) = robot();
    let scratch = Scratch::new("text_prompt");
    let history = scratch.path("deep/history");
    let mut terminal = Terminal::start(&["text", &address, "--history", &history], &[]);
    terminal.wait_for("Connected.");
    terminal.wait_for("not activated, not homed");
    // Tab completes in any case, the hint tells the argument.
    terminal.press("getrobots\t");
    terminal.wait_for("GetRobotSerial");
    terminal.press("\r");
    terminal.wait_for("Answer to GetRobotSerial");
    terminal.press("MoveJoints(1,");
    terminal.wait_for("theta2: -70 to 90 deg");
    // Ctrl-C clears the line, and what was typed is not sent.
    terminal.press(CTRL_C);
    terminal.wait_for("Ctrl-C again");
    terminal.wait_for("> ");
    // A mistake is told and not sent.
    terminal.enter("Delay(x)");
    terminal.wait_for("t must be a number, not `x`");
    terminal.wait_for("to send it as it is");
    terminal.enter("!SetEob(7)");
    // Errors stand out.
    terminal.wait_for("\u{1b}[1m\u{1b}[31m[1003]");
    terminal.enter(":help Home");
    terminal.wait_for("programming manual 11.3.84");
    terminal.enter(":state");
    terminal.wait_for("robot                 not activated");
    terminal.enter(":nonsense");
    terminal.wait_for("there is no `:nonsense`");
    // The line before the last one, from the history.
    terminal.press(&format!("{UP}{UP}\r"));
    terminal.wait_for("robot                 not activated");
    terminal.press(CTRL_D);
    let (code, screen) = terminal.end();
    assert_eq!(code, Some(0), "{screen:?}");
    let kept = std::fs::read_to_string(&history).unwrap();
    assert!(kept.contains("GetRobotSerial") && kept.contains("!SetEob(7)"), "{kept}");
    // The next session has it.
    let mut terminal = Terminal::start(&["text", &address, "--history", &history], &[]);
    terminal.wait_for("not activated, not homed");
    terminal.press(UP);
    terminal.wait_for(":state");
    terminal.press(CTRL_C);
    terminal.wait_for("Ctrl-C again");
    terminal.wait_for("> ");
    terminal.press(CTRL_C);
    let (code, screen) = terminal.end();
    assert_eq!(code, Some(0), "{screen:?}");
}

#[test]
fn what_the_robot_says_comes_above_the_line_that_is_typed() {
    let (_serving, address) = robot();
    let scratch = Scratch::new("text_prompt_above");
    let home = scratch.path("state");
    let variables = [("NO_COLOR", "1"), ("XDG_STATE_HOME", home.as_str())];
    let mut terminal = Terminal::start(&["text", &address], &variables);
    terminal.wait_for("not activated, not homed");
    terminal.enter("ActivateRobot");
    terminal.press("SetJointV");
    terminal.wait_for("The robot is activated.");
    // The line is there again below it, and can be finished.
    terminal.wait_for("> SetJointV");
    terminal.press(CTRL_C);
    terminal.wait_for("Ctrl-C again");
    terminal.wait_for("> ");
    terminal.enter("Home");
    terminal.wait_for("The robot is homed.");
    terminal.enter("SetJointVel(1)");
    terminal.enter("MoveJoints(100,0,0,0,0,0)");
    terminal.enter("GetStatusRobot");
    terminal.wait_for("moving");
    terminal.enter(":quit");
    terminal.wait_for("it stops now");
    let (code, screen) = terminal.end();
    assert_eq!(code, Some(0), "{screen:?}");
    assert!(!screen.contains("\u{1b}[31m") && !screen.contains("\u{1b}[2m"), "{screen:?}");
    let kept = std::fs::read_to_string(format!("{home}/fieldarm/text_history")).unwrap();
    assert!(kept.contains("ActivateRobot"), "{kept}");
}

#[test]
fn a_signal_to_end_leaves_the_terminal_as_it_was() {
    let (_serving, address) = robot();
    let mut terminal = Terminal::start(&["text", &address, "--no-history"], &[]);
    terminal.wait_for("not activated, not homed");
    // The line is being edited now: what is typed is shown by the prompt alone.
    terminal.press("GetFw");
    terminal.wait_for("GetFw");
    let by_line = LocalModes::ICANON | LocalModes::ECHO;
    assert!(!tcgetattr(&terminal.keys).unwrap().local_modes.intersects(by_line));
    let pid = Pid::from_child(&terminal.child);
    kill_process(pid, Signal::TERM).unwrap();
    let keys = terminal.keys.try_clone().unwrap();
    let (code, screen) = terminal.end();
    assert_eq!(code, Some(130), "{screen:?}");
    assert!(tcgetattr(&keys).unwrap().local_modes.contains(by_line));
}

#[test]
fn a_robot_that_goes_away_is_told_and_ends_the_prompt() {
    let (serving, address) = robot();
    let scratch = Scratch::new("text_prompt_gone");
    let home = scratch.path("state");
    let variables = [("XDG_STATE_HOME", home.as_str())];
    let mut terminal = Terminal::start(&["text", &address, "--no-history"], &variables);
    terminal.wait_for("not activated, not homed");
    terminal.enter("GetFwVersion");
    terminal.wait_for("[2081]");
    drop(serving);
    terminal.wait_for("Enter leaves the prompt");
    terminal.enter("");
    let (code, screen) = terminal.end();
    assert_eq!(code, Some(4), "{screen:?}");
    assert!(!std::path::Path::new(&home).exists(), "nothing is kept");
}
