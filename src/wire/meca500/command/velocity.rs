//! The three commands that may run with MoveID 0, as a type of their own.

use super::check::ArgumentError;
use super::id::MotionCommandId;
use super::motion::MotionCommand;
use crate::wire::meca500::revision::Revision;

/// A velocity command: the only kind that may be sent continuously, with MoveID 0 and SetPoint 1.
///
/// A position command sent so would be queued again in every cycle (PM L1063); this type keeps
/// it out. The robot reduces velocities above its limits instead of refusing them (PM L2086, L2194).
/// Source: PM L1044, Table 8.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VelocityCommand {
    /// ID 21: velocities of the six joints, in degrees per second.
    MoveJointsVel([f32; 6]),
    /// ID 22: tool velocity along the world frame: three in mm/s, three in degrees per second.
    MoveLinVelWrf([f32; 6]),
    /// ID 23: tool velocity along the tool frame: three in mm/s, three in degrees per second.
    MoveLinVelTrf([f32; 6]),
}

impl VelocityCommand {
    /// The ID and the six arguments of the wire.
    #[must_use]
    pub const fn encode(&self) -> (MotionCommandId, [f32; 6]) {
        match *self {
            Self::MoveJointsVel(omega) => (MotionCommandId::MOVE_JOINTS_VEL, omega),
            Self::MoveLinVelWrf(velocity) => (MotionCommandId::MOVE_LIN_VEL_WRF, velocity),
            Self::MoveLinVelTrf(velocity) => (MotionCommandId::MOVE_LIN_VEL_TRF, velocity),
        }
    }

    /// The same command with another six velocities.
    #[must_use]
    pub const fn with_velocities(self, velocities: [f32; 6]) -> Self {
        match self {
            Self::MoveJointsVel(_) => Self::MoveJointsVel(velocities),
            Self::MoveLinVelWrf(_) => Self::MoveLinVelWrf(velocities),
            Self::MoveLinVelTrf(_) => Self::MoveLinVelTrf(velocities),
        }
    }

    /// Whether every velocity is a finite number.
    ///
    /// # Errors
    ///
    /// The first that is not.
    pub fn check(&self, revision: Revision) -> Result<(), ArgumentError> {
        MotionCommand::from(*self).check(revision)
    }

    /// The manual's name of the command.
    #[must_use]
    pub fn name(&self) -> &'static str {
        MotionCommand::from(*self).name()
    }
}

impl From<VelocityCommand> for MotionCommand {
    fn from(command: VelocityCommand) -> Self {
        match command {
            VelocityCommand::MoveJointsVel(omega) => Self::MoveJointsVel(omega),
            VelocityCommand::MoveLinVelWrf(velocity) => Self::MoveLinVelWrf(velocity),
            VelocityCommand::MoveLinVelTrf(velocity) => Self::MoveLinVelTrf(velocity),
        }
    }
}

/// A command that may not run with MoveID 0.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{command} is not a velocity command and cannot run with MoveID 0")]
pub struct NotAVelocityCommand {
    /// The command's name.
    pub command: &'static str,
}

impl TryFrom<MotionCommand> for VelocityCommand {
    type Error = NotAVelocityCommand;

    fn try_from(command: MotionCommand) -> Result<Self, Self::Error> {
        match command {
            MotionCommand::MoveJointsVel(omega) => Ok(Self::MoveJointsVel(omega)),
            MotionCommand::MoveLinVelWrf(velocity) => Ok(Self::MoveLinVelWrf(velocity)),
            MotionCommand::MoveLinVelTrf(velocity) => Ok(Self::MoveLinVelTrf(velocity)),
            other => Err(NotAVelocityCommand { command: other.name() }),
        }
    }
}
