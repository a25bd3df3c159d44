//! Every command of `fixtures/spec/meca500_tcp_commands.csv`, with good, missing, excess and
//! out-of-range arguments, in each state of the robot, against the table's columns of responses,
//! errors and allowed states. What the table leaves out is in [`expected`], with the reason.

use std::collections::HashMap;

use fieldarm::sim::meca500::{FittedTool, RobotSettings};
use fieldarm::text_device::TextDevice;
use fieldarm::wire::meca500::revision::Revision;
use serde_json::Value;

use crate::desk::{Desk, code, codes};

pub(crate) type Row = HashMap<String, String>;

pub(crate) fn rows() -> Vec<Row> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/spec/meca500_tcp_commands.csv");
    csv::Reader::from_path(path).unwrap().deserialize().map(Result::unwrap).collect()
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Deactivated,
    Activated,
    Ready,
    Error,
    Paused,
    PStop2,
    EStop,
    Simulation,
    Recovery,
    Moving,
    Cleared,
    FastSimulation,
    /// P-Stop 2 as SetPStop2Cfg(2) has it.
    PStop2Pauses,
    /// Let go, and not reset.
    PStop2Released,
    EStopReleased,
    /// Booted, and the Reset button not pressed.
    Rebooted,
    /// The connection before was lost while the arm moved.
    Dropped,
}

const STATES: [State; 17] = [
    State::Deactivated,
    State::Activated,
    State::Ready,
    State::Error,
    State::Paused,
    State::PStop2,
    State::EStop,
    State::Simulation,
    State::Recovery,
    State::Moving,
    State::Cleared,
    State::FastSimulation,
    State::PStop2Pauses,
    State::PStop2Released,
    State::EStopReleased,
    State::Rebooted,
    State::Dropped,
];

impl State {
    fn desk(self) -> Desk {
        let mut desk = match self {
            Self::Deactivated
            | Self::Activated
            | Self::Simulation
            | Self::FastSimulation
            | Self::Recovery
            | Self::PStop2Pauses
            | Self::Rebooted => Desk::connected(),
            _ => Desk::ready(),
        };
        match self {
            Self::Deactivated | Self::Ready => {}
            Self::Activated => drop(desk.say("ActivateRobot")),
            Self::Error => drop(desk.say("MoveJoints(0,0,71,0,0,0)")),
            Self::Paused => drop(desk.say("PauseMotion")),
            Self::PStop2 => desk.robot.panel().press_p_stop2(),
            Self::EStop => desk.robot.panel().press_e_stop(),
            Self::Simulation | Self::FastSimulation => {
                let kind = if self == Self::Simulation { 1 } else { 2 };
                desk.say(&format!("ActivateSim({kind})"));
                desk.bring_up();
            }
            Self::Moving => begin_a_long_move(&mut desk),
            Self::Cleared => drop(desk.say("ClearMotion")),
            Self::PStop2Pauses => {
                desk.say("SetPStop2Cfg(2)");
                desk.bring_up();
                desk.robot.panel().press_p_stop2();
            }
            Self::PStop2Released => {
                desk.robot.panel().press_p_stop2();
                desk.wait_ms(500);
                desk.robot.panel().release_p_stop2();
            }
            Self::EStopReleased => {
                desk.robot.panel().press_e_stop();
                desk.wait_ms(500);
                desk.robot.panel().release_e_stop();
            }
            Self::Rebooted => {
                desk.say("RebootRobot");
                desk.wait_ms(6_000);
            }
            Self::Dropped => {
                begin_a_long_move(&mut desk);
                desk.wait_ms(500);
                desk.robot.close_control(desk.now);
                desk.wait_ms(500);
                assert!(desk.robot.open_control(desk.now));
            }
            Self::Recovery => {
                desk.say("SetRecoveryMode(1)");
                desk.say("ActivateRobot");
            }
        }
        desk.wait_ms(500);
        desk.heard();
        desk
    }

    fn motors_on(self) -> bool {
        !matches!(self, Self::Deactivated | Self::EStop | Self::EStopReleased | Self::Rebooted)
    }

    fn simulates(self) -> bool {
        matches!(self, Self::Simulation | Self::FastSimulation)
    }

    /// What keeps the robot from being ready for motion.
    fn not_ready(self) -> Option<u16> {
        match self {
            _ if !self.motors_on() => Some(1005),
            Self::Activated => Some(1006),
            _ => None,
        }
    }
}

