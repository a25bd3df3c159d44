//! Every command of the table that sets something: what it sets is in force, and lasts as long as the
//! table's column of persistence and the manual's chapter on default values say (PM L457): settings of
//! motion until the motors go off, others until the power does, persistent ones for ever.

use fieldarm::sim::meca500::FittedTool;
use fieldarm::text_device::TextDevice;

use crate::desk::{Desk, code, codes, content};
use crate::table::{Row, arguments, rows};

/// How what a command set is seen.
enum Seen {
    /// A request, whose content is as set.
    Asked(String),
    /// A request, one of whose answers has this index where there are more.
    First(String),
    /// Message of the snapshot with this code, or another.
    Told(u16),
    /// Whether a message with this code comes after a short move.
    Heard(u16),
}

/// Settings that are seen elsewhere.
const ELSEWHERE: [(&str, &str); 3] = [
    ("SetOfflineProgramLoop", "belongs to a program: `programs`"),
    ("SetValveState", "the state of a tool, and no setting: `table`"),
    ("SetVariable", "has a test of its own here and in `variables`"),
];

fn seen(row: &Row, names: &[Row]) -> Option<Seen> {
    let name = row["name"].as_str();
    Some(match name {
        "EnableEtherNetIp" => Seen::Asked("GetEthernetIpEnabled".into()),
        "EnableProfinet" => Seen::Asked("GetProfinetEnabled".into()),
        "SetNetworkOptions" => Seen::First("GetNetworkOptions".into()),
        "SetJointLimits" => Seen::Asked("GetJointLimits(2)".into()),
        "SetRecoveryMode" => Seen::Told(2049),
        "SetEob" => Seen::Heard(3012),
        "SetEom" => Seen::Heard(3004),
        "SetCtrlPortMonitoring" => Seen::Heard(2230),
        _ => {
            let request = format!("Get{}", name.strip_prefix("Set")?);
            names.iter().find(|other| other["name"] == request)?;
            Seen::Asked(request)
        }
    })
}

/// Arguments that differ from the defaults, by the table; by hand where it has no numbers.
fn other_than_default(row: &Row) -> Vec<String> {
    let by_hand = match row["name"].as_str() {
        "SetRobotName" => "left-1",
        "SetRealTimeMonitoring" => "2200,2210",
        "SetJointLimits" => "2,-30,40",
        "SetExtToolSim" => "20",
        "SetGripperRange" => "1,4",
        "SetRtc" => "2000000000",
        // With the arm inside, or it cannot be homed.
        "SetWorkZoneLimits" => "-900,-800,-700,900,800,700",
        _ => "",
    };
    if !by_hand.is_empty() {
        return by_hand.split(',').map(str::to_owned).collect();
    }
    let number = |(position, argument): (usize, &serde_json::Value)| {
        let unit = argument["unit"].as_str().unwrap_or_default();
        let default = argument["default"].as_f64();
        if let Some(choices) = unit.strip_prefix("enum{") {
            let numbers = choices.trim_end_matches('}').split(',').map(|choice| {
                choice
                    .split('=')
                    .next()
                    .and_then(|number| number.trim().parse::<f64>().ok())
                    .unwrap()
            });
            return numbers.filter(|number| Some(*number) != default).last().unwrap().to_string();
        }
        let bound = |key: &str| argument[key].as_f64();
        // Where the revisions differ the lower one will do.
        let by_revision =
            || argument["max"].as_str()?.split(['R', '3', ':', ';']).nth(3)?.parse().ok();
        match (bound("min"), bound("max").or_else(by_revision)) {
            (Some(min), Some(max)) => {
                let middle = min + (max - min) / 4.0;
                if unit.starts_with("integer") { middle.round() } else { middle }.to_string()
            }
            _ => (10.0 + 1.5 * position as f64).to_string(),
        }
    };
    arguments(row).iter().enumerate().map(number).collect()
}

fn same(one: &str, other: &str) -> bool {
    let values = |text: &str| -> Option<Vec<f64>> {
        text.split(',').map(|value| value.trim().parse().ok()).collect()
    };
    match (values(one), values(other)) {
        (Some(one), Some(other)) => {
            let near = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-6 * b.abs();
            one.len() == other.len() && one.iter().zip(&other).all(near)
        }
        _ => one == other,
    }
}

