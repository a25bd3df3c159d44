//! What messages tell of the robot.

use crate::wire::meca500::code::{Code, CodeKind};
use crate::wire::meca500::text::Message;
use crate::wire::meca500::text::value::{GripperState, RobotStatus};

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
                keep(&mut self.status, RobotStatus::read(message).ok());
                if self.status.is_some_and(|status| !status.is_in_error) {
                    self.error = None;
                }
            }
            Code::ERROR_RESET | Code::NO_ERROR_TO_RESET => self.error = None,
            Code(2079) => keep(&mut self.gripper, GripperState::read(message).ok()),
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
