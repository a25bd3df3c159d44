//! Receiving commands: which are taken, which are refused, which act at once.
//!
//! Both faces of the robot, cyclic and text, hand their motion-related commands in here. A command
//! is looked at in this order: does it exist, are its arguments good, may it run in this state, is
//! there room. Source: PM L453, L2003-2007, L1020-1022.

use super::compile::{is_move, is_queued};
use super::kinematics::{MODEL_MAX, MODEL_MIN};
use super::motion_settings::MotionSettings;
use super::queue::Item;
use super::readings::{AnyStateInErrorMode, Refusal, SetVariableClass, StartProgramClass};
use super::robot::VirtualRobot;
use super::settings::{PStop2Mode, PersistentSettings};
use crate::wire::meca500::code::Code;
use crate::wire::meca500::command::{
    CommandKind, MotionCommand, Requirement, VelocityCommand, WorkZoneLimits,
};

/// Checkpoints above the manual's 8000 that the vendor's client keeps for itself. Source: client
const CLIENT_CHECKPOINTS: core::ops::RangeInclusive<u16> = 8001..=8191;

/// What became of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Executed, or added to the queue.
    Accepted,
    /// Refused with a code of Table 1.
    Refused(Code),
    /// Ignored: a safety stop is there (code 3032 on the text port).
    Stopped,
    /// Ignored: the queue is full.
    Full,
}

impl VirtualRobot {
    /// Receives a command.
    pub fn receive(&mut self, command: &MotionCommand) -> Verdict {
        let checked = self.check_arguments(command);
        self.receive_checked(command, checked)
    }

    /// Receives a command of the text port, which takes the checkpoints of the vendor's client too.
    pub(super) fn receive_by_text(&mut self, command: &MotionCommand) -> Verdict {
        let is_clients = matches!(
            command,
            MotionCommand::SetCheckpoint(number) if CLIENT_CHECKPOINTS.contains(number)
        );
        let checked = if is_clients { Ok(()) } else { self.check_arguments(command) };
        self.receive_checked(command, checked)
    }

    fn receive_checked(&mut self, command: &MotionCommand, checked: Result<(), Code>) -> Verdict {
        match checked.and_then(|()| self.judge(command)) {
            Ok(verdict) => verdict,
            Err(code) => {
                self.note_refusal(code);
                let starts_error = self.settings.readings.refusal == Refusal::StartsErrorMode;
                if starts_error && code != Code::IN_ERROR {
                    self.raise(code);
                }
                Verdict::Refused(code)
            }
        }
    }

    fn judge(&mut self, command: &MotionCommand) -> Result<Verdict, Code> {
        let Some(spec) = command.spec() else { return Err(Code::UNKNOWN_COMMAND) };
        self.check_state(spec.requires)?;
        self.check_tool(command)?;
        let waits = match spec.kind {
            CommandKind::Queued | CommandKind::Velocity => true,
            CommandKind::Variable => {
                self.settings.readings.set_variable == SetVariableClass::Queued
            }
            CommandKind::Instantaneous => {
                matches!(command, MotionCommand::StartProgram(_))
                    && self.settings.readings.start_program == StartProgramClass::Queued
            }
            CommandKind::NoMovement | CommandKind::Unknown => false,
        };
        if !waits {
            self.execute_now(command).map(|()| Verdict::Accepted)
        } else if self.refuses_for_safety() {
            Ok(Verdict::Stopped)
        } else if self.queue.space(self.settings.readings.compiled_commands) == 0 {
            Ok(Verdict::Full)
        } else {
            if let MotionCommand::StartProgram(number) = *command {
                self.program_commands(number)?;
            }
            self.queue.push(Item::Command(*command));
            Ok(Verdict::Accepted)
        }
    }

    /// P-Stop 2 in clear mode takes no motion command until it is reset. Source: PM L882.
    fn refuses_for_safety(&self) -> bool {
        self.safety.p_stop2.is_shown() && self.settings.persistent.p_stop2 == PStop2Mode::Clear
    }

