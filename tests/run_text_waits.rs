//! What the program runner over the text interface waits for, and for how long: against the virtual robot,
//! in simulated time, on a connection that keeps some lines from the robot.
#![cfg(feature = "cli")]

#[path = "support/quick_robot.rs"]
mod quick_robot;

use fieldarm::engine::meca500::{Action, Event, Fault};
use fieldarm::link::text::Port;
use fieldarm::link::text::memory::MemoryConnection;
use fieldarm::run::drive::{Observer, Progress};
use fieldarm::run::outcome::End;
use fieldarm::run::program::Program;
use fieldarm::run::recording::Recording;
use fieldarm::run::text::{Heard, TextLink, TextRunner, TextSettings, drive_text};
use fieldarm::sim::meca500::VirtualRobot;
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::revision::Revision;
use fieldarm::wire::meca500::text::Message;

use quick_robot::quick_robot;

/// No run here lasts longer, nor keeps more lines from the robot.
const LONGEST: Duration = Duration::from_secs(300);
const MOST_LINES: u64 = 1_000;

struct Deaf {
    cell: MemoryConnection<VirtualRobot>,
    /// Lines that begin so do not reach the robot.
    to: Option<&'static str>,
    /// What is said instead.
    says: Option<&'static str>,
    unheard: u64,
    owed: u64,
}

impl Deaf {
    fn new(to: Option<&'static str>, says: Option<&'static str>) -> Self {
        let cell = MemoryConnection::new(VirtualRobot::new(quick_robot()));
        Self { cell, to, says, unheard: 0, owed: 0 }
    }

    fn run(&mut self, text: &str, settings: TextSettings) -> End {
        let program = Program::parse(text, Revision::R3).expect("a good program");
        self.cell.connect().expect("nobody else controls it");
        let mut runner = TextRunner::new(&program, settings);
        drive_text(self, &mut runner, &mut Recording::new(), &mut Nobody).end
    }
}

impl TextLink for Deaf {
    type Error = String;

    fn now(&self) -> Instant {
        self.cell.now()
    }

    fn send(&mut self, command: &str) -> Result<bool, String> {
        if self.to.is_some_and(|to| command.starts_with(to)) {
            self.unheard += 1;
            self.owed += 1;
            return Ok(true);
        }
        self.cell.send(command).map(|()| true).map_err(|reason| reason.to_string())
    }

    fn receive(
        &mut self,
        until: Instant,
        take: &mut dyn FnMut(Instant, Heard<'_>),
    ) -> Result<(), String> {
        let is_bounded = self.now() - Instant::ZERO < LONGEST && self.unheard < MOST_LINES;
        assert!(is_bounded, "the run does not end");
        let owed = core::mem::take(&mut self.owed);
        if let Some(says) = self.says {
            let message = Message::parse(says).expect("a message");
            (0..owed).for_each(|_| take(self.cell.now(), Heard::Control(message)));
        }
        let received = self.cell.receive(until, &mut |at, port, message| {
            if port == Port::Control {
                take(at, Heard::Control(message));
            }
        });
        received.map_err(|reason| reason.to_string())
    }

    fn reconnect(&mut self) -> bool {
        false
    }
}

struct Nobody;

impl Observer for Nobody {
    fn is_interrupted(&mut self) -> bool {
        false
    }

    fn event(&mut self, _event: &Event, _step: Option<usize>) {}

    fn wants_progress(&mut self, _passes: u64) -> bool {
        false
    }

    fn progress(&mut self, _progress: &Progress) {}
}

#[test]
fn a_resumption_that_is_refused_again_and_again_is_given_up() {
    let mut robot = Deaf::new(None, Some("[1040][Command failed.]"));
    assert_eq!(robot.run("Delay(0.1)", TextSettings::default()), End::Completed);
    robot.cell.cut();
    robot.cell.device_mut().panel().press_p_stop2();
    robot.cell.device_mut().panel().release_p_stop2();
    robot.to = Some("ResumeMotion");
    let end = robot.run("Delay(0.1)", TextSettings::default());
    assert_eq!(end, End::ActionFailed(Action::BringUp, Fault::Timeout));
    assert!((2..100).contains(&robot.unheard), "{} times", robot.unheard);
}

#[test]
fn what_lasts_is_waited_for_and_what_is_lost_is_not() {
    for copies_monitoring in [true, false] {
        let settings = TextSettings { copies_monitoring, ..TextSettings::default() };
        // Many lines, each of which tells when it is done; then one that is silent for long.
        let lasting = "Delay(1)\n".repeat(25) + "Delay(25)";
        let end = Deaf::new(None, None).run(&lasting, settings);
        assert_eq!(end, End::Completed, "with copies: {copies_monitoring}");
        let end = Deaf::new(Some("SetCheckpoint"), None).run("Delay(0.1)", settings);
        let lost = End::Fault(Fault::AckTimeout);
        assert_eq!(end, lost, "with copies: {copies_monitoring}");
    }
}
