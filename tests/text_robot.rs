//! The virtual robot behind its own ports, driven by the client: both ends and both sockets at once.

#[path = "support/quick_robot.rs"]
mod quick_robot;
#[path = "support/text_robot.rs"]
mod robot;

use std::time::Duration;

use fieldarm::link::text::{AnswerError, Client, Monitor, Reply};
use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::command::{MotionCommand, Pose};
use fieldarm::wire::meca500::text::{Category, TextCommandSpec};

use robot::Robot;

/// Longer than anything here takes; what takes longer hangs.
const LONG: Duration = Duration::from_secs(30);

fn ready(served: &Robot) -> Client {
    let client = served.client();
    client.request("ActivateRobot", LONG).unwrap();
    client.request("Home", LONG).unwrap();
    client
}

#[track_caller]
fn refusal(result: Result<Reply, AnswerError>) -> Code {
    match result {
        Err(AnswerError::Refused { code, .. }) => code,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_session_from_activation_to_reset() {
    let served = Robot::start();
    let client = served.client();
    assert_eq!(refusal(client.request("MoveJoints(0,0,0,0,0,0)", LONG)), Code::NOT_ACTIVATED);
    assert_eq!(refusal(client.request("Home", LONG)), Code::NOT_ACTIVATED);
    client.request("ActivateRobot", LONG).unwrap();
    assert_eq!(refusal(client.request("MoveJoints(0,0,0,0,0,0)", LONG)), Code::NOT_HOMED);
    client.request("Home", LONG).unwrap();
    client.request("SetCtrlPortMonitoring(1)", LONG).unwrap();
    client.request("SetJointVel(100)", LONG).unwrap();
    drop(client.send_motion(&MotionCommand::MoveJoints([5.0, 0.0, 0.0, 0.0, 10.0, 0.0])).unwrap());
    client.checkpoint(1).unwrap().wait(LONG).unwrap();
    client
        .wait_until(LONG, |state| {
            state.joints.is_some_and(|joints| (joints[0] - 5.0).abs() < 1e-3)
                && state.status.is_some_and(|status| status.is_end_of_block)
        })
        .unwrap();
    let far = Pose { x: 5_000.0, y: 0.0, z: 0.0, alpha: 0.0, beta: 0.0, gamma: 0.0 };
    drop(client.send_motion(&MotionCommand::MovePose(far)).unwrap());
    client.wait_until(LONG, |state| state.status.is_some_and(|s| s.is_in_error)).unwrap();
    assert_eq!(refusal(client.request("MoveJoints(0,0,0,0,0,0)", LONG)), Code::IN_ERROR);
    client.request("ResetError", LONG).unwrap();
    client.request("ResumeMotion", LONG).unwrap();
    let cleared = client.checkpoint(2).unwrap();
    drop(cleared);
    client.request("MoveJoints(60,0,0,0,0,0)", LONG).unwrap();
    let mut never = client.checkpoint(3).unwrap();
    client.request("ClearMotion", LONG).unwrap();
    assert_eq!(never.wait(LONG), Err(AnswerError::Discarded));
    client.request("DeactivateRobot", LONG).unwrap();
}

#[test]
fn mistakes_get_the_codes_of_the_manual() {
    let served = Robot::start();
    let client = ready(&served);
    for (line, code) in [
        ("Jump(1)", Code::UNKNOWN_COMMAND),
        ("Delay(1", Code::SYNTAX_ERROR),
        ("Delay(x)", Code::ARGUMENT_ERROR),
        ("SetBlending(101)", Code::ARGUMENT_ERROR),
        ("GetStatusRobot(1)", Code::ARGUMENT_ERROR),
    ] {
        assert_eq!(refusal(client.request(line, LONG)), code, "{line}");
    }
}

#[test]
fn every_request_is_answered_with_a_code_of_the_table() {
    let served = Robot::start();
    let client = ready(&served);
    let mut asked = 0;
    for spec in TextCommandSpec::all() {
        let asks = matches!(
            spec.category,
            Category::Data | Category::RealTime | Category::WorkZone | Category::Accessory
        ) && spec.name.starts_with("Get");
        let needs_nothing = spec.arguments().all(|argument| argument.optional);
        if !asks || !needs_nothing || spec.available == Some(false) {
            continue;
        }
        match client.request(spec.name, LONG) {
            Ok(Reply::Message(message)) => {
                assert!(spec.answers().contains(&message.code), "{}: {message}", spec.name);
            }
            // Without the tool.
            Err(AnswerError::Refused { code, .. }) => {
                assert!(
                    spec.errors().any(|error| error == code) || code == Code::COMMAND_FAILED,
                    "{}: {code}",
                    spec.name
                );
            }
            other => panic!("{}: {other:?}", spec.name),
        }
        asked += 1;
    }
    assert!(asked > 60, "{asked}");
}

#[test]
fn variables_come_back_as_they_were_stored() {
    let served = Robot::start();
    let client = ready(&served);
    client.request("CreateVariable(tour.home, [10, 0, -5.5, 0, 0, 0], 10001)", LONG).unwrap();
    client.request("SetJointVel(100)", LONG).unwrap();
    assert_eq!(client.request("MoveJoints(*vars.tour.home)", LONG), Ok(Reply::Accepted));
    client.checkpoint(1).unwrap().wait(LONG).unwrap();
    let missing = refusal(client.request("GetVariable(tour.none)", LONG));
    assert_eq!(missing, Code::GET_VARIABLE_FAILED);
    assert!(client.request("GetVariable(tour.home)", LONG).is_ok());
}

#[test]
fn a_monitor_sees_what_another_does() {
    let served = Robot::start();
    let monitor = Monitor::connect(served.endpoints.monitoring, LONG).unwrap();
    let client = ready(&served);
    client.request("SetJointVel(100)", LONG).unwrap();
    client.request("MoveJoints(3,0,0,0,0,0)", LONG).unwrap();
    let mut seen = (false, false, false);
    for _ in 0..100_000 {
        let message = monitor.messages().wait_next(LONG).unwrap().expect("the robot is silent");
        let state = monitor.state();
        seen.0 |= state.status.is_some_and(|status| status.is_homed);
        seen.1 |= state.joints.is_some_and(|joints| (joints[0] - 3.0).abs() < 1e-3);
        seen.2 |= message.code == Code(2230);
        if seen == (true, true, true) {
            break;
        }
    }
    assert_eq!(seen, (true, true, true));
}

#[test]
fn who_leaves_while_the_robot_moves_stops_it_and_may_come_back() {
    let served = Robot::start();
    let mut client = ready(&served);
    client.request("SetJointVel(5)", LONG).unwrap();
    client.request("MoveJoints(80,0,0,0,0,0)", LONG).unwrap();
    client.reconnect().or_else(|_| client.reconnect()).unwrap();
    client.request("GetStatusRobot", LONG).unwrap();
    assert!(client.state().status.unwrap().is_paused);
    client.request("ResumeMotion", LONG).unwrap();
    client.request("GetStatusRobot", LONG).unwrap();
    assert!(!client.state().status.unwrap().is_paused);
}
