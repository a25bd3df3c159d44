//! Real-time data: what GetRt... and the optional messages carry, and which of them are asked for.
//!
//! Every response begins with the timestamp, as Table 2 has it, also where a chapter leaves it out
//! (2201, 2208, 2211, 2218, 2228, 2229).

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use super::dispatch::Refused;
use super::format;
use crate::sim::meca500::kinematics::{Configuration, Joints, turn_of};
use crate::sim::meca500::motion::JointState;
use crate::sim::meca500::robot::VirtualRobot;
use crate::sim::meca500::torque;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::dynamic::DynamicType;
use crate::wire::meca500::text::{Argument, ParsedCommand, Value};

/// The optional messages of the Meca500: code and name. Source: PM L3787-3805.
const OPTIONAL: [(u16, &str); 15] = [
    (2200, "TargetJointPos"),
    (2201, "TargetCartPos"),
    (2202, "TargetJointVel"),
    (2203, "TargetJointTorq"),
    (2204, "TargetCartVel"),
    (2210, "JointPos"),
    (2211, "CartPos"),
    (2212, "JointVel"),
    (2213, "JointTorq"),
    (2214, "CartVel"),
    (2218, "Conf"),
    (2219, "ConfTurn"),
    (2220, "Accel"),
    (2321, "GripperForce"),
    (2322, "GripperPos"),
];
/// A message of other robots, which SetRealTimeMonitoring takes by name all the same.
const VACUUM_PRESSURE: (u16, &str) = (2343, "VacuumPressure");
/// Messages that Table 3 marks as optional although the list lacks them.
const ALSO_TAKEN: [(u16, &str); 2] = [(2228, "Wrf"), (2229, "Trf")];

/// Which optional messages are sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct RealTimeSet(u32);

/// Every optional message in the order of the codes.
fn known() -> impl Iterator<Item = (u16, &'static str)> {
    let (frames, rest) = OPTIONAL.split_at(13);
    frames.iter().chain(&ALSO_TAKEN).chain(rest).copied().chain([VACUUM_PRESSURE])
}

impl RealTimeSet {
    /// All that this robot sends.
    const fn all() -> Self {
        Self((1 << (OPTIONAL.len() + ALSO_TAKEN.len())) - 1)
    }

    /// The codes in ascending order.
    pub(super) fn codes(self) -> impl Iterator<Item = Code> {
        known()
            .enumerate()
            .filter(move |(index, _)| self.0 >> index & 1 == 1)
            .map(|(_, (code, _))| Code(code))
    }

    /// Adds a message by its code or name. Returns whether there is such a message.
    fn add(&mut self, argument: Argument<'_>) -> bool {
        let text = match argument.value() {
            Value::Text(name) => name,
            _ => argument.text,
        };
        if text.eq_ignore_ascii_case("All") {
            *self = Self::all();
            return true;
        }
        let number: Option<u16> = text.parse().ok();
        let position = known()
            .position(|(code, name)| number == Some(code) || name.eq_ignore_ascii_case(text));
        if let Some(position) = position {
            self.0 |= 1 << position;
        }
        position.is_some()
    }
}

impl VirtualRobot {
    /// SetRealTimeMonitoring: replaces what was asked for before. Source: PM L3811.
    pub(super) fn set_real_time_monitoring(
        &mut self,
        parsed: &ParsedCommand<'_>,
    ) -> Result<(), Refused> {
        let mut set = RealTimeSet::default();
        for argument in parsed.arguments() {
            if !set.add(argument) {
                return Err(Code::ARGUMENT_ERROR.into());
            }
        }
        self.ask_for(set);
        Ok(())
    }

    /// SetRealTimeMonitoring without arguments: nothing optional is sent any more. Source: choice
    pub(super) fn clear_real_time_monitoring(&mut self) {
        self.ask_for(RealTimeSet::default());
    }

    fn ask_for(&mut self, set: RealTimeSet) {
        self.text.optional = set;
        self.text.shown_conf = None;
        self.text.shown_turn = None;
        self.answer_optional();
    }

    /// 2117: which optional messages are sent.
    pub(super) fn answer_optional(&mut self) {
        let codes: Vec<u16> = self.text.optional.codes().map(|code| code.0).collect();
        self.answer(Code(2117), &format::integers(codes));
    }

    /// Where the robot wants its tool: x, y, z in mm, alpha, beta, gamma in degrees, in the world
    /// frame.
    pub(super) fn target_pose(&self) -> Joints {
        self.motion_settings.frames.tool_of_joints(&self.target_joints()).to_xyz_euler()
    }