    fn check_arguments(&self, command: &MotionCommand) -> Result<(), Code> {
        if let MotionCommand::Raw { id, .. } = command {
            // What decoding left raw is either no command of this robot or has bad arguments.
            let known = id.spec().is_some_and(|spec| spec.available);
            return Err(if known { Code::ARGUMENT_ERROR } else { Code::UNKNOWN_COMMAND });
        }
        let checked = match *command {
            // Beyond the limits is an error of the move (1007), not of the arguments.
            MotionCommand::MoveJoints(joints) => {
                return joints
                    .iter()
                    .all(|joint| joint.is_finite())
                    .then_some(())
                    .ok_or(Code::ARGUMENT_ERROR);
            }
            // As many arguments as the variable has are looked at when it is set.
            MotionCommand::SetVariable { .. } => Ok(()),
            _ => command.check(self.settings.revision),
        };
        checked.map_err(|_| Code::ARGUMENT_ERROR)?;
        match *command {
            MotionCommand::MoveGripper(opening)
                if self.tool.is_gripper() && f64::from(opening) > self.tool.range_mm() =>
            {
                Err(Code::ARGUMENT_ERROR)
            }
            // Faster only with all of the force. Source: PM L6616.
            MotionCommand::SetGripperVel(percent)
                if percent > 100.0 && self.gripper_force_to_be() < 100.0 =>
            {
                Err(Code::ARGUMENT_ERROR)
            }
            _ => Ok(()),
        }
    }

    /// The gripper force in force once what is queued has been executed, in percent.
    fn gripper_force_to_be(&self) -> f32 {
        self.queue.last_gripper_force().unwrap_or(self.motion_settings.gripper_force)
    }

    fn check_state(&self, requires: Requirement) -> Result<(), Code> {
        match requires {
            // "Any state" (PM L3970, L6734) against "every later command" (PM L872).
            Requirement::AnyState
                if self.error != Code(0)
                    && self.settings.readings.any_state_in_error_mode
                        == AnyStateInErrorMode::Refused =>
            {
                Err(Code::IN_ERROR)
            }
            Requirement::AnyState | Requirement::NotStated => Ok(()),
            Requirement::Deactivated | Requirement::BeforeActivation => {
                if self.has_motors_on() || self.is_busy() {
                    Err(Code::DEACTIVATION_NEEDED)
                } else {
                    Ok(())
                }
            }
            Requirement::ReadyForMotion
            | Requirement::ActivatedAndHomed
            | Requirement::ReadyAndHomed => {
                self.ready_for_motion()?;
                if requires == Requirement::ReadyAndHomed && !self.is_homed() {
                    return Err(Code::NOT_HOMED);
                }
                if self.error != Code(0) {
                    return Err(Code::IN_ERROR);
                }
                Ok(())
            }
        }
    }

    fn check_tool(&self, command: &MotionCommand) -> Result<(), Code> {
        let is_gripper = self.tool.is_gripper();
        let is_module = self.tool.kind() == super::settings::FittedTool::Mpm500;
        match command {
            MotionCommand::Gripper(_) if !is_gripper && !is_module => Err(Code::NO_GRIPPER),
            MotionCommand::MoveGripper(_) if !is_gripper => Err(Code::NO_GRIPPER),
            MotionCommand::SetValveState(_) if !is_module => Err(Code::NO_PNEUMATIC_MODULE),
            _ => Ok(()),
        }
    }

    /// Executes a command that acts at once.
    pub(super) fn execute_now(&mut self, command: &MotionCommand) -> Result<(), Code> {
        let persistent = &mut self.settings.persistent;
        match *command {
            MotionCommand::SetTimeScaling(percent) => {
                self.boot.time_scaling_percent = percent;
                self.clock.set_time_scaling(f64::from(percent) / 100.0);
                if !self.is_underway() {
                    self.clock.settle();
                }
            }
            MotionCommand::StartProgram(number) => return self.start_program(number),
            MotionCommand::SetJointLimits { n, q_min, q_max } => {
                let index = usize::from(n.clamp(1, 6)) - 1;
                let restores = q_min == 0.0 && q_max == 0.0;
                let (min, max) = if restores {
                    (MODEL_MIN[index], MODEL_MAX[index])
                } else {
                    (q_min.into(), q_max.into())
                };
                persistent.user_joint_limits.min[index] = min;
                persistent.user_joint_limits.max[index] = max;
            }
            MotionCommand::SetJointLimitsCfg(enabled) => persistent.joint_limits_enabled = enabled,
            MotionCommand::SetWorkZoneCfg { severity, mode } => {
                persistent.work_zone_severity = severity;
                persistent.work_zone_mode = mode;
            }
            MotionCommand::SetWorkZoneLimits(limits) => set_work_zone(persistent, limits),
            MotionCommand::SetCollisionCfg(severity) => persistent.collision_severity = severity,
            MotionCommand::SetToolSphere(sphere) => {
                persistent.tool_sphere = [sphere.x, sphere.y, sphere.z, sphere.r].map(f64::from);
            }
            MotionCommand::SetCalibrationCfg(enabled) => persistent.calibration_enabled = enabled,
            MotionCommand::RebootRobot => self.reboot(),
            MotionCommand::ClearHoming => self.arm_homed = false,
            MotionCommand::SetVariable { cyclic_id, values, .. } => {
                return self.variables.set_from_arguments(cyclic_id, &values);
            }
            _ => {}
        }
        Ok(())
    }

