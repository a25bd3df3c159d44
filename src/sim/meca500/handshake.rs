//! MoveID and SetPoint as the robot sees them.
//!
//! ```text
//! SetPoint 0: nothing is looked at
//! SetPoint 1, MoveID 0: the command acts in every cycle (velocity mode)
//! SetPoint 1, MoveID new: the command is received once, and MoveID returned
//! ```
//!
//! What "new" means, and what is returned for a command that is not taken, are readings.
//! Source: PM L1003-1064, L1121-1135, L1422.

use super::cyclic::Outputs;
use super::readings::{
    EchoInCyclicMode, FullQueue, MoveIdTrigger, NoMovementCommand, Readings, RefusalCode,
    RefusedCommand, SetPointDrop, TooManyValues, UseVariablesOnEtherCat, VelocityWithMoveId,
    ZeroVariableId,
};
use super::receive::Verdict;
use super::robot::VirtualRobot;
use super::settings::CyclicBus;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::command::{MotionCommand, MotionCommandId, VelocityCommand};
use crate::wire::meca500::image::MotionControlFlags;

/// What the robot remembers of the handshake.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Handshake {
    /// MoveID in the inputs.
    echo: u16,
    /// The last MoveID that counts as seen.
    seen: u16,
    /// MoveID of the previous cycle.
    previous: u16,
    /// SetPoint of the previous cycle.
    had_set_point: bool,
    /// Whether MoveID was 0 with SetPoint 1 in the previous cycle.
    was_cyclic: bool,
}

impl Handshake {
    /// A connection begins; `echo` replaces the MoveID returned.
    pub(super) fn connect(&mut self, echo: Option<u16>) {
        self.echo = echo.unwrap_or(self.echo);
    }

    /// The connection is lost.
    pub(super) const fn disconnect(&mut self, forget: bool) {
        self.had_set_point = false;
        self.was_cyclic = false;
        self.previous = 0;
        if forget {
            self.seen = 0;
        }
    }

    /// MoveID of the inputs.
    pub(super) const fn echo(&self) -> u16 {
        self.echo
    }

    /// Whether `move_id`, with SetPoint 1, is new.
    fn is_new(&self, move_id: u16, readings: &Readings) -> bool {
        match readings.move_id_trigger {
            MoveIdTrigger::LastAccepted => move_id != self.seen,
            MoveIdTrigger::PreviousCycle => move_id != self.previous,
            MoveIdTrigger::PreviousCycleWithSetPoint => {
                self.had_set_point && move_id != self.previous
            }
        }
    }
}

impl VirtualRobot {
    /// Looks at MoveID, SetPoint and the command of this cycle.
    pub(super) fn take_command(&mut self, outputs: &Outputs) {
        let set_point = outputs.motion_control.contains(MotionControlFlags::SET_POINT);
        let is_cyclic = set_point && outputs.move_id == 0;
        if self.face.handshake.was_cyclic && !is_cyclic {
            self.end_cyclic_mode();
        }
        let is_new = self.face.handshake.is_new(outputs.move_id, &self.settings.readings);
        if is_cyclic {
            if self.settings.readings.echo_in_cyclic_mode == EchoInCyclicMode::Zero {
                self.face.handshake.echo = 0;
            }
            if let Ok(command) = self.command_of(outputs) {
                self.receive_cyclic(&command);
            }
        } else if set_point && is_new {
            self.take_new(outputs);
        }
        let handshake = &mut self.face.handshake;
        if is_cyclic {
            // Zero is a MoveID too: the one before it is new again.
            handshake.seen = 0;
        }
        handshake.previous = outputs.move_id;
        handshake.had_set_point = set_point;
        handshake.was_cyclic = is_cyclic;
    }

    fn end_cyclic_mode(&mut self) {
        if self.settings.readings.set_point_drop == SetPointDrop::StopsAtOnce {
            self.stop_velocity();
        }
    }

    fn take_new(&mut self, outputs: &Outputs) {
        let readings = self.settings.readings;
        let verdict = match self.command_of(outputs) {
            Ok(command) => self.take_command_once(&command, &readings),
            Err(code) => {
                self.note_refusal(code);
                Taken { seen: true, echo: readings.refused_command == RefusedCommand::Acknowledged }
            }
        };
        if verdict.seen {
            self.face.handshake.seen = outputs.move_id;
        }
        if verdict.echo {
            self.face.handshake.echo = outputs.move_id;
        }
    }

    fn take_command_once(&mut self, command: &MotionCommand, readings: &Readings) -> Taken {
        let acknowledged = readings.refused_command == RefusedCommand::Acknowledged;
        if *command == MotionCommand::NoMovement {
            let echo = readings.no_movement == NoMovementCommand::Acknowledged;
            return Taken { seen: true, echo };
        }
        let is_velocity = VelocityCommand::try_from(*command).is_ok();
        if is_velocity && readings.velocity_with_move_id == VelocityWithMoveId::Ignored {
            return Taken { seen: true, echo: true };
        }
        match self.receive(command) {
            Verdict::Accepted => {
                if readings.refusal_code == RefusalCode::ShownUntilReset
                    && self.failed_activation == Code(0)
                {
                    self.shown_code = Code(0);
                }
                Taken { seen: true, echo: true }
            }
            Verdict::Refused(_) | Verdict::Stopped => Taken { seen: true, echo: acknowledged },
            Verdict::Full => {
                let lost = readings.full_queue == FullQueue::AcknowledgedAndLost;
                Taken { seen: lost, echo: lost }
            }
        }
    }

    /// The command of this cycle, with variables in place of their IDs.
    fn command_of(&self, outputs: &Outputs) -> Result<MotionCommand, Code> {
        let mut arguments = outputs.arguments;
        if outputs.motion_control.contains(MotionControlFlags::USE_VARIABLES) {
            let on_ethercat = self.settings.bus == CyclicBus::EtherCat;
            match self.settings.readings.use_variables_on_ethercat {
                UseVariablesOnEtherCat::Ignored if on_ethercat => {}
                UseVariablesOnEtherCat::Refused if on_ethercat => return Err(Code::COMMAND_FAILED),
                _ => arguments = self.with_variables(&outputs.arguments)?,
            }
        }
        Ok(MotionCommand::decode(MotionCommandId(outputs.motion_command_id), arguments))
    }

    /// The values of the variables whose cyclic IDs the arguments are. Source: PM L6820-6863.
    fn with_variables(&self, ids: &[f32; 6]) -> Result<[f32; 6], Code> {
        let readings = &self.settings.readings;
        let mut values = [0.0; 6];
        let mut count = 0;
        let last = ids.iter().rposition(|id| *id != 0.0).unwrap_or(0);
        for (position, id) in ids.iter().enumerate() {
            let zero = [0.0];
            let variable = if *id == 0.0 {
                match readings.zero_variable_id {
                    ZeroVariableId::EndsList => break,
                    _ if position > last => break,
                    ZeroVariableId::Skipped => continue,
                    ZeroVariableId::IsZero => zero.as_slice(),
                }
            } else {
                // A number that is no ID becomes 0, or another number without a variable.
                self.variables.get(*id as u16).ok_or(Code::ARGUMENT_ERROR)?
            };
            for value in variable {
                match values.get_mut(count) {
                    Some(slot) => *slot = *value,
                    None if readings.too_many_values == TooManyValues::Refused => {
                        return Err(Code::ARGUMENT_ERROR);
                    }
                    None => {}
                }
                count += 1;
            }
        }
        Ok(values)
    }
}

/// What becomes of a MoveID.
struct Taken {
    seen: bool,
    echo: bool,
}
