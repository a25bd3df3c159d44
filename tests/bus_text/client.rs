//! The PC's end: which answer belongs to which command.

use fieldarm::bus::text::client::{
    ClientSession, ClientSettings, Incoming, Outcome, Phase, RequestId, SubmitError,
};
use fieldarm::time::{Duration, Instant};
use fieldarm::wire::meca500::code::Code;
use proptest::prelude::*;

type Session = ClientSession<8, 8192>;

fn ready(settings: ClientSettings) -> Session {
    let mut session = Session::new(settings);
    session.connected(Instant::ZERO);
    assert_eq!(session.phase(), Phase::Greeting);
    hear(&mut session, "[3000][Connected to Meca500 R3 v11.3.84]");
    assert_eq!(session.phase(), Phase::Ready);
    session
}

type Ends = Vec<Option<(RequestId, Outcome)>>;

/// What messages mean, and up to where silent requests are accepted.
fn hear_all(session: &mut Session, now: Instant, text: &str) -> (Ends, Option<RequestId>) {
    let stream = text.replace('|', "\0") + "\0";
    let mut bytes = stream.as_bytes();
    let (mut ends, mut accepted) = (Vec::new(), None);
    while let Some(incoming) = session.receive(now, &mut bytes) {
        match incoming {
            Incoming::Message(received) => {
                ends.push(received.ends);
                accepted = received.accepts_before.or(accepted);
            }
            Incoming::Unreadable(_) => ends.push(None),
        }
    }
    (ends, accepted)
}

fn hear(session: &mut Session, text: &str) -> Ends {
    hear_all(session, Instant::ZERO, text).0
}

fn sent(session: &mut Session) -> String {
    let bytes = session.waiting().to_vec();
    session.sent(bytes.len());
    String::from_utf8(bytes).unwrap()
}

#[test]
fn answers_find_their_commands_by_their_codes() {
    let mut session = ready(ClientSettings::default());
    let activate = session.submit("ActivateRobot").unwrap();
    let name = session.submit("GetRobotName()").unwrap();
    let first = session.submit("LogTrace(a)").unwrap();
    let second = session.submit(" - LogTrace (b)").unwrap();
    assert_eq!(sent(&mut session), "ActivateRobot\0GetRobotName()\0LogTrace(a)\0 - LogTrace (b)\0");
    let answered = |id| Some((id, Outcome::Answered));
    assert_eq!(
        hear(&mut session, "[2095][m500]|[2085][Command successful.]|[2007][0,0,0,0,0,1,1]"),
        [answered(name), answered(first), None]
    );
    assert_eq!(
        hear(&mut session, "[2085][Command successful.]|[2000][Motors activated.]|[2000][x]"),
        [answered(second), answered(activate), None]
    );
    assert_eq!(session.pending().count(), 0);
}

#[test]
fn errors_find_their_commands_by_the_quote_or_by_what_may_fail() {
    let mut session = ready(ClientSettings::default());
    let refused = |id, code| Some((id, Outcome::Refused(code)));
    let blending = session.submit("SetBlending(500)").unwrap();
    let status = session.submit("GetStatusRobot").unwrap();
    let home = session.submit("Home").unwrap();
    let wrong = session.submit("GetFoo()").unwrap();
    assert_eq!(
        hear(&mut session, "[1003][Argument error. - Command: 'SetBlending(500)']"),
        [refused(blending, Code::ARGUMENT_ERROR)]
    );
    assert_eq!(
        hear(&mut session, "[1001][Empty command or command unrecognized. - Command: 'GetFoo()']"),
        [refused(wrong, Code::UNKNOWN_COMMAND)]
    );
    // The state can be asked for in any state, so this is about homing.
    assert_eq!(
        hear(&mut session, "[1005][The robot is not activated.]|[3005][Error of motion.]"),
        [refused(home, Code::NOT_ACTIVATED), None]
    );
    assert_eq!(session.state().error, Some(Code::MOTION_ERROR));
    let motion = session.submit("MoveJoints(0,0,0,0,0,0)").unwrap();
    assert_eq!(
        hear(&mut session, "[1011][The robot is in error.]"),
        [refused(status, Code::IN_ERROR)]
    );
    assert_eq!(
        hear(&mut session, "[1006][The robot is not homed.]"),
        [refused(motion, Code::NOT_HOMED)]
    );
    hear(&mut session, "[2005][The error was reset.]");
    assert_eq!(session.state().error, None);
}

