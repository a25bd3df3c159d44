//! The prompt of `fieldarm text` as a person at a terminal has it.
#![cfg(all(target_os = "linux", feature = "cli"))]

mod cli_support;
#[path = "support/loopback.rs"]
mod loopback;
#[path = "support/namespaces.rs"]
mod namespaces;
#[path = "support/serving.rs"]
mod serving;
#[path = "support/terminal.rs"]
mod terminal;

use cli_support::{Scratch, fieldarm};
use loopback::address;
use namespaces::Running;
use rustix::process::{Signal, kill_process};
use serving::serve;
use terminal::Terminal;

const CTRL_C: &str = "\u{3}";
const CTRL_D: &str = "\u{4}";
const UP: &str = "\u{1b}[A";

fn start(arguments: &[&str], variables: &[(&str, &str)]) -> Terminal {
    let mut command = fieldarm(arguments);
    command.env_remove("NO_COLOR").envs(variables.iter().copied());
    Terminal::start(&mut command)
}

fn robot() -> (Running, String) {
    let address = address().to_string();
    (serve(&["--tcp", &address]), address)
}

#[test]
fn a_session_at_a_terminal() {
    let (_serving, address) = robot();
    let scratch = Scratch::new("text_prompt");
    let history = scratch.path("deep/history");
    let mut terminal = start(&["text", &address, "--history", &history], &[]);
    terminal.expect("Connected.");
    terminal.expect("not activated, not homed");
    // Tab completes in any case, the hint tells the argument.
    terminal.press("getrobots\t");
    terminal.expect("GetRobotSerial");
    terminal.press("\r");
    terminal.expect("Answer to GetRobotSerial");
    terminal.press("MoveJoints(1,");
    terminal.expect("theta2: -70 to 90 deg");
    // Ctrl-C clears the line, and what was typed is not sent.
    terminal.press(CTRL_C);
    terminal.expect("Ctrl-C again");
    terminal.expect("> ");
    // A mistake is told and not sent.
    terminal.enter("Delay(x)");
    terminal.expect("t must be a number, not `x`");
    terminal.expect("to send it as it is");
    terminal.enter("!SetEob(7)");
    // Errors stand out.
    terminal.expect("\u{1b}[1m\u{1b}[31m[1003]");
    terminal.enter(":help Home");
    terminal.expect("programming manual 11.3.84");
    terminal.enter(":state");
    terminal.expect("robot                 not activated");
    terminal.enter(":nonsense");
    terminal.expect("there is no `:nonsense`");
    // The line before the last one, from the history.
    terminal.press(&format!("{UP}{UP}\r"));
    terminal.expect("robot                 not activated");
    terminal.press(CTRL_D);
    terminal.expect_exit(0);
    let kept = std::fs::read_to_string(&history).unwrap();
    assert!(kept.contains("GetRobotSerial") && kept.contains("!SetEob(7)"), "{kept}");
    // The next session has it.
    let mut terminal = start(&["text", &address, "--history", &history], &[]);
    terminal.expect("not activated, not homed");
    terminal.press(UP);
    terminal.expect(":state");
    terminal.press(CTRL_C);
    terminal.expect("Ctrl-C again");
    terminal.expect("> ");
    terminal.press(CTRL_C);
    terminal.expect_exit(0);
}

#[test]
fn what_the_robot_says_comes_above_the_line_that_is_typed() {
    let (_serving, address) = robot();
    let scratch = Scratch::new("text_prompt_above");
    let home = scratch.path("state");
    let variables = [("NO_COLOR", "1"), ("XDG_STATE_HOME", home.as_str())];
    let mut terminal = start(&["text", &address], &variables);
    terminal.expect("not activated, not homed");
    terminal.enter("ActivateRobot");
    terminal.press("SetJointV");
    terminal.expect("The robot is activated.");
    // The line is there again below it, and can be finished.
    terminal.expect("> SetJointV");
    terminal.press(CTRL_C);
    terminal.expect("Ctrl-C again");
    terminal.expect("> ");
    terminal.enter("Home");
    terminal.expect("The robot is homed.");
    terminal.enter("SetJointVel(1)");
    terminal.enter("MoveJoints(100,0,0,0,0,0)");
    terminal.enter("GetStatusRobot");
    terminal.expect("moving");
    terminal.enter(":quit");
    terminal.expect("it stops now");
    terminal.expect_exit(0);
    let screen = terminal.shown();
    assert!(!screen.contains("\u{1b}[31m") && !screen.contains("\u{1b}[2m"), "{screen:?}");
    let kept = std::fs::read_to_string(format!("{home}/fieldarm/text_history")).unwrap();
    assert!(kept.contains("ActivateRobot"), "{kept}");
}

#[test]
fn a_signal_to_end_leaves_the_terminal_as_it_was() {
    let (_serving, address) = robot();
    let mut terminal = start(&["text", &address, "--no-history"], &[]);
    terminal.expect("not activated, not homed");
    // The line is being edited now: what is typed is shown by the prompt alone.
    terminal.press("GetFw");
    terminal.expect("GetFw");
    assert!(!terminal.is_plain());
    kill_process(terminal.pid(), Signal::TERM).expect("it is our child");
    terminal.expect_exit(130);
    assert!(terminal.is_plain());
}

#[test]
fn a_robot_that_goes_away_is_told_and_ends_the_prompt() {
    let (serving, address) = robot();
    let scratch = Scratch::new("text_prompt_gone");
    let home = scratch.path("state");
    let variables = [("XDG_STATE_HOME", home.as_str())];
    let mut terminal = start(&["text", &address, "--no-history"], &variables);
    terminal.expect("not activated, not homed");
    terminal.enter("GetFwVersion");
    terminal.expect("[2081]");
    drop(serving);
    terminal.expect("Enter leaves the prompt");
    terminal.enter("");
    terminal.expect_exit(4);
    assert!(!std::path::Path::new(&home).exists(), "nothing is kept");
}
