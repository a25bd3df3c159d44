//! Who the robot is, and what time it has.

use std::format;
use std::string::String;

use super::{quoted, requests};
use crate::link::text::answer::Answer;
use crate::link::text::client::Client;
use crate::link::text::error::AnswerError;
use crate::wire::meca500::text::Message;
use crate::wire::meca500::text::value::{self, FirmwareVersion, ValueError};

fn text(message: &Message<'_>) -> Result<String, ValueError> {
    value::text(message).map(String::from)
}

requests! {
    /// GetFwVersion: firmware of the robot.
    get_fw_version, "GetFwVersion", FirmwareVersion, FirmwareVersion::read;
    /// GetProductType: `Meca500`.
    get_product_type, "GetProductType", String, text;
    /// GetRobotSerial: the serial number, as the robot writes it.
    get_robot_serial, "GetRobotSerial", String, text;
    /// GetRobotName: the name that it has in the network.
    get_robot_name, "GetRobotName", String, text;
    /// GetRtc: the robot's time of day in seconds since 1970, as SetRtc has set it. The time stamps of
    /// real-time data have nothing to do with it (PM L5667).
    get_rtc, "GetRtc", u64, value::integer;
}

impl Client {
    /// SetRobotName, of a deactivated robot: 1 to 63 characters.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send), and [`AnswerError::Argument`].
    pub fn set_robot_name(&self, name: &str) -> Result<Answer<()>, AnswerError> {
        self.order(&format!("SetRobotName({})", quoted("s", name)?))
    }

    /// SetRtc: the robot's time of day in seconds since 1970; a robot that restarts has forgotten it.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn set_rtc(&self, seconds: u32) -> Result<Answer<()>, AnswerError> {
        self.order(&format!("SetRtc({seconds})"))
    }
}
