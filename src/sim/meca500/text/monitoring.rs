//! The periodic messages: positions, what SetRealTimeMonitoring asked for, and the mark of the
//! cycle's end.
//!
//! ```text
//! [2026][...] [2027][...] optional ones, in the order of their codes ... [2230][t]
//! ```
//!
//! A cycle that could not be kept, because time jumped, is left out. Source: PM L418, L767-864.

use alloc::format;
use alloc::string::String;

use super::face::Port;
use super::format;
use crate::sim::meca500::kinematics::{Configuration, turn_of};
use crate::sim::meca500::robot::VirtualRobot;
use crate::time::Instant;
use crate::wire::meca500::code::Code;

/// The end of a monitoring cycle.
const CYCLE_END: Code = Code(2230);

impl VirtualRobot {
    /// The messages of a monitoring cycle, if one is due.
    pub(super) fn tell_periodically(&mut self) {
        let now = self.now;
        if now < self.text.next_cycle || !self.is_online() {
            return;
        }
        let interval = u64::try_from(self.text.interval.as_nanos()).unwrap_or(u64::MAX).max(1);
        let late = now.as_nanos() - self.text.next_cycle.as_nanos();
        let skipped = late / interval;
        let next =
            self.text.next_cycle.as_nanos().saturating_add((skipped + 1).saturating_mul(interval));
        self.text.next_cycle = Instant::from_nanos(next);

        let joints = format::legacy(&self.target_joints());
        self.say(Port::Monitoring, Code(2026), &joints);
        let pose = format::legacy(&self.target_pose());
        self.say(Port::Monitoring, Code(2027), &pose);
        for code in self.text.optional.codes() {
            if let Some(content) = self.optional_message(code) {
                self.say(Port::Monitoring, code, &content);
            }
        }
        let time = format!("{}", self.text_timestamp());
        self.say(Port::Monitoring, CYCLE_END, &time);
    }

    /// One optional message; `None` for one that has not changed or that the tool does not give.
    fn optional_message(&mut self, code: Code) -> Option<String> {
        match code.0 {
            2218 | 2219 => self.changed_configuration(code),
            2321 | 2322 if !self.tool.is_gripper() => None,
            _ => self.real_time_message(code),
        }
    }

    /// 2218 and 2219, which are sent when they change. Source: PM L3800.
    fn changed_configuration(&mut self, code: Code) -> Option<String> {
        let joints = self.actual_state().position;
        let Configuration { shoulder, elbow, wrist } = Configuration::of(&joints);
        let differs = if code.0 == 2218 {
            let conf = [shoulder, elbow, wrist];
            self.text.shown_conf.replace(conf) != Some(conf)
        } else {
            let turn = turn_of(joints[5]);
            self.text.shown_turn.replace(turn) != Some(turn)
        };
        if !differs {
            return None;
        }
        self.real_time_message(code)
    }
}
