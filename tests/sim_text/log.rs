//! The robot's user log: LogTrace, LogUserCommands, and what a dash keeps out of it.

use fieldarm::sim::meca500::{LogKind, LogLine};

use crate::desk::{Desk, codes};

fn lines(desk: &mut Desk) -> Vec<(LogKind, String)> {
    std::iter::from_fn(|| desk.robot.next_log_line()).map(|line| (line.kind, line.text)).collect()
}

#[test]
fn traces_are_logged_with_the_time_of_the_robot() {
    let mut desk = Desk::connected();
    desk.say("SetRtc(2000000000)");
    desk.wait_ms(3_000);
    assert_eq!(
        desk.ask("LogTrace(here it stops)"),
        "[2085][Command successful: 'LogTrace(here it stops)'.]"
    );
    assert_eq!(codes(&desk.say("-LogTrace(\"quietly, too\")")), [2085]);
    assert_eq!(
        codes(&desk.say(r#"-LogTrace({"data": {"trace": "as JSON", "traceId": 1}})"#)),
        [2085]
    );
    let line =
        LogLine { unix_s: 2_000_000_003, kind: LogKind::Trace, text: "here it stops".into() };
    assert_eq!(desk.robot.next_log_line(), Some(line));
    let others = [(LogKind::Trace, "quietly, too".into()), (LogKind::Trace, "as JSON".into())];
    assert_eq!(lines(&mut desk), others);
}

#[test]
fn commands_and_responses_are_logged_while_asked_for() {
    let mut desk = Desk::connected();
    desk.say("GetRobotName");
    assert!(lines(&mut desk).is_empty());
    desk.say("LogUserCommands(1,0)");
    desk.say(" GetRobotName() ");
    desk.say("-GetRobotName");
    desk.say("Nonsense(1)");
    desk.say("LogUserCommands(0,0)");
    desk.say("GetRobotName");
    let received = |text: &str| (LogKind::Received, text.to_owned());
    let sent = |text: &str| (LogKind::Sent, text.to_owned());
    let refusal = "[1001][Empty command or command unrecognized. - Command: 'Nonsense(1)']";
    assert_eq!(
        lines(&mut desk),
        [
            // It is on when it is answered, and off when its end is.
            sent("[2085][Command successful: 'LogUserCommands(1,0)'.]"),
            received("GetRobotName()"),
            sent("[2095][m500]"),
            received("Nonsense(1)"),
            sent(refusal),
            received("LogUserCommands(0,0)"),
        ]
    );
}

#[test]
fn copies_of_the_monitoring_port_are_no_responses() {
    let mut desk = Desk::connected();
    desk.say("SetCtrlPortMonitoring(1)");
    desk.say("LogUserCommands(1,1)");
    lines(&mut desk);
    desk.listen_ms(500);
    assert!(lines(&mut desk).is_empty());
}

#[test]
fn the_beginning_of_queued_commands_is_logged_when_their_turn_comes() {
    let mut desk = Desk::ready();
    desk.say("LogUserCommands(0,1)");
    desk.say("MoveJoints(5,0,0,0,0,0)");
    desk.say("Delay(0.5)");
    desk.say("SetJointVel(30)");
    desk.say("-MoveLinRelTrf(1,0,0,0,0,0)");
    desk.wait_ms(2);
    let begins = |text: &str| (LogKind::Begins, text.to_owned());
    assert_eq!(lines(&mut desk), [begins("MoveJoints(5,0,0,0,0,0)")]);
    desk.wait_ms(400);
    assert_eq!(lines(&mut desk), [begins("Delay(0.5)")]);
    desk.until(3012);
    let rest = [begins("SetJointVel(30)"), begins("MoveLinRelTrf(1,0,0,0,0,0)")];
    assert_eq!(lines(&mut desk), rest);
    desk.say("LogUserCommands(0,0)");
    desk.say("MoveJoints(0,0,0,0,0,0)");
    desk.until(3012);
    assert!(lines(&mut desk).is_empty());
}

#[test]
fn a_boot_ends_the_logging_and_nobody_who_reads_is_bounded() {
    let mut desk = Desk::connected();
    desk.say("LogUserCommands(1,1)");
    desk.say("RebootRobot");
    desk.wait_ms(6_000);
    desk.heard();
    lines(&mut desk);
    desk.say("GetRobotName");
    assert!(lines(&mut desk).is_empty());
    let long = "x".repeat(1_000);
    for number in 0..10_000 {
        desk.say(&format!("LogTrace({number} {long})"));
    }
    let kept = lines(&mut desk);
    assert_eq!(kept.len(), 4_096);
    let (_, last) = kept.last().unwrap();
    assert!(last.starts_with("9999 xxx") && last.len() == 256);
}
