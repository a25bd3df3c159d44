//! The monitoring port: what a new connection is told, what changes, what is periodic.

use fieldarm::sim::meca500::FittedTool;
use fieldarm::text_device::TextDevice;
use fieldarm::time::Duration;

use crate::desk::{Desk, code, codes, content, values};

fn snapshot(desk: &mut Desk) -> Vec<String> {
    let mut messages = Vec::new();
    desk.robot.monitoring_snapshot(desk.now, &mut |message| messages.push(message.to_owned()));
    messages
}

#[test]
fn a_new_connection_is_told_everything_once() {
    let mut desk = Desk::ready_with(|settings| settings.tool = FittedTool::Megp25E);
    let told = snapshot(&mut desk);
    let mut seen = codes(&told);
    assert_eq!(seen[..4], [3000, 2082, 2095, 2007]);
    for wanted in [
        2015, 2050, 2079, 2086, 2163, 2165, 2167, 2181, 2182, 2183, 2189, 2208, 2209, 2227, 2300,
        2320, 3028, 3032, 3070, 3083, 3084, 3086,
    ] {
        assert!(seen.contains(&wanted), "{wanted} in {seen:?}");
    }
    let count = seen.len();
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), count);
    assert!(told.contains(&"[2082][11.3.84.0-official]".to_owned()));
    assert!(told.contains(&"[2165][-10000,-10000,-10000,10000,10000,10000]".to_owned()));
    assert!(
        told.iter().all(|message| code(message) == 3000
            || !message.contains(' ')
            || code(message) == 2050)
    );
}

#[test]
fn positions_come_every_fifteen_milliseconds_and_end_with_a_mark() {
    let mut desk = Desk::ready();
    desk.wait_ms(300);
    desk.heard();
    let codes = codes(&std::mem::take(&mut desk.monitored));
    assert_eq!(codes.len(), 60, "{codes:?}");
    assert!(codes.chunks(3).all(|cycle| cycle == [2026, 2027, 2230]));
    assert_eq!(desk.ask("GetJoints"), "[2026][0.0000,0.0000,0.0000,0.0000,0.0000,0.0000]");
    assert!(desk.ask("GetPose").starts_with("[2027][190.0000,"));
}

#[test]
fn the_interval_is_kept_however_the_caller_steps() {
    let mut desk = Desk::connected();
    assert_eq!(codes(&desk.say("SetMonitoringInterval(0.1)")), [2085]);
    assert_eq!(desk.ask("GetMonitoringInterval"), "[2116][0.1]");
    let begin = values(&desk.ask("GetRtTargetJointPos"))[0];
    desk.now += Duration::from_millis(1050);
    TextDevice::advance(&mut desk.robot, desk.now);
    let marks = desk.monitored(2230);
    assert_eq!(marks.len(), 10);
    for (index, mark) in marks.iter().enumerate() {
        let wanted = begin + 100_000.0 * (index + 1) as f64;
        assert_eq!(values(mark), [wanted], "{mark}");
    }
    // An hour in one step leaves out cycles rather than filling the memory.
    desk.now += Duration::from_secs(36_000);
    TextDevice::advance(&mut desk.robot, desk.now);
    assert!(desk.monitored(2230).len() <= 20_001);
}

#[test]
fn optional_messages_are_those_last_asked_for() {
    let mut desk = Desk::ready();
    assert_eq!(desk.ask("SetRealTimeMonitoring(All)").split(',').count(), 17);
    let heard = desk.ask("SetRealTimeMonitoring(cartpos, 2200, Conf)");
    assert_eq!(heard, "[2117][2200,2211,2218]");
    assert_eq!(desk.ask("GetRealTimeMonitoring"), heard);
    assert_eq!(codes(&desk.say("SetRealTimeMonitoring(2999)")), [1003]);
    desk.heard();
    desk.monitored.clear();
    desk.wait_ms(45);
    desk.heard();
    let seen = codes(&std::mem::take(&mut desk.monitored));
    // The configuration is told once, since it does not change.
    let cycle = [2026, 2027, 2200, 2211, 2230];
    assert_eq!(seen[..6], [2026, 2027, 2200, 2211, 2218, 2230]);
    assert_eq!(seen[6..], [cycle, cycle].concat());
    assert_eq!(desk.ask("SetRealTimeMonitoring()"), "[2117][]");
}

