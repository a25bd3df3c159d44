//! What messages tell of the robot.

use crate::wire::meca500::code::{Code, CodeKind};
use crate::wire::meca500::text::Message;

/// The robot's state: message 2007. Source: PM L5722.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct RobotStatus {
    /// The motors are on.
    pub is_activated: bool,
    /// The robot is homed.
    pub is_homed: bool,
    /// 0: no simulation; 1: in real time; 2: fast.
    pub simulation: u8,
    /// The robot is in error mode.
    pub is_in_error: bool,
    /// Motion is paused, was cleared, or the robot is in error mode.
    pub is_paused: bool,
    /// The robot does not move and its queue is empty.
    pub is_end_of_block: bool,
    /// The robot does not move.
    pub is_end_of_motion: bool,
}

/// The gripper's state: message 2079. Source: PM Table 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct GripperState {
    /// A gripper is there and enabled.
    pub is_enabled: bool,
    /// It is homed.
    pub is_homed: bool,
    /// It holds a part.
    pub is_holding: bool,
    /// It is at a limit.
    pub is_at_limit: bool,
    /// It is in error.
    pub is_in_error: bool,
    /// It is too hot.
    pub is_overheated: bool,
}

fn flag(number: f64) -> bool {
    number != 0.0
}

impl RobotStatus {
    /// Reads message 2007; `None` for another.
    #[must_use]
    pub fn read(message: &Message<'_>) -> Option<Self> {
        let numbers = (message.code == Code::STATUS_ROBOT).then(|| message.numbers()).flatten()?;
        let [activated, homed, simulation, error, paused, end_of_block, end_of_motion] = numbers;
        Some(Self {
            is_activated: flag(activated),
            is_homed: flag(homed),
            // Saturates.
            simulation: simulation as u8,
            is_in_error: flag(error),
            is_paused: flag(paused),
            is_end_of_block: flag(end_of_block),
            is_end_of_motion: flag(end_of_motion),
        })
    }
}

impl GripperState {
    /// Reads message 2079; `None` for another.
    #[must_use]
    pub fn read(message: &Message<'_>) -> Option<Self> {
        let numbers = (message.code == Code(2079)).then(|| message.numbers()).flatten()?;
        let [enabled, homed, holding, limit, error, hot] = numbers.map(flag);
        Some(Self {
            is_enabled: enabled,
            is_homed: homed,
            is_holding: holding,
            is_at_limit: limit,
            is_in_error: error,
            is_overheated: hot,
        })
    }
}

/// The newest of everything that a connection was told. `None`: not told yet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RobotState {
    /// Activated, homed, paused and so on.
    pub status: Option<RobotStatus>,
    /// The gripper.
    pub gripper: Option<GripperState>,
    /// Joint angles in degrees: target (2026, 2200) or actual (2210), whichever came last.
    pub joints: Option<[f64; 6]>,
    /// Pose in mm and degrees: target (2027, 2201) or actual (2211), whichever came last.
    pub pose: Option<[f64; 6]>,
    /// The robot's clock in us, of the message that ends a cycle of monitoring (2230).
    pub timestamp_us: Option<u64>,
    /// The last checkpoint reached (3030).
    pub checkpoint_reached: Option<u16>,
    /// The last checkpoint discarded (3040).
    pub checkpoint_discarded: Option<u16>,
    /// Time scaling in percent (2015).
    pub time_scaling: Option<f64>,
    /// Protective stop 2 (3032): 0 clear, 1 active, 2 to be reset.
    pub p_stop_2: Option<u8>,
    /// Emergency stop (3070), as above.
    pub e_stop: Option<u8>,
    /// Stop because a connection broke (3086; 3081 in chapter 4), as above.
    pub connection_drop: Option<u8>,
    /// The last error, until it is reset (2005) or the state says that there is none.
    pub error: Option<Code>,
}

/// Six numbers, behind a time stamp where the code has one.
fn six(message: &Message<'_>) -> Option<[f64; 6]> {
    let stamped = || message.numbers().map(|[_, a, b, c, d, e, f]: [f64; 7]| [a, b, c, d, e, f]);
    message.numbers().or_else(stamped)
}

impl RobotState {
    /// Takes in a message; values that cannot be read change nothing.
    pub fn take_in(&mut self, message: &Message<'_>) {
        fn keep<T>(slot: &mut Option<T>, value: Option<T>) {
            if value.is_some() {
                *slot = value;
            }
        }
        let integer = || message.values().next().and_then(|value| value.integer());
        let small = || integer().and_then(|number| u8::try_from(number).ok());
        let checkpoint = || integer().and_then(|number| u16::try_from(number).ok());
        match message.code {
            Code::STATUS_ROBOT => {
                keep(&mut self.status, RobotStatus::read(message));
                if self.status.is_some_and(|status| !status.is_in_error) {
                    self.error = None;
                }
            }
            Code::ERROR_RESET | Code::NO_ERROR_TO_RESET => self.error = None,
            Code(2079) => keep(&mut self.gripper, GripperState::read(message)),
            Code(2026 | 2200 | 2210) => keep(&mut self.joints, six(message)),
            Code(2027 | 2201 | 2211) => keep(&mut self.pose, six(message)),
            Code(2230) => {
                let time = integer().and_then(|time| u64::try_from(time).ok());
                keep(&mut self.timestamp_us, time);
            }
            Code::CHECKPOINT_REACHED => keep(&mut self.checkpoint_reached, checkpoint()),
            Code::CHECKPOINT_DISCARDED => keep(&mut self.checkpoint_discarded, checkpoint()),
            Code(2015) => keep(&mut self.time_scaling, message.number()),
            Code::P_STOP_2 => keep(&mut self.p_stop_2, small()),
            Code::E_STOP => keep(&mut self.e_stop, small()),
            Code::CONNECTION_DROPPED | Code::CONNECTION_DROPPED_TEXT => {
                keep(&mut self.connection_drop, small());
            }
            code if starts_error_mode(code) => self.error = Some(code),
            _ => {}
        }
    }
}

/// Whether an error is one of motion or hardware; what is only wrong with a command is answered and
/// leaves the robot as it is.
fn starts_error_mode(code: Code) -> bool {
    let is_error = code.describe().is_some_and(|info| info.kind == CodeKind::Error);
    let is_of_a_command = matches!(code.0, 1000..=1006 | 1011 | 1022..=1023 | 1025..=1044 | 1550..=1554)
        || matches!(code.0, 3001..=3003 | 3014 | 3017 | 3020);
    is_error && !is_of_a_command
}
