//! The robot's state as 2007 and its companions tell it: what is sent on the monitoring port when
//! it changes, and to whoever connects there.
//!
//! Source: PM Table 3. Its column of ticks is unreliable; sent on change is what it marks so and what
//! is neither periodic nor optional.

use alloc::format;
use alloc::string::String;

use super::format;
use crate::sim::meca500::kinematics::{Configuration, turn_of};
use crate::sim::meca500::robot::VirtualRobot;
use crate::sim::meca500::safety::Signal;
use crate::sim::meca500::settings::{FittedTool, SimulationType};
use crate::sim::meca500::zones::Object;
use crate::wire::meca500::code::Code;

/// Numbers of a safety signal: 0 off, 1 present, 2 to be reset. Source: PM L739.
pub(super) const fn signal_number(signal: Signal) -> u8 {
    match signal {
        Signal::Off => 0,
        Signal::Present => 1,
        Signal::Resettable => 2,
    }
}

/// What the ports tell of the robot, as plain values that can be compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shown {
    status: [u8; 7],
    time_scaling: f32,
    recovery_mode: bool,
    gripper: [u8; 6],
    tool_version: bool,
    zone_cfg: [f32; 2],
    zone_limits: [f64; 6],
    tool_sphere: [f64; 4],
    collision_cfg: f32,
    collision: [u32; 5],
    breach: [u32; 3],
    move_mode: f32,
    conf: [i8; 3],
    turn: i32,
    checkpoint: u16,
    tool: [u32; 5],
    valves: [bool; 2],
    gripper_state: [bool; 4],
    pub(super) excessive_torque: bool,
    /// P-Stop 2, E-Stop, reboot, redundancy fault, dropped connection.
    pub(super) safety: [u8; 5],
}

impl VirtualRobot {
    /// 2007: activated, homed, simulated, in error, paused, end of block, end of motion.
    pub(super) fn status_numbers(&self) -> [u8; 7] {
        let simulation = match (self.simulating, self.simulation_type()) {
            (false, _) => 0,
            (true, SimulationType::Normal) => 1,
            (true, SimulationType::Fast) => 2,
        };
        // Paused in error mode too, whatever the cyclic bit says. Source: PM L5734.
        let in_error = self.error != Code(0);
        [
            u8::from(self.has_motors_on()),
            u8::from(self.is_homed()),
            simulation,
            u8::from(in_error),
            u8::from(self.is_paused() || in_error),
            u8::from(self.is_block_ended()),
            u8::from(!self.is_moving()),
        ]
    }

    /// Code and number of each safety signal, in the order of their codes.
    pub(super) fn safety_numbers(&self) -> [u8; 5] {
        let safety = &self.safety;
        [
            signal_number(safety.p_stop2),
            signal_number(safety.e_stop),
            signal_number(safety.reboot),
            u8::from(safety.redundancy_fault),
            signal_number(safety.connection_dropped),
        ]
    }

    /// The code of each of [`safety_numbers`](Self::safety_numbers).
    pub(super) fn safety_codes(&self) -> [Code; 5] {
        let dropped = self.connection_drop_code();
        [Code::P_STOP_2, Code::E_STOP, Code::REBOOTED, Code::REDUNDANCY_FAULT, dropped]
    }

    /// What the ports tell, as it is now.
    pub(super) fn shown_state(&self) -> Shown {
        let persistent = &self.settings.persistent;
        let ([a, b, c], [d, e, f]) = (persistent.work_zone_min, persistent.work_zone_max);
        let joints = self.target_joints();
        let Configuration { shoulder, elbow, wrist } = Configuration::of(&joints);
        let state = self.gripper_state();
        Shown {
            status: self.status_numbers(),
            time_scaling: self.boot.time_scaling_percent,
            recovery_mode: self.boot.recovery_mode,
            gripper: self.legacy_gripper(),
            tool_version: self.tool.fitted() == FittedTool::None,
            zone_cfg: [
                persistent.work_zone_severity.to_real(),
                persistent.work_zone_mode.to_real(),
            ],
            zone_limits: [a, b, c, d, e, f],
            tool_sphere: persistent.tool_sphere,
            collision_cfg: persistent.collision_severity.to_real(),
            collision: self.collision_numbers(),
            breach: self.breach_numbers(),
            move_mode: self.motion_settings.move_mode.to_real(),
            conf: [shoulder, elbow, wrist],
            turn: turn_of(joints[5]),
            checkpoint: self.checkpoint_reached,
            tool: self.tool_numbers(),
            valves: self.tool.valves(),
            gripper_state: [state.holding_part, state.target_reached, state.closed, state.open],
            excessive_torque: self.torque_exceeded,
            safety: self.safety_numbers(),
        }
    }