#[test]
fn a_sync_accepts_what_came_before_it() {
    let mut session = ready(ClientSettings::default());
    let other = session.submit("SyncCmdQueue(77)").unwrap();
    for _ in 0..3 {
        session.submit("MoveJoints(0,0,0,0,0,0)").unwrap();
    }
    let sync = session.submit_sync().unwrap();
    let late = session.submit("Delay(1)").unwrap();
    assert!(sent(&mut session).ends_with("SyncCmdQueue(1)\0Delay(1)\0"));
    let (ends, accepted) = hear_all(&mut session, Instant::ZERO, "[2097][5]|[2097][1]");
    assert_eq!(ends, [None, Some((sync, Outcome::Answered))]);
    assert_eq!(accepted, Some(sync));
    assert_eq!(session.pending().collect::<Vec<_>>(), [other, late]);
}

#[test]
fn a_checkpoint_ends_by_its_number_and_accepts_what_came_before_it() {
    let mut session = ready(ClientSettings::default());
    session.submit("MoveJoints(0,0,0,0,0,0)").unwrap();
    let first = session.submit("SetCheckpoint(1)").unwrap();
    let variable = session.submit("GetVariable(a)").unwrap();
    let motion = session.submit("Delay(1)").unwrap();
    let second = session.submit("SetCheckpoint( 2 )").unwrap();
    let third = session.submit("-SetCheckpoint(2)").unwrap();
    // About a variable, not about motion.
    assert_eq!(
        hear(&mut session, "[1551][Variable a does not exist]"),
        [Some((variable, Outcome::Refused(Code::GET_VARIABLE_FAILED)))]
    );
    let (ends, accepted) = hear_all(&mut session, Instant::ZERO, "[3030][3]|[3030][1]");
    assert_eq!((ends, accepted), (vec![None, Some((first, Outcome::Answered))], Some(first)));
    assert_eq!(
        hear(&mut session, "[1016][Out of reach.]|[3040][2]|[3030][2]"),
        [
            Some((motion, Outcome::Refused(Code::OUT_OF_REACH))),
            Some((second, Outcome::Discarded)),
            Some((third, Outcome::Answered))
        ]
    );
    assert_eq!(session.pending().count(), 0);
}

#[test]
fn commands_of_no_table_have_the_answers_that_the_caller_names() {
    let mut session = ready(ClientSettings::default());
    let id = session.submit_expecting("GetFwVersionFull", &[Code(2082)]).unwrap();
    assert_eq!(hear(&mut session, "[2082][11.3.84]"), [Some((id, Outcome::Answered))]);
}

#[test]
fn what_cannot_be_a_command_is_refused_here() {
    let mut session = Session::new(ClientSettings::default());
    assert_eq!(session.submit("Home"), Err(SubmitError::NotConnected));
    let mut session = ready(ClientSettings::default());
    assert_eq!(session.submit(" "), Err(SubmitError::Empty));
    assert_eq!(session.submit("Home\0Home"), Err(SubmitError::NotAscii { offset: 4 }));
    assert_eq!(session.submit("LogTrace(ä)"), Err(SubmitError::NotAscii { offset: 9 }));
    let long = format!("LogTrace({})", "x".repeat(5_000));
    assert_eq!(session.submit(&long), Err(SubmitError::TooLong { len: 5_010 }));
    let line = format!("LogTrace({})", "x".repeat(4_000));
    session.submit(&line).unwrap();
    session.submit(&line).unwrap();
    assert_eq!(session.submit(&line), Err(SubmitError::OutboxFull));
    assert_eq!(session.pending().count(), 2);
    assert_eq!(sent(&mut session).len(), 2 * (line.len() + 1));
}

#[test]
fn requests_are_bounded_and_motion_makes_place() {
    let mut session = ready(ClientSettings::default());
    let motion = session.submit("Delay(1)").unwrap();
    for _ in 0..8 {
        session.submit("GetRobotName").unwrap();
    }
    assert!(session.pending().all(|id| id != motion));
    assert_eq!(session.submit("GetRobotName"), Err(SubmitError::Busy));
    hear(&mut session, "[2095][a]");
    assert!(session.submit("GetRobotName").is_ok());
}

