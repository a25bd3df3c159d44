//! Clients against a scripted robot.

use std::net::TcpListener;
use std::time::Duration;

use crate::served::{LONG, Served};
use crate::text_support::ScriptedDevice;
use fieldarm::bus::text::client::{ClientSettings, SubmitError};
use fieldarm::link::text::{
    AnswerError, Client, ClientOptions, ConnectError, EndReason, Monitor, Reply,
};
use fieldarm::wire::meca500::code::Code;
use fieldarm::wire::meca500::command::MotionCommand;
use futures_lite::future::{block_on, zip};

fn connect(served: &Served) -> Client {
    Client::connect(served.endpoints.control, ClientOptions::default()).unwrap()
}

fn short() -> ClientOptions {
    ClientOptions { limit: Duration::from_millis(200), ..ClientOptions::default() }
}

#[test]
fn commands_are_answered_accepted_or_refused() {
    let served = Served::start(ScriptedDevice::default());
    let client = connect(&served);
    let status = client.request("GetStatusRobot", LONG).unwrap();
    assert_eq!(status.numbers(), Some([1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0]));
    assert!(client.state().status.unwrap().is_activated);
    assert_eq!(client.request("MoveJoints(0,0,0,0,0,0)", LONG), Ok(Reply::Accepted));
    let Reply::Message(homed) = client.request("Home", LONG).unwrap() else { panic!() };
    assert_eq!(homed.to_string(), "[2002][Homing done.]");
    let refused = client.request("Bad(1)", LONG).unwrap_err();
    let AnswerError::Refused { code, text } = refused else { panic!("{refused}") };
    assert_eq!(code, Code::UNKNOWN_COMMAND);
    assert!(text.contains("Bad(1)"));
    assert_eq!(client.request("a\0b", LONG), Err(SubmitError::NotAscii { offset: 1 }.into()));
    assert_eq!(
        client.request("GetRobotName", Duration::from_millis(20)),
        Err(AnswerError::TimedOut)
    );
    let motion = client.send_motion(&MotionCommand::MoveJoints([0.5, 0.0, -10.25, 0.0, 0.0, 1e-3]));
    drop(motion.unwrap());
    assert_eq!(client.sync().unwrap().wait(LONG).unwrap().number(), Some(3.0));
    assert!(served.commands().contains(&"MoveJoints(0.5,0,-10.25,0,0,0.001)".to_owned()));
    let no_text = client.send_motion(&MotionCommand::NoMovement).unwrap_err();
    assert!(matches!(no_text, AnswerError::NoText { .. }));
}

#[test]
fn an_unquoted_error_ends_the_motion_before_the_sync() {
    let served = Served::start(ScriptedDevice::default());
    let client = connect(&served);
    let refused = client.request("Break()", LONG).unwrap_err();
    assert!(matches!(refused, AnswerError::Refused { code: Code::NOT_ACTIVATED, .. }), "{refused}");
}

#[test]
fn everything_can_be_awaited() {
    let served = Served::start(ScriptedDevice::default());
    let connecting = Client::connecting(served.endpoints.control, ClientOptions::default());
    let client = block_on(connecting).unwrap();
    let refused = block_on(Client::connecting(served.endpoints.control, short())).unwrap_err();
    assert!(matches!(refused, ConnectError::Refused(Code::ANOTHER_USER)), "{refused}");
    let messages = client.messages();
    block_on(async {
        let home = client.send("Home").unwrap();
        let status = client.send("GetStatusRobot").unwrap();
        // Home is answered later than what was sent behind it.
        let (home, status) = zip(home, status).await;
        assert_eq!(status.unwrap().numbers::<7>().unwrap()[0], 1.0);
        assert!(home.is_ok());
        client.checkpoint(5).unwrap().await.unwrap();
        let state = client.until(|state| state.checkpoint_reached == Some(5)).await.unwrap();
        assert!(state.status.is_some());
        let codes = [2007, 2002, 3030];
        for code in codes {
            assert_eq!(messages.next().await.unwrap().code, Code(code));
        }
    });
    assert_eq!(messages.wait_next(Duration::from_millis(5)), Ok(None));
}

#[test]
fn checkpoints_are_reached_or_discarded_in_their_order() {
    let served = Served::start(ScriptedDevice::default());
    let client = connect(&served);
    let mut first = client.checkpoint(1).unwrap();
    first.wait(LONG).unwrap();
    served.with(|server| server.device_mut().mute = true);
    let mut second = client.checkpoint(2).unwrap();
    let mut again = client.checkpoint(2).unwrap();
    assert_eq!(second.wait(Duration::from_millis(20)), Err(AnswerError::TimedOut));
    let say = |text: &'static str| {
        served.with(move |server| server.device_mut().control.push_back(text.to_owned()));
    };
    say("[3030][7]");
    say("[3030][2]");
    second.wait(LONG).unwrap();
    say("[3040][2]");
    assert_eq!(again.wait(LONG), Err(AnswerError::Discarded));
    assert_eq!(again.number(), 2);
}

#[test]
fn a_state_can_be_waited_for() {
    let served = Served::start(ScriptedDevice::default());
    let client = connect(&served);
    let none = client.wait_until(Duration::from_millis(20), |state| state.p_stop_2 == Some(1));
    assert_eq!(none, Err(AnswerError::TimedOut));
    served.with(|server| server.device_mut().control.push_back("[3032][1]".into()));
    let state = client.wait_until(LONG, |state| state.p_stop_2 == Some(1)).unwrap();
    assert_eq!(state.p_stop_2, Some(1));
}

