//! `:state`: what the robot has told of itself.

use std::prelude::v1::*;

use super::messages::status_words;
use crate::bus::text::RobotState;
use crate::wire::meca500::text::RobotNumber;

/// One line for each thing that is known.
pub(super) fn words(state: &RobotState) -> String {
    let mut lines = Vec::new();
    let mut tell = |name: &str, value: Option<String>| {
        if let Some(value) = value {
            lines.push(format!("{name:<22}{value}"));
        }
    };
    tell("robot", state.status.as_ref().map(status_words));
    tell("error", state.error.map(|code| code.to_string()));
    tell("joints (deg)", state.joints.map(numbers));
    tell("pose (mm, deg)", state.pose.map(numbers));
    tell("checkpoint reached", state.checkpoint_reached.map(|number| number.to_string()));
    tell("checkpoint discarded", state.checkpoint_discarded.map(|number| number.to_string()));
    tell("time scaling", state.time_scaling.map(|percent| format!("{} %", RobotNumber(percent))));
    for (name, stop) in [
        ("protective stop 2", state.p_stop_2),
        ("emergency stop", state.e_stop),
        ("connection drop", state.connection_drop),
    ] {
        tell(name, stop.map(stop_words));
    }
    tell("robot's clock", state.timestamp_us.map(|time| format!("{time} us")));
    if lines.is_empty() {
        return "the robot has not told anything yet; GetStatusRobot asks for its state".into();
    }
    lines.push(
        "(the newest that the robot told; SetCtrlPortMonitoring(1) makes it tell more)".into(),
    );
    lines.join("\n")
}

fn numbers(numbers: [f64; 6]) -> String {
    numbers.map(|number| RobotNumber(number).to_string()).join(", ")
}

fn stop_words(state: u8) -> String {
    match state {
        0 => "clear".into(),
        1 => "active".into(),
        2 => "gone, to be reset".into(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::meca500::text::Message;

    #[test]
    fn what_is_known_is_told_and_nothing_else() {
        let mut state = RobotState::default();
        assert!(words(&state).contains("not told anything"));
        for line in ["[2007][1,1,0,1,1,1,1]", "[3005][x]", "[2026][1,2,3,4,5,6.5]", "[3032][2]"] {
            state.take_in(&Message::parse(line).unwrap());
        }
        let words = words(&state);
        for part in ["activated, homed, in error", "3005", "6.5", "gone, to be reset"] {
            assert!(words.contains(part), "{part}: {words}");
        }
        assert!(!words.contains("pose") && !words.contains("emergency"), "{words}");
    }
}
