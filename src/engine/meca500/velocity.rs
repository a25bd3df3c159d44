//! Velocity mode: the only use of MoveID 0.
//!
//! ```text
//!            set_velocity, nothing unacknowledged, ready for motion
//!   position ---------------------------------------------------> gap (SetPoint 0)
//!      ^                                                             |  mode_gap_cycles
//!      |  armed again before the next command                        v
//!   closed <-- stop, dead-man, not ready, paused, bad inputs ----- running (MoveID 0, SetPoint 1)
//!                                                                    |  another ID: through gap
//! ```
//!
//! Invariants: MoveID 0 with SetPoint 1 is written only with the ID of a [`VelocityCommand`]; SetPoint
//! and all arguments become 0 in the same cycle when the motion stops; a stopped motion starts again
//! only by another `set_velocity`.

use super::Engine;
use super::event::{Event, VelocityStop};
use super::handshake::Port;
use super::inputs::Inputs;
use super::ticket::SubmitError;
use crate::time::Instant;
use crate::wire::meca500::command::VelocityCommand;

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Velocity {
    /// What the caller wants, while it wants it.
    desired: Option<(u32, [f32; 6])>,
    expires: Instant,
    /// Cycles since the last `set_velocity`.
    cycles: u16,
}

impl Velocity {
    pub(super) const fn is_wanted(&self) -> bool {
        self.desired.is_some()
    }
}

impl<const QUEUE: usize> Engine<QUEUE> {
    /// Moves the robot at this velocity from the next cycle on, for at most the dead-man time of the
    /// configuration; call it again to go on, with the same or other velocities.
    ///
    /// Velocity mode is entered when no command is unacknowledged; commands that wait meanwhile go
    /// out after it was left. Source: PM L1044 to L1060.
    ///
    /// # Errors
    ///
    /// A velocity that is no finite number, or a robot that is not connected, not ready for motion,
    /// or paused.
    pub fn set_velocity(&mut self, velocity: VelocityCommand) -> Result<(), SubmitError> {
        velocity.check(self.config.revision)?;
        if self.is_monitoring() {
            return Err(SubmitError::MonitoringOnly);
        }
        if !self.is_connected() || !self.velocity_allowed(&self.inputs) {
            return Err(SubmitError::NotReady);
        }
        let (id, arguments) = velocity.encode();
        self.velocity.desired = Some((id.0, arguments));
        self.velocity.expires = self.now + self.config.velocity_dead_man;
        self.velocity.cycles = 0;
        Ok(())
    }

    /// Stops velocity motion: SetPoint and all arguments become 0 in the next cycle.
    pub fn stop_velocity(&mut self) {
        self.end_velocity(VelocityStop::Requested);
    }

    fn velocity_allowed(&self, inputs: &Inputs) -> bool {
        inputs.ready_for_motion()
            && !inputs.paused()
            && !self.stops_commanded()
            && self.halted.is_none()
    }

    /// Drops the wish and, where the robot is being moved, SetPoint.
    pub(super) fn end_velocity(&mut self, why: VelocityStop) {
        if self.velocity.desired.take().is_none() {
            return;
        }
        if matches!(self.port, Port::Velocity | Port::Gap { .. }) {
            self.close_port();
        }
        self.events.state_or_merge(Event::VelocityStopped(why));
    }

    /// The dead-man runs on time, whatever the inputs are; and on cycles, should the caller's clock
    /// stand still or go back.
    pub(super) fn watch_dead_man(&mut self) {
        if !self.velocity.is_wanted() {
            return;
        }
        self.velocity.cycles = self.velocity.cycles.saturating_add(1);
        let too_many = self.velocity.cycles > self.config.velocity_dead_man_cycles;
        if too_many || self.now >= self.velocity.expires {
            self.end_velocity(VelocityStop::DeadMan);
        }
    }

    /// One fresh cycle of velocity mode; true while it owns the port.
    pub(super) fn drive_velocity(&mut self, inputs: &Inputs) -> bool {
        let Some((id, arguments)) = self.velocity.desired else { return false };
        if !self.velocity_allowed(inputs) {
            self.end_velocity(VelocityStop::RobotState);
            return false;
        }
        if self.in_flight.is_some() {
            return true;
        }
        match self.port {
            Port::Velocity if self.outputs.command == id => self.outputs.arguments = arguments,
            Port::Gap { fresh }
                if fresh.saturating_add(1) >= self.config.mode_gap_cycles.max(1) =>
            {
                self.port = Port::Velocity;
                self.outputs.move_id = 0;
                self.outputs.command = id;
                self.outputs.arguments = arguments;
                self.outputs.set_point(true);
            }
            Port::Gap { fresh } => self.port = Port::Gap { fresh: fresh.saturating_add(1) },
            _ => {
                self.close_port();
                self.port = Port::Gap { fresh: 0 };
            }
        }
        true
    }
}
