//! The face as a server of the text interface sees it.

use core::fmt;

use super::face::Port;
use super::format;
use super::protocol::Controller;
use crate::sim::meca500::halt::Halts;
use crate::sim::meca500::robot::VirtualRobot;
use crate::sim::meca500::safety::Signal;
use crate::text_device::{LineProblem, TextDevice};
use crate::time::Instant;
use crate::wire::meca500::code::Code;

impl TextDevice for VirtualRobot {
    fn open_control(&mut self, now: Instant) -> bool {
        self.advance(now);
        self.listen_to_text();
        if !self.is_on_text() || !self.claim_control(Controller::Text) {
            return false;
        }
        self.text.control.clear();
        let greeting = self.greeting();
        self.say(Port::Control, Code::CONNECTED, &greeting);
        if self.safety.connection_dropped == Signal::Present {
            self.safety.connection_dropped.set_present(false);
        }
        let before = self.text.shown.map(|shown| shown.safety);
        self.observe_text();
        self.tell_standing_signals(before);
        true
    }

    fn close_control(&mut self, now: Instant) {
        self.advance(now);
        self.release_control(Controller::Text);
        self.text.control.clear();
        self.text.copies_monitoring = false;
        self.text.watchdog = None;
        self.text.drops_control = false;
        self.text.saving = None;
        self.text.waiting.clear();
        self.text.tells_variables = false;
        self.text.tells_next_stop = false;
        self.drop_connection();
        self.observe_text();
    }

    fn command(&mut self, now: Instant, line: &str) {
        self.advance(now);
        self.text_command(line);
    }

    fn reject(&mut self, now: Instant, problem: LineProblem) {
        self.advance(now);
        let code = match problem {
            LineProblem::TooLong => Code::COMMAND_TOO_LONG,
            LineProblem::NotAscii | LineProblem::Empty => Code::UNKNOWN_COMMAND,
        };
        self.say(Port::Control, code, &format::message(code, Some("")));
        self.observe_text();
    }

    fn next_control_message(&mut self, into: &mut dyn fmt::Write) -> bool {
        write_next(self.text.control.pop(), into)
    }

    fn monitoring_snapshot(&mut self, now: Instant, each: &mut dyn FnMut(&str)) {
        self.advance(now);
        self.listen_to_text();
        self.observe_text();
        self.tell_everything(&mut |code, content| {
            each(&alloc::format!("[{}][{content}]", code.0));
        });
    }

    fn next_monitoring_message(&mut self, into: &mut dyn fmt::Write) -> bool {
        write_next(self.text.monitoring.pop(), into)
    }

    fn advance(&mut self, now: Instant) {
        self.listen_to_text();
        // The robot's own method, which the trait's name would hide.
        VirtualRobot::advance(self, now);
        self.observe_text();
    }

    fn is_on_text(&self) -> bool {
        self.is_online() && !self.is_in_ethercat_mode()
    }

    fn drops_control(&self) -> bool {
        self.text.drops_control
    }

    fn keep_alive_packets(&self) -> u8 {
        self.text.keep_alive_packets
    }
}

fn write_next(message: Option<alloc::string::String>, into: &mut dyn fmt::Write) -> bool {
    let Some(message) = message else { return false };
    // No room in `into` is the server's business.
    let _ = into.write_str(&message);
    true
}

impl VirtualRobot {
    /// Tells a new control connection of the safety signals that stand since before it, which are
    /// those that `before` has too. Source: choice
    fn tell_standing_signals(&mut self, before: Option<[u8; 5]>) {
        let now = self.safety_numbers();
        for ((code, before), now) in
            self.safety_codes().into_iter().zip(before.unwrap_or(now)).zip(now)
        {
            if now != 0 && now == before {
                self.say(Port::Control, code, &format::integers([now]));
            }
        }
    }

    /// The connection watchdog: once it has run out the robot stops and ends the connection.
    /// Source: PM L906, L3160.
    pub(super) fn watch_connection(&mut self) {
        let has_run_out = self.text.watchdog.is_some_and(|runs_out| self.now >= runs_out);
        if !has_run_out {
            return;
        }
        self.text.watchdog = None;
        self.text.drops_control = true;
        self.safety.connection_dropped.set_present(true);
        if self.is_activated() {
            self.halt(Halts::CONNECTION);
        }
    }
}