    /// The content of a real-time message, its timestamp first; `None` for a code that is none.
    pub(super) fn real_time_message(&self, code: Code) -> Option<String> {
        let payload = &self.motion_settings.payload;
        let six = |values: &Joints| format::real_time(values);
        let wide = |values: [f32; 6]| format::real_time(&values.map(f64::from));
        let content = match code.0 {
            2200 => six(&self.target_state().position),
            2201 => six(&self.target_pose()),
            2202 => six(&self.target_state().velocity),
            2203 => six(&torque::calculated(&self.target_state(), payload)),
            2204 => wide(self.dynamic_values(DynamicType::TARGET_CARTESIAN_VELOCITY)),
            2208 => configuration(&self.target_state()),
            2209 => format!("{}", turn_of(self.target_state().position[5])),
            2210 => six(&self.actual_state().position),
            2211 => {
                let joints = self.actual_state().position;
                six(&self.motion_settings.frames.tool_of_joints(&joints).to_xyz_euler())
            }
            2212 => six(&self.actual_state().velocity),
            2213 => six(&torque::actual(&self.target_state(), payload, &self.disturbance)),
            2214 => wide(self.dynamic_values(DynamicType::ACTUAL_CARTESIAN_VELOCITY)),
            2218 => configuration(&self.actual_state()),
            2219 => format!("{}", turn_of(self.actual_state().position[5])),
            2220 => {
                let [x, y, z, ..] = self.dynamic_values(DynamicType::ACCELEROMETER);
                format!("5,{}", format::integers([x, y, z].map(|value| value as i32)))
            }
            2228 => wide(self.motion_settings.wrf.into()),
            2229 => wide(self.motion_settings.trf.into()),
            2300 => format::integers(self.tool_numbers()),
            2310 => format::integers(self.tool.valves().map(u8::from)),
            2320 => {
                let state = self.gripper_state();
                let parts = [state.holding_part, state.target_reached, state.closed, state.open];
                format::integers(parts.map(u8::from))
            }
            2321 => format::real_time(&[self.gripper_state().force_percent]),
            2322 => format::real_time(&[self.gripper_state().opening_mm]),
            _ => return None,
        };
        Some(format!("{},{content}", self.text_timestamp()))
    }

    /// Answers with a real-time message.
    pub(super) fn answer_real_time(&mut self, code: u16) -> Result<(), Refused> {
        let content = self.real_time_message(Code(code)).ok_or(Code::COMMAND_FAILED)?;
        self.answer(Code(code), &content);
        Ok(())
    }

    /// A request for real-time data.
    pub(super) fn request_real_time(&mut self, parsed: &ParsedCommand<'_>) -> Result<(), Refused> {
        match parsed.spec.name {
            "GetRtTargetJointPos" => self.answer_real_time(2200),
            "GetRtTargetCartPos" => self.answer_real_time(2201),
            "GetRtTargetJointVel" => self.answer_real_time(2202),
            "GetRtTargetJointTorq" => self.answer_real_time(2203),
            "GetRtTargetCartVel" => self.answer_real_time(2204),
            "GetRtTargetConf" => self.answer_real_time(2208),
            "GetRtTargetConfTurn" => self.answer_real_time(2209),
            "GetRtJointPos" => self.answer_real_time(2210),
            "GetRtCartPos" => self.answer_real_time(2211),
            "GetRtJointVel" => self.answer_real_time(2212),
            "GetRtJointTorq" => self.answer_real_time(2213),
            "GetRtCartVel" => self.answer_real_time(2214),
            "GetRtConf" => self.answer_real_time(2218),
            "GetRtConfTurn" => self.answer_real_time(2219),
            "GetRtAccelerometer" => self.answer_real_time(2220),
            "GetRtWrf" => self.answer_real_time(2228),
            "GetRtTrf" => self.answer_real_time(2229),
            _ => self.request_state(parsed),
        }
    }

    fn request_state(&mut self, parsed: &ParsedCommand<'_>) -> Result<(), Refused> {
        let [number, ..] = parsed.numbers();
        let (code, content) = match parsed.spec.name {
            "GetStatusRobot" => (Code::STATUS_ROBOT, format::integers(self.status_numbers())),
            "GetTorqueLimitsStatus" => {
                (Code::TORQUE_LIMIT_STATUS, format::integers([u8::from(self.torque_exceeded)]))
            }
            "GetSafetyStopStatus" => self.safety_stop(number as u16),
            "GetRtc" => (Code(2140), format!("{}", self.rtc_s())),
            "GetCmdPendingCount" => {
                self.ready_for_motion()?;
                (Code(2080), format!("{}", self.pending_commands()))
            }
            "GetJoints" => (Code(2026), format::legacy(&self.target_joints())),
            "GetPose" => (Code(2027), format::legacy(&self.target_pose())),
            _ => return Err(Code::UNKNOWN_COMMAND.into()),
        };
        self.answer(code, &content);
        Ok(())
    }

    /// The state of one of the signals that GetSafetyStopStatus takes. Source: PM L5697.
    fn safety_stop(&self, asked: u16) -> (Code, String) {
        let [p_stop2, e_stop, reboot, _, dropped] = self.safety_numbers();
        let number = match Code(asked) {
            Code::P_STOP_2 => p_stop2,
            Code::E_STOP => e_stop,
            Code::REBOOTED => reboot,
            _ => dropped,
        };
        (Code(asked), format::integers([number]))
    }
}

fn configuration(state: &JointState) -> String {
    let Configuration { shoulder, elbow, wrist } = Configuration::of(&state.position);
    format::integers([shoulder, elbow, wrist])
}