fn begin_a_long_move(desk: &mut Desk) {
    desk.say("SetJointVel(1)");
    desk.say("MoveJoints(60,0,0,0,0,0)");
}

/// What a command is answered with at once, or after a while.
#[derive(Clone, Debug, PartialEq)]
enum Answer {
    Silence,
    Code(u16),
    /// Comes when something has been done.
    Later(u16),
}

pub(crate) fn arguments(row: &Row) -> Vec<Value> {
    match serde_json::from_str(&row["args_json"]) {
        Ok(Value::Array(list)) => list,
        _ => Vec::new(),
    }
}

/// Good arguments: by the table where a default or a bound will do, else by hand.
fn good(row: &Row) -> Vec<String> {
    let by_hand: &[&str] = match row["name"].as_str() {
        "CreateVariable" => &["a.b", "[1,2]", "10001", "0"],
        "DeleteVariable" | "GetVariable" => &["known"],
        "SetVariable" => &["known", "2.5"],
        "ConnectionWatchdog" => &["1"],
        "LogTrace" => &["hello"],
        "MoveJoints" => &["1", "2", "3", "4", "5", "6"],
        "SetJointLimits" => &["1", "-100", "100"],
        "SetRealTimeMonitoring" => &["2200", "CartPos"],
        "SetRobotName" => &["arm-1"],
        "SetRtc" => &["1700000000"],
        "StartProgram" => &["7"],
        "StartSaving" => &["7"],
        "SetToolSphere" => &["0", "0", "0", "10"],
        "GetSafetyStopStatus" => &["3070"],
        _ => &[],
    };
    if !by_hand.is_empty() {
        return by_hand.iter().map(|text| (*text).to_owned()).collect();
    }
    arguments(row)
        .iter()
        .map(|argument| {
            let numbers = ["default", "min"].into_iter().map(|key| &argument[key]);
            numbers.filter(|value| value.is_number()).map(Value::to_string).next()
        })
        .map(|number| number.unwrap_or_else(|| "1".to_owned()))
        .collect()
}

fn line(row: &Row, arguments: &[String]) -> String {
    format!("{}({})", row["name"], arguments.join(","))
}

/// Lowest and highest value of an argument by the table, on a robot of this revision.
fn range(argument: &Value, revision: Revision) -> [Option<f64>; 2] {
    let by_revision = |text: &str| {
        let mut parts = text.split(';').filter_map(|part| part.split_once(':'));
        let name = format!("{revision:?}");
        parts.find(|(of, _)| *of == name).and_then(|(_, number)| number.parse().ok())
    };
    ["min", "max"].map(|key| match &argument[key] {
        Value::String(text) => by_revision(text),
        number => number.as_f64(),
    })
}

/// The numbers that an argument is one of, if the table lists them.
fn choices(argument: &Value) -> Option<Vec<f64>> {
    let list = argument["unit"].as_str()?.strip_prefix("enum{")?.strip_suffix('}')?;
    let number = |choice: &str| choice.split('=').next()?.trim().parse().ok();
    list.split(',').map(number).collect()
}

fn is_integer(argument: &Value) -> bool {
    argument["unit"].as_str().is_some_and(|unit| unit.starts_with("integer"))
}

/// A number by the table, and no text.
fn is_number(argument: &Value) -> bool {
    let unit = argument["unit"].as_str().unwrap_or_default();
    !["string", "list of", "boolean"].iter().any(|kind| unit.contains(kind))
}

/// What an argument must not be: beyond either end by little, between the choices, no integer, no
/// number.
fn wrong_values(argument: &Value, revision: Revision) -> Vec<String> {
    if !is_number(argument) {
        return Vec::new();
    }
    let mut wrong: Vec<String> =
        ["x", "", "nan", "inf", "1e99", "'1'", "\"1\"", "--1", "0x1"].map(str::to_owned).to_vec();
    if let Some(choices) = choices(argument) {
        let near = choices.iter().flat_map(|choice| [choice - 1.0, choice + 1.0, choice + 0.5]);
        wrong.extend(near.filter(|near| !choices.contains(near)).map(|near| near.to_string()));
        return wrong;
    }
    let step = |bound: f64| if is_integer(argument) { 1.0 } else { 1e-4 * bound.abs().max(1.0) };
    let [min, max] = range(argument, revision);
    wrong.extend(min.map(|min| (min - step(min)).to_string()));
    wrong.extend(max.map(|max| (max + step(max)).to_string()));
    if is_integer(argument) {
        wrong.push("1.5".to_owned());
    }
    wrong
}

