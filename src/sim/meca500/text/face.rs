//! What the text face remembers: who listens, what was said, what is to be said.

use alloc::collections::VecDeque;
use alloc::string::String;
use alloc::vec::Vec;

use super::log::{Log, LogKind};
use super::outbox::Outbox;
use super::program::Saving;
use super::protocol::Controller;
use super::real_time::RealTimeSet;
use super::status::Shown;
use crate::sim::meca500::robot::VirtualRobot;
use crate::time::{Duration, Instant};
use crate::wire::meca500::code::Code;

/// SetMonitoringInterval before anybody sends it. Source: PM L3683.
const DEFAULT_INTERVAL: Duration = Duration::from_millis(15);

/// Who is told something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Port {
    /// The controlling connection.
    Control,
    /// Both ports, once each.
    Both,
    /// The monitoring port, and the control port where it wants copies. What a command in progress
    /// has already been answered with is not copied.
    Monitoring,
}

/// The text face of a robot.
#[derive(Clone, Debug)]
pub(in crate::sim::meca500) struct TextFace {
    /// Whether anybody ever used the face.
    pub(super) listens: bool,
    pub(super) control: Outbox,
    pub(super) monitoring: Outbox,
    pub(super) controller: Option<Controller>,
    /// SetEob.
    pub(super) tells_end_of_block: bool,
    /// SetEom.
    pub(super) tells_end_of_movement: bool,
    /// SetCtrlPortMonitoring.
    pub(super) copies_monitoring: bool,
    /// SetMonitoringInterval.
    pub(super) interval: Duration,
    /// SetRealTimeMonitoring.
    pub(super) optional: RealTimeSet,
    /// When the next periodic messages are due.
    pub(super) next_cycle: Instant,
    /// What the ports were last told of the robot's state.
    pub(super) shown: Option<Shown>,
    /// Configuration in the last optional message 2218, which is sent when it changes.
    pub(super) shown_conf: Option<[i8; 3]>,
    /// Turn in the last optional message 2219, likewise.
    pub(super) shown_turn: Option<i32>,
    pub(super) moved: bool,
    pub(super) was_block: bool,
    /// PauseMotion was answered while the arm moved, so that its stop is told.
    pub(super) tells_next_stop: bool,
    pub(super) awaits_activation: bool,
    /// The codes that the command in progress was answered with.
    pub(super) answered: Vec<Code>,
    pub(super) in_command: bool,
    /// ConnectionWatchdog: when it runs out.
    pub(super) watchdog: Option<Instant>,
    pub(super) drops_control: bool,
    pub(super) saving: Option<Saving>,
    /// Lines that wait for the end of an activation, homing or deactivation.
    pub(super) waiting: VecDeque<String>,
    /// SetVariablesMonitoring.
    pub(super) tells_variables: bool,
    /// The robot's log.
    pub(super) log: Log,
    /// TcpDump: when it ends.
    pub(super) dump_ends: Option<Instant>,
    /// SetNetworkOptions as the last boot found it.
    pub(super) keep_alive_packets: u8,
    /// Bus that carried the images before SwitchToEtherCat.
    pub(super) bus_before: Option<crate::sim::meca500::settings::CyclicBus>,
}

impl TextFace {
    /// The face after a boot.
    pub(in crate::sim::meca500) fn new(keep_alive_packets: u8) -> Self {
        Self {
            listens: false,
            control: Outbox::default(),
            monitoring: Outbox::default(),
            controller: None,
            tells_end_of_block: true,
            tells_end_of_movement: false,
            copies_monitoring: false,
            interval: DEFAULT_INTERVAL,
            optional: RealTimeSet::default(),
            next_cycle: Instant::ZERO,
            shown: None,
            shown_conf: None,
            shown_turn: None,
            moved: false,
            was_block: true,
            tells_next_stop: false,
            awaits_activation: false,
            answered: Vec::new(),
            in_command: false,
            watchdog: None,
            drops_control: false,
            saving: None,
            waiting: VecDeque::new(),
            tells_variables: false,
            log: Log::default(),
            dump_ends: None,
            keep_alive_packets,
            bus_before: None,
        }
    }

    /// A boot: settings go back to what they are after one; who is connected shows when the server
    /// closes the ports.
    pub(in crate::sim::meca500) fn forget(&mut self, keep_alive_packets: u8) {
        let before = core::mem::replace(self, Self::new(keep_alive_packets));
        self.listens = before.listens;
        self.controller = before.controller;
        self.shown = before.shown;
        self.next_cycle = before.next_cycle;
        self.bus_before = before.bus_before;
        self.log = before.log.after_boot();
    }

    /// Nanoseconds until the face has something to do; `None` if it has not.
    pub(in crate::sim::meca500) fn due_in(&self, now: Instant) -> Option<u64> {
        if !self.listens {
            return None;
        }
        [Some(self.next_cycle), self.watchdog, self.dump_ends]
            .into_iter()
            .flatten()
            .map(|due| due.as_nanos().saturating_sub(now.as_nanos()))
            .filter(|nanos| *nanos > 0)
            .min()
    }

    /// Whether somebody controls the robot over the control port.
    pub(super) fn has_control(&self) -> bool {
        self.controller == Some(Controller::Text)
    }
}

impl VirtualRobot {
    /// Somebody uses the face.
    pub(super) fn listen_to_text(&mut self) {
        if !self.text.listens {
            self.text.listens = true;
            self.events.listen_for_text();
            self.text.shown = Some(self.shown_state());
            self.text.next_cycle = self.now + self.text.interval;
            self.text.moved = self.is_moving();
            self.text.was_block = self.is_block_ended();
        }
    }

    /// Puts a message into the outboxes that it is for.
    pub(super) fn say(&mut self, port: Port, code: Code, content: &str) {
        let text = &mut self.text;
        let message = alloc::format!("[{}][{content}]", code.0);
        let is_copied = text.copies_monitoring && !text.answered.contains(&code);
        let to_control = match port {
            Port::Control | Port::Both => true,
            Port::Monitoring => is_copied,
        };
        let is_sent = to_control && text.has_control();
        if is_sent {
            text.control.push(message.clone());
        }
        if is_sent && port != Port::Monitoring && text.log.logs_commands() {
            self.write_log(LogKind::Sent, &message);
        }
        if port != Port::Control {
            self.text.monitoring.push(message);
        }
    }

    /// Answers the command in progress.
    pub(super) fn answer(&mut self, code: Code, content: &str) {
        self.text.answered.push(code);
        self.say(Port::Control, code, content);
    }

    /// Time of a message: microseconds of the robot's monotonic clock.
    pub(super) fn text_timestamp(&self) -> u64 {
        let since = self.now - self.timestamp_origin;
        u64::try_from(since.as_micros()).unwrap_or(u64::MAX)
    }
}
