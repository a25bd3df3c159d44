//! Robots that do not hear some lines, or refuse them without a reason.

use super::*;

/// A robot that refuses a command for a reason that it does not tell, or never gets to read it.
struct Deaf {
    link: Accidents,
    /// Lines that begin so do not reach the robot.
    to: &'static str,
    /// What it says instead.
    says: Option<&'static str>,
    unheard: u64,
    owed: u64,
}

impl TextLink for Deaf {
    type Error = String;

    fn now(&self) -> Instant {
        self.link.now()
    }

    fn send(&mut self, command: &str) -> Result<bool, String> {
        if command.starts_with(self.to) {
            self.unheard += 1;
            self.owed += 1;
            return Ok(true);
        }
        self.link.send(command)
    }

    fn receive(
        &mut self,
        until: Instant,
        take: &mut dyn FnMut(Instant, Heard<'_>),
    ) -> Result<(), String> {
        let owed = core::mem::take(&mut self.owed);
        if let Some(says) = self.says {
            let message = Message::parse(says).expect("a message");
            (0..owed).for_each(|_| take(self.link.now(), Heard::Control(message)));
        }
        self.link.receive(until, take)
    }

    fn reconnect(&mut self) -> bool {
        false
    }
}

/// Runs on a robot that is deaf; how it ended, how many lines were unheard, and how long it took.
fn run_on_deaf(
    mut cell: Cell,
    text: &str,
    settings: TextSettings,
    to: &'static str,
    says: Option<&'static str>,
) -> (Outcome, u64, Duration) {
    let program = Program::parse(text, Revision::R3).expect("a good program");
    cell.connect().expect("nobody else controls it");
    let began = cell.now();
    let accident: Accident = Box::new(|_| {});
    let (cut_after, mute_after) = (None, None);
    let link = Accidents { cell, accident, cut_after, mute_after, heard: 0, said: Vec::new() };
    let mut link = Deaf { link, to, says, unheard: 0, owed: 0 };
    let mut runner = TextRunner::new(&program, settings);
    let mut watch = Watch::default();
    let outcome = drive_text(&mut link, &mut runner, &mut Recording::new(), &mut watch);
    (outcome, link.unheard, link.now() - began)
}

#[test]
fn a_resumption_that_is_refused_again_and_again_is_given_up() {
    let mut cell = run("Delay(0.1)").cell;
    cell.cut();
    let robot = cell.device_mut();
    robot.panel().press_p_stop2();
    robot.panel().release_p_stop2();
    let refusal = Some("[1040][Command failed.]");
    let (outcome, sent, took) =
        run_on_deaf(cell, "Delay(0.1)", TextSettings::default(), "ResumeMotion", refusal);
    let end = End::ActionFailed(Action::BringUp, Fault::Timeout);
    assert_eq!(outcome.end, end);
    assert!((2..100).contains(&sent), "{sent} times in {took:?}");
}

#[test]
fn what_lasts_is_waited_for_and_what_is_lost_is_not() {
    let without = TextSettings { copies_monitoring: false, ..TextSettings::default() };
    for settings in [TextSettings::default(), without] {
        let copies = settings.copies_monitoring;
        // Many lines, each of which tells when it is done; then one that is silent for long.
        let lasting = "Delay(1)\n".repeat(25) + "Delay(25)";
        let finished = run_with(&lasting, Setup { settings, ..Setup::default() });
        assert_eq!(finished.outcome, COMPLETED, "with copies: {copies}");
        let cell = MemoryConnection::new(VirtualRobot::new(armed()));
        let (outcome, ..) = run_on_deaf(cell, "Delay(0.1)", settings, "SetCheckpoint", None);
        assert_eq!(outcome.end, End::Fault(Fault::AckTimeout), "with copies: {copies}");
    }
}