#[test]
fn copies_on_the_control_port_begin_with_the_state_and_repeat_no_answer() {
    let mut desk = Desk::ready();
    let heard = desk.say("SetCtrlPortMonitoring(1)");
    assert_eq!(heard[0], "[2096][Monitoring on control port enabled]");
    assert!(codes(&heard).contains(&2007) && !codes(&heard).contains(&3000));
    let heard = desk.listen_ms(15);
    assert_eq!(codes(&heard), [2026, 2027, 2230]);
    // Answered and changed at once: told once here.
    assert_eq!(codes(&desk.say("SetTimeScaling(50)")), [2015]);
    assert_eq!(codes(&desk.say("SetRecoveryMode(1)")), [2049]);
    assert_eq!(desk.monitored(2015), ["[2015][50]"]);
    let heard = desk.say("PauseMotion");
    assert_eq!(heard, ["[2042][Motion paused.]", "[2007][1,1,0,0,1,1,1]"]);
    assert_eq!(codes(&desk.say("SetCtrlPortMonitoring(0)")), [2096]);
    assert!(desk.listen_ms(100).is_empty());
}

#[test]
fn copies_end_with_the_connection() {
    let mut desk = Desk::connected();
    desk.say("SetCtrlPortMonitoring(1)");
    desk.robot.close_control(desk.now);
    assert!(desk.robot.open_control(desk.now));
    assert_eq!(codes(&desk.listen_ms(100)), [3000]);
}

#[test]
fn changes_are_told_when_they_happen() {
    let mut desk = Desk::connected();
    for (line, message) in [
        ("SetWorkZoneCfg(1,2)", "[2163][1,2]"),
        ("SetWorkZoneLimits(-500,-500,-500,500,500,500)", "[2165][-500,-500,-500,500,500,500]"),
        ("SetToolSphere(0,0,20.5,5)", "[2167][0,0,20.5,5]"),
        ("SetCollisionCfg(0)", "[2181][0]"),
        ("SetRobotName(arm-7)", "[2095][arm-7]"),
    ] {
        assert_eq!(desk.say(line).len(), 1, "{line}");
        assert_eq!(desk.monitored(code(message)), [message]);
    }
    desk.bring_up();
    desk.say("SetMoveMode(1)");
    desk.wait_ms(3);
    assert_eq!(desk.monitored(2189), ["[2189][1]"]);
    desk.say("SetCheckpoint(12)");
    desk.wait_ms(3);
    let reached = desk.monitored(2227);
    assert_eq!(values(&reached[0])[1], 12.0);
    desk.say("MoveJoints(0,0,0,0,-20,200)");
    desk.until(3012);
    desk.heard();
    let told = std::mem::take(&mut desk.monitored);
    let turns: Vec<_> = told.iter().filter(|message| code(message) == 2209).collect();
    assert_eq!(turns.len(), 1);
    assert_eq!(values(turns[0])[1], 1.0);
    let mut confs = told.iter().filter(|message| code(message) == 2208);
    assert!(confs.next_back().unwrap().ends_with(",1,1,-1]"));
}

#[test]
fn torque_and_work_zone_events_are_told_with_the_state() {
    let mut desk = Desk::connected();
    desk.say("SetWorkZoneCfg(4,1)");
    desk.say("SetWorkZoneLimits(-500,-100,-500,500,100,500)");
    desk.bring_up();
    desk.say("MoveJoints(60,0,0,0,0,0)");
    let heard = desk.until(3049);
    assert_eq!(codes(&heard), [3049]);
    desk.wait_ms(10);
    assert_eq!(desk.monitored(2183), ["[2183][1,1,0]"]);
    assert_eq!(desk.ask("GetWorkZoneStatus"), "[2183][1,1,0]");
    let mut desk = Desk::ready();
    desk.say("SetTorqueLimits(50,50,50,50,50,50)");
    desk.say("SetTorqueLimitsCfg(4,1)");
    desk.until(3012);
    desk.robot.panel().push_joint(1, 80.0);
    let heard = desk.until(3029);
    assert_eq!(codes(&heard), [3029]);
    desk.heard();
    assert_eq!(content(&desk.ask("GetTorqueLimitsStatus")), "1");
}
