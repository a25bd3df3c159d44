//! Queued commands: they are answered only when they are refused. Source: PM L584, L1933.

use super::dispatch::Refused;
use crate::sim::meca500::event::RobotEvent;
use crate::sim::meca500::receive::Verdict;
use crate::sim::meca500::robot::VirtualRobot;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::command::MotionCommand;
use crate::wire::meca500::revision::Revision;
use crate::wire::meca500::text::{ParsedCommand, Statement};

/// The motion command that a parsed line stands for; `None` if it stands for none.
pub(super) fn command_of(parsed: &ParsedCommand<'_>, revision: Revision) -> Option<MotionCommand> {
    match Statement::from_parsed(parsed, revision) {
        Ok(Statement::Motion(command)) => Some(command),
        Ok(Statement::Velocity(velocity)) => Some(velocity.into()),
        _ => None,
    }
}

impl VirtualRobot {
    /// Hands a command to the robot. A checkpoint that the robot's state keeps from the queue will
    /// never be reached, and is told as discarded: error mode and safety stops do so to those in the
    /// queue, and the vendor's client waits for it. Source: PM L2486, client
    pub(super) fn submit(&mut self, command: &MotionCommand) -> Result<(), Refused> {
        let refused = match self.receive(command) {
            Verdict::Accepted => return Ok(()),
            Verdict::Refused(code) => Refused::Code(code),
            Verdict::Stopped => Refused::PStop2,
            Verdict::Full => Refused::Code(Code::COMMAND_BUFFER_FULL),
        };
        if let MotionCommand::SetCheckpoint(number) = *command
            && refused != Refused::Code(Code::ARGUMENT_ERROR)
        {
            self.checkpoint_discarded = number;
            self.events.push(RobotEvent::CheckpointDiscarded(number));
        }
        Err(refused)
    }

    /// Hands a parsed command to the robot.
    pub(super) fn submit_parsed(&mut self, parsed: &ParsedCommand<'_>) -> Result<(), Refused> {
        let command = command_of(parsed, self.settings.revision).ok_or(Code::ARGUMENT_ERROR)?;
        self.submit(&command)
    }
}
