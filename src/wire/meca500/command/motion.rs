//! The motion commands as typed values.

use super::arguments::{
    Conf, GripperAction, MoveMode, Payload, Pose, Severity, ToolSphere, TorqueDetection,
    TorqueSeverity, ValveAction, WorkZoneLimits, WorkZoneMode,
};
use super::id::MotionCommandId;
use super::spec::{CommandKind, CommandSpec};

/// A motion command: plain data, unchecked until [`MotionCommand::check`] says so.
///
/// One variant for each ID of Table 8 that a Meca500 has, named as the manual names the command.
/// Angles are in degrees, lengths in mm, times in seconds, percentages from 0 to 100 and above.
/// Ranges stand in [`COMMANDS`](super::COMMANDS). Source: PM Table 8.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotionCommand {
    /// ID 0: nothing. Whether the robot acknowledges it is not stated.
    NoMovement,
    /// ID 1: move to a joint set, in degrees.
    MoveJoints([f32; 6]),
    /// ID 2: move to a pose, linear in joint space.
    MovePose(Pose),
    /// ID 3: move to a pose along a straight line.
    MoveLin(Pose),
    /// ID 4: move along a straight line, by a pose given in the tool frame.
    MoveLinRelTrf(Pose),
    /// ID 5: move along a straight line, by a pose given along the axes of the world frame.
    MoveLinRelWrf(Pose),
    /// ID 6: wait this many seconds, in the queue.
    Delay(f32),
    /// ID 7: blending, in percent; 0 disables it.
    SetBlending(f32),
    /// ID 8: joint velocity of joint-space moves, in percent of the R3 top velocities.
    SetJointVel(f32),
    /// ID 9: joint acceleration of joint-space moves, in percent.
    SetJointAcc(f32),
    /// ID 10: angular velocity of linear moves, in degrees per second.
    SetCartAngVel(f32),
    /// ID 11: linear velocity of linear moves, in mm per second.
    SetCartLinVel(f32),
    /// ID 12: acceleration of linear moves, in percent.
    SetCartAcc(f32),
    /// ID 13: tool frame with respect to the flange frame.
    SetTrf(Pose),
    /// ID 14: world frame with respect to the base frame.
    SetWrf(Pose),
    /// ID 15: desired posture; disables its automatic choice.
    SetConf(Conf),
    /// ID 16: automatic choice of the posture.
    SetAutoConf(bool),
    /// ID 17: a number to be reported when all commands before it are done.
    SetCheckpoint(u16),
    /// ID 18: GripperClose or GripperOpen.
    Gripper(GripperAction),
    /// ID 19: finger velocity, in percent of about 50 mm/s.
    SetGripperVel(f32),
    /// ID 20: grip force, in percent of about 40 N.
    SetGripperForce(f32),
    /// ID 21: joint velocities, in degrees per second.
    MoveJointsVel([f32; 6]),
    /// ID 22: tool velocity along the world frame: three in mm/s, three in degrees per second.
    MoveLinVelWrf([f32; 6]),
    /// ID 23: tool velocity along the tool frame: three in mm/s, three in degrees per second.
    MoveLinVelTrf([f32; 6]),
    /// ID 24: seconds after which a velocity command that is not repeated stops.
    SetVelTimeout(f32),
    /// ID 25: desired turn of joint 6; disables its automatic choice.
    SetConfTurn(i8),
    /// ID 26: automatic choice of the turn.
    SetAutoConfTurn(bool),
    /// ID 27: torque limits of the six motors, in percent.
    SetTorqueLimits([f32; 6]),
    /// ID 28: what an exceeded torque limit does.
    SetTorqueLimitsCfg {
        /// What it leads to (`l`).
        severity: TorqueSeverity,
        /// What the limit is compared with (`m`).
        detection: TorqueDetection,
    },
    /// ID 29: move every joint by so many degrees.
    MoveJointsRel([f32; 6]),
    /// ID 30: the two valves of the MPM500.
    SetValveState([ValveAction; 2]),
    /// ID 31: finger openings that count as closed and open; both 0 restores the robot's own.
    SetGripperRange {
        /// Opening that counts as closed, in mm.
        d_closed: f32,
        /// Opening that counts as open, in mm.
        d_open: f32,
    },
    /// ID 32: move the fingers to this opening, in mm.
    MoveGripper(f32),
    /// ID 33: limit of the joint velocities of every move, in percent of the R3 top velocities.
    SetJointVelLimit(f32),
    /// ID 48: speed of the robot's time, in percent.
    SetTimeScaling(f32),
    /// ID 49: how moves are timed.
    SetMoveMode(MoveMode),
    /// ID 50: what a move that cannot keep its duration does.
    SetMoveDurationCfg(Severity),
    /// ID 51: duration of time-based moves, in seconds.
    SetMoveDuration(f32),
    /// ID 60: mass at the flange.
    SetPayload(Payload),
    /// ID 100: run the program stored in the robot under this number.
    StartProgram(u16),
    /// ID 150: limits of one joint; both 0 restores the factory's.
    SetJointLimits {
        /// Joint, 1 to 6.
        n: u8,
        /// Lowest position, in degrees.
        q_min: f32,
        /// Highest position, in degrees.
        q_max: f32,
    },
    /// ID 151: whether the limits of ID 150 are in force.
    SetJointLimitsCfg(bool),
    /// ID 152: supervision of the work zone.
    SetWorkZoneCfg {
        /// What a breach leads to (`l`).
        severity: Severity,
        /// What must stay inside (`m`).
        mode: WorkZoneMode,
    },
    /// ID 153: the work zone; all zero restores the factory's.
    SetWorkZoneLimits(WorkZoneLimits),
    /// ID 154: what an imminent collision leads to.
    SetCollisionCfg(Severity),
    /// ID 155: the tool sphere.
    SetToolSphere(ToolSphere),
    /// ID 156: whether the factory calibration is used.
    SetCalibrationCfg(bool),
    /// ID 200: reboot.
    RebootRobot,
    /// ID 1002: forget the homing, so that the next activation initialises the drives again.
    ClearHoming,
    /// IDs 10000 to 19999: set a robot variable.
    SetVariable {
        /// Cyclic ID of the variable, 10000 to 19999; it is the command's ID.
        cyclic_id: u16,
        /// Its values, of which the first `count` are meant.
        values: [f32; 6],
        /// How many values the variable has, 1 to 6. Not on the wire: the robot takes as many as
        /// the variable holds, and decoding gives 6.
        count: u8,
    },
    /// Any ID with any arguments, sent as given: the way to what this crate does not know.
    Raw {
        /// The ID.
        id: MotionCommandId,
        /// The six arguments.
        arguments: [f32; 6],
    },
}

impl MotionCommand {
    /// The command's ID on the wire.
    #[must_use]
    pub fn id(&self) -> MotionCommandId {
        self.encode().0
    }

    /// The row of [`COMMANDS`](super::COMMANDS) the command's ID belongs to, also for
    /// [`MotionCommand::Raw`]; `None` for an ID without an entry.
    #[must_use]
    pub fn spec(&self) -> Option<&'static CommandSpec> {
        CommandSpec::of(self.id())
    }

    /// When the robot executes the command.
    #[must_use]
    pub fn kind(&self) -> CommandKind {
        self.spec().map_or(CommandKind::Unknown, |spec| spec.kind)
    }

    /// The manual's name of the command; `Raw` for [`MotionCommand::Raw`].
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Raw { .. } => "Raw",
            _ => self.spec().map_or("Raw", |spec| spec.name),
        }
    }
}