/// Lines whose arguments are wrong, each with what is wrong.
fn bad(row: &Row, revision: Revision) -> Vec<(&'static str, String)> {
    let name = row["name"].as_str();
    let declared = arguments(row);
    let good = good(row);
    let mut lines = Vec::new();
    let is_list = name == "SetRealTimeMonitoring";
    let is_optional = |argument: &Value| argument["optional"] == true;
    let needed = declared.iter().filter(|argument| !is_optional(argument)).count();
    if needed > 0 && !is_list {
        lines.push(("missing", line(row, &good[..needed - 1])));
    }
    if !is_list {
        let mut excess = good.clone();
        excess.push("1".to_owned());
        lines.push(("excess", line(row, &excess)));
    }
    let by_hand: &[&str] = match name {
        // Words in place of a number in the table.
        "MoveGripper" => &["-0.001", "48.001"],
        "SetRobotName" => &["-left", "a_b", "a b", "x23456789_123456789"],
        "StartProgram" => &["a b", "a.b"],
        "StartSaving" => &["0"],
        "SetRealTimeMonitoring" => &["2199", "2215", "JointPosition", "-2200", "2200.5"],
        "SetRtc" | "TcpDump" => &["-1", "4294967296", "1.5"],
        _ => &[],
    };
    let with = |position: usize, value: &str| {
        let mut changed = good.clone();
        changed[position] = value.to_owned();
        line(row, &changed)
    };
    lines.extend(by_hand.iter().map(|value| ("out of range", with(0, value))));
    if name == "SetRobotName" {
        lines.push(("too long", with(0, &"x".repeat(64))));
    }
    for (position, argument) in declared.iter().enumerate() {
        for value in wrong_values(argument, revision) {
            // Joints beyond their limits are an error of the move: 1007, in `sequences`.
            let is_judged_later =
                name == "MoveJoints" && value.parse::<f32>().is_ok_and(f32::is_finite);
            // An argument that is nothing is none where it is the only one.
            let is_left_out = value.is_empty() && good.len() == 1 && is_optional(argument);
            // Those the table asks another error for are in `variables`.
            let is_of_a_variable = name == "CreateVariable" && value.parse::<f64>().is_ok();
            // The client's checkpoints go on behind the manual's.
            let is_clients = name == "SetCheckpoint" && value == "8001";
            if !(is_judged_later || is_left_out || is_of_a_variable || is_clients) {
                lines.push(("out of range", with(position, &value)));
            }
        }
    }
    lines
}

/// Lines with an argument at either end of its range, and with each choice.
fn at_the_ends(row: &Row, revision: Revision) -> Vec<String> {
    let good = good(row);
    let mut lines = Vec::new();
    for (position, argument) in arguments(row).iter().enumerate() {
        let ends = range(argument, revision).into_iter().flatten().collect();
        for value in
            choices(argument).unwrap_or(if is_number(argument) { ends } else { Vec::new() })
        {
            let mut changed = good.clone();
            changed[position] = value.to_string();
            lines.push(line(row, &changed));
        }
    }
    lines
}

fn first_response(row: &Row) -> Answer {
    let text = &row["responses"];
    match text.get(1..5).and_then(|code| code.parse().ok()) {
        Some(code) => Answer::Code(code),
        None => Answer::Silence,
    }
}

