//! Somebody at a terminal: lines in, messages out, in simulated time.

use fieldarm::sim::meca500::{RobotSettings, VirtualRobot};
use fieldarm::text_device::TextDevice;
use fieldarm::time::{Duration, Instant};

/// Milliseconds in which anything reasonable has happened.
const PATIENCE_MS: u32 = 60_000;

#[derive(Clone)]
pub(crate) struct Desk {
    pub(crate) robot: VirtualRobot,
    pub(crate) now: Instant,
    pub(crate) monitored: Vec<String>,
    /// Heard after what was waited for.
    kept: Vec<String>,
}

/// The code of a message.
pub(crate) fn code(message: &str) -> u16 {
    message.get(1..5).and_then(|code| code.parse().ok()).unwrap_or_else(|| panic!("{message}"))
}

/// What stands in a message's second brackets.
pub(crate) fn content(message: &str) -> &str {
    message[7..].strip_suffix(']').unwrap_or_else(|| panic!("{message}"))
}

/// A message's numbers.
pub(crate) fn values(message: &str) -> Vec<f64> {
    content(message).split(',').map(|value| value.parse().expect(message)).collect()
}

pub(crate) fn codes(messages: &[String]) -> Vec<u16> {
    messages.iter().map(|message| code(message)).collect()
}

impl Desk {
    /// A robot that was just switched on, with a control connection; the greeting is still waiting.
    pub(crate) fn connected_with(change: impl FnOnce(&mut RobotSettings)) -> Self {
        let mut settings = RobotSettings::default();
        change(&mut settings);
        let robot = VirtualRobot::new(settings);
        let mut desk = Self { robot, now: Instant::ZERO, monitored: Vec::new(), kept: Vec::new() };
        desk.wait_ms(1);
        assert!(desk.robot.open_control(desk.now));
        desk
    }

    pub(crate) fn connected() -> Self {
        let mut desk = Self::connected_with(|_| {});
        desk.heard();
        desk
    }

    pub(crate) fn ready_with(change: impl FnOnce(&mut RobotSettings)) -> Self {
        let mut desk = Self::connected_with(change);
        desk.bring_up();
        desk
    }

    pub(crate) fn ready() -> Self {
        Self::ready_with(|_| {})
    }

    pub(crate) fn bring_up(&mut self) {
        self.say("ActivateRobot");
        self.until(2000);
        self.say("Home");
        self.until(2002);
        self.wait_ms(2);
        self.heard();
        self.monitored.clear();
    }

    /// Sends a line; the messages on the control port since the last call.
    pub(crate) fn say(&mut self, line: &str) -> Vec<String> {
        self.robot.command(self.now, line);
        self.heard()
    }

    /// The messages on the control port; those on the monitoring port are put aside.
    pub(crate) fn heard(&mut self) -> Vec<String> {
        let mut messages = std::mem::take(&mut self.kept);
        let mut message = String::new();
        while self.robot.next_control_message(&mut message) {
            messages.push(std::mem::take(&mut message));
        }
        while self.robot.next_monitoring_message(&mut message) {
            self.monitored.push(std::mem::take(&mut message));
        }
        messages
    }

    /// Lets time pass without a look at the messages.
    pub(crate) fn wait_ms(&mut self, count: u32) {
        for _ in 0..count {
            self.now += Duration::from_millis(1);
            TextDevice::advance(&mut self.robot, self.now);
        }
    }

    /// The messages of so many milliseconds.
    pub(crate) fn listen_ms(&mut self, count: u32) -> Vec<String> {
        self.wait_ms(count);
        self.heard()
    }

    /// Waits for a message with this code; all messages up to it.
    pub(crate) fn until(&mut self, wanted: u16) -> Vec<String> {
        let mut messages = Vec::new();
        for _ in 0..PATIENCE_MS {
            let mut heard = self.heard();
            if let Some(position) = heard.iter().position(|message| code(message) == wanted) {
                self.kept = heard.split_off(position + 1);
                messages.append(&mut heard);
                return messages;
            }
            messages.append(&mut heard);
            self.wait_ms(1);
        }
        panic!("waited in vain for {wanted}: {messages:?}");
    }

    /// Sends a line that must be answered with one message; that message.
    pub(crate) fn ask(&mut self, line: &str) -> String {
        let mut messages = self.say(line);
        assert_eq!(messages.len(), 1, "{line}: {messages:?}");
        messages.remove(0)
    }

    /// What was heard on the monitoring port with this code, forgotten afterwards.
    pub(crate) fn monitored(&mut self, wanted: u16) -> Vec<String> {
        self.heard();
        let all = std::mem::take(&mut self.monitored);
        all.into_iter().filter(|message| code(message) == wanted).collect()
    }
}