    /// 2182: whether there is a collision, and group and number of the two objects.
    pub(super) fn collision_numbers(&self) -> [u32; 5] {
        self.collision_event.map_or([0; 5], |[one, other]| {
            let Object { group: a, id: b } = one;
            let Object { group: c, id: d } = other;
            [1, a, b, c, d]
        })
    }

    /// 2183: whether the work zone is breached, and group and number of the object.
    pub(super) fn breach_numbers(&self) -> [u32; 3] {
        self.zone_event.map_or([0; 3], |Object { group, id }| [1, group, id])
    }

    /// 2300 without its timestamp.
    pub(super) fn tool_numbers(&self) -> [u32; 5] {
        let emulated = self.tool.emulated().map_or(0, FittedTool::number);
        let overheated = u32::from(self.tool.overheated);
        let homed = u32::from(self.tool.is_homed());
        [emulated, self.tool.fitted().number(), homed, overheated, overheated]
    }

    /// 2079: gripper present, homed, holding a part, at its target or at an end of its range, in
    /// error, overheated. The manual names the fields by two letters only. Source: client
    pub(super) fn legacy_gripper(&self) -> [u8; 6] {
        if !self.tool.is_gripper() {
            return [0; 6];
        }
        let state = self.gripper_state();
        let has_arrived = state.target_reached || state.closed || state.open;
        let hot = self.tool.overheated;
        [true, self.tool.is_homed(), state.holding_part, has_arrived, hot, hot].map(u8::from)
    }

    /// Says which parts of the state differ from what was told; everything if nothing was.
    pub(super) fn tell_changes(
        &self,
        old: Option<&Shown>,
        new: &Shown,
        each: &mut dyn FnMut(Code, &str),
    ) {
        let time = self.text_timestamp();
        let mut tell = |code: u16, differs: bool, content: &dyn Fn() -> String| {
            if differs {
                each(Code(code), &content());
            }
        };
        macro_rules! differs {
            ($($field:ident)+) => {
                old.is_none_or(|old| $(old.$field != new.$field)||+)
            };
        }
        // Before 2007: the vendor's client takes the recovery mode of a new connection from here only
        // as long as it knows no status. Source: client
        if differs!(recovery_mode) {
            let code = if new.recovery_mode { Code(2049) } else { Code(2050) };
            tell(code.0, true, &|| format::message(code, None));
        }
        tell(2007, differs!(status), &|| format::integers(new.status));
        tell(2015, differs!(time_scaling), &|| format::number(new.time_scaling));
        let is_gripper = self.tool.is_gripper();
        tell(2079, differs!(gripper), &|| format::integers(new.gripper));
        tell(2086, differs!(tool_version), &|| self.tool_version());
        tell(2163, differs!(zone_cfg), &|| format::numbers(new.zone_cfg));
        let narrow = |value: f64| value as f32;
        tell(2165, differs!(zone_limits), &|| format::numbers(new.zone_limits.map(narrow)));
        tell(2167, differs!(tool_sphere), &|| format::numbers(new.tool_sphere.map(narrow)));
        tell(2181, differs!(collision_cfg), &|| format::number(new.collision_cfg));
        tell(2182, differs!(collision), &|| format::integers(new.collision));
        tell(2183, differs!(breach), &|| format::integers(new.breach));
        tell(2189, differs!(move_mode), &|| format::number(new.move_mode));
        tell(2208, differs!(conf), &|| format!("{time},{}", format::integers(new.conf)));
        tell(2209, differs!(turn), &|| format!("{time},{}", new.turn));
        tell(2227, differs!(checkpoint), &|| format!("{time},{}", new.checkpoint));
        tell(2300, differs!(tool), &|| format!("{time},{}", format::integers(new.tool)));
        let is_module = self.tool.kind() == FittedTool::Mpm500;
        tell(2310, is_module && differs!(valves tool), &|| {
            format!("{time},{}", format::integers(new.valves.map(u8::from)))
        });
        tell(2320, is_gripper && differs!(gripper_state tool), &|| {
            format!("{time},{}", format::integers(new.gripper_state.map(u8::from)))
        });
    }

    /// What a new monitoring connection is told: who the robot is, and all of its state.
    pub(super) fn tell_everything(&self, each: &mut dyn FnMut(Code, &str)) {
        each(Code::CONNECTED, &self.greeting());
        each(Code(2082), &self.full_firmware_version());
        each(Code(2095), &self.settings.network.robot_name);
        let state = self.shown_state();
        self.tell_changes(None, &state, each);
        let torque = format::integers([u8::from(state.excessive_torque)]);
        each(Code::TORQUE_LIMIT_STATUS, &torque);
        for (code, number) in self.safety_codes().into_iter().zip(state.safety) {
            each(code, &format::integers([number]));
        }
    }
}
