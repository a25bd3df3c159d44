//! What the robot says by itself: events, safety signals, ends of movement and of block.
//!
//! Called after each step of the robot's life and after each command. Several things that happen in
//! one step are told in this order: safety signals that appear, what happened (in its order), 3004
//! and 3012, safety signals that go, the state on the monitoring port, periodic messages. So an
//! E-Stop reads 3070, 3040, 2044, 2004 and a resumption 2043, 3032, as the manual prints them.
//! Source: PM L878-922.

use alloc::string::String;

use super::face::Port;
use super::format;
use super::status::Shown;
use crate::sim::meca500::event::RobotEvent;
use crate::sim::meca500::lifecycle::Lifecycle;
use crate::sim::meca500::readings::ConnectionDropCode;
use crate::sim::meca500::robot::VirtualRobot;
use crate::wire::meca500::code::Code;

impl VirtualRobot {
    /// Says what has happened since the last call.
    pub(in crate::sim::meca500) fn observe_text(&mut self) {
        if !self.text.listens {
            return;
        }
        self.watch_connection();
        self.log_beginnings();
        if !self.is_online() {
            // Nobody is connected; what changes meanwhile is told after the boot.
            return;
        }
        let new = self.shown_state();
        let Some(old) = self.text.shown.replace(new) else { return };
        self.tell_safety(&old, &new, |before, now| now == 1 || (now == 2 && before == 0));
        while let Some(event) = self.events.pop_for_text() {
            self.tell_event(event);
        }
        self.tell_failed_activation();
        self.tell_stops();
        self.tell_safety(&old, &new, |before, now| now == 0 || (now == 2 && before == 1));
        if old.excessive_torque != new.excessive_torque {
            let number = format::integers([u8::from(new.excessive_torque)]);
            self.say(Port::Both, Code::TORQUE_LIMIT_STATUS, &number);
        }
        if old != new {
            let mut messages = alloc::vec::Vec::new();
            self.tell_changes(Some(&old), &new, &mut |code, content| {
                messages.push((code, String::from(content)));
            });
            for (code, content) in messages {
                self.say(Port::Monitoring, code, &content);
            }
        }
        self.tell_variables();
        self.end_dump();
        self.tell_periodically();
    }

    fn tell_safety(&mut self, old: &Shown, new: &Shown, tells: impl Fn(u8, u8) -> bool) {
        let codes = self.safety_codes();
        for ((code, before), now) in codes.into_iter().zip(old.safety).zip(new.safety) {
            if before != now && tells(before, now) {
                self.say(Port::Both, code, &format::integers([now]));
            }
        }
    }

    /// The code of the signal of a dropped connection.
    pub(super) const fn connection_drop_code(&self) -> Code {
        match self.settings.readings.connection_drop_code {
            ConnectionDropCode::Tables => Code::CONNECTION_DROPPED,
            ConnectionDropCode::Section4 => Code::CONNECTION_DROPPED_TEXT,
        }
    }

    fn tell_event(&mut self, event: RobotEvent) {
        match event {
            RobotEvent::CheckpointReached(number) => {
                self.say(Port::Both, Code::CHECKPOINT_REACHED, &format::integers([number]));
            }
            RobotEvent::CheckpointDiscarded(number) => {
                self.say(Port::Both, Code::CHECKPOINT_DISCARDED, &format::integers([number]));
            }
            // What the command in progress was answered with is not said twice.
            RobotEvent::Error(code) if self.text.answered.contains(&code) => {}
            // A command was answered; other refusals come from programs in the queue.
            RobotEvent::Refused(_) if self.text.in_command => {}
            RobotEvent::Error(code) | RobotEvent::Refused(code) => {
                self.tell_own(Port::Control, code);
            }
            // Torque, work zone and collision are told with the state.
            RobotEvent::Warning(Code::MOVE_DURATION_TOO_SHORT) => {
                self.tell_own(Port::Control, Code::MOVE_DURATION_TOO_SHORT);
            }
            RobotEvent::Warning(_) => {}
            RobotEvent::MotionPaused => self.tell_own(Port::Control, Code::MOTION_PAUSED),
            RobotEvent::MotionCleared if self.text.answered.contains(&Code::MOTION_CLEARED) => {
                self.tell_own(Port::Monitoring, Code::MOTION_CLEARED);
            }
            RobotEvent::MotionCleared => self.tell_own(Port::Both, Code::MOTION_CLEARED),
            RobotEvent::MotionResumed => {
                self.text.tells_next_stop = false;
                self.tell_own(Port::Control, Code::MOTION_RESUMED);
            }
            RobotEvent::Activated => {
                self.text.awaits_activation = false;
                self.tell_own(Port::Control, Code::MOTORS_ACTIVATED);
            }
            RobotEvent::Homed => self.tell_own(Port::Control, Code::HOMING_DONE),
            RobotEvent::Deactivated => self.tell_own(Port::Control, Code::MOTORS_DEACTIVATED),
            // StartProgram was answered when it came.
            RobotEvent::ProgramStarted(_) => {}
            RobotEvent::ProgramEnded(_) => {
                self.tell_own(Port::Control, Code::END_OF_OFFLINE_PROGRAM);
            }
            RobotEvent::RecoveryCap => self.tell_own(Port::Both, Code(2051)),
        }
    }

    /// A code with the robot's own message.
    fn tell_own(&mut self, port: Port, code: Code) {
        let message = format::message(code, None);
        self.say(port, code, &message);
    }

    /// An activation that a safety stop has ended.
    fn tell_failed_activation(&mut self) {
        let is_under_way = matches!(self.lifecycle, Lifecycle::Activating | Lifecycle::Activated);
        if self.text.awaits_activation && !is_under_way {
            self.text.awaits_activation = false;
            self.tell_own(Port::Control, Code::ACTIVATION_FAILED);
        }
    }

    /// 3004 and 3012. Homing is no movement that anybody commanded; a deactivated robot has no
    /// block to end. Source: PM L1935-1937, L3540-3590.
    fn tell_stops(&mut self) {
        let moves = self.is_moving() && self.lifecycle == Lifecycle::Activated;
        let ended = self.is_block_ended() || self.lifecycle != Lifecycle::Activated;
        let has_stopped = self.text.moved && !moves;
        let has_ended = !self.text.was_block && ended;
        self.text.moved = moves;
        self.text.was_block = ended;
        if self.lifecycle != Lifecycle::Activated {
            self.text.tells_next_stop = false;
            return;
        }
        if has_stopped {
            let asked_for = core::mem::take(&mut self.text.tells_next_stop);
            if asked_for || self.text.tells_end_of_movement {
                self.tell_own(Port::Control, Code::END_OF_MOVEMENT);
            }
        }
        if has_ended && self.text.tells_end_of_block {
            self.tell_own(Port::Control, Code::END_OF_BLOCK);
        }
    }
}