/// What a good command is answered with in a state.
fn expected(row: &Row, state: State) -> Answer {
    let name = row["name"].as_str();
    let is_queued = row["queued_or_instant"].starts_with("queued");
    let allowed = row["allowed_state"].as_str();
    let has_tool = state.simulates();
    let is_without_power = matches!(state, State::EStop | State::EStopReleased | State::Rebooted);
    match name {
        "ActivateRobot" if is_without_power => Answer::Code(1013),
        "ActivateRobot" if state.motors_on() => Answer::Code(2000),
        "ActivateRobot" => Answer::Later(2000),
        "DeactivateRobot" if !state.motors_on() => Answer::Code(1005),
        "DeactivateRobot" => Answer::Later(2004),
        // After an E-Stop the homing is not lost.
        "Home" if matches!(state, State::Deactivated | State::Rebooted) => Answer::Code(1005),
        "Home" if !matches!(state, State::Activated | State::Recovery) => Answer::Code(2002),
        "Home" => Answer::Later(2002),
        "ResetError" if state == State::Error => Answer::Code(2005),
        "ResetError" => Answer::Code(2006),
        "ResumeMotion" if state == State::Error => Answer::Code(1011),
        "ResumeMotion" if matches!(state, State::PStop2 | State::PStop2Pauses) => {
            Answer::Code(1040)
        }
        "ActivateSim" | "DeactivateSim" if state.motors_on() => Answer::Code(1027),
        "ActivateSim" => Answer::Code(2046),
        // The cancelling one, and the one after the first, have answers of their own.
        "StartProgram" if state == State::Error => Answer::Code(1011),
        "StartProgram" if state.not_ready().is_none() => Answer::Code(3017),
        "StopSaving" | "SetOfflineProgramLoop" => Answer::Code(1022),
        // Table 2, not the chapter's misprint.
        "GetWrf" if state.not_ready().is_none() => Answer::Code(2013),
        "GetPStop2Cfg" => Answer::Code(2179),
        "GetSafetyStopStatus" => Answer::Code(3070),
        "SetRecoveryMode" => Answer::Code(2050),
        "SetEob" => Answer::Code(2054),
        "SetEom" => Answer::Code(2053),
        "SetExtToolSim" if state.motors_on() && has_tool => Answer::Code(1042),
        "GetRtGripperState" if !has_tool => Answer::Code(1038),
        "GetRtValveState" => Answer::Code(1041),
        "SetTimeScaling" if state == State::Error => Answer::Code(2015),
        "RebootRobot" if !state.motors_on() => Answer::Silence,
        "GetStatusGripper" | "GetJoints" | "GetPose" => first_response(row),
        "MoveGripper" if state == State::Recovery => Answer::Code(1006),
        _ if is_queued => match (state.not_ready(), state) {
            (Some(code), _) => Answer::Code(code),
            (None, State::Error) => Answer::Code(1011),
            (None, _) if name == "SetValveState" => Answer::Code(1041),
            (None, _) if row["errors"].contains("1038") && !has_tool => Answer::Code(1038),
            (None, State::PStop2 | State::PStop2Released) => Answer::Code(3032),
            (None, _) => Answer::Silence,
        },
        _ if allowed == "deactivated" && state.motors_on() => Answer::Code(1026),
        _ if allowed.starts_with("ready for motion") => match state.not_ready() {
            Some(code) => Answer::Code(code),
            None => first_response(row),
        },
        _ => first_response(row),
    }
}

#[test]
fn every_command_answers_as_the_table_says_in_every_state() {
    let rows = rows();
    let mut checked = 0;
    let mut problems = Vec::new();
    for state in STATES {
        let desk = state.desk();
        for row in rows.iter() {
            let mut desk = desk.clone();
            desk.robot.restore_variable(&known()).unwrap();
            let is_available = row["meca500_available"] != "no";
            let sent = line(row, &good(row));
            let heard = desk.say(&sent);
            let wanted = match is_available {
                true => expected(row, state),
                false => Answer::Code(1001),
            };
            let found = match (&wanted, heard.first()) {
                (Answer::Later(code), None) => {
                    desk.until(*code);
                    Answer::Later(*code)
                }
                (_, None) => Answer::Silence,
                (_, Some(message)) => Answer::Code(code(message)),
            };
            checked += 1;
            if found != wanted {
                problems.push(format!("{state:?} {sent}: {wanted:?} expected, {heard:?}"));
            }
        }
    }
    assert!(checked > 17 * 180, "{checked}");
    assert!(problems.is_empty(), "{} of {checked}:\n{}", problems.len(), problems.join("\n"));
}

fn known() -> fieldarm::sim::meca500::SavedVariable {
    let (name, value) = ("known".to_owned(), "1.5".to_owned());
    fieldarm::sim::meca500::SavedVariable { name, value, cyclic_id: 0 }
}

/// Fails with every line that is answered with anything but 1003, or changes a setting.
fn refuses<'a>(
    state: &str,
    desk: &Desk,
    lines: impl Iterator<Item = &'a (&'static str, String)>,
) -> u32 {
    let mut checked = 0;
    let mut problems = Vec::new();
    for (what, sent) in lines {
        let mut desk = desk.clone();
        let before = desk.robot.settings().clone();
        let heard = desk.say(sent);
        checked += 1;
        if codes(&heard) != [1003] {
            problems.push(format!("{state} {what}: {sent}: {heard:?}"));
        }
        if *desk.robot.settings() != before {
            problems.push(format!("{state} {what}: {sent} changed a setting"));
        }
    }
    assert!(problems.is_empty(), "{} of {checked}:\n{}", problems.len(), problems.join("\n"));
    checked
}