#[test]
fn a_robot_that_others_control_refuses_and_takes_the_next() {
    let served = Served::start(ScriptedDevice::default());
    let first = connect(&served);
    let refused = Client::connect(served.endpoints.control, short()).unwrap_err();
    assert!(matches!(refused, ConnectError::Refused(Code::ANOTHER_USER)), "{refused}");
    drop(first);
    let again = (0..1_000).find_map(|_| {
        std::thread::sleep(Duration::from_millis(1));
        Client::connect(served.endpoints.control, short()).ok()
    });
    assert!(again.is_some());
}

#[test]
fn nobody_waits_for_a_connection_that_ended() {
    let served = Served::start(ScriptedDevice::default());
    let mut client = connect(&served);
    let messages = client.messages();
    let mut lost = client.send("GetRobotName").unwrap();
    let mut checkpoint = client.checkpoint(3).unwrap();
    checkpoint.wait(LONG).unwrap();
    drop(client.send("Hang()").unwrap());
    assert_eq!(lost.wait(LONG), Err(AnswerError::Ended(EndReason::ByRobot)));
    assert_eq!(client.ended(), Some(EndReason::ByRobot));
    assert_eq!(client.send("Home").unwrap_err(), AnswerError::Ended(EndReason::ByRobot));
    let ended = client.wait_until(LONG, |_| false);
    assert_eq!(ended, Err(AnswerError::Ended(EndReason::ByRobot)));
    assert_eq!(messages.wait_next(LONG).unwrap().unwrap().code, Code(3030));
    assert_eq!(messages.wait_next(LONG), Err(EndReason::ByRobot));
    client.reconnect().unwrap();
    assert_eq!(client.ended(), None);
    assert!(client.request("GetStatusRobot", LONG).is_ok());
}

#[test]
fn who_never_greets_is_no_robot() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let error = Client::connect(address, short()).unwrap_err();
    assert!(matches!(error, ConnectError::NoGreeting { .. }), "{error}");
    drop(listener);
    let error = Client::connect(address, short()).unwrap_err();
    assert!(matches!(error, ConnectError::Socket { .. }), "{error}");
}

#[test]
fn a_silent_robot_counts_as_gone() {
    let served = Served::start(ScriptedDevice::default());
    let silence_limit = Some(Duration::from_millis(200));
    let settings = ClientSettings { silence_limit, ..ClientSettings::default() };
    let client =
        Client::connect(served.endpoints.control, ClientOptions { settings, ..short() }).unwrap();
    // It is asked, and answers, as long as it lives.
    let asked = client.wait_until(LONG, |state| state.status.is_some());
    assert!(asked.is_ok());
    served.with(|server| server.device_mut().mute = true);
    let ended = client.wait_until(LONG, |_| false);
    assert_eq!(ended, Err(AnswerError::Ended(EndReason::Silent)));
}

#[test]
fn the_watchdog_is_fed() {
    let served = Served::start(ScriptedDevice::default());
    let watchdog = Some(Duration::from_millis(60));
    let settings = ClientSettings { watchdog, ..ClientSettings::default() };
    let _client =
        Client::connect(served.endpoints.control, ClientOptions { settings, ..short() }).unwrap();
    let fed = (0..1_000).any(|_| {
        std::thread::sleep(Duration::from_millis(5));
        served.commands().iter().filter(|line| *line == "-ConnectionWatchdog(0.06)").count() > 5
    });
    assert!(fed);
}

#[test]
fn monitors_hear_everything_from_the_beginning_and_say_nothing() {
    let interval = Some(fieldarm::time::Duration::from_millis(2));
    let served = Served::start(ScriptedDevice { interval, ..ScriptedDevice::default() });
    let monitor = Monitor::connect(served.endpoints.monitoring, LONG).unwrap();
    for code in [2007, 2095, 2230, 2230] {
        let message = monitor.messages().wait_next(LONG).unwrap().unwrap();
        assert_eq!(message.code, Code(code));
    }
    assert!(monitor.state().timestamp_us.is_some());
    assert_eq!((monitor.messages().missed(), monitor.ended()), (0, None));
    served.with(|server| server.device_mut().is_on_text = false);
    let ended = (0..100_000).find_map(|_| monitor.messages().wait_next(LONG).err());
    assert_eq!(ended, Some(EndReason::ByRobot));
    assert_eq!(served.counts().received, 0);
    assert!(served.commands().is_empty());
}

#[test]
fn many_threads_may_ask_at_once() {
    let served = Served::start(ScriptedDevice::default());
    let client = connect(&served);
    std::thread::scope(|scope| {
        for thread in 0..4_u16 {
            let client = &client;
            scope.spawn(move || {
                for round in 0..100_u16 {
                    let number = thread * 1_000 + round + 1;
                    client.checkpoint(number).unwrap().wait(LONG).unwrap();
                    assert_eq!(client.request("Delay(0.1)", LONG), Ok(Reply::Accepted));
                }
            });
        }
    });
    assert_eq!(served.commands().len(), 4 * 100 * 3);
}
