//! What the robot tells without being asked, and how long it waits for us.

use std::format;
use std::string::String;
use std::vec;
use std::vec::Vec;

use super::{digit, number, requests};
use crate::link::text::answer::Answer;
use crate::link::text::client::Client;
use crate::link::text::error::AnswerError;
use crate::time::Duration;
use crate::wire::meca500::code::Code;
use crate::wire::meca500::text::Message;
use crate::wire::meca500::text::value::{self, ValueError};

/// Shortest period of the connection watchdog. Source: PM L3166.
const SHORTEST_WATCHDOG: Duration = Duration::from_millis(1);
/// Longest period of the connection watchdog. Source: PM L3166.
const LONGEST_WATCHDOG: Duration = Duration::from_millis(0xFFFF_FFFE);
/// More codes than there are real-time messages.
const CODES: usize = 64;

fn codes(message: &Message<'_>) -> Result<Vec<Code>, ValueError> {
    let mut room = vec![Code(0); CODES];
    let count = value::codes(message, &mut room)?;
    if count > CODES {
        return Err(ValueError::Excess { code: message.code, count: CODES });
    }
    room.truncate(count);
    Ok(room)
}

fn seconds(message: &Message<'_>) -> Result<Duration, ValueError> {
    let unfit = ValueError::Unfit {
        code: message.code,
        position: 1,
        expected: "a time in seconds, not below zero",
    };
    Duration::try_from_secs_f64(value::number(message)?).map_err(|_| unfit)
}

requests! {
    /// GetRealTimeMonitoring: codes of the real-time messages that are switched on.
    get_real_time_monitoring, "GetRealTimeMonitoring", Vec<Code>, codes;
    /// GetMonitoringInterval: time between two rounds of monitoring messages.
    get_monitoring_interval, "GetMonitoringInterval", Duration, seconds;
}

impl Client {
    /// SetRealTimeMonitoring: the real-time messages to be sent, instead of those before. Ends with what is
    /// switched on. Whether an empty list switches all off the manual does not tell; the virtual robot reads
    /// it so. Source: PM L3811.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send); so everywhere below.
    pub fn set_real_time_monitoring(
        &self,
        wanted: &[Code],
    ) -> Result<Answer<Vec<Code>>, AnswerError> {
        let list: Vec<String> = wanted.iter().map(|code| format!("{}", code.0)).collect();
        self.ask(&format!("SetRealTimeMonitoring({})", list.join(",")), codes)
    }

    /// SetCtrlPortMonitoring: whether this connection gets what monitoring connections get. With it
    /// [`state`](Self::state) is always new.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn set_ctrl_port_monitoring(&self, on: bool) -> Result<Answer<()>, AnswerError> {
        self.order(&format!("SetCtrlPortMonitoring({})", digit(on)))
    }

    /// SetMonitoringInterval: 1 ms to 1 s.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn set_monitoring_interval(&self, interval: Duration) -> Result<Answer<()>, AnswerError> {
        let seconds = number("t", interval.as_secs_f64())?;
        self.order(&format!("SetMonitoringInterval({seconds})"))
    }

    /// SetEob: whether the robot says \[3012\] when it stands still and its queue is empty. Ends with
    /// whether it does.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn set_eob(&self, on: bool) -> Result<Answer<bool>, AnswerError> {
        let line = format!("SetEob({})", digit(on));
        self.ask(&line, |message| value::is_first_of(message, [Code(2054), Code(2055)]))
    }

    /// SetEom: whether the robot says \[3004\] when it stands still. Ends with whether it does.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn set_eom(&self, on: bool) -> Result<Answer<bool>, AnswerError> {
        let line = format!("SetEom({})", digit(on));
        self.ask(&line, |message| value::is_first_of(message, [Code(2052), Code(2053)]))
    }

    /// ConnectionWatchdog, 1 ms to 49 days: the robot stops when it does not hear from this client for so
    /// long. From now on the client feeds it by itself, three times in `period`, whatever else it does, and
    /// after [`reconnect`](Self::reconnect) too. There is no answer to wait for: a robot answers the first time
    /// only (PM L3177).
    ///
    /// # Errors
    ///
    /// [`AnswerError::Argument`] or [`AnswerError::Ended`].
    pub fn keep_connection_watchdog(&self, period: Duration) -> Result<(), AnswerError> {
        if period < SHORTEST_WATCHDOG || period > LONGEST_WATCHDOG {
            let value = format!("{period:?}");
            let allowed = "it must be 0.001 to 4294967.294 s";
            return Err(AnswerError::Argument { argument: "t", value, allowed });
        }
        self.shared().set_watchdog(Some(period))
    }

    /// ConnectionWatchdog(0): the robot does not wait for this client any more, which does not feed it any
    /// more.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn cancel_connection_watchdog(&self) -> Result<Answer<()>, AnswerError> {
        self.shared().set_watchdog(None)?;
        self.order("ConnectionWatchdog(0)")
    }
}