#[test]
fn bad_arguments_are_told_in_every_state() {
    let rows = rows();
    let available = || rows.iter().filter(|row| row["meca500_available"] != "no");
    // One of each kind in every state; all of them, for either revision, where that changes most.
    let mut few: Vec<_> = available().flat_map(|row| bad(row, Revision::R4)).collect();
    few.dedup_by_key(|(what, line)| (*what, line.split('(').next().map(str::to_owned)));
    for state in STATES {
        let checked = refuses(&format!("{state:?}"), &state.desk(), few.iter());
        assert!(checked > 300, "{checked}");
    }
    for revision in [Revision::R3, Revision::R4] {
        let all: Vec<_> = available().flat_map(|row| bad(row, revision)).collect();
        let with_revision = |settings: &mut RobotSettings| settings.revision = revision;
        for desk in [Desk::ready_with(with_revision), Desk::connected_with(with_revision)] {
            let mut desk = desk;
            desk.heard();
            let checked = refuses(&format!("{revision:?}"), &desk, all.iter());
            assert!(checked > 1_000, "{checked}");
        }
    }
}

#[test]
fn the_ends_of_every_range_are_within() {
    let rows = rows();
    let mut checked = 0;
    for revision in [Revision::R3, Revision::R4] {
        let with_revision = |settings: &mut RobotSettings| {
            settings.revision = revision;
            settings.tool = FittedTool::Megp25E;
        };
        let ready = Desk::ready_with(with_revision);
        let mut resting = Desk::connected_with(with_revision);
        resting.heard();
        for row in rows.iter().filter(|row| row["meca500_available"] != "no") {
            let needs_rest = row["allowed_state"] == "deactivated";
            for sent in at_the_ends(row, revision) {
                let mut desk = if needs_rest { resting.clone() } else { ready.clone() };
                desk.robot.restore_variable(&known()).unwrap();
                let heard = desk.say(&sent);
                // What is refused for another reason has been looked at.
                assert!(!codes(&heard).contains(&1003), "{revision:?} {sent}: {heard:?}");
                checked += 1;
            }
        }
    }
    assert!(checked > 250, "{checked}");
}

#[test]
fn lines_that_are_no_commands_have_their_codes() {
    let mut desk = Desk::connected();
    for (line, wanted) in [
        ("EnableJsonMode", 1001),
        ("homing()", 1001),
        ("home", 1001),
        ("(1)", 1001),
        ("   ", 1001),
        ("MoveJoints(1,2,3,4,5,6", 1002),
        ("MoveJoints 1,2,3", 1002),
        ("MoveJoints(1 2,3,4,5,6,7)", 1002),
        ("MoveJoints(1,2,3,4,5,x)", 1003),
        ("MoveJoints(1,,3,4,5,6)", 1003),
        ("SetJointVel(1e99)", 1003),
    ] {
        assert_eq!(codes(&desk.say(line)), [wanted], "{line}");
    }
    let message = desk.ask("Nonsense(1)");
    assert!(message.contains("Nonsense(1)"), "{message}");
}

#[test]
fn tools_answer_where_they_are_fitted() {
    let mut desk = Desk::ready_with(|settings| settings.tool = FittedTool::Mpm500);
    assert!(desk.say("SetValveState(1,*)").is_empty());
    desk.until(3012);
    assert!(desk.ask("GetRtValveState").ends_with(",1,0]"));
    assert_eq!(codes(&desk.say("MoveGripper(3)")), [1038]);
    let mut desk = Desk::ready_with(|settings| settings.tool = FittedTool::Megp25E);
    assert!(desk.say("GripperOpen").is_empty());
    desk.until(3012);
    desk.wait_ms(1000);
    let state = desk.ask("GetRtGripperState");
    assert!(state.ends_with(",0,1,0,1]"), "{state}");
    assert!(desk.ask("GetRtGripperPos").ends_with(",6.000000]"));
    assert_eq!(codes(&desk.say("MoveGripper(7)")), [1003]);
    assert_eq!(desk.ask("GetExtToolFwVersion"), "[2086][v11.3.84]");
    assert_eq!(desk.ask("GetStatusGripper"), "[2079][1,1,0,1,0,0]");
    assert_eq!(codes(&desk.say("GetRtValveState")), [1041]);
}