/// What is in force now.
fn read(desk: &mut Desk, seen: &Seen) -> String {
    desk.heard();
    match seen {
        Seen::Asked(request) => content(&desk.ask(request)).to_owned(),
        Seen::First(request) => {
            content(&desk.ask(request)).split(',').next().unwrap_or_default().to_owned()
        }
        Seen::Told(wanted) => {
            let mut is_told = false;
            let now = desk.now;
            desk.robot.monitoring_snapshot(now, &mut |message| is_told |= code(message) == *wanted);
            u8::from(is_told).to_string()
        }
        Seen::Heard(wanted) => {
            desk.say("MoveJointsRel(0,0,0,0,0,0.5)");
            let heard = codes(&desk.listen_ms(500));
            u8::from(heard.contains(wanted)).to_string()
        }
    }
}

fn deactivate(desk: &mut Desk) {
    desk.say("DeactivateRobot");
    desk.until(2004);
    desk.heard();
}

fn cut_power_for_a_moment(desk: &mut Desk) {
    desk.robot.panel().switch_off();
    desk.wait_ms(100);
    desk.robot.panel().switch_on();
    desk.wait_ms(6_000);
    desk.robot.panel().press_reset();
    desk.wait_ms(10);
    desk.heard();
    desk.bring_up();
}

#[test]
fn what_is_set_is_in_force_and_lasts_as_long_as_the_table_says() {
    let rows = rows();
    let is_setter = |row: &&Row| {
        let name = row["name"].as_str();
        (name.starts_with("Set") || name.starts_with("Enable")) && row["meca500_available"] != "no"
    };
    let mut checked = 0;
    let mut problems = Vec::new();
    let ready = Desk::ready_with(|settings| settings.tool = FittedTool::Megp25E);
    for row in rows.iter().filter(is_setter) {
        let name = row["name"].as_str();
        if ELSEWHERE.iter().any(|(other, _)| *other == name) {
            continue;
        }
        let Some(seen) = seen(row, &rows) else {
            problems.push(format!("{name}: nothing shows what it sets"));
            continue;
        };
        let mut desk = ready.clone();
        let mut check = |when: &str, found: String, wanted: &str| {
            let is_clock = name == "SetRtc" && !wanted.is_empty();
            let as_clock = |text: &str| text.parse::<f64>().unwrap_or(f64::NAN);
            let is_right = match is_clock {
                true => (0.0..60.0).contains(&(as_clock(&found) - as_clock(wanted))),
                false => same(&found, wanted),
            };
            if !is_right {
                problems.push(format!("{name} {when}: {found}, not {wanted}"));
            }
        };
        let default = read(&mut desk, &seen);
        let listed: Option<Vec<String>> = arguments(row)
            .iter()
            .map(|argument| match &argument["default"] {
                serde_json::Value::Number(number) => Some(number.to_string()),
                serde_json::Value::String(text) if name == "SetRobotName" => Some(text.clone()),
                _ => None,
            })
            .collect();
        if let Some(listed) = listed.filter(|list| !list.is_empty()) {
            check("at first", default.clone(), &listed.join(","));
        }
        let wanted = other_than_default(row).join(",");
        let needs_rest = row["allowed_state"] == "deactivated" || name == "SetExtToolSim";
        if needs_rest {
            deactivate(&mut desk);
        }
        if name == "SetJointLimits" {
            // The limits in force are asked for.
            desk.say("SetJointLimitsCfg(1)");
        }
        let answers = desk.say(&format!("{name}({wanted})"));
        if answers.iter().any(|answer| code(answer) < 2000) {
            problems.push(format!("{name}({wanted}): {answers:?}"));
            continue;
        }
        desk.wait_ms(20);
        check("when set", read(&mut desk, &seen), &wanted);
        if matches!(seen, Seen::Heard(2230)) {
            // Its copies are in the way of everything that is waited for by its code.
            desk.say("SetCtrlPortMonitoring(0)");
        }
        if !needs_rest {
            deactivate(&mut desk);
            desk.bring_up();
            let is_of_motion = row["queued_or_instant"].starts_with("queued");
            // The last checkpoint is history, and SetCtrlPortMonitoring was taken back.
            let is_kept = !is_of_motion || name == "SetCheckpoint";
            let is_taken_back = name == "SetCtrlPortMonitoring";
            let left = if is_kept && !is_taken_back { &wanted } else { &default };
            check("after deactivation", read(&mut desk, &seen), left);
        }
        cut_power_for_a_moment(&mut desk);
        let is_persistent = row["persistent"].starts_with("yes");
        let left = if is_persistent { &wanted } else { &default };
        check("after a power cycle", read(&mut desk, &seen), left);
        checked += 1;
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
    assert!(checked > 40, "{checked}");
}