    /// StartProgram, class immediate: the program's commands enter the queue at its end.
    ///
    /// # Errors
    ///
    /// 3017 or 3020 for a program that is not there or invalid, 1000 when the queue lacks the room,
    /// 1005, 1006, 1011, or 1040 while P-Stop 2 refuses commands.
    pub fn start_program(&mut self, number: u16) -> Result<(), Code> {
        self.check_state(Requirement::ActivatedAndHomed)?;
        if self.refuses_for_safety() {
            return Err(Code::COMMAND_FAILED);
        }
        let commands = self.program_commands(number)?;
        if commands.len() > self.queue.space(self.settings.readings.compiled_commands) {
            return Err(Code::COMMAND_BUFFER_FULL);
        }
        self.queue.push(Item::ProgramBegin(number));
        for command in commands {
            self.queue.push(Item::Command(command));
        }
        self.queue.push(Item::ProgramEnd(number));
        Ok(())
    }

    /// The Start/Stop button: program 1, once or again and again. Source: PM L3719.
    pub(super) fn start_by_button(&mut self) -> Result<(), Code> {
        self.start_program(1)?;
        if self.settings.persistent.offline_program_loop {
            self.queue.push(Item::ProgramAgain);
        }
        Ok(())
    }

    /// StartProgram, class queued: its turn has come to be compiled.
    pub(super) fn expand_program(&mut self, number: u16) {
        let Ok(commands) = self.program_commands(number) else { return };
        let items = core::iter::once(Item::ProgramBegin(number))
            .chain(commands.into_iter().map(Item::Command))
            .chain(core::iter::once(Item::ProgramEnd(number)));
        let mut all: alloc::vec::Vec<Item> = items.collect();
        self.queue.insert_front(all.drain(..));
    }

    /// A command with MoveID 0 and SetPoint 1: velocity commands act, moves are queued in every
    /// cycle, the rest follows the reading. Source: PM L1044, L1063.
    pub(super) fn receive_cyclic(&mut self, command: &MotionCommand) {
        use super::readings::ConfigurationWithoutMoveId;
        if let Ok(velocity) = VelocityCommand::try_from(*command) {
            let is_good = velocity.check(self.settings.revision).is_ok();
            if is_good && self.check_state(Requirement::ReadyForMotion).is_ok() {
                self.velocity_command(velocity);
            }
            return;
        }
        let repeats = self.settings.readings.configuration_without_move_id
            == ConfigurationWithoutMoveId::EachCycle;
        if is_move(command) || repeats {
            self.receive(command);
        }
    }

    /// The settings in force: the values of the last queued settings that were executed.
    #[must_use]
    pub const fn motion_settings(&self) -> &MotionSettings {
        &self.motion_settings
    }

    /// Whether an offline program may hold the command.
    pub(super) fn may_be_in_program(command: &MotionCommand) -> bool {
        is_queued(command)
            || VelocityCommand::try_from(*command).is_ok()
            || matches!(
                command,
                MotionCommand::SetTimeScaling(_) | MotionCommand::SetVariable { .. }
            )
    }
}

fn set_work_zone(persistent: &mut PersistentSettings, limits: WorkZoneLimits) {
    if limits == WorkZoneLimits::default() {
        persistent.work_zone_min = PersistentSettings::FACTORY_WORK_ZONE_MIN;
        persistent.work_zone_max = PersistentSettings::FACTORY_WORK_ZONE_MAX;
    } else {
        let WorkZoneLimits { x_min, y_min, z_min, x_max, y_max, z_max } = limits;
        persistent.work_zone_min = [x_min, y_min, z_min].map(f64::from);
        persistent.work_zone_max = [x_max, y_max, z_max].map(f64::from);
    }
}