#[test]
fn a_refused_connection_is_seen() {
    let mut session = Session::new(ClientSettings::default());
    session.connected(Instant::ZERO);
    hear(&mut session, "[3001][Another user is already connected, closing connection.]");
    assert_eq!(session.phase(), Phase::Refused(Code::ANOTHER_USER));
    session.disconnected();
    assert_eq!(session.phase(), Phase::Refused(Code::ANOTHER_USER));
    session.connected(Instant::ZERO);
    session.disconnected();
    assert_eq!(session.phase(), Phase::Closed);
}

#[test]
fn the_state_follows_the_messages() {
    let mut session = ready(ClientSettings::default());
    hear(
        &mut session,
        "[2007][1,1,2,0,1,0,0]|[2210][1500,1,2,3,4,5,6]|[2027][190,0,308,0,90,0]|[3030][7]|\
         [3040][8]|[3032][2]|[2079][1,1,1,0,0,0]|[2230][58675156984]|[2015][50]|[3070][300]|junk",
    );
    let state = session.state();
    let status = state.status.unwrap();
    assert!(status.is_activated && status.is_homed && status.is_paused);
    assert!(!status.is_in_error && !status.is_end_of_block && !status.is_end_of_motion);
    assert_eq!(status.simulation, 2);
    assert_eq!(state.joints, Some([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
    assert_eq!(state.pose, Some([190.0, 0.0, 308.0, 0.0, 90.0, 0.0]));
    assert_eq!((state.checkpoint_reached, state.checkpoint_discarded), (Some(7), Some(8)));
    assert_eq!((state.p_stop_2, state.e_stop), (Some(2), None));
    assert!(state.gripper.unwrap().is_holding);
    assert_eq!(state.timestamp_us, Some(58_675_156_984));
    assert_eq!(state.time_scaling, Some(50.0));
}

#[test]
fn the_watchdog_is_fed_and_a_silent_robot_is_asked() {
    let watchdog = Some(Duration::from_millis(300));
    let mut session = ready(ClientSettings { watchdog, ..ClientSettings::default() });
    assert_eq!(sent(&mut session), "-ConnectionWatchdog(0.3)\0");
    let mut text = String::new();
    for ms in 0..=1_000 {
        let now = Instant::from_millis(ms);
        let next = session.advance(now).unwrap();
        assert!(next > now && next <= now + Duration::from_millis(100));
        text += &sent(&mut session);
    }
    assert_eq!(text.matches("-ConnectionWatchdog(0.3)\0").count(), 10);
    assert_eq!(text.len(), 250);

    let mut session = ready(ClientSettings::default());
    for ms in 0..=10_000 {
        session.advance(Instant::from_millis(ms));
    }
    assert_eq!(sent(&mut session), "-GetStatusRobot\0".repeat(4));
    assert!(!session.is_silent(Instant::from_millis(10_000)));
    assert!(session.is_silent(Instant::from_millis(10_001)));
    hear_all(&mut session, Instant::from_millis(10_001), "[2007][0,0,0,0,0,1,1]");
    assert!(!session.is_silent(Instant::from_millis(20_001)));
}

proptest! {
    #[test]
    fn no_stream_makes_it_panic_or_forget_its_bounds(
        steps in prop::collection::vec((0_u8..6, "[ -~\\x00\\n]{0,30}"), 1..100),
    ) {
        let mut session = ready(ClientSettings::default());
        let codes = ["[2007]", "[1005]", "[2097]", "[2085]", "[1003]", "[3001]"];
        for (step, text) in steps {
            match step {
                0 => { let _ = session.submit(&text); }
                1 => { let _ = session.submit_sync(); }
                2 => { let _ = session.submit("Delay(1)"); }
                _ => {
                    let code = codes[text.len() % codes.len()];
                    hear(&mut session, &format!("{code}[{text}]"));
                }
            }
            let ids: Vec<_> = session.pending().collect();
            prop_assert!(ids.len() <= 8 && ids.is_sorted());
        }
    }
}
