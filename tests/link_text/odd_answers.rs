//! Typed commands and a robot that does not answer as the manual says.

use std::time::Duration;

use crate::served::{LONG, Served};
use crate::text_support::ScriptedDevice;
use fieldarm::bus::text::client::ClientSettings;
use fieldarm::link::text::{
    Answer, AnswerError, Client, ClientOptions, EndReason, NewVariable, VariableValue,
};
use futures_lite::future::block_on;

fn connect(served: &Served) -> Client {
    Client::connect(served.endpoints.control, ClientOptions::default()).unwrap()
}

/// What becomes of a command that is answered so.
fn answered<T: std::fmt::Debug>(
    served: &Served,
    sent: Result<Answer<T>, AnswerError>,
    message: &'static str,
) -> Result<T, AnswerError> {
    let mut answer = sent.unwrap();
    served.with(move |server| server.device_mut().control.push_back(message.into()));
    answer.wait(LONG)
}

#[track_caller]
fn unreadable<T: std::fmt::Debug>(result: Result<T, AnswerError>, words: &str) {
    let error = result.unwrap_err();
    assert!(matches!(error, AnswerError::Unreadable { .. }), "{error}");
    let text = error.to_string();
    assert!(text.contains(words), "{text}");
}

#[test]
fn a_malformed_answer_names_the_message_and_the_value() {
    let served = Served::start(ScriptedDevice { mute: true, ..ScriptedDevice::default() });
    let client = connect(&served);
    let sent = client.get_status_robot();
    unreadable(
        answered(&served, sent, "[2007][1,1,0,0]"),
        "[2007][1,1,0,0] cannot be read: value 5 is missing",
    );
    unreadable(
        answered(&served, client.get_status_robot(), "[2007][1,1,0,0,0,1,7]"),
        "value 7 of message 2007 must be 0 or 1",
    );
    unreadable(
        answered(&served, client.get_rt_joint_pos(), "[2210][1,2,3,4,5,6]"),
        "value 7 is missing in message 2210",
    );
    unreadable(answered(&served, client.get_trf(), "[2014][1,2,3,4,5,6,7]"), "more than 6 values");
    unreadable(
        answered(&served, client.get_fw_version(), "[2081][eleven]"),
        "must be a version as v11.3.84",
    );
    unreadable(answered(&served, client.get_checkpoint(), "[2157][-1]"), "an integer in its range");
    unreadable(
        answered(&served, client.get_monitoring_interval(), "[2116][-0.5]"),
        "not below zero",
    );
    unreadable(
        answered(&served, client.get_real_time_monitoring(), "[2117][2200,All]"),
        "value 2 of message 2117",
    );
    unreadable(answered(&served, client.get_variable("x"), "[2551][x,1]"), "value 3 is missing");
    let sent = client.create_variable("x", &VariableValue::Truth(true), NewVariable::default());
    unreadable(answered(&served, sent, "[2552][x,true,0,5]"), "value 4");
    unreadable(answered(&served, client.get_robot_serial(), "[2083][]"), "value 1 is missing");
    // The connection goes on.
    assert_eq!(answered(&served, client.get_checkpoint(), "[2157][9]"), Ok(9));
}

#[test]
fn a_malformed_answer_can_be_awaited_too() {
    let served = Served::start(ScriptedDevice { mute: true, ..ScriptedDevice::default() });
    let client = connect(&served);
    let answer = client.get_blending().unwrap();
    served.with(|server| server.device_mut().control.push_back("[2150][smooth]".into()));
    unreadable(block_on(answer), "value 1 of message 2150 must be a number");
    let mut waiting = client.until_homed().unwrap();
    served.with(|server| server.device_mut().control.push_back("[2007][yes]".into()));
    unreadable(waiting.wait(LONG), "[2007][yes]");
}

#[test]
fn a_failed_homing_ends_the_wait_for_it() {
    let served = Served::start(ScriptedDevice { mute: true, ..ScriptedDevice::default() });
    let client = connect(&served);
    let waiting = client.until_homed().unwrap();
    let say = |text: &'static str| {
        served.with(move |server| server.device_mut().control.push_back(text.to_owned()));
    };
    say("[2007][1,0,0,0,0,1,1]");
    say("[1014][Homing failed.]");
    let error = block_on(waiting).unwrap_err();
    assert!(matches!(error, AnswerError::Refused { code, .. } if code.0 == 1014), "{error}");
}

#[test]
fn a_state_is_asked_for_again_when_something_has_changed() {
    let served = Served::start(ScriptedDevice { mute: true, ..ScriptedDevice::default() });
    let client = connect(&served);
    let mut waiting = client.until_end_of_block().unwrap();
    let say = |text: &'static str| {
        served.with(move |server| server.device_mut().control.push_back(text.to_owned()));
    };
    say("[2007][1,1,0,0,0,0,0]");
    assert_eq!(waiting.wait(Duration::from_millis(20)), Err(AnswerError::TimedOut));
    let asked = || served.commands().iter().filter(|line| *line == "GetStatusRobot").count();
    assert_eq!(asked(), 1);
    say("[3012][End of block.]");
    assert_eq!(waiting.wait(Duration::from_millis(200)), Err(AnswerError::TimedOut));
    assert_eq!(asked(), 2);
    say("[2007][1,1,0,0,0,1,1]");
    assert!(waiting.wait(LONG).unwrap().is_end_of_block);
}

#[test]
fn nobody_waits_for_a_robot_that_is_gone() {
    let served = Served::start(ScriptedDevice { mute: true, ..ScriptedDevice::default() });
    let client = connect(&served);
    let mut answer = client.get_rt_joint_pos().unwrap();
    let mut waiting = client.until_homed().unwrap();
    let mut idle = client.until_idle().unwrap();
    assert_eq!(answer.wait(Duration::from_millis(5)), Err(AnswerError::TimedOut));
    served.with(|server| server.device_mut().is_on_text = false);
    let ended = AnswerError::Ended(EndReason::ByRobot);
    assert_eq!(answer.wait(LONG), Err(ended.clone()));
    assert_eq!(waiting.wait(LONG), Err(ended.clone()));
    assert_eq!(idle.wait(LONG), Err(ended.clone()));
    assert_eq!(client.until_homed().unwrap_err(), ended);
}

#[test]
fn a_watchdog_that_is_kept_survives_a_reconnect() {
    let served = Served::start(ScriptedDevice::default());
    let settings = ClientSettings { silence_limit: None, ..ClientSettings::default() };
    let options = ClientOptions { settings, ..ClientOptions::default() };
    let mut client = Client::connect(served.endpoints.control, options).unwrap();
    client.keep_connection_watchdog(Duration::from_millis(90)).unwrap();
    let fed =
        || served.commands().iter().filter(|line| *line == "-ConnectionWatchdog(0.09)").count();
    let feeds_beyond = |count: usize| {
        (0..2_000).any(|_| {
            std::thread::sleep(Duration::from_millis(5));
            fed() > count
        })
    };
    assert!(feeds_beyond(3));
    client.reconnect().or_else(|_| client.reconnect()).unwrap();
    assert!(feeds_beyond(fed() + 2));
}
